"""A report as far as it is recorded, as Markdown for a notebook to show: its outline, and its text in one piece."""

from __future__ import annotations

from rotflex.courseware.answers import AnswerBook
from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.messages import _
from rotflex.courseware.parts import ReportItem
from rotflex.errors import AnswerError


def outline(catalogue: Catalogue, report: str, book: AnswerBook) -> str:
    """The rows of a report: what each says, on which questions it rests, and what of that is still missing.

    Parameters
    ----------
    catalogue : the course's
    report : its number, as in "First report"
    book : the student's answers

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    rows = ["| | item | what it says | rests on | so far |", "|---|---|---|---|---|"]
    for item in _items(catalogue, report):
        rests_on = ", ".join(dict.fromkeys(number for number, _part in item.shows))
        rows.append(
            f"| {item.number} | {item.heading} | {item.prompt} | {rests_on} | {_state(catalogue, item, book)} |"
        )
    return "\n".join(rows)


def assembled(catalogue: Catalogue, report: str, book: AnswerBook) -> str:
    """The recorded texts of a report, in order, under their headings.

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    pieces = []
    for item in _items(catalogue, report):
        if item.part:
            content = book.get(report, item.part)
            text = content["value"] if content else "*not written yet*"
            pieces.append(f"**{item.number} {item.heading}**\n\n{text}")
    return "\n\n".join(pieces)


def _items(catalogue: Catalogue, report: str) -> list[ReportItem]:
    if report not in catalogue.reports:
        raise AnswerError(
            _("There is no report {report!r}; there are {there}.").format(
                report=report, there=", ".join(catalogue.reports)
            )
        )
    return catalogue.items(report)


def _state(catalogue: Catalogue, item: ReportItem, book: AnswerBook) -> str:
    """Whether all that a row shows, discusses and says is recorded; nothing for a row on the report as a whole."""
    wanted = [*item.shows, *([(item.report, item.part)] if item.part else [])]
    parts = [(number, part) for number, name in wanted for part in ([name] if name else catalogue.find(number).names)]
    missing = [f"{number} {part}" for number, part in parts if book.get(number, part) is None]
    if missing:
        return _("missing: {missing}").format(missing=", ".join(missing))
    return _("recorded") if parts else ""
