"""What Windows and macOS do differently, as far as it can be shown elsewhere: files in use, signs, names, modules."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
from checkout import ROOT
from made_notebooks import answer, locked, notebook, saved
from typer.testing import CliRunner

from labcourse import course_file, files, lab_command
from labcourse.answers import answers, own_files
from labcourse.answers.words import SavedTexts
from rotflex import cli
from rotflex.course.lab import Lab
from rotflex.course.questions import CATALOGUE

NAME = "00_start.ipynb"


@pytest.fixture
def busy(monkeypatch):
    """Makes a function of a module fail so many times, as where another program has the file open."""
    monkeypatch.setattr(files, "_MAY_BE_OPEN", True)
    monkeypatch.setattr(files, "_PAUSE", 0.001)

    def make(owner, name, times):
        real, left = getattr(owner, name), [times]

        def refuse(*arguments):
            if left[0]:
                left[0] -= 1
                raise PermissionError(13, "The process cannot access the file")
            return real(*arguments)

        monkeypatch.setattr(owner, name, refuse)
        return left

    return make


def test_an_answer_is_kept_though_another_program_has_the_file_open_for_a_moment(busy, tmp_path):
    lab = Lab("ada", "virtual", tmp_path, quiet=True)
    left = busy(os, "replace", 3)
    lab.answer("0.1", resolution=0.00153)
    assert left == [0]
    assert Lab("ada", "virtual", tmp_path, quiet=True).value("0.1", "resolution") == 0.00153


def test_answers_and_words_are_read_though_they_are_being_replaced(busy, tmp_path):
    Lab("ada", "virtual", tmp_path, quiet=True).answer("0.1", resolution=0.00153)
    (tmp_path / NAME).write_bytes(saved(notebook(answer("q1", "k = 1"))))
    left = busy(os, "open", 3)
    lab = Lab("ada", "virtual", tmp_path, quiet=True)
    assert left == [0] and lab.value("0.1", "resolution") == 0.00153
    left[0] = 3
    found = SavedTexts(tmp_path, lab.catalogue)
    found.refresh()
    assert left == [0] and found.notices == []


def test_answers_are_set_aside_though_they_are_open_for_a_moment(busy, tmp_path):
    (tmp_path / "answers.json").write_text("{}")
    left = busy(os, "replace", 2)
    assert answers.set_aside(tmp_path / "answers.json", "ada") == "answers.ada.json" and left == [0]


def test_a_file_that_stays_in_use_is_an_error_after_a_while_and_at_once_elsewhere(busy, tmp_path, monkeypatch):
    (tmp_path / "a").write_text("old")
    monkeypatch.setattr(files, "_PATIENCE", 0.05)
    left = busy(os, "replace", 10**6)
    with pytest.raises(PermissionError):
        files.write(tmp_path / "a", "new")
    tries = 10**6 - left[0]
    assert tries > 1 and os.listdir(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "old"
    monkeypatch.setattr(files, "_MAY_BE_OPEN", False)
    with pytest.raises(PermissionError):
        files.write(tmp_path / "a", "new")
    assert 10**6 - left[0] == tries + 1


def test_answers_are_locked_by_windows_own_way_until_the_other_notebook_is_done(tmp_path, monkeypatch):
    tries = []

    def locking(number, mode, length):
        tries.append((mode, length, os.lseek(number, 0, os.SEEK_CUR)))
        if len(tries) < 4:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files, "_PAUSE", 0.001)
    book = answers.AnswerBook(tmp_path / "answers.json", "ada", {}, 1)
    with monkeypatch.context() as windows:
        windows.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK="at once"))
        windows.setattr(sys, "platform", "win32")
        book.answer(CATALOGUE.find("2.11"), {"omega_n": 1.0})
    assert tries == [("at once", 1, 0)] * 4 and book.notices == []


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A student's folder with one notebook, and an ID and a file name that no code of Windows's has."""
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    folder = tmp_path / "θ"
    folder.mkdir()
    (folder / NAME).write_bytes(saved(notebook(answer("q1", "k = 1"), locked("q1-answer", "lab.answer()"))))
    (folder / "→.txt").write_bytes(b"x" * (own_files.MAX_FILE + 1))
    (folder / "course.json").write_text('{"student": "Ωmega"}', encoding="utf-8")
    return folder


@pytest.mark.parametrize("code", ["cp1252", "cp850"])
def test_no_command_fails_for_a_sign_that_the_output_does_not_have(work, monkeypatch, code):
    monkeypatch.setattr(lab_command, "open_jupyterlab", lambda *arguments: None)
    for words in (
        ["--help"],
        ["lab", str(work), "--student", "Ωmega"],
        ["lab", str(work), "--student", "Ω/"],
        ["restore", "00", "--folder", str(work)],
        ["submit", str(work), "--no-check"],
        ["submit", str(work / "→")],
        ["doctor", "--bench", "virtual", "--seconds", "0.1"],
    ):
        done = CliRunner(charset=code).invoke(cli.app, words)
        assert not isinstance(done.exception, UnicodeError), words
        assert done.output


def test_a_course_file_that_an_editor_of_windows_saved_is_read(tmp_path):
    (tmp_path / "course.json").write_text('{"student": "ada"}\r\n', encoding="utf-8-sig")
    assert course_file.read(tmp_path) == {"student": "ada"}


#: Loads libraries as they are, takes from Python what Windows's has not, and loads all that students have of rotflex.
AS_ON_WINDOWS = """
import importlib, importlib.abc, json, os, pathlib, pkgutil, signal, sys
import anywidget, control, IPython.display, ipykernel.kernelspec, jupyter_client, matplotlib.pyplot, nbformat, PIL.Image
import jupyter_server.serverapp, papermill, rich.table, scipy.io, scipy.optimize, scipy.signal, sympy
import subprocess, tempfile, typer.core, webbrowser, zipfile
GONE = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name in GONE:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Refuse())
for name in GONE:
    sys.modules.pop(name, None)
for owner, names in {
    os: "fork geteuid getuid getgid getpgid killpg setsid uname mkfifo chown sched_getaffinity WNOHANG O_NONBLOCK",
    signal: "SIGHUP SIGKILL SIGALRM SIGUSR1 setitimer pthread_sigmask",
}.items():
    for name in names.split():
        if hasattr(owner, name):
            delattr(owner, name)
sys.platform = "win32"
import labcourse, rotflex
found = [
    one.name
    for package in (labcourse, rotflex)
    for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}.", onerror=print)
    if not one.name.startswith("labcourse.grading") and not one.name.endswith("__main__")
]
for name in found:
    importlib.import_module(name)
from labcourse import files
assert files._MAY_BE_OPEN
from labcourse.lab_command import fill
print(json.dumps([len(found), fill(pathlib.Path("work"), "ada")]))
"""


@pytest.mark.slow
def test_all_that_students_have_loads_without_what_windows_has_not(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", AS_ON_WINDOWS],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    modules, said = json.loads(done.stdout.splitlines()[-1])
    assert modules > 120 and "12 notebooks" in said[0]
