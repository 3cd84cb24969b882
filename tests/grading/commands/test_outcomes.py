"""Commands that follow outcomes: outcomes, sheets."""

import marked_class
import pytest
from checkout import ROOT
from command_line import rotflex, said


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    return marked_class.gradebook(tmp_path_factory.mktemp("class"), {"North": 6, "South": 6})


@pytest.mark.slow
def test_outcomes_writes_the_report_and_says_what_is_yours_alone(book, tmp_path):
    done = rotflex("outcomes", "report", book, "--out", tmp_path / "out", "--solutions", ROOT / "solutions")
    assert done.exit_code == 0, done.output
    assert "12 students: " in said(done) and "waits for a person" in said(done)
    assert "levels.csv has names: it is for you, and not for an accreditation." in said(done)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"attainment.csv", "levels.csv"}
    assert "North" in (tmp_path / "out" / "attainment.csv").read_text(encoding="utf-8")


def test_sheets_writes_those_of_the_students_named(book, tmp_path):
    words = ("outcomes", "sheets", book, "--out", tmp_path / "out", "--solutions", ROOT / "solutions")
    done = rotflex(*words, "--student", "a-00", "--student", "B-05")
    assert done.exit_code == 0, done.output
    assert "2 students: " in said(done) and "On no sheet, as no row and code has it: 3.8 K." in said(done)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a-00", "b-05", "sheets.html"]
    wrong = rotflex(*words, "--student", "zoe")
    assert wrong.exit_code == 2 and "There is no student 'zoe' in this gradebook." in said(wrong)
