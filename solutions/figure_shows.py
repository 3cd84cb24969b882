"""The check of figures that show a response: the experiment run again, or the student's own recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.courseware.json_values import thin
from rotflex.courseware.parts import Part
from rotflex.instructor.marking.checks import misfit
from rotflex.instructor.marking.figure_checks import DEGREES, RADIANS, SECONDS, curves, has_unit
from rotflex.instructor.verdicts import Case, Verdict, for_a_person, partly, right, wrong
from rotflex.units import DEG

from .response_checks import Again

Vector = NDArray[np.float64]
_VOLTS = r"v|volts?"
_THINNED_VOLTAGE_RTOL = 0.6  # of a curve that follows a voltage between few samples; one that is not it has 1 or more


@dataclass(frozen=True)
class FigureShows:
    """A figure with a curve for each of some channels over time, with units.

    Parameters
    ----------
    again : runs the experiment again
    own : (question, part) of the student's own recording, which is just as good to show
    channels : to be seen; angles in degrees or radians, the voltage in volts
    rtol : largest RMS difference, relative
    """

    again: Again
    own: tuple[str, str]
    channels: tuple[str, ...]
    rtol: float = 0.15
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for each channel, then at the labels."""
        if not case.virtual:
            return for_a_person("It does not come from the virtual bench; a person will look at it.")
        missing, unlabelled = [], []
        shown = self._shown(case)
        for channel in self.channels:
            found = (self._axis(value, *samples[channel], channel, rtol) for samples, rtol in shown)
            axis = next(filter(None, found), None)
            if axis is None:
                missing.append(channel)
            elif not self._is_labelled(axis, channel):
                unlabelled.append(channel)
        if len(missing) == len(self.channels):
            return wrong("No curve in the figure follows the recording that it should show.")
        share = 1 - (len(missing) + len(unlabelled) / 2) / len(self.channels)
        if share == 1:
            return right(f"Curves of {', '.join(self.channels)} over time, with units.")
        reasons = [f"no curve follows {', '.join(missing)}"] * bool(missing)
        reasons += [f"units are missing on the axes of {', '.join(unlabelled)}"] * bool(unlabelled)
        return partly(round(share, 2), f"The figure shows the recording, but {' and '.join(reasons)}.")

    def _shown(self, case: Case) -> list[tuple[dict[str, tuple[Vector, Vector]], float]]:
        """Times and values, by channel, of what may be seen: the experiment run again, or the student's recording.

        With each, how far a voltage may be off. Of the student's recording, few of its ragged samples are kept.
        """
        try:
            own = case.own(*self.own)
        except LookupError:
            own = {"metadata": {}, "channels": {}}
        shown = [
            ({channel: (run.time, run[channel]) for channel in self.channels}, self.rtol)
            for run in self.again(case, own["metadata"])
        ]
        if all(channel in own["channels"] for channel in self.channels):
            values = {channel: own["channels"][channel]["values"] for channel in self.channels}
            thinned = {n: (thin(own["n"], v.size) * own["sample_time"], v) for n, v in values.items()}
            shown.append((thinned, _THINNED_VOLTAGE_RTOL))
        return shown

    def _axis(
        self, figure: dict[str, Any], time: Vector, values: Vector, channel: str, voltage_rtol: float
    ) -> dict[str, Any] | None:
        """The axes on which a curve follows a channel, over a fifth of the recording at least."""
        scales, rtol = ((1.0,), voltage_rtol) if channel == "vm" else ((1 / DEG, 1.0), self.rtol)
        for axis, x, y in curves(figure):
            if np.ptp(x) < 0.2 * time[-1] or x.min() < -1e-6 or x.max() > time[-1] + 1e-6:
                continue
            wanted = np.interp(x, time, values)
            if any(misfit(y, scale * wanted) <= rtol for scale in scales):
                return axis
        return None

    def _is_labelled(self, axis: dict[str, Any], channel: str) -> bool:
        unit = _VOLTS if channel == "vm" else f"{DEGREES}|{RADIANS}"
        return has_unit(axis["xlabel"], SECONDS) and has_unit(axis["ylabel"], unit)
