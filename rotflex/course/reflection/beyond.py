"""Notebook 11: what can be asked of the observer, the sampled design and the planned turn."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import expm

from labcourse.answers.reflection import Comparison
from rotflex.config import Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection import common, modeling
from rotflex.course.reflection.common import CARRIED, AnyArray
from rotflex.course.reflection.control import by_own_voltage_model
from rotflex.specifications import SAMPLE_TIME

_SLOW = 0.03  # s, sample time of 4.5 and 4.6


def beyond_checks(servo: Servo) -> list[Comparison]:
    """Return the checks of notebook 11.

    Parameters
    ----------
    servo : nominal servo, as students know it
    """
    A, B = ("2.14", "A"), ("2.14", "B")
    Phi, Gamma = ("4.5", "Phi"), ("4.5", "Gamma")
    return [
        Comparison((("4.3", "L"), A, B), by_own_voltage_model(servo, _fades)),
        Comparison((Phi, Gamma, A, B), by_own_voltage_model(servo, _held)),
        Comparison((("4.6", "K"), Phi, Gamma, ("3.4", "desired_poles")), _placed),
        Comparison((("4.9", "alpha"), ("4.9", "V_m"), ("2.6", "theta_ddot"), ("2.6", "alpha_ddot")), _flat),
    ]


def _fades(L: AnyArray, A: AnyArray, _B: AnyArray) -> str | None:
    fades = np.abs(np.linalg.eigvals((np.eye(4) - np.reshape(L, (4, 1)) @ np.eye(1, 4)) @ expm(A * SAMPLE_TIME))) < 1
    return None if fades.all() else "With your own model (2.14), (I − L·C)·Phi is unstable. Which sign or unit has L?"


def _held(Phi: AnyArray, Gamma: AnyArray, A: AnyArray, _B: AnyArray) -> str | None:
    new, units = np.ravel(Gamma), np.outer([1, 1, _SLOW, _SLOW], [1, 1, 1 / _SLOW, 1 / _SLOW])
    if not common.alike([*Phi[4], new[4]], [0, 0, 0, 0, 0, 1], 0.0, 1e-6):
        return "The fifth state is the last voltage. What is it one sample later? Do your last rows say that?"
    if not common.alike(units * Phi[:4, :4], units * expm(A * _SLOW), CARRIED, CARRIED / 2):
        return "Phi without its fifth row and column does not follow from your own A (2.14). Which A, and which time?"
    newest = np.linalg.norm(Phi[2:4, 4]) < np.linalg.norm(new[2:4])
    return None if newest else "By your numbers, the old voltage does more than the new one. Which acts for longer?"


def _placed(K: AnyArray, Phi: AnyArray, Gamma: AnyArray, desired: AnyArray) -> str | None:
    poles = np.round(np.linalg.eigvals(Phi - np.reshape(Gamma, (5, 1)) @ np.reshape(K, (1, 5))), 4) + 0
    placed = common.alike(np.poly(poles), np.poly([*np.exp(np.ravel(desired) * _SLOW), 0]), 0.0, common.BUILT)
    return None if placed else f"Your own Phi − Gamma·K has poles at {common.listed(poles)}. Where should they be in z?"


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
