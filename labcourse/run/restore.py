"""Gives back what the course put into a notebook: locked cells and text that were changed, moved or deleted.

Answers, added cells and all that a student wrote stay as they are, with their outputs; of the notebook as it was, a
copy is kept.
"""

from __future__ import annotations

import copy
import itertools
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import files
from labcourse.answers import own_files
from labcourse.answers.notebooks import CODE, Notebook, NotebookError
from labcourse.errors import CheckError
from labcourse.run import alignment
from labcourse.run.alignment import Change, Happened, Placed, Role

_VERSION = (4, 5)  # of the format of notebooks: the first whose cells have ids
_MOST_ROUNDS = 50  # each puts more cells into their order; two are usual
_NAME = re.compile(r"[a-zA-Z0-9_-]{1,64}")  # what the format has for an id
_COURSES = (Role.LOCKED, Role.TEXT)

_GIVEN_BACK = {
    Happened.CHANGED: "{cell} is the course's again",
    Happened.MISSING: "{cell} is there again",
    Happened.MOVED: "{cell} is in its place again",
    Happened.RENAMED: "{cell} has its name again, with what stood in its place in it",
    Happened.OTHER_KIND: "{cell} is a {kind} cell again, its content as it was",
}


@dataclass(frozen=True)
class Restored:
    """What was given back, or would be.

    Attributes
    ----------
    notebook : its file name
    lines : what was given back, in words, a line each; none where nothing was missing
    kept : name of the copy of the notebook as it was; "" where there was nothing to keep
    """

    notebook: str
    lines: tuple[str, ...]
    kept: str = ""


def named(words: Sequence[str], notebooks: Sequence[str]) -> list[str]:
    """The notebooks that are meant by such words as "02"; all of them by none.

    Raises
    ------
    CheckError
        If a word means none, or several.
    """
    found = []
    for word in words:
        stem = word.removesuffix(".ipynb")
        number = stem.zfill(2) if stem.isdecimal() else stem
        exact = [name for name in notebooks if name == f"{stem}.ipynb"]
        meant = exact or [name for name in notebooks if number and name.startswith(number)]
        meant = meant or [name for name in notebooks if stem and name.startswith(stem)]
        if not meant:
            raise CheckError(f"{word!r} is no notebook of the course. There are {', '.join(notebooks)}.")
        if len(meant) > 1:
            raise CheckError(f"{word!r} can be {len(meant)} notebooks of the course: {', '.join(meant)}.")
        found += meant
    return list(dict.fromkeys(found)) or list(notebooks)


def restore(folder: Path, name: str, master: Mapping[str, Any], dry_run: bool = False) -> Restored:
    """Give back what is the course's in a student's notebook.

    Parameters
    ----------
    folder : the student's
    name : the notebook's file name
    master : the notebook as handed out
    dry_run : only look

    Raises
    ------
    CheckError
        If the notebook cannot be read or written.
    """
    path = folder / name
    try:
        data = files.read(path)
    except FileNotFoundError:
        if not dry_run:
            _write(path, master)
        return Restored(name, ("it was not there: a new one, without answers",))
    except OSError as error:
        raise CheckError(f"{name} cannot be read: {error.strerror}.") from None
    try:
        mended, lines = mend(data, master)
    except NotebookError as error:
        raise CheckError(
            f"{name} cannot be read: {error} Nothing was changed. If you have no better copy, give it another "
            "name and restore again: you then get a new one."
        ) from None
    if not lines or dry_run:
        return Restored(name, lines)
    kept = _free(path)
    try:
        files.write(kept, data)
    except OSError as error:
        raise CheckError(f"No copy of {name} can be kept: {error.strerror}. Nothing was changed.") from None
    _write(path, mended)
    return Restored(name, lines, kept.name)


def mend(data: bytes, master: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A student's notebook with all that is the course's in it, and what was given back.

    Parameters
    ----------
    data : the student's notebook's file
    master : the notebook as handed out

    Raises
    ------
    NotebookError
        If the file is no notebook.
    """
    notebook = Notebook.read(data).content
    lines = [_said(change) for change in alignment.align(master["cells"], Notebook(notebook).cells).changes]
    if notebook != json.loads(data):
        lines.append("its file has the form of a notebook again")
    version = (notebook.get("nbformat"), notebook.get("nbformat_minor"))
    if not all(isinstance(number, int) for number in version) or version < _VERSION:
        notebook["nbformat"], notebook["nbformat_minor"] = _VERSION
    notebook.setdefault("metadata", copy.deepcopy(master["metadata"]))
    for _again in range(_MOST_ROUNDS):  # an answer that stands elsewhere draws along what records it, and that the text
        before = json.dumps(notebook["cells"])
        _put_right(notebook, master)
        if json.dumps(notebook["cells"]) == before:
            break
    return notebook, tuple(lines)


def _put_right(notebook: dict[str, Any], master: Mapping[str, Any]) -> None:
    """Put the cells in order, and the course's into their place."""
    aligned = alignment.align(master["cells"], Notebook(notebook).cells)
    wrong = {change.cell for change in aligned.changes if change.what is Happened.OTHER_KIND}
    found = _Cells(master["cells"], notebook["cells"], wrong)
    notebook["cells"] = [found.cell(place) for place in aligned.placed]
    _name_all(notebook["cells"], {cell["id"] for cell in master["cells"]})


def _said(change: Change) -> str:
    kind = "code" if change.kind == CODE else "text"
    return _GIVEN_BACK[change.what].format(cell=change.cell, kind=kind)


class _Cells:
    """The cells of a restored notebook."""

    def __init__(
        self, master: Sequence[Mapping[str, Any]], own: Sequence[dict[str, Any]], of_another_kind: set[str]
    ) -> None:
        self._master, self._own, self._of_another_kind = master, own, of_another_kind
        self._begun: set[int] = set()  # cells of the course's of which there is a piece, which bears the name

    def cell(self, place: Placed) -> dict[str, Any]:
        """A cell in its place."""
        if place.student is None:
            return copy.deepcopy(dict(self._master[place.master or 0]))
        own = self._own[place.student]
        if place.master is None:
            return own
        master = self._master[place.master]
        if place.master in self._begun:
            return self._of_its_kind(own, master)
        self._begun.add(place.master)
        own["metadata"] = {**own["metadata"], **copy.deepcopy(master["metadata"])}
        own["id"] = master["id"]
        return self._as_released(own, master) if place.role in _COURSES else self._of_its_kind(own, master)

    def _as_released(self, own: dict[str, Any], master: Mapping[str, Any]) -> dict[str, Any]:
        """The course's own text. What it has shown stays, if it is still what it shows."""
        same = own.get("cell_type") == master["cell_type"] and _joined(own["source"]) == _joined(master["source"])
        if same:
            return own
        released = copy.deepcopy(dict(master))
        released["metadata"] = own["metadata"]
        return released

    def _of_its_kind(self, own: dict[str, Any], master: Mapping[str, Any]) -> dict[str, Any]:
        """An answer as it is, as code or text again. (A picture would be lost in code: such a cell stays text.)"""
        if master["id"] not in self._of_another_kind or own.get("attachments"):
            return own
        own["cell_type"] = master["cell_type"]
        if master["cell_type"] == CODE:
            own.pop("attachments", None)
            return {"execution_count": None, "outputs": [], **own}
        return {key: value for key, value in own.items() if key not in ("execution_count", "outputs")}


def _joined(source: Any) -> str:
    return source if isinstance(source, str) else "".join(source)


def _name_all(cells: list[dict[str, Any]], of_course: set[str]) -> None:
    """Give each cell an id of its own; those of the course's cells stay."""
    seen: set[str] = set()
    taken = of_course | {str(cell.get("id")) for cell in cells}
    for cell in cells:
        name = cell.get("id")
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name in seen:
            name = next(one for number in itertools.count() if (one := f"cell-{number}") not in taken)
            taken.add(name)
            cell["id"] = name
        seen.add(name)


def _free(path: Path) -> Path:
    """Where a copy of a notebook can be kept."""
    for number in itertools.count(1):
        kept = path.with_name(f"{path.stem}{f'-{number}' if number > 1 else ''}{own_files.BACKUP}{path.suffix}")
        if not os.path.lexists(kept):
            return kept
    raise AssertionError  # there are always more numbers


def _write(path: Path, notebook: Mapping[str, Any]) -> None:
    """As JupyterLab writes it."""
    text = json.dumps(notebook, ensure_ascii=False, indent=1) + "\n"
    try:
        files.write(path, text)
    except OSError as error:
        raise CheckError(f"{path.name} cannot be written: {error}.") from None
