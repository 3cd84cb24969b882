"""Frames: whatever comes off a line, in whatever pieces, no frame is made up, and the next whole one is found."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rotflex_serial import port, protocol, stream
from rotflex_serial.protocol import (
    LONGEST_BODY,
    VERSION,
    Booted,
    Cause,
    Flag,
    Foreign,
    Inputs,
    Receiver,
    Sample,
    Status,
    Type,
    checksum,
    message,
    pack,
    request,
    unpack,
)
from simulated_uno import FIRMWARE

BODIES = st.binary(min_size=1, max_size=LONGEST_BODY)
NOISE = st.binary(max_size=200)


def cut(content: bytes, places: list[int]) -> list[bytes]:
    """Bytes in pieces."""
    ends = sorted(place % (len(content) + 1) for place in places)
    return [content[start:end] for start, end in zip([0, *ends], [*ends, len(content)], strict=True)]


def found(pieces: list[bytes]) -> list[bytes]:
    receiver = Receiver()
    return [body for piece in pieces for body in receiver.take(piece)]


def test_the_checksum_is_the_one_it_is_said_to_be():
    assert checksum(b"123456789") == 0x29B1  # CRC-16/CCITT-FALSE, as catalogues of checksums have it


def test_a_frame_as_the_documentation_has_it():
    """HELLO with sequence number 1, worked out by hand but for the checksum."""
    assert request(Type.HELLO, 1) == bytes([0, 5, 0x11, 0x01]) + checksum(b"\x11\x01").to_bytes(2, "little") + b"\0"


@given(BODIES)
def test_a_frame_has_one_zero_at_its_end_and_gives_its_body_back(body):
    frame = pack(body)
    assert frame.index(0) == len(frame) - 1
    assert unpack(frame[:-1]) == body


@given(NOISE, st.lists(BODIES, min_size=1, max_size=6), st.lists(st.integers(0, 10_000), max_size=10))
def test_after_any_noise_and_a_zero_all_frames_are_found_however_they_are_cut(noise, bodies, places):
    frames = b"".join(map(pack, bodies))
    assert found(cut(frames, places)) == bodies
    line = noise + b"\0" + frames
    assert found(cut(line, places)) == found([line])
    assert found([line])[-len(bodies) :] == bodies


@settings(max_examples=300, derandomize=True)  # one in 65 536 would pass by chance: the examples are always the same
@given(NOISE)
def test_noise_is_no_frame(noise):
    assert found([noise + b"\0"]) == []


@settings(max_examples=300, derandomize=True)
@given(st.lists(BODIES, min_size=1, max_size=5), st.integers(0, 10_000), st.integers(1, 255))
def test_a_byte_that_was_changed_costs_its_frame_and_at_most_the_next(bodies, place, change):
    line = bytearray(b"".join(map(pack, bodies)))
    line[place % len(line)] ^= change
    receiver = Receiver()
    got = list(receiver.take(bytes(line)))
    kept = iter(bodies)
    assert all(body in kept for body in got)  # in their order, and none that was not sent
    assert len(bodies) - 2 <= len(got) < len(bodies)


@pytest.mark.parametrize("body", [bytes([1]), b"\0", bytes(range(LONGEST_BODY)), bytes(LONGEST_BODY)], ids=len)
def test_every_single_bit_that_is_flipped_is_found(body):
    frame = pack(body)
    for bit in range(8 * len(frame)):
        line = bytearray(frame)
        line[bit // 8] ^= 1 << bit % 8
        assert found([bytes(line) + b"\0"]) == []


@pytest.mark.parametrize("body", [b"", bytes(LONGEST_BODY + 1)])
def test_what_no_frame_can_hold_is_not_packed(body):
    with pytest.raises(ValueError, match="28 bytes"):
        pack(body)


def test_an_endless_frame_is_not_kept():
    receiver = Receiver()
    for _ in range(1000):
        assert list(receiver.take(b"\x01" * 100)) == []
    assert len(receiver._rest) <= LONGEST_BODY + 8
    assert list(receiver.take(b"\0" + pack(b"good"))) == [b"good"]
    assert receiver.damaged == 1


def test_what_a_board_says():
    sample = bytes.fromhex("1c 0201 fdffffff 07000000 41 09 05 0002 ff03")
    assert message(sample) == Sample(0x0102, Flag.EXPIRED | Flag.SESSION, 9, Inputs((-3, 7), 5, (512, 1023)))
    reply = message(bytes.fromhex("1d 07 05 02 40 06 aabb"))
    assert reply == (7, Type.READ, Status.BAD_VALUE, Flag.SESSION, 6, b"\xaa\xbb")
    assert message(b"\x1e\x08") == Booted(Cause.HANG)
    assert message(b"\x2d\x01") == Foreign(2)


@given(BODIES)
def test_any_body_is_something_or_nothing_but_never_an_error(body):
    heard = message(body)
    if body[0] >> 4 != VERSION:
        assert heard == Foreign(body[0] >> 4)


HEADER = (FIRMWARE / "src" / "protocol.h").read_text("utf-8")


def numbers(prefix: str = "") -> dict[str, int]:
    return {
        name.removeprefix(prefix): int(value)
        for name, value in re.findall(r"^\s*(?:#define )?([A-Z]\w+)(?: =)? (\d+)\b", HEADER, re.MULTILINE)
        + re.findall(r"\b([A-Z_]+) = (\d+)", HEADER)
        if name.startswith(prefix)
    }


def test_the_firmware_and_the_program_mean_the_same():
    known = numbers()
    for table in (Type, Status, protocol.Operation):
        assert {member.name: member.value for member in table}.items() <= known.items()
    assert {flag.name: flag.value for flag in Flag} == numbers("FLAG_")
    assert known["PROTOCOL_VERSION"] == VERSION
    assert known["BAUD_RATE"] == port.BAUD_RATE
    assert known["SLOWEST_MS"] == stream.SLOWEST
