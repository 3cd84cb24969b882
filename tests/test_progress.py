"""Progress bars: in a terminal and in a notebook, and nowhere else."""

import io
import subprocess
import sys

import pytest
import tqdm.auto
from tqdm.notebook import tqdm as bar_of_a_notebook

from rotflex import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stderr", "shown"), [(io.StringIO(), False), (Terminal(), True)])
def test_a_bar_is_written_to_a_terminal_only(monkeypatch, stderr, shown):
    monkeypatch.setattr("sys.stderr", stderr)
    monkeypatch.setattr("tqdm.auto.tqdm", tqdm.std.tqdm)  # whatever was imported in this process before
    monkeypatch.setattr(progress, "AFTER", 0.0)
    monkeypatch.delenv(progress.SWITCH, raising=False)
    assert list(progress.progress(range(3), "experiment", "sample")) == [0, 1, 2]
    with progress.progress(None, "fit", "run") as counter:
        counter.update()
    assert bool(stderr.getvalue()) is shown


def test_a_notebook_keeps_its_bar():
    assert bar_of_a_notebook(range(3), disable=progress._NOT_IN_LOGS, display=False).disable is False


def test_a_bar_that_is_not_shown_takes_no_semaphore():
    program = """
import sys
from rotflex.progress import progress
progress(None, "fit", "run", show=False).update()
print("multiprocessing.synchronize" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"  # a marking process is killed, and would leak it


def test_items_without_a_bar_need_no_tqdm(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)  # as in a browser
    assert list(progress.progress(range(3), "experiment", "sample", show=False)) == [0, 1, 2]
