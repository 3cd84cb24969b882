"""A student's command in a worker of the browser: it runs as in any terminal, but IPython runs the cells in it."""

from __future__ import annotations

import contextlib
import importlib
import io
import logging
import os
import runpy
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

from labcourse.answers import cell_reports


def main(name: str, words: Sequence[str]) -> None:
    """Run a command in a worker, and send the files that it wrote in the current folder and above it."""
    import js
    from pyodide.ffi import to_js

    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)  # it builds its list each time, and says so
    around = Path.cwd().parent
    before = {path: path.read_bytes() for path in around.rglob("*") if path.is_file()}
    sys.argv = [name, *words]
    with contextlib.suppress(SystemExit):
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    for path in around.rglob("*"):
        if path.is_file() and before.get(path) != (content := path.read_bytes()):
            js.sent(str(path), to_js(content))


def run_cells(
    notebooks: Mapping[str, dict[str, Any]], folder: Path, environment: Mapping[str, str], report: Callable[[str], None]
) -> None:
    """Run the code cells of notebooks in this process. After an error in a cell, the next cell is run.

    Each notebook begins with a fresh shell and without the student's modules, and with figures as they are by default.

    Parameters
    ----------
    notebooks : file name → content
    folder : in which they are run
    environment : of the run
    report : called with the file name of each notebook that begins
    """
    import matplotlib as mpl
    import matplotlib.pyplot as plt
    from IPython.core.interactiveshell import InteractiveShell

    job: Any = sys.modules["labcourse.job"]
    for name, notebook in notebooks.items():
        report(name)
        path = [*(place for place in sys.path if place), ""]  # as in a notebook's kernel
        with patch.dict(os.environ, environment), patch.object(sys, "path", path), contextlib.chdir(folder):
            importlib.reload(job)  # it reads the environment
            InteractiveShell.clear_instance()
            shell: Any = InteractiveShell.instance()
            shell.display_formatter.active_types = ["text/plain"]  # nobody looks at pictures
            cell_reports.begin(cell_reports.REPORTS_FILE, name)
            shell.user_ns.update(student=job.STUDENT, bench=job.BENCH)  # if the notebook's own cell stops
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                _run(shell, notebook["cells"])
        plt.close("all")
        mpl.rcdefaults()
        for own in [key for key, module in sys.modules.items() if _is_in(folder, module)]:
            del sys.modules[own]
    importlib.reload(job)


def _is_in(folder: Path, module: Any) -> bool:
    return str(getattr(module, "__file__", None) or "").startswith(f"{folder}{os.sep}")


def _run(shell: Any, cells: Sequence[Mapping[str, Any]]) -> None:
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] != "code" or not source.strip():
            continue
        options = {"store_history": True, "cell_id": cell.get("id")}
        code = shell.transform_cell(source)
        if shell.should_run_async(source, transformed_cell=code):
            from pyodide.ffi import run_sync

            run_sync(shell.run_cell_async(source, transformed_cell=code, **options))
        else:
            shell.run_cell(source, **options)
        if getattr(shell, "exit_now", False):
            return
