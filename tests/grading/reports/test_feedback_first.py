"""What a student reads first: how they stand by the calendar, what waits, and what moved since it was given back."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest
from gradebooks import graded, mark, prose, record, report_text
from made_courses import OURS
from page_text import page_text

from labcourse import clock
from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import Arrival, CommentRecord, Excuse, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.reports import feedback
from labcourse.grading.reports.grades import Reports
from labcourse.grading.reports.result import Result
from labcourse.grading.settings import Assignment

PRELAB, STIFFNESS, VALIDATION = "01_modeling_prelab", "02_finding_stiffness", "03_model_validation"
BEFORE, BETWEEN = datetime(2026, 11, 1, tzinfo=UTC), datetime(2026, 11, 25, tzinfo=UTC)
ASSIGNMENTS = tuple(
    Assignment(title, (name,), due=datetime(2026, month, day, 23, 59, 59, tzinfo=UTC))
    for title, name, month, day in (
        ("Lab 1", PRELAB, 11, 14),
        ("Lab 2", STIFFNESS, 11, 21),
        ("Lab 3", VALIDATION, 12, 5),
    )
)
COURSE = replace(OURS, settings=replace(OURS.settings, assignments=ASSIGNMENTS))
MARKS = (
    Mark("2.1", "V", "right", 2.0, 2.0, "Equal.", "V"),
    mark("wrong", 0.0),
    prose(),
    report_text("missing"),
)


def page(when=BETWEEN, excused=(), back=None, names=(PRELAB, STIFFNESS), marks=MARKS):
    arrived = {f"{name}.ipynb": Arrival(datetime(2026, 10, 30, tzinfo=UTC)) for name in names}
    excuses = {name: Excuse(1, "ada", name, True, "lea", "ill", BEFORE) for name in excused}
    run, ada = graded("ada", *marks), StudentRecord("ada")
    account = account_of(COURSE, Handed(ada, marks, arrived, run, excuses), when)
    asked = CommentRecord("ada", "2.11", "Why?", "lea", BEFORE, "omega_n", asks=True, is_open=True)
    whole = Result(run, ada, account, [asked, CommentRecord("ada", None, "Well done.", "lea", BEFORE)])
    return seen(feedback.page(whole.given_back(COURSE, back), COURSE))


def seen(page):
    return page_text(page).replace(" ,", ",").replace(" .", ".")


def test_in_the_term_only_what_is_due_counts_and_what_is_not_due_is_not_on_the_page():
    text = page()
    assert "So far 2.00 of 5 points." in text
    assert "Lab 1 marked 2.00 of 2" in text and "Lab 2 waits for a person of 3" in text
    assert "Lab 3 not due until 2026-12-05 of 2" in text
    assert "1 point waits for a person: 2.11" in text
    assert "2.11, omega_n: Asked on 2026-11-01 to be looked at again; not answered yet." in text
    assert "2.11: Natural frequency 0 of 3 points omega_n: wrong." in text and "2.16" not in text
    assert "How it counts Not counted so far, as it is not due or not given back: Lab 3, 04 modeling results" in text


def test_what_is_excused_has_no_points_and_asks_for_no_second_look():
    text = page(excused=[STIFFNESS])
    assert "So far 2.00 of 2 points." in text and "Lab 2 excused " in text
    assert "lea excused you on 2026-11-01 (ill)." in text and "looking at again" not in text


def test_of_what_is_not_given_back_the_page_has_the_state_alone():
    text = page(back=[PRELAB])
    assert "So far 2.00 of 2 points." in text
    assert "Lab 2 waits for a person, not given back yet of 3" in text and "Not given back yet: Lab 2" in text
    assert "Natural frequency" not in text and "looking at again" not in text
    assert "None of your marks is given back yet. The marks of Lab 1, Lab 2 come here" in page(back=[VALIDATION])


def test_a_mark_of_what_is_not_asked_any_more_is_shown_and_counts_when_everything_is_given_back():
    marks = (*MARKS, Mark("9.9", "old", "right", 1.0, 1.0, "Equal.", "1"))
    everything, one = page(marks=marks), page(marks=marks, back=[PRELAB])
    assert "So far 3.00 of 6 points." in everything and "9.9" in everything
    assert "So far 2.00 of 2 points." in one and "9.9" not in one
    assert "not given back: Lab 2, Lab 3, 04 modeling results" in one and ",." not in one and "Well done." in one


def test_what_is_missing_is_in_its_line_and_not_among_the_things_to_look_at():
    text = page(names=[PRELAB], when=datetime(2026, 12, 25, tzinfo=UTC))
    assert "Lab 3 missing 0.00 of 2" in text and "section 2.3.2, missing ? of 2" not in text
    assert text.count("2.16: How good") == 1  # among the answers


@pytest.fixture
def pages(book, tmp_path):
    def written():
        Reports(tmp_path / "out", OURS, book).write_all()
        files = {one: tmp_path / "out" / one / "feedback.html" for one in ("ada", "bob")}
        return {one: seen(file.read_text(encoding="utf-8")) for one, file in files.items()}

    return written


def test_a_mark_that_moved_is_on_the_page_from_when_it_was_first_given_back(book, pages):
    record(book, graded("ada"), graded("bob"))
    book.set_mark("bob", "2.11", "omega_n", 1.0, reason="Before it was given back.", actor="tia")
    assert "Changed since" not in pages()["bob"]
    book.publish("lea")
    book.set_mark("ada", "2.11", "omega_n", 1.5, reason="Two digits are missing.", actor="tia")
    moved = f"2.11, omega_n : 2 of 2 → 1.5 of 2, on {clock.now():%Y-%m-%d}. Two digits are missing."
    assert moved in pages()["ada"] and "Changed since" not in pages()["bob"]
    book.publish("lea")
    assert moved in pages()["ada"], "the student saw the first one"
    record(book, graded("bob", *MARKS, submission="second"))  # with 2.1, which is new, and so has not moved
    shown = pages()["bob"].partition("Changed since")[2].partition("Your answers")[0]
    assert "2.16, comparison" in shown and "2.1, V" not in shown
