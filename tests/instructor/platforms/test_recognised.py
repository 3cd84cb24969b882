"""Which platform wrote a file, which of its columns takes marks, and what is refused of it."""

from __future__ import annotations

from decimal import Decimal

import pytest
from their_exports import BLACKBOARD, BRIGHTSPACE, CANVAS, FILES, MOODLE, WORKSHEET

from rotflex.errors import GradingError
from rotflex.instructor.platforms import recognised, rules
from rotflex.instructor.platforms.their_file import read

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
    with pytest.raises(GradingError) as error:
        export(CANVAS).column()
    assert "say which by --column. There is: 'Lab 3 (1234)', 'Quiz (99)'." in str(error.value)


@pytest.mark.parametrize(
    ("content", "asked", "why"),
    [
        (CANVAS, "Lab 4", "no column 'Lab 4', and none is made: Canvas decides what a new one would be"),
        (CANVAS, "Final Score", "Canvas has it as read only"),
        (CANVAS, "Notes", "it has no number in brackets"),
        (CANVAS.replace("Quiz (99)", "Final Score of Quiz (99)"), "99", "Canvas takes it for what it computes itself"),
        (CANVAS.replace("Quiz (99)", "Lab 3 (99)"), "Lab 3", "may be any of 'Lab 3 (1234)', 'Lab 3 (99)'"),
        (MOODLE, "Course total", "Moodle computes it"),
        (MOODLE, "Assignment: Lab 3 (Feedback)", "it is for words"),
        (MOODLE.replace("Lab 3 (Real)", "Lab 3 (Letter)"), "Assignment: Lab 3 (Letter)", "shows grades as letter"),
        (MOODLE.replace("Lab 3 (Real)", "Lab 3 (Percentage)"), "Assignment: Lab 3 (Percentage)", "as percentage"),
        (MOODLE, "Last downloaded from this course", "It has no column"),
        (WORKSHEET, "Maximum Grade", "stand under Grade"),
        (WORKSHEET.replace('"Maximum Grade"', "Scale"), "Grade", "graded by a scale"),
        (WORKSHEET.replace(",20.00,50.00", ",20.00,60.00"), "Grade", "different maximum grades"),
        (BLACKBOARD, "Essay", "its kind is Letter, and marks are a Score"),
        (BLACKBOARD, "123450", "Blackboard computes it"),
        (BLACKBOARD.replace("Score] |123456", "Score]"), "Lab 3 [Total Pts: 100 Score]", "a new column, worth 0"),
        (BRIGHTSPACE, "Mood", "its kind is Text Grade"),
        (BRIGHTSPACE.replace("<Numeric", "<PassFail"), "Lab 3", "its kind is PassFail"),
        (BRIGHTSPACE, "Calculated Final Grade Numerator", "Brightspace computes it"),
    ],
)
def test_a_column_that_takes_no_marks_is_refused_in_words(content, asked, why):
    with pytest.raises(GradingError) as error:
        export(content).column(asked)
    assert why in str(error.value)


def test_where_no_column_takes_marks_each_is_told_with_its_reason():
    only_text = "OrgDefinedId,Mood Text Grade <Text>,End-of-Line Indicator\n#1,x,#\n"
    with pytest.raises(GradingError, match=r"No column of it takes marks. 'Mood Text Grade <Text>': its kind is Text"):
        export(only_text).column()


@pytest.mark.parametrize("content", ["name,mark\nAda,1\n", "", "Vorname;Nachname;E-Mail-Adresse\nAda;L;a@x.org\n"])
def test_a_file_of_no_platform_is_refused_with_what_it_has_and_what_they_have(content):
    with pytest.raises(GradingError) as error:
        export(content)
    said = str(error.value)
    assert (content.replace(";", ",").split("\n")[0].split(",")[0] or "nothing") in said
    for heading in ("'Student', 'ID'", "'Identifier' and 'Grade'", "'Username'", "'End-of-Line Indicator'"):
        assert heading in said


def test_a_damaged_file_is_said_to_be_that():
    with pytest.raises(GradingError, match="line 2 is never closed"):
        export('Student,ID,Section,Lab (1)\nAda,"1,A,\n')


def test_semicolons_and_decimal_commas_are_understood():
    theirs = CANVAS.replace('"', "").replace(",", ";").replace("100.00", "100,00")
    assert export(theirs).column("1234").maximum == Decimal(100)
    assert export(MOODLE.replace(",", "\t")).platform == "Moodle"


def test_canvas_with_first_and_last_names_apart_and_without_sis_columns():
    head = "LastName,FirstName,ID,SIS Login ID,Section,Lab (1)\n    Points Possible,,,,,5\nLovelace,Ada,71,al,A,\n"
    found = export(head)
    assert found.column().maximum == 5 and [found.shown(row) for row in found.students] == ["al (Ada Lovelace, line 3)"]


# --- the maximum ------------------------------------------------------------------------------------------------------


def maximum(content, out_of=None, column="Lab 3"):
    found = export(content)
    return recognised.maximum(found.column(column), found.platform, None if out_of is None else Decimal(out_of))


def test_the_maximum_is_the_files_or_else_has_to_be_told():
    assert maximum(CANVAS) == 100 and maximum(CANVAS, "100.0") == 100 and maximum(MOODLE, "12.5") == Decimal("12.5")
    with pytest.raises(GradingError, match=r"does not say how many points .* say so by --out-of"):
        maximum(MOODLE)


@pytest.mark.parametrize(
    ("content", "out_of", "why"),
    [
        (CANVAS, "50", "is out of 100, and by --out-of it is 50"),
        (CANVAS.replace("100.00", "0.00"), None, "is out of 0 points: set its points on Canvas"),
        (MOODLE, "-1", "is out of -1 points"),
        (CANVAS.replace("100.00", '"1,000"'), None, "may be a thousand, or a number with decimals"),
    ],
)
def test_a_maximum_that_cannot_be_is_refused(content, out_of, why):
    with pytest.raises(GradingError, match=why):
        maximum(content, out_of)
