"""The students' own code and nothing else: a lower bound for what any grader takes.

    python plain_python.py SUBMISSION

The code cells of all notebooks in a folder are run as plain Python: no kernel, no IPython, no papermill, no sandbox,
no outputs, no pictures. What they import is imported once; each notebook is a process forked from there. Prints JSON:
seconds of the imports, and seconds in the cells. Answers go into the current folder.
"""

from __future__ import annotations

import ast
import importlib
import json
import os
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: What the functions that cells call import when they are called.
CALLED_FOR = ("scipy.io", "scipy.optimize", "scipy.signal", "scipy.stats", "matplotlib.backends.backend_agg")


def code_cells(notebook: Path) -> list[str]:
    """Sources of a notebook's code cells."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def imported(source: str) -> Iterator[str]:
    """Modules that a cell imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def run_cells(sources: list[str]) -> float:
    """Seconds that a notebook's cells take, one after the other. An error in a cell is an error here."""
    from IPython.display import display
    from matplotlib import pyplot

    names: dict[str, Any] = {"__name__": "__main__", "display": display}
    started = time.perf_counter()
    for source in sources:
        exec(compile(source, "<cell>", "exec"), names)
        pyplot.close("all")  # as notebooks do after each cell
    return time.perf_counter() - started


def in_child(sources: list[str]) -> float:
    """:func:`run_cells` in a process of its own."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.write(writing, json.dumps(run_cells(sources)).encode())
            code = 0
        except Exception:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        output = pipe.read()
    _, status = os.waitpid(child, 0)
    if status:
        raise RuntimeError(f"A cell went wrong (status {status}).")
    seconds: float = json.loads(output)
    return seconds


def main(folder: Path) -> None:
    """Measure and print."""
    os.environ.update(MPLBACKEND="agg", LABCOURSE_PICTURES="off")
    notebooks = [code_cells(path) for path in sorted(folder.glob("*.ipynb"))]
    modules = {name for sources in notebooks for source in sources for name in imported(source)}
    started = time.perf_counter()
    for name in [*sorted(modules), *CALLED_FOR, "matplotlib.pyplot", "IPython.display"]:
        importlib.import_module(name)
    imports = time.perf_counter() - started
    print(json.dumps({"imports": imports, "cells": sum(map(in_child, notebooks))}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
