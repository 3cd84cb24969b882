"""Fit the nonlinear plant to a recording: the parameters that make it move as the bench did.

The plant is driven by the measured voltage from the first sample to the last, and its angles are compared with the
measured ones (an output-error fit). What makes that work on a bench with friction and encoders:

* *The servo angle drifts.* Nothing in the plant depends on theta itself, so each small error of the rate adds up in
  it for good; alpha and the rates forget their errors within a fraction of a second, friction helping. Theta is
  therefore compared window by window (1 s), less its mean difference in each: that is multiple shooting where only the
  drifting state starts anew. It costs no parameters and no further simulations.
* *An encoder tells most when it counts.* Between two samples with a count in between, the angle is where both say on
  average. The fit compares at all counts.
* *Rests tell where friction stopped a joint.* While an encoder stands, the angle may be anywhere within a count, and
  all samples of a rest have the same error. Only every tenth therefore counts, so that seconds of rest do not outweigh
  the motion. Theta at rest is compared in the window of the last motion before it: less the mean of the rest alone,
  nothing would be left. Without rests, a fit does not see a servo that creeps on where the bench stands.
* *The link hangs a little off zero,* within its friction, when the encoders are zeroed. This ``alpha_offset`` is found
  with the rest. A difference of the link's friction between the two directions has the same effect to the letter and
  cannot be told from it: ``link_friction`` is the mean of both.
* *All torques are known in ratio only.* Twice all inertias, stiffness, friction and torque per volt make the same
  motion. One of them has to be given: here J_l, which masses and lengths tell; the motor's constants are known to a
  tenth or so, and are fitted.
* *Viscous friction of the servo and back-EMF brake alike.* Only their sum can be told: ``braking``, which is
  torque_per_volt · back_emf + B_eq. A fit of it leaves B_eq as it was, and changes back_emf.
* *The output comes late.* A delay of all outputs shifts the angles by as much. One millisecond of it, unknown to the
  fit, would put the frictions off by half.
* *Residuals are not independent*, and what differs from run to run is more than chance: see
  :mod:`rotflex.greybox.solving`. In 20 fits to virtual benches (4 s of the square wave; motors within their tolerances,
  outputs 0.5 to 1.5 ms late), 168 of 180 intervals of 95 % held the truth.
* *Friction stays Coulomb's.* Stribeck's curve, friction that grows with the load, a cubic spring, a cable, pre-sliding
  (Dahl) and a limit of the current were tried on three logs of a real bench. Together they halve what is left of a log
  that is fitted, and gain nothing on one that is not (theta 0.59 and 0.61 deg, alpha 0.26 and 0.26 deg).

With several recordings of one bench, friction differs from run to run, by a factor of 2 on a real one::

    found = greybox.fit([first, second, third], servo, joint, per_recording=["servo_friction"])
    print(found)
    print(greybox.leave_one_out([first, second, third], servo, joint))
    with found.bench() as bench:
        recording = experiments.tracking(bench, K)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rotflex.config import Joint, Servo, one_of
from rotflex.errors import IdentificationError
from rotflex.greybox.bands import Band
from rotflex.greybox.problem import TYPICAL, Problem
from rotflex.greybox.result import FitResult, LeftOut, Prediction, result_of
from rotflex.greybox.solving import FREE, Chosen, choose, search, sureness
from rotflex.plant import PlantParameters
from rotflex.progress import progress as bar
from rotflex.recording import Recording

__all__ = ["FREE", "TYPICAL", "Band", "FitResult", "LeftOut", "Prediction", "fit", "leave_one_out", "typical"]


def __dir__() -> list[str]:
    return __all__


#: What no recording tells both of, and what it tells.
_ALIKE = {
    ("J_l", "torque_per_volt"): "all inertias, torques and frictions in ratio only",
    ("B_eq", "braking"): "the braking as a whole only",
}


def fit(
    recordings: Recording | Sequence[Recording],
    servo: Servo,
    joint: Joint,
    free: Sequence[str] | None = None,
    initial: PlantParameters | None = None,
    progress: bool = True,
    per_recording: Sequence[str] = (),
) -> FitResult:
    """Fit the nonlinear plant (:mod:`rotflex.plant`) to one recording, or to several of one bench.

    The voltage is taken to be held from one output to the next, as the control loop does. About seventy runs of the
    plant are needed: some 5 to 10 s for a recording of 10 s at 2 ms, and half as long again for each parameter that
    proves undetermined. A fit ends after ``solving.MOST_RUNS`` runs for each recording.

    Parameters
    ----------
    recordings : with theta, alpha, vm; any experiments in which both joints move
    servo, joint : nominal parts; what is not fitted keeps their values
    free : names in ``TYPICAL`` of what to fit. By default ``FREE``, without what the recordings do not
        determine (``fixed`` of the result). J_eq is in ``FREE``: an error of 3 % in it would put the link's friction
        off by a fifth. J_l is not, for the arm's geometry gives it. Where that is in doubt, as on a real bench, give
        J_l in place of torque_per_volt; where the motor is well known, B_eq in place of both motor parameters.
    initial : where to start, and what is not fitted, in place of the nominal parts; its outputs come at once
    progress : show a progress bar when it takes longer than a second
    per_recording : names of parameters that each recording has its own value of, such as ``("servo_friction",)``. The
        offset of alpha and the initial rates are always fitted for each recording; all else is common to them

    Returns
    -------
    FitResult

    Raises
    ------
    IdentificationError
        If a recording is not to be relied on (:mod:`rotflex.doubts`), a channel is missing or constant, nothing moves
        in three windows of 1 s, the recordings do not determine the parameters, or the fit does not settle. None
        separates J_l from torque_per_volt, or B_eq from braking.
    ConfigurationError
        If a name does not exist.
    """
    every = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not every:
        raise IdentificationError("There is no recording to fit.")
    for name in (*(free or ()), *per_recording):
        one_of("A parameter to fit", name, TYPICAL)
    for alike, told in _ALIKE.items():
        if set(alike) <= set(free or ()):
            raise IdentificationError(f"A recording tells {told}: fit {' or '.join(alike)}, and not both.")
    start = initial or typical(servo, joint)

    def make(plant: PlantParameters, delay: float, names: Sequence[str]) -> Problem:
        return Problem(every, plant, tuple(dict.fromkeys(names)), per_recording, delay)

    make(start, 0.0, free or FREE).require_motion()
    if free is None:
        chosen = choose(make, start, progress)
    else:
        problem = make(start, 0.0, free)
        found = search(problem, progress)
        chosen = Chosen(problem, found, sureness(problem, found), {})
    return result_of(chosen, servo, joint)


def typical(servo: Servo, joint: Joint) -> PlantParameters:
    """The plant that a fit begins with unless given another: nominal parts, and a typical stiffness and frictions."""
    return replace(
        PlantParameters.of(servo, joint, TYPICAL["K_s"]),
        B_l=TYPICAL["B_l"],
        servo_friction=(TYPICAL["servo_friction"],) * 2,
        link_friction=(TYPICAL["link_friction"],) * 2,
    )


def leave_one_out(
    recordings: Sequence[Recording],
    servo: Servo,
    joint: Joint,
    free: Sequence[str] | None = None,
    initial: PlantParameters | None = None,
    progress: bool = True,
    per_recording: Sequence[str] = (),
) -> LeftOut:
    """Fit to all recordings but one, and predict that one; for each.

    Parameters and errors are those of :func:`fit`. Of what each recording has its own, the prediction takes the mean.

    Raises
    ------
    IdentificationError
        If there are fewer than two recordings, too.
    """
    every = list(recordings)
    if len(every) < 2:
        raise IdentificationError(
            f"Leaving one out needs two recordings or more; there are {len(every)}. A long one can be cut in "
            "two: recording.between(0, 5) and recording.between(5, 10)."
        )
    fits = []
    for place in bar(range(len(every)), "left out", "recording", progress):
        others = every[:place] + every[place + 1 :]
        fits.append(fit(others, servo, joint, free, initial, progress, per_recording))
    return LeftOut(tuple(fits), tuple(found.predict(left) for found, left in zip(fits, every, strict=True)))
