"""Problems as data, and the sentences about them: each code has one, and nothing in a parameter is more than a text."""

import ast
import json
import re
from collections import defaultdict
from string import Formatter

import pytest
from checkout import ROOT
from hypothesis import given
from hypothesis import strategies as st

from labcourse.problems import LONGEST, MOST, Code, Problem, as_json, codes, from_json, has
from labcourse.safe_text import no_escapes
from labcourse.sentences import _SENTENCES, quoted, sentence, sentences, template

#: Names in sentences that are made of other parameters, or of the program.
MADE = {"where", "place", "cell_name", "command", "some_files"}
HOSTILE = "{oops!z:>9} {0} {{ %s \x1b[2J \u202e <b>"


class Everything(dict):
    """Parameters of which each is there."""

    def get(self, name, default=None):
        return ["x"]


def fields(code):
    """The names in all forms of a sentence that depend on whether a parameter is there."""
    made = _SENTENCES[code]
    forms = [made] if isinstance(made, str) else [made(Problem(code)), made(Problem(code, "", Everything()))]
    found = (field for form in forms for _text, field, _spec, _conversion in Formatter().parse(form) if field)
    return {re.match(r"\w+", field)[0] for field in found}


def test_each_code_has_a_sentence_and_no_sentence_has_another():
    assert {*_SENTENCES} == {*Code}
    assert all(template(Problem(code)).strip() for code in Code)
    assert all(code.value == code.name.lower() for code in Code)


@pytest.mark.parametrize("code", Code)
def test_a_sentence_can_be_made_whatever_is_given(code):
    """Nothing, as of a problem that an older version stored; and texts that would be fields, or steer a terminal."""
    assert sentence(Problem(code)) == sentence(Problem.from_json({"code": code.value}))
    lists = {"building", "files", "others", "parts", "names", "partners", "owners", "students", "cells", "similar"}
    about = {name: [HOSTILE] if name in lists else HOSTILE for name in fields(code) - {"where", "count"}}
    said = sentence(Problem.of(code, HOSTILE, **about))
    assert said == no_escapes(said) and "\x1b" not in said and "\u202e" not in said


def test_what_is_named_in_a_sentence_is_given_where_the_problem_is_made():
    """By each code that is named in a call; where it is computed, or parameters come as a whole, somewhere."""
    everywhere, of_code, as_a_whole = {"named"}, defaultdict(set), {Code.UNKNOWN.name}
    for path in [*ROOT.glob("labcourse/**/*.py"), *ROOT.glob("solutions/*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Dict):
                everywhere |= {key.value for key in node.keys if isinstance(key, ast.Constant)}
            if not isinstance(node, ast.Call):
                continue
            names = {keyword.arg for keyword in node.keywords}
            everywhere |= names
            first = node.args[0] if node.args else None
            is_code = (
                isinstance(first, ast.Attribute) and isinstance(first.value, ast.Name) and first.value.id == "Code"
            )
            if is_code and isinstance(node.func, ast.Attribute) and node.func.attr == "of":
                of_code[first.attr] |= names
                as_a_whole |= {first.attr} if None in names else set()
    assert {code: unknown for code in Code if (unknown := fields(code) - everywhere - MADE)} == {}
    known = [code for code in Code if code.name in of_code and code.name not in as_a_whole]
    answer = {"question", "part"}  # of texts: they are put to it where the question is known
    assert {code: lost for code in known if (lost := fields(code) - of_code[code.name] - MADE - answer)} == {}


NAMES = st.sampled_from(["why", "text", "seconds", "most", "building", "question", "part", "named", "cells"])
PLAIN = st.text(max_size=20) | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | st.booleans() | st.none()


def made(inner):
    values = PLAIN | inner | st.lists(PLAIN | inner, max_size=3)
    about = st.dictionaries(NAMES, values, max_size=4)
    return st.builds(lambda code, where, given: Problem.of(code, where, **given), CODES, st.text(max_size=20), about)


CODES = st.sampled_from(list(Code))
PROBLEMS = st.recursive(made(st.nothing()), made, max_leaves=5)


@given(PROBLEMS)
def test_a_problem_with_others_in_it_comes_back_from_json_as_it_was(problem):
    data = json.dumps(as_json([problem, "a text"]))
    assert from_json(json.loads(data)) == [problem, "a text"]
    assert problem.code in codes(problem) and has(problem.code, ["a text", problem], problem.where)


@pytest.mark.parametrize("code", ["of_tomorrow", "", None, 3, ["gone"], {"code": "gone"}, "GONE", "Code.GONE"])
def test_what_has_an_unknown_code_is_unknown_and_keeps_the_rest(code):
    read = Problem.from_json({"code": code, "where": "a.ipynb", "named": "x", "why": {"code": "gone"}})
    named = str(code) or "?"
    assert (read.code, read.where, read.parameters["named"]) == (Code.UNKNOWN, "a.ipynb", named)
    assert read.parameters["why"] == Problem.of(Code.GONE) and codes(read) == {Code.UNKNOWN, Code.GONE}
    assert from_json(json.loads(json.dumps(as_json(read)))) == read  # once more stored, and read
    assert quoted(named) in sentence(read)
    assert Problem.from_json({}).code is Code.UNKNOWN


def test_what_a_problem_holds_is_bounded():
    long = Problem.of(Code.RAISED, "w" * 9_999, text="t" * 9_999, cells=["c" * 9_999] * 999, type="", line=None)
    assert (len(long.where), len(long.parameters["text"])) == (LONGEST, LONGEST)
    assert (len(long.parameters["cells"]), len(long.parameters["cells"][0])) == (MOST, LONGEST)
    assert {*long.parameters} == {"text", "cells"}


def test_codes_are_those_of_problems_and_of_the_problems_in_them_and_never_of_texts():
    inner = Problem.of(Code.RAISED, text="it took longer than 60 s and was stopped")
    outer = Problem.of(Code.SUBMISSION_UNREAD, "a.zip", why=[Problem.of(Code.GONE), inner], error="encrypted")
    assert codes(outer) == {Code.SUBMISSION_UNREAD, Code.GONE, Code.RAISED}
    assert codes("gone") == set() and not has(Code.GONE, ["gone", outer])
    assert has(Code.SUBMISSION_UNREAD, [outer], "a.zip") and not has(Code.SUBMISSION_UNREAD, [outer], "b.zip")


def test_each_sentence_is_said_once_and_words_of_others_stay_as_they_are():
    gone = Problem.of(Code.NOT_HANDED_IN, "a.ipynb")
    assert sentences([gone, "Well {done}.", gone]) == ["a.ipynb was not handed in.", "Well {done}."]
    assert sentence("\x1b[2J") == no_escapes("\x1b[2J") != "\x1b[2J"
