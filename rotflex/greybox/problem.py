"""The fit as a function of a vector of unknowns: what is common to all recordings, and what is each one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.identification import channel
from rotflex.plant import PlantParameters, State, driven
from rotflex.recording import Recording
from rotflex.units import Vector

#: What can be fitted, and about how large it is: where the search starts unless told, and the unit of its steps.
TYPICAL = {
    "K_s": 1.4,
    "J_eq": 2.1e-3,
    "J_l": 3.3e-3,
    "B_eq": 8e-3,
    "B_l": 1.5e-3,
    "servo_friction": 9e-3,
    "link_friction": 2e-3,
    "torque_per_volt": 0.13,
    "braking": 0.08,
    "delay": 1e-3,
}
POSITIVE = ("K_s", "J_eq", "J_l", "torque_per_volt")
_PLAIN = ("K_s", "J_eq", "J_l", "B_eq", "B_l", "torque_per_volt")  # fields of a plant that are one number
DIFFERENCE_STEP = 0.01  #: of the unit: unknowns are changed by this much to see what changes
_OFFSET, _RATE = 1e-3, 0.1  # rad, rad/s: the units of alpha_offset and of the initial rates
_POSITIVE = 0.05  # of the unit: the smallest inertia, stiffness or torque per volt
_FEWEST_WINDOWS = 3
Jacobian = NDArray[np.float64]
WINDOW = 1.0  #: s, in which theta is compared less its mean, and beyond which residuals are independent
_EVERY = 10  # samples of rest, of which one counts: neighbours have the same error, and would outweigh the motion
_BEGINNING = 10  # samples without a count, after which a recording is taken to begin at rest


# --- one recording ----------------------------------------------------------------------------------------------------


class Record:
    """A recording with theta, alpha and vm.

    Attributes
    ----------
    begins_at_rest : whether nothing moves in its first samples
    windows : of each value of the residual, the window that it lies in (0, 1, ...)

    Raises
    ------
    IdentificationError
        If a channel is missing, or an angle constant.
    """

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.theta, self.alpha = channel(recording, "theta"), channel(recording, "alpha")
        self._volts: list[float] = channel(recording, "vm", may_be_constant=True).tolist()
        angles = (self.theta, self.alpha)
        self.begins_at_rest = all(np.ptp(angle[:_BEGINNING]) == 0 for angle in angles)
        counts = [np.flatnonzero(np.diff(angle)) for angle in angles]  # samples after which an angle has changed
        self._compared = [np.union1d(at, rests(at, len(recording))) for at in counts]
        # A rest belongs to the window of the last count before it: less its own mean, nothing would be left of it.
        last = [at[np.searchsorted(at, used, "right") - 1] for at, used in zip(counts, self._compared, strict=True)]
        self._windows = [windows(at, len(recording), recording.sample_time) for at in last]
        self.windows = np.concatenate(self._windows)

    def simulate(
        self, plant: PlantParameters, delay: float, offset: float, rates: tuple[float, float]
    ) -> tuple[Vector, Vector]:
        """theta and alpha (n,), rad, as the encoders would see them."""
        begin = State(float(self.theta[0]), float(self.alpha[0]) - offset, *rates)
        angles, speeds = np.hsplit(driven(plant, begin, self._volts, self.recording.sample_time), 2)
        late = angles - delay * speeds  # a delay is short beside all that moves
        return late[:, 0], late[:, 1] + offset

    def residual(self, theta: Vector, alpha: Vector) -> Vector:
        """Measured minus simulated at counts and rests, rad: theta less its mean in each window, then alpha."""
        difference = less_mean(_between(self.theta - theta, self._compared[0]), self._windows[0])
        return np.concatenate([difference, _between(self.alpha - alpha, self._compared[1])])

    def rms(self, theta: Vector, alpha: Vector) -> dict[str, float]:
        """Root mean square of measured minus simulated over all samples, rad: see ``FitResult.residual_rms``."""
        samples = len(self.recording)
        left = less_mean(self.theta - theta, windows(np.arange(samples), samples, self.recording.sample_time))
        return {"theta": rms(left), "alpha": rms(self.alpha - alpha)}

    def beside(self, theta: Vector, alpha: Vector) -> Recording:
        """The recording with what was simulated, for plots."""
        measured = {name: self.recording[name] for name in ("theta", "alpha", "vm")}
        simulated = {"theta_model": theta, "alpha_model": alpha}
        return Recording.of(self.recording.time, self.recording.metadata, **measured, **simulated)


def windows(samples: NDArray[np.intp], length: int, sample_time: float) -> NDArray[np.intp]:
    """The window of each sample of a recording with ``length`` samples; a rest at the end belongs to the last whole."""
    window = (samples * sample_time / WINDOW + 1e-9).astype(np.intp)
    whole = int(length * sample_time / WINDOW + 1e-9)
    return np.minimum(window, max(whole - 1, 0))


def rests(counts: NDArray[np.intp], length: int) -> NDArray[np.intp]:
    """Every tenth sample after the first count of a recording with ``length`` samples that is none of the counts."""
    return np.setdiff1d(np.arange(counts[0], length - 1), counts)[::_EVERY]


def rms(values: Vector) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _between(signal: Vector, samples: NDArray[np.intp]) -> Vector:
    """Mean of each sample and the next."""
    return (signal[samples] + signal[samples + 1]) / 2


def less_mean(signal: Vector, windows: NDArray[np.intp]) -> Vector:
    """The signal less its mean in each window."""
    return signal - (np.bincount(windows, signal) / np.maximum(np.bincount(windows), 1))[windows]


# --- all of them ------------------------------------------------------------------------------------------------------


class Unknown(NamedTuple):
    """One number to be found: of all recordings (``of`` is None), or of one."""

    key: str
    parameter: str  # of the plant that it belongs to, as TYPICAL names it; none for a recording's own conditions
    of: int | None
    unit: float
    begin: float
    lowest: float


class Problem:
    """Recordings, the plant to start from, and what is to be found.

    Parameters
    ----------
    recordings : one or more
    start : the plant to start from, which keeps what is not free
    delay : of the outputs, s: to start from, or what it is
    free : names in ``TYPICAL``
    per_recording : those of them that each recording has its own of

    Attributes
    ----------
    names : of the unknowns, those of one recording with its place among several, as in ``alpha_offset[1]``
    count : called at each run of the plant
    runs : how often the plant was run
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        start: PlantParameters,
        free: Sequence[str],
        per_recording: Sequence[str] = (),
        delay: float = 0.0,
    ) -> None:
        self.records = [Record(recording) for recording in recordings]
        self.start, self.free, self.delay = start, tuple(free), delay
        self.count: Callable[[], object] = lambda: None
        self.runs = 0
        several = len(self.records) > 1
        self.own = tuple(name for name in free if name in per_recording) if several else ()
        self.unknowns = [one for name in self.free if name not in self.own for one in self._of_plant(name, None)]
        for place, record in enumerate(self.records):
            self.unknowns += [one for name in self.own for one in self._of_plant(name, place)]
            conditions = {"alpha_offset": _OFFSET}
            if not record.begins_at_rest:
                conditions |= {"theta_dot_0": _RATE, "alpha_dot_0": _RATE}
            self.unknowns += [Unknown(key, "", place, unit, 0.0, -np.inf) for key, unit in conditions.items()]
        self.names = [one.key if one.of is None or not several else f"{one.key}[{one.of}]" for one in self.unknowns]
        self.units = np.array([one.unit for one in self.unknowns])
        self.begin = np.array([one.begin for one in self.unknowns]) / self.units
        self.lowest = np.array([one.lowest for one in self.unknowns])
        sizes = [record.windows.size for record in self.records]
        ends = np.cumsum(sizes)
        self.rows = [slice(end - size, end) for end, size in zip(ends.tolist(), sizes, strict=True)]

    def require_motion(self) -> None:
        """Enough windows in which something moves.

        Raises
        ------
        IdentificationError
            If there are too few.
        """
        moving = np.unique(self.windows()).size
        if moving < _FEWEST_WINDOWS:
            raise IdentificationError(
                f"Something moves in {moving} window{'' if moving == 1 else 's'} of {WINDOW:g} s only; "
                f"at least {_FEWEST_WINDOWS} are needed. Record for longer."
            )

    def windows(self) -> NDArray[np.intp]:
        """Of each value of the residual, the window that it lies in, numbered through all recordings."""
        first, numbered = 0, []
        for record in self.records:
            numbered.append(record.windows + first)
            first += int(record.windows.max(initial=-1)) + 1
        return np.concatenate(numbered)

    def plant(self, unknowns: Vector, place: int) -> PlantParameters:
        """The plant as it was in a recording."""
        return changed(self.start, self.values(unknowns, place))

    def values(self, unknowns: Vector, place: int) -> dict[str, float]:
        """The unknowns of one recording, SI units, by name."""
        pairs = zip(self.unknowns, (unknowns * self.units).tolist(), strict=True)
        return {one.key: value for one, value in pairs if one.of in (None, place)}

    def simulate(self, unknowns: Vector, place: int) -> tuple[Vector, Vector]:
        """theta and alpha (n,) of a recording, rad."""
        value = self.values(unknowns, place)
        rates = (value.get("theta_dot_0", 0.0), value.get("alpha_dot_0", 0.0))
        self.runs += 1
        self.count()
        delay, plant = value.get("delay", self.delay), changed(self.start, value)
        return self.records[place].simulate(plant, delay, value["alpha_offset"], rates)

    def residual(self, unknowns: Vector) -> Vector:
        """What is left of all recordings."""
        return np.concatenate([self._residual(unknowns, place) for place in range(len(self.records))])

    def _residual(self, unknowns: Vector, place: int) -> Vector:
        return self.records[place].residual(*self.simulate(unknowns, place))

    def jacobian(self, unknowns: Vector, here: Vector) -> Jacobian:
        """Derivative of the residual, which is ``here``. The step does not shrink with an unknown that goes to zero."""
        columns = np.zeros((here.size, unknowns.size))
        for index, one in enumerate(self.unknowns):
            there = unknowns.copy()
            there[index] += DIFFERENCE_STEP
            for place in range(len(self.records)) if one.of is None else (one.of,):
                rows = self.rows[place]
                columns[rows, index] = (self._residual(there, place) - here[rows]) / DIFFERENCE_STEP
        return columns

    def _of_plant(self, name: str, place: int | None) -> Iterator[Unknown]:
        """The unknowns of a parameter: one, or for the servo's friction two."""
        value, unit = known(self.start, name, self.delay), TYPICAL[name]
        lowest = _POSITIVE if name in POSITIVE else 0.0
        if name == "servo_friction":
            for way, friction in zip(("plus", "minus"), value, strict=True):
                yield Unknown(f"{name}_{way}", name, place, unit, friction, lowest)
            return
        if name == "braking":
            lowest = self.start.B_eq / unit
        yield Unknown(name, name, place, unit, sum(value) / 2 if name == "link_friction" else value, lowest)


def changed(plant: PlantParameters, values: Mapping[str, float]) -> PlantParameters:
    """A plant with other values, by the names of unknowns; names that are none of a plant's change nothing."""
    changes: dict[str, Any] = {name: values[name] for name in _PLAIN if name in values}
    plus, minus = plant.servo_friction
    changes["servo_friction"] = (values.get("servo_friction_plus", plus), values.get("servo_friction_minus", minus))
    if "link_friction" in values:
        changes["link_friction"] = (values["link_friction"],) * 2
    other = replace(plant, **changes)
    if "braking" not in values:
        return other
    return replace(other, back_emf=(values["braking"] - other.B_eq) / other.torque_per_volt)


def known(plant: PlantParameters, name: str, delay: float = 0.0) -> Any:
    """A parameter of a plant by the name that a fit gives it."""
    if name == "braking":
        return plant.torque_per_volt * plant.back_emf + plant.B_eq
    return delay if name == "delay" else getattr(plant, name)
