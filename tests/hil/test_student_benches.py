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
from rotflex.hil.student_benches import DRAW, preset, student_bench, student_seed
from rotflex.recording import Recording
from rotflex.units import HZ

#: The numbers of 100 benches, on average, each bench weighed by its seed + 1.
DRAWN = (
    "2.1039604 0.0633911881 0.298359109 0.0300545941 0.154806337 0.128550013 2.59941136 0.539083458 "
    "0.0020837981 0.00364945058 1.7957363 0.00815722448 0.00179745446 0.015778324 0.0151610788 4.91022898e-05 "
    "4.91022898e-05 0.182935651 0.130810808 5 0.0395374214 0.548705521 70 0.0368572212 0.466130419 "
    "0.00231787901 0.00025 0.001 0.002 0.503824527 "
)


def numbers(bench):
    arm, plant, timing = bench.joint, bench.parameters, bench.timing
    motor = [plant.torque_per_volt, plant.resistance, plant.back_emf, plant.J_eq, plant.J_l, plant.K_s]
    friction = [plant.B_eq, plant.B_l, *plant.servo_friction, *plant.link_friction, plant.stribeck, plant.load]
    gear = [value for wave in plant.gear for value in wave]
    late = [timing.delay, timing.jitter, timing.late, timing.late_by, timing.seed / 2**32]
    return [arm.arm_position, arm.m_1, arm.L_1, arm.m_2, arm.L_2, *motor, *friction, *gear, *late]


def test_the_draw_is_the_same_always():
    """Answers that were given on a bench stay right: no release, of this package or of numpy, may change the draw."""
    values = [numbers(student_bench(seed)) for seed in range(100)]
    averages = np.average(values, axis=0, weights=np.arange(1, 101))
    np.testing.assert_allclose(averages, np.array(DRAWN.split(), dtype=float), rtol=1e-8)


@pytest.fixture(scope="module")
def benches():
    return [student_bench(seed) for seed in range(500)]


def assert_fills(values, low, high, margin=0.02):
    room = margin * (high - low)
    assert low <= np.min(values) < low + room
    assert high - room < np.max(values) <= high


def test_natural_frequencies_fill_the_inside_of_the_sweep_evenly_on_a_logarithmic_scale(benches):
    omega_n = np.sqrt([bench.parameters.K_s / bench.parameters.J_l for bench in benches])
    assert_fills(np.log(omega_n), np.log(18.0), np.log(27.5))
    shares, _edges = np.histogram(np.log(omega_n), 4, (np.log(18.0), np.log(27.5)))
    assert shares.min() > 0.8 * len(benches) / 4
    assert omega_n.min() / HZ - 1.0 > 1.4 and omega_n.max() / HZ < 0.9 * 5.0


@given(st.integers(0, 1000), st.integers(1, 1000))
def test_another_run_changes_friction_and_the_boards_jitter_alone_and_is_the_same_every_time(seed, number):
    bench = student_bench(seed)
    run = bench.run(number)
    assert run == bench.run(number) != bench.run(number + 1)
    plant = run.parameters
    peak = (1 + plant.stribeck) * (1 + sum(height for _number, height, _phase in plant.gear))
    weaker, stronger = np.sort(plant.servo_friction) * peak
    assert 0.016 <= stronger <= 0.028 and stronger / 2 <= weaker <= stronger  # N·m, as the docstring has it
    friction = {name: getattr(bench.parameters, name) for name in ("servo_friction", "link_friction")}
    assert replace(plant, **friction) == bench.parameters
    assert replace(run.timing, seed=bench.timing.seed) == bench.timing
    assert run.joint == bench.joint


def test_between_runs_friction_differs_in_each_direction_by_itself():
    runs = np.array([student_bench(3).run(number).parameters.servo_friction for number in range(1, 200)])
    assert abs(np.corrcoef(runs.T)[0, 1]) < 0.7
    assert (runs.max(axis=0) / runs.min(axis=0) > 2).all()
    assert (runs[:, 0] > runs[:, 1]).mean() == pytest.approx(0.5, abs=0.1)


def test_another_run_of_a_bench_that_is_not_drawn_has_nearly_the_same_friction():
    first, second = (np.array(preset("real_bench").run(number).parameters.servo_friction) for number in (1, 2))
    assert (np.abs(second / first - 1) <= 0.2).all() and (second != first).all()


def test_run_1_is_the_bench_itself_and_what_no_bench_has_is_refused():
    bench = student_bench(5)
    assert bench.run(1) is bench
    for number in (0, -1, 1.0, True, "2"):
        with pytest.raises(ConfigurationError, match="run"):
            bench.run(number)
    with pytest.raises(ConfigurationError, match="1, 2, 3"):
        student_bench(1, arm_position=4)


@pytest.mark.parametrize("draw", [DRAW - 1, DRAW + 1])
def test_another_version_of_the_draw_is_refused(draw):
    with pytest.raises(ConfigurationError, match=rf"draw {draw} .* which knows {DRAW}\."):
        student_bench(7, draw=draw)


@pytest.mark.parametrize("position", [1, 2, 3])
def test_moving_the_arm_changes_its_inertia_alone(position):
    drawn, moved = student_bench(5), student_bench(5, arm_position=position)
    arm = replace(drawn.joint, arm_position=position, d_12=joint(position).d_12)
    assert moved == replace(drawn, joint=arm, parameters=replace(drawn.parameters, J_l=arm.J_l))


@given(st.text())
@example("  ada LOVELACE ")
def test_seeds_are_those_of_always_and_the_same_however_accents_are_put_together(student):
    composed, apart = (unicodedata.normalize(form, student) for form in ("NFC", "NFD"))
    always = hashlib.sha256(f"rotflex bench: {composed.strip().casefold()}".encode()).digest()
    assert student_seed(composed) == student_seed(apart) == int.from_bytes(always[:4], "big")


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
