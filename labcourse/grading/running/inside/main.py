"""Run notebooks, one after the other, each in a process forked from this one.

    python -P main.py < SPECIFICATION

The specification is JSON::

    {"notebooks": {"one.ipynb": {"cells": [...], ...}, ...}, "parameters": {"student": "ada", ...},
     "imports": ["numpy", ...], "cell_timeout": 60, "files": {"helpers.py": "(base64)", ...},
     "evidence": "package.module:function"}

Cells work in the current folder, where the files are put. What a cell outputs is discarded, and pictures that nobody
asked for are not drawn; what stopped a cell is written down (``labcourse.answers.cell_reports``).
With "evidence", that function of the course's is called with the current folder before any notebook is run, and the
plain data that it returns is left as JSON: it reads files of the student's that only a sandbox may open.
The exit code tells how it ended, see the package's constants.
"""

from __future__ import annotations

import base64
import contextlib
import functools
import gc
import importlib.util
import json
import os
import sys
import threading
import traceback
from pathlib import Path
from typing import Any

PACKAGE = "labcourse_inside"
_TRIAL_TIMEOUT = 60.0  # s; as a cell has
#: What any notebook needs; what those of a course need besides, the specification says.
_IMPORTED = (
    "IPython.core.logger",
    "IPython.core.pylabtools",
    "bdb",
    "ipykernel.ipkernel",
    "matplotlib.backends.backend_agg",
    "matplotlib.pyplot",
    "numpy",
)
#: Imported by some library where it is installed, and not needed by a notebook: a debugger, which starts threads; a
#: grammar of web addresses for jsonschema, which takes seconds.
_LEFT_OUT = ("debugpy", "rfc3987_syntax")


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


def _module(name: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.{name}")


def _prepared(imports: list[str]) -> Any:
    """Return a kernel, once all is done that need not be done for each notebook. No thread may be running then."""
    interfaces = _module("private_interfaces")
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # as a kernel sets it
    os.environ["LABCOURSE_PICTURES"] = "off"
    gc.disable()  # nothing of this is garbage
    for name in _LEFT_OUT:
        sys.modules[name] = None  # type: ignore[assignment]
    with interfaces.docstrings_as_they_stand():
        for name in (*_IMPORTED, *imports):
            importlib.import_module(name)
    interfaces.check()
    kernel = _module("kernel").Kernel()
    assert threading.active_count() == 1, threading.enumerate()
    gc.freeze()  # what there is by now, processes share; their garbage collectors need not look at it
    gc.enable()
    if _module("watch").run(kernel.try_out, steps=1, timeout=_TRIAL_TIMEOUT) != sys.modules[PACKAGE].FINE:
        raise interfaces.InterfaceChangedError(interfaces.versions())
    return kernel


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
    Path(sys.modules[PACKAGE].EVIDENCE_FILE).write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    inside: Any = sys.modules[PACKAGE]
    try:
        kernel = _prepared(specification["imports"])
    except Exception as error:
        if type(error).__name__ != "InterfaceChangedError":
            traceback.print_exc()
        else:
            print(error, file=sys.stderr)
        return int(inside.BROKEN)
    watch = functools.partial(_module("watch").run, timeout=specification["cell_timeout"])
    # Not before: what is imported by now is the course's and the libraries', whatever a file may be called.
    _put_files(specification["files"])
    if specification.get("evidence"):  # where that fails, nothing is there to come back
        watch(functools.partial(_read_evidence, specification["evidence"]), steps=1)
    worst: int = inside.FINE
    for name, notebook in specification["notebooks"].items():
        cells = _module("kernel").sources(notebook, specification["parameters"])
        worst = max(worst, watch(functools.partial(kernel.run, name, cells), steps=len(cells)))
    return worst


if __name__ == "__main__":
    _load_package()
    code = run(json.load(sys.stdin))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # taking all down in an orderly way would cost as much as a notebook
