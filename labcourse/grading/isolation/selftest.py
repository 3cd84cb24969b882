"""Whether isolation works on this computer: look at each layer, then try to break out.

Layers are looked at from outside, and by a trusted program in a sandbox that shows what it sees. Then eight are tested
by an attack each, from inside a sandbox, on targets that really exist. In one sandbox
:mod:`labcourse.grading.isolation.attacks` attacks network, files, processes, memory, privileges and system calls. In
another, children that ignore signals are left behind, and the run goes on past its time limit.
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
from dataclasses import dataclass, replace
from pathlib import Path

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
_LIMITS = Limits(seconds=60, memory=256 * MIB, processes=20)
# The children are detached, and have the token among their arguments. Should they get away, they end by themselves.
_OUTLIVE = """
[ "$(uname -n)" = sandbox ] || exit 1
trap "" INT TERM HUP
for i in 1 2 3 4 5; do setsid sh -c 'sleep 60; exit' "$0" & done
echo started > started
exec sleep 60
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
    """Return the layer of the system: good if this is Linux, with a kernel that is new enough."""
    name, release = "operating system", f"{platform.system()} {platform.release()}"
    if not sys.platform.startswith("linux"):
        return Layer(name, False, f"{release}; isolation needs Linux", bubblewrap.remedy_of_platform())
    good = _version(platform.release()) >= _OLDEST_KERNEL
    return Layer(name, good, release, "" if good else "Use a system with Linux 5.14 or newer.")


def _version(text: str) -> tuple[int, ...]:
    """Return the first two numbers in a text, as (5, 14) of "5.14.0-rc1"; fewer if it has fewer."""
    return tuple(int(part) for part in re.findall(r"\d+", text)[:2])


def _bubblewrap_layer() -> Layer:
    """Return the layer of bubblewrap: good if it is installed, in a version that is new enough."""
    program = shutil.which("bwrap")
    if program is None:
        return Layer("bubblewrap", False, "not installed", bubblewrap.INSTALL)
    reported = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    good = _version(reported) >= bubblewrap.OLDEST
    state = f"{reported or 'of an unknown version'} ({program})"
    return Layer("bubblewrap", good, state, "" if good else bubblewrap.INSTALL)


def _user_layer() -> Layer:
    """Return the layer of the user: good if there is a user without privileges to run a command as."""
    try:
        bubblewrap.sandbox_user()
    except IsolationError as error:
        return _layer_of_error(error)
    root, other = "root, who becomes another user for each run", "an ordinary user, in a user namespace"
    return Layer("user", True, root if bubblewrap.is_root() else other)


def _inside_layers() -> list[Layer]:
    """Return the layers that a trusted program in a sandbox looks at: files, network, processes, privileges, limits.

    The filter of system calls is added from outside. If the sandbox does not work, return one layer, which says why.
    """
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
    """Return whether sandboxes on this machine have the filter of system calls, which depends on its processor."""
    return seccomp.program(os.uname().machine) is not None


def _layer_of_error(error: IsolationError) -> Layer:
    """Return the layer that an error names, as one that does not work."""
    return Layer(error.layer or "sandbox", False, str(error).removesuffix(error.remedy).strip(), error.remedy)


def _seen_layer(name: str, good: bool, state: str) -> Layer:
    """Return a layer that was looked at from inside; ``state`` says what there is if it is good."""
    return Layer(name, good, state if good else f"not so: {state}", "" if good else _REPORT_IT)


def _group_layer(controller: str) -> Layer:
    """Return the optional layer in which a control group limits everything together; controller "memory" or "pids"."""
    parent = cgroups.parent_groups().get(controller)
    if parent is None:
        return Layer(cgroups.LAYERS[controller], False, "no control group available", _GROUP_REMEDY, needed=False)
    return Layer(cgroups.LAYERS[controller], True, f"control group (version {parent.version})", needed=False)


# --- attempts ---------------------------------------------------------------------------------------------------------


def attempts() -> list[Attempt]:
    """Attack eight layers: six from inside, then try to outlive a run and its time limit.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up, or the attacks could not be made in it.
    """
    return [*_attempts_inside(), *_attempts_to_outlive()]


def _attempts_inside() -> list[Attempt]:
    """Set up targets outside, and run the attacks on them in a sandbox.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up, or the attacks did not come to their end.
    """
    token, home = secrets.token_hex(16), Path(os.path.expanduser("~"))
    with (
        tempfile.TemporaryDirectory(prefix="labcourse-selftest-") as planted,
        socket.create_server(("127.0.0.1", 0)) as listener,
        # It ends with its input, and so with us.
        subprocess.Popen(["/bin/sh", "-c", "read -r word", token], stdin=subprocess.PIPE),
    ):
        targets = {
            "planted": planted,
            "port": listener.getsockname()[1],
            "token": token,
            "memory": _LIMITS.memory,
            "home": str(home),
            # Names in it under which something is shown on purpose.
            "home_shown": [
                path.relative_to(home).parts[0] for path in bubblewrap.visible_paths([]) if path.is_relative_to(home)
            ],
        }
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
    return [
        Attempt(name, contained, result, needed=name != attacks.READ_KEYS or _has_filter())
        for name, (contained, result) in results.items()
    ]


def _attempts_to_outlive() -> list[Attempt]:
    """Leave children behind, run past the time limit, and look for the children from outside.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up.
    """
    for seconds in (0.3, 3, 30):  # on a busy machine, it may take a while until the children run
        token, limits = secrets.token_hex(16), replace(_LIMITS, seconds=seconds)
        outcome = sandbox.run(["/bin/sh", "-c", _OUTLIVE, token], visible=[], wanted={"started": 16}, limits=limits)
        if started := outcome.files.get("started") == b"started\n":
            break
    left = 0
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # some end meanwhile
            left += token.encode() in (process / "cmdline").read_bytes()
    remaining = f"{left} processes left" if started or left else "no process was started, or the run's file was lost"
    in_time = outcome.ending is Ending.DEADLINE
    return [
        Attempt("outliving: leave processes behind", started and not left, remaining),
        Attempt("time: run past the time limit", in_time, f"{outcome.ending.value}, after {outcome.seconds:.1f} s"),
    ]
