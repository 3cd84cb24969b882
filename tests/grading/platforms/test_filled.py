"""Marks in one column of each platform's file: byte by byte what is else there, and what is told."""

import csv
import io
import re
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_courses import OURS
from their_exports import BLACKBOARD, CANVAS, FILES, WORKSHEET, class_of_four

from labcourse.errors import GradingError
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.platforms import filled, matching, recognised, rules
from labcourse.grading.platforms.earned import Earned, earned, of_account
from labcourse.grading.platforms.filled import Choice
from labcourse.grading.platforms.their_file import read

WORKSHEETS = "Moodle's grading worksheet"


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    with Gradebook(class_of_four(tmp_path_factory.mktemp("class"))) as opened:
        yield opened


def fill(book, content, out_of=None, have=None, **choice):
    found = rules.recognised(read(content if isinstance(content, bytes) else content.encode()))
    column = found.column("Grade" if found.platform == WORKSHEETS else "Lab 3")
    most = recognised.maximum(column, found.platform, out_of)
    matches = matching.match(found, book.students())
    done = filled.fill(
        found, column, most, matches, earned(book, OURS) | (have or {}), Choice(**{"decimals": 2} | choice)
    )
    return done, filled.told(found, done, matches)


#: Platform → what is replaced in its text, once each. ada: 2.5/3, bob: 1.2/3; cleo waits, eve has nothing.
DIFFERENCES = {
    "Canvas": [('twice",,8', 'twice",83.33,8')],
    "Moodle": [('ada@x.org,-,"Well', 'ada@x.org,83.33,"Well')],
    WORKSHEETS: [('grading - ",,50.00,Yes,"Monday', 'grading - ",41.67,50.00,Yes,"Monday')],
    "Blackboard": [('"Needs Grading"', '"83.33"')],
    "Brightspace": [("ada@x.org,,", "ada@x.org,16.67,")],
}


@pytest.mark.parametrize("platform", FILES)
def test_one_column_is_filled_and_not_another_byte_changes(book, platform):
    done, told = fill(book, FILES[platform], Decimal(100) if platform == "Moodle" else None)
    source = read(FILES[platform])
    expected = source.text
    for before, after in DIFFERENCES[platform]:
        assert expected.count(before) == 1
        expected = expected.replace(before, after)
    assert done.data == source.data(expected)
    assert list(done.unchanged) == ["s1002"]  # 1.2 of 3 is 40 of 100, 20 of 50 and 8 of 20: "40.00" is that already
    assert "2.11 explanation" in done.left["s1003"]
    assert [int(word) for word in told[0].replace("(", "").split() if word.isdigit()][:3] == [1, 0, 1]


def test_what_is_told_names_everybody_who_has_no_mark(book, snapshot):
    assert "\n".join(line for name in ("Canvas", "Brightspace") for line in fill(book, FILES[name])[1]) == snapshot


def test_a_mark_that_replaces_another_is_told_with_both(book):
    done, told = fill(book, WORKSHEET.replace(",20.00,50.00", ",19.5,50.00"))
    assert told[1] == "1 replaced: s1002: 19.5 → 20"
    assert b",20,50.00,Yes" in done.data


def test_of_what_waits_what_is_decided_so_far_is_written_only_when_asked_and_told(book):
    done, told = fill(book, FILES["Canvas"], unfinished=True)
    assert done.data.decode("utf-8-sig") == CANVAS.replace('twice",,8', 'twice",83.33,8').replace(
        '"Lab A, Lab B",,,9', '"Lab A, Lab B",,66.67,9'
    )
    assert any("s1003 (2.11 explanation)" in line for line in told)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (WORKSHEET, "Moodle.*No"),
        (BLACKBOARD, "In Progress"),
        (CANVAS.replace(",EX,", ",N/A,"), "N/A"),
        (CANVAS.replace(",EX,", ",good,"), "'good'"),
        (CANVAS.replace(",EX,,,", ""), "line 7"),
        (CANVAS.replace(",EX,", ",,"), "nothing handed in."),
    ],
)
def test_a_cell_that_is_not_ours_to_fill_is_left_with_the_reason(book, content, why):
    done, _ = fill(book, content)
    assert re.search(why, done.left["s1004"])


def test_a_mark_above_the_maximum_is_refused_for_all_at_once_unless_it_is_to_be_cut(book):
    much = {"s1001": Earned(Fraction(11, 10)), "s1003": Earned(Fraction(21, 20))}
    with pytest.raises(GradingError) as error:
        fill(book, FILES["Canvas"], have=much)
    assert "s1001: 110, s1003: 105" in str(error.value)
    done, told = fill(book, FILES["Canvas"], have=much, cap=True)
    assert b'twice",100,8' in done.data and any("s1001 (110), s1003 (105)" in line for line in told)


def test_a_mark_that_only_rounding_puts_above_the_maximum_is_refused_too(book):
    theirs = CANVAS.replace("100.00", "99.50")
    all_of_it = {"s1001": Earned(Fraction(1))}
    with pytest.raises(GradingError, match=r"s1001: 100.*more --decimals"):
        fill(book, theirs, have=all_of_it, decimals=0)
    assert b'twice",99.5,8' in fill(book, theirs, have=all_of_it, decimals=1)[0].data


def test_a_column_of_letters_is_refused(book):
    with pytest.raises(GradingError, match="'B-'"):
        fill(book, CANVAS.replace(",40.00,", ",B-,"))


def test_decimals_have_a_comma_where_the_files_have_one(book):
    theirs = FILES["Canvas"].decode("utf-8-sig").replace("100.00", '"100,00"').replace("10.00", '"10,00"')
    done, _ = fill(book, theirs.replace("40.00", '"40,00"'))
    row = list(csv.reader(io.StringIO(done.data.decode(), newline="")))[3]
    assert row[6] == "83,33"


def test_the_final_grade_counts_and_until_there_is_one_what_is_decided():
    account = SimpleNamespace(earned=Fraction(9), out_of=Fraction(12), final=7.1, final_out_of=10.0, undecided=())
    assert of_account(account) == Earned(Fraction(71, 100))  # and not 7.1 / 10.0 as the machine has it
    account.final, account.earned = None, Fraction(6)
    account.undecided = tuple(SimpleNamespace(question="1.1", part=f"p{number}") for number in range(8))
    assert of_account(account) == Earned(Fraction(1, 2), "1.1 p0, 1.1 p1, 1.1 p2, 1.1 p3, 1.1 p4, 1.1 p5 and 2 more")


def test_what_the_course_leaves_out_is_left_out_here_too(book):
    marks = replace(OURS.settings.marks, drop=("2.11 explanation",))
    course = replace(OURS, settings=replace(OURS.settings, marks=marks))
    assert {student: (one.share, one.waits) for student, one in earned(book, course).items()} == {
        "s1001": (1, ""),
        "s1002": (Fraction(6, 10), ""),
        "s1003": (1, ""),
        "s1004": (None, ""),
    }


def test_where_there_are_no_points_there_is_no_mark():
    account = SimpleNamespace(earned=Fraction(0), out_of=Fraction(0), final=None, undecided=())
    assert of_account(account) == Earned(None, "", "it is out of no points")


@given(st.fractions(min_value=0, max_value=200), st.integers(0, 5))
def test_rounding_is_half_up_and_exact(value, decimals):
    found = Fraction(filled.rounded(value, decimals))
    step = Fraction(1, 10**decimals)
    assert (found / step).denominator == 1 and -step / 2 <= value - found < step / 2


@pytest.mark.parametrize("name", ["=1+1", "@x", '"+"', "-2"])
def test_names_that_a_spreadsheet_would_calculate_are_theirs_and_stay(book, name):
    quoted = '"' + name.replace('"', '""') + '"'
    done, _ = fill(book, CANVAS.replace('"Lovelace, Ada"', quoted))
    assert quoted.encode() in done.data
