"""Run a command in a sandbox, within limits, and get the files back that it leaves.

Bubblewrap sets the sandbox up (:mod:`labcourse.grading.isolation.bubblewrap`). The trusted side, here, starts it,
watches clock and bytes, kills it from outside, and reads the files when everything inside is dead. The order matters:

1. Bubblewrap starts a launcher, a shell of our own, as the first process of the sandbox. It prints a line, and waits.
2. From outside we open the working folder, which keeps it when all inside have died, and limit the launcher.
3. The launcher becomes an unprivileged user where we are root, prints a line, and waits again.
4. When it reads ``go``, it runs the command. If the grader has died by now, its pipe has ended, and the launcher ends.

The first process of the sandbox dies with bubblewrap, and bubblewrap with the thread that called; and when the first
process of a process namespace ends, the kernel kills all others and waits for their end. One gap is bubblewrap's: if it
is killed with the grader in its first milliseconds, it can leave a process that waits forever and starts nothing
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
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from threading import Event

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, cgroups, process, seccomp
from labcourse.grading.isolation.bubblewrap import HOME, WORK, python
from labcourse.grading.isolation.process import Ending, Limits, Outcome
from labcourse.grading.isolation.unisolated import Unisolated, unisolated

__all__ = ["HOME", "WORK", "Ending", "Limits", "Outcome", "python", "run"]

_READY, _GO = b"ready\n", b"go\n"  # what the launcher prints and reads
_WAIT = 'echo ready; read -r word && [ "$word" = go ] || exit 1; '
# The first shell stays, as the namespace's first process: it reaps orphans, and all others end with it.
_LAUNCHER = "umask 022; " + _WAIT + '"$@"; exit $?'
# The second shell has the rights of the user that runs the command, and becomes the command.
_UNPRIVILEGED_LAUNCHER = _WAIT + 'exec "$@"'
_NAMESPACES = ("mnt", "pid", "net", "ipc", "uts")  # must not be shared with the sandbox; bubblewrap is not trusted
_START_TIMEOUT, _END_TIMEOUT = 60.0, 60.0  # s; more than any working machine should need
_MAX_STARTUP_OUTPUT = 65536  # bytes of bubblewrap's own messages


def run(
    command: Sequence[str],
    *,
    visible: Sequence[Path],
    wanted: Mapping[str, int],
    stdin: bytes = b"",
    environment: Mapping[str, str] | None = None,
    limits: Limits = Limits(),  # noqa: B008 (it cannot be changed)
    cancelled: Event | None = None,
    isolated: bool = True,
) -> Outcome:
    """Run a command isolated, and get the files that it leaves.

    The command starts in an empty working folder (:data:`WORK`), with an empty home (:data:`HOME`). When it ends, all
    processes that it has started are ended.

    Parameters
    ----------
    command : program, by its path or a name to be found in the sandbox, and its arguments
    visible : absolute paths to show read-only, besides the system and the Python environment. Nothing in them may be a
        socket or a pipe of the outside: these can be used through a read-only view.
    wanted : files to get from the working folder, which may be missing: name → bytes that it may have
    stdin : standard input
    environment : variables, besides PATH, HOME, TMPDIR, LANG and USER
    limits : on what the command uses
    cancelled : set from another thread to cancel the run
    isolated : False for a command that is trusted: it runs with the rights of the caller

    Returns
    -------
    Outcome
        How the run ended, and the files, however it ended (none if it was cancelled before it began). An exit status of
        128 + n is read as signal n, as by shells.

    Raises
    ------
    IsolationError
        If a wanted name is no plain file name or the sandbox cannot be set up (then the command is not run), or if a
        process in it cannot be ended. Without isolation, as :func:`.unisolated.unisolated` says.
    """
    process.check_names(wanted)
    cancelled, environment = cancelled or Event(), environment or {}
    context: contextlib.AbstractContextManager[_Sandbox | Unisolated] = (
        _sandboxed(command, visible, environment, limits, cancelled) if isolated else unisolated(command, environment)
    )
    try:
        with context as running:
            started = time.monotonic()
            running.pipes.max_output = limits.output
            running.pipes.send((_GO if isolated else b"") + stdin, last=True)
            ending = running.pipes.exchange_until(started + limits.seconds, cancelled)
            seconds = time.monotonic() - started
            code = running.end()
            files, troubles = process.read_files(running.folder, wanted)
            output = bytes(running.pipes.output[: limits.output])
    except process.Cancelled:
        return Outcome(Ending.CANCELLED, None, {}, {}, b"", 0.0)
    assert ending is not None
    return Outcome(ending, code if ending is Ending.FINISHED else None, files, troubles, output, seconds)


@contextlib.contextmanager
def _sandboxed(
    command: Sequence[str], visible: Sequence[Path], environment: Mapping[str, str], limits: Limits, cancelled: Event
) -> Iterator[_Sandbox]:
    """Set up a sandbox, with its limits and without privileges, in which a command waits for the line ``go``.

    Parameters as for :func:`run`. When the block ends, everything in the sandbox is ended.

    Raises
    ------
    IsolationError
        If the sandbox cannot be set up.
    process.Cancelled
        If the run was cancelled before the sandbox was ready.
    """
    if not sys.platform.startswith("linux"):
        raise IsolationError(
            f"Isolation needs Linux; this is {sys.platform}.", "operating system", bubblewrap.remedy_of_platform()
        )
    if any("\0" in word for word in [*command, *map(str, visible), *environment, *environment.values()]):
        raise IsolationError("A variable, a path or the command has a NUL character in it.", "files")
    uid = bubblewrap.sandbox_user()
    call_filter = seccomp.program(os.uname().machine)
    inherited: list[int] = []
    with contextlib.ExitStack() as stack:

        def file_with(data: bytes) -> int:
            """Make a file in memory that bubblewrap inherits; return its descriptor."""
            try:
                inherited.append(os.memfd_create("labcourse"))
                stack.callback(os.close, inherited[-1])
                os.pwrite(inherited[-1], data, 0)  # is read from its beginning
            except OSError as error:
                message, remedy = "Arguments cannot be passed to bubblewrap", bubblewrap.remedy_of_namespaces()
                raise IsolationError(f"{message}: memfd_create: {error.strerror}.", "bubblewrap", remedy) from None
            return inherited[-1]

        files = {path: file_with(text.encode()) for path, text in bubblewrap.synthetic_files(uid).items()}
        args = bubblewrap.arguments(uid, visible, {**bubblewrap.default_environment(), **environment}, limits, files)
        args += ["--seccomp", str(file_with(call_filter))] if call_filter is not None else []
        # Passed in a file: in the list of processes, everybody on this machine could read them. The variables may be
        # secret, so the file is in memory: nothing is written to a disk, which may also be full.
        hidden = ["--args", str(file_with("\0".join([*args, ""]).encode()))]
        unprivileged = [*bubblewrap.setpriv_prefix(uid), "/bin/sh", "-c", _UNPRIVILEGED_LAUNCHER, "sh", *command]
        groups = stack.enter_context(cgroups.limited_groups(limits, cgroups.parent_groups()))
        running = _Sandbox([*hidden, "--", "/bin/sh", "-c", _LAUNCHER, "sh", *unprivileged], inherited)
        with contextlib.closing(running):
            running.wait_until_ready(cancelled)
            running.limit(limits, groups)
            running.drop_privileges(cancelled)
            yield running


class _Sandbox:
    """A running bubblewrap, from its start to the end of everything in it.

    Parameters
    ----------
    args : of bubblewrap
    inherited : descriptors that it inherits: the files that the arguments name by number

    Attributes
    ----------
    pipes : of its processes
    folder : descriptor of the working folder

    Raises
    ------
    IsolationError
        If bubblewrap is not installed or cannot be started.
    """

    def __init__(self, args: Sequence[str], inherited: Sequence[int]) -> None:
        program = shutil.which("bwrap")
        if program is None:
            raise IsolationError("Bubblewrap (bwrap) is not installed.", "bubblewrap", bubblewrap.INSTALL)
        try:
            self._process = process.start([program, *args], pass_fds=inherited, cwd="/")
        except OSError as error:
            raise IsolationError(f"Bubblewrap cannot be started: {error.strerror}.", "bubblewrap") from error
        self.pipes = process.ProcessPipes(self._process, _MAX_STARTUP_OUTPUT)
        self.folder = self._init_pidfd = -1
        self._init_pid = 0

    def close(self) -> None:
        """End everything, and close what was open."""
        try:
            self.end()
        finally:
            self.pipes.close()
            for descriptor in {self.folder, self._init_pidfd} - {-1}:
                os.close(descriptor)

    def wait_until_ready(self, cancelled: Event) -> None:
        """Wait until the sandbox is set up, and open its working folder and a handle of its first process.

        Raises
        ------
        IsolationError
            If the sandbox cannot be set up or reached, or shares a namespace with this program.
        process.Cancelled
            If the run was cancelled.
        """
        self._await_ready(cancelled)
        try:
            self._init_pid = _child_of(self._process.pid)
            self._init_pidfd = os.pidfd_open(self._init_pid)
            shared = [kind for kind in _NAMESPACES if _namespace(self._init_pid, kind) == _namespace("self", kind)]
            if shared:
                raise IsolationError(f"The sandbox shares namespaces with us: {', '.join(shared)}.", "namespaces")
            self.folder = os.open(f"/proc/{self._init_pid}/root{WORK}", os.O_RDONLY | os.O_DIRECTORY)
        except (ValueError, OSError) as error:
            raise IsolationError(
                f"The sandbox cannot be reached from outside: {error}.",
                "file system",
                bubblewrap.remedy_of_namespaces(),
            ) from error

    def limit(self, limits: Limits, groups: Collection[Path]) -> None:
        """Limit the first process, and so all processes that it starts; then put it into control groups.

        A hard limit of the process that is lower already stays. A group that cannot take the process is passed over.

        Parameters
        ----------
        limits : on each process
        groups : folders of control groups, which limit all processes together

        Raises
        ------
        IsolationError
            If one of the limits on each process cannot be set.
        """
        import resource

        wanted = {
            resource.RLIMIT_AS: limits.memory,
            resource.RLIMIT_FSIZE: limits.file_size,
            resource.RLIMIT_NOFILE: limits.open_files,
            # An ordinary user's two shells count, too.
            resource.RLIMIT_NPROC: limits.processes + (0 if bubblewrap.is_root() else 2),
            resource.RLIMIT_CPU: math.ceil(limits.seconds * (os.cpu_count() or 1)) + 60,  # in case the clock fails
            # Not 0, with which a core file would still go to a program outside (man 5 core).
            resource.RLIMIT_CORE: 1,
            resource.RLIMIT_MSGQUEUE: 0,
            resource.RLIMIT_MEMLOCK: 0,
        }
        try:
            for kind, value in wanted.items():
                _soft, hard = resource.prlimit(self._init_pid, kind)
                most = value if hard == resource.RLIM_INFINITY else min(value, hard)
                resource.prlimit(self._init_pid, kind, (most, most))
        except (OSError, ValueError) as error:
            raise IsolationError(f"The sandbox cannot be limited: {error}.", "limits") from error
        cgroups.add(self._init_pid, groups)

    def drop_privileges(self, cancelled: Event) -> None:
        """Let the launcher become the user that runs the command, and wait until it is ready.

        Raises
        ------
        IsolationError
            If the launcher ends, or takes too long.
        process.Cancelled
            If the run was cancelled.
        """
        self.pipes.send(_GO)
        self._await_ready(cancelled)

    def end(self) -> int:
        """Kill everything inside, and wait until it is gone. A second call does no harm.

        Returns
        -------
        int
            Exit status of the command, or minus the signal that ended it.

        Raises
        ------
        IsolationError
            If a process does not end.
        """
        # Without a handle, end the input: bubblewrap ends then. Killed at a bad moment, it could leave a child behind.
        if self._init_pidfd == -1:
            self.pipes.close_input()
        else:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._init_pidfd, signal.SIGKILL)
        try:
            code = self._process.wait(timeout=_END_TIMEOUT)
            if self._init_pidfd != -1 and not _has_ended(self._init_pidfd, _END_TIMEOUT):
                raise subprocess.TimeoutExpired("bwrap", _END_TIMEOUT)
        except subprocess.TimeoutExpired as error:
            self._process.kill()
            raise IsolationError(
                f"A process in the sandbox was killed and does not end (process {self._init_pid}).",
                "processes",
                "Look at it with ps; restart this machine if it stays.",
            ) from error
        return 128 - code if 128 < code <= 128 + signal.NSIG else code

    def _await_ready(self, cancelled: Event) -> None:
        """Wait until the launcher has printed its line, and clear the output.

        Raises
        ------
        IsolationError
            If it ends, prints too much, or takes too long.
        process.Cancelled
            If the run was cancelled.
        """
        deadline = time.monotonic() + _START_TIMEOUT
        ending = self.pipes.exchange_until(deadline, cancelled, lambda output: output.endswith(_READY))
        if ending is Ending.CANCELLED:
            raise process.Cancelled
        message = self.pipes.output.decode(errors="replace").strip()
        if ending is not None:
            layer, remedy = bubblewrap.explain_failure(message)
            raise IsolationError(f"The sandbox cannot be set up: {message or ending.value}.", layer, remedy)
        self.pipes.output.clear()


def _child_of(parent: int) -> int:
    """Return the process number of the only child of a process; raise ValueError unless there is exactly one.

    Bubblewrap would report it (--info-fd), but can be killed while it does.
    """
    with contextlib.suppress(FileNotFoundError):  # not all kernels have this file
        return int(Path(f"/proc/{parent}/task/{parent}/children").read_text("ascii"))
    import psutil  # type: ignore[import-untyped]

    try:
        (child,) = psutil.Process(parent).children()
    except psutil.Error as error:
        raise ValueError(str(error)) from None
    return int(child.pid)


def _namespace(pid: int | str, kind: str) -> str:
    """Return the identity of a process's namespace of a kind ("net"), as "net:[4026531840]"; pid may be "self"."""
    return os.readlink(f"/proc/{pid}/ns/{kind}")


def _has_ended(pidfd: int, seconds: float) -> bool:
    """Wait for the end of a process, by its handle. Return whether it ended within so many seconds."""
    poll = select.poll()
    poll.register(pidfd, select.POLLIN)
    return bool(poll.poll(seconds * 1000))
