"""The page that a student gets back, where a student's text could do more than be read."""

from __future__ import annotations

from rotflex.instructor.marking.marking import Mark
from rotflex.instructor.reports import feedback
from rotflex.instructor.reports.grades import Result
from rotflex.instructor.verdicts import Status
from rotflex.workbook.questions import CATALOGUE


def test_nothing_turns_the_direction_of_the_page():
    turning = "\u202e2 of 2\u2066\x9b31m"
    mark = Mark("2.11", "explanation", Status.FOR_A_PERSON, 0.0, 1.0, turning, turning)
    page = feedback.page(Result(turning, (mark,), (turning,), (turning,), turning), CATALOGUE)
    assert not set("\u202e\u2066\x9b") & set(page)
    assert page.count(r"\u202e2 of 2\u2066\x9b31m") == 7  # twice as the name, and wherever else it is put
