"""A recording: signals sampled together. Experiments of a course's own plant may return it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Channel:
    """One signal: ``values`` (n,) in a ``unit``."""

    values: NDArray[np.float64]
    unit: str


@dataclass(frozen=True)
class Recording:
    """Signals sampled together at a fixed rate.

    Attributes
    ----------
    channels : by name
    sample_time : s
    metadata : JSON data: the experiment and its settings
    """

    channels: Mapping[str, Channel]
    sample_time: float
    metadata: Mapping[str, Any]

    @property
    def time(self) -> NDArray[np.float64]:
        """Return the times (n,) of the samples in s, from 0 on."""
        return np.arange(len(self)) * np.float64(self.sample_time)

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """Return the values (n,) of a channel."""
        return self.channels[channel].values

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())).values)
