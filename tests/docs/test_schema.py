"""The JSON Schema in the documentation is that of the models, and takes what a session writes."""

import json
import sys

import jsonschema
import pytest
import sympy
from checkout import ROOT

from labcourse.answers.answers import AnswerBook
from labcourse.answers.parts import Question, expression, number

sys.path.insert(0, str(ROOT / "tools"))
import write_schema

STORED = json.loads(write_schema.PATH.read_text(encoding="utf-8"))
QUESTION = Question("1", "1", "a", "", (), (number("x", "m", None, "", ""), expression("f", ("k", "x"), "", "")))


def test_the_file_is_that_of_the_models():
    assert write_schema.text() == write_schema.PATH.read_text(encoding="utf-8"), "run tools/write_schema.py"


def test_what_a_session_writes_is_valid_and_what_is_malformed_is_not(tmp_path):
    jsonschema.Draft202012Validator.check_schema(STORED)
    book = AnswerBook(tmp_path / "answers.json", "ada", {"uri": "virtual"}, 1)
    k, x = sympy.symbols("k x")
    replies = book.answer(QUESTION, {"x": 2.0, "f": k * sympy.sin(x) ** 2 / 2}, "a-cell")
    assert all(reply.recorded for reply in replies)
    content = json.loads(book.path.read_bytes())
    jsonschema.validate(content, STORED)
    tree = content["answers"]["1"]["f"]["value"]
    for bad in (["tan", ["symbol", "x"]], ["int", 0.5], ["pow", *tree], ["symbol", "__class__"]):
        content["answers"]["1"]["f"]["value"] = bad
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(content, STORED)
