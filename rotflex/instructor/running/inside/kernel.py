"""The kernel: ipykernel's own, without its sockets and threads, answering requests in the process that makes them."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import threading
from contextlib import suppress
from types import SimpleNamespace
from typing import Any, cast

from ipykernel.ipkernel import IPythonKernel
from traitlets.config import Config

from .channels import Channel, Descriptor, Hear, Message, Stream


class Kernel:
    """A kernel in this process. Made before the fork, and started after it.

    Attributes
    ----------
    session : what its messages go through
    shell : what ``get_ipython()`` gives in a cell
    log : what a kernel tells whoever looks after it; nobody does
    """

    def __init__(self) -> None:
        # A history file would be written by a thread. The short sleep after each cell is for the network's sake.
        config = Config({"HistoryManager": {"enabled": False}, "Kernel": {"_execute_sleep": 0.0}})
        self.log = logging.getLogger(__name__)
        self.log.addHandler(logging.NullHandler())
        self.log.propagate = False  # cells may set up logging
        self.session = Channel()
        self._kernel = IPythonKernel.instance(config=config, session=self.session, log=self.log)
        self._kernel.shell_channel_thread = SimpleNamespace(parent_thread=threading.main_thread())
        self.shell = cast(Any, self._kernel.shell)
        self.shell.enable_gui = _enable_gui
        self._descriptors: list[Descriptor] = []

    def start(self, hear: Hear | None) -> None:
        """Take over the process: its standard streams, its path, its signals.

        Parameters
        ----------
        hear : gets all messages; None if nobody listens
        """
        self.session.pid, self.session.hear = os.getpid(), hear
        nowhere = os.open(os.devnull, os.O_RDWR)
        self._streams: list[Stream] = []
        sys.stdin = open(nowhere, closefd=False)  # noqa: SIM115
        sys.stdout = Stream(self.session, "stdout", nowhere, self._streams)
        sys.stderr = Stream(self.session, "stderr", nowhere, self._streams)
        os.dup2(nowhere, 0)
        for number, stream in enumerate(self._streams, start=1):
            if hear is None:
                os.dup2(nowhere, number)
            else:
                self._descriptors.append(Descriptor(number, stream))
        sys.displayhook = self.shell.displayhook
        sys.argv = ["ipykernel_launcher.py", "-f", "kernel.json", "--HistoryManager.hist_file=:memory:"]
        sys.path.insert(_before_site_packages(), "")
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    @property
    def running(self) -> bool:
        """Whether no cell has said ``exit()``."""
        return not self.shell.exit_now

    async def execute(self, code: str) -> None:
        """Run a cell, in the loop that runs now. What goes wrong in it is among the messages."""
        content = {"code": code, "silent": False, "store_history": True, "stop_on_error": False}
        request = self.session.msg("execute_request", content)
        self._kernel.io_loop = _Loop(asyncio.get_running_loop())  # type: ignore[assignment]
        self._kernel.set_parent([], request, "shell")
        with suppress(KeyboardInterrupt):  # just when the cell had ended
            self._kernel.pre_handler_hook()
            try:
                await self._kernel.execute_request(None, [], request)
            except Exception as error:  # the cell has broken the shell itself; a kernel goes on as well as it can
                self.log.warning("%r", error)
            finally:
                self._kernel.post_handler_hook()
        for descriptor in self._descriptors:
            descriptor.drain()
        for stream in self._streams:
            stream.flush()

    def receive(self, message: Message) -> None:
        """Take a message from a front end to a widget."""
        self._kernel.set_parent([], message, "shell")
        self._kernel.shell_handlers[message["header"]["msg_type"]](None, [], {"buffers": [], **message})


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
