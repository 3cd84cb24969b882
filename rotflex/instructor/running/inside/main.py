"""Run notebooks, one after the other, each in a process forked from this one.

    python -P main.py < SPECIFICATION

The specification is JSON::

    {"notebooks": [{"name": "00_start.ipynb", "notebook": {...}}, ...],
     "parameters": {"student": "ada", "bench": "virtual"}, "imports": ["numpy", ...],
     "cell_timeout": 60, "outputs": null}

The notebooks' cells work in the current folder. With ``outputs``, a folder, the executed notebooks are written there as
a real kernel would have left them; without, the run is deaf: nothing that a cell says is kept, and pictures are not
even drawn. The exit code tells how it ended, see the package's constants.
"""

from __future__ import annotations

import functools
import importlib.util
import json
import os
import sys
import traceback
from pathlib import Path
from typing import Any

PACKAGE = "rotflex_inside"


def _load_package() -> None:
    """Make the modules beside this file importable, though the package that they belong to is not here."""
    folder = Path(__file__).resolve().parent
    spec = importlib.util.spec_from_file_location(
        PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None and spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    spec.loader.exec_module(package)


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    inside = importlib.import_module(PACKAGE)
    warm = importlib.import_module(f"{PACKAGE}.warm")
    watch = importlib.import_module(f"{PACKAGE}.watch")
    deaf = specification.get("outputs") is None
    warm.set_environment(deaf)
    try:
        warm.import_all(deaf, specification["imports"])
    except Exception:
        traceback.print_exc()
        return int(inside.BROKEN)
    engine = importlib.import_module(f"{PACKAGE}.engine")
    job = engine.Job(
        parameters=specification["parameters"],
        outputs=None if deaf else Path(specification["outputs"]).resolve(),
    )
    warm.freeze()
    worst: int = inside.FINE
    for entry in specification["notebooks"]:
        notebook = entry["notebook"]
        ended = watch.run(
            functools.partial(job.run, entry["name"], notebook),
            steps=len(notebook["cells"]) + 1,  # the cell of papermill's parameters
            timeout=specification["cell_timeout"],
        )
        worst = max(worst, ended)
    return worst


if __name__ == "__main__":
    _load_package()
    code = run(json.load(sys.stdin))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # taking all down in an orderly way would cost as much as a notebook
