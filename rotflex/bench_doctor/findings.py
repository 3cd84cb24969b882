"""What an examination of a bench has to say."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


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
