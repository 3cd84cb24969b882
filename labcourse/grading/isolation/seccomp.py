"""The filter of system calls: a few that students' work does not need, and that go around the other layers.

Classic BPF, as the kernel takes it (``man 2 seccomp``), written here without a library. It refuses:

* new user namespaces, in which a process has all capabilities again (``clone``, ``unshare``, ``setns``);
* keys that a process inherits from the grader;
* families of sockets that a network namespace does not hold, such as AF_VSOCK, which reaches a virtual machine's host;
* memory that no file size counts (``memfd_create``, System V's shared memory and queues);
* looking into other processes, and io_uring, which calls the kernel around such a filter.
"""

from __future__ import annotations

import errno
import itertools
import struct

_LOAD, _JUMP_EQUAL, _JUMP_AT_LEAST, _JUMP_BITS, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_ALLOW, _ERROR = 0x7FFF0000, 0x00050000
# Offsets in struct seccomp_data; both machines are little-endian.
_NUMBER, _ARCHITECTURE, _FIRST_ARG, _SECOND_ARG = 0, 4, 16, 24

# <linux/audit.h>; the x32 calls of x86_64 have this bit set, and would go around the list.
_ARCHITECTURES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
_X32 = 0x40000000

# From the kernel's tables of system calls: why it is refused → name → (x86_64, aarch64).
_REFUSED = {
    "new namespaces": {"unshare": (272, 97), "setns": (308, 268)},
    "inherited keys": {"add_key": (248, 217), "request_key": (249, 218), "keyctl": (250, 219)},
    "other processes": {"ptrace": (101, 117), "kcmp": (312, 272), "pidfd_getfd": (438, 438)},
    "their memory": {"process_vm_readv": (310, 270), "process_vm_writev": (311, 271), "userfaultfd": (323, 282)},
    "the kernel": {"bpf": (321, 280), "perf_event_open": (298, 241), "syslog": (103, 116)},
    "files by handle": {"fanotify_init": (300, 262), "open_by_handle_at": (304, 265)},
    "io_uring": {"io_uring_setup": (425, 425), "io_uring_enter": (426, 426), "io_uring_register": (427, 427)},
    "memory that no file size counts": {"memfd_create": (319, 279), "memfd_secret": (447, 447), "shmget": (29, 194)},
    "queues and semaphores, too": {"msgget": (68, 186), "semget": (64, 190), "mq_open": (240, 180)},
}
_CLONE, _CLONE3, _SOCKET, _IOCTL = (56, 220), (435, 435), (41, 198), (16, 29)
_NEW_NAMESPACES = 0x7E020000  # CLONE_NEWNS | NEWCGROUP | NEWUTS | NEWIPC | NEWUSER | NEWPID | NEWNET
_ALLOWED_FAMILIES = (1, 2, 10, 16)  # AF_UNIX, AF_INET, AF_INET6, AF_NETLINK
_TERMINAL_INPUT = (0x5412, 0x541C)  # TIOCSTI, TIOCLINUX: type into a terminal
Step = tuple[int, int, int, int]  # what to do, steps to jump if true and if false, the value


def program(machine: str) -> bytes | None:
    """Assemble the filter as the kernel and bubblewrap take it.

    Parameters
    ----------
    machine : ``os.uname().machine``

    Returns
    -------
    bytes or None
        None for a machine without a table of system call numbers here.
    """
    if machine not in _ARCHITECTURES:
        return None
    column = list(_ARCHITECTURES).index(machine)  # of the tables above
    steps = [
        (_LOAD, 0, 0, _ARCHITECTURE),
        (_JUMP_EQUAL, 1, 0, _ARCHITECTURES[machine]),
        (_RETURN, 0, 0, _ERROR | errno.ENOSYS),
        (_LOAD, 0, 0, _NUMBER),
        (_JUMP_AT_LEAST, 0, 1, _X32),
        (_RETURN, 0, 0, _ERROR | errno.ENOSYS),
    ]
    for numbers in itertools.chain(*map(dict.values, _REFUSED.values())):
        steps += _refuse_if(_JUMP_EQUAL, numbers[column], errno.EPERM)
    # The flags of clone3 are in memory, where a filter cannot see them. The C library falls back on clone.
    steps += _refuse_if(_JUMP_EQUAL, _CLONE3[column], errno.ENOSYS)
    steps += _check_argument(_CLONE[column], _FIRST_ARG, _refuse_if(_JUMP_BITS, _NEW_NAMESPACES, errno.EPERM))
    families = [(_JUMP_EQUAL, len(_ALLOWED_FAMILIES) - i, 0, family) for i, family in enumerate(_ALLOWED_FAMILIES)]
    steps += _check_argument(_SOCKET[column], _FIRST_ARG, [*families, (_RETURN, 0, 0, _ERROR | errno.EAFNOSUPPORT)])
    refuse_typing = [step for request in _TERMINAL_INPUT for step in _refuse_if(_JUMP_EQUAL, request, errno.EPERM)]
    steps += _check_argument(_IOCTL[column], _SECOND_ARG, refuse_typing)
    steps.append((_RETURN, 0, 0, _ALLOW))
    return b"".join(struct.pack("HBBI", *step) for step in steps)


def _refuse_if(jump: int, value: int, error: int) -> list[Step]:
    """Make steps that refuse the call with an error if the comparison ``jump`` of the loaded word and a value holds."""
    return [(jump, 0, 1, value), (_RETURN, 0, 0, _ERROR | error)]


def _check_argument(number: int, argument: int, steps: list[Step]) -> list[Step]:
    """Make steps that check an argument of one system call, and allow the call if none of them refuses it.

    Parameters
    ----------
    number : of the system call
    argument : offset of the argument in struct seccomp_data
    steps : taken when the argument is loaded
    """
    body = [(_LOAD, 0, 0, argument), *steps, (_RETURN, 0, 0, _ALLOW)]
    return [(_JUMP_EQUAL, 0, len(body), number), *body]
