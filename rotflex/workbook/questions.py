"""The catalogue: the workbook's 35 questions, its results tables, and the items of its reports. Public.

Numbers, sections and outcome codes are the workbook's; titles and prompts are ours. Question 3.8 carries no code there,
and so none here.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from rotflex.errors import AnswerError
from rotflex.workbook.catalogue_control import CONTROL, TABLE_3
from rotflex.workbook.catalogue_modeling import MODELING, TABLE_2, WARM_UP_QUESTION
from rotflex.workbook.catalogue_reports import CONTROL_ITEMS, CONTROL_REPORT, MODELING_ITEMS, MODELING_REPORT
from rotflex.workbook.parts import Part, Question, ReportItem, prose

__all__ = [
    "EVERYTHING",
    "NOTEBOOKS",
    "OUTCOMES",
    "QUESTIONS",
    "REPORTS",
    "REPORT_ITEMS",
    "TABLES",
    "WARM_UP",
    "Part",
    "Question",
    "ReportItem",
    "find",
    "find_part",
]

#: What the outcome codes stand for.
OUTCOMES = {
    "A-1": "has a strategy to solve the problem",
    "A-2": "performs the calculations",
    "A-3": "explains the results",
    "B-5": "follows the procedure",
    "B-6": "documents the data",
    "B-7": "uses appropriate analysis",
    "B-8": "accounts for uncertainty",
    "B-9": "interprets the results against the hypothesis",
    "K-1": "uses software for analysis",
    "K-2": "uses software to present data",
    "K-3": "uses software to simulate",
    "GS-1": "content and organisation of the report",
    "GS-2": "professional appearance",
}

WARM_UP = {WARM_UP_QUESTION.number: WARM_UP_QUESTION}  #: outside the 35; no points
QUESTIONS = {question.number: question for question in (*MODELING, *CONTROL)}
TABLES = {table.number: table for table in (TABLE_2, TABLE_3)}

_FORMAT_ROWS = (
    ("Format.1", "Content and organisation", "The report as a whole.", "GS-1"),
    ("Format.2", "Professional appearance", "The report as a whole; Section 5.3 has what to look for.", "GS-2"),
)


def _with_format(items: tuple[ReportItem, ...]) -> tuple[ReportItem, ...]:
    report = items[0].report
    return items + tuple(
        ReportItem(report, row, heading, prompt, (code,)) for row, heading, prompt, code in _FORMAT_ROWS
    )


#: The rows of the two reports' scoring sheets, in order.
REPORT_ITEMS = _with_format(MODELING_ITEMS) + _with_format(CONTROL_ITEMS)


def _report(number: str, section: str, notebook: str, title: str) -> Question:
    """The report's text: a prose part for each item that is written rather than shown."""
    items = [item for item in REPORT_ITEMS if item.report == number]
    written = [prose(item.part, item.outcomes[0], f"{item.heading}. {item.prompt}") for item in items if item.part]
    outcomes = dict.fromkeys(part.outcome for part in written)
    return Question(number, section, notebook, title, tuple(outcomes), tuple(written))


#: The text that the reports ask for, answered like a question.
REPORTS = {
    report.number: report
    for report in (
        _report(MODELING_REPORT, "5.1", TABLE_2.notebook, "Report on the modeling laboratory"),
        _report(CONTROL_REPORT, "5.2", TABLE_3.notebook, "Report on the control laboratory"),
    )
}

#: All that ``lab.answer`` takes.
EVERYTHING = WARM_UP | QUESTIONS | TABLES | REPORTS
#: The notebooks with something to answer, in order.
NOTEBOOKS = tuple(sorted({question.notebook for question in EVERYTHING.values()}))


def find(number: Any) -> Question:
    """The question, table or report of a number such as ``"2.11"``, ``"Table 2"`` or ``"Modeling report"``.

    Raises
    ------
    AnswerError
        If there is none; the message names those that there are.
    """
    if not isinstance(number, str):
        raise AnswerError(
            f'Give the number of the question as text, as in "2.10" (2.1 is another one); it is {number!r}.'
        )
    if number not in EVERYTHING:
        near = get_close_matches(number, EVERYTHING, n=1)
        meant = f" Did you mean {near[0]!r}?" if near else ""
        others = ", ".join(repr(name) for name in (*TABLES, *REPORTS))
        raise AnswerError(
            f"There is no question {number!r}.{meant} There are 0.1, 2.1 to 2.18, 3.1 to 3.17, and {others}."
        )
    return EVERYTHING[number]


def find_part(question: Question, name: str) -> Part:
    """The part of a question of this name.

    Raises
    ------
    AnswerError
        If there is none; the message names those that there are.
    """
    for part in question.parts:
        if part.name == name:
            return part
    raise AnswerError(f"Question {question.number} has no part {name!r}; it has {', '.join(question.names)}.")
