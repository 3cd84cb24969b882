"""A recording in the plant's place: what was measured once, through the same verbs.

A recording cannot be steered. So a replay gives a run only if it *is* that run: a controller that is fed with the
recorded angles has to set the voltages that were recorded. That needs no word of the recording's about itself, and
holds for the log of a real bench as well. All else is refused. (But for samples that came late, or never: the recording
says which those were, and how many they may be is bounded, so that nobody can declare a run as held.)

:class:`RecordedRuns` are many recordings of a bench, of which each experiment is given its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.controller import Controller, begun
from rotflex.errors import BenchError, NotRecorded, RecordingError
from rotflex.hil.board import WATCHDOG_TIMEOUT
from rotflex.plant import State
from rotflex.recording import Channel, Recording
from rotflex.unanswered import HELD, LOST, MOST_NOTED, TIMING, cut, mask, stretches, table_of
from rotflex.units import Vector

REPORTED = "told"  #: in a recording's metadata: the parts as the student was told them, and the bench's limit
VOLTAGE_LIMIT = "voltage_limit"  #: in that, V: to which the bench cut voltages
SETTINGS = ("drive", "signal", "feedback", "f_start", "f_stop", "K")  #: of an experiment, in its recording's metadata
#: of a run. A replay bears more than what is measured on a recording (:data:`rotflex.doubts.FEW`): it asks only
#: whether the run is the same, and where a voltage was held, that one is compared. On a computer that was kept busy on
#: purpose 0.006 of a minute's samples came late
MOST_HELD = 0.05
_SAME_PERIOD = 1e-6  # of the sample time
_SAME = 5e-3  # of the recorded voltage (RMS); gains as a report prints them, with four digits, make a thirtieth of it
_SAME_VOLTS = 1e-3  # V, where hardly any voltage was recorded
_ROUNDING = 2  # samples: where a pause begins and ends within a period
_MOST_LISTED = 12
_BESIDE = (
    "the recorded voltages are not those that its controller sets on the recorded angles. A person will look at it "
    "before it counts."
)
_NOTHING = Recording.of([0.0, 0.002], theta=[0.0, 0.0], alpha=[0.0, 0.0], vm=[0.0, 0.0])


class RecordedPlant:
    """Moves as a recording says, whatever voltage it is given; at the end it stays where it is.

    Parameters
    ----------
    recording : with theta and alpha
    name : of its file

    Raises
    ------
    RecordingError
        If one of them is missing.
    """

    def __init__(self, recording: Recording, name: str = "the recording") -> None:
        missing = [name for name in ("theta", "alpha") if name not in recording]
        if missing:
            raise RecordingError(f"The recording lacks {' and '.join(missing)}: there is nothing to replay.")
        self.recording, self.name = recording, name
        self._angles = list(zip(recording["theta"].tolist(), recording["alpha"].tolist(), strict=True))
        self._elapsed = 0.0

    # --- as a plant -------------------------------------------------------------------------------------------------

    @property
    def state(self) -> State:
        """Angles between two samples lie on a straight line, of which the rates are the slopes."""
        dt, last = self.recording.sample_time, len(self._angles) - 1
        place = min(self._elapsed / dt, float(last))
        index = min(math.floor(place), last - 1)
        before, after = self._angles[index : index + 2]
        rises = [then - now for now, then in zip(before, after, strict=True)]
        theta, alpha = (angle + (place - index) * rise for angle, rise in zip(before, rises, strict=True))
        theta_dot, alpha_dot = (rise / dt if place < last else 0.0 for rise in rises)
        return State(theta, alpha, theta_dot, alpha_dot)

    def advance(self, voltage: float, duration: float) -> State:
        """Let time pass; the voltage changes nothing."""
        self._elapsed += duration
        return self.state

    def rewind(self) -> None:
        """Go back to its beginning."""
        self._elapsed = 0.0

    # --- as a run ---------------------------------------------------------------------------------------------------

    @property
    def duration(self) -> float:
        """s, from the first sample to the last."""
        return float(self.recording.time[-1] - self.recording.time[0])

    def samples(self, sample_time: float) -> int:
        """Return how many samples at another sample time (s) it can give."""
        return math.floor(self.duration / sample_time + 1e-6) + 1

    def voltage(self, samples: int, sample_time: float) -> Vector | None:
        """Return the recorded voltage (samples,), V, held from one sample to the next; None where none was recorded."""
        if "vm" not in self.recording:
            return None
        places = np.arange(samples) * (sample_time / self.recording.sample_time)
        held: Vector = self.recording["vm"][np.minimum(np.floor(places + 1e-6).astype(int), len(self.recording) - 1)]
        return held

    def timing(self, samples: int, sample_time: float) -> dict[str, Any]:
        """Return what the recording says of how steadily its first samples came; nothing at another sample time."""
        about = self.recording.metadata
        return {TIMING: cut(about, 0, samples)[TIMING]} if self._is_period(sample_time) and TIMING in about else {}

    def _is_period(self, sample_time: float) -> bool:
        return abs(sample_time - self.recording.sample_time) <= _SAME_PERIOD * sample_time

    def require_whole(self, samples: int, sample_time: float, requested: str) -> None:
        """Check that it may be the run that is asked for.

        Raises
        ------
        BenchError
            If it is too short, sampled otherwise, or without the voltage.
        """
        if not self._is_period(sample_time):
            held = self.recording.sample_time
            why = f"it is sampled every {held * 1e3:g} ms, and this every {sample_time * 1e3:g} ms"
        elif "vm" not in self.recording:
            why = "without vm, nothing tells whether it is this run"
        elif samples > len(self.recording):
            why = f"it is of {self.duration:g} s, and {(samples - 1) * sample_time:g} s are asked for: see duration="
        else:
            return
        raise self._refused(requested, why)

    def require_same(self, volts: Vector, requested: str) -> Vector:
        """Return the recorded voltage, if ``volts`` are it.

        Raises
        ------
        BenchError
            If the run that is asked for would have set another one.
        """
        recorded = self.recording["vm"][: volts.size]
        apart = voltage_errors(self.recording, volts)
        if _is_same(recorded, apart):
            return recorded
        worst = int(np.argmax(apart))
        time, ours, theirs = worst * self.recording.sample_time, volts[worst], recorded[worst]
        why = f"this would set {ours:.2f} V at t = {time:.3f} s, where {theirs:.2f} V were recorded"
        raise self._refused(requested, why)

    def _refused(self, requested: str, why: str) -> BenchError:
        held = self.recording.metadata.get("experiment", "a run that does not say which")
        return BenchError(
            f"A recording cannot be steered, and {self.name} is not the run that is asked for ({requested}): {why}. It "
            f"holds {held}: {', '.join(self.recording.channels)}, {self.duration:g} s. experiments.watch(bench, "
            f"duration={self.duration:g}) gives it as it is, and experiments.validation(bench, A, B, "
            'signal="recorded") a model beside it; for anything else, open another bench.'
        )


class RecordedRuns(RecordedPlant):
    """Recordings of one bench, of which each experiment chooses its own.

    Parameters
    ----------
    recordings : in the order in which they were made
    v_max : to which voltages were cut where a recording says of no lower limit, V
    run : number of the run that is asked for

    Raises
    ------
    RecordingError
        If theta or alpha is missing in one.
    """

    def __init__(self, recordings: Sequence[Recording], v_max: float, run: int) -> None:
        self._all, self._v_max, self._run = [RecordedPlant(one).recording for one in recordings], v_max, run
        super().__init__(_NOTHING)

    def choose(
        self, settings: Mapping[str, Any], controller: Controller | None, reference: Vector, sample_time: float
    ) -> None:
        """Take the recording of an experiment.

        Parameters
        ----------
        settings : what its recording says of itself; "experiment" is its name
        controller : that is to run; None where nothing does
        reference : (n,), as the controller takes it
        sample_time : s

        Raises
        ------
        NotRecorded
            If it was not recorded; the message says what was.
        """
        name = str(settings.get("experiment", ""))
        likely = [one for one in self._all if one.metadata.get("experiment") == name and run_of(one) == self._run]
        for one in reversed(likely):
            if controller is None or _fits(one, controller, reference, sample_time, voltage_limit(one, self._v_max)):
                return super().__init__(one, f"the recording of your {name}")
        for one in reversed(likely):
            if _is_of_call(one, settings, reference, sample_time):
                print(f"Note      {described(one.metadata)}: {_BESIDE}")
                return super().__init__(one, f"the recording of your {name}")
        raise NotRecorded(self._lacking(settings, bool(likely)))

    def require_same(self, volts: Vector, requested: str) -> Vector:
        """Return the recorded voltage. That it is this run was found when it was chosen.

        (A board counts from where the arm stands at its start; what was recorded may have begun a count beside.)
        """
        return self.recording["vm"][: volts.size]

    def exactly(self, given: Recording) -> Recording:
        """Return a run on it as it was recorded: with those angles, and with what the recording says of itself."""
        exact = {name: Channel(self.recording[name][: len(given)], "rad") for name in ("theta", "alpha")}
        about = cut(self.recording.metadata, 0, len(given))
        about = {name: value for name, value in about.items() if name != REPORTED}  # which came when it was kept
        return Recording(given.time, {**given.channels, **exact}, about)

    def _lacking(self, settings: Mapping[str, Any], some: bool) -> str:
        """Return that an experiment was not recorded, and what was."""
        wanted = described(settings, run=self._run)
        if not self._all:
            return f"Nothing was recorded at the bench yet: {wanted}. Start the notebook with its address, and run it."
        why = "it was recorded with other settings only" if some else "it was not recorded"
        listed = list(dict.fromkeys(described(one.metadata, float(one.time[-1])) for one in self._all))
        if len(listed) > _MOST_LISTED:
            listed = [f"{len(listed) - _MOST_LISTED} before", *listed[-_MOST_LISTED:]]
        return (
            f"This experiment has no recording of your bench: {wanted}; {why}. Record it at the bench with what your "
            f"notebook has now, and hand in the folder with the new recording. Recorded are: {'; '.join(listed)}."
        )


def voltage_limit(recording: Recording, v_max: float) -> float:
    """Return to which voltage (V) the bench of a recording cut what its controller asked for.

    Parameters
    ----------
    recording : says so itself, where it was kept at a bench
    v_max : the most that its servo can have, V; a limit beyond it counts for nothing
    """
    limit = table_of(recording.metadata, REPORTED).get(VOLTAGE_LIMIT)
    if isinstance(limit, bool) or not isinstance(limit, int | float) or not limit > 0:
        return v_max
    return min(limit, v_max)


def run_of(recording: Recording) -> int:
    """Return the number of the run that a recording says it is; 1 where it says none."""
    run = table_of(recording.metadata, "bench").get("run", 1)
    return run if isinstance(run, int) else 1


def described(settings: Mapping[str, Any], seconds: float = 0.0, run: int = 1) -> str:
    """Return an experiment in words, as "tracking, feedback = full, K = 18.2 -17.2 1.6 0.6, 10 s"."""
    run = table_of(settings, "bench").get("run", run)
    parts = [str(settings.get("experiment", "an experiment without a name"))]
    for name in SETTINGS:
        value = settings.get(name)
        if value is not None:
            text = " ".join(f"{one:.4g}" for one in value) if isinstance(value, list) else f"{value}"
            parts.append(f"{name} = {text}")
    if seconds:
        parts.append(f"{seconds:.3g} s")
    if run != 1:
        parts.append(f"run {run}")
    return ", ".join(parts)


def _fits(recording: Recording, controller: Controller, reference: Vector, sample_time: float, v_max: float) -> bool:
    """Return whether a run of a controller along a reference is what was recorded."""
    if "vm" not in recording or reference.size > len(recording):
        return False
    if abs(recording.sample_time - sample_time) > _SAME_PERIOD * sample_time:
        return False
    apart = voltage_errors(recording, voltages(recording, controller, reference, v_max))
    return _is_same(recording["vm"][: reference.size], apart)


def voltages(recording: Recording, controller: Controller, reference: Vector, v_max: float) -> Vector:
    """Return the voltages (n,), V within ±v_max, that a controller sets for the recorded angles.

    There are as many as reference and recording both have samples. NaN becomes inf, which equals no recorded voltage.
    """
    controller = begun(controller, recording.sample_time)
    samples = zip(reference.tolist(), recording["theta"].tolist(), recording["alpha"].tolist(), strict=False)
    clipped = [min(max(controller(target, theta, alpha), -v_max), v_max) for target, theta, alpha in samples]
    result: Vector = np.nan_to_num(np.array(clipped), nan=math.inf)
    return result


def _is_of_call(recording: Recording, settings: Mapping[str, Any], reference: Vector, sample_time: float) -> bool:
    """Whether a recording says that it was made by the same call: with these settings, and along this command."""
    command = recording["theta_ref"] if "theta_ref" in recording else np.zeros(0)
    return (
        command.size == reference.size
        and abs(recording.sample_time - sample_time) <= _SAME_PERIOD * sample_time
        and all(_agrees(recording.metadata.get(name), value) for name, value in settings.items())
        and bool(np.allclose(command, reference, atol=1e-6))
    )


def _agrees(recorded: Any, value: Any) -> bool:
    """Whether a setting is the same; a gain that is computed again may differ in its last digit."""
    try:
        return bool(np.allclose(recorded, value, rtol=1e-9, atol=0))
    except (TypeError, ValueError):
        return bool(recorded == value)


def implausible_timing(recording: Recording) -> str | None:
    """Return why what a recording says of samples that were not answered cannot be so, or is too much; None if not."""
    timing = table_of(recording.metadata, TIMING)
    if not timing:
        return None
    held, samples = stretches(recording.metadata, HELD), len(recording)
    counted = [value for name in ("late", "missed") if type(value := timing.get(name)) is int]
    declared = sum(count for _first, count in held)
    if (timing.get(HELD, []) and not held) or declared > sum(counted) + len(held):
        return "what it says of samples that were not answered does not go together"
    if sum(counted) > declared and len(held) >= MOST_NOTED:
        return f"the program paused more than {MOST_NOTED} times in it"
    pause = round(WATCHDOG_TIMEOUT / recording.sample_time) + _ROUNDING
    longest = max((count for _first, count in held), default=0)
    if longest > pause:
        return (
            f"{longest} samples in a row are said not to have been answered, where the watchdog ends a run after "
            f"{pause}"
        )
    # A short run may have one whole pause.
    if declared > max(MOST_HELD * samples, pause):
        return f"{declared / samples:.0%} of its samples were not answered in time; a replay bears {MOST_HELD:.0%}"
    return None


def lost_samples(recording: Recording) -> NDArray[np.bool_]:
    """Return which of a recording's samples (n,) never came, and lie between their neighbours."""
    if implausible_timing(recording):
        return np.zeros(len(recording), dtype=bool)
    held = mask(stretches(recording.metadata, HELD), len(recording))
    return held & mask(stretches(recording.metadata, LOST), len(recording))


def voltage_errors(recording: Recording, volts: Vector) -> Vector:
    """Return how far what a controller sets on the recorded angles is from what was recorded, V (samples,).

    Where a sample was not answered, what counts is what the motor had then: the voltage of the sample before the pause,
    or the answer to the one with which it began, where that came late.

    Parameters
    ----------
    recording : with vm, and at least as long as ``volts``
    volts : (samples,), what the controller sets, V
    """
    recorded = recording["vm"][: volts.size]
    difference: Vector = np.abs(volts - recorded)
    if implausible_timing(recording):
        return difference
    for first, count in stretches(recording.metadata, HELD):
        if first >= volts.size:
            break
        part = slice(first, first + count)
        before = recorded[first - 1] if first else 0.0
        difference[part] = np.minimum(np.abs(recorded[part] - before), np.abs(recorded[part] - volts[first]))
    return difference


def _is_same(recorded: Vector, errors: Vector) -> bool:
    """Whether voltages that are so far from those recorded (both (samples,), V) are the same controller's."""
    return _rms(errors) <= max(_SAME * _rms(recorded), _SAME_VOLTS)


def _rms(values: Vector) -> float:
    return float(np.sqrt(np.mean(values**2)))
