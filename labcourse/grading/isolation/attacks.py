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
FILTER, GROUPS = "system calls", "memory of all together"  #: names of optional layers

Targets = dict[str, Any]


def assert_sandboxed(targets: Targets) -> None:
    """Exit unless this is a sandbox: a folder that exists outside does not exist inside."""
    if Path(targets["planted"]).exists() or os.uname().nodename != "sandbox" or os.getuid() == 0:
        sys.exit("This is not a sandbox; nothing was tried.")


def send_tcp(family: int, address: Any) -> None:
    """Send a message to a listener outside, over a connection."""
    with socket.socket(family, socket.SOCK_STREAM) as connection:
        connection.settimeout(2)
        connection.connect(address)
        connection.sendall(_MESSAGE)


def send_udp(targets: Targets) -> None:
    """Send to every address of the outside; the outside looks whether it arrives."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as connection:
        for address in targets["addresses"]:
            with contextlib.suppress(OSError):
                connection.sendto(_MESSAGE, (address, targets["udp"]))
    raise PermissionError("sent; nothing must arrive")


def read_accounts(targets: Targets) -> str:
    """Read the passwords of the system's users, or their names."""
    with contextlib.suppress(OSError):
        return "shadow: " + Path("/etc/shadow").read_text("utf-8")[:20]
    users = Path("/etc/passwd").read_text("utf-8").splitlines()
    if len(users) > 1:
        return f"{len(users)} users"
    raise PermissionError("one made-up user")


def read_home(targets: Targets) -> str:
    """List the grader's home folder; only what leads to the Python environment may be there."""
    others = set(os.listdir(targets["home"])) - set(targets["home_shown"])
    if others:
        return f"{len(others)} entries"
    raise PermissionError("nothing but what is shown")


def look_into_processes(targets: Targets) -> str:
    """Find the grader's processes, by number and by a token in their environment or arguments."""
    target = Path("/proc", str(targets["process"]))
    for process in (target, *Path("/proc").glob("[0-9]*")):
        for file in ("environ", "cmdline"):
            with contextlib.suppress(OSError):
                if targets["token"].encode() in (process / file).read_bytes():
                    return f"process {process.name} was found"
    raise PermissionError("none of its processes to be seen")


def kill_outside(targets: Targets) -> None:
    """Kill a process of the outside, which looks whether it lives."""
    if targets["process"] not in (os.getpid(), os.getppid(), 1):
        os.kill(targets["process"], signal.SIGKILL)
    raise PermissionError("its number is ours here")


def write_outside(targets: Targets) -> str:
    """Write into a folder of the outside that anybody may write to, and into the system and the environment."""
    for folder in (targets["planted"], "/", "/usr", "/etc", "/dev", sys.prefix, str(Path(os.__file__).parent)):
        with contextlib.suppress(OSError):
            (Path(folder) / f"labcourse-{targets['token']}").write_text("x", "utf-8")
            return f"a file was made in {folder}"
    raise PermissionError("read-only, or not there")


def call_c(function: str, *arguments: int) -> None:
    """Call a function of the C library; raise OSError if it returns an error."""
    if getattr(ctypes.CDLL(None, use_errno=True), function)(*arguments) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def write_files(total: int, each: int) -> str:
    """Write files of ``each`` bytes, until they have ``total`` bytes together."""
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
def child_processes() -> Iterator[Callable[..., None]]:
    """Start processes, each with a function and its arguments; end them all with the ``with`` block."""
    started: list[int] = []

    def start(function: Callable[..., None], *arguments: Any) -> None:
        """Call a function in a new process."""
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


def fork_many(targets: Targets) -> None:
    """Start more processes than there may be."""
    with child_processes() as start:
        for _ in range(2 * targets["processes"]):
            start(time.sleep, 10)


def take_memory_together(targets: Targets) -> None:
    """Take too much memory with several processes, each within its limit, one after the other.

    The kernel chooses which of them it kills for it: often one that has had its memory for a while. So all are asked
    after the last one has taken its memory; one that was killed does not answer.
    """
    askers = []
    with child_processes() as start:
        for _ in range(3):
            asker, answerer = socket.socketpair()
            start(hold_memory, int(0.6 * targets["memory"]), answerer)
            answerer.close()
            askers.append(asker)
            still_holds(asker)
        killed = sum(not still_holds(asker) for asker in askers)
    if killed:
        raise MemoryError(f"{killed} of {len(askers)} processes were killed for it")


def hold_memory(size: int, questions: socket.socket) -> None:
    """Take memory (bytes), page by page, and answer each question on the socket whether it is still held."""
    taken = bytearray(size)
    taken[::4096] = b"x" * len(taken[::4096])
    while questions.recv(1):
        questions.sendall(b"x")


def still_holds(asker: socket.socket) -> bool:
    """Return whether a process of :func:`hold_memory` still answers; one that was killed does not."""
    with contextlib.suppress(OSError):
        asker.sendall(b"?")
        return asker.recv(1) == b"x"
    return False


#: Name → the optional layer that contains it ("" for a layer that is always there), and the attack.
ATTACKS: dict[str, tuple[str, Callable[[Targets], object]]] = {
    "reach a TCP listener": ("", lambda t: send_tcp(socket.AF_INET, ("127.0.0.1", t["tcp"]))),
    "reach a UDP listener": ("", send_udp),
    "reach a unix listener": ("", lambda t: send_tcp(socket.AF_UNIX, t["unix"])),
    "reach an abstract unix listener": ("", lambda t: send_tcp(socket.AF_UNIX, "\0" + t["abstract"])),
    # An address that is set aside for documentation.
    "reach another machine": ("", lambda t: send_tcp(socket.AF_INET, ("192.0.2.1", 9))),
    "reach a virtual machine's host": (FILTER, lambda t: socket.socket(_AF_VSOCK, socket.SOCK_STREAM).close()),
    "read a file outside": ("", lambda t: (Path(t["planted"]) / "secret").read_text("utf-8")),
    "read the system's accounts": ("", read_accounts),
    "read the home folder": ("", read_home),
    "look into processes outside": ("", look_into_processes),
    "kill a process outside": ("", kill_outside),
    "write outside": ("", write_outside),
    "change the system's programs": ("", lambda t: os.close(os.open("/usr/bin/env", os.O_RDWR))),
    "make a user namespace": (FILTER, lambda t: call_c("unshare", _NEW_USER)),
    "trace the first process": (FILTER, lambda t: call_c("ptrace", _PTRACE_SEIZE, 1, 0, 0)),
    "read inherited keys": (FILTER, lambda t: call_c("syscall", _KEYCTL.get(os.uname().machine, -1), 0, -3, 0, 0, 0)),
    "become root": ("", lambda t: os.setuid(0)),
    "write a file too big": ("", lambda t: write_files(2 * t["file_size"], 2 * t["file_size"])),
    "fill the folder": ("", lambda t: write_files(2 * t["folder"], t["file_size"] // 2)),
    "take too much memory": ("", lambda t: len(bytearray(2 * t["memory"]))),
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
