"""Runs notebooks, one after the other, each with a kernel of its own, in a folder that is there for the run.

It is what a student's own machine can do: a kernel as JupyterLab starts it, and no sandbox. While one notebook runs,
the kernel of the next is started, and imports what notebooks use. What cells show is nowhere received.
"""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse.errors import CheckError
from labcourse.kernels import KERNEL
from labcourse.run import RUNNING

DIED, EXITED, TIMED_OUT = "died", "exited", "timed out"
CELL_TIMEOUT = 60.0  #: s; the longest cell takes seconds
GRACE = 5.0  #: s after the interrupt until the end; time to tidy up
_BEGIN = 120.0  # s that a kernel may take to start and to import what notebooks use
_LOOK = 0.2  # s between two looks at whether a kernel is still there
PARAMETERS = "parameters"  #: tag of the cell after which parameters are put

Report = Callable[[str, int, int], None]  #: is told the notebook's name, how many cells have been run, and of how many


@dataclass(frozen=True)
class Broken:
    """A cell that did not come to its end by itself.

    Attributes
    ----------
    notebook, cell : its place; the cell's id
    how : DIED (the process), EXITED (asked to, by ``exit()``), or TIMED_OUT. After the first two, and after the last
        where ``gone``, the rest of the notebook was not run
    gone : whether the process had to be ended, or ended
    """

    notebook: str
    cell: str
    how: str
    gone: bool


def run(
    notebooks: Mapping[str, dict[str, Any]],
    folder: Path,
    *,
    parameters: Mapping[str, str],
    imports: Sequence[str] = (),
    first: Callable[[str], str] = lambda name: "",
    cell_timeout: float = CELL_TIMEOUT,
    report: Report = lambda name, done, of: None,
) -> tuple[Broken, ...]:
    """Run the code cells of notebooks, going on to the next cell whatever happens in one.

    Parameters
    ----------
    notebooks : file name → content
    folder : in which they are run
    parameters : bound in each notebook after its cell tagged ``parameters``, or in the beginning
    imports : import statements of what notebooks use
    first : notebook's name → what its kernel does before the first cell, unseen
    cell_timeout : what a cell may take, s; then it is interrupted, and ``GRACE`` later its process is ended
    report : told after each cell

    Raises
    ------
    CheckError
        If a kernel does not start.
    """
    broken: list[Broken] = []
    # JupyterLab's own settings, and what a student's IPython does when it starts, are not part of the work.
    with tempfile.TemporaryDirectory(prefix="labcourse-ipython-", ignore_cleanup_errors=True) as settings:
        kernels = _Kernels(folder, Path(settings), _warm_up(imports))
        try:
            for place, (name, notebook) in enumerate(notebooks.items()):
                kernel = kernels.next(another=place + 1 < len(notebooks))
                kernel.ask(first(name))
                broken += _run_cells(kernel, name, with_parameters(notebook, parameters), cell_timeout, report)
                kernel.end()
        finally:
            kernels.end()
    return tuple(broken)


def with_parameters(notebook: Mapping[str, Any], parameters: Mapping[str, str]) -> list[dict[str, Any]]:
    """The code cells of a notebook, with one that binds parameters, as papermill puts it."""
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    lines = "\n".join(f"{name} = {value!r}" for name, value in parameters.items())
    after = next((n for n, cell in enumerate(cells) if PARAMETERS in cell["metadata"].get("tags", [])), -1) + 1
    return [*cells[:after], {"id": "injected-parameters", "source": f"# Parameters\n{lines}\n"}, *cells[after:]]


def _run_cells(
    kernel: _Kernel, name: str, cells: Sequence[Mapping[str, Any]], timeout: float, report: Report
) -> Iterator[Broken]:
    for done, cell in enumerate(cells):
        report(name, done, len(cells))
        source = "".join(cell["source"])
        if not source.strip():
            continue
        how, gone = kernel.run_cell(source, cell.get("id", ""), timeout)
        if how:
            yield Broken(name, cell.get("id", ""), how, gone)
        if gone:
            break
    report(name, len(cells), len(cells))


def _warm_up(imports: Sequence[str]) -> str:
    """Code that imports, and leaves no name behind. What cannot be imported is for the notebooks to find."""
    return "\n".join(
        [
            "def _warm_up(statements):",
            "    for statement in statements:",
            "        try:",
            "            exec(statement, {})",
            "        except Exception:",
            "            pass",
            f"_warm_up({list(imports)!r})",
            "del _warm_up",
        ]
    )


# --- kernels ----------------------------------------------------------------------------------------------------------


class _Kernels:
    """A kernel for each notebook, the next one started before it is needed."""

    def __init__(self, folder: Path, settings: Path, warm_up: str) -> None:
        self._how = (folder, settings, warm_up)
        self._all: list[_Kernel] = []
        self._waiting: _Kernel | None = None

    def next(self, another: bool) -> _Kernel:
        """A kernel that is ready; ``another`` says that one more will be needed."""
        kernel = self._waiting or self._started()
        self._waiting = None
        if not kernel.ready():  # another program may have taken its ports
            kernel.end()
            kernel = self._started()
            if not kernel.ready():
                raise CheckError(
                    "A Python kernel does not start here. Try whether JupyterLab starts one; if it does not, "
                    f"install ipykernel anew: {sys.executable} -m pip install --force-reinstall ipykernel"
                )
        if another:
            self._waiting = self._started()
        return kernel

    def _started(self) -> _Kernel:
        kernel = _Kernel(*self._how)
        self._all.append(kernel)
        kernel.start()
        return kernel

    def end(self) -> None:
        """End all that are there."""
        for kernel in self._all:
            kernel.end()


class _Kernel:
    """A kernel's process. Of its channels, only that of requests and replies is open."""

    def __init__(self, folder: Path, settings: Path, warm_up: str) -> None:
        from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
        from jupyter_client.manager import KernelManager

        command = [sys.executable, "-P", str(KERNEL), "-f", "{connection_file}"]
        spec = KernelSpec(argv=command, display_name="Python", language="python")

        class OfThisPython(KernelSpecManager):  # whatever else is installed under the name of a kernel
            def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
                return spec

        self._manager = KernelManager(kernel_spec_manager=OfThisPython())
        self._folder, self._settings, self._warm_up = folder, settings, warm_up
        self._client: Any = None
        self._pending = ""

    def start(self) -> None:
        """Start it, and let it import what notebooks use. Nothing is waited for."""
        nowhere: dict[str, Any] = {
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
        }  # what C code and daemons write
        self._manager.start_kernel(cwd=str(self._folder), env=self._environment(), **nowhere)
        self._client = self._manager.blocking_client()
        self._client.start_channels(shell=True, iopub=False, stdin=False, hb=False, control=False)
        self._pending = self._send(self._warm_up, silent=True)

    def _environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "IPYTHONDIR": str(self._settings),
            RUNNING: "check",
            "TQDM_DISABLE": "1",
            "LABCOURSE_PICTURES": "off",
            # As where it is graded; and two kernels share the processors.
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "MKL_NUM_THREADS": "1",
        }

    def ready(self) -> bool:
        """Wait until it has started; whether it has."""
        return self._reply(self._pending, _BEGIN) is not None

    def ask(self, code: str) -> None:
        """Run code unseen.

        Raises
        ------
        CheckError
            If it fails.
        """
        if not code:
            return
        reply = self._reply(self._send(code, silent=True), _BEGIN)
        if reply is None or reply["status"] != "ok":
            why = "" if reply is None else f"{reply.get('ename')}: {reply.get('evalue')}"
            raise CheckError(f"A notebook could not be begun. {why}")

    def run_cell(self, source: str, cell: str, timeout: float) -> tuple[str, bool]:
        """Run a cell: what went wrong besides errors ("" for nothing), and whether the process is gone."""
        request = self._send(source, cell=cell)
        reply = self._reply(request, timeout)
        late = reply is None and self._alive()
        if late:
            self._manager.interrupt_kernel()
            reply = self._reply(request, GRACE)
        if reply is None:
            return (TIMED_OUT if late else DIED), True
        if any(one.get("source") == "ask_exit" for one in reply.get("payload", ())):
            return EXITED, True
        return (TIMED_OUT if late else ""), False

    def end(self) -> None:
        """End the process, and all that it has started. Nothing happens where it has ended."""
        if self._client is not None:
            self._client.stop_channels()
            self._client = None
        with contextlib.suppress(RuntimeError):  # it has not been started
            self._manager.shutdown_kernel(now=True)

    def _alive(self) -> bool:
        return bool(self._manager.is_alive())

    def _send(self, code: str, silent: bool = False, cell: str = "") -> str:
        content = {
            "code": code,
            "silent": silent,
            "store_history": not silent,
            "user_expressions": {},
            "allow_stdin": False,
            "stop_on_error": False,
        }
        message = self._client.session.msg("execute_request", content, metadata={"cellId": cell} if cell else {})
        self._client.shell_channel.send(message)
        return str(message["header"]["msg_id"])

    def _reply(self, request: str, timeout: float) -> dict[str, Any] | None:
        """The reply to a request; None if there is none in time, or if the process has ended."""
        until = time.monotonic() + timeout
        gone = False
        while True:
            left = until - time.monotonic()
            try:
                message = self._client.shell_channel.get_msg(timeout=max(0.0, min(left, _LOOK)))
            except queue.Empty:
                if gone or left <= 0:
                    return None
                gone = not self._alive()  # what it said last is still read
                continue
            if message["parent_header"].get("msg_id") == request:
                return dict(message["content"])
