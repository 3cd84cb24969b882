"""Hardware-timed sampling on the virtual board: what was sampled while nobody fetched stays as it was then."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from rotflex.errors import HILError
from rotflex.hil.board import Counts, Levels, Vector
from rotflex.hil.clock import Sampling

Values = tuple[Sequence[float], Sequence[float], Sequence[float]]  #: analog, encoders, digital; counts are numbers, too


@dataclass
class Task:
    """Sampling of some channels.

    Samples are known by how many then remained to be fetched, which no two share.
    """

    analog: Sequence[int]
    encoders: Sequence[int]
    digital: Sequence[int]
    sampling: Sampling
    _kept: dict[int, Values] = field(default_factory=dict)
    _next: int = 0

    def start(self, now: float, frequency: float, samples: int) -> None:
        """Take the first sample now."""
        self.sampling.start(now, frequency, samples)
        self._kept.clear()
        self._next = samples

    def due_until(self, instant: float) -> Iterator[tuple[float, int]]:
        """When samples that were not seen yet are due until an instant, and which."""
        sampling = self.sampling
        if not sampling.started or sampling.time_waits:
            return
        self._next = min(self._next, sampling.remaining)
        while self._next > 0:
            due = sampling.due + (sampling.remaining - self._next) * sampling.period
            if due >= instant:
                return
            yield due, self._next
            self._next -= 1

    def keep(self, sample: int, values: Values) -> None:
        """Put a sample aside until it is fetched."""
        self._kept[sample] = values
        while len(self._kept) > self.sampling.capacity:
            # Those that are lost are never asked for: see Sampling.
            last = min(self._kept) if self.sampling.keeps_oldest else max(self._kept)
            del self._kept[last]

    def kept(self) -> Values | None:
        """The sample that is fetched next, if it was put aside."""
        return self._kept.pop(self.sampling.remaining, None)


def put(values: Values, buffers: tuple[Vector | None, Counts | None, Levels | None], at: int) -> None:
    """Put one sample of each channel into the buffers, as sample number ``at``."""
    for found, buffer in zip(values, buffers, strict=True):
        if found and buffer is not None:
            for place, value in enumerate(found, at * len(found)):
                buffer[place] = value


def refuse_other(count: int) -> None:
    """Raise HILError where channels of another kind are asked for."""
    if count:
        raise HILError("The virtual board has no other channels.")
