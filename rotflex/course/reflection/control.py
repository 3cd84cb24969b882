"""Section 3 and beyond: what can be asked of the design, the responses and the results tables.

Of the design (3.2 to 3.10), the main steps, and the gain on the own model. Of responses (3.11 to 3.16), the simulation
of the own design, and own numbers against own recordings. Of the tables, whether they repeat the answers. Of notebook
11, the observer, the sampled design and the planned turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import expm

from labcourse.answers.parts import Part
from labcourse.answers.reflection import Comparison
from rotflex import response
from rotflex.config import Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection.common import (
    BUILT,
    CARRIED,
    AnyArray,
    StoredRecording,
    alike,
    listed,
    same_poles,
    same_polynomial,
    stored_channel,
    stored_recording,
    thin_indices,
)
from rotflex.course.reflection.modeling import AGREES, points, value_at
from rotflex.course.spare_design import runs_away
from rotflex.errors import RotflexError
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop, with_actuator
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, OMEGA_N, RATE, SAMPLE_TIME, SETTLING_BAND, ZETA
from rotflex.units import DEG

_SLOW = 0.03  # s, sample time of 4.5 and 4.6
_AXIS = 1e-3  # of the fastest pole: what is nearer to the imaginary axis is on it
_PLACED = 0.1  # relative, of the coefficients: a gain of three digits, for a model of three digits
_COLUMNS = 0.1  # of a column's length: products of several matrices of three digits
_ROUNDED = 0.01  # of the largest terms: a column of W that is carried to zero keeps what three digits have lost
_INVERTED = 2.0  # times as much: T_c may have been rounded before it was inverted
_ASKED = 0.03  # relative, of a damping ratio or frequency: two digits

#: Where a response is recorded → where it is measured.
MEASURED = {"3.11": "3.12", "3.13": "3.14", "3.15": "3.16"}

_OTHER_LOOP = 0.1  # of the step: simulations by Euler and exact ones, limited or not, differ by 3 %
_OTHER_COMMAND = 0.02  # of the step
_LARGEST = "Is it the largest magnitude in the full-size turns?"
#: Of a quantity: its name in a summary, SI per unit of the answer, and how far an honest reading may be from what 400
#: points of the recording show: relative, and in the answer's unit. Of V_max, a peak shorter than 25 ms may be missed.
_QUANTITIES = {
    "t_s": ("settling_time", 1.0, (0.9, 1.12), 0.08, "Which turn did you measure, and from which time do you count?"),
    "PO": ("overshoot", 1.0, (0.85, 1.18), 1.8, "Which turn did you measure, and in per cent of which angle?"),
    "alpha_max_deg": ("max_alpha", DEG, (0.92, 1.09), 0.5, _LARGEST),
    "V_max": ("max_vm", 1.0, (0.9, 1.9), 0.0, _LARGEST),
}
#: The band, and those of two counts less and more: between 400 points, a response may just leave it, or just not.
_BANDS = (SETTLING_BAND, 0.75 * SETTLING_BAND, 1.25 * SETTLING_BAND)


def _by_own_voltage_model(servo: Servo, ask: Callable[..., str | None]) -> Callable[..., str | None]:
    """Put the own model, voltage as input, in place of the last two answers, A and B."""
    return lambda *own: ask(*own[:-2], *with_actuator(own[-2], own[-1], servo))


def control_checks(servo: Servo) -> list[Comparison]:
    """Return the checks of the design, the responses, the tables, and notebook 11.

    Parameters
    ----------
    servo : as the student is told it
    """
    given = ("2.14", "A"), ("2.14", "B")
    wanted, desired, K = ("3.4", "desired_poles"), ("3.4", "polynomial"), ("3.8", "K")
    design = [
        Comparison((("3.2", "polynomial"), ("2.18", "poles")), partial(_polynomial, number="2.18")),
        Comparison((wanted,), _as_asked),
        Comparison((desired, wanted), partial(_polynomial, number="3.4")),
        Comparison((("3.5", "K_c"), ("3.3", "A_c"), ("3.3", "B_c"), desired), _companion_gain),
        Comparison((("3.7", "W"), *given), _by_own_voltage_model(servo, _transforms)),
        Comparison((K, wanted, *given), _by_own_voltage_model(servo, _gain)),
        Comparison((("3.10", "K"), wanted, *given), _by_own_voltage_model(servo, _gain)),
        Comparison((("3.11", "response"), K, *given), _by_own_voltage_model(servo, _simulated)),
    ]
    measured = [
        Comparison(((measured, name), (recorded, "response")), partial(_quantity, CATALOGUE.find(measured).part(name)))
        for recorded, measured in MEASURED.items()
        for name in _QUANTITIES
    ]
    # The gain of partial state feedback is made of an answer, and repeats none.
    tables = [
        Comparison(((table.number, part.name), part.shows), partial(_repeats, part))
        for table in CATALOGUE.tables.values()
        for part in table.parts
        if part.shows is not None and part.name != "K_psf"
    ]
    Phi, Gamma = ("4.5", "Phi"), ("4.5", "Gamma")
    beyond = [
        Comparison((("4.3", "L"), *given), _by_own_voltage_model(servo, _fades)),
        Comparison((Phi, Gamma, *given), _by_own_voltage_model(servo, _held)),
        Comparison((("4.6", "K"), Phi, Gamma, wanted), _sampled),
        Comparison((("4.9", "alpha"), ("4.9", "V_m"), ("2.6", "theta_ddot"), ("2.6", "alpha_ddot")), _flat),
    ]
    return [*design, *measured, *tables, *beyond]


# --- poles and polynomials --------------------------------------------------------------------------------------------


def _polynomial(own: AnyArray, poles: AnyArray, *, number: str) -> str | None:
    if same_polynomial(own, np.poly(np.ravel(poles))):
        return None
    if same_polynomial(np.ravel(own)[::-1], np.poly(np.ravel(poles))):
        return "Which end does it begin at? The question asks for the highest power of s first."
    return (
        f"The roots of this polynomial (np.roots) are {listed(np.roots(np.ravel(own)))}; your own poles of "
        f"question {number} are {listed(poles)}. Which coefficient is off?"
    )


def _as_asked(poles: AnyArray) -> str | None:
    """Ask about poles that grow, or a pair without the damping ratio and the frequency that the task names."""
    if np.real(poles).max() >= 0:
        return "Not all of your desired poles have negative real parts. What does such a pole do to the response?"
    pair = [p for p in poles if p.imag > _AXIS * abs(p)]
    if len(pair) != 1:
        return "The task asks for one pair of complex poles and two real ones. How many pairs have you?"
    omega = abs(pair[0])
    zeta = -pair[0].real / omega
    if alike(zeta, ZETA, _ASKED) and alike(omega, OMEGA_N, _ASKED):
        return None
    return (
        f"Your pair of poles has a damping ratio of {zeta:.2g} and a natural frequency of {omega:.3g} rad/s. Are "
        "these the ones that the task names?"
    )


# --- the companion form -----------------------------------------------------------------------------------------------


def _companion_gain(K_c: AnyArray, A_c: AnyArray, B_c: AnyArray, desired: AnyArray) -> str | None:
    closed = np.poly(A_c - np.reshape(B_c, (4, 1)) @ np.reshape(K_c, (1, 4)))
    if same_polynomial(closed, np.ravel(desired)):
        return None
    return (
        f"With this gain, A_c − B_c·K_c has poles at {listed(np.roots(closed))}, which are not the roots of your "
        "desired polynomial (3.4). Which sign, which order of the coefficients, or what that A_c brings along?"
    )


def _transforms(W: AnyArray, A: AnyArray, B: AnyArray) -> str | None:
    """Ask where W does not carry the own model to the companion form of its polynomial: A W = W A_c, B = W B_c."""
    A_c = np.eye(4, k=1)
    A_c[3] = -np.poly(A).real[:0:-1]
    W = np.asarray(W, dtype=float)
    lost = _ROUNDED * np.linalg.norm(A) * np.linalg.norm(W)
    room = _INVERTED * (_COLUMNS * np.linalg.norm(np.abs(A) @ np.abs(W), axis=0) + lost)
    last = np.linalg.norm(W[:, 3:] - B) <= _COLUMNS * np.linalg.norm(B)
    if last and np.all(np.linalg.norm(W @ A_c - A @ W, axis=0) <= room):
        return None
    return (
        "With this W, inv(W)·A·W and inv(W)·B are not the companion form of your own model (2.14, motor voltage as "
        "input). Is it T times the inverse of T_c, in this order, and not its inverse?"
    )


# --- the gain ---------------------------------------------------------------------------------------------------------


def _gain(K: AnyArray, desired: AnyArray, A: AnyArray, B: AnyArray) -> str | None:
    K = np.reshape(K, (1, 4))
    closed = A - B @ K
    if same_polynomial(np.poly(closed), np.poly(np.ravel(desired)), _PLACED):
        return None
    return (
        f"With this K, your own model (2.14) has its closed-loop poles at {listed(np.linalg.eigvals(closed))}, and you "
        f"wanted {listed(desired)} (3.4). Was K made for this model, and which sign, unit and order has it?"
    )


# --- recordings -------------------------------------------------------------------------------------------------------


def _simulated(stored: StoredRecording, K: AnyArray, A: AnyArray, B: AnyArray) -> str | None:
    """Ask about a simulation of another model or gain. Where the own ones run away, another gain stands in for them."""
    if runs_away(A, B, K):
        return None
    command = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
    step, places = 2 * AMPLITUDE, thin_indices(stored)
    if stored["n"] != command.size:
        return None
    if np.abs(command[places] - stored_channel(stored, "theta_ref")).max() > _OTHER_COMMAND * step:
        return None
    try:
        own = closed_loop(A, B, K, command, saturation=None)["theta"][places]
    except RotflexError:
        return None
    if np.abs(own - stored_channel(stored, "theta")).max() <= _OTHER_LOOP * step:
        return None
    return (
        "With this command, your own A, B (2.14, motor voltage as input) and K (3.8) give another theta. Did you "
        "simulate this model with this K?"
    )


def _quantity(part: Part, given: float, stored: StoredRecording) -> str | None:
    key, unit, (low, high), room, question = _QUANTITIES[part.name]
    seen = stored_recording(stored)
    values = [getattr(response.worst(response.measure(seen, band)), key) for band in _BANDS]
    if None in values or not all(map(math.isfinite, values)):
        return None
    shown = [value / unit for value in values]
    if low * min(shown) - room <= given <= high * max(shown) + room:
        return None
    return f"Your {part.name} of {given:.3g} {part.unit} is not what your own recording shows. {question}"


# --- tables -----------------------------------------------------------------------------------------------------------


def _repeats(part: Part, entry: AnyArray, source: AnyArray) -> str | None:
    if part.kind == "poles":
        same = same_poles(entry, source)
    else:
        same = alike(entry, source, CARRIED, 1e-6 * float(np.abs(np.ravel(source)).max()))
    return None if same else f"{part.name} in the table is not what you answered. Which of the two do you mean?"


# --- beyond the workbook ----------------------------------------------------------------------------------------------


def _fades(L: AnyArray, A: AnyArray, _B: AnyArray) -> str | None:
    fades = np.abs(np.linalg.eigvals((np.eye(4) - np.reshape(L, (4, 1)) @ np.eye(1, 4)) @ expm(A * SAMPLE_TIME))) < 1
    return None if fades.all() else "With your own model (2.14), (I − L·C)·Phi is unstable. Which sign or unit has L?"


def _held(Phi: AnyArray, Gamma: AnyArray, A: AnyArray, _B: AnyArray) -> str | None:
    new, units = np.ravel(Gamma), np.outer([1, 1, _SLOW, _SLOW], [1, 1, 1 / _SLOW, 1 / _SLOW])
    if not alike([*Phi[4], new[4]], [0, 0, 0, 0, 0, 1], 0.0, 1e-6):
        return "The fifth state is the last voltage. What is it one sample later? Do your last rows say that?"
    if not alike(units * Phi[:4, :4], units * expm(A * _SLOW), CARRIED, CARRIED / 2):
        return "Phi without its fifth row and column does not follow from your own A (2.14). Which A, and which time?"
    newest = np.linalg.norm(Phi[2:4, 4]) < np.linalg.norm(new[2:4])
    return None if newest else "By your numbers, the old voltage does more than the new one. Which acts for longer?"


def _sampled(K: AnyArray, Phi: AnyArray, Gamma: AnyArray, desired: AnyArray) -> str | None:
    poles = np.round(np.linalg.eigvals(Phi - np.reshape(Gamma, (5, 1)) @ np.reshape(K, (1, 5))), 4) + 0
    placed = alike(np.poly(poles), np.poly([*np.exp(np.ravel(desired) * _SLOW), 0]), 0.0, BUILT)
    return None if placed else f"Your own Phi − Gamma·K has poles at {listed(poles)}. Where should they be in z?"


def _flat(alpha: Any, V_m: Any, *rates: Any) -> str | None:
    """Ask where the own equations of motion (2.6, B_l = 0) do not move as the own expressions say."""
    for point in points(("theta", *CATALOGUE.find("4.9").part("V_m").symbols)):
        slope = value_at(alpha.diff("gamma_ddot"), point)
        moving = point | {"alpha": value_at(alpha, point), "alpha_dot": slope * point["gamma_3"], "B_l": 0.0}
        moving["theta_dot"] = point["gamma_dot"] - moving["alpha_dot"]
        moving["tau"] = point["a"] * value_at(V_m, point) - point["b"] * moving["theta_dot"]
        wanted = np.array([point["gamma_ddot"], 0.0]) + slope * point["gamma_4"] * np.array([-1.0, 1.0])
        if not alike([value_at(rate, moving) for rate in rates], wanted, AGREES, AGREES):
            return (
                "Your own accelerations (2.6, B_l = 0) are not those of this alpha and V_m. Which sign or term is off?"
            )
    return None
