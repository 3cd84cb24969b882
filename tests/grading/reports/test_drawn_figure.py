"""A student's figure from its curves: axes, where points come to lie, and what is not drawn."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.grading.reports.drawn_figure import BOTTOM, LEFT, RIGHT, TOP, Axis, curve, drawn, make_axis


@pytest.mark.parametrize(
    ("low", "high", "logarithmic", "numbers"),
    [
        (0.0, 6.0, False, range(7)),
        (0.0, 15.0, False, [0, 2.5, 5, 7.5, 10, 12.5, 15]),
        (0.3, 5.9, False, range(1, 6)),
        (0.0, 0.006, False, [0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006]),
        (0.0, 3.0, True, [1, 10, 100, 1000]),
        (0.3, 0.9, True, []),
    ],
)
def test_the_numbers_on_an_axis_are_round_or_powers_of_ten_and_within_it(low, high, logarithmic, numbers):
    texts = [text for _at, text in Axis(low, high, 0, 100, logarithmic).ticks()]
    assert texts == [f"{number:g}" for number in numbers]


@pytest.mark.parametrize(
    ("lines", "margin", "low", "high"),
    [
        ([[0.0, 15.0]], 0.0, 0.0, 15.0),
        ([[0.0, 10.0]], 0.05, -0.5, 10.5),
        ([[4.0, 4.0]], 0.0, 2.0, 6.0),
        ([[0.0, 0.0]], 0.05, -1.0, 1.0),
        ([[1.0, 2.0], [-3.0, 0.0], [7.0]], 0.0, -3.0, 7.0),
    ],
)
def test_an_axis_holds_all_values_with_a_margin(lines, margin, low, high):
    found = make_axis(list(map(np.array, lines)), 5, 50, margin)
    assert (found.low, found.high) == pytest.approx((low, high)) and (found.start, found.end) == (5, 50)


EVEN = np.geomspace(1.0, 10.0, 5)


@pytest.mark.parametrize(
    ("lines", "even"),
    [
        ([EVEN], True),
        ([EVEN[::-1]], False),
        ([EVEN[:4]], False),
        ([EVEN * np.array([1.0, 1.2, 1.0, 1.0, 1.0])], False),
        ([EVEN * np.array([1.0, 1.05, 1.0, 1.0, 1.0])], True),
        ([np.array([1.0, 5.0]), EVEN], True),  # the longest curve decides
    ],
)
def test_a_logarithmic_axis_has_points_that_stand_evenly_over_a_decade(lines, even):
    assert make_axis(lines, 0, 1, may_be_logarithmic=True).logarithmic == even
    assert not make_axis(lines, 0, 1).logarithmic


def test_a_curve_is_a_line_through_its_points_in_tenths_and_a_point_a_cross():
    x, y = Axis(0.0, 10.0, 0.0, 100.0), Axis(0.0, 1.0, 100.0, 0.0)
    line = {"x": np.array([0.0, 5.0, 10.0]), "y": np.array([0.0, 1.0, 0.25])}
    assert curve(line, x, y) == "M0 1000L500 0L1000 750"
    assert curve({"x": np.array([5.0]), "y": np.array([0.5])}, x, y) == "M460 500h80M500 460v80"
    assert curve({**line, "x": np.array([1.0, 10.0, 100.0])}, Axis(0, 2, 0, 10, True), y) == "M0 1000L50 0L100 750"


def diagram(*curves, title="", xlabel="time (s)", ylabel="angle (deg)"):
    lines = [{"label": label, "x": np.array(x, float), "y": np.array(y, float)} for label, x, y in curves]
    return {"title": title, "xlabel": xlabel, "ylabel": ylabel, "lines": lines}


def parsed(*axes):
    return ElementTree.fromstring(f"<div>{drawn(axes)}</div>")


def test_numbers_and_labels_stand_beside_the_plot():
    (svg,) = parsed(diagram(("", [0.0, 6.0], [0.0, 10.0])))
    below, beside = ([one for one in svg.iter("text") if one.get("text-anchor") == end] for end in ("middle", "end"))
    assert [one.text for one in below] == [*map(str, range(7)), "time (s)", "angle (deg)"]
    assert [one.text for one in sorted(beside, key=lambda one: float(one.get("y")))] == ["10", "8", "6", "4", "2", "0"]
    _grid, line = (path.get("d") for path in svg.iter("path"))
    assert line.startswith(f"M{10 * LEFT} ") and f"L{10 * RIGHT} " in line
    assert all(10 * TOP < int(down) < 10 * BOTTOM for down in re.findall(r" (\d+)", line))


def test_the_description_says_what_is_to_be_seen():
    (svg,) = parsed(diagram(("measured", [0, 10], [-3, 4.5]), ("", [0, 3], [2, 4])))[:1]
    assert svg.get("role") == "img"
    text = svg.get("aria-label")
    assert "angle (deg)" in text and "time (s)" in text and "measured (" in text
    assert re.findall(r"from (\S+) to ([\d.]*\d)", text) == [("0", "10"), ("-3", "4.5"), ("2", "4")]


def test_several_diagrams_are_numbered_with_or_without_a_title():
    drawings = [diagram(("", [0, 1], [0, 1]), title=title) for title in ("A", "")]
    assert [heading.text for heading in parsed(*drawings).iter("p")] == ["Diagram 1: A", "Diagram 2"]
    assert [heading.text for heading in parsed(drawings[0]).iter("p")] == ["A"]


@pytest.mark.parametrize("line", [("a", [0, 1], [-1.7e308, 1.7e308]), ("a", [0, 1.1e300], [0, 1]), ("a", [], [])])
def test_a_figure_that_cannot_be_drawn_says_so(line):
    assert "cannot be drawn" in drawn([diagram(line)])


number = st.floats(-1e299, 1e299, allow_nan=False)


@given(st.lists(st.tuples(number, number), min_size=1, max_size=40), st.text(max_size=20))
def test_any_numbers_and_labels_give_a_picture_of_finite_points(points, label):
    x, y = zip(*points, strict=True)
    text = str(drawn([diagram((label, x, y), title=label, xlabel=label, ylabel=label)]))
    bare = re.sub(r">[^<]*<|aria-label=\"[^\"]*\"", "", text)
    assert "nan" not in bare and "inf" not in bare and len(text) < 20_000
