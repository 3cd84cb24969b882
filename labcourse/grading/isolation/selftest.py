"""Try to break out: attacks that are really made, from inside a sandbox, against targets that are really there.

Three sandboxes are started: in one :mod:`labcourse.grading.isolation.attacks` runs to its end; in the others
detached children that ignore signals are left, and it is ended from outside. What only the outside can see is looked
at from there.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from labcourse.errors import IsolationError
from labcourse.grading.isolation import attacks, bubblewrap, sandbox, seccomp
from labcourse.grading.isolation.outcome import MIB, Ending, Limits

_LIMITS = Limits(
    seconds=60, memory=256 * MIB, processes=20, file_size=8 * MIB, folder=32 * MIB, output=65536, open_files=64
)
_FILTERED = (
    "reach a virtual machine's host",
    "make a user namespace",
    "trace the first process",
    "read inherited keys",
)
_TOGETHER = "take too much memory together"  # held by control groups, where they are to be had
# Detached and ignoring signals, with the token among their arguments; {then} is what comes after them.
_CHILDREN = """
[ "$(uname -n)" = sandbox ] || exit 1
for i in 1 2 3 4 5; do
    setsid sh -c 'trap "" INT TERM HUP; while :; do sleep 1; done' "$0" &
done
echo left > left
{then}
"""


@dataclass(frozen=True)
class Attempt:
    """An attack that was made.

    Attributes
    ----------
    name : what was tried
    contained : whether the sandbox held
    said : what came of it
    needed : whether nothing may be run where it does not hold
    """

    name: str
    contained: bool
    said: str
    needed: bool = True


def run_all() -> list[Attempt]:
    """Make all attacks.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up, or the attacks could not be made in it.
    """
    token = secrets.token_hex(16)
    with tempfile.TemporaryDirectory(prefix="labcourse-selftest-") as scratch:
        planted = Path(scratch) / "planted"
        planted.mkdir()
        planted.chmod(0o777)  # whoever finds it could write to it
        (planted / "secret").write_text(token, "utf-8")
        with _listeners(planted) as (ports, received), _victim(token) as victim:
            targets = {
                **ports,
                "planted": str(planted),
                "token": token,
                "process": victim.pid,
                "home": os.path.expanduser("~"),
                "home_shown": _shown_of(Path(os.path.expanduser("~"))),
                "memory": _LIMITS.memory,
                "processes": _LIMITS.processes,
                "file_size": _LIMITS.file_size,
                "folder": _LIMITS.folder,
            }
            found = _attacked(targets)
            seen = {
                "reach a UDP listener": "it was heard outside" if received() else "",
                "kill a process outside": "" if victim.poll() is None else "it was killed",
                "write outside": "" if sorted(os.listdir(planted)) == ["secret", "unix"] else "a file is there",
            }
    attempts = [_judged(name, *what, seen.get(name, "")) for name, what in found.items()]
    return [*attempts, _flood(), _deadline()]


def _judged(name: str, contained: bool, said: str, seen: str) -> Attempt:
    needed = name != _TOGETHER and (name not in _FILTERED or seccomp.program(os.uname().machine) is not None)
    return Attempt(name, contained and not seen, seen or said, needed)


def _attacked(targets: dict[str, Any]) -> dict[str, tuple[bool, str]]:
    outcome = sandbox.run(
        [str(sandbox.python()), "-I", "-S", "-c", Path(attacks.__file__).read_text("utf-8")],
        visible=[],
        wanted="attempts.json",
        largest=65536,
        stdin=json.dumps(targets).encode(),
        limits=_LIMITS,
    )
    found = json.loads(outcome.file or b"{}")
    if list(found) != list(attacks.ATTACKS):
        message = outcome.output.decode(errors="replace").strip()
        raise IsolationError(f"The self-test did not come to its end: {message or outcome.ending.value}.", "self-test")
    return {name: (contained, said) for name, (contained, said) in found.items()}


def _flood() -> Attempt:
    return _left_behind("outlive a flood of output", Ending.OUTPUT, "exec yes", _LIMITS.seconds)


def _deadline() -> Attempt:
    for seconds in (0.3, 3, 30):  # on a busy machine, it may take a while for the children to be there
        attempt = _left_behind("outlive the deadline", Ending.DEADLINE, "exec sleep 60", seconds)
        if attempt.contained:
            break
    return attempt


def _left_behind(name: str, ending: Ending, then: str, seconds: float) -> Attempt:
    """Leave detached children that ignore signals, and be ended; the outside looks for them."""
    token = secrets.token_hex(16)
    command = ["/bin/sh", "-c", _CHILDREN.format(then=then), token]
    outcome = sandbox.run(command, visible=[], wanted="left", largest=16, limits=replace(_LIMITS, seconds=seconds))
    left = sum(token.encode() in _command_line(process) for process in Path("/proc").glob("[0-9]*"))
    if left:
        return Attempt(name, False, f"{left} processes left")
    if outcome.ending is not ending or outcome.file != b"left\n":
        return Attempt(name, False, f"it ended otherwise ({outcome.ending.value}), or its file was lost")
    return Attempt(name, True, "ended; no process left, its file was read")


def _command_line(process: Path) -> bytes:
    with contextlib.suppress(OSError):
        return (process / "cmdline").read_bytes()
    return b""


def _shown_of(home: Path) -> list[str]:
    """Names in the home folder under which something is shown on purpose."""
    return [path.relative_to(home).parts[0] for path in bubblewrap.visible_paths([]) if path.is_relative_to(home)]


# --- targets ----------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _victim(token: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of ours, with a secret in its environment. It ends with its input, and so with us."""
    environment = {**os.environ, "LABCOURSE_SECRET": token}
    with subprocess.Popen(["cat"], env=environment, stdin=subprocess.PIPE) as victim:
        yield victim


@contextlib.contextmanager
def _listeners(folder: Path) -> Iterator[tuple[dict[str, Any], Any]]:
    """Listeners of every kind, where they are, and whether the one for datagrams has received anything since."""
    abstract = "labcourse-" + secrets.token_hex(8)
    with contextlib.ExitStack() as stack:

        def bound(family: int, kind: int, address: Any) -> socket.socket:
            listener = stack.enter_context(socket.socket(family, kind))
            listener.bind(address)
            if kind == socket.SOCK_STREAM:
                listener.listen()
            return listener

        tcp = bound(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", 0))
        udp = bound(socket.AF_INET, socket.SOCK_DGRAM, ("", 0))
        bound(socket.AF_UNIX, socket.SOCK_STREAM, str(folder / "unix"))
        bound(socket.AF_UNIX, socket.SOCK_STREAM, "\0" + abstract)
        port = udp.getsockname()[1]
        _reach(udp, port)

        def received() -> bool:
            with contextlib.suppress(BlockingIOError):
                return bool(udp.recv(64))
            return False

        yield (
            {
                "tcp": tcp.getsockname()[1],
                "udp": port,
                "addresses": ["127.0.0.1", *_addresses()],
                "unix": str(folder / "unix"),
                "abstract": abstract,
            },
            received,
        )


def _reach(udp: socket.socket, port: int) -> None:
    """Make sure that a datagram sent here arrives, or its silence would mean nothing."""
    udp.settimeout(5)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"here", ("127.0.0.1", port))
    if udp.recv(64) != b"here":
        raise IsolationError("The self-test's listener hears something else.", "self-test")
    udp.setblocking(False)


def _addresses() -> list[str]:
    """This machine's address to the outside, if it has one. (Nothing is sent.)"""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        return [probe.getsockname()[0]]
    return []
