"""Numbers that build on each other: right, right for the student's own stiffness, or given their own last answer."""

import control
import numpy as np
import pytest
from scipy.linalg import expm

from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex import simulation
from rotflex.course.questions import CATALOGUE
from solutions import tolerances
from solutions.design_checks import ArrayFrom, PolesFrom, StateSpaceFunction
from solutions.key_modeling import VALIDATION
from solutions.loop_checks import ClosedLoopPoles, GainPlaces
from solutions.true_bench import TrueBench
from solutions.wanted import desired_poles

BENCH = TrueBench("ada")
WANTED = [-12 + 16j, -12 - 16j, -30, -40]
C = np.eye(2, 4)
ASKED = [("2.14", "A"), ("2.14", "B"), ("2.18", "poles"), ("3.8", "K"), ("3.1", "stability"), ("2.13", "state_space")]
A_PART, B_PART, POLES_PART, K_PART, STABILITY_PART, FUNCTION_PART = (
    CATALOGUE.find(one).part(name) for one, name in ASKED
)


def written_out(K_s, J_l, J_eq, B_eq):
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [0, K_s / J_eq, -B_eq / J_eq, 0], [0, -K_s / J_eq - K_s / J_l, B_eq / J_eq, 0]]
    return np.array(A), np.array([[0], [0], [1 / J_eq], [-1 / J_eq]])


def model(K_s):
    return written_out(K_s, BENCH.J_l, BENCH.servo.J_eq, BENCH.servo.B_eq)


def voltage_model(K_s):
    return simulation.with_actuator(*model(K_s), BENCH.servo)


def gain(K_s):
    A, B = voltage_model(K_s)
    return np.asarray(control.place(A, np.reshape(B, (4, 1)), WANTED)).reshape(1, 4)


def status(check, part, value, **own):
    return verdict(check, part, value, **own).status


def verdict(check, part, value, **own):
    """With own answers given as ``K_s=...``, ``A=...``, ``B=...``."""
    places = {
        "K_s": ("2.12", "K_s"),
        "K": ("3.8", "K"),
        "A": ("2.14", "A"),
        "B": ("2.14", "B"),
        "poles": ("2.18", "poles"),
    }
    known = {places[name]: value for name, value in own.items()}
    return check.verdict(part, value, Case(BENCH, lambda q, p: known[q, p], 7))


MODEL = ArrayFrom("the matrix A", lambda d: d.torque_model[0])
OPEN_LOOP = PolesFrom("the open-loop poles", lambda d: d.poles)
GAIN = GainPlaces()


@pytest.mark.parametrize("off", [1.001 - tolerances.K_S, 0.999 + tolerances.K_S])
def test_what_follows_from_a_stiffness_in_tolerance_is_right(off):
    K_s = off * BENCH.K_s
    assert status(MODEL, A_PART, model(K_s)[0], K_s=K_s) is Status.RIGHT
    assert status(OPEN_LOOP, POLES_PART, np.linalg.eigvals(voltage_model(K_s)[0]), K_s=K_s) is Status.RIGHT
    assert status(GAIN, K_PART, gain(K_s), K_s=K_s) is Status.RIGHT


@pytest.mark.parametrize("off", [0.5, 0.8, 1.25, 2.5])
def test_what_follows_from_a_stiffness_beyond_it_follows_and_without_that_stiffness_is_wrong(off):
    K_s = off * BENCH.K_s
    poles = np.linalg.eigvals(voltage_model(K_s)[0])
    answers = ((MODEL, A_PART, model(K_s)[0]), (OPEN_LOOP, POLES_PART, poles), (GAIN, K_PART, gain(K_s)))
    for check, part, value in answers:
        assert status(check, part, value, K_s=K_s) is Status.FOLLOW_THROUGH
        assert status(check, part, value) is Status.WRONG


def test_a_stiffness_that_was_not_answered_is_taken_from_the_own_matrix_if_it_is_right():
    for off, expected in ((0.95, Status.RIGHT), (1.4, Status.WRONG)):
        A, _ = model(off * BENCH.K_s)
        assert status(MODEL, A_PART, A, A=A) is expected
        assert status(OPEN_LOOP, POLES_PART, np.linalg.eigvals(voltage_model(off * BENCH.K_s)[0]), A=A) is expected


@pytest.mark.parametrize(
    ("check", "part", "value", "own"),
    [
        (MODEL, A_PART, np.ones((4, 4)), {"K_s": 3 * BENCH.K_s}),
        (OPEN_LOOP, POLES_PART, np.array([-1, -2, -3, -4]), {"K_s": 3 * BENCH.K_s}),
        (ClosedLoopPoles(), POLES_PART, np.array([-1, -2, -3, -4]), {"K": gain(3 * BENCH.K_s)}),
    ],
)
def test_only_own_answers_that_are_there_are_said_to_disagree(check, part, value, own):
    nothing, something = verdict(check, part, value), verdict(check, part, value, **own)
    assert nothing.status is something.status is Status.WRONG
    assert "your own" in something.reason and "your own" not in nothing.reason


def _nothing(question, part):
    raise KeyError(question, part)


def test_other_poles_and_extreme_gains_are_wrong():
    check = PolesFrom("the desired poles", lambda d: desired_poles())
    assert status(check, POLES_PART, np.array(WANTED)) is Status.RIGHT
    assert status(check, POLES_PART, np.array([-12 + 16j, -12 + 16j, -30, -40])) is Status.WRONG  # one pole twice
    with np.errstate(all="ignore"):
        for entry in (1e308, 0.0, np.finfo(float).tiny):
            assert status(GAIN, K_PART, np.full((1, 4), entry)) is Status.WRONG


def outputs(change):
    """What a student's function gives on the drawn parameters, changed."""
    found = []
    for arguments in FUNCTION_PART.probe.inputs(7):
        matrices = dict(zip("ABCD", (*written_out(*arguments), np.eye(2, 4), np.zeros((2, 1))), strict=True))
        change(matrices)
        found.append(tuple(matrices.values()))
    return found


@pytest.mark.parametrize(
    ("change", "share"),
    [
        (lambda m: None, 1.0),
        (lambda m: m.update(B=-m["B"], D=m["D"] + 1), 0.0),
    ],
)
def test_a_function_for_the_model_earns_by_matrices(change, share):
    """With one matrix wrong: tests/whole/test_single_slips.py."""
    verdict = StateSpaceFunction().verdict(FUNCTION_PART, outputs(change), Case(BENCH, _nothing, 7))
    assert verdict.share == share


def test_a_function_that_is_right_for_one_joint_only_is_wrong():
    """As with a stiffness that is written into it."""
    places = iter(range(100))

    def one_joint(matrices):
        if next(places):
            matrices["A"][3, 1] *= 1.4

    verdict = StateSpaceFunction().verdict(FUNCTION_PART, outputs(one_joint), Case(BENCH, _nothing, 7))
    assert verdict.share == 0.0 and "Look at row 4 of A" in verdict.reason


@pytest.mark.parametrize("sample_time", [0.001, 0.002, 0.02])
def test_a_model_in_discrete_time_is_named_as_what_it_is(sample_time):
    A, B = model(BENCH.K_s)
    sampled, euler = (control.c2d(control.ss(A, B, C, 0), sample_time, how) for how in ("zoh", "euler"))
    for discrete in (sampled, euler):
        assert "in discrete time" in verdict(VALIDATION["2.14"]["A"], A_PART, discrete.A).reason
    given = verdict(VALIDATION["2.14"]["B"], B_PART, sampled.B, A=sampled.A)
    assert given.status is Status.WRONG and "in discrete time" in given.reason
    poles = np.linalg.eigvals(control.c2d(control.ss(*voltage_model(BENCH.K_s), C, 0), sample_time).A)
    assert "in discrete time" in verdict(OPEN_LOOP, POLES_PART, poles).reason
    functions = outputs(lambda m: m.update(A=expm(m["A"] * sample_time)))
    said = StateSpaceFunction().verdict(FUNCTION_PART, functions, Case(BENCH, _nothing, 7))
    assert said.status is Status.WRONG and "in discrete time" in said.reason


def test_what_is_in_continuous_time_is_never_named_as_discrete():
    A, _B = model(BENCH.K_s)
    for wrong in (1.4 * A, A.T, np.eye(4), np.zeros((4, 4)), np.diag([1.0, 1, 1, 0]), expm(A * 0.002) * 1.1):
        assert "discrete" not in verdict(VALIDATION["2.14"]["A"], A_PART, wrong).reason
    for wrong in (np.array(WANTED), np.array([0, 1, 1, 1]), np.zeros(4), np.ones(4)):
        assert "discrete" not in verdict(OPEN_LOOP, POLES_PART, wrong).reason
