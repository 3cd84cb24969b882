"""Whether a recording can be one of a bench: its voltages fit its controller, and its arm is this bench's.

* **controller**: the voltage is what the experiment's controller sets, fed with the recorded angles and cut to the
  bench's limit. Where samples were not answered in time, the voltage that was held counts.
* **link**: the arm moves as the servo's angle makes an arm of this bench's natural frequency move. The servo's
  friction, which differs from run to run, has no part in it.

Whoever makes up both angles and voltages passes: ``docs/real_bench_marks.md`` says what can be forged.
"""

from __future__ import annotations

from rotflex import experiments, link
from rotflex.config import Servo
from rotflex.controller import Controller
from rotflex.errors import RotflexError
from rotflex.hil import replay
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.replay import voltage_limit, voltages
from rotflex.plant import PlantParameters
from rotflex.recording import Recording

_VOLTS = 2e-3  # V: what rounding in a file may change; one count is worth more with any gain of use
#: RMS of what the link's equation leaves, of the deflection's; up to 0.15 on a real log, and up to 0.24 in the free
#: swings of 500 virtual benches. With 5 % more or less stiffness it is more than 0.5 there.
_LINK = 0.3


def doubts(recording: Recording, servo: Servo, bench: PlantParameters) -> list[str]:
    """List the reasons why a recording may not be one of a bench; empty where there is none.

    Parameters
    ----------
    recording : theta, alpha and vm, with the experiment's settings in its metadata
    servo : as the student was told it
    bench : the bench as it is known
    """
    found = [why] if (why := replay.implausible_timing(recording)) else []
    if not (volts := voltage_misfit(recording, servo)) <= _VOLTS:
        found.append(f"its voltage is up to {volts:.2g} V beside what its controller sets on its angles")
    if not (left := link_misfit(recording, bench)) <= _LINK:
        found.append(f"its arm does not move as the arm of this bench ({left:.0%} of its motion is left over)")
    return found


def voltage_misfit(recording: Recording, servo: Servo) -> float:
    """Return the largest difference of the voltage from what its controller sets, V; 0 where no controller is known."""
    controller = _controller(recording)
    if controller is None or "theta_ref" not in recording:
        return 0.0
    anew = voltages(recording, controller, recording["theta_ref"], voltage_limit(recording, servo.V_max))
    return float(replay.voltage_errors(recording, anew).max())


def _controller(recording: Recording) -> Controller | None:
    """Return the controller that a recording says that it was made with; None where that is no feedback."""
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


def link_misfit(recording: Recording, bench: PlantParameters) -> float:
    """Return what :func:`rotflex.link.residual` leaves of the deflection.

    Returns 0 for a recording that cannot be judged: the arm hardly moves, or there are too few samples, or they are too
    far apart. A recording at 0 V is not judged either: a hand moves the arm, or it still swings from before.
    """
    theta, alpha = recording["theta"], recording["alpha"]
    if not link.can_be_judged(alpha, recording["vm"], recording.sample_time):
        return 0.0
    came = ~replay.lost_samples(recording)
    return link.residual(theta, alpha, recording.sample_time, bench.K_s / bench.J_l, bench.B_l / bench.J_l, came)
