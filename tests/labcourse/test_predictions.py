"""Predictions: the first stands, they are shown beside the recording, cost nothing, and old files have none."""

import json

import pytest

import rotflex.course.lab
from labcourse.answers import answers
from labcourse.errors import AnswerError
from rotflex import experiments

SWING = "time_of_largest_swing"


@pytest.fixture
def lab(tmp_path):
    return rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)


def said(capsys):
    return capsys.readouterr().out.splitlines()


def kept(lab):
    return json.loads(lab.book.path.read_bytes())["predictions"]


def test_the_first_prediction_stands_and_a_second_one_is_told_so(lab, capsys):
    lab.predict("2.9")
    lab.predict("2.15")
    lab.observed("2.15")
    for swing in (7, 9, 7.0):
        lab.predict("2.9", time_of_largest_swing=swing)
    lab.predict("2.15", turns_farther="Bench")
    lab.predict("2.15")
    asked, choice, none, nothing, why, first, again, same, other, other_again = said(capsys)
    assert asked.startswith(f"2.9  {SWING}  not predicted yet (s): ") and "('bench', 'model', " in choice
    assert none.startswith("2.15  ") and "answer 2.15 validation" in nothing and 'lab.observed("2.15", why=' in why
    assert first.startswith(f"2.9  predicted: {SWING} = 7 s.") and "run the experiment" in first
    assert f"{SWING} = 7 s before, and that stands" in again and same == f"2.9  predicted: {SWING} = 7 s."
    assert other.startswith("2.15  predicted: turns_farther = bench. ") and other.startswith(other_again)
    assert kept(lab)["2.9"] == {"said": {SWING: {"kind": "number", "value": 7.0}}}
    assert lab.predicted("2.9", SWING) == 7.0
    again = rotflex.course.lab.start("ada", folder=lab.book.path.parent, quiet=True)
    again.predict("2.9", time_of_largest_swing=11)
    again.book.predict("2.9", {SWING: {"kind": "number", "value": 13.0}}, None)  # as from a notebook that is behind
    assert again.predicted("2.9", SWING) == 7.0


def test_what_is_no_prediction_yet_is_not_kept(lab, capsys):
    for nothing in (..., None):
        lab.predict("2.9", time_of_largest_swing=nothing)
    lab.predict("2.9", time_of_largest_swing="soon")
    lab.predict("2.15", turns_farther="both")
    assert not lab.book.path.exists()
    first, second, _text, choice = said(capsys)
    assert first == second and "'model'" in choice
    assert lab.predicted("2.9", SWING) is None


def test_afterwards_it_stands_beside_what_was_recorded_and_a_sentence_is_kept(lab, capsys):
    lab.predict("2.9", time_of_largest_swing=7)
    lab.observed("2.9")
    _predicted, before, nothing, sentence = said(capsys)
    assert f"{SWING} = 7 s" in before and "answer 2.9 sweep" in nothing and 'lab.observed("2.9", why=' in sentence
    with lab.bench() as bench:
        sweep = experiments.sweep(bench, progress=False)
    lab.answer("2.9", sweep=sweep)
    capsys.readouterr()
    why = "It meets the arm's own frequency then."
    lab.observed("2.9", why=f"  {why} ")
    lines = said(capsys)
    named = float(lines[1].split("= ")[1].split(" s")[0])
    swing = abs(sweep.between(named - 0.05, named + 0.05).degrees("alpha")).max()
    assert swing > abs(sweep.degrees("alpha")).max() - 0.1  # a count: two swings may be equally wide
    assert why in lines[3]
    lab.observed("2.9")
    assert said(capsys) == lines
    assert kept(lab)["2.9"]["why"] == why


def test_a_prediction_of_another_release_stands_though_it_cannot_be_read(lab, capsys):
    lab.book.predict("2.15", {"turns_farther": {"kind": "choice", "value": "neither of them"}})
    stored = kept(lab)
    lab.predict("2.15")
    lab.predict("2.15", turns_farther="bench")
    assert len(said(capsys)) == 2 and kept(lab) == stored
    assert lab.predicted("2.15", "turns_farther") is None


def test_what_cannot_be_predicted_is_refused_by_name(lab):
    for call, named in (
        (lambda: lab.predict("2.1", V=1), r"'2\.1'.* 2\.9,"),
        (lambda: lab.predict(2.9, x=1), r"2\.9"),
        (lambda: lab.predict("2.9", frequency=1), f"{SWING}.*frequency"),
        (lambda: lab.observed("9.9"), r"'9\.9'"),
        (lambda: lab.observed("2.9", why=3), "int"),
        (lambda: lab.observed("2.9", why="x" * 1001), "1000"),
    ):
        with pytest.raises(AnswerError, match=named):
            call()
    assert not lab.book.path.exists()


def test_answers_keep_predictions_and_predictions_answers(lab):
    lab.answer("2.11", omega_n=20.0)
    lab.predict("2.9", time_of_largest_swing=7)
    lab.answer("2.12", K_s=1.2)
    assert lab.value("2.11", "omega_n") == 20.0
    assert lab.predicted("2.9", SWING) == 7.0
    content = answers.parse(lab.book.path.read_bytes())
    assert content["answers"].keys() == {"2.11", "2.12"}


def test_a_section_of_another_form_is_no_answers_file(lab):
    lab.answer("2.11", omega_n=20.0)
    content = json.loads(lab.book.path.read_bytes())
    assert "predictions" not in content and answers.parse(json.dumps(content).encode()) == content
    entries = (3, {"said": 3}, {"said": {SWING: 3}}, {"why": 3}, {"why": "x" * 1001}, {"else": {}})
    for section in (3, [], *({"2.9": entry} for entry in entries)):
        with pytest.raises(AnswerError, match="predictions"):
            answers.parse(json.dumps({**content, "predictions": section}).encode())
