"""The plant: a mass on a spring without friction, pulled aside and let go. Each student has a spring of their own."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from labcourse.student_id import caseless

MASS = 0.5  # kg
PULLED = 0.04  # m, from where it is let go
SAMPLE_TIME = 0.01  # s
RULER = 4  # decimals of a metre that the ruler tells


@dataclass(frozen=True)
class Channel:
    """A signal: values (n,) in a unit."""

    values: np.ndarray
    unit: str


@dataclass(frozen=True)
class Run:
    """Signals sampled together."""

    channels: dict[str, Channel]
    metadata: dict[str, Any]
    sample_time: float = SAMPLE_TIME

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())).values)


class Spring:
    """A mass on a spring of ``k`` in N/m, drawn from a seed."""

    def __init__(self, seed: int) -> None:
        self.k = float(np.random.default_rng(seed).uniform(20.0, 80.0))
        self.omega = float(np.sqrt(self.k / MASS))  # rad/s

    def release(self) -> Run:
        """Let the mass go, and read the ruler."""
        time = SAMPLE_TIME * np.arange(500)
        x = np.round(PULLED * np.cos(self.omega * time), RULER)
        return Run({"x": Channel(x, "m")}, {"experiment": "release"})


def seed_of(student: str) -> int:
    """The seed of a student's spring: the same, however the ID is typed."""
    return int.from_bytes(hashlib.sha256(caseless(student).encode()).digest()[:4], "big")
