"""The virtual board: the nonlinear plant behind a data-acquisition board's verbs.

Wired as the laboratory is: analog output 0 drives the amplifier, encoder 0 is the servo, encoder 1 the link (which
counts the other way), analog input 0 the potentiometer, analog input 1 the tachometer.

Time is simulated by default: it passes only while a task waits for its next sample, so that a run is as quick as the
computer and the same every time. With a :class:`~rotflex.hil.clock.WallClock` it passes as on a real bench.
Inside, the plant moves in whole ticks of 1/64 ms; outputs take effect when :class:`~rotflex.hil.terminals.Timing` says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from rotflex.config import DAC_LIMIT, Servo, srv02
from rotflex.errors import HILError, WatchdogExpired
from rotflex.hil.board import Channels, Vector, check_buffer
from rotflex.hil.clock import SimulatedClock, TimeSource
from rotflex.hil.own_board import ANALOG_INPUT, ANALOG_OUTPUT, OwnBoard, OwnTask, Range, Values, finite
from rotflex.hil.sensors import ANALOG_INPUTS, ENCODERS, Sensors
from rotflex.hil.terminals import AT_ONCE, Terminals, Timing
from rotflex.hil.virtual_tasks import Task
from rotflex.plant import REST, Moving, Plant, PlantParameters, State

MOTOR = 0
_ANALOG_OUTPUTS, _DIGITAL_LINES = 2, 8
_CHANNELS = {
    "encoder": ENCODERS,
    ANALOG_INPUT: ANALOG_INPUTS,
    ANALOG_OUTPUT: _ANALOG_OUTPUTS,
    "digital": _DIGITAL_LINES,
}


@dataclass
class _Watchdog:
    """Sets the outputs to a safe state when the program no longer shows that it is alive."""

    timeout: float = math.inf
    deadline: float = math.inf
    expired: bool = False
    states: dict[int, float] = field(default_factory=dict)


class VirtualBoard(OwnBoard[Task]):
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
        super().__init__("virtual", Task, _CHANNELS)
        self.servo = servo or srv02()
        self.clock = clock or SimulatedClock()
        self.plant: Moving = plant if not isinstance(plant, PlantParameters) else Plant(plant, state)
        if isinstance(self.plant, Plant) and not isinstance(self.clock, SimulatedClock):
            self.plant.prepare()
        self.terminals = Terminals(self.plant, MOTOR, self.servo.cable_gain, _ANALOG_OUTPUTS, timing, self.clock.now())
        self._digital = [0] * _DIGITAL_LINES
        self._instant = self.clock.now()  # until which the plant has moved; a sample has several calls at one instant
        self._watchdog = _Watchdog()
        self._sensors = Sensors(self.servo, self.plant)
        self._output_ranges = dict.fromkeys(range(_ANALOG_OUTPUTS), (-DAC_LIMIT, DAC_LIMIT))

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

    def _values(self, task: OwnTask) -> Values:
        """What the channels of a task read now."""
        return (
            [self._sensors.volts(channel) for channel in task.analog] if task.analog else (),
            list(map(self._sensors.counts, task.encoders)),
            [self._digital[channel] for channel in task.digital] if task.digital else (),
        )

    # --- immediate input and output -------------------------------------------------------------------------------

    def close(self) -> None:
        """Close the board; a second call does nothing."""
        self._tasks.clear()
        self._open = False

    def _set_counts(self, counts: Mapping[int, int]) -> None:
        self._catch_up(self.clock.now())
        self._sensors.set_counts(counts)

    def _set_modes(self, modes: Mapping[int, int]) -> None:
        """Count all four edges, as the data sheet's counts per turn do, or fewer."""
        self._catch_up(self.clock.now())
        self._sensors.set_modes(modes)

    def set_encoder_filter_frequency(self, channels: Channels, num_channels: int, frequencies: Vector) -> None:
        """There is no noise here to be filtered; that the frequencies (Hz) can be is checked."""
        chosen = self._chosen(channels, num_channels, "encoder")
        check_buffer(frequencies, num_channels, "analog")
        for channel, frequency in zip(chosen, frequencies.tolist(), strict=False):
            if not 0 < frequency < math.inf:
                raise HILError(f"Encoder {channel} cannot have a filter of {frequency} Hz.")

    def _set_ranges(self, kind: str, ranges: Mapping[int, Range]) -> None:
        """Cut what comes, or what is written from now on, to ranges (V)."""
        for channel, (lowest, highest) in ranges.items():
            if not -DAC_LIMIT <= lowest < highest <= DAC_LIMIT:
                raise HILError(
                    f"Channel {channel} has no range from {lowest} V to {highest} V: ±{DAC_LIMIT:g} V at most."
                )
        (self._sensors.ranges if kind == ANALOG_INPUT else self._output_ranges).update(ranges)

    def _values_now(self, task: OwnTask) -> Values:
        self._catch_up(self.clock.now())
        return self._values(task)

    def write_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Set analog outputs, V, within the converter's ±10 V."""
        voltages = self._voltages(channels, num_channels, buffer)
        self._catch_up(self.clock.now())
        if self._watchdog.expired:
            raise WatchdogExpired("The watchdog has expired and holds the outputs; clear it before writing again.")
        self.terminals.send(voltages)

    def _set_lines(self, levels: Mapping[int, int]) -> None:
        self._catch_up(self.clock.now())
        for channel, level in levels.items():
            self._digital[channel] = level

    # --- hardware-timed input -------------------------------------------------------------------------------------

    def _begin(self, task: Task, frequency: float, samples: int) -> None:
        task.start(self.clock.now(), frequency, samples)
        self.terminals.begin()

    def _fetch(self, task: Task) -> Values | None:
        if not task.remaining:
            return None
        due = task.due
        self.clock.wait_until(due)
        now = self.clock.now()
        if now > due:
            task.handle_overflow(now)
        values = task.kept()
        if values is None:
            self._catch_up(task.due)
            values = self._values(task)
        task.fetch()
        return values

    def task_stop(self, task: int) -> None:
        """Stop sampling."""
        self._task(task).stop()

    def task_delete(self, task: int) -> None:
        """Delete the task."""
        self._task(task)
        del self._tasks[task]

    # --- watchdog -------------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Channels, num_channels: int, voltages: Vector) -> None:
        """Choose the analog outputs (V) that an expired watchdog sets."""
        self._watchdog.states = self._voltages(channels, num_channels, voltages)

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

    def _voltages(self, channels: Channels, count: int, buffer: Vector) -> dict[int, float]:
        """Voltages by analog output, checked, and cut to what the converter can give in its range."""
        chosen = self._chosen(channels, count, ANALOG_OUTPUT)
        voltages = {}
        for channel, voltage in zip(chosen, finite(chosen, buffer), strict=True):
            lowest, highest = self._output_ranges[channel]
            voltages[channel] = min(max(voltage, lowest), highest)
        return voltages
