"""Commands of an instructor's day: status, publish; requests add, answer, list."""

from __future__ import annotations

from collections.abc import Sequence
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
    Marks,
    Out,
    Part,
    Question,
    Student,
    open_existing,
    results_beside,
    results_in,
)
from labcourse.safe_text import say

if TYPE_CHECKING:
    from labcourse.grading.gradebook import Request


def status(marks: Marks, course: CourseFolder = None, out: Out = None) -> None:
    """Show the state of the class: who handed in, who is in trouble, what waits for you.

    The same is written to class.html in the folder of results. This page names students: do not publish it.

    Exit code: 0 all shown, 2 something could not be read or written.
    """
    from labcourse import files
    from labcourse.grading.overview import glance, shown

    folder = results_beside(marks, out)
    found = courses.find(course)
    with open_existing(marks) as book:
        seen = glance.at(book, found)
    for line in shown.lines(seen):
        typer.echo(line)
    if folder is None:
        typer.echo("\nNo page was written: say where by --out.")
        return
    page = folder / shown.CLASS_FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        files.write(page, shown.page(seen))
    except OSError as error:
        raise GradingError(f"{page} cannot be written: {error.strerror}.") from None
    typer.echo(f"\nThe same as a page: {page}")


def publish(
    marks: Marks,
    by: By,
    note: Annotated[str, typer.Option(help="A remark for the record, for example: without the reports.")] = "",
    course: CourseFolder = None,
    out: Out = None,
) -> None:
    """Publish feedback: write all students' pages, record the time, and list what is not ready.

    Your platform delivers the pages to students. If feedback opens later by course.toml, the pages show only this date
    and problems with the submission, and nothing is recorded as published.

    Exit code: 0 published, 1 the pages are not open yet, 2 something could not be written.
    """
    from datetime import UTC, datetime

    from labcourse.grading.overview import published
    from labcourse.grading.overview.section import moment
    from labcourse.grading.reports.grades import Reports
    from labcourse.messages import plural

    folder = results_in(marks, out)
    found = courses.find(course)
    begun = datetime.now(UTC)  # a change while pages are written may be on none of them; it is reported the next time
    with open_existing(marks) as book:
        before = book.requests.publications()
        changed = published.changed_since(book.audit(), before[-1].when) if before else []
        count = Reports(folder, found, book).write_all()
        unready = published.not_ready(book, found.settings, begun)
        is_open = found.settings.feedback.is_open(begun)
        done = book.requests.publish(by, note, begun) if is_open else None
    typer.echo(f"Pages of {plural(count, '{count} student', '{count} students')}: {folder}")
    say(*unready, *_not_renewed(folder))
    if done is None:
        raise typer.Exit(SOME_TROUBLE)
    typer.echo(f"Given back on {moment(done.when)}, by {done.actor}.")
    if before:
        students = sorted({one.student for one in changed})
        say(
            "Since {when} marks of {students} have changed; tell them: {names}.".format(
                when=moment(before[-1].when),
                students=plural(len(students), "{count} student", "{count} students"),
                names=", ".join(students),
            )
            if students
            else f"No mark has changed since {moment(before[-1].when)}."
        )


def _not_renewed(folder: Path) -> list[str]:
    """Which commands write what lies in a folder of results and is not made anew with the pages."""
    from labcourse.grading.outcomes import class_report, sheet_files

    command = f"{program.name()} outcomes"
    files = {f"{command} report": class_report.PAGE_FILE, f"{command} sheets": sheet_files.FOLDER}
    there = {one: name for one, name in files.items() if (folder / name).exists()}
    if not there:
        return []
    return [
        f"As they were before, and not written anew: {', '.join(there.values())} (for that say {', '.join(there)})."
    ]


requests = typer.Typer(
    name="requests", help="Note, list and answer students' requests to look at an answer again.", no_args_is_help=True
)


@requests.command()
def add(
    marks: Marks,
    student: Student,
    question: Question,
    part: Part,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="The student's request; it is shown in their feedback.")],
) -> None:
    """Note a student's request to look at an answer again. It stays open until it is answered."""
    with open_existing(marks) as book:
        made = book.requests.make(student, (question, part), text)
    say(f"Request {made.number} of {made.student} is noted.")


@requests.command("list")
def list_requests(
    marks: Marks,
    everything: Annotated[bool, typer.Option("--all", help="Include answered requests.")] = False,
) -> None:
    """List students' requests to look at an answer again."""
    with open_existing(marks) as book:
        there = book.requests.all(open_only=not everything)
    if not there:
        typer.echo("There are no requests." if everything else "No request is open.")
    say(*_lines(there))


@requests.command()
def answer(
    marks: Marks,
    number: Annotated[int, typer.Argument(metavar="NUMBER", help="The request's number in 'requests list'.")],
    text: Annotated[str, typer.Argument(metavar="TEXT", help="Your answer; it is shown in the student's feedback.")],
    by: By,
) -> None:
    """Answer a student's request. This does not change the mark; the command 'mark' does."""
    with open_existing(marks) as book:
        done = book.requests.answer(number, by, text)
    say(
        f"Request {done.number} of {done.student}, {done.question} {done.part}, is answered. "
        f"{program.name()} report writes it down."
    )


def _lines(there: Sequence[Request]) -> list[str]:
    from labcourse.grading.overview.section import moment

    lines = []
    for one in there:
        lines.append(f"{one.number}  {moment(one.made)}  {one.student}  {one.question} {one.part}: {one.text}")
        if one.answered is not None:
            lines.append(f"    {moment(one.answered)}  {one.answered_by}: {one.answer}")
    return lines
