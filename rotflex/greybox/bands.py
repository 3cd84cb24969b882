"""The band in which a recording of the bench should lie, for a loop that a fitted plant predicts.

A prediction errs for two reasons. A band has both, as the root of the sum of their squares:

* *The bench changes from run to run.* Friction, omega_n and the delay are drawn, and the loop is simulated with each
  draw. One recording does not tell how much the first two change. A factor of 1.5 in friction and a standard deviation
  of 1.1 % in omega_n are known of such rigs (:mod:`rotflex.greybox.result`). Between several recordings, the spread is
  measured. Two or three recordings tell little of a spread. Therefore the known spread counts as one recording more.
  The link's dry friction is drawn from none on, because a fit finds too much of it: a real link rings on for seconds.
* *The plant is not the bench.* The margin is what the fit leaves (root mean square). It is at least a count and a half
  of the encoder, because the counters of the bench and of its twin do not change at the same angles.

The band reaches 1.96 times this root to either side of the prediction. That holds 95 % of normal errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.greybox.problem import less_mean, rms, windows
from rotflex.identification import channel
from rotflex.recording import Recording
from rotflex.units import DEG, Vector

REACH = 1.96  #: standard deviations: 95 % of normal errors
ANGLES = ("theta", "alpha")


class Curves(NamedTuple):
    """A prediction of one angle, (n,) rad each."""

    lower: Vector
    middle: Vector
    upper: Vector


class Inside(NamedTuple):
    """Share of the samples inside a band, from 0 to 1."""

    theta: float
    alpha: float

    def __str__(self) -> str:
        return f"Inside the band: {self.theta:.1%} of theta, {self.alpha:.1%} of alpha."


@dataclass(frozen=True, eq=False)
class Band:
    """A prediction with its band. ``print`` it for its width and for what it stands on; call it with a recording.

    Attributes
    ----------
    time : (n,) s
    middle : (2, n) theta and alpha of the fitted plant, rad
    draws : (m, 2, n) the same of plants that differ from it as runs do
    margin : (2,) rad RMS, for what the fit leaves unexplained
    is_open : whether the loop is open. Then theta drifts, and it is compared less its mean difference in each window
        of 1 s
    spread : what was drawn, in words
    """

    time: Vector
    middle: NDArray[np.float64]
    draws: NDArray[np.float64]
    margin: Vector
    is_open: bool
    spread: str

    @property
    def theta(self) -> Curves:
        """Lower curve, prediction, and upper curve of theta, rad."""
        return self._curves(0)

    @property
    def alpha(self) -> Curves:
        """Lower curve, prediction, and upper curve of alpha, rad."""
        return self._curves(1)

    @property
    def half_width(self) -> dict[str, float]:
        """Root mean square of half the width, rad, by angle."""
        curves = dict(zip(ANGLES, (self.theta, self.alpha), strict=True))
        return {name: rms(one.upper - one.middle) for name, one in curves.items()}

    def __call__(self, recording: Recording) -> Inside:
        """Return the shares of a recording's samples that lie inside.

        The recording begins where the band does: at rest, at zero. For a part of one, cut both, as in
        ``band.between(5, 10)(recording.between(5, 10))``.

        Raises
        ------
        IdentificationError
            If the recording has another length or sample time, or no theta or alpha.
        """
        pairs = zip(self.around(recording), map(recording.__getitem__, ANGLES), strict=True)
        return Inside(*(float(np.mean((one.lower <= angle) & (angle <= one.upper))) for one, angle in pairs))

    def around(self, recording: Recording) -> tuple[Curves, Curves]:
        """Return the curves of theta and alpha for a recording: in an open loop, theta's follow its drift.

        Raises
        ------
        IdentificationError
            As a call of the band.
        """
        theta, _alpha = (channel(recording, name, may_be_constant=True) for name in ANGLES)
        step = self.time[1] - self.time[0]
        if len(recording) != self.time.size or abs(recording.sample_time - step) > 1e-3 * step:
            raise IdentificationError(
                f"The recording has {len(recording)} samples, one every {recording.sample_time * 1e3:.4g} ms; the band "
                f"has {self.time.size}, one every {step * 1e3:.4g} ms. Predict along the recording's own reference. "
                "For a part of a recording, cut both: band.between(5, 10)(recording.between(5, 10))."
            )
        if not self.is_open:
            return self.theta, self.alpha
        left = theta - self.middle[0]
        drift = left - self._less_drift(left)
        return Curves(*(curve + drift for curve in self.theta)), self.alpha

    def between(self, start: float, stop: float) -> Band:
        """Return the part with start <= t < stop (s), its time counted from its own beginning.

        Raises
        ------
        RecordingError
            If there is nothing between.
        """
        theta, alpha = self.middle
        part = Recording.of(self.time, theta=theta, alpha=alpha).between(start, stop)
        first = int(np.searchsorted(self.time, start - 1e-6 * part.sample_time))
        cut = slice(first, first + len(part))
        return replace(self, time=part.time, middle=self.middle[:, cut], draws=self.draws[:, :, cut])

    def __str__(self) -> str:
        told = ", ".join(f"{name} {width / DEG:.3f}" for name, width in self.half_width.items())
        windows = " Theta drifts in an open loop: it is compared in windows of 1 s." if self.is_open else ""
        return f"Band of 95 % over {self.time[-1]:g} s; half width (RMS, deg): {told}.{windows}\n{self.spread}"

    def _curves(self, angle: int) -> Curves:
        away = self.draws[:, angle] - self.middle[angle]
        if self.is_open and angle == 0:
            away = np.array([self._less_drift(one) for one in away])
        half = REACH * np.sqrt(np.mean(away**2, axis=0) + self.margin[angle] ** 2)
        return Curves(self.middle[angle] - half, self.middle[angle], self.middle[angle] + half)

    def _less_drift(self, difference: Vector) -> Vector:
        return less_mean(difference, windows(np.arange(self.time.size), self.time.size, float(self.time[1])))
