"""No text and no files of a student's, of the greatest size that is allowed, hold up those who grade a class.

Each pattern, and each loop over a student's files, is run in a process with 5 s of processor time.
"""

import collections
import importlib
import os
import pkgutil
import re
import signal
import sys
import time
import traceback
from pathlib import Path, PurePosixPath
from re import _constants as kind
from re import _parser as parser

import pytest

pytest.importorskip("resource", reason="processor time is limited by the operating system")

import resource

import labcourse
from labcourse import patterns, safe_text
from labcourse.answers import notebooks, own_files, words
from labcourse.answers.notebooks import Cell
from labcourse.grading.gradebook import storable
from labcourse.grading.intake import archives, reading
from labcourse.grading.reports import markdown
from labcourse.run import alignment, skippable_cells

for module in pkgutil.walk_packages(labcourse.__path__, "labcourse."):
    if ".template" not in module.name and not module.name.endswith("__main__"):
        importlib.import_module(module.name)

COMMON = " a1\t\n_=-+.,;:(){}[]<>\\$!\"'*#/A\xa0"
CATEGORIES = {kind.CATEGORY_DIGIT: "1", kind.CATEGORY_SPACE: " \n", kind.CATEGORY_WORD: "a1_"}
REPEATS = (kind.MAX_REPEAT, kind.MIN_REPEAT, kind.POSSESSIVE_REPEAT)
MOST = 5  # s of processor time of each pattern, and of each loop over a student's files


def _signs(items):
    """Characters of a set; of one that excludes, all common ones."""
    if items[0][0] is kind.NEGATE:
        return COMMON
    found = ""
    for what, value in items:
        found += chr(value) if what is kind.LITERAL else chr(value[0]) if what is kind.RANGE else ""
        found += CATEGORIES.get(value, COMMON) if what is kind.CATEGORY else ""
    return "".join(dict.fromkeys(found))


def _parts(what, value):
    """The sequences within a piece of a pattern."""
    if what in REPEATS:
        return [value[2]]
    if what is kind.SUBPATTERN:
        return [value[3]]
    if what is kind.BRANCH:
        return value[1]
    if what in (kind.ASSERT, kind.ASSERT_NOT):
        return [value[1]]
    return [value] if what is kind.ATOMIC_GROUP else []


def _sample(nodes):
    """A text that a sequence matches, or nearly so."""
    text = ""
    for what, value in nodes:
        if what is kind.LITERAL:
            text += chr(value)
        elif what is kind.IN:
            text += _signs(value)[0]
        elif what in (kind.ANY, kind.NOT_LITERAL):
            text += "a"
        elif what not in (kind.ASSERT, kind.ASSERT_NOT) and (parts := _parts(what, value)):
            text += _sample(parts[0]) * (max(value[0], 1) if what in REPEATS else 1)
    return text


def _pieces(nodes, before=""):
    """What can be repeated, and what stands before it."""
    for place, (what, value) in enumerate(nodes):
        for end in range(place + 1, min(len(nodes), place + 4) + 1):
            yield before, _sample(nodes[place:end])
        if what in (kind.IN, kind.ANY, kind.NOT_LITERAL):
            yield from ((before, sign) for sign in (_signs(value) if what is kind.IN else COMMON))
        for part in _parts(what, value):
            yield from _pieces(list(part), before)
        before += _sample([(what, value)])


def repeated(pattern):
    """(before, piece, after): texts for a pattern are ``before + piece * many + after``."""
    text = pattern.pattern if isinstance(pattern.pattern, str) else pattern.pattern.decode("latin-1")
    nodes = list(parser.parse(text, pattern.flags & ~256 if pattern.flags & 256 else pattern.flags))
    found = [(before, piece) for before, piece in _pieces(nodes) if piece]
    single = dict.fromkeys(piece for _before, piece in found if len(piece) == 1)
    found += [("", _sample(nodes) or " "), *(("", one + other) for one in [*single][:8] for other in [*single][:8])]
    starts = dict.fromkeys([*found, *(("", piece) for _before, piece in found), ("x", " "), ("x", "\n")])
    return [(*one, after) for one in starts for after in ("", "\x01")]


def within(act, seconds=MOST):
    """Run a function in a process of its own with a limit on its processor time; its errors are printed."""
    sys.stdout.flush()
    process = os.fork()
    if process == 0:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            act()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    status = os.waitpid(process, 0)[1]
    stopped = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
    assert not stopped, f"it took more than {seconds} s of processor time"
    assert status == 0, "it failed; its error is printed above"


SCREENED = 400  # characters, at which the worst texts are found
ANYWHERE, FROM_THE_START = "finditer", {"match", "fullmatch"}


def uses():
    """Pattern → the methods by which it is used, by the sources of the modules that have it under a name."""
    found = {pattern: set() for pattern in patterns.LISTED}
    for module in [module for name, module in sys.modules.items() if name.startswith("labcourse.")]:
        text = Path(module.__file__).read_text(encoding="utf-8") if module.__file__ else ""
        for name, value in vars(module).items():
            if isinstance(value, re.Pattern) and value in found:
                found[value] |= set(re.findall(rf"\b{name}\.(\w+)\(", text))
    return {
        pattern: methods if methods and methods <= FROM_THE_START else {ANYWHERE, *methods & FROM_THE_START}
        for pattern, methods in found.items()
    }


USES = uses()


def hostile(pattern, before, piece, after, length):
    text = (before + piece * (length // len(piece) + 1))[: length - len(after)] + after
    return text if isinstance(pattern.pattern, str) else text.encode("latin-1", "replace")


def seconds(pattern, method, text):
    """How long a method takes on a text; what it finds is not kept."""
    begun = time.process_time()
    found = getattr(pattern, method)(text)
    if method == ANYWHERE:
        collections.deque(found, maxlen=0)
    return time.process_time() - begun


def attack(pattern, longest, methods=(ANYWHERE,)):
    """Use a pattern on the worst of its hostile texts, at their full length."""
    for method in sorted(methods):
        size = min(SCREENED, longest)
        worst = max(repeated(pattern), key=lambda text: seconds(pattern, method, hostile(pattern, *text, size)))
        seconds(pattern, method, hostile(pattern, *worst, longest))


@pytest.mark.parametrize(
    ("pattern", "longest"), [pytest.param(*item, id=str(item[0].pattern)[:40]) for item in patterns.LISTED.items()]
)
def test_a_pattern_on_its_worst_text(pattern, longest):
    within(lambda: attack(pattern, longest, USES[pattern]))


def test_a_pattern_that_takes_long_is_noticed():
    slow = re.compile(r"[;\n][\s\"]*(?=[=+])")  # its time grows with the square of the number of newlines
    with pytest.raises(AssertionError, match="more than 1 s"):
        within(lambda: slow.sub("", "\n" * 200_000), 1)


LONG = patterns.CELL
ENTRIES = archives.MAX_ENTRIES
CELLS = notebooks.MAX_CELLS
MASTER = [{"id": f"q{place}", "cell_type": "markdown", "metadata": {}, "source": "*Here.*"} for place in range(200)]
ANSWERS = [
    {**cell, "metadata": {"labcourse": {"question": str(place), "part": "why"}, "nbgrader": {"solution": True}}}
    for place, cell in enumerate(MASTER[:40])
]
NAMES = [f"0{number}_notebook.ipynb" for number in range(10)]


def many_names(count):
    """As many different names as fit into a cell: each is bound in turn."""
    return "\n".join(f"a{number}=1" for number in range(count))[: skippable_cells.LONGEST].rpartition("\n")[0]


LOOPS = {
    "pictures": lambda: words.lifted("![" * (LONG // 2)),
    "headings": lambda: words.headings("**\N{LOWER RIGHT PENCIL}" * (LONG // 3)),
    "lines of a cell": lambda: words.without_stub("\n" * notebooks.MAX_LINES, ANSWERS[0]),
    "blanks of an answer": lambda: markdown.as_html("x" + " " * (markdown.LONGEST - 2) + "x"),
    "lines of a table": lambda: safe_text.spreadsheet_cell("\n" * patterns.ANSWER),
    "stored": lambda: storable.text("\r\x01" * (patterns.ANSWER // 2)),
    "environments": lambda: own_files.choose(
        [(PurePosixPath(f"d{place}/{name}"), 1) for place in range(ENTRIES // 2) for name in ("pyvenv.cfg", "x.csv")],
        NAMES,
    ),
    "long names": lambda: reading._fitting(
        [f"{place:05}{'_a' * (archives.MAX_PATH // 2 - 6)}.ipynb" for place in range(ENTRIES)], NAMES, ".ipynb"
    ),
    "cells of one name": lambda: alignment.align(MASTER, [Cell("", "q1", "code", "x", {})] * CELLS),
    "cells of one text": lambda: alignment.align(ANSWERS, [Cell("", "", "markdown", "*Here.*", {})] * CELLS),
    "answers in words": lambda: words.written(
        ANSWERS,
        [
            Cell(cell["id"], "", "markdown", ("*" * 300 + "\r\n") * (notebooks.MAX_LINES // 15), {})
            for cell in ANSWERS[:15]
        ],
    ),
    "names of cells": lambda: skippable_cells.skippable(
        {"id": str(place), "cell_type": "code", "metadata": {}, "source": f"b{place}=1\n{many_names(4000)[:-9]}"}
        for place in range(5)
    ),
    "parts of a notebook": lambda: notebooks.Notebook.without_outputs(
        b'{"cells": [], "metadata": {"x": [' + b"{}," * (notebooks.MAX_PARTS // 2 - 20) + b"1]}}"
    ),
}


@pytest.mark.parametrize("loop", LOOPS)
def test_a_loop_over_a_students_work_at_its_largest(loop):
    within(LOOPS[loop])
