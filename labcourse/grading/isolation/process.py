"""A running command: the limits on it, its pipes, how it ended, and the files that it left."""

from __future__ import annotations

import contextlib
import os
import selectors
import stat
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import Any

from labcourse.errors import IsolationError

MIB = 2**20
NO_VARIABLES: Mapping[str, str] = MappingProxyType({})  #: default of an environment
NO_FILES: Mapping[str, int] = MappingProxyType({})  #: default of the further files to read
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
    file : content of the wanted file; None if it is missing or cannot be read
    trouble : why the file cannot be read; "" if it was read, or is missing
    output : standard output and standard error, up to the limit; untrusted bytes
    seconds : duration of the run
    layers : optional isolation layers that were active
    others : further files that were asked for: name → content, for those that exist and can be read
    """

    ending: Ending
    code: int | None
    file: bytes | None
    trouble: str
    output: bytes
    seconds: float
    layers: tuple[str, ...] = ()
    others: Mapping[str, bytes] = field(default_factory=dict)


class Cancelled(Exception):
    """The run was cancelled before the command was run."""


def start(command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
    """Start a process with pipes for :class:`ProcessPipes`; the options are those of Popen."""
    return subprocess.Popen(
        command, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options
    )


def check_names(wanted: str, further: Mapping[str, int]) -> None:
    """Check that the files to read from the working folder have plain names.

    Parameters
    ----------
    wanted : name of the wanted file
    further : name of each further file → bytes that it may have

    Raises
    ------
    IsolationError
        If a name is empty or leads out of the working folder.
    """
    for name in (wanted, *further):
        if not name or os.sep in name or "\0" in name or name in (".", ".."):
            raise IsolationError(f"The wanted file's name must be a plain one, not {name!r}.", "files")


def read_files(
    folder: int, wanted: str, largest: int, further: Mapping[str, int]
) -> tuple[bytes | None, str, dict[str, bytes]]:
    """Read the files that a command left. Call it when every process that could change them has ended.

    Parameters
    ----------
    folder : descriptor of the working folder
    wanted, largest : name of the wanted file, and the bytes that it may have
    further : further files: name → bytes that it may have

    Returns
    -------
    bytes or None
        Content of the wanted file; None if it is missing or cannot be read.
    str
        Why it cannot be read; "" if it was read, or is missing.
    dict
        Further files that can be read: name → content.
    """
    file, trouble = _read_file(folder, wanted, largest)
    others = {name: _read_file(folder, name, most)[0] for name, most in further.items()}
    return file, trouble, {name: data for name, data in others.items() if data is not None}


def _read_file(folder: int, name: str, largest: int) -> tuple[bytes | None, str]:
    """Read a file of the working folder; only an ordinary file, as untrusted code may have left a link or a pipe.

    Returns
    -------
    bytes or None
        Content; None if the file is missing or cannot be read.
    str
        Why it cannot be read; "" if it was read, or is missing.
    """
    try:
        descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY, dir_fd=folder)
    except FileNotFoundError:
        return None, ""
    except OSError as error:
        return None, f"cannot be read: {error.strerror}"
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return None, "is not an ordinary file"
        with open(descriptor, "rb", closefd=False) as file:
            data = file.read(largest + 1)
    finally:
        os.close(descriptor)
    return (data, "") if len(data) <= largest else (None, f"has more than {largest} bytes")


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
        """Begin to send data to the process. If it is the ``last``, the input of the process ends after it."""
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
        deadline : time of the monotonic clock, s
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
        """Exchange the data that can be exchanged within ``wait`` seconds."""
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
        """Read a chunk of what the process has written. Return whether there was any data."""
        data = self._stdout.read(_CHUNK)
        self.output += data or b""
        if data == b"":  # the end of the output; None would mean: nothing yet
            self._selector.unregister(self._stdout)
        return bool(data)
