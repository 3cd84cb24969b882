"""Decode an untrusted ``answers.json``: hostile files, and the texts of the saved notebooks."""

import json

import pytest
import sympy
from made_courses import OURS

from labcourse.answers import catalogue, forms, schema
from labcourse.answers.json_values import LONGEST_PROSE
from labcourse.answers.words import TextAnswer
from labcourse.grading.marking import decoding
from labcourse.grading.marking.decoding import Claims
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence
from rotflex.course.questions import CATALOGUE

SEED = 7


def file(contents, **changes):
    book = {"format": 2, "student": "ada", "bench": {"uri": "virtual"}, "software": "rotflex", "probe_seed": SEED}
    return json.dumps({**book, "answers": contents} | changes).encode()


def energy(tree):
    return file({"2.1": {"V": {"kind": "expression", "value": tree}}})


def test_the_exact_value_of_a_float_is_an_answer_like_any_other():
    K_s, alpha = sympy.symbols("K_s alpha")
    content = forms.encode(CATALOGUE.find("2.1").part("V"), sympy.Rational(0.1) * K_s * alpha**2, SEED).content
    assert 2**55 in content["value"][1]  # its denominator, larger than what a float can count to
    read = decoding.decode(file({"2.1": {"V": content}}), SEED, CATALOGUE)
    assert read.problems == []
    assert read.values["2.1", "V"] == sympy.Rational(0.1) * K_s * alpha**2


def test_no_similar_names_are_looked_for_among_thousands_of_unknown_questions(monkeypatch):
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
def test_an_expression_that_cannot_be_decoded_is_malformed(monkeypatch, error):
    def decode(part, content):
        raise error("untrusted words")

    monkeypatch.setattr(decoding.forms, "decode", decode)
    read = decoding.decode(energy(["int", 1]), SEED, CATALOGUE)
    assert error.__name__ in read.malformed["2.1", "V"]


def test_messages_about_a_file_have_no_escape_sequences():
    read = decoding.decode(file({}, format="\x1b]0;owned\x07\u202e"), SEED, CATALOGUE)
    (problem,) = read.problems
    assert problem.code is Code.ANSWERS_UNREAD and "format" in problem.parameters["error"]
    assert sentence(problem).isprintable()


@pytest.mark.parametrize("number", [0, 20, 21, 40])
def test_notes_on_unknown_questions_are_limited(number):
    read = decoding.decode(file({f"99.{place}": {"x": {}} for place in range(number)}), SEED, CATALOGUE)
    assert len(read.notes) == min(number, 21)
    ignored = [Problem.of(Code.ANSWER_TO_NOTHING, number=f"99.{place}", name="x") for place in range(min(number, 20))]
    assert read.notes[:20] == ignored
    assert read.notes[20:] == [Problem.of(Code.MORE_OF_THIS_SORT, count=number - 20)] * (number > 20)


@pytest.mark.parametrize("fits", [True, False])
def test_levels_of_an_answer_are_limited(fits):
    value = []
    for _level in range(schema.MAX_DEPTH - 5 + (not fits)):  # the file, its answers, a question, a part, a list
        value = [value]
    problems = decoding.decode(file({"1": {"x": {"kind": value}}}), SEED, CATALOGUE).problems
    assert ["deeply" in problem.parameters["error"] for problem in problems] == [True] * (not fits)


@pytest.mark.parametrize("fits", [True, False])
@pytest.mark.parametrize("sign", [1, -1])
def test_integers_are_limited(fits, sign):
    data = file({}, probe_seed=sign * (10**20 + (not fits)))
    problems = decoding.decode(data, SEED, CATALOGUE).problems
    assert any("too large" in problem.parameters["error"] for problem in problems) != fits


@pytest.mark.timeout(60)
def test_digits_are_counted_before_they_are_read():
    for digits in (26, 4000, 500_000):
        problems = decoding.decode(file({}).replace(b": 7", b": " + b"1" * digits), SEED, CATALOGUE).problems
        assert problems[0].code is Code.ANSWERS_UNREAD and "too large" in problems[0].parameters["error"]


WHERE = ("2.11", "explanation")


@pytest.fixture
def claims():
    content = {"kind": "prose", "value": "In quotes."}
    return Claims(
        values={("2.11", "omega_n"): 19.9, WHERE: "In quotes."},
        contents={("2.11", "omega_n"): {"kind": "number", "value": 19.9}, WHERE: content},
        malformed={("2.16", "comparison"): "Too long."},
    )


def test_texts_of_notebooks_replace_recorded_texts_and_nothing_else(claims):
    written = {WHERE: TextAnswer("In a cell."), ("2.16", "comparison"): TextAnswer("It fits.")}
    decoding.add_words(claims, written, OURS.catalogue)
    assert claims.values == {("2.11", "omega_n"): 19.9, WHERE: "In a cell.", ("2.16", "comparison"): "It fits."}
    assert claims.contents[WHERE] == {"kind": "prose", "value": "In a cell."}
    assert claims.malformed == {}


@pytest.mark.parametrize("where", [("2.11", "omega_n"), ("2.91", "x"), ("2.11", "x")])
def test_a_text_is_no_answer_to_a_part_of_another_kind(claims, where):
    decoding.add_words(claims, {where: TextAnswer("20")}, OURS.catalogue)
    assert claims.values == {("2.11", "omega_n"): 19.9, WHERE: "In quotes."}


@pytest.mark.parametrize("text", ["x" * (LONGEST_PROSE + 1), "a\x00b"])
def test_a_text_that_no_answer_can_be_is_malformed(claims, text):
    decoding.add_words(claims, {WHERE: TextAnswer(text)}, OURS.catalogue)
    assert WHERE not in claims.values and WHERE in claims.malformed
