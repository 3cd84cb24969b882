"""How late a board's output may come before a loop is unstable: the sampled loop, its delay included, linear."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, expm

from rotflex.plant import PlantParameters

SAMPLE_TIME = 0.002
STEP = 1e-4  # s


def plant_matrices(p: PlantParameters) -> tuple[np.ndarray, np.ndarray]:
    """A (4, 4) and B (4, 1) of the frictionless plant, with phi = theta + alpha: states theta, phi and their rates."""
    damping = p.B_eq + p.torque_per_volt * p.back_emf
    spring, damper = np.array([1.0, -1.0]) * p.K_s, np.array([1.0, -1.0]) * p.B_l
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2] = np.concatenate([-spring, -damper - [damping, 0]]) / p.J_eq
    A[3] = np.concatenate([spring, damper]) / p.J_l
    return A, np.array([[0.0], [0.0], [p.torque_per_volt / p.J_eq], [0.0]])


def spectral_radius(p: PlantParameters, gain: Sequence[float], cutoff: float, delay: float) -> float:
    """Of the loop u = −gain · (theta, alpha, and their derivatives up to ``cutoff`` rad/s), late by ``delay`` (s).

    Above 1 it is unstable. The state is the plant's, the filters' two and the outputs that are on their way.
    """
    A, B = plant_matrices(p)
    whole, rest = divmod(round(delay / STEP), round(SAMPLE_TIME / STEP))

    def held(duration: float) -> tuple[np.ndarray, np.ndarray]:
        moved = expm(np.block([[A, B], [np.zeros((1, 5))]]) * duration)
        return moved[:4, :4], moved[:4, 4:]

    (early, by_old), (late, by_new) = held(rest * STEP), held(SAMPLE_TIME - rest * STEP)
    angles = np.array([[1.0, 0, 0, 0], [-1.0, 1.0, 0, 0]])  # theta, alpha
    k = np.asarray(gain, dtype=float)
    size = 4 + 2 + whole + 1
    law = np.zeros(size)
    law[:4] = -(k[:2] + k[2:] * cutoff) @ angles
    law[4:6] = k[2:] * cutoff

    def output(samples_ago: int) -> np.ndarray:
        return law if samples_ago == 0 else np.eye(size)[5 + samples_ago]

    step = block_diag(late @ early, (1 - cutoff * SAMPLE_TIME) * np.eye(2), np.eye(whole + 1, k=-1))
    step[:4] += late @ by_old @ output(whole + 1)[None] + by_new @ output(whole)[None]
    step[4:6, :4] += cutoff * SAMPLE_TIME * angles
    step[6] = law
    return float(np.abs(np.linalg.eigvals(step)).max())


def delay_margin(p: PlantParameters, gain: Sequence[float], cutoff: float, most: float = 0.02) -> float:
    """The longest delay (s) up to which the loop is stable, to 0.1 ms; ``most`` if it is stable up to there."""
    for ticks in range(round(most / STEP)):
        if spectral_radius(p, gain, cutoff, ticks * STEP) > 1 + 1e-9:
            return (ticks - 1) * STEP
    return most
