"""Bubblewrap's arguments: which isolation layers a sandbox has, and what can be seen inside.

Inside, there are: the system's programs and libraries (``/usr``), a few of the files of ``/etc``, the Python
environment, and what the caller shows; all of it read-only, and nothing else of the file system. One bounded tmpfs can
be written: ``/tmp``, with the working folder and a home in it.
"""

from __future__ import annotations

import os
import secrets
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labcourse.errors import IsolationError
from labcourse.grading.isolation.outcome import MIB, Limits

WORK, HOME = "/tmp/work", "/tmp/home"
USER_NAME = "student"  # of the only user inside, and its group
_SHARED_MEMORY = 16 * MIB  # semaphores are files there
_SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")
_SETTINGS = ("/etc/ld.so.cache", "/etc/alternatives", "/etc/fonts", "/etc/localtime")
_NEVER = ("/proc", "/sys", "/dev", "/run", "/etc")  # nothing in them is shown, whoever asks
# Not assigned to anybody by Linux distributions, nor to containers: see systemd's "Users, Groups, UIDs and GIDs".
_UNASSIGNED_IDS = range(0x70000000, 0x7FFFFFFF)


@dataclass(frozen=True)
class User:
    """Who runs the command. Root drops to ``uid``; anybody else stays who they are, and is called ``uid`` inside."""

    uid: int
    from_root: bool


def is_root() -> bool:
    """Whether this program has root's rights."""
    return os.geteuid() == 0


def sandbox_user() -> User:
    """Somebody to run one command, with a number of their own where we are root.

    Raises
    ------
    IsolationError
        If we are root, and have no other user's number (in a container that has root only).
    """
    if not is_root():
        return User(1000, False)
    spare = _unassigned_ids(
        Path("/proc/self/uid_map").read_text("ascii"), Path("/proc/self/gid_map").read_text("ascii")
    )
    if not spare:
        raise IsolationError(
            "Students' code must not run as root, and root has no other user to become here.",
            "user",
            "Grade as an ordinary user.",
        )
    return User(spare[secrets.randbelow(len(spare))], True)


def _unassigned_ids(*maps: str) -> range:
    """Numbers that nobody has, and that we have the use of, by the kernel's maps of users and groups."""
    for candidates in (_UNASSIGNED_IDS, range(60000, 65000), range(30000, 60000)):
        if all(_covers(text, candidates) for text in maps):
            return candidates
    return range(0)


def _covers(text: str, numbers: range) -> bool:
    extents = [tuple(map(int, line.split())) for line in text.splitlines()]
    return any(first <= numbers[0] and numbers[-1] < first + length for first, _, length in extents)


def arguments(
    user: User,
    visible: Iterable[Path],
    environment: Mapping[str, str],
    limits: Limits,
    synthetic: Mapping[str, int],
) -> list[str]:
    """Bubblewrap's arguments, up to the command.

    Parameters
    ----------
    user : who runs the command
    visible : what is shown besides the system and the Python environment, see :func:`visible_paths`
    environment : all variables
    limits : of which the size of the folder is used
    synthetic : path → descriptor of a file with what is to be there

    Raises
    ------
    IsolationError
        If something cannot be shown.
    """
    args = ["--die-with-parent", "--new-session", "--as-pid-1", "--clearenv", "--hostname", "sandbox"]
    args += ["--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts", "--unshare-cgroup-try"]
    if user.from_root:  # what the launcher needs to become somebody else; it drops these, too
        args += ["--cap-drop", "ALL"]
        for capability in ("CAP_SETUID", "CAP_SETGID", "CAP_SETPCAP"):
            args += ["--cap-add", capability]
    else:
        args += ["--unshare-user", "--disable-userns", "--uid", str(user.uid), "--gid", str(user.uid)]
    for name, value in environment.items():
        args += ["--setenv", name, value]
    args += ["--proc", "/proc", "--dev", "/dev", *_tmpfs("/dev/shm", _SHARED_MEMORY), "--remount-ro", "/dev"]
    args += _tmpfs("/tmp", limits.folder)
    for folder in (WORK, HOME):
        args += ["--perms", "0777", "--dir", folder]
    args += _system_mounts()
    for path, descriptor in synthetic.items():
        args += ["--perms", "0444", "--file", str(descriptor), path]
    args += _mounts(visible_paths(visible), _own_package())
    # Last: bubblewrap's own root is a tmpfs without bounds, and belongs to whoever runs it.
    return [*args, "--remount-ro", "/", "--chdir", WORK]


def synthetic_files(user: User) -> dict[str, str]:
    """Path → text of the files that are there in place of the system's own."""
    return {
        "/etc/passwd": f"{USER_NAME}:x:{user.uid}:{user.uid}::{HOME}:/bin/sh\n",
        "/etc/group": f"{USER_NAME}:x:{user.uid}:\n",
        "/etc/hosts": "127.0.0.1 localhost sandbox\n::1 localhost\n",
        "/etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files\n",
    }


def setpriv_prefix(user: User) -> list[str]:
    """What comes before the command, for it to be run by this user."""
    if not user.from_root:
        return []
    ids = ["--reuid", str(user.uid), "--regid", str(user.uid), "--clear-groups"]
    nothing = ["--inh-caps=-all", "--ambient-caps=-all", "--bounding-set=-all", "--no-new-privs"]
    return ["/usr/bin/setpriv", *ids, *nothing, "--"]


def default_environment() -> dict[str, str]:
    """The variables that every command gets, unless the caller sets them."""
    folders = [str(python().parent), "/usr/local/bin", "/usr/bin", "/bin"]
    return {"PATH": os.pathsep.join(folders), "HOME": HOME, "TMPDIR": "/tmp", "LANG": "C.UTF-8", "USER": USER_NAME}


def python() -> Path:
    """This Python's program, by a name that it has in the sandbox as well.

    ``sys.executable`` is what was typed: by ``..`` it may go through folders that are not shown.
    """
    return straight(Path(sys.executable).absolute())


def straight(path: Path) -> Path:
    """An absolute path to the same place, without ``..``.

    Links are followed only where a ``..`` comes after them; the last stays: by its place, not by where it leads,
    a Python knows its virtual environment.
    """
    found = Path(path.anchor)
    for part in path.parts[1:]:
        found = found.resolve().parent if part == ".." else found / part
    return found


# --- what is shown ----------------------------------------------------------------------------------------------------


def visible_paths(visible: Iterable[Path]) -> list[Path]:
    """The Python environment and what the caller shows, parents first.

    Raises
    ------
    IsolationError
        If something is not there, or if too much would be seen with it.
    """
    # Under its name and where links lead to: programs ask for either.
    python = [path for prefix in (sys.prefix, sys.base_prefix) for path in (Path(prefix), Path(prefix).resolve())]
    return sorted({_checked(path) for path in [*python, *visible]})


def _checked(path: Path) -> Path:
    if not path.is_absolute():
        raise IsolationError(f"Only absolute paths can be shown in the sandbox, not {path}.", "files")
    path = straight(path)
    if not path.exists():
        raise IsolationError(f"{path} is to be shown in the sandbox, and is not there.", "files")
    real = path.resolve()
    own = (os.path.expanduser("~"), tempfile.gettempdir(), "/var", WORK, HOME)
    private = [Path(folder).resolve() for folder in own]
    for place in (path, real):
        too_much = any(folder.is_relative_to(place) for folder in private)
        if too_much or any(place.is_relative_to(folder) for folder in _NEVER):
            raise IsolationError(
                f"{path} cannot be shown in the sandbox: too much would be seen with it.",
                "files",
                "Use a Python environment in a folder of its own."
                if str(path) in (sys.prefix, sys.base_prefix)
                else "Keep what is to be shown in a folder of its own.",
            )
    if is_root():
        needed = 0o5 if real.is_dir() else 0o4
        if real.stat().st_mode & needed != needed:
            raise IsolationError(
                f"{path} can be read by its owner only, and root drops to another user in the sandbox.",
                "files",
                f"Let others read it (chmod -R o+rX {path}), or grade as an ordinary user.",
            )
    return path


def _own_package() -> Path:
    """The package that this belongs to: it knows how the command is judged, and is not for the command to see."""
    return Path(__file__).resolve().parents[2]


def _mounts(paths: Sequence[Path], hidden: Path) -> list[str]:
    """Show these, parents first; and an empty folder in place of ``hidden``, save what is asked for inside it."""
    outer = [path for path in paths if not path.is_relative_to(hidden)]
    inner = [path for path in paths if path.is_relative_to(hidden)]
    args: list[str] = []
    done = [Path("/usr")]
    for path in outer:
        if not any(path.is_relative_to(above) for above in done):
            args += _read_only(path)
            done.append(path)
    # A folder that is shown under two names has ``hidden`` under both.
    seen = [(path, path.resolve()) for path in done]
    masks = [path / hidden.relative_to(real) for path, real in seen if hidden.is_relative_to(real)]
    for mask in masks:
        args += ["--perms", "0755", "--tmpfs", str(mask)]
    for path in inner:
        args += _read_only(path)
    for mask in masks:
        args += ["--remount-ro", str(mask)]
    return args


def _read_only(path: Path) -> list[str]:
    """Show it under its name. The folders above are made first: bubblewrap makes them for their owner only."""
    args = []
    for parent in reversed(path.parents[:-1]):
        args += ["--perms", "0755", "--dir", str(parent)]
    return [*args, "--ro-bind", str(path), str(path)]


def _system_mounts() -> list[str]:
    args = []
    for path in map(Path, _SYSTEM):
        if path.is_symlink():
            args += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            args += ["--ro-bind", str(path), str(path)]
    args += ["--perms", "0755", "--dir", "/etc"]
    for name in _SETTINGS:
        args += ["--ro-bind-try", name, name]
    return args


def _tmpfs(path: str, size: int) -> list[str]:
    return ["--perms", "1777", "--size", str(size), "--tmpfs", path]
