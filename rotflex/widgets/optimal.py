"""The linear quadratic regulator, for comparison with placed poles, without a page (notebook 06, going further)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

from rotflex.errors import DesignError
from rotflex.specifications import LIMITS
from rotflex.units import DEG
from rotflex.widgets.runaway import BORDER

Vector = NDArray[np.float64]

ERROR, DEFLECTION = 40.0, 25.0  #: deg, that the notebook calls as bad as all of the voltage


def lqr(a: Vector, b: Vector, error: float = ERROR, deflection: float = DEFLECTION) -> Vector:
    """The gain (1, 4) that makes the weighted squares of error, deflection and voltage least, added up over all time.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input
    error, deflection : deg, of theta + alpha and of alpha, that are as bad as the largest voltage of the specifications

    Raises
    ------
    DesignError
        If there is no such gain.
    """
    direction, bent = np.array([[1.0, 1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0, 0.0]])
    Q = direction.T @ direction / (error * DEG) ** 2 + bent.T @ bent / (deflection * DEG) ** 2
    R = np.array([[1 / LIMITS["max_vm"] ** 2]])
    try:
        S = solve_continuous_are(a, b, Q, R)
    except (ValueError, np.linalg.LinAlgError) as error_:
        raise DesignError(f"There is no optimal gain for this model: {error_}. Look at A and B.") from None
    found: Vector = np.linalg.solve(R, b.T @ S)
    if np.linalg.eigvals(a - b @ found).real.max() > -BORDER:
        raise DesignError(
            "There is no optimal gain for this model: a motion of it cannot be controlled. Look at A and B."
        )
    return found
