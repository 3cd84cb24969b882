"""The folder that a student works in, as its files were saved: what they would hand in, read where they are at home."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import course_file, courses, files, hub, program, student_id
from labcourse.answers import own_files, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Cell, HandIn, Notebook, NotebookError
from labcourse.course_file import NOBODY
from labcourse.errors import CheckError, ConfigurationError, StudentIDError
from labcourse.files import ANSWERS_FILE, COURSE_FILE


@dataclass(frozen=True)
class Work:
    """A student's work.

    Attributes
    ----------
    folder : where it lies
    hand_in : what counts of it
    saved : notebook's file name → when it was saved last, s since 1970
    problems : what cannot be read
    notes : what is not taken, and other notebooks that look like one of the course's
    """

    folder: Path
    hand_in: HandIn
    saved: Mapping[str, float]
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def find(given: Path | None, notebooks: Iterable[str]) -> Path:
    """The folder that is meant: the given one, else this one, else the folder ``notebooks`` in it.

    Parameters
    ----------
    given : a folder, or None
    notebooks : file names of the course's notebooks, one of which has to be there

    Raises
    ------
    CheckError
        If none of the course's notebooks is there.
    """
    names = list(notebooks)
    for folder in (Path(), Path(courses.NOTEBOOKS)) if given is None else (given,):
        if any((folder / name).is_file() for name in names):
            return folder.resolve()
    if given is None:
        looked = f"There is no notebook of the course in this folder ({Path().resolve()})."
    else:
        looked = f"There is no notebook of the course in {given}."
    raise CheckError(f"{looked} Name the folder that holds {names[0]}.")


def read(
    folder: Path, notebooks: Sequence[str], modules: Sequence[str] = (), catalogue: Catalogue | None = None
) -> Work:
    """What lies in a student's folder.

    Parameters
    ----------
    folder : with the notebooks in it
    notebooks : file names of the course's
    modules : names of the course's packages
    catalogue : of the course, which has reports; without it no report is looked for
    """
    cells: dict[str, tuple[Cell, ...]] = {}
    saved: dict[str, float] = {}
    problems = []
    for name in notebooks:
        path = folder / name
        try:
            notebook = Notebook.without_outputs(files.read(path))
            cells[name], saved[name] = notebook.cells, path.stat().st_mtime
            problems += [f"{name}: {problem}" for problem in notebook.problems]
        except FileNotFoundError:
            problems.append(_not_there(folder, name))
        except NotebookError as error:
            problems.append(f"{name} cannot be read: {error}")
        except OSError as error:
            problems.append(f"{name} cannot be read: {error.strerror}.")
    reports: dict[str, bytes] = {}
    if catalogue is not None:
        reports, refused = report_files.read_all(folder, catalogue)
        problems += refused
    names = report_files.names(catalogue).values() if catalogue is not None else ()
    own, notes = own_files.read(folder, [*notebooks, *report_files.made_files(names)], modules)
    if names and not reports:
        notes += [
            (
                f"{path} comes along as a file of your own. If it is your report, hand it in as that: "
                f'lab.report("NAME OF THE REPORT", pdf="{path}").'
            )
            for path in own
            if path.casefold().endswith(report_files.PDF) and "/" not in path
        ]
    course: dict[str, Any] = {}
    content: dict[str, bytes] = {}
    for name in (COURSE_FILE, ANSWERS_FILE):
        try:
            content[name] = files.read(folder / name)
        except FileNotFoundError:
            continue
        except OSError as error:
            problems.append(f"{name} cannot be read: {error.strerror}.")
    if (data := content.get(COURSE_FILE)) is not None:
        try:
            course = course_file.parse(data)
        except ConfigurationError as error:
            problems.append(str(error))
    hand_in = HandIn(cells, own, content.get(ANSWERS_FILE), course, reports)
    return Work(folder, hand_in, saved, tuple(problems), tuple(notes))


def student_of(work: Work, given: str = "") -> str:
    """Whose work it is: as given, else as ``course.json`` says, ``answers.json``, or the hub; else "demo".

    Raises
    ------
    CheckError
        If it cannot be an ID.
    ConfigurationError
        If the hub's name for its user has to do, and cannot be an ID.
    """
    claimed = _json(work.hand_in.claim).get("student")
    named = (given, work.hand_in.course.get("student"), claimed if claimed != NOBODY else "")
    student = next((one for one in named if isinstance(one, str) and one), "") or hub.user() or NOBODY
    try:
        return student_id.normalised(student)
    except StudentIDError as error:
        raise CheckError(str(error)) from None


def _not_there(folder: Path, name: str) -> str:
    """Words on a notebook that is missing, and on a file that may be it."""
    number = name.partition("_")[0]
    found = sorted(
        files.shown(path.name) for path in folder.glob(f"{number}*.ipynb") if own_files.BACKUP not in path.name
    )
    if not found:
        return f"{name} is not there. ({program.name()} restore {name} gives a new one.)"
    return (
        f"{name} is not there. (Is it {' or '.join(found)}? Then give it its name again. Else {program.name()} restore "
        f"{name} gives a new one.)"
    )


def _json(data: bytes | None) -> dict[str, Any]:
    try:
        found = files.from_json(data or b"{}")
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
