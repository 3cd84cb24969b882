"""What isolation is made of on this computer: what is there, what is missing, and what to do about it.

Each layer is found by looking, the rest by setting up a sandbox and asking a trusted program in it what it sees.
Whether they withstand attacks is for :mod:`labcourse.grading.isolation.selftest`.
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, cgroups, remedies, sandbox
from labcourse.grading.isolation.outcome import Limits

_KERNEL = (5, 14)  # counts an ordinary user's processes in each user namespace; before, the sandbox shares one limit
_LOOK = """
cat /proc/self/status /proc/self/limits /proc/net/dev /proc/self/mounts
echo =
ls -d /proc/[0-9]*
id -u
echo seen > seen
"""
_WRITABLE = re.compile(r"/tmp|/dev/.*|/proc")
_DELEGATE = (
    "Grade as root, or in a group of your own where systemd runs: `systemd-run --user --scope …`. "
    "Without it each process is limited by itself, and the number of small files that a student can make is not."
)


_REPORT = "Do not grade here, and report what this shows."


@dataclass(frozen=True)
class Layer:
    """One of the things that isolation is made of.

    Attributes
    ----------
    name : of the layer
    good : whether it is there
    found : what was found, as text
    remedy : what to do if it is not; "" if it is
    needed : whether nothing may be run without it
    """

    name: str
    good: bool
    found: str
    remedy: str = ""
    needed: bool = True


def examine() -> list[Layer]:
    """The layers, the most basic first; after one of the first three that is missing, nothing more is looked at."""
    found: list[Layer] = []
    for look in (_system, _bubblewrap, _user):
        found.append(look())
        if not found[-1].good:
            return found
    together = [_together("memory", "memory of all together"), _together("pids", "processes of all together")]
    return [*found, *_inside(), *together]


def _system() -> Layer:
    name, release = "operating system", f"{platform.system()} {platform.release()}"
    if not sys.platform.startswith("linux"):
        return Layer(name, False, f"{release}; isolation needs Linux", remedies.of_platform())
    version = tuple(int(part) for part in re.findall(r"\d+", platform.release())[:2])
    if version < _KERNEL:
        return Layer(name, False, release, "Use a system with Linux 5.14 or newer.")
    return Layer(name, True, release)


def _bubblewrap() -> Layer:
    program = shutil.which("bwrap")
    if program is None:
        return Layer("bubblewrap", False, "not installed", remedies.INSTALL)
    reported = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    version = tuple(int(part) for part in re.findall(r"\d+", reported)[:2])
    good = version >= remedies.OLDEST
    return Layer(
        "bubblewrap", good, f"{reported or 'of an unknown version'} ({program})", "" if good else remedies.INSTALL
    )


def _user() -> Layer:
    try:
        user = bubblewrap.sandbox_user()
    except IsolationError as error:
        return _of_error(error)
    if not user.from_root:
        return Layer("user", True, "an ordinary user, in a user namespace")
    setpriv = Path(bubblewrap.setpriv_prefix(user)[0])
    if not setpriv.exists():
        return Layer("user", False, f"root, and there is no {setpriv}", "Install util-linux, or grade as another user.")
    return Layer("user", True, "root, who becomes another user for each run")


# --- seen from inside -------------------------------------------------------------------------------------------------


def _inside() -> list[Layer]:
    """The layers that a trusted program sees from inside."""
    limits = Limits(seconds=60)
    command = ["/bin/sh", "-c", _LOOK]
    try:
        outcome = sandbox.run(command, visible=[], wanted="seen", largest=5, limits=limits)
    except IsolationError as error:
        return [_of_error(error)]
    output, _, ours = outcome.output.decode(errors="replace").partition("\n=\n")
    if outcome.file != b"seen\n":
        return [Layer("sandbox", False, f"a trusted program does not run in it: {output[-200:]}", _REPORT)]
    interfaces = re.findall(r"^\s*(\w+):(?:\s+\d+){10}", output, re.MULTILINE)
    mounts = re.findall(r"^\S+ (\S+) \S+ (rw|ro),", output, re.MULTILINE)
    writable = [path for path, how in mounts if how == "rw"]
    processes = ours.count("/proc/")
    unprivileged = re.search(r"CapEff:\s*0+\n.*NoNewPrivs:\s*1\n", output, re.DOTALL)
    limited = re.search(rf"Max address space\s+{limits.memory}\s", output)
    filtered = "system calls" in outcome.layers
    return [
        _layer("file system", bool(mounts) and all(map(_WRITABLE.fullmatch, writable)), "read-only, but for /tmp"),
        _layer("network", interfaces == ["lo"], f"interfaces: {', '.join(interfaces)}"),
        _layer("processes", 0 < processes <= 5, f"{processes} to be seen, all of the sandbox"),
        _layer("privileges", bool(unprivileged) and ours.split()[-1] != "0", "none, and none to be had"),
        _layer("limits", limited is not None, "memory and files of each process, number of processes, time"),
        Layer("system calls", filtered, "filtered" if filtered else "not filtered on this machine", needed=False),
    ]


def _of_error(error: IsolationError) -> Layer:
    return Layer(error.layer or "sandbox", False, str(error).removesuffix(error.remedy).strip(), error.remedy)


def _layer(name: str, good: bool, found: str) -> Layer:
    return Layer(name, good, found if good else f"not so: {found}", "" if good else _REPORT)


def _together(controller: str, name: str) -> Layer:
    parent = cgroups.parent_groups().get(controller)
    if parent is None:
        return Layer(name, False, "no control group to be had", _DELEGATE, needed=False)
    return Layer(name, True, f"control group (version {parent.version})", needed=False)
