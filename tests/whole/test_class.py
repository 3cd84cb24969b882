"""A simulated class, from submissions to marks, against marks worked out by hand."""

from __future__ import annotations

import csv
import json
import subprocess
import sys

import pytest
import simulated_class
from simulated_class import CLASS

PROBE_SEED = 20_240_229
CELL_TIMEOUT = 45  # s; the endless loop runs as long


@pytest.fixture(scope="session")
def graded(tmp_path_factory, sandbox):
    """The class, graded by the command as an instructor runs it."""
    folder = tmp_path_factory.mktemp("class")
    source = simulated_class.course(folder / "course")
    simulated_class.hand_in(source, folder / "submissions")
    command = [sys.executable, "-m", "rotflex.cli", "grade", folder / "submissions", "--out", folder / "marks"]
    command += ["--course", source, "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT), "--probe-seed", str(PROBE_SEED)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    return folder / "marks", done


def marks_of(graded, student):
    return json.loads((graded[0] / student / "marks.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def rows(graded):
    with (graded[0] / "grades.csv").open(encoding="utf-8", newline="") as file:
        return {row["student"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("student", CLASS)
def test_points_are_those_worked_out_by_hand(graded, rows, student):
    expected = CLASS[student].marks
    row = rows[student]
    problems = marks_of(graded, student)["problems"]
    assert {number: float(row[number]) for number in expected} == expected, problems
    assert float(row["total"]) == sum(expected.values())
    assert float(row["out_of"]) == 11
    assert float(row["awaiting a person"]) == CLASS[student].awaiting


@pytest.mark.parametrize("student", CLASS)
def test_statuses_are_as_expected_and_reasons_are_given(graded, student):
    marks = {(mark["question"], mark["part"]): mark for mark in marks_of(graded, student)["marks"]}
    assert {where: marks[where]["status"] for where in CLASS[student].statuses} == CLASS[student].statuses
    assert all(mark["reason"] for mark in marks.values())


@pytest.mark.parametrize("student", CLASS)
def test_trouble_is_reported_where_there_was_some_and_nowhere_else(graded, student):
    problems = marks_of(graded, student)["problems"]
    trouble = CLASS[student].trouble
    assert (problems == []) if trouble is None else any(trouble in problem for problem in problems)


def test_the_command_says_that_there_was_trouble_and_shows_everybody(graded):
    done = graded[1]
    assert done.returncode == 1, done.stderr
    assert all(student in done.stdout for student in CLASS)
    assert "Run in isolation." in done.stdout


def test_there_is_a_row_for_each_student_in_order(rows):
    assert list(rows) == sorted(CLASS)


def test_a_deleted_and_a_doubled_cell_are_noted(graded):
    notes = " ".join(marks_of(graded, "cells")["notes"])
    assert "the cell q2-9 is not there" in notes
    assert "the cell q2-11 is there 2 times; all of them are run, in order" in notes
    assert "q2-12" not in notes


def test_an_answer_to_a_question_that_does_not_exist_is_noted_and_earns_nothing(graded):
    assert any("'9.9'" in note for note in marks_of(graded, "forger")["notes"])


def test_feedback_is_a_page_of_its_own_that_runs_and_loads_nothing(graded):
    for student in CLASS:
        page = (graded[0] / student / "feedback.html").read_text(encoding="utf-8")
        assert "default-src 'none'" in page
        assert "<script" not in page
        assert "http://" not in page and "https://" not in page
        assert "Run in isolation." in page


def test_feedback_shows_prose_as_it_was_written_and_not_as_html(graded):
    page = (graded[0] / "other-means" / "feedback.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;not flat&lt;/b&gt;" in page
    assert "<b>not flat</b>" not in page


def test_feedback_does_not_tell_the_expected_values(graded):
    from solutions.true_bench import TrueBench

    bench = TrueBench("wrong")
    page = (graded[0] / "wrong" / "feedback.html").read_text(encoding="utf-8")
    for value in (bench.K_s, bench.omega_n, bench.J_l, bench.omega_n / 6.2832):
        assert f"{value:.3g}" not in page.split("</style>")[1]
