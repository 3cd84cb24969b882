"""What several commands take, their exit codes, and how a gradebook is opened."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotflex.courseware.messages import _
from rotflex.courseware.student_id import GRADEBOOK_FILE
from rotflex.errors import GradingError
from rotflex.instructor import course as courses

if TYPE_CHECKING:
    from rotflex.instructor.gradebook import Gradebook

ALL_WELL, SOME_TROUBLE, NOT_ISOLATED = 0, 1, 3  #: exit codes; 2 is for any error that stops the command

CourseFolder = Annotated[
    str | None,
    typer.Option(
        "--course",
        envvar=courses.SETTING,
        metavar="FOLDER",
        help="The course's folder, which holds course.py.",
        show_default=_("{folder}/ here").format(folder=courses.USUAL),
    ),
]
Book = Annotated[str, typer.Option("--gradebook", help="A file, or the URL of a database.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for scripts: an object a line.")]


def open_gradebook(url: str) -> Gradebook:
    from rotflex.instructor.gradebook import Gradebook

    return Gradebook(url)


def open_existing(url: str) -> Gradebook:
    """A gradebook that something is to be done with: a slip in its name must not make a new one."""
    if "://" not in url and Path(url).is_dir():
        raise GradingError(
            _("{url} is a folder; the gradebook is a file in it, mostly {file}.").format(url=url, file=GRADEBOOK_FILE)
        )
    if "://" not in url and not Path(url).is_file():
        raise GradingError(_("There is no gradebook {url}. (rotflex grade makes one.)").format(url=url))
    return open_gradebook(url)
