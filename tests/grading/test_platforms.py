"""Marks into the files of platforms: which file it is, whose row, what is written, and not another byte changed.

Python's csv is the other opinion on cells; the importers of Moodle and Canvas are written down here a second time.
"""

import codecs
import csv
import io
import math
import re
import zipfile
from dataclasses import replace
from datetime import UTC, datetime
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_courses import OURS
from their_exports import BLACKBOARD, BRIGHTSPACE, CANVAS, FILES, MOODLE, WORKSHEET, class_of_four

from labcourse.errors import GradingError
from labcourse.grading import feedback_zip, platforms
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.platforms import SEPARATORS, Earned, table
from labcourse.grading.settings import FeedbackSettings, MarkSettings

WORKSHEETS = "Moodle's grading worksheet"


def export(content):
    return platforms.read(content if isinstance(content, bytes) else content.encode())


# --- cells ------------------------------------------------------------------------------------------------------------

CELL = st.text(st.sampled_from('ab "",;\t\r\n\'=#é学\x0b\u2028'), max_size=8)
CODECS = [
    (b"", "utf-8"),
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
]


@st.composite
def files(draw):
    """Bytes of a file that some program wrote, its separator, its text, and how long its byte-order mark is."""
    separator = draw(st.sampled_from(SEPARATORS))
    text = ""
    for _ in range(draw(st.integers(0, 5))):
        cells = draw(st.lists(st.tuples(CELL, st.booleans()), max_size=4))
        ends = draw(st.sampled_from(["\r\n", "\n", "\r"]))
        text += separator.join(written(cell, quoted, separator) for cell, quoted in cells) + ends
    if draw(st.booleans()):
        text += written(draw(CELL), True, separator)  # no line end behind the last line
    mark, codec = draw(st.sampled_from(CODECS))
    return mark + text.encode(codec), separator, text, codec, mark


def written(cell, quoted, separator):
    must = any(sign in cell for sign in (separator, '"', "\r", "\n"))
    return '"' + cell.replace('"', '""') + '"' if quoted or must else cell


def by_csv(text, separator):
    return list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))


@given(files(), CELL.filter(bool), st.data())
def test_cells_are_those_of_pythons_csv_and_one_change_changes_that_cell_and_no_other_byte(file, new, data):
    content, separator, text, codec, mark = file
    there = table(content, separator)
    expected = by_csv(text, separator)
    assert [[cell.text for cell in row] for row in there.rows] == expected and there.changed({}) == content
    if not any(expected):
        return
    row, place = data.draw(
        st.sampled_from([(row, place) for row, cells in enumerate(expected) for place in range(len(cells))])
    )
    changed = there.changed({(row, place): new}).removeprefix(mark).decode(codec)
    expected[row][place] = new
    assert by_csv(changed, separator) == expected
    cell, before = there.rows[row][place], len(there.text) - len(text)
    assert changed.startswith(text[: cell.start - before]) and changed.endswith(text[cell.end - before :])


def test_quotes_lines_and_bytes_stay_as_they_are():
    there = table(b'"a",b,c\n', ",")
    assert there.changed({(0, 0): "1"}) == b'"1",b,c\n'
    assert there.changed({(0, 1): "1.5", (0, 2): "1,5"}) == b'"a",1.5,"1,5"\n'
    several = table(b'a,"x\r\ny"\r\rb\n', ",")
    assert [several.line(row) for row in (0, 2)] == [1, 4]
    not_utf_8 = "Jürgen,1\r\n".encode("cp1252")
    assert table(not_utf_8, ",").changed({(0, 1): "2"}) == "Jürgen,2\r\n".encode("cp1252")
    for codec in ("utf-16-le", "utf-16-be"):  # without a byte-order mark
        assert table("Name\tÜ\r\n".encode(codec), "\t").changed({(0, 0): "x"}) == "x\tÜ\r\n".encode(codec)


# --- which file, and which column -------------------------------------------------------------------------------------

#: Platform → how its column may be called, whole heading first; its maximum; lines of its students.
COLUMNS = {
    "Canvas": (("Lab 3 (1234)", "lab 3", "1234"), Decimal(100), [4, 5, 6, 7]),
    "Moodle": (("Assignment: Lab 3 (Real)", "Assignment: Lab 3", "Lab 3"), None, [2, 4, 5, 6]),
    WORKSHEETS: (("Grade", "grade"), Decimal(50), [2, 3, 4, 5]),
    "Blackboard": (("Lab 3 [Total Pts: 100 Score] |123456", "Lab 3", "123456"), Decimal(100), [2, 3, 4, 5]),
    "Brightspace": (
        ("Lab 3 Points Grade <Numeric MaxPoints:20 Weight:10 Category:Labs CategoryWeight:30>", "LAB  3"),
        Decimal(20),
        [2, 3, 4, 5],
    ),
}


@pytest.mark.parametrize("platform", FILES)
def test_a_file_is_known_by_its_headings_and_its_column_by_each_of_its_names(platform):
    names, maximum, lines = COLUMNS[platform]
    found = export(FILES[platform])
    assert found.platform.name == platform
    assert [found.table.line(row) for row in found.students] == lines
    assert {found.column(name).heading for name in names} == {names[0]}
    out_of = None if maximum else 12.5
    assert found.maximum(found.column(names[0]), out_of) == (maximum or out_of)
    if platform in (WORKSHEETS, "Blackboard", "Brightspace"):
        assert found.column().heading == names[0]  # the only one need not be named


NO_MARKS = [
    *((CANVAS, asked) for asked in ("Lab 4", "Final Score", "Notes")),
    (CANVAS.replace("Quiz (99)", "Final Score of Quiz (99)"), "99"),
    (CANVAS.replace("100.00", "(read only)"), "Lab 3"),
    *(
        (MOODLE, asked)
        for asked in ("Course total", "Assignment: Lab 3 (Feedback)", "Last downloaded from this course")
    ),
    (MOODLE.replace("Lab 3 (Real)", "Lab 3 (Letter)"), "Assignment: Lab 3 (Letter)"),
    (WORKSHEET, "Maximum Grade"),
    (WORKSHEET.replace('"Maximum Grade"', "Scale"), "Grade"),
    (WORKSHEET.replace(",20.00,50.00", ",20.00,60.00"), "Grade"),
    (BLACKBOARD, "Essay"),
    (BLACKBOARD, "123450"),
    (BRIGHTSPACE, "Mood"),
    (BRIGHTSPACE.replace("<Numeric", "<PassFail"), "Lab 3"),
    (BRIGHTSPACE, "Calculated Final Grade Numerator"),
]
NO_FILES = [
    ("name,mark\nAda,1\n", "'name', 'mark'"),
    ("", "nothing"),
    (b"PK\x03\x04rest", "rest"),
    ('Student,ID,Section,Lab (1)\nAda,"1,A,\n', "line 2"),
    (codecs.BOM_UTF16_LE + b"a\0b", "UTF-16-LE"),
]


@pytest.mark.parametrize(("content", "asked"), NO_MARKS)
def test_a_column_that_takes_no_marks_is_refused_by_name(content, asked):
    with pytest.raises(GradingError, match=re.escape(f"no column {asked!r} that takes points")):
        export(content).column(asked)


@pytest.mark.parametrize(("content", "asked"), [(CANVAS, None), (CANVAS.replace("Quiz (99)", "Lab 3 (99)"), "Lab 3")])
def test_of_several_columns_one_has_to_be_named(content, asked):
    with pytest.raises(GradingError, match=r"Several columns.*'Lab 3 \(1234\)', '\w+ 3? ?\(99\)'"):
        export(content).column(asked)


@pytest.mark.parametrize(
    ("content", "file", "own", "other"),
    [
        (CANVAS, "grades", "Lab 03", ""),
        (CANVAS, "Lab 02", "Lab 03", ""),  # the heading says more than the file's name
        (CANVAS, "grades", "Lab 02", "Lab 03"),
        (CANVAS, "grades", "", "Lab 03"),  # all that counts
        (CANVAS.replace("Lab 3 (1234)", "Lab 30 (1234)"), "grades", "Lab 02", ""),
        (CANVAS.replace("Lab 3 (1234)", "Lab 3 report (1234)"), "grades", "Lab 03", "Lab 03 report"),
        (WORKSHEET, "Grades-LAB-Lab 03-77", "Lab 02", "Lab 03"),
        (WORKSHEET, "grades", "Lab 02", "Lab 03"),  # is out of 50
        (WORKSHEET, "grades", "Lab 03", ""),
        (WORKSHEET.replace("50.00", "100.00"), "grades", "Lab 02", ""),
    ],
)
def test_a_column_of_another_assignment_is_known_by_its_title_or_its_maximum(content, file, own, other):
    found = export(content)
    column = found.columns[0]
    maxima = {"Lab 02": Fraction(20), "Lab 03": Fraction(50), "Lab 03 report": Fraction(10)}
    assert platforms.misplaced(maxima, own, column, found.maximum(column), file) == other


def maximum(content, out_of):
    found = export(content)
    return found.maximum(found.column("Lab 3"), out_of)


@pytest.mark.parametrize(
    ("content", "out_of"),
    [(CANVAS, 50), (CANVAS.replace("100.00", "0.00"), None), (MOODLE, None), (MOODLE, -1), (MOODLE, math.nan)],
)
def test_what_a_column_is_out_of_is_one_number_above_0(content, out_of):
    with pytest.raises(GradingError, match=re.escape(f"--out-of says {out_of or 'nothing'}")):
        maximum(content, out_of)


@pytest.mark.parametrize(("content", "said"), NO_FILES)
def test_a_file_of_no_platform_is_refused(content, said):
    with pytest.raises(GradingError, match=said):
        export(content)


def test_other_forms_of_the_files_are_understood():
    semicolons = CANVAS.replace('"', "").replace(",", ";").replace("100.00", "100,00")
    assert maximum(semicolons, None) == 100 and export(MOODLE.replace(",", "\t")).platform.name == "Moodle"
    without_a_heading = export(
        "".join(f"{line},{n}\n" for n, line in enumerate(BRIGHTSPACE.splitlines())).replace("Indicator,0", "Indicator,")
    )
    assert without_a_heading.column().heading == COLUMNS["Brightspace"][0][0]
    head = "LastName,FirstName,ID,SIS Login ID,Section,Lab (1)\n    Points Possible,,,,,5\nLovelace,Ada,71,al,A,\n"
    found = export(head)
    assert found.maximum(found.column()) == 5
    assert [found.described(row) for row in found.students] == ["al (Ada Lovelace, line 3)"]


# --- whose row --------------------------------------------------------------------------------------------------------

ADA = StudentRecord("s1001", "Ada Lovelace", "ada@x.org", aliases=("alovelace", "71", "Participant 501"))
BOB = StudentRecord("s1002", "Bob O'Neil", "bob@x.org", aliases=("boneil", "72", "Participant 502"))


def match(content, *students):
    """Line → student, and line → why it is nobody's."""
    found = export(content)
    matches = platforms.match(found, students)
    lines = {found.table.line(row): one.student for row, one in matches.students.items()}
    return lines, {found.table.line(row): why for row, why in matches.refused.items()}


@pytest.mark.parametrize(
    ("content", "student", "line"),
    [
        (BRIGHTSPACE, {"student": "S1001"}, 2),
        (BRIGHTSPACE, {"student": "x", "email": "ADA@x.org"}, 2),
        (CANVAS, {"student": "x", "aliases": ("alovelace",)}, 4),
        (CANVAS, {"student": "x", "name": "Ada Lovelace"}, None),  # a name finds nobody
        (CANVAS, {"student": "71", "name": "A. Lovelace"}, 4),  # Canvas's own number, and nothing against it
        (CANVAS, {"student": "71", "name": "Otto Other"}, None),  # by chance another's ID
        ("Identifier,Full name,Grade,Maximum Grade\nParticipant 501,,,50\n", vars(ADA), 2),  # blind marking
    ],
)
def test_each_thing_that_a_student_is_known_by_finds_them_and_nothing_else(content, student, line):
    one = StudentRecord(
        **{key: value for key, value in student.items() if key in ("student", "name", "email", "aliases")}
    )
    assert match(content, one)[0] == ({line: one.student} if line else {})


def test_what_may_be_of_several_is_nobodys_and_the_reason_is_given():
    both = (ADA, replace(BOB, aliases=("alovelace",)))
    assert match(CANVAS, *both) == ({5: "s1002"}, {4: "it may be one or another: s1001, s1002."})
    twice = WORKSHEET + '"Participant 900","Ada L.",ada@x.org,,,50.00,Yes,-,-,\n'
    lines, refusals = match(twice, ADA, BOB)
    assert refusals == dict.fromkeys((2, 6), "several lines lead to 's1001'.") and "s1001" not in lines.values()
    assert "who has another name" in match(CANVAS, StudentRecord("71", "Otto Other"))[1][4]
    assert match(CANVAS, StudentRecord("71", "Otto Other"), ADA)[0] == {4: "s1001"}  # an ID leads to somebody else


@pytest.mark.parametrize("platform", ["Moodle", "Brightspace"])
def test_a_participants_number_hides_no_other_students_id(platform):
    both = (StudentRecord("x", "Xenia Xu", aliases=("Participant 1001",)), StudentRecord("1001", "Ada Lovelace"))
    assert match(FILES[platform].replace(b"s1001", b"1001"), *both) == ({2: "1001"}, {})


# --- what is written --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    with Gradebook(class_of_four(tmp_path_factory.mktemp("class"))) as opened:
        yield opened


def fill(book, content, out_of=None, have=None, **choice):
    """The file's bytes, what became of each cell, and the summary."""
    found = export(content)
    column = found.column("Grade" if found.platform.name == WORKSHEETS else "Lab 3")
    matches = platforms.match(found, book.students())
    marks = platforms.earned(book, OURS) | (have or {})
    data, entries = platforms.fill(
        found, column, found.maximum(column, out_of), matches, marks, **{"decimals": 2} | choice
    )
    return data, entries, platforms.summary(found, entries, matches)


#: Platform → what is replaced in its text, once each. ada: 2.5/3, bob: 1.2/3; cleo waits, eve has nothing.
DIFFERENCES = {
    "Canvas": ('twice",,8', 'twice",83.33,8'),
    "Moodle": ('ada@x.org,-,"Well', 'ada@x.org,83.33,"Well'),
    WORKSHEETS: ('grading - ",,50.00,Yes,"Monday', 'grading - ",41.67,50.00,Yes,"Monday'),
    "Blackboard": ('"Needs Grading"', '"83.33"'),
    "Brightspace": ("ada@x.org,,", "ada@x.org,16.67,"),
}


#: Platform → whom the gradebook does not have, and whether s1004 is not in the file.
UNKNOWN = {
    "Canvas": ("", False),
    "Moodle": ("Zoe", True),
    WORKSHEETS: ("", False),
    "Blackboard": ("", False),
    "Brightspace": ("#s3000 (Ann, or An Other, line 5)", True),
}


@pytest.mark.parametrize("platform", FILES)
def test_one_column_is_filled_and_not_another_byte_changes(book, platform):
    data, entries, summary = fill(book, FILES[platform], 100 if platform == "Moodle" else None)
    before, after = DIFFERENCES[platform]
    codec = "utf-16-le" if platform == "Blackboard" else "utf-8"
    assert FILES[platform].count(before.encode(codec)) == 1
    assert data == FILES[platform].replace(before.encode(codec), after.encode(codec))
    bob = entries["s1002"]  # 1.2 of 3 is 40 of 100, 20 of 50 and 8 of 20: "40.00" is that already
    assert bob.after == bob.before and not bob.waits and entries["s1003"].waits
    assert [int(word) for word in summary[0].replace("(", "").split() if word.isdigit()][:3] == [1, 0, 1]
    unknown, missing = UNKNOWN[platform]
    assert any("not in the gradebook" in line and unknown in line for line in summary) == bool(unknown)
    assert ("In the gradebook, and not in the file: s1004" in summary) == missing
    assert "s1003: left; still waits for a person: 2.11 explanation." in summary


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (WORKSHEET, "Moodle.*No"),
        (BLACKBOARD, "In Progress"),
        (CANVAS.replace(",EX,", ",good,"), "'good'"),
        (CANVAS.replace(",EX,,,", ""), "line 7"),
        (CANVAS.replace(",EX,", ",,"), "nothing handed in."),
    ],
)
def test_a_cell_that_is_not_ours_to_fill_is_left_with_the_reason(book, content, why):
    left = fill(book, content)[1]["s1004"]
    assert left.after is None and re.search(why, left.remark)


def test_a_column_of_letters_is_refused(book):
    with pytest.raises(GradingError, match="'B-'"):
        fill(book, CANVAS.replace(",40.00,", ",B-,"))


def test_a_mark_that_replaces_another_and_one_of_unfinished_work_are_listed(book):
    data, _entries, summary = fill(book, WORKSHEET.replace(",20.00,50.00", ",19.5,50.00"))
    assert "1 replaced: s1002: 19.5 → 20" in summary and b",20,50.00,Yes" in data
    data, entries, _summary = fill(book, CANVAS, unfinished=True)
    assert b'"Lab A, Lab B",,66.67,9' in data and entries["s1003"].waits
    assert entries["s1003"].remark == "still waits for a person: 2.11 explanation."


def test_a_mark_above_the_maximum_is_refused_for_all_at_once_unless_it_is_to_be_cut(book):
    much = {"s1001": Earned(Fraction(11, 10)), "s1003": Earned(Fraction(21, 20))}
    with pytest.raises(GradingError, match="s1001: 110, s1003: 105"):
        fill(book, CANVAS, have=much)
    data, entries, _summary = fill(book, CANVAS, have=much, cap=True)
    assert b'twice",100,8' in data and not entries["s1001"].waits and "110" in entries["s1001"].remark
    theirs, all_of_it = CANVAS.replace("100.00", "99.50"), {"s1001": Earned(Fraction(1))}
    with pytest.raises(GradingError, match=r"s1001: 100.*more --decimals"):  # by rounding alone
        fill(book, theirs, have=all_of_it, decimals=0)
    assert b'twice",99.5,8' in fill(book, theirs, have=all_of_it, decimals=1)[0]


def test_decimals_have_a_comma_where_the_files_have_one(book):
    theirs = CANVAS.replace("100.00", '"100,00"').replace("10.00", '"10,00"').replace("40.00", '"40,00"')
    assert by_csv(fill(book, theirs)[0].decode(), ",")[3][6] == "83,33"


def test_what_is_earned_follows_the_settings(book):
    def of(*drop):
        course = replace(OURS, settings=replace(OURS.settings, marks=MarkSettings(drop)))
        return {student: tuple(one)[:2] for student, one in platforms.earned(book, course).items()}

    assert of() == {
        "s1001": (Fraction(5, 6), ""),
        "s1002": (Fraction(2, 5), ""),
        "s1003": (Fraction(2, 3), "still waits for a person: 2.11 explanation."),
        "s1004": (None, "nothing handed in."),
    }
    assert of("2.11 explanation")["s1003"] == (1, "") and of("2.11")["s1001"] == (None, "it is out of no points.")


# --- feedback pages ---------------------------------------------------------------------------------------------------


def places(book, content, submissions=()):
    found = export(content)
    return feedback_zip.places(found, platforms.match(found, book.students()), submissions)


def moodles_importer(path, participants):
    """Whose a file in the zip is, and what it is called then, as Moodle's importer has it (since 2.x)."""
    parts = path.split("/")
    while parts:
        info = parts.pop(0).split("_", 4)
        if len(info) < 4 or not info[1].isdigit() or int(info[1]) not in participants:
            continue
        assert info[2:4] == ["assignsubmission", "file"]  # a plugin that every Moodle has
        return participants[int(info[1])], "/".join([info[4] if len(info) > 4 else "", *parts]).strip("/")
    return None


def canvass_importer(path, files):
    """Whose a file in the zip is, and what it is shown as, as Canvas's importer has it."""
    numbers = [one for one in path.rsplit("/", 1)[-1].split("_") if one.isdigit()][:2]
    return files.get(tuple(map(int, numbers)))


def test_moodle_takes_each_page_for_the_participant_whose_it_is(book):
    paths, _without = places(book, WORKSHEET)
    participants = {501: "s1001", 502: "s1002", 503: "s1003", 504: "s1004"}
    found = {student: moodles_importer(path, participants) for student, path in paths.items()}
    assert found == {student: (student, "feedback.html") for student in participants.values()}


@pytest.mark.parametrize("name", ["Ada_99_Love", "../../Ada", 'Ada: "x" <y>|?*', ". .", "Ada\\Love"])
def test_no_name_leads_astray_or_out_of_the_folder(book, name):
    quoted = '"' + name.replace('"', '""') + '"'
    path = places(book, WORKSHEET.replace('"Ada Lovelace"', quoted))[0]["s1001"]
    assert moodles_importer(path, {501: "s1001", 99: "another"}) == ("s1001", "feedback.html")
    assert path.count("/") == 1 and not path.startswith(".") and not set(path) & set('\\:*?"<>|')


def test_canvas_gets_the_newest_names_of_its_own_download(book):
    handed_in = ["lovelaceada_71_9001_lab.zip", "lovelaceada_LATE_71_9005_lab-1.zip", "oneilbob_72_9002_report.ipynb"]
    paths, without = places(book, FILES["Canvas"], [*handed_in, "strangerann_88_9003_lab.zip", "__MACOSX/readme.txt"])
    assert paths == {"s1001": "lovelaceada_LATE_71_9005_lab-1.zip"}
    assert canvass_importer(paths["s1001"], {(71, 9005): ("s1001", "lab-1.zip")}) == ("s1001", "lab-1.zip")
    assert "would show the page as 'oneilbob_72_9002_report.ipynb'" in without["s1002"]
    assert without["s1003"] == "nothing of theirs is in the download of submissions."


def test_brightspace_gets_folders_with_names_that_are_one_students_only(book):
    ada = [f"12345-601 - Ada Lovelace - Mar {day}, 2026 905 AM/lab.zip" for day in (2, 3)]
    bob = "12345-602 - Bob O'Neil - Mar 2, 2026 105 PM"
    paths, without = places(book, FILES["Brightspace"], ["index.html", *ada, f"{bob}/lab.zip"])
    assert paths == {
        "s1001": "12345-601 - Ada Lovelace - Mar 3, 2026 905 AM/feedback.html",
        "s1002": f"{bob}/feedback.html",
    }
    assert without == {"s1003": "no folder of the download bears their name."}
    namesake = FILES["Brightspace"].decode().replace('Other,"Ann, or An"', "Lovelace,Ada").encode()
    other_section = "12345-777 - Ada Lovelace - Mar 3, 2026 905 AM/lab.zip"
    for content, more in ((namesake, []), (FILES["Brightspace"], [other_section])):
        paths, without = places(book, content, [*ada, *more, f"{bob}/lab.zip"])
        assert list(paths) == ["s1002"] and "several students" in without["s1001"]


@pytest.mark.parametrize(
    ("platform", "why"), [("Moodle", "grading worksheet"), ("Blackboard", "Blackboard"), ("Canvas", "--submissions")]
)
def test_what_a_platform_does_not_take_is_refused(book, platform, why):
    with pytest.raises(GradingError, match=why):
        places(book, FILES[platform])


def test_the_zip_has_the_pages_of_the_report_and_a_zip_where_a_zip_was(book, tmp_path):
    paths = {"s1001": "a_71_1_lab.zip", "s1002": "b/feedback.html", "s1004": "c"}
    record = tmp_path / "record"
    data, new, messages = feedback_zip.pack(book, OURS, paths, {"x": "why."}, record, False)
    record.write_bytes(new)
    assert feedback_zip.pack(book, OURS, paths, {"x": "why."}, record, False)[0] == data  # asked twice, the same
    assert messages == [
        "2 pages of feedback in the zip.",
        "x: no page; why.",
        "s1004: no page; nothing of theirs is graded.",
    ]
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert archive.namelist() == ["a_71_1_lab.zip", "b/feedback.html"] and archive.testzip() is None
    inner = zipfile.ZipFile(io.BytesIO(archive.read("a_71_1_lab.zip")))
    assert inner.namelist() == ["feedback.html"] and b"Half of it." in inner.read("feedback.html")
    assert b"Half of it." not in archive.read("b/feedback.html")
    later = replace(OURS.settings, feedback=FeedbackSettings(opens=datetime(2999, 1, 1, tzinfo=UTC)))
    with pytest.raises(GradingError, match="2999-01-01"):
        feedback_zip.pack(book, replace(OURS, settings=later), paths, {}, record, False)
    (tmp_path / "x.zip").write_bytes(b"no")
    with pytest.raises(GradingError, match=r"x\.zip"):
        feedback_zip.names_in(tmp_path / "x.zip")


def test_the_zip_has_pages_that_changed_since_they_were_packed_and_given_back_or_all(tmp_path):
    record, paths = tmp_path / "record", {"s1001": "a/feedback.html", "s1002": "b/feedback.html"}

    def packed(all_pages=False):
        data, new, _messages = feedback_zip.pack(book, OURS, paths, {}, record, all_pages)
        record.write_bytes(new)
        return zipfile.ZipFile(io.BytesIO(data)).namelist() if data else []

    with Gradebook(class_of_four(tmp_path)) as book:
        book.publish("anna")
        assert packed() == ["a/feedback.html", "b/feedback.html"]
        book.publish("anna")
        assert packed() == [] and packed(all_pages=True) == ["a/feedback.html", "b/feedback.html"]
        book.set_mark("s1002", "2.11", "explanation", 0.5, reason="Half of it, too.", actor="anna")
        assert packed() == ["b/feedback.html"]
        book.publish("anna")
        assert packed() == []
