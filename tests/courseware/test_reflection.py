"""What own answers ask each other: what is said, what is missing, and when nothing is asked at all."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.course_file import REFLECT
from rotflex.courseware.parts import Question, number
from rotflex.courseware.reflection import Check, Reflection, of_notebooks, reflect, silence
from rotflex.errors import AnswerError, ConfigurationError

NOON = datetime(2026, 11, 2, 12, tzinfo=UTC)


def smaller(one, other):
    return "" if one < other else f"Is {one:g} smaller than {other:g}?"


A, B, C = ("1.1", "a"), ("1.2", "b"), ("2.1", "c")
CHECKS = (Check((A, B), smaller), Check((B, C), smaller), Check((A,), lambda a: "" if 1 / a > 0 else "?"))


def found(**given):
    def find(question, part):
        if part not in given:
            raise AnswerError("there is none")
        return given[part]

    return reflect(CHECKS, find)


def test_what_does_not_go_together_is_asked_with_the_numbers_of_its_questions():
    said = found(a=3, b=2, c=1)
    assert said.asked == ((("1.1", "1.2"), "Is 3 smaller than 2?"), (("1.2", "2.1"), "Is 2 smaller than 1?"))
    assert str(said).splitlines() == [
        "2 questions, from your own answers alone. Begin with the first: others may go away with it.",
        "  1.1, 1.2: Is 3 smaller than 2?",
        "  1.2, 2.1: Is 2 smaller than 1?",
    ]


def test_where_all_agree_it_says_so_and_no_more():
    assert str(found(a=1, b=2, c=3)) == (
        "Nothing to ask: your answers agree with each other (3 comparisons). Right or wrong, this cannot say."
    )


def test_what_is_not_answered_is_named_once_and_what_can_be_looked_at_is():
    said = found(b=1)
    assert said == Reflection((), 0, (A, C), ())
    assert str(said) == "Not looked at yet, for there is no answer: 1.1 a, 2.1 c."
    assert str(found(a=1, b=2)).splitlines()[1] == "Not looked at yet, for there is no answer: 2.1 c."
    assert str(reflect((), found)) == "There is nothing here that could be held against anything else."


def test_a_check_that_cannot_be_worked_out_stops_nothing_and_is_told():
    said = found(a=0, b=2, c=3)
    assert (said.compared, said.unclear) == (2, ("1.1",))
    assert "Not to be worked out from what is there: 1.1. Are these numbers very large or zero?" in str(said)


def test_a_notebook_has_the_checks_whose_last_answer_is_asked_for_there():
    asked = [
        Question(number_, "1", notebook, "", (), (number(part, "", None, "", ""),))
        for number_, part, notebook in (("1.1", "a", "01_one"), ("1.2", "b", "01_one"), ("2.1", "c", "02_two"))
    ]
    catalogue = Catalogue(asked)
    assert of_notebooks(CHECKS, catalogue, ()) == list(CHECKS)
    assert of_notebooks(CHECKS, catalogue, ["01"]) == [CHECKS[0], CHECKS[2]]
    assert of_notebooks(CHECKS, catalogue, ["02"]) == [CHECKS[1]]
    for wrong in ("03", "", 2):
        with pytest.raises(AnswerError, match=r"There is no notebook .* there are 01_one, 02_two"):
            of_notebooks(CHECKS, catalogue, [wrong])


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ({}, ""),
        ({"reflect": "on"}, ""),
        ({"reflect": "off"}, "switched off in this course"),
        ({"reflect": (NOON - timedelta(hours=1)).isoformat()}, ""),
        ({"reflect": (NOON + timedelta(hours=1)).isoformat()}, "It asks from 2026-11-02 13:00 on"),
        ({"reflect": "2026-11-05"}, "It asks from 2026-11-05 00:00 on"),
        ({"reflect": "2026-10-30"}, ""),
    ],
)
def test_the_setting_of_the_course_says_whether_and_when(setting, told):
    said = silence(setting, NOON)
    assert (told in said) if told else said == ""


@pytest.mark.parametrize("wrong", ["tomorrow", "", 3, None, ["on"], True])
def test_a_setting_that_is_none_is_told(wrong):
    with pytest.raises(ConfigurationError, match='"reflect" should be "on", "off" or a date'):
        silence({REFLECT: wrong}, NOON)
