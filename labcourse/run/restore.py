"""Restore the course's cells in a student's notebook, or bring a folder to the release that is installed.

Locked cells and text that were changed, moved or deleted become the course's again; in an update, those of the new
release. Answers, added cells and all that a student wrote stay as they are, with their outputs. A notebook that is
changed is saved as it was, too. A program that is interrupted leaves whole files, and the next one goes on.
"""

from __future__ import annotations

import copy
import errno
import hashlib
import itertools
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import files
from labcourse.answers import own_files
from labcourse.answers.notebooks import CODE, Notebook, NotebookError
from labcourse.answers.words import KEY
from labcourse.errors import CheckError, ConfigurationError
from labcourse.run import CELL_ID, alignment
from labcourse.run.alignment import Happened, Placed, Role, source_of

_VERSION = (4, 5)  # of the format of notebooks: the first whose cells have ids
STUB_KEY = "stub"  #: in an answer cell's metadata, among those of :data:`~labcourse.answers.words.KEY`: `stub_digest`
_BACKUP = ".before-{release}"  # the folder of notebooks as they were; a hidden one is not handed in
_OF_COURSE = ("nbgrader", "deletable", "editable", "labcourse")  # metadata that make a cell one of the course's
_MOST_ROUNDS = 50  # each puts more cells into their order; two are usual

_Cell = dict[str, Any]


@dataclass(frozen=True)
class Restored:
    """What was restored.

    Attributes
    ----------
    notebook : its file name
    lines : what was restored, a line each; none if nothing was missing
    backup : name of the file with the notebook as it was; "" if there was nothing to save
    """

    notebook: str
    lines: tuple[str, ...]
    backup: str = ""


def named(beginnings: Sequence[str], notebooks: Sequence[str]) -> list[str]:
    """Return the notebooks that texts such as "02" stand for; without any, all of them.

    Raises
    ------
    CheckError
        If a text stands for none, or for several.
    """
    names = []
    for beginning in beginnings:
        stem = beginning.removesuffix(".ipynb")
        forms = (f"{stem}.ipynb", f"{stem:0>2}" if stem.isdecimal() else stem, stem)
        matches = ([name for name in notebooks if form and name.startswith(form)] for form in forms)
        meant = next(filter(None, matches), [])
        if len(meant) != 1:
            some = f"can be {len(meant)} notebooks" if meant else "is no notebook"
            raise CheckError(f"{beginning!r} {some} of the course. There are {', '.join(meant or notebooks)}.")
        names += meant
    return list(dict.fromkeys(names)) or list(notebooks)


def restore(folder: Path, name: str, master: Mapping[str, Any]) -> Restored:
    """Restore what is the course's in a student's notebook.

    Parameters
    ----------
    folder : the student's
    name : the notebook's file name
    master : the notebook as released

    Raises
    ------
    CheckError
        If the notebook cannot be read or written.
    """
    path = folder / name
    data = None
    try:
        data = files.read(path)
        restored, lines = mend(data, master)
    except FileNotFoundError:
        restored, lines = dict(master), ("it was not there: a new one, without answers",)
    except OSError as error:
        raise CheckError(f"{name} cannot be read: {error.strerror}.") from None
    except NotebookError as error:
        raise CheckError(
            f"{name} cannot be read: {error} Nothing was changed. If you have no better copy, give it another "
            "name and restore again: you then get a new one."
        ) from None
    if not lines:
        return Restored(name, lines)
    numbers = ("", *(f"-{number}" for number in range(2, 10_000)))
    backups = (path.with_name(f"{path.stem}{number}{own_files.BACKUP}{path.suffix}") for number in numbers)
    backup = next(other for other in backups if not os.path.lexists(other))
    try:
        if data is not None:
            files.write(backup, data)
        write(path, restored)
    except OSError as error:
        raise CheckError(f"{name} cannot be restored: {error.strerror}. It is as it was.") from None
    return Restored(name, lines, backup.name if data is not None else "")


def write(path: Path, notebook: Mapping[str, Any]) -> None:
    """Write a notebook as JupyterLab does.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    files.write(path, json.dumps(notebook, ensure_ascii=False, indent=1) + "\n")


def mend(data: bytes, master: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a student's notebook with all that is the course's in it, and what was restored, a line each.

    Parameters
    ----------
    data : the student's notebook's file
    master : the notebook as released

    Raises
    ------
    NotebookError
        If the file is no notebook.
    """
    notebook = Notebook.read(data).content
    changes = alignment.align(master["cells"], Notebook(notebook).cells).changes
    by_kind = {what: [change.cell for change in changes if change.what is what] for what in Happened}
    lines = [f"gave back: {', '.join(cells)} ({what})" for what, cells in by_kind.items() if cells]
    if notebook != json.loads(data):
        lines.append("its file did not have the form of a notebook")
    version = (notebook.get("nbformat"), notebook.get("nbformat_minor"))
    if not all(isinstance(number, int) for number in version) or version < _VERSION:
        notebook["nbformat"], notebook["nbformat_minor"] = _VERSION
    notebook.setdefault("metadata", copy.deepcopy(master["metadata"]))
    for _round in range(_MOST_ROUNDS):  # an answer that stands elsewhere draws along what records it, and that the text
        before = json.dumps(notebook["cells"])
        _put_right(notebook, master["cells"])
        if json.dumps(notebook["cells"]) == before:
            break
    return notebook, tuple(lines)


def _put_right(notebook: dict[str, Any], master: Sequence[Mapping[str, Any]]) -> None:
    """Put the cells in order, and the course's into their place."""
    aligned = alignment.align(master, Notebook(notebook).cells)
    wrong_kind = {change.cell for change in aligned.changes if change.what is Happened.OTHER_KIND}
    begun: set[int] = set()  # the course's cells of which there is a piece already, which has their id
    cells = []
    for place in aligned.placed:
        own = None if place.student is None else notebook["cells"][place.student]
        cells.append(_cell(place, own, master, begun, wrong_kind))
    notebook["cells"] = cells
    _give_ids(cells, {cell["id"] for cell in master})


def _cell(
    place: Placed,
    own: _Cell | None,
    masters: Sequence[Mapping[str, Any]],
    begun: set[int],
    wrong_kind: set[str],
) -> _Cell:
    """Return the cell that belongs in a place."""
    if own is None:
        return copy.deepcopy(dict(masters[place.master or 0]))
    if place.master is None:
        return own
    master = masters[place.master]
    if place.master not in begun:
        begun.add(place.master)
        own |= {"metadata": {**own["metadata"], **copy.deepcopy(master["metadata"])}, "id": master["id"]}
        if place.role in (Role.LOCKED, Role.TEXT):
            # What the cell has shown stays if it is still what it shows.
            is_same = own.get("cell_type") == master["cell_type"] and source_of(own) == source_of(master)
            return own if is_same else {**copy.deepcopy(dict(master)), "metadata": own["metadata"]}
    if master["id"] not in wrong_kind or own.get("attachments"):  # a picture would be lost in code
        return own
    own["cell_type"] = master["cell_type"]
    if master["cell_type"] == CODE:
        own.pop("attachments", None)
        return {"execution_count": None, "outputs": [], **own}
    return {key: value for key, value in own.items() if key not in ("execution_count", "outputs")}


def _give_ids(cells: list[_Cell], of_course: set[str]) -> None:
    """Give each cell an id of its own; those of the course's cells stay."""
    seen: set[str] = set()
    taken = of_course | {str(cell.get("id")) for cell in cells}
    for cell in cells:
        name = cell.get("id")
        if not isinstance(name, str) or not CELL_ID.fullmatch(name) or name in seen:
            name = next(other for number in itertools.count() if (other := f"cell-{number}") not in taken)
            taken.add(name)
            cell["id"] = name
        seen.add(name)


# --- another release --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Changes:
    """What concerns a student's answers in an update of a notebook: ids of cells.

    Attributes
    ----------
    converted : answer cells that are of another kind now, with what the student had written
    dropped : answer cells that the course no longer has, and that stay as the student's own
    theirs : answer cells in which the student has written, and whose released text is another now
    """

    converted: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    theirs: tuple[str, ...] = ()

    def lines(self, notebook: str) -> Iterator[str]:
        """Yield the same as text."""
        lists = {
            "another kind of cell now; what you had written is in it": self.converted,
            "no answer cells any more, but still there as your own; copy what new cells ask for by hand": self.dropped,
            "the course has another text for these now; yours stays, look at theirs in a fresh copy": self.theirs,
        }
        yield from (f"{notebook}: {message}: {', '.join(names)}." for message, names in lists.items() if names)


def update(folder: Path, released: Path, release: str) -> tuple[list[str], bool]:
    """Bring the notebooks in a folder to a release.

    Parameters
    ----------
    folder : the student's
    released : folder of the notebooks as released
    release : its name

    Returns
    -------
    list
        What was done, a line each.
    bool
        Whether all notebooks that are there could be read.

    Raises
    ------
    ConfigurationError
        If a file cannot be written; what was there is still there.
    """
    lines: list[str] = []
    done: list[str] = []
    is_whole, backup = True, folder / _BACKUP.format(release=release)
    for path in sorted(released.glob("*.ipynb")):
        own = folder / path.name
        try:
            data = files.read(own)
            new, changes = updated(data, json.loads(path.read_text(encoding="utf-8")))
        except FileNotFoundError:
            continue
        except (OSError, NotebookError) as error:
            is_whole = False
            lines.append(f"{own.name} could not be read, and stays as it is: {files.reason(error)}")
            continue
        if new == json.loads(data):
            continue
        try:
            _save(backup, own.name, data)
            write(own, new)
        except OSError as error:
            raise ConfigurationError(
                f"{own} cannot be brought to the release {release}: {error}. It is as it was."
            ) from None
        done.append(path.stem)
        lines += changes.lines(own.name)
    if done:
        lines.append(
            f"Now with the course's text of the release {release}: {', '.join(done)}. Your answers are as they were, "
            f"and the notebooks as they were are in the hidden folder {backup}."
        )
    return lines, is_whole


def _save(folder: Path, name: str, data: bytes) -> None:
    """Save a notebook as it was, unless it is saved already."""
    folder.mkdir(exist_ok=True)
    if folder.is_symlink():
        raise OSError(errno.ELOOP, "it is a link, which is not followed", str(folder))
    names = itertools.chain([name], (f"{number}-{name}" for number in itertools.count(2)))
    path = next(path for path in map(folder.joinpath, names) if not path.exists() or files.read(path) == data)
    if not path.exists():
        files.write(path, data)


def updated(data: bytes, master: Mapping[str, Any]) -> tuple[dict[str, Any], Changes]:
    """Return a student's notebook with the cells of a release in place of those of another, and what changed.

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
    changes = alignment.align(master["cells"], Notebook(notebook).cells).changes
    new, _lines = mend(json.dumps(notebook).encode(), master)
    return new, Changes(
        converted=tuple(change.cell for change in changes if change.what is Happened.OTHER_KIND),
        dropped=tuple(preparing.dropped),
        theirs=tuple(dict.fromkeys(preparing.theirs)),
    )


class _Preparing:
    """A student's cells, prepared for being compared with another release than the one that they are of."""

    def __init__(self, master: list[_Cell], own: list[_Cell]) -> None:
        self._master = {cell["id"]: cell for cell in master}
        self._by_grade_id = {_grading(cell)["grade_id"]: cell for cell in master if "grade_id" in _grading(cell)}
        self._own = own
        self.dropped: list[str] = []
        self.theirs: list[str] = []

    def cells(self) -> list[_Cell]:
        """Return the cells."""
        return self._with_new([cell for cell in map(self._prepared, self._own) if cell is not None])

    def _released(self, cell: _Cell) -> _Cell | None:
        """Return the cell of the release that a cell is, by its names."""
        return self._master.get(str(cell.get("id"))) or self._by_grade_id.get(str(_grading(cell).get("grade_id")))

    def _prepared(self, cell: _Cell) -> _Cell | None:
        """Return a cell as it goes on; None if it was the course's, and is no longer."""
        released, grading = self._released(cell), _grading(cell)
        if released is not None:
            return self._answer(cell, released) if alignment.role_of(released) is Role.ANSWER else cell
        is_locked = grading.get("locked") or _metadata(cell).get("editable") is False
        if is_locked or (grading.get("solution") and _is_untouched(cell)):
            return None
        if not grading.get("solution"):
            return cell
        self.dropped.append(str(cell.get("id")))
        return {**cell, "metadata": {key: of for key, of in _metadata(cell).items() if key not in _OF_COURSE}}

    def _answer(self, cell: _Cell, released: _Cell) -> _Cell:
        """Return an answer of the student's; the release's cell if the student has not changed it."""
        is_split = sum(self._released(other) is released for other in self._own) > 1
        if not is_split and _is_untouched(cell):
            is_same = cell.get("cell_type") == released["cell_type"] and source_of(cell) == source_of(released)
            return cell if is_same else copy.deepcopy(released)
        if _stub_of(cell) and _stub_of(cell) != _stub_of(released):
            self.theirs.append(released["id"])
        return cell

    def _with_new(self, cells: list[_Cell]) -> list[_Cell]:
        """Insert the answer cells that are new, or a student's own cells would be taken for them by their place.

        If an editor has lost most of the names, nothing is inserted: the place is all there is to go by.
        """
        matched = [self._released(cell) for cell in cells]
        if 2 * sum(self._released(cell) is not None for cell in self._own) < min(len(self._own), len(self._master)):
            return cells
        new_cells, after = list(cells), 0
        there = {released["id"] for released in matched if released is not None}
        for name, released in self._master.items():
            if name in there:
                after = max(n for n, cell in enumerate(new_cells, 1) if self._released(cell) is released)
            elif alignment.role_of(released) is Role.ANSWER:
                new_cells.insert(after, copy.deepcopy(released))
                after += 1
        return new_cells


def _metadata(cell: Mapping[str, Any]) -> dict[str, Any]:
    return dict(cell.get("metadata", {}))


def _grading(cell: Mapping[str, Any]) -> dict[str, Any]:
    return dict(_metadata(cell).get("nbgrader", {}))


def stub_digest(source: str) -> str:
    """Return a digest of the text of an answer cell as released; white space at the ends of lines does not count."""
    return hashlib.sha256("\n".join(map(str.rstrip, source.splitlines())).encode()).hexdigest()[:12]


def _stub_of(cell: Mapping[str, Any]) -> str:
    """Return the digest of an answer cell's text in the release that it is of; "" if the cell does not have it."""
    about = _metadata(cell).get(KEY)
    return str(about.get(STUB_KEY, "")) if isinstance(about, Mapping) else ""


def _is_untouched(cell: Mapping[str, Any]) -> bool:
    return _stub_of(cell) == stub_digest(source_of(cell))
