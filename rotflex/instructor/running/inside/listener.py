"""Somebody listens: nbclient's own handling of a kernel's messages, as when a real kernel had sent them."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from types import SimpleNamespace

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

from .channels import Message
from .kernel import Kernel


class Listener:
    """Puts what a kernel says into the cells of a notebook."""

    def __init__(self, notebook: NotebookNode, kernel: Kernel) -> None:
        self._client = NotebookClient(notebook, record_timing=False, log=kernel.log)
        self._client.reset_execution_trackers()
        # What output widgets send back: their front end is nbclient.
        self._answers: deque[Message] = deque()
        channel = SimpleNamespace(send=self._answers.append)
        self._client.kc = SimpleNamespace(session=kernel.session, shell_channel=channel)  # type: ignore[assignment]
        self._kernel = kernel
        self._cell: NotebookNode | None = None
        self._index = 0
        self._request = ""

    def turn_to(self, cell: NotebookNode, index: int) -> None:
        """What comes now belongs to this cell."""
        while self._answers:
            self._kernel.receive(self._answers.popleft())
        self._cell, self._index, self._request = cell, index, ""
        cell.outputs = []
        self._client.clear_before_next_output = False

    def hear(self, message: Message) -> None:
        """Take a message of the kernel; what does not answer the cell's request (a task of an earlier cell) is lost."""
        request = message["parent_header"].get("msg_id", "")
        if message["msg_type"] == "execute_input":
            self._request = request
        if self._cell is not None and request == self._request and message["msg_type"] != "execute_reply":
            self._client.process_message(message, self._cell, self._index)
            self._join_streams()

    def _join_streams(self) -> None:
        """What a stream says piece by piece is one output, as a notebook shows it."""
        outputs = self._cell.outputs if self._cell is not None else []
        if len(outputs) < 2:
            return
        last, new = outputs[-2:]
        if last.output_type == new.output_type == "stream" and last.name == new.name:
            last.text += new.text
            outputs.pop()

    def write(self, path: Path) -> None:
        """Write the notebook with its outputs."""
        self._client.set_widgets_metadata()
        nbformat.write(self._client.nb, path)
