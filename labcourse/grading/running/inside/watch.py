"""Fork, and hold the child to its time.

The child reports through a pipe when a step begins and when it ends. It is not to be trusted: its reports are counted,
not read, and no more of them are believed than an honest child would have to make.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable

from . import DIED, FINE, TIMED_OUT

GRACE = 5.0  #: s after the interrupt until the end; time to tidy up
_LONGEST_PAUSE = 0.05  # s between two looks at a child that has closed its end of the pipe
_LONGEST_COMPLAINT = 2000  # characters: a traceback
_STEP = b"+"
_FINISHED = 99  # exit status of a child that has come to its end; 0 is what a cell's own exit would give

ReportStep = Callable[[], None]  #: reports that a step has begun or ended


def run(work: Callable[[ReportStep], None], steps: int, timeout: float) -> int:
    """Do some work in a forked process, and return how it ended.

    Parameters
    ----------
    work : is given a function that it must call at the beginning and at the end of each step
    steps : how many there are
    timeout : time between two such calls, s; then the process is interrupted as by Ctrl-C, and ``GRACE`` later killed

    Returns
    -------
    FINE, TIMED_OUT (a step was interrupted, and perhaps killed) or DIED (the work did not come to its end)
    """
    sys.stdout.flush()
    sys.stderr.flush()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _be_child(work, reading, writing)
    os.close(writing)
    try:
        return _Watch(child, reading, 2 * steps, timeout).wait()
    finally:
        os.close(reading)


def _be_child(
    work: Callable[[ReportStep], None], reading: int, writing: int, leave: Callable[[int], None] = os._exit
) -> None:
    """What the child does, and that it goes no further. (``os._exit`` may not be what it was when the work is done.)"""
    code = DIED
    try:
        os.setsid()
        os.close(reading)
        complaints = os.dup(2)  # the parent's standard error, wherever cells write to
        myself = os.getpid()

        def report_step() -> None:
            if os.getpid() != myself:
                leave(DIED)  # forked by a cell: it has no business with the cells that come after
            with contextlib.suppress(OSError):
                os.write(writing, _STEP)

        work(report_step)
        code = _FINISHED
    except SystemExit:
        pass
    except BaseException:
        with contextlib.suppress(BaseException):
            os.write(complaints, traceback.format_exc()[-_LONGEST_COMPLAINT:].encode(errors="replace"))
    finally:
        leave(code)


class _Watch:
    """A child, its end of the pipe, and the clock."""

    def __init__(self, child: int, pipe: int, reports: int, timeout: float) -> None:
        self.child, self.pipe, self.reports_left, self.timeout = child, pipe, reports, timeout
        self.believed = True
        self.pause = 0.001

    def wait(self) -> int:
        """Wait until the child has ended or had to be ended, and return how."""
        ended = FINE
        interrupted = False
        since = time.monotonic()
        while (status := self._status()) is None:
            left = since + (GRACE if interrupted else self.timeout) - time.monotonic()
            if left <= 0:
                ended = TIMED_OUT
                if interrupted:
                    break
                self._signal(signal.SIGINT)
                interrupted, since = True, time.monotonic()
            elif self._reported(left):
                interrupted, since = False, time.monotonic()
        self._signal(signal.SIGKILL)  # whatever else is left of its process group, too
        if status is None:
            os.waitpid(self.child, 0)
            return ended
        return ended if status == _FINISHED else DIED

    def _reported(self, seconds: float) -> bool:
        """Wait until the child reports something, but no longer than that; and whether it did."""
        if not self.believed:
            time.sleep(min(seconds, self.pause))
            self.pause = min(2 * self.pause, _LONGEST_PAUSE)
            return False
        if not select.select([self.pipe], [], [], min(seconds, 1.0))[0]:
            return False
        reports = os.read(self.pipe, 4096)
        self.reports_left -= len(reports)
        self.believed = bool(reports) and self.reports_left >= 0
        return self.believed

    def _status(self) -> int | None:
        """Exit status of the child; None while it runs."""
        pid, status = os.waitpid(self.child, os.WNOHANG)
        return os.waitstatus_to_exitcode(status) if pid else None

    def _signal(self, number: int) -> None:
        """Send a signal to the child and to its process group."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.child, number)
