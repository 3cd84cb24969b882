"""What a batch owes to honest people: faults contained, marks kept, hand-ins put together, reasons told."""

import csv
import json
import os
from functools import partial

import pytest
from fake_class import left, perfect
from made_courses import loaded
from packings import WANTED, lay, work

from labcourse.grading import batch, intake, platforms
from labcourse.grading.assignments import State
from labcourse.grading.counting import regrade
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.graded_run import is_failed, key_faults
from labcourse.grading.reports import live_report
from labcourse.grading.reports.changes import changes_since
from labcourse.grading.reports.grades import Reports
from labcourse.grading.running import supplied
from labcourse.grading.submission import PARTNER, Doubt
from labcourse.problems import Code, Problem, has

FAULTY = """
from labcourse.grading.marking.checks import ForAPerson, Number

KEY = {
    "2.11": {"omega_n": Number("it", lambda bench: bench.omega, rtol=0.05), "explanation": ForAPerson()},
    "0.1": {"resolution": Number("it", lambda bench: 3.0, rtol=0.1)},
}
"""


def marks(book, student):
    return {f"{one.question} {one.part}": one for one in book.current(student).marks}


def test_a_fault_of_the_key_costs_its_part_and_no_other(fake_class):
    fake_class.hand_in("ada")
    fake_class.grade()
    with fake_class.book() as book:
        book.set_mark("ada", "2.11", "explanation", 1.0, reason="Well put.", actor="prof")
    fake_class.course = loaded(fake_class.folder / "faulty", key=FAULTY)
    fake_class.grade()
    with fake_class.book() as book:
        found = marks(book, "ada")
        assert found["2.11 omega_n"].status == "not marked: key fault"
        assert (found["2.11 explanation"].points, found["2.11 explanation"].status) == (1.0, "given by a person")
        assert found["2.11 omega_n"].reason == Problem.of(Code.KEY_HAS_FAULT)
        (problem,) = book.current("ada").run.problems
        assert key_faults(book.current("ada")) == {("2.11", "omega_n"): problem}
        error = problem.parameters["error"]
        assert problem.code is Code.KEY_FAILED and error.startswith("AttributeError") and "key.py, line 5" in error
    fake_class.key(1.0)  # mended
    fake_class.grade()
    with fake_class.book() as book:
        assert marks(book, "ada")["2.11 omega_n"].points == 2
        assert marks(book, "ada")["2.11 explanation"].points == 1
        assert book.current("ada").run.problems == ()
    assert fake_class.runs == ["ada"]


def test_where_grading_fails_what_was_there_stays(fake_class, monkeypatch):
    fake_class.hand_in("ada")
    assert fake_class.grade() == {"ada": 2}
    fake_class.hand_in("ada", source="something else")
    fake_class.leaves["ada"] = OSError("the disk is full")
    assert fake_class.grade() == {"ada": 2}
    with fake_class.book() as book:
        stays = Problem.of(Code.EARLIER_MARKS_STAY, error="OSError: the disk is full")
        assert book.current("ada").run.problems == (stays,)
    del fake_class.leaves["ada"]
    assert fake_class.grade() == {"ada": 2}
    with fake_class.book() as book:
        assert book.current("ada").run.problems == ()
    assert fake_class.runs == ["ada", "ada", "ada"]


def test_where_grading_fails_nothing_shows_a_number(fake_class, tmp_path, capsys):
    fake_class.hand_in("ada")
    fake_class.leaves["ada"] = OSError("the disk is full")
    fake_class.grade()
    fake_class.grade()
    with fake_class.book() as book:
        current = book.current("ada")
        assert current.run.problems == (Problem.of(Code.GRADING_FAILED, error="OSError: the disk is full"),)
        assert {mark.reason for mark in current.marks} == {Problem.of(Code.NOT_GRADED)} and is_failed(current.run)
        Reports(tmp_path / "out", fake_class.course, book).write_all()
        with live_report.Screen(1, [], []) as screen:
            screen.add(True, current)
        with live_report.JsonLines(1, [], []) as lines:
            lines.add(True, current)
        table, _newline, event = capsys.readouterr().out.partition("{")
        assert "not graded" in table and "0 of" not in table
        assert json.loads("{" + event.splitlines()[0])["points"] is None
        given = platforms.earned(book, fake_class.course)["ada"]
        assert given.share is None and given.state is State.NOT_GRADED
        assert not key_faults(current)
        (row,) = csv.DictReader((tmp_path / "out" / "grades.csv").read_text().splitlines())
        assert row["total"] == row["2.11"] == "" and row["notes"].startswith("Grading failed")
        page = (tmp_path / "out" / "ada" / "feedback.html").read_text()
        assert "Not graded yet" in page and "0 of" not in page
        marks = json.loads((tmp_path / "out" / "ada" / "marks.json").read_text())
        assert marks["total"] is None and marks["account"] is None
        del fake_class.leaves["ada"]
        assert fake_class.grade() == {"ada": 2}
        assert changes_since(current, book.current("ada")) is None


@pytest.mark.parametrize("graded_before", [False, True])
def test_where_grading_fails_what_was_supplied_is_not_lost(fake_class, graded_before):
    fake_class.hand_in("ada", source="omega_n = omgea")
    if graded_before:
        fake_class.grade()
    fake_class.leaves["ada"] = OSError("the disk is full")
    fake_class.grade(supplied=supply(fake_class, "ada:2.11.omega_n=19.5"))
    del fake_class.leaves["ada"]
    fake_class.grade()
    with fake_class.book() as book:
        assert book.current("ada").run.supplied == {"2.11.omega_n": 19.5}


def test_what_is_handed_in_later_is_put_together_with_what_came_before(fake_class):
    fake_class.hand_in("ada")
    fake_class.grade()
    path = fake_class.folder / "in" / "ada" / "a.ipynb"
    path.unlink()
    (path.parent / "more.py").write_text("x = 1\n")
    assert fake_class.grade() == {"ada": 2}
    assert list(fake_class.asked["ada"].files) == ["more.py"]


def claim(student, **cells):
    book = {"format": 2, "student": student, "bench": {}, "software": "rotflex", "probe_seed": 1}
    number = {"kind": "number", "value": 1.0}
    return json.dumps({**book, "answers": {"2.11": {"omega_n": number}}, "cells": {"2.11": cells}})


def test_what_was_recorded_at_home_and_is_missing_is_trouble_with_its_reason(fake_class):
    fake_class.hand_in("ada")
    (fake_class.folder / "in" / "ada" / "answers.json").write_text(claim("ada", omega_n="gone"))
    refused = {"event": "refused", "notebook": "a.ipynb", "question": "2.11", "part": "omega_n", "why": ""}
    fake_class.leaves["ada"] = left(None, reports=json.dumps(refused).encode())
    fake_class.grade()
    with fake_class.book() as book:
        lost = Problem.of(Code.CELL_NOT_AMONG, "a.ipynb", cell="gone")
        said = Problem.of(Code.RECORDED_AT_HOME, parts=["2.11 omega_n"], why=lost)
        assert book.current("ada").run.problems == (said,)
        assert marks(book, "ada")["2.11 omega_n"].reason == Problem.of(Code.MISSING_HERE, why=lost)
        assert book.current("ada").run.claim == {"2.11": {"omega_n": "gone"}}


def test_what_was_recorded_at_home_is_compared_whomever_it_names_and_no_trouble_if_it_is_here(fake_class):
    fake_class.hand_in("ada")
    (fake_class.folder / "in" / "ada" / "answers.json").write_text(claim("Ada Lovelace", omega_n="q1-answer"))
    assert fake_class.grade() == {"ada": 2}
    with fake_class.book() as book:
        run = book.current("ada").run
    assert run.claim == {"2.11": {"omega_n": "q1-answer"}}
    assert not has(Code.RECORDED_AT_HOME, run.problems)


def stopped(*cells):
    """What a run says whose first answer stopped."""
    lines = [{"event": "ended", "cell": cell, "error": None} for cell in cells]
    error = {"type": "NameError", "message": "name 'omgea' is not defined", "line": 1}
    lines.append({"event": "ended", "cell": "q1", "error": error})
    return "".join(json.dumps({"notebook": "a.ipynb", **line}) + "\n" for line in lines).encode()


def test_what_stopped_is_told_and_stays_told_when_marked_again(fake_class):
    fake_class.hand_in("ada", source="omega_n = omgea")
    fake_class.leaves["ada"] = left(None, reports=stopped())
    fake_class.grade()
    with fake_class.book() as book:
        (why,) = book.current("ada").run.problems
        assert (why.code, why.parameters["question"]) == (Code.CELL_STOPPED, "2.11")
        assert why.parameters["why"] == Problem.of(
            Code.RAISED, type="NameError", text="name 'omgea' is not defined", line=1
        )
        assert marks(book, "ada")["2.11 omega_n"].reason == why
    fake_class.key(2.0)
    fake_class.grade()
    with fake_class.book() as book:
        assert marks(book, "ada")["2.11 omega_n"].reason == why
        list(regrade(book, fake_class.course))
        assert book.current("ada").run.problems == (why,)
    assert fake_class.runs == ["ada"]


def test_a_cell_for_a_newer_python_is_told_as_that(fake_class):
    fake_class.hand_in("ada", source='print(f"{d["unit"]}")')
    notebook = fake_class.folder / "in" / "ada" / "a.ipynb"
    about = {"metadata": {"language_info": {"version": "3.99.1"}}}
    notebook.write_text(json.dumps({**json.loads(notebook.read_text()), **about}))
    line = {"event": "ended", "cell": "q1", "error": {"type": "SyntaxError", "message": "f-string", "line": 1}}
    fake_class.leaves["ada"] = left(None, reports=json.dumps({"notebook": "a.ipynb", **line}).encode())
    fake_class.grade()
    with fake_class.book() as book:
        (problem,) = book.current("ada").run.problems
        why = problem.parameters["why"]
        assert (why.code, why.parameters["needed"]) == (Code.NEWER_PYTHON_NEEDED, "3.99")
        assert why.parameters["here"].startswith("3.") and marks(book, "ada")["2.11 omega_n"].reason == problem


def supply(fake_class, text):
    return (supplied.read(text, fake_class.course.catalogue),)


def test_a_supplied_value_is_run_earns_nothing_and_stays_until_it_is_taken_back(fake_class):
    fake_class.hand_in("ada", "bob", source="omega_n = omgea")
    fake_class.leaves["ada"] = left(None, reports=stopped())
    fake_class.grade()
    fake_class.leaves["ada"] = left(perfect("ada", 7), reports=stopped())
    for again in range(2):
        fake_class.grade(probe_seed=7, supplied=() if again else supply(fake_class, "Ada:2.11.omega_n=19.5"))
        with fake_class.book() as book:
            found = marks(book, "ada")["2.11 omega_n"]
            assert (found.status, found.points) == ("supplied by your instructor", 0)
            assert found.reason.code is Code.SUPPLIED
            why = found.reason.parameters["why"].parameters["why"]
            assert (why.code, why.parameters["type"]) == (Code.RAISED, "NameError")
            assert book.current("ada").run.supplied == {"2.11.omega_n": 19.5}
            assert marks(book, "bob")["2.11 omega_n"].points == 2
    (notebook,) = fake_class.asked["ada"].notebooks.values()
    before = [cell["source"] for cell in notebook["cells"] if cell["id"] == "supplied-q1-answer"]
    assert before == ["omega_n = 19.5\nlab.answer('2.11', omega_n=19.5)"]
    assert "supplied" not in repr(fake_class.asked["bob"])
    fake_class.grade(probe_seed=7, supplied=supply(fake_class, "ada:2.11.omega_n="))
    with fake_class.book() as book:
        assert book.current("ada").run.supplied == {}
        assert marks(book, "ada")["2.11 omega_n"].status == "right"


def test_who_handed_in_before_is_not_named_as_absent(fake_class):
    fake_class.hand_in("ada", "bob")
    (fake_class.folder / "class.csv").write_text("id\nada\nbob\ncleo\n")
    with fake_class.book() as book:
        book.import_roster(fake_class.folder / "class.csv")
    fake_class.grade()
    for path in (fake_class.folder / "in" / "ada").iterdir():
        os.unlink(path)
    (fake_class.folder / "in" / "ada").rmdir()
    with fake_class.book() as book:
        assert batch.Batch(fake_class.folder / "in", fake_class.course, book).absent == ["cleo"]


FUTURE = 4.2e9  # what a file says of itself, somebody may have written there


@pytest.fixture
def stage(tmp_path):
    """Grade folders, {name: (answer, partners, student of the course.json)}; return what counts for each student.

    ``decided`` is the instructor's answer on the partners of bob.
    """
    taken = []

    def take(decided="", **folders):
        folder = tmp_path / f"stage-{len(taken)}"
        taken.append(folder)
        for name, (answer, partners, student) in folders.items():
            lay(folder / name, work(student, answer, **{"with": partners}))
            for path in (folder / name).iterdir():
                os.utime(path, (FUTURE, FUTURE) if name == "mallory" else None)
        with Gradebook(tmp_path / "book.sqlite") as book:
            decisions = {Doubt("bob", PARTNER, "", (), "ada").key: decided}
            before = partial(batch.students_named_before, book)
            found = intake.find(folder, earlier=before, decisions=decisions).submissions
            return {one.student: _answer(stored) for one in found if (stored := _stored(book, one))}

    return take


def _stored(book, submission):
    intake.read(submission, WANTED)
    book.deliver(submission.student, submission.items)
    batch.store_common_work(book, submission)
    return book.delivered(submission.student)


def _answer(delivered):
    newest = max((one for one in delivered if one.name == WANTED[0]), key=lambda one: one.received)
    return json.loads(newest.content)["cells"][0]["source"]


def test_a_pair_hands_in_together_and_again(stage):
    assert stage(bob=("x = 0", ["ada"], "bob")) == {"bob": "x = 0"}
    assert stage("yes", bob=("x = 1", ["ada"], "bob")) == {"ada": "x = 1", "bob": "x = 1"}
    assert stage("yes", bob=("x = 2", ["ada"], "bob")) == {"ada": "x = 2", "bob": "x = 2"}
    assert stage(ada=("x = 3", ["bob"], "ada"))["ada"] == "x = 3"


def test_what_somebody_handed_in_before_is_not_replaced_in_their_name(stage):
    assert stage(ada=("x = 1", [], "ada")) == {"ada": "x = 1"}
    assert stage(mallory=("spoilt = 1", ["mallory"], "ada")) == {"ada": "x = 1", "mallory": "spoilt = 1"}
    assert stage(mallory=("spoilt = 2", ["ada"], "mallory")) == {"ada": "x = 1", "mallory": "spoilt = 2"}


def test_what_either_of_a_pair_hands_in_is_a_version_for_both(stage):
    assert stage(bob=("x = 1", ["eve"], "bob")) == {"bob": "x = 1"}
    assert stage(eve=("x = 2", ["bob"], "eve")) == {"bob": "x = 2", "eve": "x = 2"}
    assert stage(ada=("pass", ["eve"], "ada")) == {"ada": "pass", "eve": "x = 2"}
    assert stage(eve=("x = 3", ["ada"], "eve"))["ada"] == "x = 3"


def test_what_is_said_in_somebodys_name_counts_neither_before_nor_after_what_they_hand_in(stage):
    assert stage(mallory=("spoilt = 1", ["ada"], "mallory")) == {"mallory": "spoilt = 1"}
    assert stage(ada=("x = 1", [], "ada")) == {"ada": "x = 1"}
    assert stage(mallory=("spoilt = 2", ["ada"], "mallory")) == {"ada": "x = 1", "mallory": "spoilt = 2"}
