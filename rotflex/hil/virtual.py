"""The virtual board: the nonlinear plant behind a data-acquisition board's verbs.

Wired as the laboratory is: analog output 0 drives the amplifier, encoder 0 is the servo, encoder 1 the link (which
counts the other way), analog input 0 the potentiometer, analog input 1 the tachometer.

Time is simulated by default: it passes only while a task waits for its next sample, so that a run is as quick as the
computer and the same every time. With a :class:`WallClock` it passes as on a real bench. Inside, the plant moves in
whole ticks of 1/64 ms; outputs take effect when :class:`Timing` says.
"""

from __future__ import annotations

import copy
import math
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rotflex.config import DAC_LIMIT, Servo, srv02
from rotflex.errors import BenchError, ConfigurationError, HILError, WatchdogExpired
from rotflex.hil.board import (
    ANALOG_INPUT,
    ANALOG_OUTPUT,
    Board,
    BufferOverflowMode,
    EncoderQuadratureMode,
    Range,
    Task,
    Values,
)
from rotflex.hil.guard import Measurement
from rotflex.plant import HALVINGS, REST, SUBSTEP, Moving, Plant, PlantParameters, State
from rotflex.units import DEG

MOTOR = 0
SERVO_ENCODER, LINK_ENCODER = 0, 1
POTENTIOMETER, TACHOMETER = 0, 1
_CHANNELS = {"encoder": 2, ANALOG_INPUT: 2, ANALOG_OUTPUT: 2, "digital": 8}
_TIME_WAITS = (BufferOverflowMode.WAIT_ON_OVERFLOW, BufferOverflowMode.SYNCHRONIZED)
_EDGES = (EncoderQuadratureMode.X1, EncoderQuadratureMode.X2, EncoderQuadratureMode.X4)
_TRACK = 352 * DEG  # of the potentiometer; the remaining 8 deg are the gap
#: s; whole ticks need few transition matrices of the plant, however irregular the calls are
TICK = SUBSTEP / 2**HALVINGS
_STEP = 8  # ticks; delays are multiples of it
_SPANS = frozenset(range(_STEP, 2**HALVINGS + 1, _STEP))  # moved in one go; others in powers of two
_DRAWN = 1000  # delays drawn at a time

# --- time -------------------------------------------------------------------------------------------------------------


class SimulatedClock:
    """Time that passes only while somebody waits."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Return the simulated time, s."""
        return self._now

    def wait_until(self, instant: float) -> None:
        """Let time pass until ``instant``."""
        self._now = max(self._now, instant)


class WallClock:
    """The computer's own time."""

    def __init__(self) -> None:
        self._start = time.perf_counter()

    def now(self) -> float:
        """Return the seconds since the clock was made."""
        return time.perf_counter() - self._start

    def wait_until(self, instant: float) -> None:
        """Sleep until ``instant``."""
        if (remaining := instant - self.now()) > 0:
            time.sleep(remaining)


# --- the plant behind the terminals -----------------------------------------------------------------------------------


class OwnPlant:
    """A copy of a user's plant, any object with ``state`` and ``advance(voltage, duration)``; its state is checked.

    Raises
    ------
    BenchError
        If the object is no plant; later, if its state is not four finite numbers.
    """

    def __init__(self, plant: Moving) -> None:
        self._kind = type(plant).__name__
        if isinstance(plant, type) or not hasattr(plant, "state") or not callable(getattr(plant, "advance", None)):
            given = "a class" if isinstance(plant, type) else f"a {self._kind}, which lacks state or advance()"
            raise self._unfit(f"plant= was given {given}.")
        self._plant = copy.deepcopy(plant)
        _checked_now = self.state

    @property
    def state(self) -> State:
        """Angles and rates now, checked."""
        state: Any = self._plant.state
        try:
            checked = State(*map(float, state))
        except (TypeError, ValueError):
            checked = State(math.nan, 0.0, 0.0, 0.0)
        if not all(map(math.isfinite, checked)):
            raise self._unfit(f"The state of your {self._kind} is {state!r}.")
        return checked

    def advance(self, voltage: float, duration: float) -> State:
        """Hold a voltage (V) for a duration (s), and return the state at its end."""
        self._plant.advance(voltage, duration)
        return self.state

    def _unfit(self, why: str) -> BenchError:
        return BenchError(
            f"{why} A plant is an object with state, four numbers theta, alpha, theta_dot, alpha_dot in rad and rad/s, "
            "and a method advance(voltage, duration) in V and s. Or give rotflex.plant.PlantParameters."
        )


@dataclass(frozen=True)
class Timing:
    """When an output that is written takes effect: at once by default, as it does on no real board.

    Parameters
    ----------
    delay : s, from the program's write to the voltage at the motor
    jitter : s, by which that varies either way
    late : the share of outputs that come late, 0 to 1
    late_by : s, how much later these are
    seed : of what is drawn

    Raises
    ------
    ConfigurationError
        If an output could come before it was written, or a share is none.
    """

    delay: float = 0.0
    jitter: float = 0.0
    late: float = 0.0
    late_by: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (0 <= self.jitter <= self.delay < math.inf and 0 <= self.late <= 1 and 0 <= self.late_by < math.inf):
            raise ConfigurationError(
                f"A delay must be finite and not below its jitter, and the share of late outputs from 0 to 1: {self!r}."
            )

    def ticks(self) -> Iterator[int]:
        """Yield how long one output after the other takes, in ticks: the same for the same seed."""
        draw = np.random.default_rng(self.seed)
        while True:
            spread = self.delay + self.jitter * draw.uniform(-1, 1, _DRAWN)
            late = self.late_by * (draw.random(_DRAWN) < self.late)
            yield from (_STEP * np.round((spread + late) / (_STEP * TICK)).astype(int)).tolist()


AT_ONCE = Timing()  #: no delay at all


class Terminals:
    """A plant, and the voltages that drive it.

    Parameters
    ----------
    plant : what moves
    gain : of the cable to the motor
    timing : when outputs take effect
    now : time at which the plant is where it is, s
    """

    def __init__(self, plant: Moving, gain: float, timing: Timing, now: float) -> None:
        self.plant = plant
        self._gain, self._timing = gain, timing
        self._voltages = dict.fromkeys(range(_CHANNELS[ANALOG_OUTPUT]), 0.0)
        self._coming: deque[tuple[int, Mapping[int, float]]] = deque()  # tick at which it takes effect, output → V
        self._ticks = round(now / TICK)
        self.begin()

    @property
    def commanded(self) -> list[float]:
        """The outputs (V) that were set last, arrived or on their way."""
        commanded = dict(self._voltages)
        for _due, voltages in self._coming:
            commanded |= voltages
        return list(commanded.values())

    def begin(self) -> None:
        """Draw delays from the first one again: an experiment does not depend on those before it."""
        self._delays = self._timing.ticks()

    def send(self, voltages: Mapping[int, float]) -> None:
        """Set outputs (V), now that the plant has moved until now; they take effect after their delay."""
        due = self._ticks + next(self._delays)
        if self._coming:
            due = max(due, self._coming[-1][0])  # none overtakes the one before
        self._coming.append((due, voltages))
        self._arrive(self._ticks)

    def set(self, voltages: Mapping[int, float]) -> None:
        """Set outputs (V) at once, whatever was on its way."""
        self._coming.clear()
        self._voltages |= voltages

    def move(self, instant: float) -> None:
        """Let the plant move until ``instant`` (s)."""
        target = round(instant / TICK)
        self._arrive(target)
        self._move(target)

    def _arrive(self, target: int) -> None:
        while self._coming and self._coming[0][0] <= target:
            due, voltages = self._coming.popleft()
            self._move(due)
            self._voltages |= voltages

    def _move(self, target: int) -> None:
        ticks = target - self._ticks
        while ticks > 0:
            span = ticks if ticks in _SPANS else 1 << (ticks.bit_length() - 1)
            self.plant.advance(self._voltages[MOTOR] * self._gain, span * TICK)
            ticks -= span
        self._ticks = max(target, self._ticks)


# --- the board --------------------------------------------------------------------------------------------------------


@dataclass
class _Watchdog:
    """Sets the outputs to a safe state when the program no longer shows that it is alive."""

    timeout: float = math.inf
    deadline: float = math.inf
    expired: bool = False
    states: Mapping[int, float] = field(default_factory=dict)


class VirtualBoard(Board):
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
        clock: SimulatedClock | WallClock | None = None,
        timing: Timing = AT_ONCE,
    ) -> None:
        super().__init__("virtual", _CHANNELS)
        self.servo = servo or srv02()
        self.clock = clock or SimulatedClock()
        self.plant: Moving = plant if not isinstance(plant, PlantParameters) else Plant(plant, state)
        if isinstance(self.plant, Plant) and not isinstance(self.clock, SimulatedClock):
            self.plant.prepare()
        self._instant = self.clock.now()  # until which the plant has moved; a sample has several calls at one instant
        self.terminals = Terminals(self.plant, self.servo.cable_gain, timing, self._instant)
        self._digital = [0] * _CHANNELS["digital"]
        self._watchdog = _Watchdog()
        self._offsets = [0, 0]
        self._per_count = [self.servo.K_enc, self.servo.K_enc]  # rad
        self._ranges = {  # V; no input is cut until a range is chosen
            ANALOG_INPUT: dict.fromkeys((POTENTIOMETER, TACHOMETER), (-math.inf, math.inf)),
            ANALOG_OUTPUT: dict.fromkeys(range(_CHANNELS[ANALOG_OUTPUT]), (-DAC_LIMIT, DAC_LIMIT)),
        }

    def _catch_up(self, instant: float) -> None:
        """Let the plant move until ``instant``, and take the samples that are due before.

        Where time waits, by its overflow mode (``_TIME_WAITS``), a task takes its samples when they are fetched.
        """
        if instant == self._instant:
            return
        while due := [
            task
            for task in self._tasks.values()
            if task.due < instant and task.remaining and task.overflow not in _TIME_WAITS
        ]:
            self._take(min(due, key=lambda task: task.due))
        self._move(instant)

    def _move(self, instant: float) -> None:
        self._instant = instant
        if self._watchdog.deadline < instant:
            self.terminals.move(self._watchdog.deadline)
            self._watchdog.expired = True
            self._watchdog.deadline = math.inf
            self.terminals.set(self._watchdog.states)
        self.terminals.move(instant)

    def _take(self, task: Task) -> None:
        """Take the next sample of a task."""
        if task.due > self._instant:
            self._move(task.due)
        task.due += task.period
        task.give(self._values(task))

    def _counted(self, channel: int) -> int:
        """Return what an encoder's counter reads. The link's counts the other way."""
        state = self.plant.state
        angle = state.theta if channel == SERVO_ENCODER else -state.alpha
        return round(angle / self._per_count[channel]) + self._offsets[channel]

    def _volts(self, channel: int) -> float:
        """Return what an analog input reads, V."""
        state, (lowest, highest) = self.plant.state, self._ranges[ANALOG_INPUT][channel]
        if channel == TACHOMETER:
            volts = state.theta_dot / self.servo.K_tach if self.servo.tachometer else 0.0
        else:
            wrapped = math.remainder(state.theta, 2 * math.pi)
            volts = wrapped / self.servo.K_pot if abs(wrapped) <= _TRACK / 2 else 0.0  # the wiper is in the gap
        return min(max(volts, lowest), highest)

    def _values(self, task: Task) -> Values:
        """Return what the channels of a task read now."""
        return (
            [self._volts(channel) for channel in task.analog] if task.analog else (),
            list(map(self._counted, task.encoders)),
            [self._digital[channel] for channel in task.digital] if task.digital else (),
        )

    # Immediate input and output ---------------------------------------------------------------------------------

    def _set_counts(self, counts: Mapping[int, int]) -> None:
        self._catch_up(self.clock.now())
        for channel, count in counts.items():
            self._offsets[channel] += count - self._counted(channel)

    def _set_modes(self, modes: Mapping[int, int]) -> None:
        """Count one, two or four edges."""
        self._catch_up(self.clock.now())
        for channel, mode in modes.items():
            if mode not in _EDGES:
                raise HILError(f"Encoder {channel} counts one, two or four edges; it was given the mode {mode}.")
            before = self._counted(channel)
            self._per_count[channel] = self.servo.K_enc * EncoderQuadratureMode.X4 / mode
            self._offsets[channel] += before - self._counted(channel)

    def _set_filters(self, frequencies: Mapping[int, float]) -> None:
        """Check the frequencies (Hz); there is no noise here to be filtered."""
        for channel, frequency in frequencies.items():
            if not 0 < frequency < math.inf:
                raise HILError(f"Encoder {channel} cannot have a filter of {frequency} Hz.")

    def _set_ranges(self, kind: str, ranges: Mapping[int, Range]) -> None:
        """Cut what comes in, or what is written from now on, to ranges (V)."""
        for channel, (lowest, highest) in ranges.items():
            if not -DAC_LIMIT <= lowest < highest <= DAC_LIMIT:
                raise HILError(
                    f"Channel {channel} has no range from {lowest} V to {highest} V: ±{DAC_LIMIT:g} V at most."
                )
        self._ranges[kind].update(ranges)

    def _read_now(self, task: Task) -> Values:
        self._catch_up(self.clock.now())
        return self._values(task)

    def _write(self, voltages: Mapping[int, float]) -> None:
        self._catch_up(self.clock.now())
        if self._watchdog.expired:
            raise WatchdogExpired("The watchdog has expired and holds the outputs; clear it before writing again.")
        self.terminals.send(self._within_ranges(voltages))

    def _set_lines(self, levels: Mapping[int, int]) -> None:
        self._catch_up(self.clock.now())
        for channel, level in levels.items():
            self._digital[channel] = level

    def _within_ranges(self, voltages: Mapping[int, float]) -> dict[int, float]:
        ranges = self._ranges[ANALOG_OUTPUT]
        return {channel: min(max(volts, ranges[channel][0]), ranges[channel][1]) for channel, volts in voltages.items()}

    # Hardware-timed input ---------------------------------------------------------------------------------------

    def _begin(self, task: Task, frequency: float, samples: int) -> None:
        task.begin(samples)
        task.period, task.due = 1.0 / frequency, self.clock.now()
        self.terminals.begin()

    def _fetch(self, task: Task) -> Values | None:
        comes = task.remaining and not task.waiting
        if comes:
            self.clock.wait_until(task.due)
        if task.overflow not in _TIME_WAITS:
            self._catch_up(self.clock.now())
            if comes and not task.waiting:
                self._take(task)
            return task.take()
        if not task.remaining:
            return None
        self._catch_up(task.due)
        task.due += task.period
        task.remaining -= 1
        return self._values(task)

    # Watchdog ---------------------------------------------------------------------------------------------------

    def _set_safe_voltages(self, voltages: Mapping[int, float]) -> None:
        self._watchdog.states = self._within_ranges(voltages)

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
        """Return whether the watchdog has expired."""
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
        """Find out, before each call to the watchdog, whether it has expired since the last one."""
        self._check_open()
        self._catch_up(self.clock.now())


# --- a hand on the arm ------------------------------------------------------------------------------------------------

STANDING, DRIVING = 17 * DEG, 10 * DEG  #: rad, ``most`` while the servo is only held, or is driven
_STIFFNESS = 3.0  # of the hand's spring, relative to the joint's
_DAMPING = 0.7  # of the arm in the hand
_SHORT_OF = 0.95  # of ``most``: how far a hand holds the arm, so that it is held steadily


class Hand:
    """A hand that pulls the arm as a spring and a damper would, see :meth:`rotflex.hil.bench.Bench.disturb`.

    The hand alone does not deflect the arm by more than ``most``. While the servo stands, the arm is a mass on a
    spring. A constant torque tau moves it on a circle around tau/K_s, with the coordinates alpha and alpha_dot/omega_n.
    The largest torque that keeps the circle within ``most`` is the limit in each sample. So the arm also stays within
    ``most`` after the hand has let go. A motor that drives can add some degrees: then ``most`` is smaller. The tests
    pull as badly as they can on many benches, and the deflection stays below 20 deg.

    Parameters
    ----------
    most : rad, by which it deflects the arm at most
    """

    def __init__(self, most: float) -> None:
        self._most = most
        self._pull: float | None = None  # rad

    def pull(self, direction: float) -> None:
        """Pull the arm towards a direction in the room, rad as theta, until :meth:`let_go`."""
        self._pull = direction

    def let_go(self) -> None:
        """Pull no more."""
        self._pull = None

    def __call__(self, _measured: Measurement, plant: Plant) -> float:
        """Return the torque on the link, N·m."""
        pull = self._pull  # read once: it is written by another thread
        if pull is None:
            return 0.0
        theta, alpha, theta_dot, alpha_dot = plant.state
        K_s, J_l = plant.parameters.K_s, plant.parameters.J_l
        damping = 2 * _DAMPING * math.sqrt((1 + _STIFFNESS) * K_s * J_l)
        off = math.remainder(pull - theta - alpha, 2 * math.pi)
        held = K_s * math.copysign(min(_STIFFNESS * abs(off), _SHORT_OF * self._most), off)
        wanted = held - damping * (theta_dot + alpha_dot)
        room = max(0.0, self._most**2 - alpha**2 - alpha_dot**2 * J_l / K_s)
        largest = K_s * room / (2 * (self._most - math.copysign(alpha, wanted * alpha))) if room else 0.0
        return math.copysign(min(abs(wanted), largest), wanted)
