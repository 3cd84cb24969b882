"""An experiment in a thread of its own: it can be watched while it runs, and stopped at any sample.

In a browser there are no threads. An experiment there gives way whenever it waits for real time, if the browser can put
a program aside (:func:`can_wait`); if it cannot, the experiment runs as a whole.
"""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.scene.explorer import KernelLoop
from rotflex.errors import BenchError, MotorNotStopped, RotflexError, RunStopped
from rotflex.hil.bench import Bench, Measurement, Outcome
from rotflex.recording import Recording

_LATE = 1.0  # sample times after which a sample counts as missed
_SWITCH = 0.0005  # s; how often threads take turns, so that the page does not hold up the loop
_FIRST = 4096  # samples there is room for to begin with
_REST = 0.004  # s; then some samples are computed at a time
_BEHIND = 0.05  # s; simulated time that is later than this stays so: it does not hurry to catch up

Experiment = Callable[[Bench], Recording]


def can_wait() -> bool:
    """Return whether a run can wait while the page is heard: always with threads, else if a browser can put it aside.

    Ask within a task of the loop: there a run is, and what JavaScript calls directly can be put aside nowhere.
    """
    if KernelLoop.threads:
        return True
    from pyodide.ffi import can_run_sync

    return bool(can_run_sync())


class Running:
    """One run of an experiment.

    Parameters
    ----------
    bench : an open bench
    experiment : what to run on it
    alive : asked now and then; text that is not empty stops the run, and is the reason
    paced : whether a bench in simulated time waits, so that it can be watched; what it records is the same. Without
        threads, one that does not wait has ended when :meth:`start` returns

    Attributes
    ----------
    recording : when it is done, or None
    error : why it ended early, or None
    late : samples that came more than a sample time late, where time does not wait
    outcome : what is known of the motor in the end; None before
    at_zero : when it was set to 0 V, by the computer's clock (s since 1970)
    """

    def __init__(
        self, bench: Bench, experiment: Experiment, alive: Callable[[], str] = lambda: "", paced: bool = False
    ) -> None:
        self._bench, self._experiment, self._alive = bench, experiment, alive
        self._paced = paced and bench.is_simulated
        self._samples = np.empty((_FIRST, 4))
        self._count = 0
        self._asked: str = ""
        self._stopped = threading.Event()
        self._due = 0.0
        self.recording: Recording | None = None
        self.error: Exception | None = None
        self.late = 0
        self.outcome: Outcome | None = None
        self.at_zero: float | None = None
        self._ended = threading.Event()

    def start(self) -> None:
        """Begin."""
        if KernelLoop.threads:
            threading.Thread(target=self._run, name="rotflex-experiment", daemon=True).start()
        elif self._paced:
            asyncio.get_running_loop().call_soon(self._run)
        else:
            self._run()

    def stop(self, reason: str = "") -> None:
        """Ask it to stop: at the next sample, within milliseconds, the motor is at 0 V."""
        self._asked = self._asked or reason or "You stopped it."
        self._stopped.set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it has ended, and whether it has; without threads there is no waiting."""
        return self._ended.wait(timeout) if KernelLoop.threads else self.done

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    def samples(self, latest: float = np.inf) -> NDArray[np.float64]:
        """(4, n) time (s), theta, alpha (rad) and voltage (V) of the last so many seconds."""
        kept = self._samples[: self._count]
        if kept.size and latest < np.inf:
            kept = kept[np.searchsorted(kept[:, 0], kept[-1, 0] - latest) :]
        return kept.T.copy()

    def _run(self) -> None:
        before = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH)
        self._bench.on_sample = self._note
        try:
            self.recording = self._experiment(self._bench)
        except Exception as error:
            self.error = error
        finally:
            self._bench.on_sample = None
            sys.setswitchinterval(before)
            self._end()

    def _end(self) -> None:
        """0 V, whatever happened; experiments see to it themselves, and this makes sure."""
        try:
            self._bench.stop()
        except Exception as error:
            self.error = self.error or error
        finally:
            self.outcome = self._bench.safety.outcome
            self.at_zero = time.time() if self.outcome is not None and self.outcome.at_zero else None
            self._ended.set()

    def _note(self, measured: Measurement, voltage: float) -> None:
        reason = self._asked or self._alive()  # read once: stop() is called from other threads
        if reason:
            raise RunStopped(reason)
        now, sample = time.perf_counter(), measured.time
        if sample == 0.0:  # an experiment begins: the wait for rest before it has times of its own
            self._count, self.late, self._due = 0, 0, now
        previous = self._samples[self._count - 1, 0] if self._count else 0.0
        if not self._bench.is_simulated and now - self._due - sample > _LATE * (sample - previous):
            self.late += 1
        if self._count == len(self._samples):
            self._samples = np.concatenate([self._samples, np.empty_like(self._samples)])
        self._samples[self._count] = (*measured, voltage)
        if self._paced:
            self._wait_for(sample, now)
        self._count += 1

    def _wait_for(self, sample: float, now: float) -> None:
        """Wait until a sample's time, or for STOP: simulated time is never ahead. On a busy computer it goes slower."""
        self._due = max(self._due, now - sample - _BEHIND)
        if (ahead := self._due + sample - now) > 0:
            self._rest(ahead + _REST)

    def _rest(self, seconds: float) -> None:
        if KernelLoop.threads:
            self._stopped.wait(seconds)
            return
        from pyodide.ffi import run_sync

        run_sync(asyncio.sleep(seconds))


def outcome(run: Running) -> tuple[str, str]:
    """Return how a run ended: a word, and a sentence for its user. Call it when nothing more is waited for."""
    error: Any = run.error
    if run.outcome is None or not run.outcome.at_zero:
        motor = run.outcome or "The motor may still be driven. Press the emergency stop."
        why = "The bench does not answer." if error is None else f"{type(error).__name__}: {error}"
        return "NOT AT 0 V", str(error) if isinstance(error, MotorNotStopped) else f"{motor} {why}"
    if error is None:
        return "finished", f"The experiment is finished. {run.outcome}"
    why = str(error) if isinstance(error, RotflexError) else f"The experiment ended ({type(error).__name__}: {error})."
    says_it = isinstance(error, BenchError) and error.outcome is not None
    return "stopped" if isinstance(error, RunStopped) else "ended", why if says_it else f"{why} {run.outcome}"
