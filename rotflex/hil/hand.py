"""A hand on the arm of a virtual bench: it pulls the arm towards a place, as a spring and a damper would.

The hand alone does not deflect the arm by more than ``most``. While the servo stands, the arm is a mass on a spring. A
constant torque tau moves it on a circle around tau/K_s, with the coordinates alpha and alpha_dot/omega_n. The largest
torque whose circle stays within ``most`` is the limit in each sample. So the arm also stays within ``most`` after the
hand has let go. A motor that drives can add some degrees: then ``most`` is smaller. The tests pull as badly as they can
on many benches, and the deflection stays below 20 deg.
"""

from __future__ import annotations

import math

from rotflex.hil.guard import Measurement
from rotflex.plant import Plant
from rotflex.units import DEG

STANDING, DRIVING = 17 * DEG, 10 * DEG  #: rad, ``most`` while the servo is only held, or is driven
SILENCE = 0.2  #: s of simulated time; after it, a hand that does not show that it still pulls has let go
_STIFFNESS = 3.0  # of the hand's spring, relative to the joint's
_DAMPING = 0.7  # of the arm in the hand
_SHORT_OF = 0.95  # of ``most``: how far a hand holds the arm, so that it is held steadily


class Hand:
    """Pulls the arm in one run, see :meth:`rotflex.hil.bench.Bench.disturb`.

    Parameters
    ----------
    most : rad, by which it deflects the arm at most
    """

    def __init__(self, most: float) -> None:
        self._most = most
        self._pull: tuple[float] | None = None  # rad; a tuple of its own for each call of pull()
        self._known: tuple[float] | None = None
        self._since = 0.0  # s, when the last pull was felt first

    def pull(self, direction: float) -> None:
        """Pull the arm towards a direction in the room, rad as theta, from now on for ``SILENCE``."""
        self._pull = (direction,)

    def let_go(self) -> None:
        """Pull no more."""
        self._pull = None

    def __call__(self, measured: Measurement, plant: Plant) -> float:
        """Return the torque on the link, N·m."""
        pull = self._pull  # read once: it is written by another thread
        if pull is not self._known:
            self._known, self._since = pull, measured.time
        if pull is None or measured.time - self._since >= SILENCE:
            return 0.0
        theta, alpha, theta_dot, alpha_dot = plant.state
        K_s, J_l = plant.parameters.K_s, plant.parameters.J_l
        damping = 2 * _DAMPING * math.sqrt((1 + _STIFFNESS) * K_s * J_l)
        off = math.remainder(pull[0] - theta - alpha, 2 * math.pi)
        held = K_s * math.copysign(min(_STIFFNESS * abs(off), _SHORT_OF * self._most), off)
        wanted = held - damping * (theta_dot + alpha_dot)
        room = max(0.0, self._most**2 - alpha**2 - alpha_dot**2 * J_l / K_s)
        largest = K_s * room / (2 * (self._most - math.copysign(alpha, wanted * alpha))) if room else 0.0
        return math.copysign(min(abs(wanted), largest), wanted)
