"""Nothing is decided by words: a class is graded twice, and the second time each sentence is the code alone.

Marks, states, what there is to do, exit codes and tables are the same. The command is run as a program of its own, so
that the processes in which it marks have no other words, either. What runs in a sandbox keeps its words: it makes none.
"""

import csv
import json
import os
import subprocess
import sys

import pytest
import troubled_class
from checkout import ROOT
from command_line import rotflex
from sentences_as_codes import AS_CODES

import labcourse.sentences
from labcourse.grading import course as courses
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.overview import class_overview
from labcourse.grading.todo import todo
from labcourse.problems import Code, codes
from labcourse.student_id import GRADEBOOK_FILE, GRADES_FILE, INTAKE_FILE

WITH_SENTENCES, WITH_CODES = "rotflex.cli", "sentences_as_codes"
PROGRAMS = (WITH_SENTENCES, WITH_CODES)


@pytest.fixture
def say_by(monkeypatch):
    """Let problems be said, here and in programs that are started, by sentences or by codes."""
    paths = (str(ROOT), str(ROOT / "tests" / "helpers"), os.environ.get("PYTHONPATH", ""))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    sentences = labcourse.sentences._SENTENCES

    def choose(program):
        monkeypatch.setattr(labcourse.sentences, "_SENTENCES", AS_CODES if program == WITH_CODES else sentences)

    return choose


def table(path, *left_out):
    """The rows of a table without some of its columns; none without a file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8-sig", newline="") as file:
        return [{name: cell for name, cell in row.items() if name not in left_out} for row in csv.DictReader(file)]


def decided(book_file, folder, course):
    """What was decided about a class: marks, states of work, what there is to do, and the tables."""
    with Gradebook(book_file) as book:
        marks = {
            graded.run.student: [(*mark.where, mark.status, mark.points, mark.out_of) for mark in graded.marks]
            for graded in book.all_current()
        }
        overview = class_overview(book, course, folder)
    return {
        "marks": marks,
        "states": {
            one.id: [(work.notebook, work.state, work.counts, work.is_unread, work.days_late) for work in entry.works]
            for one in overview.of.students
            for entry in one.account.assignments
        },
        "to do": [(task.what.code, task.who, task.worth, task.command) for task in todo(overview.of)],
        "grades": table(folder / GRADES_FILE, "notes"),
        "intake": table(folder / INTAKE_FILE, "why"),
    }


@pytest.fixture(scope="module")
def troubled(tmp_path_factory):
    """The course, and the words with which the command grades its class."""
    folder = tmp_path_factory.mktemp("troubled")
    source = troubled_class.course(folder / "course")
    return folder, source, troubled_class.hand_in(source, folder / "in")


def run(program, *words):
    command = [sys.executable, "-m", program, *map(str, words)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=False)


def grade_troubled(program, troubled):
    """What is decided about the class with trouble of many kinds."""
    folder, source, tables = troubled
    out = folder / program.replace(".", "-")
    assert rotflex("roster", out, tables["roster"]).exit_code == 0
    how = ("--jobs", 2, "--cell-timeout", 2, "--probe-seed", 7, "--times", tables["times"], "--json")
    done = run(program, "grade", out, folder / "in", "--solutions", source, *how)
    status = rotflex("status", out, "--solutions", source)
    found = decided(out / GRADEBOOK_FILE, out, courses.load(source))
    ended = json.loads(done.stdout.splitlines()[-1])
    return {**found, "exit codes": (done.returncode, status.exit_code), "ended": ended}


#: Trouble that the class has, so that it stays what it is.
KINDS = {
    *(Code.NOTEBOOK_UNREAD, Code.REPORT_UNREAD, Code.TOOK_TOO_LONG, Code.MODULE_MISSING, Code.FILE_NOT_FOUND),
    *(Code.REFUSED, Code.BUILDS_ON_REFUSED, Code.OTHER_STUDENT_NAMED, Code.RECORDED_AT_HOME, Code.MISSING_HERE),
    *(Code.PARTNERS_UNCONFIRMED, Code.PARTNER_NOT_CONFIRMED, Code.UNTOUCHED, Code.ONE_OF_SEVERAL, Code.NOT_ON_ROSTER),
    *(Code.KEY_FAILED, Code.KEY_HAS_FAULT),
}


def told(book_file):
    """The codes of all that is said about runs and marks."""
    with Gradebook(book_file) as book:
        runs = [*book.all_current()]
    reasons = [mark.reason for one in runs for mark in one.marks]
    return set().union(
        *map(codes, reasons), *(codes(said) for one in runs for said in (*one.run.problems, *one.run.notes))
    )


@pytest.mark.usefixtures("sandbox")
def test_a_class_with_trouble_of_many_kinds(troubled, say_by):
    found = {}
    for program in PROGRAMS:
        say_by(program)
        found[program] = grade_troubled(program, troubled)
    assert found[WITH_SENTENCES] == found[WITH_CODES]
    assert found[WITH_SENTENCES]["exit codes"] == (1, 0)
    for program in PROGRAMS:
        assert told(troubled[0] / program.replace(".", "-") / GRADEBOOK_FILE) >= KINDS
