"""The command that puts marks into the files of other platforms."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labcourse import files
from labcourse.errors import GradebookError, GradingError
from labcourse.grading import course as courses
from labcourse.grading.commands.options import SOME_TROUBLE, CourseFolder, DryRun, Marks, open_existing
from labcourse.safe_text import say

if TYPE_CHECKING:
    from labcourse.grading.course import Course
    from labcourse.grading.gradebook import Gradebook
    from labcourse.grading.platforms.filled import Choice
    from labcourse.grading.platforms.matching import Matches
    from labcourse.grading.platforms.recognised import Export

_SUFFIX = "-with-marks"


def export(
    marks: Marks,
    into: Annotated[
        Path,
        typer.Option(help="The file that you exported from Canvas, Moodle, Blackboard or Brightspace.", dir_okay=False),
    ],
    column: Annotated[
        str | None, typer.Option(help="The column for the marks; not needed if only one can take marks.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(help="The file to write.", dir_okay=False, show_default="beside theirs, with-marks"),
    ] = None,
    out_of: Annotated[str | None, typer.Option(help="The maximum of the column, if the file does not say it.")] = None,
    decimals: Annotated[
        int | None,
        typer.Option(min=0, max=5, help="Decimals of a mark; rounded half up.", show_default="the course's, or 2"),
    ] = None,
    unfinished: Annotated[
        bool, typer.Option("--unfinished", help="Write the points decided so far, if some answers still wait.")
    ] = False,
    cap: Annotated[bool, typer.Option("--cap", help="Write the maximum for marks above it.")] = False,
    feedback: Annotated[
        Path | None, typer.Option(help="Write a zip of feedback pages for the platform here.", dir_okay=False)
    ] = None,
    submissions: Annotated[
        Path | None,
        typer.Option(help="The platform's zip of submissions; --feedback needs the names in it.", dir_okay=False),
    ] = None,
    dry_run: DryRun = False,
    course: CourseFolder = None,
) -> None:
    """Put marks into a file that you exported from Canvas, Moodle, Blackboard or Brightspace.

    One column is filled, and nothing else is changed.

    Exit code: 0 all students' marks are in, 1 some are not (each is named, with the reason), 2 nothing written.
    """
    from labcourse.grading.platforms.filled import Choice

    if submissions is not None and feedback is None:
        raise GradingError("--submissions gives names for --feedback: say where that is to be written.")
    found = courses.find(course)
    with open_existing(marks) as book:
        target = write or into.with_stem(into.stem + _SUFFIX)
        choice = Choice(found.settings.marks.decimals if decimals is None else decimals, unfinished, cap)
        order = _Order(into, target, column, _points(out_of), choice, feedback, submissions, dry_run)
        complete = _into_file(book, found, order)
    if not complete:
        raise typer.Exit(SOME_TROUBLE)


@dataclass(frozen=True)
class _Order:
    """What is to become of a platform's file: the command's options."""

    into: Path
    target: Path
    column: str | None
    out_of: Decimal | None
    choice: Choice
    feedback: Path | None
    submissions: Path | None
    dry: bool


def _into_file(book: Gradebook, course: Course, order: _Order) -> bool:
    """Fill the column, write the files, and tell of it; whether everybody's mark is in."""
    from labcourse.grading.platforms import filled, matching, recognised
    from labcourse.grading.platforms.earned import earned

    _must_be_others(order)
    with _about(order.into):
        theirs = _read(order.into)
        place = theirs.column(order.column)
        maximum = recognised.maximum(place, theirs.platform, order.out_of)
        matches = matching.match(theirs, book.students())
        done = filled.fill(theirs, place, maximum, matches, earned(book, course), order.choice)
    # What is refused of the feedback is refused while nothing is written.
    pages, told_of_pages = (b"", []) if order.feedback is None else _feedback(book, course, theirs, matches, order)
    if not order.dry:
        _write(order.target, done.data)
        if order.feedback is not None:
            _write(order.feedback, pages)
    about = "{platform}, column {heading!r}, out of {maximum}:"
    say(about.format(platform=theirs.platform, heading=place.heading, maximum=recognised.plain(maximum)))
    say(*filled.told(theirs, done, matches, order.dry), *told_of_pages, _written(order.target, order.dry))
    return not (done.left or done.so_far or matches.unknown or matches.refused or matches.missing)


def _feedback(
    book: Gradebook, course: Course, theirs: Export, matches: Matches, order: _Order
) -> tuple[bytes, list[str]]:
    from labcourse.grading.platforms import feedback_zip

    there = feedback_zip.submissions_in(order.submissions) if order.submissions is not None else []
    places = feedback_zip.places(theirs, matches, there)
    return feedback_zip.packed(places, feedback_zip.pages(book, course, list(places.paths)))


def _read(into: Path) -> Export:
    from labcourse.grading.platforms import rules, their_file

    try:
        data = into.read_bytes()
    except OSError as error:
        raise GradingError(f"it cannot be read: {error.strerror}.") from None
    return rules.recognised(their_file.read(data))


@contextmanager
def _about(file: Path) -> Iterator[None]:
    """Say which file it is that something is refused of."""
    try:
        yield
    except GradebookError:
        raise
    except GradingError as error:
        raise GradingError(f"{file}: {error}") from None


def _must_be_others(order: _Order) -> None:
    """Refuse to write over what was given."""
    given = [one.resolve() for one in (order.into, order.submissions) if one is not None]
    written = [one.resolve() for one in (order.target, order.feedback) if one is not None]
    for one in written:
        if one in given:
            raise GradingError(f"{one} is what was given, and is not written over: the platform's own file stays.")
    if len(set(written)) < len(written):
        raise GradingError(f"{order.target} cannot be both, marks and feedback.")


def _points(given: str | None) -> Decimal | None:
    """What --out-of says."""
    if given is None:
        return None
    try:
        return Decimal(given)
    except InvalidOperation:
        raise GradingError(f"--out-of should be a number of points, not {given!r}.") from None


def _write(target: Path, data: bytes) -> None:
    try:
        files.write(target, data)
    except OSError as error:
        raise GradingError(f"{target} cannot be written: {error.strerror}.") from None


def _written(target: Path, dry: bool) -> str:
    return "Nothing was written (--dry-run)." if dry else f"Written: {target}"
