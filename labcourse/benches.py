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
FIRST_DRAW = 1  #: the version of the draws unless another is named
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
    draw : version of the way in which benches are drawn from seeds
    benches : names of the laboratory's benches, if it is one of these
    """

    which: str = OWN
    seed: int = 0
    preset: str = ""
    draw: int = FIRST_DRAW
    benches: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "benches", tuple(self.benches))  # plain data has lists

    def seed_for(self, student: str, own: Callable[[str], int] = seed_of) -> int:
        """Return the seed of a student's bench. (A preset is not drawn; its seed is used for other random numbers.)

        Parameters
        ----------
        student : the ID
        own : the ID → the seed of the student's own bench, if the course derives it differently
        """
        return self.seed if self.which == SAME else own(student)

    def plain(self) -> dict[str, Any]:
        """Return the entry "bench" of ``course.json``."""
        more: dict[str, dict[str, Any]] = {
            SAME: {"seed": self.seed},
            PRESET: {"preset": self.preset},
            REAL: {"benches": list(self.benches)},
        }
        return {"which": self.which, **more.get(self.which, {})}


THEIR_OWN = BenchPolicy()  #: the default


def policy_of(course: Mapping[str, Any]) -> BenchPolicy:
    """Read the policy in a ``course.json``; by default, each student has a bench of their own.

    Raises
    ------
    ConfigurationError
        If it is not valid.
    """
    bench, draw = course.get("bench", {}), course.get("draw", FIRST_DRAW)
    if not isinstance(bench, Mapping) or bench.get("which", OWN) not in WHICH:
        raise ConfigurationError(
            f'"bench" should be as {{"which": "own"}}, with "own", "same", "preset" or "real"; it is {bench!r:.80}.'
        )
    names = bench.get("benches", [])
    if not is_names(names):
        raise ConfigurationError(f'the "benches" should be names, not {names!r:.80}.')
    policy = BenchPolicy(bench.get("which", OWN), bench.get("seed", 0), bench.get("preset", ""), draw, tuple(names))
    if not is_seed(policy.seed):
        raise ConfigurationError(f'the bench\'s "seed" should be from 0 to {MOST_SEED}, not {policy.seed!r:.80}.')
    if not isinstance(policy.preset, str):
        raise ConfigurationError(f'the bench\'s "preset" should be a name, not {policy.preset!r:.80}.')
    if not isinstance(draw, int) or isinstance(draw, bool):
        raise ConfigurationError(f'"draw" should be a whole number, not {draw!r:.80}.')
    return policy


def is_names(value: object) -> bool:
    """Check whether a value is a list of names of benches, which may be empty."""
    return isinstance(value, list | tuple) and all(
        isinstance(name, str) and name.strip() == name != "" for name in value
    )


def is_seed(value: object) -> bool:
    """Check whether a value is a seed, from which a bench can be drawn."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_SEED
