"""The board of a bench, as it is wired: volts at the motor, counts of the encoders, and what the motor has now."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotflex.config import Servo
from rotflex.errors import BenchError, ConfigurationError, HILError
from rotflex.hil.board import WATCHDOG_TIMEOUT, Board, BufferOverflowMode, Clock, Counts, DigitalState
from rotflex.hil.replay import RecordedPlant

_FOREVER = 2**32 - 1
_TESTED = "rotflex bench setup tests with the motor whether the watchdog still sets 0 V."
#: What the user does about a board that refuses a verb which it need not have.
_TO_DO = {
    "watchdog_set_analog_expiration_state": _TESTED,
    "watchdog_set_digital_expiration_state": _TESTED,
    "task_set_buffer_overflow_mode": "Runs go on, but a program that pauses for a second ends its run with an error.",
    "set_encoder_quadrature_mode": "rotflex bench setup counts a full turn, and so finds whether all edges count.",
    "set_encoder_filter_frequency": "The board keeps its own filter: set filter = 0 in bench.toml.",
}


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


@dataclass(frozen=True)
class Outcome:
    """What is known of the motor once a bench was stopped. All that is said of an end comes from it.

    Attributes
    ----------
    at_zero : whether the board took 0 V, or had no other voltage
    volts : the last voltage that the board took, V at the motor; None if this program wrote none
    watchdog : s from the last sign of life to the expiry of the board's watchdog; None if it does not run
    """

    at_zero: bool = True
    volts: float | None = 0.0
    watchdog: float | None = None

    def __str__(self) -> str:
        if self.at_zero:
            return "The motor is at 0 V."
        left = "have a voltage" if self.volts is None else f"be at {self.volts:.2f} V"
        acts = "No watchdog runs that could stop it."
        if self.watchdog is not None:
            acts = f"The board's watchdog, where it works, sets 0 V within {self.watchdog:g} s."
        return f"The motor may still {left}. Press the emergency stop. {acts}"


class Connection:
    """The way to a board.

    Parameters
    ----------
    connect : opens the board
    servo : nominal; its encoder and its cable
    wiring : as above
    clock : of the board, that paces the samples
    now : the computer's time, s
    prepare : sets up the board, once its watchdog is stopped and 0 V written: options, ranges, quadrature, filters
    recorded : the recording that moves in the plant's place, on a replay
    virtual : whether `connect` makes a new plant, at rest

    Attributes
    ----------
    refused : what the board refused that it need not have, by verb, with what to do
    task : that samples; None if none does
    """

    def __init__(
        self,
        connect: Callable[[], Board],
        servo: Servo,
        *,
        wiring: Wiring | None = None,
        clock: int = Clock.HARDWARE_CLOCK_0,
        now: Callable[[], float] = time.perf_counter,
        prepare: Callable[[Connection], None] | None = None,
        recorded: RecordedPlant | None = None,
        virtual: bool = False,
    ) -> None:
        self.clock, self.now, self.recorded, self.virtual = clock, now, recorded, virtual
        self.refused: dict[str, str] = {}
        self.task: int | None = None
        self._connect, self._prepare = connect, prepare
        self._board: Board | None = None
        self._wiring = wiring or Wiring()
        self._motor = np.array([self._wiring.motor], dtype=np.uint32)
        self._encoders = np.array([self._wiring.servo_encoder, self._wiring.link_encoder], dtype=np.uint32)
        self._volts = np.zeros(1)
        self._per_volt = self._wiring.motor_sign / servo.cable_gain
        self.K_theta = self._wiring.servo_sign * servo.K_enc  #: rad per count
        self.K_alpha = self._wiring.link_sign * servo.K_enc
        self._asked: float | None = None  # V, of the board, and what it took
        self._taken: float | None = None
        self._is_watched = False

    @property
    def is_open(self) -> bool:
        """Whether a board is open, as far as this program knows."""
        return self._board is not None

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

    def open(self) -> None:
        """Open the board, with its watchdog stopped and the motor at 0 V."""
        self._board, self.task, self._is_watched = self._connect(), None, False
        self._asked = self._taken = None
        self.refused.clear()
        zero = self._motor, 1, np.zeros(1)
        try:
            self._board.watchdog_set_analog_expiration_state(*zero)
        except HILError:  # the watchdog of the last program may still hold the board
            self._board.watchdog_clear()
            self.ask("watchdog_set_analog_expiration_state", *zero)
        self._board.watchdog_clear()
        self._board.watchdog_stop()
        self.write(0.0)
        if lines := self._wiring.digital_outputs:  # else a Q8-series board's expired watchdog sets no analog output
            channels, states = np.arange(lines, dtype=np.uint32), np.full(lines, DigitalState.TRISTATE, dtype=np.int32)
            self.ask("watchdog_set_digital_expiration_state", channels, lines, states)
        if self._prepare is not None:
            self._prepare(self)
            self.write(0.0)  # with a range that was chosen now, the same number may be other volts

    def close(self) -> None:
        """Close the board."""
        board, self._board = self.board, None
        board.close()

    def ask(self, verb: str, *arguments: Any) -> None:
        """Ask the board for what it need not have; a refusal is noted in ``refused``, and ends nothing."""
        try:
            getattr(self.board, verb)(*arguments)
        except HILError as error:
            self.refused[verb] = f"{error} {_TO_DO[verb]}"

    def counts(self) -> tuple[int, int]:
        """Return what the counters of servo and link read now."""
        counts = np.zeros(2, dtype=np.int32)
        self.board.read_encoder(self._encoders, 2, counts)
        servo, link = counts.tolist()
        return servo, link

    # --- the motor ------------------------------------------------------------------------------------------------

    def write(self, voltage: float) -> None:
        """Set the voltage at the motor, V."""
        self._asked = voltage or self._asked
        self._volts[0] = voltage * self._per_volt
        self.board.write_analog(self._motor, 1, self._volts)
        self._asked = self._taken = voltage

    def write_zero(self) -> None:
        """Set 0 V, and have the board confirm it: one that can has ``confirm_output`` beside the maker's verbs."""
        before = self._taken
        self.write(0.0)
        self._taken = before
        getattr(self.board, "confirm_output", bool)()
        self._taken = 0.0

    def outcome(self) -> Outcome:
        """Return what is known of the motor now. A refused voltage is not taken for off: the board may have set it."""
        volts = self._taken or self._asked
        return Outcome(volts == 0.0, volts, WATCHDOG_TIMEOUT if self._is_watched else None)

    def start_watchdog(self) -> None:
        """Have the board set 0 V when this program is silent."""
        self.board.watchdog_start(WATCHDOG_TIMEOUT)
        self._is_watched = True

    def stop_watchdog(self) -> None:
        """Have it watch no more."""
        self.board.watchdog_stop()
        self._is_watched = False

    # --- samples --------------------------------------------------------------------------------------------------

    def start_sampling(self, sample_time: float, waits: bool) -> None:
        """Start the watchdog, and a sample of both encoders each ``sample_time`` (s).

        ``waits``: whether time waits for the program; else the board drops old samples for new ones.
        """
        self.task = self.board.task_create_encoder_reader(round(1 / sample_time), self._encoders, 2)
        mode = BufferOverflowMode.SYNCHRONIZED if waits else BufferOverflowMode.OVERWRITE_ON_OVERFLOW
        self.ask("task_set_buffer_overflow_mode", self.task, int(mode))
        self.start_watchdog()
        self.board.task_start(self.task, self.clock, 1 / sample_time, _FOREVER)

    def fetch(self, counts: Counts, samples: int) -> None:
        """Wait for so many samples. Raises HILError if the board does not give them."""
        if self.task is None or self.board.task_read_encoder(self.task, samples, counts) != samples:
            raise HILError("The board gave no sample.")
