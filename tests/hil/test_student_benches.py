"""Which virtual benches there are."""

from __future__ import annotations

import hashlib
import unicodedata
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.config import joint, srv02
from rotflex.courseware.student_id import caseless
from rotflex.errors import ConfigurationError
from rotflex.hil.student_benches import DRAW, PRESETS, preset, student_bench, student_seed
from rotflex.units import HZ

SEEDS = range(500)


@pytest.fixture(scope="module")
def benches():
    return [student_bench(seed) for seed in SEEDS]


def spread(values) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))


# The ranges are those of the docstring of student_bench.
@pytest.mark.parametrize(
    ("name", "low", "high"), [("K_s", 1.15, 1.65), ("B_eq", 0.004, 0.012), ("B_l", 0.0005, 0.0025)]
)
def test_parameters_fill_their_range(benches, name, low, high):
    least, most = spread([getattr(bench.parameters, name) for bench in benches])
    margin = 0.02 * (high - low)
    assert low <= least < low + margin
    assert high - margin < most <= high


def test_inertia_is_within_three_per_cent(benches):
    least, most = spread([bench.parameters.J_eq / srv02().J_eq for bench in benches])
    assert 0.97 <= least < 0.971
    assert 1.029 < most <= 1.03


@pytest.mark.parametrize(
    ("name", "low", "high", "asymmetry"),
    [("servo_friction", 0.006, 0.013, 0.3), ("link_friction", 0.0008, 0.0032, 0.2)],
)
def test_friction_is_asymmetric_either_way_about_a_mean(benches, name, low, high, asymmetry):
    plus, minus = np.array([getattr(bench.parameters, name) for bench in benches]).T
    mean, skew = (plus + minus) / 2, (plus - minus) / (plus + minus)
    assert low <= mean.min() < mean.max() <= high
    assert -asymmetry <= skew.min() < -0.9 * asymmetry
    assert 0.9 * asymmetry < skew.max() <= asymmetry


def test_the_arm_is_at_every_anchor(benches):
    positions = [bench.arm_position for bench in benches]
    assert set(positions) == {1, 2, 3}
    assert min(map(positions.count, (1, 2, 3))) > 120
    for bench in benches:
        assert bench.parameters.J_l == joint(bench.arm_position).J_l


def test_every_natural_frequency_is_well_inside_the_sweep(benches):
    least, most = spread([np.sqrt(bench.parameters.K_s / bench.parameters.J_l) / HZ for bench in benches])
    assert 2.0 < least < most < 4.5


def test_what_is_not_drawn_is_nominal(benches):
    servo = srv02()
    for bench in benches:
        assert bench.parameters.torque_per_volt == servo.torque_per_volt
        assert bench.parameters.back_emf == servo.K_g * servo.k_m
        assert (bench.parameters.V_max, bench.parameters.I_max) == (10.0, 4.16)
        assert bench.parameters.K_3 == 0.0


@given(st.integers(0, 2**40))
def test_a_seed_is_a_bench(seed):
    assert student_bench(seed) == student_bench(seed)


def test_different_seeds_are_different_benches(benches):
    assert len({bench.parameters for bench in benches}) == len(benches)
    assert len({bench.parameters.K_s for bench in benches}) == len(benches)


def test_a_bench_of_old_is_still_the_same():
    """Answers that were given on a bench stay right: no release, of this package or of numpy, may change the draw."""
    bench = student_bench(7)
    assert bench.arm_position == 3
    drawn = [bench.parameters.K_s, bench.parameters.J_eq, bench.parameters.B_l]
    np.testing.assert_allclose(drawn, [1.5986069004847876, 2.049815793042526e-3, 1.1003325698224508e-3], rtol=1e-9)


def test_the_first_draw_is_that_bench_and_another_version_is_told():
    assert DRAW == 1
    assert student_bench(7, draw=1) == student_bench(7)
    with pytest.raises(ConfigurationError, match=r"draw 2 .* which knows 1\. Install the release .* course\.json"):
        student_bench(7, draw=2)


@pytest.mark.parametrize("position", [1, 2, 3])
def test_moving_the_arm_changes_its_inertia_alone(position):
    drawn, moved = student_bench(5), student_bench(5, arm_position=position)
    assert moved.arm_position == position
    assert moved.parameters == replace(drawn.parameters, J_l=joint(position).J_l)


def test_there_are_three_anchors():
    with pytest.raises(ConfigurationError, match="allowed: 1, 2, 3"):
        student_bench(1, arm_position=4)


def test_a_students_seed_is_the_same_everywhere():
    assert (
        student_seed("Ada Lovelace") == 3071688176
    )  # the first four bytes of the SHA-256 of "rotflex bench: ada lovelace"
    assert student_seed("  ada LOVELACE ") == student_seed("Ada Lovelace")


@given(st.text(), st.text())
def test_seeds_have_32_bits_and_differ_between_students(one, other):
    assert 0 <= student_seed(one) < 2**32
    if caseless(one) != caseless(other):
        assert student_seed(one) != student_seed(other)


@given(st.text())
def test_seeds_are_those_of_always_and_the_same_however_accents_are_put_together(student):
    composed, apart = (unicodedata.normalize(form, student) for form in ("NFC", "NFD"))
    always = hashlib.sha256(f"rotflex bench: {composed.strip().casefold()}".encode()).digest()
    assert student_seed(composed) == student_seed(apart) == int.from_bytes(always[:4], "big")


def test_presets_are_named():
    assert preset("workbook").parameters.K_s == 1.4
    assert preset("workbook").parameters.servo_friction == (0.0, 0.0)
    with pytest.raises(ConfigurationError, match="'real_bench', 'workbook'"):
        preset("mars")
    assert set(PRESETS) == {"real_bench", "workbook"}


def test_the_real_bench_is_the_one_that_was_fitted():
    p = preset("real_bench").parameters
    assert (p.J_eq, p.J_l, p.K_s, p.B_eq, p.B_l) == (2.12e-3, 2.77e-3, 1.454, 0.0095, 0.0021)
    assert np.mean(p.servo_friction) == pytest.approx(0.0108)
    assert np.mean(p.link_friction) == pytest.approx(0.0032)
