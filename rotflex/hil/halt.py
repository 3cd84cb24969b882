"""To 0 V, whatever fails on the way, and what is known of the motor afterwards.

What a board does between the expiry of its watchdog and the next write is not documented: once cleared, the watchdog
may stand, run on, or expire again at once; the outputs may jump back to what they were. So no single order is counted
on: 0 V is written until the board has taken it, and only then is the watchdog stopped. A board that does not take it is
asked again for two seconds, and left with its watchdog running, which sets 0 V where it can.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from rotflex.errors import BenchError, MotorNotStopped
from rotflex.hil.connection import Connection, Outcome

PATIENCE = 2.0  #: s; for so long a board is asked to take 0 V
#: What ends a program from outside: a stopped kernel, a closed terminal. Windows knows no SIGHUP.
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
_AGAIN = 3  # times; a watchdog that expires again in between does so within its time-out, which is far longer
_PAUSE = 0.02  # s, before a board that refused 0 V is asked again


class _Steps:
    """Steps of which each is taken, whatever became of those before it; the first failure is kept."""

    def __init__(self) -> None:
        self.failed: dict[str, Exception] = {}
        self.interrupted: BaseException | None = None

    def take(self, name: str, step: Callable[[], object]) -> bool:
        """Take a step, and return whether it worked. One that works in the end has not failed."""
        try:
            step()
        except Exception as trouble:
            self.failed.setdefault(name, trouble)
            return False
        except BaseException as interrupt:  # somebody pressed Ctrl-C: not before the motor is at 0 V
            self.interrupted = interrupt
            return False
        self.failed.pop(name, None)
        return True


def halt(connection: Connection, patience: float | None) -> None:
    """Set 0 V on the motor's output, stop the watchdog, and delete the task.

    Parameters
    ----------
    connection : with an open board
    patience : for how long a board that refuses 0 V is asked again, s; None for once only

    Raises
    ------
    MotorNotStopped
        If the board did not take 0 V; it has the outcome.
    HILError
        If the board refused another step. All steps were tried before.
    """
    steps, board = _Steps(), connection.board
    clear = partial(steps.take, "watchdog_clear", board.watchdog_clear)
    write = partial(steps.take, "write_analog", connection.write_zero)
    stop_watchdog = partial(steps.take, "watchdog_stop", connection.stop_watchdog)
    if patience is not None:
        clear()
    if not write() and patience is not None:
        before = connection.outcome()
        if not before.at_zero:
            print(f"{before} Setting it to 0 V is tried again …", file=sys.stderr, flush=True)
        _keep_trying(clear, write, stop_watchdog, time.monotonic() + (0.0 if before.at_zero else patience))
    if "write_analog" not in steps.failed:
        stop_watchdog()
    elif patience is not None:  # else it runs since the last time
        steps.take("watchdog_start", connection.start_watchdog)
    if (task := connection.task) is not None:
        connection.task = None
        steps.take("task_stop", partial(board.task_stop, task))
        steps.take("task_delete", partial(board.task_delete, task))
    _raise_failed(steps, connection.outcome())


def _keep_trying(
    clear: Callable[[], bool], write: Callable[[], bool], stop_watchdog: Callable[[], bool], end: float
) -> None:
    """Write 0 V until the board takes it, or the time is over."""
    attempt = 1
    while True:
        attempt += 1
        clear()
        if attempt > _AGAIN:  # one that expires again at once lets nothing be written before it is stopped
            stop_watchdog()
        if write() or (attempt > _AGAIN and time.monotonic() >= end):
            return
        if attempt > _AGAIN:
            time.sleep(_PAUSE)


def _raise_failed(steps: _Steps, outcome: Outcome) -> None:
    """Raise what failed: a motor that was not stopped first, then an interrupt."""
    trouble = next(iter(steps.failed.values()), None)
    if not outcome.at_zero:
        failure = MotorNotStopped(*(trouble.args if trouble is not None else ()))
        note(failure, outcome)
        raise failure from trouble
    error = steps.interrupted or trouble
    if error is not None:
        note(error, outcome)
        raise error


def note(error: BaseException, outcome: Outcome) -> None:
    """Add to an error what is known of the motor: a bench's error says it itself, another one in a note."""
    if not isinstance(error, BenchError) and getattr(error, "outcome", None) != outcome:
        error.add_note(str(outcome))
    error.outcome = outcome  # type: ignore[attr-defined]  # any exception carries it


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C and other signals until the end, for they come most easily just when a bench is closed.

    What is done meanwhile takes a few seconds at most, however often they come. Only the main thread hears them, and
    only there they have to be.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in (*_ENDING, signal.SIGINT)}
    before: dict[int, Any] = {number: handler for number, handler in handlers.items() if callable(handler)}
    came: dict[int, Any] = {}
    is_interrupted = isinstance(sys.exception(), KeyboardInterrupt)

    def later(number: int, frame: Any) -> None:
        if not (number == signal.SIGINT and is_interrupted):  # pressed again: it ends by Ctrl-C already
            came[number] = frame

    for number in before:
        signal.signal(number, later)
    try:
        yield
    except MotorNotStopped:  # comes before whatever a signal means
        came.clear()
        raise
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

    def stop_listening(self, outcome: Outcome | None) -> None:
        """Restore the earlier handlers, and raise the signal that came again, so that they see it.

        Where the motor may not be at 0 V it is not raised: the program shall live to say so, and end by that error.
        """
        if threading.current_thread() is threading.main_thread():
            before, self._before = self._before, {}
            for number, handler in before.items():
                signal.signal(number, handler)
            came, self._came = self._came, 0
            if came and (outcome is None or outcome.at_zero):
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


def reason(error: BaseException) -> str:
    """Return why a run ended, for a recording."""
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
