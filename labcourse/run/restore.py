"""Restore the course's cells in a student's notebooks, as the installed release has them.

Locked cells and text that were changed, moved or deleted become the course's again. Answers, added cells and all that a
student wrote stay as they are, with their outputs. A folder that was begun with another release is brought to the
installed one in the same way. A notebook that is changed is saved as it was, too. A program that is interrupted leaves
whole files, and the next one goes on.
"""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse import benches, course_file, courses, files
from labcourse.answers import own_files
from labcourse.answers.notebooks import CODE, Notebook, NotebookError
from labcourse.answers.words import KEY, where_of, written
from labcourse.errors import CheckError, ConfigurationError
from labcourse.files import COURSE_FILE
from labcourse.patterns import CELL_ID
from labcourse.problems import Code
from labcourse.run import alignment
from labcourse.run.alignment import Happened, Placed, Role, source_of

_VERSION = (4, 5)  # of the format of notebooks: the first whose cells have ids
STUB_KEY = "stub"  #: in an answer cell's metadata, among those of :data:`~labcourse.answers.words.KEY`: `stub_digest`
_OF_COURSE = ("nbgrader", "deletable", "editable", "labcourse")  # metadata that make a cell one of the course's
_MOST_ROUNDS = 50  # each puts more cells into their order; two are usual

_Cell = dict[str, Any]


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


def restore(folder: Path, masters: Mapping[str, Mapping[str, Any]], names: Sequence[str] = ()) -> Iterator[str]:
    """Restore what is the course's in notebooks of a student's folder; yield what was done, a line each.

    If the folder was begun with another release than the installed one, all notebooks that are there are brought to the
    installed one, and ``course.json`` with them.

    Parameters
    ----------
    folder : the student's
    masters : file name → notebook as the installed release has it
    names : file names of notebooks to restore; those that are not there are made anew

    Raises
    ------
    CheckError
        At the end, if notebooks could not be read or written. They are as they were, and the others are restored.
    """
    installed = course_file.about(courses.current().notebooks)
    begun, release = installed, installed.get(course_file.RELEASE_KEY)
    try:
        begun = course_file.read(folder) or {}
    except ConfigurationError as error:  # it may name a student, and only a person can mend it
        yield str(error)
    is_other = bool(release) and begun.get(course_file.RELEASE_KEY) != release
    there = [name for name in masters if is_other and os.path.lexists(folder / name)]
    # Nobody knows of which release a folder is that does not say it. Most likely it is of this one.
    other = str(release) if is_other and begun.get(course_file.RELEASE_KEY) else ""
    is_changed, failed = False, []
    for name in masters:
        if name in (*there, *names):
            try:
                lines = _restored(folder, name, masters[name], other)
            except CheckError as error:  # restore the others first
                failed.append(str(error))
                continue
            is_changed = is_changed or bool(lines)
            yield from lines or ([f"{name}: all that is the course's is there."] if name in names else [])
    if is_changed:
        yield (
            "A notebook that is open in JupyterLab still shows its old state: choose File → Reload Notebook from Disk "
            "there, before you save it."
        )
    if failed:
        raise CheckError("\n".join(failed))
    if is_other:
        if there and not _is_same_bench(begun, installed):
            yield "The course gives you another bench now: run your notebooks again, to measure on that one."
        student = {course_file.STUDENT_KEY: begun.get(course_file.STUDENT_KEY, "")}
        files.write(folder / COURSE_FILE, course_file.text({**begun, **installed, **student}))


def _is_same_bench(begun: dict[str, Any], installed: dict[str, Any]) -> bool:
    try:
        now = {"draw": installed.get("draw")}  # of a folder that names none
        return benches.policy_of(now | begun) == benches.policy_of(installed)
    except ConfigurationError:
        return False


def _restored(folder: Path, name: str, master: Mapping[str, Any], release: str) -> list[str]:
    """Restore a notebook; return what was done, a line each. For the release see :func:`mend`.

    Raises
    ------
    CheckError
        If the notebook cannot be read or written.
    """
    path = folder / name
    data = None
    try:
        data = files.read(path)
        restored, lines = mend(data, master, release)
    except FileNotFoundError:
        restored, lines = dict(master), ["it was not there: a new one, without answers"]
    except OSError as error:
        raise CheckError(f"{name} cannot be read: {error.strerror}.") from None
    except NotebookError as error:
        raise CheckError(
            f"{name} cannot be read: {error} Nothing was changed. If you have no better copy, give it another "
            "name and restore again: you then get a new one."
        ) from None
    if not lines:
        return []
    numbers = ("", *(f"-{number}" for number in range(2, 10_000)))
    backups = (path.with_name(f"{path.stem}{number}{own_files.BACKUP}{path.suffix}") for number in numbers)
    backup = next(other for other in backups if not os.path.lexists(other))
    try:
        if data is not None:
            files.write(backup, data)
        write(path, restored)
    except OSError as error:
        raise CheckError(f"{name} cannot be restored: {error.strerror}. It is as it was.") from None
    saved = "" if data is None else f" The notebook as it was is saved as {backup.name}."
    return [f"{name} is restored.{saved}", *(f"  {line}" for line in lines)]


def write(path: Path, notebook: Mapping[str, Any]) -> None:
    """Write a notebook as JupyterLab does.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    files.write(path, json.dumps(notebook, ensure_ascii=False, indent=1) + "\n")


def mend(data: bytes, master: Mapping[str, Any], release: str = "") -> tuple[dict[str, Any], list[str]]:
    """Return a student's notebook with all that is the course's in it, and what was restored, a line each.

    Parameters
    ----------
    data : the student's notebook's file
    master : the notebook as released
    release : name of the master's release, if the notebook is of another one

    Raises
    ------
    NotebookError
        If the file is no notebook.
    """
    notebook = Notebook.read(data).content
    lines = [] if notebook == json.loads(data) else ["its file did not have the form of a notebook"]
    of_other = _OfOtherRelease(master["cells"], notebook["cells"]) if release else None
    if of_other is not None:
        notebook["cells"] = of_other.cells()
    changes = alignment.align(master["cells"], Notebook(notebook).cells).changes
    by_kind = alignment.cells_by_change(changes)
    if of_other is None:
        messages = {f"gave back what was {what}": cells for what, cells in by_kind.items()}
    else:
        messages = {
            "another kind of cell now; what you had written is in it": by_kind[Happened.OTHER_KIND],
            "no answer cells any more, but still there as your own; copy what new cells ask for": of_other.dropped,
            "the course has another text for these now; yours stays, a fresh copy has theirs": of_other.theirs,
        }
    messages["moved what was written into the course's text to the answer cell below it"] = _move_words(
        notebook, master
    )
    lines += [f"{message}: {', '.join(dict.fromkeys(cells))}" for message, cells in messages.items() if cells]
    version = (notebook.get("nbformat"), notebook.get("nbformat_minor"))
    if not all(isinstance(number, int) for number in version) or version < _VERSION:
        notebook["nbformat"], notebook["nbformat_minor"] = _VERSION
    notebook.setdefault("metadata", copy.deepcopy(master["metadata"]))
    for _round in range(_MOST_ROUNDS):  # an answer that stands elsewhere draws along what records it, and that the text
        before = json.dumps(notebook["cells"])
        _put_right(notebook, master["cells"])
        if json.dumps(notebook["cells"]) == before:
            break
    if release and notebook != json.loads(data):
        lines.insert(0, f"now with the course's text of the release {release}; your answers are as they were")
    return notebook, lines


def _move_words(notebook: dict[str, Any], master: Mapping[str, Any]) -> list[str]:
    """Move answers that stand in the course's text, which is restored, to their cells; return the ids of these."""
    found, moved = written(master["cells"], Notebook(notebook).cells, with_pictures=False), []
    notes = (note.parameters for note in found.notes if note.code == Code.TEXT_IN_QUESTION)
    places = {(note["question"], note["part"]) for note in notes}
    for cell in notebook["cells"]:
        if (where := where_of(cell)) in places:
            cell["source"] = f"{source_of(cell)}\n\n{found.words[where].text}"
            moved.append(cell["id"])
    return moved


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
    place: Placed, own: _Cell | None, masters: Sequence[Mapping[str, Any]], begun: set[int], wrong_kind: set[str]
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


class _OfOtherRelease:
    """A student's cells of one release, prepared for being compared with those of another.

    Attributes
    ----------
    dropped : ids of answer cells that the course no longer has, and that stay as the student's own
    theirs : ids of answer cells in which the student has written, and for which the release has another text now
    """

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
