"""Section 3: the design and the responses, each step compared with the own one before it, and the results tables.

Of the design (3.1 to 3.10), each step, and the gain on the own model. Of responses (3.11 to 3.16) and tables, own
numbers against own recordings, and against the specifications.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from labcourse.answers.parts import Part
from labcourse.answers.reflection import Check
from rotflex import response
from rotflex.config import Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection.common import (
    CARRIED,
    Array,
    Stored,
    alike,
    channel,
    listed,
    recording,
    same_poles,
    same_polynomial,
    thin_indices,
    unit_of,
)
from rotflex.course.spare_design import SPARE_GAIN, runs_away
from rotflex.errors import RotflexError
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop, with_actuator
from rotflex.specifications import (
    AMPLITUDE,
    DURATION,
    FREQUENCY,
    LIMITS,
    OMEGA_N,
    RATE,
    SAMPLE_TIME,
    SETTLING_BAND,
    ZETA,
)
from rotflex.units import DEG

_AXIS = 1e-3  # of the fastest pole: what is nearer to the imaginary axis is on it
_PLACED = 0.1  # relative, of the coefficients: a gain of three digits, for a model of three digits
_PRODUCTS = 0.02  # of a column's terms, whatever their signs: they may cancel, and three digits with them
_COLUMNS = 0.1  # of a column's length: products of several matrices of three digits
_ROUNDED = 0.01  # of the largest terms: a column of W that is carried to zero keeps what three digits have lost
_INVERTED = 2.0  # times as much: T_c may have been rounded before it was inverted
_ASKED = 0.03  # relative, of a damping ratio or frequency: two digits

#: Where a response is recorded → where it is measured.
MEASURED = {"3.11": "3.12", "3.13": "3.14", "3.15": "3.16"}

_OTHER_LOOP = 0.1  # of the step: simulations by Euler and exact ones, limited or not, differ by 3 %
_OTHER_COMMAND = 0.02  # of the step
_SAME_GAIN = 0.03  # relative: three digits
_NEAR_LIMIT = 0.05  # relative: rounded to two digits, a number may be on the other side of its limit
#: Of a quantity: its name in a summary, SI per unit of the answer, and how far an honest reading may be from what 400
#: points of the recording show: relative, and in the answer's unit.
_QUANTITIES = {
    "t_s": ("settling_time", 1.0, 0.1, 0.08, "s"),
    "PO": ("overshoot", 1.0, 0.15, 1.8, "%"),
    "alpha_max_deg": ("max_alpha", DEG, 0.08, 0.5, "deg"),
}
#: The band, and those of two counts less and more: between 400 points, a response may just leave it, or just not.
_BANDS = (SETTLING_BAND, 0.75 * SETTLING_BAND, 1.25 * SETTLING_BAND)
_PEAK_LOST = (0.9, 1.9)  # V_max over what 400 points show: a peak shorter than 25 ms may be missed
_ANSWERED = ("t_s", "PO", "alpha_max_deg", "V_max")
_ALLOWED = (LIMITS["settling_time"], LIMITS["overshoot"], LIMITS["max_alpha"] / DEG, LIMITS["max_vm"])
_SYMBOLS = ("s", "%", "deg", "V")


def driven(servo: Servo, ask: Callable[..., str | None]) -> Callable[..., str | None]:
    """With the own model, voltage as input, in place of the last two answers, A and B."""
    return lambda *own: ask(*own[:-2], *with_actuator(own[-2], own[-1], servo))


def checks(servo: Servo) -> list[Check]:
    """What the design, the responses and the tables can be asked.

    Parameters
    ----------
    servo : as the student is told it
    """
    given = ("2.14", "A"), ("2.14", "B")
    own_poles, wanted, K = ("2.18", "poles"), ("3.4", "desired_poles"), ("3.8", "K")
    polynomial, desired, companion = ("3.2", "polynomial"), ("3.4", "polynomial"), (("3.3", "A_c"), ("3.3", "B_c"))
    found = [
        Check((("3.1", "stability"), own_poles), _stability),
        Check((polynomial, own_poles), partial(_polynomial, number="2.18")),
        Check(companion, _companion_form),
        Check((companion[0], polynomial), _companion),
        Check((wanted,), _as_asked),
        Check((desired, wanted), partial(_polynomial, number="3.4")),
        Check((("3.5", "K_c"), *companion, desired), _companion_gain),
        Check((("3.7", "T"), *given), driven(servo, partial(_controllability, number="2.14"))),
        Check((("3.6", "rank"), ("3.7", "T")), _rank),
        Check((("3.6", "controllable"), ("3.6", "rank")), _controllable),
        Check((("3.7", "T_c"), *companion), partial(_controllability, number="3.3")),
        Check((("3.7", "W"), *given), driven(servo, _transforms)),
        Check((K, wanted, *given), driven(servo, _gain)),
        Check((("3.9", "poles"), K, *given), driven(servo, _closed_loop)),
        Check((("3.10", "K"), wanted, *given), driven(servo, _gain)),
        Check((("3.11", "response"), K, *given), driven(servo, _simulated)),
    ]
    for recorded, measured in MEASURED.items():
        if recorded != "3.11":
            found.append(Check(((recorded, "response"), K), _recorded_with))
        found += [Check(((measured, name), (recorded, "response")), partial(_quantity, name)) for name in _QUANTITIES]
        found.append(Check(((measured, "V_max"), (recorded, "response")), _voltage))
        found.append(Check(tuple((measured, name) for name in ("satisfied", *_ANSWERED)), _satisfied))
    # Whether a table repeats what the questions have, but where an entry is made of it.
    return found + [
        Check(((table.number, part.name), part.shows), partial(_repeats, part))
        for table in CATALOGUE.tables.values()
        for part in table.parts
        if part.shows is not None
    ]


# --- poles and polynomials --------------------------------------------------------------------------------------------


def _stability(answer: str, poles: Array) -> str | None:
    real, room = np.real(poles), _AXIS * np.abs(poles).max()
    if real.max() > room:
        found, why = "unstable", "one of your own poles (2.18) has a positive real part"
    elif real.max() >= -room:
        found, why = "marginally stable", "one of your own poles (2.18) is on the imaginary axis, none is beyond it"
    else:
        found, why = "stable", "all of your own poles (2.18) have negative real parts"
    if answer == found:
        return None
    return f"You say {answer!r}, and {why}. What becomes of the response as time goes on?"


def _polynomial(own: Array, poles: Array, *, number: str) -> str | None:
    if same_polynomial(own, np.poly(np.ravel(poles))):
        return None
    if same_polynomial(np.ravel(own)[::-1], np.poly(np.ravel(poles))):
        return "Which end does it begin at? The question asks for the highest power of s first."
    return (
        f"The roots of this polynomial (np.roots) are {listed(np.roots(np.ravel(own)))}; your own poles of "
        f"question {number} are {listed(poles)}. Which coefficient is off?"
    )


def _as_asked(poles: Array) -> str | None:
    """Whether the dominant pair has the damping ratio and the frequency that the task names, and all poles decay."""
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


def _companion_form(A_c: Array, B_c: Array) -> str | None:
    if not alike(np.asarray(A_c)[:3], np.eye(4, k=1)[:3], 0.0, 1e-6):
        return "In companion form each state is the rate of the one before. Do rows 1 to 3 of your A_c say that?"
    if not alike(np.ravel(B_c), [0, 0, 0, 1], 0.0, 1e-6):
        return "In companion form the input goes into the last state alone, as it is. Does your B_c say that?"
    return None


def _companion(A_c: Array, polynomial: Array) -> str | None:
    own = np.poly(np.asarray(A_c, dtype=float))
    if same_polynomial(own, np.ravel(polynomial)):
        return None
    return (
        "The characteristic polynomial of your A_c (np.poly) is not your polynomial of question 3.2. In its last row, "
        "which signs have the coefficients, and which stands first?"
    )


def _companion_gain(K_c: Array, A_c: Array, B_c: Array, desired: Array) -> str | None:
    closed = np.poly(A_c - np.reshape(B_c, (4, 1)) @ np.reshape(K_c, (1, 4)))
    if same_polynomial(closed, np.ravel(desired)):
        return None
    return (
        f"With this gain, A_c − B_c·K_c has poles at {listed(np.roots(closed))}, which are not the roots of your "
        "desired polynomial (3.4). Which sign, which order of the coefficients, or what that A_c brings along?"
    )


def _controllability(T: Array, A: Array, B: Array, *, number: str) -> str | None:
    B = np.reshape(B, (4, 1))
    own, terms = (
        np.hstack([np.linalg.matrix_power(a, power) @ b for power in range(4)])
        for a, b in ((A, B), (np.abs(A), np.abs(B)))
    )
    if np.all(np.linalg.norm(np.asarray(T) - own, axis=0) <= _PRODUCTS * np.linalg.norm(terms, axis=0)):
        return None
    return (
        f"It should be [B, A·B, A²·B, A³·B] of your own matrices (question {number}; for T with the motor "
        "voltage as input). Is it, column by column?"
    )


def _rank(rank: float, T: Array) -> str | None:
    lengths = np.linalg.norm(T, axis=0)
    own = int(np.linalg.matrix_rank(T / np.where(lengths > 0, lengths, 1.0)))
    if own == rank:
        return None
    return f"np.linalg.matrix_rank of your own T (3.7), its columns scaled to length 1, is not {rank:g}. Why?"


def _controllable(answer: str, rank: float) -> str | None:
    if (answer == "yes") == (rank == 4):
        return None
    return f"You say {answer!r}, with a rank of {rank:g} and four states. How do these go together?"


def _transforms(W: Array, A: Array, B: Array) -> str | None:
    """Whether W carries the own model to the companion form of its own polynomial: A W = W A_c, B = W B_c."""
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


def _gain(K: Array, desired: Array, A: Array, B: Array) -> str | None:
    K = np.reshape(K, (1, 4))
    closed = A - B @ K
    if same_polynomial(np.poly(closed), np.poly(np.ravel(desired)), _PLACED):
        return None
    poles = np.linalg.eigvals(closed)
    words = f"With this K, your own model (2.14) has its closed-loop poles at {listed(poles)}"
    if poles.real.max() > _AXIS * np.abs(poles).max():
        turned = np.linalg.eigvals(A + B @ K)
        sign = " (with −K it would not)" if turned.real.max() < 0 else ""
        return words + f": it runs away{sign}. Which sign, which order, or which matrix?"
    return (
        words + f", and you wanted {listed(desired)} (3.4). Was K made for this model, in these units and this order?"
    )


def _closed_loop(poles: Array, K: Array, A: Array, B: Array) -> str | None:
    own = np.linalg.eigvals(A - B @ np.reshape(K, (1, 4)))
    if same_poles(poles, own, CARRIED):
        return None
    if same_poles(poles, np.linalg.eigvals(A), CARRIED):
        return "These are the poles of your open loop. What does the feedback make of A?"
    return "np.linalg.eigvals of your own A − B·K (2.14 with the motor voltage, 3.8) are others. Which A, B and K?"


# --- recordings -------------------------------------------------------------------------------------------------------


def _simulated(stored: Stored, K: Array, A: Array, B: Array) -> str | None:
    """Whether the simulation is of the own model and gain. Where these run away, another gain stands in for them."""
    if runs_away(A, B, K):
        return None
    command = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
    step, places = 2 * AMPLITUDE, thin_indices(stored)
    if stored["n"] != command.size:
        return None
    if np.abs(command[places] - channel(stored, "theta_ref")).max() > _OTHER_COMMAND * step:
        return None
    try:
        own = closed_loop(A, B, K, command, saturation=None)["theta"][places]
    except RotflexError:
        return None
    if np.abs(own - channel(stored, "theta")).max() <= _OTHER_LOOP * step:
        return None
    return (
        "With this command, your own A, B (2.14, motor voltage as input) and K (3.8) give another theta. Did you "
        "simulate this model with this K?"
    )


def _recorded_with(stored: Stored, K: Array) -> str | None:
    used = stored["metadata"].get("K")
    if used is None or alike(used, K, _SAME_GAIN, 1e-3) or alike(used, SPARE_GAIN, 1e-3):
        return None
    return "This was recorded with another gain than your K of question 3.8 is now. Is this the gain that you want?"


def _quantity(name: str, given: float, stored: Stored) -> str | None:
    key, unit, rtol, atol, symbol = _QUANTITIES[name]
    seen = recording(stored)
    values = [getattr(response.worst(response.measure(seen, band)), key) for band in _BANDS]
    if None in values or not all(map(math.isfinite, values)):
        return None
    shown, *others = (value / unit for value in values)
    least, most = min(shown, *others), max(shown, *others)
    if least <= given <= most or alike(given, least, rtol, atol) or alike(given, most, rtol, atol):
        return None
    if shown and (unit_meant := unit_of(given / shown, 0.3)):
        return f"Your own recording shows another size for {name}. Is it {unit_meant}?"
    return (
        f"Your {name} of {given:.3g} {symbol} is not what your own recording shows. Which turn did you measure? From "
        "which time do you count, and in per cent of which angle?"
    )


def _voltage(given: float, stored: Stored) -> str | None:
    shown = response.worst(response.measure(recording(stored))).max_vm
    if not shown or _PEAK_LOST[0] <= given / shown <= _PEAK_LOST[1]:
        return None
    return (
        f"Your V_max of {given:.3g} V is not what your own recording shows. Is it the largest "
        "magnitude in the full-size turns?"
    )


# --- specifications ---------------------------------------------------------------------------------------------------


def _satisfied(answer: str, *measured: float) -> str | None:
    shares = [value / limit for value, limit in zip(measured, _ALLOWED, strict=True)]
    if answer == "yes" and max(shares) > 1 + _NEAR_LIMIT:
        worst = int(np.argmax(shares))
        return (
            f"You say that all four are met, and your own {_ANSWERED[worst]} is {measured[worst]:.3g} "
            f"{_SYMBOLS[worst]}; the limit is {_ALLOWED[worst]:.3g} {_SYMBOLS[worst]}. Is it met?"
        )
    if answer == "no" and max(shares) < 1 - _NEAR_LIMIT:
        return "You say that not all four are met, but all four numbers of yours are within the limits. Which is right?"
    return None


# --- tables -----------------------------------------------------------------------------------------------------------


def _repeats(part: Part, entry: Array, source: Array) -> str | None:
    if part.name == "K_psf":
        fed_back = np.ravel(entry)[[0, 2]]
        if alike(fed_back, np.ravel(source)[[0, 2]], CARRIED) and not np.any(np.ravel(entry)[[1, 3]]):
            return None
        return "Which states does partial state feedback use, and what is the gain for the other states?"
    if part.kind == "poles":
        same = same_poles(entry, source)
    else:
        same = alike(entry, source, CARRIED, 1e-6 * float(np.abs(np.ravel(source)).max()))
    return None if same else f"{part.name} in the table is not what you answered. Which of the two do you mean?"
