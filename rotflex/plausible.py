"""Whether a recording can be one of a bench: its counts, its controller, its link, its motor.

Four things are looked at, each on the recording alone:

* **counts**: angles are whole counts of the encoders, where samples came;
* **controller**: the voltage is what the experiment's controller sets, fed with the recorded angles and cut to the
  bench's limit, where samples were answered, and what was held where they came late;
* **link**: the arm moves as the servo's angle makes an arm of this bench's natural frequency move. The servo's
  friction, which differs from run to run, has no part in it;
* **motor**: the servo accelerates as this bench's motor makes it, a few milliseconds after the voltage and not before.

A simulation of this very bench with its encoders and its delay passes all of it. See ``docs/real_bench_marks.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from rotflex import experiments, link
from rotflex.config import Servo
from rotflex.courseware.messages import _
from rotflex.errors import RotflexError
from rotflex.hil import answered
from rotflex.hil.controllers import Controller, StateFeedback
from rotflex.hil.recorded_runs import voltage_limit, voltages
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.units import DEG, HZ

_COUNTS = 1e-3  # of a count: files hold degrees to ten digits or more
_VOLTS = 2e-3  # V: what rounding in a file may change; one count is worth more with any gain of use
_LINK = (
    0.25  # RMS of what the link's equation leaves, of the deflection's; up to 0.15 on a real log, and on virtual ones
)
_STILL = 0.4 * DEG  # RMS of the deflection, below which it is counts and little else
_DRIVEN = 0.4  # V, RMS, below which most of the voltage goes into friction; small trials have 0.3, a decay has 0.6
_SMOOTH = 20 * HZ  # rad/s, of the filter through which accelerations are seen
_MOTOR = 0.25  # how far, relative, the motor's effect may be from the bench's; 0.03 is usual
_EARLY, _LATE = 0, 5  # samples by which the servo answers after its voltage: board and hold make 1 or 2
_FEWEST_SWINGS = 4  # of the voltage, without which the motor's effect cannot be told from friction
_FEWEST = 200  # samples, to tell anything by

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """What was looked at on a recording: numbers for a person to read.

    Attributes
    ----------
    counts : largest distance of an angle from a whole count, in counts
    volts : largest difference of the voltage from the controller's, V; None where no controller is known
    link : RMS of what the link's equation leaves, relative to the deflection's; None where the arm hardly moved
    gain, delay : the motor's effect relative to the bench's, and by how many samples it comes after the voltage; None
        where the servo hardly moved
    timing : why its samples that were not answered are too many; "" where they are not
    """

    counts: float
    volts: float | None
    link: float | None
    gain: float | None
    delay: int | None
    timing: str = ""

    def doubts(self) -> Iterator[str]:
        """What of it is not as on a bench."""
        if self.timing:
            yield self.timing
        if self.counts > _COUNTS:
            yield _("its angles are no whole counts of the encoders")
        if self.volts is not None and self.volts > _VOLTS:
            yield _("its voltage is up to {volts:.2g} V beside what its controller sets on its angles").format(
                volts=self.volts
            )
        if self.link is not None and self.link > _LINK:
            yield _("its arm does not move as the arm of this bench ({share:.0%} of its motion is left over)").format(
                share=self.link
            )
        if self.delay is not None and not _EARLY <= self.delay <= _LATE:
            yield _("its servo moves {samples} samples after its voltage").format(samples=self.delay)
        elif self.gain is not None and abs(self.gain - 1) > _MOTOR:
            yield _("its motor pulls {gain:.2g} times as hard as that of this bench").format(gain=self.gain)


def look(recording: Recording, servo: Servo, bench: PlantParameters) -> Found:
    """Look at a recording.

    Parameters
    ----------
    recording : theta, alpha and vm, with the experiment's settings in its metadata
    servo : as the student was told it
    bench : the bench as it is known
    """
    theta, alpha, vm = recording["theta"], recording["alpha"], recording["vm"]
    came = ~answered.lost(recording)
    counts = np.concatenate([theta[came], alpha[came]]) / servo.K_enc
    gain, delay = _motor(theta, alpha, vm, recording.sample_time, bench)
    return Found(
        counts=float(np.abs(counts - np.round(counts)).max()),
        volts=_off_the_controller(recording, servo),
        # At 0 V somebody moves it by hand, or it swings from before.
        link=_left_of_the_link(theta, alpha, came, recording.sample_time, bench) if vm.any() else None,
        gain=gain,
        delay=delay,
        timing=answered.why_not(recording),
    )


def _off_the_controller(recording: Recording, servo: Servo) -> float | None:
    """The largest difference of the voltage from what its controller sets, V."""
    controller = _controller(recording)
    if controller is None or "theta_ref" not in recording:
        return None
    anew = voltages(recording, controller, recording["theta_ref"], voltage_limit(recording, servo.V_max))
    return float(answered.apart(recording, anew).max())


def _controller(recording: Recording) -> Controller | None:
    """What a recording says that it was made with; None where that is no feedback."""
    about = recording.metadata
    if about.get("experiment") == "sweep" and about.get("drive") == "position":
        return experiments.FOLLOWING()
    if about.get("experiment") == "free decay":
        return experiments.HOLDING()
    if about.get("experiment") == "tracking":
        try:
            return StateFeedback(about.get("K"), about.get("feedback", ""), recording.sample_time)  # type: ignore[arg-type]
        except RotflexError:
            return None
    return None


def _left_of_the_link(
    theta: Vector, alpha: Vector, came: NDArray[np.bool_], dt: float, bench: PlantParameters
) -> float | None:
    """What :func:`rotflex.link.residual` says of this bench; None where the arm hardly moved."""
    if theta.size < _FEWEST or float(np.std(alpha)) < _STILL:
        return None
    return link.residual(theta, alpha, dt, bench.K_s / bench.J_l, bench.B_l / bench.J_l, came)


def _motor(
    theta: Vector, alpha: Vector, vm: Vector, dt: float, bench: PlantParameters
) -> tuple[float | None, int | None]:
    """The motor's effect, relative to the bench's, and the samples by which it comes after the voltage.

    Accelerations are seen through a filter, and all else through the same one; friction is fitted, as it is no two
    runs' the same.
    """
    swings = np.count_nonzero(np.diff(np.sign(vm - vm.mean())))
    hardly = float(np.std(theta)) < _STILL or float(np.std(vm)) < _DRIVEN
    if hardly or theta.size < _FEWEST or swings < _FEWEST_SWINGS:
        return None, None
    slow, rate, twice = (
        signal.bilinear([_SMOOTH**2, *[0.0] * order], [1.0, 2 * _SMOOTH, _SMOOTH**2], 1 / dt) for order in range(3)
    )
    moving, pull = signal.lfilter(*rate, theta), signal.lfilter(*twice, theta)
    spring = signal.lfilter(*slow, alpha) * bench.K_s
    wanted = bench.J_eq * pull - spring
    best: tuple[float, float, int] = (math.inf, 0.0, 0)
    for delay in range(-10, 16):
        volts = signal.lfilter(*slow, np.roll(vm, delay))
        columns = np.column_stack([volts, moving, np.tanh(moving / 0.05)])[20:-20]
        solved = np.linalg.lstsq(columns, wanted[20:-20], rcond=None)[0]
        left = float(np.std(wanted[20:-20] - columns @ solved))
        best = min(best, (left, float(solved[0]), delay))
    return best[1] / bench.torque_per_volt, best[2]
