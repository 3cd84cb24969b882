"""The kernel: ipykernel's own, without its sockets and threads, in the process that gives it cells to run.

What cells show is discarded, or written to a file (:mod:`.outputs`) for the process that follows the run.
"""

from __future__ import annotations

import asyncio
import base64
import io
import logging
import os
import random
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

import numpy as np
from ipykernel.ipkernel import IPythonKernel
from jupyter_client.session import Session
from traitlets.config import Config

from labcourse.answers import cell_reports

from . import outputs, private_interfaces
from .outputs import Message, Source

# What comes after an await is checked as well: IPython runs such cells in another way.
_TRIAL = "import asyncio\nawait asyncio.sleep(0)\nran = 6 * 7"


class Kernel:
    """A kernel in this process. Made before the fork; each process that is forked runs one notebook.

    Parameters
    ----------
    muted : whether what cells show is discarded, and for the most part not even made
    """

    def __init__(self, muted: bool) -> None:
        log = logging.getLogger(__name__)
        log.addHandler(logging.NullHandler())
        log.propagate = False  # cells may set up logging
        self._muted = muted
        self._writer: outputs.Writer | None = None
        self._streams: Sequence[Any] = ()
        self._session = OwnSession()
        config = Config(private_interfaces.kernel_options())
        self._kernel = IPythonKernel.instance(config=config, session=self._session, log=log)
        private_interfaces.run_in_main_thread(self._kernel)
        self._shell = cast(Any, self._kernel.shell)
        self._shell.enable_gui = _enable_gui
        if muted:
            private_interfaces.discard_output(self._shell)
        else:
            private_interfaces.draw_inline()

    def try_out(self, report_step: Callable[[], None]) -> None:
        """Run a cell with a known result, to check that cells run with these libraries.

        Raises
        ------
        RuntimeError
            If the result is another: an error in a kernel's own code is lost, as if a cell had broken it.
        """
        self._run_from_start([(_TRIAL, None, False)], report_step)
        if self._shell.user_ns.get("ran") != 42:
            raise RuntimeError("Cells do not run.")

    def run(self, request: Mapping[str, Any], report_step: Callable[[], None]) -> None:
        """Run the cells of a notebook, and report on them.

        Parameters
        ----------
        request : from :meth:`.papermill_client.Client.execute`
        report_step : called before and after each cell

        Raises
        ------
        SystemExit
            If a cell called ``exit()``; as with a kernel, only this ends a notebook early.
        """
        random.seed()  # the fork has copied the state of the generators
        np.random.seed()
        private_interfaces.reseed_sympy()
        if request["reports"]:
            cell_reports.begin(request["reports"], request["name"])
        self._writer = outputs.Writer(request["outputs"])
        if not self._muted:
            self._session.writer = self._writer
            self._session.send(None, outputs.BEGIN, {"language_info": self._kernel.language_info})
        job: Any = getattr(cell_reports, "job", None)
        if getattr(job, "STUDENT", ""):  # there if the notebook's own cell stops
            self._shell.user_ns.update(student=job.STUDENT, bench=job.BENCH)
        self._run_from_start(request["cells"], report_step)

    def _run_from_start(self, cells: list[Source], report_step: Callable[[], None]) -> None:
        """Take over this process, which was forked for it, and run the cells in an event loop."""
        self._take_over()
        # The loop is not closed in the end: what a cell has left running in it need not be waited for.
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        loop.run_until_complete(self._run_cells(cells, report_step))

    def _take_over(self) -> None:
        """Set the process's standard streams, arguments, path and signals as a kernel has them."""
        nowhere = os.open(os.devnull, os.O_RDWR)
        sys.stdin = open(nowhere, closefd=False)  # noqa: SIM115 (open as long as the process lives)
        for number in range(3):
            os.dup2(nowhere, number)
        if self._muted:
            sys.stdout, sys.stderr = MutedStream("stdout", nowhere), MutedStream("stderr", nowhere)
        else:
            sys.stdout, sys.stderr = self._streams = private_interfaces.streams(self._session)
        sys.displayhook = self._shell.displayhook
        sys.argv = ["ipykernel_launcher.py", "-f", "kernel.json", "--HistoryManager.hist_file=:memory:"]
        sys.path.insert(_place_of_current_folder(), "")
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    async def _run_cells(self, cells: list[Source], report_step: Callable[[], None]) -> None:
        """Run the cells in order, to the first that may not fail and does; raise SystemExit after ``exit()``."""
        self._kernel.io_loop = _Loop(asyncio.get_running_loop())  # type: ignore[assignment]  # it has all that is used of a loop
        for source, cell, may_fail in cells:
            report_step()
            await self._execute(source, cell)
            has_failed, self._session.has_failed = self._session.has_failed, False
            private_interfaces.flush(self._streams)
            if self._writer:
                self._writer.end_cell(has_failed)
            report_step()
            if self._shell.exit_now:
                raise SystemExit
            if has_failed and not may_fail:
                return

    async def _execute(self, code: str, cell: str | None) -> None:
        """Run the source of a cell, with the cell's id. IPython stores the cell's errors; none is raised here."""
        content = {"code": code, "silent": False, "store_history": True, "stop_on_error": False}
        # The id is in the request as JupyterLab puts it there: what a cell records, and its errors, go by this id.
        request = self._session.msg("execute_request", content, metadata={"cellId": cell} if cell else None)
        self._kernel.set_parent([], request, "shell")
        with suppress(KeyboardInterrupt):  # an interrupt that came just when the cell had ended
            self._kernel.pre_handler_hook()
            try:
                # If the cell has broken the shell itself, a kernel goes on as well as it can.
                with suppress(Exception):
                    await self._kernel.execute_request(None, [], request)
            finally:
                self._kernel.post_handler_hook()


class _Loop:
    """The methods of tornado's loop that a kernel calls."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.add_callback = loop.call_soon_threadsafe  # wakes the loop, in an interrupt, too

    def call_later(self, delay: float, callback: object) -> None:
        """Do nothing. ``exit()`` calls this to stop the loop later; here ``exit_now`` is checked after each cell."""

    def stop(self) -> None:
        """Do nothing: the loop ends with the last cell."""


class OwnSession(Session):
    """A kernel's session that sends no messages: it writes them to a file, if it is given one."""

    writer: outputs.Writer | None = None
    has_failed = False  # whether the reply to the last request says so

    def send(
        self,
        stream: object,
        msg_or_type: Message | str,
        content: Message | None = None,
        parent: Message | None = None,
        *_: object,
        buffers: Sequence[Any] | None = None,
        header: Message | None = None,
        metadata: Message | None = None,
        **__: object,
    ) -> Message:
        """Return the message that would have been sent."""
        message = msg_or_type
        if isinstance(message, str):
            message = self.msg(message, content, parent, header, metadata)
        if message["msg_type"] == outputs.END:
            self.has_failed = message["content"]["status"] == "error"
        elif self.writer:
            coded = [base64.b64encode(buffer).decode() for buffer in buffers or ()]
            self.writer.write(message["msg_type"], self.pack({**message, "buffers": coded}))
        return message


class MutedStream(io.TextIOBase):
    """``sys.stdout`` or ``sys.stderr``; it behaves as a kernel's, and discards what is written."""

    encoding = "UTF-8"

    def __init__(self, name: str, descriptor: int) -> None:
        self.name, self._descriptor = name, descriptor

    def fileno(self) -> int:
        """Return the descriptor that other processes may write to; what they write is discarded, as a kernel's."""
        return self._descriptor

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return False

    def write(self, string: str) -> int:
        if not isinstance(string, str):
            raise TypeError(f"write() argument must be str, not {type(string)}")
        return len(string)

    def flush(self) -> None:
        """Do nothing: nothing is held back."""


def _enable_gui(gui: Any = None) -> None:
    """Raise UsageError for a backend with windows: there is no display. The inline backend needs nothing."""
    if gui not in (None, "inline"):
        from IPython.core.error import UsageError

        raise UsageError(f"Cannot enable the event loop of {gui!r}: there is no display.")


def _place_of_current_folder() -> int:
    """Return the place in ``sys.path`` for the current folder: after the standard library, before installed packages.

    A kernel puts it there, so that a student's file cannot replace a module of the standard library.
    """
    for place, folder in enumerate(sys.path):
        if os.path.basename(folder) in {"site-packages", "dist-packages"}:
            return place
    return 0
