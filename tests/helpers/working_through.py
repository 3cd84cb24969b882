"""How a student works through the course, from the derivation to Table 3, with the package's student side.

Each answer is worked out from those before it as the notebooks do it: a mistake goes on into all that is built on it,
and where a gain is of no use, the spare one of the notebooks stands in.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy
from matplotlib.figure import Figure

from rotflex import experiments, response, signals, simulation
from rotflex.course import spare_design
from rotflex.course.questions import CATALOGUE

Where = tuple[str, str]  # question, part
Change = Callable[[Any], Any]

ASKED = CATALOGUE.without(CATALOGUE.optional)  # without optional notebooks
FULL = {(q.number, p.name): p.points for q in ASKED.everything.values() for p in q.parts if p.marked == "auto"}
MEASURED = ("t_s", "PO", "alpha_max_deg", "V_max")


def digits(count: int) -> Change:
    """Rounds numbers, arrays and lists of complex numbers to so many significant digits."""

    def one(x: complex) -> complex:
        return complex(one(x.real), one(x.imag)) if np.imag(x) else float(f"{np.real(x):.{count}g}")

    return lambda value: np.array([one(x) for x in np.ravel(value).tolist()]).reshape(np.shape(value))[()]


@dataclass
class Pen:
    """Takes answers down. A mistake goes on into all that is built on it."""

    mistakes: Mapping[Where, Change]
    answers: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __call__(self, question: str, name: str, value: Any) -> Any:
        given = self.mistakes.get((question, name), lambda value: value)(value)
        self.answers.setdefault(question, {})[name] = given
        return given


STATE = theta, alpha, theta_dot, alpha_dot = sympy.symbols("theta alpha theta_dot alpha_dot")
theta_ddot, alpha_ddot, tau = sympy.symbols("theta_ddot alpha_ddot tau")
J_eq, J_l, B_eq, B_l, K_s = sympy.symbols("J_eq J_l B_eq B_l K_s")
m_1, L_1, m_2, L_2, d_12 = sympy.symbols("m_1 L_1 m_2 L_2 d_12")


def prelab(write: Pen) -> None:
    """Questions 2.1 to 2.8, by sympy."""
    rate = {theta: theta_dot, alpha: alpha_dot, theta_dot: theta_ddot, alpha_dot: alpha_ddot}

    def d_dt(f: Any) -> Any:
        return sum(f.diff(q) * rate[q] for q in rate)

    V = write("2.1", "V", K_s * alpha**2 / 2)
    T = write("2.2", "T", J_eq * theta_dot**2 / 2 + J_l * (theta_dot + alpha_dot) ** 2 / 2)
    L = write("2.3", "L", T - V)
    servo = write("2.4", "equation", sympy.Eq(d_dt(L.diff(theta_dot)) - L.diff(theta) + B_eq * theta_dot, tau))
    link = write("2.5", "equation", sympy.Eq(d_dt(L.diff(alpha_dot)) - L.diff(alpha) + B_l * alpha_dot, 0))
    undamped = [servo.subs(B_l, 0), link.subs(B_l, 0)]
    solved = sympy.solve(undamped, [theta_ddot, alpha_ddot], dict=True)[0]
    first = write("2.6", "theta_ddot", solved[theta_ddot])
    second = write("2.6", "alpha_ddot", solved[alpha_ddot])
    rates = sympy.Matrix([theta_dot, alpha_dot, first, second])
    write("2.7", "A", rates.jacobian(STATE))
    write("2.7", "B", rates.jacobian([tau]))
    write("2.8", "J_l", m_1 * L_1**2 / 3 + m_2 * (L_2**2 / 12 + d_12**2))


def plot(recording: Any, *panels: tuple[str, ...]) -> Figure:
    """Channels over time, with units."""
    figure = Figure()
    for ax, channels in zip(np.ravel(figure.subplots(len(panels), 1)), panels, strict=True):
        for channel in channels:
            ax.plot(recording.time, recording["vm"] if channel == "vm" else recording.degrees(channel), label=channel)
        ax.set(xlabel="time (s)", ylabel="voltage (V)" if "vm" in channels else "angle (deg)")
    return figure


def spectrum(x: Any, dt: float) -> tuple[Any, Any]:
    x = np.asarray(x)
    M = 2 ** int(np.ceil(np.log2(x.size)))
    return np.arange(M // 2) / (M * dt), 2 * np.abs(np.fft.fft(x, M))[: M // 2] / x.size


def state_space(K_s: float, J_l: float, J_eq: float, B_eq: float) -> tuple[Any, Any, Any, Any]:
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [0, K_s / J_eq, -B_eq / J_eq, 0], [0, -K_s / J_eq - K_s / J_l, B_eq / J_eq, 0]]
    return np.array(A), np.array([[0], [0], [1 / J_eq], [-1 / J_eq]]), np.eye(2, 4), np.zeros((2, 1))


def modeling(lab: Any, write: Pen) -> tuple[Any, Any, Any]:
    """Questions 2.9 to 2.18 and Table 2 on a bench. Returns A and B with the motor voltage as input, and its poles."""
    with lab.bench() as bench:
        sweep = write("2.9", "sweep", experiments.sweep(bench, progress=False))
    write("2.9", "figure", plot(sweep, ("alpha",)))
    write("2.10", "spectrum", spectrum)
    f, amplitude = spectrum(sweep.degrees("alpha"), sweep.sample_time)
    figure = Figure()
    axes = figure.subplots()
    axes.plot(f[f < 10], amplitude[f < 10])
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (deg)")
    write("2.10", "figure", figure)
    swept = (f >= 1) & (f <= 5)
    omega_n = write("2.11", "omega_n", 2 * np.pi * f[swept][np.argmax(amplitude[swept])])
    arm, servo = lab.joint, lab.servo
    J_l = write("2.12", "J_l", arm.m_1 * arm.L_1**2 / 3 + arm.m_2 * (arm.L_2**2 / 12 + arm.d_12**2))
    K_s = write("2.12", "K_s", J_l * omega_n**2)
    model = write("2.13", "state_space", state_space)
    matrices = [write("2.14", name, m) for name, m in zip("ABCD", model(K_s, J_l, servo.J_eq, servo.B_eq), strict=True)]
    A, B = simulation.with_actuator(matrices[0], matrices[1], servo)
    with lab.bench() as bench:
        validation = write("2.15", "validation", experiments.validation(bench, A, B, progress=False))
    write("2.15", "figure", plot(validation, ("theta", "theta_model"), ("alpha", "alpha_model")))
    poles = write("2.18", "poles", np.linalg.eigvals(A))
    for name, value in zip(("omega_n", "K_s", *"ABCD", "poles"), (omega_n, K_s, *matrices, poles), strict=True):
        write("Table 2", name, value)
    return A, B, poles


def companion(polynomial: Any) -> Any:
    matrix = np.eye(4, k=1)
    matrix[3] = -np.ravel(polynomial)[:0:-1]
    return matrix


def ctrb(A: Any, B: Any) -> Any:
    return np.hstack([np.linalg.matrix_power(A, i) @ np.reshape(B, (4, 1)) for i in range(4)])


def design(write: Pen, A: Any, B: Any, open_loop: Any) -> dict[str, Any]:
    """Questions 3.1 to 3.10. Returns what Table 3 needs."""
    import control

    write("3.1", "stability", "marginally stable")
    polynomial = write("3.2", "polynomial", np.poly(open_loop).real)
    write("3.3", "A_c", companion(polynomial))
    B_c = np.array([[0], [0], [0], [1]])
    write("3.3", "B_c", B_c)
    poles = write("3.4", "desired_poles", [-12 + 16j, -12 - 16j, -30, -40])
    desired = write("3.4", "polynomial", np.poly(poles).real)
    K_c = write("3.5", "K_c", (desired - polynomial)[:0:-1].reshape(1, 4))
    T = write("3.7", "T", ctrb(A, B))
    write("3.6", "rank", np.linalg.matrix_rank(T))
    write("3.6", "controllable", "yes")
    T_c = write("3.7", "T_c", ctrb(companion(np.poly(A).real), B_c))  # as notebook 06 does: not that of 3.3
    W = write("3.7", "W", T @ np.linalg.inv(T_c))
    table = {"desired_poles": poles, "K_c": K_c, "W": W}
    try:
        K = write("3.8", "K", K_c @ np.linalg.inv(W))
        reached = write("3.9", "poles", np.linalg.eigvals(A - B.reshape(4, 1) @ np.reshape(K, (1, 4))))
        table |= {"K": K, "poles": reached, "K_fsf": K, "K_psf": K * [1, 0, 1, 0]}
        write("3.10", "K", control.place(A, np.reshape(B, (4, 1)), poles))
    except (ValueError, np.linalg.LinAlgError):  # the cell stops, and there is no answer
        pass
    return table


def specifications(write: Pen, question: str, recording: Any) -> dict[str, float]:
    """What is measured on a response, and whether the four specifications are met."""
    worst = response.worst(response.measure(recording))
    numbers = (worst.settling_time, worst.overshoot, np.rad2deg(worst.max_alpha), worst.max_vm)
    found = {name: write(question, name, number) for name, number in zip(MEASURED, numbers, strict=True)}
    limits = {"t_s": 0.5, "PO": 5, "alpha_max_deg": 12.5, "V_max": 10}
    write(question, "satisfied", "yes" if all(found[name] <= limits[name] for name in limits) else "no")
    return found


def gains(lab: Any, A: Any, B: Any, K: Any) -> tuple[Any, Any, Any]:
    """The gains that notebooks 07, 08 and 09 go on with."""
    simulated = None if K is None else spare_design.for_model(A, B, K)
    return simulated, spare_design.for_bench(lab.bench, K), spare_design.for_bench(lab.bench, K, ("full", "partial"))


def responses(lab: Any, write: Pen, A: Any, B: Any, table: dict[str, Any]) -> None:
    """Questions 3.11 to 3.16 and Table 3."""
    simulated, full, both = gains(lab, A, B, table.get("K"))
    command = signals.smooth_square_wave(signals.time_axis(10.0, 0.002), 0.33, np.deg2rad(20), 100)
    runs = {}
    if simulated is not None:
        runs["sim"] = ("3.11", "3.12", simulation.closed_loop(A, B, simulated, command, saturation=None))
    for feedback, suffix, recorded, measured, gain in (
        ("full", "fsf", "3.13", "3.14", full),
        ("partial", "psf", "3.15", "3.16", both),
    ):
        with lab.bench() as bench:
            runs[suffix] = (recorded, measured, experiments.tracking(bench, gain, feedback, progress=False))
    for suffix, (recorded, measured, done) in runs.items():
        run = write(recorded, "response", done)
        write(recorded, "figure", plot(run, ("theta_ref", "theta"), ("alpha",), ("vm",)))
        found = specifications(write, measured, run)
        table |= {f"{name}_{suffix}": found[name] for name in MEASURED[:3]}
    for name, value in table.items():
        write("Table 3", name, value)


def recorded(lab: Any, write: Pen) -> bytes:
    """Work through the whole course, and record all of it. Returns the ``answers.json``."""
    write("0.1", "resolution", 2 * np.pi / 4096)
    prelab(write)
    A, B, poles = modeling(lab, write)
    responses(lab, write, A, B, design(write, A, B, poles))
    for number, parts in write.answers.items():
        lab.answer(number, **parts)
    return lab.book.path.read_bytes()
