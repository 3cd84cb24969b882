"""Bubblewrap's arguments: which isolation layers a sandbox has, and what can be seen inside. And remedies if it fails.

Inside, there are: the system's programs and libraries (``/usr``), a few of the files of ``/etc``, the Python
environment, and what the caller shows; all of it read-only, and nothing else of the file system. One bounded tmpfs can
be written: ``/tmp``, with the working folder and a home in it.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from labcourse.errors import IsolationError
from labcourse.grading.isolation.process import MIB, Limits

OLDEST = (0, 8)  #: version of bubblewrap that can set up all layers
INSTALL = (
    "Install bubblewrap 0.8 or newer: `apt-get install bubblewrap` (Debian, Ubuntu), `dnf install bubblewrap` (Fedora)."
)
WORK, HOME = "/tmp/work", "/tmp/home"
USER_NAME = "student"  # of the only user inside, and its group
_SHARED_MEMORY = 16 * MIB  # semaphores are files there
_SYSTEM_FOLDERS = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")
_ETC_FILES = ("/etc/ld.so.cache", "/etc/alternatives", "/etc/fonts", "/etc/localtime")
_NEVER_SHOWN = ("/proc", "/sys", "/dev", "/run", "/etc")  # nothing in them is shown, whoever asks
# Not assigned to anybody by Linux distributions, nor to containers: see systemd's "Users, Groups, UIDs and GIDs".
_UNASSIGNED_IDS = range(0x70000000, 0x7FFFFFFF)


def is_root() -> bool:
    """Return whether this program has root's rights."""
    return os.geteuid() == 0


def sandbox_user() -> int:
    """Return the number of the user who runs a command inside.

    If this program runs as root, the number is drawn anew for each run, so that runs hardly ever share one. Otherwise
    the command runs as the user of this program, who has the number 1000 inside.

    Raises
    ------
    IsolationError
        If this program runs as root and can have no other user's number (in a container that has root only).
    """
    if not is_root():
        return 1000
    spare = _unassigned_ids(*(Path(f"/proc/self/{kind}_map").read_text("ascii") for kind in ("uid", "gid")))
    if not spare:
        raise IsolationError(
            "Students' code must not run as root, and root has no other user to become here.",
            "user",
            "Grade as an ordinary user.",
        )
    return secrets.choice(spare)


def _unassigned_ids(*maps: str) -> range:
    """Return user numbers that this process may use; an empty range if there are none.

    They are numbers that no distribution assigns, if it may use these, or else others that are rarely assigned.

    Parameters
    ----------
    maps : text of the kernel's maps (uid_map, gid_map) of this process: lines "first inside, first outside, count"
    """
    extents = [[tuple(map(int, line.split())) for line in text.splitlines()] for text in maps]
    for numbers in (_UNASSIGNED_IDS, range(60000, 65000), range(30000, 60000)):
        if all(any(first <= numbers[0] and numbers[-1] < first + n for first, _, n in lines) for lines in extents):
            return numbers
    return range(0)


def arguments(
    uid: int, visible: Iterable[Path], environment: Mapping[str, str], limits: Limits, synthetic: Mapping[str, int]
) -> list[str]:
    """Return bubblewrap's arguments, up to the command.

    Parameters
    ----------
    uid : of the user who runs the command, from :func:`sandbox_user`
    visible : paths to show besides the system and the Python environment, see :func:`visible_paths`
    environment : all variables
    limits : of which the size of the folder is used
    synthetic : path → descriptor of a file in memory with the content to show there, of :func:`synthetic_files`

    Raises
    ------
    IsolationError
        If a path cannot be shown.
    """
    args = ["--die-with-parent", "--new-session", "--as-pid-1", "--clearenv", "--hostname", "sandbox"]
    args += ["--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts", "--unshare-cgroup-try"]
    if is_root():  # the launcher needs these to become somebody else, and drops them, too
        args += ["--cap-drop", "ALL"]
        for capability in ("CAP_SETUID", "CAP_SETGID", "CAP_SETPCAP"):
            args += ["--cap-add", capability]
    else:
        args += ["--unshare-user", "--disable-userns", "--uid", str(uid), "--gid", str(uid)]
    for name, value in environment.items():
        args += ["--setenv", name, value]
    args += ["--proc", "/proc", "--dev", "/dev", *_tmpfs("/dev/shm", _SHARED_MEMORY), "--remount-ro", "/dev"]
    args += _tmpfs("/tmp", limits.folder)
    for folder in (WORK, HOME):
        args += ["--perms", "0777", "--dir", folder]
    args += _system_mounts()
    for path, descriptor in synthetic.items():
        args += ["--perms", "0444", "--file", str(descriptor), path]
    args += _bind_mounts(visible_paths(visible), _labcourse_folder())
    # Last: bubblewrap's own root is a tmpfs without bounds, and belongs to whoever runs it.
    return [*args, "--remount-ro", "/", "--chdir", WORK]


def synthetic_files(uid: int) -> dict[str, str]:
    """Return path → text of the files that replace those of the system."""
    return {
        "/etc/passwd": f"{USER_NAME}:x:{uid}:{uid}::{HOME}:/bin/sh\n",
        "/etc/group": f"{USER_NAME}:x:{uid}:\n",
        "/etc/hosts": "127.0.0.1 localhost sandbox\n::1 localhost\n",
        "/etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files\n",
    }


def setpriv_prefix(uid: int) -> list[str]:
    """Return the arguments to put before a command so that root runs it as this user; none for an ordinary user."""
    if not is_root():
        return []
    ids = ["--reuid", str(uid), "--regid", str(uid), "--clear-groups"]
    nothing = ["--inh-caps=-all", "--ambient-caps=-all", "--bounding-set=-all", "--no-new-privs"]
    return ["/usr/bin/setpriv", *ids, *nothing, "--"]


def default_environment() -> dict[str, str]:
    """Return the environment variables that every command gets, unless the caller of ``run`` sets them."""
    folders = [str(python().parent), "/usr/local/bin", "/usr/bin", "/bin"]
    return {"PATH": os.pathsep.join(folders), "HOME": HOME, "TMPDIR": "/tmp", "LANG": "C.UTF-8", "USER": USER_NAME}


def python() -> Path:
    """Return the path of the Python that runs this program; it is the same in the sandbox.

    ``sys.executable`` is what was typed: with ``..`` it may go through folders that are not shown.
    """
    return without_dots(Path(sys.executable).absolute())


def without_dots(path: Path) -> Path:
    """Return an absolute path to the same place without ``..`` in it.

    Links are followed only where a ``..`` comes after them. The last link stays: a Python finds its virtual environment
    by its own place, not by where it leads.
    """
    result = Path(path.anchor)
    for part in path.parts[1:]:
        result = result.resolve().parent if part == ".." else result / part
    return result


# --- what is shown ----------------------------------------------------------------------------------------------------


def visible_paths(visible: Iterable[Path]) -> list[Path]:
    """Return the paths to show: those of the Python environment and those in ``visible``, parents first.

    Raises
    ------
    IsolationError
        If a path does not exist, or would show too much.
    """
    # Under its name and where links lead to: programs ask for either.
    python = [path for prefix in (sys.prefix, sys.base_prefix) for path in (Path(prefix), Path(prefix).resolve())]
    return sorted({_checked_visible(path) for path in [*python, *visible]})


def _checked_visible(path: Path) -> Path:
    """Return a path that may be shown, without ``..``.

    Raises
    ------
    IsolationError
        If it is not absolute, does not exist, would show private folders, or cannot be read by the user inside.
    """
    if not path.is_absolute():
        raise IsolationError(f"Only absolute paths can be shown in the sandbox, not {path}.", "files")
    path = without_dots(path)
    if not path.exists():
        raise IsolationError(f"{path} is to be shown in the sandbox, and does not exist.", "files")
    real = path.resolve()
    private = [Path(name).resolve() for name in (os.path.expanduser("~"), tempfile.gettempdir(), "/var", WORK, HOME)]
    for place in (path, real):
        too_much = any(folder.is_relative_to(place) for folder in private)
        if too_much or any(place.is_relative_to(folder) for folder in _NEVER_SHOWN):
            environment = str(path) in (sys.prefix, sys.base_prefix)
            raise IsolationError(
                f"{path} cannot be shown in the sandbox: it would show too much.",
                "files",
                f"{'Use a Python environment' if environment else 'Keep what is to be shown'} in a separate folder.",
            )
    needed = 0o5 if real.is_dir() else 0o4  # what others may do: read, and enter a folder
    if is_root() and real.stat().st_mode & needed != needed:
        raise IsolationError(
            f"{path} can be read by its owner only, and root drops to another user in the sandbox.",
            "files",
            f"Let others read it (chmod -R o+rX {path}), or grade as an ordinary user.",
        )
    return path


def _labcourse_folder() -> Path:
    """Return the folder of labcourse, which must not be seen inside: it holds how students' work is judged."""
    return Path(__file__).resolve().parents[2]


def _bind_mounts(paths: Sequence[Path], hidden: Path) -> list[str]:
    """Return the arguments that show paths read-only, and an empty folder in place of a hidden one.

    Parameters
    ----------
    paths : to show, parents first
    hidden : folder to cover, labcourse's own; paths to show that lie in it are shown on top of the cover
    """
    args: list[str] = []
    bound = [Path("/usr")]  # _system_mounts shows it
    for path in paths:
        if not any(path.is_relative_to(above) for above in [*bound, hidden]):
            args += _bind_read_only(path)
            bound.append(path)
    # The hidden folder is covered under each name by which it can be reached: a shown path may be a link.
    real_paths = [(path, path.resolve()) for path in bound]
    masks = [str(path / hidden.relative_to(real)) for path, real in real_paths if hidden.is_relative_to(real)]
    for mask in masks:
        args += ["--perms", "0755", "--tmpfs", mask]
    for path in paths:
        args += _bind_read_only(path) if path.is_relative_to(hidden) else []
    for mask in masks:
        args += ["--remount-ro", mask]
    return args


def _bind_read_only(path: Path) -> list[str]:
    """Return the arguments that show a path read-only, under its name.

    The folders above it are made first: bubblewrap itself would make them for their owner only.
    """
    above = [arg for parent in reversed(path.parents[:-1]) for arg in ("--perms", "0755", "--dir", str(parent))]
    return [*above, "--ro-bind", str(path), str(path)]


def _system_mounts() -> list[str]:
    """Return the arguments that show the system's programs and libraries, and a few files of ``/etc``."""
    args = []
    for path in map(Path, _SYSTEM_FOLDERS):
        if path.is_symlink():
            args += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            args += ["--ro-bind", str(path), str(path)]
    args += ["--perms", "0755", "--dir", "/etc"]
    for name in _ETC_FILES:
        args += ["--ro-bind-try", name, name]
    return args


def _tmpfs(path: str, size: int) -> list[str]:
    """Return the arguments for a writable file system in memory, of so many bytes."""
    return ["--perms", "1777", "--size", str(size), "--tmpfs", path]


# --- what to do if it fails -------------------------------------------------------------------------------------------

_PLATFORM_REMEDIES = {
    "win32": "Grade under WSL2 (`wsl --install`, then this program in its Linux), or on a Linux machine.",
    "darwin": "Grade on a Linux machine, or in a Linux virtual machine on this one.",
}
_APPARMOR = (
    "AppArmor keeps bubblewrap from making user namespaces (Ubuntu 24.04 does). Let it alone do so: write\n"
    "    abi <abi/4.0>,\n"
    "    include <tunables/global>\n"
    "    profile bwrap /usr/bin/bwrap flags=(unconfined) { userns, }\n"
    "to /etc/apparmor.d/bwrap and run `sudo apparmor_parser -r /etc/apparmor.d/bwrap`."
)
_CONTAINER = (
    "This seems to be a container, and its own isolation keeps bubblewrap from setting up another. Best grade outside "
    "of it, on the machine itself. Else start the container with `--security-opt seccomp=unconfined --security-opt "
    "apparmor=unconfined --security-opt systempaths=unconfined` and grade as an ordinary user in it; do not use "
    "--privileged."
)
_NAMESPACE_SETTINGS = (
    # file in /proc/sys, the value that forbids namespaces, and what to do
    ("kernel/apparmor_restrict_unprivileged_userns", "1", _APPARMOR),
    (
        "kernel/unprivileged_userns_clone",
        "0",
        "Let ordinary users make user namespaces: `sudo sysctl kernel.unprivileged_userns_clone=1`.",
    ),
    (
        "user/max_user_namespaces",
        "0",
        "Let users make user namespaces: `sudo sysctl user.max_user_namespaces=15000`.",
    ),
)
_FAILURES = (
    # parts of bubblewrap's message, the layer that failed, and what to do; "" for what the system's settings say
    (("Unknown option",), "bubblewrap", INSTALL),
    (("No permissions to create", "Creating new namespace failed", "setting up uid map"), "namespaces", ""),
    (("mount proc", "make / slave", "remount", "mount tmpfs"), "file system", ""),
    (("loopback", "RTM_NEWADDR"), "network", ""),
    (("setpriv: failed to execute", "setpriv: not found"), "user", "Install util-linux, or grade as an ordinary user."),
    (("setpriv",), "user", "Root may not become another user here: grade as an ordinary user."),
)


def remedy_of_platform() -> str:
    """Return what to do where the system is not Linux."""
    return _PLATFORM_REMEDIES.get(sys.platform, "Grade on a Linux machine.")


def remedy_of_namespaces(settings: Path = Path("/proc/sys")) -> str:
    """Return what to do where namespaces cannot be made: about a setting in /proc/sys, a container, or in general."""
    for name, bad, remedy in _NAMESPACE_SETTINGS:
        with contextlib.suppress(OSError):
            if (settings / name).read_text("ascii").strip() == bad:
                return remedy
    if in_container():
        return _CONTAINER
    return "Let ordinary users make user namespaces (see `man 7 user_namespaces`), or grade on another machine."


def in_container(root: Path = Path("/")) -> bool:
    """Return whether this seems to be a container: of Docker, Podman, or Kubernetes, as on a hub."""
    marks = (".dockerenv", "run/.containerenv", "run/secrets/kubernetes.io", "var/run/secrets/kubernetes.io")
    return "KUBERNETES_SERVICE_HOST" in os.environ or any((root / mark).exists() for mark in marks)


def explain_failure(message: str) -> tuple[str, str]:
    """Return the layer that failed and what to do about it, from a message of bubblewrap or setpriv."""
    for parts, layer, remedy in _FAILURES:
        if any(part in message for part in parts):
            return layer, remedy or remedy_of_namespaces()
    return "bubblewrap", "The command `doctor` shows which layers work here and which do not."
