"""Many recordings of a bench in the plant's place: each experiment is given its own, where it was recorded.

Which one it is, the voltages say, as on any replay: a controller that is fed with the recorded angles has to set what
was recorded. Of several that fit, the last one counts. Where none fits, a recording of the very same call is given
(experiment, settings, command), with a note that a person will look at it: its voltages are not its controller's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rotflex.controller import Controller, begun
from rotflex.errors import NotRecorded
from rotflex.hil import answered
from rotflex.hil.board import Vector
from rotflex.hil.replay import RecordedPlant
from rotflex.recording import Channel, Recording
from rotflex.unanswered import cut

TOLD = "told"  #: in a recording's metadata: the parts as the student was told them, and the bench's limit
VOLTAGE_LIMIT = "voltage_limit"  #: in that, V: to which the bench cut voltages
SETTINGS = ("drive", "signal", "feedback", "f_start", "f_stop", "K")  #: of an experiment, in its recording's metadata
_MOST_LISTED = 12
_BESIDE = (
    "the recorded voltages are not those that its controller sets on the recorded angles. A person will look at it "
    "before it counts."
)
_NOTHING = Recording.of([0.0, 0.002], theta=[0.0, 0.0], alpha=[0.0, 0.0], vm=[0.0, 0.0])


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
            if controller is None or fits(one, controller, reference, sample_time, voltage_limit(one, self._v_max)):
                super().__init__(one, f"the recording of your {name}")
                return
        for one in reversed(likely):
            if _is_of_call(one, settings, reference, sample_time):
                print(f"Note      {described(one.metadata)}: {_BESIDE}")
                super().__init__(one, f"the recording of your {name}")
                return
        raise NotRecorded(self._lacking(settings, bool(likely)))

    def require_same(self, volts: Vector, asked: str) -> Vector:
        """The recorded voltage. That it is this run was found when it was chosen.

        (A board counts from where the arm stands at its start; what was recorded may have begun a count beside.)
        """
        return self.recording["vm"][: volts.size]

    def exactly(self, given: Recording) -> Recording:
        """A run on it as it was recorded: with those angles, and with what the recording says of itself."""
        exact = {name: Channel(self.recording[name][: len(given)], "rad") for name in ("theta", "alpha")}
        about = cut(self.recording.metadata, 0, len(given))
        about = {name: value for name, value in about.items() if name != TOLD}  # which came when it was kept
        return Recording(given.time, {**given.channels, **exact}, about)

    def _lacking(self, settings: Mapping[str, Any], some: bool) -> str:
        """That an experiment was not recorded, and what was."""
        asked = described(settings, run=self._run)
        if not self._all:
            return (
                f"Nothing was recorded at the bench yet, and so not this either: {asked}. Record it there: start "
                "the notebook with the bench's address, and run it."
            )
        why = "it was recorded with other settings only" if some else "it was not recorded"
        listed = list(dict.fromkeys(described(one.metadata, float(one.time[-1])) for one in self._all))
        if len(listed) > _MOST_LISTED:
            listed = [f"{len(listed) - _MOST_LISTED} before", *listed[-_MOST_LISTED:]]
        return (
            f"This experiment has no recording of your bench: {asked}; {why}. Record it at the bench with what "
            "your notebook has now, and hand in the folder with the new recording. Recorded are: "
            f"{'; '.join(listed)}."
        )


def voltage_limit(recording: Recording, v_max: float) -> float:
    """To which voltage (V) the bench of a recording cut what its controller asked for.

    Parameters
    ----------
    recording : says so itself, where it was kept at a bench
    v_max : the most that its servo can have, V; a limit beyond it counts for nothing
    """
    told = recording.metadata.get(TOLD)
    limit = told.get(VOLTAGE_LIMIT) if isinstance(told, Mapping) else None
    if isinstance(limit, bool) or not isinstance(limit, int | float) or not limit > 0:
        return v_max
    return min(limit, v_max)


def run_of(recording: Recording) -> int:
    """The number of the run that a recording says it is; 1 where it says none."""
    about = recording.metadata.get("bench")
    run = about.get("run", 1) if isinstance(about, Mapping) else 1
    return run if isinstance(run, int) else 1


def described(settings: Mapping[str, Any], seconds: float = 0.0, run: int = 1) -> str:
    """An experiment in words, as "tracking, feedback = full, K = 18.2 -17.2 1.6 0.6, 10 s"."""
    about = settings.get("bench")
    run = about.get("run", run) if isinstance(about, Mapping) else run
    words = [str(settings.get("experiment", "an experiment without a name"))]
    for name in SETTINGS:
        value = settings.get(name)
        if value is not None:
            text = " ".join(f"{one:.4g}" for one in value) if isinstance(value, list) else f"{value}"
            words.append(f"{name} = {text}")
    if seconds:
        words.append(f"{seconds:.3g} s")
    if run != 1:
        words.append(f"run {run}")
    return ", ".join(words)


def fits(recording: Recording, controller: Controller, reference: Vector, sample_time: float, v_max: float) -> bool:
    """Whether a run of a controller along a reference is what was recorded."""
    if "vm" not in recording or reference.size > len(recording):
        return False
    if abs(recording.sample_time - sample_time) > 1e-6 * sample_time:
        return False
    apart = answered.apart(recording, voltages(recording, controller, reference, v_max))
    return answered.is_same(recording["vm"][: reference.size], apart)


def voltages(recording: Recording, controller: Controller, reference: Vector, v_max: float) -> Vector:
    """What a controller sets, fed with the recorded angles: V, one for each entry of the reference."""
    controller = begun(controller)
    both = zip(reference.tolist(), recording["theta"].tolist(), recording["alpha"].tolist(), strict=False)
    set_ = [min(max(controller(target, theta, alpha), -v_max), v_max) for target, theta, alpha in both]
    finite: Vector = np.nan_to_num(np.array(set_), nan=math.inf)
    return finite


def _is_of_call(recording: Recording, settings: Mapping[str, Any], reference: Vector, sample_time: float) -> bool:
    """Whether a recording says that it was made by the same call: with these settings, and along this command."""
    command = recording["theta_ref"] if "theta_ref" in recording else np.zeros(0)
    return (
        command.size == reference.size
        and abs(recording.sample_time - sample_time) <= 1e-6 * sample_time
        and all(_agrees(recording.metadata.get(name), value) for name, value in settings.items())
        and bool(np.allclose(command, reference, atol=1e-6))
    )


def _agrees(told: Any, value: Any) -> bool:
    """Whether a setting is the same; a gain that is computed again may differ in its last digit."""
    try:
        return bool(np.allclose(told, value, rtol=1e-9, atol=0))
    except (TypeError, ValueError):
        return bool(told == value)
