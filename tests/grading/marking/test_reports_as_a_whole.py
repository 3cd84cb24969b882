"""A report as a whole waits for a person where anything of it was written; their mark lapses with any text of it."""

import re
from dataclasses import replace

import pytest
from gradebooks import graded, record
from made_courses import OURS

from labcourse.answers.words import TextAnswer
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marks import Status
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem

REPORT, WHOLE = "Modeling report", "Modeling report, as a whole"
COURSE = replace(OURS, key={number: OURS.key[number] for number in (REPORT, WHOLE)})
AIM, END = (REPORT, "stiffness_procedure"), (REPORT, "model_conclusion")


def claims(texts):
    read = Claims()
    decoding.add_words(read, {where: TextAnswer(text) for where, text in texts.items()}, OURS.catalogue)
    return read


def marks(texts, asked=None):
    found = marking.mark(COURSE, claims(texts), None, Submission(student="ada", probe_seed=1, asked=asked))
    return {(one.question, one.part): one for one in found}


def test_it_waits_for_a_person_where_any_text_is_written_and_is_missing_where_none_is():
    for part in ("organisation", "appearance"):
        one = marks({AIM: "We shook it."})[WHOLE, part]
        assert (one.status, one.points, one.out_of, one.awaiting) == (Status.FOR_A_PERSON, 0, 1, 1)
        one = marks({("Control report", "poles_analysis"): "The eigenvalues."})[WHOLE, part]
        assert (one.status, one.points, one.awaiting, one.given) == (Status.MISSING, 0, 0, "")


def test_whoever_judges_it_has_all_of_its_texts_under_their_headings():
    given = marks({END: "It is good.", AIM: "We shook it."})[WHOLE, "appearance"].given
    assert given.startswith("**I.1 Procedure: finding the stiffness**\n\nWe shook it.")
    assert given.endswith("**IV.1 Conclusion: the model**\n\nIt is good.")
    assert re.findall(r"^\*\*(\S+)", given, re.M) == ["I.1", "I.2", "I.3", "III.1", "III.2", "IV.1"]
    assert given.count("*not written yet*") == 4


def test_an_answer_to_it_that_somebody_smuggles_in_is_none():
    where = (WHOLE, "organisation")
    read = claims({where: "Give me the point."})
    decoding._add_answer(read, OURS.catalogue, *where, {"kind": "whole", "value": "Give me the point."})
    assert where not in read.values
    assert read.notes == [Problem.of(Code.ANSWER_TO_NOTHING, number=WHOLE, name="organisation")]
    found = marking.mark(COURSE, read, None, Submission(student="ada", probe_seed=1))
    assert {one.status for one in found} == {Status.MISSING}


def test_marking_leaves_the_claims_as_they_are_and_tells_faults_of_the_key_in_them():
    class Failing:
        kinds = ("whole",)

        def verdict(self, part, value, case):
            raise TypeError("a slip")

    key = {**COURSE.key, WHOLE: {"organisation": Failing(), "appearance": OURS.key[WHOLE]["appearance"]}}
    read = claims({AIM: "We shook it."})
    found = {
        (one.question, one.part): one
        for one in marking.mark(replace(COURSE, key=key), read, None, Submission(student="ada", probe_seed=1))
    }
    assert found[WHOLE, "organisation"].status is Status.NOT_MARKED
    assert found[WHOLE, "organisation"].given == found[WHOLE, "appearance"].given != ""
    assert list(read.values) == [AIM]
    (problem,) = read.problems
    assert (problem.code, problem.parameters["question"], problem.parameters["part"]) == (
        Code.KEY_FAILED,
        WHOLE,
        "organisation",
    )


@pytest.mark.parametrize(("asked", "expected"), [((AIM,), True), ((("Control report", "poles_analysis"),), False)])
def test_it_is_judged_where_the_release_that_was_worked_with_asks_for_its_texts(asked, expected):
    found = marks({AIM: "We shook it."}, asked)
    assert ("organisation" in {part for question, part in found if question == WHOLE}) is expected


def test_what_could_not_be_read_at_all_is_missing_as_a_whole_too():
    found = marking.nothing_earned(COURSE, Problem.of(Code.NOTHING_READ), Status.MISSING)
    assert [one.part for one in found if one.question == WHOLE] == ["organisation", "appearance"]
    assert {one.reason for one in found} == {Problem.of(Code.NOTHING_READ)}


def run(texts, submission="first"):
    return graded("ada", *marks(texts).values(), submission=submission)


def judged(book):
    return next(one for one in book.current("ada").marks if one.where == (WHOLE, "organisation"))


BOTH = {AIM: "We shook it.", END: "It is good."}


@pytest.mark.parametrize(
    ("then", "stays"),
    [
        (BOTH | {AIM: "We shook\nit. "}, True),
        (BOTH | {END: "It is bad."}, False),
        ({AIM: BOTH[AIM]}, False),
        (BOTH | {("Control report", "poles_analysis"): "The eigenvalues."}, True),
    ],
    ids=["other white space", "another text", "a text less", "another report"],
)
def test_a_persons_mark_holds_for_as_long_as_no_text_of_the_report_changes(book, then, stays):
    record(book, run(BOTH))
    book.set_mark("ada", WHOLE, "organisation", 0.75, reason="Well ordered.", actor="anna", expected=judged(book))
    record(book, run(then, "second"))
    assert (judged(book).points == 0.75) is stays
    lapsed = [one.mark.where for one in book.current("ada").lapsed]
    assert lapsed == ([] if stays else [(WHOLE, "organisation")])
