"""Commands about a person's data: person copy, person erase."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labcourse import program
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading.commands.options import (
    SOME_TROUBLE,
    By,
    CourseFolder,
    DryRun,
    Force,
    Marks,
    Out,
    Student,
    open_existing,
    results_beside,
)
from labcourse.safe_text import say
from labcourse.student_id import caseless

if TYPE_CHECKING:
    from labcourse.grading.erasure.results import Results
    from labcourse.grading.gradebook import Erased, Gradebook
    from labcourse.grading.gradebook.persons import OfOthers

_MOST_TOLD = 30  # places of one sort; they fill a screen


person = typer.Typer(name="person", help="Copy or erase all that is stored about a student.", no_args_is_help=True)


@person.command()
def erase(
    marks: Marks,
    student: Student,
    by: By,
    out: Out = None,
    submissions: Annotated[
        Path | None, typer.Option(help="Report the person's submissions in this folder, too.")
    ] = None,
    dry_run: DryRun = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    course: CourseFolder = None,
) -> None:
    """Erase all that is stored about a student. This cannot be undone.

    The gradebook records who erased somebody, but not who was erased. The files about the class are written anew. The
    names of scorers stay: this command is for students.

    Exit code: 0 erased (or shown), 1 erased, but you have to do what is printed at the end, 2 nothing erased.
    """
    from labcourse.grading.erasure import remains
    from labcourse.grading.erasure.others import of_others
    from labcourse.grading.erasure.results import Results

    found, folder = courses.find(course), results_beside(marks, out)
    results = None if folder is None else Results(folder, found)
    with open_existing(marks) as book:
        others = of_others(book, found, student)
        erased = _would_be_erased(book, student, others)
        say(*_what_goes(erased, results))
        handed_in = [] if submissions is None else [*remains.in_submissions(submissions, book, student)]
        if dry_run:
            say(*_what_stays(erased, []), "Nothing was erased: --dry-run.")
            return
        if not yes and not typer.confirm("Erase all of it? It cannot be taken back."):
            raise GradingError("Nothing was erased.")
        there = [] if results is None else results.of_class()
        if results is not None:
            results.remove(student)  # first, so that it can be done again if what follows cannot be
        try:
            done = book.persons.erase(student, by, others)
        finally:
            unwritten = [] if results is None else results.write(book, there)
            say(*unwritten, err=True)  # here, as it is also said if erasing failed
    named = [] if folder is None else [*remains.in_folder(folder, done.about)]
    named += [*handed_in, *remains.in_settings(found, done.about)]
    say(f"{done.about.student} is erased.", *_what_stays(done, named))
    say(*_what_cannot_be_seen(done, folder, submissions))
    if named or done.still_named or unwritten:
        raise typer.Exit(SOME_TROUBLE)


def _would_be_erased(book: Gradebook, student: str, others: OfOthers) -> Erased:
    """Return what would be erased of a student. For a person who only scored, the error says that this stays."""
    is_student = caseless(student) in {caseless(about.student) for about in book.students()}
    if not is_student and (book.scores.acts(actor=student) or student in {entry.actor for entry in book.audit()}):
        raise GradingError(
            f"There is no student {student!r} in the gradebook, but a person of that name scored or marked. The name "
            "stays: who decided is part of what others were given. Nothing was erased."
        )
    return book.persons.would_be_erased(student, others)


def _what_goes(erased: Erased, results: Results | None) -> Iterator[str]:
    about = erased.about
    yield "What there is of {who}:".format(who=", ".join(filter(None, (about.student, about.name, about.email))))
    called = {
        "deliveries": "files that were handed in, each version",
        "runs": "runs",
        "marks": "marks by the software",
        "decisions": "marks by persons",
        "audit": "lines of the audit trail",
        "scores": "acts of scorers",
        "claims": "answers that are being read",
        "comments": "comments for them",
        "requests": "requests to look again",
    }
    for name, what in called.items():
        if erased.counts[name]:
            yield f"{erased.counts[name]:8}  {what}"
    if results is None:
        yield "No folder of results is named (--out): what lies in one is not looked at."
    else:
        yield from (f"  folder  {path}" for path in results.own(about.student))
        yield from (f"    anew  {path}" for path in results.of_class())
    if erased.redacted:
        yield "Their name is struck out of what is said of others:"
        yield from _some(erased.redacted)


def _what_stays(erased: Erased, named: Sequence[str]) -> Iterator[str]:
    if erased.still_named:
        yield "They are named still in what others wrote themselves, or as who decided; this is left as it is:"
        yield from _some(erased.still_named)
    if named:
        yield "They are named still here, and this is yours to delete:"
        yield from _some(named)
    if erased.too_short:
        yield f"Too short to be looked for in texts of others: {', '.join(map(repr, erased.too_short))}."


def _some(lines: Sequence[str]) -> Iterator[str]:
    yield from (f"  {line}" for line in lines[:_MOST_TOLD])
    if len(lines) > _MOST_TOLD:
        yield f"  and {len(lines) - _MOST_TOLD} more"


def _what_cannot_be_seen(done: Erased, folder: Path | None, submissions: Path | None) -> Iterator[str]:
    yield "What cannot be seen from here, and is yours to look after:"
    if submissions is None:
        came_in = f" (they came in: {', '.join(done.sources)})" if done.sources else ""
        yield (
            f"  what they handed in, where you keep it{came_in}. {program.name()} grade does not take it in again; "
            "it says so."
        )
    if folder is None:
        yield "  the folder of results, which was not named"
    yield "  texts that name them otherwise, as by a first name"
    yield "  backups, tables and zips that were written elsewhere, the learning platform, e-mails"
    yield "  their own folder and computer"


@person.command()
def copy(
    marks: Marks,
    student: Student,
    into: Annotated[Path, typer.Argument(metavar="ZIP", help="The zip to write.", dir_okay=False)],
    out: Out = None,
    force: Force = False,
    course: CourseFolder = None,
) -> None:
    """Write a zip for a student with all that is stored about them: records, and each file as it was received.

    It holds the names of the scorers. It does not hold the records of class-mates.
    """
    from labcourse.grading.erasure import copied
    from labcourse.grading.erasure.results import Results

    if into.exists() and not force:
        raise GradingError(f"{into} is there already; add --force to write over it.")
    found, folder = courses.find(course), results_beside(marks, out)
    with open_existing(marks) as book:
        results = None if folder is None else Results(folder, found)
        count = copied.write(into, book, results, student)
    say(f"All records and {count} files that were handed in: {into}")
