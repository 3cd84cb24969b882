"""Figures for paper: drawn from numbers, told apart in grey, and always the same."""

import re

import numpy as np

from labcourse.report.drawing import draw


def axis(*lines, ylabel=r"speed $\mu$ (rad/s)", xlabel="time (s)", title=""):
    return {
        "title": title,
        "xlabel": xlabel,
        "ylabel": ylabel,
        "lines": [
            {"label": label, "n": len(x), "x": np.asarray(x, float), "y": np.asarray(y, float)} for label, x, y in lines
        ],
    }


T = np.linspace(0, 10, 200)
TWO = axis(("measured", T, np.sin(T)), ("model", T, np.cos(T)))


def test_curves_differ_in_dash_and_mark_as_well_as_in_colour():
    svg, _alt = draw([TWO])
    first, second = (
        re.findall(rf'<path d="[^"]*" clip-path="[^"]*" style="([^"]*stroke: {c}[^"]*)"', svg)
        for c in ("#000000", "#d55e00")
    )
    assert first and second
    assert "stroke-dasharray" not in first[0] and "stroke-dasharray" in second[0]
    assert svg.count('style="fill: #ffffff; stroke: #d55e00') > 5  # its marks


def test_a_drawing_is_always_the_same_without_fonts_and_described():
    svg, alt = draw([TWO, TWO])
    assert draw([TWO, TWO]) == (svg, alt)
    assert "<text" not in svg and "<dc:date>" not in svg
    assert alt.count("speed μ (rad/s)") == alt.count("0 to 10") == 2 and "-1 to 1" in alt


def test_odd_figures_are_drawn_all_the_same():
    for one in (
        axis(("$\\nonsense{", T, T), ylabel="$x_{$ (m)", title="50 $"),
        axis(("", [1.0], [1.0])),
        axis(("", [], []), ("b", T, T)),
        axis(("", T, 1e308 * np.ones(200))),
        axis(("mark", [2.0, 2.0], [0.0, 1.0]), ("a", T, 0 * T)),
    ):
        svg, alt = draw([one])
        assert "<svg" in svg and alt


def test_a_logarithmic_axis_stays_one():
    f = np.logspace(-1, 2, 100)
    linear = axis(("", np.linspace(0.1, 100, 100), 1 / f))
    drawings = [axis(("", f, 1 / f)), linear | {"scales": ["log", "linear"]}, linear]
    ticks = [len(re.findall(r'id="xtick_\d+"', draw([one])[0])) for one in drawings]
    assert ticks[0] == ticks[1] > ticks[2]


def test_a_unit_goes_to_a_line_of_its_own_where_its_axis_is_short():
    long = axis(("", T, T), ylabel="the angle of the servo (rad)")
    three, one = draw([long] * 3)[0], draw([long])[0]
    assert "<!-- the angle of the servo (rad) -->" in one and "<!-- the angle of the servo (rad) -->" not in three
    assert "<!-- the angle of the servo" in three
