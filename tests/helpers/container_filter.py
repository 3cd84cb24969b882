"""Runs Python under a filter of system calls as containers have it: ``container_filter.py WORDS``.

It refuses what Docker's and Podman's default filters refuse to a process without CAP_SYS_ADMIN, as far as isolation may
ask for it. The numbers are those of x86_64.
"""

import ctypes
import errno
import os
import struct
import sys

_LOAD, _JUMP_EQUAL, _JUMP_BITS, _RETURN = 0x20, 0x15, 0x45, 0x06
_ERROR, _ALLOW = 0x50000, 0x7FFF0000
_NUMBER, _FIRST = 0, 16  # offsets in struct seccomp_data
_CLONE, _CLONE3 = 56, 435
_NEW_NAMESPACES = 0x7E020000
_REFUSED = {
    "unshare": 272,
    "setns": 308,
    "mount": 165,
    "umount2": 166,
    "pivot_root": 155,
    "keyctl": 250,
    "add_key": 248,
    "request_key": 249,
    "open_tree": 428,
    "move_mount": 429,
    "fsopen": 430,
    "mount_setattr": 442,
}
_NO_NEW_PRIVILEGES, _SECCOMP, _FILTER = 38, 22, 2  # of prctl


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("steps", ctypes.c_void_p))


def main(words: list[str]) -> None:
    """Put the filter on this process, and become Python with the words."""
    steps = [(_LOAD, 0, 0, _NUMBER)]
    for number in _REFUSED.values():
        steps += [(_JUMP_EQUAL, 0, 1, number), (_RETURN, 0, 0, _ERROR | errno.EPERM)]
    steps += [(_JUMP_EQUAL, 0, 1, _CLONE3), (_RETURN, 0, 0, _ERROR | errno.ENOSYS)]
    steps += [(_JUMP_EQUAL, 0, 3, _CLONE), (_LOAD, 0, 0, _FIRST), (_JUMP_BITS, 0, 1, _NEW_NAMESPACES)]
    steps += [(_RETURN, 0, 0, _ERROR | errno.EPERM), (_RETURN, 0, 0, _ALLOW)]
    packed = b"".join(struct.pack("HBBI", *step) for step in steps)
    kept = ctypes.create_string_buffer(packed, len(packed))
    program = _Program(len(steps), ctypes.addressof(kept))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) or libc.prctl(_SECCOMP, _FILTER, ctypes.byref(program), 0, 0):
        raise OSError(ctypes.get_errno(), "no filter")
    os.execv(sys.executable, [sys.executable, *words])


if __name__ == "__main__":
    main(sys.argv[1:])
