"""A report as far as it is recorded, as Markdown: its outline for a notebook, and its text in one piece."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import ReportItem
from labcourse.errors import AnswerError

if TYPE_CHECKING:
    from labcourse.session import Session

#: Fixed: a person's mark of a report as a whole holds for as long as what they read stays the same.
NOT_WRITTEN = "*not written yet*"


def outline(catalogue: Catalogue, report: str, lab: Session) -> str:
    """The rows of a report: what each says, on which questions it rests, and what of that is still missing.

    Parameters
    ----------
    catalogue : the course's
    report : its number, as in "First report"
    lab : the student's session, with their answers

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    lab.refresh()
    rows = ["| | item | what it says | rests on | so far |", "|---|---|---|---|---|"]
    for item in _items(catalogue, report):
        rests_on = ", ".join(dict.fromkeys(number for number, _part in item.shows))
        rows.append(f"| {item.number} | {item.heading} | {item.prompt} | {rests_on} | {_state(catalogue, item, lab)} |")
    return "\n".join(rows)


def in_one_piece(items: Iterable[ReportItem], texts: Mapping[str, str]) -> str:
    """Texts of a report, in order, under their headings.

    Parameters
    ----------
    items : the rows of the report
    texts : name of a part → what is written there
    """
    return "\n\n".join(
        f"**{item.number} {item.heading}**\n\n{texts.get(item.part, NOT_WRITTEN)}" for item in items if item.part
    )


def _items(catalogue: Catalogue, report: str) -> list[ReportItem]:
    if report not in catalogue.reports:
        raise AnswerError(f"There is no report {report!r}; there are {', '.join(catalogue.reports)}.")
    return catalogue.items(report)


def _state(catalogue: Catalogue, item: ReportItem, lab: Session) -> str:
    """Whether all that a row shows, discusses and says is recorded; nothing for a row on the report as a whole."""
    wanted = [*item.shows, *([(item.report, item.part)] if item.part else [])]
    parts = [(number, part) for number, name in wanted for part in ([name] if name else catalogue.find(number).names)]
    missing = [f"{number} {part}" for number, part in parts if lab.content(number, part) is None]
    own = lab.report_files.own(item.report)
    if own is not None and item.part and lab.content(item.report, item.part) is None:
        missing.remove(f"{item.report} {item.part}")
        if not missing:
            return f"in your own document, {own.name}"
    if missing:
        return f"missing: {', '.join(missing)}"
    return "recorded" if parts else ""
