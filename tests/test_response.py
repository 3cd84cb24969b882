"""Measurements against analytic second-order responses, python-control, and a log of a real bench."""

import math

import control
import numpy as np
import pytest

from rotflex import response, signals
from rotflex.errors import ConfigurationError, IdentificationError, RecordingError
from rotflex.recording import Recording
from rotflex.units import DEG

SAMPLE_TIME = 0.002
COUNT = 360 / 4096  # deg


def unit_step(t, zeta, omega_n):
    """Response of omega_n²/(s² + 2 zeta omega_n s + omega_n²) to a unit step at 0."""
    omega_d = omega_n * math.sqrt(1 - zeta**2)
    after = np.maximum(t, 0)
    ringing = np.cos(omega_d * after) + zeta * omega_n / omega_d * np.sin(omega_d * after)
    return np.where(t < 0, 0.0, 1 - np.exp(-zeta * omega_n * after) * ringing)


def wave(levels, zeta=0.6, omega_n=20.0, hold=0.75, start=0.0, last=None, amplitude_deg=20.0):
    """A second-order servo that follows ``levels``, in amplitudes, each held for ``hold`` s, the last for ``last``."""
    held = round(hold / SAMPLE_TIME)
    counts = [held] * (len(levels) - 1) + [held if last is None else round(last / SAMPLE_TIME)]
    reference = np.repeat(np.array(levels, dtype=float), counts)
    t = np.arange(reference.size) * SAMPLE_TIME
    edges = np.concatenate([[0], np.cumsum(counts)[:-1]]) * SAMPLE_TIME
    theta = start + sum(
        size * unit_step(t - edge + 1e-12, zeta, omega_n)
        for edge, size in zip(edges, np.diff(levels, prepend=start), strict=True)
    )
    scale = amplitude_deg * DEG
    return Recording.of(t, theta_ref=scale * reference, theta=scale * theta, alpha=0.1 * theta, vm=3 * theta)


def changed(recording, **channels):
    values = {name: recording[name] for name in recording.channels} | channels
    return Recording.of(recording.time, recording.metadata, **values)


@pytest.mark.parametrize(("zeta", "omega_n"), [(0.6, 20), (0.35, 25)])
def test_figures_are_those_of_python_control_for_two_per_cent_of_the_step(zeta, omega_n):
    """4 % of the final value is 2 % of a step from -20 to 20 deg."""
    t = np.arange(0, 1.5, SAMPLE_TIME)
    servo = control.tf([omega_n**2], [1, 2 * zeta * omega_n, omega_n**2])
    expected = control.step_info(servo, T=t, SettlingTimeThreshold=0.02, yfinal=1)
    steps = response.measure(wave([-1, 1, -1], zeta, omega_n, hold=1.5, start=-1))
    assert [step.direction for step in steps] == [1, -1]
    for step in steps:
        assert step.settling_time == pytest.approx(expected["SettlingTime"], abs=SAMPLE_TIME)
        assert step.overshoot == pytest.approx(expected["Overshoot"], abs=0.02)
        assert step.peak_time == pytest.approx(expected["PeakTime"], abs=SAMPLE_TIME)
        assert step.size == pytest.approx(40 * DEG)
        assert step.steady_state_error == pytest.approx(0, abs=1e-3 * DEG)


@pytest.mark.parametrize("outside", [0.81, -0.81])
@pytest.mark.parametrize("size", [20.0, -20.0])
def test_settling_time_runs_to_the_first_sample_that_stays_in_the_band(size, outside):
    """The band of ±0.8 deg has two edges, upwards and downwards."""
    reference, theta = (np.where(np.arange(1000) < begin, -size, size) for begin in (100, 200))
    theta[300] += outside
    theta[310] += outside * 0.79 / 0.81
    t = np.arange(1000) * SAMPLE_TIME
    (step,) = response.measure(Recording.of(t, theta_ref=reference * DEG, theta=theta * DEG))
    assert step.start == pytest.approx(100 * SAMPLE_TIME)
    assert step.settling_time == pytest.approx(201 * SAMPLE_TIME)
    if size * outside > 0:
        assert step.overshoot == pytest.approx(100 * 0.81 / 40)
        assert step.peak_time == pytest.approx(200 * SAMPLE_TIME)


def test_a_rate_limited_step_counts_from_the_start_of_its_ramp():
    t = signals.time_axis(2.9, SAMPLE_TIME)
    sharp = signals.square_wave(t - 1, 0.5, 20 * DEG)
    ramped = 20 * DEG * signals.rate_limit(signals.square_wave(t - 1, 0.5), 25, SAMPLE_TIME, initial=-1)
    theta = 20 * DEG * (2 * unit_step(t - 1, 0.7, 25) - 2 * unit_step(t - 2, 0.7, 25) - 1)
    at_once = response.measure(Recording.of(t, theta_ref=sharp, theta=theta))
    slowly = response.measure(Recording.of(t, theta_ref=ramped, theta=theta))
    assert [step.start for step in slowly] == pytest.approx([1, 2])
    for one, other in zip(at_once, slowly, strict=True):
        assert other.settling_time == one.settling_time
        assert other.overshoot == pytest.approx(one.overshoot)
        assert (other.before, other.after) == (one.before, one.after)


def test_largest_deflection_and_voltage_belong_to_their_own_step():
    recording = wave([-1, 1, -1], start=-1)
    alpha, vm = np.zeros(len(recording)), np.zeros(len(recording))
    half = len(recording) // 3
    alpha[half + 50], vm[half + 5] = -0.15, 8.0
    alpha[2 * half + 50], vm[2 * half + 5] = 0.12, -9.0
    first, second = response.measure(changed(recording, alpha=alpha, vm=vm))
    assert (first.max_alpha, first.max_vm) == (0.15, 8.0)
    assert (second.max_alpha, second.max_vm) == (0.12, 9.0)
    summary = response.worst([first, second])
    assert (summary.max_alpha, summary.max_vm) == (0.15, 9.0)


@pytest.mark.parametrize("ramped", [False, True])
def test_the_first_step_from_zero_has_the_same_band_and_its_own_height(ramped):
    recording = wave([1, -1, 1], 0.6, 20, hold=1.5)
    reference = recording["theta_ref"]
    if ramped:
        reference = 20 * DEG * signals.rate_limit(reference / (20 * DEG), 100, SAMPLE_TIME)
    first, second, third = response.measure(changed(recording, theta_ref=reference))
    assert (first.start, first.before, first.after) == (0, 0, pytest.approx(20 * DEG))
    assert (second.before, second.after) == (pytest.approx(20 * DEG), pytest.approx(-20 * DEG))
    assert first.overshoot == pytest.approx(second.overshoot, abs=1e-3)  # each of its own step
    # ±0.8 deg is 4 % of the first step and 2 % of the others.
    t = np.arange(0, 1.5, SAMPLE_TIME)
    for step, share in ((first, 0.04), (third, 0.02)):
        outside = np.flatnonzero(np.abs(unit_step(t, 0.6, 20) - 1) > share)
        assert step.settling_time == pytest.approx(t[outside[-1] + 1], abs=1e-9)


def test_the_first_step_does_not_flatter_the_summary():
    steps = response.measure(wave([1, -1, 1], start=0))
    summary = response.worst(steps)
    assert (summary.steps, summary.left_out) == (2, 1)
    assert summary.settling_time == steps[1].settling_time > steps[0].settling_time
    # A wave that opens at its first level has no step there.
    assert [step.direction for step in response.measure(wave([1, -1, 1], start=1))] == [-1, 1]


def test_the_step_back_to_zero_has_the_band_of_the_value_it_came_from():
    up, down = response.measure(wave([0, 1, 0], hold=1.5))
    assert down.settling_time == pytest.approx(up.settling_time, abs=1e-9)


def sticking(error_deg):
    """A servo that rests ``error_deg`` short of 20 deg after the step up, and on its command after the step down."""
    recording = wave([-1, 1, -1], hold=1.5, start=-1)
    share = 1 - error_deg / 40
    held = len(recording) // 3
    theta = recording["theta"].copy()
    theta[held : 2 * held] = -20 * DEG + share * (theta[held : 2 * held] + 20 * DEG)
    return changed(recording, theta=theta)


def test_steady_state_error_is_command_minus_angle_also_of_a_recording_of_the_servo_alone():
    whole = sticking(0.5)
    alone = response.measure(Recording.of(whole.time, theta_ref=whole["theta_ref"], theta=whole["theta"]))
    assert [finding.met for finding in response.verdict(response.worst(alone))][2:] == [None, None]
    up, down = response.measure(whole)
    assert [step.settling_time for step in alone] == [up.settling_time, down.settling_time]
    assert up.steady_state_error == pytest.approx(0.5 * DEG, rel=1e-3)
    assert down.steady_state_error == pytest.approx(0, abs=1e-3 * DEG)
    assert response.worst([up, down]).steady_state_error == up.steady_state_error
    up, _ = response.measure(sticking(1.0))  # outside the band
    assert up.settling_time == math.inf
    assert "rest 1 deg from the command" in up.remark


@pytest.mark.parametrize("quantised", [True, False])
def test_counts_and_noise_inside_the_band_move_the_figures_by_no_more_than_themselves(quantised):
    recording = wave([-1, 1, -1, 1], zeta=0.6 if quantised else 0.7, hold=1.5, start=-1)
    noise = np.random.default_rng(3).uniform(-0.15, 0.15, len(recording)) * DEG
    theta = np.round(recording["theta"] / (COUNT * DEG)) * COUNT * DEG if quantised else recording["theta"] + noise
    disturbed = response.measure(changed(recording, theta=theta))
    for clean, coarse in zip(response.measure(recording), disturbed, strict=True):
        assert coarse.overshoot == pytest.approx(clean.overshoot, abs=100 * (COUNT if quantised else 0.3) / 40)
        assert coarse.settling_time == pytest.approx(clean.settling_time, abs=0.03)
        assert abs(coarse.steady_state_error) <= (COUNT / 2 if quantised else 0.03) * DEG + 1e-9
        assert coarse.remark == ""


@pytest.mark.parametrize("last", [SAMPLE_TIME, 0.3, 1.0])
def test_a_last_step_that_is_cut_off_is_listed_as_not_measurable(last):
    steps = response.measure(wave([-1, 1, -1], hold=1.5, start=-1, last=last))
    assert [step.measurable for step in steps] == [True, False]
    assert steps[1].settling_time is steps[1].overshoot is steps[1].max_vm is None
    assert f"{last:.3g} s" in steps[1].remark
    summary = response.worst(steps)
    assert (summary.steps, summary.left_out) == (1, 1)
    assert "3 s, 20 to -20 deg" in summary.remarks[0]
    ramped = wave([-1, 1, -1], hold=1.0, start=-1, last=0.02)
    reference = 20 * DEG * signals.rate_limit(ramped["theta_ref"] / (20 * DEG), 25, SAMPLE_TIME, initial=-1)
    assert not response.measure(changed(ramped, theta_ref=reference))[1].measurable


def test_what_cannot_be_measured_is_an_error_that_says_why():
    t = np.arange(200) * SAMPLE_TIME
    reference = np.where(np.arange(200) < 199, -0.3, 0.3)
    steps = response.measure(Recording.of(t, theta_ref=reference, theta=np.full(200, -0.3)))
    with pytest.raises(IdentificationError, match=r"0\.002 s"):
        response.worst(steps)
    with pytest.raises(IdentificationError, match="no steps"):
        response.worst([])
    commands = (np.full(t.size, 20 * DEG), "constant, 20 deg"), (signals.chirp(t, 1, 5, 0.3), "not a square wave")
    for command, named in commands:
        with pytest.raises(IdentificationError, match=named):
            response.measure(Recording.of(t, theta_ref=command, theta=reference))
    with pytest.raises(RecordingError, match="theta_ref"):
        response.measure(Recording.of(t, theta=reference))
    for band in (4, 1, 0, -0.04, math.nan):
        with pytest.raises(ConfigurationError):
            response.measure(wave([-1, 1, -1], start=-1), band)


@pytest.mark.parametrize("frequency", [2.3, 5.0, 31.0])
def test_an_angle_that_keeps_ringing_never_settles(frequency):
    recording = wave([-1, 1, -1], hold=1.5, start=-1)
    ringing = 1.5 * DEG * np.sin(2 * np.pi * frequency * recording.time)
    steps = response.measure(changed(recording, theta=recording["theta"] + ringing))
    assert all(step.settling_time == math.inf and "±0.8 deg" in step.remark for step in steps)
    assert response.verdict(response.worst(steps))[0].met is False


def test_an_angle_of_the_wrong_sign_or_that_does_not_move_is_found_out():
    recording = wave([1, -1, 1], hold=1.5)
    steps = response.measure(changed(recording, theta=-recording["theta"]))
    for step in steps:
        assert (step.settling_time, step.overshoot) == (math.inf, None)
        assert "sign" in step.remark
    assert [finding.met for finding in response.verdict(response.worst(steps))[:2]] == [False, None]
    steps = response.measure(changed(recording, theta=np.zeros(len(recording))))
    assert all("it moved 0 deg of" in step.remark for step in steps)
    assert response.worst(steps).settling_time == math.inf


def summary(**values):
    plain = {"settling_time": 0.4, "overshoot": 3.4, "steady_state_error": 0.0, "max_alpha": 10.9 * DEG, "max_vm": 8.6}
    return response.Summary(**(plain | values), steps=4, left_out=1, remarks=())


def test_the_printed_simulation_meets_all_four():
    findings = response.verdict(summary())
    assert all(finding.met is True for finding in findings)
    assert "10.9 deg" in findings[2].words and "12.5 deg" in findings[2].words
    at_the_limit = response.verdict(summary(max_vm=10.0))[3]
    assert len(at_the_limit.words) > len(findings[3].words)  # more may have been asked for


@pytest.mark.parametrize(
    ("quantity", "limit"), [("settling_time", 0.5), ("overshoot", 5.0), ("max_alpha", 12.5 * DEG), ("max_vm", 10.0)]
)
def test_a_limit_is_met_up_to_itself_and_broken_beyond(quantity, limit):
    for value, met in ((limit, True), (1.001 * limit, False)):
        broken = {f.specification.quantity: f.met for f in response.verdict(summary(**{quantity: value}))}
        assert broken.pop(quantity) is met
        assert all(broken.values())


def test_swing_and_noise_are_of_full_turns_after_the_time_that_is_said():
    recording = wave([1, -1, 1], hold=1.0)  # the first turn, from 0, is half as large
    late = recording.time % 1 > 0.5
    alpha = np.where(late, 0.02, 0.5) * DEG
    alpha[(recording.time < 1) & late] = DEG
    alpha[recording.time > 1.9] *= -3
    vm = np.where(recording.time % 1 > 0.2, np.arange(alpha.size) % 2 * 0.4, 0.0)
    vm[recording.time < 1] *= 9
    noisy = changed(recording, alpha=alpha, vm=vm)
    assert response.swing(noisy) == pytest.approx(1.5 * DEG)  # three times 0.5, early in the last turn
    assert response.swing(noisy.between(0, 2.8), after=0.55) == pytest.approx(0.06 * DEG)
    assert response.voltage_noise(noisy) == pytest.approx(0.4)
    with pytest.raises(IdentificationError, match="lasts longer than 2 s"):
        response.swing(noisy, after=2.0)
