"""What this course's answers ask each other: slips are asked about, right answers never, and nothing is given away.

All slips, carried on, and all right ways are in ``tests/whole/test_reflections.py``.
"""

import json
import re
from datetime import datetime, timedelta

import numpy as np
import pytest
from reflections import asked_of, lab_of, usual_checks
from right_ways import rewritten, worked
from single_slips import SLIPS, STUDENT

import rotflex.course.lab
from rotflex import experiments
from rotflex.course.questions import CATALOGUE


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """A student's own right answers, and their file."""
    return worked(STUDENT, tmp_path_factory.mktemp(STUDENT))


def asked_with(usual, tmp_path, changes):
    """What is asked when some of the answers are others; nothing is carried on."""
    own, data = usual
    changed, _said = rewritten(STUDENT, tmp_path, changes, own, data)
    return asked_of(STUDENT, changed)


def texts(reflection, question):
    return [text for numbers, text in reflection.asked if question in numbers]


def test_right_answers_are_asked_nothing_and_all_of_them_are_looked_at(usual):
    said = asked_of(STUDENT, usual[1])
    assert (said.asked, said.missing, said.unclear) == ((), (), ())
    assert said.compared == len(usual_checks(STUDENT)) > 80


def test_of_every_answer_that_is_marked_but_figures_and_entries_something_is_asked():
    """But for what nothing else says anything of."""
    alone = {("0.1", "resolution")}
    marked = {
        (question.number, part.name)
        for question in CATALOGUE.everything.values()
        for part in question.parts
        if part.marked == "auto" and part.kind != "figure"
    }
    assert marked - {where for check in lab_of(STUDENT).checks() for where in check.about} == alone


@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: slip.name)
def test_a_slip_that_is_not_carried_on_is_asked_about_at_its_own_question(usual, tmp_path, slip):
    own, _data = usual
    nested = {}
    for (question, part), value in own.items():
        nested.setdefault(question, {})[part] = value
    said = asked_with(usual, tmp_path, {slip.where: lambda right, _own: slip.change(right, nested)})
    assert texts(said, slip.where[0]), said.asked
    assert not said.unclear
    for _numbers, text in said.asked:
        assert "?" in text


@pytest.mark.parametrize("factor", [1.3, 0.6, 3.0])
def test_the_peak_of_the_own_sweep_is_not_told(usual, tmp_path, factor):
    """What 2.11 asks for is in the own recording; to read it is the student's part."""
    said = asked_with(usual, tmp_path, {("2.11", "omega_n"): lambda right, own: factor * right})
    assert texts(said, "2.9")
    peak = float(usual[0]["2.11", "omega_n"])
    numbers = [float(one) for one in re.findall(r"\d+\.\d+|\d+", " ".join(texts(said, "2.9")))]
    assert not [one for one in numbers if abs(one / peak - 1) < 0.03 or abs(one / (peak / (2 * np.pi)) - 1) < 0.03]


@pytest.mark.parametrize(
    ("changes", "question", "told"),
    [
        ({("2.12", "J_l"): lambda v, own: v * 1e7}, "2.12", "g·cm²"),
        ({("2.12", "J_l"): lambda v, own: v * 1e3}, "2.12", "thousandth"),
        ({("2.12", "K_s"): lambda v, own: v * 1e3}, "2.12", "thousandth"),
        ({("2.14", "A"): lambda v, own: v * [[1], [1], [1.5], [1.5]]}, "2.14", r"swings at \d.* Hz"),
        ({("2.14", "A"): lambda v, own: v[[1, 0, 2, 3]]}, "2.14", "rows 1"),
        ({("3.8", "K"): lambda v, own: -v}, "3.8", "−K"),
        (
            {("3.12", "satisfied"): lambda v, own: "yes", ("3.12", "t_s"): lambda v, own: 0.7},
            "3.12",
            r"t_s is 0.7 s.*0\.5 s",
        ),
        (
            {
                ("3.14", name): lambda v, own, value=value: value
                for name, value in {"t_s": 0.3, "PO": 2, "alpha_max_deg": 9, "V_max": 8, "satisfied": "no"}.items()
            },
            "3.14",
            "not all four",
        ),
        ({("3.12", "t_s"): lambda v, own: 1000 * v}, "3.12", "ms for s"),
        ({("3.4", "desired_poles"): lambda v, own: [-1.2 + 19.96j, -1.2 - 19.96j, -30, -40]}, "3.4", r"0\.06"),
    ],
)
def test_what_is_asked_names_numbers_of_the_students_own(usual, tmp_path, changes, question, told):
    assert re.search(told, " ".join(texts(asked_with(usual, tmp_path, changes), question)))


def test_what_rounding_leaves_in_the_column_of_w_that_is_carried_to_zero_is_not_asked_about(usual, tmp_path):
    """Found on the bench "measure-22", whose student rounded each step to four digits."""
    lost = np.array([[0.0], [1], [1], [-1]]) * [1e-4, 0, 0, 0]
    said = asked_with(usual, tmp_path, {("3.7", "W"): lambda W, own: W + np.abs(W).max() * lost})
    assert not texts(said, "2.14")


def test_a_recording_of_a_practice_bench_is_asked_about(usual, tmp_path):
    with lab_of(STUDENT).practice().bench() as bench:
        practised = experiments.sweep(bench, progress=False)
    said = asked_with(usual, tmp_path, {("2.9", "sweep"): lambda right, own: practised})
    assert "practice bench" in texts(said, "2.9")[0]


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e200])
def test_whatever_numbers_there_are_it_says_something_and_raises_nothing(usual, tmp_path, size):
    numeric = [where for where in usual[0] if CATALOGUE.find(where[0]).part(where[1]).kind in ("number", "matrix")]
    said = asked_with(usual, tmp_path, dict.fromkeys(numeric, lambda right, own: right * size))
    assert len(said.asked) > 5
    assert str(said)


def test_in_a_session_it_prints_what_there_is_to_ask_and_keeps_nothing(tmp_path, capsys):
    lab = rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)
    lab.answer("2.11", omega_n=20.0)
    lab.answer("2.12", J_l=0.0035, K_s=0.07)
    before = (tmp_path / "answers.json").read_bytes()
    capsys.readouterr()
    assert lab.reflect("02") is None
    printed = capsys.readouterr().out.splitlines()
    assert printed[1] == "  2.12, 2.11: Your K_s is your J_l times your omega_n. Which unit does that product have?"
    assert printed[2].endswith(": 2.9 sweep, 2.10 spectrum, 2.8 J_l.")
    assert (tmp_path / "answers.json").read_bytes() == before


def test_the_course_can_switch_it_off_or_delay_it(tmp_path, capsys):
    tomorrow = datetime.now().astimezone() + timedelta(days=1)
    for setting, fragment in (("off", "switched this off"), (tomorrow.isoformat(), f"from {tomorrow:%Y-%m-%d}")):
        (tmp_path / "course.json").write_text(json.dumps({"student": "ada", "reflect": setting}))
        lab = rotflex.course.lab.start(folder=tmp_path, quiet=True)
        lab.reflect()
        assert fragment in capsys.readouterr().out
