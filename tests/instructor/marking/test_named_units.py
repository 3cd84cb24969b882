"""Units read off labels, as students write them."""

from __future__ import annotations

import math

import pytest

from rotflex.instructor.marking.named_units import named
from rotflex.instructor.marking.unit_words import ANGLE, FREQUENCY, TIME, VOLTAGE, Unit

DEG, RATE = math.pi / 180, 1 / (2 * math.pi)


def sizes(label, quantity):
    return [unit.size for unit in named(label, quantity)]


@pytest.mark.parametrize(
    ("label", "size"),
    [
        ("time (s)", 1),
        ("Time [ms]", 1e-3),
        ("t / µs", 1e-6),
        (r"$t\ [\mathrm{s}]$", 1),
        (r"$t$ (\si{\milli\second})", 1e-3),
        ("t (min)", 60),
        ("time (s, from the start)", 1),
        ("time in seconds", 1),
        ("seconds", 1),
        ("time_ms", 1e-3),
        ("time in milliseconds", 1e-3),
        ("čas [ms]", 1e-3),
        ("时间（s）", 1),
    ],
)
def test_a_label_names_a_unit_of_time(label, size):
    assert sizes(label, TIME) == [pytest.approx(size)]


@pytest.mark.parametrize(
    ("label", "size"),
    [
        ("α (°)", DEG),
        (r"$\alpha$ [$^\circ$]", DEG),
        ("deflection in degrees of arc", DEG),
        ("Winkel °", DEG),
        ("theta_deg", DEG),
        ("α (rad)", 1),
        ("α (mrad)", 1e-3),
        (r"$\alpha$ ($10^{-3}$ rad)", 1e-3),
        ("α (×10⁻³ rad)", 1e-3),
        ("α / 1e-3 rad", 1e-3),
        ("θ (0.001 rad)", 1e-3),
        ("θ (turns)", 2 * math.pi),
    ],
)
def test_a_label_names_a_unit_of_angle(label, size):
    assert sizes(label, ANGLE) == [pytest.approx(size)]


@pytest.mark.parametrize(("label", "size"), [("V_m (V)", 1), ("voltage in mV", 1e-3), ("theta (deg), voltage (V)", 1)])
def test_a_label_names_a_unit_of_voltage(label, size):
    assert sizes(label, VOLTAGE) == [pytest.approx(size)]


@pytest.mark.parametrize(
    ("label", "size"),
    [
        ("f (Hz)", 1),
        ("f in Hz (FFT)", 1),
        ("f (1/s)", 1),
        ("f [kHz]", 1e3),
        ("f (mHz)", 1e-3),
        ("ω (rad/s)", RATE),
        ("ω / rad/s", RATE),
        (r"$\omega\ [\mathrm{rad\,s^{-1}}]$", RATE),
        ("ω (rad·s⁻¹)", RATE),
        (r"$\omega\ \left[\frac{\mathrm{rad}}{\mathrm{s}}\right]$", RATE),
        ("Kreisfrequenz in rad/s", RATE),
        ("speed (rev/min)", 1 / 60),
        ("frequency in cycles per second", 1),
    ],
)
def test_a_label_names_a_unit_of_frequency(label, size):
    assert sizes(label, FREQUENCY) == [pytest.approx(size)]


@pytest.mark.parametrize(
    ("label", "quantity"),
    [
        ("time", TIME),
        ("the sweep's time", TIME),
        ("time (samples)", TIME),
        ("sample [n]", TIME),
        ("ω (rad/s)", TIME),
        ("t_s", TIME),
        ("time (m)", TIME),
        ("α (deg/s)", ANGLE),
        ("α (rad s^-1)", ANGLE),
        ("speed in degrees per second", ANGLE),
        ("T (°C)", ANGLE),
        ("Winkel / Grad", ANGLE),
        ("时间（秒）", TIME),
        ("α (10^-3)", ANGLE),
        ("frequency", FREQUENCY),
        ("angle (rad)", VOLTAGE),
        ("", VOLTAGE),
    ],
)
def test_a_label_may_name_no_unit_of_a_quantity(label, quantity):
    assert named(label, quantity) == ()


def test_a_label_may_name_two_units():
    assert sizes("theta (deg), alpha (rad)", ANGLE) == [pytest.approx(DEG), 1]
    assert sizes("theta / deg, alpha / rad", ANGLE) == [pytest.approx(DEG), 1]


@pytest.mark.parametrize("quantity", [TIME, ANGLE, VOLTAGE, FREQUENCY])
def test_each_word_of_the_table_is_read(quantity):
    """As labels are: composed, and in small letters."""
    for unit in quantity.units:
        assert isinstance(unit, Unit)
        for word in (unit.symbols + " " + unit.names).split():
            assert sizes(f"x ({word})", quantity) == [unit.size], word
