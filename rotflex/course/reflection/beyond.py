"""Notebook 11: observer, sampled design and planned turn, each compared with the own model, design and recordings."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import expm

from labcourse.answers.reflection import Check
from rotflex import response
from rotflex.config import Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection import common, modeling
from rotflex.course.reflection.common import CARRIED, Array, Stored
from rotflex.course.reflection.control import driven
from rotflex.hil.controllers import StateFeedback
from rotflex.specifications import SAMPLE_TIME

_SLOW = 0.03  # s, sample time of 4.5 and 4.6
_ON_CIRCLE = 0.02  # of |z|: what is nearer to 1 may be on either side
_LOST = (0.82, 2.2)  # of the own limit: friction moves the bench's limit, and 30 ms may settle where 25 ms is the limit
_BENCH = 0.45  # relative: friction and feedback add that much to a plan
_COUNTS = 0.2  # deg or V: two counts of an encoder; between stored points, the largest may be missed


def checks(servo: Servo) -> list[Check]:
    """Return the checks of notebook 11.

    Parameters
    ----------
    servo : nominal servo, as students know it
    """
    by_voltage, model, plant = partial(driven, servo), "2.14 A, 2.14 B", "4.5 Phi, 4.5 Gamma"
    table = (
        (f"4.1 spare, 4.1 rank_servo, 4.1 rank_link, {model}", by_voltage(_known)),
        ("4.2 deviation_both, 4.2 deviation_servo", partial(_smaller, "How can two encoders know less than one does?")),
        (f"4.3 L, {model}", by_voltage(_fades)),
        ("4.4 noise_observer, 4.4 noise_derivatives", partial(_smaller, "Why is your observer noisier? Which unit?")),
        ("4.4 swing_deg, 4.4 response", partial(_shown, lambda run: np.rad2deg(response.swing(run)), CARRIED)),
        (f"{plant}, {model}", by_voltage(_held)),
        (f"4.6 K, {plant}, 3.4 desired_poles", _placed),
        (f"4.7 limit_ms, {plant}, 3.8 K", _limit),
        ("4.7 lost_ms, 4.7 limit_ms", _lost),
        ("4.8 forgives, 4.8 peak_emulated, 4.8 peak_sampled", _forgives),
        ("4.9 alpha, 4.9 V_m, 2.6 theta_ddot, 2.6 alpha_ddot", _flat),
        ("4.10 alpha_max_deg, 4.10 response", partial(_shown, lambda run: abs(run.degrees("alpha")).max(), _BENCH)),
        ("4.10 V_max, 4.10 response", partial(_shown, lambda run: abs(run["vm"]).max(), _BENCH)),
        ("4.10 swing_deg, 4.10 response", partial(_shown, lambda run: np.rad2deg(response.swing(run)), CARRIED)),
    )
    return [Check(tuple((number, name) for number, name in map(str.split, at.split(", "))), ask) for at, ask in table]


def _known(spare: str, rank_servo: float, rank_link: float, A: Array, _B: Array) -> str | None:
    own = [np.linalg.matrix_rank([np.linalg.matrix_power(A, k)[row] for k in range(4)]) for row in (0, 1)]
    if own != [rank_servo, rank_link]:
        return "With your own A (2.14, motor voltage), at least one of your two ranks is another. Which C did you use?"
    known = [name for name, rank in zip(("link", "servo"), own, strict=True) if rank == 4] or ["neither"]
    return None if spare in known else f"You say {spare!r}. By your own ranks, which encoder alone knows all states?"


def _smaller(question: str, one: float, other: float) -> str | None:
    return None if one < other else question


def _fades(L: Array, A: Array, _B: Array) -> str | None:
    fades = np.abs(np.linalg.eigvals((np.eye(4) - np.reshape(L, (4, 1)) @ np.eye(1, 4)) @ expm(A * SAMPLE_TIME))) < 1
    return None if fades.all() else "With your own model (2.14), (I − L·C)·Phi is unstable. Which sign or unit has L?"


def _shown(measure: Any, room: float, given: float, stored: Stored) -> str | None:
    shown = common.alike(given, measure(common.recording(stored)), room, _COUNTS)
    return None if shown else f"Your {given:.3g} does not fit your own recording. Which unit, which part of the run?"


def _held(Phi: Array, Gamma: Array, A: Array, _B: Array) -> str | None:
    new, units = np.ravel(Gamma), np.outer([1, 1, _SLOW, _SLOW], [1, 1, 1 / _SLOW, 1 / _SLOW])
    if not common.alike([*Phi[4], new[4]], [0, 0, 0, 0, 0, 1], 0.0, 1e-6):
        return "The fifth state is the last voltage. What is it one sample later? Do your last rows say that?"
    if not common.alike(units * Phi[:4, :4], units * expm(A * _SLOW), CARRIED, CARRIED / 2):
        return "Phi without its fifth row and column does not follow from your own A (2.14). Which A, and which time?"
    newest = np.linalg.norm(Phi[2:4, 4]) < np.linalg.norm(new[2:4])
    return None if newest else "By your numbers, the old voltage does more than the new one. Which acts for longer?"


def _placed(K: Array, Phi: Array, Gamma: Array, desired: Array) -> str | None:
    poles = np.round(np.linalg.eigvals(Phi - np.reshape(Gamma, (5, 1)) @ np.reshape(K, (1, 5))), 4) + 0
    placed = common.alike(np.poly(poles), np.poly([*np.exp(np.ravel(desired) * _SLOW), 0]), 0.0, common.BUILT)
    return None if placed else f"Your own Phi − Gamma·K has poles at {common.listed(poles)}. Where should they be in z?"


def _limit(limit_ms: float, Phi: Array, Gamma: Array, K: Array) -> str | None:
    import control

    emulated = StateFeedback(K, sample_time=_SLOW, cutoff=1 / _SLOW).system()
    loop = control.feedback(control.ss(Phi, Gamma, np.eye(2, 5), 0, _SLOW), emulated, sign=1)
    agrees = (np.abs(loop.poles()).max() - 1) * np.sign(1e3 * _SLOW - limit_ms) >= -_ON_CIRCLE
    return None if agrees else "Is your emulated K stable with your own Phi and Gamma (4.5)? Does your limit say so?"


def _lost(lost_ms: str, limit_ms: float) -> str | None:
    agrees = _LOST[0] <= float(lost_ms) / limit_ms <= _LOST[1]
    return None if agrees else f"Your model loses the loop at {limit_ms:.3g} ms. Why is your bench so different?"


def _forgives(answer: str, emulated: float, sampled: float) -> str | None:
    agrees = answer == ("sampled" if sampled < emulated else "emulated")
    return None if agrees else f"You say {answer!r}. Which of your own peaks is higher, and what does a peak tell?"


def _flat(alpha: Any, V_m: Any, *rates: Any) -> str | None:
    """Ask where the own equations of motion (2.6, B_l = 0) do not move as the own expressions say."""
    for point in modeling.points(("theta", *CATALOGUE.find("4.9").part("V_m").symbols)):
        slope = modeling.value_at(alpha.diff("gamma_ddot"), point)
        moving = point | {"alpha": modeling.value_at(alpha, point), "alpha_dot": slope * point["gamma_3"], "B_l": 0.0}
        moving["theta_dot"] = point["gamma_dot"] - moving["alpha_dot"]
        moving["tau"] = point["a"] * modeling.value_at(V_m, point) - point["b"] * moving["theta_dot"]
        wanted = np.array([point["gamma_ddot"], 0.0]) + slope * point["gamma_4"] * np.array([-1.0, 1.0])
        if not common.alike(
            [modeling.value_at(rate, moving) for rate in rates], wanted, modeling.AGREES, modeling.AGREES
        ):
            return (
                "Your own accelerations (2.6, B_l = 0) are not those of this alpha and V_m. Which sign or term is off?"
            )
    return None
