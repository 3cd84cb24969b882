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
from rotflex.hil.student_benches import DRAW, student_bench, student_seed
from rotflex.recording import Recording
from rotflex.units import HZ

#: Draw → the numbers of 100 benches, on average, each bench weighed by its seed + 1.
DRAWN = {
    1: (
        "2.14376238 0.064 0.29845 0.03 0.155575 0.128453321 2.6 0.537434412 0.00208555512 0.00368089674 1.4216953 "
        "0.00779181579 0.00149700589 0.00941477614 0.00952490389 0.00196931264 0.00200509242 1 0 0 0 0 0 "
    ),
    2: (
        "1.87148515 0.0640369505 0.298672673 0.0298670495 0.155339307 0.129330316 2.58518158 0.536549442 "
        "0.00208260946 0.00358132908 1.88114731 0.00797350413 0.00173853467 0.00888962287 0.00944379904 "
        "5.04435745e-05 5.04435745e-05 1 0.000991040633 0.00025 0.001 0.002 0.500938228 "
    ),
    3: (
        "2.02950495 0.0642275446 0.298004356 0.0298267723 0.155439703 0.129650969 2.61635904 0.539150654 "
        "0.00208944285 0.00363441612 1.90892038 0.00787947065 0.00182933307 0.00971049987 0.00903667094 "
        "5.59462661e-05 5.59462661e-05 1.19659423 5 0.138272972 2.95042688 70 0.161727028 2.81885338 0.00225375708 "
        "0.00025 0.001 0.002 0.48928649 "
    ),
}


def numbers(bench):
    arm, plant, timing = bench.joint, bench.parameters, bench.timing
    motor = [plant.torque_per_volt, plant.resistance, plant.back_emf, plant.J_eq, plant.J_l, plant.K_s]
    friction = [plant.B_eq, plant.B_l, *plant.servo_friction, *plant.link_friction, plant.breakaway]
    gear = [value for wave in plant.gear for value in wave]
    late = [timing.delay, timing.jitter, timing.late, timing.late_by, timing.seed / 2**32]
    return [arm.arm_position, arm.m_1, arm.L_1, arm.m_2, arm.L_2, *motor, *friction, *gear, *late]


@pytest.mark.parametrize("draw", DRAWN)
def test_benches_of_old_are_still_the_same(draw):
    """Answers that were given on a bench stay right: no release, of this package or of numpy, may change the draw."""
    values = [numbers(student_bench(seed, draw=draw)) for seed in range(100)]
    averages = np.average(values, axis=0, weights=np.arange(1, 101))
    np.testing.assert_allclose(averages, np.array(DRAWN[draw].split(), dtype=float), rtol=1e-8)


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


def test_run_1_is_the_bench_itself_and_what_no_bench_has_is_refused():
    bench = student_bench(5)
    assert bench.run(1) is bench
    for number in (0, -1, 1.0, True, "2"):
        with pytest.raises(ConfigurationError, match="run"):
            bench.run(number)
    with pytest.raises(ConfigurationError, match="1, 2, 3"):
        student_bench(1, arm_position=4)


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
