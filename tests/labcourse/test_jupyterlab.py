"""How JupyterLab is started, and its address: in parts, and as it is, as root and without a browser."""

import json
import os
import signal
import subprocess
import sys
import urllib.request
from types import SimpleNamespace

import pytest
import strangers
from browser import free_port
from checkout import ROOT
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import KernelManager
from jupyter_server.auth import IdentityProvider
from jupyter_server.serverapp import ServerApp

from labcourse import server
from labcourse.files import KERNEL
from labcourse.server import CourseServer, SafeKernelSpec


@pytest.fixture
def serving(monkeypatch):
    """Make a server that serves nothing when it is started."""
    monkeypatch.setattr(ServerApp, "start_app", lambda server: None)

    def made(**options):
        course = CourseServer(**options)
        course.identity_provider = IdentityProvider(parent=course)
        course.io_loop = SimpleNamespace(add_callback=lambda *_arguments, **_options: None)
        return course

    return made


@pytest.mark.parametrize(
    ("system", "environment", "opened"),
    [
        ("linux", {}, False),  # a browser for terminals at best
        ("linux", {"DISPLAY": ":0"}, True),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, True),
        ("linux", {"BROWSER": "wslview"}, True),
        ("win32", {}, True),
        ("darwin", {}, True),
    ],
)
def test_a_browser_is_opened_where_it_has_a_screen(monkeypatch, serving, system, environment, opened):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    course = serving(open_browser=True)
    monkeypatch.setattr(server.sys, "platform", system)
    course.start_app()
    assert course.open_browser is opened


def test_a_secret_of_the_users_own_is_left(monkeypatch):
    monkeypatch.delenv("JUPYTER_TOKEN", raising=False)
    monkeypatch.delenv("JUPYTER_TOKEN_FILE", raising=False)
    first, second = (server.environment()["JUPYTER_TOKEN"] for _ in range(2))
    assert len(first) >= 32 and first != second
    monkeypatch.setenv("JUPYTER_TOKEN", "mine")
    assert "JUPYTER_TOKEN" not in server.environment()


@pytest.mark.parametrize(
    ("ip", "host", "root"),
    [
        ("localhost", "localhost", True),
        ("0.0.0.0", "127.0.0.1", False),
        ("", "127.0.0.1", False),
        ("::", "[::1]", False),
        ("lab.edu", "lab.edu", False),
    ],
)
def test_the_address_is_one_on_this_machine_and_root_serves_nobody_else(monkeypatch, serving, ip, host, root):
    monkeypatch.setenv("JUPYTER_TOKEN", "a b")
    course = serving(port=8889, default_url="/lab")
    course.ip = ip
    course.start_app()
    assert (course.address, course.allow_root) == (f"http://{host}:8889/lab?token=a%20b", root)


def asked(address, what, data=None):
    """Ask the server's interface."""
    at, _slash, rest = address.partition("/lab/tree/")
    head = {"Authorization": f"token {rest.partition('token=')[2]}"}
    with urllib.request.urlopen(urllib.request.Request(f"{at}/api/{what}", data, head), timeout=60) as reply:
        return json.loads(reply.read())


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


def served(folder, *options):
    """Start the command, as in a container without a browser; return the process and the lines up to the address."""
    environment = {
        name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    }
    environment |= {"PYTHONPATH": str(ROOT), "LABCOURSE_CONFIG_DIR": str(folder / "settings")}
    environment |= {f"JUPYTER_{name}_DIR": str(folder / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    running = subprocess.Popen(
        [sys.executable, "-m", "rotflex", "lab", "work", *options],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=(folder / "log").open("wb"),
        text=True,
    )
    lines = []
    while (line := running.stdout.readline()) and "http" not in line:
        lines.append(line)
    return running, [*lines, line]


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_the_first_notebook_is_served_and_its_address_is_all_that_is_said(tmp_path):
    """As it is here: in a container, as root and without a browser, among other places. It ends with its kernels."""
    ran = strangers.lay(tmp_path / "work", names=strangers.OF_OTHERS)
    running, lines = served(tmp_path, "--student", "ada", "--", "--LabApp.news_url=")
    try:
        address = next((word for word in lines[-1].split() if word.startswith("http")), "")
        assert "/lab/tree/00_start.ipynb?token=" in address
        assert len(lines) == 3  # what was copied, the student, the address
        assert (tmp_path / "log").read_text() == ""
        with urllib.request.urlopen(address, timeout=60) as page:
            assert page.status == 200
        spec = asked(address, "kernelspecs")["kernelspecs"]["python3"]["spec"]
        assert spec["argv"][:3] == [sys.executable, "-P", str(KERNEL)]
        assert ran() == []
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address.replace("/lab/tree/", "/api/contents/").partition("?")[0], timeout=60)
        kernel = asked(address, "kernels", b"{}")["id"]
    finally:
        running.send_signal(getattr(signal, "SIGHUP", signal.SIGTERM))
        running.send_signal(signal.SIGINT)  # a second one does not cut the end short
        assert running.wait(60) == 0
    assert "Stopping" in running.stdout.read()
    assert not [*(tmp_path / "RUNTIME").glob(f"kernel-{kernel}*")]


@pytest.mark.scheduled
@pytest.mark.timeout(120)
def test_the_users_options_win(tmp_path):
    port = free_port()
    running, lines = served(
        tmp_path, "--", "--LabApp.default_url=/tree", f"--ServerApp.port={port}", "--IdentityProvider.token=mine"
    )
    running.send_signal(signal.SIGTERM)
    assert running.wait(60) == 0 and f":{port}/tree?token=mine" in lines[-1]
