"""Commands that run students' code, and show whether it can be run in isolation: doctor, grade."""

from __future__ import annotations

import json
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, tzinfo
from pathlib import Path
from typing import Annotated

import typer

from labcourse.errors import GradingError, IsolationError
from labcourse.grading import course as courses
from labcourse.grading.commands.options import (
    ALL_WELL,
    NOT_ISOLATED,
    SOME_TROUBLE,
    Again,
    CourseFolder,
    Json,
    Marks,
    Out,
    open_or_make,
    results_in,
)
from labcourse.messages import plural
from labcourse.student_id import GRADEBOOK_FILE, INTAKE_FILE


def doctor(as_json: Json = False) -> None:
    """Check that students' code can be isolated on this computer, by trying to break out of each layer.

    Exit code: 0 it can, 3 it cannot.
    """
    from labcourse.grading.running import isolation_report

    examined = isolation_report.examine()
    if as_json:
        typer.echo(json.dumps(examined.as_data()))
    else:
        isolation_report.print_state(examined)
    raise typer.Exit(ALL_WELL if examined.good else NOT_ISOLATED)


def grade(
    marks: Marks,
    submissions: Annotated[
        Path,
        typer.Argument(
            metavar="SUBMISSIONS",
            help="A folder, or a zip, with the submissions, as downloaded from a learning platform.",
        ),
    ],
    out: Out = None,
    course: CourseFolder = None,
    jobs: Annotated[int, typer.Option(min=1, help="Number of submissions to run in parallel.")] = 1,
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
            min=0, max=2**53, help="Seed for the inputs of students' functions.", show_default="the gradebook's secret"
        ),
    ] = None,
    every_cell: Annotated[
        bool, typer.Option("--every-cell", help="Also run the cells that only show something: slower, same marks.")
    ] = False,
    supply: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STUDENT:QUESTION.PART=VALUE",
            help="Supply a missing answer. It earns nothing; later answers can. An empty VALUE takes it back.",
        ),
    ] = None,
    times: Annotated[Path | None, typer.Option(help="A CSV with names and times of receipt.", dir_okay=False)] = None,
    time_zone: Annotated[
        str, typer.Option(help="Time zone of times without one (in names and zips), for example Europe/Berlin.")
    ] = "UTC",
    again: Again = None,
    as_json: Json = False,
    unsafe_no_isolation: Annotated[
        bool, typer.Option("--unsafe-no-isolation", help="Run students' code with your own rights.")
    ] = False,
) -> None:
    """Run and mark the submissions of a class. Unchanged submissions are not run again.

    MARKS is made if needed. Marks, grades.csv and all students' feedback are written there.

    Exit code: 0 all graded, 1 trouble with some submissions (they get the points that they earned), 2 nothing graded,
    3 nothing graded, because students' code cannot be isolated here.
    """
    if not math.isfinite(deadline):
        raise typer.BadParameter("It should be a number of seconds.", param_hint="--deadline")
    if not submissions.exists():  # or nothing is made
        raise GradingError(f"There is no folder {submissions}.")
    if submissions.is_dir() and not any(submissions.iterdir()):
        raise GradingError(f"There is nothing in {submissions}.")
    if (submissions / GRADEBOOK_FILE).is_file():
        raise GradingError(f"{submissions} is a class's folder of marks. Name that first, then the submissions.")
    folder = results_in(marks, out)
    if folder.resolve().is_relative_to(submissions.resolve()):
        raise GradingError(f"{folder} lies among the submissions: choose another folder for the results.")
    # The self-test mostly waits; meanwhile libraries are imported.
    checked = ThreadPoolExecutor(1).submit(_check_isolation, not unsafe_no_isolation, scheduler)
    from labcourse.grading.batch import Batch, Settings
    from labcourse.grading.intake.platforms import read_times
    from labcourse.grading.reports import intake_table
    from labcourse.grading.reports.changes import Before
    from labcourse.grading.reports.grades import Reports, make_folder
    from labcourse.grading.reports.live_report import JsonLines, Screen
    from labcourse.grading.running import isolation_report, supplied
    from labcourse.grading.running.runner import Limits

    zone = _zone(time_zone)
    when, problems = read_times(times, zone) if times else ({}, [])
    limits = Limits(cell_timeout, deadline, memory * 2**20, processes)
    try:
        found = courses.find(course)
        values = tuple(supplied.read(one, found.catalogue) for one in supply or ())
        settings = Settings(
            *(limits, jobs, scheduler, probe_seed, not unsafe_no_isolation, every_cell, values, when, zone),
            again=tuple(again or ()),
        )
        checked.result()
        make_folder(folder)
        decided = intake_table.read(folder / INTAKE_FILE)
        settings = replace(settings, decisions={one.key: text for one, text in decided.items() if text})
        with open_or_make(marks) as book:
            batch = Batch(submissions, found, book, settings)
            before = Before(book)
            progress = (JsonLines if as_json else Screen)(
                len(batch.students), [*batch.ignored, *problems], batch.absent
            )
            with Reports(folder, found, book, batch.students) as reports, progress:
                try:
                    for step in batch.grade():
                        progress.add(step.ran, reports.write(step.graded), before.changes(step.graded))
                finally:
                    open_rows = intake_table.write(folder / INTAKE_FILE, batch.doubts, decided)
        to_decide = (
            f"What cannot be known for certain is in {folder / INTAKE_FILE}, with what was assumed "
            f"({plural(open_rows, '{count} row', '{count} rows')}): write what is right under decision and grade again."
        )
        for line in filter(None, (reports.closed, reports.unknown, reports.hints, to_decide if open_rows else "")):
            typer.echo(line, err=True)
    except IsolationError as error:
        isolation_report.print_refusal(error)
        raise typer.Exit(NOT_ISOLATED) from None
    raise typer.Exit(SOME_TROUBLE if progress.trouble else ALL_WELL)


def _zone(name: str) -> tzinfo:
    from zoneinfo import ZoneInfo

    try:
        return UTC if name == "UTC" else ZoneInfo(name)
    except (ValueError, OSError, LookupError):
        raise typer.BadParameter(
            f"There is no time zone {name!r}; write it as Europe/Berlin.", param_hint="--time-zone"
        ) from None


def _check_isolation(isolated: bool, scheduler: str | None) -> None:
    """Try to break out before any submission can. (On a cluster it is the workers' isolation that counts.)"""
    from labcourse.grading.isolation import unisolated
    from labcourse.grading.running import isolation_report

    if isolated and scheduler is None:
        isolation_report.check()
    elif not isolated:
        unisolated.check_allowed()
