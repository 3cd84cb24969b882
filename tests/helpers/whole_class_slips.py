"""One change at a time, in an otherwise perfect file: (value, all values) → value."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import sympy
from working_through import (
    L_1,
    L_2,
    B_eq,
    B_l,
    J_eq,
    J_l,
    K_s,
    Where,
    alpha,
    alpha_dot,
    ctrb,
    digits,
    m_1,
    m_2,
    theta,
    theta_dot,
)

Slip = Callable[[Any, Mapping[Where, Any]], Any]


def _placed(A: Any, B: Any) -> Any:
    import control

    return np.asarray(control.place(A, B, [-12 + 16j, -12 - 16j, -30, -40])).reshape(1, 4)


#: What is plausible at first sight and wrong.
SLIPS: dict[tuple[Where, str], Slip] = {
    (("2.1", "V"), "theta in place of alpha"): lambda v, own: v.subs(alpha, theta),
    (("2.2", "T"), "the link turns with alpha only"): lambda v, own: (J_eq * theta_dot**2 + J_l * alpha_dot**2) / 2,
    (("2.3", "L"), "the total energy"): lambda v, own: own["2.2", "T"] + own["2.1", "V"],
    (("2.4", "equation"), "friction on the wrong side"): lambda v, own: sympy.Eq(v.lhs - 2 * B_eq * theta_dot, v.rhs),
    (("2.5", "equation"), "damped by the servo's rate"): lambda v, own: v.subs(B_l * alpha_dot, B_l * theta_dot),
    (("2.6", "alpha_ddot"), "acceleration in the room"): lambda v, own: -K_s * alpha / J_l,
    (("2.7", "A"), "the rates exchanged"): lambda v, own: v[:, [0, 1, 3, 2]],
    (("2.7", "B"), "the link's inertia"): lambda v, own: sympy.Matrix([0, 0, 1 / J_l, -1 / J_l]),
    (("2.8", "J_l"), "no parallel axis"): lambda v, own: m_1 * L_1**2 / 3 + m_2 * L_2**2 / 12,
    (("2.8", "J_l"), "bottom arm about its middle"): lambda v, own: v - m_1 * L_1**2 / 4,
    (("2.11", "omega_n"), "in Hz"): lambda v, own: v / (2 * np.pi),
    (("2.12", "K_s"), "with the frequency in Hz"): lambda v, own: v / (2 * np.pi) ** 2,
    (("2.12", "K_s"), "per degree"): lambda v, own: np.deg2rad(v),
    (("2.14", "A"), "no reaction of the base"): lambda v, own: v + v[2, 1] * np.outer([0, 0, 0, 1], [0, 1, 0, 0]),
    (("2.14", "A"), "voltage as input"): lambda v, own: v - 80 * np.outer([0, 0, 1, -1], [0, 0, 1, 0]),
    (("2.14", "B"), "no minus"): lambda v, own: np.abs(v),
    (("2.14", "B"), "for the voltage"): lambda v, own: 0.1284 * v,
    (("2.14", "C"), "its rows exchanged"): lambda v, own: v[::-1],
    (("2.14", "C"), "theta and its rate"): lambda v, own: np.eye(4)[[0, 2]],
    (("2.14", "D"), "ones"): lambda v, own: v + 1,
    (("2.18", "poles"), "of the torque model"): lambda v, own: np.linalg.eigvals(own["2.14", "A"]),
    (("2.18", "poles"), "in Hz"): lambda v, own: v / (2 * np.pi),
    (("2.18", "poles"), "mirrored"): lambda v, own: -v,
    (("3.1", "stability"), "stable"): lambda v, own: "stable",
    (("3.1", "stability"), "unstable"): lambda v, own: "unstable",
    (("3.2", "polynomial"), "lowest power first"): lambda v, own: v[::-1],
    (("3.2", "polynomial"), "of the torque model"): lambda v, own: np.poly(own["2.14", "A"]).real,
    (("3.2", "polynomial"), "signs of the poles"): lambda v, own: np.abs(v) * [1, -1, 1, -1, 1],
    (("3.3", "A_c"), "no minus"): lambda v, own: np.abs(v),
    (("3.3", "A_c"), "last row the other way round"): lambda v, own: np.vstack([v[:3], v[3, ::-1]]),
    (("3.3", "A_c"), "transposed"): lambda v, own: v.T,
    (("3.3", "B_c"), "first entry"): lambda v, own: v[::-1],
    (("3.4", "desired_poles"), "omega_n for omega_d"): lambda v, own: np.array([-12 + 20j, -12 - 20j, -30, -40]),
    (("3.4", "desired_poles"), "in the right half"): lambda v, own: -v,
    (("3.4", "polynomial"), "lowest power first"): lambda v, own: v[::-1],
    (("3.4", "polynomial"), "a zero lost"): lambda v, own: v * [1, 1, 1, 1, 0.1],
    (("3.5", "K_c"), "a zero lost, 48000"): lambda v, own: v * [0.1, 1, 1, 1],
    (("3.5", "K_c"), "last power first"): lambda v, own: v[:, ::-1],
    (("3.5", "K_c"), "desired coefficients as they are"): lambda v, own: np.array([[480000.0, 56800, 3280, 94]]),
    (("3.5", "K_c"), "open loop less desired"): lambda v, own: -v,
    (("3.6", "rank"), "3"): lambda v, own: 3.0,
    (("3.6", "controllable"), "no"): lambda v, own: "no",
    (("3.7", "T"), "columns the other way round"): lambda v, own: v[:, ::-1],
    (("3.7", "T"), "of the torque model"): lambda v, own: ctrb(own["2.14", "A"], own["2.14", "B"]),
    (("3.7", "T_c"), "its inverse"): lambda v, own: np.linalg.inv(v),
    (("3.7", "W"), "its inverse"): lambda v, own: np.linalg.inv(v),
    (("3.7", "W"), "the wrong order"): lambda v, own: np.linalg.inv(own["3.7", "T_c"]) @ own["3.7", "T"],
    (("3.8", "K"), "the companion form's"): lambda v, own: own["3.5", "K_c"],
    (("3.8", "K"), "W in place of its inverse"): lambda v, own: own["3.5", "K_c"] @ own["3.7", "W"],
    (("3.8", "K"), "per degree"): lambda v, own: np.deg2rad(v),
    (("3.8", "K"), "the other sign"): lambda v, own: -v,
    (("3.8", "K"), "states in another order"): lambda v, own: v[:, [0, 2, 1, 3]],
    (("3.8", "K"), "of the torque model"): lambda v, own: _placed(own["2.14", "A"], own["2.14", "B"]),
    (("3.8", "K"), "one digit only"): lambda v, own: digits(1)(v),
    (("3.9", "poles"), "of the open loop"): lambda v, own: own["2.18", "poles"],
    (("3.9", "poles"), "mirrored"): lambda v, own: -v,
    (("3.10", "K"), "the companion form's"): lambda v, own: own["3.5", "K_c"],
    (("3.10", "K"), "of the torque model"): lambda v, own: _placed(own["2.14", "A"], own["2.14", "B"]),
    (("3.12", "t_s"), "counted from the start"): lambda v, own: v + 1.515,
    (("3.12", "PO"), "of the amplitude"): lambda v, own: 2 * v,
    (("3.12", "PO"), "a fraction"): lambda v, own: v / 100,
    (("3.12", "alpha_max_deg"), "in radians"): lambda v, own: np.deg2rad(v),
    (("3.12", "V_max"), "the amplifier's limit doubled"): lambda v, own: 20.0,
    (("3.16", "satisfied"), "not what the numbers say"): lambda v, own: "no" if v == "yes" else "yes",
    (("3.14", "t_s"), "in milliseconds"): lambda v, own: 1000 * v,
    (("3.14", "alpha_max_deg"), "in radians"): lambda v, own: np.deg2rad(v),
    (("3.16", "t_s"), "of full state feedback"): lambda v, own: 0.5 * v,
    (("3.16", "V_max"), "half of it"): lambda v, own: v / 2,
    (("Table 2", "C"), "its rows exchanged"): lambda v, own: v[::-1],
    (("Table 2", "poles"), "of the torque model"): lambda v, own: np.linalg.eigvals(own["2.14", "A"]),
    (("Table 3", "K_c"), "the gain for the original states"): lambda v, own: own["3.8", "K"],
    (("Table 3", "K_psf"), "of full state feedback"): lambda v, own: own["3.8", "K"],
    (("Table 3", "K_psf"), "the servo's gains left out"): lambda v, own: own["3.8", "K"] * [0, 1, 0, 1],
    (("Table 3", "W"), "its inverse"): lambda v, own: np.linalg.inv(v),
}
