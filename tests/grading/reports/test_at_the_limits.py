"""How much is shown, at either side of each bound."""

import io

import pytest
from gradebooks import graded, mark, prose
from PIL import Image

from labcourse.answers.attached_pictures import MAX_STORED
from labcourse.grading.reports import formulas, live_report, rendered_words
from labcourse.grading.reports.changes import changes
from labcourse.grading.reports.formulas import FormulaError, _depth
from labcourse.grading.reports.live_report import Screen
from labcourse.grading.reports.rendered_words import as_html
from labcourse.grading.reports.result import result_of

FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])


def names(number):
    return [f"student{place:02}" for place in range(number)]


def screen(capsys, monkeypatch, students, trouble=()):
    monkeypatch.setenv("COLUMNS", "200")
    with Screen(len(students), [], []) as report:
        for student in students:
            one = graded(student, mark(), prose(), problems=(f"trouble of {student}",) if student in trouble else ())
            report.add(False, result_of(one), None)
    return capsys.readouterr().out


@pytest.mark.parametrize("number", [1, 3, 4, 7])
def test_a_class_is_listed_up_to_a_screenful_and_the_rest_counted(number, capsys, monkeypatch):
    monkeypatch.setattr(live_report, "_MOST_ROWS", 3)
    text = screen(capsys, monkeypatch, names(number))
    assert sum(f" {name} " in text for name in names(number)) == min(number, 3)
    assert (f"and {number - 3} more, in grades.csv" in text) == (number > 3)
    assert ("more, in grades.csv" in text) == (number > 3)


def test_in_a_large_class_two_with_trouble_come_first(capsys, monkeypatch):
    monkeypatch.setattr(live_report, "_MOST_ROWS", 3)
    text = screen(capsys, monkeypatch, names(9), trouble=("student05", "student08"))
    rows = [name for name in names(9) if f" {name} " in text]
    assert rows == ["student00", "student05", "student08"]
    assert text.index(" student05 ") < text.index(" student08 ") < text.index(" student00 ")


def test_in_a_class_that_just_fits_all_come_by_name(capsys, monkeypatch):
    monkeypatch.setattr(live_report, "_MOST_ROWS", 3)
    text = screen(capsys, monkeypatch, names(3)[::-1], trouble=("student02",))
    assert text.index(" student00 ") < text.index(" student01 ") < text.index(" student02 ")


@pytest.mark.parametrize("number", [2, 3, 5])
def test_changed_marks_are_listed_up_to_a_screenful_and_the_rest_counted(number, capsys, monkeypatch):
    monkeypatch.setattr(live_report, "_MOST_ROWS", 2)
    monkeypatch.setenv("COLUMNS", "200")
    with Screen(number, [], []) as report:
        for student in reversed(names(number)):
            before = graded(student, mark(), prose())
            after = graded(student, mark("wrong", 0.0, "More than 1 % off."), prose(), key="key 2")
            report.add(False, result_of(after), changes(before, after))
    text = capsys.readouterr().out
    assert [name for name in names(number) if f"{name}: 2 → 0" in text] == names(number)[:2]
    assert (f"The marks of {number - 2} more changed" in text) == (number > 2)
    assert ("more changed" in text) == (number > 2)


def is_shown(latex):
    try:
        return formulas.as_mathml(latex).startswith("<math")
    except FormulaError:
        return False


@FITS
def test_characters_of_a_formula(fits):
    assert is_shown("x" * (formulas.LONGEST + (not fits))) == fits


@FITS
@pytest.mark.parametrize(("opening", "closing"), [("{", "}"), (r"\left(", r"\right)"), (r"\sqrt{", "}")])
def test_groups_of_a_formula_in_each_other(fits, opening, closing):
    depth = formulas._DEEPEST + (not fits)
    latex = opening * depth + "x" + closing * depth
    assert (_depth(latex), is_shown(latex)) == (depth, fits)


@pytest.mark.parametrize(
    ("latex", "depth"),
    [
        ("", 0),
        ("x", 0),
        ("x^2_1", 0),
        ("{x}", 1),
        ("{x}{y}{z}", 1),
        ("{{x}{y}}", 2),
        (r"\{x\}", 0),
        (r"\begin{a}{x}\end{a}", 2),
        (r"{\left(x\right)}", 2),
        ("}{", 0),
        ("^" * 8, 1),
        ("^" * 16, 2),
        (r"\bar" * 16 + " x", 8),
        (r"{x}\bar\bar y", 1),
    ],
)
def test_how_deep_groups_stand_in_each_other(latex, depth):
    assert _depth(latex) == depth


@FITS
def test_nodes_of_a_formula(monkeypatch, fits):
    from latex2mathml.converter import convert_to_element

    nodes = sum(1 for _node in convert_to_element("x+y=z", display="inline").iter())
    monkeypatch.setattr(formulas, "MOST_NODES", nodes - (not fits))
    assert is_shown("x+y=z") == fits


TYPED = 'class="words-source"'


@FITS
def test_characters_of_words(fits):
    page = as_html("y" * (rendered_words.LONGEST + (not fits)))
    assert (TYPED in page) != fits and page.count("y" * rendered_words.LONGEST) == 1


@FITS
def test_bars_in_a_line(fits):
    columns = rendered_words._WIDEST - 1 + (not fits)
    wide = "\n".join("|" + cell * columns for cell in ("a|", "-|", "b|"))
    assert ("<table" in as_html(wide)) == fits


@FITS
def test_quotes_in_each_other(fits):
    assert (TYPED in as_html("> " * (rendered_words._DEEPEST + (not fits)) + "so")) != fits


def picture(side=10):
    packed = io.BytesIO()
    Image.new("RGB", (side, side), "white").save(packed, format="PNG")
    return packed.getvalue()


@FITS
@pytest.mark.parametrize("with_picture", [False, True])
def test_bytes_of_a_page_without_its_pictures(monkeypatch, fits, with_picture):
    text, pictures = ("So. ![a](a.png)", {"a.png": picture()}) if with_picture else ("So.", {})
    whole = as_html(text, pictures)
    start, end = whole.find("<img"), whole.find(">", whole.find("<img")) + 1
    size = len(whole) - (end - start if with_picture else 0)
    monkeypatch.setattr(rendered_words, "MOST_BYTES", size - (not fits))
    assert (TYPED in as_html(text, pictures)) != fits


@FITS
def test_bytes_of_a_picture(fits):
    data = picture() + bytes(MAX_STORED - len(picture()) + (not fits))
    page = as_html("![a](a.png)", {"a.png": data})
    assert ("<img" in page, "picture not available" in page) == (fits, not fits)
