"""Only a student who was enrolled from a roster, and has nothing else in the gradebook, can be removed."""

from datetime import UTC, datetime

import pytest
from gradebook_dump import dump
from gradebooks import enrol, graded, record

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import Delivery, StudentRecord


@pytest.fixture
def book(book, tmp_path):
    enrol(book, tmp_path, ("ada", "Ada", "", "A"), ("bod", "Bob", "b@x.org", "B"))
    return book


def test_a_student_with_only_a_line_of_the_roster_is_removed_and_may_come_again(book, tmp_path):
    before = dump(book)
    assert book.remove("BOD") == StudentRecord("bod", "Bob", "b@x.org", "B", enrolled=True)
    assert [one.student for one in book.students()] == ["ada"]
    enrol(book, tmp_path, ("bod", "Bob", "b@x.org", "B"))
    assert dump(book) == before


def deliver(book):
    book.deliver("ada", [Delivery("a.ipynb", "1", b"{}", datetime(2026, 3, 2, tzinfo=UTC))])


@pytest.mark.parametrize(
    ("done", "tables"),
    [
        (deliver, ["deliveries"]),
        (lambda book: record(book, graded("ada")), ["runs", "marks", "audit"]),
        (lambda book: book.comment("ada", "Come and see me.", actor="tia"), ["comments"]),
    ],
    ids=["handed in", "graded", "comment"],
)
def test_a_student_with_other_rows_is_not_removed_and_the_message_names_them(book, done, tables):
    done(book)
    before = dump(book)
    with pytest.raises(GradebookError, match="'ada' is not removed") as refused:
        book.remove("Ada")
    assert set(str(refused.value).rpartition(": ")[2].strip(".").split(", ")) == set(tables)
    assert dump(book) == before
