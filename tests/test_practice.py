"""Benches to practise on: another one each time, nobody's own, told of once an answer is given, and kept nowhere."""

import re

import numpy as np
import pytest
from made_courses import OURS

import rotflex.course.lab
from labcourse.errors import AnswerError
from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from labcourse.grading.marks import Status
from labcourse.grading.submission import Submission
from rotflex import experiments, identification
from rotflex.course import practice
from rotflex.errors import ConfigurationError
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LABCOURSE_RUNNING", raising=False)
    return rotflex.course.lab.start("ada", quiet=True)


def swept(one):
    with one.bench() as bench:
        return experiments.sweep(bench, progress=False)


def test_each_call_draws_another_bench_and_a_number_gives_one_again(lab, capsys):
    first, second = lab.practice(), lab.practice()
    assert first.number != second.number
    again = lab.practice(first.number)
    assert again.joint == first.joint
    with first as bench, again as same:
        assert bench.identity == same.identity
    assert capsys.readouterr().out.splitlines()[0] == (
        f"<practice bench {first.number}: arm in position {first.joint.arm_position}>"
    )


def test_its_recording_is_found_to_be_true_and_nothing_is_told_before_an_answer(lab, capsys):
    one = lab.practice(7)
    found = identification.resonance(identification.frequency_response(swept(one))).value
    assert "rad/s" not in capsys.readouterr().out and "K_s" not in repr(one)
    one.answer(omega_n=found, K_s=one.joint.J_l * found**2)
    omega, stiffness = capsys.readouterr().out.splitlines()
    true = re.fullmatch(r"omega_n = .* rad/s: [+-]\d\.\d %, near enough .* 3 % .* has ([\d.]+) rad/s\.", omega)[1]
    assert float(true) == pytest.approx(found, rel=0.015)
    assert re.search(r"near enough .* 6 % .* N·m/rad\.$", stiffness)
    one.answer(omega_n=found / 2)
    assert re.search(r": -(49|50)\..*not near enough yet .* The bench has", capsys.readouterr().out)


def test_what_is_no_answer_or_no_bench_is_refused_and_reveals_nothing(lab, capsys):
    one = lab.practice(5)
    capsys.readouterr()
    for given in ({}, {"J_l": 3}, {"omega_n": "much"}, {"omega_n": np.nan}, {"K_s": [1.0, 2.0]}, {"K_s": None}):
        with pytest.raises(AnswerError, match=r"omega_n|K_s"):
            one.answer(**given)
    assert capsys.readouterr().out == ""
    for number in (0, practice.MOST + 1, 1.5, True, "7"):
        with pytest.raises(ConfigurationError, match=str(practice.MOST)):
            lab.practice(number)


def test_a_recording_of_it_that_is_handed_in_is_another_benchs(lab, tmp_path):
    lab.answer("2.9", sweep=swept(lab.practice()))
    seed = student_seed("ada")
    claims = decode((tmp_path / "answers.json").read_bytes(), seed, OURS.catalogue)
    marks = {
        (one.question, one.part): one
        for one in mark(OURS, claims, TrueBench("ada"), Submission(student="ada", probe_seed=seed))
    }
    assert marks["2.9", "sweep"].status is Status.WRONG
    assert "bench" in marks["2.9", "sweep"].reason


def test_where_a_program_runs_the_notebooks_it_is_always_the_same_and_works(lab, monkeypatch, capsys):
    for running in ("check", "grade"):
        monkeypatch.setenv("LABCOURSE_RUNNING", running)
        one = lab.practice()
        assert one.number == 1
        one.answer(omega_n=20)
        assert "The bench has" in capsys.readouterr().out
