"""Commands that follow outcomes: outcomes, sheets."""

import os
import shutil
import subprocess
import sys

import marked_class
import pytest
from checkout import ROOT
from command_line import rotflex, said

SPRING = ROOT / "tests" / "courses" / "spring" / "solutions"


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    return marked_class.gradebook(tmp_path_factory.mktemp("class"), {"North": 6, "South": 6})


@pytest.mark.slow
def test_outcomes_writes_the_report_and_says_what_is_yours_alone(book, tmp_path):
    done = rotflex("outcomes", "report", book, "--out", tmp_path / "out", "--solutions", ROOT / "solutions")
    assert done.exit_code == 0, done.output
    assert "12 students: " in said(done) and "waits for a person" in said(done)
    assert "students.csv has names: it is for you, and not for an accreditation." in said(done)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"attainment.html", "attainment.csv", "students.csv"}
    assert "North" in (tmp_path / "out" / "attainment.csv").read_text(encoding="utf-8")


def test_outcomes_without_sections_names_none(book, tmp_path):
    done = rotflex(
        "outcomes", "report", "--no-sections", book, "--out", tmp_path / "out", "--solutions", ROOT / "solutions"
    )
    assert done.exit_code == 0, done.output
    assert "North" not in (tmp_path / "out" / "attainment.csv").read_text(encoding="utf-8")


def test_sheets_writes_those_of_the_students_named(book, tmp_path):
    words = ("outcomes", "sheets", book, "--out", tmp_path / "out", "--solutions", ROOT / "solutions")
    done = rotflex(*words, "--student", "a-00", "--student", "B-05")
    assert done.exit_code == 0, done.output
    assert "2 students: " in said(done) and "On no sheet, as no row and code has it: 3.8 K." in said(done)
    assert sorted(path.name for path in (tmp_path / "out" / "sheets").iterdir()) == ["a-00", "b-05"]
    wrong = rotflex(*words, "--student", "zoe")
    assert wrong.exit_code == 2 and "There is no student 'zoe' in this gradebook." in said(wrong)


@pytest.mark.slow
def test_a_course_without_map_and_sheets_says_so(book, tmp_path):
    shutil.copytree(SPRING.parent, tmp_path / "spring")

    def alone(command):
        """In a process of its own: another course's packages would stay loaded in this one."""
        course = tmp_path / "spring" / "solutions"
        words = [
            sys.executable,
            "-m",
            "rotflex",
            "outcomes",
            command,
            book,
            "--out",
            tmp_path / "out",
            "--solutions",
            course,
        ]
        env = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "200"}
        return subprocess.run(words, env=env, capture_output=True, encoding="utf-8", check=False)

    done = alone("report")
    assert done.returncode == 0 and "This course has no outcomes.toml in" in " ".join(done.stdout.split())
    done = alone("sheets")
    assert done.returncode == 2 and "This course has no scoring sheets: there is no" in " ".join(done.stderr.split())
    assert not (tmp_path / "out" / "sheets").exists()


def test_of_a_small_class_the_terminal_says_that_the_report_is_empty(tmp_path):
    book = marked_class.gradebook(tmp_path, {"North": 1})
    done = rotflex("outcomes", "report", book, "--solutions", ROOT / "solutions")
    assert done.exit_code == 0 and said(done).startswith("1 student: ")
    assert "This report shows no figures at all" in said(done) and "fewest, in [outcomes] of course.toml" in said(done)


@pytest.mark.parametrize("command", ["report", "sheets"])
def test_a_gradebook_that_is_not_there_is_told_and_not_made(command, tmp_path):
    done = rotflex("outcomes", command, tmp_path / "no.sqlite", "--out", tmp_path / "out", "--solutions", "solutions")
    assert done.exit_code == 2 and "There is no gradebook" in said(done)
    assert not (tmp_path / "no.sqlite").exists()
