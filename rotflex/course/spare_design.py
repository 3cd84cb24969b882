"""A gain to go on with where the student's own cannot be run, so that nobody is stuck.

A loop that runs away, a bench that stops at a limit, a servo that does not follow: nothing can be recorded or measured
then. The notebooks say so, say where to look, and go on with the gain of the workbook's own example, which is printed
there. On a model that this gain does not hold either, they take one that puts its poles somewhere harmless.

Marking decides by the same functions, so that what was made with a spare gain is taken as what it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import experiments, response
from rotflex.errors import DesignError, LimitExceeded, NotRecorded, RotflexError
from rotflex.hil.bench import Bench
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, RATE, SAMPLE_TIME
from rotflex.units import DEG

Gain = NDArray[np.float64]

#: The gain printed in the workbook, for its own example: V/rad, V/rad, V/(rad/s), V/(rad/s).
SPARE_GAIN = (18.2356, -17.1547, 1.5893, 0.6327)

_HARMLESS_POLES = (-10 + 10j, -10 - 10j, -25, -30)  # rad/s: settled well within a turn, and not what is asked for
_SMALL, _SHORT = 2 * DEG, 3.1  # amplitude (rad) and duration (s) of the first try on a bench
_VIRTUAL = frozenset(("seed", "preset"))  # one of these is in the identity of each virtual bench
_ON_THE_AXIS = 1e-6  # of the fastest pole: what is nearer to the imaginary axis is on it, but for rounding

_WHERE = (
    "Look at question 2.14 (the signs in A and B), 3.5 (the desired coefficients minus the open-loop ones, the "
    "constant term first) and 3.8 (K from K_c and the inverse of W)."
)
_COST = (
    "{act} it now, or go on: from here on, this notebook uses {what}. What you record and measure with it counts in "
    "full. You lose points only for the answer that is {fault}."
)
_WRONG = {"act": "Correct", "fault": "wrong"}


def runs_away(A: ArrayLike, B: ArrayLike, K: ArrayLike) -> bool:
    """Whether a pole of A − B K has a positive real part; also where one is no finite number."""
    A, B, K = np.asarray(A, dtype=float), np.reshape(B, (4, 1)), np.reshape(K, (1, 4))
    with np.errstate(all="ignore"):
        loop = A - B @ K
    if not np.isfinite(loop).all():
        return True
    poles = np.linalg.eigvals(loop)
    return bool(poles.real.max() > _ON_THE_AXIS * max(1.0, np.abs(poles).max()))


def can_be_measured(recording: Recording) -> bool:
    """Whether the servo follows the command, so that there is a response to measure."""
    try:
        worst = response.worst(response.measure(recording))
    except RotflexError:
        return False
    return None not in (worst.settling_time, worst.overshoot, worst.max_alpha, worst.max_vm)


def holds(A: ArrayLike, B: ArrayLike, K: ArrayLike) -> bool:
    """Whether the loop of a model (voltage as input) and a gain neither runs away nor stays where it is."""
    if runs_away(A, B, K):
        return False
    command = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
    try:
        return can_be_measured(closed_loop(A, B, K, command, saturation=None))
    except RotflexError:
        return False


def stand_in(A: ArrayLike, B: ArrayLike) -> Gain | None:
    """A gain (1, 4) that holds a model: the workbook's printed one, else one with harmless poles; None if none does."""
    printed = np.array([SPARE_GAIN])
    if holds(A, B, printed):
        return printed
    import control

    try:
        placed = np.reshape(control.acker(np.asarray(A, dtype=float), np.reshape(B, (4, 1)), _HARMLESS_POLES), (1, 4))
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        return None
    return placed if holds(A, B, placed) else None


def for_model(A: ArrayLike, B: ArrayLike, K: ArrayLike) -> Gain | None:
    """The student's gain (1, 4) if it holds their model, else one to go on with, saying why; None if there is none."""
    own = np.reshape(np.asarray(K, dtype=float), (1, 4))
    if holds(A, B, own):
        return own
    if runs_away(A, B, own):
        print("With your gain, your model is unstable: a pole has a positive real part.", _WHERE)
    else:
        print("With your gain, the servo of your model does not follow the command.", _WHERE)
    spare = stand_in(A, B)
    if spare is None:
        print("This cell found no gain that works with this model, so the cells below wait for another model.")
    elif np.array_equal(spare, [SPARE_GAIN]):
        print(_COST.format(what=f"the workbook's printed gain, K = {_listed(spare)}", **_WRONG))
    else:
        print(
            "The workbook's printed gain does not work with your model either, so the model itself is not right.",
            _COST.format(what="another gain, which only makes your model stable", **_WRONG),
        )
    return spare


def for_bench(bench: Callable[[], Bench], K: ArrayLike | None, feedback: Sequence[str] = ("full",)) -> Gain:
    """The student's gain (1, 4) if there is one and their bench bears it, else the workbook's printed one, saying why.

    On a real bench it is tried with a small wave; on a virtual one, where nothing can break, with the whole one.

    Parameters
    ----------
    bench : gives the bench, not yet open: ``lab.bench``
    K : the student's gain, (4,) or (1, 4); None if they have none
    feedback : with which it is to be run
    """
    spare = np.array([SPARE_GAIN])
    what = f"the workbook's printed gain, K = {_listed(spare)}"
    if K is None:
        cost = _COST.format(what=what, act="Answer", fault="missing")
        print("There is no gain of yours to run: question 3.8 is not answered.", cost)
        return spare
    own = np.reshape(np.asarray(K, dtype=float), (1, 4))
    why = next(filter(None, (_what_happens(bench, own, way) for way in feedback)), "")
    if not why:
        return own
    print(f"The bench cannot run with your gain: {why}", _WHERE, _COST.format(what=what, **_WRONG))
    return spare


def _what_happens(bench: Callable[[], Bench], K: Gain, feedback: str) -> str:
    """Why a gain is of no use on a bench, in words; nothing if it is."""
    whole = _fails(bench, K, feedback) if _VIRTUAL & bench().identity.keys() else None
    if whole == "":  # what follows the whole wave follows the small one
        return ""
    return _fails(bench, K, feedback, amplitude=_SMALL, duration=_SHORT) or whole or ""


def _fails(bench: Callable[[], Bench], K: Gain, feedback: str, **wave: float) -> str:
    """Why an experiment with a gain gives nothing to measure, in words; nothing if it does."""
    try:
        with bench() as opened:
            run = experiments.tracking(opened, K, feedback, progress=False, **wave)
    except (LimitExceeded, DesignError, NotRecorded) as error:  # what passed a limit at the bench was not recorded
        return str(error)
    return "" if wave or can_be_measured(run) else "the servo does not follow the command."


def _listed(gain: Gain) -> str:
    return "[{}]".format(", ".join(f"{entry:g}" for entry in gain.ravel()))
