"""A student's figure from its curves: where the points come to lie, and what is not drawn."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.grading.reports.drawn_figure import drawn


def diagram(*curves, title="", xlabel="time (s)", ylabel="angle (deg)"):
    lines = [{"label": label, "n": len(x), "x": np.array(x, float), "y": np.array(y, float)} for label, x, y in curves]
    return {"title": title, "xlabel": xlabel, "ylabel": ylabel, "lines": lines}


def pictures(*axes):
    root = ElementTree.fromstring(f"<div>{drawn(axes)}</div>")
    return [svg for svg in root.iter("svg") if svg.get("class") == "drawn"]


def curves(svg):
    paths = [path.get("d") for path in svg.iter("path") if "curve" in path.get("class")]
    return [
        [tuple(int(number) / 10 for number in point.split()) for point in re.split("[ML]", path)[1:]] for path in paths
    ]


def words(svg):
    return ["".join(text.itertext()) for text in svg.iter("text")]


def test_a_curve_goes_where_its_numbers_are():
    (svg,) = pictures(diagram(("a", [0, 5, 10], [-1, 0, 1])))
    ((first, middle, last),) = curves(svg)
    assert first[0] < middle[0] < last[0] and first[1] > middle[1] > last[1]  # down is more, on a page
    assert middle == pytest.approx(((first[0] + last[0]) / 2, (first[1] + last[1]) / 2), abs=0.1)
    assert {"0", "2", "10", "-1", "1", "time (s)", "angle (deg)"} <= set(words(svg))


def test_several_curves_differ_in_more_than_colour_and_are_named():
    axis = diagram(("measured", [0, 1], [0, 1]), ("", [0, 1], [1, 0]))
    text = str(drawn([axis]))
    assert 'class="curve look0"' in text and 'class="curve look1"' in text
    assert "measured</li>" in text and "no label</li>" in text


def test_the_description_says_what_is_to_be_seen():
    (svg,) = pictures(diagram(("measured", [0, 10], [-3, 4.5]), ("", [0, 3], [2, 4])))
    assert svg.get("role") == "img"
    said = svg.get("aria-label")
    assert "angle (deg)" in said and "time (s)" in said and "measured (" in said
    assert re.findall(r"from (\S+) to ([\d.]*\d)", said) == [("0", "10"), ("-3", "4.5"), ("2", "4")]


def test_formulas_in_labels_are_made_readable():
    (svg,) = pictures(
        diagram(("a", [0, 1], [0, 1]), xlabel=r"$\omega_n t$ / s", ylabel=r"$|\mathrm{\alpha}|$ in $^\circ$")
    )
    assert words(svg)[-2:] == ["ω_n t / s", "|α| in °"]


@pytest.mark.parametrize(
    "curve",
    [("a", [0, 1], [-1.7e308, 1.7e308]), ("a", [0, 1.7e308], [0, 1]), ("a", [], [])],
    ids=["too large", "too far", "empty"],
)
def test_what_cannot_be_drawn_is_said(curve):
    assert "cannot be drawn" in drawn([diagram(curve)])


number = st.floats(-1e299, 1e299, allow_nan=False)


@given(st.lists(st.tuples(number, number), min_size=1, max_size=40), st.text(max_size=20))
def test_any_numbers_and_labels_give_a_picture_of_finite_points(points, label):
    x, y = zip(*points, strict=True)
    axis = diagram((label, x, y), title=label, xlabel=label, ylabel=label)
    text = str(drawn([axis]))
    assert "nan" not in re.sub(r">[^<]*<|aria-label=\"[^\"]*\"", "", text) and "inf" not in re.sub(
        r">[^<]*<|aria-label=\"[^\"]*\"", "", text
    )
    assert len(text) < 20_000


@pytest.mark.parametrize("value", [0.0, 5.0, -3e-9, 1e200])
def test_a_flat_line_and_a_single_point_are_drawn(value):
    (flat, dot) = pictures(diagram(("a", [0, 1], [value, value])), diagram(("a", [value], [value])))
    ((start, end),) = curves(flat)
    assert start[1] == end[1]
    assert any("curve" in path.get("class") for path in dot.iter("path"))
