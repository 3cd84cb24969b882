"""Commands that follow outcomes: outcomes, sheets."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from labcourse.grading import course as courses
from labcourse.grading.commands.options import CourseFolder, Marks, Out, open_existing, results_in
from labcourse.messages import plural
from labcourse.safe_text import say


class Groups(StrEnum):
    """What a class is divided into."""

    SECTION = "section"
    NONE = "none"


def outcomes(
    marks: Marks,
    out: Out = None,
    course: CourseFolder = None,
    by: Annotated[Groups, typer.Option(help="The groups that are shown beside each other.")] = Groups.SECTION,
) -> None:
    """Write how the class does in each criterion and outcome: attainment.html, attainment.csv, students.csv.

    Nothing is shown of groups that are smaller than course.toml allows; students.csv has names, and is yours only.

    Exit code: 0 all written, 2 something could not be.
    """
    from labcourse.grading.outcomes import class_report

    found, folder = courses.find(course), results_in(marks, out)
    with open_existing(marks) as book:
        done = class_report.write(folder, found, book, by is Groups.SECTION)
    students = plural(done.students, "{count} student", "{count} students")
    typer.echo(f"{students}: {folder / class_report.PAGE_FILE}")
    say(*done.notes)
    say(f"{class_report.STUDENTS_FILE} has names: it is for you, and not for an accreditation.")


def sheets(
    marks: Marks,
    out: Out = None,
    course: CourseFolder = None,
    student: Annotated[
        list[str] | None, typer.Option(help="The sheets of this student only; may be given several times.")
    ] = None,
) -> None:
    """Write each student's scoring sheets, filled in: HTML, PDF and CSV, and one CSV of all cells of the class.

    Exit code: 0 all written, 2 something could not be.
    """
    from labcourse.grading.outcomes import sheet_files

    found, folder = courses.find(course), results_in(marks, out)
    with open_existing(marks) as book:
        count, notes = sheet_files.write(folder, found, book, student or ())
    students = plural(count, "{count} student", "{count} students")
    typer.echo(f"{students}: {folder / sheet_files.FOLDER}")
    say(*notes)
