"""To 0 V, whatever fails on the way.

What a board does between the expiry of its watchdog and the next write is not documented: once cleared, the watchdog
may stand, run on, or expire again at once; the outputs may jump back to what they were. So no single order is counted
on: 0 V is written until the board has taken it, and only then is the watchdog stopped. A board that never takes it is
left with its watchdog running, which sets 0 V where it can.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from rotflex.errors import HILError
from rotflex.hil.board import Board, Channels

WATCHDOG_TIMEOUT = 0.2  #: s; an arm at 30 rad/s turns a whole turn meanwhile, and no more
_AGAIN = 3  # times; a watchdog that expires again in between does so within its time-out, which is far longer


class _Steps:
    """Steps of which each is taken, whatever became of those before it; the first failure is kept."""

    def __init__(self) -> None:
        self._failed: dict[str, Exception] = {}
        self._interrupted: BaseException | None = None

    def take(self, name: str, step: Callable[[], object]) -> bool:
        """Whether a step was taken. One that is taken in the end has not failed."""
        try:
            step()
        except Exception as trouble:
            self._failed.setdefault(name, trouble)
            return False
        except BaseException as interrupt:  # somebody pressed Ctrl-C: not before the motor is at 0 V
            self._interrupted = interrupt
            return False
        self._failed.pop(name, None)
        return True

    def finish(self) -> None:
        """Raise what failed, and an interrupt before all else."""
        if self._interrupted is not None:
            if not self._failed:
                self._interrupted.add_note("The motor is at 0 V.")
            raise self._interrupted
        for trouble in self._failed.values():
            raise trouble


def halt(board: Board, motor: Channels, task: int | None) -> None:
    """0 V on the motor's output, no watchdog, and no task.

    Raises
    ------
    HILError
        If the board refused something, after all else was done all the same.
    """
    steps = _Steps()
    clear = partial(steps.take, "watchdog_clear", board.watchdog_clear)
    write = partial(steps.take, "write_analog", partial(board.write_analog, motor, 1, np.zeros(1)))
    stop_watchdog = partial(steps.take, "watchdog_stop", board.watchdog_stop)
    if _at_zero(clear, write):
        stop_watchdog()
    else:
        # One that expires again at once lets nothing be written before it is stopped.
        clear()
        stop_watchdog()
        if not write():
            steps.take("watchdog_start", partial(board.watchdog_start, WATCHDOG_TIMEOUT))
    if task is not None:
        steps.take("task_stop", partial(board.task_stop, task))
        steps.take("task_delete", partial(board.task_delete, task))
    steps.finish()


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C waits until the end of this, for it comes most easily just when a bench is let go.

    Pressed twice, it does not wait. Only the main thread hears it, and only there it has to.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    pressed: list[Any] = []

    def later(*event: Any) -> None:
        if pressed:
            before(*event)
        pressed.append(event)

    signal.signal(signal.SIGINT, later)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if pressed:
            before(*pressed[0])


def _at_zero(clear: Callable[[], bool], write: Callable[[], bool]) -> bool:
    for _attempt in range(_AGAIN):
        clear()
        if write():
            return True
    return False


def reason(error: BaseException) -> str:
    """Why a run ended, for a recording."""
    text = error.get_error_message() if isinstance(error, HILError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
