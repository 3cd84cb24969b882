"""Notebook and ``.po`` → the notebook in that language. A cell is translated as a whole, or not at all."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from rotflex.courseware import words
from rotflex.courseware.messages import _
from rotflex.instructor.translation import paragraphs, po_files, unchanged

_SHOWN = 40  # characters of a piece that is named by its beginning


Notebook = TypeVar("Notebook", bound=dict[str, Any])


@dataclass(frozen=True)
class Progress:
    """How far a notebook is translated.

    Attributes
    ----------
    notebook : name of its file
    cells : text cells with words that students see
    done : those of them that are in the other language
    open : ids of cells of which something is not translated, or only proposed (fuzzy)
    refused : why a translated cell is not used: cell, piece, and what differs, in words
    stale : whether the file of translations is not of the notebook as it is now
    """

    notebook: str
    cells: int
    done: int
    open: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    stale: bool = False

    def __str__(self) -> str:
        parts = [_("{notebook}: {done} of {cells} text cells are translated")]
        if self.open:
            parts.append(_("{open} wait for a translation"))
        if refused := self.cells - self.done - len(self.open):
            parts.append(_("{refused} are refused"))
        return ", ".join(parts).format(
            notebook=self.notebook, done=self.done, cells=self.cells, open=len(self.open), refused=refused
        )


def translated(notebook: Notebook, name: str, course: Path, language: str) -> tuple[Notebook, Progress]:
    """A notebook in another language, as far as it is translated, and how far that is.

    Code cells, metadata, ids, attachments and outputs are the source's; so are text cells that are not translated, or
    whose translation changes what it must not.

    Parameters
    ----------
    notebook : the course's own; it is not changed
    name : of its file
    course : the course's folder
    language : as "de"

    Raises
    ------
    GradingError
        If the file of translations cannot be read.
    """
    known = po_files.read(po_files.file_of(course, language, name))
    usable = {
        (entry.msgctxt or "", entry.msgid): entry.msgstr
        for entry in known
        if entry.msgstr and not entry.fuzzy and not entry.obsolete
    }
    sources: dict[str, str] = {}
    waiting, refused = [], []
    for cell in po_files.cells(notebook):
        about = str(cell["id"])
        if not all((about, text) in usable for text in po_files.pieces_of(cell)):
            waiting.append(about)
            continue
        faults = list(_faults(cell, {text: usable[about, text] for text in po_files.pieces_of(cell)}))
        if faults:
            refused += [_("cell {cell!r}: {fault}").format(cell=about, fault=fault) for fault in faults]
        else:
            sources[about] = _source(cell, {text: usable[about, text] for text in po_files.pieces_of(cell)})
    made = copy.copy(notebook)
    made["cells"] = [_with_source(cell, sources) for cell in notebook["cells"]]
    live = {(entry.msgctxt or "", entry.msgid) for entry in known if not entry.obsolete}
    progress = Progress(
        name,
        cells=sum(1 for _cell in po_files.cells(notebook)),
        done=len(sources),
        open=tuple(waiting),
        refused=tuple(refused),
        stale=live != set(po_files.keys(notebook)),
    )
    return made, progress


def of_course(notebooks: Iterable[Path], course: Path, language: str) -> list[Progress]:
    """How far each notebook of a course is translated.

    Raises
    ------
    GradingError
        If a file of translations cannot be read.
    """
    read = ((path.name, json.loads(path.read_text(encoding="utf-8"))) for path in notebooks)
    return [translated(notebook, name, course, language)[1] for name, notebook in read]


def _faults(cell: Mapping[str, Any], by_source: Mapping[str, str]) -> Iterator[str]:
    for source, translation in by_source.items():
        told = unchanged.differences(source, translation)
        if paragraphs.is_one(source) and not paragraphs.is_one(translation):
            told = [_("it should be one paragraph, list item or row, without a sign of a list or a heading before it")]
        if told:
            yield _("“{beginning}”: {faults}").format(beginning=_beginning(source), faults="; ".join(told))
    made = _source(cell, by_source)
    if len(words.headings(made)) != len(words.headings(words.source_of(cell))):
        yield _("the line with {mark} is no longer read as the heading of an answer: it must hold no * < or >").format(
            mark=words.MARK
        )


def _beginning(text: str) -> str:
    line = text.splitlines()[0]
    return line if len(line) <= _SHOWN else f"{line[: _SHOWN - 1]}…"


def _source(cell: Mapping[str, Any], by_source: Mapping[str, str]) -> str:
    found = paragraphs.pieces(words.source_of(cell))
    return "".join(by_source[piece.text] if piece.words else piece.text for piece in found)


def _with_source(cell: dict[str, Any], sources: Mapping[str, str]) -> dict[str, Any]:
    """A cell with another text, in the form in which its file has it: a string, or its lines."""
    source = sources.get(str(cell["id"]))
    if source is None:
        return cell
    made = copy.copy(cell)
    made["source"] = source if isinstance(cell["source"], str) else source.splitlines(keepends=True)
    return made
