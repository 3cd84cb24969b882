"""The board at the end of a serial line, behind the verbs of :class:`~rotflex.hil.board.Board`.

It has one analog output (the motor, in volts), two encoders (every edge counts), two analog inputs (0 to 5 V), four
digital outputs that can be read back, and one clock, in whole milliseconds. What else the verbs could ask for is
refused in words.

While samples come, outputs and reloads are sent and not waited for: each sample says which output the board had obeyed
last, and whether its watchdog has expired. All else is asked and answered.
"""

from __future__ import annotations

import contextlib
from typing import Any, NamedTuple

from numpy.typing import NDArray

from rotflex.errors import HILError
from rotflex.hil.arguments import KnownChannels, check_modes, finite, same_for_all
from rotflex.hil.board import Channels, Clock, Counts, DigitalState, Levels, Vector, check_buffer
from rotflex.hil.serial import protocol
from rotflex.hil.serial.line import Line
from rotflex.hil.serial.motor import Motor
from rotflex.hil.serial.port import Port
from rotflex.hil.serial.protocol import Flag, Inputs, Type
from rotflex.hil.serial.stream import Stream
from rotflex.hil.serial.tasks import Task, overflow_mode

_ENCODERS, _ANALOG_INPUTS, _ANALOG_OUTPUTS, _DIGITAL_LINES = 2, 2, 1, 4
_X4 = 4


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


class SerialBoard:
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
        self._port = port
        self._open = True
        self._known_channels = KnownChannels()
        self._line = Line(port)
        self._stream = Stream(self._line)
        try:
            self._line.greet()
            self._motor = Motor(self._line, supply)
        except BaseException:
            port.close()
            raise

    def is_valid(self) -> bool:
        """Whether the board is open."""
        return self._open

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

    def set_encoder_counts(self, channels: Channels, num_channels: int, counts: Counts) -> None:
        """Set what the counters read now."""
        encoders = self._chosen(channels, num_channels, _ENCODERS, "encoder")
        check_buffer(counts, num_channels, "encoder")
        values = [0] * _ENCODERS
        for encoder, count in zip(encoders, counts.tolist(), strict=False):
            values[encoder] = count
        mask = sum(1 << encoder for encoder in set(encoders))
        self._line.ask(Type.COUNTS, protocol.COUNTS.pack(mask, *values))

    def set_encoder_quadrature_mode(self, channels: Channels, num_channels: int, modes: NDArray[Any]) -> None:
        """Every edge is counted: X4 is the one mode."""
        self._chosen(channels, num_channels, _ENCODERS, "encoder")
        check_modes(modes, num_channels)
        same_for_all(modes, num_channels, _X4, "The board counts every edge of its encoders (X4, mode 4), always.")

    def set_encoder_filter_frequency(self, channels: Channels, num_channels: int, frequencies: Vector) -> None:
        """The board has no filter: refused."""
        self._chosen(channels, num_channels, _ENCODERS, "encoder")
        raise HILError("The board has no filter at its encoders. Where one is needed, wire one (docs/serial_bench.md).")

    def set_analog_input_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Its analog inputs have one range, 0 to 5 V."""
        self._chosen(channels, num_channels, _ANALOG_INPUTS, "analog input")
        for bounds in (minima, maxima):
            check_buffer(bounds, num_channels, "analog")
        refusal = "The board's analog inputs have one range, 0 to 5 V."
        same_for_all(minima, num_channels, 0.0, refusal)
        same_for_all(maxima, num_channels, 5.0, refusal)

    def set_analog_output_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Its output has one range: what the motor's driver is fed with, either way."""
        self._chosen(channels, num_channels, _ANALOG_OUTPUTS, "analog output")
        for bounds in (minima, maxima):
            check_buffer(bounds, num_channels, "analog")
        refusal = f"The motor's range is its supply, ±{self._motor.supply:g} V."
        same_for_all(minima, num_channels, -self._motor.supply, refusal)
        same_for_all(maxima, num_channels, self._motor.supply, refusal)

    def read_encoder(self, channels: Channels, num_channels: int, buffer: Counts) -> None:
        """Read encoder counts."""
        self.read(None, 0, channels, num_channels, None, 0, None, 0, None, buffer, None, None)

    def read_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Read analog inputs, V; they are up to 2 ms old."""
        self.read(channels, num_channels, None, 0, None, 0, None, 0, buffer, None, None, None)

    def read(
        self,
        analog_channels: Channels | None,
        num_analog_channels: int,
        encoder_channels: Channels | None,
        num_encoder_channels: int,
        digital_channels: Channels | None,
        num_digital_channels: int,
        other_channels: Channels | None,
        num_other_channels: int,
        analog_buffer: Vector | None,
        encoder_buffer: Counts | None,
        digital_buffer: Levels | None,
        other_buffer: Vector | None,
    ) -> None:
        """Read inputs of all kinds at one instant. This board has no other channels."""
        chosen_inputs = self._inputs(
            (analog_channels, num_analog_channels),
            (encoder_channels, num_encoder_channels),
            (digital_channels, num_digital_channels),
            num_other_channels,
        )
        task = Task(*chosen_inputs, capacity=1)
        task.check_buffers(1, analog_buffer, encoder_buffer, digital_buffer)
        servo, link, lines, *analog = protocol.READ.unpack(self._line.ask(Type.READ).payload)[:5]
        inputs = Inputs((servo, link), lines, (analog[0], analog[1]))
        task.fill(0, inputs, analog_buffer, encoder_buffer, digital_buffer)

    def write_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Set the motor's voltage (V), within its supply. What is too large is cut."""
        outputs = self._chosen(channels, num_channels, _ANALOG_OUTPUTS, "analog output")
        values = finite(outputs, buffer)
        self._hear()
        if outputs:
            self._motor.set(values[-1])
        if not self._stream.running:
            self._motor.settle()

    def write_digital(self, channels: Channels, num_channels: int, buffer: Levels) -> None:
        """Set digital lines: 0 low, anything else high."""
        lines = self._chosen(channels, num_channels, _DIGITAL_LINES, "digital")
        check_buffer(buffer, num_channels, "digital")
        levels = dict(zip(lines, buffer.tolist(), strict=False))
        mask = sum(1 << line for line in levels)
        self._line.ask(Type.LINES, protocol.LINES.pack(mask, sum(1 << line for line in levels if levels[line])))

    def set_card_specific_options(self, options: str, size: int) -> None:
        """This board has no options of its own: any but the empty string is refused."""
        self._check_open()
        if options:
            raise HILError(f"The serial board has no options; it was given {options!r}.")

    # --- hardware-timed input -------------------------------------------------------------------------------------

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """Create a task that samples encoders."""
        return self.task_create_reader(samples_in_buffer, None, 0, channels, num_channels, None, 0, None, 0)

    def task_create_reader(
        self,
        samples_in_buffer: int,
        analog_channels: Channels | None,
        num_analog_channels: int,
        encoder_channels: Channels | None,
        num_encoder_channels: int,
        digital_channels: Channels | None,
        num_digital_channels: int,
        other_channels: Channels | None,
        num_other_channels: int,
    ) -> int:
        """Create a task that samples inputs of all kinds."""
        chosen_inputs = self._inputs(
            (analog_channels, num_analog_channels),
            (encoder_channels, num_encoder_channels),
            (digital_channels, num_digital_channels),
            num_other_channels,
        )
        if samples_in_buffer < 1:
            raise HILError(f"A task needs a buffer of at least one sample; it was given {samples_in_buffer}.")
        return self._stream.add(Task(*chosen_inputs, capacity=samples_in_buffer))

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched in time."""
        self._task(task).overflow = overflow_mode(mode)

    def task_get_buffer_overflows(self, task: int) -> int:
        """How many samples were lost since the start, on the line or for lack of room."""
        chosen_task = self._task(task)
        self._hear()
        return chosen_task.lost

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        """Start sampling; the first sample is taken now. All tasks that run at a time have one rate."""
        begun = self._task(task)
        if clock != Clock.HARDWARE_CLOCK_0:
            raise HILError(f"The board has one clock, HARDWARE_CLOCK_0; it was asked for clock {clock}.")
        self._stream.start(begun, frequency, num_samples)

    def task_read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples of encoders, and return how many came."""
        return self.task_read(task, num_samples, None, buffer, None, None)

    def task_read(
        self,
        task: int,
        num_samples: int,
        analog_buffer: Vector | None,
        encoder_buffer: Counts | None,
        digital_buffer: Levels | None,
        other_buffer: Vector | None,
    ) -> int:
        """Wait for samples of all kinds, and return how many came (fewer only at the end of the task)."""
        read = self._task(task)
        if not read.started:
            raise HILError(f"Task {task} has not been started.")
        if num_samples < 1:
            raise HILError(f"A task gives one sample or more at a time; it was asked for {num_samples}.")
        read.check_buffers(num_samples, analog_buffer, encoder_buffer, digital_buffer)
        self._hear()
        count = 0
        while count < num_samples and (inputs := self._stream.fetch(read)) is not None:
            read.fill(count, inputs, analog_buffer, encoder_buffer, digital_buffer)
            count += 1
        return count

    def task_flush(self, task: int) -> None:
        """Does nothing: a reader keeps what was sampled."""
        self._task(task)

    def task_stop(self, task: int) -> None:
        """Stop sampling."""
        self._task(task).end()
        self._rest()

    def task_delete(self, task: int) -> None:
        """Delete the task."""
        self._task(task).end()
        del self._stream.tasks[task]
        self._rest()

    # --- watchdog -------------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Channels, num_channels: int, voltages: Vector) -> None:
        """An expired watchdog sets the motor to 0 V, and to nothing else."""
        outputs = self._chosen(channels, num_channels, _ANALOG_OUTPUTS, "analog output")
        if any(finite(outputs, voltages)):
            raise HILError("The board's watchdog sets the motor to 0 V, and cannot be told to set another voltage.")

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Its watchdog leaves digital lines as they are: any other state is refused."""
        self._chosen(channels, num_channels, _DIGITAL_LINES, "digital")
        check_buffer(states, num_channels, "state")
        same_for_all(states, num_channels, DigitalState.NO_CHANGE, "The board's watchdog leaves its digital lines.")

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

    def _check_open(self) -> None:
        if not self._open:
            raise HILError("The board is closed.")

    def _task(self, handle: int) -> Task:
        self._check_open()
        if handle not in self._stream.tasks:
            raise HILError(f"There is no task {handle}.")
        return self._stream.tasks[handle]

    def _chosen(self, channels: Channels | None, count: int, available: int, kind: str) -> tuple[int, ...]:
        self._check_open()
        return self._known_channels.of(channels, count, available, kind)

    def _inputs(
        self,
        analog: tuple[Channels | None, int],
        encoders: tuple[Channels | None, int],
        digital: tuple[Channels | None, int],
        others: int,
    ) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
        if others:
            raise HILError("The serial board has no other channels.")
        return (
            self._chosen(*analog, _ANALOG_INPUTS, "analog input"),
            self._chosen(*encoders, _ENCODERS, "encoder"),
            self._chosen(*digital, _DIGITAL_LINES, "digital"),
        )
