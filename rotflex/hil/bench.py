"""The calibrated bench: radians and volts above a data-acquisition board, within limits, and 0 V in the end.

    with hil.open("virtual:?seed=7") as bench:
        bench.start(sample_time=0.002)
        measured = bench.read()        # waits for the next sample
        bench.write(1.5)               # volts at the motor

However a ``with`` block ends, the motor is at 0 V afterwards. A watchdog on the board does the same should the program
stop without a word. The hardware's own emergency stop comes first all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from rotflex.config import Joint, Servo, check_mounted
from rotflex.errors import BenchError, HILError, LimitExceeded
from rotflex.hil.board import Board, BufferOverflowMode, Clock
from rotflex.hil.replay import RecordedPlant
from rotflex.units import DEG

WATCHDOG_TIMEOUT = 0.2  #: s
_FOREVER = 2**32 - 1


class Measurement(NamedTuple):
    """One sample: time since the start (s), servo angle and deflection (rad)."""

    time: float
    theta: float
    alpha: float


@dataclass(frozen=True)
class Limits:
    """Software limits. The makers publish no mechanical ones, so these are cautious.

    Attributes
    ----------
    voltage : at the motor, V; a larger command is cut to it
    theta : servo angle either way, rad: half a turn, for the cables' sake
    alpha : deflection either way, rad
    """

    voltage: float = 10.0
    theta: float = 180 * DEG
    alpha: float = 30 * DEG


@dataclass(frozen=True)
class Wiring:
    """Which channels the bench is wired to. ``link_sign`` is -1: the link's encoder counts the other way."""

    motor: int = 0
    servo_encoder: int = 0
    link_encoder: int = 1
    link_sign: int = -1


class Bench:
    """A bench: its board, its parts as the data sheet states them, its limits.

    Parameters
    ----------
    connect : opens the board; called on entering the ``with`` block
    servo, joint : nominal parameters, as the student is told them
    identity : plain data that says which bench this is; goes into every recording
    limits, wiring : as above
    recorded : the recording that moves in the plant's place, on a replay

    Attributes
    ----------
    on_sample : called once a sample, with what was measured and the voltage that is about to be set; None for nobody.
        What it raises ends the experiment before that voltage is set: so a run is watched, and stopped from elsewhere.
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
    ) -> None:
        self.servo = check_mounted(servo)
        self.joint = joint
        self.identity = dict(identity)
        self.limits = limits or Limits()
        self.recorded = recorded
        self._connect = connect
        self._wiring = wiring or Wiring()
        self.on_sample: Callable[[Measurement, float], None] | None = None
        self._latest = Measurement(0.0, 0.0, 0.0)
        self._board: Board | None = None
        self._task: int | None = None
        self._sample = 0
        self._sample_time = 0.0
        self._v_max = min(self.limits.voltage, servo.V_max)
        self._motor = np.array([self._wiring.motor], dtype=np.uint32)
        self._encoders = np.array([self._wiring.servo_encoder, self._wiring.link_encoder], dtype=np.uint32)
        self._counts = np.zeros(2, dtype=np.int32)
        self._volts = np.zeros(1)
        self._K_theta = servo.K_enc
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
            raise BenchError("The bench is not open. Use it as `with lab.bench() as on_the_bench:`.")
        return self._board

    # --- open and close -------------------------------------------------------------------------------------------

    def __enter__(self) -> Self:
        if self._board is not None:
            raise BenchError("The bench is open already.")
        self._board, self._task = self._connect(), None
        try:
            self._board.watchdog_set_analog_expiration_state(self._motor, 1, np.zeros(1))
            self._board.watchdog_clear()
            self._board.watchdog_stop()
            self._set_motor(0.0)
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._close()

    def _close(self) -> None:
        """0 V, then let go of the board; each is tried whatever happens to the other."""
        board, self._board = self._board, None
        if board is None or not board.is_valid():
            return
        try:
            self._halt(board)
        finally:
            board.close()

    def _halt(self, board: Board) -> None:
        """0 V and no task, even if the watchdog holds the outputs.

        The watchdog goes on running until the board has taken the 0 V: should it not take them, the watchdog sets them.
        """
        try:
            board.watchdog_clear()
        finally:
            self._volts[0] = 0.0
            board.write_analog(self._motor, 1, self._volts)
        board.watchdog_stop()
        if self._task is not None:
            task, self._task = self._task, None
            board.task_stop(task)
            board.task_delete(task)

    # --- an experiment --------------------------------------------------------------------------------------------

    def start(self, sample_time: float, zero: bool = True) -> None:
        """Begin to sample, with the angles counted from where the arm stands now.

        Parameters
        ----------
        sample_time : s
        zero : False goes on counting from where the encoders were zeroed last

        Raises
        ------
        BenchError
            If the bench is not open, or the watchdog would not outlast the sample time.
        """
        board = self.board
        if not 0 < sample_time < WATCHDOG_TIMEOUT:
            raise BenchError(
                f"The sample time is {sample_time!r} s; it must be positive, and shorter than the {WATCHDOG_TIMEOUT} s "
                "after which the watchdog stops the motor."
            )
        self.stop()
        if zero:
            board.set_encoder_counts(self._encoders, 2, np.zeros(2, dtype=np.int32))
        self._sample, self._sample_time = 0, sample_time
        self._task = board.task_create_encoder_reader(round(1 / sample_time), self._encoders, 2)
        mode = BufferOverflowMode.SYNCHRONIZED if self.is_simulated else BufferOverflowMode.OVERWRITE_ON_OVERFLOW
        board.task_set_buffer_overflow_mode(self._task, mode)
        board.watchdog_start(WATCHDOG_TIMEOUT)
        board.task_start(self._task, Clock.HARDWARE_CLOCK_0, 1 / sample_time, _FOREVER)

    @property
    def is_simulated(self) -> bool:
        """Whether time waits for the program."""
        return self.identity.get("clock") == "simulated"

    def read(self) -> Measurement:
        """Wait for the next sample.

        Raises
        ------
        LimitExceeded
            If an angle is past its limit. The motor is at 0 V then.
        HILError
            If the board gives no sample.
        BenchError
            If the bench is not open, or not sampling.
        """
        board = self.board
        if self._task is None:
            raise BenchError("The bench is not sampling; call start() first.")
        if board.task_read_encoder(self._task, 1, self._counts) != 1:
            raise HILError("The board gave no sample.")
        board.watchdog_reload()
        servo, link = self._counts.tolist()
        measured = Measurement(self._sample * self._sample_time, servo * self._K_theta, link * self._K_alpha)
        self._sample += 1
        self._latest = measured
        if abs(measured.theta) > self.limits.theta or abs(measured.alpha) > self.limits.alpha:
            self.stop()
            self._report_limit(measured)
        return measured

    def write(self, voltage: float) -> float:
        """Set the motor voltage (V), cut to the limits, and return what was set.

        Raises
        ------
        BenchError
            If the voltage is not a finite number; the motor is at 0 V then.
        HILError
            If the board refuses it, as when its watchdog has expired.
        """
        applied = min(max(voltage, -self._v_max), self._v_max)
        if applied != voltage and not np.isfinite(voltage):
            self.stop()
            raise BenchError(f"The controller asked for {voltage} V. The motor is at 0 V; check the gain.")
        if self.on_sample is not None:
            self.on_sample(self._latest, applied)
        self._set_motor(applied)
        return applied

    def stop(self) -> None:
        """0 V, and no more samples."""
        self._halt(self.board)

    def _set_motor(self, voltage: float) -> None:
        self._volts[0] = voltage / self.servo.cable_gain
        self.board.write_analog(self._motor, 1, self._volts)

    def _report_limit(self, measured: Measurement) -> None:
        theta_passed = abs(measured.theta) > self.limits.theta
        name, value, limit = (
            ("servo angle", measured.theta, self.limits.theta)
            if theta_passed
            else ("deflection", measured.alpha, self.limits.alpha)
        )
        raise LimitExceeded(
            f"The {name} reached {value / DEG:.1f} deg at t = {measured.time:.3f} s; its limit is "
            f"±{limit / DEG:.0f} deg. The motor is at 0 V. Use a smaller amplitude or check the gain."
        )
