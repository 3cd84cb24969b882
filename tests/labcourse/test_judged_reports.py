"""What is judged of a report as a whole: it gets marks, and nobody can or has to answer it."""

import pytest

from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import WHOLE, Question, ReportItem, number
from labcourse.errors import AnswerError
from labcourse.session import Session
from rotflex.course.questions import CATALOGUE as OURS

ITEMS = [
    ReportItem("First report", "I", "Aim", "The aim.", ("B",), part="aim"),
    ReportItem("First report", "II", "End", "The end.", ("B",), part="end"),
    ReportItem("First report", "F.1", "Order", "Whether it has any.", ("G-1",), judged="order"),
    ReportItem("First report", "F.2", "Looks", "Whether it is neat.", ("G-2",), judged="looks"),
    ReportItem("Second report", "I", "Aim", "The aim.", ("B",), part="aim"),
]
CATALOGUE = Catalogue(
    [Question("1.1", "1", "01", "Stiffness", (), (number("k", "N/m", None, "", "?"),))],
    report_items=ITEMS,
    reports={"First report": ("2", "02", "On the spring"), "Second report": ("3", "03", "On the rest")},
)
AS_A_WHOLE = "First report, as a whole"


@pytest.fixture
def lab(tmp_path):
    return Session("ada", tmp_path, CATALOGUE, {}, 1)


def test_a_report_is_judged_where_a_row_says_so():
    assert list(CATALOGUE.judged) == [AS_A_WHOLE]
    assert CATALOGUE.report_judged == {AS_A_WHOLE: "First report"}
    one = CATALOGUE.judged[AS_A_WHOLE]
    assert (one.section, one.notebook, one.title, one.outcomes) == ("2", "02", "On the spring", ("G-1", "G-2"))
    assert [(part.name, part.kind, part.marked, part.points, part.outcome) for part in one.parts] == [
        ("order", WHOLE, "person", 1, "G-1"),
        ("looks", WHOLE, "person", 1, "G-2"),
    ]
    assert one.parts[1].prompt == "Looks. Whether it is neat."


def test_it_is_marked_and_not_asked():
    assert AS_A_WHOLE not in CATALOGUE.everything
    assert list(CATALOGUE.marked) == ["1.1", "First report", "Second report", AS_A_WHOLE]
    assert CATALOGUE.find_marked(AS_A_WHOLE) is CATALOGUE.judged[AS_A_WHOLE]
    assert CATALOGUE.find_marked("1.1") is CATALOGUE.find("1.1")
    with pytest.raises(AnswerError, match=r"1\.2"):
        CATALOGUE.find_marked("1.2")
    with pytest.raises(AnswerError, match="as text"):
        CATALOGUE.find_marked(1.1)


def test_whoever_answers_it_is_told_what_to_write_instead(lab):
    for attempt in (lambda: lab.answer(AS_A_WHOLE, order="Good."), lambda: lab.value(AS_A_WHOLE, "order")):
        with pytest.raises(AnswerError, match="'First report'"):
            attempt()
    assert not lab.book.path.exists()


def test_it_is_missing_in_no_list_of_what_there_is_to_do(lab, capsys):
    lab.progress()
    lab.summary()
    text = capsys.readouterr().out
    assert "as a whole" not in text and "order" not in text
    assert "First report      On the spring: missing: aim, end" in text


def test_the_texts_of_a_report_in_one_piece_say_what_is_not_written():
    aim, missing, end, text = report_files.in_one_piece(ITEMS[:4], {"end": "It ended."}).split("\n\n")
    assert (aim, missing.startswith("*"), end, text) == ("**I Aim**", True, "**II End**", "It ended.")


def test_both_reports_of_this_course_are_judged_for_a_point_in_each_of_two_outcomes():
    assert {number: [(part.outcome, part.points) for part in one.parts] for number, one in OURS.judged.items()} == {
        f"{report}, as a whole": [("GS-1", 1), ("GS-2", 1)] for report in ("Modeling report", "Control report")
    }
    asked = OURS.without(OURS.optional)  # as a class is asked by default
    parts = [part for question in asked.marked.values() for part in question.parts]
    assert sum(part.points for part in parts) == 128.5
    assert sum(part.points for part in parts if part.marked == "person") == 46
