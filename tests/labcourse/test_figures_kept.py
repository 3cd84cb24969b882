"""What is kept of a figure: what is seen of it. And where on its labels a unit may stand."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

from labcourse.answers import forms
from labcourse.answers.figures import unit_places
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError

FIGURE = Part("figure", "figure", 1, "A figure.")
T = np.linspace(0, 15, 7501)


def kept(figure):
    """A figure as it is read back from a file, and the hints that its owner was given."""
    encoded = forms.encode(FIGURE, figure, 1)
    return forms.decode(FIGURE, json.loads(json.dumps(encoded.content)))["axes"], encoded.hints


def plotted(*args, **looks):
    figure = Figure()
    ax = figure.subplots()
    ax.plot(*args, **looks)
    ax.set(xlabel="time (s)", ylabel="x (deg)")
    return figure, ax


def test_of_a_curve_that_goes_on_beyond_the_limits_what_is_within_is_kept():
    figure, ax = plotted(T, np.sin(T))
    ax.set_xlim(4, 6)
    ((diagram,), _hints) = kept(figure)
    (line,) = diagram["lines"]
    assert (line["x"][0], line["x"][-1], line["x"].size, line["n"]) == (4, 6, 200, 1001)


def test_only_what_is_within_the_limits_is_seen():
    figure, ax = plotted(T, np.sin(T))
    ax.set(ylim=(0.5, 0), xlim=(15, 0))  # turned limits are limits
    y = kept(figure)[0][0]["lines"][0]["y"]
    assert y.min() >= 0 and y.max() <= 0.5
    figure, ax = plotted(0.1 * np.arange(31), np.arange(31))
    ax.set(xlim=(0, 0.3 * 10), ylim=(0, 30))
    assert kept(figure)[0][0]["lines"][0]["n"] == 31  # points on the limits are seen
    figure, ax = plotted(T, np.exp(T))
    ax.set_xscale("log")
    assert kept(figure)[0][0]["lines"][0]["x"][0] == 0.002  # zero is not
    figure, ax = plotted(T, np.sin(T))
    ax.axvline(5)
    ax.set_xlim(4, 6)
    assert kept(figure)[0][0]["lines"][1]["x"].tolist() == [5, 5]  # marks across the diagram stay
    ax.set_xlim(20, 30)
    ax.lines[1].remove()
    with pytest.raises(AnswerError, match="limits"):
        forms.encode(FIGURE, figure, 1)


def test_what_was_made_invisible_is_not_kept():
    figure, ax = plotted(T, np.sin(T))
    ax.plot(T, np.cos(T), visible=False)
    figure.add_subplot().plot(T, T)
    figure.axes[1].set_visible(False)
    ((diagram,), _hints) = kept(figure)
    assert len(diagram["lines"]) == 1


def test_points_and_steps_are_curves_too():
    figure = Figure()
    ax = figure.subplots()
    ax.scatter([0, 1, 2, 3], [1, 5, 2, 4], label="points")
    ax.stairs([1, 2, 3], [0, 1, 2, 3], label="steps")
    ((diagram,), _hints) = kept(figure)
    points, steps = sorted(diagram["lines"], key=lambda line: line["label"])
    assert (points["x"].tolist(), points["y"].tolist()) == ([0, 1, 2, 3], [1, 5, 2, 4])
    assert (steps["x"].tolist(), steps["y"].tolist()) == ([0.5, 1.5, 2.5], [1, 2, 3])


def test_of_very_many_curves_those_with_most_points_are_kept_and_it_is_said():
    figure, ax = plotted(T, np.sin(T))
    for place in range(40):
        ax.plot([0, 15], [place, place])
    ax.plot(T, np.cos(T))
    ((diagram,), hints) = kept(figure)
    sizes = [line["n"] for line in diagram["lines"]]
    assert (len(sizes), sizes[0], sizes[-1]) == (24, 7501, 7501)
    assert any("42 curves" in hint for hint in hints)


def diagrams(**how):
    figure = Figure()
    axes = figure.subplots(2, 1, **how)
    for ax in axes:
        ax.plot(T, np.sin(T))
        ax.set_ylabel("x (deg)")
    return figure, axes


def test_the_lowest_label_is_for_those_above_with_the_same_limits():
    figure, axes = diagrams()
    axes[1].set_xlabel("time (s)")
    assert [axis["xlabel"] for axis in kept(figure)[0]] == ["time (s)", "time (s)"]
    axes[0].set_xlim(0, 5)
    assert [axis["xlabel"] for axis in kept(figure)[0]] == ["", "time (s)"]


def test_labels_of_the_whole_figure_and_of_twin_axes_are_shared_and_units_are_known():
    figure, axes = diagrams()
    axes[1].set_ylabel("")
    figure.supxlabel("t / s")
    figure.supylabel("y / V")
    assert [(one["xlabel"], one["ylabel"]) for one in kept(figure)[0]] == [("t / s", "x (deg)"), ("t / s", "y / V")]
    figure, ax = plotted(T, np.sin(T))
    for label in ("Time, s", "время в с", "時間（秒）", "time {s}", r"$t\,/\,\mathrm{s}$"):
        ax.set_xlabel(label)
        assert kept(figure)[1] == ()
    ax.set_xlabel("time (s)")
    other = ax.twinx()
    other.plot(T, T)
    other.set_ylabel("voltage (V)")
    labels = [(one["xlabel"], one["ylabel"]) for one in kept(figure)[0]]
    assert labels == [("time (s)", "x (deg)"), ("time (s)", "voltage (V)")]


def test_what_was_kept_before_limits_counted_is_read_as_it_was():
    line = {"label": "", "n": 3, "x": [0, 1, 2], "y": [1, 2, 3]}
    old = {"kind": "figure", "axes": [{"title": "", "xlabel": "", "ylabel": "", "lines": [line]}]}
    assert forms.decode(FIGURE, old)["axes"][0]["lines"][0]["x"].tolist() == [0, 1, 2]


def test_a_unit_may_stand_in_many_places():
    seconds = ["time (s)", "time [s]", "time {s}", "time <s>", "time, s", "time: s", "time - s", "t/s", "time in s"]
    places = dict.fromkeys([*seconds, "tiempo en s", "czas w s", "time (s"], "s")
    places |= {"時間（秒）": "秒", "ω / rad/s": "rad/s", "время в с": "с", "angle (theta, in °)": "°"}
    places |= {"angle (deg, unwrapped)": "deg", "theta / deg, alpha / rad": "rad"}
    assert [label for label, place in places.items() if place not in unit_places(label)] == []


def test_a_label_may_have_no_place_for_a_unit():
    for label in ("", "time", "the sweep's time", "integral", "t_s", "( )", "$$", "\\", "{"):
        assert unit_places(label) == []


def test_a_label_made_to_be_slow_has_few_places():
    for piece in ("in ", "(", ",", "\\frac{", "a.", "x^-1 ", "\\mathrm{", "[(<", "$\\", "_{", "10^9"):
        assert len(unit_places(piece * (200 // len(piece)))) <= 16
