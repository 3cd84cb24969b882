"""What the notebooks' code cells say stands in ``rotflex.workbook.texts``: all of it, and nothing that no cell says."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest
from checkout import ROOT

from rotflex.workbook import texts

NOTEBOOKS = [path for path in sorted((ROOT / "solutions").glob("*.ipynb")) if path.name < "90"]
SHOWS = {"print", "set_title", "set_xlabel", "set_ylabel", "supxlabel", "supylabel", "text", "annotate"}
SHOWN_AS = {"caption", "alt", "label", "title", "xlabel", "ylabel"}
#: Units, symbols and names of modes, which are the same in each language.
NO_WORDS = {"rad", "deg", "theta", "alpha", "omega", "full", "partial", "printed"}
#: The first cell that students are to copy: it shows how axes are labelled.
EXAMPLES = {"first-zoom"}


def code(path: Path) -> Iterator[tuple[str, ast.Module]]:
    """The course's code cells: id, and what is in it. Answers are the students', and other cells the instructor's."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        answer = cell["metadata"].get("nbgrader", {}).get("solution")
        if cell["cell_type"] == "code" and not answer and "instructor" not in cell["metadata"].get("tags", []):
            yield cell["id"], ast.parse("".join(cell["source"]))


def calls(path: Path) -> Iterator[ast.Call]:
    return (node for _cell, tree in code(path) for node in ast.walk(tree) if isinstance(node, ast.Call))


def said(path: Path) -> Iterator[tuple[str, set[str]]]:
    """The lines that a notebook's cells say, each with the names of the values that it is given."""
    for call in calls(path):
        if isinstance(call.func, ast.Name) and call.func.id == "said":
            yield ast.literal_eval(call.args[0]), {keyword.arg or "" for keyword in call.keywords}


def shown(path: Path) -> Iterator[int]:
    """The numbers of the figures that a notebook's cells take captions of."""
    for call in calls(path):
        if isinstance(call.func, ast.Attribute) and ast.unparse(call.func) == "said.figure":
            yield ast.literal_eval(call.args[0])


def words(node: ast.expr) -> list[str]:
    """Words that stand in what is shown, but for names that are put in, formulas, and units in brackets."""
    if isinstance(node, ast.IfExp):
        return words(node.body) + words(node.orelse)
    if isinstance(node, ast.BinOp):
        return words(node.left) + words(node.right)
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    text = "".join(part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str))
    text = re.sub(r"\$[^$]*\$|\([^()]*\)", " ", text)
    return [word for word in re.findall(r"(?<![\w/·])[A-Za-z]{3,}(?!\w)", text) if word not in NO_WORDS]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
class TestEachNotebook:
    def test_says_what_there_is_with_the_values_that_it_needs(self, path):
        lines = texts.of(path.name[:2])._lines
        for name, values in said(path):
            assert values == {field for _text, field, *_ in Formatter().parse(lines[name]) if field} or not values, name
            if not values:
                assert "{" not in re.sub(r"\$[^$]*\$", "", lines[name]), name

    def test_says_all_that_there_is(self, path):
        made = texts.of(path.name[:2])
        assert {name for name, _values in said(path)} == set(made._lines)
        assert sorted(shown(path)) == sorted(made._figures)

    def test_has_the_captions_of_its_figures_by_their_numbers(self, path):
        for number, figure in texts.of(path.name[:2])._figures.items():
            assert figure["caption"].startswith(f"**Figure {number}.** ")

    def test_has_no_words_in_its_code_cells(self, path):
        found = []
        for cell, tree in code(path):
            for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
                name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
                given = [*(call.args if name in SHOWS else ()), *(k.value for k in call.keywords if k.arg in SHOWN_AS)]
                found += [(cell, words(node)) for node in given if words(node) and cell not in EXAMPLES]
        assert found == []


def test_a_line_is_said_in_the_readers_language(monkeypatch):
    monkeypatch.setattr(texts, "_", {"{a} mm": "{a} Millimeter", "A figure.": "Ein Bild."}.__getitem__)
    made = texts.Texts({1: {"caption": "A figure."}}, {"length": "{a} mm"})
    assert made("length", a=3) == "3 Millimeter"
    assert made.figure(1) == {"caption": "Ein Bild."}
