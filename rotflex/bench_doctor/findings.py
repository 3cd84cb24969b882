"""What an examination of a bench has to say."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from rotflex.errors import RotflexError


class Level(StrEnum):
    """How good it is."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes
    ----------
    what : was looked at
    level : whether it is as it should be
    said : what was found
    to_do : what to do about it; empty if there is nothing
    """

    what: str
    level: Level
    said: str
    to_do: str = ""


def step(what: str, look: Callable[[], Iterator[Finding]], to_do: str) -> Iterator[Finding]:
    """What a look gives; an error on the way is a finding, too.

    Parameters
    ----------
    what : is looked at
    look : looks
    to_do : where it raises an error
    """
    try:
        yield from look()
    except RotflexError as error:
        yield Finding(what, Level.FAIL, str(error), to_do)
