"""Codes of outcomes, the map to outcomes and the layout of the scoring sheets, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from labcourse.errors import GradingError
from labcourse.grading.course import OUTCOMES_FILE, SHEETS_FILE, Course
from labcourse.grading.course_check.finding import Finding
from labcourse.grading.outcomes import outcome_map, sheet_layout


def check(course: Course) -> Iterator[Finding]:
    """Codes that the catalogue does not explain; what of map and sheets cannot be used; what is on no sheet."""
    for number, question in course.catalogue.marked.items():
        codes = dict.fromkeys([*question.outcomes, *(part.outcome for part in question.parts if part.outcome)])
        for code in codes:
            if code not in course.catalogue.outcomes:
                there = ", ".join(course.catalogue.outcomes) or "none"
                yield Finding(f"question {number}", f"there is no outcome {code!r}; the catalogue has {there}.")
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
