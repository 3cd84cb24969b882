"""Notebooks are read with and without their outputs, repaired, and bounded."""

import json
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.answers import notebooks
from labcourse.answers.notebooks import UNREADABLE, Cell, Notebook, NotebookError
from labcourse.problems import Code, Problem
from labcourse.run import student_folder

FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])
KINDS = ["code", "markdown", "raw", UNREADABLE]
texts = st.text(st.characters(codec="utf-8"), max_size=20)
cells = st.builds(Cell, id=texts, grade_id=texts, kind=st.sampled_from(KINDS), source=texts)
pictures = st.dictionaries(texts, st.dictionaries(texts, texts, max_size=2), max_size=2)
all_cells = st.lists(
    cells | st.builds(Cell, id=texts, grade_id=texts, kind=st.just("markdown"), source=texts, attachments=pictures),
    max_size=5,
).map(tuple)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=12,
)
LIMITS = {name: getattr(notebooks, name) for name in ("MAX_FILE", "MAX_NOTEBOOK", "MAX_PICTURES", "MAX_PARTS")}


def made(*cells):
    return json.dumps({"cells": cells}, separators=(",", ":")).encode()


def a_cell(source="x = 1", outputs=(), kind="code", **more):
    return {"cell_type": kind, "id": "a", "source": source, "outputs": outputs} | more


def is_read(monkeypatch, data, **limits):
    """Check whether a notebook is read within some limits."""
    for name, value in (LIMITS | limits).items():
        monkeypatch.setattr(notebooks, name, value)
    try:
        return bool(Notebook.without_outputs(data).cells)
    except NotebookError as error:
        assert error.problem.parameters.get("most") or "nested" in error.problem.parameters["error"]
        return False


@given(given_cells=all_cells, extra=json_values, ascii=st.booleans(), indent=st.sampled_from([None, 1]))
def test_cells_are_the_same_whatever_stands_beside_them(given_cells, extra, ascii, indent):
    content = json.loads(notebooks.to_bytes(given_cells))
    for cell in content["cells"]:
        cell.update(outputs=extra, execution_count=3, extra=extra)
    content = {"metadata": extra, **content, "nbformat": 4}
    data = json.dumps(content, ensure_ascii=ascii, indent=indent).encode()
    assert Notebook.read(data).cells == Notebook.without_outputs(data).cells == given_cells


@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16"])
def test_large_outputs_take_no_more_memory_than_the_text_and_those_of_one_cell(coding):
    outputs = [{"text": ["line\n"] * 100_000}, {"image/png": "A" * 10_000_000}]
    text = made(*[a_cell(outputs=outputs)] * 4).decode().encode(coding)
    tracemalloc.start()
    notebook = Notebook.without_outputs(text)
    _now, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert ([cell.source for cell in notebook.cells], notebook.problems) == (["x = 1"] * 4, ())
    assert most < 80_000_000


@pytest.mark.parametrize("where", ["cells", "outputs"])
@pytest.mark.parametrize("piece", ["[],", "{},", '"",', "1,", "[", '{"a":'])
def test_countless_parts_are_refused(monkeypatch, piece, where):
    many = piece * 200_000
    text = f"[{many}1]" if piece[-1] == "," else many
    data = made(a_cell(outputs=None)).replace(b"null", text.encode())
    data = f'{{"cells": {text}}}'.encode() if where == "cells" else data
    assert not is_read(monkeypatch, data, MAX_PARTS=100_000)


@FITS
def test_bytes_of_a_notebook_with_its_outputs(monkeypatch, fits):
    data = made(a_cell(outputs=["x" * 1000]))
    assert is_read(monkeypatch, data, MAX_FILE=len(data) - (not fits)) == fits


@FITS
@pytest.mark.parametrize(("kind", "name"), [("code", "MAX_NOTEBOOK"), ("markdown", "MAX_PICTURES")])
def test_bytes_of_a_notebooks_cells(monkeypatch, fits, kind, name):
    limits = {"MAX_NOTEBOOK": 10_000, "MAX_PICTURES": 20_000}
    data = made(a_cell("x" * (limits[name] + (not fits)), kind=kind, outputs=["x" * 30_000]))
    assert is_read(monkeypatch, data, **limits) == fits
    if not fits:
        with pytest.raises(NotebookError, match=f"{kind} cells have more than {limits[name]} bytes"):
            Notebook.without_outputs(data)


@FITS
@pytest.mark.parametrize("outputs", [(), ("x" * 5000,)], ids=["small", "large"])
def test_bytes_of_a_notebooks_pictures(monkeypatch, fits, outputs):
    attachments = {"a.png": {"image/png": "A" * 600}}
    data = made(a_cell("see", outputs, "markdown", attachments=attachments))
    stored = len("a.png") + len("image/png") + 600
    monkeypatch.setattr(notebooks, "MAX_NOTEBOOK", 3000)
    monkeypatch.setattr(notebooks, "MAX_PICTURES", stored - (not fits))
    notebook = Notebook.without_outputs(data)
    (cell,) = notebook.cells
    assert (bool(cell.attachments), len(notebook.problems), cell.source) == (fits, not fits, "see")


@pytest.mark.parametrize("outputs", ["", ["x" * 2_000]])
def test_pictures_are_taken_as_far_as_they_fit_and_the_text_always_is(monkeypatch, outputs):
    monkeypatch.setattr(notebooks, "MAX_PICTURES", 1000)
    monkeypatch.setattr(notebooks, "MAX_NOTEBOOK", 2000)
    attached = [
        a_cell(f"see {place}", [], "markdown", attachments={"a.png": {"image/png": "A" * size}})
        for place, size in enumerate([600, 600, 300])
    ]
    notebook = Notebook.without_outputs(made(*attached, a_cell(outputs=outputs)))
    assert [cell.source for cell in notebook.cells[:3]] == ["see 0", "see 1", "see 2"]
    assert [bool(cell.attachments) for cell in notebook.cells[:3]] == [True, False, True]
    assert notebook.problems == (Problem.of(Code.PASTED_PICTURE_LEFT_OUT, picture="a.png", cell=2),)


def test_a_picture_in_a_text_as_colab_writes_it_costs_nobody_the_notebook():
    text = f"![plot](data:image/png;base64,{'A' * 400_000})"
    notebook = Notebook.without_outputs(made(a_cell(text, kind="markdown")))
    assert [cell.source for cell in notebook.cells] == [text]


@FITS
def test_parts_of_a_notebook(monkeypatch, fits):
    data = made(a_cell(outputs=["x"] * 50))
    parts = sum(data.count(sign) for sign in (b"[", b"{", b",", b'"'))
    assert is_read(monkeypatch, data, MAX_PARTS=parts - (not fits)) == fits


@FITS
def test_cells_of_a_notebook(monkeypatch, fits):
    monkeypatch.setattr(notebooks, "MAX_CELLS", 5)
    assert is_read(monkeypatch, made(*[a_cell()] * (5 + (not fits)))) == fits


@FITS
@pytest.mark.parametrize(("kind", "name"), [("code", "MAX_SOURCE"), ("markdown", "MAX_TEXT"), ("raw", "MAX_SOURCE")])
def test_characters_of_a_cell(monkeypatch, fits, kind, name):
    monkeypatch.setattr(notebooks, "MAX_SOURCE", 50)
    monkeypatch.setattr(notebooks, "MAX_TEXT", 70)
    size = getattr(notebooks, name) + (not fits)
    (cell,) = Notebook.read(made(a_cell("x" * size, kind=kind))).cells
    assert (cell.source == "x" * size) == fits and (cell.kind == UNREADABLE) != fits


def test_the_python_that_a_notebook_was_saved_with():
    about = {"language_info": {"name": "python", "version": "3.12.1"}, "widgets": {"state": {"version": "2.0"}}}
    data = json.dumps({"cells": [a_cell(outputs=["x" * 200])], "metadata": about}).encode()
    assert Notebook.without_outputs(data).python == "3.12.1"
    assert Notebook.without_outputs(made(a_cell())).python == ""


def test_the_check_at_home_names_what_would_be_refused_or_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(notebooks, "MAX_NOTEBOOK", 400)
    monkeypatch.setattr(notebooks, "MAX_PICTURES", 500)
    (tmp_path / "a.ipynb").write_bytes(made(a_cell("x" * 500)))
    picture = {"a.png": {"image/png": "A" * 600}}
    (tmp_path / "b.ipynb").write_bytes(made(a_cell("see", kind="markdown", attachments=picture)))
    work = student_folder.read(tmp_path, ["a.ipynb", "b.ipynb"])
    assert [*work.hand_in.notebooks] == ["b.ipynb"]
    told = [(Code.NOTEBOOK_UNREAD, "a.ipynb"), (Code.PASTED_PICTURE_LEFT_OUT, "b.ipynb")]
    assert [(problem.code, problem.where) for problem in work.problems] == told
