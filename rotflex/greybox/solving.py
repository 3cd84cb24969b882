"""The least squares of a problem, how sure they are, and which parameters recordings do not tell.

Three variances of the unknowns are found, and the largest counts:

* *White residuals*, as the textbook has them, times a factor. A periodic motion repeats its rounding errors period
  after period, which no residual can show; on virtual benches the errors are about twice what white residuals mean.
* *Windows* (cluster-robust: Liang and Zeger, 1986): sums over windows of 1 s count as independent, not samples.
* *Recordings*, where there are several: the jackknife that leaves out one recording after the other (CR3 of Bell and
  McCaffrey, 2002), linearised at the least squares. It sees what varies from log to log, and the equations leave out.
  The errors of what is common reach what is each recording's own, and are added there.

Intervals use Student's t for the number of windows, or of recordings. On 16 virtual benches whose servo friction
differed by up to half between three recordings (3.2 s each, friction each one's own), 94 of 96 intervals of 95 % of
common parameters held the truth, and 92 of 96 of friction; by windows alone, 85 of the 96, and 41 of 60. With one
friction for all, which is not so, 60 of 60 common ones did, several times as wide; by windows alone, 50.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.greybox.problem import DIFFERENCE_STEP, Jacobian, Problem, changed, known
from rotflex.identification import Estimate
from rotflex.plant import PlantParameters
from rotflex.progress import progress as bar
from rotflex.units import Vector

CONFIDENCE = 0.95
_TOLERANCE = 1e-3  # of the sum of squares: a step that gains less is the last
MOST_RUNS = 600  #: of the plant for each recording in a whole fit; 60 to 170 are usual, and 430 for another mechanism
_SMALLEST_INFLATION = 2.0  # of the standard errors for white residuals
_NONE = 1e-6  # of the unit: a friction or a delay that is less was pushed against its bound, which is zero
_LARGEST_CONDITION = 1e10  # of the information, scaled: beyond, something is not told
_TAKES_PART = 0.1  # of an unknown in a direction that is not told


class Optimum(NamedTuple):
    """Where the sum of squares is least, in units of the unknowns."""

    values: Vector
    residual: Vector
    jacobian: Jacobian


class Sureness(NamedTuple):
    """Standard errors, half widths of the 95 % intervals, SI units; and (p, p) correlations.

    ``within`` are the half widths without what varies from recording to recording: whether something is told at all.
    """

    errors: Vector
    reaches: Vector
    within: Vector
    correlation: NDArray[np.float64]


def search(problem: Problem, progress: bool) -> Optimum:
    """The least squares. Runs that the problem has behind it count, too.

    Raises
    ------
    IdentificationError
        If the search does not settle in ``MOST_RUNS`` runs of the plant for each recording.
    """
    from scipy.optimize import least_squares

    latest: dict[bytes, Vector] = {}
    most = MOST_RUNS * len(problem.records)

    def value(unknowns: Vector) -> Vector:
        if problem.runs >= most:
            raise IdentificationError(
                f"The fit has not settled in {most} runs of the plant. Fit fewer parameters, or give an initial plant "
                "that is nearer to the bench."
            )
        latest.clear()  # the Jacobian is asked for where the residual was found last
        return latest.setdefault(unknowns.tobytes(), problem.residual(unknowns))

    def jacobian(unknowns: Vector) -> Jacobian:
        here = latest.get(unknowns.tobytes())
        return problem.jacobian(unknowns, problem.residual(unknowns) if here is None else here)

    with bar(None, "fit", "run", progress, most) as counter:
        counter.update(problem.runs)
        problem.count = counter.update
        best = least_squares(
            value,
            np.maximum(problem.begin, problem.lowest + DIFFERENCE_STEP),
            jac=jacobian,
            bounds=(problem.lowest, np.inf),
            ftol=_TOLERANCE,
            xtol=1e-5,
            max_nfev=most,
        )
    return Optimum(np.where(np.abs(best.x) < _NONE, 0.0, best.x), np.asarray(best.fun), np.asarray(best.jac))


def untold(problem: Problem, best: Optimum) -> list[str]:
    """Names of the unknowns that the recordings do not tell: without effect, or with the same effect as others."""
    information = best.jacobian.T @ best.jacobian
    scale = np.sqrt(np.diag(information))
    if not scale.all():
        return [name for name, size in zip(problem.names, scale.tolist(), strict=True) if size == 0]
    scaled = information / np.outer(scale, scale)
    if np.linalg.cond(scaled) <= _LARGEST_CONDITION:
        return []
    weakest = np.abs(np.linalg.eigh(scaled)[1][:, 0])
    return [name for name, part in zip(problem.names, weakest.tolist(), strict=True) if part > _TAKES_PART]


def sureness(problem: Problem, best: Optimum) -> Sureness:
    """How sure the values are.

    Raises
    ------
    IdentificationError
        If the recordings do not tell one of them.
    """
    lost = untold(problem, best)
    if lost:
        raise IdentificationError(
            f"The recording does not tell what {', '.join(lost)} are. Fit fewer, or record more motion."
        )
    inverse = np.linalg.inv(best.jacobian.T @ best.jacobian)
    white = _SMALLEST_INFLATION**2 * np.diag(inverse) * (best.residual @ best.residual)
    white /= best.residual.size - best.values.size
    windows, clusters = _between_windows(problem, best, inverse)
    variance = np.maximum(windows, white)
    reaches = within = student(clusters) * np.sqrt(variance)
    if len(problem.records) > 1:
        recordings = _between_recordings(problem, best)
        common = np.array([one.of is None for one in problem.unknowns])
        spread = student(len(problem.records)) * np.sqrt(recordings)
        # What is a recording's own has an error of its own, and that of the common ones besides.
        variance = np.where(common, np.maximum(variance, recordings), variance + recordings)
        reaches = np.where(common, np.maximum(within, spread), np.hypot(within, spread))
    return Sureness(
        errors=np.sqrt(variance) * problem.units,
        reaches=reaches * problem.units,
        within=within * problem.units,
        correlation=inverse / np.sqrt(np.outer(np.diag(inverse), np.diag(inverse))),
    )


def _between_windows(problem: Problem, best: Optimum, inverse: NDArray[Any]) -> tuple[Vector, int]:
    """Variances of the unknowns with windows as clusters, and how many windows there are."""
    windows = problem.windows()
    sums = np.zeros((windows.max() + 1, best.values.size))
    np.add.at(sums, windows, best.jacobian * best.residual[:, None])
    clusters = np.unique(windows).size
    robust = inverse @ (sums.T @ sums) @ inverse * clusters / (clusters - 1)
    return np.asarray(np.diag(robust)), clusters


def _between_recordings(problem: Problem, best: Optimum) -> Vector:
    """Variances of the common unknowns by the jackknife over recordings, and what each one's own have from them."""
    common = np.array([one.of is None for one in problem.unknowns])
    parts = [_without_own(problem, best, common, place) for place in range(len(problem.records))]
    whole = sum((information for information, _score in parts), np.zeros((common.sum(),) * 2))
    moved = np.array([np.linalg.lstsq(whole - information, score, rcond=None)[0] for information, score in parts])
    moved = (moved - moved.mean(axis=0)) * np.sqrt((len(parts) - 1) / len(parts))
    variance = np.zeros(common.size)
    variance[common] = (moved**2).sum(axis=0)
    for place, rows in enumerate(problem.rows):
        own = np.array([one.of == place for one in problem.unknowns])
        along = np.linalg.lstsq(best.jacobian[rows][:, own], best.jacobian[rows][:, common] @ moved.T, rcond=None)[0]
        variance[own] = (along**2).sum(axis=1)
    return variance


def _without_own(
    problem: Problem, best: Optimum, common: NDArray[np.bool_], place: int
) -> tuple[NDArray[np.float64], Vector]:
    """What one recording says of the common unknowns, whatever its own are: its information, and its score."""
    rows = problem.rows[place]
    own = np.array([one.of == place for one in problem.unknowns])
    ours, residual = best.jacobian[rows][:, common], best.residual[rows]
    basis = np.linalg.qr(best.jacobian[rows][:, own])[0]
    free = ours - basis @ (basis.T @ ours)
    return free.T @ free, free.T @ residual


def student(samples: int) -> float:
    """Half width of the interval in standard errors."""
    from scipy.stats import t

    return float(t.ppf((1 + CONFIDENCE) / 2, samples - 1))


# --- what to fit, unless somebody says it -----------------------------------------------------------------------------

FREE = ("K_s", "J_eq", "torque_per_volt", "braking", "B_l", "servo_friction", "link_friction", "delay")
MAY_BE_NONE = ("link_friction", "delay", "B_l")  # in the order in which they are given up
_ON_DATA_SHEETS = ("torque_per_volt", "braking", "J_eq")
_OPEN = 0.25  # of the value: half an interval so wide tells less than a data sheet

_AS_NONE = "{name}: not told from none (95 %: {low:.2g} to {high:.2g}), so it is taken as none."
_SHEET = "{name}: left open (95 %: {low:.2g} to {high:.2g}), so it stays at {value:.4g}, where the fit began."
_NOT_AT_ALL = "{name}: nothing tells it, so it is taken as {value:.4g}."

#: A problem from the plant to start from, the delay, and what is free.
Make = Callable[[PlantParameters, float, Sequence[str]], Problem]


class Fixed(NamedTuple):
    """A parameter that was given up: its value with what the fit said of it while it was free, and why, in words."""

    estimate: Estimate
    interval: tuple[float, float]
    why: str


class Chosen(NamedTuple):
    """A fit of what is told, and what is not."""

    problem: Problem
    best: Optimum
    sure: Sureness
    fixed: dict[str, Fixed]


def choose(make: Make, nominal: PlantParameters, progress: bool) -> Chosen:
    """Fit, give up what is told least, and fit again from there.

    Raises
    ------
    IdentificationError
        If something is not told that nobody knows, such as the stiffness.
    """
    free: tuple[str, ...] = FREE
    plant, delay, fixed, runs = nominal, 0.0, dict[str, Fixed](), 0
    while True:
        problem = make(plant, delay, free)
        problem.runs = runs
        best = search(problem, progress)
        runs = problem.runs
        name, sure = _without_effect(problem, best), None
        if name is None:
            sure = sureness(problem, best)
            name = _next_to_fix(problem, best, sure)
            if name is None:
                return Chosen(problem, best, sure, fixed)
        plant, delay = problem.plant(best.values, 0), problem.values(best.values, 0).get("delay", delay)
        value = 0.0 if name in MAY_BE_NONE else known(nominal, name)
        fixed[name] = _fix(name, value, problem, best, sure)
        free = tuple(other for other in free if other != name)
        plant, delay = changed(plant, {name: value}), 0.0 if name == "delay" else delay


def _without_effect(problem: Problem, best: Optimum) -> str | None:
    """The first to be given up of what is not told at all."""
    keys = {name.partition("[")[0] for name in untold(problem, best)}
    return next((name for name in (*MAY_BE_NONE, *_ON_DATA_SHEETS) if name in keys), None)


def _next_to_fix(problem: Problem, best: Optimum, sure: Sureness) -> str | None:
    """Return the next parameter to fix because the recordings do not determine it; None if they determine all.

    First come those that may be zero, if their uncertainty exceeds their value; then those on data sheets.
    """
    values = np.abs(best.values) * problem.units
    for names, enough in ((MAY_BE_NONE, 1.0), (_ON_DATA_SHEETS, 1 / _OPEN)):
        for name in names:
            places = _places(problem, name)
            if name in problem.free and (values[places] / _reaches(problem, name, sure)).max() < enough:
                return name
    return None


def _reaches(problem: Problem, name: str, sure: Sureness) -> Vector:
    """Half widths that decide whether a parameter is given up: of a friction or a delay, those that are reported.

    Of two recordings, Student's t is 12.7: damping and delay would be given up that each of the two tells. So would
    what stands on data sheets, of any number. Without a Coulomb friction of the link, B_l still damps it.
    """
    reported = name == "link_friction" or (name in MAY_BE_NONE and len(problem.records) != 2)
    return (sure.reaches if reported else sure.within)[_places(problem, name)]


def _fix(name: str, value: float, problem: Problem, best: Optimum, sure: Sureness | None) -> Fixed:
    """What is kept of a parameter that is given up; without ``sure`` it is not told at all."""
    if sure is None:
        return Fixed(Estimate(value, np.inf), (-np.inf, np.inf), _NOT_AT_ALL.format(name=name, value=value))
    places = _places(problem, name)
    values, reaches = (best.values * problem.units)[places], _reaches(problem, name, sure)
    low, high = float((values - reaches).min()), float((values + reaches).max())
    why = (_AS_NONE if name in MAY_BE_NONE else _SHEET).format(name=name, low=low, high=high, value=value)
    return Fixed(Estimate(value, float(sure.errors[places].max())), (low, high), why)


def _places(problem: Problem, name: str) -> list[int]:
    """Where a parameter stands among the unknowns: once, or once for each recording."""
    return [place for place, one in enumerate(problem.unknowns) if one.key == name]
