"""Commands on what is in a gradebook: regrade, mark, history, roster."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotflex.courseware.messages import _
from rotflex.instructor import course as courses
from rotflex.instructor.commands.options import (
    SOME_TROUBLE,
    Book,
    CourseFolder,
    Json,
    open_existing,
    open_gradebook,
)


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
    """Mark the answers in the gradebook again, by the key as it is now. No notebook is run."""
    from rotflex.instructor.regrade import regrade as mark_again
    from rotflex.instructor.reports.grades import Reports
    from rotflex.instructor.reports.result import result_of

    found = courses.find(course)
    with open_existing(gradebook) as book:
        changes = 0
        reports = None if out is None else Reports(out, found.catalogue)
        for before, after in mark_again(book, found, question or (), jobs):
            if reports is not None:
                reports.write(after)
            old, new = result_of(before), result_of(after)
            changes += old.marks != new.marks
            if as_json:
                typer.echo(json.dumps({"student": new.student, "before": old.total, "after": new.total}))
            elif old.marks != new.marks:
                typer.echo(
                    _("{student}: {before:g} → {after:g} of {out_of:g} points").format(
                        student=new.student, before=old.total, after=new.total, out_of=new.out_of
                    )
                )
        if reports is not None:
            reports.close()
    if not as_json:
        typer.echo(
            _("{changes} of the students have other marks now.").format(changes=changes)
            if changes
            else _("Nobody's marks changed.")
        )


def mark(
    student: Annotated[str, typer.Argument(help="Whose.")],
    question: Annotated[str, typer.Argument(help="As 1.11.")],
    part: Annotated[str, typer.Argument(help="As explanation.")],
    points: Annotated[float, typer.Argument(min=0, help="To give.")],
    reason: Annotated[str, typer.Option(help="For the student, and for the record.")],
    by: Annotated[str, typer.Option(help="Who gives them.")],
    gradebook: Book,
) -> None:
    """Give points to an answer that a person has read. They stay for as long as the answer is the same."""
    with open_existing(gradebook) as book:
        book.set_mark(student, question, part, points, reason, actor=by)
    typer.echo(
        _("{student}, {question}, {part}: {points:g}. Grade again to have it in the reports.").format(
            student=student, question=question, part=part, points=points
        )
    )


def history(
    student: Annotated[str | None, typer.Argument(help="Whose; everybody's if left out.")] = None,
    question: Annotated[str | None, typer.Option(help="Of this question only.")] = None,
    *,
    gradebook: Book,
) -> None:
    """Show every change of a mark: what it was and became, when, by whom, and why."""
    from rotflex.instructor.reports.safe_text import no_escapes

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
            typer.echo(no_escapes(f"{words}  {entry.actor}: {entry.reason}"))


def roster(
    file: Annotated[Path, typer.Argument(help="A CSV file with a line for each student.", dir_okay=False)],
    gradebook: Book,
) -> None:
    """Take the names of a class into the gradebook: a CSV with a heading; id, name, email and section are read."""
    with open_gradebook(gradebook) as book:
        report = book.import_roster(file)
    typer.echo(
        _("{added} added, {changed} changed, {unchanged} as they were.").format(
            added=report.added, changed=report.changed, unchanged=report.unchanged
        )
    )
    for problem in report.problems:
        typer.secho(problem, err=True, fg="yellow")
    if report.problems:
        raise typer.Exit(SOME_TROUBLE)
