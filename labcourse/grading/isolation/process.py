"""A running command: the limits on it, its pipes, how it ended, and the files that it left."""

from __future__ import annotations

import contextlib
import errno
import os
import selectors
import stat
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from labcourse.errors import IsolationError

MIB = 2**20
_POLL_INTERVAL = 0.1  # s; how often the clock and the event that cancels the run are checked
_CHUNK = 65536  # bytes: what a pipe holds


@dataclass(frozen=True)
class Limits:
    """What a command may use.

    Attributes
    ----------
    seconds : wall time, from its start
    memory : bytes of address space of each process; with control groups also bytes of memory of all together
    processes : at a time, threads included
    file_size : bytes of each file that it writes; twice what all files of a student may have
    folder : bytes of all that it writes
    output : bytes of standard output and standard error together
    open_files : of each process
    """

    seconds: float = 600.0
    memory: int = 2048 * MIB
    processes: int = 100
    file_size: int = 64 * MIB
    folder: int = 256 * MIB
    output: int = MIB
    open_files: int = 256


class Ending(Enum):
    """How a run ended."""

    FINISHED = "finished"  # by itself, with any exit status
    DEADLINE = "deadline"  # it took too long
    OUTPUT = "output"  # it wrote too much
    CANCELLED = "cancelled"  # the caller cancelled it


@dataclass(frozen=True)
class Outcome:
    """What came back from a command.

    Attributes
    ----------
    ending : how the run ended
    code : exit status, or minus the signal that ended it; None if the command was killed from outside
    files : name → content of the wanted files that could be read
    troubles : name → why it could not be read, of the wanted files that exist and could not
    output : standard output and standard error, up to the limit; untrusted bytes
    seconds : duration of the run
    """

    ending: Ending
    code: int | None
    files: Mapping[str, bytes]
    troubles: Mapping[str, str]
    output: bytes
    seconds: float


class Cancelled(Exception):
    """The run was cancelled before the command was run."""


def start(command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
    """Start a process with pipes for :class:`ProcessPipes`; the options are those of Popen."""
    return subprocess.Popen(
        command, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options
    )


def check_names(wanted: Iterable[str]) -> None:
    """Raise IsolationError if the name of a file to read is no plain one: it might lead out of the working folder."""
    for name in wanted:
        if not name or os.sep in name or "\0" in name or name in (".", ".."):
            raise IsolationError(f"A wanted file's name must be a plain one, not {name!r}.", "files")


def read_files(folder: int, wanted: Mapping[str, int]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Read the files that a command left. Call it when every process that could change them has ended.

    Parameters
    ----------
    folder : descriptor of the working folder
    wanted : name of each file → the bytes that it may have

    Returns
    -------
    dict
        Name → content of the files that could be read.
    dict
        Name → why it could not be read, of those that exist and could not.
    """
    files, troubles = {}, {}
    for name, most in wanted.items():
        try:
            files[name] = _read_file(folder, name, most)
        except FileNotFoundError:
            continue
        except OSError as error:
            troubles[name] = error.strerror or type(error).__name__
    return files, troubles


def _read_file(folder: int, name: str, most: int) -> bytes:
    """Read a file of the working folder; parameters as for :func:`read_files`.

    Raises
    ------
    OSError
        If it is missing, has too many bytes, or is no ordinary file: untrusted code may have left a link or a pipe.
    """
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY, dir_fd=folder)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is not an ordinary file")
        with open(descriptor, "rb", closefd=False) as file:
            data = file.read(most + 1)
    finally:
        os.close(descriptor)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes")
    return data


class ProcessPipes:
    """Feed and read a process of :func:`start`.

    Nothing here blocks, whether or not the process reads its input, and whatever it writes.

    Parameters
    ----------
    process : from :func:`start`
    max_output : bytes that it may write

    Attributes
    ----------
    output : what the process has written so far
    max_output : bytes that it may write
    """

    def __init__(self, process: subprocess.Popen[bytes], max_output: int) -> None:
        assert process.stdin is not None and process.stdout is not None
        self.process, self.output, self.max_output = process, bytearray(), max_output
        self._stdin, self._stdout = process.stdin, process.stdout
        self._to_send, self._end_input_after = memoryview(b""), False
        os.set_blocking(self._stdin.fileno(), False)
        os.set_blocking(self._stdout.fileno(), False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._stdout, selectors.EVENT_READ)

    def send(self, data: bytes, last: bool = False) -> None:
        """Begin to send data to the process, once earlier data are sent. After the ``last`` data, its input ends."""
        self._to_send, self._end_input_after = memoryview(data), last
        if data:
            self._selector.register(self._stdin, selectors.EVENT_WRITE)
        elif last:
            self.close_input()

    def exchange_until(
        self, deadline: float, cancelled: threading.Event, ready: Callable[[bytearray], bool] = lambda output: False
    ) -> Ending | None:
        """Exchange data until the process ends, must be ended, or has written what the caller waits for.

        Parameters
        ----------
        deadline : when it must be ended, by the monotonic clock, s
        cancelled : set from another thread to give up
        ready : function of the output so far: whether the caller need not wait any more

        Returns
        -------
        Ending or None
            How the process ended, or why it must be ended; None if its output is ``ready``.
        """
        while not ready(self.output):
            ended = self.process.poll() is not None
            while ended and len(self.output) <= self.max_output and self._stdout in self._selector.get_map():
                if not self._read_output():  # other processes may still hold the pipe: do not wait for them
                    break
            if len(self.output) > self.max_output:
                return Ending.OUTPUT
            if ended:
                return Ending.FINISHED
            if cancelled.is_set():
                return Ending.CANCELLED
            if (left := deadline - time.monotonic()) <= 0:
                return Ending.DEADLINE
            self._exchange(min(left, _POLL_INTERVAL))
        return None

    def close_input(self) -> None:
        """End the input of the process."""
        with contextlib.suppress(KeyError, ValueError):  # not registered, or closed before
            self._selector.unregister(self._stdin)
        self._stdin.close()

    def close(self) -> None:
        """Close both pipes."""
        self._selector.close()
        self._stdin.close()
        self._stdout.close()

    def _exchange(self, wait: float) -> None:
        """Wait up to so many seconds until data can be exchanged, and exchange a chunk; or until the process ends."""
        if not self._selector.get_map():  # the process has closed its output: only wait for its end
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=wait)
            return
        for key, _events in self._selector.select(timeout=wait):
            if key.fileobj is self._stdin:
                self._write_input()
            else:
                self._read_output()

    def _write_input(self) -> None:
        """Write the next chunk to the process, and end its input after the last one."""
        try:
            sent = self._stdin.write(self._to_send[:_CHUNK]) or 0
        except BrokenPipeError:  # the process does not read the rest
            sent, self._end_input_after = len(self._to_send), True
        self._to_send = self._to_send[sent:]
        if not self._to_send:
            self._selector.unregister(self._stdin)
            if self._end_input_after:
                self._stdin.close()

    def _read_output(self) -> bool:
        """Read a chunk of what the process has written, without waiting. Return whether there was any data."""
        data = self._stdout.read(_CHUNK)
        self.output += data or b""
        if data == b"":  # the end of the output; None would mean: nothing yet
            self._selector.unregister(self._stdout)
        return bool(data)
