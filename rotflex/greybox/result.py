"""What a fit has found, and what can be done with it: predict a recording, or a loop with its band.

One recording does not tell how much runs differ. A standard deviation of 36 % in friction, of each direction by itself,
and of 0.76 % in omega_n are known of such rigs (``FRICTION``, ``OMEGA_N_SPREAD``). Between several recordings, the
spread is measured. Two or three recordings tell little of a spread. Therefore the known spread counts as one recording
more. :mod:`rotflex.greybox.bands` has what becomes of it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from rotflex import hil
from rotflex.config import Joint, Servo, real_array
from rotflex.controller import Controller
from rotflex.errors import BenchError
from rotflex.greybox.bands import ANGLES, NEW_RUN, REACH, Band, Loop, in_degrees, largest_rms, less_drift
from rotflex.greybox.problem import POSITIVE, Problem, changed, known, rms
from rotflex.greybox.solving import MAY_BE_NONE, Chosen, search, student
from rotflex.hil.bench import Bench
from rotflex.hil.student_benches import FIRST_RUN, VirtualPlantSpec
from rotflex.hil.virtual import Timing
from rotflex.identification import Estimate
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.units import DEG, Vector

#: standard deviation from run to run, of the logarithm of friction in each direction: three logs of one bench want
#: 0.026, 0.026 and 0.012 N·m one way, and about 0.016, 0.010 and 0.014 the other
FRICTION = 0.36
OMEGA_N_SPREAD = 0.0076  #: the same of omega_n, relative: these logs gave 23.01, 23.04 and 22.72 rad/s
KNOWN = 1  #: the known spread counts as so many recordings, beside those that are measured
_COUNTS = 1.5  # of an encoder: what is left at least, because the counters of bench and twin differ
#: times what the fit leaves of theta and alpha, on other runs: another controller lets the link swing as it did not in
#: the recording that was fitted. Of 71 drawn benches, 66 held 95 % under another controller with 1.5 for alpha
_ELSEWHERE = np.array([1.0, 2.25])
_LEAST = 1e-3  # N·m: of less friction, a relative spread says nothing
_SMALLEST = 0.05  # of the fitted value: an inertia, the stiffness or the torque per volt of a draw
_KNOWN = f"standard deviations of {FRICTION:.0%} in friction and {OMEGA_N_SPREAD:.1%} in omega_n are known of such rigs"
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


_CONDITIONS = ("alpha_offset", "theta_dot_0", "alpha_dot_0")  # of a recording, and no parameters of the plant


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

        Doubts about the recordings come first. Recordings are named by ``recordings``, else by their place.
        """
        beyond = self.parameters.J_eq / PlantParameters.of(self.servo, self.joint, self.parameters.K_s).J_eq
        inertia = f"This fit is doubted: J_eq is {beyond:.3g} times that of the data sheet. Are units, or J_l, wrong?"
        several = len(self.predictions) > 1
        places = [f"recording [{place}]" if several else "the recording" for place in range(len(self.predictions))]
        named = list(zip(recordings or places, self.predictions, strict=True))
        found = [f"{name}: {doubt}" for name, one in named for doubt in one.recording.doubts]
        found += [inertia] * (not 1 / _FAR < beyond < _FAR)
        return found + [
            f"This fit is doubted: what is left of {name} is {in_degrees(one.rms)} (RMS, deg), and of a flexible "
            f"joint's at most {in_degrees(_DOUBTFUL)}. Is it another mechanism's, or are units, signs, channels wrong?"
            for name, one in named
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
        """Predict a loop on a new run of the bench, with the band in which 95 % of a recording's samples should lie.

        The plant is simulated on its bench about sixty times, from rest at zero: with encoders and delay, and each time
        with other friction, omega_n and errors of the fit. See :mod:`rotflex.greybox.bands` for what the band stands
        on. A reference of 10 s at 2 ms takes about 9 s. The same fit and reference give the same band.

        Parameters
        ----------
        reference : (n,) commanded angle, rad, one per sample; V for an open loop
        controller : function (theta_ref, theta, alpha) → V, or a discrete system, see :mod:`rotflex.controller`; for an
            open loop ``rotflex.hil.controllers.OpenLoop()``
        sample_time : s
        progress : show a progress bar when it takes longer than a second

        Raises
        ------
        DesignError
            If the controller returns anything but one number.
        BenchError
            If the reference is not a list of finite numbers.
        """
        bench, size = _bench_of(self)
        least = _COUNTS * self.servo.K_enc / REACH
        left = np.maximum(least, np.max([_left(one.recording) for one in self.predictions], axis=0))
        spread = _SEVERAL.format(logs=len(self.predictions)) if len(self.predictions) > 1 else _ONE
        loop = Loop(
            real_array("The reference", reference, BenchError), controller, sample_time, bench, size, left, spread
        )
        return loop.band(np.zeros(size), np.eye(size), _ELSEWHERE * left, progress)

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
        lines += [
            *self.doubts(recordings),
            NEW_RUN,
            *self.fixed.values(),
            *self._correlation_warnings([*called.values()]),
        ]
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


# --- how runs differ --------------------------------------------------------------------------------------------------


def _bench_of(fit: FitResult) -> tuple[Callable[[Vector], Bench], int]:
    """Return a function that opens the bench of a draw, and how many standard normal numbers make a draw.

    The last three are friction in the positive and in the negative direction, and omega_n, as they differ from run to
    run. Those before are the parameters of the plant, with errors that go together as the fit says.
    """
    told = list(fit.estimates)[: len(fit.correlation)]
    names = [name for name in _UNITS if name in told and name not in _CONDITIONS]
    places = [told.index(name) for name in names]
    none = [name for name in MAY_BE_NONE if name in fit.fixed and math.isfinite(fit.estimates[name].uncertainty)]
    alike = block_diag(fit.correlation[np.ix_(places, places)], np.eye(len(none)))
    names += none
    values = np.array([fit.estimates[name].value for name in names])
    errors = np.array([fit.estimates[name].uncertainty for name in names])
    sizes, axes = np.linalg.eigh(alike * np.outer(errors, errors))
    root = axes * np.sqrt(np.maximum(sizes, 0.0))
    lowest = {"braking": fit.parameters.B_eq} | {name: _SMALLEST * known(fit.parameters, name) for name in POSITIVE}
    least = np.array([lowest.get(name, 0.0) for name in names])
    friction, omega_n = _spread(fit)

    def bench(draw: Vector) -> Bench:
        drawn = dict(zip(names, np.maximum(values + root @ draw[:-3], least).tolist(), strict=True))
        plant = changed(fit.parameters, drawn)
        plus, minus = (np.array(plant.servo_friction) * np.exp(friction * draw[-3:-1])).tolist()
        plant = replace(plant, servo_friction=(plus, minus), K_s=plant.K_s * (1 + omega_n * float(draw[-1])) ** 2)
        spec = VirtualPlantSpec(fit.joint, plant, Timing(delay=drawn.get("delay", fit.delay)))
        return hil.open("virtual", plant=spec, servo=fit.servo)

    return bench, len(names) + 3


def _left(recording: Recording) -> Vector:
    """Return what a fit leaves of a recording, as ``Loop.left``."""
    theta, alpha = (recording[name] - recording[f"{name}_model"] for name in ANGLES)
    step = recording.sample_time
    return largest_rms(np.array([less_drift(theta, step), alpha]), step)


def _spread(fit: FitResult) -> tuple[float, float]:
    """Return the standard deviations from run to run, of the logarithm of friction and, relative, of omega_n."""
    variance = np.square([FRICTION, OMEGA_N_SPREAD])
    logs = len(fit.predictions)
    if logs > 1:
        scale = math.sqrt(logs) / student(logs)  # an interval reaches Student's t standard errors of a mean
        ways = [name for name in ("servo_friction_plus", "servo_friction_minus") if name in fit.intervals]
        relative = [np.ptp(fit.intervals[name]) / 2 / max(fit.estimates[name].value, _LEAST) for name in ways]
        friction = scale * np.mean(relative) if ways else FRICTION
        measured = np.square([friction, scale * 2 * fit.omega_n.uncertainty / fit.omega_n.value])
        variance = (KNOWN * variance + (logs - 1) * measured) / (KNOWN + logs - 1)
    friction, omega_n = np.sqrt(variance * (1 + 1 / logs)).tolist()  # the fit has the mean of its runs
    return friction, omega_n


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


def joined_rms(predictions: tuple[Prediction, ...]) -> dict[str, float]:
    """The root mean squares over the samples of all."""
    samples = np.array([len(one.recording) for one in predictions])
    return {
        name: float(np.sqrt(np.average([one.rms[name] ** 2 for one in predictions], weights=samples)))
        for name in predictions[0].rms
    }
