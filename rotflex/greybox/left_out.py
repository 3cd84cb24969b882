"""How well a fit tells of a recording that it has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rotflex.greybox.result import FitResult, Prediction, in_degrees, joined_rms


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
