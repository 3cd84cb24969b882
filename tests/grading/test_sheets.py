"""The four scoring sheets: their layout, what stands in a cell, and that text in them is text."""

import csv
import io
import json
import random
from copy import copy
from dataclasses import replace

import marked_class
import pytest
from accessible import findings
from checkout import ROOT
from gradebooks import enrol
from made_courses import OURS
from refused import refused

from labcourse.errors import GradingError
from labcourse.grading import sheets
from labcourse.grading.gradebook import Gradebook, MarkRecord, StudentRecord
from labcourse.grading.outcomes import standing
from labcourse.grading.settings import MarkSettings

LAYOUTS = {one.name: one for one in sheets.read_layouts(OURS.folder, OURS.catalogue)}


ADA = StudentRecord("ada", "Ada L.", "", "B")


def sheet(name, *marks, about=ADA):
    one = standing(about, marks, OURS.catalogue, MarkSettings())
    return sheets.fill(LAYOUTS[name], one, OURS.settings.levels)


def cell(name, row, code, *marks):
    (cells,) = [cells for line, cells in sheet(name, *marks).rows if line.number == row]
    return cells.get(code)


FAULTS = [
    '[x]\ntitle = "X"\nsection = "7"\ncodes = ["A-1"]',
    '[x]\ntitle = "X"\nreport = "No"\ncodes = ["A-1"]',
    '[x]\ntitle = "X"\ncodes = ["A-1"]',
    '[x]\ntitle = "X"\nsection = "2.2"\ncodes = ["Z-1"]',
    '[x]\ntitle = "X"\nsection = "2.2"\ncodes = ["A-1"]\nrows = 3',
    '["a/b"]\ntitle = "X"\nsection = "2.2"\ncodes = ["A-1"]',
    '[x]\ntitle = "X"\nreport = "Modeling report"\ncodes = []\nalso = {"I.9" = ["2.1"]}',
    '[x]\ntitle = "X"\nreport = "Modeling report"\ncodes = []\nalso = {"I.1" = ["9.9"]}',
    '[x]\ntitle = "X"\nreport = "Modeling report"\ncodes = ["K-1"]\nalso = {"I.1" = ["2.18"], "I.2" = ["2.18"]}',
]


def test_a_fault_in_the_layout_is_told(tmp_path, snapshot):
    catalogue = copy(OURS.catalogue)
    catalogue.whole = catalogue  # without optional notebooks, so that messages name none of their questions

    def read(text):
        (tmp_path / "sheets.toml").write_text(text, encoding="utf-8")
        sheets.read_layouts(tmp_path, catalogue)

    assert refused(GradingError, read, FAULTS, tmp_path) == snapshot


@pytest.mark.parametrize("content", [None, "[x"])
def test_a_course_without_sheets_or_with_a_file_that_cannot_be_read_says_so(tmp_path, content):
    if content:
        (tmp_path / "sheets.toml").write_text(content, encoding="utf-8")
    with pytest.raises(GradingError, match=r"sheets\.toml"):
        sheets.read_layouts(tmp_path, OURS.catalogue)


MACHINE = MarkRecord("3.6", "controllable", "right", 1, 1, "")
PERSON = MarkRecord("3.6", "explanation", "given by a person", 0.5, 1, "")
WAITING = MarkRecord("3.6", "explanation", "for a person", 0, 1, "")


@pytest.mark.parametrize(
    ("marks", "level", "points", "by"),
    [
        ([MACHINE, PERSON], "3", ["1/1 m", "0.5/1 p"], "m+p"),
        ([MACHINE, WAITING], "4 …", ["1/1 m", "…/1"], "m"),
        ([WAITING], "…", ["…/1"], ""),
        ([PERSON], "2", ["0.5/1 p"], "p"),
        ([MarkRecord("3.6", "explanation", "missing", 0, 1, "")], "0", ["0/1 m"], "m"),
        ([MarkRecord("3.6", "explanation", "given by a person", 0.25, 1, "")], "1", ["0.25/1 p"], "p"),
        ([MarkRecord("3.6", "controllable", "not marked: key fault", 0, 1, "")], "…", ["…/1"], ""),
    ],
)
def test_a_cell_says_level_points_whose_they_are_and_what_waits(marks, level, points, by):
    found = cell("control_report", "III.1", "B-7", *marks)
    assert (found.level_text, found.points_texts, found.by) == (level, points, by)


def test_a_sheet_of_a_made_up_student_is_what_it_is_by_hand():
    found = sheet(
        "modeling_prelab",
        MarkRecord("2.1", "V", "right", 2, 2, ""),
        MarkRecord("2.3", "L", "wrong", 0, 1, ""),
        MarkRecord("2.4", "strategy", "given by a person", 0.75, 1, ""),
        MarkRecord("2.4", "equation", "partly right", 1, 2, ""),
        MarkRecord("2.5", "strategy", "for a person", 0, 1, ""),
        MarkRecord("2.11", "omega_n", "right", 2, 2, ""),  # on another sheet
    )
    rows = list(csv.reader(io.StringIO(sheets.table(found))))
    assert rows[0] == [
        *("row", "heading"),
        *(f"{code} {what}" for code in ("A-1", "A-2", "A-3") for what in ("level", "earned", "out of", "by")),
    ]
    none = [""] * 4
    assert rows[1:] == [
        ["2.1", "Potential energy", *none, "4", "2", "2", "m", *none],
        ["2.2", "Kinetic energy", *none, *none, *none],
        ["2.3", "Lagrangian", *none, "0", "0", "1", "m", *none],
        ["2.4", "Equation of motion of the servo", "3", "0.75", "1", "p", "2", "1", "2", "m", *none],
        ["2.5", "Equation of motion of the link", "…", "", "1", "", *none, *none],
        ["2.6", "Angular accelerations", *none, *none, *none],
        ["2.7", "State-space matrices", *none, *none, *none],
        ["2.8", "Inertia of the link", *none, *none, *none],
        ["total", "3.75 of 6 points; 1 of 7 wait", "3 …", "0.75", "2", "p", "2", "3", "5", "m", *none],
    ]


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    with Gradebook(marked_class.gradebook(folder, {"A": 2})) as opened:
        enrol(opened, folder, ("eve", "Eve", "", ""))
        yield opened


def test_each_student_has_four_sheets_in_three_forms_and_the_class_one_table(book, tmp_path):
    count, notes = sheets.write(tmp_path / "out", OURS, book)
    missing = ["On no sheet, as no row and code has it: 3.8 K.", "Without marks, and so without sheets: eve."]
    assert (count, notes) == (2, missing)
    for student in ("a-00", "a-01"):
        names = {path.name for path in (tmp_path / "out" / "sheets" / student).iterdir()}
        assert names == {f"{name}.{form}" for name in LAYOUTS for form in ("html", "pdf", "csv")}
    assert all(path.read_bytes().startswith(b"%PDF-") for path in (tmp_path / "out").rglob("*.pdf"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "out" / "sheets.csv").read_text(encoding="utf-8"))))
    for graded in book.all_current():
        mine = [row for row in rows if row["student"] == graded.run.student and row["row"] == "total"]
        marks = [mark for mark in graded.marks if mark.where != ("3.8", "K")]
        decided = [mark for mark in marks if mark.status != "for a person"]
        assert sum(float(row["out of"]) for row in mine) == pytest.approx(sum(mark.out_of for mark in marks))
        assert sum(float(row["decided"]) for row in mine) == pytest.approx(sum(mark.out_of for mark in decided))
        assert sum(float(row["earned"]) for row in mine) == pytest.approx(sum(m.points for m in decided), abs=0.2)
        assert sum(int(row["parts that wait"]) for row in mine) == len(marks) - len(decided)


def test_some_students_sheets_alone_and_without_what_is_dropped(book, tmp_path):
    dropped = replace(OURS, settings=replace(OURS.settings, marks=MarkSettings(drop=("2.11",))))
    count, notes = sheets.write(tmp_path / "out", dropped, book, ["A-01"])
    assert count == 1 and [path.name for path in (tmp_path / "out" / "sheets").iterdir()] == ["a-01"]
    assert "Dropped by course.toml, and on no sheet: 2.11." in notes
    text = (tmp_path / "out" / "sheets.csv").read_text(encoding="utf-8")
    found = {(row["sheet"], row["row"], row["code"]): row for row in csv.DictReader(io.StringIO(text))}
    assert found["modeling_report", "III.1", "B-7"]["out of"] == "4"  # 2.12 with 3 points, and the report's text with 1


def test_an_unknown_student_and_a_folder_that_cannot_be_written_are_refused(book, tmp_path):
    with pytest.raises(GradingError, match="no student 'zoe'"):
        sheets.write(tmp_path / "out", OURS, book, ["a-00", "zoe"])
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").write_text("a file")
    with pytest.raises(GradingError, match="/out"):
        sheets.write(tmp_path / "out", OURS, book, ["a-00"])


HOSTILE = [
    "<script>alert(1)</script>",
    '#panic("no")',
    "$ integral $ *bold* _em_ @label // comment \\",
    '=HYPERLINK("http://x")',
    '"); #read("/etc/passwd")',
    "\x1b[31mred\u202egpj",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_is_text_in_page_pdf_and_table(name):
    """The last name's letters are no text of anybody; typst has the others as they are."""
    import typst

    found = sheet("modeling_prelab", MACHINE, about=StudentRecord("ada", name, "", name))
    values = sheets.content(found, OURS)
    page = sheets.as_page(values)
    assert "<script" not in page and "\x1b" not in page and "\u202e" not in page
    assert sheets.as_pdf(values).startswith(b"%PDF-")
    source = (ROOT / "labcourse/grading/templates/sheet.typ").read_bytes() + b"\n#metadata(sheet.who) <who>"
    told = json.loads(typst.query(source, "<who>", field="value", one=True, sys_inputs={"sheet": json.dumps(values)}))
    assert told[0][1] == (name if name.isprintable() else "\\x1b[31mred\\u202egpj")
    rows = list(
        csv.reader(io.StringIO(sheets.class_table([sheet("control_report", MACHINE, about=found.standing.about)])))
    )
    assert rows[1][1].startswith("'=" if name.startswith("=") else name[0] if name[0].isprintable() else "\\x1b")


@pytest.mark.parametrize("name", list(LAYOUTS))
def test_a_pdf_is_one_page_on_which_every_student_draws_something_else(name):
    full = sheets.content(sheet(name, *marked_class.marks(random.Random(5))), OURS)
    pictures = {sheets.as_pdf({**full, **other}, format="png", ppi=40) for other in ({}, {"total": "another"})}
    assert len(pictures) == 2 and all(one.startswith(b"\x89PNG") for one in pictures)


def test_the_page_loads_nothing_fits_and_can_be_read(chromium, tmp_path):
    widest = max(LAYOUTS.values(), key=lambda layout: len(layout.columns))
    text = sheets.as_page(sheets.content(sheet(widest.name, *marked_class.marks(random.Random(4))), OURS))
    assert "default-src 'none'" in text and "<script" not in text and "http" not in text.replace("http-equiv", "")
    assert "m: marked by the machine. p: marked by a person." in text
    (tmp_path / "sheet.html").write_text(text, encoding="utf-8")
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.goto((tmp_path / "sheet.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280 and findings(page) == []
