"""Commands that follow outcomes: outcomes report, outcomes sheets."""

from __future__ import annotations

from typing import Annotated

import typer

from labcourse.grading import course as courses
from labcourse.grading.commands.options import CourseFolder, Marks, Out, open_existing, results_in
from labcourse.messages import plural
from labcourse.safe_text import say

outcomes = typer.Typer(
    name="outcomes", help="Show the class's levels in each outcome, and fill in scoring sheets.", no_args_is_help=True
)


@outcomes.command()
def report(
    marks: Marks,
    out: Out = None,
    course: CourseFolder = None,
    sections: Annotated[bool, typer.Option(help="Show the sections of the class side by side.")] = True,
) -> None:
    """Write the levels of the class in each criterion and outcome: attainment.html, attainment.csv, students.csv.

    Groups smaller than course.toml allows are not shown. students.csv has names: do not publish it.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading.outcomes import class_report

    found, folder = courses.find(course), results_in(marks, out)
    with open_existing(marks) as book:
        done = class_report.write(folder, found, book, sections)
    students = plural(done.students, "{count} student", "{count} students")
    typer.echo(f"{students}: {folder / class_report.PAGE_FILE}")
    say(*done.notes)
    say(f"{class_report.STUDENTS_FILE} has names: it is for you, and not for an accreditation.")


@outcomes.command()
def sheets(
    marks: Marks,
    out: Out = None,
    course: CourseFolder = None,
    student: Annotated[
        list[str] | None, typer.Option(help="Only the sheets of this student; may be given several times.")
    ] = None,
) -> None:
    """Write each student's scoring sheets as HTML, PDF and CSV, and one CSV of the whole class.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading.outcomes import sheet_files

    found, folder = courses.find(course), results_in(marks, out)
    with open_existing(marks) as book:
        count, notes = sheet_files.write(folder, found, book, student or ())
    students = plural(count, "{count} student", "{count} students")
    typer.echo(f"{students}: {folder / sheet_files.FOLDER}")
    say(*notes)
