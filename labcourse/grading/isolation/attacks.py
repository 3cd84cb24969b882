"""Attacks on six layers from inside a sandbox, for :mod:`labcourse.grading.isolation.selftest`; run it nowhere else.

A program that stands alone: it reads its targets as JSON from standard input, and writes ``attempts.json``, attack →
[whether it was contained, what happened]. It first makes sure that it is in a sandbox, and each attack has a bound.

An attack that returns has succeeded, whatever it returns; one that the sandbox contained raises OSError or MemoryError.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

_KEYCTL = {"x86_64": 250, "aarch64": 219}
READ_KEYS = "system calls: read inherited keys"  #: contained by the filter of system calls, and by nothing else

Targets = dict[str, Any]


def assert_sandboxed(targets: Targets) -> None:
    """Exit unless this is a sandbox: a folder that exists outside does not exist inside."""
    if Path(targets["planted"]).exists() or os.uname().nodename != "sandbox" or os.getuid() == 0:
        sys.exit("This is not a sandbox; nothing was tried.")


def reach_files(targets: Targets) -> str:
    """List the grader's home folder, and make a file in the system or in the Python environment."""
    with contextlib.suppress(OSError):
        # What leads to the Python environment is there on purpose.
        if others := set(os.listdir(targets["home"])) - set(targets["home_shown"]):
            return f"{len(others)} entries of the home folder were seen"
    for folder in ("/", "/usr", "/etc", "/dev", sys.prefix, str(Path(os.__file__).parent)):
        with contextlib.suppress(OSError):
            (Path(folder) / f"labcourse-{targets['token']}").write_text("x", "utf-8")
            return f"a file was made in {folder}"
    raise PermissionError("home folder not to be seen, all else read-only")


def find_process(targets: Targets) -> str:
    """Find a process of the grader's, by a token in its arguments."""
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if targets["token"].encode() in (process / "cmdline").read_bytes():
                return f"process {process.name} was found"
    raise PermissionError("none of its processes to be seen")


def read_keys(_targets: Targets) -> None:
    """Find the keyring of the grader's session, which no namespace hides."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(_KEYCTL.get(os.uname().machine, -1), 0, -3, 0, 0, 0) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


#: Layer and attack → function that makes the attack.
ATTACKS: dict[str, Callable[[Targets], object]] = {
    "network: reach a listener": lambda t: socket.create_connection(("127.0.0.1", t["port"]), timeout=2).close(),
    "files: see the home folder, or make a file": reach_files,
    "processes: find one of the grader's": find_process,
    "memory: take too much": lambda t: len(bytearray(2 * t["memory"])),
    "privileges: become root": lambda t: os.setuid(0),
    READ_KEYS: read_keys,
}


def main() -> None:
    """Make all attacks. What the sandbox answers with an error was contained."""
    targets = json.load(sys.stdin)
    assert_sandboxed(targets)
    attempts: dict[str, tuple[bool, str]] = {}
    for name, attack in ATTACKS.items():
        try:
            attempts[name] = False, f"it succeeded: {attack(targets)}"
        except (OSError, MemoryError) as error:
            attempts[name] = True, getattr(error, "strerror", None) or str(error) or type(error).__name__
    Path("attempts.json").write_text(json.dumps(attempts), "utf-8")


if __name__ == "__main__":
    main()
