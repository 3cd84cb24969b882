"""The tool that puts faults into the code: what it makes is Python, differs from before, and keeps every line."""

from __future__ import annotations

import ast

import pytest
from checkout import ROOT

from benchmarks import fault_operators
from benchmarks.fault_operators import OPERATORS, faults

SOURCE = '''"""A docstring of 3."""

from typing import TYPE_CHECKING

__all__ = ["f"]
if TYPE_CHECKING:
    x = 1 + 1


def f(a: int = 7, *, b: "int | None" = None) -> list[int]:
    """Another, of 4 < 5."""
    if a < 3 and b is None:
        raise ValueError("no" + f"{a + 1}")
    found = [
        one
        for one in range(2, a)
        if not one % 2
    ]
    g(
        found,
        b,
    )
    return found
'''


def changes():
    return {(one.operator, " ".join(one.old.split()), " ".join(one.new.split())) for one in faults(SOURCE, "a.py")}


def test_each_operator_makes_its_faults():
    found = changes()
    assert {operator for operator, _old, _new in found} == set(OPERATORS)
    for one in (
        ("comparison", "a < 3", "(a <= 3)"),
        ("comparison", "b is None", "(b is not None)"),
        ("constant", "7", "8"),
        ("arithmetic", "one % 2", "(one * 2)"),
        ("negation", "a < 3 and b is None", "(a < 3 or b is None)"),
        ("negation", "not one % 2", "bool(one % 2)"),
        ("removed statement", "g( found, b, )", "pass"),
        ("swapped arguments", "range(2, a)", "range(a, 2)"),
        ("swapped arguments", "g( found, b, )", "g(b, found)"),
    ):
        assert one in found
    removed = [old for operator, old, _new in found if operator == "removed statement"]
    assert len(removed) == 2 and any(old.startswith("raise") for old in removed)


def test_what_changes_nothing_is_left_alone():
    touched = {one.line for one in faults(SOURCE, "a.py")}
    assert touched.isdisjoint({1, 3, 5, 6, 7, 11})
    assert not any("int" in one.old and ":" in one.old for one in faults(SOURCE, "a.py"))


@pytest.mark.parametrize("file", ["rotflex/instructor/batch.py", "rotflex/hil/bench.py", "rotflex/courseware/words.py"])
def test_every_fault_is_python_on_the_same_lines(file):
    source = (ROOT / file).read_text(encoding="utf-8")
    before, lines = ast.dump(ast.parse(source)), source.count("\n")
    found = faults(source, file)
    assert len(found) > 40
    for one in found:
        changed = one.put_into(source)
        assert ast.dump(ast.parse(changed)) != before and changed.count("\n") == lines
        assert changed.splitlines()[: one.line - 1] == source.splitlines()[: one.line - 1]
        assert changed.splitlines()[one.last :] == source.splitlines()[one.last :]


def test_the_same_source_gives_the_same_faults():
    assert fault_operators.faults(SOURCE, "a.py") == fault_operators.faults(SOURCE, "a.py")
