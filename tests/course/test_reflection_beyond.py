"""What the answers of notebook 11 ask each other: slips are asked about, right and consistent answers never.

The answers are worked out by python-control and numpy (``beyond_answers.py``), not by the package.
"""

from functools import cache

import control
import numpy as np
import pytest
import sympy
from beyond_answers import FLAT, POLES, B_eq, J_l, Student, a, gamma_ddot, zoh
from reflections import stored
from working_through import Pen, digits, prelab

from labcourse.answers.reflection import Reflection, reflect
from rotflex.config import srv02
from rotflex.course.reflection.control import control_checks
from solutions.true_bench import TrueBench

NAMES = ("s5", "s0", "s17", "ada", "bob", "s11")
CHECKS = [check for check in control_checks(srv02()) if check.about[0][0].startswith("4.")]
SEED = 7
PEN = Pen({})
prelab(PEN)
RATES = {("2.6", name): PEN.answers["2.6"][name] for name in ("theta_ddot", "alpha_ddot")}


@cache
def student(name, factor=1.02):
    """A student with a stiffness that is so many times the right one."""
    bench = TrueBench(name)
    return Student(name, bench, factor * bench.K_s)


@cache
def answers_of(name, factor=1.02):
    one = student(name, factor)
    Phi, Gamma, _L, K = one.sampled(0.03)
    sampled = {("4.5", "Phi"): Phi, ("4.5", "Gamma"): Gamma, ("4.6", "K"): K}
    return stored({**RATES, **one.before, ("4.3", "L"): one.L, **sampled, **FLAT}, SEED)


def asked_of(answers):
    return reflect(CHECKS, lambda *where: answers[where])


@pytest.mark.parametrize("name", NAMES)
def test_right_answers_of_many_benches_are_asked_nothing(name):
    said = asked_of(answers_of(name))
    assert said == Reflection(compared=len(CHECKS))


@pytest.mark.parametrize("count", [3, 2])
def test_what_rounding_leaves_is_not_asked_about(count):
    own = answers_of(NAMES[0])
    rounded = {where: digits(count)(v) if isinstance(v, float | np.ndarray) else v for where, v in own.items()}
    assert not asked_of(rounded).asked


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_answers_that_are_wrong_and_go_together_are_asked_nothing(factor):
    """Nothing here knows what is right."""
    said = asked_of(answers_of(NAMES[0], factor))
    assert not (said.asked or said.missing or said.unclear)


def exchanged(one):
    """Phi and Gamma where the new voltage acts for 2 ms."""
    A, B = one.model
    (rest, old), (_, new) = (zoh(A, B, h) for h in (0.002, 0.028))
    Phi = np.zeros((5, 5))
    Phi[:4, :4], Phi[:4, 4:] = zoh(A, B, 0.03)[0], rest @ new
    return {("4.5", "Phi"): Phi, ("4.5", "Gamma"): np.vstack([old, [[1]]])}


def part(number, name, change):
    """A slip in one answer: the right value → what is given."""
    return lambda one, own: {(number, name): change(own[number, name])}


SLIPS = {
    "4.3 the other sign": part("4.3", "L", lambda v: -v),
    "4.3 per degree": part("4.3", "L", np.rad2deg),
    "4.5 at 2 ms": lambda one, own: {("4.5", "Phi"): one.sampled(0.00201)[0]},
    "4.5 in the torque": lambda one, own: {
        ("4.5", "Phi"): np.pad(zoh(*one.torque_model, 0.03)[0], (0, 1)),
    },
    "4.5 the last voltage stays": part("4.5", "Phi", lambda v: v + np.diag([0, 0, 0, 0, 1])),
    "4.5 no new voltage": part("4.5", "Gamma", lambda v: v * [[1], [1], [1], [1], [0]]),
    "4.5 delay and rest exchanged": lambda one, own: exchanged(one),
    "4.6 the other sign": part("4.6", "K", lambda v: -v),
    "4.6 the continuous gain": lambda one, own: {("4.6", "K"): np.append(one.K, 0)[np.newaxis]},
    # Noticed on half of the benches, of the slower arms.
    "4.6 without the delay": lambda one, own: {
        ("4.6", "K"): np.append(control.place(*zoh(*one.model, 0.03), np.exp(POLES * 0.03)), 0)[np.newaxis],
    },
    "4.9 the sign of alpha": part("4.9", "alpha", lambda v: -v),
    "4.9 no friction": part("4.9", "V_m", lambda v: v.subs(B_eq, 0)),
    "4.9 no spring": part("4.9", "V_m", lambda v: v - J_l * gamma_ddot / a),
    "4.9 the torque": part("4.9", "V_m", lambda v: sympy.expand(v * a)),
}


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_is_asked_about_at_its_question(name):
    own = answers_of(NAMES[0])
    slip = stored(SLIPS[name](student(NAMES[0]), own), SEED)
    said = asked_of({**own, **slip})
    texts = [text for numbers, text in said.asked if name.split()[0] == numbers[0]]
    assert texts, said
    assert not said.unclear
    assert all(text.endswith("?") for text in texts)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e200])
def test_whatever_numbers_there_are_it_says_something_and_raises_nothing(size):
    own = answers_of(NAMES[0])
    said = asked_of({where: v * size if isinstance(v, float | np.ndarray) else v for where, v in own.items()})
    assert said.asked or said.unclear
    assert str(said)
