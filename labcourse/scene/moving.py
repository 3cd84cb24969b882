"""A drawing that moves: plain shapes whose points stand in frames, which signals turn and shift.

A pendulum on a cart, whose signals are the cart's place ``x`` (m) and the pendulum's ``angle`` (rad)::

    cart = GROUND.shifted(1, 0, by="x")
    rod = cart.turned(by="angle")
    drawing = Moving({"x": 0.1, "angle": 0.2}, x=(-1, 1), y=(-1, 1))
    drawing.rectangle(cart, (-0.2, -0.1), (0.2, 0.1))
    drawing.line(rod.at(0, 0), rod.at(0, -0.6), "measured", width=5)
    drawing.reading("x", "x", " m", digits=2)

The page has the frames, and so can go through a recording by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from labcourse.errors import CourseError
from labcourse.scene.roles import checked

Item = dict[str, Any]


@dataclass(frozen=True)
class Frame:
    """Axes that points are given in: x to the right, y up, until they are turned and shifted.

    Attributes
    ----------
    steps : from the ground; each is taken in the axes to which those before it have led
    """

    steps: tuple[Item, ...] = ()

    def turned(self, by: str) -> Frame:
        """These axes turned anticlockwise about their own origin, by a signal (rad)."""
        return Frame((*self.steps, {"turn": by}))

    def shifted(self, x: float, y: float, by: str | None = None) -> Frame:
        """These axes shifted by (x, y), or by so much for each unit of a signal."""
        return Frame((*self.steps, {"shift": [x, y], "by": by}))

    def at(self, x: float, y: float) -> Point:
        """A point by its place in these axes."""
        return Point(self, x, y)

    @property
    def signals(self) -> list[str]:
        """Names of the signals that move it."""
        names = (step.get("turn", step.get("by")) for step in self.steps)
        return [name for name in names if name is not None]


@dataclass(frozen=True)
class Point:
    """A point of a shape; see :meth:`Frame.at`."""

    frame: Frame
    x: float
    y: float

    def packed(self) -> Item:
        """As the page takes it."""
        return {"frame": list(self.frame.steps), "at": [self.x, self.y]}


GROUND = Frame()  #: does not move


@dataclass
class Moving:
    """A drawing to scale, as wide and as high as there is room for.

    A role is what a shape stands for: one of :data:`~labcourse.scene.roles.ROLES`. Later shapes cover earlier
    ones. A role that there is not, and a signal's name that is not among ``signals``, raise CourseError.

    Attributes
    ----------
    signals : name → value now; a scene's player puts recorded values in their place
    x, y : limits of what is to be seen
    height : share of its column
    """

    signals: Mapping[str, float]
    x: tuple[float, float]
    y: tuple[float, float]
    height: float = 1.0
    shapes: list[Item] = field(default_factory=list)
    readings: list[Item] = field(default_factory=list)

    def line(self, start: Point, end: Point, role: str, width: float | None = None) -> None:
        """A straight line; one of a given ``width`` (px) is a rod with round ends."""
        self._add({"kind": "line", "role": role, "width": width}, start, end)

    def rectangle(self, frame: Frame, low: tuple[float, float], high: tuple[float, float]) -> None:
        """A body: a rectangle along a frame's axes, by two opposite corners."""
        (left, bottom), (right, top) = low, high
        corners = [frame.at(*corner) for corner in ((left, bottom), (right, bottom), (right, top), (left, top))]
        self._add({"kind": "rectangle", "role": "text", "fill": "body"}, *corners)

    def circle(self, middle: Point, radius: float, role: str) -> None:
        """A circle's outline, to scale."""
        self._add({"kind": "circle", "role": role, "radius": radius}, middle)

    def dot(self, middle: Point, size: float = 4, role: str = "text") -> None:
        """A pivot or the like: a filled circle whose radius is in px."""
        self._add({"kind": "dot", "role": role, "size": size}, middle)

    def spring(self, start: Point, end: Point, role: str, turns: int = 9, swing: float = 4) -> None:
        """A zigzag; ``swing`` (px) is how far it goes to either side."""
        self._add({"kind": "spring", "role": role, "turns": turns, "swing": swing}, start, end)

    def reading(self, label: str, signal: str, unit: str = "", scale: float = 1.0, digits: int = 1) -> None:
        """A signal's value in words, above the drawing: times ``scale``, with so many decimals."""
        self._check([signal])
        about = {"label": label, "signal": signal, "unit": unit}
        self.readings.append(about | {"scale": scale, "digits": digits})

    def packed(self) -> Item:
        """As the page takes it."""
        limits = {"x": list(self.x), "y": list(self.y), "height": self.height}
        fixed = {"kind": "moving", "signals": dict(self.signals), **limits}
        return fixed | {"shapes": self.shapes, "readings": self.readings}

    def _add(self, shape: Item, *points: Point) -> None:
        checked(shape["role"])
        for point in points:
            self._check(point.frame.signals)
        self.shapes.append(shape | {"points": [point.packed() for point in points]})

    def _check(self, names: list[str]) -> None:
        for name in names:
            if name not in self.signals:
                raise CourseError(f"The drawing has no signal {name!r}; it has {', '.join(self.signals)}.")
