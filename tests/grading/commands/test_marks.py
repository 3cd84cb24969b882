"""Commands on a gradebook: regrade, report, mark, comment, history."""

import re
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from checkout import ROOT
from command_line import rotflex, said
from day_class import FIRST, SECOND
from gradebooks import enrol, graded, mark, prose, record, rows
from made_courses import OURS

from labcourse.errors import GradingError
from labcourse.grading import counting
from labcourse.grading.counting import Regraded
from labcourse.grading.gradebook import DECIDED, Delivery, Gradebook
from labcourse.grading.marking.marking_processes import marking_digest
from labcourse.grading.marks import Mark
from labcourse.grading.settings import Assignment, CourseSettings, LateSettings
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence


@pytest.fixture
def book(tmp_path):
    """A gradebook's file, with two students' marks and a roster of three."""
    with Gradebook(tmp_path / "book.sqlite") as opened:
        record(opened, graded("ada"), graded("bob"))
        enrol(opened, tmp_path, ("ada", "Ada L.", "", ""), ("eve", "Eve E.", "", ""))
    return tmp_path / "book.sqlite"


def give(book, points, by, *more):
    words = ("mark", book, "ada", "2.11", "explanation", points, "--reason", "Well.", "--by", by)
    return rotflex(*words, *more)


def given(book):
    with Gradebook(book) as opened:
        return opened.current("ada").marks[1]


def test_a_mark_is_given_and_the_answer_it_is_for_is_shown(book):
    done = give(book, 0.5, "anna")
    assert done.exit_code == 0
    assert "ada, 2.11, explanation: 0.5, for the answer 'Because it bends.'" in said(done)
    assert given(book).points == 0.5


def test_a_persons_points_are_replaced_where_they_are_named(book):
    give(book, 0.5, "anna")
    assert give(book, 1, "ben", "--expect", "0.25").exit_code == 2 and given(book).points == 0.5
    assert give(book, 1, "ben", "--expect", "0.5").exit_code == 0 and given(book).points == 1
    assert give(book, 1 / 3, "ben", "--expect", "1").exit_code == 0
    shown = re.search(r"--expect ([\d.]+)\)", said(give(book, 1, "anna")))[1]  # rounded
    assert give(book, 1, "anna", "--expect", shown).exit_code == 0 and given(book).points == 1


def test_what_another_gave_between_reading_and_writing_is_not_replaced(book, monkeypatch):
    set_mark = Gradebook.set_mark

    def somebody_is_first(self, *arguments, **others):
        monkeypatch.setattr(Gradebook, "set_mark", set_mark)
        assert give(book, 0.25, "anna").exit_code == 0
        return set_mark(self, *arguments, **others)

    monkeypatch.setattr(Gradebook, "set_mark", somebody_is_first)
    done = give(book, 1, "ben")
    assert done.exit_code == 2 and "from anna" in said(done) and given(book).points == 0.25


def test_a_comment_is_in_the_feedback(book, tmp_path):
    assert rotflex("comment", book, "ada", "See me \x1b[31m.", "--by", "anna").exit_code == 0
    assert rotflex("comment", book, "ada", "Which unit?", "--question", "2.11", "--by", "anna").exit_code == 0
    assert rotflex("report", book, "--out", tmp_path / "out", "--solutions", ROOT).exit_code == 0
    page = (tmp_path / "out" / "ada" / "feedback.html").read_text(encoding="utf-8")
    assert "See me \\x1b[31m." in page and "Which unit?" in page and "anna" in page


@pytest.fixture
def names(tmp_path):
    path = tmp_path / "names.csv"
    path.write_text("student,name,tutorial\nada,Ada,1\nbod,Bob,1\nebe,Eve,1\n", encoding="utf-8")
    return path


def students(book):
    with Gradebook(book) as opened:
        return [one.student for one in opened.students()]


@pytest.mark.parametrize(
    ("there", "named", "file"),
    [
        ("", "term/MARKS", "term/MARKS/gradebook.sqlite"),
        ("", "MARKS/gradebook.sqlite", "MARKS/gradebook.sqlite"),
        ("", "class.db", "class.db"),
    ],
)
def test_a_roster_makes_the_gradebook_that_it_goes_into_and_its_folder(tmp_path, names, there, named, file):
    (tmp_path / there).mkdir(exist_ok=True)
    for told in ("3 added, 0 changed, 0 as they were.", "0 added, 0 changed, 3 as they were."):
        done = rotflex("roster", tmp_path / named, names)
        assert done.exit_code == 0 and told in said(done) and "Columns that are not read: tutorial." in said(done)
    assert (tmp_path / file).is_file() and students(tmp_path / file) == ["ada", "bod", "ebe"]


def test_whose_id_was_a_slip_can_be_taken_out_and_whoever_has_marks_cannot(book, names):
    rotflex("roster", book, names)
    done = rotflex("roster", book, "--remove", "BOD", "--remove", "ebe")
    assert done.exit_code == 0 and "bod is no longer in the gradebook." in said(done)
    assert students(book) == ["ada", "bob", "eve"]
    done = rotflex("roster", book, "--remove", "ada", "--remove", "zoe", "--remove", "eve")
    assert done.exit_code == 1 and "'ada' is not removed:" in said(done) and "no student 'zoe'" in said(done)
    assert students(book) == ["ada", "bob"]
    done = rotflex("roster", book, names, "--remove", "ebe", "--remove", "bod")
    assert done.exit_code == 0 and students(book) == ["ada", "bob"]


@pytest.fixture
def marked_again(monkeypatch):
    """Regrade with these outcomes."""

    def outcomes(*found):
        monkeypatch.setattr("labcourse.grading.counting.regrade", lambda *_, **_others: iter(found))

    return outcomes


WRONG = graded("ada", mark("wrong", 0.0, "More than 1 % off \x1b[31m."), prose(), key="key 2")


def test_regrade_says_what_changed_for_whom_and_why(book, marked_again):
    left = {"question": "2.11", "part": "omega_n", "points": 1.0, "by_key": 2.0}
    marked_again(
        Regraded(graded("ada", mark(), prose()), WRONG), Regraded(graded("bob"), graded("bob"), unchanged=(left,))
    )
    done = rotflex("regrade", book, "--solutions", ROOT)
    assert done.exit_code == 0
    assert done.output.splitlines() == [
        "ada: 2 → 0 of 3 points; the key has changed",
        "    2.11, omega_n: 2 of 2 (right) → 0 of 2 (wrong). More than 1 % off \\x1b[31m.",
        "bob, 2.11, omega_n: 1 points, given by a person, stay; the key gives 2.",
        "Other marks than before: 1 student. The same: 1.",
    ]


def test_regrade_does_not_end_well_where_the_key_failed(book, marked_again):
    about = {"question": "2.11", "part": "omega_n", "error": "KeyError, key.py, line 5."}
    fault = Problem.of(Code.KEY_FAILED, **about)
    failed = graded("bob", mark("not marked: key fault", 0.0), problems=(fault,))
    marked_again(Regraded(graded("ada", mark(), prose()), WRONG), Regraded(graded("bob", mark()), failed))
    done = rotflex("regrade", book, "--solutions", ROOT)
    assert done.exit_code == 1 and sentence(fault) in said(done)


def test_an_error_amid_a_regrade_leaves_reports_of_everybody(book, tmp_path, monkeypatch):
    def fails(*_, **_others):
        yield Regraded(graded("ada"), graded("ada"))
        raise GradingError("The database is gone.")

    monkeypatch.setattr("labcourse.grading.counting.regrade", fails)
    done = rotflex("regrade", book, "--solutions", ROOT, "--out", tmp_path / "out")
    assert done.exit_code == 2 and "rotflex: The database is gone." in done.output
    assert list(rows(tmp_path / "out")) == ["ada", "bob", "eve"]


def test_history_begins_with_what_persons_did_and_has_lateness_and_no_change_that_moves_no_point(tmp_path, monkeypatch):
    """One student, counted by hand: late by a day; scored, excused from the next notebook, and graded anew."""
    labs = (Assignment("Lab 02", (FIRST,), datetime(2026, 3, 1, 18, tzinfo=UTC)), Assignment("Lab 03", (SECOND,)))
    settings = CourseSettings(assignments=labs, late=LateSettings(per_day=10))
    monkeypatch.setattr("labcourse.grading.course.find", lambda _named: replace(OURS, settings=settings))
    with Gradebook(tmp_path / "gradebook.sqlite") as opened:
        late = Delivery(f"{FIRST}.ipynb", "d", b"{}", datetime(2026, 3, 2, 12, tzinfo=UTC), "a.zip", "by the platform")
        in_time = replace(late, received=datetime(2026, 3, 1, 12, tzinfo=UTC), clock=DECIDED)
        opened.deliver("ada", [late])
        opened.deliver("bob", [in_time])
        missing = Mark("2.12", "K_s", "missing", 0.0, 2.0, "")
        record(opened, graded("ada", mark("wrong", 0.0), prose(), missing), graded("bob", prose()))
        opened.set_mark("ada", "2.11", "explanation", 1 / 3, reason="A third.", actor="tia")
        opened.excuse("ada", [SECOND], reason="ill", actor="lea")
        opened.take("ada", FIRST, "a.zip", late.received, reason="Her laptop broke.", actor="lea")
        better = (mark("right", 2.0), prose(), replace(missing, status="wrong"))
        record(opened, graded("ada", *better, submission="next"))
    done = rotflex("history", tmp_path, "ADA")
    assert done.exit_code == 0, done.output
    lines = [re.sub(r"^  \S+ \S+ UTC  ", "", line) for line in done.output.splitlines()]
    assert lines == [
        "Decided by persons:",
        "ada  2.11 explanation: 0 (for a person) → 0.33 (given by a person)  tia: A third.",
        f"ada  {SECOND}: excused  lea: ill",
        f"ada  {FIRST}: version of 2026-03-02 12:00 UTC taken  lea: Her laptop broke.",
        "Late, extended, or at a time that a person decides:",
        lines[5],
        "Given by the program:",
        "ada  2.11 explanation: – → 0 (for a person)  batch: run",
        "ada  2.11 omega_n: – → 0 (wrong)  batch: run",
        "ada  2.11 omega_n: 0 (wrong) → 2 (right)  batch: run",
    ]
    assert lines[5].startswith(f"  ada  {FIRST} was handed in on 2026-03-02 12:00 UTC") and "1 day late" in lines[5]
    assert "loses 10 % of its points" in lines[5]
    only = rotflex("history", tmp_path, "ada", "--question", "2.16").output
    assert f"{SECOND}: excused" in only and FIRST not in only and "2.11" not in only
    decided = rotflex("history", tmp_path, "bob").output
    assert f"2026-03-01 12:00 UTC ({DECIDED}). It was due on 2026-03-01 18:00 UTC. It is in time." in decided


def test_who_left_no_answers_is_marked_again_with_the_others(tmp_path):
    with Gradebook(tmp_path / "book.sqlite") as opened:
        record(opened, graded("bob", mark(status="missing", points=0.0), answers=None, words={}))
        (done,) = counting.regrade(opened, OURS)
        assert not done.problem and {one.points for one in done.after.marks} == {0.0}
        assert opened.current("bob").key_digest == marking_digest(OURS)
