"""The outline of a report and its text, from what is recorded."""

import pytest

from labcourse.errors import AnswerError
from labcourse.session import Session
from rotflex.course import reports
from rotflex.course.questions import CATALOGUE


@pytest.fixture
def lab(tmp_path):
    return Session("ada", tmp_path, CATALOGUE, {}, 1)


def rows(markdown):
    found = [[cell.strip() for cell in line.strip("|").split("|")] for line in markdown.splitlines()[2:]]
    return {cells[0]: cells for cells in found}


@pytest.mark.parametrize("report", CATALOGUE.reports)
def test_outline_has_every_row_of_the_scoring_sheet_with_as_many_cells_as_headings(report, lab):
    markdown = reports.outline(report, lab)
    headings = markdown.splitlines()[0].count("|")
    assert {line.count("|") for line in markdown.splitlines()} == {headings}
    assert list(rows(markdown)) == [item.number for item in CATALOGUE.report_items if item.report == report]


def test_outline_names_what_a_row_still_lacks_and_says_when_it_is_complete(lab):
    row = rows(reports.outline("Control report", lab))["III.7"]
    assert row[3] == "3.17" and "3.17 explanation" in row[4] and "comparison_analysis" in row[4]
    lab.answer("3.17", explanation="Nobody damps the link.")
    row = rows(reports.outline("Control report", lab))["III.7"]
    assert "3.17 explanation" not in row[4] and "comparison_analysis" in row[4]
    lab.answer("Control report", comparison_analysis="As said in question 3.17.")
    assert rows(reports.outline("Control report", lab))["III.7"][4] == "recorded"


def test_unknown_report_is_refused_with_the_names_of_those_that_there_are(lab):
    for function in (reports.outline, reports.button):
        with pytest.raises(AnswerError, match="Control report"):
            function("Table 3", lab)
