"""Run a command in a sandbox, within limits, and get one file back.

Bubblewrap sets the sandbox up (:mod:`labcourse.grading.isolation.bubblewrap`). The trusted side, here, starts it,
watches clock and bytes, kills it from outside and reads the file when everything inside is dead. The order matters:

1. Bubblewrap starts a launcher, a shell of our own, as the sandbox's first process. It prints a line, and waits.
2. From outside we take hold of the working folder, which keeps it when all inside have died, and limit the launcher.
3. The launcher becomes an unprivileged user where we are root; prints a line; waits again.
4. Told to go, it runs the command. Had the grader died by now, its pipe would have ended and the launcher with it.

The sandbox's first process dies with bubblewrap, and bubblewrap with the thread that called; and with the first process
of a process namespace, the kernel kills all others and waits for their end. One gap is bubblewrap's own: killed with
the grader in its first milliseconds, it can leave a process that waits forever and starts nothing
(https://github.com/containers/bubblewrap/issues/633).
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, cgroups, remedies, seccomp
from labcourse.grading.isolation.bubblewrap import HOME, WORK, python
from labcourse.grading.isolation.outcome import Ending, Limits, Outcome, read_others, read_wanted
from labcourse.grading.isolation.pipes import ProcessPipes

__all__ = ["HOME", "WORK", "Ending", "Limits", "Outcome", "python", "run"]

NO_VARIABLES: Mapping[str, str] = MappingProxyType({})
NO_FILES: Mapping[str, int] = MappingProxyType({})
_READY, _GO = b"ready\n", b"go\n"
# The first shell stays, as the namespace's first process: it reaps orphans, and its end is everybody's.
_WAIT = 'echo ready; read -r word && [ "$word" = go ] || exit 1; '
_LAUNCHER = "umask 022; " + _WAIT + '"$@"; exit $?'
_DROPPED = _WAIT + 'exec "$@"'
_NAMESPACES = ("mnt", "pid", "net", "ipc", "uts")  # whatever bubblewrap says, the sandbox must have its own
_START_TIMEOUT, _END_TIMEOUT = 60.0, 60.0  # s; more than any machine that is alive should need
_MAX_STARTUP_OUTPUT = 65536  # bytes of what bubblewrap complains of


class _Cancelled(Exception):
    """Given up before the command was run."""


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
    """Run a command isolated, and get a file that it leaves, or several.

    It starts in an empty working folder (:data:`WORK`), with a home (:data:`HOME`) that is empty, too. When it ends,
    all that it has started is ended.

    Parameters
    ----------
    command : program, by its path or a name to be found in the sandbox, and its arguments
    visible : absolute paths of what is shown read-only, besides the system and the Python environment. Nothing in them
        may be a socket or a pipe of the outside: these can be used through a read-only view.
    wanted : name of the file in the working folder
    largest : bytes that it may have
    also : further such files, which may be missing: name → bytes that it may have
    stdin : standard input
    environment : variables, besides PATH, HOME, TMPDIR, LANG and USER
    limits : on what it uses
    cancelled : set from another thread to give up

    Returns
    -------
    How it ended, and the file, however it ended. An exit status of 128 + n is taken for the signal n, as by shells.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up; the command is not run, then.
    """
    if not sys.platform.startswith("linux"):
        raise IsolationError(
            f"Isolation needs Linux; this is {sys.platform}.", "operating system", remedies.of_platform()
        )
    for name in (wanted, *also):
        if not name or os.sep in name or name in (".", ".."):
            raise IsolationError(f"The wanted file's name must be a plain one, not {name!r}.", "files")
    if any("\0" in word for word in [*command, *map(str, visible), *environment, *environment.values()]):
        raise IsolationError("A variable, a path or the command has a NUL character in it.", "files")
    user = bubblewrap.sandbox_user()
    variables = {**bubblewrap.default_environment(), **environment}
    cancelled = cancelled or threading.Event()
    inside = [*bubblewrap.setpriv_prefix(user), "/bin/sh", "-c", _DROPPED, "sh", *command]
    with contextlib.ExitStack() as stack:
        files = {
            path: stack.enter_context(_memfd(text.encode())) for path, text in bubblewrap.synthetic_files(user).items()
        }
        args = bubblewrap.arguments(user, visible, variables, limits, files)
        groups = stack.enter_context(cgroups.limited_groups(limits, cgroups.parent_groups()))
        box = stack.enter_context(_Sandbox(args, inside, list(files.values())))
        try:
            box.wait_until_ready(cancelled)
            active_layers = box.limit(limits, groups)
            box.drop_privileges(cancelled)
        except _Cancelled:
            return Outcome(Ending.CANCELLED, None, None, "", b"", 0.0)
        started = time.monotonic()
        ending = box.run_command(stdin, limits, cancelled)
        seconds = time.monotonic() - started
        code = box.end()
        file, trouble = read_wanted(box.folder, wanted, largest)
        others = read_others(box.folder, also)
        output = bytes(box.pipes.output[: limits.output])
    code_then = code if ending is Ending.FINISHED else None
    return Outcome(ending, code_then, file, trouble, output, seconds, active_layers, others)


class _Sandbox:
    """A running bubblewrap, from its start to the end of everything in it (a ``with`` block)."""

    def __init__(self, args: Sequence[str], inside: Sequence[str], files: Sequence[int]) -> None:
        self._args, self._inside, self._files = args, inside, files
        self._init_pidfd: int | None = None  # descriptor of the sandbox's first process
        self._init_pid = 0  # its number
        self.folder = -1

    def __enter__(self) -> _Sandbox:
        program = shutil.which("bwrap")
        if program is None:
            raise IsolationError("Bubblewrap (bwrap) is not installed.", "bubblewrap", remedies.INSTALL)
        filtering = seccomp.program(os.uname().machine)
        self._filtered = filtering is not None
        with contextlib.ExitStack() as stack:
            passed, args = list(self._files), list(self._args)
            if filtering is not None:
                passed.append(stack.enter_context(_memfd(filtering)))
                args += ["--seccomp", str(passed[-1])]
            # In a file, for nobody else on this machine to read in the list of processes.
            passed.append(stack.enter_context(_memfd("\0".join([*args, ""]).encode())))
            command = [program, "--args", str(passed[-1]), "--", "/bin/sh", "-c", _LAUNCHER, "sh", *self._inside]
            try:
                self.process = subprocess.Popen(
                    command,
                    bufsize=0,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    pass_fds=passed,
                    cwd="/",
                )
            except OSError as error:
                raise IsolationError(f"Bubblewrap cannot be started: {error.strerror}.", "bubblewrap") from error
        self.pipes = ProcessPipes(self.process, _MAX_STARTUP_OUTPUT)
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.end()
        finally:
            self.pipes.close()
            for descriptor in (self.folder, self._init_pidfd):
                if descriptor not in (None, -1):
                    os.close(descriptor)

    def wait_until_ready(self, cancelled: threading.Event) -> None:
        """Wait until the sandbox is set up, and take hold of the working folder and of the first process."""
        self._await_ready(cancelled)
        try:
            self._init_pid = _child_of(self.process.pid)
            self._init_pidfd = os.pidfd_open(self._init_pid)
            shared = [kind for kind in _NAMESPACES if _namespace(self._init_pid, kind) == _namespace("self", kind)]
            if shared:
                raise IsolationError(f"The sandbox shares namespaces with us: {', '.join(shared)}.", "namespaces")
            self.folder = os.open(f"/proc/{self._init_pid}/root{WORK}", os.O_RDONLY | os.O_DIRECTORY)
        except (ValueError, OSError) as error:
            raise IsolationError(
                f"The sandbox cannot be reached from outside: {error}.", "file system", remedies.of_namespaces()
            ) from error

    def limit(self, limits: Limits, groups: cgroups.Groups) -> tuple[str, ...]:
        """Limit the first process, and so all that it starts; which optional layers are active."""
        import resource

        processors = os.cpu_count() or 1
        wanted = {
            resource.RLIMIT_AS: limits.memory,
            resource.RLIMIT_FSIZE: limits.file_size,
            resource.RLIMIT_NOFILE: limits.open_files,
            resource.RLIMIT_NPROC: limits.processes
            + (0 if bubblewrap.is_root() else 2),  # the two shells are the same user
            resource.RLIMIT_CPU: math.ceil(limits.seconds * processors) + 60,  # a backstop: the clock comes first
            # Not 0, with which a core file would still go to a program outside (man 5 core).
            resource.RLIMIT_CORE: 1,
            resource.RLIMIT_MSGQUEUE: 0,
            resource.RLIMIT_MEMLOCK: 0,
        }
        try:
            for kind, value in wanted.items():
                _, hard = resource.prlimit(self._init_pid, kind)
                most = value if hard == resource.RLIM_INFINITY else min(value, hard)
                resource.prlimit(self._init_pid, kind, (most, most))
        except (OSError, ValueError) as error:
            raise IsolationError(f"The sandbox cannot be limited: {error}.", "limits") from error
        return (*groups.add(self._init_pid), *(("system calls",) if self._filtered else ()))

    def drop_privileges(self, cancelled: threading.Event) -> None:
        """Let the launcher become who is to run the command."""
        self.pipes.send(_GO)
        self._await_ready(cancelled)

    def run_command(self, stdin: bytes, limits: Limits, cancelled: threading.Event) -> Ending:
        """Let it run the command, until it ends or must be ended."""
        self.pipes.max_output = limits.output
        self.pipes.send(_GO + stdin, last=True)
        ending = self.pipes.exchange_until(time.monotonic() + limits.seconds, cancelled)
        assert ending is not None
        return ending

    def end(self) -> int:
        """Kill all that is inside, wait until it is gone, and return the exit status (minus the signal).

        Raises
        ------
        IsolationError
            If something does not go away.
        """
        if (
            self._init_pidfd is None
        ):  # the end of its input ends it; killed at a bad moment, it could leave a child behind
            self.pipes.close_input()
        else:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._init_pidfd, signal.SIGKILL)
        try:
            code = self.process.wait(timeout=_END_TIMEOUT)
            if self._init_pidfd is not None and not _has_ended(self._init_pidfd, _END_TIMEOUT):
                raise subprocess.TimeoutExpired("bwrap", _END_TIMEOUT)
        except subprocess.TimeoutExpired as error:
            self.process.kill()
            raise IsolationError(
                f"What runs in the sandbox was killed and does not end (process {self._init_pid}).",
                "processes",
                "Look at it with ps; restart this machine if it stays.",
            ) from error
        return 128 - code if 128 < code <= 128 + signal.NSIG else code

    def _await_ready(self, cancelled: threading.Event) -> None:
        ending = self.pipes.exchange_until(
            time.monotonic() + _START_TIMEOUT, cancelled, lambda output: output.endswith(_READY)
        )
        if ending is Ending.CANCELLED:
            raise _Cancelled
        message = self.pipes.output.decode(errors="replace").strip()
        if ending is not None:
            layer, remedy = remedies.explain(message)
            raise IsolationError(f"The sandbox cannot be put up: {message or ending.value}.", layer, remedy)
        self.pipes.output.clear()


def _child_of(parent: int) -> int:
    """The only child of a process. (Bubblewrap would report it (--info-fd), but can be killed while it does.)"""
    with contextlib.suppress(FileNotFoundError):  # an option of the kernel's
        return int(Path(f"/proc/{parent}/task/{parent}/children").read_text("ascii"))
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # some end meanwhile
            if int(stat.read_text("ascii", "replace").rpartition(")")[2].split()[1]) == parent:
                return int(stat.parent.name)
    raise ProcessLookupError("it has no first process")


def _namespace(process: int | str, kind: str) -> str:
    return os.readlink(f"/proc/{process}/ns/{kind}")


def _has_ended(process: int, seconds: float) -> bool:
    """Whether a process (its descriptor) ends within this time."""
    poll = select.poll()
    poll.register(process, select.POLLIN)
    return bool(poll.poll(seconds * 1000))


@contextlib.contextmanager
def _memfd(data: bytes) -> Iterator[int]:
    """A descriptor from which to read this, without a file system."""
    try:
        descriptor = os.memfd_create("labcourse")
    except OSError as error:
        raise IsolationError(
            f"Bubblewrap cannot be told what to do: memfd_create: {error.strerror}.",
            "bubblewrap",
            remedies.of_namespaces(),
        ) from None
    try:
        os.write(descriptor, data)
        os.lseek(descriptor, 0, os.SEEK_SET)
        yield descriptor
    finally:
        os.close(descriptor)
