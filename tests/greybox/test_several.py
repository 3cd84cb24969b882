"""Several recordings of one bench, whose friction differs from run to run, fitted at once; each left out in turn."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import joint, srv02
from rotflex.errors import ConfigurationError, IdentificationError
from rotflex.greybox import FREE, fit, leave_one_out, solving
from rotflex.greybox.problem import Record, rms
from rotflex.greybox.result import joined_rms
from rotflex.greybox.solving import Optimum, Sureness, _fix, _next_to_fix, sureness
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.student_benches import student_bench
from rotflex.plant import Plant, PlantParameters, State
from rotflex.recording import Recording
from rotflex.units import DEG

pytestmark = pytest.mark.slow
COUNT = 360 / 4096 * DEG
GAIN = [13.04, -17.26, 1.32, -0.046]


def smooth(spec):
    """Return a bench with Coulomb friction alone, as a fit models it."""
    return replace(spec, parameters=replace(spec.parameters, stribeck=0.0, load=0.0, gear=()))


SPEC = smooth(student_bench(5))
FRICTION = 0.6, 1.0, 1.4  # of the drawn one


def run_of(spec, friction, frequency=0.5, duration=3.2):
    """A recording of a bench with other servo friction, by itself."""
    plus, minus = spec.parameters.servo_friction
    parameters = replace(spec.parameters, servo_friction=(plus * friction, minus * friction))
    with hil.open("virtual", plant=replace(spec, parameters=parameters)) as bench:
        return experiments.tracking(
            bench, GAIN, amplitude=30 * DEG, frequency=frequency, duration=duration, progress=False
        )


@pytest.fixture(scope="module")
def recordings():
    return [run_of(SPEC, friction, frequency) for friction, frequency in zip(FRICTION, (0.5, 0.4, 0.6), strict=True)]


@pytest.fixture(scope="module")
def together(recordings):
    return fit(recordings, srv02(), SPEC.joint, FREE, progress=False, per_recording=("servo_friction",))


def test_one_set_of_parameters_is_found_from_all_and_its_intervals_hold_the_truth(together):
    true = SPEC.parameters
    truth = {name: getattr(true, name) for name in ("K_s", "J_eq", "torque_per_volt", "B_l")}
    truth |= {"braking": true.torque_per_volt * true.back_emf + true.B_eq, "delay": SPEC.timing.delay}
    for name, value in truth.items():
        low, high = together.intervals[name]
        assert low <= value <= high, name
        if name in ("K_s", "J_eq", "torque_per_volt", "braking"):
            assert high - low < 0.05 * value, name
    assert together.delay == together.estimates["delay"].value
    assert max(together.residual_rms.values()) < COUNT


def test_each_recording_has_its_own_friction_and_the_plant_their_mean(together):
    plus, minus = SPEC.parameters.servo_friction
    for way, drawn in (("plus", plus), ("minus", minus)):
        own = [together.estimates[f"servo_friction_{way}[{place}]"].value for place in range(3)]
        assert own == pytest.approx(np.multiply(FRICTION, drawn), rel=0.15)
        low, high = together.intervals[f"servo_friction_{way}"]
        assert low < drawn < high
        assert together.estimates[f"servo_friction_{way}"].value == pytest.approx(np.mean(own))
        # The interval is that of Student's t for three runs: 4.303 standard errors of their mean, at least.
        assert high - low >= 2 * 4.302 * np.std(own, ddof=1) / np.sqrt(3)
    found = together.parameters.servo_friction
    assert found == pytest.approx(np.mean([plant.servo_friction for plant in together.plants], axis=0))
    assert {plant.K_s for plant in together.plants} == {together.parameters.K_s}


def test_the_fitted_bench_moves_as_the_true_one_in_another_experiment(together):
    again = replace(SPEC, parameters=replace(SPEC.parameters, servo_friction=together.parameters.servo_friction))
    with together.bench() as ours, hil.open("virtual", plant=again) as true:
        assert ours.joint == SPEC.joint
        made, wanted = (experiments.free_decay(bench, duration=2.0, progress=False) for bench in (ours, true))
    for name in ("theta", "alpha"):
        assert np.sqrt(np.mean((made[name] - wanted[name]) ** 2)) < COUNT, name
    assert made.metadata["bench"]["plant"]["K_s"] == together.parameters.K_s
    assert made.metadata["bench"]["plant"]["delay"] == together.delay
    with together.bench("virtual:?clock=wall", run=2) as other:
        assert (other.identity["clock"], other.identity["run"]) == ("wall", 2)


def test_a_fitted_plant_predicts_another_recording_and_drifts(together):
    predicted = together.predict(run_of(SPEC, 1.0, 0.45))
    assert predicted.rms["alpha"] < 1.5 * COUNT
    assert predicted.drift >= predicted.rms["theta"]
    left = predicted.recording["alpha"] - predicted.recording["alpha_model"]
    assert predicted.rms["alpha"] == pytest.approx(np.sqrt(np.mean(left**2)))


def test_leaving_one_out_tells_the_recording_that_is_of_another_bench():
    known = SPEC.parameters
    stiffer = replace(SPEC, parameters=replace(known, K_s=1.15 * known.K_s))
    every = [run_of(SPEC, 1.0), run_of(SPEC, 1.0, 0.4), run_of(stiffer, 1.0)]
    out = leave_one_out(every, srv02(), SPEC.joint, ("K_s", "delay"), initial=known, progress=False)
    assert [len(found.plants) for found in out.fits] == [2, 2, 2]
    assert out.fits[2].parameters.K_s == pytest.approx(known.K_s, rel=0.005)
    alpha = [prediction.rms["alpha"] for prediction in out.predictions]
    assert alpha[2] > 3 * COUNT > out.fits[2].residual_rms["alpha"]
    assert out.rms["alpha"] == pytest.approx(np.sqrt(np.mean(np.square(alpha))))
    table = str(out).splitlines()
    assert len(table) == 5 and table[3].startswith("[2]") and f"alpha {alpha[2] / DEG:.3f}" in table[3]
    # The spread between recordings widens the interval, until it holds both stiffnesses.
    low, high = fit(every, srv02(), SPEC.joint, ("K_s", "delay"), initial=known, progress=False).intervals["K_s"]
    assert low < known.K_s and high > 1.15 * known.K_s


def test_what_is_left_of_recordings_of_different_length_is_that_of_all_their_samples():
    left = [np.full(300, 1.0), np.full(100, -3.0)]
    every = tuple(SimpleNamespace(recording=one, rms={"alpha": rms(one)}) for one in left)
    assert joined_rms(every)["alpha"] == pytest.approx(rms(np.concatenate(left)))


def test_one_recording_cannot_be_left_out_and_none_cannot_be_fitted(recordings):
    with pytest.raises(IdentificationError, match=r"needs two recordings or more; there are 1\. A long one can be cut"):
        leave_one_out(recordings[:1], srv02(), SPEC.joint)
    with pytest.raises(IdentificationError, match="no recording to fit"):
        fit([], srv02(), SPEC.joint)
    with pytest.raises(ConfigurationError, match="'friction'; allowed: 'K_s'"):
        fit(recordings, srv02(), SPEC.joint, per_recording=("friction",))


def test_the_spread_between_recordings_is_the_jackknife_of_fits_without_each():
    """A linear problem, where the jackknife is exact: four recordings, two common unknowns, and an offset of each."""
    draw = np.random.default_rng(2)
    count, samples = 4, 50
    blocks = [draw.normal(size=(samples, 2)) for _ in range(count)]
    measured = [block @ [1.0 + 0.3 * draw.normal(), 2.0] + draw.normal() for block in blocks]
    jacobian = np.zeros((count * samples, 2 + count))
    for place, block in enumerate(blocks):
        jacobian[place * samples : (place + 1) * samples] = np.hstack(
            [block, np.outer(np.ones(samples), np.eye(count)[place])]
        )
    values, *_rest = np.linalg.lstsq(jacobian, np.concatenate(measured), rcond=None)
    residual = jacobian @ values - np.concatenate(measured)
    problem = SimpleNamespace(
        names=[*"ab", *"0123"],
        unknowns=[SimpleNamespace(of=of) for of in (None, None, 0, 1, 2, 3)],
        units=np.ones(6),
        records=[None] * count,
        rows=[slice(place * samples, (place + 1) * samples) for place in range(count)],
        windows=lambda: np.arange(count * samples),  # as good as white
    )
    without = []
    for place in range(count):
        kept = np.delete(np.arange(count), place)
        rows = np.concatenate([np.arange(count * samples)[problem.rows[one]] for one in kept])
        columns = [0, 1, *(2 + kept)]
        refit = np.linalg.lstsq(jacobian[np.ix_(rows, columns)], np.concatenate(measured)[rows], rcond=None)[0]
        without.append(refit[0])
    expected = np.sqrt((count - 1) / count * np.sum((without - np.mean(without)) ** 2))
    sure = sureness(problem, Optimum(values, residual, jacobian))
    assert sure.errors[0] == pytest.approx(expected)
    assert sure.reaches[0] == pytest.approx(3.18245 * expected, rel=1e-5)  # Student's t of 3 degrees of freedom


@pytest.mark.scheduled
def test_a_friction_and_a_delay_that_are_not_there_are_given_up_in_words():
    parameters = replace(SPEC.parameters, link_friction=(0.0, 0.0))
    still = replace(SPEC, parameters=parameters, timing=replace(SPEC.timing, delay=0.0, jitter=0.0, late=0.0))
    found = fit(run_of(still, 1.0, duration=4.0), srv02(), SPEC.joint, progress=False)
    assert set(found.fixed) == {"link_friction", "delay"}
    assert found.parameters.link_friction == (0.0, 0.0) and found.delay == 0.0
    for name in found.fixed:
        assert found.estimates[name].value == 0.0
        assert found.intervals[name][0] <= 0 < found.intervals[name][1]
        assert found.fixed[name].startswith(f"{name}: not told from none (95 %: ")
        assert found.fixed[name] in str(found)
    assert found.parameters.K_s == pytest.approx(parameters.K_s, rel=0.002)
    assert found.parameters.B_l == pytest.approx(parameters.B_l, rel=0.1)


@pytest.mark.parametrize(
    ("logs", "spread", "given_up"),
    [
        (1, {}, None),
        (3, {"link_friction": 2.5e-3}, "link_friction"),
        (2, {"link_friction": 2.5e-3}, "link_friction"),
        (3, {"delay": 2e-3}, "delay"),
        (2, {"delay": 2e-3}, None),  # between two recordings, every interval is wide
        (3, {"torque_per_volt": 0.2}, None),
    ],
)
def test_a_friction_that_the_spread_between_recordings_does_not_tell_from_none_is_given_up(logs, spread, given_up):
    names = ("link_friction", "delay", "B_l", "torque_per_volt", "braking", "J_eq")
    values = np.array([2e-3, 1e-3, 1.5e-3, 0.13, 0.08, 2e-3])
    problem = SimpleNamespace(
        free=names, unknowns=[SimpleNamespace(key=name) for name in names], units=np.ones(6), records=[None] * logs
    )
    within = values / 10
    sure = Sureness(
        within, np.array([spread.get(*pair) for pair in zip(names, within, strict=True)]), within, np.eye(6)
    )
    found = Optimum(values, np.zeros(1), np.zeros((1, 6)))
    assert _next_to_fix(problem, found, sure) == given_up
    if given_up:
        low, high = _fix(given_up, 0.0, problem, found, sure).interval
        assert low < 0 < high


def test_the_interval_of_omega_n_is_the_spread_between_recordings_and_of_one_no_less_than_logs_differ(together):
    relative = np.ptp(together.intervals["K_s"]) / together.parameters.K_s / 4  # half a width, and a square root
    assert 2 * together.omega_n.uncertainty == pytest.approx(relative * together.omega_n.value)
    one = replace(together, predictions=together.predictions[:1])
    assert 2 * one.omega_n.uncertainty == pytest.approx(max(0.16, relative * one.omega_n.value))
    assert f"{one.omega_n.value:.4g} ± 0.16 rad/s" in str(one)


def test_a_fit_that_leaves_much_is_doubted_in_words(together):
    assert together.doubts() == [] and "doubted" not in str(together)
    first, second, third = together.predictions
    for angle, most in (("theta", 1.0), ("alpha", 0.5)):
        for left, doubted in ((0.99, False), (1.01, True)):
            bad = replace(second, rms=second.rms | {angle: left * most * DEG})
            fitted = replace(together, predictions=(first, bad, third))
            assert [("b.mat" in doubt) for doubt in fitted.doubts(("a.mat", "b.mat", "c.mat"))] == [True] * doubted
            assert ("[1]" in "".join(fitted.doubts())) == ("This fit is doubted" in str(fitted)) == doubted


@pytest.mark.scheduled
@pytest.mark.parametrize("free", [("K_s", "J_eq", "B_l", "servo_friction"), None])
def test_a_log_of_another_mechanism_is_doubted_and_its_fit_ends_well_before_the_bound(other_mechanism_path, free, runs):
    log = Recording.load(other_mechanism_path)
    found = fit(log, srv02(), joint(1), free, progress=False)
    assert any("left of the recording is theta" in doubt for doubt in found.doubts())
    assert len(runs) < solving.MOST_RUNS / 2


@pytest.fixture
def runs(monkeypatch):
    """One element for each run of the plant."""
    made, simulate = [], Record.simulate
    monkeypatch.setattr(Record, "simulate", lambda *given: [made.append(1), simulate(*given)][1])
    return made


@pytest.mark.scheduled
def test_a_whole_fit_ends_after_a_number_of_runs_of_the_plant(runs, monkeypatch):
    log = run_of(SPEC, 1.0)
    assert fit(log, srv02(), SPEC.joint, progress=False).fixed  # so that there is a second search
    most = len(runs) * 4 // 5  # which neither of them takes
    runs.clear()
    monkeypatch.setattr(solving, "MOST_RUNS", most)
    with pytest.raises(IdentificationError, match=f"not settled in {most} runs"):
        fit(log, srv02(), SPEC.joint, progress=False)
    assert most <= len(runs) < most + 12  # a Jacobian is finished


def test_what_the_motor_does_is_given_up_where_it_does_nothing():
    """The arm is deflected by hand and let go, at 0 V; the servo swings along."""
    true = replace(PlantParameters.of(srv02(), joint(1), 1.5), B_l=1e-3, servo_friction=(2e-3, 2e-3))
    moving, states = Plant(true, State(0.0, 0.35, 0.0, 0.0)), []
    for _sample in range(1600):
        states.append(moving.state[:2])
        moving.advance(0.0, 0.002)
    theta, alpha = np.round(np.transpose(states) / COUNT) * COUNT
    recording = Recording.of(np.arange(1600) * 0.002, theta=theta, alpha=alpha, vm=np.zeros(1600))
    found = fit(recording, srv02(), joint(1), progress=False)
    assert found.fixed["torque_per_volt"] == "torque_per_volt: nothing tells it, so it is taken as 0.1285."
    assert found.intervals["torque_per_volt"] == (-np.inf, np.inf)
    assert found.parameters.K_s == pytest.approx(1.5, rel=0.005)
    assert found.parameters.J_eq == pytest.approx(true.J_eq, rel=0.01)
    assert found.estimates["braking"].value == pytest.approx(true.torque_per_volt * true.back_emf + true.B_eq, rel=0.01)


@pytest.mark.scheduled
def test_the_log_of_a_real_bench_tells_its_resonance_and_no_link_friction(real_log):
    found = fit(real_log, srv02(), joint(1), progress=False)
    assert set(found.fixed) == {"link_friction"}
    # A fit of others to three such logs: K_s 1.454 and J_l 2.77e-3.
    assert found.omega_n.value == pytest.approx(np.sqrt(1.454 / 2.77e-3), rel=0.01)
    assert 0.08 <= found.omega_n.uncertainty < 0.005 * found.omega_n.value
    assert not found.doubts()
    said = str(found)
    assert "J_l = 0.003278 kg·m² was given" in said and "link_friction: not told from none" in said
    with found.bench() as bench:  # under the gain of that log, along its reference
        again = run(bench, StateFeedback([13.0384, -17.2586, 1.3198, -0.0461]), real_log["theta_ref"], progress=False)
    for name, limit in (("theta", 0.2), ("alpha", 0.16)):  # as near as the preset that was made for it
        assert np.sqrt(np.mean((again.degrees(name) - real_log.degrees(name)) ** 2)) <= limit, name
