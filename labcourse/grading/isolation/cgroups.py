"""Memory and processes of all that runs in a sandbox together, limited where the system lets us (control groups).

An optional layer. It is active where we may make a group of our own below the one that we are in: as root, mostly; as
anybody else where the system's manager has handed a group over (``systemd-run --user --scope``). A group made here is
below ours (version 1, so that a limit on us holds inside) or beside it (version 2, where inner groups hold no
processes).
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from labcourse.grading.isolation.outcome import Limits

_PREFIX = "labcourse"
_PATIENCE = 2.0  # s; the kernel lets go of a group a little after its last process
_FILES = {
    # controller → version → the file of its limit
    "memory": {1: "memory.limit_in_bytes", 2: "memory.max"},
    "pids": {1: "pids.max", 2: "pids.max"},
}
_NAMES = {"memory": "memory of all together", "pids": "processes of all together"}


@dataclass(frozen=True)
class ParentGroup:
    """A group below which one can be made that has a controller."""

    folder: Path
    version: int


@dataclass
class Groups:
    """Groups that were made for one sandbox: controller → folder, where the limit was set."""

    limited: dict[str, Path]

    def add(self, pid: int) -> tuple[str, ...]:
        """Put a process into them, with all that it will start; what is limited by them from now on."""
        active = []
        for controller, folder in self.limited.items():
            with contextlib.suppress(OSError):
                (folder / "cgroup.procs").write_text(str(pid), "ascii")
                active.append(_NAMES[controller])
        return tuple(active)


def parent_groups(system: Path = Path("/proc/self")) -> dict[str, ParentGroup]:
    """Where groups can be made: controller ("memory", "pids") → group; without those that cannot be had.

    Parameters
    ----------
    system : folder with the kernel's ``cgroup`` and ``mountinfo`` of this process
    """
    try:
        ours = _ours((system / "cgroup").read_text("utf-8"))
        mounts = (system / "mountinfo").read_text("utf-8")
    except OSError:
        return {}
    found = {}
    for root, folder, version, controllers in _hierarchies(mounts):
        for controller in _FILES:
            path = ours.get(controller if version == 1 else "")
            if path is None or (version == 1 and controller not in controllers) or not path.is_relative_to(root):
                continue
            parent = _parent_group(folder, path.relative_to(root), version, controller)
            if parent is not None and os.access(parent.folder, os.W_OK | os.X_OK):
                found[controller] = parent
    return found


def _parent_group(folder: Path, path: Path, version: int, controller: str) -> ParentGroup | None:
    if version == 1:
        return ParentGroup(folder / path, 1)
    for group in (folder / path, (folder / path).parent):  # beside ours, but not above where we can see
        with contextlib.suppress(OSError):
            handed_on = (group / "cgroup.subtree_control").read_text("ascii").split()
            if group.is_relative_to(folder) and controller in handed_on:
                return ParentGroup(group, 2)
    return None


def _ours(text: str) -> dict[str, Path]:
    """Controller (or "" for version 2) → the group that we are in, from ``/proc/self/cgroup``."""
    found = {}
    for line in text.splitlines():
        _, controllers, path = line.split(":", 2)
        for controller in controllers.split(","):
            found[controller] = Path(path)
    return found


def _hierarchies(mounts: str) -> Iterator[tuple[Path, Path, int, list[str]]]:
    """What is mounted of the groups: its root, where, version, and the controllers (of version 1)."""
    for line in mounts.splitlines():
        left, _, right = line.partition(" - ")
        kind, _, options = right.split(" ", 2)
        root, folder = left.split(" ")[3:5]
        if kind in ("cgroup", "cgroup2"):
            yield Path(root), Path(folder), 2 if kind == "cgroup2" else 1, options.split(",")


@contextlib.contextmanager
def limited_groups(limits: Limits, parents: Mapping[str, ParentGroup]) -> Iterator[Groups]:
    """Groups with these limits, where they can be had, for as long as the ``with`` block lasts."""
    name = f"{_PREFIX}-{os.getpid()}-{secrets.token_hex(8)}"
    most = {"memory": limits.memory, "pids": limits.processes + 2}  # two shells wait for the command
    groups, folders = Groups({}), set()
    try:
        for controller, parent in parents.items():
            _sweep(parent.folder)
            folder = parent.folder / name
            with contextlib.suppress(OSError):
                folder.mkdir(exist_ok=True)  # both controllers have the same one in version 2
                folders.add(folder)
                (folder / _FILES[controller][parent.version]).write_text(str(most[controller]), "ascii")
                groups.limited[controller] = folder
                _no_swap(folder, limits.memory)
        yield groups
    finally:
        for folder in folders:
            _remove(folder)


def _no_swap(folder: Path, memory: int) -> None:
    for name, value in (("memory.memsw.limit_in_bytes", memory), ("memory.swap.max", 0)):
        if (folder / name).exists():
            (folder / name).write_text(str(value), "ascii")


def _remove(folder: Path) -> None:
    deadline = time.monotonic() + _PATIENCE
    while folder.exists() and time.monotonic() < deadline:
        try:
            folder.rmdir()
        except OSError:
            time.sleep(0.01)


def _sweep(folder: Path) -> None:
    """Remove what a program that was killed has left: the groups of processes that are no more."""
    for left in folder.glob(f"{_PREFIX}-*"):
        found = re.fullmatch(rf"{_PREFIX}-(\d+)-[0-9a-f]+", left.name)
        if found and not Path("/proc", found[1]).exists():
            with contextlib.suppress(OSError):
                left.rmdir()
