"""Why a recording may not be relied on: facts that every recording carries as ``recording.doubts``.

A doubt is data. ``str(doubt)`` is the sentence for whoever reads it. These are the codes:

===================  =================================================================================================
``late_samples``     samples came late, or never: ``late``, ``missed`` of ``samples``
``uneven_time``      steps of the time differ from the usual one: ``uneven`` of ``samples``, ``usual``, ``widest`` (s)
``clock_off``        the board's clock differs from the computer's: ``drift``, of the time
``other_mechanism``  the link's equation of motion leaves the part ``left`` of the deflection unexplained
``early_end``        the run was broken off: ``reason``
===================  =================================================================================================

There is one bound: a recording with more than 1 % of late or uneven samples is refused, by steps and verdicts
(:mod:`rotflex.response`), identification, fits and bands. All other doubts are said, and the figures stand.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotflex import link, unanswered
from rotflex.errors import DoubtfulRecording, IdentificationError
from rotflex.units import Vector

FEW = 0.01  #: of the samples: where more came late, never or unevenly, a recording is not to be relied on
HELPS = (
    "The computer was busy: close other programs, run on mains power, plug the board in without a hub, and give it a "
    "clock of its own. If that does not help, check the board's power and cables."
)
UNEVEN = 1e-3  #: of the usual step, by which one may differ; a log's time column carries rounding
_OWN = ("virtual bench", "simulation", "")  # sources that have no other mechanism; none, for arrays in memory
_BY_HAND = ("watch", "hold")  # experiments in which a hand moves the arm
_SENTENCES = {
    "late_samples": (
        "Of {samples} samples {late} came late and {missed} never came: {judged} (at most {few:.0%} may). " + HELPS
    ),
    "uneven_time": (
        "Of {samples} samples {uneven} do not come after the usual {usual:.4g} s, but after up to {widest:.4g} s: "
        "{judged} (at most {few:.0%} may). recording.resampled({usual:.3g}) spaces them evenly."
    ),
    "clock_off": "{clock} All times and frequencies may be off by as much.",
    "other_mechanism": (
        "The arm does not swing as a flexible joint's: {left:.0%} of its deflection remain unexplained. Is it another "
        "mechanism's, did something touch the arm, or are signs, units or channels wrong?"
    ),
    "early_end": "The run ended early: {reason}",
}


@dataclass(frozen=True)
class Doubt:
    """A reason why a recording may not be relied on.

    Attributes
    ----------
    code : see the module
    parameters : plain data
    share : of the samples, that it concerns; 0 where it concerns none in particular
    """

    code: str
    parameters: Mapping[str, Any]
    share: float = 0.0

    @property
    def refuses(self) -> bool:
        """Whether the recording is not to be measured on."""
        return self.share > FEW

    def __str__(self) -> str:
        judged, clock = (
            "too many" if self.refuses else "few enough",
            unanswered.of_clock(self.parameters.get("drift", 0)),
        )
        return _SENTENCES[self.code].format(**self.parameters, judged=judged, few=FEW, clock=clock)


def of_samples(metadata: Mapping[str, Any], samples: int) -> Doubt | None:
    """Return the doubt about samples that came late or never, of so many; None where all came in time."""
    late, missed = unanswered.counted(metadata)
    if not late + missed:
        return None
    return Doubt("late_samples", {"late": late, "missed": missed, "samples": samples}, (late + missed) / samples)


def of_recording(time: Vector, signals: Mapping[str, Vector], metadata: Mapping[str, Any]) -> Iterator[Doubt]:
    """Yield all doubts about a recording.

    Parameters
    ----------
    time : (n,) s
    signals : channels (n,) by name, in SI units
    metadata : of the recording
    """
    if late := of_samples(metadata, time.size):
        yield late
    steps = np.diff(time)
    usual = float(np.median(steps))
    if uneven := int(np.count_nonzero(np.abs(steps - usual) > UNEVEN * usual + 1e-9)):
        about = {"uneven": uneven, "samples": time.size, "usual": usual, "widest": float(steps.max())}
        yield Doubt("uneven_time", about, uneven / time.size)
    if abs(drift := unanswered.drift_of(metadata)) > unanswered.DRIFT:
        yield Doubt("clock_off", {"drift": drift})
    if not uneven and (left := _unexplained(signals, usual, metadata)) > link.OTHER_MECHANISM:
        yield Doubt("other_mechanism", {"left": left})
    if reason := metadata.get("ended"):
        yield Doubt("early_end", {"reason": str(reason)})


def _unexplained(signals: Mapping[str, Vector], dt: float, metadata: Mapping[str, Any]) -> float:
    """Return the part of the deflection that the link's equation leaves at any frequency; 0 if it cannot be judged."""
    if metadata.get("source", "") in _OWN or metadata.get("experiment") in _BY_HAND:
        return 0.0
    if not signals.keys() >= {"theta", "alpha", "vm"} or not link.can_be_judged(signals["alpha"], signals["vm"], dt):
        return 0.0
    return link.natural_frequency(signals["theta"], signals["alpha"], dt)[1]


def require_reliable(doubts: Iterable[Doubt]) -> None:
    """Check that a recording with these doubts is to be measured on.

    Raises
    ------
    IdentificationError
        If more than 1 % of its samples came late, never or unevenly.
    """
    if refusing := [str(doubt) for doubt in doubts if doubt.refuses]:
        raise IdentificationError(" ".join(refusing))


def warn(doubts: Iterable[Doubt]) -> None:
    """Warn of each doubt, as :class:`rotflex.errors.DoubtfulRecording`."""
    for doubt in doubts:
        warnings.warn(str(doubt), DoubtfulRecording, stacklevel=3)
