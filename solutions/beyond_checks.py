"""What answers of notebook 11 are compared with: observers, sampled designs, and experiments that are run again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from labcourse.answers.json_values import thin
from labcourse.answers.parts import Part
from labcourse.grading.marking.checks import EVALUATION_ERRORS, refused_recording
from labcourse.grading.marking.expression_checks import value_at
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case, Verdict, follow_through, for_a_person, right, wrong
from rotflex import link, observers, response, sampled
from rotflex.controller import Controller
from rotflex.course import spare_design
from rotflex.errors import LimitExceeded, RotflexError
from rotflex.hil.controllers import ObserverFeedback, StateFeedback, TwoDegreesOfFreedom
from rotflex.recording import Recording
from rotflex.signals import flat, smooth_square_wave, time_axis
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, RATE, SAMPLE_TIME
from rotflex.units import DEG, REV

from . import tolerances
from .design_checks import Array, ArrayFrom, Follows
from .own_answers import usable
from .repeated import Again, given_gain, own_model, right_design, run_of
from .response_checks import ResponseOf
from .wanted import desired_poles

RESOLUTION = REV / 4096  #: rad, of the encoders
HELD, DELAY = 0.03, 0.002  #: s, sample time of 4.5 and 4.6, and delay of the voltage
PEAKS_AT = 0.02  #: s, sample time of 4.8
_WINDOW = 0.1  # s, of the samples of 4.2
_MOTOR, _LINK = 0.1, 0.005  # V and N·m, standard deviations of the process noise
_ANGLE, _TURN, _REST, _WATCHED, _FRICTION = 40 * DEG, 0.5, 0.5, 2.5, 0.07  # of 4.10: rad, s, s, s, V

Plant = Callable[[Array, Array, float], Any]  # A, B and the sample time (s) → the sampled plant
Groups = Callable[[Case], Iterator[list[Callable[[], Controller]]]]


@dataclass(frozen=True)
class NumberFrom(ArrayFrom):
    """A number that follows from a design, as :class:`ArrayFrom`."""

    kinds = ("number",)


@dataclass(frozen=True)
class InUnits(ArrayFrom):
    """A matrix for states: each entry within a tolerance of the largest entry in its unit, as one may be near zero."""

    rtol: float = tolerances.STATES

    def _agrees(self, value: Any, expected: Any) -> bool:
        return near_in_units(value, expected, self.rtol)


def near_in_units(value: Any, expected: Any, rtol: float = tolerances.STATES) -> bool:
    """Whether each entry is within a tolerance of the largest entry in its unit."""
    wanted = np.asarray(expected, dtype=float)
    return bool(np.all(np.abs(np.reshape(value, wanted.shape) - wanted) <= rtol * largest_in_unit(wanted)))


def largest_in_unit(matrix: Array) -> Array:
    """Return for each entry the largest magnitude in its unit: pairs of rows and of columns are angles, then rates."""
    sizes = np.abs(matrix)
    for axis, count in enumerate(sizes.shape):
        pairs = np.maximum.reduceat(sizes, range(0, count, 2), axis=axis)
        sizes = np.repeat(pairs, 2, axis=axis).take(range(count), axis=axis)
    return np.maximum(sizes, 1e-4)  # where zeros are right, so is what rounding leaves


# --- what follows from a model ----------------------------------------------------------------------------------------


def deviation(A: Array, B: Array, encoders: int = 1, state: int = 3) -> float:
    """Standard deviation of a state from samples of so many encoders, deg or deg/s."""
    return float(observers.uncertainty(A, np.eye(encoders, 4), _WINDOW, SAMPLE_TIME, RESOLUTION)[state] / DEG)


def plant_in_z(A: Array, B: Array, sample_time: float) -> Any:
    """The plant of 4.5: five states, the last one is the last voltage."""
    return sampled.sample(A, B, sample_time, DELAY)


def _changed(plant: Any, last: Array, new: Array, stored: float = 1.0) -> Any:
    """The plant with other effects (4, 1) of the last and the new voltage."""
    import control

    Phi, Gamma = np.array(plant.A), np.vstack([new, [[stored]]])
    Phi[:4, 4:] = last
    return control.StateSpace(Phi, Gamma, plant.C, plant.D, plant.dt)


def _exchanged(A: Array, B: Array, sample_time: float) -> Any:
    plant = plant_in_z(A, B, sample_time)
    return _changed(plant, plant.B[:4], plant.A[:4, 4:])


def _without_delay(A: Array, B: Array, sample_time: float) -> Any:
    return _changed(plant_in_z(A, B, sample_time), np.zeros((4, 1)), sampled.sample(A, B, sample_time).B)


def _late(A: Array, B: Array, sample_time: float) -> Any:
    return sampled.sample(A, B, sample_time, sample_time - DELAY)


def _not_stored(A: Array, B: Array, sample_time: float) -> Any:
    plant = plant_in_z(A, B, sample_time)
    return _changed(plant, plant.A[:4, 4:], plant.B[:4], 0.0)


def _predictor(A: Array, B: Array, J_l: float, plant: Any = None) -> Array:
    plant = plant or sampled.sample(A, B, SAMPLE_TIME)
    return np.asarray(plant.A @ kalman(A, B, J_l, plant))


def kalman(
    A: Array, B: Array, J_l: float, plant: Any = None, resolution: float = RESOLUTION, servo_only: bool = True
) -> Array:
    """Kalman's gain for a sampled plant; without one, for the model at 2 ms without delay."""
    plant = plant or sampled.sample(A, B, SAMPLE_TIME)
    torque = np.array([[0.0], [0.0], [0.0], [1 / J_l]])
    sources = [(sampled.sample(A, effect, plant.dt).B, size) for effect, size in ((B, _MOTOR), (torque, _LINK))]
    return observers.kalman_gain(plant, observers.process_noise(plant, *sources), resolution, servo_only)


#: Usual slips of 4.5 and 4.3, which go on into what is built on them: what was done → what it gives.
PLANTS: dict[str, Plant] = {
    "what the last and the new voltage do is exchanged": _exchanged,
    "the delay is missing": _without_delay,
    "the 2 ms before the new voltage acts and the rest of the sample are exchanged": lambda A, B, h: sampled.sample(
        A, B, h, h - DELAY
    ),
    "the fifth state is the new voltage, so that its entry in Gamma is 1": _not_stored,
}
OBSERVERS: dict[str, Callable[..., Array]] = {
    "it is the gain of the predictor, Phi L: the filter uses the newest sample": _predictor,
    "the variance of rounding is the resolution squared, divided by 12": partial(
        kalman, resolution=RESOLUTION * np.sqrt(12)
    ),
    "the resolution is in degrees where the model has radians": partial(kalman, resolution=RESOLUTION / DEG),
}


def peak_emulated(A: Array, B: Array, K: Array, plant_in_z: Plant = plant_in_z) -> float:
    """M_s with a continuous design and differences for rates."""
    controller = StateFeedback(K, sample_time=PEAKS_AT, cutoff=1 / PEAKS_AT)
    return sampled.margins(plant_in_z(A, B, PEAKS_AT), controller.system()).sensitivity_peak


def peak_sampled(
    A: Array, B: Array, J_l: float, poles: Array, plant_in_z: Plant = plant_in_z, L: Callable[..., Array] = kalman
) -> float:
    """M_s with a sampled design and an observer."""
    plant = plant_in_z(A, B, PEAKS_AT)
    K = sampled.gain_by_place(plant, poles)
    controller = ObserverFeedback(plant.A, plant.B, L(A, B, J_l, plant), K, PEAKS_AT)
    return sampled.margins(plant, controller.system()).sensitivity_peak


def limit_ms(A: Array, B: Array, K: Array, plant_in_z: Plant = plant_in_z) -> float:
    """Longest sample time (ms) up to which a continuous design is stable; 0 if it is never lost, or always."""

    def growth(ms: float) -> float:
        return float(np.abs(sampled.emulated_poles(plant_in_z(A, B, ms / 1e3), K)).max()) - 1

    times = np.arange(2.5, 100)
    lost = next((place for place, ms in enumerate(times) if growth(float(ms)) >= 0), 0)
    return float(brentq(growth, times[lost - 1], times[lost])) if lost else 0.0


def planned(A: Array, B: Array) -> flat.FlatMotion:
    """Plan the turn of 4.10."""
    return flat.turn(A, B, _ANGLE, _TURN, time_axis(_WATCHED, SAMPLE_TIME), _REST)


def largest_by_own(case: Case, part: str) -> float:
    """Largest magnitude of the student's own expression of 4.9 along the turn of 4.10, rad or V."""
    servo, A = case.bench.servo, own_model(case)[0]
    x = Polynomial([0.0, 1.0])
    bell = (x * (1 - x)) ** flat.SMOOTH
    known = {"J_eq": servo.J_eq, "B_eq": servo.B_eq, "a": servo.torque_per_volt, "b": servo.back_emf_damping}
    known |= {"J_l": case.bench.J_l, "K_s": -(A[2, 1] + A[3, 1]) * case.bench.J_l}
    names = ("gamma_dot", "gamma_ddot", "gamma_3", "gamma_4")
    rates = [bell.deriv(k) * (_ANGLE / bell.integ()(1.0) / _TURN ** (k + 1)) for k in range(len(names))]
    expression = usable(case.own, "4.9", part)
    points = ({name: float(rate(now)) for name, rate in zip(names, rates, strict=True)} for now in np.linspace(0, 1))
    return max(abs(value_at(expression, known | point)) for point in points)


# --- the student's own ------------------------------------------------------------------------------------------------


def own_poles(case: Case) -> Array:
    """The student's desired poles (3.4), else the right ones."""
    try:
        return np.ravel(usable(case.own, "3.4", "desired_poles"))
    except LookupError:
        return desired_poles()


def gains(case: Case) -> list[Array]:
    """The gains that notebook 11 may go on with: the student's own if the bench bears it, else the spare one."""
    own, spare = given_gain(case), [np.array(spare_design.SPARE_GAIN), np.ravel(right_design(case).K)]
    if own is None or not _bears(case, own, "full"):
        return spare
    return [own] if _bears(case, own, "partial") else [own, *spare]


def _bears(case: Case, K: Array, feedback: str) -> bool:
    try:
        return spare_design.can_be_measured(case.bench.tracking(tuple(K.tolist()), feedback))
    except LimitExceeded:
        return False
    except RotflexError:  # at a real bench it was not recorded
        return True


def own_plant(case: Case) -> Plant:
    """How the student samples a plant, by their Phi and Gamma: rightly, or with one of the usual slips."""
    try:
        own, model = [usable(case.own, "4.5", part) for part in ("Phi", "Gamma")], own_model(case)
    except LookupError:
        return plant_in_z

    def agrees(plant: Any) -> bool:
        return near_in_units(own[0], plant.A) and near_in_units(own[1], plant.B)

    return next((build for build in PLANTS.values() if agrees(build(*model, HELD))), plant_in_z)


def own_observer(case: Case) -> Callable[..., Array]:
    """How the student finds an observer's gain, by their L: rightly, or with one of the usual slips."""
    try:
        own, known = usable(case.own, "4.3", "L"), (*own_model(case), case.bench.J_l)
    except LookupError:
        return kalman
    return next((find for find in OBSERVERS.values() if near_in_units(own, find(*known))), kalman)


def by_models(what: str, function: Callable[..., Any], *more: Callable[[Case], Any]) -> Follows:
    """What follows from the student's own model or the right one, and from more of their own."""
    models: tuple[Callable[[Case], Any], ...] = (own_model, lambda case: right_design(case).voltage_model)
    return tuple(
        (what, lambda case, model=model: function(*model(case), *(one(case) for one in more))) for model in models
    )


# --- experiments, run again -------------------------------------------------------------------------------------------


def square(sample_time: float) -> Array:
    """The command of 3.13 at another sample time (s)."""
    return smooth_square_wave(time_axis(DURATION, sample_time), FREQUENCY, AMPLITUDE, RATE)


def along_square(groups: Groups, sample_time: float = SAMPLE_TIME) -> Again:
    """Run controllers along the square wave: all of the first group of which one gives something to measure."""

    def again(case: Case, metadata: dict[str, Any]) -> list[Recording]:
        runs: list[Recording] = []
        for group in groups(case):
            for controller in group:
                try:
                    runs.append(case.bench.follow(controller(), square(sample_time), sample_time, run_of(metadata)))
                except EVALUATION_ERRORS:  # it cannot be designed or built, or a limit of the bench was passed
                    continue
            if any(spare_design.can_be_measured(run) for run in runs):
                break
        return runs

    return again


def derivatives(case: Case) -> Iterator[list[Callable[[], Controller]]]:
    """The state feedback of 3.13."""
    yield [partial(StateFeedback, K) for K in gains(case)]


def observed(case: Case, servo_only: bool = True) -> Iterator[list[Callable[[], Controller]]]:
    """The observers of 4.4: with the student's own L and with the right one, then all right."""

    def feedback(model: tuple[Array, Array], K: Array, own_L: bool) -> Controller:
        plant = sampled.sample(*model, SAMPLE_TIME)
        L = usable(case.own, "4.3", "L") if own_L else kalman(*model, case.bench.J_l, servo_only=servo_only)
        return ObserverFeedback(plant.A, plant.B, L, K, SAMPLE_TIME)

    yield [partial(feedback, own_model(case), K, own_L) for K in gains(case) for own_L in {servo_only, False}]
    yield [partial(feedback, right_design(case).voltage_model, np.ravel(right_design(case).K), False)]


def observed_by_either(case: Case) -> Iterator[list[Callable[[], Controller]]]:
    """The observers of 4.4, and those with both encoders: the servo may come to rest elsewhere with them."""
    for alone, both in zip(observed(case), observed(case, servo_only=False), strict=True):
        yield [*alone, *both]


def sampled_design(case: Case) -> Iterator[list[Callable[[], Controller]]]:
    """The sampled designs of 4.6: by the student's own Phi, Gamma and K, by their own poles, then all right."""
    import control

    def feedback(
        model: tuple[Array, Array], poles: Array | None, own: bool, own_L: bool = False, servo_only: bool = True
    ) -> Controller:
        plant = plant_in_z(*model, HELD)
        if own:
            Phi, Gamma = usable(case.own, "4.5", "Phi"), usable(case.own, "4.5", "Gamma")
            plant = control.StateSpace(Phi, Gamma, plant.C, plant.D, HELD)
        K = usable(case.own, "4.6", "K") if poles is None else sampled.gain_by_place(plant, poles)
        find = own_observer(case) if own_L else partial(kalman, servo_only=servo_only)
        return ObserverFeedback(plant.A, plant.B, find(*model, case.bench.J_l, plant), K, HELD)

    of_own = partial(feedback, own_model(case))
    ways = ((None, True, True), (None, True), (None, True, False, False), (None, False), (own_poles(case), False))
    yield [partial(of_own, *way) for way in ways]
    yield [partial(feedback, right_design(case).voltage_model, desired_poles(), False)]


def turned(case: Case, metadata: dict[str, Any]) -> list[Recording]:
    """The turn of 4.10 by the student's own model and gain, else by the right ones."""
    for model in (own_model(case), right_design(case).voltage_model):
        runs = []
        for K in gains(case):
            try:
                motion = planned(*model)
                controller = TwoDegreesOfFreedom(StateFeedback(K), motion.feedforward(K, _FRICTION))
                runs.append(case.bench.follow(controller, motion.states[0], SAMPLE_TIME, run_of(metadata)))
            except EVALUATION_ERRORS:
                continue
        if runs:
            return runs
    return []


def with_own_recording(question: str, again: Again) -> Again:
    """The student's own recording, as far as it is stored, besides runs of an experiment."""

    def runs(case: Case, metadata: dict[str, Any]) -> list[Recording]:
        try:
            return [stored(case.own(question, "response")), *again(case, metadata)]
        except EVALUATION_ERRORS:
            return again(case, metadata)

    return runs


def stored(value: dict[str, Any]) -> Recording:
    """What is stored of a recording, which is thinned."""
    channels = {name: channel["values"] for name, channel in value["channels"].items()}
    times = thin(value["n"], len(channels["theta"]))
    return Recording.of(np.linspace(0, times[-1] * value["sample_time"], times.size), **channels)


@dataclass(frozen=True)
class TurnOf(ResponseOf):
    """A recording of the planned turn. Other honest plans and feedbacks give other samples, and are as good.

    So a recording that differs from the experiment run again is judged by what it shows: where the servo ends and how
    soon, that the link hardly bends, and that it moves as the link of the student's bench.
    """

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the experiment run again, else look at the motion."""
        found = super().verdict(part, value, case)
        if found.status is not Status.WRONG or refused_recording(part, value, case) is not None:
            return found
        fault = self._fault(stored(value), case)
        return wrong(fault) if fault else right("Your bench makes the turn that is asked for.")

    def _fault(self, run: Recording, case: Case) -> str | None:
        theta, alpha, dt = run["theta"], run["alpha"], run.sample_time
        turn = tolerances.TURN
        off = np.abs(theta - theta[-1])
        moving = np.flatnonzero((np.abs(theta - theta[0]) > turn["angle"]) & (off > turn["angle"]))
        if abs(theta[-1] - theta[0] - _ANGLE) > turn["angle"]:
            return "The servo does not turn by 40 deg from where it starts."
        if np.ptp(moving) * dt > turn["time"]:
            return "The servo takes much longer than half a second."
        if (
            np.abs(alpha).max()
            > turn["deflection"] * np.abs(planned(*right_design(case).voltage_model).states[1]).max()
        ):
            return "The link bends much more than in the planned turn: the command is not the planned motion."
        if link.residual(theta, alpha, dt, case.bench.omega_n**2, 0.0) > turn["link"]:
            return "Its link does not move as the link of your bench."
        return None


@dataclass(frozen=True)
class LostAt:
    """The first sample time (ms) at which the student's own gain is lost on their bench, once it is run again.

    A loop is lost if a turn does not settle, or a limit stops the bench. A person may see it by most turns as well.
    """

    kinds = ("choice",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Run the gain at each sample time, until it is lost."""
        if not case.truth_is_known:
            return for_a_person("It was not measured on a bench that is known here; a person will look at it.")
        found = {first for K in gains(case) for first in self._firsts(part, K, case)}
        if value in found:
            return right("It is lost there, and not before, when the experiment is run again.")
        if not found and value == self._beyond_own_limit(part, case):
            return follow_through("It is the first that is longer than your own limit.")
        return wrong("Look at each run: does every turn settle, or does something stop the bench?")

    def _firsts(self, part: Part, K: Array, case: Case) -> set[str]:
        """The first time at which a turn does not settle, and at which most do not."""
        shares: dict[str, float] = {}
        for tried in part.choices:
            try:
                shares[tried] = self._unsettled(K, float(tried) / 1e3, case)
            except LimitExceeded:
                shares[tried] = 1.0
            except RotflexError:  # at a real bench it was not recorded
                break
        return {next((t for t, share in shares.items() if share > least), "") for least in (0, 0.5)} - {""}

    def _unsettled(self, K: Array, sample_time: float, case: Case) -> float:
        controller = StateFeedback(K, sample_time=sample_time, cutoff=1 / sample_time)
        run = case.bench.follow(controller, square(sample_time), sample_time)
        turns = [turn.settling_time for turn in response.measure(run) if turn.settling_time is not None]
        return float(np.mean(np.isinf(turns)))

    def _beyond_own_limit(self, part: Part, case: Case) -> str | None:
        try:
            limit = float(usable(case.own, "4.7", "limit_ms"))
        except LookupError:
            limit = limit_ms(*right_design(case).voltage_model, np.ravel(right_design(case).K))
        return next((tried for tried in part.choices if float(tried) > limit), None)
