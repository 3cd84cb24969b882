"""What the command `lab` has JupyterLab's server do differently: quick explorers, and kernels that start safely.

The server sends a small message ("busy") and then the new picture of an explorer. On a connection that gathers small
messages, as is usual (Nagle's algorithm), the second waits until the browser has acknowledged the first, and a browser
that has nothing else to say does so after 40 ms: half of the time from a slider to its picture.
"""

from __future__ import annotations

import os
import sys
from typing import Any

from jupyter_client.kernelspec import KernelSpec
from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection

from labcourse.jupyterlab import KERNEL


class PromptConnection(ZMQChannelsWebsocketConnection):
    """A kernel's connection to a page that sends each message at once."""

    def connect(self) -> Any:
        """As ever, without gathering."""
        self.websocket_handler.set_nodelay(True)
        return super().connect()


class SafeKernelSpec(KernelSpec):
    """How a kernel is started. One of this Python imports nothing from the notebook's folder until a cell does."""

    def __init__(self, **given: Any) -> None:
        argv = list(given.get("argv", ()))
        if argv[:1] in (["python"], [sys.executable]) and "ipykernel_launcher" in argv:
            begin = argv.index("ipykernel_launcher") + 1
            given["argv"] = [sys.executable, "-P", str(KERNEL), *argv[begin:]]
        super().__init__(**given)


os.environ.pop("PYTHONSAFEPATH", None)  # the server inherits it; terminals run students' programs as ever
