"""What this course's answers ask each other: slips are asked about, right answers never, and nothing is given away.

That nothing is asked of right ways of every kind is tested in ``tests/whole/test_right_ways.py``.
"""

import re

import numpy as np
import pytest
import sympy
from reflections import asked_of, lab_of, stored, usual_checks
from right_ways import worked
from single_slips import SLIPS, STUDENT
from working_through import K_s, alpha

import rotflex.course.lab
from labcourse.answers.reflection import Reflection, of_notebooks, reflect
from rotflex import experiments
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """A student's own right answers, and their file."""
    return worked(STUDENT, tmp_path_factory.mktemp(STUDENT))


@pytest.fixture(scope="module")
def asked_with(usual):
    """Ask what there is to ask of some answers when these are others; nothing is carried on."""
    seed, checks = student_seed(STUDENT), usual_checks(STUDENT)
    right = stored(usual[0], seed)

    def ask(changed):
        answers = right | stored(changed, seed)
        concerned = [check for check in checks if changed.keys() & set(check.about)]
        return reflect(concerned, lambda *where: answers[where])

    return ask


def texts(reflection, question):
    return [text for numbers, text in reflection.asked if question in numbers]


def test_right_answers_are_asked_nothing_and_all_of_them_are_looked_at(usual):
    said = asked_of(STUDENT, usual[1])
    assert said == Reflection(compared=len(usual_checks(STUDENT)))


@pytest.mark.parametrize("notebook", [f"{number:02}" for number in range(1, 12)])
def test_each_notebook_that_asks_for_a_comparison_has_one(notebook):
    assert of_notebooks(lab_of(STUDENT).checks(), CATALOGUE, [notebook])


#: Slips by name, or an answer and its change → what is asked at that answer's question.
ASKED = {
    "2.1 V: no factor 1/2": "Lagrangian",
    "2.2 T: the link turns with alpha alone": "Lagrangian",
    "2.3 L: the total energy": "Lagrangian",
    "2.4 equation: friction drives": r"equation of question 2\.4",
    "2.6 theta_ddot: the spring's sign": r"equation of question 2\.4",
    ("2.5", "equation", lambda right: sympy.Eq(right.lhs + K_s * alpha, right.rhs)): r"equation of question 2\.5",
    "2.7 A: the rates exchanged": "rows? .* of A",
    "2.8 J_l: no parallel axis": "% of this J_l",
    "2.11 omega_n: in Hz": "% of its highest value",
    "2.12 K_s: omega_n not squared": r"swings at \d.* Hz",
    "2.13 state_space: a minus lost in the last row of A": "row 4 of A",
    "2.13 state_space: a minus lost in B": "row .* of B",
    "2.13 state_space: A transposed": "row 1, 2, 3, 4 of A",
    "2.14 A: a minus lost in the last row": "nothing pulls it back",
    ("2.14", "A", lambda right: right * [[1], [1], [1.5], [1.5]]): r"arm of your A swings at \d.* Hz",
    "2.18 poles: of the torque's model": "torque as input",
    "2.18 poles: mirrored": "motor voltage as input, are others",
    "Table 2 C: its rows exchanged": "C in the table",
    "3.2 polynomial: a coefficient": r"roots of this polynomial .* question 2\.18",
    "3.2 polynomial: lowest power first": "highest power of s first",
    "3.3 A_c: transposed": "A_c brings along",
    "3.3 B_c: first entry": "A_c − B_c·K_c",
    "3.4 desired_poles: zeta 0.06": r"damping ratio of 0\.06",
    "3.4 desired_poles: in the right half plane": "negative real parts",
    ("3.4", "desired_poles", lambda right: [-12, -16, -30, -40]): "How many pairs",
    "3.4 polynomial: a zero lost": r"roots of this polynomial .* question 3\.4",
    "3.5 K_c: open loop less desired": "A_c − B_c·K_c",
    "3.7 W: the wrong order": "T times the inverse of T_c",
    "3.8 K: the other sign": r"closed-loop poles at .*\(3\.4\)",
    "3.11 response: with the torque's model": "simulate this model with this K",
    "3.12 t_s: from the start of the recording": "from which time",
    "3.14 alpha_max_deg: in radians": "largest magnitude",
    "3.16 V_max: from peak to peak": "largest magnitude",
    "Table 3 W: its inverse": "W in the table",
}
NAMED = {slip.name: slip for slip in SLIPS}


@pytest.mark.parametrize("slip", ASKED, ids=lambda slip: slip if isinstance(slip, str) else " ".join(slip[:2]))
def test_a_slip_is_asked_about_at_its_own_question_and_the_right_value_is_not_told(usual, asked_with, slip):
    own, nested = usual[0], {}
    for (question, part), value in own.items():
        nested.setdefault(question, {})[part] = value
    where = NAMED[slip].where if isinstance(slip, str) else slip[:2]
    right = own[where]
    given = NAMED[slip].change(right, nested) if isinstance(slip, str) else slip[2](right)
    said = asked_with({where: given})
    assert re.search(ASKED[slip], " ".join(texts(said, where[0]))), said.asked
    assert not said.unclear
    assert all("?" in text for _numbers, text in said.asked)
    if isinstance(right, float):
        of_it = " ".join(text for numbers, text in said.asked if numbers[0] == where[0])
        told = [float(number) for number in re.findall(r"\d+\.\d+|\d+", of_it)]
        secrets = {right, right / (2 * np.pi), np.rad2deg(right)} - {given}
        assert not [number for number in told for secret in secrets if abs(number / secret - 1) < 0.03]


def test_what_rounding_leaves_in_the_column_of_w_that_is_carried_to_zero_is_not_asked_about(usual, asked_with):
    """Found on the bench "measure-22", whose student rounded each step to four digits."""
    W, lost = usual[0]["3.7", "W"], np.array([[0.0], [1], [1], [-1]]) * [1e-4, 0, 0, 0]
    assert not texts(asked_with({("3.7", "W"): W + np.abs(W).max() * lost}), "2.14")


def test_a_recording_of_a_practice_bench_is_asked_about(asked_with):
    with lab_of(STUDENT).practice().bench() as bench:
        practised = experiments.sweep(bench, progress=False)
    assert "practice bench" in texts(asked_with({("2.9", "sweep"): practised}), "2.9")[0]


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e200])
def test_whatever_numbers_there_are_it_says_something_and_raises_nothing(usual, asked_with, size):
    numeric = [where for where in usual[0] if CATALOGUE.find(where[0]).part(where[1]).kind in ("number", "matrix")]
    said = asked_with({where: usual[0][where] * size for where in numeric})
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
    assert printed[1].startswith("  2.12, 2.11: With your J_l = 0.0035 kg·m² and K_s = 0.07 N·m/rad")
    assert printed[2].endswith(": 2.9 sweep, 2.8 J_l.")
    assert (tmp_path / "answers.json").read_bytes() == before
