"""Whether isolation works on this computer: look at each layer, then try to break out.

Layers are looked at from outside, and by a trusted program in a sandbox that shows what it sees. Then attacks are made,
from inside a sandbox, against targets that really exist: in one sandbox :mod:`labcourse.grading.isolation.attacks` runs
to its end; in others detached children that ignore signals are left, and it is ended from outside. Some results are
seen only from outside, and are looked at from there.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import re
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from labcourse.errors import IsolationError
from labcourse.grading.isolation import attacks, bubblewrap, cgroups, sandbox, seccomp
from labcourse.grading.isolation.process import MIB, Ending, Limits

_OLDEST_KERNEL = (5, 14)  # it counts a user's processes in each user namespace; before, the sandbox shares one limit
_INSPECTION = """
cat /proc/self/status /proc/self/limits /proc/net/dev /proc/self/mounts
echo =
ls -d /proc/[0-9]*
id -u
echo seen > seen
"""
_WRITABLE = re.compile(r"/tmp|/dev/.*|/proc")
_GROUP_REMEDY = (
    "Grade as root, or in your own group where systemd runs: `systemd-run --user --scope …`. "
    "Without it each process is limited by itself, and the number of small files that a student can make is not."
)
_REPORT_IT = "Do not grade here, and report what this shows."
_LIMITS = Limits(
    seconds=60, memory=256 * MIB, processes=20, file_size=8 * MIB, folder=32 * MIB, output=65536, open_files=64
)
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
class Layer:
    """A layer of isolation.

    Attributes
    ----------
    name : of the layer
    good : whether it works
    state : what there is, as text
    remedy : what to do if it does not work; "" if it does
    needed : whether nothing may be run without it
    """

    name: str
    good: bool
    state: str
    remedy: str = ""
    needed: bool = True


@dataclass(frozen=True)
class Attempt:
    """An attack that was made.

    Attributes
    ----------
    name : of the attack
    contained : whether the sandbox contained it
    result : what happened
    needed : whether nothing may be run where it is not contained
    """

    name: str
    contained: bool
    result: str
    needed: bool = True


# --- layers -----------------------------------------------------------------------------------------------------------


def layers() -> list[Layer]:
    """Return the state of the layers, the most basic first; the list ends early if one of the first three fails."""
    result: list[Layer] = []
    for basic_layer in (_system_layer, _bubblewrap_layer, _user_layer):
        result.append(basic_layer())
        if not result[-1].good:
            return result
    return [*result, *_inside_layers(), _group_layer("memory"), _group_layer("pids")]


def _system_layer() -> Layer:
    """Return whether this is Linux, with a kernel that is new enough."""
    name, release = "operating system", f"{platform.system()} {platform.release()}"
    if not sys.platform.startswith("linux"):
        return Layer(name, False, f"{release}; isolation needs Linux", bubblewrap.remedy_of_platform())
    good = _version(platform.release()) >= _OLDEST_KERNEL
    return Layer(name, good, release, "" if good else "Use a system with Linux 5.14 or newer.")


def _version(text: str) -> tuple[int, ...]:
    """Return the first two numbers in a text, as (5, 14)."""
    return tuple(int(part) for part in re.findall(r"\d+", text)[:2])


def _bubblewrap_layer() -> Layer:
    """Return whether bubblewrap is installed, in a version that is new enough."""
    program = shutil.which("bwrap")
    if program is None:
        return Layer("bubblewrap", False, "not installed", bubblewrap.INSTALL)
    reported = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    good = _version(reported) >= bubblewrap.OLDEST
    state = f"{reported or 'of an unknown version'} ({program})"
    return Layer("bubblewrap", good, state, "" if good else bubblewrap.INSTALL)


def _user_layer() -> Layer:
    """Return whether there is a user without privileges to run a command as."""
    try:
        bubblewrap.sandbox_user()
    except IsolationError as error:
        return _layer_of_error(error)
    root, other = "root, who becomes another user for each run", "an ordinary user, in a user namespace"
    return Layer("user", True, root if bubblewrap.is_root() else other)


def _inside_layers() -> list[Layer]:
    """Return the layers that a trusted program in a sandbox can see: files, network, processes, privileges, limits."""
    limits = Limits(seconds=60)
    try:
        outcome = sandbox.run(["/bin/sh", "-c", _INSPECTION], visible=[], wanted={"seen": 5}, limits=limits)
    except IsolationError as error:
        return [_layer_of_error(error)]
    output, _, listing = outcome.output.decode(errors="replace").partition("\n=\n")
    if outcome.files.get("seen") != b"seen\n":
        return [Layer("sandbox", False, f"a trusted program does not run in it: {output[-200:]}", _REPORT_IT)]
    interfaces = re.findall(r"^\s*(\w+):(?:\s+\d+){10}", output, re.MULTILINE)
    mounts = re.findall(r"^\S+ (\S+) \S+ (rw|ro),", output, re.MULTILINE)
    read_only = bool(mounts) and all(_WRITABLE.fullmatch(path) for path, how in mounts if how == "rw")
    processes = listing.count("/proc/")
    # The last word of the listing is the user's number.
    unprivileged = re.search(r"CapEff:\s*0+\n.*NoNewPrivs:\s*1\n", output, re.DOTALL) and listing.split()[-1] != "0"
    limited = re.search(rf"Max address space\s+{limits.memory}\s", output)
    filtered = _has_filter()
    return [
        _seen_layer("file system", read_only, "read-only, but for /tmp"),
        _seen_layer("network", interfaces == ["lo"], f"interfaces: {', '.join(interfaces)}"),
        # The launcher's shells, and what this listing itself starts.
        _seen_layer("processes", 0 < processes <= 5, f"{processes} to be seen, all of the sandbox"),
        _seen_layer("privileges", bool(unprivileged), "none, and none to be had"),
        _seen_layer("limits", bool(limited), "memory and files of each process, number of processes, time"),
        Layer("system calls", filtered, "filtered" if filtered else "not filtered on this machine", needed=False),
    ]


def _has_filter() -> bool:
    """Return whether sandboxes on this machine have the filter of system calls."""
    return seccomp.program(os.uname().machine) is not None


def _layer_of_error(error: IsolationError) -> Layer:
    """Return the layer that an error is about, as not working."""
    return Layer(error.layer or "sandbox", False, str(error).removesuffix(error.remedy).strip(), error.remedy)


def _seen_layer(name: str, good: bool, state: str) -> Layer:
    """Return a layer that was looked at from inside; ``state`` says what is right about it."""
    return Layer(name, good, state if good else f"not so: {state}", "" if good else _REPORT_IT)


def _group_layer(controller: str) -> Layer:
    """Return whether a control group limits everything in a sandbox together; controller as "memory" or "pids"."""
    parent = cgroups.parent_groups().get(controller)
    if parent is None:
        return Layer(cgroups.LAYERS[controller], False, "no control group available", _GROUP_REMEDY, needed=False)
    return Layer(cgroups.LAYERS[controller], True, f"control group (version {parent.version})", needed=False)


# --- attempts ---------------------------------------------------------------------------------------------------------


def attempts() -> list[Attempt]:
    """Make all attacks.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up, or the attacks could not be made in it.
    """
    with _attack_targets() as (targets, seen_outside):
        results = _run_attacks(targets)
        seen = seen_outside()
    judged = [_attempt_of(name, *result, seen.get(name, "")) for name, result in results.items()]
    flood = _attempt_to_outlive("outlive a flood of output", Ending.OUTPUT, "exec yes", _LIMITS.seconds)
    for seconds in (0.3, 3, 30):  # on a busy machine, it may take a while until the children run
        deadline = _attempt_to_outlive("outlive the deadline", Ending.DEADLINE, "exec sleep 60", seconds)
        if deadline.contained:
            break
    return [*judged, flood, deadline]


def _run_attacks(targets: dict[str, Any]) -> dict[str, tuple[bool, str]]:
    """Run the attacks in a sandbox.

    Returns
    -------
    dict
        Name of the attack → whether it was contained, and what happened.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up, or the attacks did not come to their end.
    """
    outcome = sandbox.run(
        [str(sandbox.python()), "-I", "-S", "-c", Path(attacks.__file__).read_text("utf-8")],
        visible=[],
        wanted={"attempts.json": 65536},
        stdin=json.dumps(targets).encode(),
        limits=_LIMITS,
    )
    results = json.loads(outcome.files.get("attempts.json", b"{}"))
    if list(results) != list(attacks.ATTACKS):
        message = outcome.output.decode(errors="replace").strip()
        raise IsolationError(f"The self-test did not come to its end: {message or outcome.ending.value}.", "self-test")
    return {name: (contained, result) for name, (contained, result) in results.items()}


def _attempt_of(name: str, contained: bool, result: str, seen_outside: str) -> Attempt:
    """Return the attempt of an attack: by its own result, and by what was seen outside ("" if nothing was)."""
    layer, _ = attacks.ATTACKS[name]
    needed = layer == "" or (layer == attacks.FILTER and _has_filter())
    return Attempt(name, contained and not seen_outside, seen_outside or result, needed)


def _attempt_to_outlive(name: str, ending: Ending, then: str, seconds: float) -> Attempt:
    """Start detached children that ignore signals, let the run be ended, and look for the children from outside.

    Parameters
    ----------
    name : of the attempt
    ending : how the run has to end
    then : line of shell after the children are started, which makes the run end so
    seconds : time limit of the run
    """
    token = secrets.token_hex(16)
    command = ["/bin/sh", "-c", _CHILDREN.format(then=then), token]
    outcome = sandbox.run(command, visible=[], wanted={"left": 16}, limits=replace(_LIMITS, seconds=seconds))
    left = 0
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # some end meanwhile
            left += token.encode() in (process / "cmdline").read_bytes()
    if left:
        return Attempt(name, False, f"{left} processes left")
    if outcome.ending is not ending or outcome.files.get("left") != b"left\n":
        return Attempt(name, False, f"it ended otherwise ({outcome.ending.value}), or its file was lost")
    return Attempt(name, True, "ended; no process left, its file was read")


@contextlib.contextmanager
def _attack_targets() -> Iterator[tuple[dict[str, Any], Callable[[], dict[str, str]]]]:
    """Set up targets of every kind for the attacks.

    Yields
    ------
    dict
        What the attacks must know of the targets.
    Callable
        Function that looks at the targets from outside: attack → what it did, for those that did something.
    """
    token, abstract = secrets.token_hex(16), "labcourse-" + secrets.token_hex(8)
    home = Path(os.path.expanduser("~"))
    with contextlib.ExitStack() as stack:
        planted = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="labcourse-selftest-"))) / "planted"
        planted.mkdir()
        planted.chmod(0o777)  # whoever finds it could write to it
        (planted / "secret").write_text(token, "utf-8")

        def bind_socket(family: int, kind: int, address: Any) -> socket.socket:
            """Return a socket at an address, until the ``with`` block ends."""
            listener = stack.enter_context(socket.socket(family, kind))
            listener.bind(address)
            if kind == socket.SOCK_STREAM:
                listener.listen()
            return listener

        tcp = bind_socket(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", 0))
        udp = bind_socket(socket.AF_INET, socket.SOCK_DGRAM, ("", 0))
        bind_socket(socket.AF_UNIX, socket.SOCK_STREAM, str(planted / "unix"))
        bind_socket(socket.AF_UNIX, socket.SOCK_STREAM, "\0" + abstract)
        addresses = _own_addresses(udp)
        # A process of ours, with a secret in its environment. It ends with its input, and so with us.
        environment = {**os.environ, "LABCOURSE_SECRET": token}
        victim = stack.enter_context(subprocess.Popen(["cat"], env=environment, stdin=subprocess.PIPE))
        targets = {
            "tcp": tcp.getsockname()[1],
            "udp": udp.getsockname()[1],
            "addresses": addresses,
            "unix": str(planted / "unix"),
            "abstract": abstract,
            "planted": str(planted),
            "token": token,
            "process": victim.pid,
            "home": str(home),
            # Names in it under which something is shown on purpose.
            "home_shown": [
                path.relative_to(home).parts[0] for path in bubblewrap.visible_paths([]) if path.is_relative_to(home)
            ],
            **{name: getattr(_LIMITS, name) for name in ("memory", "processes", "file_size", "folder")},
        }

        def seen_outside() -> dict[str, str]:
            """Return attack → what it did to a target."""
            seen = {}
            with contextlib.suppress(BlockingIOError):
                seen["reach a UDP listener"] = "it was heard outside" if udp.recv(64) else ""
            if victim.poll() is not None:
                seen["kill a process outside"] = "it was killed"
            if sorted(os.listdir(planted)) != ["secret", "unix"]:
                seen["write outside"] = "a file is there"
            return seen

        yield targets, seen_outside


def _own_addresses(udp: socket.socket) -> list[str]:
    """Return this machine's addresses. Check that a datagram reaches the listener; else silence would mean nothing.

    Raises
    ------
    IsolationError
        If the listener receives something else.
    """
    udp.settimeout(5)
    addresses = ["127.0.0.1"]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"here", ("127.0.0.1", udp.getsockname()[1]))
        if udp.recv(64) != b"here":
            raise IsolationError("The self-test's listener hears something else.", "self-test")
        with contextlib.suppress(OSError):  # where it has no address to the outside
            sender.connect(("192.0.2.1", 9))  # nothing is sent
            addresses.append(sender.getsockname()[0])
    udp.setblocking(False)
    return addresses
