"""The warm process: it imports what notebooks use, and runs each in a process forked from this one.

    python -P -m labcourse.run.inside.main < SPECIFICATION

For grading, the specification is one line of JSON::

    {"notebooks": {"one.ipynb": {"cells": [...], ...}, ...}, "parameters": {"student": "ada", ...},
     "imports": ["import numpy", ...], "cell_timeout": 60, "files": {"helpers.py": "(base64)", ...},
     "evidence": "package.module:function", "shown": ["one.ipynb"]}

papermill runs each notebook, here, in the current folder, where the files are put. What a cell outputs is discarded,
and pictures that nobody asked for are not drawn; what stopped a cell is written down (``answers.cell_reports``).
With "evidence", that function of the course's is called with the current folder before any notebook is run, and the
plain data that it returns is left as JSON: it reads files of the student's that only a sandbox may open.
With "shown", cells output what they do anywhere, and these notebooks are left with their outputs.
The name of each notebook is printed when it begins. The exit code says how it ended; the package has its constants.

Anywhere else, papermill runs in another process, which keeps this one (:mod:`labcourse.run.warm`). The first line is
``{"imports": [...], "muted": false}``. The answer is a line, null or why no notebook can be run. Each further line is
a request of :class:`.papermill_client.Client`, with the folder to run it in; the answers are what :func:`.watch.follow`
yields, a line each. The process ends with its standard input.
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
from collections.abc import Generator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from labcourse.answers import cell_reports

from . import BROKEN, EVIDENCE_FILE, EXECUTED, FINE, private_interfaces, watch

_TRIAL_TIMEOUT = 60.0  # s; as a cell has
#: What any notebook needs; the specification has the statements for a course.
_ALWAYS_IMPORTED = (
    "import bdb, numpy, matplotlib.pyplot, matplotlib.backends.backend_agg",
    "import ipykernel.ipkernel, IPython.core.logger, IPython.core.pylabtools",
)
#: Imported by some library where it is installed, and not needed by a notebook: a debugger, which starts threads; a
#: grammar of web addresses, which takes seconds (``labcourse.grading``, which is not here, keeps it out as well).
_NOT_IMPORTED = ("debugpy", "rfc3987_syntax")


def _prepared_kernel(imports: list[str], muted: bool = True) -> Any:
    """Do all that need not be done for each notebook, and return a kernel that is ready to be forked.

    Parameters
    ----------
    imports : import statements of the modules that the notebooks use
    muted : whether what cells show is discarded

    Raises
    ------
    UntestedVersionError
        If a library has a version that was not tested, or if cells do not run.
    Exception
        Whatever an import raises.
    """
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # as a kernel sets it
    os.environ["PYTHONBREAKPOINT"] = "0"  # nobody is there to debug: breakpoint() does nothing
    if muted:
        os.environ["LABCOURSE_PICTURES"] = "off"
    gc.disable()  # nothing of this is garbage
    for name in _NOT_IMPORTED:
        sys.modules[name] = None  # type: ignore[assignment]  # the import fails at once
    private_interfaces.check_versions()
    with private_interfaces.plain_docstrings():
        for statement in (*_ALWAYS_IMPORTED, *imports):
            exec(statement, {})
    from .kernel import Kernel  # not before its libraries: they compose their docstrings when they are imported

    kernel = Kernel(muted)
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


def run(specification: dict[str, Any]) -> int:
    """Run all notebooks of a specification, and return the exit code."""
    shown = specification.get("shown", ())
    try:
        kernel = _prepared_kernel(specification["imports"], muted=not shown)
    except private_interfaces.UntestedVersionError as error:
        print(error, file=sys.stderr)
        return BROKEN
    except Exception:  # whatever an import raises: the last line says why nothing runs
        traceback.print_exc()
        return BROKEN
    private_interfaces.silence_loggers()
    with private_interfaces.no_entry_points():  # an engine may be of a package that the release has in another version
        from . import papermill_client
    timeout = specification["cell_timeout"]
    # Not before: what is imported by now is the course's and the libraries', whatever a file may be called.
    _put_files(specification["files"])
    if specification.get("evidence"):  # if that fails, there is no evidence file
        watch.run(functools.partial(_read_evidence, specification["evidence"]), 1, timeout)
    worst = FINE

    def run_here(request: dict[str, Any]) -> Generator[int | None]:
        nonlocal worst
        for ended in _follow(kernel, request):
            worst = max(worst, ended or FINE)
            yield ended

    client = functools.partial(papermill_client.Client, run=run_here)

    def execute_notebook(nb: Any, kernel_name: str, **options: Any) -> Any:
        try:
            return papermill_client.execute(nb, client, **options)
        finally:  # also if a cell has ended the process
            if options["name"] in shown:
                with contextlib.suppress(Exception):  # without it, the rest of the run is worth as much
                    Path(f"{EXECUTED}{options['name']}").write_text(json.dumps(nb), encoding="utf-8")

    engine = SimpleNamespace(
        execute_notebook=execute_notebook,
        nb_kernel_name=lambda nb, name: name,
        nb_language=lambda nb, language: language,
    )
    # Where the release has student and bench of the job, no cell sets them.
    own = ("student", "bench") if getattr(getattr(cell_reports, "job", None), "STUDENT", "") else ()
    parameters = {name: value for name, value in specification["parameters"].items() if name not in own}
    for name, notebook in specification["notebooks"].items():
        print(name)  # the fork flushes it
        papermill_client.run_unattended(
            engine, name, notebook, parameters, reports=cell_reports.REPORTS_FILE, execution_timeout=timeout
        )
    return worst


def _follow(kernel: Any, request: dict[str, Any]) -> Generator[int | None]:
    return watch.follow(functools.partial(kernel.run, request), len(request["cells"]), request["timeout"])


def serve(settings: dict[str, Any]) -> int:
    """Run notebooks that another process asks for, as long as it is there; return the exit code."""
    answers = open(os.dup(1), "w", encoding="utf-8")  # noqa: SIM115 (open as long as the process lives)
    os.dup2(2, 1)  # a library may print when it is imported
    reason = None
    try:
        kernel = _prepared_kernel(settings["imports"], settings["muted"])
    except Exception as error:  # whatever an import raises
        reason = f"{type(error).__name__}: {error}"
    print(json.dumps(reason), file=answers, flush=True)
    for line in sys.stdin if reason is None else ():
        request = json.loads(line)
        os.chdir(request["folder"])
        importlib.reload(sys.modules["labcourse.job"])  # it notes the folder
        for ended in _follow(kernel, request):
            print(json.dumps(ended), file=answers, flush=True)
    return FINE if reason is None else BROKEN


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
    first = json.loads(sys.stdin.readline())
    code = run(first) if "notebooks" in first else serve(first)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # taking all down in an orderly way would cost as much as a notebook
