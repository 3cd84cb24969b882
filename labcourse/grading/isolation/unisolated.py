"""Run a command without isolation, if it is trusted.

Only some limits hold: the deadline, and the bytes that the command writes to its output and leaves in its files. It
works in a separate folder, with an environment that has nothing of the grader's, and the processes that it started
end with it, as far as they can be found. It has the rights of the caller; memory, processes and files are not limited.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, process

_TOKEN = "LABCOURSE_RUN"  # environment variable that marks the processes of a run
_ROUNDS = 100  # a process that forks faster than this needs the sandbox
_REMOVE = 'chmod -R u+rwX -- "$0"; rm -rf -- "$0"'  # rm copes with any depth and any names


@contextlib.contextmanager
def unisolated(command: Sequence[str], environment: Mapping[str, str]) -> Iterator[Unisolated]:
    """Run a command with the rights of the caller, until the ``with`` block ends.

    Parameters
    ----------
    command, environment : as for :func:`labcourse.grading.isolation.sandbox.run`

    Raises
    ------
    IsolationError
        For root, as no untrusted command may have root's rights; and on systems without process groups (Windows).
    """
    check_allowed()
    scratch = Path(tempfile.mkdtemp(prefix="labcourse-run-")).resolve()
    with contextlib.ExitStack() as stack:
        remove = ["/bin/sh", "-c", _REMOVE, str(scratch)]
        stack.callback(subprocess.run, remove, capture_output=True, check=False)
        work, home = scratch / "work", scratch / "home"
        work.mkdir()
        home.mkdir()
        # Held open: should the command put another folder in its place, the files are still read from this one.
        folder = os.open(work, os.O_RDONLY | os.O_DIRECTORY)
        stack.callback(os.close, folder)
        path, token = os.pathsep.join([str(bubblewrap.python().parent), os.defpath]), secrets.token_hex(16)
        own_variables = {"PATH": path, "HOME": str(home), "TMPDIR": str(home), "LANG": "C.UTF-8"}
        variables = {**own_variables, **environment, _TOKEN: token}
        running = Unisolated(process.start(command, cwd=work, env=variables, start_new_session=True), folder, token)
        stack.callback(running.pipes.close)
        stack.callback(running.end)
        yield running


class Unisolated:
    """A command that runs with the rights of the caller, with the attributes of a sandbox.

    Parameters
    ----------
    started : its process
    folder : descriptor of its working folder
    token : in the environment of all its processes
    """

    def __init__(self, started: subprocess.Popen[bytes], folder: int, token: str) -> None:
        self._process, self.folder, self._token = started, folder, token
        self.pipes = process.ProcessPipes(started, 0)
        self._code: int | None = None

    def end(self) -> int:
        """Kill the command's process group, and every process that has the token of the run in its environment.

        Processes that the command starts can leave the group; the environment that they started with stays.

        Returns
        -------
        int
            Exit status of the command, or minus the signal that ended it. A second call returns it again.
        """
        import psutil  # type: ignore[import-untyped]

        if self._code is not None:  # ended before: its process number may be another process's by now
            return self._code
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._code = self._process.wait()
        for _ in range(_ROUNDS):
            left = _processes_with(self._token)
            if not left:
                break
            for running in left:
                with contextlib.suppress(psutil.Error):
                    running.kill()
            psutil.wait_procs(left, timeout=1)
        return self._code


def check_allowed() -> None:
    """Raise IsolationError for root, and on systems without process groups (Windows)."""
    if os.name != "posix":
        raise IsolationError(
            "A run cannot be watched and ended here.", "operating system", bubblewrap.remedy_of_platform()
        )
    if os.geteuid() == 0:
        raise IsolationError(
            "Running students' code without isolation is not for root: with its rights it could do anything at all.",
            "user",
            "Grade in isolation, or as a user made for it who owns nothing of value.",
        )


def _processes_with(token: str) -> list[Any]:
    """Return the running processes (psutil's) that have the token of a run in their environment."""
    import psutil

    processes = []
    for running in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if running.environ().get(_TOKEN) == token and running.status() != psutil.STATUS_ZOMBIE:
                processes.append(running)
    return processes
