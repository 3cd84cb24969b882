"""The grey-box fit against virtual benches, whose truth is known, and against the log of a real bench.

Some benches are of the first draw, with the data sheet's motor and no delay: for fits that are told so.
"""

from dataclasses import replace

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import joint, srv02
from rotflex.errors import ConfigurationError, IdentificationError
from rotflex.greybox import FREE, fit
from rotflex.greybox.problem import Record
from rotflex.hil.student_benches import VirtualPlantSpec, student_bench
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.units import DEG

pytestmark = pytest.mark.slow

COUNT = 360 / 4096 * DEG
#: A bench with the motor of the data sheet and prompt outputs.
NOMINAL = VirtualPlantSpec(
    joint(2),
    replace(
        PlantParameters.of(srv02(), joint(2), 1.42),
        J_eq=2.05e-3,
        B_eq=0.008,
        B_l=0.0015,
        servo_friction=(0.0094, 0.0075),
        link_friction=(0.0018, 0.0021),
    ),
)
DRAWN = student_bench(4)
#: With Coulomb friction alone, as a fit models it.
SMOOTH = replace(DRAWN, parameters=replace(DRAWN.parameters, stribeck=0.0, load=0.0, gear=()))
GAIN = [13.04, -17.26, 1.32, -0.046]
KNOWN_MOTOR = ("K_s", "J_eq", "B_eq", "B_l", "servo_friction", "link_friction")


def tracked(spec, duration):
    with hil.open("virtual", plant=spec) as bench:
        return experiments.tracking(bench, GAIN, amplitude=30 * DEG, frequency=0.5, duration=duration, progress=False)


def truth(bench):
    """True values by the names that a fit gives them."""
    true = bench.parameters
    plus, minus = true.servo_friction
    values = {name: getattr(true, name) for name in ("K_s", "J_eq", "B_eq", "B_l", "torque_per_volt")}
    values |= {"servo_friction_plus": plus, "servo_friction_minus": minus, "delay": bench.timing.delay}
    values |= {"link_friction": sum(true.link_friction) / 2}
    return values | {"braking": true.torque_per_volt * true.back_emf + true.B_eq}


WITHIN = {
    NOMINAL: {"K_s": 0.002, "J_eq": 0.005, "B_eq": 0.02, "B_l": 0.15, "link_friction": 0.15}
    | {"servo_friction_plus": 0.03, "servo_friction_minus": 0.03},
    SMOOTH: {"K_s": 0.002, "J_eq": 0.005, "torque_per_volt": 0.01, "braking": 0.005, "B_l": 0.15},
}


@pytest.fixture(scope="module", params=WITHIN)
def fitted(request):
    """A fit that knows the motor, and one of all, with the bench and what is true of it."""
    spec = request.param
    free = KNOWN_MOTOR if spec == NOMINAL else FREE
    result = fit(tracked(spec, 4.0), srv02(), spec.joint, free, progress=False)
    return spec, {name: value for name, value in truth(spec).items() if name in result.estimates}, result


def test_a_virtual_bench_is_recovered_with_narrow_intervals_and_less_than_a_count_is_left(fitted):
    spec, true_values, result = fitted
    for name, tolerance in WITHIN[spec].items():
        assert result.estimates[name].value == pytest.approx(true_values[name], rel=tolerance), name
    if spec == SMOOTH:
        assert result.estimates["delay"].value == pytest.approx(true_values["delay"], abs=2e-4)
        assert result.estimates["link_friction"].value < 4e-4  # it is next to nothing

    assert spec == NOMINAL or {"torque_per_volt", "braking", "delay"} < set(true_values)
    for name, true in true_values.items():
        low, high = result.intervals[name]
        assert low <= true <= high, name
        if spec == NOMINAL:
            assert high - low < (0.5 if name in ("B_l", "link_friction") else 0.1) * true, name
        elif name in ("K_s", "J_eq", "torque_per_volt", "braking"):
            assert high - low < 0.05 * true, name

    assert max(result.residual_rms.values()) < (COUNT / 2 if spec == NOMINAL else COUNT)
    alpha = result.recording["alpha"] - result.recording["alpha_model"]
    assert result.residual_rms["alpha"] == pytest.approx(np.sqrt(np.mean(alpha**2)))


@pytest.mark.parametrize("seed", [4, pytest.param(7, marks=pytest.mark.scheduled)])
def test_a_bench_that_sticks_on_a_rough_gear_still_gives_its_natural_frequency(seed):
    true = student_bench(seed)
    assert true.parameters.stribeck and true.parameters.load and true.parameters.gear
    result = fit(tracked(true, 4.0), srv02(), true.joint, progress=False)
    omega_n = np.sqrt(result.parameters.K_s / result.parameters.J_l)
    assert omega_n == pytest.approx(np.sqrt(true.parameters.K_s / true.parameters.J_l), rel=0.01)
    assert result.residual_rms["alpha"] < COUNT


def test_a_recording_that_begins_in_the_middle_of_a_swing_is_fitted_as_well():
    true = NOMINAL.parameters
    recording = tracked(NOMINAL, 4.2).between(1.1, 4.2)
    start = replace(true, K_s=1.4)
    result = fit(recording, srv02(), NOMINAL.joint, free=("K_s", "B_l"), initial=start, progress=False)
    assert abs(result.estimates["alpha_dot_0"].value) > 0.5
    assert result.parameters.K_s == pytest.approx(true.K_s, rel=0.002)
    assert result.parameters.B_l == pytest.approx(true.B_l, rel=0.05)
    assert result.residual_rms["alpha"] < COUNT / 2


@pytest.mark.parametrize(("free", "other"), [("J_l", "torque_per_volt"), ("B_eq", "braking")])
def test_what_has_the_same_effect_is_not_fitted_together(free, other):
    with pytest.raises(IdentificationError, match=f"{free} or {other}"):
        fit(jittering(), srv02(), joint(1), (*FREE, free), progress=False)


def jittering(duration=4.0, **changed):
    """Angles that count to and fro, at 0 V."""
    t = np.arange(round(duration / 0.002)) * 0.002
    angle = COUNT * (np.arange(t.size) // 20 % 3)
    channels = {"theta": angle, "alpha": -angle, "vm": np.zeros(t.size)} | changed
    return Recording.of(t, **{name: values for name, values in channels.items() if values is not None})


def test_what_cannot_be_fitted_is_refused_with_the_reason():
    for recording, named in (
        (jittering(vm=None), "'vm'"),
        (jittering(alpha=np.zeros(2000)), "'alpha'"),
        (jittering(duration=2.0), "2 windows"),
    ):
        with pytest.raises(IdentificationError, match=named):
            fit(recording, srv02(), joint(1), progress=False)
    stuck = replace(PlantParameters.of(srv02(), joint(1), 1.4), servo_friction=(1.0, 1.0), link_friction=(1.0, 1.0))
    with pytest.raises(IdentificationError, match="K_s, J_eq, alpha_offset"):
        fit(jittering(3.0), srv02(), joint(1), free=("K_s", "J_eq"), initial=stuck, progress=False)
    with pytest.raises(ConfigurationError, match=r"'K_3'.*'K_s'"):
        fit(jittering(), srv02(), joint(1), free=("K_3",))


def test_a_rest_is_compared_at_every_tenth_sample_in_the_window_of_the_motion_before_it():
    """Both encoders count for 0.5 s and then stand for 3.5 s, while a model's angles creep on."""
    t = np.arange(2000) * 0.002
    ramp = np.minimum(t, 0.5)
    angle = np.floor(ramp / 0.02) * COUNT  # 25 counts
    record = Record(Recording.of(t, theta=angle, alpha=angle, vm=np.zeros(t.size)))
    counts, rests = 25, (1999 - 9 - 25 + 9) // 10  # the first count comes after sample 9
    assert record.windows.tolist() == [0] * 2 * (counts + rests)
    left = record.residual(angle + np.maximum(t - 0.5, 0) * DEG, angle + np.maximum(t - 0.5, 0) * DEG)
    theta, alpha = left.reshape(2, -1)
    assert alpha.min() == pytest.approx(-3.5 * DEG, rel=0.01)
    assert theta == pytest.approx(alpha - alpha.mean())


def test_a_record_of_rest_alone_is_refused():
    standing = {name: np.full(2000, 7 * COUNT) for name in ("theta", "alpha")}
    with pytest.raises(IdentificationError, match=r"'theta' is constant.* nothing moved"):
        fit(jittering(**standing, vm=np.full(2000, 0.1)), srv02(), joint(1), progress=False)
    # A count or two within a second, and rest ever after, is not enough either.
    twitch = {name: COUNT * (np.arange(2000) == 100) for name in ("theta", "alpha")}
    with pytest.raises(IdentificationError, match="moves in 1 window of 1 s only; at least 3"):
        fit(jittering(**twitch), srv02(), joint(1), progress=False)
