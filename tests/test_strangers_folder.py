"""Commands import nothing from the folder in which they are called (``lab``: tests/labcourse/test_jupyterlab.py)."""

import json
import os
import shutil
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import strangers
from checkout import ROOT
from command_line import rotflex

NAME = "05_control_prelab.ipynb"
COMMAND = [str(Path(sys.executable).with_name("rotflex"))]
MODULE = [sys.executable, "-P", "-m", "rotflex"]
#: A command that starts another process, as marking does: that one imports what is on its path.
STARTS_ANOTHER = """
import multiprocessing
from rotflex import cli
@cli.app.command()
def start():
    other = multiprocessing.get_context("spawn").Process(target=print, args=("started",))
    other.start()
    other.join()
if __name__ == "__main__":
    cli.run()
"""


@pytest.fixture
def folder(tmp_path):
    """A student's folder with one notebook."""
    made = tmp_path / "work"
    made.mkdir()
    (made / "course.json").write_text(json.dumps({"student": "ada"}))
    for name in (NAME, "01_modeling_prelab.ipynb"):
        shutil.copy(ROOT / "notebooks" / name, made)
    return made


def called(command, folder):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (MODULE, ["submit", "--no-check"]),
        (COMMAND, ["restore", NAME]),
        (COMMAND, ["doctor"]),
    ],
)
def test_a_command_imports_nothing_from_the_folder_that_it_is_called_in(folder, command, words):
    ran = strangers.lay(folder, names=strangers.OF_OTHERS)
    done = called([*command, *words], folder)
    print(done.stdout, done.stderr)
    assert "Traceback" not in done.stderr
    assert ran() == []


SECRET = "a secret of another place"
LINKS = {
    "a secret": lambda path, secret: path.symlink_to(secret),
    "no end": lambda path, secret: path.symlink_to("/dev/zero"),
    "a pipe": lambda path, secret: os.mkfifo(path),
    "nothing": lambda path, secret: path.symlink_to(secret.with_name("not-there")),
}
needs_links = pytest.mark.skipif(os.name == "nt", reason="links need rights there, and there are no such pipes")


@pytest.fixture
def link(tmp_path, folder, request):
    """Put a link, or a pipe, in place of a file in the folder."""
    secret = tmp_path / "secret"
    secret.write_text(json.dumps({"student": SECRET}))

    def put(name):
        (folder / name).unlink(missing_ok=True)
        LINKS[getattr(request, "param", "a secret")](folder / name, secret)

    return put


@needs_links
@pytest.mark.parametrize(
    ("link", "name"),
    [*((kind, NAME) for kind in LINKS), *(("a secret", name) for name in ("answers.json", "course.json", "data.csv"))],
    indirect=["link"],
)
def test_a_link_is_not_packed_and_that_is_said(tmp_path, folder, link, name):
    link(name)
    done = rotflex("submit", "--no-check", "--student", "ada", folder)
    with zipfile.ZipFile(tmp_path / "ada.zip") as packed:
        content = {one: packed.read(one) for one in packed.namelist()}
    assert f"{name} " in done.output
    assert name == "course.json" or name not in content
    assert SECRET.encode() not in b"".join(content.values()) and SECRET not in done.output


@needs_links
@pytest.mark.parametrize("link", LINKS, indirect=True)
def test_a_link_is_not_restored_and_that_is_said(folder, link):
    link(NAME)
    done = rotflex("restore", NAME, "--folder", folder)
    assert NAME in done.output and not stat.S_ISREG((folder / NAME).lstat().st_mode)


@needs_links
@pytest.mark.parametrize("link", LINKS, indirect=True)
def test_nothing_is_written_through_a_link(tmp_path, folder, link, monkeypatch):
    monkeypatch.setattr("labcourse.lab_command.open_jupyterlab", lambda *given: None)
    link(NAME)
    done = rotflex("lab", folder)
    assert (NAME in done.output) == (folder / NAME).is_symlink() and not (tmp_path / "not-there").exists()
    assert json.loads((tmp_path / "secret").read_text()) == {"student": SECRET}


def test_a_process_that_a_command_starts_imports_nothing_either(tmp_path, folder):
    ran = strangers.lay(folder)
    (tmp_path / "begin.py").write_text(STARTS_ANOTHER)
    done = called([sys.executable, str(tmp_path / "begin.py"), "start"], folder)
    assert "started" in done.stdout and ran() == []


@needs_links
@pytest.mark.parametrize("words", [["submit", "--no-check", "--student", "ada"], ["lab"], ["restore", "--folder"]])
def test_a_name_that_steers_a_terminal_is_printed_without_that(folder, words, monkeypatch):
    monkeypatch.setattr("labcourse.lab_command.open_jupyterlab", lambda *given: None)
    (folder / "a\x1b[2J\u202eb.csv").symlink_to("nowhere")
    (folder / "01\x1b[2J.ipynb").write_text("{")
    (folder / "01_modeling_prelab.ipynb").unlink()
    (folder / "course.json").write_text(json.dumps({"student": "a\x1b[2J"}))
    done = rotflex(*words, folder)
    assert done.output and "\x1b[2J" not in done.output and "\u202e" not in done.output
