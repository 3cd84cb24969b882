"""The instructor's commands. ``rotflex.cli`` adds them where this package is."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotflex.courseware.messages import _
from rotflex.courseware.student_id import GRADEBOOK_FILE
from rotflex.errors import GradingError, IsolationError
from rotflex.instructor import course as courses

if TYPE_CHECKING:
    from rotflex.instructor.batch import Settings
    from rotflex.instructor.gradebook import Gradebook

ALL_WELL, SOME_TROUBLE, NOT_ISOLATED = 0, 1, 3  # exit codes; 2 is for any error that stops the command

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


def register(app: typer.Typer) -> None:
    """Add the instructor's commands to the application."""
    for command in (release, notebooks, check_course, doctor, grade, regrade, mark, history, roster):
        app.command()(command)


def release(
    out: Annotated[Path, typer.Argument(help="Folder for the release; made if needed.", file_okay=False)],
    course: CourseFolder = None,
    with_data: Annotated[bool, typer.Option("--with-data", help="Hand out the sample recordings, too.")] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Delete an earlier release in OUT.")] = False,
) -> None:
    """Make the students' folder and zip: no solutions, no key, none of the instructor's modules."""
    from rotflex.instructor.release.student_course import release as make

    made = make(courses.find(course), out, with_data, replace)
    typer.echo(
        _("{count} notebooks: {notebooks}").format(count=len(made.notebooks), notebooks=", ".join(made.notebooks))
    )
    typer.echo(f"{made.folder}\n{made.archive}")


def notebooks(course: CourseFolder = None) -> None:
    """Derive the student notebooks in notebooks/ from the course's anew."""
    from rotflex.instructor.release.student_course import write_notebooks

    for path in write_notebooks(courses.find(course)):
        typer.echo(str(path))


def check_course(
    course: CourseFolder = None,
    run: Annotated[
        bool, typer.Option("--run/--no-run", help="Run the notebooks with solutions, and mark what they answer.")
    ] = True,
) -> None:
    """Say what is missing in a course, or contradicts itself: questions, key, cells, numbers in texts.

    Exit code: 0 everything fits, 1 something does not.
    """
    from rotflex.instructor.course_check import check

    found = courses.find(course)
    count = 0
    for finding in check(found, run):
        count += 1
        typer.echo(str(finding))
    asked = len(found.catalogue.everything)
    if count:
        typer.echo(_("{count} found.").format(count=count), err=True)
        raise typer.Exit(SOME_TROUBLE)
    typer.echo(
        _("{asked} questions, tables and reports in {notebooks} notebooks: everything fits.").format(
            asked=asked, notebooks=len(found.notebooks)
        )
    )


def doctor(as_json: Json = False) -> None:
    """Show, layer by layer, whether students' code can be run in isolation here, by trying to break out.

    Exit code: 0 it can, 3 it cannot.
    """
    from rotflex.instructor.running import isolation_report

    examined = isolation_report.examine()
    if as_json:
        typer.echo(json.dumps(examined.as_data()))
    else:
        isolation_report.show(examined)
    raise typer.Exit(ALL_WELL if examined.good else NOT_ISOLATED)


def grade(
    submissions: Annotated[
        Path, typer.Argument(help="Holds a folder or a zip for each student, named by their ID.", file_okay=False)
    ],
    out: Annotated[Path, typer.Option(help="Folder for grades.csv and the feedback; made if needed.", file_okay=False)],
    course: CourseFolder = None,
    gradebook: Annotated[
        str | None, typer.Option(help="A file, or the URL of a database.", show_default=f"OUT/{GRADEBOOK_FILE}")
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Submissions to run at a time.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="Run on the workers of this dask.distributed scheduler, as tcp://host:8786.")
    ] = None,
    cell_timeout: Annotated[int, typer.Option(min=1, help="Seconds that a cell may take.")] = 60,
    deadline: Annotated[float, typer.Option(min=1, help="Seconds that a submission may take.")] = 600,
    memory: Annotated[int, typer.Option(min=256, help="Megabytes that a submission may take.")] = 2048,
    processes: Annotated[int, typer.Option(min=8, help="Processes that a submission may have.")] = 100,
    probe_seed: Annotated[
        int | None,
        typer.Option(
            min=0, max=2**53, help="For the inputs of students' functions.", show_default="by the gradebook's secret"
        ),
    ] = None,
    every_cell: Annotated[
        bool, typer.Option("--every-cell", help="Run the cells that only show something, too: slower, same marks.")
    ] = False,
    as_json: Json = False,
    unsafe_no_isolation: Annotated[
        bool, typer.Option("--unsafe-no-isolation", help="Run students' code with your own rights.")
    ] = False,
) -> None:
    """Run and mark a class. What is in the gradebook already and has not changed is not run again.

    Exit code: 0 all graded, 1 there was trouble with some submissions (they score what they earned), 2 nothing graded,
    3 nothing graded, as students' code cannot be isolated here.
    """
    from rotflex.instructor.batch import Batch, Settings
    from rotflex.instructor.reports.grades import Reports
    from rotflex.instructor.reports.live_report import JsonLines, Screen
    from rotflex.instructor.running import intake, isolation_report
    from rotflex.instructor.running.runner import Limits

    if not math.isfinite(deadline):
        raise typer.BadParameter(_("It should be a number of seconds."), param_hint="--deadline")
    if out.resolve().is_relative_to(submissions.resolve()):
        raise GradingError(
            _("{out} lies among the submissions: choose another folder for the results.").format(out=out)
        )
    limits = Limits(cell_timeout, deadline, memory * 2**20, processes)
    settings = Settings(limits, jobs, scheduler, probe_seed, not unsafe_no_isolation, every_cell)
    try:
        intake.submissions(submissions)  # or nothing is made
        found = courses.find(course)
        _check_isolation(settings)
        reports = Reports(out, found.catalogue)
        with _open(gradebook or str(out / GRADEBOOK_FILE)) as book:
            batch = Batch(submissions, found, book, settings)
            progress = (JsonLines if as_json else Screen)(len(batch), batch.ignored, batch.absent)
            with reports, progress:
                for step in batch.grade():
                    progress.add(step.ran, reports.write(step.graded))
    except IsolationError as error:
        isolation_report.refuse(error)
        raise typer.Exit(NOT_ISOLATED) from None
    raise typer.Exit(SOME_TROUBLE if progress.trouble else ALL_WELL)


def _check_isolation(settings: Settings) -> None:
    """Try to break out before any submission can. (On a cluster it is the workers' isolation that counts.)"""
    from rotflex.instructor.running import isolation_report

    if settings.isolated and settings.scheduler is None:
        isolation_report.check()
    elif not settings.isolated:
        isolation_report.check_unisolated()


def _open(url: str) -> Gradebook:
    from rotflex.instructor.gradebook import Gradebook

    return Gradebook(url)


def _open_existing(url: str) -> Gradebook:
    """A gradebook that something is to be done with: a slip in its name must not make a new one."""
    if "://" not in url and not Path(url).is_file():
        raise GradingError(_("There is no gradebook {url}. (rotflex grade makes one.)").format(url=url))
    return _open(url)


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
    with _open_existing(gradebook) as book:
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
    with _open_existing(gradebook) as book:
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

    with _open_existing(gradebook) as book:
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
    with _open(gradebook) as book:
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
