"""The table of problems has a row for each code, and is what the tool writes."""

import sys

from checkout import ROOT

from labcourse.problems import Code

sys.path.insert(0, str(ROOT / "tools"))
import problem_table

ROWS, CODES = problem_table.rows(), [code.value for code in Code]


def test_each_code_has_a_row_and_each_row_a_code_in_the_order_of_the_enum():
    assert list(ROWS) == CODES
    assert [code for codes in problem_table.groups().values() for code in codes] == [*Code]


def test_each_row_says_who_reads_it_and_what_to_do():
    for code, row in ROWS.items():
        assert row.keys() <= {"read", "inside", "do", "words"} and row["do"].endswith("."), code
        assert {*row.get("read", ())} <= {*problem_table.PLACES} and {*row.get("inside", ())} <= {*CODES}, code
        assert row.get("read") or row.get("inside"), code


def test_words_that_stand_for_a_parameter_stand_in_the_sentence():
    for code, row in ROWS.items():
        sentence = problem_table.shown(Code(code), row.get("words", {}))
        assert [word for word in row.get("words", {}).values() if f"*{word}*" not in sentence] == [], code
        assert not {*"{}|"} & {*sentence}, code


def test_the_page_is_that_of_the_tool():
    assert problem_table.text() == problem_table.PAGE.read_text(encoding="utf-8"), "run tools/problem_table.py"
