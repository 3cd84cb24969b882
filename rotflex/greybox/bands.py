"""The band in which a recording of the bench should lie, for a loop that a fitted plant predicts.

A prediction is wrong for two reasons, and a band has both, as the root of the sum of their squares:

* *The bench changes from run to run.* Friction, omega_n and the delay are drawn, and the loop is simulated with each.
  With one recording, how much the first two change is not measured: :data:`FRICTION` and :data:`OMEGA_N` are known of
  such rigs. With several recordings, the spread is measured between them. Two or three recordings say little of a
  spread, so the known one counts as :data:`KNOWN` recordings more.
* *The plant is not the bench.* The margin is what the fit leaves, root mean square, and a count and a half of the
  encoder at least: the counters of the bench and of its twin do not change at the same angle.

A band is 1.96 times that root to either side of the prediction. That holds 95 % of normal errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import hil
from rotflex.controller import Controller
from rotflex.errors import IdentificationError
from rotflex.greybox.problem import less_mean, rms, windows
from rotflex.greybox.solving import student
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.guard import Limits
from rotflex.hil.loop import run
from rotflex.hil.student_benches import VirtualPlantSpec, scaled
from rotflex.hil.virtual import Timing
from rotflex.identification import Vector, channel
from rotflex.progress import progress as bar
from rotflex.recording import Recording
from rotflex.units import DEG

if TYPE_CHECKING:
    from rotflex.greybox.result import FitResult

FRICTION = 1.5  #: from run to run, the friction of such rigs changes by a factor up to this one
#: standard deviation from run to run, relative: 23.01, 23.22 and 22.72 rad/s were fitted to three logs of one bench
OMEGA_N = 0.011
KNOWN = 1  #: recordings that the known spread counts as, beside measured ones
DRAWS = 20
_REACH = 1.96  # standard deviations: 95 % of normal errors
_COUNTS = 1.5  # of an encoder: the least margin
_SEED = 20
_ANGLES = ("theta", "alpha")


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


class Spread(NamedTuple):
    """How far a run may be from the fit: ln(friction), omega_n (relative), and the delay (s), evenly to either side."""

    friction: float
    omega_n: float
    delay: float


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
        return {
            name: rms(curves.upper - curves.middle)
            for name, curves in {"theta": self.theta, "alpha": self.alpha}.items()
        }

    def __call__(self, recording: Recording) -> Inside:
        """Return the shares of a recording's samples that lie inside.

        The recording begins where the band does: at rest, at zero. For a part of one, cut both, as in
        ``band.between(5, 10)(recording.between(5, 10))``.

        Raises
        ------
        IdentificationError
            If the recording has another length or sample time, or no theta or alpha.
        """
        shares = []
        for curves, name in zip(self.around(recording), _ANGLES, strict=True):
            shares.append(float(np.mean((curves.lower <= recording[name]) & (recording[name] <= curves.upper))))
        return Inside(*shares)

    def around(self, recording: Recording) -> tuple[Curves, Curves]:
        """Return the curves of theta and alpha for a recording: in an open loop, theta's follow its drift.

        Raises
        ------
        IdentificationError
            As a call of the band.
        """
        theta = channel(recording, "theta", may_be_constant=True)
        channel(recording, "alpha", may_be_constant=True)
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
        half = _REACH * np.sqrt(np.mean(away**2, axis=0) + self.margin[angle] ** 2)
        return Curves(self.middle[angle] - half, self.middle[angle], self.middle[angle] + half)

    def _less_drift(self, difference: Vector) -> Vector:
        return less_mean(difference, windows(np.arange(self.time.size), self.time.size, float(self.time[1])))


def band(found: FitResult, reference: ArrayLike, controller: Controller, sample_time: float, progress: bool) -> Band:
    """Predict a loop: see :meth:`rotflex.greybox.FitResult.band`."""
    spread = _spread(found)
    levels = (np.arange(DRAWS) * 2 + 1) / DRAWS - 1  # a Latin hypercube: each parameter takes all its levels
    draw = np.random.default_rng(_SEED)
    servo, link, omega_n, delay = (draw.permutation(levels) for _parameter in range(4))
    factor = math.exp(spread.friction)
    changes = [factor**servo, factor * (1 + link) / 2, spread.omega_n * omega_n, spread.delay * delay]
    simulated = []
    for change in bar([(1.0, 1.0, 0.0, 0.0), *np.transpose(changes).tolist()], "band", "run", progress):
        with hil.open("virtual", plant=_changed(found, *change), servo=found.servo) as bench:
            bench.limits = Limits(theta=math.inf, alpha=math.inf)  # there is nothing to come to harm
            recording = run(bench, controller, reference, sample_time, progress=False)
        simulated.append([recording[name] for name in _ANGLES])
    middle, *draws = np.array(simulated)
    least = _COUNTS * found.servo.K_enc / _REACH
    margin = np.array([max(found.residual_rms[name], least) for name in _ANGLES])
    return Band(recording.time, middle, np.array(draws), margin, type(controller) is OpenLoop, _in_words(found, spread))


def _changed(found: FitResult, servo: float, link: float, omega_n: float, delay: float) -> VirtualPlantSpec:
    """The fitted bench with friction times factors, and with another omega_n (relative) and delay (s)."""
    was = found.parameters
    plant = replace(
        was,
        servo_friction=scaled(was.servo_friction, servo),
        link_friction=scaled(was.link_friction, link),
        K_s=was.K_s * (1 + omega_n) ** 2,
    )
    return VirtualPlantSpec(found.joint, plant, Timing(delay=max(found.delay + delay, 0.0)))


def _spread(found: FitResult) -> Spread:
    """How friction, omega_n and the delay differ from run to run. Half an even spread is √3 standard deviations."""
    known = np.array([math.log(FRICTION), math.sqrt(3) * OMEGA_N])
    delay = math.sqrt(3) * found.estimates["delay"].uncertainty if "delay" in found.estimates else 0.0
    logs = len(found.predictions)
    if logs > 1:
        ways = [name for name in ("servo_friction_plus", "servo_friction_minus") if name in found.intervals]
        reach = sum(float(np.ptp(found.intervals[name])) / 2 for name in ways)
        friction = reach / max(sum(found.estimates[name].value for name in ways), 1e-9)
        # An interval reaches Student's t standard errors of a mean to either side.
        measured = np.array([friction, 2 * found.omega_n.uncertainty / found.omega_n.value])
        measured *= math.sqrt(3 * logs) / student(logs)
        squares = (KNOWN * known**2 + (logs - 1) * measured**2) / (KNOWN + logs - 1)
        known = np.sqrt(squares * (1 + 1 / logs))
    friction, omega_n = known.tolist()
    return Spread(friction, omega_n, delay)


def _in_words(found: FitResult, spread: Spread) -> str:
    logs = len(found.predictions)
    drawn = (
        f"Drawn: servo friction ×/÷ {math.exp(spread.friction):.2f}, omega_n ±{spread.omega_n:.1%}, "
        f"delay ±{spread.delay * 1e3:.2f} ms."
    )
    known = f"friction ×/÷ {FRICTION} and omega_n ±{OMEGA_N:.1%} (standard deviation)"
    if logs > 1:
        return (
            f"{drawn} The spread is measured between {logs} recordings; {known}, known of such rigs, count as one more."
        )
    return f"{drawn} One recording does not tell how runs differ: {known} are known of such rigs."
