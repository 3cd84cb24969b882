"""Ways by which a cell's outputs leave it: messages, streams, widgets' comms, and what is written past Python.

They are those of a kernel, but for the socket: each message goes to one function in the same process.
"""

from __future__ import annotations

import contextvars
import io
import os
import threading
import time
from collections.abc import Callable
from typing import Any

from jupyter_client.session import Session

Message = dict[str, Any]
Hear = Callable[[Message], None]

_FLUSH_INTERVAL = 0.2  # s; a kernel sends its streams that often
_DRAINED = 1.0  # s to wait at most for what was written to a descriptor


class Channel(Session):
    """A kernel's session that hands its messages to a function; without one, nobody listens."""

    hear: Hear | None = None

    def send(  # type: ignore[override]
        self,
        stream: object,
        msg_or_type: Message | str,
        content: Message | None = None,
        parent: Message | None = None,
        ident: object = None,
        buffers: list[bytes] | None = None,
        track: bool = False,
        header: Message | None = None,
        metadata: Message | None = None,
    ) -> Message:
        """Hand over a message. From a process forked by a cell nothing goes out, as from a kernel."""
        message = msg_or_type
        if isinstance(message, str):
            message = self.msg(message, content=content, parent=parent, header=header, metadata=metadata)
        if self.hear is not None and os.getpid() == self.pid:
            # As if it had been sent: plain data, nothing that the cell could still change.
            message["content"] = self.unpack(self.pack(message["content"]))
            message["buffers"] = list(buffers or [])
            self.hear(message)
        return message


class Stream(io.TextIOBase):
    """``sys.stdout`` or ``sys.stderr`` of a kernel."""

    encoding = "UTF-8"

    def __init__(self, channel: Channel, name: str, descriptor: int, siblings: list[Stream]) -> None:
        self.channel, self.name, self._descriptor, self._siblings = channel, name, descriptor, siblings
        self._pending: list[tuple[Message, str]] = []
        self._since = 0.0
        self._lock = threading.RLock()
        self._parent: contextvars.ContextVar[Message] = contextvars.ContextVar("parent")
        self._last_parent: Message = {}
        siblings.append(self)

    def set_parent(self, parent: Message) -> None:
        """Say which cell's output it is from now on; threads, which have no context, follow the last one."""
        self._last_parent = parent["header"]
        self._parent.set(parent["header"])

    def fileno(self) -> int:
        """Where other processes may write, as a kernel's terminal."""
        return self._descriptor

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return False

    def write(self, string: str) -> int:
        if not isinstance(string, str):
            raise TypeError(f"write() argument must be str, not {type(string)}")
        if self.channel.hear is not None:
            if any(stream._overdue() for stream in self._siblings):
                for stream in self._siblings:
                    stream.flush()
            with self._lock:
                if not self._pending:
                    self._since = time.monotonic()
                self._pending.append((self._parent.get(self._last_parent), string))
        return len(string)

    def flush(self) -> None:
        with self._lock:
            pending, self._pending = self._pending, []
        texts: list[tuple[Message, list[str]]] = []
        for parent, text in pending:
            if not texts or texts[-1][0] is not parent:
                texts.append((parent, []))
            texts[-1][1].append(text)
        for parent, pieces in texts:
            self.channel.send(None, "stream", {"name": self.name, "text": "".join(pieces)}, parent={"header": parent})

    def _overdue(self) -> bool:
        return bool(self._pending) and time.monotonic() - self._since > _FLUSH_INTERVAL


class Descriptor:
    """What is written to a descriptor itself, by C code or by another process, goes into a stream, too."""

    def __init__(self, number: int, stream: Stream) -> None:
        self._number, self._stream = number, stream
        self._reading, writing = os.pipe()
        os.dup2(writing, number)
        os.close(writing)
        self._token, self._drained = b"\0" + os.urandom(16) + b"\0", threading.Event()
        threading.Thread(target=self._read, daemon=True).start()

    def drain(self) -> None:
        """Wait until all that was written so far has arrived."""
        self._drained.clear()
        try:
            os.write(self._number, self._token)
        except OSError:
            return  # the cell has closed it
        self._drained.wait(_DRAINED)

    def _read(self) -> None:
        kept = b""
        while data := os.read(self._reading, 65536):
            before, token, after = (kept + data).partition(self._token)
            # A part of the token may be all that has come of it.
            lengths = () if token else range(len(self._token), 0, -1)
            cut = next((length for length in lengths if before.endswith(self._token[:length])), 0)
            kept = before[len(before) - cut :] if cut else b""
            text = before[: len(before) - cut] + after
            if text:
                self._stream.write(text.decode(errors="replace"))
            if token:
                self._drained.set()
