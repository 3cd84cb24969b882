"""A fault in the format of a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.courseware.report.document import Place


@dataclass(frozen=True)
class Fault:
    """Something that a reader of a report would mind, and what to do about it. No value is given away by it.

    Attributes
    ----------
    kind : a word for the sort of fault, as in "caption"; the same for all of a sort
    what : what is wrong, and where
    why : why a reader minds
    advice : what to do
    place : the cell in which to do it
    """

    kind: str
    what: str
    why: str
    advice: str
    place: Place

    def __str__(self) -> str:
        return f"{self.what} {self.why} {self.advice}"


def listed(faults: Iterable[Fault]) -> str:
    """Faults as a list in Markdown, each with a link to its cell."""
    return "\n".join(
        f"* **{fault.what}** {fault.why} {fault.advice} " + _("[Open the cell]({link})").format(link=fault.place.link)
        for fault in faults
    )
