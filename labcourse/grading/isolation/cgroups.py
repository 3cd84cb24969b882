"""Control groups: limit memory and processes of everything in a sandbox together, where the system permits it.

An optional layer. It is active where we may make a group below the one that we are in: as root, mostly; as anybody else
where the system's manager has delegated a group (``systemd-run --user --scope``). A group made here is below ours
(version 1, so that a limit on us holds inside) or beside it (version 2, where inner groups hold no processes).
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import time
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from labcourse.grading.isolation.process import Limits

PREFIX = "labcourse"  #: of the names of groups that are made here
#: Controller → the name of its layer.
LAYERS = {"memory": "memory of all together", "pids": "processes of all together"}
_LIMIT_FILES = {("memory", 1): "memory.limit_in_bytes", ("memory", 2): "memory.max"}  # those of pids: "pids.max"
_REMOVAL_TIMEOUT = 2.0  # s; the kernel lets go of a group a little after its last process


@dataclass(frozen=True)
class ParentGroup:
    """A group below which one can be made: its folder, and the version (1 or 2) of its hierarchy."""

    folder: Path
    version: int


def parent_groups(proc_self: Path = Path("/proc/self")) -> dict[str, ParentGroup]:
    """Find where groups can be made: controller ("memory", "pids") → group. Unavailable controllers are left out.

    Parameters
    ----------
    proc_self : folder with the kernel's ``cgroup`` and ``mountinfo`` of this process
    """
    try:
        lines = [line.split(":", 2) for line in (proc_self / "cgroup").read_text("utf-8").splitlines()]
        mounts = (proc_self / "mountinfo").read_text("utf-8").splitlines()
    except OSError:
        return {}
    # Controller → the group that this process is in; "" stands for the hierarchy of version 2.
    ours = {name: Path(path) for _number, names, path in lines for name in names.split(",")}
    parents = {}
    for line in mounts:
        left, _, right = line.partition(" - ")
        kind, _, options = right.split(" ", 2)
        root, folder = map(Path, left.split(" ")[3:5])
        version = {"cgroup": 1, "cgroup2": 2}.get(kind, 0)
        controllers = {1: options.split(","), 2: list(LAYERS)}.get(version, [])
        for controller in (name for name in LAYERS if name in controllers):
            path = ours.get("" if version == 2 else controller)
            if path is not None and path.is_relative_to(root):
                group = folder / path.relative_to(root)
                parent = group if version == 1 else _delegating(folder, group, controller)
                if parent is not None and os.access(parent, os.W_OK | os.X_OK):
                    parents[controller] = ParentGroup(parent, version)
    return parents


def _delegating(mount: Path, current: Path, controller: str) -> Path | None:
    """Find the group that passes a controller on to groups below it; None if there is none.

    Parameters
    ----------
    mount : folder of the hierarchy; a group above it cannot be seen
    current : the group that this process is in; it, or the one above it, may pass the controller on
    controller : "memory" or "pids"
    """
    for group in (current, current.parent):
        with contextlib.suppress(OSError):
            passed_on = (group / "cgroup.subtree_control").read_text("ascii").split()
            if group.is_relative_to(mount) and controller in passed_on:
                return group
    return None


@contextlib.contextmanager
def limited_groups(limits: Limits, parents: Mapping[str, ParentGroup]) -> Iterator[Collection[Path]]:
    """Make groups with limits, where that is possible; yield their folders. They are removed after the block.

    Parameters
    ----------
    limits : of which the memory and the number of processes are used
    parents : from :func:`parent_groups`
    """
    name = f"{PREFIX}-{os.getpid()}-{secrets.token_hex(8)}"
    values = {"memory": limits.memory, "pids": limits.processes + 2}  # the launcher's two shells count, too
    limited = set()
    with contextlib.ExitStack() as stack:
        for controller, parent in parents.items():
            _remove_stale_groups(parent.folder)
            folder = parent.folder / name
            with contextlib.suppress(OSError):
                folder.mkdir(exist_ok=True)  # in version 2 both controllers have the same one
                stack.callback(_remove_group, folder)
                limit = _LIMIT_FILES.get((controller, parent.version), "pids.max")
                (folder / limit).write_text(str(values[controller]), "ascii")
                limited.add(folder)
                # Memory and swap together (version 1), or swap alone (version 2): nothing is swapped out.
                for swap, value in (("memory.memsw.limit_in_bytes", limits.memory), ("memory.swap.max", 0)):
                    if (folder / swap).exists():
                        (folder / swap).write_text(str(value), "ascii")
        yield limited


def add(pid: int, groups: Iterable[Path]) -> None:
    """Put a process, with all that it will start, into groups; a group that cannot take it is passed over."""
    for folder in groups:
        with contextlib.suppress(OSError):
            (folder / "cgroup.procs").write_text(str(pid), "ascii")


def _remove_group(folder: Path) -> None:
    """Remove a group. Try for up to 2 s, then leave it: the kernel may still be busy with its last process."""
    deadline = time.monotonic() + _REMOVAL_TIMEOUT
    while folder.exists() and time.monotonic() < deadline:
        try:
            folder.rmdir()
        except OSError:
            time.sleep(0.01)


def _remove_stale_groups(parent: Path) -> None:
    """Remove the groups that a killed program has left: their names have the number of a process that has ended."""
    for folder in parent.glob(f"{PREFIX}-*"):
        match = re.fullmatch(rf"{PREFIX}-(\d+)-[0-9a-f]+", folder.name)
        if match and not Path("/proc", match[1]).exists():
            with contextlib.suppress(OSError):
                folder.rmdir()
