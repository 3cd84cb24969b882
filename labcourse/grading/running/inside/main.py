"""Run notebooks, one after the other, each in a process forked from this one.

    python -P main.py < SPECIFICATION

The specification is JSON::

    {"notebooks": {"one.ipynb": {"cells": [...], ...}, ...}, "parameters": {"student": "ada", ...},
     "imports": ["numpy", ...], "cell_timeout": 60, "files": {"helpers.py": "(base64)", ...},
     "evidence": "package.module:function"}

The notebooks' cells work in the current folder, where the files are put. Nothing that a cell outputs is kept, and
pictures are not even drawn; what stopped a cell is written down (``labcourse.answers.cell_reports``).
Where there is "evidence", that function of the course's is called with the current folder before any notebook is run,
and the plain data that it returns is left as JSON: files of the student's that only a sandbox may open.
The exit code tells how it ended, see the package's constants.
"""

from __future__ import annotations

import base64
import contextlib
import functools
import importlib.util
import json
import os
import sys
import traceback
from pathlib import Path
from typing import Any

PACKAGE = "labcourse_inside"
_TRIAL_TIMEOUT = 60.0  # s; as a cell has


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


def _prepared(parameters: dict[str, str], imports: list[str]) -> Any:
    """What runs a notebook in a fork of this process, which has done all that need not be done for each."""
    warm = importlib.import_module(f"{PACKAGE}.warm")
    watch = importlib.import_module(f"{PACKAGE}.watch")
    private_interfaces = importlib.import_module(f"{PACKAGE}.private_interfaces")
    warm.set_environment()
    warm.import_all(imports)
    private_interfaces.check()
    job = importlib.import_module(f"{PACKAGE}.engine").Job(parameters)
    warm.freeze()
    if watch.run(job.try_out, steps=1, timeout=_TRIAL_TIMEOUT) != importlib.import_module(PACKAGE).FINE:
        raise private_interfaces.InterfaceChangedError(private_interfaces.versions())
    return job


def _put_files(files: dict[str, str]) -> None:
    """Put a student's own files into the current folder, each where nothing is yet."""
    for name, content in files.items():
        path = Path(name)
        if path.is_absolute() or ".." in path.parts:
            continue
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as file:
                file.write(base64.b64decode(content))


def _read_evidence(reader: str, report_step: Any) -> None:
    """Call a function of the course's with the current folder, and write down what it returns."""
    report_step()
    module, _colon, name = reader.partition(":")
    content = getattr(importlib.import_module(module), name)(Path.cwd())
    file = importlib.import_module(PACKAGE).EVIDENCE_FILE
    Path(file).write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    inside = importlib.import_module(PACKAGE)
    watch = importlib.import_module(f"{PACKAGE}.watch")
    private_interfaces = importlib.import_module(f"{PACKAGE}.private_interfaces")
    try:
        job = _prepared(specification["parameters"], specification["imports"])
    except private_interfaces.InterfaceChangedError as error:
        print(error, file=sys.stderr)
        return int(inside.BROKEN)
    except Exception:
        traceback.print_exc()
        return int(inside.BROKEN)
    # Not before: what is imported by now is the course's and the libraries', whatever a file may be called.
    _put_files(specification["files"])
    if specification.get("evidence"):  # where that fails, nothing is there to come back
        reading = functools.partial(_read_evidence, specification["evidence"])
        watch.run(reading, steps=1, timeout=specification["cell_timeout"])
    worst: int = inside.FINE
    for name, notebook in specification["notebooks"].items():
        ended = watch.run(
            functools.partial(job.run, name, notebook),
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
