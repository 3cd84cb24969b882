"""What changed since feedback was given back, and what was not ready."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

from gradebooks import graded, mark, prose, record, report_text

from labcourse.grading.overview import published
from labcourse.grading.settings import CourseSettings, FeedbackSettings, MarkSettings


def changes(book):
    last = book.requests.publications()[-1]
    return [(one.student, one.part) for one in published.changed_since(book.audit(), last.when)]


def test_marks_that_changed_after_it_was_given_back_are_told_with_both_points(book):
    record(book, graded("ada"), graded("bob"))
    book.set_mark("bob", "2.11", "explanation", 1.0, "good", "tia")
    book.requests.publish("lea")
    assert changes(book) == []
    book.set_mark("ada", "2.11", "explanation", 0.5, "half", "tia")  # was not decided
    book.set_mark("bob", "2.11", "omega_n", 1.5, "rounding", "tia")
    assert changes(book) == [("ada", "explanation"), ("bob", "omega_n")]
    section = published.section(book.requests.publications(), book.audit())
    assert "Marks of 2 students have changed since" in section.first and section.urgent
    assert section.tables[0].rows == (
        ("ada", "2.11 explanation: not decided → 0.5 of 1"),
        ("bob", "2.11 omega_n: 2 of 2 → 1.5 of 2"),
    )
    book.requests.publish("lea", "again")
    assert changes(book) == []


def test_what_went_back_to_what_it_was_or_has_another_reason_alone_changed_for_nobody(book):
    record(book, graded("ada"))
    book.requests.publish("lea")
    book.set_mark("ada", "2.11", "omega_n", 1.0, "half", "tia")
    assert changes(book) == [("ada", "omega_n")]
    book.set_mark("ada", "2.11", "omega_n", 2.0, "no, all of it", "tia")
    assert changes(book) == []


def test_who_was_graded_since_has_marks_that_nobody_was_told_of(book):
    record(book, graded("ada"))
    book.requests.publish("lea")
    record(book, graded("bob", mark(), prose()))
    assert changes(book) == [("bob", "omega_n")]  # the explanation is not decided yet


def test_what_waits_is_asked_or_is_closed_is_told_before(book):
    record(book, graded("ada"), graded("bob", mark(), prose(), replace(report_text(), status="missing")))
    book.requests.make("ada", ("2.11", "omega_n"), "Please.")
    waits, asks = published.not_ready(book, CourseSettings(), datetime.now(UTC))
    assert waits == "Still to be read by a person: 3 answers of 2 students; their pages say so."
    assert asks == "1 request not answered yet (rotflex requests list)."
    later = FeedbackSettings(opens=datetime.now(UTC) + timedelta(days=1))
    assert published.not_ready(book, CourseSettings(feedback=later), datetime.now(UTC))[-1].startswith(
        f"Feedback opens on {later.opens:%Y-%m-%d}"
    )
    book.requests.answer(1, "tia", "Yes.")
    for student, part in (("ada", "explanation"), ("bob", "explanation")):
        book.set_mark(student, "2.11", part, 1.0, "good", "tia")
    assert published.not_ready(book, CourseSettings(), datetime.now(UTC)) == [
        "Still to be read by a person: 1 answer of 1 student; their pages say so."
    ]
    book.set_mark("ada", "2.16", "comparison", 1.0, "good", "tia")
    opened = FeedbackSettings(opens=datetime(2020, 1, 1, tzinfo=UTC))
    assert published.not_ready(book, CourseSettings(feedback=opened), datetime.now(UTC)) == []


def test_what_is_dropped_need_not_be_read_before(book):
    record(book, graded("ada"))
    dropped = CourseSettings(marks=MarkSettings(drop=("2.16", "2.12")))
    assert published.not_ready(book, dropped, datetime.now(UTC)) == [
        "Still to be read by a person: 1 answer of 1 student; their pages say so.",
        "Left out, as course.toml drops it: 2.16, 2.12. Requests and changed marks are told all the same.",
    ]
    book.set_mark("ada", "2.11", "explanation", 1.0, "good", "tia")
    book.set_mark("ada", "2.16", "comparison", 1.0, "good", "tia")
    assert published.not_ready(book, dropped, datetime.now(UTC)) == []  # nothing is left out either


def test_before_the_first_time_it_says_so(book):
    section = published.section([], [])
    assert section.first == "Feedback was not given back yet (rotflex publish)." and not section.urgent
