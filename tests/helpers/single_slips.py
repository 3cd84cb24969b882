"""Single slips: one thing done wrong at one place, and all that comes after worked out from it as the notebooks do.

Each costs the points of its own answer. Where it costs more, a person who marked by hand would take that off, too; it
is said what and why. ``told`` is what the student must be able to read of it: what to look at, or what to do.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import sympy
from working_through import (
    L_1,
    L_2,
    MEASURED,
    B_eq,
    B_l,
    J_eq,
    J_l,
    K_s,
    Where,
    alpha,
    alpha_dot,
    ctrb,
    m_1,
    m_2,
    spectrum,
    state_space,
    theta,
    theta_dot,
)

from rotflex import config, experiments, hil, signals, simulation
from rotflex.hil.student_benches import student_seed

STUDENT = "ada"  # everybody who slips has this bench
Answers = Mapping[str, Mapping[str, Any]]
Slipped = Callable[[Any, Answers], Any]  # (the right value, all answers so far) → what is given


@dataclass(frozen=True)
class Slip:
    """One slip.

    Attributes
    ----------
    where : (question, part) at which it is made
    what : in a few words
    change : what is given in place of the right value
    told : a pattern that the reason must have
    costs : share of the part's points that is lost
    besides : (question, part) → points lost besides, and why a person would take them off, too
    """

    where: Where
    what: str
    change: Slipped
    told: str
    costs: float = 1.0
    besides: Mapping[Where, tuple[float, str]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """For lists."""
        return f"{' '.join(self.where)}: {self.what}"


def column(values: Any) -> Any:
    return np.reshape(values, (4, 1))


def bench() -> Any:
    return hil.open("virtual", seed=student_seed(STUDENT))


def torque(own: Answers) -> tuple[Any, Any]:
    return np.asarray(own["2.14"]["A"]), np.asarray(own["2.14"]["B"])


def voltage(own: Answers) -> tuple[Any, Any]:
    return simulation.with_actuator(*torque(own), config.srv02())


def row(index: int, change: Callable[[Any], Any]) -> Callable[..., Any]:
    """``state_space`` with a row of A changed."""

    def slipped(*parameters: float) -> Any:
        A, *others = state_space(*parameters)
        A[index] = change(A[index])
        return A, *others

    return slipped


def at_another_anchor(name: str) -> float:
    arm = hil.student_benches.student_bench(student_seed(name)).joint
    return replace(arm, d_12=config.joint(arm.arm_position % 3 + 1).d_12).J_l


def held_servo(K_s: float, J_l: float, J_eq: float, B_eq: float) -> Any:
    A, *others = state_space(K_s, J_l, J_eq, B_eq)
    A[3, 1] = -K_s / J_l
    return A, *others


def transposed(*parameters: float) -> Any:
    A, *others = state_space(*parameters)
    return A.T, *others


def pushes_the_link(*parameters: float) -> Any:
    A, B, *others = state_space(*parameters)
    return A, np.abs(B), *others


def rows_swapped(*parameters: float) -> Any:
    A, B, C, D = state_space(*parameters)
    return A, B, C[::-1], D


def half_as_high(x: Any, dt: float) -> Any:
    f, amplitude = spectrum(x, dt)
    return f, amplitude / 2


def by_all(x: Any, dt: float) -> Any:
    """The sum is divided by the number of samples and of the zeros that are appended to them."""
    f, amplitude = spectrum(x, dt)
    return f, amplitude * np.size(x) / (2 * f.size)


def validated(model: Callable[[Answers], tuple[Any, Any]]) -> Slipped:
    def slipped(right: Any, own: Answers) -> Any:
        with bench() as opened:
            return experiments.validation(opened, *model(own), progress=False)

    return slipped


def tracked(feedback: str) -> Slipped:
    def slipped(right: Any, own: Answers) -> Any:
        with bench() as opened:
            return experiments.tracking(opened, right.metadata["K"], feedback, progress=False)

    return slipped


def torque_simulated(right: Any, own: Answers) -> Any:
    command = signals.smooth_square_wave(signals.time_axis(10.0, 0.002), 0.33, np.deg2rad(20), 100)
    return simulation.closed_loop(*torque(own), own["3.8"]["K"], command, saturation=None)


def placed(A: Any, B: Any, own: Answers) -> Any:
    import control

    return control.place(A, column(B), own["3.4"]["desired_poles"])


def times(factor: Any) -> Slipped:
    return lambda right, own: right * factor


def pair(damping: float, frequency: float) -> list[complex]:
    """Four desired poles with another pair than the right one."""
    return [complex(-damping, frequency), complex(-damping, -frequency), -30, -40]


UNCONTROLLABLE = "the voltage cannot move all of this model, so that it has no gain, and no loop to simulate"
WITHOUT_GAIN = ("W", "K", "poles", "t_s_sim", "PO_sim", "alpha_max_deg_sim", "K_fsf", "K_psf")

SLIPS: tuple[Slip, ...] = (
    # --- the derivation -----------------------------------------------------------------------------------------------
    Slip(("2.1", "V"), "no factor 1/2", times(2), "factor in front"),
    Slip(("2.1", "V"), "bent by theta", lambda v, own: v.subs(alpha, theta), "bent by alpha"),
    Slip(
        ("2.2", "T"),
        "the link turns with alpha alone",
        lambda v, own: (J_eq * theta_dot**2 + J_l * alpha_dot**2) / 2,
        "theta \\+ alpha",
    ),
    Slip(("2.3", "L"), "the total energy", lambda v, own: own["2.2"]["T"] + own["2.1"]["V"], "total energy"),
    Slip(
        ("2.4", "equation"),
        "friction drives",
        lambda v, own: sympy.Eq(v.lhs - 2 * B_eq * theta_dot, v.rhs),
        "sign of the friction",
    ),
    Slip(
        ("2.4", "equation"),
        "no friction",
        lambda v, own: sympy.Eq(v.lhs - B_eq * theta_dot, v.rhs),
        "friction is missing",
    ),
    Slip(
        ("2.5", "equation"),
        "a minus lost at the spring",
        lambda v, own: sympy.Eq(v.lhs - 2 * K_s * alpha, v.rhs),
        "sign of the spring",
    ),
    Slip(
        ("2.5", "equation"),
        "damped by the servo's rate",
        lambda v, own: sympy.Eq(v.lhs + B_l * (theta_dot - alpha_dot), v.rhs),
        "damping goes with alpha_dot",
    ),
    Slip(
        ("2.6", "theta_ddot"),
        "the spring's sign",
        lambda v, own: v - 2 * K_s * alpha / J_eq,
        "spring",
    ),
    Slip(("2.6", "alpha_ddot"), "the acceleration in the room", lambda v, own: -K_s * alpha / J_l, "theta \\+ alpha"),
    Slip(("2.7", "A"), "the rates exchanged", lambda v, own: v[:, [0, 1, 3, 2]], "Rows"),
    Slip(
        ("2.7", "B"),
        "a minus lost",
        lambda v, own: v.applyfunc(lambda x: x * (-1 if x.could_extract_minus_sign() else 1)),
        "gives: 4",
        costs=0.25,
    ),
    Slip(("2.8", "J_l"), "the bottom arm about its middle", lambda v, own: v - m_1 * L_1**2 / 4, "turns about its end"),
    Slip(("2.8", "J_l"), "no parallel axis", lambda v, own: m_1 * L_1**2 / 3 + m_2 * L_2**2 / 12, "parallel-axis"),
    # --- on the bench -------------------------------------------------------------------------------------------------
    Slip(("2.10", "spectrum"), "half as high", lambda v, own: half_as_high, "half as high", costs=0.5),
    Slip(("2.10", "spectrum"), "divided by zeros as well", lambda v, own: by_all, "zeros are appended", costs=0.5),
    Slip(("2.11", "omega_n"), "in Hz", times(1 / (2 * np.pi)), "Hz"),
    Slip(("2.11", "omega_n"), "another peak", times(1.3), "Nothing on your bench has its peak at this frequency"),
    Slip(("2.12", "J_l"), "another anchor", lambda v, own: at_another_anchor(STUDENT), "anchor"),
    Slip(("2.12", "K_s"), "with the frequency in Hz", times((2 * np.pi) ** -2), "Hz"),
    Slip(("2.12", "K_s"), "omega_n not squared", lambda v, own: v / own["2.11"]["omega_n"], "J_l·omega_n²"),
    # --- the model ----------------------------------------------------------------------------------------------------
    Slip(
        ("2.13", "state_space"),
        "a minus lost in the last row of A",
        lambda v, own: row(3, lambda r: r * [1, -1, 1, 1]),
        "row 4 of A, and at the signs",
    ),
    Slip(("2.13", "state_space"), "the link on a held servo", lambda v, own: held_servo, "row 4 of A"),
    Slip(
        ("2.13", "state_space"),
        "A transposed",
        lambda v, own: transposed,
        "row 1, 2, 3, 4 of A",
        besides={
            ("2.15", "figure"): (0.25, "theta_model stays at zero, which no figure can show to follow anything"),
            **dict.fromkeys((("3.8", "K"), ("3.10", "K")), (2, UNCONTROLLABLE)),
            ("3.9", "poles"): (1, UNCONTROLLABLE),
            **dict.fromkeys((("3.11", name) for name in ("response", "figure")), (1, UNCONTROLLABLE)),
            **dict.fromkeys((("3.12", name) for name in (*MEASURED, "satisfied")), (1, UNCONTROLLABLE)),
            **dict.fromkeys((("Table 3", name) for name in WITHOUT_GAIN), (0.25, UNCONTROLLABLE)),
        },
    ),
    Slip(("2.13", "state_space"), "a minus lost in B", lambda v, own: pushes_the_link, "another B", costs=0.5),
    Slip(("2.13", "state_space"), "rows of C exchanged", lambda v, own: rows_swapped, "another C", costs=0.5),
    Slip(
        ("2.14", "A"),
        "a minus lost in the last row",
        lambda v, own: v * ([[1]] * 3 + [[-1]]),
        "last row has the other sign",
    ),
    Slip(
        ("2.14", "A"), "the voltage's model", lambda v, own: v - np.outer([0, 0, 1, -1], [0, 0, 33, 0]), "follows from"
    ),
    Slip(("2.14", "B"), "a minus lost", lambda v, own: np.abs(v), "a minus is missing"),
    Slip(("2.14", "B"), "times ten", times(10), "follows from"),
    Slip(("2.14", "C"), "its rows exchanged", lambda v, own: v[::-1], ""),
    Slip(
        ("2.15", "validation"),
        "with the torque's model",
        validated(torque),
        "your model of question 2.14 gives other",
        costs=0.5,
    ),
    Slip(
        ("2.18", "poles"), "of the torque's model", lambda v, own: np.linalg.eigvals(torque(own)[0]), "torque as input"
    ),
    Slip(("2.18", "poles"), "mirrored", times(-1), "signs of the real parts"),
    # --- the design ---------------------------------------------------------------------------------------------------
    Slip(("3.1", "stability"), "stable", lambda v, own: "stable", "what decides it"),
    Slip(("3.2", "polynomial"), "a coefficient", times([1, 1, 1.1, 1, 1]), "follows from"),
    Slip(("3.2", "polynomial"), "lowest power first", lambda v, own: v[::-1], "highest power of s first"),
    Slip(("3.3", "A_c"), "no minus", lambda v, own: np.vstack([v[:3], -v[3:]]), "last row has the other sign"),
    Slip(("3.3", "A_c"), "last row reversed", lambda v, own: np.vstack([v[:3], v[3:, ::-1]]), "the other way round"),
    Slip(("3.3", "A_c"), "transposed", lambda v, own: v.T, "transposed"),
    Slip(("3.3", "B_c"), "first entry", lambda v, own: np.ravel(v)[::-1], ""),
    Slip(("3.4", "desired_poles"), "omega_n for omega_d", lambda v, own: pair(12, 20), "sqrt"),
    Slip(
        ("3.4", "desired_poles"),
        "real and imaginary part exchanged",
        lambda v, own: pair(16, 12),
        "exchanged|real and imaginary",
    ),
    Slip(
        ("3.4", "desired_poles"), "in the right half plane", lambda v, own: [-p for p in v], "signs of the real parts"
    ),
    Slip(("3.4", "desired_poles"), "zeta 0.06", lambda v, own: pair(1.2, 19.96), "damping ratio"),
    Slip(("3.4", "polynomial"), "a zero lost", times([1, 1, 1, 1, 0.1]), "factor of ten"),
    Slip(("3.5", "K_c"), "reversed", lambda v, own: v[:, ::-1], "lowest power of s comes first"),
    Slip(
        ("3.5", "K_c"),
        "the desired coefficients as they are",
        lambda v, own: np.array([[480000, 56800, 3280, 94.0]]),
        "not taken off",
    ),
    Slip(("3.5", "K_c"), "open loop less desired", times(-1), "open-loop polynomial less the desired"),
    Slip(("3.6", "rank"), "3", lambda v, own: 3, "number of states"),
    Slip(("3.7", "T"), "columns reversed", lambda v, own: v[:, ::-1], "the other way round"),
    Slip(("3.7", "T"), "of the torque's model", lambda v, own: ctrb(*torque(own)), "torque as input"),
    Slip(("3.7", "T_c"), "its inverse", lambda v, own: np.linalg.inv(v), "inverse"),
    Slip(("3.7", "W"), "its inverse", lambda v, own: np.linalg.inv(v), "inverse of what is asked for"),
    Slip(("3.7", "W"), "the wrong order", lambda v, own: np.linalg.inv(own["3.7"]["T_c"]) @ own["3.7"]["T"], "order"),
    Slip(("3.8", "K"), "the companion form's", lambda v, own: own["3.5"]["K_c"], "inverse of W"),
    Slip(("3.8", "K"), "W for its inverse", lambda v, own: own["3.5"]["K_c"] @ own["3.7"]["W"], "not by its inverse"),
    Slip(("3.8", "K"), "the other sign", times(-1), "signs are turned round"),
    Slip(("3.8", "K"), "per degree", lambda v, own: np.deg2rad(v), "per degree"),
    Slip(("3.8", "K"), "states in another order", lambda v, own: v[:, [0, 2, 1, 3]], "another order"),
    Slip(("3.8", "K"), "of the torque's model", lambda v, own: placed(*torque(own), own), "torque as input"),
    Slip(("3.8", "K"), "a digit", times([1.3, 1, 1, 1]), "eigenvalues of A - B K"),
    Slip(("3.9", "poles"), "of the open loop", lambda v, own: own["2.18"]["poles"], "eigenvalues of A - B K"),
    Slip(("3.10", "K"), "of the torque's model", lambda v, own: placed(*torque(own), own), "torque as input"),
    # --- responses ----------------------------------------------------------------------------------------------------
    Slip(
        ("3.11", "response"),
        "with the torque's model",
        torque_simulated,
        "torque as input",
        besides={("3.11", "figure"): (0.33, "of a voltage as short as this one's peaks, too few samples are kept")},
    ),
    Slip(("3.12", "V_max"), "the amplifier's limit doubled", lambda v, own: 20.0, ""),
    Slip(("3.16", "satisfied"), "the other word", lambda v, own: "no" if v == "yes" else "yes", ""),
    Slip(("3.12", "PO"), "of the amplitude", times(2), "per cent of the step|40 deg"),
    Slip(("3.12", "t_s"), "from the start of the recording", lambda v, own: v + 1.515, "start of the turn|run again"),
    Slip(("3.13", "response"), "with partial feedback", tracked("partial"), "feedback"),
    Slip(("3.14", "alpha_max_deg"), "in radians", lambda v, own: np.deg2rad(v), "unit"),
    Slip(("3.16", "V_max"), "from peak to peak", times(2), "run again"),
    # --- tables -------------------------------------------------------------------------------------------------------
    Slip(("Table 2", "C"), "its rows exchanged", lambda v, own: v[::-1], "follows from"),
    Slip(
        ("Table 2", "poles"),
        "of the torque's model",
        lambda v, own: np.linalg.eigvals(torque(own)[0]),
        "torque as input",
    ),
    Slip(("Table 3", "W"), "its inverse", lambda v, own: np.linalg.inv(v), "inverse|follows from"),
)

_NAMED = {slip.name: slip for slip in SLIPS}
#: Slips that are carried on through the whole course at a landing; all are by `make test-all`.
OF_EACH_KIND = [
    _NAMED[name]
    for name in (
        "2.11 omega_n: in Hz",  # a unit, with all that is built on it
        "2.13 state_space: a minus lost in the last row of A",  # a function
        "2.13 state_space: A transposed",  # a model that cannot be controlled
        "3.8 K: W for its inverse",  # a gain
        "3.13 response: with partial feedback",  # a run on the bench
    )
]
