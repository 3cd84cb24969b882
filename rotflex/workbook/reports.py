"""A report as far as it is recorded, as Markdown for a notebook to show: its outline, and its text in one piece."""

from __future__ import annotations

from rotflex.errors import AnswerError
from rotflex.workbook.answers import AnswerBook
from rotflex.workbook.parts import ReportItem
from rotflex.workbook.questions import REPORT_ITEMS, REPORTS, find


def outline(report: str, book: AnswerBook) -> str:
    """The rows of a report: what each says, on which questions it rests, and what of that is still missing.

    Parameters
    ----------
    report : its number, as in "Modeling report"
    book : the student's answers

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    rows = ["| | item | what it says | rests on | so far |", "|---|---|---|---|---|"]
    for item in _items(report):
        rests_on = ", ".join(dict.fromkeys(number for number, _ in item.shows))
        rows.append(f"| {item.number} | {item.heading} | {item.prompt} | {rests_on} | {_state(item, book)} |")
    return "\n".join(rows)


def assembled(report: str, book: AnswerBook) -> str:
    """The recorded texts of a report, in order, under their headings.

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    pieces = []
    for item in _items(report):
        if item.part:
            content = book.get(report, item.part)
            text = content["value"] if content else "*not written yet*"
            pieces.append(f"**{item.number} {item.heading}**\n\n{text}")
    return "\n\n".join(pieces)


def _items(report: str) -> list[ReportItem]:
    if report not in REPORTS:
        raise AnswerError(f"There is no report {report!r}; there are {', '.join(REPORTS)}.")
    return [item for item in REPORT_ITEMS if item.report == report]


def _state(item: ReportItem, book: AnswerBook) -> str:
    """Whether all that a row shows, discusses and says is recorded; nothing for a row on the report as a whole."""
    wanted = [*item.shows, *([(item.report, item.part)] if item.part else [])]
    parts = [(number, part) for number, name in wanted for part in ([name] if name else find(number).names)]
    missing = [f"{number} {part}" for number, part in parts if book.get(number, part) is None]
    if missing:
        return f"missing: {', '.join(missing)}"
    return "recorded" if parts else ""
