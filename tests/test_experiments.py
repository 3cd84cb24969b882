"""The experiments, on virtual benches whose truth is known."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.signal import lsim

from rotflex import design, experiments, hil, model, observers, response, sampled
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError, DesignError, LimitExceeded
from rotflex.hil.bench import Safety
from rotflex.hil.controllers import ObserverFeedback, OpenLoop, StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.guard import Allowance, Guard
from rotflex.hil.student_benches import student_bench
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop
from rotflex.units import DEG, HZ


def true_frequency(seed: int) -> float:
    """The link's natural frequency (rad/s) on the bench of a seed, from its drawn parameters."""
    parameters = student_bench(seed).parameters
    return np.sqrt(parameters.K_s / parameters.J_l)


def spectrum_peak(x: np.ndarray, dt: float) -> float:
    """Frequency (rad/s) of the largest Fourier coefficient between 1 and 5 Hz, with fine zero-padding."""
    padded = 1 << 17
    f = np.fft.rfftfreq(padded, dt)
    swept = (f > 1) & (f < 5)
    return HZ * f[swept][np.abs(np.fft.rfft(x, padded))[swept].argmax()]


def linear_model(K_s: float) -> tuple[np.ndarray, np.ndarray]:
    """A and B for voltage input, written out here from the equations of motion (nominal parts, arm position 1)."""
    servo, J_l = srv02(), joint(1).J_l
    damping = servo.B_eq + servo.back_emf_damping
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1
    A[2, 1:3] = K_s / servo.J_eq, -damping / servo.J_eq
    A[3, 1:3] = -K_s * (1 / servo.J_eq + 1 / J_l), damping / servo.J_eq
    return A, np.array([0, 0, 1, -1]) * servo.torque_per_volt / servo.J_eq


@pytest.mark.parametrize("seed", range(4))
def test_a_position_driven_sweep_peaks_at_the_natural_frequency_and_a_voltage_driven_one_well_above_it(seed):
    with hil.open(seed=seed) as bench:
        by_position = experiments.sweep(bench, progress=False)
        by_voltage = experiments.sweep(bench, drive="voltage", progress=False)
    assert spectrum_peak(by_position["alpha"], 0.002) == pytest.approx(true_frequency(seed), rel=0.025)
    higher = 1.03 if true_frequency(seed) > 26.0 else 1.12  # the sweep ends soon after the peak of a stiff joint
    assert spectrum_peak(by_voltage["alpha"], 0.002) > higher * true_frequency(seed)


@pytest.mark.parametrize("signal", ["square", "step"])
def test_validation_runs_the_model_beside_the_bench(signal):
    A, B = linear_model(1.4)
    with hil.open("virtual:?preset=workbook") as bench:
        recording = experiments.validation(bench, A, B, signal, progress=False)
    _, _, states = lsim((A, B[:, None], np.eye(4), np.zeros((4, 1))), recording["vm"], recording.time, interp=False)
    np.testing.assert_allclose(recording["theta_model"], states[:, 0], atol=1e-9)
    np.testing.assert_allclose(recording["alpha_model"], states[:, 1], atol=1e-9)
    # That preset has no friction: but for the encoder's half count, bench and model are one.
    count = bench.servo.K_enc
    np.testing.assert_allclose(recording["theta"], recording["theta_model"], atol=0.51 * count)
    np.testing.assert_allclose(recording["alpha"], recording["alpha_model"], atol=0.51 * count)


def test_tracking_meets_the_specifications_on_the_workbook_bench():
    gain = [18.2356, -17.1547, 1.5893, 0.6327]
    with hil.open("virtual:?preset=workbook") as bench:
        full = experiments.tracking(bench, gain, progress=False)
        partial = experiments.tracking(bench, gain, "partial", progress=False)
    assert full.degrees("theta_ref").max() == pytest.approx(20)
    assert np.abs(full.degrees("alpha")).max() < 12.5
    assert np.abs(full["vm"]).max() < 10
    # Without the link in the feedback it swings on: in the second half second after a turn there is far more of it.
    late = (full.time > 2.0) & (full.time < 2.5)
    assert np.abs(partial["alpha"][late]).max() > 5 * np.abs(full["alpha"][late]).max()


def test_a_function_that_does_what_a_gain_does_makes_the_same_run():
    gain = [18.2356, -17.1547, 1.5893, 0.6327]
    with hil.open("virtual:?preset=workbook") as bench:
        by_gain = experiments.tracking(bench, gain, "partial", duration=2.0, progress=False)
        law = StateFeedback(gain, "partial")
        by_function = experiments.tracking(bench, law, duration=2.0, progress=False)
        with pytest.raises(ConfigurationError, match="feedback"):
            experiments.tracking(bench, law, "partial", progress=False)
    for name in ("theta_ref", "theta", "alpha", "vm"):
        np.testing.assert_array_equal(by_function[name], by_gain[name])
    assert by_function.metadata["controller"] == "StateFeedback"


LINEAR, GAIN = linear_model(1.4), [18.2356, -17.1547, 1.5893, 0.6327]
EXPERIMENTS = {
    "sweep": (experiments.sweep, 15.0),
    "sweep of the voltage": (lambda bench, **more: experiments.sweep(bench, drive="voltage", **more), 15.0),
    "free decay": (experiments.free_decay, 6.0),
    "square wave": (lambda bench, **more: experiments.validation(bench, *LINEAR, **more), 10.0),
    "step": (lambda bench, **more: experiments.validation(bench, *LINEAR, "step", **more), 2.5),
    "tracking": (lambda bench, **more: experiments.tracking(bench, GAIN, **more), 10.0),
    "watching": (experiments.watch, 10.0),
}


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_lasts_as_long_as_is_asked_and_as_documented_unless_it_is(experiment):
    run, usual = EXPERIMENTS[experiment]
    with hil.open("virtual:?preset=workbook") as bench:
        for asked, lasts in (({"duration": 1.5}, 1.5), ({}, usual)):
            recording = run(bench, progress=False, **asked)
            assert recording.time[[0, -1]] == pytest.approx([0, lasts])
            assert np.diff(recording.time) == pytest.approx(0.002)


def test_every_experiment_starts_at_rest_counted_from_there_and_ends_at_0_volts():
    with hil.open(seed=5) as bench:
        for _ in range(2):
            recording = experiments.sweep(bench, duration=2.0, progress=False)
            assert recording["theta"][0] == 0 == recording["alpha"][0]
            assert bench.board.terminals.commanded[0] == 0.0
        experiments.rest(bench)
        state = bench.board.plant.state
        assert abs(state.theta_dot) < 0.01
        assert abs(state.alpha_dot) < 0.5 * bench.servo.K_enc * true_frequency(5)  # it swings within a count


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_on_a_virtual_bench_does_not_depend_on_what_ran_before_it(experiment):
    run, _usual = EXPERIMENTS[experiment]
    with hil.open(seed=4) as bench:
        alone = run(bench, duration=1.0, progress=False)
    with hil.open(seed=4) as bench:
        bench.start(0.002)
        for voltage in (2.0, 2.0, -1.0):
            bench.read()
            bench.write(voltage)
        experiments.tracking(bench, GAIN, duration=0.7, progress=False)
        for _ in range(2):
            again = run(bench, duration=1.0, progress=False)
            for channel in alone.channels:
                np.testing.assert_array_equal(again[channel], alone[channel])


def test_a_sweep_that_is_too_wild_stops_at_0_volts_and_says_why():
    with hil.open(seed=1) as bench:
        with pytest.raises(LimitExceeded, match=r"deflection.*smaller amplitude"):
            experiments.sweep(bench, amplitude=25 * DEG, progress=False)
        assert bench.board.terminals.commanded[0] == 0.0


@pytest.mark.parametrize(
    "ask",
    [
        lambda bench: experiments.free_decay(bench, amplitude=10),
        lambda bench: experiments.sweep(bench, amplitude=10),
        lambda bench: experiments.tracking(bench, GAIN, amplitude=10),
        lambda _bench: closed_loop(*LINEAR, GAIN, np.full(10, 10.0)),
    ],
)
def test_an_angle_that_looks_like_degrees_is_refused_with_how_to_write_it(ask):
    with hil.open(seed=1) as bench, pytest.raises(ConfigurationError, match=r"573 deg; did you mean 10 \* DEG"):
        ask(bench)


def test_unknown_choices_name_the_known_ones_and_a_model_is_four_by_four():
    A, B = linear_model(1.4)
    with hil.open("virtual:?seed=7&arm_position=2") as bench:
        for error, named, call in (
            (ConfigurationError, "'position', 'voltage'", lambda: experiments.sweep(bench, drive="torque")),
            *(
                (ConfigurationError, "'square', 'step'", partial(experiments.validation, bench, A, B, signal=signal))
                for signal in ("chirp", "recorded")  # the second one is a replay's alone
            ),
            (DesignError, r"\(4, 4\)", lambda: experiments.validation(bench, A[:3], B)),
            (DesignError, "finite", lambda: experiments.validation(bench, A, np.full(4, np.inf))),
        ):
            with pytest.raises(error, match=named):
                call()
        metadata = experiments.sweep(bench, duration=0.1, progress=False).metadata
    assert (metadata["source"], metadata["experiment"]) == ("virtual bench", "sweep")
    assert (metadata["bench"]["seed"], metadata["bench"]["arm_position"]) == (7, 2)


@pytest.mark.parametrize("factor", [-1.0, -1e3, -1e6])
def test_a_model_that_runs_away_is_recorded_up_to_a_bound_and_told(factor, capsys):
    A, B = linear_model(1.4)
    with hil.open(seed=1) as bench:
        right = experiments.validation(bench, A, B)
        assert "model_cut_at" not in right.metadata and "runs away" not in capsys.readouterr().out
        away = experiments.validation(bench, factor * A, B)
    said, cut = capsys.readouterr().out, away.metadata["model_cut_at"]
    assert "runs away" in said and f"at {cut:.2f} s" in said
    angles = np.abs([away["theta_model"], away["alpha_model"]])
    assert angles.max() == 100 and np.isfinite(angles).all()
    assert angles[:, away.time < cut].max() < 100
    assert np.ptp(angles[:, away.time >= cut], axis=1).max() == 0  # they stay there
    np.testing.assert_allclose(away["theta"], right["theta"], atol=0.01)  # of the bench, nothing is changed


# --- any command, at any sample time ---


@pytest.mark.parametrize("sample_time", [0.002, 0.03, 0.15])
def test_a_controller_is_called_at_the_sample_time_that_is_asked_for(sample_time):
    command = np.linspace(0, 0.1, 20)
    with hil.open(seed=3) as bench:
        run = experiments.follow(bench, lambda theta_ref, _theta, _alpha: theta_ref, command, sample_time)
    np.testing.assert_allclose(run["theta_ref"], command, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run["vm"], command, rtol=0, atol=1e-9)
    assert run.sample_time == pytest.approx(sample_time) and run.metadata["sample_time"] == sample_time


def test_a_controller_that_is_made_for_another_sample_time_is_refused():
    feedback = StateFeedback([18.0, -17.0, 1.6, 0.6])
    with hil.open(seed=3) as bench:
        for controller in (feedback, TwoDegreesOfFreedom(feedback)):
            with pytest.raises(DesignError, match=r"0\.002 s; the run has 0\.02 s"):
                experiments.follow(bench, controller, np.zeros(5), 0.02)
        with pytest.raises(DesignError, match=r"0\.02 s; the run has 0\.002 s"):
            experiments.tracking(bench, StateFeedback([1.0, 0, 0, 0], sample_time=0.02, cutoff=50.0))


@pytest.mark.parametrize("sample_time", [0.2, 0.0, -0.002, np.nan, 0.06])
def test_a_sample_time_that_watchdog_or_guard_cannot_bear_is_refused(sample_time):
    bench = hil.open(seed=3)
    bench.safety = Safety(guard=Guard(srv02()) if sample_time == 0.06 else None)
    with bench, pytest.raises(BenchError, match=r"shorter than the 0\.2 s .* guard .* at most 0\.05 s"):
        experiments.follow(bench, OpenLoop(), np.zeros(5), sample_time)


@pytest.mark.parametrize("seed", [3, 14])
@pytest.mark.parametrize("sample_time", [0.01, 0.03, 0.05])
def test_an_observer_and_a_sampled_design_control_a_bench_and_no_guard_stops_them(seed, sample_time):
    spec = student_bench(seed)
    model_of_it = model.state_space(srv02(), spec.joint, spec.parameters.K_s, link_damping=0.0)
    plant = sampled.sample(model_of_it, sample_time, 0.002)
    K = sampled.gain_by_place(plant, design.desired_poles(0.6, 20, -30, -40))
    noise = observers.process_noise(plant, (sampled.sample(model_of_it, sample_time).B, 0.1))
    L = observers.kalman_gain(plant, noise, srv02().K_enc, servo_only=True)
    controller = ObserverFeedback(plant.A, plant.B, L, K, sample_time)
    t = time_axis(6.0, sample_time)
    bench = hil.open(seed=seed)
    bench.safety = Safety(guard=Guard(srv02(), allowance=Allowance(stiffness=spec.parameters.K_s)))
    with bench:
        run = experiments.follow(bench, controller, smooth_square_wave(t, 0.33, 20 * DEG, 100.0), sample_time)
    found = response.worst(response.measure(run))
    assert found.max_vm < 10 and response.swing(run) < 1.5 * DEG
    assert found.settling_time < 0.7 or sample_time > 0.01
    # A long sample time leaves a small gain: where friction takes what it asks for, the servo stops.
    plant_itself = spec.parameters
    waves = sum(height for _number, height, _phase in plant_itself.gear)
    friction = max(plant_itself.servo_friction) * (1 + plant_itself.stribeck) * (1 + waves)
    stops = friction / plant_itself.torque_per_volt / K.ravel()[0] + srv02().K_enc
    assert abs(found.steady_state_error) < stops
