"""The ways by which a cell's output would leave it, without an end: messages to a front end, and the streams."""

from __future__ import annotations

import io
from typing import Any

from jupyter_client.session import Session

Message = dict[str, Any]


class MutedSession(Session):
    """A kernel's session that makes messages and sends none."""

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
        """Return what would have been sent."""
        if isinstance(msg_or_type, str):
            return self.msg(msg_or_type, content=content, parent=parent, header=header, metadata=metadata)
        return msg_or_type


class MutedStream(io.TextIOBase):
    """``sys.stdout`` or ``sys.stderr``, as a kernel's behaves, save that nothing comes of what is written."""

    encoding = "UTF-8"

    def __init__(self, name: str, descriptor: int) -> None:
        self.name, self._descriptor = name, descriptor

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
        return len(string)

    def flush(self) -> None:
        """Nothing is kept back."""
