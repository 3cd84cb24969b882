"""Which virtual benches there are, and one with a plant of one's own."""

import hashlib
import unicodedata
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rotflex import experiments, hil
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import DRAW, PRESETS, preset, student_bench, student_seed
from rotflex.recording import Recording
from rotflex.units import HZ

SEEDS = range(500)
J_EQ = srv02().J_eq


@pytest.fixture(scope="module")
def benches():
    return [student_bench(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def first_benches():
    return [student_bench(seed, draw=1) for seed in SEEDS]


def assert_fills(values, low, high, margin=0.02):
    room = margin * (high - low)
    assert low <= np.min(values) < low + room
    assert high - room < np.max(values) <= high


@pytest.mark.parametrize(
    ("name", "low", "high"), [("B_eq", 0.004, 0.012), ("B_l", 0.001, 0.0025), ("J_eq", 0.97 * J_EQ, 1.03 * J_EQ)]
)
def test_parameters_fill_their_range(benches, name, low, high):
    assert_fills([getattr(bench.parameters, name) for bench in benches], low, high)


def test_natural_frequencies_fill_the_inside_of_the_sweep_evenly_on_a_logarithmic_scale(benches):
    omega_n = np.sqrt([bench.parameters.K_s / bench.parameters.J_l for bench in benches])
    assert_fills(np.log(omega_n), np.log(18.0), np.log(27.5))
    shares, _edges = np.histogram(np.log(omega_n), 4, (np.log(18.0), np.log(27.5)))
    assert shares.min() > 0.8 * len(benches) / 4
    assert omega_n.min() / HZ - 1.0 > 1.4 and omega_n.max() / HZ < 0.9 * 5.0


@pytest.mark.parametrize(("name", "range_"), [("m_1", 0.08), ("m_2", 0.08), ("L_1", 0.03), ("L_2", 0.03)])
def test_arms_vary_by_what_a_student_can_weigh_and_measure(benches, name, range_):
    nominal, resolution = getattr(joint(1), name), 1e-4 if name[0] == "m" else 5e-4
    values = np.array([getattr(bench.joint, name) for bench in benches])
    least, most = np.min(values / nominal), np.max(values / nominal)
    assert 1 - range_ - 0.02 < least < 1 - 0.9 * range_ and 1 + 0.9 * range_ < most < 1 + range_ + 0.02
    np.testing.assert_allclose(values / resolution, np.round(values / resolution), atol=1e-6)


def test_the_true_arm_is_the_one_that_the_student_is_told(benches):
    for bench in benches:
        assert bench.parameters.J_l == bench.joint.J_l
    assert len({bench.joint.J_l for bench in benches}) > 0.98 * len(benches)


def test_motors_are_within_the_data_sheets_tolerances_and_most_near_the_middle(benches):
    sheet = srv02()
    torque = np.array([bench.parameters.torque_per_volt for bench in benches]) / sheet.torque_per_volt
    resistance = np.array([bench.parameters.resistance for bench in benches]) / sheet.R_m
    back_emf = np.array([bench.parameters.back_emf for bench in benches]) / (sheet.K_g * sheet.k_m)
    for values in (resistance, back_emf):
        assert_fills(values, 0.88, 1.12, 0.1)
        assert np.mean(np.abs(values - 1) < 0.06) == pytest.approx(0.75, abs=0.06)  # a triangle's share
    assert 0.88 * 0.9 * 0.95 / 1.12 <= torque.min() < 0.85 and 1.17 < torque.max() <= 1.12 * 1.1 * 1.05 / 0.88
    # In SI units the torque constant is the constant of the back-EMF: both are the same magnets and the same wire.
    efficiency = torque * resistance / back_emf
    assert efficiency.min() >= 0.9 * 0.95 and efficiency.max() <= 1.1 * 1.05


@pytest.mark.parametrize(
    ("draw", "name", "low", "high", "asymmetry"),
    [
        (1, "servo_friction", 0.006, 0.013, 0.3),
        (1, "link_friction", 0.0008, 0.0032, 0.2),
        (2, "servo_friction", 0.006, 0.013, 0.3),
        (3, "servo_friction", 0.006, 0.013, 0.3),
    ],
)
def test_friction_is_asymmetric_either_way_about_a_mean(draw, name, low, high, asymmetry):
    benches = [student_bench(seed, draw=draw) for seed in SEEDS]
    plus, minus = np.array([getattr(bench.parameters, name) for bench in benches]).T
    mean, skew = (plus + minus) / 2, (plus - minus) / (plus + minus)
    assert_fills(mean, low, high)
    assert -asymmetry <= skew.min() < -0.9 * asymmetry
    assert 0.9 * asymmetry < skew.max() <= asymmetry


def test_the_link_hardly_rubs(benches):
    friction = np.array([bench.parameters.link_friction for bench in benches])
    assert_fills(friction[:, 0], 0.0, 1e-4)
    np.testing.assert_array_equal(friction[:, 0], friction[:, 1])


def test_the_arm_is_at_every_anchor(benches):
    positions = [bench.joint.arm_position for bench in benches]
    assert set(positions) == {1, 2, 3}
    assert min(map(positions.count, (1, 2, 3))) > 120
    assert all(bench.joint.d_12 == joint(bench.joint.arm_position).d_12 for bench in benches)


@pytest.mark.parametrize(("draw", "least", "most"), [(2, 0.5e-3, 1.5e-3), (3, 1e-3, 3.5e-3)])
def test_the_boards_output_comes_late(draw, least, most):
    benches = [student_bench(seed, draw=draw) for seed in SEEDS]
    timings = [bench.timing for bench in benches]
    assert_fills([timing.delay for timing in timings], least, most)
    assert {(timing.jitter, timing.late, timing.late_by) for timing in timings} == {(0.25e-3, 1e-3, 2e-3)}
    assert len({timing.seed for timing in timings}) == len(benches)


def test_what_is_not_drawn_is_nominal(benches, first_benches):
    servo = srv02()
    for bench in first_benches:
        assert bench.parameters.torque_per_volt == servo.torque_per_volt
        assert bench.parameters.back_emf == servo.K_g * servo.k_m
        assert bench.parameters.J_l == joint(bench.joint.arm_position).J_l
        assert bench.joint == joint(bench.joint.arm_position)
        assert bench.timing.longest == 0
    for bench in [*benches, *first_benches]:
        assert (bench.parameters.V_max, bench.parameters.I_max) == (10.0, 4.16)
        assert bench.parameters.K_3 == 0.0


def test_the_servo_sticks_and_its_gear_is_rough_in_the_third_draw_alone(benches, first_benches):
    assert_fills([bench.parameters.breakaway for bench in benches], 1.0, 1.4)
    turn = np.linspace(0, 2 * np.pi, 2000)
    for bench in benches[:50]:
        shares = np.array([bench.parameters.roughness(theta) for theta in turn])
        assert shares.mean() == pytest.approx(1, abs=1e-3)
        assert 0.25 < np.ptp(shares) / 2 <= 0.3
    for bench in [*first_benches, student_bench(7, draw=2), *PRESETS.values()]:
        assert bench.parameters.breakaway == bench.parameters.roughness(1.0) == 1


@given(st.integers(0, 1000), st.integers(2, 1000), st.sampled_from([(2, 1 / 1.25, 1.2), (3, 1 / 1.5, 1.5)]))
def test_another_run_changes_friction_and_the_boards_jitter_alone_and_is_the_same_every_time(seed, number, of_draw):
    draw, least, most = of_draw
    bench = student_bench(seed, draw=draw)
    run = bench.run(number)
    assert run == bench.run(number) != bench.run(number + 1)
    for name in ("servo_friction", "link_friction"):
        before, after = np.array(getattr(bench.parameters, name)), np.array(getattr(run.parameters, name))
        ratios = after / before
        assert ratios[0] == pytest.approx(ratios[1]) and least <= ratios[0] <= most
    friction = {name: getattr(bench.parameters, name) for name in ("servo_friction", "link_friction")}
    assert replace(run.parameters, **friction) == bench.parameters
    assert replace(run.timing, seed=bench.timing.seed) == bench.timing
    assert run.joint == bench.joint


def test_a_run_changes_friction_by_its_number_and_its_bench_evenly_over_a_range():
    def factor(seed, number):
        bench = student_bench(seed)
        return bench.run(number).parameters.servo_friction[0] / bench.parameters.servo_friction[0]

    assert len({round(factor(seed, 2), 6) for seed in range(50)}) == 50
    factors = np.log([factor(5, number) for number in range(2, 402)])
    assert_fills(factors, -np.log(1.5), np.log(1.5))
    assert np.mean(factors) == pytest.approx(0, abs=0.04)


def test_run_1_is_the_bench_itself_and_what_no_bench_has_is_refused():
    bench = student_bench(5)
    assert bench.run(1) is bench
    for number in (0, -1, 1.0, True, "2"):
        with pytest.raises(ConfigurationError, match="run"):
            bench.run(number)
    with pytest.raises(ConfigurationError, match="1, 2, 3"):
        student_bench(1, arm_position=4)


def test_different_seeds_are_different_benches(benches):
    assert len({bench.parameters for bench in benches}) == len(benches)
    assert len({bench.parameters.K_s for bench in benches}) == len(benches)


def test_a_bench_of_old_is_still_the_same():
    """Answers that were given on a bench stay right: no release, of this package or of numpy, may change the draw."""
    bench = student_bench(7, draw=1)
    assert bench.joint.arm_position == 3
    drawn = [bench.parameters.K_s, bench.parameters.J_eq, bench.parameters.B_l]
    np.testing.assert_allclose(drawn, [1.5986069004847876, 2.049815793042526e-3, 1.1003325698224508e-3], rtol=1e-9)
    bench = student_bench(7, draw=2)
    assert (bench.joint.arm_position, bench.joint.m_1, bench.joint.L_2) == (1, 0.0634, 0.153)
    drawn = [bench.parameters.K_s, bench.parameters.torque_per_volt, bench.timing.delay]
    np.testing.assert_allclose(drawn, [1.393164255846557, 0.12772475908836778, 1.4931053258133865e-3], rtol=1e-9)
    bench = student_bench(7, draw=3)
    assert (bench.joint.arm_position, bench.joint.m_1, bench.joint.L_2) == (3, 0.0679, 0.1545)
    drawn = [bench.parameters.K_s, bench.parameters.breakaway, bench.timing.delay, *bench.parameters.gear[1]]
    np.testing.assert_allclose(
        drawn,
        [2.6101209877230596, 1.2317822765732882, 0.0026275971816832255, 70, 0.24435012605453615, 6.239691844178153],
        rtol=1e-9,
    )


def test_the_newest_draw_is_the_third_and_another_version_is_refused():
    assert DRAW == 3
    assert student_bench(7, draw=3) == student_bench(7) != student_bench(7, draw=2)
    with pytest.raises(ConfigurationError, match=r"draw 4 .* which knows 1, 2, 3\."):
        student_bench(7, draw=4)


@pytest.mark.parametrize("draw", [1, 2, 3])
@pytest.mark.parametrize("position", [1, 2, 3])
def test_moving_the_arm_changes_its_inertia_alone(position, draw):
    drawn, moved = student_bench(5, draw=draw), student_bench(5, arm_position=position, draw=draw)
    arm = replace(drawn.joint, arm_position=position, d_12=joint(position).d_12)
    assert moved == replace(drawn, joint=arm, parameters=replace(drawn.parameters, J_l=arm.J_l))


@given(st.text())
@example("  ada LOVELACE ")
def test_seeds_are_those_of_always_and_the_same_however_accents_are_put_together(student):
    composed, apart = (unicodedata.normalize(form, student) for form in ("NFC", "NFD"))
    always = hashlib.sha256(f"rotflex bench: {composed.strip().casefold()}".encode()).digest()
    assert student_seed(composed) == student_seed(apart) == int.from_bytes(always[:4], "big")


def test_presets_are_the_workbooks_plant_and_the_real_bench_as_it_was_fitted():
    assert set(PRESETS) == {"real_bench", "workbook"}
    assert preset("workbook").parameters.K_s == 1.4
    assert preset("workbook").parameters.servo_friction == (0.0, 0.0)
    p = preset("real_bench").parameters
    assert (p.J_eq, p.J_l, p.K_s, p.B_eq) == (2.12e-3, 2.77e-3, 1.454, 0.0095)
    assert np.mean(p.servo_friction) == pytest.approx(0.0108)
    with pytest.raises(ConfigurationError, match="'real_bench', 'workbook'"):
        preset("mars")


def decay(bench):
    with bench:
        return experiments.free_decay(bench, duration=0.5, progress=False)


@pytest.mark.parametrize("number", [1, 3])
def test_a_drawn_bench_given_as_ones_own_is_the_same_bench_in_each_run(number):
    own = hil.open("virtual", plant=student_bench(7), run=number)
    assert own.joint == student_bench(7).joint
    assert hil.open("virtual", plant=student_bench(7), servo=srv02(encoder="EHR")).servo.encoder == "EHR"
    ours, drawn = decay(own), decay(hil.open("virtual:?seed=7", run=number))
    for name in drawn.channels:
        assert ours[name].tolist() == drawn[name].tolist()


def test_parameters_alone_have_the_first_arm_and_prompt_outputs(tmp_path):
    parameters = student_bench(7).parameters
    bench = hil.open("virtual:?encoder=EHR", plant=parameters)
    assert (bench.joint.arm_position, bench.servo.encoder) == (1, "EHR")
    recording = decay(bench)
    saved = Recording.load(recording.save(tmp_path / "own.mat")).metadata
    assert saved["source"] == "virtual bench"
    assert saved["bench"]["plant"]["K_s"] == parameters.K_s
    assert saved["bench"]["plant"]["delay"] == 0
    assert "seed" not in saved["bench"]
    prompt, late = recording, decay(hil.open("virtual:?encoder=EHR", plant=student_bench(7)))
    assert prompt["alpha"].tolist() != late["alpha"].tolist()


def test_what_an_address_has_no_use_for_is_refused_and_not_dropped_in_silence():
    plant = {"plant": student_bench(7).parameters}
    refused = [("virtual:?seed=3", plant, "seed="), ("virtual:?preset=workbook", plant, "preset=")]
    refused += [("virtual:?arm_position=2", plant, "arm_position="), ("replay:some.mat", plant, "plant=")]
    refused += [(uri, {"setup": Setup()}, "setup=") for uri in ("virtual:?seed=7", "virtual:twin.toml", "replay:a.mat")]
    boards = ("virtual:twin.toml", "replay:some.mat", "quanser:q2_usb/0")
    refused += [(uri, {"servo": srv02()}, "servo=") for uri in boards]
    for uri, choices, named in refused:
        with pytest.raises(BenchError, match=named):
            hil.open(uri, **choices)
