"""Block diagrams of the experiments and of the control loop. Signals on a tinted tag are recorded."""

from __future__ import annotations

from itertools import pairwise

from rotflex.figures.pictures import Picture, style
from rotflex.figures.sketch import THICK, Block, Point, Sketch

_SCALE = 0.4  # inches per unit
_DESIRED_STATE = r"$x_d = [\,\theta_d\;\;0\;\;0\;\;0\,]^T$"


def _two_outputs(sketch: Sketch, plant: Block, end: float, names: tuple[str, str] = (r"\alpha", r"\theta")) -> None:
    """Arrows from the plant to ``end``, with the recorded signals' names on them."""
    for name, rise in zip(names, (0.55, -0.55), strict=True):
        sketch.arrow((plant.right[0], plant.y + rise), (end, plant.y + rise))
        sketch.signal(plant.right[0] + 0.95, plant.y + rise, f"${name}$", recorded=True)


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
        sketch.contact(contact)
    sketch.text(throws[0][0] + 0.2, throws[0][1] + 0.4, "full", size=10.5, ha="left")
    sketch.text(throws[1][0] - 0.1, throws[1][1] - 0.45, "partial", size=10.5)


def sweep_experiment() -> Picture:
    """The sine sweep: a position loop makes the servo follow it, and the link answers (Figure 2.4)."""
    y, low = 3.0, 0.9
    with style():
        sketch = Sketch(17.2, 4.4, _SCALE)
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
    sketch.figure.alt_text = (
        "Block diagram of the sweep experiment. The measured servo angle theta is subtracted from a sine sweep "
        "of 1 to 5 Hz; a position controller turns the difference into the voltage for the servo with the "
        "flexible joint. Recorded are the sweep, the voltage, theta and the deflection alpha."
    )
    return sketch.figure


def validation_experiment() -> Picture:
    """The same voltage to the bench and to the model (Figure 2.6)."""
    y, apart = 3.3, 1.55
    with style():
        sketch = Sketch(17.2, 6.6, _SCALE)
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
        for name, rise in ((r"\alpha_\mathrm{model}", 0.55), (r"\theta_\mathrm{model}", -0.55)):
            sketch.arrow((model.right[0], model.y + rise), (plots.left[0], model.y + rise))
            sketch.signal(model.right[0] + 1.6, model.y + rise, f"${name}$", recorded=True)
        sketch.key(1.8, 0.8)
        sketch.text(bench.x, bench.top[1] + 0.35, "the bench", size=10.5)
        sketch.text(model.x, model.bottom[1] - 0.35, "your model", size=10.5)
    sketch.figure.alt_text = (
        "Block diagram of the validation. One voltage, a step or a square wave, drives the servo with the "
        "flexible joint and, beside it, the state-space model. The measured theta and alpha are recorded with "
        "those of the model and plotted together."
    )
    return sketch.figure


def state_feedback() -> Picture:
    """The state-feedback loop, u = K (x_d - x) (Figure 3.2)."""
    y, low = 2.7, 0.7
    with style():
        sketch = Sketch(17.2, 3.9, _SCALE)
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
    sketch.figure.alt_text = (
        "Block diagram of state feedback. The state x is subtracted from the desired state x_d; the gain K turns "
        "the difference into the motor voltage u of the plant x' = A x + B u. The state is taken off before the "
        "output matrix C."
    )
    return sketch.figure


def simulation_loop() -> Picture:
    """The closed loop as it is simulated, with the switch between full and partial feedback (Figure 3.3)."""
    y = 5.2
    with style():
        sketch = Sketch(18.8, 6.3, 0.385)
        wave = sketch.block(1.45, y, "square wave\n±1, 0.33 Hz", 2.5, size=9.5)
        limiter = sketch.block(4.05, y, "rate\nlimiter", 1.7, size=9.5)
        amplitude = sketch.block(6.4, y, "amplitude\n20 deg", 2.0, size=9.5)
        junction = sketch.junction(9.1, y, {"left": "+", "bottom": "-"})
        gain = sketch.block(10.5, y, "$K$", 1.1, size=14)
        limit = sketch.block(12.35, y, "limit\n±10 V", 1.6, size=9.5)
        model = sketch.block(15.8, y, r"$\dot{x} = Ax + Bu$", 2.8, size=11.5)
        chain = (wave, limiter, amplitude, junction, gain, limit, model)
        for start, end in pairwise(chain):
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
    sketch.figure.alt_text = (
        "Block diagram of the simulation. A square wave of 0.33 Hz, smoothed by a rate limiter and scaled to 20 "
        "deg, is the desired servo angle. The state of the linear model is fed back: all of it, or, with the "
        "switch at partial, with the deflection and its rate set to zero. The gain K and a limit of 10 V turn "
        "the difference into the motor voltage. Recorded are the desired angle, the voltage, theta and alpha."
    )
    return sketch.figure


def implementation_loop() -> Picture:
    """The closed loop on the bench: filtered derivatives, the voltage's limit, and the switch (Figure 3.5)."""
    y, direct, filtered = 5.7, 3.8, 2.0
    with style():
        sketch = Sketch(18.0, 6.9, 0.4)
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
    sketch.figure.alt_text = (
        "Block diagram of the control loop on the bench. Encoders measure theta and alpha; derivative filters "
        "add their rates, which completes the state. A switch feeds back the full state, or the partial one with "
        "alpha and its rate set to zero. The difference from the desired angle, a smoothed square wave of plus "
        "and minus 20 deg, goes through the gain K and a limit of 10 V to the servo. Recorded are the desired "
        "angle, the voltage, theta and alpha."
    )
    return sketch.figure
