"""The four scoring sheets: their layout, what stands in a cell, that text in them is text, and how they are printed."""

import html
import random
import re
from dataclasses import replace

import marked_class
import pypdfium2
import pytest
from accessible import findings
from gradebooks import enrol
from made_courses import OURS

from labcourse.errors import GradingError
from labcourse.grading import sheets
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.outcomes import standing
from labcourse.grading.settings import MarkSettings

LAYOUTS = {one.title: one for one in sheets.read_layouts(OURS.folder, OURS.catalogue)}
PRELAB, MODELING, _PRELAB, CONTROL = LAYOUTS


ADA = StudentRecord("ada", "Ada L.", "", "B")


def sheet(title, *marks, about=ADA):
    one = standing(about, marks, OURS.catalogue, MarkSettings())
    return sheets.fill(LAYOUTS[title], one, OURS.settings.levels)


def cell(title, row, code, *marks):
    (cells,) = [cells for line, cells in sheet(title, *marks).rows if line.number == row]
    return cells.get(code)


#: The entries of a sheet → the place that the message names.
FAULTS = [
    ('section = "7"\ncodes = ["A-1"]', "x.section"),
    ('report = "No"\ncodes = ["A-1"]', "x.report"),
    ('codes = ["A-1"]', "x"),
    ('section = "2.2"\ncodes = ["Z-1"]', "x.codes"),
    ('section = "2.2"\ncodes = ["A-1"]\nrows = 3', "x.rows"),
    ('report = "Modeling report"\ncodes = []\nalso = {"I.9" = ["2.1"]}', "x.also"),
    ('report = "Modeling report"\ncodes = []\nalso = {"I.1" = ["9.9"]}', "x.also, questions"),
    ('report = "Modeling report"\ncodes = ["K-1"]\nalso = {"I.1" = ["2.18"], "I.2" = ["2.18"]}', "2.18, poles"),
]


@pytest.mark.parametrize(("text", "place"), FAULTS)
def test_a_fault_in_the_layout_is_told(tmp_path, text, place):
    (tmp_path / "sheets.toml").write_text(f'[x]\ntitle = "X"\n{text}', encoding="utf-8")
    with pytest.raises(GradingError, match=f"{place}: "):
        sheets.read_layouts(tmp_path, OURS.catalogue)


def test_a_course_without_sheets_says_so(tmp_path):
    with pytest.raises(GradingError, match=r"sheets\.toml"):
        sheets.read_layouts(tmp_path, OURS.catalogue)


MACHINE = Mark("3.6", "controllable", "right", 1, 1, "")
PERSON = Mark("3.6", "explanation", "given by a person", 0.5, 1, "")


@pytest.mark.parametrize(
    ("marks", "level", "points"),
    [
        ([MACHINE, PERSON], "3", ["1/1 m", "0.5/1 p"]),
        ([Mark("3.6", "explanation", "missing", 0, 1, "")], "0", ["0/1 m"]),
        ([Mark("3.6", "controllable", "not marked: key fault", 0, 1, "")], "…", ["…/1"]),
    ],
)
def test_a_cell_says_level_points_whose_they_are_and_what_waits(marks, level, points):
    found = cell(CONTROL, "III.1", "B-7", *marks)
    assert (found.level_text, found.points_texts) == (level, points)


def on_page(page):
    """Student, title of the sheet, number of the row ("Total" for the last), and code → level, and points."""
    found = {}
    for section in page.split("<section")[1:]:
        (title,) = re.findall(r"<h1>(.*?)</h1>", section)
        (student,) = re.findall(r"ID: <strong>(.*?)</strong>", section)
        _first, *codes = re.findall(r'<th scope="col">(.*?)</th>', section)
        for heading, row in re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', section, re.DOTALL):
            for code, cell in zip(codes, re.findall(r"<td>(.*?)</td>", row), strict=True):
                if cell:
                    level, *points = re.findall(r"<(?:strong|span)>(.*?)</", cell)
                    place = (html.unescape(student), html.unescape(title), heading.split()[0], code)
                    assert place not in found
                    found[place] = level, points
    return found


def test_a_sheet_of_a_made_up_student_is_what_it_is_by_hand():
    found = sheet(
        PRELAB,
        Mark("2.1", "V", "right", 2, 2, ""),
        Mark("2.3", "L", "wrong", 0, 1, ""),
        Mark("2.4", "strategy", "given by a person", 0.75, 1, ""),
        Mark("2.4", "equation", "partly right", 1, 2, ""),
        Mark("2.5", "strategy", "for a person", 0, 1, ""),
        Mark("2.11", "omega_n", "right", 2, 2, ""),  # on another sheet
    )
    shown = on_page(sheets.as_page([found], OURS))
    assert {(row, code): [level, *points] for (_who, _title, row, code), (level, points) in shown.items()} == {
        ("2.1", "A-2"): ["4", "2/2 m"],
        ("2.3", "A-2"): ["0", "0/1 m"],
        ("2.4", "A-1"): ["3", "0.75/1 p"],
        ("2.4", "A-2"): ["2", "1/2 m"],
        ("2.5", "A-1"): ["…", "…/1"],
        ("Total", "A-1"): ["3 …", "0.75/1 p", "…/1"],
        ("Total", "A-2"): ["2", "3/5 m"],
    }
    assert found.total == "3.75 of 6 points; 1 of 7 wait"


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    with Gradebook(marked_class.gradebook(folder, {"A": 2})) as opened:
        enrol(opened, folder, ("eve", "Eve", "", ""))
        yield opened


def test_each_student_has_a_file_with_four_sheets_and_the_class_one_with_all(book, tmp_path):
    count, notes = sheets.write(tmp_path / "out", OURS, book)
    missing = ["On no sheet, as no row and code has it: 3.8 K.", "Without marks, and so without sheets: eve."]
    assert (count, notes) == (2, missing)
    pages = {path.parent.name: path.read_text(encoding="utf-8") for path in (tmp_path / "out").rglob("*.html")}
    assert pages.keys() == {"out", "a-00", "a-01"}
    whole = on_page(pages.pop("out"))
    assert whole == {place: cell for page in pages.values() for place, cell in on_page(page).items()}
    assert {title for _who, title, _row, _code in whole} == {*LAYOUTS}
    for graded in book.all_current():
        place = (graded.run.student, "Total")
        totals = [text for (who, _, row, _), (_, texts) in whole.items() if (who, row) == place for text in texts]
        worth = sum(float(text.split()[0].partition("/")[2]) for text in totals)
        waits = sum(float(text.partition("/")[2]) for text in totals if text.startswith("…"))
        marks = [mark for mark in graded.marks if mark.where != ("3.8", "K")]
        assert worth == pytest.approx(sum(mark.out_of for mark in marks))
        assert waits == pytest.approx(sum(mark.out_of for mark in marks if mark.status == "for a person"))


def test_some_students_sheets_alone_and_without_what_is_dropped(book, tmp_path):
    dropped = replace(OURS, settings=replace(OURS.settings, marks=MarkSettings(drop=("2.11",))))
    count, notes = sheets.write(tmp_path / "out", dropped, book, ["A-01"])
    assert count == 1 and {path.name for path in (tmp_path / "out").iterdir()} == {"a-01", "sheets.html"}
    assert "Dropped by course.toml, and on no sheet: 2.11." in notes
    found = on_page((tmp_path / "out" / "sheets.html").read_text(encoding="utf-8"))
    _level, points = found["a-01", MODELING, "III.1", "B-7"]
    worth = sum(float(text.split()[0].partition("/")[2]) for text in points)
    assert worth == 4  # 2.12 with 3 points, and the report's text with 1


def test_an_unknown_student_and_a_folder_that_cannot_be_written_are_refused(book, tmp_path):
    with pytest.raises(GradingError, match="no student 'zoe'"):
        sheets.write(tmp_path / "out", OURS, book, ["a-00", "zoe"])
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").write_text("a file")
    with pytest.raises(OSError, match="/out"):
        sheets.write(tmp_path / "out", OURS, book, ["a-00"])


@pytest.mark.parametrize("name", ["<script>alert(1)</script>", "\x1b[31mred\u202egpj"])
def test_a_hostile_name_is_text(name):
    found = sheet(PRELAB, MACHINE, about=StudentRecord("ada", name, "", name))
    page = sheets.as_page([found], OURS)
    assert "<script" not in page and "\x1b" not in page and "\u202e" not in page
    assert page.count("&lt;script&gt;alert(1)" if "script" in name else "\\x1b[31mred\\u202egpj") == 2


@pytest.fixture(scope="module")
def page(chromium, tmp_path_factory):
    """The page of a student with something that waits."""
    file = tmp_path_factory.mktemp("sheets") / "sheets.html"
    marks = marked_class.marks(random.Random(4), waiting=0.5)
    file.write_text(sheets.as_page([sheet(title, *marks) for title in LAYOUTS], OURS), encoding="utf-8")
    opened = chromium.new_page(viewport={"width": 1280, "height": 720})
    opened.goto(file.as_uri())
    return opened


def test_the_page_loads_nothing_fits_and_can_be_read(page):
    text = page.content()
    assert "default-src 'none'" in text and "<script" not in text and "http" not in text.replace("http-equiv", "")
    assert "m: marked by the machine. p: marked by a person." in text
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280 and findings(page) == []


def test_on_paper_each_sheet_is_a_page_of_a4_and_the_widest_one_is_turned(page):
    with pypdfium2.PdfDocument(page.pdf(prefer_css_page_size=True)) as printed:
        sizes = [tuple(round(side / 72 * 25.4) for side in one.get_size()) for one in printed]
        texts = [" ".join(one.get_textpage().get_text_range().split()) for one in printed]
    assert sizes == [(297, 210) if len(LAYOUTS[title].columns) > 8 else (210, 297) for title in LAYOUTS]
    for title, text in zip(LAYOUTS, texts, strict=True):
        assert title in text and "An empty cell has no points" in text
