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

import json
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike

from rotflex import files
from rotflex.config import Joint, Servo, check_mounted
from rotflex.errors import BenchError, ConfigurationError, HILError, LimitExceeded, WatchdogExpired
from rotflex.hil.board import Board, BufferOverflowMode, Clock, Counts, DigitalState
from rotflex.hil.guard import SLOWEST, Guard, Limits, Measurement, Supervision, at
from rotflex.hil.halt import WATCHDOG_TIMEOUT, Ending, halt, uninterrupted
from rotflex.hil.pace import Pace
from rotflex.hil.replay import RecordedPlant
from rotflex.plant import Plant
from rotflex.recording import Recording
from rotflex.unanswered import TIMING

_FOREVER = 2**32 - 1
_NO_MARK = (
    "It is not known how far the arm is from its mark: the servo's counter does not read what it read when this bench "
    "was closed last, as after power-off, or after somebody turned the arm. With the amplifier off, turn the arm back "
    "to its mark, where theta was set to zero in the commissioning, and look that no cable is twisted."
)
_TESTED = "rotflex bench setup tests with the motor whether the watchdog still sets 0 V."
#: What the user does about a board that refuses a verb which it need not have.
_TO_DO = {
    "watchdog_set_analog_expiration_state": _TESTED,
    "watchdog_set_digital_expiration_state": _TESTED,
    "task_set_buffer_overflow_mode": "Runs go on, but a program that pauses for a second ends its run with an error.",
    "set_encoder_quadrature_mode": "rotflex bench setup counts a full turn, and so finds whether all edges count.",
    "set_encoder_filter_frequency": "The board keeps its own filter: set filter = 0 in bench.toml.",
}
_NO_PUSH = (
    "A program can push the arm only on a virtual bench in simulated time, with rotflex's own plant. Leave out "
    "disturbance= here. On a real bench, push the arm by hand, with care."
)
_REST, _REST_TRIES = 0.1, 20  # s without a count, after which the servo is at rest, and how often that is awaited
_A_FEW = 5  # counts, half a degree
_THIS_PROGRAM = uuid.uuid4().hex

#: What pushes the arm of a virtual bench: (the sample that was just taken, the plant) → torque on the link, N·m.
Push = Callable[[Measurement, Plant], float]

__all__ = ["WATCHDOG_TIMEOUT", "Bench", "Limits", "Mark", "Measurement", "Safety", "Wiring"]


@dataclass(frozen=True)
class Wiring:
    """Which channels the bench is wired to, and which way.

    A positive voltage turns the servo the positive way, and a positive turn counts up, where a sign is 1. By default
    it is as on the virtual bench, where the link's encoder counts the other way. How a real bench is wired is found
    there, never assumed.

    digital_outputs : how many digital outputs the board has that an expired watchdog must let go

    Raises
    ------
    ConfigurationError
        If a sign is neither 1 nor -1.
    """

    motor: int = 0
    servo_encoder: int = 0
    link_encoder: int = 1
    link_sign: int = -1
    motor_sign: int = 1
    servo_sign: int = 1
    digital_outputs: int = 0

    def __post_init__(self) -> None:
        for name in ("motor_sign", "servo_sign", "link_sign"):
            if getattr(self, name) not in (1, -1):
                raise ConfigurationError(f"{name} must be 1 or -1; it is {getattr(self, name)!r}.")


class Mark:
    """Where theta is zero on a real bench: at the mark of its commissioning, however often the arm was turned since.

    Cables twist, so the limit of theta is about one place. A counter goes on counting while its board is powered. A
    small file has what it read last and what it reads at the mark; where it reads something else now, nobody knows
    where the arm stands. The file is away while the bench is open: a program that was killed leaves none.

    Parameters
    ----------
    path : of its file
    needed : whether the arm must be put at the mark where it is not known; else zero is where it stands then

    Attributes
    ----------
    zero : what the servo's counter reads at the mark; None if it is not known
    """

    def __init__(self, path: Path, needed: bool) -> None:
        self._path, self._needed = path, needed
        self.zero: int | None = None
        self._set_by = ""  # the program in which the arm merely stood there; none for a mark that a person set

    def find(self, counts: int) -> None:
        """Find the zero of a bench that was just opened; ``counts`` is what the servo's counter reads."""
        self.zero = None
        try:
            saved = json.loads(self._path.read_text(encoding="utf-8"))
            last, zero, set_by = int(saved["counts"]), int(saved["zero"]), str(saved["set_by"])
            files.patiently(self._path.unlink)
        except (OSError, ValueError, TypeError, LookupError):
            last, zero, set_by = counts, counts, "nobody"
        if abs(counts - last) <= _A_FEW and set_by in ("", "" if self._needed else _THIS_PROGRAM):
            self.zero, self._set_by = zero, set_by
        elif not self._needed:
            self.zero, self._set_by = counts, _THIS_PROGRAM

    def set(self, counts: int) -> None:
        """Take where the arm stands now."""
        self.zero, self._set_by = counts, ""

    def save(self, counts: int) -> None:
        """Save the zero of a bench that is closed; ``counts`` is what the servo's counter reads at rest.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        files.write(self._path, json.dumps({"counts": counts, "zero": self.zero, "set_by": self._set_by}) + "\n")


@dataclass(frozen=True)
class Safety:
    """What a bench has that can come to harm.

    Attributes
    ----------
    guard : watches every run for motion that cannot be
    commissioned : asked before each closed loop; returns why there is none yet on this bench, None if there may be
    folder : where samples are stored while they come, and runs that were broken off
    mark : from which the servo's angle is limited; without one it is from where each run begins
    """

    guard: Guard | None = None
    commissioned: Callable[[], str | None] | None = None
    folder: Path | None = None
    mark: Mark | None = None


class Bench:
    """A bench: its board, its parts as the data sheet states them, its limits.

    Parameters
    ----------
    connect : opens the board; called on entering the ``with`` block
    servo, joint : nominal parameters, as the student is told them
    identity : plain data that says which bench this is; goes into every recording
    limits, wiring : as above
    recorded : the recording that moves in the plant's place, on a replay
    safety : for a bench that can come to harm
    clock : of the board, that paces the samples
    now : the computer's time, s
    prepare : sets up the board, once its watchdog is stopped and 0 V written: options, ranges, quadrature, filters
    virtual : whether `connect` makes a new plant, at rest

    Attributes
    ----------
    late : the samples that waited before the one that was read last, where time does not wait
    kept : what the last run recorded that did not end as it should, with the reason in its metadata
    kept_in : the file in which that is saved; None if it is in none
    running : held by whoever runs something, until what it recorded is kept
    on_sample : called once a sample, with what was measured and the voltage that is about to be set, or was held where
        the sample came late; None for nobody.
        What it raises ends the experiment before that voltage is set: so a run is watched, and stopped from elsewhere.
    is_left_alone : whether reads leave the watchdog to expire, as its test does; not so any more from the next start on
    refused : what the board refused that it need not have, by verb, with what to do
    on_recorded : called with the recording of each experiment, once it is whole; None for nobody
    """

    def __init__(
        self,
        connect: Callable[[], Board],
        servo: Servo,
        joint: Joint,
        identity: Mapping[str, Any],
        limits: Limits | None = None,
        wiring: Wiring | None = None,
        recorded: RecordedPlant | None = None,
        safety: Safety | None = None,
        clock: int = Clock.HARDWARE_CLOCK_0,
        now: Callable[[], float] = time.perf_counter,
        prepare: Callable[[Bench], None] | None = None,
        virtual: bool = False,
    ) -> None:
        self.servo = check_mounted(servo)
        self.joint = joint
        self.identity = dict(identity)
        self.limits = limits or Limits()
        self.recorded = recorded
        self.safety = safety or Safety()
        self._clock, self._now = clock, now
        self._connect, self._prepare, self._virtual = connect, prepare, virtual
        self._wiring = wiring or Wiring()
        self.on_sample: Callable[[Measurement, float], None] | None = None
        self.on_recorded: Callable[[Recording], object] | None = None
        self.refused: dict[str, str] = {}
        self._push: Push | None = None
        self.is_left_alone = False
        self.late: list[Measurement] = []
        self.kept: Recording | None = None
        self.kept_in: Path | None = None
        self.latest = Measurement(0.0, 0.0, 0.0)
        self.running = threading.RLock()
        self._ending = Ending(self._is_sampling_here, self._close_after_run)
        self._sampled_by = 0  # a thread
        self._pace: Pace | None = None
        self._supervision: Supervision | None = None  # of a run
        self._board: Board | None = None
        self._task: int | None = None
        self._sample = 0
        self._sample_time = 0.0
        self._motor = np.array([self._wiring.motor], dtype=np.uint32)
        self._encoders = np.array([self._wiring.servo_encoder, self._wiring.link_encoder], dtype=np.uint32)
        self._counts = np.zeros(2, dtype=np.int32)
        self._begun = (0, 0)  # counts from which angles are counted
        self._volts = np.zeros(1)
        self._K_theta = self._wiring.servo_sign * servo.K_enc
        self._K_alpha = self._wiring.link_sign * servo.K_enc

    def __repr__(self) -> str:
        described = ", ".join(f"{key}={value}" for key, value in self.identity.items())
        return f"<Bench: {described}; {'open' if self._board else 'closed'}>"

    @property
    def board(self) -> Board:
        """The open board.

        Raises
        ------
        BenchError
            If the bench is not open.
        """
        if self._board is None:
            raise BenchError("The bench is not open. Use it in a `with` statement, as in `with … as on_the_bench:`.")
        return self._board

    # --- open and close -------------------------------------------------------------------------------------------

    def __enter__(self) -> Self:
        if self._board is not None:
            raise BenchError("The bench is open already.")
        self._board, self._task = self._connect(), None
        try:
            if not self.is_simulated:
                self._ending.listen()
            self._prepare_watchdog(self._board)
            self._board.watchdog_clear()
            self._board.watchdog_stop()
            self._set_motor(0.0)
            self._let_lines_go()
            if self._prepare is not None:
                self._prepare(self)
                self._set_motor(0.0)  # with a range that was chosen now, the same number may be other volts
            if self.safety.mark is not None:
                self.safety.mark.find(self.counts()[0])
        except BaseException:
            self._close()
            raise
        return self

    def renew(self) -> None:
        """Connect a virtual bench anew, so that an experiment does not depend on what ran before it."""
        if self._virtual and self.board.is_valid():
            self._close()
            self.__enter__()

    def _prepare_watchdog(self, board: Board) -> None:
        """Have an expired watchdog set 0 V, also where the one of the last program still holds the board."""
        try:
            board.watchdog_set_analog_expiration_state(self._motor, 1, np.zeros(1))
        except HILError:
            board.watchdog_clear()
            self.ask("watchdog_set_analog_expiration_state", self._motor, 1, np.zeros(1))

    def _let_lines_go(self) -> None:
        """Have an expired watchdog let digital outputs go: on Q8-series boards it sets no analog one otherwise."""
        lines = self._wiring.digital_outputs
        if lines:
            channels, states = np.arange(lines, dtype=np.uint32), np.full(lines, DigitalState.TRISTATE, dtype=np.int32)
            self.ask("watchdog_set_digital_expiration_state", channels, lines, states)

    def ask(self, verb: str, *arguments: Any) -> None:
        """Ask the board for what it need not have; a refusal is noted in ``refused``, and ends nothing."""
        try:
            getattr(self.board, verb)(*arguments)
        except HILError as error:
            self.refused[verb] = f"{error} {_TO_DO[verb]}"

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        try:
            self._close()
        except HILError as failure:  # it is shown in place of the first one, whose notes say where the samples are
            for note in getattr(error, "__notes__", ()) if failure is not error else ():
                failure.add_note(note)
            raise

    def _close(self) -> None:
        """Set 0 V, then close the board; each is tried whatever happens to the other."""
        try:
            with uninterrupted():
                board, self._board = self._board, None
                if board is None or not board.is_valid():
                    return
                try:
                    self._halt(board)
                    self._save_mark(board)
                finally:
                    board.close()
        finally:
            self._ending.stop_listening()

    def _close_after_run(self) -> None:
        """Close, once a run of another thread has ended."""
        self.running.acquire(timeout=1.0)
        self._close()

    def _is_sampling_here(self) -> bool:
        return self._task is not None and self._sampled_by == threading.get_ident()

    # --- where theta is zero --------------------------------------------------------------------------------------

    def counts(self, board: Board | None = None) -> tuple[int, int]:
        """Return what the counters of servo and link read now; ``board`` is one that is being closed."""
        counts = np.zeros(2, dtype=np.int32)
        (board or self.board).read_encoder(self._encoders, 2, counts)
        servo, link = counts.tolist()
        return servo, link

    def set_zero(self) -> None:
        """Take where the arm stands now as its mark, about which the servo's angle is limited."""
        self.stop()
        if self.safety.mark is not None:
            self.safety.mark.set(self.counts()[0])

    @property
    def mark_unknown(self) -> str | None:
        """Why the arm must be put at its mark before the motor drives; None if it need not be."""
        return _NO_MARK if self.safety.mark is not None and self.safety.mark.zero is None else None

    @property
    def begun(self) -> float:
        """Where the last run began, rad from the mark; 0 where there is none."""
        mark = self.safety.mark
        return 0.0 if mark is None or mark.zero is None else (self._begun[0] - mark.zero) * self._K_theta

    def require_mark(self) -> None:
        """Raise :class:`BenchError` unless it is known how far the arm is from its mark; the motor is at 0 V then."""
        if self.mark_unknown:
            self.stop()
            then = "Then call set_zero() of the open bench; or in a terminal: rotflex bench zero bench.toml."
            raise BenchError(f"{self.mark_unknown} {then}")

    def _save_mark(self, board: Board) -> None:
        """Save what the servo's counter reads, once the servo has come to rest. What fails here is asked next time."""
        mark = self.safety.mark
        with suppress(HILError, OSError):
            if mark is not None and mark.zero is not None:
                read = [self.counts(board)[0]]
                while read[-1:] != read[-2:-1] and len(read) <= _REST_TRIES:
                    time.sleep(_REST)
                    read.append(self.counts(board)[0])
                mark.save(read[-1])

    def _halt(self, board: Board) -> None:
        with uninterrupted():
            task, self._task = self._task, None
            halt(board, self._motor, task)

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
        board = self.board
        if not 0 < sample_time < WATCHDOG_TIMEOUT or (self.safety.guard and sample_time > SLOWEST):
            raise BenchError(
                f"The sample time is {sample_time!r} s. It must be positive, and shorter than the {WATCHDOG_TIMEOUT} s "
                f"after which the watchdog stops the motor. Where a guard watches the bench, it is at most {SLOWEST} s."
            )
        self.stop()
        if zero:
            self._begun = self.counts()
        self._sample, self._sample_time = 0, sample_time
        self._pace, self.late, self.is_left_alone = None, [], False
        self._supervision = Supervision(self.limits, self.safety.guard, sample_time, self.begun)
        self._sampled_by = threading.get_ident()
        self._task = board.task_create_encoder_reader(round(1 / sample_time), self._encoders, 2)
        mode = BufferOverflowMode.SYNCHRONIZED if self.is_simulated else BufferOverflowMode.OVERWRITE_ON_OVERFLOW
        self.ask("task_set_buffer_overflow_mode", self._task, int(mode))
        board.watchdog_start(WATCHDOG_TIMEOUT)
        board.task_start(self._task, self._clock, 1 / sample_time, _FOREVER)
        if not self.is_simulated:
            self._pace = Pace(sample_time, "hardware" if self._clock >= 0 else "software", self._now)

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
        board = self.board
        if self._task is None:
            raise BenchError("The bench is not sampling; call start() first.")
        self._fetch(board, self._counts, 1)
        self.late = []
        if self._pace is None:
            measured = self._taken(self._counts.tolist())
        else:
            came, lost = self._all_here(board, self._pace)
            self._sample += lost
            measured = self._taken(came[0], 1 + lost)
            for counts in came[1:]:
                self.late.append(measured)
                measured = self._taken(counts)
        self._show_alive(board)
        return measured

    def _fetch(self, board: Board, counts: Counts, samples: int) -> None:
        if self._task is None or board.task_read_encoder(self._task, samples, counts) != samples:
            raise HILError("The board gave no sample.")

    def _show_alive(self, board: Board) -> None:
        if not self.is_left_alone and not board.watchdog_reload():
            self.stop()
            raise _expired()

    def _drop_stale(self, board: Board, pace: Pace) -> None:
        """Drop samples from before the run by reading them, for flushing has no effect on readers."""
        stale = pace.stale() if self._sample == 0 else 0
        if stale:
            self._fetch(board, np.zeros(2 * stale, dtype=np.int32), stale)
            self._show_alive(board)
            self._fetch(board, self._counts, 1)

    def _taken(self, counts: list[int], samples: int = 1) -> Measurement:
        """Return the next sample from its counts, within the limits; ``samples`` after the one before."""
        servo, link = counts
        theta, alpha = (servo - self._begun[0]) * self._K_theta, (link - self._begun[1]) * self._K_alpha
        measured = Measurement(self._sample * self._sample_time, theta, alpha)
        self._sample += 1
        self.latest = measured
        why = "" if self._supervision is None else self._supervision.see(measured, samples)
        if why:
            self._end(why)
        return measured

    def _all_here(self, board: Board, pace: Pace) -> tuple[list[list[int]], int]:
        """Return the counts of the sample that has just come and of those that wait; and how many were lost before."""
        self._drop_stale(board, pace)
        came, lost, behind = [self._counts.tolist()], 0, pace.arrived(self._sample)
        if behind and pace.too_slow and self.safety.guard is not None:  # a virtual bench may be on a busy computer
            slow = (
                f"A sample comes every {self._sample_time * 1e3:.3g} ms, and each answer takes {pace.answer * 1e3:.3g} "
                "ms: the controller is too slow for its sample time."
            )
            self._end(at(slow, self.latest.time))
        if behind:
            self._show_alive(board)
        while behind:
            self._fetch(board, self._counts, 1)
            came.append(self._counts.tolist())
            behind, lost = pace.fetched(self._sample + len(came) - 1)
        pace.skipped(self._sample, lost, len(came) - 1)
        return came, lost

    def write(self, voltage: float) -> float:
        """Set the motor voltage (V), cut to the limits, and return what was set.

        Raises
        ------
        BenchError
            If the voltage is not a finite number, or the bench is not sampling; the motor is at 0 V then.
        LimitExceeded
            If it exceeds the lower limit of a bench that has not been commissioned; the motor is at 0 V then.
        HILError
            If the board refuses it, as when its watchdog has expired.
        """
        most = self._v_max
        applied = min(max(voltage, -most), most)
        if applied != voltage:
            self._refuse_beyond(voltage)  # raises for NaN, which equals nothing, and where nothing may be cut
        if applied and self._task is None:  # no watchdog runs, and nothing would stop the motor
            self.stop()
            raise BenchError("The bench is not sampling, so the motor stays at 0 V; call start() first.")
        self._ending.require_none()
        if applied:
            self.require_mark()
        if self.on_sample is not None:
            self.on_sample(self.latest, applied)
        try:
            self._set_motor(applied)
        except HILError as error:
            expired = False
            with suppress(HILError):
                expired = self.board.watchdog_is_expired()
            if expired:
                raise _expired() from error
            raise
        if self._pace is not None:
            self._pace.answered()
        if self._supervision is not None:
            self._supervision.drive(applied)
        return applied

    def _refuse_beyond(self, voltage: float) -> None:
        """Raise where a voltage may not be cut to the limit: it is no number, or the limits have a reason."""
        if not np.isfinite(voltage):
            self.stop()
            raise BenchError(f"The controller asked for {voltage} V. The motor is at 0 V; check the gain.")
        if self.limits.why:
            why = f"The controller asked for {voltage:.1f} V, and the limit is ±{self._v_max:g} V."
            self._end(at(why, self.latest.time, self.limits.why))

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
        if torque is not None and not (self._virtual and self.is_simulated and self.recorded is None):
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

    @property
    def timing(self) -> dict[str, Any]:
        """How steadily the last run's samples came, a few numbers; nothing where time waits."""
        return {} if self._pace is None else {TIMING: self._pace.report()}

    def require_commissioned(self) -> None:
        """Raise :class:`BenchError` unless this bench was commissioned as it is wired now."""
        if self.safety.commissioned is not None and (why := self.safety.commissioned()):
            raise BenchError(why)

    def stop(self) -> None:
        """Set 0 V, and take no more samples. Nothing pushes the arm any more."""
        plant = getattr(self.board, "plant", None)
        if isinstance(plant, Plant):
            plant.torque = 0.0
        self._halt(self.board)

    @property
    def _v_max(self) -> float:
        return min(self.limits.voltage, self.servo.V_max)

    def _set_motor(self, voltage: float) -> None:
        self._volts[0] = self._wiring.motor_sign * voltage / self.servo.cable_gain
        self.board.write_analog(self._motor, 1, self._volts)

    def _end(self, why: str) -> NoReturn:
        """End a run for a limit: 0 V first, and then the reason."""
        self.stop()
        raise LimitExceeded(f"{why} The motor is at 0 V.")


def _expired() -> WatchdogExpired:
    return WatchdogExpired(
        f"The program did not show for {WATCHDOG_TIMEOUT:g} s that it was alive, so the board's watchdog expired. "
        "Close what else keeps this computer busy, and run it again."
    )
