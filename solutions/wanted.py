"""What is wanted of the closed loop: the desired poles, and their polynomial."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex import design
from rotflex.specifications import OMEGA_N, P_3, P_4, ZETA

Array = NDArray[Any]


def desired_poles(zeta: float = ZETA) -> Array:
    """Return the desired closed-loop poles (3.4), or what they would be with another damping ratio."""
    return design.desired_poles(zeta, OMEGA_N, P_3, P_4)


def desired_polynomial() -> Array:
    """Desired characteristic polynomial (3.4)."""
    return np.poly(desired_poles()).real
