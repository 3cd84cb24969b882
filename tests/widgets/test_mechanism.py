"""Servo and arm from above, held against the angles themselves."""

import numpy as np
import pytest

from rotflex.recording import Recording
from rotflex.widgets.mechanism import mechanism, played


def placed(point, signals):
    """Where a point stands, as a complex number: turning is multiplying."""
    place = complex(*point["at"])
    for step in reversed(point["frame"]):
        place *= np.exp(1j * signals[step["turn"]])
    return place


@pytest.mark.parametrize(("theta", "alpha"), [(0.0, 0.0), (0.6, -0.2), (-2.5, 0.3)])
def test_the_arm_is_deflected_from_the_servo_and_the_springs_reach_it(theta, alpha):
    panel = mechanism(theta, alpha).packed()
    drawn = [(one["kind"], [placed(point, panel["signals"]) for point in one["points"]]) for one in panel["shapes"]]
    kinds = [kind for kind, _ in drawn]
    assert kinds == ["circle", "line", "rectangle", "line", "spring", "spring", "dot"]
    (_, circle), (_, servo), (_, body), (_, arm), (_, left), (_, right), (_, axle) = drawn
    ahead = 1j * np.exp(1j * theta)  # up, turned anticlockwise
    assert circle == servo[:1] == arm[:1] == axle == [0]
    assert servo[1] == pytest.approx(ahead)
    assert arm[1] == pytest.approx(0.94j * np.exp(1j * (theta + alpha)))
    assert np.mean(body) == pytest.approx(0)
    assert max((one / ahead).real for one in body) == pytest.approx(0.3)  # half of its length
    for spring in (left, right):
        assert spring[1] == pytest.approx(arm[1] * 0.62 / 0.94)
        assert 0 < (spring[0] / ahead).real < 0.3  # on the body
    assert (left[0] / ahead).imag == pytest.approx(-(right[0] / ahead).imag)
    stretch = abs(left[1] - left[0]) - abs(right[1] - right[0])
    assert np.sign(round(stretch, 12)) == -np.sign(alpha)  # the left one is the longer where the arm goes to the right


def test_the_angles_are_read_in_degrees():
    panel = mechanism(0.6, -0.2).packed()
    read = {one["label"]: panel["signals"][one["signal"]] * one["scale"] for one in panel["readings"]}
    assert read == pytest.approx({"θ": np.degrees(0.6), "α": np.degrees(-0.2)})


def test_a_recording_is_played_under_the_names_that_move_the_drawing():
    time = np.linspace(3, 5, 1001)
    recording = Recording.of(time, {}, theta=np.sin(time), alpha=0.1 * np.cos(time), vm=0 * time)
    play = played(recording, 3.0, 5.0)
    assert play.signals.keys() == mechanism(0, 0).signals.keys()
    assert play.duration == pytest.approx(2)
    assert play.signals["theta"] == pytest.approx(np.sin(np.linspace(3, 5, 120)), abs=1e-5)
    assert play.signals["alpha"] == pytest.approx(0.1 * np.cos(np.linspace(3, 5, 120)), abs=1e-5)
