"""What intake cannot know for certain, and what an instructor decided about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

OWNER, TIME = "owner", "time received"  #: what may be decided, besides a file: then it is the file's name

#: :attr:`Doubt.key` → what was decided.
Decisions = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Doubt:
    """Something that an instructor may decide.

    Attributes
    ----------
    submission : name of the folder, archive or file, from the folder of the class on
    about : :data:`OWNER`, :data:`TIME`, or the name of the course's file that several files may be
    assumed : what counts without a decision; "" for nothing
    why : the reason
    alternatives : what else it may be
    """

    submission: str
    about: str
    assumed: str
    why: str
    alternatives: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """What a decision is known by. One on a time holds for files as they were saved then, if the row says when."""
        saved = f": {self.alternatives}" if self.about == TIME and self.alternatives else ""
        return self.submission, f"{self.about}{saved}"
