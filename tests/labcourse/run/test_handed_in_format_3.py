"""A notebook that was saved in format 3 is one for all that a student does with it."""

from __future__ import annotations

import json

import pytest
from made_courses import OURS

from labcourse.answers.notebooks import Notebook
from labcourse.answers.words import SavedWords
from labcourse.grading.release import student_course
from labcourse.run import restore, submit, update

NAME = "02_finding_stiffness.ipynb"
MASTER = json.loads(student_course.derive_notebooks(OURS)[NAME])


def in_format_3(wrote: str = "omega_n = 20.0") -> bytes:
    cells = []
    for cell in MASTER["cells"]:
        source = wrote if cell["id"] == "q2-11" else "".join(cell["source"])
        if cell["id"] == "q2-11-explanation":
            source += "\n\nThe ratio holds the link alone.\n"
        text = {"input": source, "outputs": []} if cell["cell_type"] == "code" else {"source": source}
        cells.append({"cell_type": cell["cell_type"], "metadata": cell["metadata"], **text})
    return json.dumps({"nbformat": 3, "metadata": {}, "worksheets": [{"cells": cells}]}).encode()


def test_its_cells_are_listed_as_those_of_any_other():
    assert [cell["source"] for cell in Notebook.read(in_format_3()).content["cells"]] == [
        cell.source for cell in Notebook.read(in_format_3()).cells
    ]


def test_it_can_be_handed_in():
    assert submit.slim(in_format_3()) == (in_format_3(), 0)


@pytest.mark.parametrize(
    "mended", [lambda data: restore.mend(data, MASTER)[0], lambda data: update.updated(data, MASTER)[0]]
)
def test_it_can_be_restored_and_brought_to_a_release(mended):
    notebook = mended(in_format_3())
    assert (notebook["nbformat"], "worksheets" in notebook) == (4, False)
    answers = {cell["id"]: "".join(cell["source"]) for cell in notebook["cells"]}
    assert "omega_n = 20.0" in answers["q2-11"]
    assert [cell["id"] for cell in notebook["cells"]] == [cell["id"] for cell in MASTER["cells"]]


def test_its_words_are_read(tmp_path):
    (tmp_path / NAME).write_bytes(in_format_3())
    saved = SavedWords(tmp_path, OURS.catalogue)
    saved.refresh()
    assert saved.notices == []
