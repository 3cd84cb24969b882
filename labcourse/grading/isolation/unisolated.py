"""Run a command without isolation, for those who trust it: the same call as the sandbox.

What is held to: the deadline, the bytes that it writes and leaves, a folder of its own, an environment with nothing of
ours in it, and that what it started ends with it, as far as it can be found. It has the rights of whoever calls;
memory, processes and files are not limited.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import psutil  # type: ignore[import-untyped]

from labcourse.errors import IsolationError
from labcourse.grading.isolation import remedies
from labcourse.grading.isolation.bubblewrap import python
from labcourse.grading.isolation.outcome import Ending, Limits, Outcome, read_others, read_wanted
from labcourse.grading.isolation.pipes import ProcessPipes
from labcourse.grading.isolation.sandbox import NO_FILES, NO_VARIABLES

_TOKEN = "LABCOURSE_RUN"  # environment variable by which a run's processes are known
_ROUNDS = 100  # a process that forks faster than this is for the sandbox


def run(
    command: Sequence[str],
    *,
    visible: Sequence[Path],
    wanted: str,
    largest: int,
    also: Mapping[str, int] = NO_FILES,
    stdin: bytes = b"",
    environment: Mapping[str, str] = NO_VARIABLES,
    limits: Limits = Limits(),  # noqa: B008 (it cannot be changed)
    cancelled: threading.Event | None = None,
) -> Outcome:
    """Run a command with our own rights, and get a file that it leaves.

    Takes and returns what :func:`labcourse.grading.isolation.sandbox.run` does. All files are visible, whatever
    ``visible`` says; of the limits, ``seconds`` and ``output`` hold.

    Raises
    ------
    IsolationError
        For root, whose rights no untrusted command may have; and where there are no process groups (Windows).
    """
    del visible
    _refuse_root()
    token = secrets.token_hex(16)
    with _scratch() as scratch:
        work, home = scratch / "work", scratch / "home"
        for folder in (work, home):
            folder.mkdir()
        # Held open: should the command put another folder in its place, the file is still sought here.
        opened = os.open(work, os.O_RDONLY | os.O_DIRECTORY)
        try:
            process = subprocess.Popen(
                command,
                bufsize=0,
                cwd=work,
                env={**_variables(home), **environment, _TOKEN: token},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            pipes = ProcessPipes(process, limits.output)
            started = time.monotonic()
            try:
                pipes.send(stdin, last=True)
                ending = pipes.exchange_until(started + limits.seconds, cancelled or threading.Event())
                seconds = time.monotonic() - started
            finally:
                _end_all(process, token)
                pipes.close()
            file, trouble = read_wanted(opened, wanted, largest)
            others = read_others(opened, also)
        finally:
            os.close(opened)
    assert ending is not None
    code = process.returncode if ending is Ending.FINISHED else None
    return Outcome(ending, code, file, trouble, bytes(pipes.output[: limits.output]), seconds, (), others)


def _refuse_root() -> None:
    if os.name != "posix":
        raise IsolationError("A run cannot be watched and ended here.", "operating system", remedies.of_platform())
    if os.geteuid() == 0:
        raise IsolationError(
            "Root does not run students' code without isolation: with its rights it could do anything at all.",
            "user",
            "Grade in isolation, or as a user made for it who owns nothing of value.",
        )


def _variables(home: Path) -> dict[str, str]:
    path = os.pathsep.join([str(python().parent), os.defpath])
    return {"PATH": path, "HOME": str(home), "TMPDIR": str(home), "LANG": "C.UTF-8"}


@contextlib.contextmanager
def _scratch() -> Iterator[Path]:
    """A temporary folder. It is removed by rm, to which neither depth nor odd names in it matter."""
    folder = Path(tempfile.mkdtemp(prefix="labcourse-run-")).resolve()
    try:
        yield folder
    finally:
        for command in (["chmod", "-R", "u+rwX"], ["rm", "-rf"]):
            subprocess.run([*command, "--", str(folder)], capture_output=True, check=False)


def _end_all(process: subprocess.Popen[bytes], token: str) -> None:
    """Kill the process group, and every process that bears the run's token.

    What it starts may leave the group; the environment that it was born with stays.
    """
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    for _ in range(_ROUNDS):
        found = _with_token(token)
        if not found:
            return
        for one in found:
            with contextlib.suppress(psutil.Error):
                one.kill()
        psutil.wait_procs(found, timeout=1)


def _with_token(token: str) -> list[psutil.Process]:
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if process.environ().get(_TOKEN) == token and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found
