"""Cells that were written to stop, or to slow, those who read them: in time and memory that an honest notebook takes.

What they are read by runs beside the class that is graded, in the same process, and has no limits but its own.
"""

import json
import subprocess
import sys

import pytest
from checkout import ROOT

from labcourse.answers import notebooks
from labcourse.answers.cell_reports import CellError, CellReport, CellReports
from labcourse.answers.notebooks import CODE, Cell
from labcourse.problems import Code, Problem
from labcourse.run.merge import merged
from labcourse.run.reasons import explain
from labcourse.sentences import sentences
from rotflex.course.questions import CATALOGUE

SECONDS = 60.0  # after which a test that hangs ends; each of these took minutes, or would
NAME = "02_finding_stiffness.ipynb"


def answer(question, parts):
    grading = {"nbgrader": {"grade_id": f"q{question}", "solution": True}}
    call = f'lab.answer("{question}", {", ".join(f"{part}={part}" for part in parts)})'
    return [
        {"id": f"q{question}", "cell_type": CODE, "source": "", "metadata": grading},
        {"id": f"q{question}-answer", "cell_type": CODE, "source": call, "metadata": {}},
        {"id": f"look-{question}", "cell_type": CODE, "source": "look(x)", "metadata": {"tags": ["illustration"]}},
    ]


QUESTIONS = ("2.11", "2.12")
NOTHING = CellReports()
PRISTINE = {NAME: {"cells": [cell for one in QUESTIONS for cell in answer(one, CATALOGUE.find(one).names)]}}


def explained(cells, reports=NOTHING, claim=None):
    of_the_course = notebooks.as_released(PRISTINE[NAME])
    mine = (*of_the_course[:1], *cells, *of_the_course[1:])
    made = merged(PRISTINE, {NAME: mine})
    return explain(PRISTINE, made, reports, set(), CATALOGUE, handed_in=[NAME], claim=claim)


SIZES = {190_000: 26, 19_000: 5}  # characters of a cell, how many such cells: of the second sort, all is looked at
TRAPS = {
    # Python copies all names of a function for each function in it.
    "names and lambdas": lambda n: f"def f():\n {_names(n // 18, 'a{}=0', ';')}\n [{'lambda:0,' * (n // 19)}]",
    "global names": lambda n: f"def f():\n global {_names(n // 15, 'a{}', ',')}\n [{'lambda:0,' * (n // 19)}]",
    "names one by one": lambda n: _names(n // 14, "a{0}=b{0}", "\n"),
    "minus": lambda n: "-" * n + "1",
    "not": lambda n: "not " * (n // 4) + "1",
    "lambdas in each other": lambda n: "lambda:" * (n // 7) + "0",
    "attributes": lambda n: "a" + ".a" * (n // 2),
    "calls": lambda n: "a" + "()" * (n // 2),
    "sums": lambda n: "1" + "+1" * (n // 2),
    "powers": lambda n: "1" + "**1" * (n // 3),
    "elif": lambda n: "if a:\n 0\n" + "elif a:\n 0\n" * (n // 12),
    "brackets": lambda n: "(" * n,
    "loops in a list": lambda n: "[1 " + "for x in a " * (n // 11) + "]",
    "functions in each other": lambda n: "".join(" " * i + f"def f{i}():\n" for i in range(99)) + " " * 99 + "0",
    "digits": lambda n: "9" * n,
    "lines": lambda n: ".\n" * (n // 2),
    "no characters": lambda n: "a\0b\ud7ff\ufeff\u202e",
}


def _names(count, form, between):
    return between.join(form.format(number) for number in range(count))


#: Each for itself, as one of them may end the process: what a stack of Python's parser cannot bear, it dies of.
PROGRAM = """
import json, resource, sys, threading
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
sys.path[:0] = json.loads(sys.argv[1])
from test_hostile_cells import SIZES, TRAPS, explained
from labcourse.answers.notebooks import CODE, Cell
def read():
    for size, count in SIZES.items():
        explained([Cell(f"c{place}", "", CODE, TRAPS[sys.argv[2]](size)) for place in range(count)])
    print("read")
thread = threading.Thread(target=read)  # as graders do
thread.start()
thread.join()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of memory are set as Unix does it")
@pytest.mark.parametrize("name", TRAPS)
def test_a_notebook_full_of_one_trap_is_merged_and_explained_in_little_time(name):
    assert all(len(TRAPS[name](size)) <= notebooks.MAX_SOURCE for size in SIZES)
    path = json.dumps([str(ROOT), str(ROOT / "tests" / "helpers"), str(ROOT / "tests" / "labcourse" / "run")])
    command = [sys.executable, "-c", PROGRAM, path, name]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS)
    assert (done.returncode, done.stdout) == (0, "read\n"), done.stderr


@pytest.mark.slow
@pytest.mark.timeout(SECONDS)
def test_a_thousand_cells_of_which_each_builds_on_all_before_it():
    cells = [
        Cell(f"c{i}", "", CODE, f"x{i} = [{', '.join(f'x{j}' for j in range(max(0, i - 20), i))}]") for i in range(900)
    ]
    stopped = [
        CellReport(NAME, cell.id, True, CellError("E", "m") if place % 50 == 0 else None)
        for place, cell in enumerate(cells)
    ]
    said = explained(cells, CellReports(tuple(stopped)))
    assert (len(said.harmless), said.stops) == (18, ())  # one of 50 stops, no answer uses it, and names are too many


def test_answers_that_say_they_lack_each_other_have_an_end():
    wheres = [(number, part) for number in QUESTIONS for part in CATALOGUE.find(number).names]
    lacked = tuple(wheres[1:] + wheres[:1])
    reports = CellReports(tuple(CellReport(NAME, f"q{number}-answer", True, None, lacked) for number in QUESTIONS))
    assert explained([], reports).missing[wheres[0]] == Problem.of(Code.BUILDS_ON_UNANSWERED, on="2.11")


ODD_IDS = ["../../x", "/etc/passwd", "C:\\x", "<script>", "\x1b[2J", "\u202e", "a" * 65, "a b", "", "q2.11-answer", "é"]


def test_cells_are_run_by_ids_that_can_do_no_harm_and_tell_them_apart():
    cells = [Cell(name, "", CODE, "pass") for name in ODD_IDS * 80]
    forged = [Cell("q2.11-answer", "q2.11-answer", CODE, "forge()") for _ in range(5)]
    made = merged(PRISTINE, {NAME: (*forged, *notebooks.as_released(PRISTINE[NAME]), *cells)}).notebooks[NAME]["cells"]
    assert [cell["source"] for cell in made if cell["id"] == "q2.11-answer"] == [PRISTINE[NAME]["cells"][1]["source"]]
    names = [cell["id"] for cell in made]
    assert len(set(names)) == len(names) > 800
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-") for name in names)


def test_a_claim_that_is_all_names_is_told_in_few_words():
    claim = {number: dict.fromkeys(CATALOGUE.find(number).names, "<b>\x1b[2J" * 100) for number in QUESTIONS}
    assert all(len(one) < 300 for one in sentences(explained([], claim=claim).lost))
