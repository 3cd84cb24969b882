"""Make docs/moving_arm.svg: the arm as a virtual bench recorded it, in the drawing that the bench console has.

    python tools/make_moving_arm.py

The servo jumps there and back, is held, and the arm swings. The picture moves by CSS alone, stands still for readers
who ask for less motion, and takes the colours of a page that it is put into.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex import hil
from rotflex.experiments import HOLDING
from rotflex.hil.loop import run
from rotflex.recording import Recording
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG
from rotflex.widgets.mechanism import mechanism

TARGET = Path(__file__).resolve().parents[1] / "docs" / "moving_arm.svg"

BENCH = "virtual:?seed=7"
JUMP, REST, HELD = 30 * DEG, 0.4, 3.8  # rad, s, s
FRAMES_PER_SECOND = 25
SIDE = 300  # px, of the drawing; beside it are the traces
TRACES = (330, 40, 350, 100, 30)  # left, top, width, height of each, gap: px
COLOURS = {
    "grid": ("--color-background-border", "#d0d0d0"),
    "reference": ("--color-foreground-muted", "#5c5c5c"),
    "measured": ("--arm-measured", "#b34700"),
    "voltage": ("--arm-spring", "#00785a"),
    "text": ("--color-foreground-primary", "#1a1a1a"),
    "body": ("--color-background-border", "#d8dde2"),
    "model": ("--arm-model", "#005a9c"),
}
ALT = (
    "The bench from above, as it was recorded: the servo jumps by 30 degrees and is held, and the arm on its springs "
    "swings until friction has used up its energy; then the same the other way. Beside it the servo angle and the "
    "deflection of the arm are drawn against time."
)

Motion = tuple[NDArray[np.float64], NDArray[np.float64]]  #: x and y of a point in each frame


def recorded() -> Recording:
    """The servo jumps there and back, on a virtual bench."""
    length = round(2 * (REST + HELD) / SAMPLE_TIME)
    time = np.arange(length) * SAMPLE_TIME
    command = np.where((time >= REST) & (time < 2 * REST + HELD), JUMP, 0.0)
    with hil.open(BENCH) as bench:
        return run(bench, HOLDING(), command, SAMPLE_TIME, {"experiment": "there and back"}, progress=False)


def place(point: dict[str, Any], signals: dict[str, NDArray[np.float64]]) -> Motion:
    """Where a point of a moving drawing is in each frame, in the drawing's own axes."""
    count = len(next(iter(signals.values())))
    x, y = (np.full(count, float(value)) for value in point["at"])
    for step in reversed(point["frame"]):
        if "turn" in step:
            angle = signals[step["turn"]]
            x, y = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
        else:
            by = signals[step["by"]] if step["by"] else 1.0
            x, y = x + step["shift"][0] * by, y + step["shift"][1] * by
    return x, y


def keyframes(name: str, first: Motion, second: Motion | None, stretched: bool) -> tuple[str, str]:
    """CSS that moves a shape with one of its points, or with two; and the transform that it begins with."""
    x, y = first
    transforms = [f"translate({a:.1f}px,{b:.1f}px)" for a, b in zip(x, y, strict=True)]
    if second is not None:
        along = np.unwrap(np.arctan2(second[1] - y, second[0] - x))
        length = np.hypot(second[0] - x, second[1] - y)
        turned = [f" rotate({np.degrees(angle):.2f}deg)" for angle in along]
        scaled = [f" scaleX({factor:.3f})" if stretched else "" for factor in length / length[0]]
        transforms = ["".join(parts) for parts in zip(transforms, turned, scaled, strict=True)]
    if len(set(transforms)) == 1:
        return "", transforms[0]
    return f"@keyframes {name}{{{frames(transforms, 'transform')}}}", transforms[0]


def frames(values: Sequence[str], what: str) -> str:
    """Key frames at equal times; of those that say the same as both neighbours, none."""
    last = len(values) - 1
    kept = [n for n, value in enumerate(values) if n in (0, last) or not values[n - 1] == value == values[n + 1]]
    return "".join(f"{100 * n / last:.4g}%{{{what}:{values[n]}}}" for n in kept)


def shape(item: dict[str, Any], points: Sequence[Motion]) -> str:
    """A shape in the axes of its first two points: from the origin to the right."""
    (x0, y0), (x1, y1) = ((float(x[0]), float(y[0])) for x, y in (points[0], points[min(1, len(points) - 1)]))
    length = math.hypot(x1 - x0, y1 - y0)
    match item["kind"]:
        case "circle":
            return f'<circle r="{item["radius"] * scale():.1f}" fill="none"/>'
        case "dot":
            return f'<circle r="{item["size"]}" stroke="none" class="fill-{item["role"]}"/>'
        case "line":
            return f'<path d="M0 0H{length:.1f}" stroke-width="{item["width"] or 1.5}"/>'
        case "spring":
            turns, swing = item["turns"], item["swing"]
            steps = [(0.12 + 0.76 * n / (2 * turns), (-1) ** n * swing) for n in range(1, 2 * turns)]
            zigzag = "L".join(f"{length * a:.1f} {b:.1f}" for a, b in [(0.12, 0), *steps, (0.88, 0), (1, 0)])
            return f'<path d="M0 0L{zigzag}" fill="none" stroke-width="1.3" vector-effect="non-scaling-stroke"/>'
        case "rectangle":
            x3, y3 = (float(value[0]) for value in points[3])
            height = (-(y1 - y0) * (x3 - x0) + (x1 - x0) * (y3 - y0)) / length
            return (
                f'<rect y="{min(0.0, height):.1f}" width="{length:.1f}" height="{abs(height):.1f}" class="fill-body"/>'
            )
    raise ValueError(f"a shape of kind {item['kind']!r} is not known here")


def scale() -> float:
    """Pixels for a unit of the drawing."""
    drawing = mechanism(0.0, 0.0)
    return SIDE / (drawing.x[1] - drawing.x[0])


def traces(time: NDArray[np.float64], rows: Sequence[tuple[str, NDArray[np.float64], str]]) -> str:
    """Signals against time, one above the other; a line goes along with the drawing."""
    left, top, width, height, gap = TRACES
    parts = []
    for row, (label, values, role) in enumerate(rows):
        base, most = top + row * (height + gap), float(np.abs(values).max()) * 1.1
        zero = base + height * (0.5 if values.min() < -most / 4 else 0.9)
        unit = (zero - base) / most
        line = "L".join(
            f"{left + width * t / time[-1]:.1f} {zero - unit * v:.1f}" for t, v in zip(time, values, strict=True)
        )
        parts.append(f'<path d="M{left} {zero:.1f}h{width}" class="grid" stroke-width="1"/>')
        parts.append(f'<path d="M{line}" fill="none" class="{role}" stroke-width="2"/>')
        parts.append(f'<text x="{left}" y="{base - 6}">{label}</text>')
    bottom = top + 2 * height + gap
    parts.append(f'<path class="now text" d="M{left} {top}V{bottom}" stroke-width="1"/>')
    parts.append(f'<text x="{left + width}" y="{bottom + 16}" text-anchor="end">{time[-1]:.0f} s</text>')
    return "".join(parts)


def picture(recording: Recording) -> str:
    """The SVG."""
    every = round(1 / FRAMES_PER_SECOND / SAMPLE_TIME)
    signals = {name: recording.channels[name].values[::every] for name in ("theta", "alpha")}
    time = recording.time[::every]
    drawing = mechanism(0.0, 0.0)
    pixels, css, body = scale(), [], []
    for number, item in enumerate(drawing.shapes):
        # Up is y there, and down is y here.
        points = [place(point, signals) for point in item["points"]]
        points = [(SIDE / 2 + pixels * x, SIDE / 2 - pixels * y) for x, y in points]
        name = f"arm{number}"
        moving, begins = keyframes(name, points[0], points[1] if len(points) > 1 else None, item["kind"] == "spring")
        css.append(moving)
        animated = f"animation-name:{name};" if moving else ""
        body.append(f'<g class="moves {item["role"]}" style="{animated}transform:{begins}">{shape(item, points)}</g>')
    css.append(f"@keyframes arm-now{{to{{transform:translateX({TRACES[2]}px)}}}}.now{{animation-name:arm-now}}")
    css.append(
        f".moves,.now{{animation-duration:{time[-1]:.2f}s;animation-timing-function:linear;"
        "animation-iteration-count:infinite;stroke-linecap:round;stroke-linejoin:round}"
    )
    for role, (variable, fallback) in COLOURS.items():
        css.append(
            f".arm .{role}{{stroke:var({variable},{fallback})}}.arm .fill-{role}{{fill:var({variable},{fallback})}}"
        )
    css.append(".arm text{font:13px sans-serif;fill:var(--color-foreground-primary,#1a1a1a)}")
    css.append("@media(prefers-reduced-motion:reduce){.moves,.now{animation:none}}")
    rows = [
        ("servo angle θ", signals["theta"] / DEG, "model"),
        ("deflection α of the arm", signals["alpha"] / DEG, "measured"),
    ]
    left, _top, width, *_ = TRACES
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="arm" viewBox="0 0 {left + width + 10} {SIDE}" role="img" '
        f'aria-label="{ALT}">\n<style>{"".join(css)}</style>\n{"".join(body)}\n{traces(time, rows)}\n</svg>\n'
    )


def main() -> None:
    """Record, and draw."""
    TARGET.write_text(picture(recorded()), encoding="utf-8", newline="\n")
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
