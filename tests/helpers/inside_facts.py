"""What a notebook's cells leave behind, noted by the notebook itself: so a real kernel's can be compared with ours."""

import contextlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nbformat
import papermill
import pytest
from inside_runs import ENVIRONMENT, run, specification

FACTS = "facts.jsonl"
#: A cell that notes of each cell after it how it ended, with what result, and what is left of figures and streams.
_EACH_CELL = f"""
def _observe_cells():
    import json, os, sys

    shell, path = get_ipython(), os.path.abspath({FACTS!r})
    as_text = shell.display_formatter.formatters["text/plain"]

    def observe(result):
        error = result.error_before_exec or result.error_in_exec
        pyplot = sys.modules.get("matplotlib.pyplot")
        fact = {{
            "source": result.info.raw_cell,
            "number": result.execution_count,
            "success": result.success,
            "result": None if result.result is None else as_text(result.result),
            "error": None if error is None else [type(error).__name__, str(error)],
            "figures": pyplot.get_fignums() if pyplot else [],
        }}
        with open(path, "a") as file:
            file.write(json.dumps(fact) + chr(10))

    shell.events.register("post_run_cell", observe)

_observe_cells()
"""
#: A cell that notes what is there in the end.
_THE_END = f"""
def _observe_names():
    import json

    plain = (bool, int, float, complex, str, bytes, list, tuple, dict, set, type(None))
    names = {{}}
    for name, value in globals().items():
        if name[:1] != "_" and isinstance(value, plain):
            try:
                names[name] = repr(value)
            except Exception as error:
                names[name] = repr(error)
    with open({FACTS!r}, "a") as file:
        file.write(json.dumps({{"names": names}}) + chr(10))

_observe_names()
"""


def observed(notebook: dict[str, Any]) -> dict[str, Any]:
    """The notebook with cells that note facts: first, after papermill's parameters if it has any, and last."""
    cells = notebook["cells"]
    tagged = [place for place, cell in enumerate(cells) if "parameters" in cell["metadata"].get("tags", [])]
    place = tagged[0] + 1 if tagged else 0
    first, last = (
        json.loads(json.dumps(nbformat.v4.new_code_cell(source, id=name)))
        for source, name in ((_EACH_CELL, "observe-cells"), (_THE_END, "observe-names"))
    )
    return {**notebook, "cells": [*cells[:place], first, *cells[place:], last]}


def with_kernels(notebooks: Mapping[str, dict[str, Any]], folder: Path, student: str = "ada") -> None:
    """Run each with a kernel of its own in the folder, by papermill and nbclient; errors in cells stop nothing."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTEST_CURRENT_TEST", raising=False)  # with which a kernel would not look at its descriptors
        for name, value in ENVIRONMENT.items():
            patch.setenv(name, value)
        for name, notebook in notebooks.items():
            given = json.loads(json.dumps(notebook))
            for cell in given["cells"]:
                cell["metadata"]["tags"] = [*cell["metadata"].get("tags", []), "raises-exception"]
            path = folder.parent / f"{folder.name}-{name}"
            path.write_text(json.dumps(given), encoding="utf-8")
            options = {"cwd": folder, "progress_bar": False, "execution_timeout": 120, "raise_on_iopub_timeout": True}
            parameters = {"student": student, "bench": "virtual"}
            with contextlib.suppress(papermill.PapermillExecutionError):  # cells had errors, it says in the end
                papermill.execute_notebook(path, None, parameters, kernel_name="python3", **options)


def inside(notebooks: Mapping[str, dict[str, Any]], folder: Path, student: str = "ada") -> int:
    """Run them inside, and return the exit code."""
    done = run(specification(notebooks, student=student), folder)
    assert "Traceback" not in done.stderr, done.stderr  # (papermill notes where there are no parameters)
    return done.returncode


def facts(folder: Path) -> list[dict[str, Any]]:
    """What was noted in a folder, without what differs from one run to the next."""
    text = (folder / FACTS).read_text(encoding="utf-8").replace(str(folder), "FOLDER")
    return [_tidy(json.loads(line)) for line in text.splitlines()]


def _tidy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tidy(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_tidy(inner) for inner in value]
    if not isinstance(value, str):
        return value
    value = re.sub(r"0x[0-9a-f]{6,}", "ADDRESS", value)
    value = re.sub(r"ipykernel_\d+/\d+", "CELL", value)
    return re.sub(r"(\b|_)[0-9a-f]{32}\b", "ID", value)
