"""A notebook's outputs in a file: messages as a kernel sends them, one a line, and a line for the end of each cell.

The process that runs the cells writes them, and the one that follows the run reads them. The file is not to be trusted,
because a cell can write to it. Both hold to the same limits: one so as not to fill a disk, the other its memory.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator
from typing import IO, Any

MOST_OF_CELL = 1_000_000  #: bytes; of what follows when a cell has cleared its output
MOST_OF_NOTEBOOK = 20_000_000  #: bytes
#: Stands in place of what is beyond that.
CUT = f"[Output cut: the most are {MOST_OF_CELL:,} bytes a cell and {MOST_OF_NOTEBOOK:,} a notebook.]\n"
BEGIN = "kernel_info_reply"  #: type of the message before the first cell
END = "execute_reply"  #: type of the message that ends a cell

Source = tuple[str, str | None, bool]  #: of a cell, the cell's id, and whether the next is run after an error
Message = dict[str, Any]


class Allowance:
    """What a cell and a notebook have output, in bytes."""

    def __init__(self) -> None:
        self._of_cell = self._of_notebook = 0
        self._is_cut = False

    def take(self, kind: str, size: int) -> bool:
        """Return whether a message of a type is within the limits, and count its bytes if it is."""
        if kind == "clear_output":
            self._of_cell = 0
        if self._of_cell + size > MOST_OF_CELL or self._of_notebook + size > MOST_OF_NOTEBOOK:
            self._is_cut = True
            return False
        self._of_cell, self._of_notebook = self._of_cell + size, self._of_notebook + size
        return True

    def end_cell(self) -> bool:
        """Begin the next cell; return whether something of the last was beyond the limits."""
        is_cut, self._of_cell, self._is_cut = self._is_cut, 0, False
        return is_cut


class Writer:
    """Write messages to a file."""

    def __init__(self, path: str) -> None:
        self._file, self._allowance = open(path, "ab"), Allowance()  # noqa: SIM115 (open as long as the process lives)

    def write(self, kind: str, message: bytes) -> None:
        """Write a message of a type, JSON, if it is within the limits."""
        if self._allowance.take(kind, len(message)):
            self._write(message)

    def end_cell(self, failed: bool) -> None:
        """Write that a cell has ended, and whether by an error."""
        self._write(json.dumps({"msg_type": END, "failed": failed, "cut": self._allowance.end_cell()}).encode())

    def _write(self, message: bytes) -> None:
        with contextlib.suppress(OSError):  # a full disk: the run is worth more than what it shows
            self._file.write(message + b"\n")
            self._file.flush()


def read(file: IO[bytes], allowance: Allowance) -> Iterator[Message]:
    """Yield the messages that a file has more than before; the last of a cell has "failed" and "cut"."""
    while file.tell() < MOST_OF_NOTEBOOK + MOST_OF_CELL:
        line = file.readline(MOST_OF_CELL + 1)
        if len(line) <= MOST_OF_CELL and not line.endswith(b"\n"):  # none, or one that is being written
            file.seek(-len(line), os.SEEK_CUR)
            return
        with contextlib.suppress(ValueError, TypeError, KeyError, RecursionError):  # a cell may write anything
            message = json.loads(line)
            if message["msg_type"] == END:
                yield {"msg_type": END, "failed": message["failed"], "cut": allowance.end_cell() or message["cut"]}
            elif allowance.take(message["msg_type"], len(line) - 1):
                yield message
