"""The pens that the diagrams are drawn with: blocks and wires, springs, dampers, dimensions and angles.

Coordinates are in units of the drawing, x to the right and y up, with the origin at the lower left corner; angles are
in degrees, counter-clockwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Polygon, Rectangle
from matplotlib.path import Path

from rotflex.figures.pictures import BLACK, new_picture
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

    def arrow(self, *points: Point, heads: str = "-|>", width: float = THICK, color: str = INK) -> None:
        """A line through the points with a filled head at its end (``"<|-|>"``: at both ends)."""
        self.axes.add_patch(
            FancyArrowPatch(
                path=Path(points),
                arrowstyle=f"{heads},head_width=0.22,head_length=0.5",
                mutation_scale=13,
                linewidth=width,
                color=color,
                joinstyle="miter",
                capstyle="butt",
                zorder=4.2,
            )
        )

    def dot(self, point: Point) -> None:
        """A take-off point, where one signal goes two ways."""
        self.axes.add_patch(Circle(point, 0.1, color=INK, zorder=4))

    def contact(self, point: Point) -> None:
        """A contact of a switch."""
        self.axes.add_patch(Circle(point, 0.12, facecolor=BACKGROUND, edgecolor=INK, linewidth=THICK, zorder=5))

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
        self.axes.add_patch(Circle((x, y), radius, facecolor=BACKGROUND, edgecolor=INK, linewidth=THICK, zorder=3))
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
        self.text(
            *middle, text, size=12, bbox={"boxstyle": "round,pad=0.1", "facecolor": BACKGROUND, "edgecolor": "none"}
        )
