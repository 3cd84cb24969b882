"""The band of a predicted loop: what lies inside, what does not, and what makes it wide."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import joint, srv02
from rotflex.errors import IdentificationError
from rotflex.greybox import Band, fit
from rotflex.greybox import result as results
from rotflex.hil.controllers import OpenLoop, StateFeedback
from rotflex.hil.student_benches import student_bench, with_friction
from rotflex.identification import Estimate
from rotflex.recording import Recording
from rotflex.units import DEG

COUNT = 360 / 4096 * DEG
GAIN = [13.04, -17.26, 1.32, -0.046]
SPEC = student_bench(4)  # with a rough gear and a breakaway


# --- a band made by hand ----------------------------------------------------------------------------------------------


def made(is_open=False, samples=2000):
    """A band of 2 deg to either side of theta, and of 1 deg of alpha: half from draws, half from the margin."""
    t = np.arange(samples) * 0.002
    middle = np.array([np.sin(t), np.cos(t)])
    half = np.array([[2.0], [1.0]]) * DEG / 1.96 / np.sqrt(2)
    sway = np.where(t % 1 < 0.5, 1, -1)  # of no mean in a window
    draws = np.array([middle + half * sway, middle - half * sway])
    return Band(t, middle, draws, half[:, 0], is_open, "made by hand")


def beside(band, theta=0.0, alpha=0.0):
    """A recording that is off the prediction by so much, deg."""
    return Recording.of(band.time, theta=band.middle[0] + theta * DEG, alpha=band.middle[1] + alpha * DEG)


def test_the_share_inside_is_that_of_the_samples_of_each_angle():
    band = made()
    assert band.theta.upper - band.theta.middle == pytest.approx(np.full(2000, 2 * DEG))
    assert band.theta.middle - band.theta.lower == pytest.approx(np.full(2000, 2 * DEG))
    quarter = np.where(np.arange(2000) < 500, 1.01, 0.99)
    inside = band(beside(band, theta=2 * quarter, alpha=-quarter))
    assert inside == (0.75, 0.75)
    assert str(inside) == "Inside the band: 75.0% of theta, 75.0% of alpha."
    assert band(beside(band, theta=-2.01, alpha=0.99)) == (0.0, 1.0)
    assert "half width (RMS, deg): theta 2.000, alpha 1.000" in str(band)


def test_theta_may_drift_in_an_open_loop_and_is_compared_in_windows_of_a_second():
    band = made(is_open=True)
    drift = 10 * (band.time // 1)  # deg
    assert band(beside(band, theta=drift)) == (1.0, 1.0)
    assert made()(beside(band, theta=drift)).theta == 0.25
    assert band(beside(band, theta=drift + 2.02 * np.sign(np.sin(2 * np.pi * (band.time + 0.001))))).theta == 0.0
    curves, _alpha = band.around(beside(band, theta=drift))
    assert curves.middle == pytest.approx(band.middle[0] + drift * DEG)
    assert "windows of 1 s" in str(band)


def test_a_part_is_compared_with_the_same_part_of_a_recording():
    band = made()
    recording = beside(band, theta=np.where(band.time < 3, 0.0, 5.0))
    part = band.between(2, 3)
    assert part(recording.between(2, 3)) == (1.0, 1.0)
    assert part(recording.between(3, 4)).theta == 0.0
    assert part.theta.middle == pytest.approx(band.middle[0, 1000:1500])
    assert part.time[0] == 0.0


@pytest.mark.parametrize(
    ("spoiled", "named"),
    [
        (lambda recording: recording.between(0, 1), "500 samples.* band has 2000.*between"),
        (lambda recording: replace(recording, time=2 * recording.time), "every 4 ms; the band .* every 2 ms"),
        (lambda recording: replace(recording, channels={"theta": recording.channels["theta"]}), "'alpha'"),
    ],
)
def test_a_recording_that_cannot_be_compared_is_refused_with_the_reason(spoiled, named):
    band = made()
    with pytest.raises(IdentificationError, match=named):
        band(spoiled(beside(band)))


# --- what makes it wide -----------------------------------------------------------------------------------------------


def found(logs, friction, omega_n):
    """What a fit says of its spread: half widths of 95 % intervals, relative."""
    intervals = {f"servo_friction_{way}": (0.01 * (1 - friction), 0.01 * (1 + friction)) for way in ("plus", "minus")}
    estimates = {name: Estimate(0.01, 0.0) for name in intervals} | {"delay": Estimate(1e-3, 1e-4)}
    return SimpleNamespace(
        predictions=[None] * logs,
        intervals=intervals,
        estimates=estimates,
        omega_n=Estimate(20.0, 20.0 * omega_n / 2),
    )


def test_the_spread_of_several_recordings_is_measured_and_of_one_it_is_the_known_one():
    for friction in (0.1, 0.5):  # whatever a single fit says of itself
        assert results._spread(found(1, friction, 0.005)) == pytest.approx((1.5, 0.01905, 1.732e-4), rel=1e-3)
    # With 11 logs, Student's t is 2.228. The error of a mean is that of a run divided by sqrt(11).
    factor, omega_n, _delay = results._spread(found(11, 2.228 * 0.3 / np.sqrt(11), 2.228 * 0.02 / np.sqrt(11)))
    assert np.log(factor) / np.sqrt(3) == pytest.approx(np.sqrt((0.234**2 + 10 * 0.3**2) / 11 * 12 / 11), rel=1e-3)
    assert omega_n / np.sqrt(3) == pytest.approx(np.sqrt((0.011**2 + 10 * 0.02**2) / 11 * 12 / 11), rel=1e-3)
    # Two logs that happen to agree do not say that runs are alike.
    assert results._spread(found(2, 0.0, 0.0))[0] == pytest.approx(np.exp(np.log(1.5) * np.sqrt(0.75)))


@pytest.fixture(scope="module")
def fitted():
    with hil.open("virtual", plant=SPEC) as bench:
        recording = experiments.tracking(bench, GAIN, frequency=0.5, duration=3.0, progress=False)
    return fit(recording, srv02(), SPEC.joint, progress=False), recording["theta_ref"]


def run_of(spec, reference):
    """A run of a bench along a reference, from rest."""
    with hil.open("virtual", plant=spec) as bench:
        return hil.loop.run(bench, StateFeedback(GAIN), reference, progress=False)


def rubbing(factor):
    """The bench with friction times a factor."""
    return replace(SPEC, parameters=with_friction(SPEC.parameters, factor, 1.0))


@pytest.mark.slow
def test_a_run_with_other_friction_lies_inside_and_one_of_a_bench_that_rubs_does_not(fitted):
    result, reference = fitted
    controller = StateFeedback(GAIN)
    controller(0.0, 1.0, 1.0)  # it remembers something else
    band = result.band(reference, controller, progress=False)
    assert band.draws == pytest.approx(result.band(reference, controller, progress=False).draws, abs=0)
    for factor in (1 / 1.4, 1.4):
        assert min(band(run_of(rubbing(factor), reference))) >= 0.95
    assert band(run_of(rubbing(3.0), reference)).theta < 0.5
    # No margin is less than what two counters differ by.
    assert (band.alpha.upper - band.alpha.middle).min() >= 1.5 * COUNT * (1 - 1e-9)
    assert "One recording does not tell how runs differ: friction ×/÷ 1.5" in str(band)


@pytest.mark.slow
def test_the_band_is_wider_where_runs_differ_more_and_where_the_fit_leaves_more(fitted, monkeypatch):
    result, reference = fitted
    usual = result.band(reference, StateFeedback(GAIN), progress=False).half_width
    (prediction,) = result.predictions
    left = replace(result, predictions=(replace(prediction, rms={"theta": 0.3 * DEG, "alpha": 0.2 * DEG}),))
    wide = left.band(reference, StateFeedback(GAIN), progress=False).half_width
    assert wide["theta"] > 1.96 * 0.3 * DEG and wide["alpha"] > 1.96 * 0.2 * DEG
    monkeypatch.setattr(results, "FRICTION", 2.5)
    monkeypatch.setattr(results, "OMEGA_N_SPREAD", 0.04)
    wide = result.band(reference, StateFeedback(GAIN), progress=False).half_width
    assert wide["theta"] > 1.3 * usual["theta"] and wide["alpha"] > 1.3 * usual["alpha"]


@pytest.mark.slow
def test_an_open_loop_is_predicted_along_its_voltage(fitted):
    result, _reference = fitted
    with hil.open("virtual", plant=rubbing(1.2)) as bench:
        volts = 1.2 * np.sign(np.sin(np.pi * np.arange(1000) * 0.002 + 0.01))
        recording = hil.loop.run(bench, OpenLoop(), volts, progress=False)
    band = result.band(volts, OpenLoop(), progress=False)
    assert band.is_open
    assert min(band(recording)) >= 0.95


@pytest.mark.slow
@pytest.mark.scheduled
@pytest.mark.parametrize(("seen", "other"), [((0, 5), (5, 11)), ((5, 11), (0, 5))])
def test_one_half_of_a_real_benchs_log_lies_in_the_band_of_the_other(real_log, seen, other):
    result = fit(real_log.between(*seen), srv02(), joint(1), progress=False)
    feedback = StateFeedback([13.0384, -17.2586, 1.3198, -0.0461])  # of that log
    band = result.band(real_log["theta_ref"], feedback, progress=False).between(*other)
    assert min(band(real_log.between(*other))) >= 0.95
    assert max(band.half_width.values()) <= 0.6 * DEG
