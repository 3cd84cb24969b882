"""The check of figures that show a response: the experiment run again, or the student's own recording."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.parts import Part
from labcourse.grading.marking.curves import Match, Trace, Wanted, best_match, find_matches, own_trace
from labcourse.grading.verdicts import Case, Verdict, for_a_person, partly, right, wrong

from .quantities import ANGLE, VOLTAGE
from .repeated import Again

_THINNED_VOLTAGE_RTOL = 0.6  # of a curve that follows a voltage between few samples; one that is not it has 1 or more
_LARGEST = 1e3  # rad and V; what is larger in the student's own recording is from no bench
_NO_CURVE, _NOT_IT = 0.0, 1.0  # what it costs to show a channel by none, or by one that does not follow
_BY_MISFIT = 1e-3  # of a share, between curves that earn the same

Shown = dict[str, list[Match]]  # channel → the curves that follow it


@dataclass(frozen=True)
class FigureShows:
    """A figure with a curve for each of some channels over time, with units, over a turn of the command or more.

    The time may be counted from anywhere, the same for curves over the same stretch of it. A curve shows one channel.

    Parameters
    ----------
    again : runs the experiment again
    own : (question, part) of the student's own recording, which is just as good to show
    channels : to be seen; angles and the voltage, in any units
    command : the channel whose turns are counted; of one that does not turn, half of the recording is to be seen
    rtol : largest RMS difference, relative
    """

    again: Again
    own: tuple[str, str]
    channels: tuple[str, ...]
    command: str = "theta_ref"
    rtol: float = 0.15
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for each channel, then at the labels."""
        if not case.truth_is_known:
            return for_a_person("It does not come from a bench that is known here; a person will look at it.")
        shown: Shown = {channel: [] for channel in self.channels}
        for wanted in self._wanted(case):
            for channel, seen in _seen(value, wanted).items():
                shown[channel] += seen
        chosen = _one_curve_each(shown)
        reasons = [_missing(channel, best_match(shown[channel])) for channel in self.channels if channel not in chosen]
        if not chosen:
            known = "".join(f"; {reason}" for reason in reasons if ":" in reason)
            return wrong(
                "No curve in the figure follows the recording that it should show over a turn of the command or "
                f"more{known}."
            )
        if reasons:
            reasons.append("each curve should follow over a turn of the command or more")
        reasons += dict.fromkeys(fault for seen in chosen.values() for fault in seen.faults)
        if not reasons:
            return right(f"Curves of {', '.join(self.channels)} over time, with units.")
        share = sum(seen.share for seen in chosen.values()) / len(self.channels)
        return partly(
            round(share, 2),
            f"The figure shows the recording, but {'; '.join(reasons)}.",
        )

    def _wanted(self, case: Case) -> Iterator[dict[str, Wanted]]:
        """What may be seen, by channel: the experiment run again, or the student's recording.

        With each, how far a curve may be off. Of the student's recording, few of its ragged samples are kept.
        """
        try:
            metadata = case.own(*self.own)["metadata"]
        except LookupError:
            metadata = {}
        turn = math.inf
        for run in self.again(case, metadata):
            turn = _turn(run[self.command], run.sample_time)
            traces = {channel: Trace(run.time, run[channel]) for channel in self.channels}
            yield {channel: self._of(channel, trace, turn, self.rtol) for channel, trace in traces.items()}
        own = {one: own_trace(case, self.own, one, _LARGEST, smooth=one != "vm") for one in self.channels}
        yield {
            channel: self._of(channel, trace, turn, _THINNED_VOLTAGE_RTOL if channel == "vm" else self.rtol)
            for channel, trace in own.items()
            if trace is not None
        }

    def _of(self, channel: str, trace: Trace, turn: float, rtol: float) -> Wanted:
        return Wanted(trace, VOLTAGE if channel == "vm" else ANGLE, rtol, min(turn, trace.duration / 2))


def _turn(command: NDArray[np.float64], sample_time: float) -> float:
    """How long a turn of a command takes, s: from one rise to the next; inf where it does not rise twice."""
    rises = np.flatnonzero(np.diff((command > (command.min() + command.max()) / 2).astype(int)) > 0)
    return float(np.diff(rises).max() * sample_time) if rises.size > 1 else math.inf


def _seen(figure: dict[str, Any], wanted: dict[str, Wanted]) -> Shown:
    """The curves that follow each channel: with the recording's times; where there are none, with others."""
    found: Shown = {channel: [] for channel in wanted}
    for search in (False, True):
        for channel, one in wanted.items():
            if any(seen.share for seen in found[channel]):
                continue
            origins = [(seen.curve, seen.shift) for shown in found.values() for seen in shown if seen.share]
            found[channel] += find_matches(figure, one, search and one.rtol < _THINNED_VOLTAGE_RTOL, origins)
    return found


def _one_curve_each(shown: Shown) -> dict[str, Match]:
    """A curve for each channel that has one, no curve for two, so that most is earned."""
    from scipy.optimize import linear_sum_assignment

    curves = list(dict.fromkeys(seen.curve.lines for of_one in shown.values() for seen in of_one if seen.share))
    place = {lines: column for column, lines in enumerate(curves)}
    costs = np.full((len(shown), len(curves)), _NOT_IT)
    nearest: dict[tuple[int, int], Match] = {}
    for row, of_one in enumerate(shown.values()):
        for seen in filter(lambda seen: seen.share, of_one):
            column, cost = place[seen.curve.lines], _BY_MISFIT * seen.misfit - seen.share
            if cost < costs[row, column]:
                costs[row, column], nearest[row, column] = cost, seen
    costs = np.hstack([costs, np.full((len(shown), len(shown)), _NO_CURVE)])
    channels = list(shown)
    pairs = np.transpose(linear_sum_assignment(costs)).tolist()
    return {channels[row]: nearest[row, column] for row, column in pairs if (row, column) in nearest}


def _missing(channel: str, seen: Match | None) -> str:
    if seen is None or not seen.lacking:
        return f"no curve of its own follows {channel}"
    return f"{channel}: {seen.lacking}"
