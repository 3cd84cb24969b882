"""What students see of their marks, and when, is as the course's settings say."""

import json
import re
from dataclasses import replace
from datetime import timedelta

import pytest
from gradebooks import graded, record, result
from made_courses import OURS
from page_text import page_text

from labcourse import clock
from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import feedback
from labcourse.grading.reports.grades import Reports
from labcourse.grading.settings import CourseSettings, FeedbackSettings, MarkSettings

MARKS = (
    Mark("2.11", "omega_n", Status.WRONG, 0.0, 2.0, "Look at the units.", "omega_n = 3.1"),
    Mark("2.12", "K_s", Status.BY_A_PERSON, 1.5, 2.0, "Nearly: see me.", "K_s = 1.2"),
    Mark("2.13", "J_l", Status.MISSING, 0.0, 1.0, "2.13 stopped: NameError, line 3.", ""),
)
POINTS = re.compile(r"\d of \d|points|Points")


ALL = FeedbackSettings()


def course(seen=ALL, **more):
    return replace(OURS, settings=CourseSettings(term="2026 autumn", feedback=seen, **more))


def page(given=MARKS, seen=ALL, **decided):
    made = course(seen, **decided)
    account = account_of(made, Handed(StudentRecord("ada"), given))
    return page_text(feedback.page(result(*given, account=account), made))


def test_points_and_reasons_are_shown_unless_the_settings_say_otherwise():
    shown = page()
    assert "So far 1.50 of 5 points" in shown and "0 of 2 points" in shown
    assert all(mark.reason in shown for mark in MARKS)


def test_without_points_there_is_none_on_the_page_and_the_verdicts_stay():
    shown = page(seen=FeedbackSettings(points=False))
    assert not POINTS.search(shown)
    assert "wrong . Look at the units." in shown and "omega_n = 3.1" in shown


def test_without_reasons_the_keys_go_and_those_of_a_person_and_what_stopped_stay():
    shown = page(seen=FeedbackSettings(reasons=False))
    assert "Look at the units." not in shown and "wrong , 0 of 2 points" in shown
    assert "Nearly: see me." in shown and "NameError, line 3." in shown


@pytest.fixture
def book(book):
    marks = (MARKS[0], replace(MARKS[1], status=Status.PARTLY), MARKS[2])
    record(book, graded("ada", *marks, problems=("02_finding_stiffness.ipynb could not be read.",)))
    return book


def test_before_their_time_pages_say_when_they_open_and_what_went_wrong_and_nothing_of_the_marks(tmp_path, book):
    opens = clock.now() + timedelta(hours=1)
    reports = Reports(tmp_path / "out", course(FeedbackSettings(opens=opens)), book)
    reports.write_all()
    shown = page_text((tmp_path / "out" / "ada" / "feedback.html").read_text(encoding="utf-8"))
    when = f"{opens:%Y-%m-%d %H:%M} UTC"
    assert f"What came of it can be read here from {when} on." in shown
    assert "02_finding_stiffness.ipynb could not be read." in shown and "2026 autumn" in shown
    assert not POINTS.search(shown) and not any(mark.reason in shown or mark.question in shown for mark in MARKS)
    assert list(reports.notices()) == [
        f"Feedback pages say that they open at {when} (course.toml); then say rotflex report."
    ]
    assert json.loads((tmp_path / "out" / "ada" / "marks.json").read_text())["total"] == 1.5  # the instructor's


def test_the_student_reads_how_it_counts_where_a_setting_applies_and_without_points_if_they_are_not_shown():
    assert "So far 1.50 of 5 points." in page() and "How it counts" not in page()
    assert page(marks=MarkSettings(drop=("3.1",), weights={"3.2": 2})) == page()  # not this student's
    shown = page(marks=MarkSettings(drop=("2.13",)))
    assert "So far 1.50 of 4 points." in shown and "How it counts Not counted: 2.13. Your answers" in shown
    shown = page(seen=FeedbackSettings(points=False), marks=MarkSettings(drop=("2.13",)))
    assert "How it counts Not counted: 2.13. Your answers" in shown and not POINTS.search(shown)
