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
from labcourse.grading.graded_run import (
    Facts,
    facts_of,
    is_failed,
    key_faults,
    marking_job,
    supplied_parts,
    words_as_json,
)
from labcourse.grading.marking.marking_processes import Marked
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
    "reports": REPORTS,
    "ended": (
        Problem.of(Code.CELL_TIMED_OUT, seconds=60),
        Problem.of(Code.RESULT_UNREAD, "answers.json", error="a link"),
    ),
    "problems": (
        Problem.of(Code.CELL_STOPPED, cell="two", notebook="a.ipynb", building=["1", "2"], why=STOP),
        Problem.of(Code.SUBMISSION_UNREAD, "a.zip", why=[Problem.of(Code.ENCRYPTED), Problem.of(Code.GONE)]),
    ),
    "notes": (Problem.of(Code.NOT_HANDED_IN, "b.ipynb"), "a text of the course"),
    "missing": [("1", "x", Problem.of(Code.CELL_STOPPED, why=STOP)), ("2", "y", Problem.of(Code.NO_TEXT))],
    "asked": [("1", "x"), ("2", "y")],
    "bench_of": "bob",
    "policy": BenchPolicy("real", benches=("north",)),
    "reports_in_pdf": {"First report": ReportFile("First report", "first_report.pdf", "0" * 64, 9000, True, True)},
    "untouched": ("02_speed",),
    "waits": [("1", "x")],
    "evidence": b'{"recordings": []}',
}


def run_of(facts, **more):
    return replace(graded("ada").run, cells=facts.as_json(), **more)


def test_all_parts_are_looked_at():
    assert set(PARTS) == set(Facts.model_fields)


@pytest.mark.parametrize("name", PARTS)
def test_each_part_of_what_is_known_comes_back_as_it_was(name, tmp_path):
    facts = Facts(**{name: PARTS[name]})
    assert facts != Facts() and facts_of(run_of(facts)) == facts
    with Gradebook(tmp_path / "book.sqlite") as book:
        record(book, replace(graded("ada"), run=run_of(facts)))
        assert facts_of(book.current("ada").run) == facts


def test_a_record_without_facts_has_its_messages():
    problems, notes = (Problem.of(Code.PYTHON_DIED),), (Problem.of(Code.NOT_HANDED_IN, "a.ipynb"),)
    run = replace(graded("ada").run, cells=(), problems=problems, notes=notes)
    assert facts_of(run) == Facts(problems=problems, notes=notes, bench_of="ada")


@pytest.mark.parametrize(("bench_of", "student"), [("", "ada"), ("bob", "bob")])
def test_marking_is_given_whose_bench_it_was_and_all_that_was_recorded(bench_of, student):
    words = {
        ("1", "why"): TextAnswer("So.", {"a.png": b"1"}),
        ("1", "how"): TextAnswer("Thus."),
        ("2", "why"): TextAnswer("No."),
    }
    facts = Facts(**PARTS | {"bench_of": bench_of})
    run = run_of(facts, answers=b"{}", words=words_as_json(words), supplied={"1.x": 3, "2.11.omega_n": 4}, probe_seed=5)
    asked = marking_job(run)
    assert (asked.student, asked.answers, asked.probe_seed, asked.words) == (student, b"{}", 5, words)
    assert asked.context.missing == {(question, part): why for question, part, why in PARTS["missing"]}
    assert (asked.context.asked_parts, asked.policy) == (facts.asked, facts.policy)
    assert asked.evidence == facts.evidence
    assert asked.context.supplied == supplied_parts(run) == {("1", "x"), ("2.11", "omega_n")}


def test_what_marking_says_is_put_behind_what_was_known_once_and_replaces_what_an_earlier_key_said():
    p, q, r, n, m, old = (Problem.of(Code.SAID_BY_COURSE, text=text) for text in ("p", "q", "r", "n", "m", "old"))
    run = run_of(Facts(problems=(p, q), notes=(n,)), problems=(p, q, old), notes=(n, old))
    marker = SimpleNamespace(mark=lambda job: Marked((), (q, r, r), (n, m)))
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
