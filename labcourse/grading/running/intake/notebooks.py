"""A student's notebook without what is not needed of it, and back: outputs, which make it large, are passed over.

They are passed over without being read into anything, so that a notebook with a hundred megabytes of outputs takes no
more memory than its file.
"""

from __future__ import annotations

import itertools
import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from labcourse.answers.handed_in import MAX_CELLS, TEXT, Cell, NotebookError, cells_of
from labcourse.grading.running.intake import limits
from labcourse.run.portability import Version, version

_KEPT = {b'"id"', b'"cell_type"', b'"source"', b'"metadata"'}
_PICTURES = b'"attachments"'
_SPACE = re.compile(rb"[ \t\r\n]*")
_STRING = re.compile(rb'"(?:[^"\\]++|\\.)*+"', re.DOTALL)
_PLAIN = re.compile(rb"[^\s,:\[\]{}\"]+")
_VERSION = re.compile(rb'"version"\s*:\s*"([\d.]+)')
_LONGEST_ABOUT = 2_000  # bytes of what Jupyter writes of the language
_MARK = re.compile(rb'"(?:[^"\\]++|\\.)*+"|[\[\]{}]', re.DOTALL)


def read(data: bytes) -> tuple[tuple[Cell, ...], list[str]]:
    """The cells of a notebook's file, and a word on each picture that was left out.

    Raises
    ------
    NotebookError
        If it is no notebook, or too large without its outputs.
    """
    if len(data) > limits.MAX_NOTEBOOK_FILE:
        raise NotebookError(f"it has more than {limits.MAX_NOTEBOOK_FILE} bytes.")
    problems = []
    if len(data) > limits.MAX_NOTEBOOK:
        scanner = _Scanner(_utf8(data))
        data = scanner.without_outputs()
        problems = scanner.problems
    cells = cells_of(data)
    # The text of some editors holds pictures.
    most = {TEXT: limits.MAX_PICTURES}
    if any(size > most.get(kind, limits.MAX_NOTEBOOK) for kind, size in _sizes(cells).items()):
        raise NotebookError(f"its cells have more than {limits.MAX_NOTEBOOK} bytes.")
    kept, left_out = _with_few_pictures(cells)
    return kept, [*problems, *left_out]


def saved_with(data: bytes) -> Version | None:
    """Return the Python that a notebook was saved with, which Jupyter writes behind its cells; None if it does not."""
    said = _VERSION.search(data.rpartition(b'"language_info"')[2][:_LONGEST_ABOUT])
    return version(said[1].decode()) if said else None


def _sizes(cells: Sequence[Cell]) -> Counter[str]:
    """Bytes of the cells of each kind."""
    found: Counter[str] = Counter()
    for cell in cells:
        found[cell.kind] += len(cell.source.encode())
    return found


def _utf8(data: bytes) -> bytes:
    coding = json.detect_encoding(data)
    if coding == "utf-8":
        return data
    try:
        return data.decode(coding).encode()
    except UnicodeError:
        raise NotebookError("it is not JSON (UnicodeError).") from None


def _with_few_pictures(cells: Sequence[Cell]) -> tuple[tuple[Cell, ...], list[str]]:
    kept, problems, size = [], [], 0
    for place, cell in enumerate(cells, 1):
        attachments = {}
        for name, content in cell.attachments.items():
            added = len(name) + sum(len(kind) + len(data) for kind, data in content.items())
            if size + added > limits.MAX_PICTURES:
                problems.append(
                    f"the picture {name!a:.80} in its cell {place} is left out: together, they are too large."
                )
            else:
                attachments[name] = content
                size += added
        kept.append(replace(cell, attachments=attachments))
    return tuple(kept), problems


def to_bytes(cells: Sequence[Cell]) -> bytes:
    """Cells as a notebook's file; :func:`~labcourse.answers.handed_in.cells_of` gives the same cells again."""
    return json.dumps({"cells": [_as_data(cell) for cell in cells]}, sort_keys=True, separators=(",", ":")).encode()


def _as_data(cell: Cell) -> dict[str, object]:
    metadata = {"nbgrader": {"grade_id": cell.grade_id}} if cell.grade_id else {}
    data: dict[str, object] = {"cell_type": cell.kind, "id": cell.id, "metadata": metadata, "source": cell.source}
    if cell.attachments:
        data["attachments"] = {name: dict(content) for name, content in cell.attachments.items()}
    return data


class _Scanner:
    """A notebook's text, gone through value by value."""

    def __init__(self, text: bytes) -> None:
        self._text = text
        self._place = 0
        self._marks = self._kept = self._pictures = 0
        self.problems: list[str] = []

    def without_outputs(self) -> bytes:
        """The notebook with its cells alone, and these with what counts of them."""
        cells: list[bytes] | None = None
        for key in self._members():
            if key == b'"cells"' and self._at(b"["):
                cells = list(self._cells())  # of two lists of cells, the last counts, as everywhere
            else:
                self._skip()
        if cells is None:
            raise NotebookError("it is large, and not a notebook of format 4: save it in JupyterLab.")
        return b'{"cells":[' + b",".join(cells) + b"]}"

    def _cells(self) -> Iterator[bytes]:
        for place in self._elements():
            if place > MAX_CELLS:
                raise NotebookError(f"it has more than {MAX_CELLS} cells.")
            if self._at(b"{"):
                yield b"{" + b",".join(self._kept_members(place)) + b"}"
            else:
                self._skip()

    def _kept_members(self, place: int) -> Iterator[bytes]:
        for key in self._members():
            start = self._place
            self._skip()
            size = self._place - start
            if key == _PICTURES and self._pictures + size > limits.MAX_PICTURES:
                why = "the pictures in its cell {place} are left out: together, they are too large."
                self.problems.append(why.format(place=place))
            elif key == _PICTURES:
                self._pictures += size
                yield key + b":" + self._text[start : self._place]
            elif key in _KEPT:
                self._kept += size
                most = (
                    limits.MAX_NOTEBOOK + limits.MAX_PICTURES
                )  # text may hold pictures; what is code, is looked at later
                if self._kept > most:
                    raise NotebookError(f"without its outputs it has more than {most} bytes.")
                yield key + b":" + self._text[start : self._place]

    def _members(self) -> Iterator[bytes]:
        """Each key of an object, before its value."""
        for _one in self._items(b"{", b"}"):
            key = self._match(_STRING)
            self._expect(b":")
            yield key

    def _elements(self) -> Iterator[int]:
        """The place of each element of a list, from 1, before it."""
        yield from self._items(b"[", b"]")

    def _items(self, begin: bytes, end: bytes) -> Iterator[int]:
        self._expect(begin)
        if self._at(end):
            return self._expect(end)
        for place in itertools.count(1):
            self._count()
            yield place
            if self._at(end):
                return self._expect(end)
            self._expect(b",")
        return None

    def _count(self) -> None:
        self._marks += 1
        if self._marks > limits.MAX_BRACKETS:
            raise NotebookError(f"it has more than {limits.MAX_BRACKETS} parts.")

    def _skip(self) -> None:
        """Pass over a value, whatever it holds."""
        if not (self._at(b"{") or self._at(b"[")):
            self._match(_STRING if self._at(b'"') else _PLAIN)
            return
        depth = 0
        for found in _MARK.finditer(self._text, self._place):
            self._count()
            first = self._text[found.start()]
            depth += (first in b"[{") - (first in b"]}")
            if not depth:
                self._place = found.end()
                return
        raise _no_json()

    def _at(self, character: bytes) -> bool:
        self._space()
        return self._text.startswith(character, self._place)

    def _expect(self, character: bytes) -> None:
        if not self._at(character):
            raise _no_json()
        self._place += len(character)

    def _space(self) -> None:
        found = _SPACE.match(self._text, self._place)
        self._place = found.end() if found else self._place

    def _match(self, pattern: re.Pattern[bytes]) -> bytes:
        self._space()
        found = pattern.match(self._text, self._place)
        if found is None:
            raise _no_json()
        self._place = found.end()
        return found[0]


def _no_json() -> NotebookError:
    return NotebookError("it is not JSON (JSONDecodeError).")
