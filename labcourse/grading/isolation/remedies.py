"""What to do when a layer cannot be set up, from the messages of bubblewrap and the system."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

OLDEST = (0, 8)  #: version of bubblewrap that can set up all layers

INSTALL = (
    "Install bubblewrap 0.8 or newer: `apt-get install bubblewrap` (Debian, Ubuntu), `dnf install bubblewrap` (Fedora)."
)
MACHINE = {
    "win32": "Grade under WSL2 (`wsl --install`, then this program in its Linux), or on a Linux machine.",
    "darwin": "Grade on a Linux machine, or in a Linux virtual machine on this one.",
}
ANY_MACHINE = "Grade on a Linux machine."
_APPARMOR = (
    "AppArmor keeps bubblewrap from making user namespaces (Ubuntu 24.04 does). Let it alone do so: write\n"
    "    abi <abi/4.0>,\n"
    "    include <tunables/global>\n"
    "    profile bwrap /usr/bin/bwrap flags=(unconfined) { userns, }\n"
    "to /etc/apparmor.d/bwrap and run `sudo apparmor_parser -r /etc/apparmor.d/bwrap`."
)
_DEBIAN = "Let ordinary users make user namespaces: `sudo sysctl kernel.unprivileged_userns_clone=1`."
_NONE_LEFT = "Let users make user namespaces: `sudo sysctl user.max_user_namespaces=15000`."
_CONTAINER = (
    "This seems to be a container whose own isolation keeps bubblewrap from setting up another. Best grade outside of "
    "it, on the machine itself. Else start the container with `--security-opt seccomp=unconfined --security-opt "
    "apparmor=unconfined --security-opt systempaths=unconfined` and grade as an ordinary user in it; do not use "
    "--privileged."
)
_USERNS = "Let ordinary users make user namespaces (see `man 7 user_namespaces`), or grade on another machine."
_SETTINGS = {
    "kernel/apparmor_restrict_unprivileged_userns": ("1", _APPARMOR),
    "kernel/unprivileged_userns_clone": ("0", _DEBIAN),
    "user/max_user_namespaces": ("0", _NONE_LEFT),
}
_MESSAGES = (
    # bubblewrap's message when it fails → which layer
    (("Unknown option",), "bubblewrap", INSTALL),
    (("No permissions to create", "Creating new namespace failed", "setting up uid map"), "namespaces", ""),
    (("mount proc", "make / slave", "remount", "mount tmpfs"), "file system", ""),
    (("loopback", "RTM_NEWADDR"), "network", ""),
    (("setpriv: failed to execute", "setpriv: not found"), "user", "Install util-linux, or grade as an ordinary user."),
    (("setpriv",), "user", "Root may not become another user here: grade as an ordinary user."),
)


def of_platform() -> str:
    """What to do where the system is not Linux."""
    return MACHINE.get(sys.platform, ANY_MACHINE)


def of_namespaces(settings: Path = Path("/proc/sys")) -> str:
    """What to do where namespaces cannot be made: by the system's settings, or by being in a container."""
    for name, (bad, remedy) in _SETTINGS.items():
        with contextlib.suppress(OSError):
            if (settings / name).read_text("ascii").strip() == bad:
                return remedy
    return _CONTAINER if in_container() else _USERNS


def in_container(root: Path = Path("/")) -> bool:
    """Whether this seems to be a container: Docker's, Podman's, or one of Kubernetes, as a hub may be made of."""
    marks = (".dockerenv", "run/.containerenv", "run/secrets/kubernetes.io", "var/run/secrets/kubernetes.io")
    return "KUBERNETES_SERVICE_HOST" in os.environ or any((root / mark).exists() for mark in marks)


def explain(message: str) -> tuple[str, str]:
    """Which layer failed, and what to do, from the message when it did."""
    for marks, layer, remedy in _MESSAGES:
        if any(mark in message for mark in marks):
            return layer, remedy or of_namespaces()
    return "bubblewrap", "The command `doctor` shows what is there and what is missing."
