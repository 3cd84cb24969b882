"""Commands on what is in a gradebook: regrade, report, mark, comment, history, roster."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labcourse import program
from labcourse.errors import GradebookError, GradingError
from labcourse.grading import course as courses
from labcourse.grading.commands.options import (
    SOME_TROUBLE,
    Again,
    By,
    CourseFolder,
    Json,
    Marks,
    Out,
    Part,
    Question,
    Student,
    open_existing,
    open_or_make,
    results_beside,
    results_in,
)
from labcourse.messages import plural
from labcourse.safe_text import say

if TYPE_CHECKING:
    from labcourse.grading.gradebook import Gradebook, MarkRecord

_SHOWN = 60  # characters of an answer that was marked


def regrade(
    marks: Marks,
    course: CourseFolder = None,
    question: Annotated[
        list[str] | None, typer.Option(help="Mark only this question again; may be given several times.")
    ] = None,
    out: Out = None,
    jobs: Annotated[int, typer.Option(min=1, help="Number of submissions to mark in parallel.")] = 1,
    as_json: Json = False,
) -> None:
    """Mark all answers again with the present key, and show what changed. No notebook is run.

    Marks that a person gave stay; if the key would give other points, they are listed. grades.csv and the feedback are
    written anew; if MARKS is a database's URL, --out names the folder for them.

    Exit code: 0 all marked, 1 some could not be marked (their marks stay), 2 nothing marked.
    """
    from contextlib import ExitStack

    from labcourse.grading.batch import regrade as mark_again
    from labcourse.grading.graded_run import key_faults
    from labcourse.grading.reports.changes import changes
    from labcourse.grading.reports.grades import Reports

    found, folder = courses.find(course), results_beside(marks, out)
    students = changed = failed = 0
    faults: dict[str, None] = {}
    with open_existing(marks) as book, ExitStack() as stack:
        reports = None if folder is None else stack.enter_context(Reports(folder, found, book))
        for done in mark_again(book, found, question or (), jobs):
            change = changes(done.before, done.after)
            students += 1
            changed += bool(change.parts)
            failed += bool(done.problem)
            faults |= dict.fromkeys(key_faults(done.after))
            if as_json:
                left = [one.as_data() for one in done.unchanged]
                typer.echo(json.dumps({**change.as_data(), "left_alone": left, "problem": done.problem}))
                continue
            if done.problem:
                say(
                    f"{change.student}: {done.problem} The marks stay as they were.",
                    err=True,
                )
            if change.parts:
                say(str(change))
            say(*(f"{change.student}, {one}" for one in done.unchanged))
    for line in (*faults, *([reports.hints] if reports and reports.hints else ())):
        say(line, err=True)
    if not as_json:
        typer.echo(
            "Other marks than before: {students}. The same: {same}.".format(
                students=plural(changed, "{count} student", "{count} students"), same=students - changed
            )
            if changed
            else "Nobody's marks changed."
        )
    if failed or faults:
        raise typer.Exit(SOME_TROUBLE)


def report(
    marks: Marks,
    out: Out = None,
    course: CourseFolder = None,
) -> None:
    """Write grades.csv and all students' feedback from the gradebook. Nothing is run or marked.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading.reports.grades import Reports

    found, folder = courses.find(course), results_in(marks, out)
    with open_existing(marks) as book:
        reports = Reports(folder, found, book)
        count = reports.write_all()
    typer.echo(f"{plural(count, '{count} student', '{count} students')}: {folder}")
    for line in filter(None, (reports.closed, reports.unknown, reports.hints)):
        typer.echo(line)


def mark(
    marks: Marks,
    student: Student,
    question: Question,
    part: Part,
    points: Annotated[float, typer.Argument(metavar="POINTS", min=0, help="Points to give.")],
    reason: Annotated[str, typer.Option(help="The reason, for the student and for the record.")],
    by: By,
    expect: Annotated[
        float | None,
        typer.Option(help="The points that are replaced; needed if a person gave them.", show_default="none yet"),
    ] = None,
) -> None:
    """Give points to one answer by hand. They stay until the answer changes.

    Points that a person gave are replaced only if --expect states them. So if two persons mark the same answer, the
    second one gets a message with the name of the first.
    """
    with open_existing(marks) as book:
        seen = _seen(book, student, question, part)
        book.set_mark(student, question, part, points, reason, by, _expected(seen, expect))
    given = " ".join(seen.given.split()) if seen is not None else ""
    shown = given if len(given) <= _SHOWN else f"{given[:_SHOWN]}…"
    say(f"{student}, {question}, {part}: {points:g}, for the answer {shown!r}. {program.name()} report writes it down.")


def _seen(book: Gradebook, student: str, question: str, part: str) -> MarkRecord | None:
    """A mark as it is now; None if there is none."""
    graded = book.current(student)
    marks = () if graded is None else graded.marks
    return next((one for one in marks if one.where == (question, part)), None)


def _expected(seen: MarkRecord | None, points: float | None) -> MarkRecord | None:
    """What is to be replaced: a mark of these points; without any, one that no person gave."""
    from labcourse.grading.gradebook import GIVEN_BY_A_PERSON
    from labcourse.grading.verdicts import Status

    if seen is None:
        return None
    if points is not None:  # 1/3 is shown as 0.333333
        return seen if f"{points:g}" == f"{seen.points:g}" else replace(seen, points=points)
    return replace(seen, status=Status.FOR_A_PERSON.value) if seen.status == GIVEN_BY_A_PERSON else seen


def comment(
    marks: Marks,
    student: Student,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="Your comment; it is shown in the student's feedback.")],
    by: By,
    question: Annotated[str | None, typer.Option(help="The question, as 1.11; without it: the whole work.")] = None,
) -> None:
    """Write a comment into a student's feedback, on one question or on the whole work."""
    with open_existing(marks) as book:
        graded = book.current(student)
        if question is not None and graded is not None and question not in {one.question for one in graded.marks}:
            raise GradingError(
                f"{student!r} has no marks for a question {question!r}: a word on it would be seen nowhere."
            )
        book.comment(student, text, by, question)
    say(f"{student}: noted. {program.name()} report writes it down.")


def history(
    marks: Marks,
    student: Annotated[
        str | None, typer.Argument(metavar="STUDENT", help="The student's ID; without it, all students.")
    ] = None,
    question: Annotated[str | None, typer.Option(help="Only changes of this question.")] = None,
) -> None:
    """Show every change of a mark: before and after, when, by whom, and why."""
    with open_existing(marks) as book:
        for entry in book.audit(student, question):
            before, after = (
                "–" if one is None else f"{one.points:g} ({one.status})" for one in (entry.before, entry.after)
            )
            words = (
                f"{entry.when:%Y-%m-%d %H:%M} UTC  {entry.student}  {entry.question} {entry.part}: {before} → {after}"
            )
            say(f"{words}  {entry.actor}: {entry.reason}")


def roster(
    marks: Marks,
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE", help="A CSV file with a line for each student.", dir_okay=False, show_default=False
        ),
    ] = None,
    remove: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID",
            help="Remove this student, if the gradebook has only their name; may be given several times.",
        ),
    ] = None,
    again: Again = None,
) -> None:
    """Read the names of a class from a CSV file into the gradebook, which is made if needed.

    The columns id, name, email and section are read. An empty cell changes nothing; a cell with - deletes the
    stored value. Students who are not in the file stay: --remove removes an ID that was mistyped, if nothing was
    handed in, graded or written under it.

    Exit code: 0 all read, 1 some lines were not read, or a student was not removed, 2 nothing read.
    """
    if file is None and not remove:
        raise GradingError("Say what the roster is: a CSV file; or by --remove whom to take out.")
    troubles: list[str] = []
    # Without a roster a slip in the gradebook's name must not make a new one.
    with open_existing(marks) if file is None else open_or_make(marks) as book:
        if file is not None:
            troubles += _taken_in(book, file, again or ())
        for student in remove or ():
            try:
                gone = book.remove(student)
            except GradebookError as error:
                troubles.append(str(error))
            else:
                say(f"{gone.student} is no longer in the gradebook.")
    for trouble in troubles:
        say(trouble, err=True)
    if troubles:
        raise typer.Exit(SOME_TROUBLE)


def _taken_in(book: Gradebook, file: Path, again: Sequence[str]) -> tuple[str, ...]:
    """Take a roster in, and tell of it; what was not taken."""
    taken = book.import_roster(file, again)
    typer.echo(f"{taken.added} added, {taken.changed} changed, {taken.unchanged} as they were.")
    say(*taken.notes)
    return taken.problems
