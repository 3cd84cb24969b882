"""Predictions: the first stands, they are shown beside the recording, cost nothing, and old files have none."""

from __future__ import annotations

import json

import pytest

import rotflex.lab
from rotflex import experiments
from rotflex.courseware import answers, predictions
from rotflex.errors import AnswerError
from rotflex.workbook.questions import CATALOGUE

SWING = "time_of_largest_swing"


@pytest.fixture
def lab(tmp_path):
    return rotflex.lab.start("ada", folder=tmp_path, quiet=True)


def said(capsys):
    return capsys.readouterr().out.splitlines()


def kept(lab):
    return json.loads(lab.book.path.read_bytes())["predictions"]


def test_the_first_prediction_stands_and_a_second_one_is_told_so(lab, capsys):
    lab.predict("2.9", time_of_largest_swing=7)
    lab.predict("2.9", time_of_largest_swing=9)
    lab.predict("2.9", time_of_largest_swing=7.0)
    assert said(capsys) == [
        f"2.9  predicted: {SWING} = 7 s. It stands now; run the experiment.",
        f"2.9  You said {SWING} = 7 s before, and that stands. Wrong predictions cost nothing.",
        f"2.9  predicted: {SWING} = 7 s.",
    ]
    assert kept(lab) == {"2.9": {"said": {SWING: {"kind": "number", "value": 7.0}}}}
    assert lab.predicted("2.9", SWING) == 7.0
    again = rotflex.lab.start("ada", folder=lab.book.path.parent, quiet=True)
    again.predict("2.9", time_of_largest_swing=11)
    assert again.predicted("2.9", SWING) == 7.0


def test_what_is_no_prediction_yet_is_not_kept(lab, capsys):
    for nothing in (..., None):
        lab.predict("2.9", time_of_largest_swing=nothing)
    lab.predict("2.9", time_of_largest_swing="soon")
    lab.predict("2.15", turns_farther="both")
    assert not lab.book.path.exists()
    first, second, text, choice = said(capsys)
    assert first == second and "not predicted yet: The sweep goes from 1 Hz to 5 Hz" in first
    assert "not kept: it is text" in text
    assert "not kept: " in choice and "'model'" in choice
    assert lab.predicted("2.9", SWING) is None


def test_without_a_prediction_it_says_what_can_be_and_what_was_predicted(lab, capsys):
    lab.predict("2.9")
    lab.predict("2.15")
    sweep, validation = said(capsys)
    assert sweep.startswith(f"2.9  {SWING} (s): The sweep goes")
    assert validation.startswith("2.15  turns_farther ('bench', 'model', 'about the same'): ")
    lab.predict("2.15", turns_farther="Bench")
    capsys.readouterr()
    lab.predict("2.15")
    assert said(capsys) == ["2.15  predicted: turns_farther = bench."]


def test_afterwards_it_stands_beside_what_was_recorded_and_a_sentence_is_kept(lab, capsys):
    lab.predict("2.9", time_of_largest_swing=7)
    lab.observed("2.9")
    assert said(capsys)[1:] == [
        f"2.9  You predicted {SWING} = 7 s.",
        "      There is nothing to compare it with yet: answer 2.9 sweep.",
        '      Keep a sentence on it: lab.observed("2.9", why="...")',
    ]
    with lab.bench() as bench:
        sweep = experiments.sweep(bench, progress=False)
    lab.answer("2.9", sweep=sweep)
    capsys.readouterr()
    lab.observed("2.9", why="  It meets the arm's own frequency then. ")
    widest = sweep.time[abs(sweep["alpha"]).argmax()]
    lines = said(capsys)
    assert float(lines[1].split("= ")[1].split(" s")[0]) == pytest.approx(widest, abs=0.05)
    assert lines[2].startswith("      Which frequency did the sweep have then?")
    assert lines[3] == "      Your words: It meets the arm's own frequency then."
    lab.observed("2.9")
    assert said(capsys) == lines
    assert kept(lab)["2.9"]["why"] == "It meets the arm's own frequency then."


def test_without_a_prediction_the_recording_is_shown_all_the_same(lab, capsys):
    lab.observed("2.9")
    assert said(capsys)[0] == "2.9  You predicted nothing here."


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda lab: lab.predict("2.1", V=1), "Nothing is predicted of '2.1'; there is something to predict of 2.9,"),
        (lambda lab: lab.predict(2.9, x=1), "Nothing is predicted of 2.9"),
        (lambda lab: lab.predict("2.9", frequency=1), f"you can predict {SWING}, not frequency"),
        (lambda lab: lab.observed("9.9"), "Nothing is predicted of '9.9'"),
        (lambda lab: lab.observed("2.9", why=3), "a sentence, text between quotes; it is a int"),
        (lambda lab: lab.observed("2.9", why="x" * 1001), "at most 1000 characters"),
    ],
)
def test_what_cannot_be_predicted_is_told(lab, call, told):
    with pytest.raises(AnswerError, match=told):
        call(lab)
    assert not lab.book.path.exists()


def test_answers_keep_predictions_and_predictions_answers(lab):
    lab.answer("2.11", omega_n=20.0)
    lab.predict("2.9", time_of_largest_swing=7)
    lab.answer("2.12", K_s=1.2)
    assert lab.value("2.11", "omega_n") == 20.0
    assert lab.predicted("2.9", SWING) == 7.0
    content = answers.parse(lab.book.path.read_bytes())
    assert content["answers"].keys() == {"2.11", "2.12"}


def test_a_file_without_any_is_as_it_always_was(lab):
    lab.answer("2.11", omega_n=20.0)
    assert "predictions" not in json.loads(lab.book.path.read_bytes())
    assert answers.parse(lab.book.path.read_bytes()).keys() >= {"answers", "cells"}


@pytest.mark.parametrize(
    "section",
    [
        3,
        [],
        {"2.9": 3},
        {"2.9": {"said": 3}},
        {"2.9": {"said": {SWING: 3}}},
        {"2.9": {"why": 3}},
        {"2.9": {"why": "x" * 1001}},
        {"2.9": {"else": {}}},
    ],
)
def test_a_section_of_another_form_is_no_answers_file(lab, section):
    lab.answer("2.11", omega_n=20.0)
    content = json.loads(lab.book.path.read_bytes())
    with pytest.raises(AnswerError, match="Its predictions should be"):
        answers.parse(json.dumps({**content, "predictions": section}).encode())


def test_all_that_can_be_predicted_can_be_kept_and_is_worth_nothing():
    for question, foretold in CATALOGUE.predictions.items():
        recordings = {part.name for part in CATALOGUE.find(question).parts if part.kind == "recording"}
        for one in foretold:
            assert one.part.kind in predictions.KINDS and one.part.points == 0
            assert one.part.prompt.endswith("?") and one.ask.endswith("?")
            assert one.found_in[0][0] == question and one.found_in[0][1] in recordings
