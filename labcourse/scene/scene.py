"""What an explorer shows, as plain data: plots, handles to drag, drawings that move, controls, readouts.

A scene knows nothing of the page it is drawn on. ``packed`` gives it as the page takes it: JSON, and all curves in one
buffer of 32-bit floats. Angles on handles and in plots are in whatever unit the axis says.

A drawing that moves (:class:`Moving`) has shapes whose points stand in frames, which signals turn and shift. A pendulum
on a cart, whose signals are the cart's place ``x`` (m) and the pendulum's ``angle`` (rad)::

    cart = GROUND.shifted(1, 0, by="x")
    rod = cart.turned(by="angle")
    drawing = Moving({"x": 0.1, "angle": 0.2}, x=(-1, 1), y=(-1, 1))
    drawing.rectangle(cart, (-0.2, -0.1), (0.2, 0.1))
    drawing.line(rod.at(0, 0), rod.at(0, -0.6), "measured", width=5)
    drawing.reading("x", "x", " m", digits=2)

The page has the frames, and so can go through a recording by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labcourse.errors import CourseError

Item = dict[str, Any]

MOST_POINTS = 1200  #: of a curve; more than a screen has across
_BLACK = "#000000"
#: What a curve or a shape stands for, and how it is drawn: on the page (drawing.js) by its name, in a still picture by
#: these keyword arguments of ``Axes.plot``. The colours are Okabe and Ito's, which people with any kind of colour
#: vision can tell apart; what is drawn together differs in line style too, so that a grey print can be read.
ROLES: dict[str, dict[str, Any]] = {
    "reference": {"color": _BLACK, "linestyle": (0, (5, 2)), "linewidth": 1.2},
    "measured": {"color": "#D55E00", "linestyle": "-", "linewidth": 1.5},
    "model": {"color": "#0072B2", "linestyle": (0, (6, 1.5, 1.5, 1.5)), "linewidth": 1.8},
    "voltage": {"color": "#009E73", "linestyle": "-", "linewidth": 1.2},
    "highlight": {"color": "#CC79A7", "linestyle": (0, (1.2, 1.2)), "linewidth": 2.0},
    "ghost": {"color": "#777777", "linestyle": (0, (3, 4)), "linewidth": 1.2},
    "grid": {"color": "#BBBBBB", "linewidth": 0.8},
    "axis": {"color": _BLACK, "linewidth": 0.8},
    "text": {"color": _BLACK, "linewidth": 1.0},
    "body": {"color": "#CFD8DC", "linewidth": 1.0},
}


def checked(role: str) -> str:
    """Return a role.

    Raises
    ------
    CourseError
        If there is none of that name.
    """
    if role not in ROLES:
        raise CourseError(f"There is no role {role!r}; the roles are {', '.join(ROLES)}.")
    return role


@dataclass
class Panel:
    """One plot.

    Attributes
    ----------
    xlabel, ylabel : with units; without an xlabel, the panel shares the axis of the one below it
    x, y : limits of the axes
    height : share of its column
    equal : a unit is as long in both directions
    bare : without grid lines
    """

    ylabel: str
    x: tuple[float, float]
    y: tuple[float, float]
    xlabel: str = ""
    height: float = 1.0
    equal: bool = False
    bare: bool = False
    items: list[Item] = field(default_factory=list)
    handles: list[Item] = field(default_factory=list)

    def line(self, x: ArrayLike, y: ArrayLike, role: str, label: str = "", **look: Any) -> None:
        """A curve; ``role`` is one of :data:`ROLES`, as of all that is drawn."""
        curve = thinned(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        self.items.append({"kind": "line", "x": curve[0], "y": curve[1], "role": checked(role), "label": label, **look})

    def area(self, x: ArrayLike, y: ArrayLike, role: str, label: str = "", opacity: float = 0.3) -> None:
        """The inside of a closed curve."""
        self.items.append({"kind": "area", "x": x, "y": y, "role": checked(role), "label": label, "opacity": opacity})

    def band(self, low: float, high: float, role: str, label: str = "", axis: str = "y") -> None:
        """All between two values of an axis."""
        self.items.append({"kind": "band", "axis": axis, "span": [low, high], "role": checked(role), "label": label})

    def level(self, at: float, role: str, label: str = "", axis: str = "y", **look: Any) -> None:
        """A straight line across the plot, at a value of an axis."""
        self.items.append({"kind": "level", "axis": axis, "at": at, "role": checked(role), "label": label, **look})

    def mark(self, x: float, y: float, role: str, shape: str = "cross", label: str = "", size: float = 5) -> None:
        """A cross, square or circle."""
        look = {"role": checked(role), "shape": shape, "label": label, "size": size}
        self.items.append({"kind": "mark", "at": [float(x), float(y)], **look})

    def points(self, x: ArrayLike, y: ArrayLike, role: str, label: str = "", size: float = 2) -> None:
        """A cloud of dots."""
        look = {"role": checked(role), "shape": "dot", "label": label, "size": size}
        self.items.append({"kind": "points", "x": x, "y": y, **look})

    def text(self, x: float, y: float, text: str, anchor: str = "center") -> None:
        """A word in the plot."""
        self.items.append({"kind": "text", "at": [float(x), float(y)], "text": text, "anchor": anchor})

    def handle(
        self,
        name: str,
        x: float,
        y: float,
        label: str,
        text: str,
        step: tuple[float, float],
        role: str = "measured",
        shape: str = "cross",
        axis: str = "both",
        legend: str = "",
    ) -> None:
        """Something to drag, or to move with the arrow keys.

        Parameters
        ----------
        name : by which the explorer hears of it
        x, y : where it is
        label, text : what it is, and where, in words
        step : of one press of a key, in either direction
        role, shape : its colour; cross or cursor
        axis : "x" or "y" if it moves along one axis only
        legend : its entry in the plot's legend; of handles that look the same, one has it
        """
        found = {"name": name, "x": float(x), "y": float(y), "label": label, "text": text, "step": list(step)}
        self.handles.append(found | {"role": checked(role), "shape": shape, "axis": axis, "legend": legend})


# --- drawings that move -----------------------------------------------------------------------------------------------


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

    A role is what a shape stands for: one of :data:`ROLES`. Later shapes cover earlier
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
    grabs: list[Item] = field(default_factory=list)

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

    def grab(self, name: str, point: Point, label: str, text: str, step: float) -> None:
        """A point that can be held, by the pointer or the arrow keys, and pulled: it moves only by its signals.

        Parameters
        ----------
        name : by which the explorer hears of it, see :meth:`labcourse.scene.explorer.Explorer.grab`
        point : where it is
        label, text : what it is, and how it stands, in words
        step : by how much one press of a key pulls, in the drawing's units
        """
        self._check(point.frame.signals)
        about = {"name": name, "label": label, "text": text, "step": step}
        self.grabs.append(about | {"point": point.packed()})

    def packed(self) -> Item:
        """As the page takes it."""
        limits = {"x": list(self.x), "y": list(self.y), "height": self.height}
        fixed = {"kind": "moving", "signals": dict(self.signals), **limits}
        return fixed | {"shapes": self.shapes, "readings": self.readings, "grabs": self.grabs}

    def _add(self, shape: Item, *points: Point) -> None:
        checked(shape["role"])
        for point in points:
            self._check(point.frame.signals)
        self.shapes.append(shape | {"points": [point.packed() for point in points]})

    def _check(self, names: list[str]) -> None:
        for name in names:
            if name not in self.signals:
                raise CourseError(f"The drawing has no signal {name!r}; it has {', '.join(self.signals)}.")


# --- the whole --------------------------------------------------------------------------------------------------------


@dataclass
class Column:
    """Plots and drawings above each other; ``width`` is the column's share."""

    panels: Sequence[Panel | Moving]
    width: float = 1.0


class Control:
    """Something above the plots; the page knows it by its class's name."""

    def packed(self) -> Item:
        """As the page takes it."""
        return {"kind": type(self).__name__.lower(), **vars(self)}


@dataclass(frozen=True)
class Slider(Control):
    """A number, by slider or box."""

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    value: float
    disabled: bool = False


@dataclass(frozen=True)
class Choice(Control):
    """One of several; ``options`` is value → text."""

    name: str
    label: str
    options: Mapping[str, str]
    value: str
    disabled: bool = False

    def packed(self) -> Item:
        """As the page takes it: the options in their order."""
        return super().packed() | {"options": [*self.options.items()]}


@dataclass(frozen=True)
class Button(Control):
    """Something to press; ``look`` is "main", "stop" (which goes out at once, also by Escape) or plain."""

    name: str
    label: str
    look: str = ""
    disabled: bool = False
    title: str = ""


@dataclass(frozen=True)
class Row:
    """A line of a readout. ``mark`` is "met", "missed" or "unknown", told by ``words`` too: never by colour alone."""

    label: str
    values: Sequence[str] = ()
    mark: str = ""
    words: str = ""


@dataclass(frozen=True)
class Readout:
    """A small table beside the plots; one that is ``folded`` is opened by a click on its title."""

    title: str
    rows: Sequence[Row]
    head: Sequence[str] = ()
    folded: bool = False

    def packed(self) -> Item:
        """As the page takes it."""
        rows = [vars(row) | {"values": list(row.values)} for row in self.rows]
        return vars(self) | {"rows": rows, "head": list(self.head) or None}


@dataclass
class Play:
    """A recording that drawings can go through in its own time.

    Attributes
    ----------
    signals : name, as the drawings have it → (n,) values, evenly spaced in time
    duration : s
    auto : whether it begins by itself, once what it shows has changed and nothing is held
    at_once : whether it begins by itself before anything has changed, too
    """

    signals: Mapping[str, NDArray[np.float64]]
    duration: float
    auto: bool = False
    at_once: bool = False


@dataclass
class Scene:
    """All that is shown.

    Attributes
    ----------
    alt : the plots in words
    columns : of plots
    controls : rows of them, above the plots
    readouts : below the plots, on a wide page beside them
    height : of the plots, px; less where the whole explorer would not be in view at once, or, on a narrow page, two
        columns below each other
    play : what the player plays
    live : while something runs that must stop when the page is gone: what the page says if nothing more is heard of it
    """

    alt: str
    columns: Sequence[Column] = ()
    controls: Sequence[Sequence[Control]] = ()
    readouts: Sequence[Readout] = ()
    height: int = 420
    play: Play | None = None
    live: str = ""

    def packed(self) -> tuple[dict[str, Any], bytes]:
        """The scene as JSON, and its numbers.

        Raises
        ------
        CourseError
            If a signal that is played moves nothing.
        """
        buffer = _Buffer()
        columns = []
        for column in self.columns:
            panels = [_packed_panel(panel, buffer) for panel in column.panels]
            columns.append({"width": column.width, "panels": panels})
        scene = {
            "alt": self.alt,
            "columns": columns,
            "controls": [[control.packed() for control in row] for row in self.controls],
            "readouts": [readout.packed() for readout in self.readouts],
            "height": self.height,
            "play": self._packed_play(buffer),
            "live": self.live,
        }
        return scene, buffer.bytes()

    def _packed_play(self, buffer: _Buffer) -> Item | None:
        if self.play is None:
            return None
        drawings = [panel for column in self.columns for panel in column.panels if isinstance(panel, Moving)]
        moved = {name for drawing in drawings for name in drawing.signals}
        for name in self.play.signals:
            if name not in moved:
                raise CourseError(
                    f"No drawing has a signal {name!r} to be played; there are {', '.join(sorted(moved))}."
                )
        signals = {name: buffer.put(values) for name, values in self.play.signals.items()}
        return vars(self.play) | {"signals": signals}


def around(*curves: NDArray[np.float64]) -> tuple[float, float]:
    """Limits of an axis that hold some curves, with a margin."""
    low, high = min(float(one.min()) for one in curves), max(float(one.max()) for one in curves)
    margin = 0.1 * (high - low) or 1.0
    return low - margin, high + margin


def thinned(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A long curve with fewer points: of each stretch, the lowest and the highest, so that no peak is lost."""
    if x.size <= MOST_POINTS:
        return x, y
    stretches = MOST_POINTS // 2
    edges = np.linspace(0, x.size, stretches + 1).astype(int)
    kept = []
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = y[start:stop]
        kept += sorted((start + int(part.argmin()), start + int(part.argmax())))
    return x[kept], y[kept]


def _packed_panel(panel: Panel | Moving, buffer: _Buffer) -> Item:
    if isinstance(panel, Moving):
        return panel.packed()
    items = []
    for item in panel.items:
        curve = {axis: buffer.put(item[axis]) for axis in ("x", "y") if axis in item}
        items.append(item | curve)
    names = ("xlabel", "ylabel", "height", "equal", "bare", "handles")
    fixed = {name: getattr(panel, name) for name in names}
    return {"kind": "plot", "x": list(panel.x), "y": list(panel.y), "items": items, **fixed}


class _Buffer:
    """Curves, one after the other."""

    def __init__(self) -> None:
        self._parts: list[NDArray[np.float32]] = []
        self._known: dict[int, list[int]] = {}
        self._size = 0

    def put(self, values: ArrayLike) -> list[int]:
        """Add a curve, and return where it is: offset and count. The same array is not added twice."""
        if id(values) in self._known:
            return self._known[id(values)]
        part = np.ascontiguousarray(values, dtype=np.float32)
        place = [self._size, part.size]
        self._parts.append(part)
        self._size += part.size
        self._known[id(values)] = place  # callers keep their arrays for as long as the scene is packed
        return place

    def bytes(self) -> bytes:
        """All of it."""
        return b"".join(part.tobytes() for part in self._parts)
