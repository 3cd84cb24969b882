"""The firmware's frames, compiled for this computer, against the program's."""

from __future__ import annotations

import ctypes
import shutil
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rotflex_serial.protocol import LONGEST_BODY, Receiver, checksum, pack
from simulated_uno import FIRMWARE

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="There is no C compiler (cc) here.")
BODIES = st.binary(min_size=1, max_size=LONGEST_BODY)
PACKED = LONGEST_BODY + 4


class CReceiver(ctypes.Structure):
    _fields_ = (("bytes", ctypes.c_uint8 * PACKED), ("length", ctypes.c_uint8), ("damaged", ctypes.c_uint16))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory) -> ctypes.CDLL:
    built = tmp_path_factory.mktemp("frame") / "frame.so"
    source = FIRMWARE / "src" / "frame.c"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", str(built), str(source)], check=True)
    library = ctypes.CDLL(str(built))
    for name, result in (
        ("frame_crc", ctypes.c_uint16),
        ("frame_pack", ctypes.c_uint8),
        ("frame_take", ctypes.c_uint8),
    ):
        getattr(library, name).restype = result
    return library


def found(library: ctypes.CDLL, content: bytes) -> tuple[list[bytes], int]:
    receiver, bodies = CReceiver(), []
    for byte in content:
        length = library.frame_take(ctypes.byref(receiver), ctypes.c_uint8(byte))
        assert length <= LONGEST_BODY
        if length:
            bodies.append(bytes(receiver.bytes[:length]))
    return bodies, receiver.damaged


@given(BODIES)
def test_both_pack_alike(compiled, body):
    packed = ctypes.create_string_buffer(PACKED)
    length = compiled.frame_pack(body, ctypes.c_uint8(len(body)), packed)
    assert packed.raw[:length] == pack(body)
    assert compiled.frame_crc(body, ctypes.c_uint8(len(body))) == checksum(body)


#: A frame with another checksum, and one that ends too early.
DAMAGED = BODIES.map(lambda body: pack(body)[:-2] + b"\x01\0") | BODIES.map(lambda body: pack(body)[:-3] + b"\0")


@given(st.lists(st.one_of(BODIES.map(pack), DAMAGED, st.binary(max_size=60)), max_size=8).map(b"".join))
def test_both_find_the_same_in_whatever_comes(compiled, content):
    receiver = Receiver()
    here = list(receiver.take(content))
    assert found(compiled, content) == (here, receiver.damaged)
