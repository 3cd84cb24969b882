"""What own answers ask each other: what is said, what is missing, and when nothing is asked at all."""

from datetime import UTC, datetime, timedelta

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, number
from labcourse.answers.reflection import Comparison, Reflection, of_notebooks, reflect, silence
from labcourse.course_file import REFLECT
from labcourse.errors import AnswerError, ConfigurationError

NOON = datetime(2026, 11, 2, 12, tzinfo=UTC)


def smaller(one, other):
    return "" if one < other else f"Is {one:g} smaller than {other:g}?"


A, B, C = ("1.1", "a"), ("1.2", "b"), ("2.1", "c")
CHECKS = (
    Comparison((A, B), smaller),
    Comparison((B, C), smaller),
    Comparison((A,), lambda a: "" if 1 / a > 0 else "?"),
)


def found(**given):
    def find(question, part):
        if part not in given:
            raise AnswerError("there is none")
        return given[part]

    return reflect(CHECKS, find)


def test_what_does_not_go_together_is_asked_with_the_numbers_of_its_questions():
    said = found(a=3, b=2, c=1)
    assert said.asked == [(["1.1", "1.2"], "Is 3 smaller than 2?"), (["1.2", "2.1"], "Is 2 smaller than 1?")]
    agreeing, lacking, unclear = found(a=1, b=2, c=3), found(b=1), found(a=0, b=2, c=3)
    assert (agreeing.asked, agreeing.compared) == ([], 3)
    assert lacking == Reflection(missing={A: None, C: None})
    assert (unclear.compared, [*unclear.unclear]) == (2, ["1.1"])
    for reflection, fragments in (
        (said, ["In 1 of 3 comparisons", "  1.1, 1.2: Is 3 smaller than 2?", "  1.2, 2.1: Is 2 smaller than 1?"]),
        (agreeing, ["(3 comparisons)"]),
        (lacking, [": 1.1 a, 2.1 c."]),
        (found(a=1, b=2), ["(2 comparisons)", ": 2.1 c."]),
        (unclear, ["(2 comparisons)", " 1.1. "]),
        (reflect((), found), ["nothing here"]),
    ):
        lines = str(reflection).splitlines()
        assert len(lines) == len(fragments)
        assert all(fragment in line for fragment, line in zip(fragments, lines, strict=True))


def test_a_notebook_has_the_checks_whose_last_answer_is_asked_for_there():
    asked = [
        Question(number_, "1", notebook, "", (), (number(part, "", None, "", ""),))
        for number_, part, notebook in (("1.1", "a", "01_one"), ("1.2", "b", "01_one"), ("2.1", "c", "02_two"))
    ]
    catalogue = Catalogue(asked)
    assert of_notebooks(CHECKS, catalogue, ()) == list(CHECKS)
    assert of_notebooks(CHECKS, catalogue, ["01"]) == [CHECKS[0], CHECKS[2]]
    assert of_notebooks(CHECKS, catalogue, ["02"]) == [CHECKS[1]]
    for wrong in ("03", "", "2"):
        with pytest.raises(AnswerError, match="01_one, 02_two"):
            of_notebooks(CHECKS, catalogue, [wrong])


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ({}, None),
        ({"reflect": "on"}, None),
        ({"reflect": "off"}, "off"),
        ({"reflect": (NOON - timedelta(hours=1)).isoformat()}, None),
        ({"reflect": (NOON + timedelta(hours=1)).isoformat()}, "2026-11-02 13:00"),
        ({"reflect": "2026-11-05"}, "2026-11-05 00:00"),
        ({"reflect": "2026-10-30"}, None),
    ],
)
def test_the_setting_of_the_course_says_whether_and_when(setting, reason):
    assert (reason or "") in (silence(setting, NOON) or "") and bool(silence(setting, NOON)) == bool(reason)


def test_a_setting_that_is_none_is_refused_by_name():
    for wrong in ("tomorrow", "", 3, None, ["on"], True):
        with pytest.raises(ConfigurationError, match='"reflect"'):
            silence({REFLECT: wrong}, NOON)
