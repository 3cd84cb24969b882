"""The gain to go on with: no bench is stopped by it, and it is taken only where the student's own is of no use."""

import re

import control
import numpy as np
import pytest

from rotflex import experiments, hil, simulation
from rotflex.config import joint, srv02
from rotflex.course import spare_design

PRINTED = np.array([spare_design.SPARE_GAIN])
WANTED = [-12 + 16j, -12 - 16j, -30, -40]


def model(K_s=1.4, sign=1.0):
    """The model with the voltage as input; ``sign=-1`` loses the minus in its last row."""
    servo, arm = srv02(), joint(1)
    k, b = K_s / servo.J_eq, servo.B_eq / servo.J_eq
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, k, -b, 0], [0, -sign * (k + K_s / arm.J_l), b, 0]])
    return simulation.with_actuator(A, np.array([0, 0, 1, -1]) / servo.J_eq, servo)


def gain(A, B):
    return np.reshape(control.place(A, B, WANTED), (1, 4))


@pytest.mark.parametrize(
    ("count", "duration"),
    [(3, 10.0), pytest.param(300, 3.1, marks=[pytest.mark.slow, pytest.mark.scheduled])],
    ids=["few", "many"],
)
def test_no_bench_is_stopped_by_the_spare_gain(count, duration):
    for seed in range(count):
        for feedback in ("full", "partial"):
            with hil.open("virtual", seed=seed) as bench:
                run = experiments.tracking(bench, PRINTED, feedback, duration=duration, progress=False)
            assert np.abs(run["theta"]).max() < 0.5 * bench.safety.limits.theta, seed
            assert np.abs(run["alpha"]).max() < 0.8 * bench.safety.limits.alpha, seed
            assert spare_design.can_be_measured(run), seed


def test_a_gain_that_holds_its_model_stays(capsys):
    A, B = model()
    np.testing.assert_array_equal(spare_design.for_model(A, B, gain(A, B)), gain(A, B))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(("change", "why"), [(lambda K: -K, "unstable"), (lambda K: 1e-3 * K, "follow")])
def test_for_a_gain_that_does_not_the_printed_one_stands_in_and_it_is_said_why_and_where_to_look(change, why, capsys):
    A, B = model()
    np.testing.assert_array_equal(spare_design.for_model(A, B, change(gain(A, B))), PRINTED)
    said = capsys.readouterr().out
    for pattern in (why, "2.14", "3.5", "3.8", "18.2356, -17.1547"):
        assert re.search(pattern, said), said


def test_on_a_model_that_the_printed_gain_does_not_hold_another_does_that_is_not_the_answer(capsys):
    A, B = model(sign=-1)
    stand_in = spare_design.for_model(A, B, PRINTED)
    assert "the model itself is not right" in capsys.readouterr().out
    assert spare_design.holds(A, B, stand_in)
    assert not np.allclose(stand_in, gain(A, B), rtol=0.1)


def test_a_model_that_no_gain_holds_has_none(capsys):
    A, _ = model()
    assert spare_design.for_model(A, np.zeros((4, 1)), PRINTED) is None
    assert "wait for another model" in capsys.readouterr().out


@pytest.mark.parametrize("feedback", [("full",), ("full", "partial")])
def test_a_gain_that_the_bench_bears_stays(feedback, capsys):
    K = gain(*model())
    np.testing.assert_array_equal(spare_design.for_bench(lambda: hil.open(seed=3), K, feedback), K)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("K", "patterns"),
    [
        (-gain(*model()), [r"deflection reached|servo angle reached", "2.14", "3.5", "3.8", "18.2356"]),
        (1e-3 * gain(*model()), ["not follow", "2.14", "3.5", "3.8", "18.2356"]),
        (None, ["3.8"]),
    ],
    ids=["away", "weak", "none"],
)
def test_for_one_that_it_does_not_and_for_none_the_printed_one_stands_in(K, patterns, capsys):
    np.testing.assert_array_equal(spare_design.for_bench(lambda: hil.open(seed=3), K), PRINTED)
    said = capsys.readouterr().out
    assert all(re.search(pattern, said) for pattern in patterns), said


class RealBench(hil.Bench):
    """As far as anybody can tell."""

    def __init__(self, *arguments, **settings):
        super().__init__(*arguments, **settings)
        self.identity = {"board": "q2_usb"}


def test_a_virtual_bench_is_tried_with_the_whole_wave_and_a_real_one_gently(monkeypatch):
    tried = []
    run = experiments.tracking

    def watched(bench, *arguments, **settings):
        tried.append(settings.get("amplitude"))
        return run(bench, *arguments, **settings)

    monkeypatch.setattr(experiments, "tracking", watched)
    spare_design.for_bench(lambda: hil.open(seed=3), PRINTED)
    assert tried == [None]
    tried.clear()
    with monkeypatch.context() as context:
        context.setattr(spare_design, "can_be_measured", lambda run: False)
        spare_design.for_bench(lambda: hil.open(seed=3), PRINTED)
    assert tried == [None, pytest.approx(np.deg2rad(2))]  # each once
    tried.clear()
    monkeypatch.setattr(hil, "Bench", RealBench)
    spare_design.for_bench(lambda: hil.open(seed=3), PRINTED)
    assert tried == [pytest.approx(np.deg2rad(2))]
