"""JupyterLab as ``labcourse lab`` runs it: on a folder, at its first notebook, with its address in one line.

Its server stops at the first Ctrl-C, and starts kernels safely.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import sys
import urllib.parse
from pathlib import Path
from typing import Any

from jupyter_client.kernelspec import KernelSpec
from jupyter_server.serverapp import ServerApp
from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection
from jupyterlab.labapp import LabApp  # type: ignore[import-untyped]
from traitlets.config import Config

from labcourse.files import KERNEL, LAB_EXTENSIONS

#: JupyterLab's settings; a user's options win over them. The server imports what they name.
SETTINGS = {
    "Application": {"log_level": "ERROR"},
    "ContentsManager": {"pre_save_hook": "labcourse.scene.saved_explorers.with_pictures"},
    "KernelSpecManager": {"kernel_spec_class": "labcourse.server.SafeKernelSpec"},
    "LabApp": {"news_url": "", "check_for_updates_class": "jupyterlab.NeverCheckForUpdate"},
    "ServerApp": {"kernel_websocket_connection_class": "labcourse.server.PromptConnection"},
}
_TOKENS = ("JUPYTER_TOKEN", "JUPYTER_TOKEN_FILE")
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
_LOCAL = ("localhost", "127.0.0.1", "::1")
_EVERYWHERE = ("", "0.0.0.0", "::")  # addresses that stand for all of a machine's
_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # environment variables; one is set where a browser can be seen


class PromptConnection(ZMQChannelsWebsocketConnection):
    """A kernel's connection to a page that sends each message at once.

    The server sends a small message ("busy") and then the new picture of an explorer. If small messages are gathered
    (Nagle's algorithm, the default), the second waits until the browser has acknowledged the first, up to 40 ms: half
    of the time from a slider to its picture.
    """

    def connect(self) -> Any:
        """Connect, with Nagle's algorithm switched off."""
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


class CourseServer(ServerApp):
    """A server that prints its address in one line, and stops at the first Ctrl-C without a question."""

    _ending = False

    def init_signal(self) -> None:
        """End the kernels and stop at any signal to end; kernels leave benches at 0 V."""
        super().init_signal()
        for name in _SIGNALS:
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), self._end)

    def start_app(self) -> None:
        """Start to serve, and print the address.

        Root, the usual user in a container, may start it without an option if only this machine can connect.
        """
        self.allow_root = self.allow_root or self.ip in _LOCAL
        has_screen = sys.platform in ("win32", "darwin", "cygwin") or any(map(os.environ.get, _SCREENS))
        self.open_browser = self.open_browser and has_screen  # else a browser for terminals takes over this terminal
        if first := urllib.parse.unquote(self.default_url.partition("/lab/tree/")[2]):
            self.io_loop.add_callback(self._start_kernel, first)
        super().start_app()
        # An earlier callback of this loop begins to listen.
        self.io_loop.add_callback(print, f"JupyterLab runs at {self.address}  (Ctrl-C ends it.)", flush=True)

    async def _start_kernel(self, notebook: str) -> None:
        """Start the kernel of the first notebook before its page asks for it. Where that fails, the page says why."""
        name = self.kernel_manager.default_kernel_name
        with contextlib.suppress(Exception):
            await self.session_manager.create_session(notebook, notebook, "notebook", name)

    @property
    def address(self) -> str:
        """The address of the first page, with the token. It avoids a container's host name, which is invented."""
        url = urllib.parse.urlsplit(self.local_url if self.ip in _EVERYWHERE else self.public_url)
        token = self.identity_provider.token
        return url._replace(query=f"token={urllib.parse.quote(token)}" if token else "").geturl()

    def _end(self, *_: Any) -> None:
        """Stop the server, once."""
        if not self._ending:  # a second Ctrl-C must not interrupt the end
            self._ending = True
            self.stop(from_signal=True)
            with contextlib.suppress(OSError):  # the terminal may be closed
                print("Stopping JupyterLab.", flush=True)


def run(folder: Path, options: list[str]) -> None:
    """Run JupyterLab until it ends or is interrupted.

    Parameters
    ----------
    folder : with the notebooks; the first one is shown
    options : JupyterLab's own; they win over ours
    """
    os.environ |= environment()
    os.environ.pop("PYTHONSAFEPATH", None)  # students' programs, which terminals start, run as usual
    first = min((path.name for path in folder.glob("*.ipynb")), default="")
    config = Config(SETTINGS)
    config.ServerApp.root_dir = str(folder.resolve())
    config.LabApp.extra_labextensions_path = [str(LAB_EXTENSIONS)]
    config.LabApp.default_url = f"/lab/tree/{urllib.parse.quote(first)}" if first else "/lab"
    CourseServer.instance(config=config, jpserver_extensions={"jupyterlab": True})  # LabApp takes this instance
    LabApp.launch_instance(argv=options)


def environment() -> dict[str, str]:
    """Return the environment variables that JupyterLab needs.

    With a token from the environment, JupyterLab prints its address in one line instead of five, and writes it to no
    log. The folder of settings switches off its question about news, which would cover a student's first picture.
    """
    paths = [os.environ.get("JUPYTER_CONFIG_PATH", ""), str(KERNEL.parent)]
    variables = {"JUPYTER_CONFIG_PATH": os.pathsep.join(filter(None, paths))}
    if not any(os.environ.get(name) for name in _TOKENS):
        variables[_TOKENS[0]] = secrets.token_hex(24)
    return variables
