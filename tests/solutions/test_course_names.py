"""Names between the cells of a course: whatever a student keeps under a short name, the cells after it still run."""

from __future__ import annotations

import ast
import re
import string
import sys
from typing import Any

import matplotlib.pyplot as plt
import nbformat
import pytest
from checkout import ROOT

from labcourse.run import RUNNING
from rotflex import progress

NOTEBOOKS = sorted((ROOT / "solutions").glob("[01]*.ipynb"))
SHORT = {*string.ascii_letters, "data", "time", "fig", "ax"}
SOLUTION = re.compile(r"### BEGIN SOLUTION.*?### END SOLUTION", re.DOTALL)


def assigned(source: str) -> set[str]:
    """Return the names that code assigns."""
    names = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name))
    return {name.id for name in names if isinstance(name.ctx, ast.Store)}


@pytest.mark.scheduled
def test_every_short_name_that_no_question_asks_for_is_the_students(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(RUNNING, "check")
    monkeypatch.setenv(progress.SWITCH, "off")
    monkeypatch.setattr(sys, "displayhook", sys.displayhook)  # sympy.init_printing puts its own there
    broken = {}
    for path in NOTEBOOKS:
        names: dict[str, Any] = {"display": lambda *shown: None}
        asked: set[str] = set()
        for cell in nbformat.read(path, as_version=4).cells:
            if cell.cell_type != "code" or "instructor" in cell.metadata.get("tags", ()):
                continue
            try:
                exec(compile(cell.source, cell.id, "exec"), names)
            except Exception as error:
                broken[path.stem, cell.id] = repr(error)
            if "parameters" in cell.metadata.get("tags", ()):
                names["student"] = "ada"
            if SOLUTION.search(cell.source):
                asked |= assigned(SOLUTION.sub("pass", cell.source))
                names |= dict.fromkeys(SHORT - asked, object())
    plt.close("all")
    assert broken == {}
