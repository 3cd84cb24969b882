"""The map to outcomes and the layout of the scoring sheets, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from labcourse.errors import GradingError
from labcourse.grading.course import OUTCOMES_FILE, SHEETS_FILE, Course
from labcourse.grading.course_check.finding import Finding
from labcourse.grading.outcomes import outcome_map, sheet_layout


def check(course: Course) -> Iterator[Finding]:
    """What of the two cannot be used, and what has a code and is on no sheet; nothing where the course has neither."""
    try:
        outcome_map.find(course.folder, course.catalogue)
    except GradingError as error:
        yield Finding(OUTCOMES_FILE, str(error))
    if not (course.folder / SHEETS_FILE).exists():
        return
    try:
        layouts = sheet_layout.read(course.folder, course.catalogue)
    except GradingError as error:
        yield Finding(SHEETS_FILE, str(error))
        return
    for number, part in sheet_layout.on_no_sheet(layouts, course.catalogue):
        if part.outcome:
            yield Finding(
                SHEETS_FILE,
                f"{number}, {part.name}: it carries {part.outcome}, and is on no sheet.",
            )
