"""Section 2: the derivation, the stiffness, the model, and whether they agree.

Of the derivation (2.1 to 2.8), units that do not go together and steps that do not follow from the one before;
expressions are compared at a few random points. Of the stiffness and the model (2.9 to 2.18), what is measured, what is
built of it, and whether the two agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from labcourse.answers.reflection import Check
from rotflex import signals
from rotflex.config import Joint, Servo
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.course.reflection.common import (
    BUILT,
    CARRIED,
    Array,
    Stored,
    alike,
    channel,
    hertz,
    listed,
    same_poles,
    sweep_spectrum,
    thin_indices,
    unit_of,
)
from rotflex.simulation import along, with_actuator
from rotflex.units import HZ

Point = Mapping[str, float]

_STATE = ("theta", "alpha", "theta_dot", "alpha_dot")
_NAMES = (*_STATE, "theta_ddot", "alpha_ddot", "tau", "J_eq", "J_l", "B_eq", "B_l", "K_s")
_ARMS = ("m_1", "L_1", "m_2", "L_2", "d_12")
_POINTS = 4
AGREES = 2e-3  #: relative: a third may be written 0.333
_STIFFNESS = 1.0  # N·m/rad: any will do, where only signs are looked at
_GROWS = 1e-3  # of the fastest pole: what is nearer to the imaginary axis does not run away

_TIME, _ENERGY, _MASS, _LENGTH = 1.7, 2.3, 3.1, 0.6  # other units of these
#: What a symbol's value becomes in the other units.
_SCALES: Mapping[str, float] = {
    **dict.fromkeys(("theta_dot", "alpha_dot"), 1 / _TIME),
    **dict.fromkeys(("theta_ddot", "alpha_ddot"), _TIME**-2),
    **dict.fromkeys(("tau", "K_s"), _ENERGY),
    **dict.fromkeys(("J_eq", "J_l"), _ENERGY * _TIME**2),
    **dict.fromkeys(("B_eq", "B_l"), _ENERGY * _TIME),
    **dict.fromkeys(("m_1", "m_2"), _MASS),
    **dict.fromkeys(("L_1", "L_2", "d_12"), _LENGTH),
}

_ELSEWHERE = 0.2  # relative, of omega_n: read off a free swing it is up to 10 % low, and a sweep's peak up to 6 % high
_RINGS = 0.1  # relative, of omega_n: K_s and omega_n of two digits are 6 % apart at most
_EXACT = 1e-3  # relative: outputs are stored to six digits, and a third may be 0.333
_HEIGHT = 0.25  # of a test signal's size: peaks between two lines of a spectrum are lower
_MODEL = 0.15  # of an angle's whole range: models of three digits differ by less
_SQUARE_HZ, _STEP_AT = 0.5, 0.5  # Hz and s, as experiments.validation has them
_PULLS = 3.0  # times as far as the bench: friction and the data sheet's tolerances do not make that much


def checks(servo: Servo, joint: Joint, probe_seed: int) -> tuple[Check, ...]:
    """What derivation, stiffness and model can be asked.

    Parameters
    ----------
    servo, joint : as the student is told them
    probe_seed : from which the inputs of functions are drawn
    """
    V, T, L = ("2.1", "V"), ("2.2", "T"), ("2.3", "L")
    theirs, links = ("2.4", "equation"), ("2.5", "equation")
    rates = ("2.6", "theta_ddot"), ("2.6", "alpha_ddot")
    paper = ("2.7", "A"), ("2.7", "B")
    omega_n, K_s, J_l = ("2.11", "omega_n"), ("2.12", "K_s"), ("2.12", "J_l")
    A, B = ("2.14", "A"), ("2.14", "B")
    code, beside = ("2.13", "state_space"), ("2.15", "validation")
    energy, acceleration = _units(_ENERGY, "an energy (N·m)"), _units(_TIME**-2, "an angular acceleration (rad/s²)")
    numbers = partial(_numbers, servo=servo)
    return (
        *(Check((where,), energy) for where in (V, T, L)),
        Check((L, T, V), _lagrangian),
        Check((theirs,), _units_of_equation),
        Check((theirs, L), partial(_follows, coordinate="theta")),
        Check((links,), _units_of_equation),
        Check((links, L), partial(_follows, coordinate="alpha")),
        Check((links,), _carried_along),
        *(Check((where,), acceleration) for where in rates),
        Check((*rates, theirs, links), _solve),
        Check(paper[:1], lambda A: _kinematics(_at_nominal(A, servo, joint))),
        Check((*paper, *rates), _rows_of_accelerations),
        Check(paper[:1], lambda A: _left_alone(_at_nominal(A, servo, joint))),
        Check((("2.8", "J_l"),), _units(_MASS * _LENGTH**2, "an inertia (kg·m²)")),
        Check((J_l, ("2.8", "J_l")), partial(_inertia, joint=joint)),
        Check((("2.10", "spectrum"),), partial(_height, probe_seed=probe_seed)),
        Check((omega_n, ("2.9", "sweep")), _peak),
        Check((K_s, J_l, omega_n), _stiffness),
        Check((code, *paper), partial(_code, probe_seed=probe_seed)),
        Check((code,), _code_by_itself),
        Check((A,), _kinematics),
        Check((A,), _left_alone),
        Check((A, paper[0], K_s, J_l), numbers),
        Check((B, paper[1], K_s, J_l), numbers),
        Check((A, B, omega_n), _rings),
        Check((("2.14", "C"), ("2.14", "D")), _outputs),
        Check((beside,), _beside_the_bench),
        Check((beside, A, B), partial(_recorded_with, servo=servo)),
        Check((("2.18", "poles"), A, B), partial(_open_loop, servo=servo)),
    )


# --- expressions at points --------------------------------------------------------------------------------------------


def points(names: tuple[str, ...]) -> Iterator[dict[str, float]]:
    """Draw a few points: a value of each name."""
    draw = np.random.default_rng(1)
    for _point in range(_POINTS):
        yield dict(zip(names, draw.uniform(0.5, 2.0, len(names)).tolist(), strict=True))


def value_at(expression: Any, point: Point) -> float:
    """The value of an expression at a point.

    Raises
    ------
    ArithmeticError
        If it has no real one there.
    """
    import sympy

    number = sympy.sympify(expression).xreplace({sympy.Symbol(name): sympy.Float(v) for name, v in point.items()})
    found = complex(number)
    if not np.isfinite(found) or abs(found.imag) > 1e-9 * abs(found.real):
        raise ArithmeticError("not a real number")
    return found.real


def _matrix_at(matrix: Any, point: Point) -> Array:
    """The numbers of a matrix of expressions at a point."""
    rows, columns = matrix.shape
    return np.array([[value_at(matrix[i, j], point) for j in range(columns)] for i in range(rows)])


def _residual(equation: Any) -> Any:
    return equation.lhs - equation.rhs


def _close(one: float, other: float, size: float = 0.0) -> bool:
    return abs(one - other) <= AGREES * max(abs(one), abs(other), size, 1e-3)


# --- units ------------------------------------------------------------------------------------------------------------


def _scaled(point: Point) -> dict[str, float]:
    return {name: value * _SCALES.get(name, 1.0) for name, value in point.items()}


def _units(factor: float, what: str) -> Callable[[Any], str | None]:
    """Ask where an expression is not the quantity ``what``, which in the other units is so many times as large."""
    question = (
        f"Each term should be {what}. The units of the symbols give something else in at least one term. "
        "Which term has another unit?"
    )

    def ask(expression: Any) -> str | None:
        pairs = [
            (value_at(expression, _scaled(point)), factor * value_at(expression, point))
            for point in points(_NAMES + _ARMS)
        ]
        return None if all(_close(one, other) for one, other in pairs) else question

    return ask


def _units_of_equation(equation: Any) -> str | None:
    left = _residual(equation)
    ratios = [value_at(left, _scaled(point)) / value_at(left, point) for point in points(_NAMES)]
    if all(_close(one, ratios[0]) for one in ratios):
        return None
    return (
        "Not all terms of your equation have the same unit, if you put in the units of the symbols. Which term has "
        "another unit?"
    )


# --- one step from the one before -------------------------------------------------------------------------------------


def _lagrangian(L: Any, T: Any, V: Any) -> str | None:
    values = [[value_at(one, point) for one in (L, T, V)] for point in points(_NAMES)]
    if all(_close(L, T - V, max(abs(T), abs(V))) for L, T, V in values):
        return None
    return "This L is not the Lagrangian of your own T and V. How do you compute L from T and V?"


def _euler_lagrange(L: Any, coordinate: str, point: Point) -> float:
    """The left side of the Euler-Lagrange equation at rest: what accelerations and angles make of it."""
    import sympy

    rate = sympy.Symbol(f"{coordinate}_dot")
    momentum = sympy.diff(L, rate)
    faster = sum(sympy.diff(momentum, sympy.Symbol(f"{q}_dot")) * sympy.Symbol(f"{q}_ddot") for q in ("theta", "alpha"))
    return value_at(faster - sympy.diff(L, sympy.Symbol(coordinate)), point)


def _affine(f: Callable[[Point], float], point: Point) -> Array:
    """At rest and without a torque: what ``f`` has of each acceleration, and what is left without them."""
    still = {**point, **dict.fromkeys(("theta_dot", "alpha_dot", "tau", "theta_ddot", "alpha_ddot"), 0.0)}
    left = f(still)
    return np.array([f({**still, "theta_ddot": 1.0}) - left, f({**still, "alpha_ddot": 1.0}) - left, left])


def _follows(equation: Any, L: Any, *, coordinate: str) -> str | None:
    """Ask where an equation is no combination of the two that the own L gives: either may be put into the other."""
    left = _residual(equation)
    for point in points(_NAMES):
        given = _affine(lambda p: value_at(left, p), point)
        wanted = np.transpose([_affine(partial(_euler_lagrange, L, q), point) for q in ("theta", "alpha")])
        parts = np.linalg.lstsq(wanted, given, rcond=None)[0]
        if np.linalg.norm(wanted @ parts - given) > AGREES * np.linalg.norm(given):
            return (
                "Without friction and torque, this equation does not follow from your own L (2.3). "
                f"Differentiate your L again, with respect to {coordinate}_dot and then time, and with "
                f"respect to {coordinate}. Which term is different?"
            )
    return None


def _carried_along(equation: Any) -> str | None:
    """Whether an arm that is carried round evenly, unbent, needs nothing but the torque that holds the servo's speed.

    (Which stands in the equation where the servo's was put into it.)
    """
    left = _residual(equation)
    for point in points(_NAMES):
        turning = {**point, **dict.fromkeys(("alpha", "alpha_dot", "theta_ddot", "alpha_ddot"), 0.0)}
        turning["tau"] = point["B_eq"] * point["theta_dot"]
        if not _close(value_at(left, turning), 0.0, point["theta_dot"]):
            return (
                "Let the servo turn at a constant rate, and let the arm turn with it (alpha = 0). Then there is no "
                "deflection and no acceleration, but your equation still has a term. Which one, and with which rate?"
            )
    return None


def _solve(theta_ddot: Any, alpha_ddot: Any, servo: Any, link: Any) -> str | None:
    for point in points(_NAMES):
        undamped = {**point, "B_l": 0.0}
        found = {"theta_ddot": value_at(theta_ddot, undamped), "alpha_ddot": value_at(alpha_ddot, undamped)}
        solved = {**undamped, **found}
        for number, equation in (("2.4", servo), ("2.5", link)):
            left = _residual(equation)
            terms = max(abs(value_at(left, one)) for one in (solved, *({**solved, name: 0.0} for name in found)))
            if abs(value_at(left, solved)) > 2 * AGREES * terms:
                return (
                    f"Your two accelerations do not satisfy your own equation of question {number} with B_l = 0. "
                    "Did you lose a sign or a term when you solved for them?"
                )
    return None


def _rows_of_accelerations(A: Any, B: Any, theta_ddot: Any, alpha_ddot: Any) -> str | None:
    wrong = set()
    for point in points(_NAMES):
        rates = _matrix_at(A, point) @ [point[name] for name in _STATE] + _matrix_at(B, point).ravel() * point["tau"]
        for row, own in ((3, theta_ddot), (4, alpha_ddot)):
            if not _close(rates[row - 1], value_at(own, point)):
                wrong.add(row)
    if not wrong:
        return None
    return (
        "A times the state, plus B times tau, is not your own acceleration of question 2.6 in these rows: "
        f"{' and '.join(map(str, sorted(wrong)))}. Which coefficient is in the wrong column, or has the wrong "
        "sign?"
    )


def _inertia(J_l: float, formula: Any, *, joint: Joint) -> str | None:
    own = value_at(formula, {name: getattr(joint, name) for name in _ARMS})
    if alike(J_l, own, CARRIED / 2):
        return None
    gives = "Your own formula (2.8), with lab.joint's masses and lengths, gives"
    if own and (unit := unit_of(J_l / own)):
        return f"{gives} another size: is it {unit}?"
    return f"{gives} {100 * own / J_l:.0f} % of this J_l. Are these the numbers of your own bench, at its anchor?"


# --- models -----------------------------------------------------------------------------------------------------------


def _at_nominal(A: Any, servo: Servo, joint: Joint) -> Array:
    """A matrix of expressions with the parts' numbers and some stiffness."""
    arm = {"J_l": joint.J_l, "K_s": _STIFFNESS, "B_l": 0.0}
    return _matrix_at(A, {"J_eq": servo.J_eq, "B_eq": servo.B_eq, **arm})


def _kinematics(A: Array) -> str | None:
    """Ask where the first rows of a model's A are not those of angles and their rates."""
    if alike(np.asarray(A)[:2], [[0, 0, 1, 0], [0, 0, 0, 1]], 0.0, 1e-6):
        return None
    return (
        "The first two rows of A give the rates of theta and alpha. These rates are the last two states. With the "
        "states theta, alpha, theta_dot, alpha_dot, do your rows 1 and 2 say this?"
    )


def _left_alone(A: Array) -> str | None:
    """Ask where a model without an input runs away."""
    poles = np.linalg.eigvals(np.asarray(A, dtype=float))
    if poles.real.max() <= _GROWS * max(1.0, np.abs(poles).max()):
        return None
    return (
        "Without any torque, this A has a pole with a positive real part: an arm that is let go swings more and "
        "more. Does your bench do that? If not, which sign is wrong (spring or friction), and in which row?"
    )


# --- what is measured -------------------------------------------------------------------------------------------------


def _height(outputs: list[tuple[Array, ...]], *, probe_seed: int) -> str | None:
    """Whether the peaks of a spectrum, as sines, make a signal as large as the one that it is of."""
    ratios = []
    for (_f, amplitude), (x, _dt) in zip(outputs, COMPOUND_SINES.inputs(probe_seed), strict=True):
        inner = amplitude[1:-1]
        tops = np.sort(inner[(inner >= amplitude[:-2]) & (inner > amplitude[2:])])[-3:]
        ratios.append(math.sqrt(float(np.sum(tops**2)) / 2) / float(np.std(x)))
    ratio = float(np.median(ratios))
    if abs(ratio - 1) <= _HEIGHT:
        return None
    return (
        f"Your function was tried on a test signal. The sines of its spectrum together are {ratio:.2g} times as large "
        "as the signal. Try it on np.sin: how high is the peak of a sine of amplitude 1?"
    )


def _peak(omega_n: float, sweep: Stored) -> str | None:
    omega, amplitude = sweep_spectrum(sweep)
    peak = float(omega[np.argmax(amplitude)])
    if abs(omega_n / peak - 1) <= _ELSEWHERE:
        return None
    question = f"Your omega_n of {omega_n:.3g} rad/s is {hertz(omega_n)}."
    if unit := unit_of(omega_n / peak, _ELSEWHERE):
        return f"{question} The spectrum of your own sweep is not high there. Is it {unit}?"
    if not omega[0] <= omega_n <= omega[-1]:
        return f"{question} Your sweep does not go through that frequency. Which unit is it in?"
    there = 100 * float(np.interp(omega_n, omega, amplitude))
    return (
        f"{question} There, the spectrum of your own sweep has {there:.0f} % of its highest value. Which peak did you "
        "read?"
    )


def _stiffness(K_s: float, J_l: float, omega_n: float) -> str | None:
    own = J_l * omega_n**2
    if alike(K_s, own, BUILT):
        return None
    if alike(K_s, J_l * omega_n, BUILT):
        return "Your K_s is your J_l times your omega_n. Which unit does that product have?"
    if unit := unit_of(K_s / own):
        return f"By your own J_l and omega_n, this K_s has another size. Is it {unit}?"
    return (
        f"With your J_l = {J_l:.3g} kg·m² and K_s = {K_s:.3g} N·m/rad, a link swings at "
        f"{hertz(math.sqrt(abs(K_s / J_l)))}; your omega_n is {hertz(omega_n)}. Which of the three numbers is "
        "wrong?"
    )


# --- the model in code and in numbers ---------------------------------------------------------------------------------


def _code(outputs: list[tuple[Array, ...]], A: Any, B: Any, *, probe_seed: int) -> str | None:
    differing: dict[str, set[int]] = {"A": set(), "B": set()}
    for (code_A, code_B, *_more), parameters in zip(outputs, PLANT_PARAMETERS.inputs(probe_seed), strict=True):
        point = dict(zip(("K_s", "J_l", "J_eq", "B_eq"), parameters, strict=True))
        for name, code, paper in (("A", code_A, _matrix_at(A, point)), ("B", code_B, _matrix_at(B, point))):
            differing[name].update(_rows(code, paper, _EXACT))
    if not any(differing.values()):
        return None
    rows = " and ".join(f"row {_numbered(rows)} of {name}" for name, rows in differing.items() if rows)
    return (
        "With the same parameters, your function and your own A and B of question 2.7 give different numbers in "
        f"{rows}. At least one of the two is wrong. If it is 2.7, which step from 2.1 on is wrong?"
    )


def _code_by_itself(outputs: list[tuple[Array, ...]]) -> str | None:
    return next(filter(None, (_kinematics(A) or _left_alone(A) or _outputs(C, D) for A, _B, C, D in outputs)), None)


def _rows(one: Array, other: Array, rtol: float) -> list[int]:
    """The rows (from 1) in which two matrices differ; small entries are held to the row's largest."""
    a, b = np.reshape(one, (4, -1)), np.reshape(other, (4, -1))
    return [row + 1 for row in range(4) if not alike(a[row], b[row], rtol, 1e-3 * max(np.abs(b[row]).max(), 1e-3))]


def _numbers(matrix: Array, symbols: Any, K_s: float, J_l: float, *, servo: Servo) -> str | None:
    own = _matrix_at(symbols, {"K_s": K_s, "J_l": J_l, "J_eq": servo.J_eq, "B_eq": servo.B_eq})
    rows = _rows(matrix, own, BUILT)
    if not rows:
        return None
    return (
        "Your own matrix of question 2.7, with your K_s and J_l and lab.servo's J_eq and B_eq put in, differs "
        f"from these numbers in row {_numbered(rows)}. Which number, or which sign?"
    )


def _numbered(rows: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(rows)))


def _rings(A: Array, B: Array, omega_n: float) -> str | None:
    """Whether the model's arm, with the servo held, swings as fast as the student has measured."""
    b = np.ravel(B)
    square = -(A[3, 1] - b[3] / b[2] * A[2, 1])
    if not square > 0:
        return (
            "When the servo of your model is held still, its arm does not swing, because nothing pulls it back. Which "
            "signs do the spring's terms have in rows 3 and 4 of A, and which signs does B have?"
        )
    if abs(math.sqrt(square) / omega_n - 1) <= _RINGS:
        return None
    return (
        f"When the servo is held still, the arm of your A swings at {hertz(math.sqrt(square))}. In your own recording, "
        f"it swings at {hertz(omega_n)}. What is wrong: the stiffness (2.12), the inertia, or a term of A?"
    )


def _outputs(C: Array, D: Array) -> str | None:
    if not alike(np.reshape(C, (2, 4)), np.eye(2, 4), 0.0, 1e-6):
        return "The outputs are theta and alpha, in that order. What does your C give of [theta, alpha, ...]?"
    return "With your D, a torque changes an angle at once. Is this possible?" if np.any(np.ravel(D)) else None


# --- the model beside the bench ---------------------------------------------------------------------------------------


def _beside_the_bench(stored: Stored) -> str | None:
    cut = stored["metadata"].get("model_cut_at")
    if cut is not None:
        return (
            f"In this recording your model runs away (at {float(cut):.3g} s), and your bench does not. Which "
            "sign in A of question 2.14 makes it do so?"
        )
    for angle in ("theta", "alpha"):
        ratio = np.ptp(channel(stored, f"{angle}_model")) / np.ptp(channel(stored, angle))
        if not 1 / _PULLS <= ratio <= _PULLS:
            return (
                f"In this recording, {angle} of your model moves {ratio:.2g} times as far as {angle} of your "
                "bench. Is it the model with the motor voltage as input, and what makes B so large or small?"
            )
    return None


def _recorded_with(stored: Stored, A: Array, B: Array, *, servo: Servo) -> str | None:
    """Whether the model's curves are those of the student's own matrices."""
    volts = _voltage(stored)
    if volts is None:
        return None
    angles, cut = along(*with_actuator(A, B, servo), volts, stored["sample_time"])
    if cut is not None or not np.isfinite(angles).all():
        raise ArithmeticError("it runs away")
    model = angles[:, thin_indices(stored)]
    for row, angle in enumerate(("theta", "alpha")):
        there = channel(stored, f"{angle}_model")
        if np.abs(there - model[row]).max() > _MODEL * max(np.ptp(there), np.ptp(model[row])):
            return (
                f"The model's {angle} in this recording is not what your A and B of question 2.14 give with the "
                "motor voltage as input. Was it recorded with an earlier model, or with the torque's?"
            )
    return None


def _voltage(stored: Stored) -> Array | None:
    """The voltage of the experiment, sample by sample; None if it is not one of those known here."""
    size = float(np.abs(channel(stored, "vm")).max())
    t = stored["sample_time"] * np.arange(stored["n"])
    signal = stored["metadata"].get("signal")
    if signal not in ("square", "step"):
        return None
    volts = signals.square_wave(t, _SQUARE_HZ, size) if signal == "square" else signals.step(t, size, at=_STEP_AT)
    return volts if alike(volts[thin_indices(stored)], channel(stored, "vm"), 0.0, 0.02 * size) else None


def _open_loop(poles: Array, A: Array, B: Array, *, servo: Servo) -> str | None:
    own = np.linalg.eigvals(with_actuator(A, B, servo)[0])
    if same_poles(poles, own):
        return None
    if same_poles(poles, np.linalg.eigvals(A)):
        return "These are the poles of A as it is, with the torque as input. Which input does the question name?"
    if same_poles(-np.asarray(poles), own):
        return "These are the poles of your model with all signs turned round. Do they decay, or grow?"
    if same_poles(HZ * np.asarray(poles), own):
        return "Are these in hertz in place of rad/s?"
    return (
        f"The poles of your own A and B (2.14), with the motor voltage as input, are others: not {listed(poles)}. Why?"
    )
