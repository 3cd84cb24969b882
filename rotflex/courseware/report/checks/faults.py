"""A fault in the format of a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.courseware.report.document import Document, Figure, Place, Table


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
    about : what is missing, as it is written, as in "Figure 9" and "[3]"; "" where nothing is
    """

    kind: str
    what: str
    why: str
    advice: str
    place: Place
    about: str = ""

    def __str__(self) -> str:
        return f"{self.what} {self.why} {self.advice}"


def called(one: Figure | Table, document: Document) -> str:
    """What a figure or table is called by: its label; of a picture in a text, where that is."""
    if isinstance(one, Figure) and any(one.label in text.pictures for text in document.texts):
        where = next((section.number for section in document.sections if one in section.blocks), "")
        return _("the picture in section {number}").format(number=where)
    return one.label


def named(one: Figure | Table, document: Document) -> str:
    """What a figure or table is told by: its number in the report, and what it is called by where that is another."""
    text = _("Figure {number}") if isinstance(one, Figure) else _("Table {number}")
    name = text.format(number=one.number)
    label = called(one, document)
    return name if label in ("", name) else f"{name} ({label})"


def listed(faults: Iterable[Fault]) -> str:
    """Faults as a list in Markdown, each with a link to its cell."""
    return "\n".join(
        f"* **{fault.what}** {fault.why} {fault.advice} " + _("[Open the cell]({link})").format(link=fault.place.link)
        for fault in faults
    )
