"""The mechanism: the joint's angles and lengths, and what it is lumped into."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.patches import Circle, Ellipse, Rectangle

from rotflex.figures.pictures import BLUE, Picture, style
from rotflex.figures.sketch import BACKGROUND, INK, SHADE, THICK, TINT, Sketch, along


def joint_angles() -> Picture:
    """The flexible joint from above: servo angle, deflection, and the lengths of the arms (Figure 2.1)."""
    theta, alpha = 20.0, 20.0
    link, pivot = theta + alpha, (3.4, 3.2)
    # The arms are to scale, with the top arm at anchor 2: a unit is 29.8 mm.
    L_1, L_2, d_12 = 10.0, 5.2, 7.9
    axis_of: dict[str, Any] = {"style": (0, (8, 3, 1.5, 3)), "layer": 4}
    with style():
        sketch = Sketch(15.6, 12.2, scale=0.43)
        # The base, which turns with the servo, and what it turns from.
        sketch.bar(pivot, theta, (-1.7, 3.3), 4.6, TINT)
        sketch.line(pivot, along(pivot, 0, 9.9), **axis_of)
        sketch.text(*along(pivot, 0, 10.1), "fixed axis", size=10.5, ha="left")
        sketch.line(pivot, along(pivot, theta, 10.3), **axis_of)
        sketch.text(*along(pivot, theta, 10.5), "base axis", size=10.5, ha="left")
        for side in (1, -1):
            post = along(pivot, theta, 2.5, 1.95 * side)
            sketch.spring(post, along(pivot, link, 2.6), coils=3 if side > 0 else 5, breadth=0.4, layer=4.5)
            sketch.axes.add_patch(Circle(post, 0.15, facecolor=INK, zorder=5))
        sketch.line(along(pivot, theta, 0.9, -2.0), (6.6, 1.0), width=0.8, layer=6)
        sketch.text(6.7, 1.0, "base, on the load gear of the servo", size=10.5, ha="left")
        # The link: a long arm on the pivot and a short one fixed on top of it.
        sketch.bar(pivot, link, (-0.5, L_1), 0.85, BACKGROUND, layer=5)
        sketch.bar(pivot, link, (d_12 - L_2 / 2, d_12 + L_2 / 2), 0.42, SHADE, layer=5.2)
        sketch.axes.add_patch(Circle(pivot, 0.3, facecolor=BACKGROUND, edgecolor=INK, linewidth=THICK, zorder=5.5))
        for middle in (pivot, along(pivot, link, d_12)):
            sketch.axes.add_patch(Circle(middle, 0.09, facecolor=INK, zorder=5.6))
        sketch.dimension(pivot, link, (d_12 - L_2 / 2, d_12 + L_2 / 2), 0.95, "$L_2$")
        sketch.dimension(pivot, link, (0, d_12), 1.85, "$d_{12}$")
        sketch.dimension(pivot, link, (0, L_1), 2.75, "$L_1$")
        # Names of the arms, with leaders.
        for distance, height, name in ((9.2, 9.0, "top arm, $m_2$"), (7.0, 8.0, "bottom arm, $m_1$")):
            sketch.line(
                along(pivot, link, distance, -0.1 if distance > 9 else -0.3), (12.3, height), width=0.8, layer=6
            )
            sketch.text(12.4, height, name, ha="left")
        sketch.angle(pivot, 5.2, 0, theta, r"$\theta$")
        sketch.angle(pivot, 5.2, theta, link - 4.8, r"$\alpha$")
        sketch.text(
            0.4,
            11.5,
            "Both angles are positive counter-clockwise,\nthe way $V_m > 0$ turns the servo.",
            size=10.5,
            ha="left",
        )
    sketch.figure.alt_text = (
        "The flexible joint seen from above. The base has turned counter-clockwise by the servo angle theta. The "
        "link has turned a further angle alpha from the middle of the base, against two springs. The link is a "
        "long bottom arm of length L1 and mass m1 on the pivot and a short top arm of length L2 and mass m2 "
        "fixed on it; d12 is the distance from the pivot to the middle of the top arm. Both angles are positive "
        "counter-clockwise."
    )
    return sketch.figure


def _disc(sketch: Sketch, x: float, y: float, name: str) -> None:
    """A disc on a horizontal shaft, seen a little from the right: its face is to the right of ``x``."""
    thick, radius, squash = 1.1, 1.9, 0.4
    rim: dict[str, Any] = {"facecolor": SHADE, "edgecolor": INK, "linewidth": THICK}
    sketch.axes.add_patch(Ellipse((x - thick, y), 2 * radius * squash, 2 * radius, zorder=3, **rim))
    sketch.axes.add_patch(Rectangle((x - thick, y - radius), thick, 2 * radius, facecolor=SHADE, zorder=3.1))
    for edge in (y - radius, y + radius):
        sketch.line((x - thick, edge), (x, edge), width=THICK, layer=3.2)
    sketch.axes.add_patch(
        Ellipse((x, y), 2 * radius * squash, 2 * radius, facecolor=TINT, edgecolor=INK, linewidth=THICK, zorder=3.3)
    )
    sketch.text(x - 0.05, y + 1.05, name, size=14)


def lumped_model() -> Picture:
    """Two inertias, the spring and the damper between them, and the servo's own friction (Figure 2.2)."""
    y, servo, link = 4.0, 5.7, 13.0
    with style():
        sketch = Sketch(15.6, 7.6, scale=0.43)
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
        for x, words in (
            (servo - 0.5, "servo and base"),
            (middle, "joint, twisted by $\\alpha$"),
            (link - 0.5, "link"),
        ):
            sketch.text(x, 1.15, words, size=10.5)
    sketch.figure.alt_text = (
        "The lumped model. The torque tau turns the inertia J_eq of the servo and the base through the angle "
        "theta, against the viscous friction B_eq to ground. The spring of stiffness K_s and, beside it, the "
        "damper B_l connect J_eq to the inertia J_l of the link, which turns through theta plus alpha."
    )
    return sketch.figure


def desired_poles() -> Picture:
    """Where the closed-loop poles shall be, in symbols (Figure 3.1)."""
    sigma, omega_d, origin = 4.2, 3.4, (12.4, 4.8)
    p_1, p_2 = (origin[0] - sigma, origin[1] + omega_d), (origin[0] - sigma, origin[1] - omega_d)
    omega_n = float(np.hypot(sigma, omega_d))
    direction = float(np.degrees(np.arctan2(omega_d, -sigma)))
    with style():
        sketch = Sketch(15.6, 9.6, scale=0.43)
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
        sketch.text(p_1[0] - 0.6, p_1[1], "dominant", size=10.5, ha="right")
        sketch.text(p_2[0] - 0.6, p_2[1], "dominant", size=10.5, ha="right")
        sketch.text((p_3[0] + p_4[0]) / 2, origin[1] - 0.6, "further left", size=10.5)
    sketch.figure.alt_text = (
        "The s-plane with the four desired closed-loop poles, all in the left half. The dominant pair p1 and p2 "
        "is at minus sigma plus and minus j omega_d: at the distance omega_n from the origin, on the rays whose "
        "angle from the negative real axis is the inverse cosine of zeta. The poles p3 and p4 are on the real "
        "axis, further to the left."
    )
    return sketch.figure
