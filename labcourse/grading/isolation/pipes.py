"""Feed a running command its input, read its output, and notice its end: never waiting for it."""

from __future__ import annotations

import contextlib
import os
import selectors
import subprocess
import threading
import time
from collections.abc import Callable

from labcourse.grading.isolation.outcome import Ending

_LOOK = 0.1  # s; how often the clock, and the word to give up, are looked at
_CHUNK = 65536  # bytes: what a pipe holds


class ProcessPipes:
    """The pipes of a process that was started with ``stdin=PIPE, stdout=PIPE, stderr=STDOUT``.

    Nothing here blocks, whether or not the process reads its input and whatever it writes.
    """

    def __init__(self, process: subprocess.Popen[bytes], max_output: int) -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self.process = process
        self.output = bytearray()
        self.max_output = max_output
        self._to_send = memoryview(b"")
        self._last = False
        self._stdin, self._stdout = process.stdin, process.stdout
        for pipe in (self._stdin, self._stdout):
            os.set_blocking(pipe.fileno(), False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._stdout, selectors.EVENT_READ)

    def send(self, data: bytes, last: bool = False) -> None:
        """Go on to send this; after the ``last``, the process's input ends."""
        self._to_send, self._last = memoryview(data), last
        if data:
            self._selector.register(self._stdin, selectors.EVENT_WRITE)
        elif last:
            self._stdin.close()

    def exchange(self, wait: float) -> None:
        """Exchange what can be exchanged within ``wait`` seconds."""
        if not self._selector.get_map():  # it has closed its output: only its end is left to wait for
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=wait)
            return
        for key, _ in self._selector.select(timeout=wait):
            if key.fileobj is self._stdin:
                self._write()
            else:
                self._read()

    def exchange_until(
        self, deadline: float, cancelled: threading.Event, enough: Callable[[bytearray], bool] | None = None
    ) -> Ending | None:
        """Exchange until the process ends, writes too much, must be ended, or has written ``enough`` (then: None)."""
        while True:
            if enough is not None and enough(self.output):
                return None
            if len(self.output) > self.max_output:
                return Ending.OUTPUT
            if self.process.poll() is not None:
                self._drain()
                return Ending.OUTPUT if len(self.output) > self.max_output else Ending.FINISHED
            if cancelled.is_set():
                return Ending.CANCELLED
            if (left := deadline - time.monotonic()) <= 0:
                return Ending.DEADLINE
            self.exchange(min(left, _LOOK))

    def close_input(self) -> None:
        """End the process's input here."""
        if not self._stdin.closed:
            with contextlib.suppress(KeyError):
                self._selector.unregister(self._stdin)
            self._stdin.close()

    def close(self) -> None:
        self._selector.close()
        for pipe in (self._stdin, self._stdout):
            with contextlib.suppress(OSError):  # input that was never taken is flushed here, in vain
                pipe.close()

    def _write(self) -> None:
        try:
            sent = os.write(self._stdin.fileno(), self._to_send[:_CHUNK])
        except BlockingIOError:
            return
        except BrokenPipeError:  # it does not read the rest
            sent, self._last = len(self._to_send), True
        self._to_send = self._to_send[sent:]
        if not self._to_send:
            self._selector.unregister(self._stdin)
            if self._last:
                self._stdin.close()

    def _read(self) -> bool:
        """Read once; whether there was something."""
        try:
            data = os.read(self._stdout.fileno(), _CHUNK)
        except BlockingIOError:
            return False
        self.output += data
        if not data:
            self._selector.unregister(self._stdout)
        return bool(data)

    def _drain(self) -> None:
        """Read what was written before the end; others that hold the pipe are not waited for."""
        while len(self.output) <= self.max_output and self._stdout in self._selector.get_map() and self._read():
            pass
