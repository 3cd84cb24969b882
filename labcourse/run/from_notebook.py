"""Run the students' commands from a notebook: ``lab.check()`` and its like, for those who never see a terminal.

They run as programs of their own: the notebook's kernel keeps its names, and stays as it was.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import files, program
from labcourse.files import IN_BROWSER
from labcourse.patterns import CELL_ID
from labcourse.run import by_program
from labcourse.safe_text import no_escapes

if TYPE_CHECKING:  # the commands' help loads this module
    from labcourse.answers.catalogue import Catalogue

_PATIENCE = 15  # s for a program that was asked to end; three times the grace of what is ended
_ITSELF = 5  # s for one that has noticed the interrupt by itself, as on Linux and macOS
_LONGEST_ID = 64  # characters of a cell's id, as Jupyter allows


def run(
    command: str,
    arguments: Sequence[str],
    folder: Path,
    cell: str = "",
    needs_saving: bool = False,
    take: Callable[[Path], None] = lambda path: None,
) -> None:
    """Run a command, and print its output as it comes.

    Parameters
    ----------
    command : "check", "submit" or "restore"
    arguments : its arguments
    folder : of the notebooks
    cell : id of the cell that asks for it; "" if it is not known
    needs_saving : do nothing if that cell is not saved as it stands
    take : called in a browser with each file to hand in
    """
    if by_program():
        print(nothing_here(f"lab.{command}()"))
        return
    if not is_saved(folder, cell):
        print("This notebook is not saved as it stands here, and what counts is the saved file.")
        if needs_saving:
            print("Save it (Ctrl+S, on a Mac ⌘+S), and run this cell again.")
            return
        print("What follows is about the file as it was saved last.\n")
    with contextlib.closing(output_of(command, arguments, folder, take)) as lines:
        for line in lines:
            print(no_escapes(line), end="", flush=True)


def output_of(
    command: str, arguments: Sequence[str], folder: Path, take: Callable[[Path], None] = lambda path: None
) -> Generator[str]:
    """Run a command as a program of its own, and yield the lines that it prints, as they come."""
    if IN_BROWSER:
        from labcourse.run import in_browser

        yield from in_browser.lines(command, arguments, folder, take)
        return
    pipes: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    environment = {**os.environ, "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1"}
    words = [sys.executable, "-P", "-m", program.name(), command, *arguments]
    child = subprocess.Popen(words, cwd=folder, env=environment, encoding="utf-8", errors="replace", **pipes)
    assert child.stdout is not None
    try:
        yield from child.stdout
    finally:
        _end(child)


def _end(child: subprocess.Popen[str]) -> None:
    """Wait until a program ends by itself, or, if the cell was interrupted, because it is asked to."""
    for seconds, end in ((_ITSELF, child.terminate), (_PATIENCE, child.kill)):
        try:
            child.wait(timeout=seconds)
            return
        except subprocess.TimeoutExpired:
            end()
    child.wait()


def nothing_here(command: str) -> str:
    """Return the message in place of a command, where a program runs the notebooks."""
    return f"{command} does nothing here: a program runs this notebook, and no person."


def is_saved(folder: Path, cell: str) -> bool:
    """Return whether one of a folder's notebooks has the running cell with its source. True if it is not known."""
    history = getattr(getattr(_shell(), "history_manager", None), "input_hist_raw", None)
    if not history or not CELL_ID.fullmatch(cell):
        return True
    saved = (saved_cells(path) for path in sorted(folder.glob("*.ipynb")))
    return any((cell, history[-1]) == (identity, source) for cells in saved for identity, _kind, source in cells)


def report_of(catalogue: Catalogue, notebook: str) -> str:
    """Return the number of the report that a notebook prepares: the first one in it or after it; "" without reports."""
    after = [number for number, report in catalogue.reports.items() if f"{report.notebook}.ipynb" >= notebook]
    return next(iter(after or [*catalogue.reports][-1:]), "")


def in_kernel() -> bool:
    """Return whether a person works in a notebook: a kernel runs this, and no program runs the notebook."""
    return getattr(_shell(), "kernel", None) is not None and not by_program()


def show(page: str, text: str) -> None:
    """Show HTML in a live notebook, and elsewhere print the text that says the same."""
    if in_kernel():
        content: Any = {"text/html": page, "text/plain": text}
        sys.modules["IPython"].display.display(content, raw=True)
    else:
        print(text)


def _shell() -> Any:
    ipython = sys.modules.get("IPython")
    return None if ipython is None else ipython.get_ipython()


def saved_cells(path: Path) -> list[list[str]]:
    """Return id, type and source of each cell of a notebook; none if it cannot be read."""
    from labcourse.answers.notebooks import Notebook, NotebookError

    try:
        return [[cell.id, cell.kind, cell.source] for cell in Notebook.read(files.read(path)).cells]
    except (OSError, NotebookError):
        return []


def cell_now() -> str:
    """Return the id of the notebook's cell that is being run; "" if there is none, as when a button was pressed.

    Editors that do not tell a kernel which cell they send have none, either. JupyterLite's kernel keeps it for itself.
    """
    shell = _shell()
    header = getattr(shell, "parent_header", None) or getattr(getattr(shell, "kernel", None), "_parent_header", None)
    about = header.get("metadata") if isinstance(header, dict) else None
    cell = about.get("cellId") if isinstance(about, dict) else None
    return cell[:_LONGEST_ID] if isinstance(cell, str) else ""
