"""What several commands take, their exit codes, and how a gradebook is opened."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labcourse import program
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.student_id import GRADEBOOK_FILE

if TYPE_CHECKING:
    from labcourse.grading.gradebook import Gradebook

ALL_WELL, SOME_TROUBLE, NOT_ISOLATED = 0, 1, 3  #: exit codes; 2 is for any error that stops the command

CourseFolder = Annotated[
    str | None,
    typer.Option(
        "--solutions",
        envvar=courses.SETTING,
        metavar="FOLDER",
        help="The course's folder, which holds course.py.",
        show_default=f"{courses.SOLUTIONS}/ here",
    ),
]
Marks = Annotated[
    str,
    typer.Argument(
        metavar="MARKS",
        help="The folder with the marks and results of the class; or its gradebook: a file, or a database's URL.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(help="Folder for the results.", file_okay=False, show_default="the gradebook's folder"),
]
By = Annotated[str, typer.Option(metavar="NAME", help="Your name, for the record.")]
Student = Annotated[str, typer.Argument(metavar="STUDENT", help="The student's ID.")]
Question = Annotated[str, typer.Argument(metavar="QUESTION", help="The number of the question, for example 1.11.")]
Part = Annotated[str, typer.Argument(metavar="PART", help="The part of the question, for example explanation.")]
Again = Annotated[
    list[str] | None,
    typer.Option(metavar="ID", help="Accept a person who was erased, as a new student; may be given several times."),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show what would be done, but change nothing.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for scripts: one object per line.")]


def open_gradebook(url: str) -> Gradebook:
    from labcourse.grading.gradebook import Gradebook

    return Gradebook(url)


def _is_address(url: str) -> bool:
    from labcourse.grading.gradebook.database import is_address

    return is_address(url)


def open_existing(url: str) -> Gradebook:
    """A gradebook that something is to be done with: a slip in its name must not make a new one."""
    found = url if _is_address(url) else str(_file_of(Path(url)))
    return open_gradebook(found)


def open_or_make(url: str) -> Gradebook:
    """Open a gradebook; make it, and the folder that it lies in, if there is none yet."""
    if _is_address(url):
        return open_gradebook(url)
    file = _file_to_make(Path(url))
    file.parent.mkdir(parents=True, exist_ok=True)
    return open_gradebook(str(file))


def _file_to_make(path: Path) -> Path:
    """A name of which there is nothing yet is that of a folder, unless it has an ending."""
    named = path.is_file() or (path.suffix and not path.is_dir())
    return path if named else path / GRADEBOOK_FILE


def _file_of(path: Path) -> Path:
    """A gradebook's file, by its own name or that of the folder of results."""
    inside = path / GRADEBOOK_FILE
    if path.is_dir() and not inside.is_file():
        raise GradingError(
            f"There is no gradebook {GRADEBOOK_FILE} in the folder {path}. ({program.name()} grade makes one.)"
        )
    if not path.exists():
        raise GradingError(f"There is no gradebook {path}. ({program.name()} grade makes one.)")
    return inside if path.is_dir() else path


def results_beside(marks: str, out: Path | None) -> Path | None:
    """The folder of results: as named, or that of the gradebook; None where this is no file."""
    if out is not None or _is_address(marks):
        return out
    return _file_to_make(Path(marks)).parent


def results_in(marks: str, out: Path | None) -> Path:
    """The folder of results, for what cannot do without one. Raises GradingError if none is known."""
    found = results_beside(marks, out)
    if found is None:
        raise GradingError("Say by --out into which folder it is to be written.")
    return found
