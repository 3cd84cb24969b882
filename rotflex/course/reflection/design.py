"""Of the design (3.1 to 3.10): each step against the own one before it, and the gain against the own model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from labcourse.answers.reflection import Check
from rotflex.config import Servo
from rotflex.course.reflection.numbers import (
    CARRIED,
    Array,
    alike,
    listed,
    same_poles,
    same_polynomial,
)
from rotflex.simulation import with_actuator
from rotflex.specifications import OMEGA_N, ZETA

_AXIS = 1e-3  # of the fastest pole: what is nearer to the imaginary axis is on it
_PLACED = 0.1  # relative, of the coefficients: a gain of three digits, for a model of three digits
_PRODUCTS = 0.02  # of a column's terms, whatever their signs: they may cancel, and three digits with them
_COLUMNS = 0.1  # of a column's length: products of several matrices of three digits
_ROUNDED = 0.01  # of the largest terms: a column of W that is carried to zero keeps what three digits have lost
_INVERTED = 2.0  # times as much: T_c may have been rounded before it was inverted
_ASKED = 0.03  # relative, of a damping ratio or frequency: two digits
_GIVEN = ("2.14", "A"), ("2.14", "B")


def checks(servo: Servo) -> tuple[Check, ...]:
    """What the design can be asked.

    Parameters
    ----------
    servo : as the student is told it
    """

    def driven(ask: Callable[..., str]) -> Callable[..., str]:
        """With the own model, voltage as input, in place of the last two answers, A and B."""
        return lambda *own: ask(*own[:-2], *with_actuator(own[-2], np.reshape(own[-1], (4, 1)), servo))

    polynomial, desired = ("3.2", "polynomial"), ("3.4", "polynomial")
    return (
        Check((("3.1", "stability"), ("2.18", "poles")), _stability),
        Check((polynomial, ("2.18", "poles")), lambda own, poles: _polynomial(own, poles, "2.18")),
        Check((("3.3", "A_c"), ("3.3", "B_c")), _companion_form),
        Check((("3.3", "A_c"), polynomial), _companion),
        Check((("3.4", "desired_poles"),), _as_asked),
        Check((desired, ("3.4", "desired_poles")), lambda own, poles: _polynomial(own, poles, "3.4")),
        Check((("3.5", "K_c"), ("3.3", "A_c"), ("3.3", "B_c"), desired), _companion_gain),
        Check((("3.7", "T"), *_GIVEN), driven(lambda T, A, B: _controllability(T, A, B, "2.14"))),
        Check((("3.6", "rank"), ("3.7", "T")), _rank),
        Check((("3.6", "controllable"), ("3.6", "rank")), _controllable),
        Check(
            (("3.7", "T_c"), ("3.3", "A_c"), ("3.3", "B_c")),
            lambda T_c, A_c, B_c: _controllability(T_c, A_c, np.reshape(B_c, (4, 1)), "3.3"),
        ),
        Check((("3.7", "W"), *_GIVEN), driven(_transforms)),
        Check((("3.8", "K"), ("3.4", "desired_poles"), *_GIVEN), driven(_gain)),
        Check((("3.9", "poles"), ("3.8", "K"), *_GIVEN), driven(_closed_loop)),
        Check((("3.10", "K"), ("3.4", "desired_poles"), *_GIVEN), driven(_gain)),
    )


# --- poles and polynomials --------------------------------------------------------------------------------------------


def _stability(said: str, poles: Array) -> str:
    real, room = np.real(poles), _AXIS * np.abs(poles).max()
    if real.max() > room:
        found, why = "unstable", "one of your own poles (2.18) has a positive real part"
    elif real.max() >= -room:
        found, why = "marginally stable", "one of your own poles (2.18) is on the imaginary axis, none is beyond it"
    else:
        found, why = "stable", "all of your own poles (2.18) have negative real parts"
    if said == found:
        return ""
    return f"You say {said!r}, and {why}. What becomes of the response as time goes on?"


def _polynomial(own: Array, poles: Array, number: str) -> str:
    if same_polynomial(own, np.poly(np.ravel(poles))):
        return ""
    if same_polynomial(np.ravel(own)[::-1], np.poly(np.ravel(poles))):
        return "Which end does it begin at? The question asks for the highest power of s first."
    return (
        f"The roots of this polynomial (np.roots) are {listed(np.roots(np.ravel(own)))}; your own poles of "
        f"question {number} are {listed(poles)}. Which coefficient is off?"
    )


def _as_asked(poles: Array) -> str:
    """Whether the dominant pair has the damping ratio and the frequency that the task names, and all poles decay."""
    if np.real(poles).max() >= 0:
        return "Not all of your desired poles have negative real parts. What does such a pole do to the response?"
    pair = [p for p in poles if p.imag > _AXIS * abs(p)]
    if len(pair) != 1:
        return "The task asks for one pair of complex poles and two real ones. How many pairs have you?"
    omega = abs(pair[0])
    zeta = -pair[0].real / omega
    if alike(zeta, ZETA, _ASKED) and alike(omega, OMEGA_N, _ASKED):
        return ""
    return (
        f"Your pair of poles has a damping ratio of {zeta:.2g} and a natural frequency of {omega:.3g} rad/s. Are "
        "these the ones that the task names?"
    )


# --- the companion form -----------------------------------------------------------------------------------------------


def _companion_form(A_c: Array, B_c: Array) -> str:
    if not alike(np.asarray(A_c)[:3], np.eye(4, k=1)[:3], 0.0, 1e-6):
        return "In companion form each state is the rate of the one before. Do rows 1 to 3 of your A_c say that?"
    if not alike(np.ravel(B_c), [0, 0, 0, 1], 0.0, 1e-6):
        return "In companion form the input goes into the last state alone, as it is. Does your B_c say that?"
    return ""


def _companion(A_c: Array, polynomial: Array) -> str:
    own = np.poly(np.asarray(A_c, dtype=float))
    if same_polynomial(own, np.ravel(polynomial)):
        return ""
    return (
        "The characteristic polynomial of your A_c (np.poly) is not your polynomial of question 3.2. In its last row, "
        "which signs have the coefficients, and which stands first?"
    )


def _companion_gain(K_c: Array, A_c: Array, B_c: Array, desired: Array) -> str:
    closed = np.poly(A_c - np.reshape(B_c, (4, 1)) @ np.reshape(K_c, (1, 4)))
    if same_polynomial(closed, np.ravel(desired)):
        return ""
    return (
        f"With this gain, A_c − B_c·K_c has poles at {listed(np.roots(closed))}, which are not the roots of your "
        "desired polynomial (3.4). Which sign, which order of the coefficients, or what that A_c brings along?"
    )


def _controllability(T: Array, A: Array, B: Array, number: str) -> str:
    own, terms = (
        np.hstack([np.linalg.matrix_power(a, power) @ b for power in range(4)])
        for a, b in ((A, B), (np.abs(A), np.abs(B)))
    )
    if np.all(np.linalg.norm(np.asarray(T) - own, axis=0) <= _PRODUCTS * np.linalg.norm(terms, axis=0)):
        return ""
    return (
        f"It should be [B, A·B, A²·B, A³·B] of your own matrices (question {number}; for T with the motor "
        "voltage as input). Is it, column by column?"
    )


def _rank(rank: float, T: Array) -> str:
    lengths = np.linalg.norm(T, axis=0)
    own = int(np.linalg.matrix_rank(T / np.where(lengths > 0, lengths, 1.0)))
    if own == rank:
        return ""
    return f"np.linalg.matrix_rank of your own T (3.7), its columns scaled to length 1, is not {rank:g}. Why?"


def _controllable(said: str, rank: float) -> str:
    if (said == "yes") == (rank == 4):
        return ""
    return f"You say {said!r}, with a rank of {rank:g} and four states. How do these go together?"


def _transforms(W: Array, A: Array, B: Array) -> str:
    """Whether W carries the own model to the companion form of its own polynomial: A W = W A_c, B = W B_c."""
    A_c = np.eye(4, k=1)
    A_c[3] = -np.poly(A).real[:0:-1]
    W = np.asarray(W, dtype=float)
    lost = _ROUNDED * np.linalg.norm(A) * np.linalg.norm(W)
    room = _INVERTED * (_COLUMNS * np.linalg.norm(np.abs(A) @ np.abs(W), axis=0) + lost)
    last = np.linalg.norm(W[:, 3:] - B) <= _COLUMNS * np.linalg.norm(B)
    if last and np.all(np.linalg.norm(W @ A_c - A @ W, axis=0) <= room):
        return ""
    return (
        "With this W, inv(W)·A·W and inv(W)·B are not the companion form of your own model (2.14, motor voltage as "
        "input). Is it T times the inverse of T_c, in this order, and not its inverse?"
    )


# --- the gain ---------------------------------------------------------------------------------------------------------


def _gain(K: Array, desired: Array, A: Array, B: Array) -> str:
    K = np.reshape(K, (1, 4))
    closed = A - B @ K
    if same_polynomial(np.poly(closed), np.poly(np.ravel(desired)), _PLACED):
        return ""
    poles = np.linalg.eigvals(closed)
    words = f"With this K, your own model (2.14) has its closed-loop poles at {listed(poles)}"
    if poles.real.max() > _AXIS * np.abs(poles).max():
        turned = np.linalg.eigvals(A + B @ K)
        sign = " (with −K it would not)" if turned.real.max() < 0 else ""
        return words + f": it runs away{sign}. Which sign, which order, or which matrix?"
    return (
        words + f", and you wanted {listed(desired)} (3.4). Was K made for this model, in these units and this order?"
    )


def _closed_loop(poles: Array, K: Array, A: Array, B: Array) -> str:
    own = np.linalg.eigvals(A - B @ np.reshape(K, (1, 4)))
    if same_poles(poles, own, CARRIED):
        return ""
    if same_poles(poles, np.linalg.eigvals(A), CARRIED):
        return "These are the poles of your open loop. What does the feedback make of A?"
    return "np.linalg.eigvals of your own A − B·K (2.14 with the motor voltage, 3.8) are others. Which A, B and K?"
