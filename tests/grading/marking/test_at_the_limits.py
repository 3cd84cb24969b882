"""Tolerances of checks, and bounds of what is marked, at either side of their values."""

import math
import signal

import numpy as np
import pytest

from labcourse.answers.parts import Part, choice, number, recording
from labcourse.grading.marking import checks, decoding
from labcourse.grading.marking.checks import ChoiceIs, Number, RecordingOf, misfit, wrong_answers
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.recording import Channel, Recording

X = number("x", "", None, "", "A number.")
ABC = choice("letter", ("a", "b", "c"), "", "A letter.")
RIGHT, FOLLOW, WRONG = Status.RIGHT, Status.FOLLOW_THROUGH, Status.WRONG


def case(own=None, virtual=True):
    answers = own or {}
    return Case(None, lambda question, part: answers[question, part], 1, virtual)


@pytest.mark.parametrize("target", [20.0, -20.0, 1e-9, 3e7])
@pytest.mark.parametrize("rtol", [0.01, 0.05, 0.3])
@pytest.mark.parametrize(("share", "status"), [(0.98, RIGHT), (-0.98, RIGHT), (1.02, WRONG), (-1.02, WRONG)])
def test_a_number_is_right_up_to_its_tolerance_to_either_side(target, rtol, share, status):
    check = Number("the number", lambda bench: target, rtol)
    verdict = check.verdict(X, target * (1 + share * rtol), case())
    assert (verdict.status, verdict.share) == (status, float(status is RIGHT))
    words = f"Within {100 * rtol:g} % of the number." if status is RIGHT else f"More than {100 * rtol:g} % off"
    assert verdict.reason.startswith(words)


def test_of_nought_only_nought_is_near():
    check = Number("the number", lambda bench: 0.0, 0.1)
    assert [check.verdict(X, value, case()).status for value in (0.0, 1e-12)] == [RIGHT, WRONG]


@pytest.mark.parametrize("rtol", [None, 0.1])
@pytest.mark.parametrize(("share", "status"), [(0.98, FOLLOW), (-0.98, FOLLOW), (1.02, WRONG), (-1.02, WRONG)])
def test_a_number_follows_from_ones_own_up_to_its_tolerance_which_is_two_per_cent_unless_given(rtol, share, status):
    more = {} if rtol is None else {"follow_rtol": rtol}
    check = Number(
        "it", lambda bench: 1.0, 0.01, follow=lambda own: 2 * own("1", "x"), follow_what="twice your own", **more
    )
    verdict = check.verdict(X, 10.0 * (1 + share * (rtol or 0.02)), case({("1", "x"): 5.0}))
    assert verdict.status is status
    expected = "agrees with twice your own." if status is FOLLOW else "It does not agree with twice your own either."
    assert expected in verdict.reason


@pytest.mark.parametrize("own", [{}, {("1", "x"): 0.0}, {("1", "x"): math.inf}, {("1", "x"): math.nan}])
def test_from_nothing_nothing_follows(own):
    check = Number("it", lambda bench: 1.0, 0.01, follow=lambda own: own("1", "x"), follow_what="your own")
    verdict = check.verdict(X, own.get(("1", "x"), 5.0), case(own))
    assert verdict.status is WRONG and "your own" not in verdict.reason


def test_from_a_division_by_nought_nothing_follows():
    check = Number("it", lambda bench: 1.0, 0.01, follow=lambda own: 1 / own("1", "x"), follow_what="your own")
    assert check.verdict(X, 5.0, case({("1", "x"): 0})).status is WRONG


@pytest.mark.parametrize(("share", "named"), [(0.98, True), (-0.98, True), (1.02, False), (-1.02, False)])
def test_a_slip_is_named_up_to_the_tolerance_of_what_it_leads_to(share, named):
    check = Number("it", lambda bench: 1.0, 0.05, slips=lambda bench: {"no slip": 9.0, "in degrees": 57.3})
    verdict = check.verdict(X, 57.3 * (1 + share * 0.05), case())
    assert verdict.status is WRONG and (verdict.reason == "Not it: in degrees.") == named


@pytest.mark.parametrize(("given", "follows", "status"), [("a", "b", RIGHT), ("b", "b", FOLLOW), ("c", "b", WRONG)])
def test_a_choice_is_right_or_follows_or_is_wrong(given, follows, status):
    assert ChoiceIs("a", "so", lambda own, bench: follows, "yours").verdict(ABC, given, case()).status is status


@pytest.mark.parametrize("expected", ["A", lambda bench: "A"], ids=["a text", "of the bench"])
def test_a_right_choice_that_nobody_can_choose_is_a_fault_of_the_key(expected):
    with pytest.raises(TypeError, match="expects 'A', and the choices are 'a', 'b', 'c'"):
        ChoiceIs(expected, "so").verdict(ABC, "a", case())


@pytest.mark.parametrize("error", checks.EVALUATION_ERRORS)
def test_a_choice_of_which_nothing_follows_is_wrong(error):
    def follow(own, bench):
        raise error("nothing")

    assert ChoiceIs("a", "so", follow).verdict(ABC, "b", case()).status is WRONG


TIME = 0.01 * np.arange(300)
WANTED = np.sin(7 * TIME)
PART = recording("r", {"excitation": "sweep"}, ("theta",), "", "", units={"theta": "rad"})


def of_a_run(values, n=300, sample_time=0.01, **metadata):
    about = {"excitation": "sweep", **metadata}
    channels = {"theta": {"unit": "rad", "values": values}}
    return {"n": n, "sample_time": sample_time, "channels": channels, "metadata": about}


def judged(value, virtual=True, **choices):
    bench = Recording(TIME, {"theta": Channel(WANTED, "rad")}, {})
    check = RecordingOf(lambda _bench: bench, "theta", **({"rtol": 0.1} | choices))
    return check.verdict(PART, value, case(virtual=virtual))


@pytest.mark.parametrize(("share", "status"), [(0.0, RIGHT), (0.98, RIGHT), (-0.98, RIGHT), (1.02, WRONG)])
def test_a_recording_is_right_up_to_its_tolerance_whatever_its_mean(share, status):
    for mean in (0.0, 5.0):
        assert judged(of_a_run((1 + 0.1 * share) * WANTED + mean)).status is status


@pytest.mark.parametrize(
    ("n", "sample_time", "status"), [(301, 0.01, WRONG), (300, 0.0100098, RIGHT), (300, 0.010011, WRONG)]
)
def test_a_recordings_length_and_sample_time_are_those_of_the_experiment(n, sample_time, status):
    assert judged(of_a_run(WANTED, n, sample_time)).status is status


def test_a_recordings_settings_are_looked_at_before_its_samples():
    assert judged(of_a_run(WANTED, excitation="steps")).reason.endswith("its excitation should be 'sweep'.")
    slips = {("gain", 1): "with another gain", ("run", 1): "of another run"}
    assert judged(of_a_run(-WANTED, run=2), slips=slips).reason == "of another run"
    assert judged(of_a_run(-WANTED, gain=2, run=2), slips=slips).reason == "with another gain"
    assert judged(of_a_run(-WANTED, gain=1, run=1), slips=slips).reason.startswith("Not a recording of your bench")
    assert judged(of_a_run(WANTED), virtual=False).status is Status.FOR_A_PERSON


@pytest.mark.parametrize(("bench", "run"), [({"run": 1}, 1), ({"run": 1000}, 1000), ({}, 1), (None, 1), ("virtual", 1)])
def test_a_recording_that_names_no_run_is_of_the_first(bench, run):
    assert checks.claimed_run({"bench": bench}) == run


@pytest.mark.parametrize("run", [0, 1001, True, 2.0, "2", None])
def test_runs_have_whole_numbers_from_1_to_1000(run):
    with pytest.raises(ValueError, match="1 to 1000"):
        checks.claimed_run({"bench": {"run": run}})
    assert judged(of_a_run(WANTED, bench={"run": run})).status is WRONG


def test_a_misfit_is_relative_to_what_is_wanted_and_infinite_without_it():
    assert misfit(1.5 * WANTED + 3, WANTED) == pytest.approx(0.5)
    assert misfit(WANTED, 2 * WANTED) == pytest.approx(0.5)
    with np.errstate(all="ignore"):
        assert misfit(WANTED, np.ones(300)) == misfit(np.ones(300), np.ones(300)) == math.inf


def test_the_alarm_is_set_to_the_time_that_is_allowed_and_none_is_left():
    with decoding.time_limited(5.0):
        assert 1 < signal.getitimer(signal.ITIMER_REAL)[0] <= 5
    with pytest.raises(decoding.TooSlow, match=r"stopped after 0\.2 s"), decoding.time_limited(0.2):
        signal.pause()
    assert signal.getitimer(signal.ITIMER_REAL) == (0, 0)


@pytest.mark.parametrize(
    ("value", "digits", "status"),
    [
        (3.1, 2, RIGHT),
        (3.1, 0, WRONG),
        (3.2, 2, WRONG),  # rounded the wrong way
        (3.105, 2, WRONG),  # not rounded, and off
        (3.0, 1, RIGHT),
        (3.0, 2, WRONG),
        (3.12, 2, RIGHT),  # within 1 %
    ],
)
def test_a_number_is_right_to_the_fewest_digits_that_are_allowed(value, digits, status):
    check = Number("it", lambda bench: math.pi, 0.01, fewest_digits=digits)
    assert check.verdict(X, value, case()).status is status


@pytest.mark.parametrize("value", [0.0, 0.1, 2.0, 90.0])
def test_a_number_made_wrong_is_off_by_a_twentieth_of_what_is_plausible_at_least(value):
    part = Part("x", "number", 1, "...", unit="%", plausible=(0.0, 100.0))
    assert next(wrong_answers(part, value))[1] - value == pytest.approx(5.0 + 0.37 * value)
