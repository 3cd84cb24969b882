"""The students' commands in a notebook: they run as programs, and not where a program runs the notebook."""

import sys
from types import SimpleNamespace

import pytest
from made_notebooks import code, notebook, saved

import rotflex.course.lab
from labcourse.run import by_program, from_notebook

PROGRAM = "import sys; print(*sys.argv[1:], sep='|'); print('→')"


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A session in a folder; the command is one that says what it was given."""
    for name in ("LABCOURSE_RUNNING", "PYTEST_CURRENT_TEST"):
        monkeypatch.delenv(name, raising=False)
    real = from_notebook.subprocess.Popen

    def popen(command, **options):
        assert command[:4] == [sys.executable, "-P", "-m", "rotflex"]
        assert options["cwd"] == tmp_path
        return real([sys.executable, "-c", PROGRAM, *command[4:]], **options)

    monkeypatch.setattr(from_notebook.subprocess, "Popen", popen)
    return rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)


def test_each_asks_the_command_and_shows_what_it_says(lab, capsys):
    for ask, given in (
        (lab.check, "check|--student|ada"),
        (lambda: lab.submit("bob", "carl"), "submit|--student|ada|--with=bob|--with=carl"),
        (lambda: lab.restore("02"), "restore|--|02"),
        (lab.restore, "restore|--"),
    ):
        ask()
        assert capsys.readouterr().out == f"{given}\n→\n"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("LABCOURSE_RUNNING", "check"),
        ("LABCOURSE_RUNNING", "grade"),
        ("PYTEST_CURRENT_TEST", "a/02.ipynb::Cell 3 (setup)"),
    ],
)
def test_where_a_program_runs_the_notebook_nothing_is_done_and_that_is_said(lab, capsys, monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    monkeypatch.setattr(from_notebook.subprocess, "Popen", None)
    for ask in (lab.check, lab.submit, lab.restore):
        ask()
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["lab.check()", "lab.submit()", "lab.restore()"]
    monkeypatch.delenv(name)
    monkeypatch.setenv("PYTEST_CURRENT_TEST", "tests/test_lab.py::test_x (call)")  # no notebook
    assert not by_program()


@pytest.fixture
def runs(monkeypatch):
    """As if a kernel ran a cell of this source."""

    def kernel(source):
        shell = SimpleNamespace(history_manager=SimpleNamespace(input_hist_raw=["", source]))
        monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))

    return kernel


def test_a_notebook_is_saved_where_its_running_cell_is_in_a_file_as_it_is_run(tmp_path, runs):
    (tmp_path / "a.ipynb").write_bytes(saved(notebook(code("one", "lab.check()"))))
    (tmp_path / "b.ipynb").write_text("broken")
    runs("lab.check()")
    assert from_notebook.is_saved(tmp_path, "one")
    assert not from_notebook.is_saved(tmp_path, "two")
    runs("lab.check()  # again")
    assert not from_notebook.is_saved(tmp_path, "one")
    # Other editors give no id, or one of their own.
    assert from_notebook.is_saved(tmp_path, "")
    assert from_notebook.is_saved(tmp_path, "vscode-notebook-cell:/a.ipynb#W1")


def test_what_is_not_saved_is_told_and_is_neither_packed_nor_restored(tmp_path, lab, capsys, runs, monkeypatch):
    runs("lab.check()")
    monkeypatch.setattr("labcourse.session.cell_now", lambda: "one")
    lab.check()
    said = capsys.readouterr().out
    assert said.startswith("This notebook is not saved as it stands here") and "check|--student|ada" in said
    lab.submit()
    lab.restore("02")
    said = capsys.readouterr().out
    assert said.count("Save it (Ctrl+S") == 2 and "|" not in said
