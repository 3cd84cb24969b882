"""Drawings for the derivation of the model: a worked example, the motor's circuit, the parallel-axis theorem."""

from __future__ import annotations

from matplotlib.patches import Ellipse, Rectangle

from rotflex.figures.drawings import BACKGROUND, INK, SHADE, THICK, TINT, Point, Sketch, along, drawing


@drawing(15.4, 9.0, 0.43)
def trolley_with_pendulum(sketch: Sketch) -> None:
    """The worked example of the modeling pre-lab: a trolley on a spring, with a pendulum hanging from it.

    A trolley of mass M on a level rail, tied to a wall on the left by a spring of stiffness k and pushed to the right
    by a force F. Its displacement s is counted to the right from where the spring is relaxed. A rod of length l hangs
    from the trolley, with a bob of mass m at its end. The rod makes the angle phi with the vertical; phi is positive
    when the bob is to the right of the trolley.
    """
    pivot, rail, tilt = (8.0, 6.0), 4.6, 28.0
    sketch.line((0.9, rail), (0.9, 7.8), width=3)
    sketch.line((0.9, rail), (15.0, rail), width=3)
    sketch.spring((0.9, 6.3), (6.2, 6.3), coils=7, breadth=0.7)
    sketch.signal(3.5, 7.1, "$k$")
    for wheel in (6.9, 9.1):
        sketch.circle((wheel, rail + 0.3), 0.27, layer=3)
    sketch.block(*pivot, "", width=3.6, height=1.8)
    sketch.signal(7.0, 6.3, "$M$")
    sketch.arrow((9.8, 6.0), (12.2, 6.0))
    sketch.signal(12.7, 6.0, "$F$")
    # The displacement, from where the spring is relaxed to where the trolley is.
    relaxed, height = 5.6, 8.2
    for x, low in ((relaxed, 7.7), (pivot[0], 7.1)):
        sketch.line((x, low), (x, height + 0.3), width=0.8)
    sketch.arrow((relaxed, height), (pivot[0], height), width=1.2)
    sketch.signal((relaxed + pivot[0]) / 2, height + 0.4, "$s$")
    sketch.line(pivot, (pivot[0], 1.0), style=(0, (6, 3)), layer=3.5)
    bob = along(pivot, tilt - 90, 5.2)
    sketch.line(pivot, bob, width=2.5, layer=5)
    sketch.dot(pivot)
    sketch.circle(bob, 0.5, SHADE, 5.5)
    sketch.signal(*bob, "$m$")
    sketch.signal(*along(pivot, tilt - 90, 3.0, 0.5), r"$\ell$")
    sketch.angle(pivot, 3.4, -90, tilt - 90 - 3, "")
    sketch.signal(*along(pivot, tilt / 2 - 90, 3.95), r"$\phi$")


@drawing(15.4, 6.4, 0.43)
def armature_circuit(sketch: Sketch) -> None:
    """The circuit of the motor's armature, and the gears between motor and load (Equation 2.8).

    The circuit of the armature. The voltage V_m drives the current i_m through the resistance R_m and through the
    motor, which opposes it by the back-EMF k_m times the rate of its shaft. The shaft turns at the rate omega_m and
    enters the gears, of ratio K_g to 1. On their other side the load shaft turns at the rate theta dot, with the torque
    tau.
    """
    left, motor, top, bottom = 1.6, 7.4, 5.0, 1.2
    middle = (top + bottom) / 2
    sketch.spring((left, top), (5.6, top), coils=6, breadth=0.6)  # drawn like a resistor
    sketch.signal(3.6, top + 0.75, "$R_m$")
    sketch.line((5.6, top), (motor, top), (motor, bottom), (left, bottom), width=THICK)
    sketch.line((left, top), (left, bottom), width=THICK)
    sketch.arrow((5.9, top), (6.8, top))
    sketch.signal(6.3, top + 0.55, "$i_m$")
    for x, name, fill in ((left, "$V_m$", BACKGROUND), (motor, "M", TINT)):
        sketch.circle((x, middle), 0.75, fill, 3)
        sketch.signal(x, middle, name)
        sketch.text(x + 0.4, middle + 1.1, "$+$")
        sketch.text(x + 0.4, middle - 1.1, "$-$")
    sketch.signal(motor - 1.0, middle, r"$e_b = k_m \omega_m$", ha="right")
    sketch.line((motor + 0.75, middle), (10.2, middle), width=2.6)
    gears = sketch.block(11.3, middle, "gears\n$K_g : 1$", width=2.2, height=2.2)
    sketch.line(gears.right, (14.6, middle), width=2.6)
    for x, name in ((8.7, r"$\omega_m$"), (13.1, r"$\dot\theta,\ \tau$")):
        sketch.angle((x, middle), 0.9, -60, 60, "", squash=0.4)
        sketch.signal(x + 0.4, middle + 1.45, name)


@drawing(15.4, 6.6, 0.43)
def parallel_axes(sketch: Sketch) -> None:
    """A body, its centre of mass, and another axis: the vectors of the parallel-axis theorem.

    A flat body, seen along the axes. An arrow d leads from a new axis outside the body to its centre of mass, an arrow
    rho from the centre of mass to a speck of mass dm, and a third arrow, their sum, from the new axis to the speck.
    """
    axis: Point = (1.6, 1.5)
    centre: Point = (7.6, 3.0)
    speck: Point = (10.2, 4.6)
    sketch.axes.add_patch(Ellipse(centre, 8.6, 4.6, angle=14, facecolor=TINT, edgecolor=INK, lw=THICK, zorder=2))
    for start, end in ((axis, centre), (centre, speck), (axis, speck)):
        sketch.arrow(start, end, width=1.2)
    for point in (axis, centre):
        sketch.circle(point, 0.16)
    sketch.axes.add_patch(Rectangle((speck[0] - 0.13, speck[1] - 0.13), 0.26, 0.26, facecolor=INK, zorder=5))
    sketch.signal(4.6, 1.65, r"$\vec d$")
    sketch.signal(9.3, 3.45, r"$\vec\rho$")
    sketch.signal(4.7, 3.5, r"$\vec d + \vec\rho$", ha="center")
    sketch.signal(10.6, 4.6, "$dm$", ha="left")
    sketch.text(centre[0] + 0.3, centre[1] - 0.5, "centre of mass", size=10.5, ha="left")
    sketch.text(axis[0], axis[1] - 0.6, "new axis", size=10.5)
