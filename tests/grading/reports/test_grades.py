"""The folder of results: everybody, every time, from the gradebook and its roster."""

import errno
import json
from collections import Counter
from copy import copy
from dataclasses import replace

import pytest
from gradebooks import enrol, graded, mark, prose, record, report_text, rows
from made_courses import OURS
from sqlalchemy import event

from labcourse import clock, files
from labcourse.errors import GradingError
from labcourse.grading.gradebook import CommentRecord, Delivery, StudentRecord
from labcourse.grading.reports import feedback
from labcourse.grading.reports.grades import NOT_GRADED_YET, Reports


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def test_everybody_is_in_the_reports_whoever_was_graded_just_now(book, out, tmp_path):
    record(book, graded("bob"), graded("ada"), graded("zoe"))
    enrol(book, tmp_path, ("ada", "Ada L.", "ada@x.org", "B"), ("eve", "Eve E.", "", "A"))
    book.deliver("Dan", [Delivery("02.ipynb", "d", b"{}", clock.now())])
    assert Reports(out, OURS, book).write_all() == 3  # who have pages
    found = rows(out)
    assert list(found) == ["ada", "bob", "Dan", "eve", "zoe"]
    assert [found["ada"][name] for name in ("name", "email", "section", "total")] == ["Ada L.", "ada@x.org", "B", "2"]
    assert (found["eve"]["notes"], found["Dan"]["notes"]) == ("nothing handed in", NOT_GRADED_YET)
    assert sorted(path.name for path in out.iterdir()) == ["ada", "bob", "grades.csv", "zoe"]
    assert {path.name for path in (out / "zoe").iterdir()} == {"marks.json", "feedback.html"}


def test_each_row_of_the_class_is_read_once(book, out):
    students = [f"s{number}" for number in range(4)]
    record(book, *map(graded, students))
    for student in students:
        book.comment(student, "Please look again.", actor="tia", question="2.11", part="omega_n", asks=True)
    loaded = Counter()

    def count(row, _context):
        loaded[type(row)] += 1

    for table in (StudentRecord, CommentRecord):
        event.listen(table, "load", count)
    Reports(out, OURS, book).write_all()
    for table in (StudentRecord, CommentRecord):
        event.remove(table, "load", count)
    assert loaded == {StudentRecord: 4, CommentRecord: 4}


@pytest.mark.parametrize("end", [KeyboardInterrupt, GradingError("The scheduler is gone.")])
def test_whatever_ends_a_batch_everybody_is_in_the_reports(book, out, tmp_path, end):
    record(book, graded("ada"), graded("bob"))
    with pytest.raises(BaseException) as caught, Reports(out, OURS, book, ["cleo", "Ada"]):
        raise end
    assert caught.type is (end if isinstance(end, type) else type(end))
    found = rows(out)
    assert list(found) == ["ada", "bob", "cleo"]
    assert found["cleo"]["notes"] == "handed in, not graded yet"
    assert not (out / "cleo").exists()


def test_a_students_folder_bears_the_rosters_spelling(book, out, tmp_path):
    record(book, graded("ADA"))
    enrol(book, tmp_path, ("Ada", "Ada L.", "", ""))
    Reports(out, OURS, book).write_all()
    assert list(rows(out)) == ["Ada"]
    assert [path.name for path in out.iterdir() if path.is_dir()] == ["Ada"]


def test_marks_as_data_hold_what_people_said(book, out):
    record(book, graded("ada"))
    book.comment("ada", "Good.", actor="prof", question="2.11")
    book.set_mark("ada", "2.11", "explanation", 0.5, reason="Nearly.", actor="tutor")
    record(book, graded("ada", mark(), prose(given="Otherwise."), report_text(), submission="second"))
    Reports(out, OURS, book).write_all()
    data = json.loads((out / "ada" / "marks.json").read_text(encoding="utf-8"))
    assert (data["total"], data["awaiting"], data["not_marked"], data["out_of"]) == (2, 3, 0, 5)
    ((comment,), (lapsed,)) = data["comments"], data["lapsed"]
    assert (comment["question"], comment["text"], comment["by"]) == ("2.11", "Good.", "prof")
    assert lapsed.startswith("2.11, explanation: tutor gave 0.5 of 1 points on ")


@pytest.mark.parametrize("in_the_way", ["folder", "file", "read-only"])
def test_a_place_that_cannot_be_written_to_is_told_before_anything_is_run(book, out, monkeypatch, in_the_way):
    def refuse(target, content):
        raise OSError(errno.EROFS, "", str(target))

    if in_the_way == "folder":
        (out / "grades.csv").mkdir(parents=True)
    elif in_the_way == "file":
        out.write_text("")
    else:
        monkeypatch.setattr(files, "write", refuse)
    with pytest.raises(GradingError, match=r"grades\.csv" if in_the_way == "folder" else "out"):
        Reports(out, OURS, book)


def test_a_folder_of_a_student_that_cannot_be_made_costs_the_others_nothing(book, out):
    record(book, graded("ada"), graded("bob"))
    reports = Reports(out, OURS, book)
    (out / "ada").write_text("a file")
    with pytest.raises(GradingError, match=r"ada.*rotflex report"):
        reports.write_all()
    assert (out / "bob" / "feedback.html").exists() and list(rows(out)) == ["ada", "bob"]


def test_a_disk_that_is_full_is_told_once_and_what_was_there_stays(book, out, monkeypatch):
    record(book, graded("ada"), graded("bob"))
    Reports(out, OURS, book).write_all()
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    book.comment("ada", "Well.", actor="prof")
    reports = Reports(out, OURS, book)

    def full(path, data):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(GradingError, match=r"grades\.csv.* 3 more.*Free some space.*rotflex grade"):
        reports.write_all()
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_page_is_made_again_only_if_something_about_it_changed_and_is_always_there_as_it_should_be(
    book, out, monkeypatch
):
    record(book, graded("ada"), graded("bob"))
    made, page = [], feedback.page

    def counted(result, course):
        made.append(result.about.student)
        return page(result, course)

    monkeypatch.setattr(feedback, "page", counted)

    def again(course=OURS):
        made.clear()
        Reports(out, course, book).write_all()
        return made

    assert again() == ["ada", "bob"]
    first = {path: path.read_bytes() for path in out.rglob("*.*")}
    as_loaded_again = replace(OURS, catalogue=copy(OURS.catalogue))
    assert again(as_loaded_again) == [] and {path: path.read_bytes() for path in out.rglob("*.*")} == first
    (out / "ada" / "feedback.html").write_text("Full marks!")
    (out / "bob" / "marks.json").unlink()
    assert again() == ["ada", "bob"] and {path: path.read_bytes() for path in out.rglob("*.*")} == first
    book.comment("bob", "Say why.", actor="tia", question="2.11", part="omega_n")
    assert again() == ["bob"]
    settings = replace(OURS.settings, term="Spring")
    assert again(replace(OURS, settings=settings)) == ["ada", "bob"]
