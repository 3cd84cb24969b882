"""What goes wrong around a command is one clear line, and exit code 2; nobody sees a traceback."""

import errno
import importlib
import os
import subprocess
import sys

import pytest
from checkout import ROOT
from command_line import rotflex
from gradebooks import graded, record
from made_courses import copied

from labcourse.grading.gradebook import Gradebook


def one_line(done, *words):
    """Whether a command ended with exit code 2 and one line for people, with these words in it."""
    assert done.exit_code == 2, done.output
    assert isinstance(done.exception, SystemExit), done.exception
    lines = done.output.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("rotflex: "), done.output
    assert all(word in lines[0] for word in words), done.output


@pytest.fixture
def isolated(monkeypatch):
    monkeypatch.setattr("labcourse.grading.running.isolation_report.check", lambda: None)


@pytest.fixture
def handed_in(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "ada.zip").write_bytes(b"not a zip")
    return tmp_path / "in"


@pytest.fixture
def book(tmp_path):
    with Gradebook(tmp_path / "book.sqlite") as opened:
        record(opened, graded("ada"))
    return tmp_path / "book.sqlite"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("KEY = {\n    '2.11': {]\n}\n", ("SyntaxError", "key.py, line 2")),
        ("\n\nKEY = {'2.11': nonsense}\n", ("NameError: name 'nonsense'", "key.py, line 3")),
    ],
)
def test_a_slip_in_the_key_is_named_with_file_and_line(handed_in, tmp_path, isolated, key, said):
    course = copied(tmp_path, key=key)
    one_line(rotflex("grade", tmp_path / "out", handed_in, "--solutions", course), *said)
    assert not (tmp_path / "out").exists()


def test_a_gradebook_that_is_a_folder_or_no_database(tmp_path, handed_in, isolated):
    (tmp_path / "other").write_text("student,total\n" * 100)
    one_line(rotflex("history", tmp_path), "There is no gradebook", "gradebook.sqlite")
    one_line(rotflex("history", tmp_path / "other"), "this file is not a gradebook")
    grade = (handed_in, "--out", tmp_path / "out", "--solutions", ROOT)
    one_line(rotflex("grade", tmp_path / "other", *grade), "this file is not a gradebook")
    (tmp_path / "gradebook.sqlite").mkdir()
    one_line(rotflex("grade", tmp_path, *grade), "cannot be opened")


@pytest.mark.slow
def test_a_disk_that_is_full_for_the_gradebook(book, tmp_path):
    """A real one: SQLite may have no more pages than there are."""
    code = (
        "import sqlite3, sys; from rotflex import cli; real = sqlite3.connect\n"
        "def connect(*a, **k):\n    made = real(*a, **k); made.execute('PRAGMA max_page_count = 1'); return made\n"
        "sqlite3.connect = sqlite3.dbapi2.connect = connect\n"
        "sys.argv[0] = 'rotflex'; cli.app()"
    )
    words = ["comment", str(book), "ada", "x" * 100_000, "--by", "anna"]
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    assert "database or disk is full" in done.stderr and "Free some space" in done.stderr
    with Gradebook(book) as opened:
        assert opened.comments("ada") == []


def test_whatever_the_system_refuses_elsewhere_is_one_line_too(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "somewhere/notebooks")

    module = importlib.import_module("labcourse.grading.release.student_course")
    monkeypatch.setattr(module, "write_notebooks", refuse)
    one_line(rotflex("make-notebooks", "--solutions", ROOT), "somewhere/notebooks: Permission denied.")
