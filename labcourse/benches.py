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
FIRST_DRAW = 1  #: the version of the draws of whoever names none
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
        the one of the laboratory's at which they made their recordings
    seed : of everybody's bench, where it is the same
    preset : name of everybody's bench, where it is a preset
    draw : version of how benches are drawn from seeds
    benches : names of the laboratory's, where it is one of these
    """

    which: str = OWN
    seed: int = 0
    preset: str = ""
    draw: int = FIRST_DRAW
    benches: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "benches", tuple(self.benches))  # plain data has lists

    def seed_for(self, student: str, own: Callable[[str], int] = seed_of) -> int:
        """The seed of a student's bench. (Of a preset nothing is drawn; it is then good for other draws.)

        Parameters
        ----------
        student : the ID
        own : the ID → the seed of the student's own bench, for a course that draws it in its own way
        """
        return self.seed if self.which == SAME else own(student)

    def plain(self) -> dict[str, Any]:
        """What stands under "bench" in ``course.json``."""
        more: dict[str, dict[str, Any]] = {
            SAME: {"seed": self.seed},
            PRESET: {"preset": self.preset},
            REAL: {"benches": list(self.benches)},
        }
        return {"which": self.which, **more.get(self.which, {})}


THEIR_OWN = BenchPolicy()  #: where nothing is said


def policy_of(course: Mapping[str, Any]) -> BenchPolicy:
    """The policy that a ``course.json`` says; benches are the students' own where it says nothing.

    Raises
    ------
    ConfigurationError
        If it cannot be understood.
    """
    said, draw = course.get("bench", {}), course.get("draw", FIRST_DRAW)
    if not isinstance(said, Mapping) or said.get("which", OWN) not in WHICH:
        raise ConfigurationError(
            f'"bench" should be as {{"which": "own"}}, with "own", "same", "preset" or "real"; it is {said!r:.80}.'
        )
    named = said.get("benches", [])
    if not is_names(named):
        raise ConfigurationError(f'the "benches" should be names, not {named!r:.80}.')
    policy = BenchPolicy(said.get("which", OWN), said.get("seed", 0), said.get("preset", ""), draw, tuple(named))
    if not is_seed(policy.seed):
        raise ConfigurationError(f'the bench\'s "seed" is {policy.seed!r:.80}, which is none.')
    if not isinstance(policy.preset, str):
        raise ConfigurationError(f'the bench\'s "preset" should be a name, not {policy.preset!r:.80}.')
    if not isinstance(draw, int) or isinstance(draw, bool):
        raise ConfigurationError(f'"draw" should be a whole number, not {draw!r:.80}.')
    return policy


def is_names(value: object) -> bool:
    """Whether it is a list of names of benches, which may be empty."""
    return isinstance(value, list | tuple) and all(isinstance(one, str) and one.strip() == one != "" for one in value)


def is_seed(value: object) -> bool:
    """Whether everybody's bench can be drawn from it."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_SEED
