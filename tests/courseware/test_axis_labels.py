"""Labels of axes, out of TeX, and where on them a unit may stand."""

from __future__ import annotations

import pytest

from rotflex.courseware.kinds.axis_labels import plain, unit_places


@pytest.mark.parametrize(
    ("label", "expected"),
    [
        ("Time (s)", "time (s)"),
        (r"$t\ [\mathrm{ms}]$", "t [ms]"),
        (r"$\alpha$ / $^{\circ}$", "alpha / °"),
        (r"$\theta\,/\,\text{rad}$", "theta / rad"),
        ("θ （º）", "θ (°)"),
        ("角度【度】", "角度(度)"),
        (r"$10^{-3}$ rad", "10^-3 rad"),
        ("×10⁻³ rad", "×10^-3 rad"),
        (r"$\frac{t}{\mathrm{s}}$", "t/s"),
        (r"\unit{\milli\second}", "(millisecond)"),
        (r"$t$ in $\mu$ s", "t in μs"),
        ("\u200fالزمن\u200f (ث)", "الزمن (ث)"),
    ],
)
def test_a_label_is_read_without_tex_and_in_small_letters(label, expected):
    assert plain(label) == expected


@pytest.mark.parametrize(
    ("label", "place"),
    [
        ("time (s)", "s"),
        ("time [s]", "s"),
        ("time {s}", "s"),
        ("time <s>", "s"),
        ("時間（秒）", "秒"),
        ("time, s", "s"),
        ("time: s", "s"),
        ("time - s", "s"),
        ("t/s", "s"),
        ("ω / rad/s", "rad/s"),
        ("time in s", "s"),
        ("tiempo en s", "s"),
        ("czas w s", "s"),
        ("время в с", "с"),
        ("angle (theta, in °)", "°"),
        ("angle (deg, unwrapped)", "deg"),
        ("theta / deg, alpha / rad", "rad"),
        ("time (s", "s"),
    ],
)
def test_a_unit_may_stand_in_many_places(label, place):
    assert place in unit_places(label)


@pytest.mark.parametrize("label", ["", "time", "the sweep's time", "integral", "t_s", "( )", "$$", "\\", "{"])
def test_a_label_may_have_no_place_for_a_unit(label):
    assert unit_places(label) == []


@pytest.mark.parametrize("piece", ["in ", "(", ",", "\\frac{", "a.", "x^-1 ", "\\mathrm{", "[(<", "$\\", "_{", "10^9"])
def test_a_label_made_to_be_slow_has_few_places(piece):
    assert len(unit_places(piece * (200 // len(piece)))) <= 16
