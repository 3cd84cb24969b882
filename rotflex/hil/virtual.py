"""The virtual board: the nonlinear plant behind a data-acquisition board's verbs.

Wired as the laboratory is: analog output 0 drives the amplifier, encoder 0 is the servo, encoder 1 the link (which
counts the other way), analog input 0 the potentiometer, analog input 1 the tachometer.

Time is simulated by default: it passes only while a task waits for its next sample, so that a run is as quick as the
computer and the same every time. With a :class:`~rotflex.hil.clock.WallClock` it passes as on a real bench.
Inside, the plant moves in whole ticks of 1/64 ms; outputs take effect when :class:`~rotflex.hil.terminals.Timing` says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from rotflex.config import DAC_LIMIT, Servo, srv02
from rotflex.errors import HILError, WatchdogExpired
from rotflex.hil import arguments
from rotflex.hil.board import (
    BufferOverflowMode,
    Channels,
    Clock,
    Counts,
    Levels,
    Vector,
    check_buffer,
)
from rotflex.hil.clock import Sampling, SimulatedClock, TimeSource
from rotflex.hil.sensors import ANALOG_INPUTS, ENCODERS, Sensors, check_filter
from rotflex.hil.terminals import AT_ONCE, Terminals, Timing
from rotflex.hil.virtual_tasks import Task, Values, put, refuse_other
from rotflex.plant import REST, Moving, Plant, PlantParameters, State

MOTOR = 0
_ANALOG_OUTPUTS, _DIGITAL_LINES = 2, 8


@dataclass
class _Watchdog:
    """Sets the outputs to a safe state when the program no longer shows that it is alive."""

    timeout: float = math.inf
    deadline: float = math.inf
    expired: bool = False
    states: dict[int, float] = field(default_factory=dict)


class VirtualBoard:
    """A board with the plant on its terminals.

    Parameters
    ----------
    plant : the true plant's parameters; or something else that moves, such as a recording
    servo : the nominal servo, for sensor gains and the cable
    state : where the plant starts
    clock : simulated time by default
    timing : when outputs take effect; at once by default
    """

    def __init__(
        self,
        plant: PlantParameters | Moving,
        servo: Servo | None = None,
        state: State = REST,
        clock: TimeSource | None = None,
        timing: Timing = AT_ONCE,
    ) -> None:
        self.servo = servo or srv02()
        self.clock = clock or SimulatedClock()
        self.plant: Moving = plant if not isinstance(plant, PlantParameters) else Plant(plant, state)
        if isinstance(self.plant, Plant) and not isinstance(self.clock, SimulatedClock):
            self.plant.prepare()
        self.terminals = Terminals(self.plant, MOTOR, self.servo.cable_gain, _ANALOG_OUTPUTS, timing, self.clock.now())
        self._open = True
        self._digital = [0] * _DIGITAL_LINES
        self._tasks: dict[int, Task] = {}
        self._next_task = 1
        self._instant = self.clock.now()  # until which the plant has moved; a sample has several calls at one instant
        self._watchdog = _Watchdog()
        self._sensors = Sensors(self.servo, self.plant)
        self._output_ranges = [(-DAC_LIMIT, DAC_LIMIT)] * _ANALOG_OUTPUTS
        self._known_channels = arguments.KnownChannels()

    # --- the plant ------------------------------------------------------------------------------------------------

    def _catch_up(self, instant: float) -> None:
        """Let the plant move until ``instant`` under the voltage that is on the output."""
        if instant == self._instant:
            return
        if not isinstance(self.clock, SimulatedClock):
            self._sample_until(instant)
        self._move(instant)

    def _sample_until(self, instant: float) -> None:
        """Take the samples that are due on the way to an instant, and put them aside until they are fetched."""
        due = [(when, sample, task) for task in self._tasks.values() for when, sample in task.due_until(instant)]
        for when, sample, task in sorted(due, key=lambda one: one[0]):
            self._move(when)
            task.keep(sample, self._values(task))

    def _move(self, instant: float) -> None:
        self._instant = instant
        if self._watchdog.deadline < instant:
            self.terminals.move(self._watchdog.deadline)
            self._watchdog.expired = True
            self._watchdog.deadline = math.inf
            self.terminals.set(self._watchdog.states)
        self.terminals.move(instant)

    def _values(self, task: Task) -> Values:
        """What the channels of a task read now."""
        return (
            [self._sensors.volts(channel) for channel in task.analog],
            [self._sensors.counts(channel) for channel in task.encoders],
            [self._digital[channel] for channel in task.digital],
        )

    # --- immediate input and output -------------------------------------------------------------------------------

    def is_valid(self) -> bool:
        """Whether the board is open."""
        return self._open

    def close(self) -> None:
        """Close the board; a second call does nothing."""
        self._tasks.clear()
        self._open = False

    def set_encoder_counts(self, channels: Channels, num_channels: int, counts: Counts) -> None:
        """Set what the counters read now."""
        chosen = self._channels(channels, num_channels, ENCODERS, "encoder")
        check_buffer(counts, num_channels, "encoder")
        self._catch_up(self.clock.now())
        self._sensors.set_counts(chosen, counts.tolist())

    def set_encoder_quadrature_mode(self, channels: Channels, num_channels: int, modes: Channels) -> None:
        """Count all four edges, as the data sheet's counts per turn do, or fewer. What the counters read stays."""
        chosen = self._channels(channels, num_channels, ENCODERS, "encoder")
        arguments.check_modes(modes, num_channels)
        self._catch_up(self.clock.now())
        self._sensors.set_modes(chosen, modes.tolist())

    def set_encoder_filter_frequency(self, channels: Channels, num_channels: int, frequencies: Vector) -> None:
        """There is no noise here to be filtered; that the frequencies (Hz) can be is checked."""
        chosen = self._channels(channels, num_channels, ENCODERS, "encoder")
        check_buffer(frequencies, num_channels, "analog")
        check_filter(chosen, frequencies.tolist())

    def set_analog_input_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Cut what comes to ranges (V)."""
        chosen = self._channels(channels, num_channels, ANALOG_INPUTS, "analog input")
        self._sensors.set_ranges(arguments.ranges(chosen, minima, maxima, DAC_LIMIT))

    def set_analog_output_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Cut what is written from now on to ranges (V)."""
        chosen = self._channels(channels, num_channels, _ANALOG_OUTPUTS, "analog output")
        for channel, one in arguments.ranges(chosen, minima, maxima, DAC_LIMIT).items():
            self._output_ranges[channel] = one

    def read_encoder(self, channels: Channels, num_channels: int, buffer: Counts) -> None:
        """Read encoder counts."""
        self.read(None, 0, channels, num_channels, None, 0, None, 0, None, buffer, None, None)

    def read_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Read analog inputs, V."""
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
        refuse_other(num_other_channels)
        analog = self._channels(analog_channels, num_analog_channels, ANALOG_INPUTS, "analog input")
        encoders = self._channels(encoder_channels, num_encoder_channels, ENCODERS, "encoder")
        digital = self._channels(digital_channels, num_digital_channels, _DIGITAL_LINES, "digital")
        check_buffer(analog_buffer, len(analog), "analog")
        check_buffer(encoder_buffer, len(encoders), "encoder")
        check_buffer(digital_buffer, len(digital), "digital")
        self._catch_up(self.clock.now())
        now = Task(analog, encoders, digital, Sampling(1))
        put(self._values(now), (analog_buffer, encoder_buffer, digital_buffer), 0)

    def write_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Set analog outputs, V, within the converter's ±10 V."""
        voltages = self._voltages(channels, num_channels, buffer)
        self._catch_up(self.clock.now())
        if self._watchdog.expired:
            raise WatchdogExpired("The watchdog has expired and holds the outputs; clear it before writing again.")
        self.terminals.send(voltages)

    def write_digital(self, channels: Channels, num_channels: int, buffer: Levels) -> None:
        """Set digital lines."""
        chosen = self._channels(channels, num_channels, _DIGITAL_LINES, "digital")
        check_buffer(buffer, num_channels, "digital")
        self._catch_up(self.clock.now())
        for channel, level in zip(chosen, buffer.tolist(), strict=False):
            self._digital[channel] = level

    def set_card_specific_options(self, options: str, size: int) -> None:
        """This board has no options of its own: any but the empty string is refused."""
        self._check_open()
        if options:
            raise HILError(f"The virtual board has no options; it was given {options!r}.")

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
        refuse_other(num_other_channels)
        if samples_in_buffer < 1:
            raise HILError(f"A task needs a buffer of at least one sample; it was given {samples_in_buffer}.")
        task = Task(
            analog=self._channels(analog_channels, num_analog_channels, ANALOG_INPUTS, "analog input"),
            encoders=self._channels(encoder_channels, num_encoder_channels, ENCODERS, "encoder"),
            digital=self._channels(digital_channels, num_digital_channels, _DIGITAL_LINES, "digital"),
            sampling=Sampling(capacity=samples_in_buffer),
        )
        handle = self._next_task
        self._next_task += 1
        self._tasks[handle] = task
        return handle

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched before the task's buffer was full."""
        chosen = self._task(task)
        try:
            chosen.sampling.overflow = BufferOverflowMode(mode)
        except ValueError:
            listed = ", ".join(f"{mode.value} ({mode.name})" for mode in BufferOverflowMode)
            raise HILError(f"There is no buffer overflow mode {mode}; there are {listed}.") from None

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        """Start sampling; the first sample is taken now."""
        chosen = self._task(task)
        if clock != Clock.HARDWARE_CLOCK_0:
            raise HILError(f"The virtual board has one clock, HARDWARE_CLOCK_0; it was asked for clock {clock}.")
        chosen.start(self.clock.now(), frequency, num_samples)
        self.terminals.begin()

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
        chosen = self._task(task)
        sampling = chosen.sampling
        if not sampling.started:
            raise HILError(f"Task {task} has not been started.")
        if num_samples < 1:
            raise HILError(f"A task gives one sample or more at a time; it was asked for {num_samples}.")
        analog, encoders, digital = chosen.analog, chosen.encoders, chosen.digital
        check_buffer(analog_buffer, num_samples * len(analog), "analog")
        check_buffer(encoder_buffer, num_samples * len(encoders), "encoder")
        check_buffer(digital_buffer, num_samples * len(digital), "digital")
        count = 0
        while count < num_samples and sampling.remaining:
            self.clock.wait_until(sampling.due)
            now = self.clock.now()
            if now > sampling.due:
                sampling.handle_overflow(now)
            values = chosen.kept()
            if values is None:
                self._catch_up(sampling.due)
                values = self._values(chosen)
            put(values, (analog_buffer, encoder_buffer, digital_buffer), count)
            sampling.fetch()
            count += 1
        return count

    def task_get_buffer_overflows(self, task: int) -> int:
        """How many samples were lost since the start, for want of room."""
        return self._task(task).sampling.lost

    def task_flush(self, task: int) -> None:
        """This board has readers only, on which this has no effect: read what waits to be rid of it."""
        self._task(task)

    def task_stop(self, task: int) -> None:
        """Stop sampling."""
        self._task(task).sampling.stop()

    def task_delete(self, task: int) -> None:
        """Delete the task."""
        self._task(task)
        del self._tasks[task]

    # --- watchdog -------------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Channels, num_channels: int, voltages: Vector) -> None:
        """Choose the analog outputs (V) that an expired watchdog sets."""
        self._watchdog.states = self._voltages(channels, num_channels, voltages)

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Nothing hangs on the digital lines: they stay as they are."""
        self._channels(channels, num_channels, _DIGITAL_LINES, "digital")
        check_buffer(states, num_channels, "state")

    def watchdog_start(self, timeout: float) -> None:
        """Start the watchdog."""
        self._attend()
        if not timeout > 0:
            raise HILError(f"A watchdog needs a positive time-out; it was given {timeout} s.")
        self._watchdog.timeout = timeout
        self._watchdog.deadline = self.clock.now() + timeout

    def watchdog_reload(self) -> bool:
        """Show that the program is alive. A watchdog that has expired stays so, and False says it."""
        self._attend()
        if not self._watchdog.expired:
            self._watchdog.deadline = self.clock.now() + self._watchdog.timeout
        return not self._watchdog.expired

    def watchdog_is_expired(self) -> bool:
        """Whether the watchdog has expired."""
        self._attend()
        return self._watchdog.expired

    def watchdog_clear(self) -> None:
        """Let outputs be written again."""
        self._attend()
        self._watchdog.expired = False

    def watchdog_stop(self) -> None:
        """Stop the watchdog."""
        self._attend()
        self._watchdog.timeout = self._watchdog.deadline = math.inf

    def _attend(self) -> None:
        """What every call to the watchdog begins with: it may have expired since the last one."""
        self._check_open()
        self._catch_up(self.clock.now())

    # --- checks ---------------------------------------------------------------------------------------------------

    def _check_open(self) -> None:
        if not self._open:
            raise HILError("The board is closed.")

    def _task(self, handle: int) -> Task:
        self._check_open()
        if handle not in self._tasks:
            raise HILError(f"There is no task {handle}.")
        return self._tasks[handle]

    def _channels(self, channels: Channels | None, count: int, available: int, kind: str) -> tuple[int, ...]:
        """The first ``count`` channel numbers, checked."""
        self._check_open()
        return self._known_channels.of(channels, count, available, kind)

    def _voltages(self, channels: Channels, count: int, buffer: Vector) -> dict[int, float]:
        """Voltages by analog output, checked, and cut to what the converter can give."""
        chosen = self._channels(channels, count, _ANALOG_OUTPUTS, "analog output")
        return arguments.within(chosen, buffer, self._output_ranges)
