"""Code that messages, docstrings and notebooks recommend takes no name that the notebooks' own cells need later."""

from __future__ import annotations

import ast
import json
import re

from checkout import ROOT

_OPENED = re.compile(r"with lab\.bench\([^)]*\) as (\w+)")


def begun_with():
    """Names that the cells which every notebook begins with bind."""
    names = set()
    for path in (ROOT / "solutions").glob("0*.ipynb"):
        cells = {cell["id"]: "".join(cell["source"]) for cell in json.loads(path.read_text("utf-8"))["cells"]}
        for cell in ("parameters", "setup"):
            tree = ast.parse(cells[cell])
            names |= {
                node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            }
            names |= {alias.asname or alias.name for node in ast.walk(tree) for alias in getattr(node, "names", ())}
    return names


def test_the_bench_that_is_opened_does_not_take_the_name_of_its_address():
    students = [path for path in (ROOT / "rotflex").rglob("*.py") if "instructor" not in path.parts]
    texts = [path.read_text("utf-8") for path in (*students, *(ROOT / "solutions").glob("*.ipynb"))]
    recommended = {name for text in texts for name in _OPENED.findall(text)}
    assert "on_the_bench" in recommended
    assert {"bench", "lab", "student"} <= begun_with()
    assert not recommended & begun_with()
