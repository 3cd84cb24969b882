"""Scoring sheets as files: a page, a PDF and a table for each, and a table of all cells of the class.

What a roster and students say goes into the page escaped, into tables as text, and into typst as data, never as markup.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import files, program
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes import pages, sheet_layout
from labcourse.grading.outcomes.levels import standings
from labcourse.grading.outcomes.sheet import MACHINE, PERSON, WAITS, Scored, Sheet, filled
from labcourse.grading.reports.result import points
from labcourse.safe_text import as_csv, no_escapes
from labcourse.student_id import caseless

if TYPE_CHECKING:
    from typst import Fonts

FOLDER, CLASS_FILE = (
    "sheets",
    "sheets.csv",
)  #: in the folder of results: of all students' sheets, and their joined table
TOTAL = "total"  #: in the place of a row's number


def write(out: Path, course: Course, book: Gradebook, students: Sequence[str] = ()) -> tuple[int, list[str]]:
    """Write the sheets of a class in place of earlier ones.

    Parameters
    ----------
    out : folder; made if needed
    course, book : whose sheets, and whose marks
    students : IDs of those whose sheets are written; everybody's without any. The joined table has these only

    Returns
    -------
    int
        Of how many students.
    list[str]
        What there is to say: what is on no sheet, and who has no marks.

    Raises
    ------
    GradingError
        If the course has no sheets, a student is not known, or something cannot be written.
    """
    level_of = course.settings.levels.level_of
    layouts = sheet_layout.read(course.folder, course.catalogue)
    everybody = {caseless(one.about.student): one for one in standings(book, course.catalogue, course.settings.marks)}
    known = {caseless(one): one for one in (*book.handed_in(), *(about.student for about in book.students()))}
    unknown = [one for one in students if caseless(one) not in known]
    if unknown:
        raise GradingError(
            f"There is no student {unknown[0]!r} in this gradebook. ({program.name()} report lists them in grades.csv.)"
        )
    wanted = dict.fromkeys(map(caseless, students)) or known
    made = [filled(layout, everybody[one], level_of) for one in wanted if one in everybody for layout in layouts]
    try:
        for sheet in made:
            _write(out / FOLDER / sheet.about.student, sheet, course)
        out.mkdir(parents=True, exist_ok=True)
        files.write(out / CLASS_FILE, joined(made))
    except OSError as error:
        raise GradingError(f"{error.filename or out} cannot be written: {error.strerror}.") from None
    absent = [known[one] for one in wanted if one not in everybody]
    return len(wanted) - len(absent), [*_notes(layouts, course, absent)]


def _notes(layouts: Sequence[sheet_layout.Layout], course: Course, absent: Sequence[str]) -> Iterator[str]:
    left_out = [f"{number} {part.name}" for number, part in sheet_layout.on_no_sheet(layouts, course.catalogue)]
    if left_out:
        yield f"On no sheet, as no row and code has it: {', '.join(left_out)}."
    if dropped := course.settings.marks.drop:
        yield f"Dropped by course.toml, and on no sheet: {', '.join(dropped)}."
    if absent:
        yield f"Without marks, and so without sheets: {', '.join(absent)}."


def _write(folder: Path, sheet: Sheet, course: Course) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    name = sheet.layout.name
    about = content(sheet, course)
    files.write(folder / f"{name}.html", pages.page("sheet.html", **about))
    files.write(folder / f"{name}.pdf", as_pdf(about))
    files.write(folder / f"{name}.csv", table(sheet))


def content(sheet: Sheet, course: Course) -> dict[str, Any]:
    """A sheet as plain data: what stands on its page and in its PDF."""
    layout, about = sheet.layout, sheet.about
    return {
        "title": layout.title,
        "course": " · ".join(filter(None, (course.title, course.settings.term))),
        "who": [
            [heading, no_escapes(value)]
            for heading, value in (
                ("Student name", about.name),
                ("ID", about.student),
                ("Section", about.section),
            )
            if value
        ],
        "first": "Item" if any(line.group for line in sheet.lines) else "Question",
        "codes": list(layout.codes),
        "format": list(layout.format),
        "rows": [*_rows(sheet)],
        "totals": [_cell(sheet.totals.get(code)) for code in layout.columns],
        "total": sheet.total,
        "about": layout.about,
        "legend": legend(),
    }


def legend() -> list[str]:
    """What stands in a cell, in words."""
    return [
        "In a cell: the level, 4 to 1 (0 where nothing is of worth), by the share of the points that are decided; "
        "then the points earned of the points possible.",
        f"{MACHINE}: marked by the machine. {PERSON}: marked by a person.",
        f"{WAITS}: waits for a person, or could not be marked; a level before it may change.",
    ]


def _rows(sheet: Sheet) -> Iterator[dict[str, Any]]:
    group = ""
    for line in sheet.lines:
        if line.group != group:
            group = line.group
            yield {"group": group}
        yield {
            "group": "",
            "number": line.number,
            "heading": line.heading,
            "cells": [_cell(line.cells.get(code)) for code in sheet.layout.columns],
        }


def _cell(scored: Scored | None) -> dict[str, Any] | None:
    if scored is None:
        return None
    return {"level": scored.level_word, "points": scored.points_words, "person": scored.person.possible > 0}


# --- PDF --------------------------------------------------------------------------------------------------------------


def as_pdf(about: dict[str, Any], **options: Any) -> bytes:
    """A sheet as PDF, or as ``options`` of typst's compiler have it.

    The fonts are those that typst comes with; only letters that these do not have are taken from the computer's.
    """
    import typst

    made = typst.compile(
        pages.source("sheet.typ"), sys_inputs={"sheet": json.dumps(about)}, font_paths=_fonts(), **options
    )
    assert isinstance(made, bytes)  # of one page as a picture, or of a PDF
    return made


@cache
def _fonts() -> Fonts:
    import typst

    return typst.Fonts()


# --- tables -----------------------------------------------------------------------------------------------------------


def table(sheet: Sheet) -> str:
    """A sheet as CSV, in its layout: for each code the level, the points, and whose marks they are."""
    columns = sheet.layout.columns
    said = [f"{code} {what}" for code in columns for what in ("level", "earned", "out of", "by")]
    rows = [["row", "heading", *said]]
    for number, heading, cells in (
        *((line.number, line.heading, line.cells) for line in sheet.lines),
        (TOTAL, sheet.total, sheet.totals),
    ):
        rows.append([number, heading, *(word for code in columns for word in _words(cells.get(code)))])
    return as_csv(rows)


def _words(scored: Scored | None) -> list[str]:
    if scored is None:
        return ["", "", "", ""]
    found = scored.all
    earned = points(found.earned) if found.decided else ""
    return [scored.level_word, earned, points(found.possible), scored.by]


def joined(sheets: Iterable[Sheet]) -> str:
    """All cells of several sheets, a row for each: of which student, sheet, row and code."""
    heading = ["student", "name", "section", "sheet", "row", "heading", "code", "level", "earned", "decided", "out of"]
    rows = [[*heading, "parts that wait", "by"]]
    for sheet in sheets:
        about = sheet.about
        lines = [*((line.number, line.heading, line.cells) for line in sheet.lines), (TOTAL, "", sheet.totals)]
        for number, title, cells in lines:
            for code, scored in cells.items():
                found = scored.all
                level = "" if scored.level is None else str(scored.level)
                sums = (points(found.earned), points(found.decided), points(found.possible), str(found.waiting))
                who = (about.student, about.name, about.section, sheet.layout.name)
                rows.append([*who, number, title, code, level, *sums, scored.by])
    return as_csv(rows)
