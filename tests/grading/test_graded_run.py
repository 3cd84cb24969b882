"""What the gradebook keeps of a run comes back as it was, each part of it by itself, and is what marking is given."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from gradebooks import graded, mark, prose, record

from labcourse.answers.cell_reports import CellError, CellReport, CellReports, Refusal
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import TextAnswer
from labcourse.benches import BenchPolicy
from labcourse.grading import graded_run
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.graded_run import facts_as_json, is_failed, key_faults, submission_of, words_as_json
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

REPORTS = CellReports(
    (
        CellReport("a.ipynb", "one", True, None, ()),
        CellReport("a.ipynb", "two", True, CellError("NameError", "name 'x'", 3), (("1", "x"), ("2", "y"))),
        CellReport("b.ipynb", "three", False, CellError("Left", "", None), ()),
    ),
    (Refusal("1", "x", "it is a text"), Refusal("2", "y", "")),
    (("a.ipynb", "student", "Ada Lovelace"),),
)
STOP = Problem.of(Code.RAISED, type="NameError", text="name 'x'", line=3)
#: Each part of what is known of a run, with a value that it does not usually have.
PARTS = {
    "cell_reports": REPORTS,
    "ended": (
        Problem.of(Code.CELL_TIMED_OUT, seconds=60),
        Problem.of(Code.RESULT_UNREAD, "answers.json", error="a link"),
    ),
    "problems": [
        Problem.of(Code.CELL_STOPPED, cell="two", notebook="a.ipynb", building=["1", "2"], why=STOP),
        Problem.of(Code.SUBMISSION_UNREAD, "a.zip", why=[Problem.of(Code.ENCRYPTED), Problem.of(Code.GONE)]),
    ],
    "notes": [Problem.of(Code.NOT_HANDED_IN, "b.ipynb"), "a text of the course"],
    "missing": {("1", "x"): Problem.of(Code.CELL_STOPPED, why=STOP), ("2", "y"): Problem.of(Code.NO_TEXT)},
    "asked": [("1", "x"), ("2", "y")],
    "bench_of": "bob",
    "policy": BenchPolicy("real", benches=("north",)),
    "documents": {"First report": ReportFile("First report", "first_report.pdf", "0" * 64, 9000, True, True)},
    "untouched": ("02_speed",),
    "waits": [("1", "x")],
    "evidence": b'{"recordings": []}',
}


def run_of(submission, **more):
    return replace(graded("ada").run, cells=facts_as_json(submission), **more)


def test_all_parts_are_looked_at():
    assert set(PARTS) == {*facts_as_json(Submission(student="ada"))[0]}


@pytest.mark.parametrize("name", PARTS)
def test_each_part_of_what_is_known_comes_back_as_it_was(name, tmp_path):
    run = run_of(Submission(student="ada", **{name: PARTS[name]}))
    assert getattr(submission_of(run), name) == PARTS[name] != getattr(Submission(student="ada"), name)
    with Gradebook(tmp_path / "book.sqlite") as book:
        record(book, replace(graded("ada"), run=run))
        assert submission_of(book.current("ada").run) == submission_of(run)


def test_a_record_without_facts_has_its_messages():
    problems, notes = (Problem.of(Code.PYTHON_DIED),), (Problem.of(Code.NOT_HANDED_IN, "a.ipynb"),)
    run = replace(graded("ada").run, cells=(), problems=problems, notes=notes)
    found = submission_of(run)
    assert (found.problems, found.notes, found.bench_of) == ([*problems], [*notes], "ada")


@pytest.mark.parametrize(("bench_of", "student"), [("", "ada"), ("bob", "bob")])
def test_marking_is_given_whose_bench_it_was_and_all_that_was_recorded(bench_of, student):
    words = {
        ("1", "why"): TextAnswer("So.", {"a.png": b"1"}),
        ("1", "how"): TextAnswer("Thus."),
        ("2", "why"): TextAnswer("No."),
    }
    submission = Submission(student="ada", **PARTS | {"bench_of": bench_of})
    supplied = {"1.x": 3, "2.11.omega_n": 4}
    run = run_of(submission, answers=b"{}", words=words_as_json(words), supplied=supplied, probe_seed=5)
    marked = submission_of(run)
    assert (marked.bench_of, marked.answers, marked.probe_seed, marked.words) == (student, b"{}", 5, words)
    assert marked.supplied_parts == {("1", "x"), ("2.11", "omega_n")}


def test_what_marking_says_is_put_behind_what_was_known_once_and_replaces_what_an_earlier_key_said():
    p, q, r, n, m, old = (Problem.of(Code.SAID_BY_COURSE, text=text) for text in ("p", "q", "r", "n", "m", "old"))
    run = run_of(Submission(student="ada", problems=[p, q], notes=[n]), problems=(p, q, old), notes=(n, old))

    def mark_it(submission):
        submission.problems += [q, r, r]
        submission.notes += [n, m]

    marker = SimpleNamespace(mark=mark_it)
    found = graded_run.mark(run, marker, "").run
    assert (found.problems, found.notes) == ((p, q, r), (n, m))


def test_faults_of_the_key_are_known_by_the_parts_that_they_left_unmarked():
    failed = [Problem.of(Code.KEY_FAILED, question="2.11", part=part, error="?") for part in ("omega_n", "explanation")]
    said = Problem.of(Code.SAID_BY_COURSE, text="2.11, omega_n is not marked: the key failed. ?")
    unmarked = mark("not marked: key fault", 0.0)
    one = graded("ada", unmarked, prose(), problems=(said, *failed))
    assert key_faults(one) == {("2.11", "omega_n"): failed[0]}
    assert key_faults(graded("ada", mark(), prose(), problems=(*failed,))) == {}


def test_a_failed_grading_is_known_by_its_problem_alone():
    failed, stays = (Problem.of(code, error="full") for code in (Code.GRADING_FAILED, Code.EARLIER_MARKS_STAY))
    words = Problem.of(Code.CELL_STOPPED, why=Problem.of(Code.RAISED, type="ValueError", text=sentence(failed)))
    assert is_failed(graded("ada", problems=(stays, failed)).run)
    assert not any(is_failed(graded("ada", problems=(one,)).run) for one in (stays, words, sentence(failed)))


def test_two_questions_two_parts_each_are_told_apart():
    data = b'{"format": 2, "student": "ada", "bench": {}, "software": "", "probe_seed": 1, "cells": {}, "answers": '
    data += b'{"1": {"x": {}, "y": {}}, "2": {"x": {}, "z": {}}}}'
    assert graded_run.recorded_in(data) == {("1", "x"), ("1", "y"), ("2", "x"), ("2", "z")}
    assert graded_run.recorded_in(None) == graded_run.recorded_in(b"[]") == set()
