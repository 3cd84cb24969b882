"""Commands about a course: new, make-notebooks, check-course, release."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labcourse import program
from labcourse.grading import course as courses
from labcourse.grading.commands.options import SOME_TROUBLE, CourseFolder
from labcourse.messages import plural


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the course's folder and of its package.")],
) -> None:
    """Make a folder with a small complete course, as a start for your own."""
    from labcourse.grading.new import make

    folder = make(name, Path.cwd())
    typer.echo(f"{folder}\nGo on there: {program.name()} make-notebooks, then {program.name()} check-course.")


def release(
    out: Annotated[
        Path, typer.Argument(metavar="OUT", help="Folder for the release; made if needed.", file_okay=False)
    ],
    course: CourseFolder = None,
    with_data: Annotated[bool, typer.Option("--with-data", help="Include the sample recordings.")] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Delete an earlier release in OUT.")] = False,
    keep: Annotated[
        bool, typer.Option("--keep/--no-keep", help="Store the zip; grading needs it for work begun with it.")
    ] = True,
) -> None:
    """Make the folder and zip that students get, without solutions, key and the instructor's modules."""
    from labcourse.grading.release import releases
    from labcourse.grading.release.student_course import release as make

    found = courses.find(course)
    made = make(found, out, with_data, replace)
    count = plural(len(made.notebooks), "{count} notebook", "{count} notebooks")
    typer.echo(f"{count}: {', '.join(made.notebooks)}")
    typer.echo(f"{made.folder}\n{made.archive}")
    if keep:
        typer.echo(f"Release {made.id}, kept as {releases.store(found, made.archive, made.id)}")
    else:
        typer.echo(f"Release {made.id}, not kept: what is done with it is run with the course as it is.")


def make_notebooks(course: CourseFolder = None) -> None:
    """Make the student notebooks in notebooks/ from the notebooks with solutions."""
    from labcourse.grading.release.student_course import write_notebooks

    for path in write_notebooks(courses.find(course)):
        typer.echo(str(path))


def check_course(
    course: CourseFolder = None,
    run: Annotated[
        bool,
        typer.Option("--run/--no-run", help="Run the notebooks without and with solutions, and mark the solutions."),
    ] = True,
) -> None:
    """Find what is missing or contradictory in a course: questions, key, cells, numbers in texts.

    Exit code: 0 no problems, 1 some problems.
    """
    from labcourse.grading.course_check import check

    found = courses.find(course)
    count = 0
    for finding in check(found, run):
        count += 1
        typer.echo(str(finding))
    asked = len(found.catalogue.everything)
    if count:
        typer.echo(f"{count} found.")
        raise typer.Exit(SOME_TROUBLE)
    typer.echo(
        "{asked} questions, tables and reports in {notebooks}: everything fits.".format(
            asked=asked, notebooks=plural(len(found.notebooks), "{count} notebook", "{count} notebooks")
        )
    )
