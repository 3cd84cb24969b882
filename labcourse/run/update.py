"""A half-done folder, brought to the release of the course that is installed. No answer is touched.

The course's cells become those of the new release; answers, added cells and own files stay. Of each notebook that is
changed, a copy is kept as it was. A program that ends in between leaves whole files, and the next one goes on.
"""

from __future__ import annotations

import ast
import copy
import errno
import hashlib
import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import files
from labcourse.answers.notebooks import CODE, Notebook, NotebookError
from labcourse.answers.words import KEY, MARK
from labcourse.errors import ConfigurationError
from labcourse.run import alignment, restore
from labcourse.run.alignment import Happened, Role

STUB = "# Your code here."  #: what a released answer cell has where the solution stood
STUB_KEY = "stub"  #: in an answer cell's metadata, among those of :data:`~labcourse.answers.words.KEY`: `stub_digest`
ASIDE = "-before"  #: at the end of the name of a cell that an answer cell of another kind has taken the place of
_KEPT = ".before-{release}"  # the folder of copies; a hidden one is not handed in

_COURSES = ("nbgrader", "deletable", "editable", "labcourse")  # metadata that make a cell one of the course's

_Cell = dict[str, Any]


@dataclass(frozen=True)
class Changes:
    """What became of a notebook.

    Attributes
    ----------
    changed, new, gone : how many of the course's cells have another text, were not there, are no longer there
    aside : answer cells that are of another kind now; what a student had written stands below
    dropped : answer cells that are none any more, and stay as the student's own
    theirs : answer cells in which the student has written, and whose text as handed out is another now
    """

    changed: int = 0
    new: int = 0
    gone: int = 0
    aside: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    theirs: tuple[str, ...] = ()

    def lines(self, notebook: str) -> Iterator[str]:
        """The same, in words."""
        if self.changed or self.new or self.gone:
            yield f"{notebook}: of the course's cells {self.changed} changed, {self.new} new, {self.gone} gone."
        lists = {
            "another kind of cell now; what you had written stands below": self.aside,
            "no answer cells any more, but still there as your own; copy what new cells ask for by hand": self.dropped,
            "the course has another text for these now; yours stays, look at theirs in a fresh copy": self.theirs,
        }
        for message, names in lists.items():
            if names:
                yield f"{notebook}: {message}: {', '.join(names)}."


def update(folder: Path, released: Path, release: str) -> tuple[list[str], bool]:
    """Bring the notebooks in a folder to a release.

    Parameters
    ----------
    folder : the student's
    released : where the notebooks as handed out are
    release : its name

    Returns
    -------
    list
        What was done, a line each.
    bool
        Whether all that is there could be brought to it.

    Raises
    ------
    ConfigurationError
        If a file cannot be written; what was there is there still.
    """
    lines, whole, kept = [], True, folder / _KEPT.format(release=release)
    copied = False
    for path in sorted(released.glob("*.ipynb")):
        own = folder / path.name
        try:
            data = files.read(own)
            done, changes = updated(data, json.loads(path.read_text(encoding="utf-8")))
        except FileNotFoundError:
            continue
        except (OSError, NotebookError) as error:
            whole = False
            lines.append(f"{own.name} could not be read, and stays as it is: {files.reason(error)}")
            continue
        if done != json.loads(data):
            try:
                _keep(kept, own.name, data)
                files.write(own, json.dumps(done, ensure_ascii=False, indent=1) + "\n")
            except OSError as error:
                raise ConfigurationError(
                    f"{own} cannot be brought to the release {release}: {error}. It is as it was."
                ) from None
            copied = True
            lines += changes.lines(own.name)
    if copied:
        begun = "Your notebooks now have the course's text of the release {release}; your answers are as they were."
        copies = "Copies of the notebooks as they were lie in the hidden folder {folder}."
        lines = [begun.format(release=release), *lines, copies.format(folder=kept)]
    return lines, whole


def _keep(folder: Path, name: str, data: bytes) -> None:
    """Keep a notebook as it was, unless it is kept already."""
    folder.mkdir(exist_ok=True)
    if folder.is_symlink():
        raise OSError(errno.ELOOP, "it is a link, which is not followed", str(folder))
    for number in itertools.count(1):
        kept = folder / (name if number == 1 else f"{number}-{name}")
        if not kept.exists():
            files.write(kept, data)
            return
        if files.read(kept) == data:
            return


def updated(data: bytes, master: Mapping[str, Any]) -> tuple[dict[str, Any], Changes]:
    """A student's notebook with the cells of a release in place of those of another, and what changed.

    Parameters
    ----------
    data : the student's notebook's file
    master : the notebook as the release has it

    Raises
    ------
    NotebookError
        If the file is no notebook.
    """
    notebook = Notebook.read(data).content
    preparing = _Preparing(master["cells"], notebook["cells"])
    notebook["cells"] = preparing.cells()
    happened = [
        change.what
        for change in alignment.align(master["cells"], Notebook(notebook).cells).changes
        if change.role in (Role.LOCKED, Role.TEXT)
    ]
    done, _lines = restore.mend(json.dumps(notebook).encode(), master)
    done["cells"] = _below(done["cells"], preparing.aside)
    return done, Changes(
        changed=happened.count(Happened.CHANGED),
        new=happened.count(Happened.MISSING),
        gone=preparing.gone,
        aside=tuple(dict.fromkeys(preparing.aside.values())),
        dropped=tuple(preparing.dropped),
        theirs=tuple(dict.fromkeys(preparing.theirs)),
    )


class _Preparing:
    """A student's cells, made ready for being held against another release than the one that they are of."""

    def __init__(self, master: list[_Cell], own: list[_Cell]) -> None:
        self._master = {cell["id"]: cell for cell in master}
        self._by_grade_id = {_grading(cell)["grade_id"]: cell for cell in master if "grade_id" in _grading(cell)}
        self._own = own
        self.gone = 0
        self.aside: dict[str, str] = {}  # new name of the student's cell → the answer cell in whose place it was
        self.dropped: list[str] = []
        self.theirs: list[str] = []

    def cells(self) -> list[_Cell]:
        """The cells."""
        kept = [cell for cell in map(self._prepared, self._own) if cell is not None]
        return self._with_new(kept)

    def _of_course(self, cell: _Cell) -> _Cell | None:
        """The cell of the release that a cell is, by its names."""
        return self._master.get(_name(cell)) or self._by_grade_id.get(str(_grading(cell).get("grade_id")))

    def _prepared(self, cell: _Cell) -> _Cell | None:
        """A cell as it goes on; None if it was the course's, and is no longer."""
        meant, grading = self._of_course(cell), _grading(cell)
        if meant is not None:
            return self._answer(cell, meant) if alignment.role_of(meant) is Role.ANSWER else cell
        no_answer = grading.get("locked") or _metadata(cell).get("editable") is False
        if no_answer or (grading.get("solution") and (_is_untouched(cell) or _is_unfilled(cell))):
            self.gone += 1
            return None
        if not grading.get("solution"):
            return cell
        self.dropped.append(_name(cell))
        return _own(cell, _name(cell))

    def _answer(self, cell: _Cell, meant: _Cell) -> _Cell | None:
        """An answer of the student's. (An empty one presets what the release presets, but for a piece of one.)"""
        pieces = [one for one in self._own if self._of_course(one) is meant]
        unfilled = _is_untouched(cell) or _is_unfilled(cell, alignment.source_of(meant))
        unfilled = unfilled and len(pieces) == 1
        if cell.get("cell_type") == meant["cell_type"]:
            if not unfilled and _stub_of(cell) and _stub_of(cell) != _stub_of(meant):
                self.theirs.append(meant["id"])
            same = alignment.source_of(cell) == alignment.source_of(meant)
            return copy.deepcopy(meant) if unfilled and not same else cell
        if unfilled:
            return None
        number = len([place for place in self.aside.values() if place == meant["id"]])
        name = f"{meant['id']}{ASIDE}{f'-{number + 1}' if number else ''}"
        self.aside[name] = meant["id"]
        return _own(cell, name)

    def _with_new(self, cells: list[_Cell]) -> list[_Cell]:
        """With the answer cells that are new, or a student's own cells would be taken for them by their place.

        Where an editor has lost most of the names, the place is all there is to go by.
        """
        named = len([cell for cell in self._own if self._of_course(cell) is not None])
        if 2 * named < min(len(self._own), len(self._master)):
            return cells
        there = {meant["id"] for cell in cells if (meant := self._of_course(cell)) is not None}
        found, after = list(cells), 0
        for name, cell in self._master.items():
            if name in there:
                after = max(place for place, one in enumerate(found, 1) if self._of_course(one) is cell)
            elif alignment.role_of(cell) is Role.ANSWER:
                found.insert(after, copy.deepcopy(cell))
                after += 1
        return found


def _metadata(cell: Mapping[str, Any]) -> dict[str, Any]:
    return dict(cell.get("metadata", {}))


def _grading(cell: Mapping[str, Any]) -> dict[str, Any]:
    return dict(_metadata(cell).get("nbgrader", {}))


def _name(cell: Mapping[str, Any]) -> str:
    return str(cell.get("id", ""))


def _own(cell: _Cell, name: str) -> _Cell:
    """A cell as one of the student's own, which they may delete."""
    return {
        **cell,
        "id": name,
        "metadata": {key: value for key, value in _metadata(cell).items() if key not in _COURSES},
    }


def stub_digest(source: str) -> str:
    """What the text of an answer cell, as it is handed out, is known by; white space at the end of lines is nothing."""
    return hashlib.sha256("\n".join(map(str.rstrip, source.splitlines())).encode()).hexdigest()[:12]


def _stub_of(cell: Mapping[str, Any]) -> str:
    """What the text of an answer cell was known by in the release that it is of; empty where that is not written."""
    about = _metadata(cell).get(KEY)
    return str(about.get(STUB_KEY, "")) if isinstance(about, Mapping) else ""


def _is_untouched(cell: Mapping[str, Any]) -> bool:
    return _stub_of(cell) == stub_digest(alignment.source_of(cell))


def _is_unfilled(cell: Mapping[str, Any], released: str = "") -> bool:
    """Say whether an answer cell is empty: its banner, presets as ``k = None  # N/m``, and the stub.

    A comment that is not in the cell as it is `released` now is the student's, and counts as an answer.
    """
    if cell.get("cell_type") != CODE:
        return False
    source = alignment.source_of(cell).splitlines()
    lines = [line for line in source if line.strip() != STUB and not line.startswith(f"# {MARK}")]
    if any("#" in line and line[line.index("#") :] not in released for line in lines):
        return False
    try:
        body = ast.parse("\n".join(lines)).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return all(
        isinstance(statement, ast.Assign)
        and isinstance(statement.value, ast.Constant)
        and (statement.value.value is None or not str(statement.value.value).strip())
        for statement in body
    )


def _below(cells: list[_Cell], aside: Mapping[str, str]) -> list[_Cell]:
    """With each cell that was put aside below the one that has taken its place."""
    moved = {cell["id"]: cell for cell in cells if cell["id"] in aside}
    found = []
    for cell in cells:
        if cell["id"] not in moved:
            found.append(cell)
            found += [moved[name] for name, place in aside.items() if place == cell["id"] and name in moved]
    return found
