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
from rotflex.hil.student_benches import student_bench
from rotflex.identification import Estimate
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE
from rotflex.units import DEG

COUNT = 360 / 4096 * DEG
GAIN = [13.04, -17.26, 1.32, -0.046]
SPEC = student_bench(4)  # with friction that a fit does not model


# --- a band made by hand ----------------------------------------------------------------------------------------------


def made(is_open=False, samples=2000, **options):
    """A band of 2 deg to either side of theta, and of 1 deg of alpha: half from draws, half from the margin."""
    t = np.arange(samples) * 0.002
    middle = np.array([np.sin(t), np.cos(t)])
    half = np.array([[1.0], [0.5]]) * DEG
    sway = np.where(t % 1 < 0.5, 1, -1)  # of no mean in a window
    draws = np.array([middle + half * sway, middle - half * sway] * 30)
    return Band(t, middle, draws, half[:, 0] / 1.96, is_open, "made by hand", **options)


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


def test_a_band_reaches_farther_to_the_side_on_which_its_draws_are():
    """Of 60 draws, 57 are off by 1 deg to the same side, and three by 5 deg: 2.5 % of them lie beyond those."""
    band = made()
    away = np.repeat([1.0, 5.0], [57, 3])[:, None, None] * DEG
    one_sided = replace(band, draws=band.middle - away)
    assert one_sided.theta.upper - band.middle[0] == pytest.approx(np.full(2000, 1 * DEG))  # the margin alone
    assert band.middle[0] - one_sided.theta.lower == pytest.approx(np.full(2000, 6 * DEG))
    assert one_sided.half_width["theta"] == pytest.approx(3.5 * DEG)


def test_what_a_band_was_adapted_to_counts_neither_as_inside_nor_in_the_width():
    band = made(first=500)
    assert band(beside(band, theta=np.where(band.time < 1.0, 30.0, 1.99))) == (1.0, 1.0)
    assert band(beside(band, theta=np.where(band.time < 2.5, 0.0, 30.0))).theta == 0.5
    wide = np.where(band.time < 1.0, 10.0, 1.0)
    stretched = replace(band, draws=band.middle + wide * (band.draws - band.middle))
    assert stretched.half_width == pytest.approx(band.half_width)
    part = stretched.between(0.5, 1.5)
    assert part.first == 250 and part.half_width == pytest.approx(band.half_width)
    assert stretched.between(2.0, 3.0).first == 0
    with pytest.raises(IdentificationError, match=r"between 0 s and 1 s"):
        stretched.between(0.0, 1.0)


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
    return SimpleNamespace(
        predictions=[None] * logs,
        intervals=intervals,
        estimates={name: Estimate(0.01, 0.0) for name in intervals},
        omega_n=Estimate(20.0, 20.0 * omega_n / 2),
    )


def test_the_spread_of_several_recordings_is_measured_and_of_one_it_is_the_known_one():
    for friction in (0.1, 0.5):  # whatever a single fit says of itself; it is of one run, too
        assert results._spread(found(1, friction, 0.005)) == pytest.approx(np.sqrt(2) * np.array([0.36, 0.0076]))
    # With 11 logs, Student's t is 2.228. The error of a mean is that of a run divided by sqrt(11).
    friction, omega_n = results._spread(found(11, 2.228 * 0.3 / np.sqrt(11), 2.228 * 0.02 / np.sqrt(11)))
    assert friction == pytest.approx(np.sqrt((0.36**2 + 10 * 0.3**2) / 11 * 12 / 11), rel=1e-3)
    assert omega_n == pytest.approx(np.sqrt((0.0076**2 + 10 * 0.02**2) / 11 * 12 / 11), rel=1e-3)
    # Two logs that happen to agree do not say that runs are alike.
    assert results._spread(found(2, 0.0, 0.0))[0] == pytest.approx(0.36 * np.sqrt(0.75))


@pytest.fixture(scope="module")
def fitted():
    with hil.open("virtual", plant=SPEC) as bench:
        recording = experiments.tracking(bench, GAIN, frequency=0.5, duration=3.0, progress=False)
    return fit(recording, srv02(), SPEC.joint, progress=False), recording["theta_ref"]


def run_of(spec, reference):
    """A run of a bench along a reference, from rest."""
    with hil.open("virtual", plant=spec) as bench:
        return hil.loop.run(bench, StateFeedback(GAIN), reference, progress=False)


def rubbing(plus, minus=None, omega_n=1.0):
    """The bench with friction of each direction, and omega_n, times factors."""
    friction = SPEC.parameters.servo_friction
    changed = (friction[0] * plus, friction[1] * (plus if minus is None else minus))
    K_s = SPEC.parameters.K_s * omega_n**2
    return replace(SPEC, parameters=replace(SPEC.parameters, servo_friction=changed, K_s=K_s))


@pytest.mark.slow
def test_a_run_with_other_friction_lies_inside_and_one_of_a_bench_that_rubs_does_not(fitted):
    result, reference = fitted
    controller = StateFeedback(GAIN)
    controller(0.0, 1.0, 1.0)  # it remembers something else
    band = result.band(reference, controller, progress=False)
    assert len(band.draws) >= 60
    assert band.draws == pytest.approx(result.band(reference, controller, progress=False).draws, abs=0)
    for factors in ((0.5, 0.5), (2.0, 2.0), (0.5, 2.0)):
        assert min(band(run_of(rubbing(*factors), reference))) >= 0.95
    assert band(run_of(rubbing(6.0), reference)).theta < 0.5
    # No margin is less than what two counters differ by, and alpha's is more, for other controllers.
    assert (band.theta.upper - band.theta.middle).min() >= 1.5 * COUNT * (1 - 1e-9)
    assert (band.alpha.upper - band.alpha.middle).min() >= 2.25 * 1.5 * COUNT * (1 - 1e-9)
    assert "is for a new run" in str(band) and "One recording does not tell how runs differ" in str(band)
    assert band.doubts()[0] in str(band) and band.doubts()[0] in str(result)


@pytest.mark.scheduled
@pytest.mark.slow
def test_the_band_is_wider_where_runs_differ_more_and_where_the_fit_leaves_and_tells_less(fitted, monkeypatch):
    result, reference = fitted

    def half_width(of=result):
        return of.band(reference[:700], StateFeedback(GAIN), progress=False).half_width

    usual = half_width()
    (prediction,) = result.predictions
    off = prediction.recording["alpha_model"] + 0.5 * DEG * np.sin(20 * prediction.recording.time)
    left = replace(prediction, recording=prediction.recording.with_channels(alpha_model=off))
    assert half_width(replace(result, predictions=(left,)))["alpha"] > usual["alpha"] + 0.5 * DEG
    unsure = result.estimates | {"K_s": Estimate(result.parameters.K_s, 0.1 * result.parameters.K_s)}
    assert half_width(replace(result, estimates=unsure))["alpha"] > 1.3 * usual["alpha"]
    monkeypatch.setattr(results, "FRICTION", 0.9)
    monkeypatch.setattr(results, "OMEGA_N_SPREAD", 0.04)
    wide = half_width()
    assert wide["theta"] > 1.3 * usual["theta"] and wide["alpha"] > 1.3 * usual["alpha"]


@pytest.mark.scheduled
@pytest.mark.slow
def test_a_band_adapted_to_the_beginning_of_a_run_is_narrower_and_holds_the_rest(fitted):
    result, reference = fitted
    band = result.band(reference, StateFeedback(GAIN), progress=False)
    run = run_of(rubbing(0.5, 2.0, 1.015), reference)
    adapted = band.adapted(run, 1.2, progress=False)
    assert adapted.first == 601
    assert min(adapted(run)) >= 0.95
    rest = replace(band, first=adapted.first).half_width
    assert adapted.half_width["theta"] < 0.8 * rest["theta"]
    off = {
        name: np.sqrt(np.mean((one.middle[0] - run["theta"])[601:] ** 2))
        for name, one in {"new": band, "adapted": adapted}.items()
    }
    assert off["adapted"] < 0.5 * off["new"]
    assert "adapted to this run" in str(adapted) and adapted.doubts() != band.doubts()


@pytest.mark.slow
def test_a_band_is_not_adapted_to_too_much_or_to_a_run_that_does_not_move(fitted):
    result, reference = fitted
    band = result.band(reference, StateFeedback(GAIN), progress=False)
    run = run_of(SPEC, reference)
    for until in (0.0, 1.25, 5.0):
        with pytest.raises(IdentificationError, match=r"4 s of a recording at most, and to 40% .* here to 1\.201 s"):
            band.adapted(run, until)
    still = run.with_channels(theta=np.where(run.time < 1.3, COUNT * (run.time % 0.1 > 0.05), run["theta"]))
    with pytest.raises(IdentificationError, match=r"nothing to adapt to: until 1 s, theta moved by 0\.088 deg"):
        band.adapted(still, 1.0)
    with pytest.raises(IdentificationError, match="a part of another"):
        band.between(0, 2).adapted(run.between(0, 2), 0.5)
    with pytest.raises(IdentificationError, match="samples"):
        band.adapted(run.between(0, 2), 0.5)


@pytest.mark.slow
def test_an_open_loop_is_predicted_along_its_voltage(fitted):
    result, _reference = fitted
    with hil.open("virtual", plant=rubbing(1.2)) as bench:
        volts = 1.2 * np.sign(np.sin(np.pi * np.arange(1000) * 0.002 + 0.01))
        recording = hil.loop.run(bench, OpenLoop(), volts, progress=False)
    band = result.band(volts, OpenLoop(), progress=False)
    assert band.is_open
    assert min(band(recording)) >= 0.9  # what friction differs adds up here: less is promised than of a closed loop


@pytest.mark.slow
@pytest.mark.scheduled
def test_a_run_under_another_controller_lies_inside_though_the_fit_takes_play_for_friction_of_the_link():
    """Bench 1003: its fit finds thirty times the link's friction, and stops a swing of two counts that goes on."""
    gain = [10.89, -12.88, 0.72, -0.236]
    reference = smooth_square_wave(time_axis(6.0, 0.002), FREQUENCY, AMPLITUDE, RATE)
    with hil.open("virtual", seed=1003) as bench:
        recording = hil.loop.run(bench, StateFeedback(gain), reference, progress=False)
    band = fit(recording, srv02(), student_bench(1003).joint, progress=False).band(
        reference, StateFeedback(gain, "partial"), progress=False
    )
    with hil.open("virtual", seed=1003, run=8) as bench:
        assert min(band(hil.loop.run(bench, StateFeedback(gain, "partial"), reference, progress=False))) >= 0.95


@pytest.mark.slow
@pytest.mark.scheduled
@pytest.mark.parametrize(("seen", "other"), [("lqr", "pd"), ("pd", "lqr")])
def test_one_log_of_a_real_bench_lies_in_the_band_of_the_other(real_log_path, seen, other):
    """Under another gain, and with half the friction one way; adapted to the first 4 s, the band is narrow."""
    gains = {"lqr": [13.0384, -17.2586, 1.3198, -0.0461], "pd": [4.74, 4.74, 0.2133, 0.2133]}
    logs = {name: Recording.load(real_log_path.with_name(f"real_bench_{name}.mat")) for name in gains}
    result = fit(logs[seen], srv02(), joint(1), progress=False)
    band = result.band(logs[other]["theta_ref"], StateFeedback(gains[other]), progress=False)
    assert min(band(logs[other])) >= 0.95
    adapted = band.adapted(logs[other], 4.0, progress=False)
    assert min(adapted(logs[other])) >= 0.9
    assert max(adapted.half_width.values()) <= 0.8 * DEG
