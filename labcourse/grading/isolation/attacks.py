"""Attacks, to be made from inside a sandbox by :mod:`labcourse.grading.isolation.selftest`. Run this nowhere else.

A program that stands alone: it reads its targets as JSON from standard input, and writes ``attempts.json``, attack →
[whether it was contained, what happened]. It first makes sure that it is in a sandbox, and each attack has a bound.

An attack that returns has succeeded, whatever it returns; one that the sandbox contained raises OSError or MemoryError.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

MIB = 2**20
_NEW_USER, _AF_VSOCK, _PTRACE_SEIZE = 0x10000000, 40, 0x4206
_KEYCTL = {"x86_64": 250, "aarch64": 219}
_MESSAGE = b"Seen from outside."
FILTER, GROUPS = "system calls", "memory of all together"  #: optional layers

Targets = dict[str, Any]


def assert_sandboxed(to: Targets) -> None:
    """Exit unless this is a sandbox: a folder that exists outside does not exist inside."""
    if Path(to["planted"]).exists() or os.uname().nodename != "sandbox" or os.getuid() == 0:
        sys.exit("This is not a sandbox; nothing was tried.")


def connect(family: int, address: Any) -> None:
    """Send a message to a listener outside."""
    with socket.socket(family, socket.SOCK_STREAM) as connection:
        connection.settimeout(2)
        connection.connect(address)
        connection.sendall(_MESSAGE)


def send_udp(to: Targets) -> None:
    """Send to every address of the outside; the outside looks whether it arrives."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as connection:
        for address in to["addresses"]:
            with contextlib.suppress(OSError):
                connection.sendto(_MESSAGE, (address, to["udp"]))
    raise PermissionError("sent; nothing must arrive")


def read_accounts(to: Targets) -> str:
    """Read the passwords of the system's users, or their names."""
    with contextlib.suppress(OSError):
        return "shadow: " + Path("/etc/shadow").read_text("utf-8")[:20]
    users = Path("/etc/passwd").read_text("utf-8").splitlines()
    if len(users) > 1:
        return f"{len(users)} users"
    raise PermissionError("one made-up user")


def read_home(to: Targets) -> str:
    """List the grader's home folder; only what leads to the Python environment may be there."""
    others = set(os.listdir(to["home"])) - set(to["home_shown"])
    if others:
        return f"{len(others)} entries"
    raise PermissionError("nothing but what is shown")


def look_into_processes(to: Targets) -> str:
    """Find the grader's processes, by number and by a token in their environment or arguments."""
    named = Path("/proc", str(to["process"]))
    for process in (named, *Path("/proc").glob("[0-9]*")):
        for file in ("environ", "cmdline"):
            with contextlib.suppress(OSError):
                if to["token"].encode() in (process / file).read_bytes():
                    return f"process {process.name} was found"
    raise PermissionError("none of its processes to be seen")


def kill_outside(to: Targets) -> None:
    """Kill a process of the outside, which looks whether it lives."""
    if to["process"] not in (os.getpid(), os.getppid(), 1):
        os.kill(to["process"], signal.SIGKILL)
    raise PermissionError("its number is ours here")


def write_outside(to: Targets) -> str:
    """Write into a folder of the outside that anybody may write to, and into the system and the environment."""
    for folder in (to["planted"], "/", "/usr", "/etc", "/dev", sys.prefix, str(Path(os.__file__).parent)):
        with contextlib.suppress(OSError):
            (Path(folder) / f"labcourse-{to['token']}").write_text("x", "utf-8")
            return f"a file was made in {folder}"
    raise PermissionError("read-only, or not there")


def call(function: str, *arguments: int) -> None:
    """Call a function of the C library."""
    if getattr(ctypes.CDLL(None, use_errno=True), function)(*arguments) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def write(total: int, each: int) -> str:
    """Write files of so many bytes each, until they have ``total`` together."""
    block, written = bytes(MIB), 0
    names: list[Path] = []
    try:
        while written < total:
            names.append(Path(f"/tmp/fill-{len(names)}"))
            with open(names[-1], "wb", buffering=0) as file:
                while file.tell() < each:
                    written += file.write(block)
    finally:
        for name in names:
            name.unlink(missing_ok=True)
    return f"{written // MIB} MiB were written"


@contextlib.contextmanager
def children() -> Iterator[Callable[..., None]]:
    """Start processes, each with a function and its arguments; end them all with the ``with`` block."""
    started: list[int] = []

    def start(function: Callable[..., None], *arguments: Any) -> None:
        child = os.fork()
        if child == 0:
            try:
                function(*arguments)
            finally:
                os._exit(0)
        started.append(child)

    try:
        yield start
    finally:
        for child in started:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def fork_many(to: Targets) -> None:
    """Start more processes than there may be."""
    with children() as start:
        for _ in range(2 * to["processes"]):
            start(time.sleep, 10)


def take_memory_together(to: Targets) -> None:
    """Take too much memory with several processes, each within its limit, one after the other.

    The kernel chooses which of them it kills for it: often one that has had its memory for a while. So all are asked
    after the last one has taken its memory; one that was killed does not answer.
    """
    askers = []
    with children() as start:
        for _ in range(3):
            asker, asked = socket.socketpair()
            start(hold_memory, int(0.6 * to["memory"]), asked)
            asked.close()
            askers.append(asker)
            answers(asker)
        killed = sum(not answers(asker) for asker in askers)
    if killed:
        raise MemoryError(f"{killed} of {len(askers)} processes were killed for it")


def hold_memory(size: int, asked: socket.socket) -> None:
    """Take memory, page by page, and answer the question whether it is still held."""
    taken = bytearray(size)
    taken[::4096] = b"x" * len(taken[::4096])
    while asked.recv(1):
        asked.sendall(b"x")


def answers(asker: socket.socket) -> bool:
    """Ask a process whether it holds its memory."""
    with contextlib.suppress(OSError):
        asker.sendall(b"?")
        return asker.recv(1) == b"x"
    return False


#: Name → the optional layer that contains it ("" for a layer that is always there), and the attack.
ATTACKS: dict[str, tuple[str, Callable[[Targets], object]]] = {
    "reach a TCP listener": ("", lambda to: connect(socket.AF_INET, ("127.0.0.1", to["tcp"]))),
    "reach a UDP listener": ("", send_udp),
    "reach a unix listener": ("", lambda to: connect(socket.AF_UNIX, to["unix"])),
    "reach an abstract unix listener": ("", lambda to: connect(socket.AF_UNIX, "\0" + to["abstract"])),
    # An address that is set aside for documentation.
    "reach another machine": ("", lambda to: connect(socket.AF_INET, ("192.0.2.1", 9))),
    "reach a virtual machine's host": (FILTER, lambda to: socket.socket(_AF_VSOCK, socket.SOCK_STREAM).close()),
    "read a file outside": ("", lambda to: (Path(to["planted"]) / "secret").read_text("utf-8")),
    "read the system's accounts": ("", read_accounts),
    "read the home folder": ("", read_home),
    "look into processes outside": ("", look_into_processes),
    "kill a process outside": ("", kill_outside),
    "write outside": ("", write_outside),
    "change the system's programs": ("", lambda to: os.close(os.open("/usr/bin/env", os.O_RDWR))),
    "make a user namespace": (FILTER, lambda to: call("unshare", _NEW_USER)),
    "trace the first process": (FILTER, lambda to: call("ptrace", _PTRACE_SEIZE, 1, 0, 0)),
    "read inherited keys": (FILTER, lambda to: call("syscall", _KEYCTL.get(os.uname().machine, -1), 0, -3, 0, 0, 0)),
    "become root": ("", lambda to: os.setuid(0)),
    "write a file too big": ("", lambda to: write(2 * to["file_size"], 2 * to["file_size"])),
    "fill the folder": ("", lambda to: write(2 * to["folder"], to["file_size"] // 2)),
    "take too much memory": ("", lambda to: len(bytearray(2 * to["memory"]))),
    "start too many processes": ("", fork_many),
    "take too much memory together": (GROUPS, take_memory_together),
}


def main() -> None:
    """Make all attacks. What the sandbox answers with an error was contained."""
    targets = json.load(sys.stdin)
    assert_sandboxed(targets)
    attempts: dict[str, tuple[bool, str]] = {}
    for name, (_layer, attack) in ATTACKS.items():
        try:
            attempts[name] = False, f"it succeeded: {attack(targets)}"
        except (OSError, MemoryError) as error:
            attempts[name] = True, getattr(error, "strerror", None) or str(error) or type(error).__name__
    Path("attempts.json").write_text(json.dumps(attempts), "utf-8")


if __name__ == "__main__":
    main()
