"""The protocol between program and board, as plain functions of bytes. README.md has it in words.

A frame is a body, its CRC-16 behind it, both without a zero inside (COBS), and a zero at the end. The first byte of
each body is the protocol's version (upper half) and the body's type (lower half); all numbers are little-endian.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Iterator
from enum import IntEnum, IntFlag
from typing import NamedTuple

VERSION = 1
LONGEST_BODY = 28
_CHECKSUM = struct.Struct("<H")
_LONGEST_PIECE = LONGEST_BODY + _CHECKSUM.size + 1


class Type(IntEnum):
    """What a frame is."""

    HELLO = 1
    BYE = 2
    OUTPUT = 3
    RELOAD = 4
    READ = 5
    COUNTS = 6
    START = 7
    STOP = 8
    WATCHDOG = 9
    LINES = 10
    SUPPLY = 11
    SAMPLE = 12
    REPLY = 13
    BOOTED = 14
    ALIVE = 15


class Status(IntEnum):
    """How the board took a request."""

    OK = 0
    UNKNOWN = 1
    BAD_VALUE = 2
    NO_SESSION = 3
    EXPIRED = 4
    OTHER_VERSION = 5


class Operation(IntEnum):
    """What is done to the program's watchdog."""

    CLEAR = 0
    WATCH = 1
    UNWATCH = 2


class Flag(IntFlag):
    """How the board is, in each sample and reply."""

    EXPIRED = 1
    SILENT = 2
    WATCHING = 4
    SAMPLING = 8
    MISCOUNTED = 16
    DAMAGED = 32
    SESSION = 64


class Cause(IntFlag):
    """Why the board started."""

    POWER = 1
    RESET = 2
    BROWN_OUT = 4
    HANG = 8


class Inputs(NamedTuple):
    """All inputs at one instant: counts, levels of the digital lines as bits, analog inputs in steps of 1/1024."""

    counts: tuple[int, int]
    lines: int
    analog: tuple[int, int]


class Sample(NamedTuple):
    """A sample: its number (modulo 65536) since the start, how the board is, the output obeyed last, and all inputs."""

    number: int
    flags: Flag
    accepted: int
    inputs: Inputs


class Reply(NamedTuple):
    """The answer to a request: to which, how it was taken, and what it gives."""

    sequence: int
    to: int
    status: Status
    flags: Flag
    accepted: int
    payload: bytes


class Booted(NamedTuple):
    """The board has just started."""

    cause: Cause


class Foreign(NamedTuple):
    """A whole frame of another version of the protocol."""

    version: int


Message = Sample | Reply | Booted | Foreign

_SAMPLE = struct.Struct("<BH2iBBB2H")
_REPLY = struct.Struct("<BBBBBB")
_BOOTED = struct.Struct("<BB")

OUTPUT = struct.Struct("<h")  #: mV
PERIOD = struct.Struct("<H")  #: ms
SUPPLY = struct.Struct("<H")  #: mV
COUNTS = struct.Struct("<B2i")  #: mask, counts
WATCHDOG = struct.Struct("<BH")  #: operation, ms
LINES = struct.Struct("<BB")  #: mask, levels
HELLO = struct.Struct("<BHBB")  #: firmware's release, steps of the motor's output, ms of silence, why it started
READ = struct.Struct("<2iB2HHHH")  #: inputs; frames damaged, frames lost, edges of encoders missed


def checksum(body: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    return crc_hqx(body, 0xFFFF)


def pack(body: bytes) -> bytes:
    """A body as a frame.

    Raises
    ------
    ValueError
        If it is empty or longer than any frame.
    """
    if not 1 <= len(body) <= LONGEST_BODY:
        raise ValueError(f"A frame's body has 1 to {LONGEST_BODY} bytes; this has {len(body)}.")
    checked = body + _CHECKSUM.pack(checksum(body))
    return b"".join(bytes([len(piece) + 1]) + piece for piece in checked.split(b"\0")) + b"\0"


def unpack(piece: bytes) -> bytes | None:
    """The body in what stood between two zeros, or None if it is not a whole frame."""
    if len(piece) > _LONGEST_PIECE:
        return None
    pieces, at = [], 0
    while at < len(piece):
        end = at + piece[at]
        if end > len(piece) or end == at:
            return None
        pieces.append(piece[at + 1 : end])
        at = end
    checked = b"\0".join(pieces)
    body, found = checked[: -_CHECKSUM.size], checked[-_CHECKSUM.size :]
    return body if body and _CHECKSUM.pack(checksum(body)) == found else None


class Receiver:
    """Finds the frames in what comes off a line, in whatever pieces it comes.

    Attributes
    ----------
    damaged : how many frames were thrown away
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._rest = b""

    def take(self, incoming: bytes) -> Iterator[bytes]:
        """The bodies of frames that are whole now."""
        *pieces, rest = (self._rest + incoming).split(b"\0")
        self._rest = rest[: _LONGEST_PIECE + 1]  # what is longer is no frame, and need not be kept
        for piece in filter(None, pieces):
            body = unpack(piece)
            if body is None:
                self.damaged += 1
            else:
                yield body


def request(kind: Type, sequence: int, payload: bytes = b"") -> bytes:
    """A frame from the program to the board; a zero before it ends whatever noise has left on the line."""
    return b"\0" + pack(bytes([VERSION << 4 | kind, sequence]) + payload)


def message(body: bytes) -> Message | None:
    """What the board says, or None if it is nothing that a board says."""
    version, kind = body[0] >> 4, body[0] & 0xF
    if version != VERSION:
        return Foreign(version)
    if kind == Type.SAMPLE and len(body) == _SAMPLE.size:
        _head, number, servo, link, flags, accepted, lines, *analog = _SAMPLE.unpack(body)
        return Sample(number, Flag(flags), accepted, Inputs((servo, link), lines, (analog[0], analog[1])))
    if kind == Type.REPLY and len(body) >= _REPLY.size and body[3] <= max(Status):
        _head, sequence, to, status, flags, accepted = _REPLY.unpack_from(body)
        return Reply(sequence, to, Status(status), Flag(flags), accepted, body[_REPLY.size :])
    if kind == Type.BOOTED and len(body) == _BOOTED.size:
        return Booted(Cause(body[1]))
    return None
