"""The limits of an isolated command, what comes back from it, and how its file is read."""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

MIB = 2**20


@dataclass(frozen=True)
class Limits:
    """What a command may use.

    Attributes
    ----------
    seconds : wall time, from its start
    memory : bytes of address space of each process; and, where there are cgroups, bytes of memory of all together
    processes : at a time, threads counted
    file_size : bytes of each file that it writes; twice all own files
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
    """How a run came to its end."""

    FINISHED = "finished"  # by itself, whatever its exit status
    DEADLINE = "deadline"  # it took too long
    OUTPUT = "output"  # it wrote too much
    CANCELLED = "cancelled"  # we gave up


@dataclass(frozen=True)
class Outcome:
    """What came back from a command.

    Attributes
    ----------
    ending : how it came to its end
    code : exit status, or minus the signal that ended it; None if it was ended from here
    file : the bytes of the wanted file, if it could be read
    trouble : why the file could not be read; "" if it could, or if there was none
    output : standard output and standard error, as far as they were read; untrusted bytes
    seconds : that it took
    layers : the optional layers that were active
    others : further files that were asked for, as far as they are there and could be read
    """

    ending: Ending
    code: int | None
    file: bytes | None
    trouble: str
    output: bytes
    seconds: float
    layers: tuple[str, ...] = ()
    others: Mapping[str, bytes] = field(default_factory=dict)


def read_others(folder: int, also: Mapping[str, int]) -> dict[str, bytes]:
    """Further files of an open folder: name → bytes, of those that :func:`read_wanted` reads without trouble."""
    found = {name: read_wanted(folder, name, largest)[0] for name, largest in also.items()}
    return {name: data for name, data in found.items() if data is not None}


def read_wanted(folder: int, name: str, largest: int) -> tuple[bytes | None, str]:
    """The bytes of a file in an open folder (a descriptor), and what was wrong with it.

    What untrusted code left there may be a link, a pipe or anything else. Only an ordinary file of at most ``largest``
    bytes is read, and never waited for. To be called once everything that could change it is dead.
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
    if len(data) > largest:
        return None, f"has more than {largest} bytes"
    return data, ""
