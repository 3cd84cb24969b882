"""The kernel: ipykernel's own, without its sockets and threads, answering requests in the process that makes them."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from contextlib import suppress
from typing import Any, cast

from ipykernel.ipkernel import IPythonKernel
from traitlets.config import Config

from . import private_interfaces
from .muted import MutedSession, MutedStream


class Kernel:
    """A kernel in this process. Made before the fork, and started after it."""

    def __init__(self) -> None:
        log = logging.getLogger(__name__)
        log.addHandler(logging.NullHandler())
        log.propagate = False  # cells may set up logging
        self._session = MutedSession()
        config = Config(private_interfaces.kernel_options())
        self._kernel = IPythonKernel.instance(config=config, session=self._session, log=log)
        private_interfaces.run_in_main_thread(self._kernel)
        self._shell = cast(Any, self._kernel.shell)
        self._shell.enable_gui = _enable_gui
        private_interfaces.discard_output(self._shell)

    def start(self) -> None:
        """Take over the process: its standard streams, its path, its signals."""
        nowhere = os.open(os.devnull, os.O_RDWR)
        sys.stdin = open(nowhere, closefd=False)  # noqa: SIM115
        sys.stdout = MutedStream("stdout", nowhere)
        sys.stderr = MutedStream("stderr", nowhere)
        for number in range(3):
            os.dup2(nowhere, number)
        sys.displayhook = self._shell.displayhook
        sys.argv = ["ipykernel_launcher.py", "-f", "kernel.json", "--HistoryManager.hist_file=:memory:"]
        sys.path.insert(_before_site_packages(), "")
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    @property
    def names(self) -> dict[str, Any]:
        """What cells have bound."""
        return cast(dict[str, Any], self._shell.user_ns)

    @property
    def running(self) -> bool:
        """Whether no cell has called ``exit()``."""
        return not self._shell.exit_now

    async def execute(self, code: str, cell: str = "") -> None:
        """Run a cell, by its id, in the loop that runs now. What goes wrong in it is the cell's affair."""
        content = {"code": code, "silent": False, "store_history": True, "stop_on_error": False}
        # As JupyterLab does it: what a cell records, and its errors, are known by the cell's id.
        request = self._session.msg("execute_request", content, metadata={"cellId": cell} if cell else None)
        self._kernel.io_loop = _Loop(asyncio.get_running_loop())  # type: ignore[assignment]
        self._kernel.set_parent([], request, "shell")
        with suppress(KeyboardInterrupt):  # just when the cell had ended
            self._kernel.pre_handler_hook()
            try:
                # If the cell has broken the shell itself, a kernel goes on as well as it can.
                with suppress(Exception):
                    await self._kernel.execute_request(None, [], request)
            finally:
                self._kernel.post_handler_hook()


class _Loop:
    """What a kernel asks of tornado's loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.add_callback = loop.call_soon_threadsafe  # wakes the loop, in an interrupt, too

    def call_later(self, delay: float, callback: object) -> None:
        """By this, ``exit()`` would stop the loop; here it is enough to see it when the cell has ended."""

    def stop(self) -> None:
        """As above."""


def _enable_gui(gui: Any = None) -> None:
    """There are no windows; the backend that draws into the notebook needs none."""
    if gui not in (None, "inline"):
        from IPython.core.error import UsageError

        raise UsageError(f"Cannot enable the event loop of {gui!r}: there is no display.")


def _before_site_packages() -> int:
    """Where a kernel puts the current folder: after the standard library, so that nothing there can stand in for it."""
    for place, folder in enumerate(sys.path):
        if os.path.basename(folder) in {"site-packages", "dist-packages"}:
            return place
    return 0
