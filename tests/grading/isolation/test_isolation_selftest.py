"""The self-test: its attacks are contained, as root and as an ordinary user, and a layer that is missing is noticed."""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import sandbox_attacks
from checkout import ROOT

from labcourse.errors import IsolationError
from labcourse.grading.isolation import attacks, bubblewrap, sandbox, seccomp, selftest
from labcourse.grading.isolation.process import Ending, Outcome

pytestmark = pytest.mark.isolation

SYSTEM_PYTHON = Path("/usr/bin/python3")
NOBODY = "65534"
LAYERS = ["network", "files", "processes", "memory", "privileges", "system calls", "outliving", "time"]


def broken(attempts):
    """The layers that did not hold."""
    return [attempt.name.partition(":")[0] for attempt in attempts if not attempt.contained]


def test_every_attack_is_contained():
    attempts = selftest.attempts()
    assert [attempt.name.partition(":")[0] for attempt in attempts] == LAYERS
    assert broken(attempts) == []
    assert all(attempt.needed and attempt.result for attempt in attempts)


# A test that could not fail would be worth nothing: with a layer taken away, its attack must be seen to succeed.


def replace_argument(monkeypatch, old, new):
    """Give bubblewrap other words for some that follow each other."""
    arguments, old = bubblewrap.arguments, old.split()

    def replaced(*given):
        args = arguments(*given)
        where = next(at for at in range(len(args)) if args[at : at + len(old)] == old)
        return [*args[:where], *new.split(), *args[where + len(old) :]]

    monkeypatch.setattr(bubblewrap, "arguments", replaced)


def test_a_shared_network_is_noticed(monkeypatch):
    replace_argument(monkeypatch, "--unshare-net", "")
    with pytest.raises(IsolationError, match=": net"):
        selftest.attempts()
    monkeypatch.setattr(sandbox, "_NAMESPACES", ())  # had it not been noticed already
    assert broken(selftest.attempts()) == ["network"]


def test_a_view_of_the_home_folder_is_noticed(monkeypatch):
    with tempfile.TemporaryDirectory(dir="/var/tmp") as home:  # in the sandbox, /tmp is its own
        os.chmod(home, 0o755)
        (Path(home) / "key.py").write_text("")
        monkeypatch.setenv("HOME", home)
        shown = " ".join(bubblewrap._bind_read_only(Path(home)))
        replace_argument(monkeypatch, "--remount-ro /", f"{shown} --remount-ro /")
        assert broken(selftest.attempts()) == ["files"]


def test_a_view_of_the_processes_is_noticed(monkeypatch):
    replace_argument(monkeypatch, "--proc /proc", "--ro-bind /proc /proc")
    assert broken(selftest.attempts()) == ["processes"]


def test_missing_limits_are_noticed(monkeypatch):
    monkeypatch.setattr(sandbox._Sandbox, "limit", lambda *_: ())
    assert broken(selftest.attempts()) == ["memory"]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root has privileges to leave")
def test_a_privilege_that_was_left_is_noticed(monkeypatch):
    left = ["--inh-caps=+setuid", "--ambient-caps=+setuid", "--"]
    prefix = bubblewrap.setpriv_prefix
    monkeypatch.setattr(bubblewrap, "setpriv_prefix", lambda user: [*prefix(user)[:6], *left])
    assert broken(selftest.attempts()) == ["privileges"]


def test_a_missing_filter_is_noticed_and_may_be_missing(monkeypatch):
    monkeypatch.setattr(seccomp, "program", lambda machine: None)
    (keys,) = [attempt for attempt in selftest.attempts() if not attempt.contained or not attempt.needed]
    assert keys.name.startswith("system calls") and not keys.needed
    assert not keys.contained or "not implemented" in keys.result  # a kernel without keys


def test_a_process_that_outlives_its_run_is_noticed(monkeypatch):
    left = []

    def run(command, **_more):
        there = ["/bin/sh", "-c", "echo; read -r word", command[-1]]  # it ends with its input
        left.append(subprocess.Popen(there, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        left[0].stdout.readline()
        return Outcome(Ending.DEADLINE, None, {"started": b"started\n"}, {}, b"", 0.3)

    monkeypatch.setattr(sandbox, "run", run)
    try:
        assert broken(selftest._attempts_to_outlive()) == ["outliving"]
    finally:
        left[0].communicate()


def test_a_view_of_the_outside_is_noticed_before_anything_is_tried(monkeypatch):
    bound, outside = bubblewrap._bind_mounts, tempfile.gettempdir()
    monkeypatch.setattr(bubblewrap, "_bind_mounts", lambda *given: [*bound(*given), "--bind", outside, outside])
    with pytest.raises(IsolationError):
        selftest.attempts()


def test_the_attacks_do_nothing_outside_of_a_sandbox(tmp_path):
    (tmp_path / "secret").write_text("x")
    program = [sys.executable, attacks.__file__]
    done = subprocess.run(
        program, input=f'{{"planted": "{tmp_path}"}}', capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode != 0
    assert "not a sandbox" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["secret"]


AS_ORDINARY_USER = """
import os, sys
from labcourse.grading.isolation import selftest
assert os.geteuid() != 0
assert [layer for layer in selftest.layers() if layer.needed and not layer.good] == []
attempts = selftest.attempts()
assert [attempt for attempt in attempts if attempt.needed and not attempt.contained] == []
assert len(attempts) == 8
import sandbox_attacks
assert sandbox_attacks.successful_attacks() == sandbox_attacks.TOGETHER
print("contained")
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="all other tests are an ordinary user's then")
def test_every_attack_is_contained_for_an_ordinary_user_as_well(tmp_path_factory):
    if not SYSTEM_PYTHON.exists():
        pytest.skip("no Python of the system's, for a user who cannot see this one")
    scratch = Path(subprocess.check_output(["mktemp", "-d", "/tmp/rotflex-test-XXXXXX"], text=True).strip())
    try:
        scratch.chmod(0o755)
        package = scratch / "labcourse"
        shutil.copytree(ROOT / "labcourse", package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(sandbox_attacks.__file__, scratch)
        drop = ["setpriv", "--reuid", NOBODY, "--regid", NOBODY, "--clear-groups", "--inh-caps=-all"]
        environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(scratch), "HOME": "/nonexistent"}
        done = subprocess.run(
            [*drop, str(SYSTEM_PYTHON), "-B", "-c", AS_ORDINARY_USER],
            env=environment,
            cwd="/",
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        shutil.rmtree(scratch)
    assert done.stdout == "contained\n", done.stderr


def test_the_package_can_be_imported_where_linuxs_own_modules_are_missing():
    """As on Windows: without fcntl, resource, pwd and the like."""
    modules = [module.stem for module in (ROOT / "labcourse" / "grading" / "isolation").glob("*.py")]
    assert "sandbox" in modules
    script = "import sys\nfor name in ('fcntl', 'resource', 'pwd', 'grp', 'termios'): sys.modules[name] = None\n"
    script += "".join(f"import labcourse.grading.isolation.{name}\n" for name in modules if name != "__init__")
    assert importlib.util.find_spec("labcourse.grading.isolation") is not None
    done = subprocess.run([sys.executable, "-S", "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
