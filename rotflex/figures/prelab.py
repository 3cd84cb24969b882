"""Drawings for the derivation of the model: its worked example."""

from __future__ import annotations

from rotflex.figures.drawings import SHADE, Sketch, along, drawing


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
