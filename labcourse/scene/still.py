"""A scene as a still picture, for a page without widgets: printed, or run by papermill."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import numpy as np

from labcourse.errors import CourseError
from labcourse.pictures import SHOWN_PER_INCH, WIDTH, Picture, style
from labcourse.scene.scene import ROLES, Item, Moving, Panel, Readout, Scene

_MARKERS = {"cross": "x", "square": "s", "circle": "o", "dot": "o"}
_POINTS = 72 / SHOWN_PER_INCH  # of matplotlib, in a px
_LETTERS, _LINE = 13, 16  # of a readout: letters in an inch, px of a line


def picture(scene: Scene) -> Picture:
    """Draw the plots and drawings of a scene, with the readouts that are not folded below them.

    Raises
    ------
    CourseError
        If it has none.
    """
    if not scene.columns:
        raise CourseError("There is nothing to draw yet.")
    width = WIDTH * (1.35 if len(scene.columns) > 1 else 1.0)
    lines = [
        line
        for readout in scene.readouts
        if not readout.folded
        for line in textwrap.wrap(_in_words(readout), round(_LETTERS * width))
    ]
    with style():
        figure = Picture(figsize=(width, (scene.height + _LINE * len(lines)) / SHOWN_PER_INCH), layout="constrained")
        columns = figure.add_gridspec(1, len(scene.columns), width_ratios=[one.width for one in scene.columns])
        for place, column in enumerate(scene.columns):
            heights = [panel.height for panel in column.panels]
            cells = columns[0, place].subgridspec(len(heights), 1, height_ratios=heights)
            for row, panel in enumerate(column.panels):
                axes = figure.add_subplot(cells[row, 0])
                if isinstance(panel, Moving):
                    draw_moving(axes, panel)
                else:
                    _plot(axes, panel)
        if lines:
            # Symbols as M_a with their subscripts.
            text = re.sub(r"\b([A-Z])_([a-z]+)\b", r"$\\mathrm{\1}_{\\mathrm{\2}}$", "\n".join(lines))
            figure.supxlabel(text, fontsize="small")
    figure.alt_text = scene.alt
    return figure


def _in_words(readout: Readout) -> str:
    between = " | " if readout.head else " "
    rows = (" ".join(filter(None, (row.label, between.join(row.values), row.words))) for row in readout.rows)
    heads = f" ({' | '.join(filter(None, readout.head))})" if readout.head else ""
    # A number is not parted from its unit.
    return re.sub(r"(?<=\d) (?=[^\W\d]|[%°])", "\N{NO-BREAK SPACE}", f"{readout.title}{heads}: {'; '.join(rows)}")


def _plot(axes: Any, panel: Panel) -> None:
    axes.set(xlim=panel.x, ylim=panel.y)
    axes.set_xlabel(panel.xlabel, fontsize="small")
    axes.set_ylabel(panel.ylabel, fontsize="small")
    axes.grid(not panel.bare)
    axes.tick_params(labelbottom=bool(panel.xlabel))
    if panel.equal:
        axes.set_aspect("equal")
    for item in panel.items:
        if not item.get("clock"):  # where a player is
            _item(axes, item)
    for handle in panel.handles:
        if handle["shape"] == "cursor":
            _item(axes, handle | {"kind": "level", "at": handle[handle["axis"]], "label": handle["legend"]})
        else:
            _item(axes, handle | {"kind": "mark", "at": [handle["x"], handle["y"]], "label": handle["legend"]})
    labels = axes.get_legend_handles_labels()[1]
    if labels and panel.equal:  # one above it would take its width
        axes.legend(loc="lower left", fontsize="x-small", frameon=True)
    elif labels:
        look = {"fontsize": "x-small", "ncols": min(len(labels), 3), "borderaxespad": 0.0, "columnspacing": 1.0}
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.01), **look)


def _item(axes: Any, item: Item) -> None:
    label = item.get("label") or None
    look = ROLES[item.get("role", "text")]
    if "width" in item:
        look = look | {"linewidth": item["width"] * _POINTS}
    if "dash" in item:
        look = look | {"linestyle": (0, item["dash"]) if item["dash"] else "-"}
    filled = {"color": (look["color"], item.get("opacity", 0.3)), "linewidth": 0, "label": label}
    match item["kind"]:
        case "line":
            axes.plot(item["x"], item["y"], label=label, **look)
        case "area":
            axes.fill(item["x"], item["y"], **filled)
        case "band":
            (axes.axhspan if item["axis"] == "y" else axes.axvspan)(*item["span"], **filled)
        case "level":
            (axes.axhline if item["axis"] == "y" else axes.axvline)(item["at"], label=label, **look)
        case "text":
            axes.text(*item["at"], item["text"], ha=item["anchor"], va="center", color="#555555", fontsize="x-small")
        case "mark" | "points":
            x, y = item["at"] if "at" in item else (item["x"], item["y"])
            fill = "full" if item["shape"] == "dot" else "none"
            marker = {"marker": _MARKERS[item["shape"]], "markersize": 1.4 * item.get("size", 5), "fillstyle": fill}
            axes.plot(x, y, linestyle="none", color=look["color"], label=label, **marker)


def draw_moving(axes: Any, drawing: Moving) -> None:
    """Draw a moving drawing as its signals stand now."""
    axes.set(xlim=drawing.x, ylim=drawing.y, aspect="equal")
    axes.set_axis_off()
    read = [
        f"{one['label']} {drawing.signals[one['signal']] * one['scale']:.{one['digits']}f}{one['unit']}"
        for one in drawing.readings
    ]
    axes.set_title("   ".join(read), fontsize="small", loc="left")
    for shape in drawing.shapes:
        points = np.array([_standing(point, drawing) for point in shape["points"]])
        look = ROLES[shape["role"]]
        match shape["kind"]:
            case "line" if shape["width"]:
                rod = {"linewidth": shape["width"] * _POINTS, "linestyle": "-", "solid_capstyle": "round"}
                axes.plot(*points.T, **look | rod)
            case "line":
                axes.plot(*points.T, **look)
            case "rectangle":
                axes.fill(*points.T, facecolor=ROLES[shape["fill"]]["color"], edgecolor=look["color"], zorder=2)
            case "circle":
                turn = np.linspace(0, 2 * np.pi, 100)
                axes.plot(*(points[0][:, None] + shape["radius"] * np.array([np.cos(turn), np.sin(turn)])), **look)
            case "dot":
                axes.plot(*points[0], "o", markersize=2 * shape["size"] * _POINTS, color=look["color"])
            case "spring":
                along = np.linspace(0, 1, 2 * shape["turns"] + 2)[:, None]
                (x, y), length = points[1] - points[0], np.hypot(*(points[1] - points[0])) or 1.0
                swing = shape["swing"] / 200 * (drawing.y[1] - drawing.y[0])
                side = np.where(np.arange(len(along)) % 2, swing, -swing)
                side[[0, -1]] = 0.0
                zigzag = points[0] + along * (x, y) + side[:, None] * np.array([-y, x]) / length
                axes.plot(*zigzag.T, **look)


def _standing(point: Item, drawing: Moving) -> tuple[float, float]:
    """Where a point is on the ground: through its frames, the innermost first."""
    x, y = point["at"]
    for step in reversed(point["frame"]):
        if "turn" in step:
            turned = np.exp(1j * drawing.signals[step["turn"]]) * complex(x, y)
            x, y = turned.real, turned.imag
        else:
            much = 1.0 if step["by"] is None else drawing.signals[step["by"]]
            x, y = x + step["shift"][0] * much, y + step["shift"][1] * much
    return x, y
