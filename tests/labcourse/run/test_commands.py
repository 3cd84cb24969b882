"""The students' commands: what they say, what they write, and how they end."""

import json
import signal
from pathlib import Path

import pytest
from made_notebooks import answer, code, locked, notebook, saved, text
from typer.testing import CliRunner

from labcourse import courses
from labcourse.answers import notebooks
from labcourse.courses import InstalledCourse
from labcourse.problems import Code, Problem
from labcourse.run import check as checking
from labcourse.run.check import Checked, CheckedPart, CheckState
from rotflex import cli

MASTERS = {
    "01_swing.ipynb": notebook(
        text("title", "# Swing"),
        code("parameters", 'student = ""', ["parameters"]),
        locked("setup", "import rotflex.course.lab\nlab = rotflex.course.lab.start(student, quiet=True)"),
        answer("q1", "omega_n = None"),
        locked("q1-answer", 'lab.answer("2.11", omega_n=omega_n)'),
    ),
    "02_later.ipynb": notebook(text("end", "Done.")),
}


def rotflex(*arguments):
    """The exit code of a command, and its output with single spaces."""
    done = CliRunner().invoke(cli.app, [str(argument) for argument in arguments])
    return done.exit_code, " ".join(done.output.split())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A desk with a student's folder on it."""
    monkeypatch.delenv("LABCOURSE_RUNNING", raising=False)
    work = tmp_path / "desk" / "notebooks"
    work.mkdir(parents=True)
    for name, master in MASTERS.items():
        (work / name).write_bytes(saved(master))
    (work / "course.json").write_text('{"student": "ada"}')
    monkeypatch.setattr(notebooks, "masters", lambda: MASTERS)
    monkeypatch.setattr(courses, "notebooks", lambda: {"rotflex": {*MASTERS}})
    monkeypatch.chdir(tmp_path / "desk")
    return work


@pytest.fixture
def finds(monkeypatch):
    """Have a check find the answer in a state without running anything; note the folder and student it was asked of."""
    asked = []

    def prepare(state):
        def check(folder, masters, catalogue, *, student, report):
            asked.append((folder, student))
            report("01_swing.ipynb")
            why = Problem.of(Code.BUILDS_ON_UNANSWERED, on="2.9") if state is CheckState.MISSING else None
            return Checked("ada", folder, (CheckedPart("01_swing.ipynb", "2.11", "omega_n", state, why),))

        monkeypatch.setattr(checking, "check", check)
        return asked

    return prepare


@pytest.mark.parametrize(
    ("state", "code", "said"),
    [
        (CheckState.RECORDED, 0, "Complete: 1 question."),
        (CheckState.MISSING, 1, "2.11 omega_n: not recorded. It builds on 2.9, which is not answered."),
        (CheckState.DIFFERENT, 1, "recorded, but different from your page"),
        (CheckState.EMPTY, 1, "nothing yet: 01_swing"),
    ],
)
def test_check_and_submit_say_what_was_found_and_end_with_it(folder, finds, state, code, said):
    asked = finds(state)
    done, output = rotflex("check", "--student", "bob")
    assert (done, asked) == (code, [(folder.resolve(), "bob")])
    assert "Running 1 of 2: 01_swing.ipynb" in output and said in output
    done, output = rotflex("submit", "--with", "bob")
    assert done == code and said in output and "Receipt ada, bob" in output
    assert (folder.parent / "ada.zip").exists() and (folder.parent / "ada-receipts.txt").exists()


@pytest.mark.parametrize("words", [("check", "other"), ("submit", "other"), ("restore", "--folder", "other")])
def test_a_folder_without_the_notebooks_is_an_error_that_names_one(folder, words):
    Path("other").mkdir()
    done, output = rotflex(*words)
    assert done == 2 and "other" in output and "01_swing.ipynb" in output


def test_the_folder_is_this_one_or_the_usual_one_in_it(folder, finds, monkeypatch):
    asked = finds(CheckState.RECORDED)
    monkeypatch.chdir(folder)
    assert rotflex("check")[0] == 0 and asked[0][0] == folder.resolve()
    monkeypatch.chdir(folder.parent.parent)
    assert rotflex("check")[0] == 2


def test_submit_asks_whose_work_it_is_before_it_runs_anything(folder, finds):
    asked = finds(CheckState.RECORDED)
    (folder / "course.json").unlink()
    done, output = rotflex("submit")
    assert (done, asked) == (2, []) and "rotflex submit --student YOUR-ID" in output


def test_submit_without_a_check_runs_nothing_and_says_so(folder, finds, tmp_path):
    asked = finds(CheckState.RECORDED)
    done, output = rotflex("submit", "--no-check", "--out", tmp_path / "out")
    assert (done, asked) == (0, []) and "not checked, as you asked" in output
    assert (tmp_path / "out" / "ada.zip").exists()


def test_restore_says_what_it_restored_and_that_an_open_notebook_is_to_be_read_again(folder):
    own = json.loads((folder / "01_swing.ipynb").read_bytes())
    del own["cells"][0]
    (folder / "01_swing.ipynb").write_bytes(saved(own))
    for words, fragments in (
        (
            [],
            [
                "02_later.ipynb: all",
                "saved as 01_swing.before-restore.ipynb.",
                "gave back what was deleted: title",
                "Reload Notebook from Disk",
            ],
        ),
        (["01"], ["01_swing.ipynb: all that is the course's is there."]),
    ):
        done, output = rotflex("restore", *words)
        assert done == 0 and all(fragment in output for fragment in fragments)
        assert ("Reload" in output) == ("deleted" in output)
    assert rotflex("restore", "07")[0] == 2
    (folder / "01_swing.ipynb").write_text("{")
    done, output = rotflex("restore")
    assert done == 2 and "01_swing.ipynb cannot be read" in output


@pytest.mark.parametrize("command", ["check", "submit", "restore"])
def test_where_the_only_notebooks_are_the_students_own_nothing_can_be_compared(folder, finds, monkeypatch, command):
    """As with python -m rotflex in the course's folder: the package there knows no other notebooks."""
    finds(CheckState.RECORDED)
    monkeypatch.setattr(courses, "current", lambda: InstalledCourse("made", folder.parent))
    done, output = rotflex(command)
    assert done == 2 and "pip install ." in output
    if command == "submit":
        assert rotflex("submit", "--no-check")[0] == 0


@pytest.mark.parametrize("command", ["check", "submit", "restore"])
def test_where_a_program_runs_the_notebook_that_asks_nothing_is_done(folder, monkeypatch, command):
    monkeypatch.setenv("LABCOURSE_RUNNING", "check")
    before = sorted(folder.parent.rglob("*"))
    done, output = rotflex(command)
    assert (done, output.split()[0]) == (0, command)
    assert sorted(folder.parent.rglob("*")) == before


@pytest.mark.parametrize("first", [signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)])
def test_who_ends_a_run_is_heard_once_so_that_it_ends_in_order(folder, monkeypatch, first):
    endings = {signal.SIGTERM, first}
    ended = []

    def check(*_arguments, **_named):
        try:
            signal.raise_signal(first)
        finally:
            for again in endings:
                signal.raise_signal(again)
            ended.append("in order")

    monkeypatch.setattr(checking, "check", check)
    before = {number: signal.getsignal(number) for number in endings}
    done, output = rotflex("check")
    assert (done, ended) == (130, ["in order"]) and output.endswith("Stopped.")
    assert {number: signal.getsignal(number) for number in endings} == before
