"""The band of a predicted loop: where a recording of the bench should lie.

A prediction errs on two levels, and draws of a band have both:

* *What is the plant's.* A fit tells its parameters up to their errors, which go together as the fit says.
* *What is the run's.* On a real bench, friction of each direction differs from run to run, and omega_n does a little.
  Friction acts on one side. Therefore the curves are quantiles of the draws, and lie not evenly about the prediction.

What the fit leaves unexplained is added on either side: the margin. It is at least a count and a half of the encoder,
because the counters of the bench and of its twin do not change at the same angles.

:meth:`Band.adapted` finds what is the run's from the beginning of its recording. It looks for the draw that is likely
beforehand and leaves little of that beginning in the loop (maximum a posteriori), and draws from what is still open.
The plant's own errors are part of it: an error of the braking that was fitted to another run is not taken for friction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rotflex import doubts
from rotflex.controller import Controller
from rotflex.errors import IdentificationError
from rotflex.greybox.problem import less_mean, rms, windows
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.guard import Limits
from rotflex.hil.loop import run as run_loop
from rotflex.identification import channel
from rotflex.progress import progress as bar
from rotflex.recording import Recording
from rotflex.units import DEG, Array, Vector

ANGLES = ("theta", "alpha")
_DRAWS = 60
REACH = 1.96  #: standard deviations: 95 % of normal errors
QUANTILES = (0.025, 0.975)
LONGEST_BEGINNING = 4.0  #: s of a recording that a band may be adapted to
LARGEST_SHARE = 0.4  #: of a recording that a band may be adapted to
#: what a band is for, and what was measured: docs/reference/identification.md has the table
NEW_RUN = (
    "The band of a prediction is for a new run. On ten pairs of two logs of a real bench and their halves, such bands "
    "held all of both angles; on at least 102 of 103 virtual benches, 95 % of each run, under other commands and "
    "controllers, too."
)
DRIFTS = (
    "Theta drifts in an open loop: it is compared in windows of 1 s. On 103 virtual benches, about 40 % of it lay "
    "inside on another run, of which the friction is not known."
)
ADAPTED = (
    "The band is adapted to this run. On two logs of a real bench and their halves, such bands held at least 93 % of "
    "both angles after 4 s, and at least 85 % after 2 s."
)
_SEED = 20
_INDEPENDENT = 8.0  # values in a second, about two a swing of the link: errors of neighbouring samples are alike
_STEP = 0.15  # standard deviations, by which draws are changed to see what changes
_GAIN, _MOST_STEPS = 0.01, 8  # of the search for the likeliest draw: a step that gains less is the last


class Loop(NamedTuple):
    """A loop that is to be predicted, and the benches that it may be run on.

    A draw is a vector (k,) of standard normal numbers, and stands for a bench. Zeros stand for the fitted one.

    Attributes
    ----------
    reference : (n,) rad, or V in an open loop
    controller, sample_time : see ``FitResult.band``
    bench : open the bench of a draw
    size : k
    left : (2,) rad, of theta and alpha, that the fit leaves unexplained: the largest RMS in a window of 1 s
    spread : what the draws stand on, in words
    """

    reference: Vector
    controller: Controller
    sample_time: float
    bench: Callable[[Vector], Bench]
    size: int
    left: Vector
    spread: str

    def angles(self, draw: Vector, samples: int | None = None) -> Array:
        """Return theta and alpha (2, n), rad, on the bench of a draw; of the first samples only if they are counted."""
        with self.bench(draw) as bench:
            bench.safety.limits = Limits(theta=math.inf, alpha=math.inf)  # there is nothing to come to harm
            recording = run_loop(bench, self.controller, self.reference[:samples], self.sample_time, progress=False)
        return np.array([recording[name] for name in ANGLES])

    def band(self, center: Vector, root: Array, margin: Vector, progress: bool) -> Band:
        """Return the band of draws about a draw, with a root (k, k) of their covariance."""
        from scipy.special import ndtri

        levels = ndtri((np.arange(_DRAWS) + 0.5) / _DRAWS)  # a Latin hypercube: each number takes all its levels
        random = np.random.default_rng(_SEED)
        away = root @ np.array([random.permutation(levels) for _number in center])
        middle, *draws = [self.angles(draw) for draw in bar([center, *(center + away.T)], "band", "run", progress)]
        is_open = type(self.controller) is OpenLoop
        time = np.arange(self.reference.size, dtype=float) * self.sample_time
        return Band(time, middle, np.array(draws), margin, is_open, self.spread, loop=self)

    def likeliest(self, measured: Array) -> tuple[Vector, Array, Vector]:
        """Return the likeliest draw for the beginning (2, m) of a run, rad, by Gauss-Newton steps.

        Returns
        -------
        (k,) the draw; (k, k) a root of the covariance of what is still open; (2,) what is left, as ``left``
        """
        from scipy.optimize import least_squares

        weight = math.sqrt(_INDEPENDENT * self.sample_time) / self.left[:, None]

        def difference(draw: Vector) -> Array:
            left = measured - self.angles(draw, measured.shape[1])
            if type(self.controller) is OpenLoop:
                left[0] = less_drift(left[0], self.sample_time)
            return left

        def residual(draw: Vector) -> Vector:
            return np.concatenate([(weight * difference(draw)).ravel(), draw])

        def jacobian(draw: Vector) -> Array:
            here = residual(draw)
            return np.transpose([(residual(draw + step) - here) / _STEP for step in _STEP * np.eye(self.size)])

        best = least_squares(residual, np.zeros(self.size), jacobian, ftol=_GAIN, max_nfev=_MOST_STEPS)
        slopes = np.asarray(best.jac)
        root = np.linalg.inv(np.linalg.cholesky(slopes.T @ slopes)).T
        return best.x, root, largest_rms(difference(best.x), self.sample_time)


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
    margin : (2,) rad, for what the fit leaves unexplained
    is_open : whether the loop is open. Then theta drifts, and it is compared less its mean difference in each window
        of 1 s
    spread : what was drawn, in words
    first : the first sample that counts; those before have told what is the run's
    loop : what was predicted, of a band that may be adapted to a run
    kind : whether it is for a new run, or adapted to one; and what was measured, in words
    """

    time: Vector
    middle: Array
    draws: Array
    margin: Vector
    is_open: bool
    spread: str
    first: int = 0
    loop: Loop | None = None
    kind: str = NEW_RUN

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
        return {name: rms((one.upper - one.lower)[self.first :] / 2) for name, one in curves.items()}

    def __call__(self, recording: Recording) -> Inside:
        """Return the shares of a recording's samples that lie inside; of an adapted band, of those from ``first`` on.

        The recording begins where the band does: at rest, at zero. For a part of one, cut both, as in
        ``band.between(5, 10)(recording.between(5, 10))``.

        Raises
        ------
        IdentificationError
            If the recording is not to be relied on (:mod:`rotflex.doubts`), has another length or sample time, or no
            theta or alpha.
        """
        pairs = zip(self.around(recording), map(recording.__getitem__, ANGLES), strict=True)
        inside = [(one.lower <= angle) & (angle <= one.upper) for one, angle in pairs]
        return Inside(*(float(np.mean(one[self.first :])) for one in inside))

    def around(self, recording: Recording) -> tuple[Curves, Curves]:
        """Return the curves of theta and alpha for a recording: in an open loop, theta's follow its drift.

        Raises
        ------
        IdentificationError
            As a call of the band.
        """
        doubts.warn(recording.doubts)
        theta, _alpha = (channel(recording, name, may_be_constant=True) for name in ANGLES)
        step = self._step
        if len(recording) != self.time.size or abs(recording.sample_time - step) > 1e-3 * step:
            raise IdentificationError(
                f"The recording has {len(recording)} samples, one every {recording.sample_time * 1e3:.4g} ms; the band "
                f"has {self.time.size}, one every {step * 1e3:.4g} ms. Predict along the recording's own reference. "
                "For a part of a recording, cut both: band.between(5, 10)(recording.between(5, 10))."
            )
        if not self.is_open:
            return self.theta, self.alpha
        left = theta - self.middle[0]
        drift = left - less_drift(left, step)
        return Curves(*(curve + drift for curve in self.theta)), self.alpha

    def adapted(self, recording: Recording, until: float, progress: bool = True) -> Band:
        """Find what is the run's from the beginning of its recording, and return the band of the rest of it.

        Samples up to ``until`` count neither as inside nor in the width. The beginning is simulated about 60 times, and
        the whole as often as for any band.

        Parameters
        ----------
        recording : a run along the reference of the band, by its controller
        until : s, at most 4 s and 40 % of the recording
        progress : show a progress bar when it takes longer than a second

        Raises
        ------
        IdentificationError
            If ``until`` is too long, the recording is none of this loop, a joint does not move until then, or the band
            was cut.
        """
        self.around(recording)
        if self.loop is None:
            raise IdentificationError("This band is a part of another: adapt that one, and cut it then.")
        longest = min(LONGEST_BEGINNING, LARGEST_SHARE * len(recording) * self._step)
        if not 0 < until <= longest * (1 + 1e-9):
            raise IdentificationError(
                f"until is {until:g} s. A band is adapted to {LONGEST_BEGINNING:g} s of a recording at most, and to "
                f"{LARGEST_SHARE:.0%} of it, so that the rest shows what it is worth: here to {longest:.4g} s."
            )
        samples = int(until / self._step + 1e-6) + 1
        measured = np.array([recording[name][:samples] for name in ANGLES])
        moved = np.ptp(measured, axis=1)
        if (moved <= REACH * self.margin).any():
            theta, alpha = (moved / DEG).tolist()
            raise IdentificationError(
                f"There is nothing to adapt to: until {until:g} s, theta moved by {theta:.2g} deg and alpha by "
                f"{alpha:.2g} deg. Give a later until, or a recording that moves sooner."
            )
        center, root, left = self.loop.likeliest(measured)
        adapted = self.loop.band(center, root, np.maximum(self.loop.left, left), progress)
        return replace(adapted, first=samples, spread=f"What is still open after {until:g} s was drawn.", kind=ADAPTED)

    def between(self, start: float, stop: float) -> Band:
        """Return the part with start <= t < stop (s), its time counted from its own beginning.

        Raises
        ------
        RecordingError
            If there is nothing between.
        IdentificationError
            If the band was adapted to all of it.
        """
        theta, alpha = self.middle
        part = Recording.of(self.time, theta=theta, alpha=alpha).between(start, stop)
        begin = int(np.searchsorted(self.time, start - 1e-6 * part.sample_time))
        cut, first = slice(begin, begin + len(part)), max(self.first - begin, 0)
        if first >= len(part):
            raise IdentificationError(f"The band was adapted to all that is between {start:g} s and {stop:g} s.")
        middle, draws = self.middle[:, cut], self.draws[:, :, cut]
        return replace(self, time=part.time, middle=middle, draws=draws, first=first, loop=None)

    def __str__(self) -> str:
        width = f"Band of 95 % over {self.time[-1]:g} s; half width (RMS, deg): {in_degrees(self.half_width)}."
        return f"{width}\n{' '.join(self.doubts())} {self.spread}"

    def doubts(self) -> list[str]:
        """Say whether the band is for a new run or adapted to one, and what share was measured for it on what."""
        return [self.kind, DRIFTS] if self.is_open else [self.kind]

    @property
    def _step(self) -> float:
        return float(self.time[1] - self.time[0])

    def _curves(self, angle: int) -> Curves:
        away = self.draws[:, angle] - self.middle[angle]
        if self.is_open and angle == 0:
            away = np.array([less_drift(one, self._step) for one in away])
        low, high = np.quantile(away, QUANTILES, axis=0)
        middle, margin = self.middle[angle], REACH * self.margin[angle]
        return Curves(middle + np.minimum(low, 0.0) - margin, middle, middle + np.maximum(high, 0.0) + margin)


def less_drift(difference: Vector, sample_time: float) -> Vector:
    """Return the difference of two angles (n,) less its mean in each window."""
    return less_mean(difference, windows(np.arange(difference.size), difference.size, sample_time))


def largest_rms(differences: Array, sample_time: float) -> Vector:
    """Return the largest root mean square (2,) in a window, of differences (2, n) of theta and alpha."""
    window = windows(np.arange(differences.shape[1]), differences.shape[1], sample_time)
    squares = [np.bincount(window, one**2) / np.bincount(window) for one in differences]
    return np.asarray(np.sqrt(np.max(squares, axis=1)))


def in_degrees(values: Mapping[str, float]) -> str:
    """Angles (rad) by name, for a line of text."""
    return ", ".join(f"{name} {value / DEG:.3f}" for name, value in values.items())
