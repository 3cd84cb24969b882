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
#: What any notebook needs; the specification names what those of a course need besides.
_ALWAYS_IMPORTED = (
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
_NOT_IMPORTED = ("debugpy", "rfc3987_syntax")


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


def _submodule(name: str) -> Any:
    """Import a module beside this file."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def _prepared_kernel(imports: list[str]) -> Any:
    """Do all that need not be done for each notebook, and return a kernel that is ready to be forked.

    Parameters
    ----------
    imports : modules that the notebooks use

    Raises
    ------
    InterfaceChangedError
        If a library is not as it was tested.
    Exception
        Whatever an import raises.
    """
    interfaces = _submodule("private_interfaces")
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # as a kernel sets it
    os.environ["LABCOURSE_PICTURES"] = "off"
    gc.disable()  # nothing of this is garbage
    for name in _NOT_IMPORTED:
        sys.modules[name] = None  # type: ignore[assignment]  # the import fails at once
    with interfaces.plain_docstrings():
        for name in (*_ALWAYS_IMPORTED, *imports):
            importlib.import_module(name)
    interfaces.check()
    kernel = _submodule("kernel").Kernel()
    assert threading.active_count() == 1, threading.enumerate()  # else a fork is not safe
    gc.freeze()  # forked processes share the objects so far: their garbage collectors leave these alone
    gc.enable()
    if _submodule("watch").run(kernel.try_out, steps=1, timeout=_TRIAL_TIMEOUT) != sys.modules[PACKAGE].FINE:
        raise interfaces.InterfaceChangedError(interfaces.versions_message())
    return kernel


def _put_files(files: dict[str, str]) -> None:
    """Put a student's own files (path → content in base64) into the current folder. Existing files stay."""
    for name, content in files.items():
        path = Path(name)
        if path.is_absolute() or ".." in path.parts:
            continue
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as file:
                file.write(base64.b64decode(content))


def _read_evidence(reader: str, report_step: Any) -> None:
    """Call the course's function that reads evidence, and write what it returns to the evidence file.

    Parameters
    ----------
    reader : "package.module:function"; it is called with the current folder
    report_step : called once, when the step begins
    """
    report_step()
    module, _colon, name = reader.partition(":")
    content = getattr(importlib.import_module(module), name)(Path.cwd())
    Path(sys.modules[PACKAGE].EVIDENCE_FILE).write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    inside: Any = sys.modules[PACKAGE]
    try:
        kernel = _prepared_kernel(specification["imports"])
    except Exception as error:
        if type(error).__name__ != "InterfaceChangedError":
            traceback.print_exc()
        else:
            print(error, file=sys.stderr)
        return int(inside.BROKEN)
    watch = functools.partial(_submodule("watch").run, timeout=specification["cell_timeout"])
    # Not before: what is imported by now is the course's and the libraries', whatever a file may be called.
    _put_files(specification["files"])
    if specification.get("evidence"):  # if that fails, there is no evidence file
        watch(functools.partial(_read_evidence, specification["evidence"]), steps=1)
    worst: int = inside.FINE
    for name, notebook in specification["notebooks"].items():
        cells = _submodule("kernel").sources(notebook, specification["parameters"])
        worst = max(worst, watch(functools.partial(kernel.run, name, cells), steps=len(cells)))
    return worst


if __name__ == "__main__":
    _load_package()
    code = run(json.load(sys.stdin))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # taking all down in an orderly way would cost as much as a notebook
