"""JupyterLab as ``labcourse lab`` runs it: on a folder, at its first notebook, with its address in one line."""

from __future__ import annotations

import json
import os
import secrets
import signal
import subprocess
import sys
import urllib.parse
import urllib.request
import webbrowser
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_CONNECTION = "labcourse.server.PromptConnection"  # by name: the server is another program
_KERNELS = "labcourse.server.SafeKernelSpec"
_SAVED = "labcourse.scene.saved_explorers.with_pictures"
KERNEL = Path(__file__).parent / "jupyter" / "kernel.py"
_SETTINGS = KERNEL.parent  # of JupyterLab, unless its user chose others
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP
_PATIENCE = 15  # s for JupyterLab to end its kernels and go; kernels take 5 s each, together
_LOOK = 0.2  # s between two looks for its address
_ASKING = 5  # s for its server to take a request; it answers at once, and before the patience for its end is over
_EVERYWHERE = ("", "0.0.0.0", "::", "*")  # addresses that stand for all of a machine's
_PATHS = "JUPYTER_CONFIG_PATH"
_STARTUP = "PYTHONSTARTUP"
_TOKENS = ("JUPYTER_TOKEN", "JUPYTER_TOKEN_FILE")

_WINDOWS = sys.platform == "win32"
#: How a program is started that is to hear Ctrl-C from us only.
_BY_ITSELF: dict[str, Any] = (
    {"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)} if _WINDOWS else {"start_new_session": True}
)


def open_jupyterlab(folder: Path, options: list[str]) -> int:
    """Run JupyterLab until it ends or is interrupted, and return its exit code.

    Parameters
    ----------
    folder : with the notebooks; the first one is shown
    options : JupyterLab's own; they win over ours
    """
    first = min((path.name for path in folder.glob("*.ipynb")), default="")
    page = f"lab/tree/{urllib.parse.quote(first)}" if first else "lab"
    # In a session of its own, JupyterLab hears Ctrl-C from us only: it would ask, and be ended before it has ended its
    # kernels. Whatever ends this program, then, has to end JupyterLab, too: a closed terminal as well.
    previous = {number: signal.signal(number, _interrupt) for number in _ENDINGS}
    server = _Server(folder, page, _servers())
    child = subprocess.Popen(_command(folder, page, options), env=_environment(), **_BY_ITSELF)
    try:
        return _wait(child, server)
    except KeyboardInterrupt:
        print("Stopping JupyterLab.")
        return 0
    finally:
        _stop(child, server)
        for number, handler in previous.items():
            signal.signal(number, handler)


# --- how it is started ------------------------------------------------------------------------------------------------


def _command(folder: Path, page: str, options: list[str]) -> list[str]:
    theirs = {_setting(option) for option in options}
    ours = [
        f"--ServerApp.root_dir={folder.resolve()}",
        f"--ServerApp.kernel_websocket_connection_class={_CONNECTION}",
        f"--KernelSpecManager.kernel_spec_class={_KERNELS}",
        f"--ContentsManager.pre_save_hook={_SAVED}",
        f"--LabApp.default_url=/{page}",
        # What matters of all that it would say, its address, is said by us; and nothing is asked of the network.
        *([] if "debug" in theirs else ["--Application.log_level=ERROR"]),
        "--LabApp.news_url=",
        "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    ]
    if _is_root() and "ip" not in theirs:
        # Root in a container is usual; who lets others than this machine in decides about root, too.
        ours += ["--ServerApp.ip=localhost", "--allow-root"]
    if not _has_browser():
        ours += ["--no-browser"]
    # What is given twice, JupyterLab takes for a list, and then it takes none of its settings.
    mine = [option for option in ours if _setting(option) not in theirs]
    return [sys.executable, "-P", "-m", "jupyterlab", *mine, *options]


def _setting(option: str) -> str:
    """The name of what an option sets: of ``--ServerApp.log_level=10`` and of ``--log-level=10``, "log_level"."""
    return option.lstrip("-").partition("=")[0].rpartition(".")[2].replace("-", "_")


def _environment() -> dict[str, str]:
    """With a secret that is in no log: by one of JupyterLab's own making, it would print the address in five lines.

    And with settings by which it does not ask, over a student's first picture, whether they want its news; and with a
    file that each kernel runs at its start, unless the user has one.
    """
    paths = [os.environ.get(_PATHS, ""), str(_SETTINGS)]
    ours = {_PATHS: os.pathsep.join(filter(None, paths))}
    if not os.environ.get(_STARTUP):
        ours[_STARTUP] = str(_SETTINGS / "startup.py")
    if not any(os.environ.get(name) for name in _TOKENS):
        ours[_TOKENS[0]] = secrets.token_hex(24)
    return os.environ | ours


def _is_root() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _has_browser() -> bool:
    """Whether a browser that can show JupyterLab can be opened: one in the terminal cannot."""
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("win32", "darwin", "cygwin") or any(os.environ.get(name) for name in screens)


# --- while it runs ----------------------------------------------------------------------------------------------------


def _wait(child: subprocess.Popen[bytes], server: _Server) -> int:
    """Wait for its end, and say its address once it is known.

    On Windows, Ctrl-C is heard after a wait and not within it: so each is short.
    """
    told = False
    while True:
        try:
            return child.wait(_LOOK)
        except subprocess.TimeoutExpired:
            if not told and server.found():
                told = True
                address = server.address()
                print(f"JupyterLab runs at {address}  (Ctrl-C ends it.)", flush=True)


class _Server:
    """The server that has come since, for a folder, as it says of itself.

    Parameters
    ----------
    folder, page : what it shows
    before : the servers that ran before
    """

    def __init__(self, folder: Path, page: str, before: Mapping[Path, Any]) -> None:
        self._folder, self._page, self._before = folder, page, before
        self._told: dict[str, Any] = {}

    def found(self) -> bool:
        """Whether it is there yet."""
        for path, server in _servers().items():
            if server != self._before.get(path) and _same(server.get("root_dir"), self._folder):
                self._told = server
        return bool(self._told)

    def address(self) -> str:
        """Where it shows the page."""
        token = self._told.get("token")
        return f"{self._url()}{self._page}" + (f"?token={urllib.parse.quote(token)}" if token else "")

    def _url(self) -> str:
        """Where it is for whoever sits here. One that listens everywhere names its host, which a container makes up."""
        url = urllib.parse.urlsplit(str(self._told["url"]))
        if self._told.get("hostname") in _EVERYWHERE:
            url = url._replace(netloc=f"127.0.0.1:{self._told.get('port', url.port)}")
        return url.geturl()

    def end(self) -> bool:
        """Ask it to end its kernels and go; whether it has heard."""
        if not self._told:
            return False
        heads = {"Authorization": f"token {self._told.get('token', '')}"}
        asked = urllib.request.Request(f"{self._url()}api/shutdown", data=b"", headers=heads, method="POST")
        try:
            urllib.request.urlopen(asked, timeout=_ASKING).close()
        except OSError:
            return False
        return True


def _same(given: Any, folder: Path) -> bool:
    return isinstance(given, str) and _plain(given) == _plain(folder)


def _plain(path: str | Path) -> str:
    return os.path.normcase(os.path.realpath(path))


def _servers() -> dict[Path, dict[str, Any]]:
    """What the servers that run here say of themselves, by their files."""
    from jupyter_core.paths import jupyter_runtime_dir

    found = {}
    for path in Path(jupyter_runtime_dir()).glob("jpserver-*.json"):
        try:
            server = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):  # gone, or not all there yet
            continue
        if isinstance(server, dict) and isinstance(server.get("url"), str):
            found[path] = server
    return found


# --- its end ----------------------------------------------------------------------------------------------------------


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


def _stop(child: subprocess.Popen[bytes], server: _Server) -> None:
    """End a child that is still running, kindly first: it has kernels to end, and these leave benches at 0 V."""
    if child.poll() is not None:
        return
    # Another Ctrl-C while it is going is for nobody.
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        if not (_WINDOWS and server.end()):  # where to terminate is to kill
            child.terminate()
        try:
            child.wait(timeout=_PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
    finally:
        signal.signal(signal.SIGINT, previous)
