"""An optional notebook: off, nothing asks for it; a setting switches it on, also in mid-term.

The mass on a spring gets a second notebook with two questions, worth 3 points, which the catalogue calls optional.
"""

from __future__ import annotations

import csv
import json
import shutil
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from checkout import ROOT

from labcourse.answers.catalogue import Catalogue
from labcourse.errors import ConfigurationError, GradingError
from labcourse.grading import assignments, commands, course_check
from labcourse.grading import course as courses
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.counting import regrade
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.release import releases, student_course
from labcourse.grading.release.student_course import Release
from labcourse.grading.reports.grades import Reports
from labcourse.grading.scoring import rubric
from labcourse.grading.sheets import read_layouts
from rotflex.course.questions import CATALOGUE

OPTIONAL = "02_beyond"
ON = f'[optional]\nnotebooks = ["{OPTIONAL}"]\n'
_QUESTIONS = """
        Question("4.1", "4", "02_beyond", "Damping", ("models",), (
            number("ratio", "", (0.0, 1.0), "models", "The damping ratio of your spring.", points=2),
        )),
        Question("4.2", "4", "02_beyond", "Why", ("models",), (prose("why", "models", "Why is it so small?"),)),
    ],
    optional=("02_beyond",),
"""
_KEY = """KEY = {
    "4.1": {"ratio": Number("the damping ratio", lambda bench: 0.25, rtol=0.02)},
    "4.2": {"why": ForAPerson()},
"""
_RUBRIC = '\n["4.2".why]\nlook_for = "A reason."\n4 = "All."\n3 = "Most."\n2 = "Some."\n1 = "Little."\n'
_SHEETS = """
[first]
title = "First"
section = "1"
codes = ["measures", "models"]
[beyond]
title = "Beyond"
section = "4"
codes = ["models"]
"""
_TEXT = """# %% [markdown]
# # Beyond

# %% imports
import math

# %% [markdown]
# ## 4.1 Damping

# %% answer 4.1
ratio = 0.25

# %% [markdown]
# ## 4.2 Why

# %% words 4.2 why [markdown]
# It rubs.
"""
_BEFORE = "# %% [markdown]\n# ## 1.1 The motion after release\n"
_LINK = "# %% [markdown]\n# What follows:\n#\n# * [the next one](02_beyond.ipynb#Damping), if you like\n# * a rest\n\n"


def replaced(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, (path, old)
    path.write_text(text.replace(old, new), encoding="utf-8")


@dataclass(frozen=True)
class Term:
    """The course's folder, and its releases of a term: without the optional notebook, and then with it."""

    solutions: Path
    without: Release
    with_it: Release


def set_to(solutions: Path, settings: str) -> Course:
    """The course with other settings."""
    (solutions / "course.toml").write_text(settings, encoding="utf-8")
    return courses.load(solutions)


@pytest.fixture(scope="module")
def term(tmp_path_factory: pytest.TempPathFactory) -> Term:
    place = tmp_path_factory.mktemp("optional")
    spring, solutions = place / "spring", place / "spring" / "solutions"
    shutil.copytree(ROOT / "tests/courses/spring", spring, ignore=shutil.ignore_patterns("notebooks", "__pycache__"))
    replaced(spring / "springlab" / "catalogue.py", "\n    ],\n", _QUESTIONS)
    replaced(solutions / "key.py", "KEY = {\n", _KEY)
    replaced(solutions / "01_spring.py", _BEFORE, _LINK + _BEFORE)
    for name, more in (("rubric.toml", _RUBRIC), ("sheets.toml", _SHEETS), (f"{OPTIONAL}.py", _TEXT)):
        with (solutions / name).open("a", encoding="utf-8") as file:
            file.write(more)
    commands.make_notebooks(str(solutions))
    return Term(
        solutions,
        student_course.release(set_to(solutions, ""), place / "without"),
        student_course.release(set_to(solutions, ON), place / "with"),
    )


@pytest.fixture
def off(term: Term) -> Course:
    return set_to(term.solutions, "")


@pytest.fixture
def on(term: Term) -> Course:
    return set_to(term.solutions, ON)


def test_what_is_off_is_in_nothing_that_students_get(term):
    with zipfile.ZipFile(term.without.archive) as archive:
        texts = {name: archive.read(name).decode() for name in archive.namelist() if "/notebooks/" in name}
    assert [Path(name).name for name in texts] == ["01_spring.ipynb", "course.json"]
    assert not [name for name, text in texts.items() if OPTIONAL in text or "4.1" in text]
    assert "a rest" in texts["spring-course/notebooks/01_spring.ipynb"]
    assert "if you like" not in texts["spring-course/notebooks/01_spring.ipynb"]
    assert term.with_it.notebooks == ("01_spring.ipynb", f"{OPTIONAL}.ipynb")
    with_link = (term.with_it.folder / "notebooks" / "01_spring.ipynb").read_text(encoding="utf-8")
    assert f"[the next one]({OPTIONAL}.ipynb#Damping), if you like" in with_link


def test_what_is_off_is_in_nothing_that_the_instructor_sees(off):
    assert (off.folder.parent / "notebooks" / f"{OPTIONAL}.ipynb").is_file()  # for those who write the course
    assert [path.stem for path in off.notebooks] == ["01_spring"] == list(off.catalogue.notebooks)
    assert [one.notebooks for one in assignments.of_course(off)] == [("01_spring",)]
    assert sum(question.points for question in off.catalogue.marked.values()) == 8
    assert {*off.key} == {"1.1", "1.2", "1.3", "1.4"}
    assert {*rubric.read(off.folder, off.catalogue)} == {("1.4", "why")}
    assert [layout.title for layout in read_layouts(off.folder, off.catalogue)] == ["First"]
    assert list(course_check.check(off, run=False)) == []


def test_what_is_on_is_a_notebook_as_any_other(sandbox, on):
    assert [one.notebooks for one in assignments.of_course(on)] == [("01_spring",), (OPTIONAL,)]
    assert sum(question.points for question in on.catalogue.marked.values()) == 11
    assert {*rubric.read(on.folder, on.catalogue)} == {("1.4", "why"), ("4.2", "why")}
    assert [layout.title for layout in read_layouts(on.folder, on.catalogue)] == ["First", "Beyond"]
    assert list(course_check.check(on)) == []


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ('[optional]\nnotebooks = ["01_spring"]\n', "there is no optional notebook '01_spring'"),
        (f'[optional]\nnotebooks = "{OPTIONAL}"\n', "a list, in brackets"),
        (f'[[deadline]]\ndue = 2026-11-21\nnotebooks = ["{OPTIONAL}"]\n', f"{OPTIONAL} is optional"),
        ('[marks]\nweights = {"4.1 ratio" = 2}\n', f"4.1 ratio is in {OPTIONAL}"),
        ('[marks]\ndrop = ["4.2"]\n', r"Name it in \[optional\] notebooks, or leave this entry out"),
    ],
)
def test_a_setting_that_names_what_the_class_does_not_have_is_refused(term, settings, said):
    with pytest.raises(GradingError, match=said):
        set_to(term.solutions, settings)
    if OPTIONAL in said:
        set_to(term.solutions, ON + settings)


def test_a_name_of_no_notebook_is_found_in_the_catalogue(off):
    catalogue = Catalogue([], optional=("02_beyound",))
    found = [one for one in course_check.check_cells(replace(off, catalogue=catalogue)) if "optional" in one.where]
    assert [one.what for one in found] == ["there is no notebook 02_beyound in solutions."]


def hand_in(made: Release, folder: Path) -> None:
    """The notebooks of a release with answers, in a new folder that bears the student's name."""
    shutil.copytree(made.folder / "notebooks", folder)
    answers = {
        "q1-1": "run = lab.bench().release()",
        "q1-2": "k = lab.bench().k",
        "q1-3": 'formula = sympy.sqrt(sympy.Symbol("k") / sympy.Symbol("m"))\nomega = lab.bench().omega',
        "q4-1": "ratio = 0.25",
    }
    for path in folder.glob("*.ipynb"):
        notebook = json.loads(path.read_text(encoding="utf-8"))
        for cell in notebook["cells"]:
            cell["source"] = answers.get(cell["id"], cell["source"])
        path.write_text(json.dumps(notebook), encoding="utf-8")
    about = json.loads((folder / "course.json").read_text(encoding="utf-8"))
    (folder / "course.json").write_text(json.dumps({**about, "student": folder.name}), encoding="utf-8")


def graded(course: Course, submissions: Path, out: Path) -> dict[str, dict[str, str]]:
    """The rows of the table of grades, by student."""
    out.mkdir(exist_ok=True)
    with Gradebook(out / "book.sqlite") as book:
        for step in Batch(submissions, course, book, Settings()).grade():
            assert not step.graded.run.key.startswith("failed")
        Reports(out, course, book).write_all()
    with (out / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["student"]: row for row in csv.DictReader(file)}


def test_it_is_switched_on_in_mid_term(sandbox, term, tmp_path):
    """Ada goes on with the release that has it, and Bob does not. Eve hands it in alone, before it is there."""
    submissions, marks = tmp_path / "submissions", tmp_path / "marks"
    for name in ("ada", "bob", "eve"):
        hand_in(term.without, submissions / name)
    (submissions / "eve" / "01_spring.ipynb").unlink()
    shutil.copy(term.with_it.folder / "notebooks" / f"{OPTIONAL}.ipynb", submissions / "eve")
    course = set_to(term.solutions, "")
    releases.store(course, term.without.archive, term.without.id)
    rows = graded(course, submissions, marks)
    # 1.4 is in words, and nobody wrote any.
    expected = {"ada": ("7", "8"), "bob": ("7", "8"), "eve": ("0", "8")}
    assert {name: (row["total"], row["out_of"]) for name, row in rows.items()} == expected
    assert not [column for column in rows["eve"] if "4." in column or "beyond" in column]
    assert f"'{OPTIONAL}.ipynb': not recognised as notebooks of the course" in rows["eve"]["notes"]
    for name in ("ada", "eve"):
        shutil.rmtree(submissions / name)

    hand_in(term.with_it, submissions / "ada")
    course = set_to(term.solutions, ON)
    releases.store(course, term.with_it.archive, term.with_it.id)
    with Gradebook(marks / "book.sqlite") as book:  # marking Bob's old run again asks him for nothing new
        again = {one.after.run.student: one for one in regrade(book, course)}
        assert again["bob"].before.marks == again["bob"].after.marks
    rows = graded(course, submissions, marks)
    assert {name: (row["total"], row["out_of"]) for name, row in rows.items() if name != "eve"} == {
        "ada": ("9", "11"),
        "bob": ("7", "8"),
    }
    # Switched off again, its marks go.
    with Gradebook(marks / "book.sqlite") as book:
        for one in regrade(book, set_to(term.solutions, "")):
            assert {mark.question for mark in one.after.marks} == {"1.1", "1.2", "1.3", "1.4"}


def test_the_questions_of_this_course_are_the_same_with_an_optional_notebook_that_is_off():
    workbook = {name: one for name, one in CATALOGUE.marked.items() if not name.startswith("4.")}
    assert len(workbook) == len(CATALOGUE.marked) - 11
    for course in ({"release": "2025-autumn-1", "student": "ada"}, {"release": "2026-1", "optional": []}):
        assert CATALOGUE.of_release(course).marked == workbook
        assert CATALOGUE.of_release(course).predictions == CATALOGUE.predictions
    for course in ({}, {"student": "ada"}, {"release": "2026-1", "optional": ["11_beyond_the_workbook"]}):
        assert CATALOGUE.of_release(course) is CATALOGUE
    for course in ({"optional": 1}, {"without": "01_modeling_prelab"}):
        with pytest.raises(ConfigurationError, match="in a list"):
            CATALOGUE.of_release(course)
