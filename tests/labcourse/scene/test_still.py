"""A scene's still picture, and roles that there are not."""

import numpy as np
import pytest

from labcourse.errors import CourseError
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import GROUND, Column, Moving, Panel, Readout, Row, Scene

T = np.linspace(0, 1, 50)
ANGLE = 0.3


class Pendulum(Explorer):
    """An explorer that says nothing of a picture."""

    def view(self):
        plot = Panel("angle (rad)", (0, 1), (-1, 1), "time (s)")
        plot.line(T, np.cos(T), "measured", "measured", width=3)
        plot.area([0, 1, 1], [0, 0, 1], "model")
        plot.band(-0.5, 0.5, "ghost")
        plot.level(0.2, "axis", dash=[])
        plot.points([0.1, 0.2], [0.1, 0.2], "highlight")
        plot.text(0.5, 0.5, "here")
        plot.handle("cursor", 0.4, 0, "cursor", "0.4 s", (0.01, 0), shape="cursor", axis="x")
        plot.handle("gain", 0.6, 0.1, "gain", "0.1", (0.01, 0.01), legend="gain")
        rod = GROUND.shifted(0, 1).turned(by="angle")
        drawing = Moving({"angle": ANGLE}, x=(-2, 2), y=(-2, 2))
        drawing.line(rod.at(0, 0), rod.at(0, -1), "measured", width=5)
        drawing.rectangle(rod, (-0.1, -0.1), (0.1, 0.1))
        drawing.circle(rod.at(0, 0), 0.5, "grid")
        drawing.dot(rod.at(0, 0))
        drawing.spring(GROUND.at(-2, 0), rod.at(0, -1), "model")
        drawing.reading("angle", "angle", " rad", digits=2)
        readout = Readout("Numbers", [Row("angle", ("0.30 rad",))])
        return Scene("A pendulum.", [Column([plot]), Column([drawing])], readouts=[readout])


def test_a_picture_is_drawn_from_the_scene_unless_said_otherwise():
    picture = Pendulum().picture()
    plot, drawing = picture.axes
    curve = plot.lines[0]
    np.testing.assert_allclose(curve.get_ydata(), np.cos(T))
    assert (plot.get_xlim(), plot.get_xlabel(), picture.alt_text) == ((0, 1), "time (s)", "A pendulum.")
    assert {text.get_text() for text in plot.get_legend().get_texts()} == {"measured", "gain"}
    rod = drawing.lines[0].get_xydata()
    np.testing.assert_allclose(rod, [[0, 1], [np.sin(ANGLE), 1 - np.cos(ANGLE)]], atol=1e-12)
    assert "image/png" in Pendulum()._repr_mimebundle_()[0]


class Wordy(Explorer):
    """An explorer with a long readout."""

    def view(self):
        plot = Panel("angle (rad)", (0, 1), (-1, 1))
        rows = [Row(f"settling {'so ' * (index % 7)}", (f"{index}.25 %", f"{index} deg")) for index in range(30)]
        return Scene("Wordy.", [Column([plot])], readouts=[Readout("Numbers", rows, head=("full", "partial"))])


def test_a_line_of_a_readout_ends_nowhere_between_a_number_and_its_unit():
    lines = Wordy().picture().get_supxlabel().split("\n")
    assert len(lines) > 5
    assert not [line for line in lines if line.startswith(("%", "deg"))]


def test_a_role_that_there_is_not_is_refused_with_those_that_there_are():
    panel, drawing = Panel("", (0, 1), (0, 1)), Moving({}, (0, 1), (0, 1))
    for draw in (
        lambda: panel.line(T, T, "mesured"),
        lambda: panel.handle("x", 0, 0, "", "", (1, 1), role="mesured"),
        lambda: drawing.dot(GROUND.at(0, 0), role="mesured"),
    ):
        with pytest.raises(CourseError, match=r"'mesured'.*measured.*ghost"):
            draw()
    assert not panel.items and not panel.handles and not drawing.shapes
