"""An untrusted ``answers.json``, where it was made to cost something: time, or an honest student's answers."""

import json

import pytest
import sympy
from made_courses import OURS

from labcourse.answers import catalogue, forms
from labcourse.answers.bounds import LONGEST_PROSE
from labcourse.answers.words import Words
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.verdicts import Status
from rotflex.course.questions import CATALOGUE

SEED = 7


def file(answers, **changes):
    book = {"format": 2, "student": "ada", "bench": {"uri": "virtual"}, "software": "rotflex", "probe_seed": SEED}
    return json.dumps({**book, "answers": answers} | changes).encode()


def energy(tree):
    return file({"2.1": {"V": {"kind": "expression", "value": tree}}})


def test_the_exact_value_of_a_float_is_an_answer_like_any_other():
    K_s, alpha = sympy.symbols("K_s alpha")
    content = forms.encode(CATALOGUE.find("2.1").part("V"), sympy.Rational(0.1) * K_s * alpha**2, SEED).content
    assert 2**55 in content["value"][1]  # its denominator, larger than what a float can count to
    read = decoding.decode(file({"2.1": {"V": content}}), SEED, CATALOGUE)
    assert read.problems == []
    assert read.values["2.1", "V"] == sympy.Rational(0.1) * K_s * alpha**2


def test_for_questions_that_there_are_not_nothing_similar_is_sought(monkeypatch):
    monkeypatch.setattr(catalogue, "get_close_matches", None)
    read = decoding.decode(file({f"2.{number}": {"V": {}} for number in range(100, 20_000)}), SEED, CATALOGUE)
    assert len(read.notes) == 21


def test_an_expression_that_is_slow_to_build_is_malformed(monkeypatch):
    monkeypatch.setattr(decoding, "_TIME_LIMIT", 0.3)
    great = ["pow", ["int", 10**20], ["int", 64]]  # its square roots are sought for factors, one by one
    read = decoding.decode(
        energy(["add", *(["sqrt", ["add", great, ["int", n]]] for n in range(160))]), SEED, CATALOGUE
    )
    assert "TooSlow" in read.malformed["2.1", "V"]


@pytest.mark.parametrize("error", [OverflowError, ValueError, RecursionError, MemoryError])
def test_an_expression_that_nothing_can_hold_is_malformed_and_the_others_count(monkeypatch, error):
    def decode(part, content):
        raise error("untrusted words")

    monkeypatch.setattr(decoding.forms, "decode", decode)
    read = decoding.decode(energy(["int", 1]), SEED, CATALOGUE)
    assert error.__name__ in read.malformed["2.1", "V"]


def test_what_is_said_of_a_file_has_no_escapes_in_it():
    read = decoding.decode(file({}, format="\x1b]0;owned\x07\u202e"), SEED, CATALOGUE)
    assert "format" in read.problems[0]
    assert read.problems[0].isprintable()


WHERE = ("2.11", "explanation")


@pytest.fixture
def claims():
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
    assert WHERE not in found.values and WHERE in found.malformed


def test_a_mark_on_words_waits_for_a_person_and_shows_them(claims):
    found = with_words(claims, {WHERE: Words("Because $\\theta$ is not flat.")})
    case = marking.case_of(OURS, found, OURS.bench("ada"), 1)
    question = OURS.catalogue.find("2.11")
    mark = marking.mark_part(question, question.part("explanation"), OURS.key["2.11"]["explanation"], found, case)
    assert (mark.status, mark.given) == (Status.FOR_A_PERSON, "Because $\\theta$ is not flat.")
