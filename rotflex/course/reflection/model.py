"""Of the stiffness and the model (2.9 to 2.18): what is measured, what is built of it, and whether the two agree."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from scipy.linalg import expm

from labcourse.answers.reflection import Check
from rotflex import signals
from rotflex.config import Servo
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.course.reflection.derivation import kinematics, left_alone, matrix_at
from rotflex.course.reflection.numbers import BUILT, Array, alike, hertz, listed, same_poles, unit_of
from rotflex.course.reflection.recordings import Kept, channel, sweep_spectrum, thin_indices
from rotflex.simulation import with_actuator
from rotflex.units import HZ

_ELSEWHERE = 0.2  # relative, of omega_n: read off a free swing it is up to 10 % low, and a sweep's peak up to 6 % high
_RINGS = 0.1  # relative, of omega_n: K_s and omega_n of two digits are 6 % apart at most
_EXACT = 1e-3  # relative: outputs are kept to six digits, and a third may be 0.333
_ENERGY = 0.25  # of a test signal's size: peaks between two lines of a spectrum are lower
_MODEL = 0.15  # of an angle's whole range: models of three digits differ by less
_SQUARE_HZ, _STEP_AT = 0.5, 0.5  # Hz and s, as experiments.validation has them
_PULLS = 3.0  # times as far as the bench: friction and the data sheet's tolerances do not make that much


def checks(servo: Servo, probe_seed: int) -> tuple[Check, ...]:
    """What the stiffness and the model can be asked.

    Parameters
    ----------
    servo : as the student is told it
    probe_seed : from which the inputs of functions are drawn
    """
    A, B = ("2.14", "A"), ("2.14", "B")
    return (
        Check((("2.10", "spectrum"),), lambda outputs: _height(outputs, probe_seed)),
        Check((("2.11", "omega_n"), ("2.9", "sweep")), _peak),
        Check((("2.12", "K_s"), ("2.12", "J_l"), ("2.11", "omega_n")), _stiffness),
        Check((("2.13", "state_space"), ("2.7", "A"), ("2.7", "B")), lambda *own: _code(*own, probe_seed=probe_seed)),
        Check((("2.13", "state_space"),), _code_by_itself),
        Check((A,), kinematics),
        Check((A,), left_alone),
        Check((A, ("2.7", "A"), ("2.12", "K_s"), ("2.12", "J_l")), lambda *own: _numbers(*own, servo=servo)),
        Check((B, ("2.7", "B"), ("2.12", "K_s"), ("2.12", "J_l")), lambda *own: _numbers(*own, servo=servo)),
        Check((A, B, ("2.11", "omega_n")), _rings),
        Check((("2.14", "C"), ("2.14", "D")), _outputs),
        Check((("2.15", "validation"),), _beside_the_bench),
        Check((("2.15", "validation"), A, B), lambda *own: _recorded_with(*own, servo=servo)),
        Check((("2.18", "poles"), A, B), lambda *own: _open_loop(*own, servo=servo)),
    )


# --- what is measured -------------------------------------------------------------------------------------------------


def _height(outputs: list[tuple[Array, ...]], probe_seed: int) -> str:
    """Whether the peaks of a spectrum, as sines, make a signal as large as the one that it is of."""
    ratios = []
    for (_f, amplitude), (x, _dt) in zip(outputs, COMPOUND_SINES.inputs(probe_seed), strict=True):
        inner = amplitude[1:-1]
        tops = np.sort(inner[(inner >= amplitude[:-2]) & (inner > amplitude[2:])])[-3:]
        ratios.append(math.sqrt(float(np.sum(tops**2)) / 2) / float(np.std(x)))
    ratio = float(np.median(ratios))
    if abs(ratio - 1) <= _ENERGY:
        return ""
    return (
        f"On a test signal, the sines that your spectrum shows would make a signal {ratio:.2g} times as large as "
        "the one that it was given. Try it on np.sin: how high is the peak of a sine of amplitude 1?"
    )


def _peak(omega_n: float, sweep: Kept) -> str:
    omega, amplitude = sweep_spectrum(sweep)
    peak = float(omega[np.argmax(amplitude)])
    if abs(omega_n / peak - 1) <= _ELSEWHERE:
        return ""
    words = f"Your omega_n of {omega_n:.3g} rad/s is {hertz(omega_n)}."
    unit = unit_of(omega_n / peak, _ELSEWHERE)
    if unit:
        return words + f" The spectrum of your own sweep is not high there. Is it {unit}?"
    if not omega[0] <= omega_n <= omega[-1]:
        return words + " Your sweep does not go through that frequency. Which unit is it in?"
    there = 100 * float(np.interp(omega_n, omega, amplitude))
    return (
        words
        + f" There, the spectrum of your own sweep has {there:.0f} % of its highest value. Which peak did you read?"
    )


def _stiffness(K_s: float, J_l: float, omega_n: float) -> str:
    own = J_l * omega_n**2
    if alike(K_s, own, BUILT):
        return ""
    if alike(K_s, J_l * omega_n, BUILT):
        return "Your K_s is your J_l times your omega_n. Which unit does that product have?"
    unit = unit_of(K_s / own)
    if unit:
        return f"By your own J_l and omega_n, this K_s has another size. Is it {unit}?"
    return (
        f"A mass of inertia J_l = {J_l:.3g} kg·m² on a spring of K_s = {K_s:.3g} N·m/rad swings at "
        f"{hertz(math.sqrt(abs(K_s / J_l)))}; your omega_n is {hertz(omega_n)}. Which of the three numbers is "
        "off?"
    )


# --- the model in code and in numbers ---------------------------------------------------------------------------------


def _code(outputs: list[tuple[Array, ...]], A: Any, B: Any, *, probe_seed: int) -> str:
    names = ("K_s", "J_l", "J_eq", "B_eq")
    differing: dict[str, set[int]] = {"A": set(), "B": set()}
    for (code_A, code_B, *_more), parameters in zip(outputs, PLANT_PARAMETERS.inputs(probe_seed), strict=True):
        point = dict(zip(names, parameters, strict=True))
        for name, code, paper in (("A", code_A, matrix_at(A, point)), ("B", code_B, matrix_at(B, point))):
            differing[name].update(_rows(code, paper, _EXACT))
    if not any(differing.values()):
        return ""
    return (
        "On the same parameters, your function and your own A and B of question 2.7 give different numbers in {rows}. "
        "They cannot both be right. Which is it, and if it is 2.7: which step from 2.1 on?"
    ).format(rows=" and ".join(f"row {_numbered(rows)} of {name}" for name, rows in differing.items() if rows))


def _code_by_itself(outputs: list[tuple[Array, ...]]) -> str:
    for A, _B, C, D in outputs:
        found = kinematics(A) or left_alone(A) or _outputs(C, D)
        if found:
            return found
    return ""


def _rows(one: Array, other: Array, rtol: float) -> list[int]:
    """The rows (from 1) in which two matrices differ; small entries are held to the row's largest."""
    a, b = np.reshape(one, (4, -1)), np.reshape(other, (4, -1))
    return [row + 1 for row in range(4) if not alike(a[row], b[row], rtol, 1e-3 * max(np.abs(b[row]).max(), 1e-3))]


def _numbers(matrix: Array, symbols: Any, K_s: float, J_l: float, *, servo: Servo) -> str:
    own = matrix_at(symbols, {"K_s": K_s, "J_l": J_l, "J_eq": servo.J_eq, "B_eq": servo.B_eq})
    rows = _rows(matrix, own, BUILT)
    if not rows:
        return ""
    return (
        "Your own matrix of question 2.7, with your K_s and J_l and lab.servo's J_eq and B_eq put in, differs "
        f"from these numbers in row {_numbered(rows)}. Which number, or which sign?"
    )


def _numbered(rows: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(rows)))


def _rings(A: Array, B: Array, omega_n: float) -> str:
    """Whether the model's arm, with the servo held, swings as fast as the student has measured."""
    b = np.ravel(B)
    square = -(A[3, 1] - b[3] / b[2] * A[2, 1])
    if not square > 0:
        return (
            "Hold the servo of your model still, and its arm does not swing: nothing pulls it back. Which "
            "sign do the spring's terms have in rows 3 and 4 of A, and what signs has B?"
        )
    if abs(math.sqrt(square) / omega_n - 1) <= _RINGS:
        return ""
    return (
        f"With its servo held still, the arm of your A rings at {hertz(math.sqrt(square))}; by your own "
        f"recording it is {hertz(omega_n)}. Is it the stiffness (2.12), the inertia, or a term of A?"
    )


def _outputs(C: Array, D: Array) -> str:
    if not alike(np.reshape(C, (2, 4)), np.eye(2, 4), 0.0, 1e-6):
        return "The outputs are theta and alpha, in that order. What does your C give of [theta, alpha, ...]?"
    if np.any(np.ravel(D)):
        return "With your D, the torque moves an angle in no time at all. Can it?"
    return ""


# --- the model beside the bench ---------------------------------------------------------------------------------------


def _beside_the_bench(kept: Kept) -> str:
    cut = kept["metadata"].get("model_cut_at")
    if cut is not None:
        return (
            f"In this recording your model runs away (at {float(cut):.3g} s), and your bench does not. Which "
            "sign in A of question 2.14 makes it do so?"
        )
    for angle in ("theta", "alpha"):
        ratio = np.ptp(channel(kept, f"{angle}_model")) / np.ptp(channel(kept, angle))
        if not 1 / _PULLS <= ratio <= _PULLS:
            return (
                f"In this recording, {angle} of your model moves {ratio:.2g} times as far as {angle} of your "
                "bench. Is it the model with the motor voltage as input, and what makes B so large or small?"
            )
    return ""


def _recorded_with(kept: Kept, A: Array, B: Array, *, servo: Servo) -> str:
    """Whether the model's curves are those of the student's own matrices."""
    volts = _voltage(kept)
    if volts is None:
        return ""
    model = _angles(*with_actuator(A, np.reshape(B, (4, 1)), servo), volts, kept["sample_time"])[:, thin_indices(kept)]
    for row, angle in enumerate(("theta", "alpha")):
        there = channel(kept, f"{angle}_model")
        if np.abs(there - model[row]).max() > _MODEL * max(np.ptp(there), np.ptp(model[row])):
            return (
                f"The model's {angle} in this recording is not what your A and B of question 2.14 give with the "
                "motor voltage as input. Was it recorded with an earlier model, or with the torque's?"
            )
    return ""


def _voltage(kept: Kept) -> Array | None:
    """The voltage of the experiment, sample by sample; None if it is not one of those known here."""
    dt, size = kept["sample_time"], float(np.abs(channel(kept, "vm")).max())
    t = dt * np.arange(kept["n"])
    made: dict[Any, Callable[[], Array]] = {
        "square": lambda: signals.square_wave(t, _SQUARE_HZ, size),
        "step": lambda: signals.step(t, size, at=_STEP_AT),
    }
    volts = made.get(kept["metadata"].get("signal"), lambda: None)()
    if volts is None or not alike(volts[thin_indices(kept)], channel(kept, "vm"), 0.0, 0.02 * size):
        return None
    return volts


def _angles(A: Array, B: Array, volts: Array, dt: float) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        step = expm(np.block([[A, B], [np.zeros((1, 5))]]) * dt)
        state, angles = np.zeros(4), np.empty((2, volts.size))
        for index, voltage in enumerate(volts.tolist()):
            angles[:, index] = state[:2]
            state = step[:4, :4] @ state + step[:4, 4] * voltage
    if not np.isfinite(angles).all():
        raise ArithmeticError("it runs away")
    return angles


def _open_loop(poles: Array, A: Array, B: Array, *, servo: Servo) -> str:
    own = np.linalg.eigvals(with_actuator(A, np.reshape(B, (4, 1)), servo)[0])
    if same_poles(poles, own):
        return ""
    if same_poles(poles, np.linalg.eigvals(A)):
        return "These are the poles of A as it is, with the torque as input. Which input does the question name?"
    if same_poles(-np.asarray(poles), own):
        return "These are the poles of your model with all signs turned round. Do they decay, or grow?"
    if same_poles(HZ * np.asarray(poles), own):
        return "Are these in hertz in place of rad/s?"
    return (
        f"The poles of your own A and B (2.14), with the motor voltage as input, are others: not {listed(poles)}. Why?"
    )
