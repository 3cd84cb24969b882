"""A time limit for code that untrusted input can make slow."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType


class TooSlow(ArithmeticError):
    """A calculation was stopped because it took too long."""


@contextlib.contextmanager
def time_limited(seconds: float) -> Iterator[None]:
    """Limit the time of a ``with`` block: raise :class:`TooSlow` in it after so many seconds.

    It works only in the main thread of a program on Linux or macOS, where answers are marked
    (:mod:`labcourse.grading.marking.marking_processes`); elsewhere there is no limit.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        """Handle the signal of the timer."""
        raise TooSlow(f"stopped after {seconds:g} s")

    previous = signal.signal(signal.SIGALRM, stop)
    # The timer repeats: code in the block may catch the first TooSlow as an error of arithmetic.
    signal.setitimer(signal.ITIMER_REAL, seconds, max(seconds / 10, 0.01))
    try:
        yield
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0)
        finally:
            signal.signal(signal.SIGALRM, previous)
