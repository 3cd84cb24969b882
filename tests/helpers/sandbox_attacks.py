"""Attacks from inside a sandbox that neither the self-test makes, nor at each landing the class in ``hostile.py``."""

import json
import os
import subprocess

from labcourse.grading.isolation import cgroups, sandbox
from labcourse.grading.isolation.process import MIB, Limits

LIMITS = Limits(seconds=60, memory=256 * MIB, processes=20, file_size=8 * MIB, folder=32 * MIB, open_files=64)
#: Is in the sandbox, or does nothing. An attack is contained if it ends with an OSError or a MemoryError.
PROGRAM = """
import contextlib, ctypes, json, mmap, os, socket, sys, time
t = json.load(sys.stdin)
if os.uname().nodename != "sandbox" or os.path.exists(t["outside"]) or os.getuid() == 0: sys.exit(99)
started = []
def start(function, *arguments):
    if child := os.fork(): return started.append(child)
    try: function(*arguments)
    finally: os._exit(0)
def call(function, *arguments):
    if getattr(ctypes.CDLL(None, use_errno=True), function)(*arguments) < 0: raise OSError(ctypes.get_errno(), function)
def write(total, each):
    names = []
    try:
        while len(names) * each < total:
            names.append(f"/tmp/fill-{len(names)}")
            with open(names[-1], "wb", buffering=0) as file:
                while file.tell() < each: file.write(bytes(2**20))
    finally:
        for name in names: os.unlink(name)
succeeded = []
for name, attack in t["attacks"].items():
    with contextlib.suppress(OSError, MemoryError):
        exec(attack, globals())
        succeeded.append(name)
    for child in started:
        with contextlib.suppress(OSError): os.kill(child, 9), os.waitpid(child, 0)
    started.clear()
with open("succeeded", "w") as file: json.dump(succeeded, file)
"""
MEMORY_TOGETHER = """
taken = mmap.mmap(-1, 3)
def take(number):
    held = bytearray(b"x") * int(0.6 * t["memory"])
    taken[number] = 1
    time.sleep(30)
for number in range(3): start(take, number)
until = time.monotonic() + 20
while time.monotonic() < until:
    if os.waitpid(-1, os.WNOHANG)[1] == 9: raise MemoryError
    if sum(taken[:]) == 3: until = min(until, time.monotonic() + 1)
    time.sleep(0.01)
"""
ATTACKS = {
    "another machine": 'socket.create_connection(("192.0.2.1", 9), 2)',  # an address set aside for documentation
    "virtual machine's host": "socket.socket(40, socket.SOCK_STREAM).close()",  # AF_VSOCK
    "kill": 'if t["victim"] not in (os.getpid(), os.getppid(), 1): os.kill(t["victim"], 9)',
    "change a program": 'os.close(os.open("/usr/bin/env", os.O_RDWR))',
    "user namespace": 'call("unshare", 0x10000000)',
    "trace the first process": 'call("ptrace", 0x4206, 1, 0, 0)',
    "file too big": 'write(2 * t["file_size"], 2 * t["file_size"])',
    "full folder": 'write(2 * t["folder"], t["file_size"] // 2)',
    "many processes": 'for _ in range(2 * t["processes"]): start(time.sleep, 10)',
    "memory together": MEMORY_TOGETHER,
}
#: Contained where there are control groups.
TOGETHER = set() if "memory" in cgroups.parent_groups() else {"memory together"}


def successful_attacks():
    """Make all attacks in a sandbox; return the names of those that succeeded."""
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE) as victim:
        targets = {"attacks": ATTACKS, "outside": os.path.abspath(__file__), "victim": victim.pid, **vars(LIMITS)}
        command = [str(sandbox.python()), "-I", "-S", "-c", PROGRAM]
        given = json.dumps(targets).encode()
        outcome = sandbox.run(command, visible=[], wanted={"succeeded": 10_000}, stdin=given, limits=LIMITS)
        succeeded = set(json.loads(outcome.files["succeeded"])) - {"kill"}  # it may have found a process of its own
        return succeeded | ({"kill"} if victim.poll() is not None else set())
