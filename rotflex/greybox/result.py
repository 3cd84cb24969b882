"""What a fit has found, and what can be done with it: predict a recording, or a loop with its band.

A :class:`Band` is where a recording of the bench should lie. A prediction errs for two reasons. A band has both, as the
root of the sum of their squares:

* *The bench changes from run to run.* Friction, omega_n and the delay are drawn, and the loop is simulated with each
  draw. One recording does not tell how much the first two change. A factor of 1.5 in friction and a standard deviation
  of 1.1 % in omega_n are known of such rigs (``FRICTION``, ``OMEGA_N_SPREAD``). Between several recordings, the spread
  is measured. Two or three recordings tell little of a spread. Therefore the known spread counts as one recording more.
  The link's dry friction is drawn from none on, because a fit finds too much of it: a real link rings on for seconds.
* *The plant is not the bench.* The margin is what the fit leaves (root mean square). It is at least a count and a half
  of the encoder, because the counters of the bench and of its twin do not change at the same angles.

The band reaches 1.96 times this root to either side of the prediction. That holds 95 % of normal errors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import hil
from rotflex.config import Joint, Servo
from rotflex.controller import Controller
from rotflex.errors import IdentificationError
from rotflex.greybox.problem import Problem, changed, less_mean, rms, windows
from rotflex.greybox.solving import Chosen, search, student
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.guard import Limits
from rotflex.hil.loop import run as run_loop
from rotflex.hil.student_benches import FIRST_RUN, VirtualPlantSpec, with_friction
from rotflex.hil.virtual import Timing
from rotflex.identification import Estimate, channel
from rotflex.plant import PlantParameters
from rotflex.progress import progress as bar
from rotflex.recording import Recording
from rotflex.units import DEG, Vector

FRICTION = 1.5  #: the largest factor by which the friction of such rigs changes from run to run
#: standard deviation from run to run, relative: fits to three logs of one bench gave 23.01, 23.22 and 22.72 rad/s
OMEGA_N_SPREAD = 0.011
KNOWN = 1  #: the known spread counts as so many recordings, beside those that are measured
REACH = 1.96  #: standard deviations: 95 % of normal errors
ANGLES = ("theta", "alpha")
_DRAWS = 20
_COUNTS = 1.5  # of an encoder: the least margin
_LEAST = 1e-3  # N·m: of less friction, a relative spread says nothing
_SEED = 20
_KNOWN = f"friction ×/÷ {FRICTION} and a standard deviation of {OMEGA_N_SPREAD:.1%} in omega_n are known of such rigs"
_ONE = f"One recording does not tell how runs differ: {_KNOWN}."
_SEVERAL = f"The spread is measured between {{logs}} recordings; {_KNOWN}, and count as one recording more."
_HIGH_CORRELATION = 0.95  # of a correlation: the interval of each is three times what it would be, were the other known
#: rad RMS: what is left of a log of the right plant is half of it at most, and of another mechanism (a flexible link in
#: the joint's place) half as much again
_DOUBTFUL = {"theta": 1.0 * DEG, "alpha": 0.5 * DEG}
_FAR = 5.0  # times the data sheet's J_eq, which gears and loads change less
_FROM_ONE_LOG = 0.16  # rad/s: half the width that an interval of omega_n has at least, for logs of one bench differ
_DIGITS = 4  # of a value, where its interval does not need more
_UNITS = {
    "K_s": "N·m/rad",
    "J_eq": "kg·m²",
    "J_l": "kg·m²",
    "B_eq": "N·m/(rad/s)",
    "B_l": "N·m/(rad/s)",
    "servo_friction_plus": "N·m",
    "servo_friction_minus": "N·m",
    "link_friction": "N·m",
    "torque_per_volt": "N·m/V",
    "braking": "N·m/(rad/s)",
    "delay": "s",
    "alpha_offset": "rad",
    "theta_dot_0": "rad/s",
    "alpha_dot_0": "rad/s",
}


@dataclass(frozen=True)
class Prediction:
    """A recording beside what a fitted plant makes of its voltage.

    Attributes
    ----------
    recording : theta, alpha, vm as measured, and theta_model, alpha_model as simulated, for plots
    rms : as ``FitResult.residual_rms``
    """

    recording: Recording
    rms: Mapping[str, float]

    @property
    def drift(self) -> float:
        """Root mean square of theta less theta_model as they are, rad: small errors of the rate add up in it."""
        return rms(self.recording["theta"] - self.recording["theta_model"])


@dataclass(frozen=True)
class FitResult:
    """A fitted plant. ``print`` it for a table, and for what to mind.

    Attributes
    ----------
    parameters : the plant with the fitted values (no delay is among them: that is the board's); of what each recording
        has its own, the mean
    delay : of the outputs, s
    estimates : by name, with standard errors, SI units: the free parameters (servo_friction as servo_friction_plus and
        _minus); alpha_offset, the measured alpha (rad) at which the springs are at ease; and the initial rates,
        theta_dot_0 and alpha_dot_0 (rad/s), unless the recording begins at rest. With several recordings, what each
        has its own is named with its place, ``alpha_offset[0]``. Last come means of such parameters, and what was fixed
    intervals : by name, the 95 % confidence interval
    correlation : (p, p) correlation matrix of the first p estimates: those of the fit itself
    residual_rms : rad, root mean square of measured minus simulated over all samples: "theta" less its mean in each
        window of 1 s, and "alpha"
    predictions : of each recording that was fitted
    plants : as they were in each recording
    fixed : what the recordings do not tell, and how it was chosen, in words; for a fit that chose by itself
    servo, joint : the nominal parts
    """

    parameters: PlantParameters
    delay: float
    estimates: Mapping[str, Estimate]
    intervals: Mapping[str, tuple[float, float]]
    correlation: NDArray[np.float64]
    predictions: tuple[Prediction, ...]
    plants: tuple[PlantParameters, ...]
    fixed: Mapping[str, str]
    servo: Servo
    joint: Joint

    @property
    def recording(self) -> Recording:
        """The first recording, with what was simulated."""
        return self.predictions[0].recording

    @property
    def residual_rms(self) -> Mapping[str, float]:
        """See the attributes."""
        return joined_rms(self.predictions)

    @property
    def omega_n(self) -> Estimate:
        """sqrt(K_s/J_l), rad/s: what recordings tell best, whatever inertia or torque was given.

        Its uncertainty is half of what its 95 % interval reaches to either side. Of several recordings, the interval is
        that of the spread between them, with Student's t; of one, it reaches 0.16 rad/s at least, for logs of one bench
        differ by more than any of them shows.
        """
        value = math.sqrt(self.parameters.K_s / self.parameters.J_l)
        signs = {name: sign for name, sign in {"K_s": 1, "J_l": -1}.items() if name in self.estimates}
        shares = [
            sign * float(np.ptp(self.intervals[name])) / 2 / self.estimates[name].value for name, sign in signs.items()
        ]
        places = [list(self.estimates).index(name) for name in signs]
        alike = np.eye(len(places))  # means over recordings have no place among the correlations
        if max(places, default=0) < len(self.correlation):
            alike = self.correlation[np.ix_(places, places)]
        variance = float(np.array(shares) @ alike @ np.array(shares)) if shares else 0.0
        reach = value * math.sqrt(max(variance, 0.0)) / 2
        return Estimate(value, max(reach, _FROM_ONE_LOG if len(self.predictions) == 1 else 0.0) / 2)

    def doubts(self, recordings: Sequence[str] = ()) -> list[str]:
        """Say why the fit is not to be trusted; empty where nothing speaks against it.

        Recordings are named by ``recordings``, else by their place.
        """
        beyond = self.parameters.J_eq / PlantParameters.of(self.servo, self.joint, self.parameters.K_s).J_eq
        inertia = f"This fit is doubted: J_eq is {beyond:.3g} times that of the data sheet. Are units, or J_l, wrong?"
        several = len(self.predictions) > 1
        places = [f"recording [{place}]" if several else "the recording" for place in range(len(self.predictions))]
        return [inertia] * (not 1 / _FAR < beyond < _FAR) + [
            f"This fit is doubted: what is left of {name} is {in_degrees(one.rms)} (RMS, deg), and of a flexible "
            f"joint's at most {in_degrees(_DOUBTFUL)}. Is it another mechanism's, or are units, signs, channels wrong?"
            for name, one in zip(recordings or places, self.predictions, strict=True)
            if any(one.rms[angle] > most for angle, most in _DOUBTFUL.items())
        ]

    def predict(self, recording: Recording) -> Prediction:
        """Another recording, as this plant has it: of it, only its own offset and initial rates are found.

        Raises
        ------
        IdentificationError
            If a channel is missing or constant.
        """
        problem = Problem([recording], self.parameters, (), delay=self.delay)
        return predicted(problem, search(problem, progress=False).values)[0]

    def band(
        self, reference: ArrayLike, controller: Controller, sample_time: float = 0.002, progress: bool = True
    ) -> Band:
        """Predict a loop on the bench, with the band in which 95 % of a recording's samples should lie.

        The plant is simulated on its bench about twenty times, from rest at zero: with encoders and delay, and with
        other friction, omega_n and delay each time. See :mod:`rotflex.greybox.result` for what the band stands on. A
        reference of 10 s at 2 ms takes about 3 s. The same fit and reference give the same band.

        Parameters
        ----------
        reference : (n,) commanded angle, rad, one per sample; V for an open loop
        controller : function (theta_ref, theta, alpha) → V, see :mod:`rotflex.controller`; for an open loop
            ``rotflex.hil.controllers.OpenLoop()``
        sample_time : s
        progress : show a progress bar when it takes longer than a second

        Raises
        ------
        DesignError
            If the controller returns anything but one number.
        BenchError
            If the reference is not a list of finite numbers.
        """
        friction, most_omega_n, most_delay = _spread(self)
        levels = (np.arange(_DRAWS) * 2 + 1) / _DRAWS - 1  # a Latin hypercube: each parameter takes all its levels
        draw = np.random.default_rng(_SEED)
        servo, link, omega_n, delay = (draw.permutation(levels) for _parameter in range(4))
        changes = [friction**servo, friction * (1 + link) / 2, most_omega_n * omega_n, most_delay * delay]
        simulated = []
        for change in bar([(1.0, 1.0, 0.0, 0.0), *np.transpose(changes).tolist()], "band", "run", progress):
            with hil.open("virtual", plant=_changed(self, *change), servo=self.servo) as bench:
                bench.safety.limits = Limits(theta=math.inf, alpha=math.inf)  # there is nothing to come to harm
                recording = run_loop(bench, controller, reference, sample_time, progress=False)
            simulated.append([recording[name] for name in ANGLES])
        middle, *draws = np.array(simulated)
        least = _COUNTS * self.servo.K_enc / REACH
        margin = np.array([max(self.residual_rms[name], least) for name in ANGLES])
        drawn = f"friction ×/÷ {friction:.2f}, omega_n ±{most_omega_n:.1%}, delay ±{most_delay * 1e3:.2f} ms"
        source = _SEVERAL if len(self.predictions) > 1 else _ONE
        said = f"Drawn evenly: {drawn}. {source.format(logs=len(self.predictions))}"
        return Band(recording.time, middle, np.array(draws), margin, type(controller) is OpenLoop, said)

    def bench(self, uri: str = "virtual", run: int = FIRST_RUN) -> Bench:
        """A virtual bench with this plant and this delay, for all experiments.

        Parameters
        ----------
        uri : how it is opened: ``"virtual"``, or with options, as ``"virtual:?clock=wall"``
        run : another than the first has other friction
        """
        spec = VirtualPlantSpec(self.joint, self.parameters, Timing(delay=self.delay))
        return hil.open(uri, plant=spec, servo=self.servo, run=run)

    def __str__(self) -> str:
        return self.table()

    def table(self, recordings: Sequence[str] = ()) -> str:
        """What is printed. What a recording has its own is named by ``recordings``, else by its place."""
        called = {name: _called(name, recordings) for name in self.estimates}
        width = max(24, *(len(name) + 1 for name in called.values()))
        lines = [f"{'':{width}}{'value':>12}   {'95 % interval'}"]
        for name, found in self.estimates.items():
            low, high = self.intervals[name]
            unit, digits = _UNITS[name.partition("[")[0]], _digits(low, high)
            value = f"{found.value:.{digits}g}" if found.value else "none found"
            value = "fixed" if name in self.fixed else value
            lines.append(f"{called[name]:{width}}{value:>12}   {low:.{digits}g} … {high:.{digits}g} {unit}")
        lines.append(f"What is left (RMS, deg): {in_degrees(self.residual_rms)}.")
        lines += [*self.doubts(recordings), *self.fixed.values(), *self._correlation_warnings([*called.values()])]
        return "\n".join([*lines, self._in_ratio()])

    def _correlation_warnings(self, names: Sequence[str]) -> list[str]:
        """Return a warning for each pair of parameters with strongly correlated estimates."""
        high = np.argwhere(np.abs(np.triu(self.correlation, 1)) >= _HIGH_CORRELATION)
        return [
            f"{names[one]} and {names[other]} can hardly be separated (correlation "
            f"{self.correlation[one, other]:.2f}): an error of one goes with an error of the other. A recording of "
            "another motion separates them."
            for one, other in high.tolist()
        ]

    def _in_ratio(self) -> str:
        """What the values stand on."""
        given = "torque_per_volt" if "J_l" in self.estimates else "J_l"
        return (
            f"Recordings tell inertias, stiffness, friction and torques in ratio only: {given} = "
            f"{getattr(self.parameters, given):.4g} {_UNITS[given]} was given, and an error of it is an error of "
            f"all of them. omega_n = {Estimate(self.omega_n.value, 2 * self.omega_n.uncertainty)} rad/s (95 %) does "
            "not depend on it."
        )


@dataclass(frozen=True)
class LeftOut:
    """Each recording as the others predict it. ``print`` it for a table.

    Attributes
    ----------
    fits : to all recordings but the first, but the second, ...
    predictions : of the first, of the second, ..., each by the fit that has not seen it
    """

    fits: tuple[FitResult, ...]
    predictions: tuple[Prediction, ...]

    @property
    def rms(self) -> Mapping[str, float]:
        """Root mean square errors of the predictions over all recordings, rad: see ``FitResult.residual_rms``."""
        return joined_rms(self.predictions)

    def __str__(self) -> str:
        return self.table()

    def table(self, recordings: Sequence[str] = ()) -> str:
        """What is printed. Each recording is named by ``recordings``, else by its place."""
        names = recordings or [f"[{place}]" for place in range(len(self.fits))]
        head = ("Left out", "predicted (RMS, deg)", "the others, fitted without it")
        width = max(12, len(head[0]), *(len(name) for name in names))
        lines = [f"{head[0]:{width}} {head[1]:24} {head[2]}"]
        for name, found, prediction in zip(names, self.fits, self.predictions, strict=True):
            lines.append(f"{name:{width}} {in_degrees(prediction.rms):24} {in_degrees(found.residual_rms)}")
        lines.append(f"{'all':{width}} {in_degrees(self.rms)}")
        return "\n".join(lines)


# --- the band of a predicted loop -------------------------------------------------------------------------------------


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
        width = f"Band of 95 % over {self.time[-1]:g} s; half width (RMS, deg): {in_degrees(self.half_width)}."
        drifts = " Theta drifts in an open loop: it is compared in windows of 1 s." if self.is_open else ""
        return f"{width}{drifts}\n{self.spread}"

    def _curves(self, angle: int) -> Curves:
        away = self.draws[:, angle] - self.middle[angle]
        if self.is_open and angle == 0:
            away = np.array([self._less_drift(one) for one in away])
        half = REACH * np.sqrt(np.mean(away**2, axis=0) + self.margin[angle] ** 2)
        return Curves(self.middle[angle] - half, self.middle[angle], self.middle[angle] + half)

    def _less_drift(self, difference: Vector) -> Vector:
        return less_mean(difference, windows(np.arange(self.time.size), self.time.size, float(self.time[1])))


def _changed(fit: FitResult, servo: float, link: float, omega_n: float, delay: float) -> VirtualPlantSpec:
    """Return the fitted bench with friction times factors, and with another omega_n (relative) and delay (s)."""
    plant = replace(with_friction(fit.parameters, servo, link), K_s=fit.parameters.K_s * (1 + omega_n) ** 2)
    return VirtualPlantSpec(fit.joint, plant, Timing(delay=max(fit.delay + delay, 0.0)))


def _spread(fit: FitResult) -> tuple[float, float, float]:
    """Return how far a run may be from the fit: a factor of friction, omega_n (relative), and the delay (s).

    The draws are even. Half their width is √3 standard deviations.
    """
    known = np.array([math.log(FRICTION), math.sqrt(3) * OMEGA_N_SPREAD])
    delay = math.sqrt(3) * fit.estimates["delay"].uncertainty if "delay" in fit.estimates else 0.0
    logs = len(fit.predictions)
    if logs > 1:
        scale = math.sqrt(3 * logs) / student(logs)  # an interval reaches Student's t standard errors of a mean
        ways = [name for name in ("servo_friction_plus", "servo_friction_minus") if name in fit.intervals]
        relative = [np.ptp(fit.intervals[name]) / 2 / max(fit.estimates[name].value, _LEAST) for name in ways]
        friction = scale * np.mean(relative) if ways else known[0]
        measured = np.array([friction, scale * 2 * fit.omega_n.uncertainty / fit.omega_n.value])
        known = np.sqrt((KNOWN * known**2 + (logs - 1) * measured**2) / (KNOWN + logs - 1) * (1 + 1 / logs))
    return math.exp(known[0]), float(known[1]), delay


# --- from the fit -----------------------------------------------------------------------------------------------------


def result_of(chosen: Chosen, servo: Servo, joint: Joint) -> FitResult:
    """What a fit has found, in the end."""
    problem, best, sure, fixed = chosen
    values = (best.values * problem.units).tolist()
    estimates, intervals = {}, {}
    errors, reaches = sure.errors.tolist(), sure.reaches.tolist()
    for name, value, error, reach in zip(problem.names, values, errors, reaches, strict=True):
        estimates[name], intervals[name] = Estimate(value, error), (value - reach, value + reach)
    own = _own(problem, values)
    for key, each in own.items():
        mean = estimates[key] = _mean(each, [estimates[f"{key}[{place}]"].uncertainty for place in range(len(each))])
        reach = student(len(each)) * mean.uncertainty
        intervals[key] = (mean.value - reach, mean.value + reach)
    plants = tuple(problem.plant(best.values, place) for place in range(len(problem.records)))
    common = problem.values(best.values, 0)
    return FitResult(
        parameters=changed(plants[0], {key: estimates[key].value for key in own}),
        delay=estimates["delay"].value if "delay" in problem.own else common.get("delay", problem.delay),
        estimates=estimates | {name: one.estimate for name, one in fixed.items()},
        intervals=intervals | {name: one.interval for name, one in fixed.items()},
        correlation=sure.correlation,
        predictions=predicted(problem, best.values),
        plants=plants,
        fixed={name: one.why for name, one in fixed.items()},
        servo=servo,
        joint=joint,
    )


def _own(problem: Problem, values: list[float]) -> dict[str, list[float]]:
    """The values in one recording after the other of each parameter of the plant that is each one's own."""
    own: dict[str, list[float]] = {}
    for unknown, value in zip(problem.unknowns, values, strict=True):
        if unknown.of is not None and unknown.parameter in problem.own:
            own.setdefault(unknown.key, []).append(value)
    return own


def _mean(values: list[float], errors: list[float]) -> Estimate:
    """The mean of what recordings have their own of, by their spread, or by their own errors where these are larger."""
    spread = max(float(np.std(values, ddof=1)), float(np.sqrt(np.mean(np.square(errors)))))
    return Estimate(float(np.mean(values)), spread / math.sqrt(len(values)))


def predicted(problem: Problem, unknowns: NDArray[np.float64]) -> tuple[Prediction, ...]:
    """Each recording of a problem, as measured and as simulated."""
    made = []
    for place, record in enumerate(problem.records):
        angles = problem.simulate(unknowns, place)
        made.append(Prediction(record.beside(*angles), record.rms(*angles)))
    return tuple(made)


def _called(name: str, recordings: Sequence[str]) -> str:
    """A parameter's name for people: ``alpha_offset[0]`` with the recording's name in the place of its number."""
    if not recordings:
        return name
    return re.sub(r"\[(\d+)\]$", lambda place: f"[{recordings[int(place[1])]}]", name)


def _digits(low: float, high: float) -> int:
    """So many significant digits that both ends of an interval are told apart, to two digits of its width."""
    if not 0 < high - low < math.inf:
        return _DIGITS
    largest = max(abs(low), abs(high))
    return max(_DIGITS, math.floor(math.log10(largest)) - math.floor(math.log10(high - low)) + 2)


def in_degrees(values: Mapping[str, float]) -> str:
    """Angles (rad) by name, for a line of text."""
    return ", ".join(f"{name} {value / DEG:.3f}" for name, value in values.items())


def joined_rms(predictions: tuple[Prediction, ...]) -> dict[str, float]:
    """The root mean squares over the samples of all."""
    samples = np.array([len(one.recording) for one in predictions])
    return {
        name: float(np.sqrt(np.average([one.rms[name] ** 2 for one in predictions], weights=samples)))
        for name in predictions[0].rms
    }
