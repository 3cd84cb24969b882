"""Commands on what is in a gradebook: regrade, report, mark, comment, history, roster."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotflex.courseware.messages import _
from rotflex.errors import GradingError
from rotflex.instructor import course as courses
from rotflex.instructor.commands.options import (
    SOME_TROUBLE,
    Book,
    CourseFolder,
    Json,
    open_existing,
    open_gradebook,
)

if TYPE_CHECKING:
    from rotflex.instructor.gradebook import Gradebook, MarkRecord

_SHOWN = 60  # characters of an answer that was marked


def regrade(
    gradebook: Book,
    course: CourseFolder = None,
    question: Annotated[
        list[str] | None, typer.Option(help="Mark only this question again; may be given several times.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write grades.csv and the feedback here anew.", file_okay=False)
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Submissions to mark at a time.")] = 1,
    as_json: Json = False,
) -> None:
    """Mark the answers in the gradebook again, by the key as it is now, and tell what changed. No notebook is run.

    Exit code: 0 all marked, 1 some could not be marked (their marks stay as they were), 2 nothing marked.
    """
    from contextlib import ExitStack

    from rotflex.instructor.regrade import key_faults
    from rotflex.instructor.regrade import regrade as mark_again
    from rotflex.instructor.reports.changes import changes
    from rotflex.instructor.reports.grades import Reports

    found = courses.find(course)
    changed = failed = 0
    faults: dict[str, None] = {}
    with open_existing(gradebook) as book, ExitStack() as stack:
        reports = None if out is None else stack.enter_context(Reports(out, found, book))
        for done in mark_again(book, found, question or (), jobs):
            told = changes(done.before, done.after)
            changed += bool(told.parts)
            failed += bool(done.problem)
            faults |= dict.fromkeys(key_faults(done.after))
            if as_json:
                typer.echo(json.dumps({**told.as_data(), "problem": done.problem}))
                continue
            if done.problem:
                _say(
                    _("{student}: {why} The marks stay as they were.").format(student=told.student, why=done.problem),
                    err=True,
                )
            if told.parts:
                _say(str(told))
    for line in (*faults, *([reports.hints] if reports and reports.hints else ())):
        _say(line, err=True)
    if not as_json:
        typer.echo(
            _("{changes} of the students have other marks now.").format(changes=changed)
            if changed
            else _("Nobody's marks changed.")
        )
    if failed or faults:
        raise typer.Exit(SOME_TROUBLE)


def report(
    gradebook: Book,
    out: Annotated[Path, typer.Option(help="Folder for grades.csv and the feedback; made if needed.", file_okay=False)],
    course: CourseFolder = None,
) -> None:
    """Write grades.csv and the feedback of everybody in the gradebook and its roster. Nothing is run or marked.

    Exit code: 0 all written, 2 something could not be.
    """
    from rotflex.instructor.reports.grades import Reports

    found = courses.find(course)
    with open_existing(gradebook) as book:
        reports = Reports(out, found, book)
        count = reports.write_all()
    typer.echo(_("{count} students: {out}").format(count=count, out=out))
    for line in filter(None, (reports.closed, reports.hints)):
        typer.echo(line)


def mark(
    student: Annotated[str, typer.Argument(help="Whose.")],
    question: Annotated[str, typer.Argument(help="As 1.11.")],
    part: Annotated[str, typer.Argument(help="As explanation.")],
    points: Annotated[float, typer.Argument(min=0, help="To give.")],
    reason: Annotated[str, typer.Option(help="For the student, and for the record.")],
    by: Annotated[str, typer.Option(help="Who gives them.")],
    gradebook: Book,
    expect: Annotated[
        float | None,
        typer.Option(
            help="The points that these replace. Needed where a person has given some already.", show_default="none yet"
        ),
    ] = None,
) -> None:
    """Give points to an answer that a person has read. They stay for as long as the answer is the same.

    Points that a person gave before are replaced only if --expect names them: of two who mark the same answer, the
    second is told who was first.
    """
    with open_existing(gradebook) as book:
        seen = _seen(book, student, question, part)
        book.set_mark(student, question, part, points, reason, by, _expected(seen, expect))
    given = " ".join(seen.given.split()) if seen is not None else ""
    shown = given if len(given) <= _SHOWN else f"{given[:_SHOWN]}…"
    _say(
        _("{student}, {question}, {part}: {points:g}, for the answer {shown!r}. rotflex report writes it down.").format(
            student=student, question=question, part=part, points=points, shown=shown
        )
    )


def _seen(book: Gradebook, student: str, question: str, part: str) -> MarkRecord | None:
    """A mark as it is now; None if there is none."""
    graded = book.current(student)
    marks = () if graded is None else graded.marks
    return next((one for one in marks if one.where == (question, part)), None)


def _expected(seen: MarkRecord | None, points: float | None) -> MarkRecord | None:
    """What is to be replaced: a mark of these points; without any, one that no person gave."""
    from rotflex.instructor.gradebook import GIVEN_BY_A_PERSON
    from rotflex.instructor.verdicts import Status

    if seen is None:
        return None
    if points is not None:
        return replace(seen, points=points)
    return replace(seen, status=Status.FOR_A_PERSON.value) if seen.status == GIVEN_BY_A_PERSON else seen


def comment(
    student: Annotated[str, typer.Argument(help="To whom.")],
    text: Annotated[str, typer.Argument(help="What there is to say; it is shown in the feedback.")],
    by: Annotated[str, typer.Option(help="Who says it.")],
    gradebook: Book,
    question: Annotated[str | None, typer.Option(help="On this question, as 1.11; else on all of the work.")] = None,
) -> None:
    """Write a word to a student, on a question or on everything."""
    with open_existing(gradebook) as book:
        graded = book.current(student)
        if question is not None and graded is not None and question not in {one.question for one in graded.marks}:
            raise GradingError(
                _("{student!r} has no marks for a question {question!r}: a word on it would be seen nowhere.").format(
                    student=student, question=question
                )
            )
        book.comment(student, text, by, question)
    _say(_("{student}: noted. rotflex report writes it down.").format(student=student))


def history(
    student: Annotated[str | None, typer.Argument(help="Whose; everybody's if left out.")] = None,
    question: Annotated[str | None, typer.Option(help="Of this question only.")] = None,
    *,
    gradebook: Book,
) -> None:
    """Show every change of a mark: what it was and became, when, by whom, and why."""
    with open_existing(gradebook) as book:
        for entry in book.audit(student, question):
            before, after = (
                "–" if one is None else f"{one.points:g} ({one.status})" for one in (entry.before, entry.after)
            )
            words = _("{when:%Y-%m-%d %H:%M} UTC  {student}  {question} {part}: {before} → {after}").format(
                when=entry.when,
                student=entry.student,
                question=entry.question,
                part=entry.part,
                before=before,
                after=after,
            )
            _say(f"{words}  {entry.actor}: {entry.reason}")


def roster(
    file: Annotated[Path, typer.Argument(help="A CSV file with a line for each student.", dir_okay=False)],
    gradebook: Book,
) -> None:
    """Take the names of a class into the gradebook: a CSV with a heading; id, name, email and section are read.

    Exit code: 0 all taken, 1 some lines were not, 2 nothing taken.
    """
    with open_gradebook(gradebook) as book:
        taken = book.import_roster(file)
    typer.echo(
        _("{added} added, {changed} changed, {unchanged} as they were.").format(
            added=taken.added, changed=taken.changed, unchanged=taken.unchanged
        )
    )
    for problem in taken.problems:
        typer.secho(problem, err=True, fg="yellow")
    if taken.problems:
        raise typer.Exit(SOME_TROUBLE)


def _say(words: str, err: bool = False) -> None:
    """Words that may hold a student's, without what steers a terminal."""
    from rotflex.instructor.reports.safe_text import no_escapes

    typer.echo(no_escapes(words), err=err)
