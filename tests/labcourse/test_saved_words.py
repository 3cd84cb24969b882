"""What a session knows of answers in words: what the saved notebooks of its folder hold."""

import json
import re

import pytest
from checkout import ROOT

import rotflex.course.lab
from labcourse.errors import AnswerError

NOTEBOOK = "02_finding_stiffness.ipynb"
REPORT = "04_modeling_results.ipynb"


@pytest.fixture
def folder(tmp_path):
    for name in (NOTEBOOK, REPORT):
        (tmp_path / name).write_bytes((ROOT / "notebooks" / name).read_bytes())
    return tmp_path


@pytest.fixture
def lab(folder):
    return rotflex.course.lab.start("ada", folder=folder, quiet=True)


def write(folder, name, cell_id, text, **changes):
    notebook = json.loads((folder / name).read_text(encoding="utf-8"))
    (cell,) = [cell for cell in notebook["cells"] if cell["id"] == cell_id]
    cell["source"] = [cell["source"][0], "\n", text]
    cell.update(changes)
    (folder / name).write_text(json.dumps(notebook), encoding="utf-8")


def test_words_are_there_once_the_notebook_is_saved(lab, folder, capsys):
    assert not lab.has("2.11", "explanation")
    with pytest.raises(AnswerError, match="saved notebook"):
        lab.value("2.11", "explanation")
    write(folder, NOTEBOOK, "q2-11-explanation", "It $\\omega$ swings.")
    assert lab.value("2.11", "explanation") == "It $\\omega$ swings."
    lab.answer("2.11", omega_n=19.9)
    capsys.readouterr()
    lab.progress("02_finding_stiffness")
    assert "2.11              Natural frequency: answered" in capsys.readouterr().out
    lab.summary()
    assert re.search(r"02_finding_stiffness +1 of 4", capsys.readouterr().out)


def test_an_explanation_of_one_word_is_read_and_asked_about_once_when_an_answer_is_given(lab, folder, capsys):
    where = f"{NOTEBOOK}: 2.11, explanation"
    write(folder, NOTEBOOK, "q2-11-explanation", "Friction.")
    capsys.readouterr()
    lab.answer("2.11", omega_n=19.9)
    assert where in capsys.readouterr().out
    assert lab.value("2.11", "explanation") == "Friction."
    cells = json.loads((folder / NOTEBOOK).read_text(encoding="utf-8"))["cells"]
    metadata = next(cell["metadata"] for cell in cells if cell["id"] == "q2-11-explanation")
    write(folder, NOTEBOOK, "q2-11-explanation", "Friction.", metadata={**metadata, "more": 1})
    lab.answer("2.11", omega_n=19.9)
    assert where not in capsys.readouterr().out
    write(folder, NOTEBOOK, "q2-11-explanation", "Friction drags the peak.")
    lab.summary()
    assert where not in capsys.readouterr().out
    write(folder, NOTEBOOK, "q2-11-explanation", "x" * 5001, id="renewed")  # too long; in a cell with another id
    lab.summary()
    assert where in capsys.readouterr().out


def test_words_in_quotes_of_an_old_notebook_still_count_and_new_ones_come_first(lab, folder):
    lab.answer("2.11", explanation="In quotes.")
    assert lab.value("2.11", "explanation") == "In quotes."
    write(folder, NOTEBOOK, "q2-11-explanation", "In a cell.")
    assert lab.value("2.11", "explanation") == "In a cell."


def test_a_notebook_that_cannot_be_read_is_told_and_the_others_count(lab, folder, capsys):
    (folder / REPORT).write_text("{")
    write(folder, NOTEBOOK, "q2-11-explanation", "It swings.")
    assert lab.has("2.11", "explanation")
    said = capsys.readouterr().out
    assert REPORT in said and "JSON" in said
    assert lab.has("2.11", "explanation")
    assert capsys.readouterr().out == ""  # once


def test_an_instructors_notebook_has_no_text_of_a_students_after_its_answers(tmp_path):
    (tmp_path / REPORT).write_bytes((ROOT / "solutions" / REPORT).read_bytes())
    lab = rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)
    said = lab.value("Modeling report", "stiffness_procedure")
    assert said.startswith("The goal was")
    assert "Say how the equations of motion became matrices" not in said
