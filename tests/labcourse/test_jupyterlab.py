"""How JupyterLab is started, and its address: with a stand-in for it, and as it is, as root and without a browser."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import strangers
from checkout import ROOT
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import KernelManager

from labcourse import jupyterlab
from labcourse.server import SafeKernelSpec

ROOTLESS = ["--ServerApp.ip=localhost", "--allow-root"]


def command(monkeypatch, *options, root=False, browser=True, page="lab"):
    monkeypatch.setattr(jupyterlab, "_is_root", lambda: root)
    monkeypatch.setattr(jupyterlab, "_has_browser", lambda: browser)
    return jupyterlab._command(Path("work"), page, list(options))


def test_for_a_user_with_a_browser_nothing_is_given_up(monkeypatch):
    said = command(monkeypatch, "--port=1")
    assert not {*ROOTLESS, "--no-browser"} & set(said)
    assert said[-1] == "--port=1"


@pytest.mark.parametrize("option", ["--ip=0.0.0.0", "--ServerApp.ip=0.0.0.0", "--ip"])
def test_root_is_let_in_from_this_machine_alone(monkeypatch, option):
    assert set(ROOTLESS) <= set(command(monkeypatch, root=True))
    assert not set(ROOTLESS) & set(command(monkeypatch, option, root=True))


@pytest.mark.parametrize(
    "option",
    ["--LabApp.default_url=/lab", "--log-level=10", "--ServerApp.log_level=10", "--no-browser", "--LabApp.news_url="],
)
def test_nothing_is_given_twice(monkeypatch, option):
    """JupyterLab takes it for a list, and then takes none of its own settings, without a word."""
    said = command(monkeypatch, option, root=True, browser=False)
    assert [one for one in said if jupyterlab._setting(one) == jupyterlab._setting(option)] == [option]
    assert not [one for one in command(monkeypatch, "--debug") if "log_level" in one]


@pytest.mark.parametrize(
    ("system", "environment", "known", "there"),
    [
        ("linux", {}, True, False),  # a browser in the terminal at best
        ("linux", {"DISPLAY": ":0"}, True, True),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, True, True),
        ("linux", {"BROWSER": "wslview"}, True, True),
        ("linux", {"DISPLAY": ":0"}, False, False),
        ("win32", {}, True, True),
        ("darwin", {}, True, True),
    ],
)
def test_whether_a_browser_can_be_opened(monkeypatch, system, environment, known, there):
    def get():
        if not known:
            raise jupyterlab.webbrowser.Error

    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(jupyterlab.sys, "platform", system)
    monkeypatch.setattr(jupyterlab.webbrowser, "get", get)
    assert jupyterlab._has_browser() is there
    assert ("--no-browser" in command(monkeypatch, browser=there)) is not there


def test_a_secret_of_the_users_own_is_left(monkeypatch):
    monkeypatch.delenv("JUPYTER_TOKEN", raising=False)
    monkeypatch.delenv("JUPYTER_TOKEN_FILE", raising=False)
    first, second = (jupyterlab._environment()["JUPYTER_TOKEN"] for _ in range(2))
    assert len(first) >= 32 and first != second
    monkeypatch.setenv("JUPYTER_TOKEN", "mine")
    assert jupyterlab._environment()["JUPYTER_TOKEN"] == "mine"


@pytest.mark.parametrize(
    ("listens", "address"),
    [("0.0.0.0", "http://127.0.0.1:8889/lab?token=a%20b"), ("lab.edu", "http://lab.edu:8889/lab?token=a%20b")],
)
def test_a_server_that_listens_everywhere_is_here_whatever_a_container_calls_its_host(
    monkeypatch, tmp_path, listens, address
):
    host = "d59d6b7a6f54" if listens == "0.0.0.0" else listens
    told = {"url": f"http://{host}:8889/", "hostname": listens, "port": 8889, "token": "a b"}
    monkeypatch.setattr(jupyterlab, "_servers", lambda: {Path("new"): {**told, "root_dir": str(tmp_path)}})
    server = jupyterlab._Server(tmp_path, "lab", {})
    assert server.found() and server.address() == address


#: On Windows, to terminate a program is to kill it, and JupyterLab is asked by its own interface to end. (Elsewhere it
#: is terminated: all other tests that start it do so.)
AS_ON_WINDOWS = """
from labcourse import jupyterlab
jupyterlab._WINDOWS = True
jupyterlab.subprocess.Popen.terminate = lambda child: print("terminated")
from rotflex.cli import app
app()
"""


def kernel_of(address):
    """Return the command by which the server starts a kernel."""
    server, _slash, rest = address.partition("/lab/tree/")
    request = urllib.request.Request(
        f"{server}/api/kernelspecs", headers={"Authorization": f"token {rest.partition('token=')[2]}"}
    )
    with urllib.request.urlopen(request, timeout=60) as reply:
        return json.loads(reply.read())["kernelspecs"]["python3"]["spec"]["argv"]


@pytest.mark.parametrize(
    "argv", [["python", "-m", "ipykernel_launcher"], [sys.executable, "-Xfrozen_modules=off", "-m"]]
)
def test_a_kernel_of_this_python_takes_nothing_from_its_folder_before_a_cell_does(argv, tmp_path):
    launcher = [] if argv[-1] == "ipykernel_launcher" else ["ipykernel_launcher"]
    spec = SafeKernelSpec(argv=[*argv, *launcher, "-f", "{connection_file}"], language="python", display_name="Python")
    ran = strangers.lay(tmp_path)
    (tmp_path / "own.py").write_text("VALUE = 42\n")
    specs = KernelSpecManager()
    specs.get_kernel_spec = lambda name: spec
    manager = KernelManager(kernel_spec_manager=specs)
    manager.start_kernel(cwd=str(tmp_path), env=os.environ | {"IPYTHONDIR": str(tmp_path / "ipython")})
    client = manager.blocking_client()
    try:
        client.start_channels()
        client.wait_for_ready(timeout=60)
        code = "import json, own, os; assert own.VALUE == 42 and 'PYTHONSAFEPATH' not in os.environ; json.dumps(1)"
        assert client.execute_interactive(code, timeout=60)["content"]["status"] == "ok"
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    assert ran() == []


def test_a_kernel_of_another_program_is_started_as_it_says():
    argv = ["/opt/python3.9", "-m", "ipykernel_launcher"]
    assert SafeKernelSpec(argv=argv).argv == argv


@pytest.mark.slow
def test_the_first_notebook_is_served_and_its_address_is_all_that_is_said(tmp_path):
    """As it is here: in a container, as root and without a browser, among other places. Its end is as on Windows."""
    ran = strangers.lay(tmp_path, tmp_path / "work")
    environment = {
        name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    }
    environment |= {"PYTHONPATH": str(ROOT), "LABCOURSE_CONFIG_DIR": str(tmp_path / "settings")}
    environment |= {f"JUPYTER_{name}_DIR": str(tmp_path / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    running = subprocess.Popen(
        [sys.executable, "-P", "-c", AS_ON_WINDOWS, "lab", "work", "--student", "ada"],
        cwd=tmp_path,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=(tmp_path / "log").open("wb"),
        text=True,
    )
    try:
        told, address = [], ""
        deadline = time.monotonic() + 120
        while not address and time.monotonic() < deadline and (line := running.stdout.readline()):
            told.append(line)
            address = next((word for word in line.split() if word.startswith("http")), "")
        assert "/lab/tree/00_start.ipynb?token=" in address
        assert len(told) == 3  # what was copied, the student, the address
        assert (tmp_path / "log").read_text() == ""
        with urllib.request.urlopen(address, timeout=60) as page:
            assert page.status == 200
        assert kernel_of(address)[:3] == [sys.executable, "-P", str(jupyterlab.KERNEL)]
        assert ran() == []
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address.replace("/lab/tree/", "/api/contents/").partition("?")[0], timeout=60)
    finally:
        running.send_signal(signal.SIGTERM)
        assert running.wait(60) == 0
    assert "terminated" not in running.stdout.read()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=10)
