"""JupyterLab as a student starts it, and a headless browser in front of it: one of each for all tests of a process."""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
TOKEN = "for-tests-on-loopback-only"
#: Nothing that a browser does on its own: no look-ups, no updates, no QUIC.
CHROMIUM_OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE = 120_000  # ms; a bound, not an expectation


def free_port() -> int:
    """A port of the loopback interface that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def jupyterlab(folder: Path, *options: str, prefix: str = "") -> Iterator[str]:
    """`rotflex lab FOLDER`, with settings of its own, until the block ends. Gives the address.

    With a prefix, as "/user/ada", all of it is below that, as on a hub.
    """
    port = free_port()
    home = folder.parent / "jupyter-home"
    environment = os.environ | {
        name: str(home / name.lower())
        for name in (
            "HOME",
            "JUPYTER_CONFIG_DIR",
            "JUPYTER_DATA_DIR",
            "JUPYTER_RUNTIME_DIR",
            "IPYTHONDIR",
            "JUPYTERLAB_SETTINGS_DIR",
            "JUPYTERLAB_WORKSPACES_DIR",
        )
    }
    (home / "home").mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "rotflex.cli", "lab", str(folder), *options]
    command += ["--no-browser", "--ip=127.0.0.1", f"--port={port}", "--ServerApp.port_retries=0"]
    command += [
        f"--IdentityProvider.token={TOKEN}",
        "--allow-root",
        f"--ServerApp.base_url={prefix}/",
        "--LabApp.news_url=",
        "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    ]
    log = folder.parent / "jupyterlab.log"
    with log.open("wb") as output:
        server = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
    address = f"http://127.0.0.1:{port}{prefix}"
    try:
        _wait_for(server, f"{address}/api/status?token={TOKEN}", log)
        yield address
    finally:
        server.send_signal(signal.SIGTERM)
        try:
            server.wait(timeout=60)
        except subprocess.TimeoutExpired:
            os.killpg(server.pid, signal.SIGKILL)
            server.wait()


def _wait_for(server: subprocess.Popen, url: str, log: Path) -> None:
    for _ in range(600):
        if server.poll() is not None:
            raise AssertionError(f"JupyterLab ended:\n{log.read_text(errors='replace')[-3000:]}")
        with contextlib.suppress(OSError):
            urllib.request.urlopen(url, timeout=5).close()
            return
        time.sleep(0.2)
    raise AssertionError(f"JupyterLab did not answer:\n{log.read_text(errors='replace')[-3000:]}")


@dataclass
class Served:
    """A JupyterLab that runs, with the course in its folder."""

    address: str
    folder: Path
    released: Path  # a copy of the course, as students get it

    def course(self, name: str) -> Path:
        """Give a test file the course in a folder of its own, below JupyterLab's."""
        return Path(shutil.copytree(self.released, self.folder / name))


@contextlib.contextmanager
def served(folder: Path) -> Iterator[Served]:
    """Serve the course in ``folder / "work"``, below a prefix as a hub does, until the block ends."""
    work, released = folder / "work", folder / "released"
    with jupyterlab(work, "--student", "ada", "--", "--expose-app-in-browser", prefix="/user/ada") as address:
        shutil.copytree(work, released)
        yield Served(address, work, released)


def end_kernels(address: str) -> None:
    """End all kernels that run, as nobody looks at their notebooks any more."""
    for session in get(address, "/api/sessions"):
        ended = urllib.request.Request(f"{address}/api/sessions/{session['id']}?token={TOKEN}", method="DELETE")
        urllib.request.urlopen(ended, timeout=60).close()


def get(address: str, path: str) -> Any:
    """What the server's interface says."""
    with urllib.request.urlopen(f"{address}{path}?token={TOKEN}", timeout=30) as reply:
        return json.load(reply)


@dataclass
class Visit:
    """A page that is open, and what was noticed while it was."""

    page: Any
    errors: list[str] = field(default_factory=list)
    abroad: list[str] = field(default_factory=list)


_open = contextlib.ExitStack()
_chromium: list[Any] = []  # none or one


def chromium() -> Any:
    """Return the browser of this process; start it, without a window, if it does not run yet."""
    if not _chromium:
        from playwright.sync_api import sync_playwright

        playwright = _open.enter_context(sync_playwright())
        launched = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=CHROMIUM_OPTIONS)
        _open.callback(launched.close)
        _chromium.append(launched)
    return _chromium[0]


def close() -> None:
    """End the browser, if it runs. (While it does, this thread has playwright's event loop, and can run no other.)"""
    _chromium.clear()
    _open.close()


@contextlib.contextmanager
def visit(address: str, notebook: str) -> Iterator[Visit]:
    """A notebook in JupyterLab, in a browser with a fresh profile, its kernel ready."""
    page = chromium().new_page(viewport={"width": 1280, "height": 1600})
    try:
        page.set_default_timeout(PATIENCE)
        seen = Visit(page)
        page.on("console", lambda message: seen.errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: seen.errors.append(str(error)))
        page.on("request", lambda request: _note_request(seen, request.url, address))
        page.goto(f"{address}/lab/tree/{notebook}?token={TOKEN}&reset")
        page.wait_for_function(_READY)
        yield seen
    finally:
        page.close()
        end_kernels(address)


def _note_request(seen: Visit, url: str, address: str) -> None:
    if not url.startswith((address, address.replace("http", "ws"), "data:", "blob:", "about:")):
        seen.abroad.append(url)


# JupyterLab hands out its application object when asked to expose it; the session is what to wait for.
_READY = """() => {
    const app = window.jupyterapp;
    const panel = app && app.shell.currentWidget;
    const session = panel && panel.context && panel.context.isReady && panel.sessionContext;
    return Boolean(session && session.session && session.session.kernel && session.session.kernel.status === 'idle');
}"""

_CODE_CELLS = """() => {
    const model = window.jupyterapp.shell.currentWidget.content.model;
    const cells = [];
    for (let i = 0; i < model.cells.length; i++) {
        const cell = model.cells.get(i);
        if (cell.type === 'code') cells.push({source: cell.sharedModel.getSource(), count: cell.executionCount,
            outputs: cell.outputs.toJSON()});
    }
    return cells;
}"""


def run_all(seen: Visit) -> list[dict[str, Any]]:
    """Run all cells and return the code cells: source, count, outputs. Bounded by PATIENCE."""
    # The command's promise ends when the last cell does: do not wait for it inside the page.
    seen.page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
    seen.page.wait_for_function(f"() => ({_CODE_CELLS})().every(cell => !cell.source.trim() || cell.count)")
    return seen.page.evaluate(_CODE_CELLS)


def plain(cell: dict[str, Any]) -> str:
    """The text that a cell printed, and its errors."""
    texts = []
    for output in cell["outputs"]:
        text = output.get("text", output.get("evalue", ""))
        texts.append("".join(text) if isinstance(text, list) else text)
    return re.sub(r"\x1b\[[0-9;]*m", "", "".join(texts))
