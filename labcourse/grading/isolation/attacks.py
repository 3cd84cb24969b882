"""Attacks, to be made from inside a sandbox by :mod:`labcourse.grading.isolation.selftest`. Run this nowhere else.

A program that stands alone: it gets its targets as JSON on standard input, and leaves ``attempts.json``, attack → [was
it contained, what was said]. It first makes sure that it is in a sandbox, and each attack has a bound of its own.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import json
import os
import signal
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

MIB = 2**20
_NEW_USER, _AF_VSOCK, _PTRACE_SEIZE = 0x10000000, 40, 0x4206
_KEYCTL = {"x86_64": 250, "aarch64": 219}
_TALK = "Seen from outside."


def assert_sandboxed(targets: dict[str, Any]) -> None:
    """Exit unless this is a sandbox: a folder that is there outside is not there."""
    if Path(targets["planted"]).exists() or os.uname().nodename != "sandbox" or os.getuid() == 0:
        sys.exit("This is not a sandbox; nothing was tried.")


def connect_tcp(targets: dict[str, Any]) -> str:
    """Talk to a listener outside."""
    with socket.create_connection(("127.0.0.1", targets["tcp"]), timeout=2) as connection:
        connection.sendall(_TALK.encode())
    return "connected"


def send_udp(targets: dict[str, Any]) -> str:
    """Send to every address of the outside; whether it arrives is seen there."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as connection:
        for address in targets["addresses"]:
            with contextlib.suppress(OSError):
                connection.sendto(_TALK.encode(), (address, targets["udp"]))
    raise PermissionError("sent; nothing must arrive")


def connect_unix(targets: dict[str, Any]) -> str:
    """Talk to listeners outside, by path and by an abstract name."""
    said = ""
    for address in (targets["unix"], "\0" + targets["abstract"]):
        try:
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(address)
            return "connected"
        except OSError as error:
            said = str(error)
    raise PermissionError(said)


def leave_network(targets: dict[str, Any]) -> str:
    """Reach an address that is not this machine's (one that is set aside for documentation)."""
    with socket.create_connection(("192.0.2.1", 9), timeout=1):
        return "connected"


def open_vsock(targets: dict[str, Any]) -> str:
    """Get a socket to the host of a virtual machine; it is not connected."""
    with socket.socket(_AF_VSOCK, socket.SOCK_STREAM):
        return "a socket was made"


def read_planted(targets: dict[str, Any]) -> str:
    """Read a file of the outside."""
    return (Path(targets["planted"]) / "secret").read_text("utf-8")


def read_accounts(targets: dict[str, Any]) -> str:
    """Read the names of the system's users, and their passwords."""
    with contextlib.suppress(OSError):
        return "shadow: " + Path("/etc/shadow").read_text("utf-8")[:20]
    users = Path("/etc/passwd").read_text("utf-8").splitlines()
    if len(users) > 1:
        return f"{len(users)} users"
    raise PermissionError("one made-up user")


def read_home(targets: dict[str, Any]) -> str:
    """List the grader's home folder; only what leads to the Python environment may be there."""
    others = set(os.listdir(targets["home"])) - set(targets["home_shown"])
    if others:
        return f"{len(others)} entries"
    raise PermissionError("nothing but what is shown")


def look_into_processes(targets: dict[str, Any]) -> str:
    """Find the grader's processes: by number, by what their environment holds; and read their memory."""
    with contextlib.suppress(OSError):
        if os.readlink(f"/proc/{targets['process']}/exe") and _has(f"/proc/{targets['process']}/environ", targets):
            return "its environment was read"
    for process in Path("/proc").glob("[0-9]*"):
        if _has(str(process / "environ"), targets) or _has(str(process / "cmdline"), targets):
            return f"process {process.name} was found"
    raise PermissionError("none of its processes to be seen")


def _has(path: str, targets: dict[str, Any]) -> bool:
    with contextlib.suppress(OSError):
        return targets["token"].encode() in Path(path).read_bytes()
    return False


def kill_outside(targets: dict[str, Any]) -> str:
    """Kill a process of the outside, which sees whether it lives."""
    own = os.getpid()
    if targets["process"] not in (own, os.getppid(), 1):
        os.kill(targets["process"], signal.SIGKILL)
    raise PermissionError("its number is ours here")


def write_outside(targets: dict[str, Any]) -> str:
    """Write into a folder of the outside that anybody may write to, and into the system and the environment."""
    for folder in (targets["planted"], "/", "/usr", "/etc", "/dev", sys.prefix, str(Path(os.__file__).parent)):
        with contextlib.suppress(OSError):
            (Path(folder) / f"labcourse-{targets['token']}").write_text("x", "utf-8")
            return f"a file was made in {folder}"
    raise PermissionError("read-only, or not there")


def write_programs(targets: dict[str, Any]) -> str:
    """Open a program of the system for writing."""
    with open("/usr/bin/env", "r+b"):
        return "opened"


def gain_namespaces(targets: dict[str, Any]) -> str:
    """Make a user namespace, in which one has all capabilities."""
    return _call(lambda libc: libc.unshare(_NEW_USER))


def trace(targets: dict[str, Any]) -> str:
    """Look into the memory of the sandbox's first process."""
    return _call(lambda libc: libc.ptrace(_PTRACE_SEIZE, 1, 0, 0))


def read_keys(targets: dict[str, Any]) -> str:
    """Read the keys that were inherited from whoever started us."""
    number = _KEYCTL[os.uname().machine]
    return _call(lambda libc: libc.syscall(number, 0, -3, 0, 0, 0))


def become_root(targets: dict[str, Any]) -> str:
    """Become root."""
    os.setuid(0)
    return "done"


def _call(function: Callable[[ctypes.CDLL], int]) -> str:
    if function(ctypes.CDLL(None, use_errno=True)) >= 0:
        return "done"
    number = ctypes.get_errno()
    raise OSError(number, os.strerror(number))


def write_big_file(targets: dict[str, Any]) -> str:
    """Write a file larger than any may be."""
    block = bytes(MIB)
    try:
        with open("big", "wb", buffering=0) as file:
            for _ in range(2 * targets["file_size"] // MIB):
                if file.write(block) < MIB:
                    raise OSError(errno.EFBIG, "File too large")
    finally:
        os.unlink("big")
    return f"{2 * targets['file_size'] // MIB} MiB were written"


def fill_folder(targets: dict[str, Any]) -> str:
    """Fill all that can be written."""
    block, wrote = bytes(MIB), 0
    names: list[str] = []
    try:
        while wrote < 2 * targets["folder"]:
            names.append(f"/tmp/fill-{len(names)}")
            with open(names[-1], "wb", buffering=0) as file:
                for _ in range(targets["file_size"] // (2 * MIB)):
                    wrote += file.write(block)
    finally:
        for name in names:
            os.unlink(name)
    return f"{wrote // MIB} MiB were written"


def take_memory(targets: dict[str, Any]) -> str:
    """Take twice the memory that a process may have."""
    bytearray(2 * targets["memory"])
    return f"{2 * targets['memory'] // MIB} MiB were given"


def take_memory_together(targets: dict[str, Any]) -> str:
    """Take it with several processes, each within its limit, one after the other.

    Which of them the kernel kills for it is the kernel's choice: often one that has had its memory for a while. So they
    are asked when all have had their turn; who was killed does not answer.
    """
    each = int(0.6 * targets["memory"])
    children = []
    try:
        for _ in range(3):
            ours, theirs = socket.socketpair()
            child = os.fork()
            if child == 0:
                _hold_memory(each, theirs)
            theirs.close()
            children.append((child, ours))
            _answers(ours)
        held = sum(_answers(ours) for _, ours in children)
    finally:
        for child, ours in children:
            ours.close()
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
    if held == len(children):
        return f"{held * each // MIB} MiB were given"
    raise MemoryError(f"{len(children) - held} of {len(children)} processes were killed for it")


def _hold_memory(size: int, asked: socket.socket) -> NoReturn:
    """Take memory, page by page, and answer whoever asks whether it is still held."""
    try:
        taken = bytearray(size)
        taken[::4096] = b"x" * len(taken[::4096])
        while asked.recv(1):
            asked.sendall(b"x")
    finally:
        os._exit(0)


def _answers(child: socket.socket) -> bool:
    """Ask a child whether it holds its memory; one that was killed does not answer."""
    with contextlib.suppress(OSError):
        child.sendall(b"?")
        return child.recv(1) == b"x"
    return False


def fork_many(targets: dict[str, Any]) -> str:
    """Start more processes than there may be."""
    children: list[int] = []
    try:
        while len(children) < 2 * targets["processes"]:
            child = os.fork()
            if child == 0:
                time.sleep(10)
                os._exit(0)
            children.append(child)
        return f"{len(children)} processes were started"
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


ATTACKS: dict[str, Callable[[dict[str, Any]], str]] = {
    "reach a TCP listener": connect_tcp,
    "reach a UDP listener": send_udp,
    "reach a unix listener": connect_unix,
    "reach another machine": leave_network,
    "reach a virtual machine's host": open_vsock,
    "read a file outside": read_planted,
    "read the system's accounts": read_accounts,
    "read the home folder": read_home,
    "look into processes outside": look_into_processes,
    "kill a process outside": kill_outside,
    "write outside": write_outside,
    "change the system's programs": write_programs,
    "make a user namespace": gain_namespaces,
    "trace the first process": trace,
    "read inherited keys": read_keys,
    "become root": become_root,
    "write a file too big": write_big_file,
    "fill the folder": fill_folder,
    "take too much memory": take_memory,
    "start too many processes": fork_many,
    "take too much memory together": take_memory_together,
}


def main() -> None:
    """Make all attacks. Whatever the sandbox answers with an error was contained."""
    targets = json.load(sys.stdin)
    assert_sandboxed(targets)
    found: dict[str, tuple[bool, str]] = {}
    for name, attack in ATTACKS.items():
        try:
            found[name] = False, attack(targets)
        except (OSError, MemoryError) as error:
            found[name] = True, getattr(error, "strerror", None) or str(error) or type(error).__name__
    Path("attempts.json").write_text(json.dumps(found), "utf-8")


if __name__ == "__main__":
    main()
