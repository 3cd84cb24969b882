"""Where things stand in a figure that is drawn anew: the numbers of its axes, margins, marks and words."""

import re

import numpy as np
import pytest

from labcourse.answers.labels import evenly_logarithmic
from labcourse.grading.reports import drawn_figure
from labcourse.grading.reports.drawn_figure import _Axis, _axis, _path, _round_step, drawn

PLOT = {"left": 76, "right": 708, "top": 10, "bottom": 224}  # of a page of 720 by 270


@pytest.mark.parametrize(
    ("low", "high", "logarithmic", "numbers"),
    [
        (0.0, 6.0, False, range(7)),
        (0.0, 15.0, False, [0, 2.5, 5, 7.5, 10, 12.5, 15]),
        (-1.0, 1.0, False, [-1, -0.5, 0, 0.5, 1]),
        (0.3, 5.9, False, range(1, 6)),
        (0.0, 0.006, False, [0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006]),
        (1000.0, 7000.0, False, range(1000, 8000, 1000)),
        (-7.0, -1.0, False, range(-7, 0)),
        (1.0, 1000.0, True, [1, 10, 100, 1000]),
        (0.5, 50.0, True, [1, 10]),
        (0.1, 1.0, True, [0.1, 1]),
        (2, 9, True, []),
    ],
)
def test_the_numbers_on_an_axis_are_round_or_powers_of_ten_and_within_it(low, high, logarithmic, numbers):
    words = [word for _at, word in _Axis(low, high, 0, 100, logarithmic).ticks()]
    assert words == [f"{number:g}" for number in numbers]


def test_values_stand_by_their_share_between_the_ends():
    assert _Axis(10.0, 20.0, 100.0, 300.0).at(np.array([10.0, 12.5, 20.0])).tolist() == [100.0, 150.0, 300.0]
    assert _Axis(10.0, 20.0, 300.0, 100.0).at(np.array([10.0, 12.5])).tolist() == [300.0, 250.0]
    assert _Axis(1.0, 100.0, 0.0, 10.0, True).at(np.array([1.0, 10.0, 100.0])) == pytest.approx([0, 5, 10])


@pytest.mark.parametrize(
    ("step", "rounded"),
    [(1, 1), (1.01, 2), (2, 2), (2.1, 2.5), (2.6, 5), (5.1, 10), (9.9, 10), (0.03, 0.05), (170, 200), (1e-7, 1e-7)],
)
def test_a_step_is_rounded_up(step, rounded):
    assert _round_step(step) == pytest.approx(rounded)


@pytest.mark.parametrize(
    ("name", "values", "low", "high"),
    [
        ("x", [0.0, 15.0], 0.0, 15.0),
        ("y", [0.0, 10.0], -0.5, 10.5),
        ("y", [-4.0, 4.0], -4.4, 4.4),
        ("x", [4.0, 4.0], 2.0, 6.0),
        ("y", [-4.0, -4.0], -6.0, -2.0),
        ("y", [0.0, 0.0], -1.0, 1.0),
        ("x", [3.0], 1.5, 4.5),
    ],
)
def test_an_axis_holds_all_values_with_a_margin_above_and_below(name, values, low, high):
    found = _axis([np.array(values)], name)
    assert (found.low, found.high) == pytest.approx((low, high)) and not found.logarithmic
    ends = (PLOT["left"], PLOT["right"]) if name == "x" else (PLOT["bottom"], PLOT["top"])
    assert (found.start, found.end) == ends


def test_an_axis_holds_the_values_of_several_curves():
    found = _axis([np.array([1.0, 2.0]), np.array([-3.0, 0.0]), np.array([7.0])], "x")
    assert (found.low, found.high) == (-3.0, 7.0)


@pytest.mark.parametrize(("largest", "drawn_"), [(9.9e299, True), (1.1e300, False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_axis_goes_as_far_as_differences_are_finite(largest, drawn_, sign):
    assert (_axis([np.array([0.0, sign * largest])], "y") is not None) == drawn_
    assert _axis([], "x") is None


EVEN = np.geomspace(1.0, 10.0, 5)


@pytest.mark.parametrize(
    ("values", "even"),
    [
        (EVEN, True),
        (EVEN[::-1], False),
        (EVEN[:4], False),
        (np.geomspace(1.0, 9.99, 5), False),
        (np.geomspace(1.0, 1000.0, 5), True),
        (EVEN - 1.0, False),
        (np.linspace(1.0, 100.0, 50), False),
        (EVEN * np.array([1.0, 1.2, 1.0, 1.0, 1.0]), False),
        (EVEN * np.array([1.0, 1.05, 1.0, 1.0, 1.0]), True),
    ],
)
def test_a_logarithmic_axis_is_one_whose_points_stand_evenly_over_a_decade(values, even):
    assert evenly_logarithmic(values) == even
    if values.min() > 0:
        assert _axis([values], "x").logarithmic == even
        assert not _axis([values], "y").logarithmic


def test_of_several_curves_the_longest_says_whether_an_axis_is_logarithmic():
    assert _axis([np.array([1.0, 5.0]), EVEN], "x").logarithmic
    assert not _axis([np.linspace(1, 10, 6), EVEN], "x").logarithmic


def test_a_curve_is_a_line_through_its_points_in_tenths_and_a_point_a_cross():
    x, y = _Axis(0.0, 10.0, 0.0, 100.0), _Axis(0.0, 1.0, 100.0, 0.0)
    line = {"x": np.array([0.0, 5.0, 10.0]), "y": np.array([0.0, 1.0, 0.25])}
    assert _path(line, x, y) == "M0 1000L500 0L1000 750"
    assert _path({"x": np.array([5.0]), "y": np.array([0.5])}, x, y) == "M460 500h80M500 460v80"


def axis(*lines, **labels):
    texts = {"title": "", "xlabel": "time (s)", "ylabel": "angle (deg)"} | labels
    return {**texts, "lines": [{"x": np.array(x), "y": np.array(y), "label": label} for x, y, label in lines]}


def test_numbers_and_labels_stand_beside_the_plot():
    page = str(drawn([axis(([0.0, 6.0], [0.0, 10.0], ""))]))
    assert 'viewBox="0 0 720 270"' in page
    texts = re.findall(r'<text x="(-?\d+)" y="(-?\d+)" text-anchor="(\w+)">([^<]*)</text>', page)
    assert texts[:2] == [("76", "242", "middle", "0"), ("181", "242", "middle", "1")]
    beside = [(x, anchor, word) for x, _y, anchor, word in texts if anchor == "end"]
    assert [word for _x, _anchor, word in beside] == ["0", "2", "4", "6", "8", "10"] and {x for x, *_ in beside} == {
        "68"
    }
    assert texts[-1] == ("392", "262", "middle", "time (s)")
    assert '<text transform="translate(14 117.0) rotate(-90)" text-anchor="middle">angle (deg)</text>' in page
    grid = re.search(r'class="grid" d="([^"]*)"', page)[1]
    assert grid.startswith("M76 224V10M181 224V10") and "H708" in grid


def test_curves_take_their_looks_in_turn_and_each_has_its_own_up_to_six():
    lines = [([0.0, 1.0], [0.0, float(place)], f"curve {place}") for place in range(8)]
    page = str(drawn([axis(*lines)]))
    assert re.findall(r'class="curve look(\d)" d="M7', page) == list("01234501")
    assert re.findall(r'look(\d)" d="M0 4H40"/></svg> (curve \d)', page)[6:] == [("0", "curve 6"), ("1", "curve 7")]
    assert drawn_figure._LOOKS == 6


@pytest.mark.parametrize("number", [1, 2, 3])
def test_diagrams_are_numbered_where_there_are_several_with_or_without_a_title(number):
    page = str(drawn([axis(([0.0, 1.0], [0.0, 1.0], ""), title=title) for title in ("A", "", "B")[:number]]))
    expected = ["A"] if number == 1 else ["Diagram 1: A", "Diagram 2", "Diagram 3: B"][:number]
    assert re.findall(r"<p>([^<]*)</p>", page) == expected
