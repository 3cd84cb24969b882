"""Which platform wrote a file, which of its columns takes marks, and what is refused of it."""

import re
from decimal import Decimal

import pytest
import typer
from checkout import ROOT
from refused import refused
from their_exports import BLACKBOARD, BRIGHTSPACE, CANVAS, FILES, MOODLE, WORKSHEET

from labcourse.errors import GradingError
from labcourse.grading.platforms import recognised, rules
from labcourse.grading.platforms.their_file import read
from rotflex import cli

WORKSHEETS = "Moodle's grading worksheet"
#: Platform → how its column may be called, whole heading first; its maximum; lines of its students.
COLUMNS = {
    "Canvas": (("Lab 3 (1234)", "lab 3", "1234"), Decimal(100), [4, 5, 6, 7, 9]),
    "Moodle": (("Assignment: Lab 3 (Real)", "Assignment: Lab 3", "Lab 3"), None, [2, 4, 5, 6]),
    WORKSHEETS: (("Grade", "grade"), Decimal(50), [2, 3, 4, 5]),
    "Blackboard": (("Lab 3 [Total Pts: 100 Score] |123456", "Lab 3", "123456"), Decimal(100), [2, 3, 4, 5]),
    "Brightspace": (
        ("Lab 3 Points Grade <Numeric MaxPoints:20 Weight:10 Category:Labs CategoryWeight:30>", "LAB  3"),
        Decimal(20),
        [2, 3, 4, 5],
    ),
}


def export(content):
    return rules.recognised(read(content if isinstance(content, bytes) else content.encode()))


@pytest.mark.parametrize("platform", FILES)
def test_a_file_is_known_by_its_headings(platform):
    names, maximum, lines = COLUMNS[platform]
    found = export(FILES[platform])
    assert found.platform == platform
    assert [found.table.line(row) for row in found.students] == lines
    for name in names:
        column = found.column(name)
        assert (column.heading, column.maximum) == (names[0], maximum)


def test_the_only_column_that_takes_marks_need_not_be_named():
    for platform in (WORKSHEETS, "Blackboard", "Brightspace"):
        assert export(FILES[platform]).column().heading == COLUMNS[platform][0][0]


def test_of_several_columns_one_has_to_be_named_and_all_are_told():
    with pytest.raises(GradingError, match=r"--column.*\(1234\)', 'Quiz \(99\)'"):
        export(CANVAS).column()


NO_MARKS = [
    (CANVAS, "Lab 4"),
    (CANVAS, "Final Score"),
    (CANVAS, "Notes"),
    (CANVAS.replace("Quiz (99)", "Final Score of Quiz (99)"), "99"),
    (CANVAS.replace("Quiz (99)", "Lab 3 (99)"), "Lab 3"),
    (MOODLE, "Course total"),
    (MOODLE, "Assignment: Lab 3 (Feedback)"),
    (MOODLE.replace("Lab 3 (Real)", "Lab 3 (Letter)"), "Assignment: Lab 3 (Letter)"),
    (MOODLE.replace("Lab 3 (Real)", "Lab 3 (Percentage)"), "Assignment: Lab 3 (Percentage)"),
    (MOODLE, "Last downloaded from this course"),
    (WORKSHEET, "Maximum Grade"),
    (WORKSHEET.replace('"Maximum Grade"', "Scale"), "Grade"),
    (WORKSHEET.replace(",20.00,50.00", ",20.00,60.00"), "Grade"),
    (BLACKBOARD, "Essay"),
    (BLACKBOARD, "123450"),
    (BLACKBOARD.replace("Score] |123456", "Score]"), "Lab 3 [Total Pts: 100 Score]"),
    (BRIGHTSPACE, "Mood"),
    (BRIGHTSPACE.replace("<Numeric", "<PassFail"), "Lab 3"),
    (BRIGHTSPACE, "Calculated Final Grade Numerator"),
]


def test_a_column_that_takes_no_marks_is_refused_with_its_reason(snapshot):
    assert refused(GradingError, lambda content, asked: export(content).column(asked), NO_MARKS) == snapshot


def test_where_no_column_takes_marks_each_is_told_with_its_reason():
    only_text = "OrgDefinedId,Mood Text Grade <Text>,End-of-Line Indicator\n#1,x,#\n"
    with pytest.raises(GradingError, match=r"Grade <Text>'.* Text"):
        export(only_text).column()


@pytest.mark.parametrize("content", ["name,mark\nAda,1\n", "", "Vorname;Nachname;E-Mail-Adresse\nAda;L;a@x.org\n"])
def test_a_file_of_no_platform_is_refused_with_what_it_has_and_what_they_have(content):
    with pytest.raises(GradingError) as error:
        export(content)
    said = str(error.value)
    assert (content.replace(";", ",").split("\n")[0].split(",")[0] or "nothing") in said
    for heading in ("'Student', 'ID'", "'Identifier' and 'Grade'", "'Username'", "'End-of-Line Indicator'"):
        assert heading in said


def test_a_damaged_file_is_said_to_be_that_with_the_line():
    with pytest.raises(GradingError, match="line 2"):
        export('Student,ID,Section,Lab (1)\nAda,"1,A,\n')


def test_semicolons_and_decimal_commas_are_understood():
    theirs = CANVAS.replace('"', "").replace(",", ";").replace("100.00", "100,00")
    assert export(theirs).column("1234").maximum == Decimal(100)
    assert export(MOODLE.replace(",", "\t")).platform == "Moodle"


def test_canvas_with_first_and_last_names_apart_and_without_sis_columns():
    head = "LastName,FirstName,ID,SIS Login ID,Section,Lab (1)\n    Points Possible,,,,,5\nLovelace,Ada,71,al,A,\n"
    found = export(head)
    assert found.column().maximum == 5 and [found.shown(row) for row in found.students] == ["al (Ada Lovelace, line 3)"]


def maximum(content, out_of=None, column="Lab 3"):
    found = export(content)
    return recognised.maximum(found.column(column), found.platform, None if out_of is None else Decimal(out_of))


def test_the_maximum_is_the_files_or_else_has_to_be_told():
    assert maximum(CANVAS) == 100 and maximum(CANVAS, "100.0") == 100 and maximum(MOODLE, "12.5") == Decimal("12.5")
    with pytest.raises(GradingError, match="--out-of"):
        maximum(MOODLE)


NO_MAXIMUM = [
    (CANVAS, "50"),
    (CANVAS.replace("100.00", "0.00"), None),
    (MOODLE, "-1"),
    (CANVAS.replace("100.00", '"1,000"'), None),
]


def test_a_maximum_that_cannot_be_is_refused(snapshot):
    assert refused(GradingError, maximum, NO_MAXIMUM) == snapshot


TEXT = (ROOT / "docs" / "platforms.md").read_text(encoding="utf-8")


def test_each_option_that_it_names_is_there_and_each_that_is_there_is_named():
    command = typer.main.get_command(cli.app).commands["export"]
    there = {name for option in command.params for name in option.opts if name.startswith("--")}
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", TEXT))
    assert named <= there and there - named <= {"--solutions", "--help"}


@pytest.mark.parametrize("platform", ["Canvas", "Moodle", "Blackboard"])
def test_the_columns_of_its_commands_are_names_that_are_understood(platform):
    section = TEXT.split(f"## {platform}\n")[1].split("\n## ")[0]
    (asked, *others) = re.findall(r'--column "([^"]+)"', section)
    export = rules.recognised(read(FILES[platform]))
    assert all(export.column(one).place == export.column("Lab 3").place for one in (asked, *others))
