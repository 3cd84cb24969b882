"""Where the closed-loop poles lie when the stiffness is not quite what it was taken for, without a page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rotflex.errors import DesignError
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import HZ
from rotflex.widgets.region import excess_of

Vector = NDArray[np.float64]

BIN = 1 / (8192 * SAMPLE_TIME)  #: Hz, of the notebooks' spectrum: the sweep, filled up with zeros to 8192 samples
#: Limits, relative, as ``04_modeling_results`` has them: of the peak, as the servo's loop gives way; of the inertia.
LOOP, INERTIA = 0.03, 0.01
COUNT = 41  #: stiffnesses that are tried


@dataclass(frozen=True)
class Cloud:
    """One gain on many models.

    Attributes
    ----------
    spread : relative standard uncertainty of K_s
    factors : (n,) of K_s, all equally likely
    poles : (n, 4) of the closed loop, rad/s
    share : of the models, on which all four specifications are met
    """

    spread: float
    factors: Vector
    poles: NDArray[np.complex128]
    share: float


def spread_of(a: Vector) -> float:
    """The relative standard uncertainty of K_s = J_l·omega_n², as the notebooks work it out.

    Of what may lie anywhere within a limit, it is the limit over √3; omega_n counts twice. Limits: half a bin of the
    spectrum, the loop, the inertia.

    Raises
    ------
    DesignError
        If the model has no spring between servo and link.
    """
    squared = -a[3, 1] - a[2, 1]  # K_s / J_l
    if not squared > 0:
        raise DesignError("The model has no spring between servo and link: look at the second column of A.")
    half_a_bin = BIN / 2 * HZ / np.sqrt(squared)
    return float(np.hypot(INERTIA, 2 * np.hypot(half_a_bin, LOOP)) / np.sqrt(3))


def cloud(a: Vector, b: Vector, applied: Vector, spread: float) -> Cloud:
    """Put a gain on models whose stiffness differs.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input; K_s is in the second column of its lower half
    applied : (1, 4) gain that is fed back
    spread : relative standard uncertainty of K_s
    """
    factors = np.maximum(1 + spread * ndtri((np.arange(COUNT) + 0.5) / COUNT), 0.0)
    models = np.repeat(a[None], COUNT, axis=0)
    models[:, 2:, 1] *= factors[:, None]
    poles = np.asarray(np.linalg.eigvals(models - b @ applied), dtype=complex)
    met = excess_of(models, b, np.repeat(applied, COUNT, axis=0)) <= 0
    return Cloud(spread, factors, poles, float(met.mean()))
