"""What is told of a hand-in that is made ready: what is untouched, what is there twice, what cannot be taken."""

import json

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import MAX_SOURCE, Notebook
from labcourse.answers.parts import Question, number
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.prepared import prepare
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem

CATALOGUE = Catalogue([Question(name, "1", "a", "", (), (number("x", "", None, "", ""),)) for name in ("1", "2")])


def code(name, source, solution=False):
    grading = {"nbgrader": {"grade_id": name, "solution": solution}}
    return {"id": name, "cell_type": "code", "source": source, "metadata": grading}


MASTER = [
    {"id": "text", "cell_type": "markdown", "source": "What is x?", "metadata": {}},
    code("setup", "lab = start()"),
    code("q1", "x = None", True),
    code("q1-answer", 'lab.answer("1", x=x)'),
    code("q2", "y = None", True),
    code("q2-answer", 'lab.answer("2", x=y)'),
]
BUNDLE = Bundle(b"", {"a.ipynb": {"cells": MASTER}}, {}, (), "0" * 64, CATALOGUE)


def made(*cells, bundle=BUNDLE, **files):
    notebooks = {"a.ipynb": Notebook.read(json.dumps({"cells": list(cells)}).encode()).cells}
    submission = Submission(student="ada", notebooks=notebooks, **files)
    prepare(submission, bundle, CATALOGUE)
    return submission


def answered(name, source):
    return [cell | {"source": source} if cell["id"] == name else cell for cell in MASTER]


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        (MASTER, True),
        (answered("text", "What is x"), True),
        (answered("q1", "  x = None\n"), True),
        (answered("q1", ""), True),
        (answered("q1", "x = 1"), False),
        (answered("q2", "y = 1"), False),
        ([*MASTER, code("mine", "print(1)")], False),
        ([*MASTER, code("mine", " \n")], True),
    ],
)
def test_a_notebook_in_which_nothing_is_written_is_told_and_no_other(cells, told):
    assert [*made(*cells).notes] == [Problem.of(Code.UNTOUCHED, "a.ipynb")] * told


def test_a_notebook_that_asks_for_nothing_is_not_called_untouched():
    cells = [cell for cell in MASTER if not cell["id"].startswith("q")]
    bundle = Bundle(b"", {"a.ipynb": {"cells": cells}}, {}, (), "0" * 64, CATALOGUE)
    assert made(*cells, bundle=bundle).notes == []


@pytest.mark.parametrize("times", [1, 2, 3])
def test_two_answer_cells_of_one_id_are_told_each_with_its_number(times):
    mine = [*answered("q1", "x = 1"), *[code("q2", "y = 2", True)] * (times - 1)]
    told = [note for note in made(*mine).notes if note.parameters.get("cell") == "q2"]
    assert told == [Problem.of(Code.CELL_REPEATED, "a.ipynb", cell="q2", times=times)] * (times > 1)


def test_two_cells_that_cannot_be_taken_are_both_told_with_their_places():
    long = "x" * (MAX_SOURCE + 1)
    cells = [code("one", long), *MASTER, code("two", long), code("three", "x" * MAX_SOURCE)]
    expected = (Problem.of(Code.CELL_TOO_LONG, "a.ipynb", cell=place, most=MAX_SOURCE) for place in (1, 8))
    assert made(*cells).problems == [*expected]


def claim(**changes):
    about = {"format": 2, "student": "Ada", "bench": {}, "software": "", "probe_seed": 1, "answers": {}, "cells": {}}
    return json.dumps(about | changes).encode()


ANSWERS = {"1": {"x": {"kind": "number", "value": 1.0}}, "2": {"x": {}}, "9": {"x": {}}}


@pytest.mark.parametrize(
    ("data", "cells", "is_unread"),
    [
        (None, None, False),
        (b"[]", None, True),
        (claim(student="bob", answers=ANSWERS), {"1": {"x": ""}, "2": {"x": ""}}, False),
        (claim(), {}, False),
        (claim(answers=ANSWERS, cells={"1": {"x": "q1"}}), {"1": {"x": "q1"}, "2": {"x": ""}}, False),
        (claim(answers=ANSWERS, cells={"1": {"x": "q" * 65}}), {"1": {"x": "q" * 64}, "2": {"x": ""}}, False),
    ],
)
def test_what_was_recorded_at_home_is_a_claim_whomever_it_names(data, cells, is_unread):
    found = made(*answered("q1", "x = 1"), answers_at_home=data)
    assert found.claim == cells
    assert [note.code for note in found.notes] == [Code.CLAIM_UNREAD] * is_unread


def test_an_answer_cell_for_code_that_became_text_is_run_and_noted_and_a_text_beside_a_piece_of_code_is_not():
    turned = [cell | ({"cell_type": "markdown"} if cell["id"] == "q1" else {}) for cell in answered("q1", "x = 1")]
    found = made(*turned)
    assert found.notes == [Problem.of(Code.CELL_IS_TEXT, "a.ipynb", cell="q1")]
    assert "x = 1" in [cell["source"] for cell in found.merged.notebooks["a.ipynb"]["cells"]]
    words = code("q1", "It bends.", True) | {"id": "new", "cell_type": "markdown"}
    beside = made(
        *[other for cell in answered("q1", "x = 1") for other in ([cell, words] if cell["id"] == "q1" else [cell])]
    )
    assert beside.notes == []
    assert "It bends." not in [cell["source"] for cell in beside.merged.notebooks["a.ipynb"]["cells"]]
