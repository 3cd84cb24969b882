"""The students' commands as a notebook gives them: ``lab.check()`` and its like, for those who never see a terminal.

They run as programs of their own: the notebook's kernel keeps its names, and stays as it was.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from labcourse import files, program
from labcourse.answers.notebooks import Notebook, NotebookError
from labcourse.run import by_program
from labcourse.safe_text import no_escapes

_NAME = re.compile(r"[a-zA-Z0-9_-]{1,64}")  # an id as notebooks have them; editors may send other things
_PATIENCE = 15  # s for a program that was asked to end; three times the grace of what is ended
_ITSELF = 5  # s for one that has heard of the interrupt by itself, as on Linux and macOS; the grace
_LONGEST_ID = 64  # characters of a cell's id, as Jupyter allows


def run(command: str, words: Sequence[str], folder: Path, cell: str = "", needs_saving: bool = False) -> None:
    """Run a command, and print what it says as it goes on.

    Parameters
    ----------
    command : "check", "submit" or "restore"
    words : what it is given besides
    folder : of the notebooks
    cell : id of the cell that asks for it; "" if it is not known
    needs_saving : do nothing where that cell is not saved as it stands
    """
    if by_program():
        print(nothing_here(f"lab.{command}()"))
        return
    if not is_saved(folder, cell):
        print("This notebook is not saved as it stands here, and what counts is the saved file.")
        print("Save it (Ctrl+S, on a Mac ⌘+S), and run this cell again.")
        if needs_saving:
            return
        print()
    arguments = [sys.executable, "-P", "-m", program.name(), command, *words]
    child = subprocess.Popen(
        arguments,
        cwd=folder,
        env={**os.environ, "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )
    assert child.stdout is not None
    try:
        for line in child.stdout:
            print(no_escapes(line), end="", flush=True)
    finally:
        _end(child)


def nothing_here(command: str) -> str:
    """What is said in place of doing it, where notebooks are run by a program."""
    return f"{command} does nothing here: a program runs this notebook, and no person."


def _end(child: subprocess.Popen[str]) -> None:
    """See to it that it has ended: by itself, or, where the cell was interrupted, because it is asked to."""
    if child.poll() is None:
        try:
            child.wait(timeout=_ITSELF)
        except subprocess.TimeoutExpired:
            child.terminate()
    try:
        child.wait(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()


def is_saved(folder: Path, cell: str) -> bool:
    """Whether one of a folder's notebooks has the cell that is being run, as it is run. True where it is not known."""
    source = _source_now()
    if source is None or not _NAME.fullmatch(cell):
        return True
    return any((cell, source) in _cells(path) for path in sorted(folder.glob("*.ipynb")))


def _source_now() -> str | None:
    """The source of the cell that is being run."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    history = getattr(getattr(shell, "history_manager", None), "input_hist_raw", None)
    return history[-1] if history else None


def _cells(path: Path) -> set[tuple[str, str]]:
    """Ids and sources of a notebook's cells; none where it cannot be read."""
    try:
        return {(cell.id, cell.source) for cell in Notebook.read(files.read(path)).cells}
    except (OSError, NotebookError):
        return set()


def cell_now() -> str:
    """The id of the notebook's cell that is being run; "" where there is none, as when a button was pressed.

    Editors that do not tell a kernel which cell they send have none, either.
    """
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    header = getattr(shell, "parent_header", None)
    about = header.get("metadata") if isinstance(header, dict) else None
    cell = about.get("cellId") if isinstance(about, dict) else None
    return cell[:_LONGEST_ID] if isinstance(cell, str) else ""
