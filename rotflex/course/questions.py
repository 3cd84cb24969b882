"""The catalogue of this course: the workbook's questions, its results tables, and the items of its reports. Public.

Numbers, sections and outcome codes are the workbook's; titles and prompts are ours. Question 3.8 carries no code there,
and so none here.
"""

from __future__ import annotations

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import ReportItem
from rotflex.course.catalogue_control import CONTROL, TABLE_3
from rotflex.course.catalogue_modeling import MODELING, TABLE_2, WARM_UP_QUESTION
from rotflex.course.catalogue_reports import CONTROL_ITEMS, CONTROL_REPORT, MODELING_ITEMS, MODELING_REPORT
from rotflex.course.predictions import PREDICTIONS
from rotflex.course.starts import STARTS

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

_FORMAT_ROWS = (
    (
        "Format.1",
        "Content and organisation",
        "The report as a whole: each part does its own work, and all of it agrees.",
        "GS-1",
        "organisation",
    ),
    (
        "Format.2",
        "Professional appearance",
        "The report as a whole: the lists at the end of `04_modeling_results` have what to look for.",
        "GS-2",
        "appearance",
    ),
)


def _with_format(items: tuple[ReportItem, ...]) -> tuple[ReportItem, ...]:
    report = items[0].report
    return items + tuple(
        ReportItem(report, row, heading, prompt, (code,), judged=part)
        for row, heading, prompt, code, part in _FORMAT_ROWS
    )


CATALOGUE = Catalogue(
    (*MODELING, *CONTROL),
    warm_up=(WARM_UP_QUESTION,),
    tables=(TABLE_2, TABLE_3),
    report_items=_with_format(MODELING_ITEMS) + _with_format(CONTROL_ITEMS),
    reports={
        MODELING_REPORT: ("5.1", TABLE_2.notebook, "Report on the modeling laboratory"),
        CONTROL_REPORT: ("5.2", TABLE_3.notebook, "Report on the control laboratory"),
    },
    outcomes=OUTCOMES,
    predictions=PREDICTIONS,
    starts=STARTS,
)
