"""Read the folder that a student works in, as its files were saved: what they would hand in."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from labcourse import course_file, files, student_id
from labcourse.answers import own_files, report_files
from labcourse.answers.answers import student_in
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Cell, HandIn, Notebook, NotebookError, why_unread
from labcourse.course_file import NOBODY
from labcourse.errors import CheckError, ConfigurationError, StudentIDError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.problems import Code, Problem
from labcourse.run.alignment import count_changed


@dataclass(frozen=True)
class StudentFolder:
    """A student's work.

    Attributes
    ----------
    folder : where it is
    hand_in : what counts of it
    problems : what cannot be read
    notes : what is not taken, and other notebooks that look like one of the course's
    """

    folder: Path
    hand_in: HandIn
    problems: tuple[Problem, ...]
    notes: tuple[Problem, ...]


def read(
    folder: Path, notebooks: Sequence[str], modules: Sequence[str] = (), catalogue: Catalogue | None = None
) -> StudentFolder:
    """Read what is in a student's folder.

    Parameters
    ----------
    folder : with the notebooks in it
    notebooks : file names of the course's
    modules : names of the course's packages
    catalogue : of the course, which has reports; without it no report is looked for
    """
    cells: dict[str, tuple[Cell, ...]] = {}
    problems: list[Problem] = []
    absent: list[str] = []
    for name in notebooks:
        try:
            notebook = Notebook.without_outputs(files.read(folder / name))
            cells[name] = notebook.cells
            problems += [replace(problem, where=name) for problem in notebook.problems]
        except FileNotFoundError:
            absent.append(name)
        except (NotebookError, OSError) as error:
            problems.append(Problem.of(Code.NOTEBOOK_UNREAD, name, why=why_unread(error)))
    problems += _not_there(folder, absent)
    reports: dict[str, bytes] = {}
    pdfs: Iterable[str] = ()
    if catalogue is not None:
        pdfs = report_files.names(catalogue).values()
        reports, refused = report_files.read_all(folder, catalogue)
        problems += refused
    own, notes = own_files.read(folder, [*notebooks, *report_files.made_files(pdfs)], modules)
    for path_ in own if pdfs and not reports else ():
        if path_.casefold().endswith(report_files.PDF) and "/" not in path_:
            notes.append(Problem.of(Code.LOOKS_LIKE_REPORT, path_))
    claim, about = (_read_file(folder / name, problems) for name in (ANSWERS_FILE, COURSE_FILE))
    course: dict[str, Any] = {}
    try:
        course = course_file.parse(about) if about is not None else {}
    except ConfigurationError as error:
        problems.append(Problem.of(Code.COURSE_FILE_UNREAD, COURSE_FILE, error=str(error)))
    return StudentFolder(folder, HandIn(cells, own, claim, course, reports), tuple(problems), tuple(notes))


def work_elsewhere(work: StudentFolder, masters: Mapping[str, Mapping[str, Any]]) -> Iterator[Problem]:
    """Yield a problem for each file in which more is written than in the notebook that counts.

    It is a copy under a name of its own, or, beside an empty notebook, JupyterLab's checkpoint.

    Parameters
    ----------
    work : as it was read
    masters : file name → notebook as released
    """
    for name, cells in work.hand_in.notebooks.items():
        master, stem = masters[name]["cells"], Path(name).stem
        written = count_changed(master, cells)
        checkpoint = work.folder / ".ipynb_checkpoints" / f"{stem}-checkpoint.ipynb"
        for path in (*sorted(work.folder.glob(f"*{stem}*.ipynb")), *([] if written else [checkpoint])):
            with contextlib.suppress(OSError, NotebookError):
                copied = Notebook.without_outputs(files.read(path)).cells
                if own_files.BACKUP not in path.name and count_changed(master, copied) > written:
                    code = Code.CHECKPOINT_HAS_MORE if path == checkpoint else Code.COPY_NOT_CHECKED
                    yield Problem.of(code, name, file=files.shown(path.name))


def _read_file(path: Path, problems: list[Problem]) -> bytes | None:
    """Return the content of a file; None if it is not there, or cannot be read, which is added to the problems."""
    try:
        return files.read(path)
    except FileNotFoundError:
        pass
    except OSError as error:
        problems.append(Problem.of(Code.FILE_UNREAD, path.name, why=why_unread(error)))
    return None


def _not_there(folder: Path, absent: Sequence[str]) -> Iterator[Problem]:
    """Yield a problem for each missing notebook for which there are files that may be it, and one for all others."""
    others = []
    for name in absent:
        similar = {*folder.glob(f"{name.partition('_')[0]}*.ipynb"), *folder.glob(f"{Path(name).stem}*.json")}
        if names := sorted(files.shown(path.name) for path in similar if own_files.BACKUP not in path.name):
            yield Problem.of(Code.MISNAMED, name, similar=names)
        else:
            others.append(name)
    if others:
        yield Problem.of(Code.NOT_THERE, files=others)


def student_of(work: StudentFolder, given: str = "") -> str:
    """Return the ID of the student: as given, else as in ``course.json``, ``answers.json``, or on the hub; else "demo".

    Raises
    ------
    CheckError
        If it cannot be an ID.
    ConfigurationError
        If the hub's name for its user is needed, and cannot be an ID.
    """
    claimed = student_in(work.hand_in.claim)
    named = (given, work.hand_in.course.get("student"), claimed if claimed != NOBODY else "")
    student = next((name for name in named if isinstance(name, str) and name), "") or course_file.hub_user() or NOBODY
    try:
        return student_id.normalised(student)
    except StudentIDError as error:
        raise CheckError(str(error)) from None
