"""Run notebooks one after the other in a folder, as a student's own computer can: without a sandbox.

On Linux, the warm runner that grading uses (:mod:`labcourse.run.inside`) runs them: it imports what notebooks use once,
and forks for each. It needs the versions of libraries that it was tested with. Elsewhere, each notebook gets a kernel.
What cells show is discarded; ``cell_reports`` writes down what became of them.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse import course_file, job
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.errors import CheckError
from labcourse.files import KERNEL
from labcourse.run import RUNNING, inside
from labcourse.run.inside import main
from labcourse.run.inside.watch import GRACE

CELL_TIMEOUT = 60.0  #: s; the longest cell takes seconds
#: Windows cannot fork. On macOS a fork is not safe: system libraries start threads of their own (Accelerate, which
#: numpy calculates with there, is one), and a forked process can crash or wait forever. Python's own
#: ``multiprocessing`` no longer forks there for this reason (bpo-33725).
CAN_FORK = sys.platform == "linux"
_BEGIN = 120.0  # s that a kernel may take to start
_LOOK = 0.2  # s between two looks at whether a kernel is still there

#: What a kernel does before the first cell.
_FIRST = """
from labcourse.answers import cell_reports
get_ipython().display_formatter.active_types = ["text/plain"]  # nobody looks at pictures
cell_reports.begin({path!r}, {name!r})
student, bench = cell_reports.job.STUDENT, cell_reports.job.BENCH  # there if the notebook's own cell stops
del cell_reports
"""


def run(
    notebooks: Mapping[str, dict[str, Any]],
    folder: Path,
    *,
    parameters: Mapping[str, str],
    imports: Sequence[str] = (),
    cell_timeout: float = CELL_TIMEOUT,
    report: Callable[[str], None] = lambda name: None,
) -> None:
    """Run the code cells of notebooks. After an error in a cell, the next cell is run.

    Parameters
    ----------
    notebooks : file name → content
    folder : in which they are run; answers and reports on cells are left there
    parameters : the student of the run, and the bench unless it is virtual; no cell changes them (:mod:`labcourse.job`)
    imports : import statements of what notebooks use, for the warm runner
    cell_timeout : time for a cell, s; then it is interrupted, and ``GRACE`` later its process is ended
    report : called with the file name of each notebook that begins

    Raises
    ------
    CheckError
        If they cannot be run here.
    """
    # JupyterLab's own settings, and what a student's IPython does when it starts, are not part of the work.
    with tempfile.TemporaryDirectory(prefix="labcourse-ipython-", ignore_cleanup_errors=True) as settings:
        environment = {
            **{name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"},  # cells may start Python
            "IPYTHONDIR": settings,
            job.VARIABLE: json.dumps({**parameters, "course": course_file.read(folder)}),
            RUNNING: "check",
            "TQDM_DISABLE": "1",
            "LABCOURSE_PICTURES": "off",
            # As where it is graded; and two processes share the processors.
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
        }
        specification = {
            "notebooks": dict(notebooks),
            "parameters": {"bench": job.BENCH, **parameters},
            "imports": list(imports),
            "files": {},
            "cell_timeout": cell_timeout,
        }
        if not (CAN_FORK and _run_warm(specification, folder, environment, report)):
            _run_in_kernels(specification, folder, environment, report)


def _run_warm(
    specification: Mapping[str, Any], folder: Path, environment: Mapping[str, str], report: Callable[[str], None]
) -> bool:
    """Run notebooks with the warm runner, and return True; False if it cannot work here, and nothing was run.

    The warm runner is one process that imports libraries once, and forks for each notebook.
    """
    command = [sys.executable, "-P", "-m", main.__name__]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    runner = subprocess.Popen(command, cwd=folder, env=dict(environment), encoding="utf-8", errors="replace", **pipes)
    assert runner.stdin is not None and runner.stdout is not None
    try:
        with contextlib.suppress(BrokenPipeError), runner.stdin:
            json.dump(specification, runner.stdin)
        for line in runner.stdout:
            if (name := line.rstrip("\n")) in specification["notebooks"]:  # a library may print when it is imported
                report(name)
        code = runner.wait()
    finally:
        runner.terminate()
        runner.wait()
        runner.stdout.close()
    if code not in (inside.FINE, inside.TIMED_OUT, inside.DIED, inside.BROKEN):
        raise CheckError(f"The run of your notebooks ended early (code {code}), perhaps for lack of memory. Try again.")
    return code != inside.BROKEN


# --- kernels ----------------------------------------------------------------------------------------------------------


def _run_in_kernels(
    specification: Mapping[str, Any], folder: Path, environment: Mapping[str, str], report: Callable[[str], None]
) -> None:
    """Run notebooks, each with a kernel of its own."""
    for name, notebook in specification["notebooks"].items():
        report(name)
        kernel = _Kernel(folder, environment)
        try:
            kernel.begin(_FIRST.format(path=str(folder / REPORTS_FILE), name=name))
            for source, cell in main.sources(notebook, {}):
                if not kernel.run_cell(source, cell, specification["cell_timeout"]):
                    break
        finally:
            kernel.end()


class _Kernel:
    """A kernel's process. Of its channels, only that of requests and replies is open."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
        from jupyter_client.manager import KernelManager

        command = [sys.executable, "-P", str(KERNEL), "-f", "{connection_file}"]
        spec = KernelSpec(argv=command, display_name="Python", language="python")

        class OfThisPython(KernelSpecManager):  # whatever else is installed under the name of a kernel
            def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
                return spec

        self._manager = KernelManager(kernel_spec_manager=OfThisPython())
        nowhere: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._manager.start_kernel(cwd=str(folder), env=dict(environment), **nowhere)
        self._client = self._manager.blocking_client()
        self._client.start_channels(shell=True, iopub=False, stdin=False, hb=False, control=False)

    def begin(self, code: str) -> None:
        """Wait until the kernel has started and has run some code.

        Raises
        ------
        CheckError
            If it does not start.
        """
        reply = self._reply(self._send(code, None, silent=True), _BEGIN)
        if reply is None or reply["status"] != "ok":
            raise CheckError(
                "A Python kernel does not start here. Try whether JupyterLab starts one; if it does not, "
                f"install ipykernel anew: {sys.executable} -m pip install --force-reinstall ipykernel"
            )

    def run_cell(self, source: str, cell: str | None, timeout: float) -> bool:
        """Run a cell; return False if it ended the process, asked it to end, or could not be interrupted."""
        request = self._send(source, cell)
        reply = self._reply(request, timeout)
        if reply is None and self._manager.is_alive():
            self._manager.interrupt_kernel()
            reply = self._reply(request, GRACE)
        return reply is not None and all(payload.get("source") != "ask_exit" for payload in reply.get("payload", ()))

    def end(self) -> None:
        """End the process, and all that it has started."""
        self._client.stop_channels()
        self._manager.shutdown_kernel(now=True)

    def _send(self, code: str, cell: str | None, silent: bool = False) -> str:
        """Send code to run, with the cell's id as JupyterLab sends it; return the id of the request."""
        content = {"code": code, "silent": silent, "allow_stdin": False, "stop_on_error": False}
        message = self._client.session.msg("execute_request", content, metadata={"cellId": cell} if cell else {})
        self._client.shell_channel.send(message)
        return str(message["header"]["msg_id"])

    def _reply(self, request: str, timeout: float) -> dict[str, Any] | None:
        """Return the reply to a request; None if there is none in time, or if the process has ended."""
        until = time.monotonic() + timeout
        is_alive = True
        while True:
            left = until - time.monotonic()
            try:
                message = self._client.shell_channel.get_msg(timeout=max(0.0, min(left, _LOOK)))
            except queue.Empty:
                if not is_alive or left <= 0:
                    return None
                is_alive = self._manager.is_alive()  # what it said last is still read
                continue
            if message["parent_header"].get("msg_id") == request:
                return dict(message["content"])
