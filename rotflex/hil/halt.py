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
#: What ends a program from outside: a stopped kernel, a closed terminal. Windows knows no SIGHUP.
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
_AGAIN = 3  # times; a watchdog that expires again in between does so within its time-out, which is far longer


class _Steps:
    """Steps of which each is taken, whatever became of those before it; the first failure is kept."""

    def __init__(self) -> None:
        self._failed: dict[str, Exception] = {}
        self._interrupted: BaseException | None = None

    def take(self, name: str, step: Callable[[], object]) -> bool:
        """Take a step, and return whether it worked. One that works in the end has not failed."""
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
    """Set 0 V on the motor's output, stop the watchdog, and delete the task.

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
    """Hold back Ctrl-C and other signals until the end, for they come most easily just when a bench is closed.

    What comes twice does not wait. Only the main thread hears it, and only there it has to.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in (*_ENDING, signal.SIGINT)}
    before: dict[int, Any] = {number: handler for number, handler in handlers.items() if callable(handler)}
    came: dict[int, Any] = {}

    def later(number: int, frame: Any) -> None:
        if number in came:
            before[number](number, frame)
        came[number] = frame

    for number in before:
        signal.signal(number, later)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in [number for number in before if number in came][:1]:  # the end of the program before Ctrl-C
            before[number](number, came[number])


class ProgramEnded(SystemExit):
    """The system, or a person, ends the program by a signal."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self._name = signal.Signals(number).name

    def __str__(self) -> str:
        return f"{self._name} ended the program."


class Ending:
    """Signals that end the program while a bench is open: 0 V first, and then what they mean.

    Parameters
    ----------
    is_sampling : whether the main thread is in the middle of a run, which then ends by :class:`ProgramEnded`
    close : closes the bench at 0 V, and calls :meth:`stop_listening`
    """

    def __init__(self, is_sampling: Callable[[], bool], close: Callable[[], None]) -> None:
        self._is_sampling, self._close = is_sampling, close
        self._before: dict[int, Any] = {}
        self._came = 0

    def listen(self) -> None:
        """Start listening, in the main thread only. A signal that is ignored, as under nohup, stays ignored."""
        if threading.current_thread() is threading.main_thread():
            for number in _ENDING:
                before = signal.getsignal(number)
                if before not in (signal.SIG_IGN, None):
                    self._before[number] = before
                    signal.signal(number, self._hear)

    def stop_listening(self) -> None:
        """Restore the earlier handlers, and raise the signal that came again, so that they see it."""
        if threading.current_thread() is threading.main_thread():
            before, self._before = self._before, {}
            for number, handler in before.items():
                signal.signal(number, handler)
            came, self._came = self._came, 0
            if came:
                signal.raise_signal(came)

    def require_none(self) -> None:
        """Raise :class:`ProgramEnded` in a run of another thread, if a signal came."""
        if self._came:
            raise ProgramEnded(self._came)

    def _hear(self, number: int, _frame: Any) -> None:
        if not self._came:
            self._came = number
            if self._is_sampling():
                raise ProgramEnded(number)
            self._close()


def _at_zero(clear: Callable[[], bool], write: Callable[[], bool]) -> bool:
    for _attempt in range(_AGAIN):
        clear()
        if write():
            return True
    return False


def reason(error: BaseException) -> str:
    """Return why a run ended, for a recording."""
    text = error.get_error_message() if isinstance(error, HILError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
