"""Responses and what is measured on them, held against the experiment run again."""

import itertools

import numpy as np
import pytest

from labcourse.answers import forms
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex import response
from rotflex.course import spare_design
from rotflex.course.questions import CATALOGUE
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop, with_actuator
from solutions.design_checks import Design
from solutions.repeated import own_gain, run_again, simulated_again, validated_again
from solutions.response_checks import Measured, ResponseOf, Satisfied
from solutions.true_bench import TrueBench

NAME, FRIEND = "ada", "bo"  # two benches with the same arm position and nearly the same stiffness
CHANNELS = ("theta", "alpha", "vm")
ASKED = [("3.13", "response"), *(("3.14", name) for name in ("t_s", "alpha_max_deg", "satisfied"))]
RESPONSE, T_S, DEFLECTION, SATISFIED = (CATALOGUE.find(number).part(name) for number, name in ASKED)
SIMULATED = CATALOGUE.find("3.11").part("response")
FULL = run_again("full")
OWN = ("3.13", "response")


def stored(part, value):
    return forms.decode(part, forms.encode(part, value, 1).content)


@pytest.fixture(scope="module")
def bench():
    return TrueBench(NAME)


@pytest.fixture(scope="module")
def K(bench):
    return tuple(np.ravel(Design(bench.servo, bench.joint, bench.K_s).K).tolist())


@pytest.fixture(scope="module")
def run(bench, K):
    return bench.tracking(K, "full")


@pytest.fixture(scope="module")
def friends(K):
    return TrueBench(FRIEND).tracking(K, "full")


def case(bench, virtual=True, **own):
    """A case with own answers to 3.8 and of the response, as ``K=`` and ``response=``; ``q3_14_t_s=`` and such."""
    places = {"K": ("3.8", "K"), "response": OWN}
    known = {
        places.get(name) or (".".join(name[1:].split("_", 2)[:2]), name.split("_", 2)[2]): value
        for name, value in own.items()
    }
    return Case(bench, lambda question, part: known[question, part], 7, virtual)


def test_a_recording_of_the_own_bench_with_the_feedback_asked_for_is_right(bench, K, run, friends):
    check = ResponseOf(FULL, CHANNELS)

    def judged(recording, **metadata):
        value = stored(RESPONSE, recording)
        value["metadata"] |= metadata
        return check.verdict(RESPONSE, value, case(bench, K=np.array([K])))

    assert judged(run).status is Status.RIGHT
    assert judged(friends).status is Status.WRONG  # of a bench that is nearly the same
    partial = bench.tracking(K, "partial")
    assert judged(partial).status is Status.WRONG and "feedback" in judged(partial).reason
    assert judged(partial, feedback="full").status is Status.WRONG
    for odd in (None, "K", [1, 2], [1e308] * 4, [True, "x", None, {}]):
        assert judged(run, K=odd).status is Status.RIGHT


def simulation_with(A, B, K, saturation=None, fidelity="exact"):
    command = smooth_square_wave(time_axis(10.0, 0.002), 0.33, np.deg2rad(20), 100)
    return stored(SIMULATED, closed_loop(A, B, K, command, fidelity=fidelity, saturation=saturation))


def test_a_simulation_of_either_fidelity_with_the_limit_or_without_is_right_and_a_recording_none(bench, K, run):
    check, own = ResponseOf(simulated_again, CHANNELS), case(bench, K=np.array([K]))
    A, B = Design(bench.servo, bench.joint, bench.K_s).voltage_model
    for fidelity, saturation in itertools.product(("exact", "workbook"), (None, 10.0)):
        value = simulation_with(A, B, K, saturation, fidelity)
        assert check.verdict(SIMULATED, value, own).status is Status.RIGHT
    value = stored(RESPONSE, run)
    value["metadata"]["experiment"] = "closed_loop"
    assert check.verdict(SIMULATED, value, own).status is Status.WRONG


def test_a_number_carried_over_follows_and_only_if_it_is_the_same(bench):
    check = Measured("t_s", FULL, OWN, rtol=0.05, carried=("3.14", "t_s"))
    own = case(bench, q3_14_t_s=2.0)
    assert check.verdict(T_S, 2.0, own).status is Status.FOLLOW_THROUGH
    assert check.verdict(T_S, 1.5, own).status is Status.WRONG


LIMITS = {"t_s": 0.5, "PO": 5.0, "alpha_max_deg": 12.5, "V_max": 10.0}


def numbers(bench, **shares):
    """A case with own numbers, as shares of their limits; 0.9 where nothing is said."""
    return case(bench, **{f"q3_14_{part}": limit * shares.get(part, 0.9) for part, limit in LIMITS.items()})


def satisfied(value, own):
    """The verdict with the checks of the numbers, which have 3 % of room."""
    checks = {name: Measured(name, FULL, OWN) for name in LIMITS}
    return Satisfied("3.14", FULL, OWN, checks).verdict(SATISFIED, value, own)


def test_numbers_that_are_not_right_are_not_called_measured_and_what_agrees_with_them_follows(bench, K, run):
    worst = response.worst(response.measure(run))
    right_ones = {
        "t_s": worst.settling_time,
        "PO": worst.overshoot,
        "alpha_max_deg": np.rad2deg(worst.max_alpha),
        "V_max": worst.max_vm,
    }
    is_met = "yes" if all(right_ones[name] <= limit for name, limit in LIMITS.items()) else "no"
    own = {"K": np.array([K]), "response": stored(RESPONSE, run)}

    def judged(value, **changed):
        given = {f"q3_14_{name}": number for name, number in (right_ones | changed).items()}
        return satisfied(value, case(bench, **own, **given))

    measured, mistaken = judged(is_met), judged("no", t_s=5.0)
    assert (measured.status, mistaken.status) == (Status.RIGHT, Status.FOLLOW_THROUGH)
    assert "that you measured" in measured.reason and "not all of them are right" in mistaken.reason
    assert judged("yes", t_s=5.0).status is Status.WRONG


def test_nothing_follows_from_numbers_that_are_all_wrong_where_nothing_was_recorded(bench, K, run):
    invented = {f"q3_14_{name}": 0.3 * limit for name, limit in LIMITS.items()}
    for value in ("yes", "no"):
        verdict = satisfied(value, case(bench, **invented))
        assert verdict.status is Status.WRONG and "nothing follows" in verdict.reason
    recorded = case(bench, K=np.array([K]), response=stored(RESPONSE, run), **invented)
    assert satisfied("yes", recorded).status is Status.FOLLOW_THROUGH


@pytest.mark.parametrize(
    ("shares", "accepted"),
    [
        ({}, {"yes"}),
        *[({name: 1.1}, {"no"}) for name in LIMITS],
        ({"V_max": 1.0}, {"yes", "no"}),  # cut off there: it may have been more
        ({"V_max": 1.0, "t_s": 1.1}, {"no"}),
    ],
)
def test_specifications_are_met_as_the_own_numbers_say(bench, shares, accepted):
    check = Satisfied("3.14", FULL, OWN)
    given = {word: check.verdict(SATISFIED, word, numbers(bench, **shares)).status for word in ("yes", "no")}
    assert {word for word, status in given.items() if status is Status.RIGHT} == accepted


def test_what_does_not_come_from_the_virtual_bench_is_for_a_person(bench, run):
    elsewhere = case(bench, virtual=False)
    assert ResponseOf(FULL, CHANNELS).verdict(RESPONSE, stored(RESPONSE, run), elsewhere).status is Status.FOR_A_PERSON
    assert Measured("t_s", FULL, OWN).verdict(T_S, 0.4, elsewhere).status is Status.FOR_A_PERSON


@pytest.mark.parametrize("spare", [True, False], ids=["spare gain", "right design"])
def test_another_gains_simulation_counts_where_the_own_loop_runs_away_and_only_there(bench, K, spare):
    """A student who saw it run away and took another's gain, or the one that the notebook offers."""
    A, B = Design(bench.servo, bench.joint, bench.K_s).voltage_model
    value = simulation_with(A, B, spare_design.SPARE_GAIN if spare else np.array([K]))
    check = ResponseOf(simulated_again, CHANNELS)
    away, holding = case(bench, K=-np.array([K])), case(bench, K=(1.1 if spare else 1.3) * np.array([K]))
    assert check.verdict(SIMULATED, value, away).status is Status.RIGHT
    assert check.verdict(SIMULATED, value, holding).status is Status.WRONG


def test_the_gain_of_3_8_is_the_students_own_before_that_of_3_10(bench, K):
    known = {("3.8", "K"): np.array([K]), ("3.10", "K"): 2 * np.array([K])}
    judged = Case(bench, lambda question, part: known[question, part], 7)
    assert own_gain(judged) == pytest.approx(K)
    del known["3.8", "K"]
    assert own_gain(judged) == pytest.approx(2 * np.array(K))


def test_on_a_model_that_runs_away_what_the_notebook_goes_on_with_counts(bench):
    design = Design(bench.servo, bench.joint, bench.K_s)
    A, B = (np.array(matrix) for matrix in design.torque_model[:2])
    A[3, 1] = -A[3, 1]
    known = {("2.14", "A"): A, ("2.14", "B"): B, ("3.8", "K"): np.array([spare_design.SPARE_GAIN])}
    A_v, B_v = with_actuator(A, B, bench.servo)
    value = simulation_with(A_v, B_v, spare_design.stand_in(A_v, B_v))
    judged = Case(bench, lambda question, part: known[question, part], 7)
    assert ResponseOf(simulated_again, CHANNELS).verdict(SIMULATED, value, judged).status is Status.RIGHT


@pytest.mark.parametrize("factor", [-1.0, 1e-3], ids=["stops the bench", "does not follow"])
def test_numbers_that_the_own_gain_could_not_give_are_those_of_the_right_design_or_the_spare_gain(bench, K, factor):
    own = case(bench, K=factor * np.array([K]))
    for gain in (K, spare_design.SPARE_GAIN):
        worst = response.worst(response.measure(bench.tracking(tuple(gain), "full")))
        check = Measured("t_s", FULL, OWN, rtol=0.001)
        assert check.verdict(T_S, worst.settling_time, own).status is Status.RIGHT
        assert check.verdict(T_S, 1.5 * worst.settling_time, own).status is Status.WRONG


def test_a_model_too_large_to_be_simulated_breaks_nothing(bench):
    known = {("2.14", "A"): np.full((4, 4), 1e300), ("2.14", "B"): np.full((4, 1), 1e300)}
    with np.errstate(all="ignore"):
        runs = validated_again(Case(bench, lambda question, part: known[question, part], 7), {})
    assert len(runs) == 1
    assert np.isfinite(runs[0]["theta_model"]).all()


def test_numbers_of_a_recording_with_the_other_feedback_follow_from_it_and_not_without_it(bench, K):
    partial = bench.tracking(K, "partial")
    settling = response.worst(response.measure(partial)).settling_time
    check = Measured("t_s", FULL, OWN, slips=(run_again("partial"),))
    recorded = case(bench, K=np.array([K]), response=stored(RESPONSE, partial))
    assert check.verdict(T_S, settling, recorded).status is Status.FOLLOW_THROUGH
    assert check.verdict(T_S, 1.2 * settling, recorded).status is Status.WRONG
    right_one = case(bench, K=np.array([K]), response=stored(RESPONSE, bench.tracking(K, "full")))
    assert check.verdict(T_S, settling, right_one).status is Status.WRONG


def test_who_measured_a_servo_that_never_settles_need_not_give_a_settling_time(bench, K):
    check = Measured("t_s", FULL, OWN, measured="3.14")
    restless = np.array([K]) * [0.2, 1, 1, 1]  # it gets half way, and is still on its way when it is sent back
    run = bench.tracking(tuple(restless.ravel().tolist()), "full")
    assert response.worst(response.measure(run)).settling_time == np.inf
    recorded = {"K": restless, "response": stored(RESPONSE, run)}
    assert check.missing(T_S, case(bench, **recorded, q3_14_PO=0.0)).status is Status.RIGHT
    assert check.missing(T_S, case(bench, virtual=False, **recorded, q3_14_PO=0.0)) is None
    assert check.missing(T_S, case(bench, **recorded)) is None  # nothing was measured on it
    assert check.missing(T_S, case(bench, K=restless, q3_14_PO=0.0)) is None  # nothing was recorded
    settled = {"K": np.array([K]), "response": stored(RESPONSE, bench.tracking(K, "full"))}
    assert check.missing(T_S, case(bench, **settled, q3_14_PO=0.0)) is None
