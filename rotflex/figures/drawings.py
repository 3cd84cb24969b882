"""The workbook's diagrams: block diagrams of the experiments and of the control loop, the mechanism, and its poles.

A drawing is a function that draws on a :class:`Sketch`. Coordinates are in units of the drawing, x to the right and y
up, with the origin at the lower left corner; angles are in degrees, counter-clockwise. In block diagrams, signals on a
tinted tag are recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from inspect import cleandoc
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.patches import Circle, Ellipse, FancyArrowPatch, FancyBboxPatch, Polygon, Rectangle
from matplotlib.path import Path

from rotflex.figures.pictures import BLACK, BLUE, Picture, new_picture, style
from rotflex.units import DEG

Point = tuple[float, float]

INK, BACKGROUND, TINT, SHADE = BLACK, "#FFFFFF", "#EEF3F8", "#C9D3DD"
RECORDED = "#FBF3B0"  #: behind the name of a signal that is recorded
THICK, THIN = 1.5, 0.9
_SIDES = {"left": (-1, 0), "right": (1, 0), "top": (0, 1), "bottom": (0, -1)}


@dataclass(frozen=True)
class Block:
    """A drawn block or summing junction, and the middles of its sides."""

    x: float
    y: float
    width: float
    height: float

    def side(self, name: str) -> Point:
        """The middle of the "left", "right", "top" or "bottom" side."""
        dx, dy = _SIDES[name]
        return self.x + dx * self.width / 2, self.y + dy * self.height / 2

    left = property(lambda self: self.side("left"))
    right = property(lambda self: self.side("right"))
    top = property(lambda self: self.side("top"))
    bottom = property(lambda self: self.side("bottom"))


def along(start: Point, angle: float, distance: float, offset: float = 0.0) -> Point:
    """The point at ``distance`` from ``start`` in a direction (deg), ``offset`` to the left of it."""
    c, s = np.cos(angle * DEG), np.sin(angle * DEG)
    return start[0] + distance * c - offset * s, start[1] + distance * s + offset * c


class Sketch:
    """A blank drawing of ``width`` by ``height`` units, a unit being ``scale`` inches."""

    def __init__(self, width: float, height: float, scale: float = 0.4) -> None:
        self.figure = new_picture(width * scale, height * scale, layout=None)
        self.axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
        self.axes.set_axis_off()

    # --- words and lines -------------------------------------------------------------------------------------------

    def text(self, x: float, y: float, text: str, size: float = 11, **options: Any) -> None:
        """Words or mathematics, centred on a point unless told otherwise."""
        look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": size, "zorder": 6} | options
        self.axes.text(x, y, text, **look)

    def signal(self, x: float, y: float, text: str, recorded: bool = False, **options: Any) -> None:
        """The name of a signal; on a tinted tag if it is recorded."""
        tag = {"boxstyle": "round,pad=0.22", "facecolor": RECORDED, "edgecolor": "#777777", "linewidth": 0.8}
        self.text(x, y, text, **{"size": 12, "bbox": tag if recorded else None} | options)

    def key(self, x: float, y: float) -> None:
        """What the tag behind a signal's name says."""
        self.signal(x, y, "recorded signal", recorded=True, size=10)

    def line(self, *points: Point, width: float = THIN, style: Any = "-", color: str = INK, layer: float = 2) -> None:
        """A line through the points."""
        x, y = zip(*points, strict=True)
        self.axes.plot(x, y, color=color, linewidth=width, linestyle=style, zorder=layer, solid_capstyle="round")

    def arrow(self, *points: Point, heads: str = "-|>", width: float = THICK) -> None:
        """A line through the points with a filled head at its end (``"<|-|>"``: at both ends)."""
        look: dict[str, Any] = {"joinstyle": "miter", "capstyle": "butt", "mutation_scale": 13, "zorder": 4.2}
        style = f"{heads},head_width=0.22,head_length=0.5"
        self.axes.add_patch(FancyArrowPatch(path=Path(points), arrowstyle=style, linewidth=width, color=INK, **look))

    def dot(self, point: Point) -> None:
        """A take-off point, where one signal goes two ways."""
        self.axes.add_patch(Circle(point, 0.1, color=INK, zorder=4))

    def circle(self, centre: Point, radius: float, fill: str = BACKGROUND, layer: float = 5, edge: str = INK) -> None:
        """A filled circle, with an outline unless ``edge`` is "none"."""
        self.axes.add_patch(Circle(centre, radius, facecolor=fill, edgecolor=edge, linewidth=THICK, zorder=layer))

    # --- block diagrams --------------------------------------------------------------------------------------------

    def block(self, x: float, y: float, text: str, width: float = 2.6, height: float = 1.5, **options: Any) -> Block:
        """A block centred on a point."""
        corner = (x - width / 2, y - height / 2)
        look: dict[str, Any] = {"facecolor": TINT, "edgecolor": INK, "linewidth": THICK, "zorder": 3}
        self.axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle="round,pad=0,rounding_size=0.12", **look))
        self.text(x, y, text, **options)
        return Block(x, y, width, height)

    def junction(self, x: float, y: float, signs: Mapping[str, str]) -> Block:
        """A summing junction; ``signs`` maps a side to the sign that its input enters with."""
        radius = 0.32
        self.circle((x, y), radius, layer=3)
        for side, sign in signs.items():
            dx, dy = _SIDES[side]
            # Beside the incoming arrow, not on it.
            self.text(x + dx * 0.62 + abs(dy) * 0.36, y + dy * 0.62 + abs(dx) * 0.32, f"${sign}$", size=12)
        return Block(x, y, 2 * radius, 2 * radius)

    # --- mechanics -------------------------------------------------------------------------------------------------

    def bar(
        self, start: Point, angle: float, span: tuple[float, float], breadth: float, fill: str, layer: float = 3
    ) -> None:
        """A bar along a direction (deg), from ``span[0]`` to ``span[1]`` of the start."""
        (near, far), half = span, breadth / 2
        corners = [along(start, angle, *corner) for corner in ((near, half), (near, -half), (far, -half), (far, half))]
        self.axes.add_patch(Polygon(corners, facecolor=fill, edgecolor=INK, linewidth=THICK, zorder=layer))

    def spring(self, start: Point, end: Point, coils: int = 5, breadth: float = 0.45, layer: float = 3) -> None:
        """A spring between two points."""
        length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
        angle = float(np.arctan2(end[1] - start[1], end[0] - start[0])) / DEG
        zigzag = np.tile([1, -1], coils) * breadth / 2
        distance = np.linspace(0.2, 0.8, 2 * coils) * length
        wire = [start, along(start, angle, 0.14 * length)]
        wire += [along(start, angle, d, o) for d, o in zip(distance, zigzag, strict=True)]
        self.line(*wire, along(start, angle, 0.86 * length), end, width=THICK, layer=layer)

    def damper(self, start: Point, end: Point, breadth: float = 0.7) -> None:
        """A horizontal dashpot between two points: the cup to the left, the piston to the right."""
        (x0, y), (x1, _y) = start, end
        cup, mouth, piston = x0 + 0.35 * (x1 - x0), x0 + 0.68 * (x1 - x0), x0 + 0.55 * (x1 - x0)
        half = breadth / 2
        self.line(start, (cup, y), width=THICK)
        self.line((mouth, y + half), (cup, y + half), (cup, y - half), (mouth, y - half), width=THICK)
        self.line((piston, y + 0.7 * half), (piston, y - 0.7 * half), width=2 * THICK)
        self.line((piston, y), end, width=THICK)

    def ground(self, x: float, y: float, width: float) -> None:
        """Fixed ground below a point."""
        self.line((x - width / 2, y), (x + width / 2, y), width=THICK)
        hatched = Rectangle((x - width / 2, y - 0.3), width, 0.3, hatch="////", fill=False, linewidth=0, edgecolor=INK)
        self.axes.add_patch(hatched)

    # --- dimensions ------------------------------------------------------------------------------------------------

    def angle(self, centre: Point, radius: float, start: float, stop: float, text: str, squash: float = 1.0) -> None:
        """An arc with a head, from one direction (deg) to another, and its name beyond its middle.

        ``squash`` below 1 flattens the circle, as one sees it about a shaft that is turned from the eye.
        """
        turn = np.linspace(start, stop, 60) * DEG
        points = [(centre[0] + radius * squash * np.cos(t), centre[1] + radius * np.sin(t)) for t in turn]
        self.arrow(*points, width=1.2)
        if text:
            self.signal(*along(centre, (start + stop) / 2, radius + 0.5), text)

    def dimension(self, start: Point, angle: float, span: Sequence[float], offset: float, text: str) -> None:
        """A dimension line for the ``span`` along a direction (deg), drawn ``offset`` to the left of it."""
        near, far = span
        for distance in span:
            feet = along(start, angle, distance, 0.5), along(start, angle, distance, offset + 0.2)
            self.line(*feet, width=0.8, color="#777777", layer=4)
        ends = along(start, angle, near, offset), along(start, angle, far, offset)
        self.arrow(*ends, heads="<|-|>", width=THIN)
        middle = along(start, angle, (near + far) / 2, offset)
        behind = {"boxstyle": "round,pad=0.1", "facecolor": BACKGROUND, "edgecolor": "none"}
        self.text(*middle, text, size=12, bbox=behind)


def drawing(
    width: float, height: float, scale: float = 0.4
) -> Callable[[Callable[[Sketch], None]], Callable[[], Picture]]:
    """Make a figure of a function that draws on a sketch.

    The function's docstring, below its first line, becomes the figure's description for those who cannot see it.

    Parameters
    ----------
    width, height, scale : of the sketch, see :class:`Sketch`
    """

    def decorate(draw: Callable[[Sketch], None]) -> Callable[[], Picture]:
        """Make a drawing a function without arguments. Its docstring, after the first paragraph, is the alt text."""

        @wraps(draw)
        def picture() -> Picture:
            with style():
                sketch = Sketch(width, height, scale)
                draw(sketch)
            sketch.figure.alt_text = " ".join(cleandoc(draw.__doc__ or "").partition("\n\n")[2].split())
            return sketch.figure

        del picture.__wrapped__  # else a signature would show the sketch as an argument
        return picture

    return decorate


# --- block diagrams ---------------------------------------------------------------------------------------------------

_DESIRED_STATE = r"$x_d = [\,\theta_d\;\;0\;\;0\;\;0\,]^T$"


def _two_outputs(sketch: Sketch, plant: Block, end: float, suffix: str = "", offset: float = 0.95) -> None:
    """Arrows from the plant to ``end``, with the names of the recorded alpha and theta on them."""
    for name, rise in ((r"\alpha", 0.55), (r"\theta", -0.55)):
        sketch.arrow((plant.right[0], plant.y + rise), (end, plant.y + rise))
        sketch.signal(plant.right[0] + offset, plant.y + rise, f"${name}{suffix}$", recorded=True)


def _feedback_switch(sketch: Sketch, state: Point, partial: Point, target: Point) -> None:
    """From the state's take-off, by way of the switch between full and partial feedback, up to ``target``."""
    common = (target[0], (state[1] + partial[1]) / 2)
    throws = (common[0] + 1.1, state[1]), (common[0] + 1.1, partial[1])
    chooser = sketch.block(*partial, "$\\alpha$ and $\\dot{\\alpha}$" + "\nto zero", 2.6, 1.3, size=10.5)
    sketch.dot(state)
    sketch.line(state, throws[0], width=THICK)
    sketch.arrow(state, (state[0], partial[1]), chooser.right)
    sketch.line(chooser.left, throws[1], width=THICK)
    sketch.line(common, throws[0], width=1.4 * THICK)
    sketch.arrow(common, target)
    for contact in (*throws, common):
        sketch.circle(contact, 0.12)
    sketch.text(throws[0][0] + 0.2, throws[0][1] + 0.4, "full", size=10.5, ha="left")
    sketch.text(throws[1][0] - 0.1, throws[1][1] - 0.45, "partial", size=10.5)


@drawing(17.2, 4.4)
def sweep_experiment(sketch: Sketch) -> None:
    """The sine sweep: a position loop makes the servo follow it, and the link answers (Figure 2.4).

    Block diagram of the sweep experiment. The measured servo angle theta is subtracted from a sine sweep of 1 to 5 Hz;
    a position controller turns the difference into the voltage for the servo with the flexible joint. Recorded are the
    sweep, the voltage, theta and the deflection alpha.
    """
    y, low = 3.0, 0.9
    source = sketch.block(1.8, y, "sine sweep\n1 to 5 Hz\nin 15 s", 2.8, 2.0)
    junction = sketch.junction(5.4, y, {"left": "+", "bottom": "-"})
    controller = sketch.block(7.9, y, "position\ncontroller", 2.7)
    bench = sketch.block(12.3, y, "servo and\nflexible joint", 3.2, 2.0)
    sketch.arrow(source.right, junction.left)
    sketch.signal(4.0, y + 0.6, r"$\theta_d$", recorded=True)
    sketch.arrow(junction.right, controller.left)
    sketch.arrow(controller.right, bench.left)
    sketch.signal(9.95, y + 0.6, "$V_m$", recorded=True)
    _two_outputs(sketch, bench, 16.8)
    take_off = (15.9, y - 0.55)
    sketch.dot(take_off)
    sketch.arrow(take_off, (take_off[0], low), (junction.x, low), junction.bottom)
    sketch.key(1.8, low)
    sketch.text(10.6, low - 0.4, "the servo follows the sweep", size=10.5)


@drawing(17.2, 6.6)
def validation_experiment(sketch: Sketch) -> None:
    """The same voltage to the bench and to the model (Figure 2.6).

    Block diagram of the validation. One voltage, a step or a square wave, drives the servo with the flexible joint and,
    beside it, the state-space model. The measured theta and alpha are recorded with those of the model and plotted
    together.
    """
    y, apart = 3.3, 1.55
    source = sketch.block(1.8, y, "step or\nsquare wave", 2.8)
    bench = sketch.block(8.5, y + apart, "servo and\nflexible joint", 3.6, 2.0)
    model = sketch.block(8.5, y - apart, "$\\dot{x} = Ax + Bu$\n$y = Cx + Du$", 3.6, 2.0, size=13)
    plots = sketch.block(15.5, y, "measured\nand model\nin one plot", 2.8, 5.2)
    fork = (5.0, y)
    sketch.line(source.right, fork, width=THICK)
    sketch.dot(fork)
    for plant in (bench, model):
        sketch.arrow(fork, (fork[0], plant.y), plant.left)
    sketch.signal(4.1, y + 0.6, "$V_m$", recorded=True)
    _two_outputs(sketch, bench, plots.left[0])
    _two_outputs(sketch, model, plots.left[0], r"_\mathrm{model}", 1.6)
    sketch.key(1.8, 0.8)
    sketch.text(bench.x, bench.top[1] + 0.35, "the bench", size=10.5)
    sketch.text(model.x, model.bottom[1] - 0.35, "your model", size=10.5)


@drawing(17.2, 3.9)
def state_feedback(sketch: Sketch) -> None:
    """The state-feedback loop, u = K (x_d - x) (Figure 3.2).

    Block diagram of state feedback. The state x is subtracted from the desired state x_d; the gain K turns the
    difference into the motor voltage u of the plant x' = A x + B u. The state is taken off before the output matrix C.
    """
    y, low = 2.7, 0.7
    junction = sketch.junction(4.6, y, {"left": "+", "bottom": "-"})
    gain = sketch.block(6.9, y, "$K$", 1.6, 1.5, size=14)
    plant = sketch.block(11.0, y, r"$\dot{x} = Ax + Bu$", 3.5, 1.7, size=13)
    output = sketch.block(14.8, y, "$C$", 1.3, 1.3, size=14)
    sketch.arrow((0.4, y), junction.left)
    sketch.signal(2.0, y + 0.6, _DESIRED_STATE)
    sketch.arrow(junction.right, gain.left)
    sketch.arrow(gain.right, plant.left)
    sketch.signal(8.48, y + 0.55, "$u = V_m$")
    sketch.arrow(plant.right, output.left)
    sketch.signal(13.45, y + 0.5, "$x$")
    sketch.arrow(output.right, (16.9, y))
    sketch.signal(16.1, y + 0.5, "$y$")
    take_off = (13.45, y)
    sketch.dot(take_off)
    sketch.arrow(take_off, (take_off[0], low), (junction.x, low), junction.bottom)


@drawing(18.8, 6.3, 0.385)
def simulation_loop(sketch: Sketch) -> None:
    """The closed loop as it is simulated, with the switch between full and partial feedback (Figure 3.3).

    Block diagram of the simulation. A square wave of 0.33 Hz, smoothed by a rate limiter and scaled to 20 deg, is the
    desired servo angle. The state of the linear model is fed back: all of it, or, with the switch at partial, with the
    deflection and its rate set to zero. The gain K and a limit of 10 V turn the difference into the motor voltage.
    Recorded are the desired angle, the voltage, theta and alpha.
    """
    y = 5.2
    wave = sketch.block(1.45, y, "square wave\n±1, 0.33 Hz", 2.5, size=9.5)
    limiter = sketch.block(4.05, y, "rate\nlimiter", 1.7, size=9.5)
    amplitude = sketch.block(6.4, y, "amplitude\n20 deg", 2.0, size=9.5)
    junction = sketch.junction(9.1, y, {"left": "+", "bottom": "-"})
    gain = sketch.block(10.5, y, "$K$", 1.1, size=14)
    limit = sketch.block(12.35, y, "limit\n±10 V", 1.6, size=9.5)
    model = sketch.block(15.8, y, r"$\dot{x} = Ax + Bu$", 2.8, size=11.5)
    for start, end in pairwise((wave, limiter, amplitude, junction, gain, limit, model)):
        sketch.arrow(start.right, end.left)
    sketch.signal(7.95, y + 0.6, r"$\theta_d$", recorded=True)
    sketch.signal(13.75, y + 0.6, "$V_m$", recorded=True)
    take_off = (17.75, y)
    sketch.line(model.right, take_off, width=THICK)
    sketch.dot(take_off)
    sketch.arrow(take_off, (18.7, y))
    sketch.signal(18.1, y + 0.7, r"$\theta,\ \alpha$", recorded=True)
    state = (14.6, 2.9)
    sketch.line(take_off, (take_off[0], state[1]), state, width=THICK)
    sketch.signal(16.0, state[1] + 0.4, "$x$")
    sketch.key(1.6, 0.9)
    sketch.text(4.4, 2.9, _DESIRED_STATE, size=12)
    _feedback_switch(sketch, state, (12.7, 1.2), junction.bottom)


@drawing(18.0, 6.9)
def implementation_loop(sketch: Sketch) -> None:
    """The closed loop on the bench: filtered derivatives, the voltage's limit, and the switch (Figure 3.5).

    Block diagram of the control loop on the bench. Encoders measure theta and alpha; derivative filters add their
    rates, which completes the state. A switch feeds back the full state, or the partial one with alpha and its rate set
    to zero. The difference from the desired angle, a smoothed square wave of plus and minus 20 deg, goes through the
    gain K and a limit of 10 V to the servo. Recorded are the desired angle, the voltage, theta and alpha.
    """
    y, direct, filtered = 5.7, 3.8, 2.0
    source = sketch.block(1.8, y, "smoothed\nsquare wave\n±20 deg", 2.8, 1.9, size=10.5)
    junction = sketch.junction(5.2, y, {"left": "+", "bottom": "-"})
    gain = sketch.block(7.0, y, "$K$", 1.4, size=14)
    limit = sketch.block(10.0, y, "limit\n±10 V", 1.9, size=10.5)
    bench = sketch.block(13.9, y, "servo and\nflexible joint,\nencoders", 3.2, 1.9, size=10.5)
    for start, end in pairwise((source, junction, gain, limit, bench)):
        sketch.arrow(start.right, end.left)
    sketch.signal(4.0, y + 0.6, r"$\theta_d$", recorded=True)
    sketch.signal(11.65, y + 0.6, "$V_m$", recorded=True)
    corner = 17.2
    sketch.signal(16.55, y + 0.6, r"$\theta,\ \alpha$", recorded=True)
    # What is measured and, filtered, its rate of change make up the state.
    joined, take_off = 11.2, (10.2, 2.9)
    derivative = sketch.block(14.3, filtered, r"$\dfrac{\omega_c\, s}{s + \omega_c}$", 2.9, 1.7, size=13)
    sketch.line(bench.right, (corner, y), (corner, direct), width=THICK)
    sketch.dot((corner, direct))
    sketch.arrow((corner, direct), (joined, direct))
    sketch.arrow((corner, direct), (corner, filtered), derivative.right)
    sketch.arrow(derivative.left, (joined, filtered))
    sketch.line((joined, direct + 0.4), (joined, filtered - 0.4), width=5)
    sketch.signal(12.1, filtered + 0.5, r"$\dot{\theta},\ \dot{\alpha}$")
    sketch.signal(12.1, direct + 0.4, r"$\theta,\ \alpha$")
    sketch.text(derivative.x, derivative.bottom[1] - 0.4, "derivative filters", size=10.5)
    sketch.line((joined, take_off[1]), take_off, width=THICK)
    sketch.signal(9.5, take_off[1] + 0.4, "$x$")
    sketch.key(1.8, 0.8)
    sketch.text(2.4, take_off[1], _DESIRED_STATE, size=12)
    _feedback_switch(sketch, take_off, (8.5, 1.2), junction.bottom)


# --- the mechanism ----------------------------------------------------------------------------------------------------


@drawing(15.6, 12.2, 0.43)
def joint_angles(sketch: Sketch) -> None:
    """The flexible joint from above: servo angle, deflection, and the lengths of the arms (Figure 2.1).

    The flexible joint seen from above. The base has turned counter-clockwise by the servo angle theta. The link has
    turned a further angle alpha from the middle of the base, against two springs. The link is a long bottom arm of
    length L1 and mass m1 on the pivot and a short top arm of length L2 and mass m2 fixed on it; d12 is the distance
    from the pivot to the middle of the top arm. Both angles are positive counter-clockwise.
    """
    theta, alpha = 20.0, 20.0
    link, pivot = theta + alpha, (3.4, 3.2)
    # The arms are to scale, with the top arm at anchor 2: a unit is 29.8 mm.
    L_1, L_2, d_12 = 10.0, 5.2, 7.9
    axis_of: dict[str, Any] = {"style": (0, (8, 3, 1.5, 3)), "layer": 4}
    # The base, which turns with the servo, and what it turns from.
    sketch.bar(pivot, theta, (-1.7, 3.3), 4.6, TINT)
    sketch.line(pivot, along(pivot, 0, 9.9), **axis_of)
    sketch.text(*along(pivot, 0, 10.1), "fixed axis", size=10.5, ha="left")
    sketch.line(pivot, along(pivot, theta, 10.3), **axis_of)
    sketch.text(*along(pivot, theta, 10.5), "base axis", size=10.5, ha="left")
    for side in (1, -1):
        post = along(pivot, theta, 2.5, 1.95 * side)
        sketch.spring(post, along(pivot, link, 2.6), coils=3 if side > 0 else 5, breadth=0.4, layer=4.5)
        sketch.circle(post, 0.15, INK, 5, edge="none")
    sketch.line(along(pivot, theta, 0.9, -2.0), (6.6, 1.0), width=0.8, layer=6)
    sketch.text(6.7, 1.0, "base, on the load gear of the servo", size=10.5, ha="left")
    # The link: a long arm on the pivot and a short one fixed on top of it.
    sketch.bar(pivot, link, (-0.5, L_1), 0.85, BACKGROUND, layer=5)
    sketch.bar(pivot, link, (d_12 - L_2 / 2, d_12 + L_2 / 2), 0.42, SHADE, layer=5.2)
    sketch.circle(pivot, 0.3, layer=5.5)
    for middle in (pivot, along(pivot, link, d_12)):
        sketch.circle(middle, 0.09, INK, 5.6, edge="none")
    sketch.dimension(pivot, link, (d_12 - L_2 / 2, d_12 + L_2 / 2), 0.95, "$L_2$")
    sketch.dimension(pivot, link, (0, d_12), 1.85, "$d_{12}$")
    sketch.dimension(pivot, link, (0, L_1), 2.75, "$L_1$")
    # Names of the arms, with leaders.
    for distance, height, name in ((9.2, 9.0, "top arm, $m_2$"), (7.0, 8.0, "bottom arm, $m_1$")):
        start = along(pivot, link, distance, -0.1 if distance > 9 else -0.3)
        sketch.line(start, (12.3, height), width=0.8, layer=6)
        sketch.text(12.4, height, name, ha="left")
    sketch.angle(pivot, 5.2, 0, theta, r"$\theta$")
    sketch.angle(pivot, 5.2, theta, link - 4.8, r"$\alpha$")
    words = "Both angles are positive counter-clockwise,\nthe way $V_m > 0$ turns the servo."
    sketch.text(0.4, 11.5, words, size=10.5, ha="left")


def _disc(sketch: Sketch, x: float, y: float, name: str) -> None:
    """A disc on a horizontal shaft, seen a little from the right: its face is to the right of ``x``."""
    thick, radius, squash = 1.1, 1.9, 0.4
    size = (2 * radius * squash, 2 * radius)
    rim: dict[str, Any] = {"edgecolor": INK, "linewidth": THICK}
    sketch.axes.add_patch(Ellipse((x - thick, y), *size, facecolor=SHADE, zorder=3, **rim))
    sketch.axes.add_patch(Rectangle((x - thick, y - radius), thick, 2 * radius, facecolor=SHADE, zorder=3.1))
    for edge in (y - radius, y + radius):
        sketch.line((x - thick, edge), (x, edge), width=THICK, layer=3.2)
    sketch.axes.add_patch(Ellipse((x, y), *size, facecolor=TINT, zorder=3.3, **rim))
    sketch.text(x - 0.05, y + 1.05, name, size=14)


@drawing(15.6, 7.6, 0.43)
def lumped_model(sketch: Sketch) -> None:
    """Two inertias, the spring and the damper between them, and the servo's own friction (Figure 2.2).

    The lumped model. The torque tau turns the inertia J_eq of the servo and the base through the angle theta, against
    the viscous friction B_eq to ground. The spring of stiffness K_s and, beside it, the damper B_l connect J_eq to the
    inertia J_l of the link, which turns through theta plus alpha.
    """
    y, servo, link = 4.0, 5.7, 13.0
    sketch.line((1.0, y), (servo - 1.6, y), width=2.6)
    _disc(sketch, servo, y, "$J_{eq}$")
    # The link's friction acts on its motion relative to the base: it is beside the spring, not to ground.
    fork, tine = (servo + 1.7, link - 2.9), 0.75
    sketch.line((servo, y), (fork[0], y), width=2.6, layer=3.5)
    sketch.line((fork[1], y), (link - 1.5, y), width=2.6)
    for x in fork:
        sketch.line((x, y - tine), (x, y + tine), width=2.6)
    sketch.spring((fork[0], y + tine), (fork[1], y + tine), breadth=0.6)
    sketch.damper((fork[0], y - tine), (fork[1], y - tine))
    middle = sum(fork) / 2
    sketch.signal(middle, y + tine + 0.85, "$K_s$")
    sketch.signal(middle, y - tine - 0.85, "$B_l$")
    _disc(sketch, link, y, "$J_l$")
    # The servo's friction: a bearing on the ground.
    bearing = 2.9
    for edge in (0.17, -0.17):
        sketch.line((bearing - 0.6, y + edge), (bearing + 0.6, y + edge), width=2.2, layer=3)
    sketch.line((bearing, y - 0.17), (bearing, y - 2.2), width=THICK)
    sketch.ground(bearing, y - 2.2, 1.5)
    sketch.signal(bearing - 0.7, y - 1.1, "$B_{eq}$")
    # Angles and torque, all turning the same way.
    sketch.angle((1.4, y), 1.2, -60, 60, "", squash=0.4)
    sketch.signal(1.4, y + 1.6, r"$\tau$")
    for x, name in ((servo, r"$\theta$"), (link, r"$\theta + \alpha$")):
        sketch.angle((x, y), 2.5, 10, 68, "", squash=0.42)
        sketch.signal(x + 0.95, y + 2.3, name, ha="left")
    parts = {"servo and base": servo - 0.5, "joint, twisted by $\\alpha$": middle, "link": link - 0.5}
    for words, x in parts.items():
        sketch.text(x, 1.15, words, size=10.5)


@drawing(15.6, 9.6, 0.43)
def desired_poles(sketch: Sketch) -> None:
    """Where the closed-loop poles shall be, in symbols (Figure 3.1).

    The s-plane with the four desired closed-loop poles, all in the left half. The dominant pair p1 and p2 is at minus
    sigma plus and minus j omega_d: at the distance omega_n from the origin, on the rays whose angle from the negative
    real axis is the inverse cosine of zeta. The poles p3 and p4 are on the real axis, further to the left.
    """
    sigma, omega_d, origin = 4.2, 3.4, (12.4, 4.8)
    p_1, p_2 = (origin[0] - sigma, origin[1] + omega_d), (origin[0] - sigma, origin[1] - omega_d)
    omega_n = float(np.hypot(sigma, omega_d))
    direction = float(np.degrees(np.arctan2(omega_d, -sigma)))
    sketch.axes.add_patch(Rectangle((0, 0), origin[0], 9.6, facecolor=TINT, zorder=0))
    sketch.text(0.3, 9.1, "stable half of the $s$-plane", size=10.5, ha="left")
    sketch.arrow((0.3, origin[1]), (14.9, origin[1]), width=1.2)
    sketch.arrow((origin[0], 0.3), (origin[0], 9.35), width=1.2)
    sketch.text(14.6, origin[1] - 0.5, "Re $s$")
    sketch.text(origin[0] + 0.7, 9.1, "Im $s$")
    sketch.line(origin, p_1, width=THICK)
    sketch.text(*along(p_1, direction + 180, 0.45 * omega_n, 0.45), r"$\omega_n$", size=13)
    sweep = np.radians(np.linspace(direction - 9, 369 - direction, 121))
    circle = [(origin[0] + omega_n * np.cos(t), origin[1] + omega_n * np.sin(t)) for t in sweep]
    sketch.line(*circle, style=(0, (1.2, 1.6)))
    sketch.angle(origin, 1.9, 180, direction, "")
    sketch.text(*along(origin, 161, 3.05), r"$\cos^{-1}\zeta$", size=11)
    for pole, sign in ((p_1, ""), (p_2, "-")):
        sketch.line(pole, (pole[0], origin[1]), style=(0, (4, 2.5)))
        sketch.line(pole, (origin[0], pole[1]), style=(0, (4, 2.5)))
        sketch.text(origin[0] + 0.25, pole[1], rf"${sign}\omega_d$", size=13, ha="left")
    sketch.text(p_1[0] + 0.2, origin[1] - 0.5, r"$-\sigma = -\zeta\omega_n$", size=12, ha="left")
    p_3, p_4 = (4.2, origin[1]), (1.9, origin[1])
    for pole, name, drop in ((p_1, "p_1", 0.6), (p_2, "p_2", -0.6), (p_3, "p_3", 0.6), (p_4, "p_4", 0.6)):
        sketch.axes.plot(*pole, marker="x", markersize=11, markeredgewidth=3, color=BLUE, zorder=5)
        sketch.text(pole[0], pole[1] + drop, f"${name}$", size=13)
    for pole in (p_1, p_2):
        sketch.text(pole[0] - 0.6, pole[1], "dominant", size=10.5, ha="right")
    sketch.text((p_3[0] + p_4[0]) / 2, origin[1] - 0.6, "further left", size=10.5)
