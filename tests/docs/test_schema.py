"""The JSON Schema of ``answers.json``, as other programs read it: it takes what a session writes, and names faults."""

import json

import jsonschema
import pytest
import sympy

from labcourse.answers import cell_reports, expressions, json_values, schema
from labcourse.answers.answers import AnswerBook
from labcourse.answers.parts import Question, expression, number
from labcourse.errors import AnswerError

X, F = number("x", "m", None, "", ""), expression("f", ("k", "x"), "", "")
QUESTION = Question("1", "1", "a", "", (), (X, F))
FILE = {"format": 2, "student": "ada", "bench": {}, "software": "", "probe_seed": 1, "answers": {}}
DEFINITIONS = json_values.SCHEMA["definitions"]

LONG = "at most 1000 characters"


def test_what_a_session_writes_is_valid_and_what_is_malformed_is_not(tmp_path):
    jsonschema.Draft4Validator.check_schema(json_values.SCHEMA)
    book = AnswerBook(tmp_path / "answers.json", "ada", {"uri": "virtual"}, 1)
    k, x = sympy.symbols("k x")
    replies = book.answer(QUESTION, {"x": 2.0, "f": k * sympy.sin(x) ** 2 / 2}, "a-cell")
    assert all(reply.recorded for reply in replies)
    content = json.loads(book.path.read_bytes())
    jsonschema.validate(content, json_values.SCHEMA)
    tree = content["answers"]["1"]["f"]["value"]
    for bad in (["tan", ["symbol", "x"]], ["int", 0.5], ["pow", *tree], ["symbol", "__class__"]):
        content["answers"]["1"]["f"]["value"] = bad
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(content, json_values.SCHEMA)


def test_each_kind_has_a_definition_and_the_bounds_are_those_of_the_readers():
    assert set(schema.KINDS) <= set(DEFINITIONS)
    assert {one["$ref"].rpartition("/")[2] for one in DEFINITIONS["Answer"]["oneOf"]} == set(schema.KINDS)
    trees = {one["items"][0]["enum"][0]: one for one in DEFINITIONS["Tree"]["oneOf"]}
    arguments = {kind: (one["minItems"] - 1, one["maxItems"] - 1) for kind, one in trees.items()}
    assert arguments == expressions.ARGUMENTS
    assert trees["symbol"]["items"][1]["pattern"] == f"^{expressions.NAME.pattern}$"
    for bound in (expressions.MAX_DEPTH, expressions.MAX_NODES, expressions.MAX_EXPONENT):
        assert f" {bound}" in DEFINITIONS["Tree"]["description"]
    assert DEFINITIONS["Name"]["maxLength"] == cell_reports.LONGEST
    assert DEFINITIONS["Line"]["maximum"] == cell_reports.MOST_LINES


@pytest.mark.parametrize(
    ("changed", "place", "words"),
    [
        ({"answers": {"1": {"x": 5}}}, "answers.1.x", "An answer should be an object."),
        ({"more": 1}, "more", "Extra inputs are not permitted"),
        ({"student": None}, "student", "Input should be a valid string"),
        ({"probe_seed": 1.0}, "probe_seed", "Input should be a valid integer"),
        ({"probe_seed": -1}, "probe_seed", "Input should be greater than or equal to 0"),
        ({"when": {"1": {"x": 2**33}}}, "when.1.x", "Input should be less than 8589934592"),
        ({"predictions": {"a": {"why": "x" * 1001}}}, "predictions.a.why", f"String should have {LONG}"),
        ({"format": 3}, "format", "It has format 3; this version reads format 2: install the newer one."),
    ],
)
def test_a_fault_is_named_with_its_place(changed, place, words):
    schema.check_file(FILE)
    with pytest.raises(AnswerError) as caught:
        schema.check_file(FILE | changed)
    assert str(caught.value) == f"It is not a file of answers: {words} (at {place})"
    with pytest.raises(AnswerError, match=r"Field required \(at student\)"):
        schema.check_file({name: value for name, value in FILE.items() if name != "student"})


@pytest.mark.parametrize(
    ("part", "content", "place"),
    [
        (X, {"value": 1.0, "uncertainty": 0}, "number.uncertainty"),
        (F, {"value": ["int", 0.5]}, "expression.value"),
        (X, {"value": True}, "number.value"),
    ],
)
def test_a_fault_of_an_answer_is_named_with_its_place(part, content, place):
    with pytest.raises(AnswerError, match=rf"\(at {place}\)$"):
        schema.read_answer(part, {"kind": part.kind, **content})
