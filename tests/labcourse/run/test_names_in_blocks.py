"""Names that an answer uses, or that a cell binds, wherever in a statement: by these a cell is run or left out."""

import builtins

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import CellError, CellReport, Reports
from labcourse.answers.notebooks import CODE, as_released
from labcourse.answers.parts import Question, number
from labcourse.run import skippable_cells
from labcourse.run.merge import merged
from labcourse.run.reasons import explain

#: Every place of every compound statement, and each kind of scope, in which a name can be read.
USES = {
    "for, what it goes through": "for i in n:\n    pass",
    "for, body": "for i in range(3):\n    x = n",
    "for, after a binding in the body": "for i in range(0):\n    n = 1\nx = n",
    "for, else": "for i in range(3):\n    pass\nelse:\n    x = n",
    "for, target": "for n.attribute in range(3):\n    pass",
    "for, index of the target": "items = {}\nfor items[n] in range(3):\n    pass",
    "while, test": "while n:\n    break",
    "while, body": "while True:\n    x = n\n    break",
    "while, after a binding in the body": "while False:\n    n = 1\nx = n",
    "while, else": "while False:\n    pass\nelse:\n    x = n",
    "if, test": "if n:\n    pass",
    "if, body": "if 1:\n    x = n",
    "elif, test": "if 0:\n    pass\nelif n:\n    pass",
    "elif, body": "if 0:\n    pass\nelif 1:\n    x = n",
    "else": "if 0:\n    pass\nelse:\n    x = n",
    "if, bound in one branch": "if 0:\n    n = 1\nx = n",
    "else, bound in one branch": "if 1:\n    pass\nelse:\n    n = 1\nx = n",
    "try, body": "try:\n    x = n\nexcept Exception:\n    pass",
    "try, kind of error": "try:\n    pass\nexcept n:\n    pass",
    "try, kinds of errors": "try:\n    pass\nexcept (ValueError, n.Error):\n    pass",
    "except, body": "try:\n    pass\nexcept Exception:\n    x = n",
    "try, else": "try:\n    pass\nexcept Exception:\n    pass\nelse:\n    x = n",
    "finally": "try:\n    pass\nfinally:\n    x = n",
    "try, after a binding in the body": "try:\n    n = 1\nfinally:\n    pass\nx = n",
    "except, after a binding in the body": "try:\n    n = 1\nexcept Exception:\n    x = n",
    "try*": "try:\n    pass\nexcept* n:\n    pass",
    "with, what is entered": "with n:\n    pass",
    "with, target": "with open('x') as n.file:\n    pass",
    "with, body": "with open('x') as f:\n    x = n",
    "with, before a binding in the body": "with open('x') as f:\n    x = n\n    n = 1",
    "with, after one that an error may have kept from being bound": (
        "from contextlib import suppress\nwith suppress(Exception):\n    n = 1\nx = n"
    ),
    "match, subject": "match n:\n    case _:\n        pass",
    "match, guard": "match 1:\n    case 1 if n:\n        pass",
    "match, value": "match 1:\n    case n.ONE:\n        pass",
    "match, body": "match 1:\n    case 1:\n        x = n",
    "match, after a binding in a case": "match 1:\n    case 2:\n        n = 1\nx = n",
    "list, element": "[n for i in range(3)]",
    "list, what it goes through": "[i for i in n]",
    "dict, key": "{n: i for i in range(3)}",
    "function, body": "def f():\n    return n",
    "function, default": "def f(a=n):\n    pass",
    "function, decorator": "@n\ndef f():\n    pass",
    "function within a function": "def f():\n    def g():\n        return n\n    return g",
    "function, global": "def f():\n    global n\n    n += 1",
    "asynchronous function": "async def f():\n    async with n as g:\n        pass",
    "lambda, body": "f = lambda: n",
    "class, base": "class A(n):\n    pass",
    "class, decorator": "@n\nclass A:\n    pass",
    "class, body": "class A:\n    x = n",
    "text with values": "f'{n}'",
    "changed": "n += 1",
    "annotated": "x: int = n",
    "annotation only": "n: int\nx = n",
    "named on the way": "(x := n)",
    "before it is bound": "x = n\nn = 1",
    "in its own value": "n = n + 1",
    "imported under another name": "import math as m\nx = n",
}


def cell(name, source, *tags):
    return {"id": name, "cell_type": "code", "source": source, "metadata": {"tags": list(tags)}}


def left_out(illustration, certain):
    return skippable_cells.skippable([cell("shown", illustration, "illustration"), cell("answer", certain)]) == {
        "shown"
    }


def test_what_an_answer_uses_anywhere_is_run_before_it():
    for source in USES.values():
        compile(source, "cell", "exec")
    assert [name for name, source in USES.items() if left_out("n = 1", source)] == []


#: Bound in full before it is read, so that nobody else's is.
OWN = {
    "assigned": "n = 1\nx = n",
    "unpacked": "(a, [n, *b]) = f()\nx = n",
    "for, target": "for n in range(3):\n    x = n",
    "for, targets": "for i, (j, n) in f():\n    x = n",
    "for, bound in the body before": "for i in range(3):\n    n = 1\n    x = n",
    "while, bound in the body before": "while True:\n    n = 1\n    x = n",
    "if, bound in both branches": "if f():\n    n = 1\nelse:\n    n = 2\nx = n",
    "if and elif": "if f():\n    n = 1\nelif g():\n    n = 2\nelse:\n    n = 3\nx = n",
    "with": "with f() as n:\n    x = n",
    "with, unpacked": "with f() as (n, m):\n    x = n",
    "try, bound in the body before": "try:\n    n = 1\n    x = n\nfinally:\n    pass",
    "list": "[n for n in range(3)]",
    "dict": "{n: m for n, m in f()}",
    "function, parameter": "def f(n):\n    return n",
    "function, its own": "def f():\n    n = 1\n    return n",
    "lambda, parameter": "f = lambda n: n",
    "function": "def n():\n    pass\nx = n",
    "asynchronous function": "async def n():\n    pass\nx = n",
    "class": "class n:\n    pass\nx = n",
    "imported": "import n\nx = n",
    "imported with more": "import n.more\nx = n",
    "imported as": "import m as n\nx = n",
    "imported from": "from m import n\nx = n",
    "imported from as": "from m import o as n\nx = n",
    "annotated": "n: int = 1\nx = n",
    "changed after": "n = 1\nn += 1",
    "attribute": "x.n",
}


def test_what_an_answer_binds_itself_is_no_use_of_anothers():
    assert [name for name, source in OWN.items() if not left_out("n = 1", source)] == []


#: Every way in which a cell can bind a name for those after it.
BINDS = {
    **{
        name: source
        for name, source in OWN.items()
        if source.startswith(("n = ", "(a", "import", "from", "def n", "cl"))
    },
    "asynchronous function": "async def n():\n    pass",
    "annotated": "n: int = 1",
    "for, target": "for n in range(3):\n    pass",
    "for, targets": "for i, (j, n) in f():\n    pass",
    "for, body": "for i in range(3):\n    n = i",
    "for, else": "for i in range(3):\n    pass\nelse:\n    n = 1",
    "while, body": "while f():\n    n = 1",
    "while, else": "while f():\n    pass\nelse:\n    n = 1",
    "if": "if f():\n    n = 1",
    "elif": "if f():\n    pass\nelif g():\n    n = 1",
    "else": "if f():\n    pass\nelse:\n    n = 1",
    "try": "try:\n    n = 1\nexcept Exception:\n    pass",
    "except": "try:\n    pass\nexcept Exception:\n    n = 1",
    "try, else": "try:\n    pass\nexcept Exception:\n    pass\nelse:\n    n = 1",
    "finally": "try:\n    pass\nfinally:\n    n = 1",
    "with": "with f() as n:\n    pass",
    "with, body": "with f():\n    n = 1",
    "match, captured": "match f():\n    case [n, *_]:\n        pass",
    "match, as": "match f():\n    case int() as n:\n        pass",
    "match, rest of a mapping": "match f():\n    case {1: 2, **n}:\n        pass",
    "match, body": "match f():\n    case 1:\n        n = 1",
    "named on the way": "print(n := 1)",
    "named in a list": "[n := i for i in range(3)]",
    "by a function, as global": "def f():\n    global n\n    n = 1\nf()",
    "changed": "n += 1",
    "all of a module": "from math import *",
}


def test_a_cell_that_binds_what_an_answer_uses_is_run_however_it_binds_it():
    assert [name for name, source in BINDS.items() if left_out(source, "x = n")] == []
    assert left_out("m = 1", "x = n")


NO_BINDING = {
    "list": "[n for n in range(3)]",
    "function's own": "def f(n):\n    m = n",
    "class's own": "class A:\n    n = 1",
    "lambda": "f = lambda n: n",
    "attribute": "a.n = 1",
    "item": "a['n'] = 1",
    "keyword": "f(n=1)",
    "only read": "print(n)",
}


def test_a_name_that_does_not_outlive_a_cell_is_not_what_an_answer_uses():
    assert [name for name, source in NO_BINDING.items() if not left_out(source, "x = n")] == []


@pytest.mark.parametrize("length", [0, 1])
def test_cells_are_looked_at_up_to_their_longest(length, monkeypatch):
    certain = "x = 1"
    assert left_out("n=1", certain.ljust(skippable_cells.LONGEST + length)) == (length == 0)
    monkeypatch.setattr(skippable_cells, "LONGEST_TOGETHER", len("n=1" + certain) - length)
    assert left_out("n=1", certain) == (length == 0)


def test_a_roundabout_way_to_names_has_all_run():
    reaching = {"globals", "locals", "vars", "dir", "eval", "exec", "compile", "__import__"}
    assert reaching <= set(dir(builtins)) and reaching <= skippable_cells._ROUNDABOUT
    for source in ("x = {}", "def f():\n    return {}"):
        assert [name for name in skippable_cells._ROUNDABOUT if left_out("n = 1", source.format(name))] == []


CATALOGUE = Catalogue([Question(name, "1", "1_one", "", (), (number("x", "", None, "", ""),)) for name in ("1", "2")])
CELLS = [{"id": "shared", "cell_type": CODE, "source": "pass", "metadata": {"tags": ["open"]}}]
for one in ("1", "2"):
    grading = {"nbgrader": {"grade_id": f"q{one}", "solution": True}}
    CELLS.append({"id": f"q{one}", "cell_type": CODE, "source": "", "metadata": grading})
    CELLS.append({"id": f"q{one}-answer", "cell_type": CODE, "source": f'lab.answer("{one}", x=x)', "metadata": {}})
MASTER = {"1_one.ipynb": {"cells": CELLS}}


def built_on_what_stopped(binding, use):
    made = merged(MASTER, {"1_one.ipynb": as_released(MASTER["1_one.ipynb"], {"q1": binding, "q2": use})})
    errors = {"q1": CellError("ZeroDivisionError", "division by zero", 1), "q2": CellError("TypeError", "None", 1)}
    cells = made.notebooks["1_one.ipynb"]["cells"]
    reports = Reports(tuple(CellReport("1_one.ipynb", one["id"], True, errors.get(one["id"]), ()) for one in cells), ())
    found = explain(MASTER, made, reports, set(), CATALOGUE, handed_in=("1_one.ipynb",), claim=None, seconds=60)
    return "ZeroDivisionError" in found.missing["2", "x"]


def test_what_stopped_is_told_of_what_builds_on_a_name_that_it_binds():
    bindings = {name: source for name, source in BINDS.items() if "import *" not in source}
    assert [name for name, source in bindings.items() if not built_on_what_stopped(source, "x = n")] == []
    for use in ("for i in range(3):\n    x = n", "try:\n    x = n\nfinally:\n    pass"):
        assert built_on_what_stopped("n = 1", use)
    assert not built_on_what_stopped("m = 1", "x = n")


@pytest.mark.parametrize(
    "comprehension", ["[i for i in n]", "{i for i in n}", "{i: i for i in n}", "{i: [j for j in i] for i in n}"]
)
def test_the_names_of_a_comprehension_are_its_own_whatever_python_runs(comprehension):
    """From Python 3.12 on, the table of symbols mixes those of a list with those of the cell around it."""
    table = skippable_cells._table(f"x = {comprehension}")
    assert {symbol.get_name() for symbol in table.get_symbols()} == {"x", "n"}
    assert [child.get_name() for child in table.get_children()] == ["genexpr"]
