"""Answers in words, taken from saved notebooks, beside those that a run recorded."""

from __future__ import annotations

import pytest
from made_courses import OURS

from rotflex.courseware.kinds.values import LONGEST_PROSE
from rotflex.courseware.words import Words
from rotflex.instructor.marking import decoding, marking
from rotflex.instructor.marking.decoding import Claims
from rotflex.instructor.verdicts import Status

WHERE = ("2.11", "explanation")


@pytest.fixture
def claims():
    """What a run recorded: a number, and words in quotes as in an older notebook."""
    content = {"kind": "prose", "value": "In quotes."}
    return Claims(
        values={("2.11", "omega_n"): 19.9, WHERE: "In quotes."},
        contents={("2.11", "omega_n"): {"kind": "number", "value": 19.9}, WHERE: content},
        malformed={("2.16", "comparison"): "Too long."},
    )


def with_words(claims, written):
    return decoding.with_words(claims, written, OURS.catalogue)


def test_words_count_before_what_was_recorded_and_the_rest_stays(claims):
    found = with_words(claims, {WHERE: Words("In a cell."), ("2.16", "comparison"): Words("It fits.")})
    assert found.values == {("2.11", "omega_n"): 19.9, WHERE: "In a cell.", ("2.16", "comparison"): "It fits."}
    assert found.contents[WHERE] == {"kind": "prose", "value": "In a cell."}
    assert found.malformed == {}
    assert claims.values[WHERE] == "In quotes." and claims.malformed  # not changed


def test_without_words_what_was_recorded_counts(claims):
    assert with_words(claims, {}) == claims


@pytest.mark.parametrize("where", [("2.11", "omega_n"), ("2.91", "x"), ("2.11", "x")])
def test_words_are_taken_for_answers_in_words_alone(claims, where):
    assert with_words(claims, {where: Words("20")}).values == claims.values


@pytest.mark.parametrize("text", ["x" * (LONGEST_PROSE + 1), "a\x00b"])
def test_words_that_no_answer_can_be_are_malformed(claims, text):
    found = with_words(claims, {WHERE: Words(text)})
    assert WHERE not in found.values and "printable text" in found.malformed[WHERE]


def test_a_mark_on_words_waits_for_a_person_and_shows_them(claims):
    found = with_words(claims, {WHERE: Words("Because $\\theta$ is not flat.")})
    case = marking.case_of(OURS, found, OURS.bench("ada"), 1)
    question = OURS.catalogue.find("2.11")
    mark = marking.mark_part(question, question.part("explanation"), OURS.key["2.11"]["explanation"], found, case)
    assert (mark.status, mark.given) == (Status.FOR_A_PERSON, "Because $\\theta$ is not flat.")
