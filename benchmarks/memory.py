"""Memory of a program and of all that it starts, in proportional set size: what processes share counts once."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import Counter
from collections.abc import Iterator

import psutil

MEGABYTE = 1e6
ITSELF, SANDBOX, OTHERS, WORKERS, TOTAL = "itself", "sandbox", "others", "workers", "total"
_SANDBOX_PROGRAM = "bwrap"


class Peaks(Counter[str]):
    """Peaks, in bytes: of the program itself, of all sandboxes, of its other processes, of both of these, of all.

    They need not be at the same moment.
    """

    def megabytes(self, what: str) -> float:
        """A peak, MB."""
        return self[what] / MEGABYTE


class Sampler:
    """Looks at the memory of a program until it is stopped. It takes time itself, so that nothing else should be
    measured finely at once.

    Parameters
    ----------
    program : process id
    interval : s between two looks

    Attributes
    ----------
    peaks : so far
    busy : s of processor time that looking has taken
    """

    def __init__(self, program: int, interval: float) -> None:
        self.peaks = Peaks()
        self.busy = 0.0
        self._program, self._interval = psutil.Process(program), interval
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._measure, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._over.set()
        self._thread.join()

    def _measure(self) -> None:
        started = time.thread_time()
        while not self._over.wait(self._interval):
            now = _sizes(self._program)
            for what, size in now.items():
                self.peaks[what] = max(self.peaks[what], size)
            self.busy = time.thread_time() - started


def _sizes(program: psutil.Process) -> dict[str, int]:
    itself = _size(program)
    sandbox = others = 0
    for child in _children(program):
        family = list(_family(child))
        size = sum(map(_size, family))
        if any(_is_sandbox(process) for process in family):
            sandbox += size
        else:
            others += size
    return {
        ITSELF: itself,
        SANDBOX: sandbox,
        OTHERS: others,
        WORKERS: sandbox + others,
        TOTAL: itself + sandbox + others,
    }


def _children(program: psutil.Process) -> list[psutil.Process]:
    """What it has started. Until a new process has become another program, its memory is the old one's."""
    try:
        words = program.cmdline()
        return [child for child in program.children() if child.cmdline() != words]
    except psutil.NoSuchProcess:  # any of them has just ended; there will be another look
        return []


def _family(process: psutil.Process) -> Iterator[psutil.Process]:
    yield process
    with contextlib.suppress(psutil.NoSuchProcess):
        yield from process.children(recursive=True)


def _size(process: psutil.Process) -> int:
    """Its proportional set size; nothing if it has just ended."""
    try:
        return int(process.memory_full_info().pss)
    except (psutil.NoSuchProcess, psutil.ZombieProcess, ProcessLookupError):
        return 0


def _is_sandbox(process: psutil.Process) -> bool:
    try:
        return process.name() == _SANDBOX_PROGRAM
    except psutil.NoSuchProcess:
        return False
