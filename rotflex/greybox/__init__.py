"""Fit the nonlinear plant to a recording: the parameters that make it move as the bench did.

The plant is driven by the measured voltage from the first sample to the last, and its angles are compared with the
measured ones (an output-error fit). What makes that work on a bench with friction and encoders:

* *The servo angle drifts.* Nothing in the plant depends on theta itself, so each small error of the rate adds up in
  it for good; alpha and the rates forget their errors within a fraction of a second, friction helping. Theta is
  therefore compared window by window (1 s), less its mean difference in each: that is multiple shooting where only the
  drifting state starts anew. It costs no parameters and no further simulations.
* *An encoder tells most when it counts.* While it stands, the angle may be anywhere within a count, and many seconds of
  rest, all with the same error, would outweigh the motion; worse, where the link comes to rest makes a sum of squares
  with several minima. Between two samples with a count in between the angle is where both say on average, so the fit
  compares there, and only there.
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
* *Residuals are not independent.* The standard errors are cluster-robust (Liang and Zeger, 1986): sums over windows
  count as independent, not samples. A periodic motion repeats its rounding errors period after period, which no
  residual can show; on virtual benches the errors are about twice what white residuals would mean, and no standard
  error is stated smaller than that. The intervals use Student's t for the number of windows. In 20 fits to virtual
  benches (the square wave; motors within their tolerances, outputs 0.5 to 1.5 ms late), 177 of 180 intervals of 95 %
  held the truth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.config import Joint, Servo, one_of
from rotflex.errors import IdentificationError
from rotflex.identification import Estimate, Vector, channel
from rotflex.plant import Plant, PlantParameters, State
from rotflex.progress import counter
from rotflex.recording import Channel, Recording

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
FREE = ("K_s", "J_eq", "torque_per_volt", "braking", "B_l", "servo_friction", "link_friction", "delay")
#: What no recording tells both of, and what it tells.
_ALIKE = {
    ("J_l", "torque_per_volt"): "all inertias, torques and frictions in ratio only",
    ("B_eq", "braking"): "the braking as a whole only",
}
WINDOW = 1.0  #: s, in which theta is compared less its mean, and beyond which residuals are independent
_OFFSET, _RATE = 1e-3, 0.1  # rad, rad/s: the units of alpha_offset and of the initial rates
_STEP = 0.01  # of the unit: parameters are changed by this much to see what changes
_TOLERANCE = 1e-3  # of the sum of squares: a step that gains less is the last
_MOST_STEPS = 40  # usual are 5 to 8
_POSITIVE = 0.05  # of the unit: the smallest inertia, stiffness or torque per volt
_SMALLEST_INFLATION = 2.0  # of the standard errors for white residuals
_FEWEST_WINDOWS = 3
_BEGINNING = 10  # samples without a count, after which a recording is taken to begin at rest


@dataclass(frozen=True)
class FitResult:
    """A fitted plant.

    Attributes
    ----------
    parameters : the plant with the fitted values (no delay is among them: that is the board's)
    estimates : by name, with standard errors, SI units: the free parameters (servo_friction as servo_friction_plus and
        _minus); alpha_offset, the measured alpha (rad) at which the springs are at ease; and the initial rates,
        theta_dot_0 and alpha_dot_0 (rad/s), unless the recording begins at rest
    intervals : by name, the 95 % confidence interval
    correlation : (p, p) correlation matrix of the estimates, in their order
    residual_rms : "theta" and "alpha", rad: root mean square of measured minus simulated, over all samples; theta less
        its mean in each window
    recording : theta, alpha, vm as measured, and theta_model, alpha_model as simulated, for plots
    """

    parameters: PlantParameters
    estimates: Mapping[str, Estimate]
    intervals: Mapping[str, tuple[float, float]]
    correlation: NDArray[np.float64]
    residual_rms: Mapping[str, float]
    recording: Recording


def fit(
    recording: Recording,
    servo: Servo,
    joint: Joint,
    free: Sequence[str] = FREE,
    initial: PlantParameters | None = None,
    progress: bool = True,
) -> FitResult:
    """Fit the nonlinear plant (:mod:`rotflex.plant`) to a recording.

    The voltage is taken to be held from one output to the next, as the control loop does. About seventy runs of the
    plant are needed: some 5 to 10 s for a recording of 10 s at 2 ms.

    Parameters
    ----------
    recording : with theta, alpha, vm; any experiment in which both joints move
    servo, joint : nominal parts; what is not fitted keeps their values
    free : names in ``TYPICAL`` of what to fit. J_eq is among them: 3 % off in it would put the link's friction off by
        a fifth. J_l is not, for the arm's geometry gives it. Where that is in doubt, as on a real bench, give J_l in
        place of torque_per_volt; where the motor is well known, B_eq in place of both motor's parameters.
    initial : where to start, and what is not fitted, in place of the nominal parts; its outputs come at once
    progress : show a progress bar when it takes longer than a second

    Returns
    -------
    FitResult

    Raises
    ------
    IdentificationError
        If a channel is missing or constant, nothing moves in three windows of 1 s, or the recording does not tell the
        parameters: J_l beside torque_per_volt, or B_eq beside braking, no recording tells.
    ConfigurationError
        If a name in ``free`` does not exist.
    """
    for name in free:
        one_of("A parameter to fit", name, TYPICAL)
    for alike, told in _ALIKE.items():
        if set(alike) <= set(free):
            raise IdentificationError(f"A recording tells {told}: fit {' or '.join(alike)}, and not both.")
    start = initial or replace(
        PlantParameters.of(servo, joint, TYPICAL["K_s"]),
        B_l=TYPICAL["B_l"],
        servo_friction=(TYPICAL["servo_friction"],) * 2,
        link_friction=(TYPICAL["link_friction"],) * 2,
    )
    problem = _Problem(recording, start, tuple(dict.fromkeys(free)))
    values, residual, jacobian = _least_squares(problem, progress)
    return _result(problem, values, residual, jacobian)


class _Problem:
    """The fit as a function of a vector of unknowns, each in its own unit."""

    def __init__(self, recording: Recording, start: PlantParameters, free: tuple[str, ...]) -> None:
        self.recording, self.start, self.free = recording, start, free
        self.theta, self.alpha = channel(recording, "theta"), channel(recording, "alpha")
        self.volts: list[float] = channel(recording, "vm", may_be_constant=True).tolist()
        self.names: list[str] = []
        begin: list[float] = []
        units: list[float] = []
        for name in free:
            value = _known(start, name)
            fields = {name: value}
            if name == "servo_friction":
                fields = {"servo_friction_plus": value[0], "servo_friction_minus": value[1]}
            elif name == "link_friction":
                fields = {name: sum(value) / 2}
            self.names += fields
            begin += fields.values()
            units += [TYPICAL[name]] * len(fields)
        lowest = [_POSITIVE if name in ("K_s", "J_eq", "J_l", "torque_per_volt") else 0.0 for name in self.names]
        if "braking" in free:
            lowest[self.names.index("braking")] = start.B_eq / TYPICAL["braking"]
        conditions = {"alpha_offset": _OFFSET}
        if not (_stands(self.theta) and _stands(self.alpha)):
            conditions |= {"theta_dot_0": _RATE, "alpha_dot_0": _RATE}
        self.names += conditions
        self.units = np.array([*units, *conditions.values()])
        self.begin = np.array([*begin, *(0.0 for _ in conditions)]) / self.units
        self.lowest = np.array([*lowest, *(-np.inf for _ in conditions)])

        self.counts = [_counted(self.theta), _counted(self.alpha)]
        self.windows = [self.window(at) for at in self.counts]
        moving = np.unique(np.concatenate(self.windows)).size
        if moving < _FEWEST_WINDOWS:
            raise IdentificationError(
                f"Something moves in {moving} windows of {WINDOW:g} s only; at least {_FEWEST_WINDOWS} are needed. "
                "Record for longer."
            )

    def window(self, samples: NDArray[np.intp]) -> NDArray[np.intp]:
        """The window (0, 1, ...) of each sample; a rest at the end belongs to the last whole one."""
        window = (samples * self.recording.sample_time / WINDOW + 1e-9).astype(np.intp)
        whole = int(len(self.recording) * self.recording.sample_time / WINDOW + 1e-9)
        return np.minimum(window, max(whole - 1, 0))

    def parameters(self, unknowns: Vector) -> PlantParameters:
        """The plant's parameters."""
        value = self._by_name(unknowns)
        fields = [name for name in self.free if name in value and name not in ("braking", "delay")]
        changes: dict[str, Any] = {name: value[name] for name in fields}
        if "servo_friction" in self.free:
            changes["servo_friction"] = (value["servo_friction_plus"], value["servo_friction_minus"])
        if "link_friction" in self.free:
            changes["link_friction"] = (value["link_friction"],) * 2
        plant = replace(self.start, **changes)
        if "braking" in value:
            plant = replace(plant, back_emf=(value["braking"] - plant.B_eq) / plant.torque_per_volt)
        return plant

    def simulate(self, unknowns: Vector) -> tuple[Vector, Vector]:
        """theta and alpha (n,), rad, as the encoders would see them."""
        value = self._by_name(unknowns)
        offset, delay = value["alpha_offset"], value.get("delay", 0.0)
        begin = State(
            float(self.theta[0]),
            float(self.alpha[0]) - offset,
            value.get("theta_dot_0", 0.0),
            value.get("alpha_dot_0", 0.0),
        )
        plant = Plant(self.parameters(unknowns), begin)
        dt = self.recording.sample_time
        states = []
        for volts in self.volts:
            states.append(plant.state)
            plant.advance(volts, dt)
        angles, rates = np.hsplit(np.array(states), 2)
        late = angles - delay * rates  # a delay is short beside all that moves
        return late[:, 0], late[:, 1] + offset

    def _by_name(self, unknowns: Vector) -> dict[str, float]:
        return dict(zip(self.names, (unknowns * self.units).tolist(), strict=True))

    def residual(self, unknowns: Vector) -> Vector:
        """Measured minus simulated where the encoders count, rad: theta less its mean in each window, then alpha."""
        theta, alpha = self.simulate(unknowns)
        difference = _less_mean(_between(self.theta - theta, self.counts[0]), self.windows[0])
        return np.concatenate([difference, _between(self.alpha - alpha, self.counts[1])])


def _known(plant: PlantParameters, name: str) -> Any:
    """A parameter of a plant by the name that a fit gives it."""
    if name == "braking":
        return plant.torque_per_volt * plant.back_emf + plant.B_eq
    return 0.0 if name == "delay" else getattr(plant, name)


def _counted(angle: Vector) -> NDArray[np.intp]:
    """Samples after which the angle has changed."""
    return np.flatnonzero(np.diff(angle))


def _between(signal: Vector, samples: NDArray[np.intp]) -> Vector:
    """Mean of each sample and the next."""
    return (signal[samples] + signal[samples + 1]) / 2


def _less_mean(signal: Vector, windows: NDArray[np.intp]) -> Vector:
    """The signal less its mean in each window."""
    return signal - (np.bincount(windows, signal) / np.maximum(np.bincount(windows), 1))[windows]


def _stands(angle: Vector) -> bool:
    """Whether a recording begins at rest."""
    return bool(np.ptp(angle[:_BEGINNING]) == 0)


def _least_squares(problem: _Problem, progress: bool) -> tuple[Vector, Vector, NDArray[np.float64]]:
    """The unknowns with the least sum of squares, the residual and its Jacobian there."""
    from scipy.optimize import least_squares

    latest: dict[bytes, Vector] = {}

    with counter("fit", "run", progress) as count:

        def residual(unknowns: Vector) -> Vector:
            count()
            return problem.residual(unknowns)

        def value(unknowns: Vector) -> Vector:
            latest.clear()  # the Jacobian is asked for where the residual was found last
            return latest.setdefault(unknowns.tobytes(), residual(unknowns))

        def jacobian(unknowns: Vector) -> NDArray[np.float64]:
            here = latest.get(unknowns.tobytes())
            here = residual(unknowns) if here is None else here
            # The step does not shrink with an unknown that goes to zero.
            columns = [(residual(unknowns + step) - here) / _STEP for step in _STEP * np.eye(unknowns.size)]
            return np.column_stack(columns)

        found = least_squares(
            value,
            np.maximum(problem.begin, problem.lowest + _STEP),
            jac=jacobian,
            bounds=(problem.lowest, np.inf),
            ftol=_TOLERANCE,
            xtol=1e-5,
            max_nfev=_MOST_STEPS,
        )
    if not found.success:
        raise IdentificationError(
            f"The fit has not settled in {_MOST_STEPS} steps. Fit fewer parameters, or give an initial plant that is "
            "nearer to the bench."
        )
    return np.asarray(found.x), np.asarray(found.fun), np.asarray(found.jac)


def _result(problem: _Problem, unknowns: Vector, residual: Vector, jacobian: NDArray[np.float64]) -> FitResult:
    from scipy.stats import t

    information = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(information))
    if not scale.all() or np.linalg.cond(information / np.outer(scale, scale)) > 1e10:
        raise IdentificationError(
            f"The recording does not tell what {', '.join(problem.names)} are. Fit fewer, or record more motion."
        )
    inverse = np.linalg.inv(information)
    white = inverse * (residual @ residual) / (residual.size - unknowns.size)
    windows = np.concatenate(problem.windows)
    sums = np.zeros((windows.max() + 1, unknowns.size))
    np.add.at(sums, windows, jacobian * residual[:, None])
    clusters = np.unique(windows).size
    robust = inverse @ (sums.T @ sums) @ inverse * clusters / (clusters - 1)
    variance = np.maximum(np.diag(robust), _SMALLEST_INFLATION**2 * np.diag(white))
    values, errors = unknowns * problem.units, np.sqrt(variance) * problem.units
    reach = float(t.ppf(0.975, clusters - 1))

    theta, alpha = problem.simulate(unknowns)
    measured = problem.recording
    difference = _less_mean(measured["theta"] - theta, problem.window(np.arange(len(measured))))
    kept = {name: measured.channels[name] for name in ("theta", "alpha", "vm")}
    simulated = {"theta_model": Channel(theta, "rad"), "alpha_model": Channel(alpha, "rad")}
    estimates = [Estimate(*pair) for pair in zip(values.tolist(), errors.tolist(), strict=True)]
    return FitResult(
        parameters=problem.parameters(unknowns),
        estimates=dict(zip(problem.names, estimates, strict=True)),
        intervals={
            name: (found.value - reach * found.uncertainty, found.value + reach * found.uncertainty)
            for name, found in zip(problem.names, estimates, strict=True)
        },
        correlation=inverse / np.sqrt(np.outer(np.diag(inverse), np.diag(inverse))),
        residual_rms={
            "theta": float(np.sqrt(np.mean(difference**2))),
            "alpha": float(np.sqrt(np.mean((measured["alpha"] - alpha) ** 2))),
        },
        recording=Recording(measured.time, {**kept, **simulated}, measured.metadata),
    )
