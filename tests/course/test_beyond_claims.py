"""What notebook 11 says in numbers, tested on drawn benches and on the bench of its own solution.

The designs are those of ``benchmarks/beyond.py``: what a student makes of what a student knows.
"""

import sys
from functools import cache

import control
import numpy as np
import pytest
from checkout import ROOT
from scipy.linalg import expm

from rotflex import experiments, hil, observers, response, sampled
from rotflex.config import srv02
from rotflex.errors import LimitExceeded
from rotflex.hil.student_benches import student_bench, student_seed
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, RATE
from rotflex.units import DEG

sys.path.append(str(ROOT / "benchmarks"))
import beyond

pytestmark = pytest.mark.slow
DEMO = student_seed("demo")  # the student of the solution
BENCHES = (0, 1, DEMO)
LINK = "sampled, both"
SERVO = "sampled, servo's encoder"


@cache
def designs(seed, factor=1.0):
    return {(name, h): controller for name, h, controller in beyond.designs(seed, factor)}


@cache
def on_wave(seed, name, h=0.002, factor=1.0):
    """The recording along the square wave; None if a limit stops it."""
    wave = smooth_square_wave(time_axis(DURATION, h), FREQUENCY, AMPLITUDE, RATE)
    try:
        with hil.open("virtual", seed=seed) as bench:
            return experiments.follow(bench, designs(seed, factor)[name, h], wave, h, progress=False)
    except LimitExceeded:
        return None


def measured(*run):
    return response.worst(response.measure(on_wave(*run)))


def settles(*run):
    return on_wave(*run) is not None and measured(*run).settling_time < np.inf


def swing(*run):
    return response.swing(on_wave(*run)) / DEG


@cache
def on_turns(seed):
    return {name: beyond.short(seed, way, command) for name, way, command in beyond.turns(seed)}


def followed(seed, controller, command):
    """Angle of the servo (n,), deg."""
    with hil.open("virtual", seed=seed) as bench:
        return experiments.follow(bench, controller, command, progress=False).degrees("theta")


# --- 1 What the encoders know -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", BENCHES)
def test_the_servos_encoder_alone_knows_the_state_and_the_links_does_not(seed):
    A = beyond.own_model(seed)[0]
    ranks = [np.linalg.matrix_rank(control.obsv(A, C)) for C in np.eye(2, 4)[:, None]]
    assert ranks == [observers.observability(A, C).rank for C in np.eye(2, 4)] == [4, 3]
    with pytest.raises(ValueError):
        control.gram(control.ss(A, np.zeros((4, 1)), np.eye(1, 4), 0), "o")


def rate_known(seed, outputs):
    """Standard deviation (deg/s) of the link's rate from 50 samples, by equation (3)."""
    C, Phi = np.eye(outputs, 4), expm(beyond.own_model(seed)[0] * 0.002)
    seen = np.vstack([C @ np.linalg.matrix_power(Phi, k) for k in range(50)])
    return srv02().K_enc / np.sqrt(12) * np.sqrt(np.linalg.inv(seen.T @ seen)[3, 3]) / DEG


@pytest.mark.parametrize("seed", BENCHES)
def test_the_servos_encoder_knows_the_links_rate_less_well_and_the_integral_a_little_less_than_the_sum(seed):
    assert 2.4 < rate_known(seed, 1) / rate_known(seed, 2) < 3.6
    integral = observers.uncertainty(beyond.own_model(seed)[0], np.eye(1, 4), 0.1, 0.002, srv02().K_enc)[3] / DEG
    assert integral / rate_known(seed, 1) == pytest.approx(1.06, abs=0.02)


# --- 2 An observer ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", BENCHES)
def test_with_the_motors_noise_two_poles_go_to_the_zeros(seed):
    A, B, _K = beyond.own_model(seed)
    plant, push = sampled.sample(A, B, 0.002), [0, 0, 0, 1 / student_bench(seed).joint.J_l]
    zero = 1j * np.sqrt(-(A[2, 1] + A[3, 1]))
    assert np.abs(control.ss(A, B, np.eye(1, 4), 0).zeros() - zero).min() == pytest.approx(0, abs=1e-3)
    apart = []
    for volts in (0.02, 0.1, 0.5, 5.0):
        noise = observers.process_noise(plant, (plant.B, volts), (sampled.sample(A, push, 0.002).B, 0.005))
        L = observers.kalman_gain(plant, noise, srv02().K_enc, servo_only=True)
        apart.append(np.abs(np.log(observers.observer_poles(plant, L)) / 0.002 - zero).min())
    assert apart == sorted(apart, reverse=True)
    assert apart[-1] < 0.05 * abs(zero)


@pytest.mark.parametrize("seed", BENCHES)
def test_the_observers_voltage_is_five_times_quieter_and_the_swing_as_small(seed):
    derivatives, servo, both = (response.voltage_noise(on_wave(seed, name)) for name in ("33 Hz, full", SERVO, LINK))
    assert max(servo, both) < derivatives / 5
    assert max(swing(seed, SERVO), swing(seed, LINK)) < min(1.0, swing(seed, "33 Hz, partial"))
    assert measured(seed, SERVO).max_alpha == pytest.approx(measured(seed, "33 Hz, full").max_alpha, rel=0.1)


# --- 3 Design for a slow computer -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", BENCHES)
def test_emulation_is_predicted_and_lost_where_the_sampled_design_settles(seed):
    A, B, K = beyond.own_model(seed)
    assert 0.024 < sampled.longest_sample_time(A, B, K, 0.002) < 0.034
    assert all(settles(seed, "emulated", h) for h in (0.01, 0.02))
    assert on_wave(seed, "emulated", 0.03) is None or not all(
        finding.met for finding in response.verdict(measured(seed, "emulated", 0.03))
    )
    assert not settles(seed, "emulated", 0.05)
    assert all(settles(seed, SERVO, h) for h in (0.002, 0.01, 0.02, 0.03, 0.05))
    assert measured(seed, "emulated", 0.02).max_alpha > 1.2 * measured(seed, SERVO, 0.02).max_alpha
    assert measured(seed, SERVO, 0.05).max_vm < measured(seed, SERVO).max_vm


# --- 4 Which design forgives? -----------------------------------------------------------------------------------------


def peak(seed, name, h):
    A, B, _K = beyond.own_model(seed)
    return sampled.margins(sampled.sample(A, B, h, 0.002), designs(seed)[name, h].system())


@pytest.mark.parametrize("seed", BENCHES)
def test_at_20_ms_the_sampled_design_forgives(seed):
    emulated, own = peak(seed, "emulated", 0.02), peak(seed, SERVO, 0.02)
    assert own.sensitivity_peak < 2
    assert emulated.sensitivity_peak > 4
    assert own.delay > 5 * emulated.delay


# --- 5 A turn that leaves no swing ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", BENCHES)
def test_a_flat_turn_leaves_no_swing(seed):
    ran = on_turns(seed)
    assert ran["flat"]["swing, deg"] <= 0.5
    assert ran["flat"]["V_m, V"] < 0.5 * ran["step"]["V_m, V"]
    assert ran["flat"]["alpha, deg"] < 0.5 * ran["step"]["alpha, deg"]
    assert ran["shaped, partial"]["swing, deg"] < 0.4 * ran["step, partial"]["swing, deg"]


# --- the numbers of the solution's conclusion ------------------------------------------------------------------------
