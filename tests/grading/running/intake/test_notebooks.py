"""A notebook without its outputs, and as plain bytes and back."""

import json
import tracemalloc
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packings import WANTED

from labcourse.answers.handed_in import UNREADABLE, Cell, HandIn, NotebookError, cells_of
from labcourse.grading.running.intake import Item, limits, newest, notebooks

KINDS = ["code", "markdown", "raw", UNREADABLE]
texts = st.text(st.characters(codec="utf-8"), max_size=20)
cells = st.builds(Cell, id=texts, grade_id=texts, kind=st.sampled_from(KINDS), source=texts)
pictures = st.dictionaries(texts, st.dictionaries(texts, texts, max_size=2), max_size=2)
all_cells = st.lists(
    cells | st.builds(Cell, id=texts, grade_id=texts, kind=st.just("markdown"), source=texts, attachments=pictures),
    max_size=5,
).map(tuple)


@given(all_cells)
def test_cells_become_bytes_and_the_same_cells_again(given_cells):
    assert cells_of(notebooks.to_bytes(given_cells)) == given_cells


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=12,
)


@given(
    given_cells=all_cells,
    outputs=json_values,
    extra=json_values,
    ascii=st.booleans(),
    indent=st.sampled_from([None, 1]),
)
def test_what_is_passed_over_does_not_matter_whatever_it_is(given_cells, outputs, extra, ascii, indent):
    """A notebook with large outputs is gone through by a reader of its own: it finds what the usual one finds."""
    content = json.loads(notebooks.to_bytes(given_cells))
    for cell in content["cells"]:
        cell.update(outputs=outputs, execution_count=3, extra=extra)
    content = {"metadata": extra, **content, "nbformat": 4}
    text = json.dumps(content, ensure_ascii=ascii, indent=indent).encode()
    scanned = notebooks._Scanner(text).without_outputs()
    assert cells_of(scanned) == given_cells == cells_of(text)
    assert b'"outputs"' not in scanned or "outputs" in notebooks.to_bytes(given_cells).decode()


@given(data=st.data())
def test_damaged_text_is_told_and_nothing_else(data):
    text = bytearray(b'{"cells": [{"id": "q1", "source": ["x = 1"], "outputs": [{"a": [1, "]"]}]}], "metadata": {}}')
    for place in data.draw(st.lists(st.integers(0, len(text) - 1), max_size=4)):
        text[place] = data.draw(st.sampled_from(b'[]{}",:\\ x1\x00\xff'))
    try:
        cells_of(notebooks._Scanner(bytes(text)).without_outputs())
    except NotebookError as error:
        assert str(error).startswith("it is ") or "cell" in str(error)


def large(outputs, **cell):
    made = {"id": "q1", "cell_type": "code", "source": "x = 1", "metadata": {}, "outputs": outputs} | cell
    return json.dumps({"cells": [made]}).encode()


@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16"])
def test_large_outputs_are_passed_over_in_little_memory(coding):
    text = large([{"text": ["line\n"] * 100_000}, {"image/png": "A" * 30_000_000}]).decode().encode(coding)
    tracemalloc.start()
    (cell,), problems = notebooks.read(text)
    _now, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (cell.source, problems) == ("x = 1", [])
    assert most < 20_000_000 or coding != "utf-8"


@pytest.mark.timeout(120)
@pytest.mark.parametrize("piece", ["[],", "{},", '"",', "1,"])
def test_outputs_of_countless_parts_are_refused(piece, monkeypatch):
    monkeypatch.setattr(limits, "MAX_BRACKETS", 100_000)
    many = piece * (limits.MAX_NOTEBOOK // 2)
    if piece == "1,":  # numbers are passed over at once
        assert notebooks.read(large([]).replace(b"[]", f"[{many}1]".encode()))[0][0].source == "x = 1"
    with pytest.raises(NotebookError, match="more than 1000 cells"):
        notebooks.read(f'{{"cells": [{many}1]}}'.encode())
    if piece != "1,":
        with pytest.raises(NotebookError, match=r"more than 100000 parts"):
            notebooks.read(large([]).replace(b"[]", f"[{many}1]".encode()))


def test_a_picture_in_a_text_as_colab_writes_it_costs_nobody_the_notebook():
    text = f"![plot](data:image/png;base64,{'A' * 400_000})"
    cell = {"id": "a", "cell_type": "markdown", "source": text, "metadata": {}}
    (found,), problems = notebooks.read(json.dumps({"cells": [cell]}).encode())
    assert (found.source, problems) == (text, [])


def test_a_notebook_of_format_3_is_read():
    cells = [
        {"cell_type": "code", "input": ["x = 1\n", "x"], "prompt_number": 1, "metadata": {}, "outputs": []},
        {"cell_type": "markdown", "source": "text", "metadata": {}},
    ]
    old = {"nbformat": 3, "nbformat_minor": 0, "metadata": {"name": ""}, "worksheets": [{"cells": cells}]}
    found, _problems = notebooks.read(json.dumps(old).encode())
    assert [(cell.kind, cell.source) for cell in found] == [("code", "x = 1\nx"), ("markdown", "text")]


@pytest.mark.parametrize("outputs", ["", "x" * 2_000])
def test_pictures_are_taken_as_far_as_they_fit_and_the_text_always_is(monkeypatch, outputs):
    monkeypatch.setattr(limits, "MAX_PICTURES", 1000)
    monkeypatch.setattr(limits, "MAX_NOTEBOOK", 2000)
    made = [
        {"cell_type": "markdown", "source": f"see {place}", "attachments": {"a.png": {"image/png": "A" * size}}}
        for place, size in enumerate([600, 600, 300])
    ]
    text = json.dumps({"cells": [*made, {"cell_type": "code", "source": "", "outputs": outputs}]}).encode()
    found, problems = notebooks.read(text)
    assert [cell.source for cell in found[:3]] == ["see 0", "see 1", "see 2"]
    assert [bool(cell.attachments) for cell in found[:3]] == [True, False, True]
    assert len(problems) == 1 and "in its cell 2" in problems[0] and "too large" in problems[0]


names = st.sampled_from([*WANTED, "answers.json", "course.json", "h.py", "data/x.csv"])
items = st.builds(
    Item,
    name=names,
    content=st.integers(0, 99).map(lambda number: b'{"cells": [], "n": %d}' % number),
    received=st.integers(1, 5).map(lambda day: datetime(2026, 11, day, tzinfo=UTC)),
    source=st.sampled_from(["a.zip", "b.zip"]),
)


@given(st.lists(items, max_size=12))
def test_the_newest_of_each_name_counts_and_of_one_time_the_last(given_items):
    hand_in, notes = newest(given_items, WANTED)
    best = {}
    for place, item in enumerate(given_items):
        best[item.name] = max(best.get(item.name, (item.received, place)), (item.received, place))
    assert set(hand_in.notebooks) == set(best) & set(WANTED)
    assert set(hand_in.files) == set(best) & {"h.py", "data/x.csv"}
    for name, content in hand_in.files.items():
        assert content == given_items[best[name][1]].content
    assert (hand_in.claim is None) == ("answers.json" not in best)
    if hand_in.claim is not None:
        assert hand_in.claim == given_items[best["answers.json"][1]].content
    told = [note for note in notes if note.endswith("was not handed in.")]
    assert len(told) == (len(set(WANTED) - set(best)) if hand_in.notebooks else 0)


def test_nothing_makes_an_empty_hand_in():
    assert newest([], WANTED) == (HandIn(), [])
