"""The calibrated bench: radians and volts above a data-acquisition board, within limits, and 0 V in the end.

    with hil.open("virtual:?seed=7") as bench:
        bench.start(sample_time=0.002)
        measured = bench.read()        # waits for the next sample
        bench.write(1.5)               # volts at the motor

However a ``with`` block ends, the motor is at 0 V afterwards. Should the program stop without a word, the board's
watchdog sets 0 V, where it works; commissioning tests that. The hardware's emergency stop remains the first safeguard.

Where time does not wait for the program, a read gives the newest sample: those that waited behind a pause are in
``late``, for whoever wants them, and no voltage is written for them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike

from rotflex.config import Joint, Servo, check_mounted
from rotflex.doubts import of_samples
from rotflex.errors import BenchError, HILError, LimitExceeded, MotorNotStopped, WatchdogExpired
from rotflex.hil.board import WATCHDOG_TIMEOUT, Board
from rotflex.hil.connection import Connection, Outcome, Wiring
from rotflex.hil.guard import SLOWEST, Limits, Measurement, at
from rotflex.hil.halt import Ending, reason, uninterrupted
from rotflex.hil.pace import Pace
from rotflex.hil.recorder import Recorder
from rotflex.hil.safety import Mark, Safety
from rotflex.plant import Plant
from rotflex.unanswered import TIMING

_NO_PUSH = (
    "A program can push the arm only on a virtual bench in simulated time, with rotflex's own plant. Leave out "
    "disturbance= here. On a real bench, push the arm by hand, with care."
)
_REST, _REST_TRIES = 0.1, 20  # s without a count, after which the servo is at rest, and how often that is awaited

#: What pushes the arm of a virtual bench: (the sample that was just taken, the plant) → torque on the link, N·m.
Push = Callable[[Measurement, Plant], float]

__all__ = ["Bench", "Connection", "Limits", "Mark", "Measurement", "Outcome", "Recorder", "Safety", "Wiring"]


class Bench:
    """A bench: the way to its board, its parts as the data sheet states them, what keeps it safe, and what it records.

    Parameters
    ----------
    connection : to the board, which is opened on entering the ``with`` block
    servo, joint : nominal parameters, as the student is told them
    identity : plain data that says which bench this is; goes into every recording
    safety : what keeps it from harm, and what is known of the motor in the end
    recorder : for what is recorded

    Attributes
    ----------
    late : the samples that waited before the one that was read last, where time does not wait
    running : held by whoever runs something, until what it recorded is kept
    on_sample : called once a sample, with what was measured and the voltage that is about to be set, or was held where
        the sample came late; None for nobody.
        What it raises ends the experiment before that voltage is set: so a run is watched, and stopped from elsewhere.
    is_left_alone : whether reads leave the watchdog to expire, as its test does; not so any more from the next start on
    """

    def __init__(
        self,
        connection: Connection,
        servo: Servo,
        joint: Joint,
        identity: Mapping[str, Any],
        safety: Safety | None = None,
        recorder: Recorder | None = None,
    ) -> None:
        self.connection, self.safety, self.recorder = connection, safety or Safety(), recorder or Recorder()
        self.servo, self.joint, self.identity = check_mounted(servo), joint, dict(identity)
        self.on_sample: Callable[[Measurement, float], None] | None = None
        self.is_left_alone = False
        self.late: list[Measurement] = []
        self.latest = Measurement(0.0, 0.0, 0.0)
        self.running = threading.RLock()
        self._ending = Ending(self._is_sampling_here, self._close_after_run)
        self._sampled_by = 0  # a thread
        self._pace: Pace | None = None
        self._push: Push | None = None
        self._sample = 0
        self._sample_time = 0.0
        self._counts = np.zeros(2, dtype=np.int32)
        self._begun = (0, 0)  # counts from which angles are counted
        self._answered = 0, (0.0, 0.0)  # the sample that was answered last; voltages before that answer, and since

    def __repr__(self) -> str:
        described = ", ".join(f"{key}={value}" for key, value in self.identity.items())
        return f"<Bench: {described}; {'open' if self.connection.is_open else 'closed'}>"

    @property
    def board(self) -> Board:
        """The open board; raises :class:`BenchError` if the bench is not open."""
        return self.connection.board

    # --- open and close -------------------------------------------------------------------------------------------

    def __enter__(self) -> Self:
        if self.connection.is_open:
            raise BenchError("The bench is open already.")
        self.safety.outcome = None
        try:
            if not self.is_simulated:
                self._ending.listen()
            self.connection.open()
            if self.safety.mark is not None:
                self.safety.mark.find(self.connection.counts()[0])
        except BaseException:
            self._close()
            raise
        return self

    def renew(self) -> None:
        """Connect a virtual bench anew, so that an experiment does not depend on what ran before it."""
        if self.connection.virtual and self.board.is_valid():
            self._close()
            self.__enter__()

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        try:
            self._close()
        except HILError as failure:  # it is shown in place of the first one, which says in notes where the samples are
            for text in getattr(error, "__notes__", ()) if failure is not error else ():
                if text not in getattr(failure, "__notes__", ()):
                    failure.add_note(text)
            if isinstance(error, MotorNotStopped):  # which says so, and by what the run ended
                return
            raise

    def _close(self) -> None:
        """Set 0 V, then close the board; each is tried whatever happens to the other."""
        try:
            with uninterrupted():
                if not self.connection.is_open:
                    return
                try:
                    if self.board.is_valid():
                        self.safety.halt(self.connection)
                        self._save_mark()
                finally:
                    self.connection.close()
        finally:
            self._ending.stop_listening(self.safety.outcome)

    def _close_after_run(self) -> None:
        """Close, once a run of another thread has ended."""
        self.running.acquire(timeout=1.0)
        self._close()

    def _is_sampling_here(self) -> bool:
        return self.connection.task is not None and self._sampled_by == threading.get_ident()

    # --- where theta is zero --------------------------------------------------------------------------------------

    def set_zero(self) -> None:
        """Take where the arm stands now as its mark, about which the servo's angle is limited."""
        self.stop()
        if self.safety.mark is not None:
            self.safety.mark.set(self.connection.counts()[0])

    @property
    def begun(self) -> float:
        """Where the last run began, rad from the mark; 0 where there is none."""
        return self._from_mark(self._begun[0])

    @property
    def place(self) -> float:
        """Where the servo stands now, rad from the mark; 0 where there is none."""
        return self._from_mark(self.connection.counts()[0]) if self.safety.mark is not None else 0.0

    def _from_mark(self, counts: int) -> float:
        mark = self.safety.mark
        return 0.0 if mark is None or mark.zero is None else (counts - mark.zero) * self.connection.K_theta

    def _save_mark(self) -> None:
        """Save what the servo's counter reads, once the servo has come to rest. What fails here is asked next time."""
        mark = self.safety.mark
        with suppress(HILError, OSError):
            if mark is not None and mark.zero is not None:
                read = [self.connection.counts()[0]]
                while read[-1:] != read[-2:-1] and len(read) <= _REST_TRIES:
                    time.sleep(_REST)
                    read.append(self.connection.counts()[0])
                mark.save(read[-1])

    # --- an experiment --------------------------------------------------------------------------------------------

    def start(self, sample_time: float, zero: bool = True) -> None:
        """Begin to sample, with the angles counted from where the arm stands now.

        Parameters
        ----------
        sample_time : s
        zero : False goes on counting from where it was begun last

        Raises
        ------
        BenchError
            If the bench is not open, or the sample time is too long for its watchdog or its guard.
        """
        if not 0 < sample_time < WATCHDOG_TIMEOUT or (self.safety.guard and sample_time > SLOWEST):
            raise BenchError(
                f"The sample time is {sample_time!r} s. It must be positive, and shorter than the {WATCHDOG_TIMEOUT} s "
                f"after which the watchdog stops the motor. Where a guard watches the bench, it is at most {SLOWEST} s."
            )
        self.stop()
        if zero:
            self._begun = self.connection.counts()
        self._sample, self._sample_time = 0, sample_time
        self._pace, self.late, self.is_left_alone = None, [], False
        self._answered = 0, (0.0, 0.0)
        self.safety.start(sample_time, self.begun)
        self._sampled_by = threading.get_ident()
        self.connection.start_sampling(sample_time, self.is_simulated)
        if not self.is_simulated:
            clock = "hardware" if self.connection.clock >= 0 else "software"
            self._pace = Pace(sample_time, clock, self.connection.now)

    @property
    def is_simulated(self) -> bool:
        """Whether time waits for the program."""
        return self.identity.get("clock") == "simulated"

    def read(self) -> Measurement:
        """Wait for the next sample; where several waited already, the newest is given and the others are ``late``.

        Raises
        ------
        LimitExceeded
            If an angle is past its limit, or the servo moves as it could not. The motor is at 0 V then.
        HILError
            If the board gives no sample, or its watchdog has expired.
        BenchError
            If the bench is not open, or not sampling, or answers come too slowly.
        """
        if self.board and self.connection.task is None:
            raise BenchError("The bench is not sampling; call start() first.")
        try:
            self.connection.fetch(self._counts, 1)
        except HILError as error:
            self._require_alive(error)
            raise
        self.late = []
        came, lost = ([self._counts.tolist()], 0) if self._pace is None else self._all_here(self._pace)
        self._sample += lost
        measured = self._taken(came[0], 1 + lost)
        for counts in came[1:]:
            self.late.append(measured)
            measured = self._taken(counts)
        self._show_alive()
        return measured

    def _show_alive(self) -> None:
        if not self.is_left_alone and not self.board.watchdog_reload():
            self._end(WatchdogExpired(self._why_expired()))

    def _require_alive(self, error: HILError) -> None:
        """Raise :class:`WatchdogExpired` if that is why the board refused something."""
        expired = False
        with suppress(HILError):
            expired = not self.is_left_alone and self.board.watchdog_is_expired()
        if expired:
            self._end(WatchdogExpired(self._why_expired()), error)

    def _why_expired(self) -> str:
        """Return why the board's watchdog has expired: too slow a controller, a board that was silent, or a pause."""
        pace = self._pace
        if pace is not None and pace.too_slow:
            return pace.too_slow
        if pace is not None and pace.waited >= WATCHDOG_TIMEOUT:
            silent = f"No sample came from the board for {pace.waited:.2f} s, so that its watchdog expired"
            try:
                asked = pace.now()
                self.connection.fetch(self._counts, 1)
                if pace.blocked(asked, pace.now()):  # else the next one waited already: the computer had paused
                    return f"{silent}: the board was silent. Look at its power and its cables."
            except HILError:  # it gives no samples before it is cleared
                return f"{silent}: the board was silent, or this computer paused. Look at the board's power and cables."
        return (
            f"The program did not show for {WATCHDOG_TIMEOUT:g} s that it was alive, so the board's watchdog expired. "
            "Close what else keeps this computer busy, and run it again."
        )

    def _taken(self, counts: list[int], samples: int = 1) -> Measurement:
        """Return the next sample from its counts, within the limits; ``samples`` after the one before."""
        theta = (counts[0] - self._begun[0]) * self.connection.K_theta
        alpha = (counts[1] - self._begun[1]) * self.connection.K_alpha
        measured = Measurement(self._sample * self._sample_time, theta, alpha)
        self._sample += 1
        self.latest = measured
        supervision = self.safety.supervision
        if supervision is not None and self.overdue:
            supervision.drive(self.held(self._sample - 2))  # what the motor had until this sample
        if supervision is not None and (why := supervision.see(measured, samples)):
            late = of_samples(self.timing, self._sample)
            self._end(LimitExceeded(f"{late} {why}" if late and late.refuses else why))
        return measured

    def _all_here(self, pace: Pace) -> tuple[list[list[int]], int]:
        """Return the counts of the sample that has just come and of those that wait; and how many were lost before."""
        if stale := pace.stale(self._sample):  # they are dropped by reading, for flushing has no effect on readers
            self.connection.fetch(np.zeros(2 * stale, dtype=np.int32), stale)
            self._show_alive()
            self.connection.fetch(self._counts, 1)
        came, lost, behind = [self._counts.tolist()], 0, pace.arrived(self._sample)
        if behind and pace.too_slow and self.safety.guard is not None:  # a virtual bench may be on a busy computer
            self._end(LimitExceeded(at(pace.too_slow, self.latest.time)))
        if behind:
            self._show_alive()
        while behind:
            self.connection.fetch(self._counts, 1)
            came.append(self._counts.tolist())
            behind, lost = pace.fetched(self._sample + len(came) - 1)
        pace.skipped(self._sample, lost, len(came) - 1)
        return came, lost

    def write(self, voltage: float) -> float:
        """Set the motor voltage (V), cut to the limits, and return what was set.

        Raises
        ------
        BenchError
            If the voltage is not a finite real number, or the bench is not sampling; the motor is at 0 V then.
        LimitExceeded
            If it exceeds the lower limit of a bench that has not been commissioned; the motor is at 0 V then.
        HILError
            If the board refuses it, as when its watchdog has expired.
        """
        if np.iscomplexobj(voltage):  # numpy's compare, and lose their imaginary part on the way to the board
            self._end(BenchError(f"The controller asked for {voltage} V; a voltage is a real number."))
        most = self.v_max
        applied = min(max(voltage, -most), most)
        if applied != voltage:
            self._refuse_beyond(voltage)  # raises for NaN, which equals nothing, and where nothing may be cut
        if self.board and applied and self.connection.task is None:  # no watchdog runs that would stop the motor
            self._end(BenchError("The bench is not sampling, so the motor is not driven; call start() first."))
        self._ending.require_none()
        supervision = self.safety.supervision
        if applied and supervision is not None and not supervision.is_driven:
            try:
                self.safety.require_place(self.begun + self.latest.theta)
            except BenchError as error:
                self._end(error)
        if self.on_sample is not None:
            self.on_sample(self.latest, applied)
        try:
            try:
                self.connection.write(applied)
            finally:
                if self._pace is not None:
                    self._pace.answered()
        except HILError as error:
            self._require_alive(error)
            raise
        self._answered = self.sample, (self._answered[1][1], applied)
        if supervision is not None:
            supervision.drive(applied)
        return applied

    def _refuse_beyond(self, voltage: float) -> None:
        """Raise where a voltage may not be cut to the limit: it is no number, or the limits have a reason."""
        if not np.isfinite(voltage):
            self._end(BenchError(f"The controller asked for {voltage} V; check the gain."))
        if self.safety.limits.why:
            why = f"The controller asked for {voltage:.1f} V, and the limit is ±{self.v_max:g} V."
            self._end(LimitExceeded(at(why, self.latest.time, self.safety.limits.why)))

    def disturb(self, torque: ArrayLike | Push | None) -> None:
        """Push the arm in the runs from now on, each sample until the next one; a recording has it as ``tau_link``.

        Parameters
        ----------
        torque : on the link, N·m, one value a sample from the beginning of each run, as a recording's ``tau_link``; or
            a function of the sample that was just taken and of the plant; None for no push

        Raises
        ------
        BenchError
            If this is no virtual bench in simulated time, or the torque is not a list of finite numbers.
        """
        if torque is not None and not (self.connection.virtual and self.is_simulated and not self.connection.recorded):
            raise BenchError(_NO_PUSH)
        if torque is None or callable(torque):
            self._push = torque
            return
        values = np.asarray(torque, dtype=float)
        if values.ndim != 1 or not np.isfinite(values).all():
            raise BenchError("A disturbance must be a one-dimensional array of finite numbers: torques in N·m.")
        self._push = lambda _measured, _plant: float(values[self.sample]) if self.sample < values.size else 0.0

    def push(self) -> float:
        """Let the disturbance act on the link until the next sample, and return its torque, N·m."""
        if self._push is None:
            return 0.0
        plant = getattr(self.board, "plant", None)
        if not isinstance(plant, Plant):
            raise BenchError(_NO_PUSH)
        plant.torque = self._push(self.latest, plant)
        return plant.torque

    @property
    def sample(self) -> int:
        """Which sample of the run was read last; -1 before the first."""
        return self._sample - 1

    @property
    def overdue(self) -> int:
        """How many periods late the voltage was written that was there when the last sample was read."""
        return 0 if self._pace is None else self._pace.overdue

    def held(self, sample: int) -> float:
        """Return which voltage (V) the motor had after a sample, from the one answered last to the one read last."""
        answered, (before, since) = self._answered
        return before if sample < answered + self.overdue else since

    @property
    def timing(self) -> dict[str, Any]:
        """How steadily the last run's samples came, a few numbers; nothing where time waits."""
        return {} if self._pace is None else {TIMING: self._pace.report()}

    def stop(self) -> None:
        """Set 0 V, and take no more samples. Nothing pushes the arm any more.

        Raises
        ------
        MotorNotStopped
            If the board does not take 0 V.
        """
        plant = getattr(self.board, "plant", None)
        if isinstance(plant, Plant):
            plant.torque = 0.0
        self.safety.halt(self.connection)

    @property
    def v_max(self) -> float:
        """The voltage to which larger commands are cut, or beyond which they are refused, V."""
        return min(self.safety.limits.voltage, self.servo.V_max)

    def _end(self, error: BenchError, cause: Exception | None = None) -> NoReturn:
        """Set 0 V, and raise an error, with what became of the motor."""
        try:
            self.stop()
        except MotorNotStopped as failure:
            failure.add_note(f"Before that: {reason(error)}")
            raise
        error.outcome = self.safety.outcome
        raise error from cause
