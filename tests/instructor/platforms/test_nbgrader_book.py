"""Marks in nbgrader's own gradebook, made by nbgrader's own command of a notebook that students get."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from checkout import ROOT
from gradebooks import graded, mark, prose, record
from made_courses import OURS
from typer.testing import CliRunner

from rotflex import cli
from rotflex.errors import GradingError
from rotflex.instructor.gradebook import Gradebook
from rotflex.instructor.platforms import nbgrader_book
from rotflex.instructor.release import student_notebooks

NAME = "02_finding_stiffness"
BESIDE = Path(sys.prefix, "nbgrader")  # where make test puts it, so that no JupyterLab has its extensions
THERE = BESIDE.is_dir() or importlib.util.find_spec("nbgrader") is not None
with_nbgrader = pytest.mark.skipif(not THERE, reason="nbgrader is not installed: make .venv/nbgrader")


# --- what needs no nbgrader -------------------------------------------------------------------------------------------


def test_each_answer_cell_has_the_points_of_what_is_answered_in_it():
    cells = nbgrader_book.answer_cells(OURS)
    assert cells[NAME, "q2-11"] == (("2.11", "omega_n"),)
    assert cells[NAME, "q2-11-explanation"] == (("2.11", "explanation"),)
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        for cell in student_notebooks.read(path).cells:
            about = cell.metadata.get("nbgrader", {})
            if about.get("grade"):
                parts = cells.pop((path.stem, about["grade_id"]))
                points = sum(OURS.catalogue.find(question).part(part).points for question, part in parts)
                assert points == about["points"], cell.id
    assert not cells


def test_where_nbgrader_is_not_installed_that_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "nbgrader.api", None)
    with (
        Gradebook(tmp_path / "book.sqlite") as book,
        pytest.raises(GradingError, match="nbgrader is not installed here"),
    ):
        nbgrader_book.carry(book, OURS, tmp_path / "gradebook.db", "lab")


# --- and what does ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def nbgrader():
    """It can be imported, while this module's tests run."""
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(sys, "path", [*sys.path, str(BESIDE)])
        yield


@pytest.fixture(scope="module")
def generated(tmp_path_factory, nbgrader):
    """nbgrader's gradebook after ``nbgrader generate_assignment`` of a released notebook."""
    folder = tmp_path_factory.mktemp("nbgrader")
    (folder / "source" / "lab").mkdir(parents=True)
    shutil.copyfile(ROOT / "notebooks" / f"{NAME}.ipynb", folder / "source" / "lab" / f"{NAME}.ipynb")
    (folder / "nbgrader_config.py").write_text('c = get_config()\nc.CourseDirectory.course_id = "control"\n')
    words = [sys.executable, "-m", "nbgrader", "generate_assignment", "lab"]
    programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])  # it calls alembic's
    modules = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(BESIDE)]))
    environment = {**os.environ, "PATH": programs, "PYTHONPATH": modules}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "gradebook.db"


@pytest.fixture
def theirs(generated, tmp_path):
    """The same, with submissions of four."""
    from nbgrader.api import Gradebook as Theirs

    path = tmp_path / "gradebook.db"
    shutil.copyfile(generated, path)
    with Theirs(f"sqlite:///{path}", course_id="control") as book:
        for student in ("ada", "BOB", "cleo", "zoe"):
            book.add_student(student)
            book.add_submission("lab", student)
    return path


@pytest.fixture
def ours(tmp_path):
    with Gradebook(tmp_path / "book.sqlite") as book:
        record(
            book,
            graded("ada", mark(), prose()),
            graded("bob", mark("wrong", 0.0), prose("wrong", 0.0)),
            graded("eve", mark(), prose()),
        )
        book.set_mark("ada", "2.11", "explanation", 0.5, "Half of it.", "anna")
        book.set_mark("eve", "2.11", "explanation", 0.5, "Half of it.", "anna")
        yield book


def grades(path):
    """Student and cell → points and whether they are still to be given, read from the database itself."""
    with sqlite3.connect(path) as database:
        rows = database.execute(
            "SELECT s.student_id, c.name, g.manual_score, g.needs_manual_grade FROM grade g JOIN base_cell c "
            "ON c.id = g.cell_id JOIN submitted_notebook n ON n.id = g.notebook_id JOIN submitted_assignment s "
            "ON s.id = n.assignment_id"
        )
        return {(student, cell): (score, bool(waits)) for student, cell, score, waits in rows}


def courses(path):
    with sqlite3.connect(path) as database:
        return database.execute("SELECT id FROM course").fetchall()


@with_nbgrader
def test_marks_go_into_the_cells_and_who_and_what_is_left_out_is_told(theirs, ours, generated):
    before = grades(theirs)
    told = nbgrader_book.carry(ours, OURS, theirs, "lab").told()
    after = grades(theirs)
    assert {where: found for where, found in after.items() if found != before[where]} == {
        ("ada", "q2-11"): (2.0, False),
        ("ada", "q2-11-explanation"): (0.5, False),
        ("BOB", "q2-11"): (0.0, False),
        ("BOB", "q2-11-explanation"): (0.0, False),
    }
    assert told[0] == "4 marks of cells written (0 of them in place of another), 0 as they were; of 2 students."
    assert {
        "cleo: nothing; the gradebook has no such student.",
        "zoe: nothing; the gradebook has no such student.",
        "eve: nothing; nbgrader has no submission of theirs: collect it there, and autograde it.",
    } <= set(told)
    assert "Cell 02_finding_stiffness q2-9: left; nothing of it is marked here." in told
    assert courses(theirs) == courses(generated)  # nor is one added beside theirs


@with_nbgrader
def test_of_two_submissions_that_lead_to_one_student_neither_gets_their_marks(theirs, ours, tmp_path):
    from nbgrader.api import Gradebook as Theirs

    with Theirs(f"sqlite:///{theirs}", course_id="control") as book:
        book.add_student("ada@x.org")
        book.add_submission("lab", "ada@x.org")
    roster = tmp_path / "roster.csv"
    roster.write_text("Student ID,Email\nada,ada@x.org\n")
    ours.import_roster(roster)
    before = grades(theirs)
    carried = nbgrader_book.carry(ours, OURS, theirs, "lab")
    assert {student for (student, cell), found in grades(theirs).items() if found != before[student, cell]} == {"BOB"}
    assert carried.without["ada"] == carried.without["ada@x.org"] == "several submissions lead to 'ada'."
    assert carried.students == {"bob"}


@with_nbgrader
def test_the_same_again_changes_nothing_and_another_mark_is_told_with_both(theirs, ours):
    nbgrader_book.carry(ours, OURS, theirs, "lab")
    again = nbgrader_book.carry(ours, OURS, theirs, "lab")
    assert (again.written, again.unchanged) == (0, 4)
    ours.set_mark("ada", "2.11", "explanation", 1.0, "All of it.", "anna")
    told = nbgrader_book.carry(ours, OURS, theirs, "lab").told()
    assert "Replaced: ada, 02_finding_stiffness q2-11-explanation: 0.5 → 1" in told


@with_nbgrader
def test_what_waits_for_a_person_goes_on_waiting_there(theirs, ours):
    record(ours, graded("ada", mark(), prose(given="Another answer."), submission="second"))
    carried = nbgrader_book.carry(ours, OURS, theirs, "lab")
    assert carried.waiting == {"ada": [f"{NAME} q2-11-explanation"]}
    assert grades(theirs)["ada", "q2-11-explanation"] == (None, True)


@with_nbgrader
def test_a_cell_of_other_points_is_left_alone(theirs, ours):
    less = replace(mark(), out_of=3.0)
    record(ours, graded("ada", less, prose(), submission="second"))
    carried = nbgrader_book.carry(ours, OURS, theirs, "lab")
    assert "worth 2 points in nbgrader, and 3 here" in carried.cells[f"{NAME} q2-11"]
    assert grades(theirs)["ada", "q2-11"] == (None, True)


@with_nbgrader
def test_what_has_no_cell_is_told(theirs, ours):
    record(ours, graded("ada", mark(), prose(), replace(mark(), question="3.7", part="gain"), submission="second"))
    assert "In no cell, and so not in nbgrader: 3.7 gain" in nbgrader_book.carry(ours, OURS, theirs, "lab").told()


@with_nbgrader
def test_a_dry_run_writes_nothing(theirs, ours):
    before = theirs.read_bytes()
    assert nbgrader_book.carry(ours, OURS, theirs, "lab", dry=True).written == 4
    assert theirs.read_bytes() == before


@with_nbgrader
def test_what_cannot_be_used_is_refused_in_words(theirs, ours, tmp_path):
    with pytest.raises(GradingError, match="no assignment 'exam'; it has 'lab'"):
        nbgrader_book.carry(ours, OURS, theirs, "exam")
    with pytest.raises(GradingError, match="There is no gradebook"):
        nbgrader_book.carry(ours, OURS, tmp_path / "none.db", "lab")
    with pytest.raises(GradingError, match="cannot be used as a gradebook of nbgrader's"):
        nbgrader_book.carry(ours, OURS, tmp_path / "book.sqlite", "lab")
    assert not (tmp_path / "none.db").exists()


@with_nbgrader
def test_the_command_tells_what_came_of_it_and_whether_all_is_in(theirs, ours, tmp_path):
    asked = ("export", tmp_path / "book.sqlite", "--course", OURS.folder, "--nbgrader", theirs, "--assignment", "lab")
    dry = CliRunner().invoke(cli.app, [*map(str, asked), "--dry-run"])
    assert dry.exit_code == 1 and "4 marks of cells written" in dry.output and "Nothing was written" in dry.output
    (new,) = [line for line in dry.output.splitlines() if line.startswith("Where nobody gave a mark: ")]
    assert {f"ada, {NAME} q2-11: 2", f"ada, {NAME} q2-11-explanation: 0.5"} <= set(new.partition(": ")[2].split("; "))
    assert grades(theirs)["ada", "q2-11"] == (None, True)
    done = CliRunner().invoke(cli.app, list(map(str, asked)))
    assert done.exit_code == 1 and "eve: nothing; nbgrader has no submission of theirs" in done.output
    assert grades(theirs)["ada", "q2-11"] == (2.0, False)
