"""``grades.csv``: who has a row, and what can, and cannot, be taken for no points."""

import csv
import io
import re
from datetime import UTC, datetime

import gradebooks
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_courses import OURS

from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import GivenMark, StudentRecord
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports.grades import NotGraded, grades_table
from labcourse.safe_text import as_csv, from_spreadsheet_cell, no_escapes, spreadsheet_cell

NUMBER = Mark("2.11", "omega_n", Status.RIGHT, 1.5, 2.0, "Reason.", "19.9 rad/s")
WORDS = Mark("2.11", "explanation", Status.FOR_A_PERSON, 0.0, 1.0, "Reason.", "So.")
ALL_WORDS = Mark("2.16", "comparison", Status.FOR_A_PERSON, 0.0, 2.0, "Reason.", "So.")
FAULTY = Mark("3.1", "stability", Status.NOT_MARKED, 0.0, 1.0, "The key has a fault.", "stable")
NO_POINTS = Mark("0.1", "resolution", Status.WRONG, 0.0, 0.0, "Reason.", "1")


def result(student="ada", *marks, **more):
    return gradebooks.result(*(marks or (NUMBER, WORDS, ALL_WORDS)), student=student, **more)


def table(*rows, handed_in=(), order=()):
    text = grades_table(rows, handed_in, order)
    return {row["student"]: row for row in csv.DictReader(io.StringIO(text, newline=""))}


def test_what_waits_and_what_the_key_could_not_mark_is_0_in_no_column():
    row = table(result("ada", WORDS, ALL_WORDS, FAULTY, NO_POINTS))["ada"]
    assert [row[name] for name in ("2.11", "2.16", "3.1", "total")] == ["", "", "", ""]
    assert (row["awaiting a person"], row["not marked"], row["out_of"]) == ("3", "1", "4")
    assert row["undecided"] == "2.11 explanation; 2.16 comparison; 3.1 stability"


def test_no_points_that_were_decided_are_0():
    wrong = Mark("2.11", "omega_n", Status.WRONG, 0.0, 2.0, "Reason.", "3")
    row = table(result("ada", wrong, WORDS))["ada"]
    assert (row["2.11"], row["total"], row["awaiting a person"]) == ("0", "0", "1")


def test_columns_stand_in_the_keys_order_and_hold_what_only_one_has():
    found = table(result("ada", ALL_WORDS), result("bob", NUMBER), order=["2.11", "2.12", "2.16"])
    assert [name for name in found["ada"] if re.match(r"\d\.", name)] == ["2.11", "2.16"]
    assert (found["ada"]["2.11"], found["bob"]["2.11"]) == ("", "1.5")


def test_a_persons_mark_that_lapsed_is_in_the_notes():
    mark = Mark("2.11", "explanation", "given by a person", 0.5, 1.0, "Well.", "Before.")
    lapsed = GivenMark(mark, "A. Teacher", datetime(2026, 3, 2, tzinfo=UTC))
    notes = table(result(lapsed=[lapsed], problems=("Trouble.",)))["ada"]["notes"]
    assert notes.startswith("Trouble. 2.11, explanation: A. Teacher gave 0.5 of 1 points on 2026-03-02 for another")
    assert "a person has to look again" in notes and notes.endswith("Run in isolation.")


def test_cells_that_a_spreadsheet_would_calculate_are_made_text():
    names = ["=1+1", "+1", "-1", "@x", "\tx", "\xa0=1", "\rx", "2 =1"]
    assert list(table(*map(result, names))) == ["'=1+1", "'+1", "-1", "'@x", "'\tx", "'\xa0=1", "\\rx", "2 =1"]
    about = StudentRecord("ada", "=HYPERLINK()", "@x", "-1")
    for row in (
        *table(result(about=("=HYPERLINK()", "@x", "-1"))).values(),
        *table(NotGraded(about, account_of(OURS, Handed(about)))).values(),
    ):
        assert (row["name"], row["email"], row["section"]) == ("'=HYPERLINK()", "'@x", "-1")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31mred", "\\x1b[31mred"),
        ("\u202egnp.exe", "\\u202egnp.exe"),
        ("half \ud800", "half \\ud800"),
        ("two\nlines\té,你,👩\u200d🔬", "two\nlines\té,你,👩\u200d🔬"),
    ],
)
def test_what_steers_a_terminal_is_shown_instead(text, shown):
    assert no_escapes(text) == shown


@given(st.text(st.characters()))
def test_harmless_text_stays_harmless_and_can_be_written(text):
    shown = no_escapes(text)
    assert no_escapes(shown) == shown
    assert "\x1b" not in shown
    shown.encode("utf-8")


CELLS = st.text(st.sampled_from("=+-@;,\"' \xa0a1\n\t"), max_size=12)


@given(st.lists(st.lists(CELLS, min_size=1, max_size=3), min_size=1, max_size=3))
def test_wherever_a_spreadsheet_splits_no_formula_begins(rows):
    """At commas, as CSV means it, and at semicolons, where quotes within a line count for nothing."""
    text = as_csv(rows)
    split = [csv.reader(io.StringIO(text, newline=""), delimiter=delimiter) for delimiter in ",;"]
    for cell in (cell for table in split for row in table for cell in row):
        assert not cell.lstrip(" \xa0").startswith(("=", "+", "-", "@")) or re.fullmatch(r"-\d+(\.\d+)?", cell)


@given(CELLS)
def test_what_is_read_back_is_what_was_written(text):
    text = text.replace("'", "")  # a sign of ours is not told from one that was there
    assert from_spreadsheet_cell(spreadsheet_cell(text)) == text
