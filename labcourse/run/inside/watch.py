"""Fork, and hold the child to its time.

The child reports through a pipe when a step begins and when it ends. It is not to be trusted: its reports are counted,
not read, and no more of them are believed than an honest child would have to make. Who follows it is given each report
when it comes, so that it can look at what the step has left.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Generator, Iterator

from . import DIED, FINE, TIMED_OUT

GRACE = 5.0  #: s after the interrupt until the end; time to tidy up
_PAUSE = 0.002  # s between two looks at a child that cannot report any more
_LONGEST_TRACEBACK = 2000  # characters
_STEP = b"+"
_PARENT = os.getppid()
_FINISHED = 99  # exit status of a child that has come to its end; 0 is what a cell's own exit would give

ReportStep = Callable[[], None]  #: reports that a step has begun or ended


def run(work: Callable[[ReportStep], None], steps: int, timeout: float) -> int:
    """Do some work in a forked process as :func:`follow` does, and return how it ended."""
    *_reports, ended = follow(work, steps, timeout)
    assert ended is not None
    return ended


def follow(work: Callable[[ReportStep], None], steps: int, timeout: float) -> Generator[int | None]:
    """Do some work in a forked process: yield None for each report of a step, and last how the work ended.

    The process is ended when the iterator is closed.

    Parameters
    ----------
    work : is given a function that it must call at the beginning and at the end of each step
    steps : how many there are
    timeout : time between two such calls, s; then the process is interrupted as by Ctrl-C, and ``GRACE`` later killed

    Yields
    ------
    int or None
        Last FINE, TIMED_OUT (a step was interrupted, and perhaps killed) or DIED (the work did not come to its end).
    """
    sys.stdout.flush()
    sys.stderr.flush()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _work_as_child(work, reading, writing)
    os.close(writing)
    try:
        yield from _Watch(child, reading, 2 * steps, timeout).follow()
    finally:
        os.close(reading)


def _work_as_child(
    work: Callable[[ReportStep], None], reading: int, writing: int, exit_now: Callable[[int], None] = os._exit
) -> None:
    """Do the work in the child process, and end the process, whatever happens.

    Parameters
    ----------
    work : is given the function that reports a step
    reading, writing : ends of the pipe to the parent
    exit_now : ends the process. It is bound here, before the work: a cell may replace ``os._exit``.
    """
    code = DIED
    try:
        os.setsid()
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        os.close(reading)
        parents_stderr = os.dup(2)  # the parent's standard error, wherever cells write to
        own_pid = os.getpid()

        def report_step() -> None:
            """Write a byte to the parent, at the beginning and end of each step; end a process that a cell forked."""
            if os.getpid() != own_pid:
                exit_now(DIED)  # forked by a cell: it has no business with the cells that come after
            with contextlib.suppress(OSError):
                os.write(writing, _STEP)

        work(report_step)
        code = _FINISHED
    except SystemExit:
        pass
    except BaseException:
        with contextlib.suppress(BaseException):
            os.write(parents_stderr, traceback.format_exc()[-_LONGEST_TRACEBACK:].encode(errors="replace"))
    finally:
        exit_now(code)


class _Watch:
    """The parent's watch over a child: its reports, and the time that it takes.

    Parameters
    ----------
    child : process number, also of its process group
    pipe : descriptor from which its reports are read
    reports : number that an honest child makes at most
    timeout : time between two reports, s
    """

    def __init__(self, child: int, pipe: int, reports: int, timeout: float) -> None:
        self.child, self.pipe, self.reports_left, self.timeout = child, pipe, reports, timeout
        self.reports_believed = True

    def follow(self) -> Iterator[int | None]:
        """Wait until the child has ended, or end it; yield None for each report, and last FINE, TIMED_OUT or DIED."""
        try:
            yield from self._follow()
        finally:
            self._signal(signal.SIGKILL)  # whatever else is left of its process group, too
            with contextlib.suppress(ChildProcessError):  # it had ended
                os.waitpid(self.child, 0)

    def _follow(self) -> Iterator[int | None]:
        ended = FINE
        interrupted = False
        since = time.monotonic()
        while (status := self._exit_status()) is None:
            if os.getppid() != _PARENT:
                raise SystemExit("The program that asked for this run has ended.")
            left = since + (GRACE if interrupted else self.timeout) - time.monotonic()
            if left <= 0:
                ended = TIMED_OUT
                if interrupted:
                    break
                self._signal(signal.SIGINT)
                interrupted, since = True, time.monotonic()
            elif self._wait_for_report(left):
                interrupted, since = False, time.monotonic()
                yield None
        yield ended if status in (None, _FINISHED) else DIED

    def _wait_for_report(self, seconds: float) -> bool:
        """Wait for a report of the child, for so many seconds at most; return whether one came that is believed."""
        if not self.reports_believed:  # the pipe tells nothing any more: only wait
            time.sleep(min(seconds, _PAUSE))
            return False
        if not select.select([self.pipe], [], [], min(seconds, 1.0))[0]:
            return False
        reports = os.read(self.pipe, 4096)
        self.reports_left -= len(reports)
        self.reports_believed = bool(reports) and self.reports_left >= 0
        return self.reports_believed

    def _exit_status(self) -> int | None:
        """Return the exit status of the child; None while it runs."""
        pid, status = os.waitpid(self.child, os.WNOHANG)
        return os.waitstatus_to_exitcode(status) if pid else None

    def _signal(self, number: int) -> None:
        """Send a signal to the child and to its process group."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.child, number)
