"""Which bench each student has: a virtual one (their own, the same for all, or a named one), or the laboratory's."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.errors import ConfigurationError
from labcourse.student_id import caseless

OWN, SAME, PRESET, REAL = "own", "same", "preset", "real"
WHICH = (OWN, SAME, PRESET, REAL)
_ENTRIES = ("which", "seed", "preset", "benches")  # of the entry "bench"
MOST_SEED = 2**32 - 1  #: seeds are drawn from 32 bits


def seed_of(student: str) -> int:
    """Return the seed (32 bits) of a student's own bench; the same on every machine, however the ID is typed."""
    return int.from_bytes(hashlib.sha256(caseless(student).encode()).digest()[:4], "big")


@dataclass(frozen=True)
class BenchPolicy:
    """Which bench each student has.

    Attributes
    ----------
    which : "own", drawn from the student's ID; "same", drawn from ``seed``; "preset", the one named ``preset``; "real",
        the laboratory's bench at which they made their recordings
    seed : of everybody's bench, where it is the same
    preset : name of everybody's bench, where it is a preset
    draw : version of the way in which benches are drawn from seeds; as the course draws them now unless given
    benches : names of the laboratory's benches, if it is one of these

    Raises
    ------
    ConfigurationError
        If an entry is not valid.
    """

    which: str = OWN
    seed: int = 0
    preset: str = ""
    draw: int | None = None
    benches: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        seed_is_valid = type(self.seed) is int and 0 <= self.seed <= MOST_SEED
        names = self.benches if isinstance(self.benches, list | tuple) else [None]
        names_are_valid = all(isinstance(name, str) and name.strip() == name != "" for name in names)
        if not (self.which in WHICH and seed_is_valid and isinstance(self.preset, str) and names_are_valid):
            raise ConfigurationError(
                '"bench" should be {"which": "own"}, {"which": "same", "seed": 1}, {"which": "preset", "preset": '
                f'"NAME"}} or {{"which": "real", "benches": ["NAME"]}}, with a seed from 0 to {MOST_SEED}; it has '
                f"{vars(self)!r:.120}."
            )
        if not (self.draw is None or type(self.draw) is int):
            raise ConfigurationError(f'"draw" should be a whole number, not {self.draw!r:.80}.')
        object.__setattr__(self, "benches", tuple(names))  # JSON has lists

    def seed_for(self, student: str, own: Callable[[str], int] = seed_of) -> int:
        """Return the seed of a student's bench. (A preset is not drawn; its seed is used for other random numbers.)

        Parameters
        ----------
        student : the ID
        own : the ID → the seed of the student's own bench, if the course derives it differently
        """
        return self.seed if self.which == SAME else own(student)

    def as_json(self) -> dict[str, Any]:
        """Return the entry "bench" of ``course.json``."""
        names = {SAME: ["seed"], PRESET: ["preset"], REAL: ["benches"]}.get(self.which, [])
        return {"which": self.which, **{name: getattr(self, name) for name in names}}


THEIR_OWN = BenchPolicy()  #: the default


def policy_of(course: Mapping[str, Any]) -> BenchPolicy:
    """Read the policy in a ``course.json``; by default, each student has a bench of their own.

    Raises
    ------
    ConfigurationError
        If it is not valid.
    """
    bench = course.get("bench", {})
    entries = bench if isinstance(bench, Mapping) else {"which": [bench]}  # refused as no policy
    known: dict[str, Any] = {name: entries[name] for name in _ENTRIES if name in entries}  # there may be later ones
    return BenchPolicy(**known, draw=course.get("draw"))
