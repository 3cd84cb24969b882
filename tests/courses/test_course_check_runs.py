"""``check-course`` on spoilt copies of the course of a mass on a spring: what a run of the notebooks brings out."""

import shutil
from dataclasses import replace

import pytest

from labcourse.answers.parts import ReportItem
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading import course_check
from labcourse.grading.running import bundle

NOTEBOOK = "01_spring.ipynb"
SOLVED = "### BEGIN SOLUTION\nk = lab.bench().k\n### END SOLUTION"
IN_K = f"{NOTEBOOK}, cell 'q1-2'"


def found(course, run=True):
    return {finding.where: finding.what for finding in course_check.check(course, run)}


@pytest.mark.usefixtures("sandbox")
@pytest.mark.parametrize(
    ("stub", "place", "said"),
    [
        ("k = # N/m", IN_K, "SyntaxError"),
        ("def k(\n    # to be written", IN_K, "SyntaxError"),
        ("", f"{NOTEBOOK}, cell 'q1-2-answer'", "with k = None"),
        ("k = lab.value('1.1', 'run')", "", ""),  # it needs an answer, which everybody has to give first
    ],
)
def test_a_notebook_that_stops_when_nothing_is_filled_in_is_told_with_its_cell(spoilt, stub, place, said):
    course = spoilt(q1_2=f"{stub}\n{SOLVED}")
    stops = {finding.where: finding.what for finding in course_check.check_empty(course, bundle.build(course))}
    assert place in stops if place else stops == {}
    assert said in stops.get(place, "")


@pytest.mark.parametrize(
    ("cells", "cause"),
    [
        ("# %% answer 9.9\nx = 1\n", "02_text.py, cell 'answer 9.9'"),
        ("# %% answer 1.2\nk = 1\n" * 2, "2 cells begin with"),
    ],
)
def test_a_text_that_gives_no_notebook_is_reported(spoilt, cells, cause):
    course = spoilt()
    (course.folder / "02_text.py").write_text(cells, encoding="utf-8")
    (told,) = found(course, run=False).items()
    assert told[0] == "the texts of the notebooks" and cause in told[1]


@pytest.mark.parametrize("shows", [("1.2", "stiffness"), ("2.2", "")])
def test_a_row_of_a_report_that_shows_nothing_is_reported(spoilt, shows):
    course = spoilt()
    course.catalogue.report_items = (ReportItem("Report", "1", "Results", "What came out.", (), (("1.1", ""), shows)),)
    (fault,) = course_check.check_files(course)
    assert fault.where == "the catalogue, Report 1" and " ".join(shows).split()[-1] in fault.what


@pytest.mark.usefixtures("sandbox")
def test_a_solution_that_is_not_recorded_says_why(spoilt):
    number = SOLVED.replace("lab.bench().k", '"stiff"')
    told = found(
        spoilt(q1_2=f"k = None\n{number}", q1_3=SOLVED.replace("k = lab.bench().k", "formula = omega = 1 / 0"))
    )
    by_part = {where.partition(" (key.py, line ")[0]: what for where, what in told.items()}
    assert "it is text" in by_part["the key, 1.2 k"]
    assert "ZeroDivisionError" in by_part["the key, 1.3 omega"]


def test_imports_that_there_are_not_are_told(spoilt):
    (told,) = found(replace(spoilt(), imports=("springlab.lab", "springlag.lab")), run=False).items()
    assert told[0] == "course.py, imports" and "springlag.lab" in told[1]


@pytest.mark.parametrize("kinds", ["", '    kinds = ("number")'])
def test_a_check_without_kinds_is_refused(spoilt, kinds):
    course = spoilt()
    with (course.folder / "key.py").open("a", encoding="utf-8") as file:
        file.write(f'\n\nclass Mine:\n    """Mine."""\n\n{kinds}\n\n\nKEY["1.2"]["k"] = Mine()\n')
    shutil.copytree(course.folder, course.folder.with_name("again"))
    with pytest.raises(GradingError, match=r"1\.2, k.*Mine.*kinds"):
        courses.load(course.folder.with_name("again"))


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("    ],\n    outcomes", '        ("1.5",),\n    ],\n    outcomes', "entry 5 of questions is a tuple"),
        ('Question("1.4"', 'Question("1.2"', r"question 1\.2 is in questions twice"),
        ('Question("1.4"', 'Question("Report"', r"question Report is in the catalogue twice"),
        ('number("omega"', 'number("formula"', r"question 1\.3 has two parts 'formula'"),
        ("points=2", 'points="2"', "k: points should be a number.* '2'"),
        ("points=2", "points=-2", "k: points should be a number.* -2"),
    ],
)
def test_a_slip_in_the_catalogue_is_named_with_its_place(spoilt, before, after, said):
    course = spoilt()
    path = course.folder.parent / "springlab" / "catalogue.py"
    source = path.read_text(encoding="utf-8")
    assert before in source
    report = '    ],\n    reports={"Report": ("1", "01_spring", "On the spring")},\n    outcomes'
    source = source.replace(before, after)
    path.write_text(source.replace("    ],\n    outcomes", report) if "Report" in after else source, encoding="utf-8")
    spoilt.forget()
    shutil.copytree(course.folder, course.folder.with_name("again"))
    with pytest.raises(GradingError, match=said + r".*catalogue\.py, line \d+"):
        courses.load(course.folder.with_name("again"))
