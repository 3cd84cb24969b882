"""papermill's engine ``labcourse`` outside of grading: the warm process that runs notebooks, or else kernels.

papermill's progress bar has a thread, and a program that calls it may have others, so it is not forked. It starts one
process (:mod:`.inside.main`), which imports what notebooks use and is forked for each, and keeps it for the next one.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import json
import os
import subprocess
import sys
import threading
from collections.abc import Generator, Mapping, Sequence
from queue import Empty
from typing import Any

from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
from jupyter_core.utils import ensure_async
from nbclient.exceptions import DeadKernelError
from nbformat import NotebookNode
from papermill.clientwrap import PapermillNotebookClient
from papermill.log import logger

from labcourse.files import KERNEL
from labcourse.run.inside import main, papermill_client
from labcourse.run.inside.watch import GRACE

#: Windows cannot fork. On macOS a fork is not safe: system libraries start threads of their own (Accelerate, which
#: numpy calculates with there, is one), and a forked process can crash or wait forever. Python's own
#: ``multiprocessing`` no longer forks there for this reason (bpo-33725).
CAN_FORK = sys.platform == "linux"
_IOPUB = 60  # s to wait for the last output of a cell that has ended

#: What a kernel does before the first cell; that student and bench are there if the notebook's own cell stops.
_FIRST = """
from labcourse.answers import cell_reports
if {reports!r}:
    cell_reports.begin({reports!r}, {name!r})
if cell_reports.job.STUDENT:
    student, bench = cell_reports.job.STUDENT, cell_reports.job.BENCH
del cell_reports
"""
_MUTED = """get_ipython().display_formatter.active_types = ["text/plain"]  # nobody looks at pictures"""


def execute_notebook(
    notebook: NotebookNode,
    muted: bool = False,
    imports: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
    **options: Any,
) -> NotebookNode:
    """Run a notebook in the current folder, and return it with its outputs.

    Parameters
    ----------
    notebook : with papermill's metadata
    muted : discard outputs, and for the most part do not even make them
    imports : import statements of what notebooks use, which the warm process imports once
    environment : of the process that runs the cells; None for that of this process
    options : of papermill's own engine, and ``name`` and ``reports`` as :class:`.papermill_client.Client` has them

    Raises
    ------
    ChildProcessError
        If the warm process was killed.
    """
    environment = dict(os.environ if environment is None else environment)
    reason: str | None = f"There is no safe fork on {sys.platform}."
    if CAN_FORK:
        with _lock:
            warm = _started(environment, {"imports": list(imports), "muted": muted})
            client = functools.partial(papermill_client.Client, run=warm.run)
            if (reason := warm.reason) is None:
                return papermill_client.execute(notebook, client, **options)
    logger.warning(f"The notebook gets a kernel of its own. {reason}")
    kernel = functools.partial(_KernelClient, environment=environment, muted=muted)
    return papermill_client.execute(notebook, kernel, **options)


# --- the warm process -------------------------------------------------------------------------------------------------


class _Warm:
    """The warm process.

    Parameters
    ----------
    environment : of the process
    settings : what it imports, and whether it is muted

    Attributes
    ----------
    reason : why it runs no notebook; None if it does
    """

    def __init__(self, environment: dict[str, str], settings: dict[str, Any]) -> None:
        self.made_for = (os.getpid(), environment, settings)
        command = [sys.executable, "-P", "-m", main.__name__]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, env=environment, encoding="utf-8", **pipes)
        self._write(settings)
        self.reason: str | None = self._read()

    def run(self, request: dict[str, Any]) -> Generator[int | None]:
        """Run a notebook in the current folder; yield as :func:`.watch.follow` does."""
        self._write({**request, "folder": os.getcwd()})
        ended = None
        try:
            while ended is None:
                ended = self._read()
                yield ended
        finally:
            if ended is None:  # nobody waits for it any more
                end()

    def end(self) -> None:
        """End the process, and what it has forked."""
        if self.made_for[0] == os.getpid():  # else this program was forked from the one that has it
            self._process.terminate()
            self._process.communicate()

    def _write(self, message: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # the answer says so
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()

    def _read(self) -> Any:
        assert self._process.stdout is not None
        if not (line := self._process.stdout.readline()):
            raise ChildProcessError(f"The process that runs notebooks has ended (code {self._process.wait()}).")
        return json.loads(line)


_kept: list[_Warm] = []  # one at most, for the next notebook
_lock = threading.Lock()


def _started(environment: dict[str, str], settings: dict[str, Any]) -> _Warm:
    """Return the warm process with these settings, and end one with others."""
    if not _kept or _kept[0].made_for != (os.getpid(), environment, settings):
        end()
        _kept.append(_Warm(environment, settings))
    return _kept[0]


def end() -> None:
    """End the warm process, if there is one."""
    while _kept:
        _kept.pop().end()


atexit.register(end)


# --- kernels ----------------------------------------------------------------------------------------------------------


class _OfThisPython(KernelSpecManager):
    """Whatever else is installed under the name of a kernel."""

    def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
        command = [sys.executable, "-P", str(KERNEL), "-f", "{connection_file}"]
        return KernelSpec(argv=command, display_name="Python", language="python")


class _KernelClient(PapermillNotebookClient):  # type: ignore[misc]  # papermill has no types
    """papermill's client for a kernel of this Python. A cell that takes too long is interrupted, as a warm one is.

    Parameters
    ----------
    manager : of the notebook
    environment : of the kernel
    muted : discard outputs
    name, reports : as :class:`.papermill_client.Client` has them
    """

    def __init__(
        self, manager: Any, environment: dict[str, str], muted: bool, name: str = "", reports: str = "", **options: Any
    ) -> None:
        super().__init__(manager, **{"iopub_timeout": _IOPUB, "on_cell_executed": _stop_after_exit} | options)
        self._environment, self._muted = environment, muted
        self._first = _FIRST.format(reports=reports, name=name) + muted * _MUTED

    def create_kernel_manager(self) -> Any:
        manager = super().create_kernel_manager()
        manager.kernel_spec_manager = _OfThisPython()
        return manager

    def execute(self, **_: object) -> None:
        """Run the cells, and put their outputs into the notebook."""
        self.on_notebook_start = lambda **_: self.kc.execute(self._first, silent=True)
        nowhere: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        super().execute(env=self._environment, **nowhere)

    def execute_cell(self, cell: NotebookNode, cell_index: int, **_: object) -> Any:
        """Run a cell, with its id in the request as JupyterLab puts it there."""
        self.kc.session.metadata = {"cellId": cell.get("id")}
        return super().execute_cell(cell, cell_index)

    def output(self, outs: list[NotebookNode], *arguments: Any) -> Any:
        return None if self._muted else super().output(outs, *arguments)

    async def _async_handle_timeout(self, timeout: int, cell: NotebookNode | None = None) -> Any:
        """Interrupt a cell that takes too long, and return its reply; end a kernel that does not reply to that."""
        await ensure_async(self.km.interrupt_kernel())
        with contextlib.suppress(Empty):
            return await ensure_async(self.kc.shell_channel.get_msg(timeout=GRACE))
        raise DeadKernelError("Kernel died")


def _stop_after_exit(cell: NotebookNode, cell_index: int, execute_reply: Mapping[str, Any]) -> None:
    """Run no more cells after one that asked the kernel to end, which it does a moment later.

    Raises
    ------
    DeadKernelError
        If this cell did.
    """
    if any(payload.get("source") == "ask_exit" for payload in execute_reply["content"].get("payload", ())):
        raise DeadKernelError("Kernel died")
