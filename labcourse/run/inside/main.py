"""Run notebooks, one after the other, each in a process forked from this one.

    python -P -m labcourse.run.inside.main < SPECIFICATION

The specification is JSON::

    {"notebooks": {"one.ipynb": {"cells": [...], ...}, ...}, "parameters": {"student": "ada", ...},
     "imports": ["import numpy", ...], "cell_timeout": 60, "files": {"helpers.py": "(base64)", ...},
     "evidence": "package.module:function"}

Cells work in the current folder, where the files are put. What a cell outputs is discarded, and pictures that nobody
asked for are not drawn; what stopped a cell is written down (``labcourse.answers.cell_reports``).
With "evidence", that function of the course's is called with the current folder before any notebook is run, and the
plain data that it returns is left as JSON: it reads files of the student's that only a sandbox may open.
The name of each notebook is printed when it begins. The exit code says how it ended; the package has its constants.
"""

from __future__ import annotations

import base64
import contextlib
import functools
import gc
import importlib
import json
import os
import signal
import sys
import threading
import traceback
from pathlib import Path
from typing import Any

from labcourse.answers import cell_reports

from . import BROKEN, EVIDENCE_FILE, FINE, private_interfaces, watch

_PARAMETERS_TAG = "parameters"
_TRIAL_TIMEOUT = 60.0  # s; as a cell has
#: What any notebook needs; the specification has the statements for a course.
_ALWAYS_IMPORTED = (
    "import bdb, numpy, matplotlib.pyplot, matplotlib.backends.backend_agg",
    "import ipykernel.ipkernel, IPython.core.logger, IPython.core.pylabtools",
)
#: Imported by some library where it is installed, and not needed by a notebook: a debugger, which starts threads; a
#: grammar of web addresses, which takes seconds (``labcourse.grading``, which is not here, keeps it out as well).
_NOT_IMPORTED = ("debugpy", "rfc3987_syntax")


def _prepared_kernel(imports: list[str]) -> Any:
    """Do all that need not be done for each notebook, and return a kernel that is ready to be forked.

    Parameters
    ----------
    imports : import statements of the modules that the notebooks use

    Raises
    ------
    UntestedVersionError
        If a library has a version that was not tested, or if cells do not run.
    Exception
        Whatever an import raises.
    """
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # as a kernel sets it
    os.environ["LABCOURSE_PICTURES"] = "off"
    gc.disable()  # nothing of this is garbage
    for name in _NOT_IMPORTED:
        sys.modules[name] = None  # type: ignore[assignment]  # the import fails at once
    private_interfaces.check_versions()
    with private_interfaces.plain_docstrings():
        for statement in (*_ALWAYS_IMPORTED, *imports):
            exec(statement, {})
    from .kernel import Kernel  # not before its libraries: they compose their docstrings when they are imported

    kernel = Kernel()
    assert threading.active_count() == 1, threading.enumerate()  # else a fork is not safe
    gc.freeze()  # forked processes share the objects so far: their garbage collectors leave these alone
    gc.enable()
    if watch.run(kernel.try_out, steps=1, timeout=_TRIAL_TIMEOUT) != FINE:
        raise private_interfaces.UntestedVersionError(
            f"Cells do not run with these libraries: {private_interfaces.installed()}."
        )
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
    Path(EVIDENCE_FILE).write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def sources(notebook: dict[str, Any], parameters: dict[str, str]) -> list[tuple[str, str | None]]:
    """Return the cells to run of a notebook, each as source and id.

    These are its code cells that are not empty, and a cell that sets the parameters: after the cell with the tag
    "parameters", or first. That one has no id. Where the release has student and bench of the job, these two are set
    first, so that they are there if the notebook's own cell stops.

    Parameters
    ----------
    notebook : as JSON
    parameters : name → value
    """
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    tagged = [_PARAMETERS_TAG in cell["metadata"].get("tags", ()) for cell in cells]
    place = tagged.index(True) + 1 if any(tagged) else 0
    sources_and_ids: list[tuple[str, str | None]] = [("".join(cell["source"]), cell["id"]) for cell in cells]
    own = ("student", "bench") if getattr(getattr(cell_reports, "job", None), "STUDENT", "") else ()
    lines = [(name, f"{name} = {json.dumps(value, ensure_ascii=False)}\n") for name, value in parameters.items()]
    sources_and_ids.insert(place, ("# Parameters\n" + "".join(line for name, line in lines if name not in own), None))
    sources_and_ids.insert(0, ("".join(line for name, line in lines if name in own), None))
    return [(source, cell) for source, cell in sources_and_ids if source.strip()]


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    try:
        kernel = _prepared_kernel(specification["imports"])
    except private_interfaces.UntestedVersionError as error:
        print(error, file=sys.stderr)
        return BROKEN
    except Exception:  # whatever an import raises: the last line says why nothing runs
        traceback.print_exc()
        return BROKEN
    timeout = specification["cell_timeout"]
    # Not before: what is imported by now is the course's and the libraries', whatever a file may be called.
    _put_files(specification["files"])
    if specification.get("evidence"):  # if that fails, there is no evidence file
        watch.run(functools.partial(_read_evidence, specification["evidence"]), 1, timeout)
    worst = FINE
    for name, notebook in specification["notebooks"].items():
        print(name)  # the fork flushes it
        cells = sources(notebook, specification["parameters"])
        worst = max(worst, watch.run(functools.partial(kernel.run, name, cells), len(cells), timeout))
    return worst


def _end(*_arguments: object) -> None:
    """End this process and what it has forked; another signal, which may follow at once, does not disturb that."""
    _handle_endings(signal.SIG_IGN)
    raise KeyboardInterrupt


def _handle_endings(handler: Any) -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup has it
            signal.signal(number, handler)


if __name__ == "__main__":
    _handle_endings(_end)
    code = run(json.load(sys.stdin))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # taking all down in an orderly way would cost as much as a notebook
