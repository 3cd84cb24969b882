"""Which bench each student has: a virtual one (their own, the same for all, or a named one), or the laboratory's."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, Strict, TypeAdapter, ValidationError

from labcourse.errors import ConfigurationError
from labcourse.student_id import caseless

Which = Literal["own", "same", "preset", "real"]
OWN: Which = "own"
SAME: Which = "same"
PRESET: Which = "preset"
REAL: Which = "real"
FIRST_DRAW = 1  #: the version of the draws of whoever names none
MOST_SEED = 2**32 - 1  #: seeds are drawn from 32 bits


def seed_of(student: str) -> int:
    """Return the seed (32 bits) of a student's own bench; the same on every machine, however the ID is typed."""
    return int.from_bytes(hashlib.sha256(caseless(student).encode()).digest()[:4], "big")


_Name = Annotated[str, Strict(), Field(pattern=r"^\S(.*\S)?$")]  # without blanks around it
_WHICH = Field(description='"own", "same", "preset" or "real"', examples=['"own"'])
_SEED = Field(ge=0, le=MOST_SEED, description=f"a whole number from 0 to {MOST_SEED}", examples=["2026"])
_PRESET = Field(description="the name of a bench", examples=['"workshop"'])
_BENCHES = Field(min_length=1, description="names of the laboratory's benches", examples=['["north"]'])


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

    which: Annotated[Which, _WHICH] = OWN
    seed: Annotated[int, Strict(), _SEED] = 0
    preset: Annotated[_Name, _PRESET] = ""
    draw: Annotated[int, Strict()] = FIRST_DRAW
    benches: Annotated[tuple[_Name, ...], _BENCHES] = ()

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


_READER = TypeAdapter(BenchPolicy)


def policy_of(course: Mapping[str, Any]) -> BenchPolicy:
    """Read the policy from the content of a ``course.json``; without one, benches are the students' own.

    Raises
    ------
    ConfigurationError
        If it cannot be understood.
    """
    bench = course.get("bench", {})
    if not isinstance(bench, Mapping):
        raise ConfigurationError(f'"bench" should be as {{"which": "own"}}; it is {bench!r:.80}.')
    try:
        return _READER.validate_python({**bench, "draw": course.get("draw", FIRST_DRAW)})
    except ValidationError as error:
        fault = error.errors()[0]
        raise ConfigurationError(
            f'the bench\'s "{fault["loc"][0]}" is {fault["input"]!r:.80}: {fault["msg"]}.'
        ) from None
