"""The board at the end of a serial line, behind the verbs of :class:`~rotflex.hil.board.Board`.

It has one analog output (the motor, in volts), two encoders (every edge counts), two analog inputs (0 to 5 V), four
digital outputs that can be read back, and one clock, in whole milliseconds. What else the verbs could ask for is
refused in words.

While samples come, outputs and reloads are sent and not waited for: each sample says which output the board had obeyed
last, and whether its watchdog has expired. All else is asked and answered.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from typing import NamedTuple

from rotflex.errors import HILError
from rotflex.hil.board import (
    ANALOG_INPUT,
    ANALOG_OUTPUT,
    Board,
    BufferOverflowMode,
    Channels,
    Counts,
    DigitalState,
    EncoderQuadratureMode,
    Range,
    Task,
    Values,
)
from rotflex_serial import protocol
from rotflex_serial.line import Line
from rotflex_serial.motor import Motor
from rotflex_serial.port import Port
from rotflex_serial.protocol import Flag, Inputs, Type
from rotflex_serial.stream import Stream, values

_CHANNELS = {"encoder": 2, ANALOG_INPUT: 2, ANALOG_OUTPUT: 1, "digital": 4}


class Condition(NamedTuple):
    """What went wrong without stopping anything, since the board was opened.

    Attributes
    ----------
    samples_lost : samples that did not come
    damaged_here, damaged_there : frames that came damaged, here and at the board
    lost_there : frames that the board expected, and that did not come
    edges_missed : times an encoder was quicker than the board; cleared when counts are set
    """

    samples_lost: int
    damaged_here: int
    damaged_there: int
    lost_there: int
    edges_missed: int


class SerialBoard(Board):
    """An open board.

    Parameters
    ----------
    port : the line to it, open
    supply : what the motor's driver is fed with, V; a voltage at the motor is a share of it

    Raises
    ------
    HILError
        If nothing answers there, or something else than this board's firmware.
    """

    def __init__(self, port: Port, supply: float) -> None:
        super().__init__("serial", _CHANNELS)
        self._port = port
        self._line = Line(port)
        self._stream = Stream(self._line, self._tasks)
        try:
            self._line.greet()
            self._motor = Motor(self._line, supply)
        except BaseException:
            port.close()
            raise

    def close(self) -> None:
        """0 V, and close the line; a second call does nothing. Should the board not hear, its silence guard acts."""
        if not self._open:
            return
        self._open = False
        try:
            with contextlib.suppress(HILError):
                self._line.ask(Type.BYE)
        finally:
            self._port.close()

    def condition(self) -> Condition:
        """What went wrong without stopping anything."""
        self._check_open()
        *_inputs, damaged, lost, missed = protocol.READ.unpack(self._line.ask(Type.READ).payload)
        return Condition(self._stream.lost, self._line.damaged, damaged, lost, missed)

    # --- immediate input and output -------------------------------------------------------------------------------

    def _set_counts(self, counts: Mapping[int, int]) -> None:
        mask = sum(1 << encoder for encoder in counts)
        self._line.ask(Type.COUNTS, protocol.COUNTS.pack(mask, counts.get(0, 0), counts.get(1, 0)))

    def _set_modes(self, modes: Mapping[int, int]) -> None:
        if any(mode != EncoderQuadratureMode.X4 for mode in modes.values()):
            raise HILError("The board counts every edge of its encoders (X4, mode 4), always.")

    def _set_filters(self, frequencies: Mapping[int, float]) -> None:
        """The board has no filter: refused."""
        raise HILError(
            "The board has no filter at its encoders. Where one is needed, wire one (contrib/serial/README.md)."
        )

    def _set_ranges(self, kind: str, ranges: Mapping[int, Range]) -> None:
        """Its analog inputs have one range, and its output that of what the motor's driver is fed with, either way."""
        only, said = (0.0, 5.0), "0 to 5 V"
        if kind == ANALOG_OUTPUT:
            only, said = (-self._motor.supply, self._motor.supply), f"±{self._motor.supply:g} V, the motor's supply"
        for asked in ranges.values():
            if not all(math.isclose(one, has, abs_tol=1e-6) for one, has in zip(asked, only, strict=True)):
                raise HILError(f"The board's {kind}s have one range, {said}.")

    def _read_now(self, task: Task) -> Values:
        """All inputs; the analog ones are up to 2 ms old."""
        servo, link, lines, *analog = protocol.READ.unpack(self._line.ask(Type.READ).payload)[:5]
        return values(task, Inputs((servo, link), lines, (analog[0], analog[1])))

    def _write(self, voltages: Mapping[int, float]) -> None:
        """Set the motor's voltage (V), within its supply. What is too large is cut."""
        self._hear()
        for voltage in voltages.values():
            self._motor.set(voltage)
        if not self._stream.running:
            self._motor.settle()

    def _set_lines(self, levels: Mapping[int, int]) -> None:
        mask = sum(1 << line for line in levels)
        self._line.ask(Type.LINES, protocol.LINES.pack(mask, sum(1 << line for line in levels if levels[line])))

    # --- hardware-timed input -------------------------------------------------------------------------------------

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched in time; the board's clock waits for nobody."""
        self._task(task)
        if mode in (BufferOverflowMode.WAIT_ON_OVERFLOW, BufferOverflowMode.SYNCHRONIZED):
            raise HILError(
                f"The board's clock waits for nobody: it cannot keep to overflow mode {BufferOverflowMode(mode).name}, "
                "which is for simulators."
            )
        super().task_set_buffer_overflow_mode(task, mode)

    def task_get_buffer_overflows(self, task: int) -> int:
        """How many samples were lost since the start, on the line or for lack of room."""
        self._hear()
        return super().task_get_buffer_overflows(task)

    def _begin(self, task: Task, frequency: float, samples: int) -> None:
        """All tasks that run at a time have one rate."""
        self._stream.start(task, frequency, samples)

    def _fetch(self, task: Task) -> Values | None:
        self._hear()
        return self._stream.fetch(task)

    def task_stop(self, task: int) -> None:
        """Stop sampling."""
        super().task_stop(task)
        self._rest()

    def task_delete(self, task: int) -> None:
        """Delete the task."""
        super().task_delete(task)
        self._rest()

    def confirm_output(self) -> None:
        """Make sure that the board has obeyed the last voltage.

        Raises
        ------
        HILError
            If it does not.
        """
        self._motor.settle()

    # --- watchdog -------------------------------------------------------------------------------------------------

    def _set_safe_voltages(self, voltages: Mapping[int, float]) -> None:
        """An expired watchdog sets the motor to 0 V, and to nothing else."""
        if any(voltages.values()):
            raise HILError("The board's watchdog sets the motor to 0 V, and cannot be told to set another voltage.")

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Its watchdog leaves digital lines as they are: any other state is refused."""
        super().watchdog_set_digital_expiration_state(channels, num_channels, states)
        if any(state != DigitalState.NO_CHANGE for state in states[:num_channels]):
            raise HILError("The board's watchdog leaves its digital lines.")

    def watchdog_start(self, timeout: float) -> None:
        """Start the watchdog. (The board's own, which acts after 50 ms of silence, is always on.)"""
        self._check_open()
        self._motor.watch(timeout)

    def watchdog_reload(self) -> bool:
        """Show that the program is alive. False if the watchdog has expired, as far as the last sample knew."""
        self._check_open()
        self._line.post(Type.RELOAD)
        if not self._stream.running:
            return not self._motor.is_expired()
        self._hear()
        return Flag.EXPIRED not in self._line.flags

    def watchdog_is_expired(self) -> bool:
        """Whether the watchdog has expired, or the board has heard nothing for too long."""
        self._check_open()
        return self._motor.is_expired()

    def watchdog_clear(self) -> None:
        """Let outputs be written again after the watchdog expired. The motor is at 0 V then; the watchdog runs on."""
        self._check_open()
        self._motor.clear()

    def watchdog_stop(self) -> None:
        """Stop the watchdog, once the last output is known to be obeyed."""
        self._check_open()
        self._motor.unwatch()

    # --- inside ---------------------------------------------------------------------------------------------------

    def _hear(self) -> None:
        """Take what has come, and wait for nothing."""
        self._check_open()
        self._line.listen(self._port.now())

    def _rest(self) -> None:
        """Sample no more, if no task wants it; the last output is obeyed by then."""
        self._stream.rest()
        if not self._stream.running:
            self._motor.settle()
