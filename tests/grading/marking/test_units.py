"""Units read off labels, as students write them."""

import math

import pytest

from labcourse.grading.marking.units import TIME, units_in_label
from solutions.quantities import ANGLE, FREQUENCY, VOLTAGE

DEG, RATE = math.pi / 180, 1 / (2 * math.pi)


def sizes(label, quantity):
    return [unit.size for unit in units_in_label(label, quantity)]


@pytest.mark.parametrize(
    ("quantity", "label", "size"),
    [
        (TIME, "time (s)", 1),
        (TIME, "t / µs", 1e-6),
        (TIME, r"$t\ [\mathrm{s}]$", 1),
        (TIME, r"$t$ (\si{\milli\second})", 1e-3),
        (TIME, "time_ms", 1e-3),
        (TIME, "time in milliseconds", 1e-3),
        (TIME, "t (h)", 3600),
        (TIME, "t / d", 86_400),
        (TIME, "时间（s）", 1),
        (ANGLE, "α (°)", DEG),
        (ANGLE, r"$\alpha$ [$^\circ$]", DEG),
        (ANGLE, "deflection in degrees of arc", DEG),
        (ANGLE, "α (×10⁻³ rad)", 1e-3),
        (ANGLE, "α / 1e-3 rad", 1e-3),
        (ANGLE, "θ (0.001 rad)", 1e-3),
        (VOLTAGE, "theta (deg), voltage (V)", 1),
        (FREQUENCY, "f (1/s)", 1),
        (FREQUENCY, r"$\omega\ [\mathrm{rad\,s^{-1}}]$", RATE),
        (FREQUENCY, "ω (rad·s⁻¹)", RATE),
        (FREQUENCY, r"$\omega\ \left[\frac{\mathrm{rad}}{\mathrm{s}}\right]$", RATE),
        (FREQUENCY, "Kreisfrequenz in rad/s", RATE),
        (TIME, "time (samples)", None),
        (TIME, "ω (rad/s)", None),
        (ANGLE, "α (deg/s)", None),
        (ANGLE, "α (rad s^-1)", None),
        (ANGLE, "T (°C)", None),
        (TIME, "时间（秒）", None),
        (VOLTAGE, "angle (rad)", None),
        (VOLTAGE, "", None),
    ],
)
def test_a_label_names_a_unit_or_none_of_a_quantity(quantity, label, size):
    assert sizes(label, quantity) == ([pytest.approx(size)] if size else [])


def test_a_label_may_name_two_units():
    assert sizes("theta (deg), alpha (rad)", ANGLE) == [pytest.approx(DEG), 1]
    assert sizes("theta / deg, alpha / rad", ANGLE) == [pytest.approx(DEG), 1]


@pytest.mark.parametrize("quantity", [TIME, ANGLE, VOLTAGE, FREQUENCY])
def test_each_word_of_the_table_is_read(quantity):
    for unit in quantity.units:
        for word in (unit.symbols + " " + unit.names).split():
            assert sizes(f"x ({word})", quantity) == [unit.size], word
