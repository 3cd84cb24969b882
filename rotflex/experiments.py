"""The laboratory's experiments: a bench in, a recording out.

Each runs on an open bench, real or virtual, waits until the arm stands still, counts the angles from where it stands,
and leaves the motor at 0 V. A virtual bench begins each experiment in the same state, whatever ran before::

    with hil.open("virtual:?seed=7") as bench:
        recording = experiments.sweep(bench)
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex.config import in_radians, one_of, real_array
from rotflex.controller import Controller, name_of, runnable
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import OpenLoop, PositionServo, StateFeedback
from rotflex.hil.loop import listen, run
from rotflex.hil.replay import RecordedRuns
from rotflex.recording import Recording
from rotflex.signals import chirp, smooth_square_wave, square_wave, step, time_axis
from rotflex.simulation import along, matrices, takes_systems
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, RATE, SAMPLE_TIME
from rotflex.units import DEG, HZ, Vector

__all__ = [
    "FOLLOWING",
    "HOLDING",
    "MODEL_BOUND",
    "follow",
    "free_decay",
    "hold",
    "rest",
    "sweep",
    "tracking",
    "validation",
    "watch",
]


def __dir__() -> list[str]:
    return __all__


_STILL_FOR = 0.5  # s without a count, after which the arm is at rest
_PATIENCE = 40.0  # s to wait for it
MODEL_BOUND = 100.0  #: rad; a model whose angle passes it has run away, and its curves are cut there

#: The servo's position loops. On every bench both are stable with outputs that come 6 ms late: 4 ms, the most that a
#: board with a slow bus and a late sample needs, and half as much again.
FOLLOWING = partial(PositionServo, K_p=8.0, K_d=2.5, sample_time=SAMPLE_TIME, cutoff=25 * HZ)
HOLDING = partial(PositionServo, K_p=80.0, K_d=2.0, sample_time=SAMPLE_TIME)


def sweep(
    bench: Bench,
    f_start: float = 1.0,
    f_stop: float = 5.0,
    duration: float = 15.0,
    amplitude: float | None = None,
    drive: str = "position",
    progress: bool = True,
) -> Recording:
    """Sine sweep for the natural frequency of the link (Section 2.3.1).

    The servo follows the sweep in a position loop, so that the link is shaken by a base that moves nearly as commanded:
    then its deflection is largest near sqrt(K_s/J_l). With ``drive="voltage"`` the sweep is the motor voltage; the
    servo then gives way to the link, and the deflection is largest elsewhere. Friction takes a part of the voltage:
    angles are up to a third smaller than without it at 0.8 V, and nearer to that at 3 V.

    The loop's gains are small: a stiff one is unstable on a board whose output comes some milliseconds late, and shakes
    the motor at frequencies that are not good for it. It brakes more than it pulls (K_d ω against K_p), which keeps
    the peak of alpha within 3 % of sqrt(K_s/J_l) on most benches (6 % above 4 Hz, where the sweep soon ends) where a
    loop that pulls would shift it down.

    Parameters
    ----------
    bench : an open bench
    f_start, f_stop : Hz
    duration : s
    amplitude : rad for ``drive="position"`` (4 deg unless given), V for ``drive="voltage"`` (0.8 V unless given)
    drive : "position" or "voltage"
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta, alpha, vm, and theta_ref if the servo follows the sweep.
    """
    one_of("drive", drive, ("position", "voltage"))
    t = time_axis(duration, SAMPLE_TIME)
    settings = {"experiment": "sweep", "drive": drive, "f_start": f_start, "f_stop": f_stop}
    if drive == "voltage":
        volts = chirp(t, f_start, f_stop, 0.8 if amplitude is None else amplitude)
        return _run(bench, OpenLoop(), volts, settings, progress)
    turned = 4 * DEG if amplitude is None else in_radians("amplitude", amplitude)
    return _run(bench, FOLLOWING(), chirp(t, f_start, f_stop, turned), settings, progress)


def free_decay(bench: Bench, amplitude: float = 10 * DEG, duration: float = 6.0, progress: bool = True) -> Recording:
    """The link swings freely after the servo has jumped and is held where it is (Section 2.1.5).

    The servo is held by a position loop, which gives way by a little. Wide swings are therefore slower than with a
    clamped servo, by 3 to 10 %, and die down sooner. Small ones cannot move the servo, whose friction holds it: they
    come within 1 or 2 % of sqrt(K_s/J_l), and ring on. See :func:`rotflex.identification.logarithmic_decrement`, which
    allows for the servo's part.

    Parameters
    ----------
    bench : an open bench
    amplitude : of the servo's jump, rad; the link swings by about two thirds of it
    duration : s
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta_ref, theta, alpha, vm, from the jump on.
    """
    theta_ref = step(time_axis(duration, SAMPLE_TIME), in_radians("amplitude", amplitude))
    return _run(bench, HOLDING(), theta_ref, {"experiment": "free decay"}, progress)


@takes_systems
def validation(
    bench: Bench,
    A: ArrayLike,
    B: ArrayLike,
    signal: str = "square",
    amplitude: float | None = None,
    duration: float | None = None,
    progress: bool = True,
) -> Recording:
    """The same voltage on the bench and on a linear model, side by side (Section 2.3.2).

    Parameters
    ----------
    bench : an open bench
    A, B : (4, 4) and (4,) or (4, 1), the model for voltage input, states theta, alpha and their rates; or, in place of
        the two, a system of python-control
    signal : "square" (0.5 Hz) or "step" (at 0.5 s; the servo turns on and on, so it is short); for a replay also
        "recorded": whatever voltage was recorded, from a bench at rest
    amplitude : V; 1.5 V for the square wave and 0.8 V for the step unless given; a recorded voltage has its own
    duration : s; 10 s for the square wave, 2.5 s for the step and all that was recorded unless given
    progress : show a progress bar when it takes longer than a second, and say it when the model runs away

    Returns
    -------
    Recording
        theta, alpha, vm, theta_model, alpha_model. A model that runs away is cut at ±100 rad and stays there; the
        metadata then say when, as ``model_cut_at`` (s).

    Raises
    ------
    DesignError
        If A or B has the wrong shape or a value that is not finite.
    BenchError
        If a recorded voltage is asked for, and none was recorded.
    """
    recorded = bench.connection.recorded
    steered = recorded is None or isinstance(recorded, RecordedRuns)
    one_of("signal", signal, ("square", "step") if steered else ("square", "step", "recorded"))
    matrices(A, B)  # before anything moves
    settings = {"experiment": "validation", "signal": signal}
    if recorded is not None and signal == "recorded":
        nothing = np.zeros(time_axis(min(duration or recorded.duration, recorded.duration), SAMPLE_TIME).size)
        if recorded.voltage(nothing.size, SAMPLE_TIME) is None:
            raise BenchError(f"{recorded.name} has no channel vm: no voltage drives the model.")
        measured = _run(bench, None, nothing, settings, progress, from_rest=False)
    else:
        if signal == "square":
            volts = square_wave(time_axis(duration or 10.0, SAMPLE_TIME), 0.5, 1.5 if amplitude is None else amplitude)
        else:
            volts = step(time_axis(duration or 2.5, SAMPLE_TIME), 0.8 if amplitude is None else amplitude, at=0.5)
        measured = _run(bench, OpenLoop(), volts, settings, progress)
    angles, cut = along(A, B, measured["vm"], SAMPLE_TIME, MODEL_BOUND)
    compared = measured.with_channels(theta_model=angles[0], alpha_model=angles[1])
    if cut is None:
        return compared
    cut_at = float(measured.time[cut])
    if progress:
        print(_RAN_AWAY.format(time=cut_at, bound=MODEL_BOUND, turns=MODEL_BOUND / (2 * np.pi)))
    return replace(compared, metadata={**measured.metadata, "model_cut_at": cut_at})


def tracking(
    bench: Bench,
    controller: Controller | ArrayLike,
    feedback: str = "full",
    amplitude: float = AMPLITUDE,
    frequency: float = FREQUENCY,
    rate: float = RATE,
    duration: float = DURATION,
    progress: bool = True,
) -> Recording:
    """State feedback, or a controller of one's own, along a smoothed square wave (Sections 3.4.3 and 3.4.4).

    Parameters
    ----------
    bench : an open bench
    controller : the gain K of a state feedback, (4,), (1, 4) or (4, 1), on theta, alpha (V/rad) and their rates
        (V/(rad/s)); or a function (theta_ref, theta, alpha) → V, in rad, called every ``SAMPLE_TIME``; or a discrete
        system of python-control, see :mod:`rotflex.controller`. A function that has a state also has a method
        ``reset()``, which is called before the run
    feedback : of a gain, "full", or "partial" (the servo's angle and rate only)
    amplitude : rad
    frequency : Hz
    rate : limit on the slope of the unit square wave, 1/s
    duration : s
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta_ref, theta, alpha, vm.

    Raises
    ------
    DesignError
        If K is not four finite real numbers, a system cannot be run, or a function returns anything but one number.
    """
    settings: dict[str, Any] = {"experiment": "tracking"}
    if callable(controller):
        one_of("feedback", feedback, ("full",))  # it is for a controller of one's own to leave an angle out
        settings["controller"] = name_of(controller)
    else:
        controller = StateFeedback(controller, feedback, SAMPLE_TIME)
        settings |= {"feedback": feedback, "K": controller.K}
    turned = in_radians("amplitude", amplitude)
    theta_ref = smooth_square_wave(time_axis(duration, SAMPLE_TIME), frequency, turned, rate)
    return _run(bench, controller, theta_ref, settings, progress)


def follow(
    bench: Bench, controller: Controller, reference: ArrayLike, sample_time: float = SAMPLE_TIME, progress: bool = True
) -> Recording:
    """Run a controller along any command, at any sample time.

    Parameters
    ----------
    bench : an open bench
    controller : a function (theta_ref, theta, alpha) → V, in rad, or a discrete system, see :func:`tracking`
    reference : (n,) commanded servo angle, rad, one a sample
    sample_time : s, below the 0.2 s of the watchdog; at most 0.05 s on a real bench, which has a guard
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta_ref, theta, alpha, vm.

    Raises
    ------
    DesignError
        If the controller is made for another sample time, or returns anything but one number.
    BenchError
        If the reference is not a list of finite numbers, or the sample time is too long.
    """
    settings = {"experiment": "follow", "controller": name_of(controller)}
    return _run(bench, controller, real_array("The reference", reference, BenchError), settings, progress, sample_time)


def watch(bench: Bench, duration: float = 10.0, progress: bool = True) -> Recording:
    """Listen to the encoders at 0 V: while the arm is moved by hand, or a recording is replayed.

    Parameters
    ----------
    bench : an open bench
    duration : s
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta, alpha, vm, from the first sample on; nothing waits for the arm to be at rest. A replay gives at most
        what was recorded, with its voltage (no vm, where none was recorded).
    """
    nothing = np.zeros(time_axis(duration, SAMPLE_TIME).size)
    return _run(bench, None, nothing, {"experiment": "watch"}, progress, from_rest=False)


def hold(bench: Bench, duration: float = 20.0, progress: bool = True) -> Recording:
    """Hold the servo where it is, while the arm is pulled aside by hand and let go.

    Parameters
    ----------
    bench : an open bench
    duration : s
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    Recording
        theta_ref, theta, alpha, vm, from the first sample on; nothing waits for the arm to be at rest.
    """
    in_place = np.zeros(time_axis(duration, SAMPLE_TIME).size)
    return _run(bench, HOLDING(), in_place, {"experiment": "hold"}, progress, from_rest=False)


def rest(bench: Bench) -> None:
    """Wait at 0 V until neither encoder has counted for half a second. A virtual bench is connected anew before.

    A replay does not wait.

    Raises
    ------
    BenchError
        If the arm does not come to rest.
    """
    bench.renew()
    if bench.connection.recorded is not None:
        return
    still_samples, still = round(_STILL_FOR / SAMPLE_TIME), 0
    bench.start(SAMPLE_TIME, zero=False)
    try:
        last = bench.read()
        for _sample in range(round(_PATIENCE / SAMPLE_TIME)):
            bench.write(0.0)
            measured = bench.read()
            still = still + 1 if measured[1:] == last[1:] else 0
            last = measured
            if still >= still_samples:
                return
    finally:
        bench.stop()
    raise BenchError(f"The arm has not come to rest in {_PATIENCE:g} s. Hold it still, or look for a loose encoder.")


def _run(
    bench: Bench,
    controller: Controller | None,
    reference: Vector,
    settings: dict[str, Any],
    progress: bool,
    sample_time: float = SAMPLE_TIME,
    from_rest: bool = True,
) -> Recording:
    """Run a controller that is made for this sample time, or listen without one; tell who stores the recording.

    A bench of recordings gives the very angles of its own. With ``progress``, doubts about the recording are printed.
    """
    if controller is not None:
        controller = runnable(controller, sample_time)
    recorded = bench.connection.recorded
    if isinstance(recorded, RecordedRuns):
        recorded.choose(settings, controller, reference, sample_time)
    if from_rest:
        rest(bench)
    else:
        bench.renew()
    if controller is None:
        measured = listen(bench, reference.size, sample_time, settings, progress)
    else:
        measured = run(bench, controller, reference, sample_time, settings, progress)
    if isinstance(recorded, RecordedRuns):
        measured = recorded.exactly(measured)
    if bench.recorder.on_recorded is not None:
        bench.recorder.on_recorded(measured)
    if progress and measured.doubts:
        print(*measured.doubts, sep="\n")
    return measured


_RAN_AWAY = (
    "Your model runs away: at {time:.2f} s an angle of it passed {bound:g} rad ({turns:.0f} turns), and its curves are "
    "cut there. No bench does that by itself. Look at the signs in the last two rows of A, row by row: the spring "
    "pulls servo and link towards each other, and friction brakes. Then look at B."
)
