"""Commands import nothing from the folder in which they are called (``lab``: tests/courseware/test_jupyterlab.py)."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import strangers
from checkout import ROOT

COMMAND = [str(Path(sys.executable).with_name("rotflex"))]
MODULE = [sys.executable, "-P", "-m", "rotflex"]
#: Marking does this after its command has begun: a process that is started imports what is on its path.
STARTS_ANOTHER = """
import multiprocessing
from rotflex.cli import app
if __name__ == "__main__":
    app(["--version"], standalone_mode=False)
    other = multiprocessing.get_context("spawn").Process(target=print, args=("started",))
    other.start()
    other.join()
"""


@pytest.fixture
def folder(tmp_path):
    """A student's folder with one notebook."""
    made = tmp_path / "work"
    made.mkdir()
    (made / "course.json").write_text(json.dumps({"student": "ada"}))
    shutil.copy(ROOT / "notebooks" / "05_control_prelab.ipynb", made)
    return made


def called(command, folder):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (COMMAND, ["check"]),
        (MODULE, ["submit", "--no-check"]),
        (COMMAND, ["restore", "05_control_prelab.ipynb"]),
        (COMMAND, ["doctor"]),
    ],
)
def test_a_command_imports_nothing_from_the_folder_that_it_is_called_in(folder, command, words):
    ran = strangers.lay(folder, names=strangers.OF_OTHERS)
    done = called([*command, *words], folder)
    print(done.stdout, done.stderr)
    assert "Traceback" not in done.stderr
    assert ran() == []


def test_a_process_that_a_command_starts_imports_nothing_either(tmp_path, folder):
    ran = strangers.lay(folder)
    (tmp_path / "begin.py").write_text(STARTS_ANOTHER)
    done = called([sys.executable, str(tmp_path / "begin.py")], folder)
    assert "started" in done.stdout and ran() == []
