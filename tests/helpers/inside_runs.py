"""Notebooks made of a few lines, and how they are run as inside a sandbox, though there is none."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import nbformat
from checkout import ROOT
from made_courses import OURS

from labcourse.run.inside import main

#: The command that starts the program, which reads a specification from its standard input.
PROGRAM = [sys.executable, "-P", "-m", main.__name__]
#: What a kernel, or the program, is started with besides what this process has.
ENVIRONMENT = {"TQDM_DISABLE": "1", "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}


def notebook(cells: Mapping[str, str] | Sequence[str]) -> dict[str, Any]:
    """A notebook of code cells, by their ids or numbered from 0; the cell of parameters comes before the first."""
    named = cells if isinstance(cells, Mapping) else {f"cell-{number}": source for number, source in enumerate(cells)}
    parameters = nbformat.v4.new_code_cell(
        "student = None\nbench = None", id="parameters", metadata={"tags": ["parameters"]}
    )
    made = nbformat.v4.new_notebook(
        cells=[parameters, *(nbformat.v4.new_code_cell(source, id=name) for name, source in named.items())],
        metadata={"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}},
    )
    return dict(json.loads(nbformat.writes(made)))


def specification(
    notebooks: Mapping[str, dict[str, Any]], student: str = "ada", cell_timeout: float = 60
) -> dict[str, Any]:
    """What the program is told."""
    return {
        "notebooks": dict(notebooks),
        "parameters": {"student": student, "bench": "virtual"},
        "imports": [f"import {name}" for name in OURS.imports],
        "files": {},
        "cell_timeout": cell_timeout,
    }


def run(told: dict[str, Any], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run notebooks in a folder, with the rights of whoever tests: harmless ones only."""
    return subprocess.run(
        PROGRAM,
        input=json.dumps(told),
        cwd=folder,
        env={**os.environ, **ENVIRONMENT},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
