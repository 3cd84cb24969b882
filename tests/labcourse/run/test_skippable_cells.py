"""Cells that only show something are left out of a run, unless a name that they bind is used; nothing else changes."""

import json

import pytest
from made_courses import WITH_OPTIONAL

from labcourse.answers.words import where_of
from labcourse.grading.course_check import solved_cells
from labcourse.grading.running import bundle, runner
from labcourse.run import skippable_cells
from labcourse.run.merge import merged

#: Places of compound statements, and kinds of scope, in which a name ``n`` is read that an earlier cell has bound.
USES = """
for i in n: pass
for i in range(3): x = n
for i in range(0): n = 1;;x = n
for i in range(3): pass;;else: x = n
for n.attribute in range(3): pass
items = {};;for items[n] in range(3): pass
while n: break
while False: pass;;else: x = n
if n: pass
if 0: pass;;elif n: pass
if 0: pass;;elif 1: x = n
if 1: pass;;else: n = 1;;x = n
try: pass;;except n: pass
try: pass;;except Exception: pass;;else: x = n
try: pass;;finally: x = n
try: n = 1;;finally: pass;;x = n
try: pass;;except* n: pass
with n: pass
with open('x') as n.file: pass
from contextlib import suppress;;with suppress(Exception): n = 1;;x = n
match n:;; case _: pass
match 1:;; case 1 if n: pass
match 1:;; case n.ONE: pass
[n for i in range(3)]
def f(): return n
def f(a=n): pass
@n;;def f(): pass
def f():;; global n;; n += 1
f = lambda: n
class A(n): pass
class A: x = n
f'{n}'
n += 1
n: int;;x = n
(x := n)
n = n + 1
"""
#: Bound in full before it is read, so that nobody else's is.
OWN = """
n = 1;;x = n
(a, [n, *b]) = f();;x = n
for n in range(3): x = n
for i, (j, n) in f(): x = n
while f(): n = 1; x = n
if f(): n = 1;;else: n = 2;;x = n
with f() as (n, m): x = n
try: n = 1; x = n;;finally: pass
[n for n in range(3)]
def f(n): return n
def f():;; n = 1;; return n
def n(): pass;;x = n
class n: pass;;x = n
import n.more;;x = n
from m import o as n;;x = n
n = 1;;n += 1
x.n
"""
#: Ways in which a cell can bind a name for those after it.
BINDS = """
n = 1
(a, [n, *b]) = f()
import m as n
def n(): pass
for i, (j, n) in f(): pass
while f(): pass;;else: n = 1
with f() as n: pass
match f():;; case {1: 2, **n}: pass
print(n := 1)
def f():;; global n;; n = 1;;f()
n += 1
from math import *
"""
#: A name that does not outlive a cell, or is no name.
NO_BINDING = """
[n for n in range(3)]
def f(n): m = n
class A: n = 1
a.n = 1; a['n'] = 1; f(n=1)
print(n)
"""


def cases(table):
    return [line.replace(";;", "\n") for line in table.strip().splitlines()]


def cell(name, source, *tags):
    return {"id": name, "cell_type": "code", "source": source, "metadata": {"tags": list(tags)}}


def left_out(answer, shown="picture = 1", another="print(picture)"):
    """What is left out of a notebook of an answer cell and two illustrations, the second of which uses the first."""
    illustrations = (cell("one", shown, "illustration"), cell("two", another, "illustration"))
    return skippable_cells.skippable([*illustrations, cell("answer", answer)])


def test_a_cell_is_run_where_an_answer_uses_a_name_that_it_binds_and_left_out_elsewhere():
    for source in cases(USES):
        compile(source, "cell", "exec")
    assert [source for source in cases(USES) if "one" in left_out(source, "n = 1", "0")] == []
    assert [source for source in cases(BINDS) if "one" in left_out("x = n", source, "0")] == []
    assert [source for source in cases(OWN) if "one" not in left_out(source, "n = 1", "0")] == []
    assert [source for source in cases(NO_BINDING) if "one" not in left_out("x = n", source, "0")] == []


def test_what_an_answer_uses_and_what_that_uses_in_turn_is_run():
    assert left_out("x = 1\nprint(x)") == {"one", "two"}
    assert left_out("x = picture") == {"two"}
    assert left_out("y = second", another="second = picture") == set()


@pytest.mark.parametrize("source", [*sorted(skippable_cells._ROUNDABOUT), "%time picture", "!ls", "x = = 1"])
def test_where_it_cannot_be_read_off_everything_is_run(source):
    assert left_out(f"x = {source}" if source.isidentifier() else source) == set()


@pytest.mark.parametrize("length", [0, 1])
def test_cells_are_looked_at_up_to_their_longest(length, monkeypatch):
    assert ("one" in left_out("x = 1".ljust(skippable_cells.LONGEST + length), "n=1")) == (length == 0)
    monkeypatch.setattr(skippable_cells, "LONGEST_TOGETHER", len("n=1" + "0" + "x = 1") - length)
    assert ("one" in left_out("x = 1", "n=1", "0")) == (length == 0)


@pytest.mark.scheduled
def test_answers_are_the_same_to_the_last_bit_with_and_without_illustrations(sandbox):
    """The whole course, solved. What an illustration draws, or runs on a bench, must leave no trace."""
    made = bundle.build(WITH_OPTIONAL)
    solved = solved_cells(WITH_OPTIONAL, made.pristine)
    settings = {"parameters": made.parameters, "imports": made.imports}
    every, needed = (merged(made.pristine, solved, every_cell).notebooks for every_cell in (True, False))
    runs = [runner.run(made.packed, runner.Job("ada", one, 5, **settings)) for one in (every, needed)]
    assert [problems for _files, problems in runs] == [(), ()]
    answers = [files["answers.json"] for files, _problems in runs]
    cells = [one for notebook in made.pristine.values() for one in notebook["cells"]]
    in_words = {where[0] for one in cells if (where := where_of(one))}
    recorded = json.loads(answers[0])["answers"].keys()
    assert recorded | in_words == WITH_OPTIONAL.catalogue.everything.keys()
    assert answers[0] == answers[1]
    counts = [sum(len(one["cells"]) for one in notebooks.values()) for notebooks in (every, needed)]
    assert counts[1] < 0.65 * counts[0]
