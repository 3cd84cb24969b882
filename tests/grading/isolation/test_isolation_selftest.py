"""The self-test: its attacks are contained, as root and as an ordinary user, and a layer that is missing is noticed."""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from checkout import ROOT

from labcourse.errors import IsolationError
from labcourse.grading.isolation import attacks, bubblewrap, cgroups, sandbox, seccomp, selftest

pytestmark = pytest.mark.isolation

SYSTEM_PYTHON = Path("/usr/bin/python3")
NOBODY = "65534"


def not_contained(attempts):
    return {attempt.name for attempt in attempts if not attempt.contained}


def test_every_attack_is_contained():
    attempts = selftest.attempts()
    names = [attempt.name for attempt in attempts]
    assert names == [*attacks.ATTACKS, "outlive a flood of output", "outlive the deadline"]
    together = set() if "memory" in cgroups.parent_groups() else {"take too much memory together"}
    assert not_contained(attempts) == together
    assert [attempt.name for attempt in attempts if not attempt.needed] == ["take too much memory together"]
    assert all(attempt.result for attempt in attempts)


# A test that could not fail would be worth nothing: with a layer taken away, its attacks must be seen to succeed.


def test_a_shared_network_is_noticed(monkeypatch):
    arguments = bubblewrap.arguments
    monkeypatch.setattr(
        bubblewrap, "arguments", lambda *given: [word for word in arguments(*given) if word != "--unshare-net"]
    )
    with pytest.raises(IsolationError, match=": net"):
        selftest.attempts()
    monkeypatch.setattr(sandbox, "_NAMESPACES", ())  # had it not been noticed already
    found = not_contained(selftest.attempts())
    assert {"reach a TCP listener", "reach a UDP listener", "reach an abstract unix listener"} <= found
    assert "read a file outside" not in found


def test_missing_limits_are_noticed(monkeypatch):
    monkeypatch.setattr(sandbox._Sandbox, "limit", lambda *_: ())
    found = not_contained(selftest.attempts())
    assert {"write a file too big", "take too much memory", "start too many processes"} <= found
    assert "fill the folder" not in found


def test_a_folder_without_bounds_is_noticed(monkeypatch):
    arguments = bubblewrap.arguments

    def unbounded(*given):
        args = arguments(*given)
        where = args.index(str(selftest._LIMITS.folder)) - 1  # --size N
        return args[:where] + args[where + 2 :]

    monkeypatch.setattr(bubblewrap, "arguments", unbounded)
    assert not_contained(selftest.attempts()) - {"take too much memory together"} == {"fill the folder"}


def test_a_missing_filter_is_noticed(monkeypatch):
    monkeypatch.setattr(seccomp, "program", lambda machine: None)
    attempts = selftest.attempts()
    assert "reach a virtual machine's host" in not_contained(attempts) | {
        attempt.name
        for attempt in attempts
        if "not supported" in attempt.result  # a kernel without them
    }
    if os.geteuid() == 0:
        assert "make a user namespace" in not_contained(attempts)
    assert not {attempt.name for attempt in attempts if attempt.needed} & not_contained(attempts)


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
assert len(attempts) > 20
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
