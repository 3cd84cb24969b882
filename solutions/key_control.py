"""How the answers of Section 3 are marked. Part of ``key.py``, which has the policy."""

import numpy as np

from labcourse.grading.marking.checks import EVALUATION_ERRORS, ChoiceIs, ForAPerson, MatrixIs, Number, PolesAre
from rotflex.config import srv02
from rotflex.specifications import ZETA
from rotflex.units import DEG

from . import tolerances
from .design_checks import CARRIED, ArrayFrom, carried
from .figure_shows import FigureShows
from .loop_checks import ClosedLoopPoles, GainPlaces, by_own_companion, torque_gain
from .own_answers import usable
from .own_model import own_voltage_model
from .repeated import gain_used, own_model, run_again, simulated_again, torque_simulated
from .response_checks import Measured, ResponseOf, Satisfied
from .wanted import desired_poles, desired_polynomial

# --- Section 3.3: the design on paper -------------------------------------------------------------------------------


def own_polynomial(case):
    return np.poly(np.ravel(usable(case.own, "2.18", "poles"))).real


def own_stability(own, bench):
    """What the workbook's rule makes of the student's own poles."""
    poles = np.ravel(usable(own, "2.18", "poles"))
    largest = np.abs(poles).max()
    real = np.where(np.abs(poles.real) < 1e-3 * largest, 0.0, poles.real)
    if np.any(real > 0) or np.sum(np.abs(poles) < 1e-3 * largest) > 1:
        return "unstable"
    return "marginally stable" if np.any(real == 0) else "stable"


def swapped(poles):
    """The complex poles with their real and imaginary parts exchanged."""
    return np.where(poles.imag == 0, poles, -np.abs(poles.imag) + 1j * np.sign(poles.imag) * np.abs(poles.real))


def companion(polynomial):
    """The workbook's companion matrix of s⁴ + a₄s³ + a₃s² + a₂s + a₁."""
    matrix = np.eye(4, k=1)
    matrix[3] = -np.ravel(polynomial)[:0:-1]
    return matrix


def own_companion(case):
    return companion(usable(case.own, "3.2", "polynomial"))


def wanted_by_own_poles(own):
    return np.poly(np.ravel(usable(own, "3.4", "desired_poles"))).real


def own_K_c(case):
    """The difference of the student's own two polynomials; the right one where they gave none."""
    try:
        desired = np.ravel(usable(case.own, "3.4", "polynomial"))
    except LookupError:
        desired = desired_polynomial()
    return (desired - np.ravel(usable(case.own, "3.2", "polynomial")))[:0:-1]


def K_c_for_own_wish(case):
    """For the student's own desired polynomial, from the polynomial of their own model."""
    desired = np.ravel(usable(case.own, "3.4", "polynomial"))
    return (desired - np.poly(own_model(case)[0]).real)[:0:-1]


K_C = (
    ("the difference of your own two polynomials", own_K_c),
    ("your own desired polynomial", K_c_for_own_wish),
)

PRELAB = {
    "3.1": {
        "stability": ChoiceIs(
            "marginally stable",
            "One pole is on the imaginary axis, and it is not repeated; all others are in the left half.",
            follow=own_stability,
            follow_what="your own poles",
        ),
        "explanation": ForAPerson(),
    },
    "3.2": {
        "strategy": ForAPerson(),
        "polynomial": ArrayFrom(
            "the characteristic polynomial",
            lambda d: d.polynomial,
            follow=(("the polynomial of your own poles", own_polynomial),),
            slips=(("highest power of s first", lambda p: p[::-1]),),
        ),
    },
    "3.3": {
        "A_c": ArrayFrom(
            "the companion matrix",
            lambda d: companion(d.polynomial),
            follow=(("the companion matrix of your own polynomial", own_companion),),
            slips=(
                ("the last row has the other sign", lambda a: np.vstack([a[:3], -a[3:]])),
                (
                    "the coefficients of the last row go the other way round",
                    lambda a: np.vstack([a[:3], a[3:, ::-1]]),
                ),
                ("it is transposed", np.transpose),
            ),
        ),
        "B_c": MatrixIs("the companion form of B", lambda bench: [0, 0, 0, 1]),
    },
    "3.4": {
        "strategy": ForAPerson(),
        "desired_poles": PolesAre(
            "the desired poles",
            lambda bench: desired_poles(),
            rtol=tolerances.DESIRED,
            slips=lambda bench: {
                "the imaginary part is omega_n sqrt(1 - zeta²), not omega_n": (
                    desired_poles().real + 1j * desired_poles().imag / np.sqrt(1 - ZETA**2)
                ),
                "the dominant pair is -zeta omega_n ± j omega_n sqrt(1 - zeta²): real and imaginary part": swapped(
                    desired_poles()
                ),
                "a factor of ten is lost in the damping ratio": desired_poles(ZETA / 10),
            },
        ),
        "polynomial": MatrixIs(
            "the desired polynomial",
            lambda bench: desired_polynomial(),
            rtol=tolerances.DESIRED,
            follow=wanted_by_own_poles,
            follow_what="the polynomial of your own desired poles",
            follow_rtol=tolerances.DESIRED,
            slips=lambda bench: {
                "highest power of s first": desired_polynomial()[::-1],
                "a factor of ten is lost in the last entry": desired_polynomial() * [1, 1, 1, 1, 0.1],
            },
        ),
    },
    "3.5": {
        "strategy": ForAPerson(),
        "K_c": ArrayFrom(
            "the gain in companion form",
            lambda d: (desired_polynomial() - d.polynomial)[:0:-1],
            follow=K_C,
            slips=(
                ("the gain for the lowest power of s comes first", lambda k: k[::-1]),
                ("a factor of ten is lost in the first entry", lambda k: k * [0.1, 1, 1, 1]),
                ("the open-loop coefficients were not taken off", lambda k: desired_polynomial()[:0:-1]),
                ("it is the open-loop polynomial less the desired one", np.negative),
            ),
        ),
    },
}

# --- Section 3.4.1: the design in numbers ---------------------------------------------------------------------------


def ctrb(A, B):
    columns = [np.reshape(B, (4, 1))]
    for _time in range(3):
        columns.append(A @ columns[-1])
    return np.hstack(columns)


def own_ctrb(case):
    return ctrb(*own_voltage_model(case.own, case.bench.servo))


def torque_ctrb(case):
    return ctrb(usable(case.own, "2.14", "A"), usable(case.own, "2.14", "B"))


def W_the_wrong_way(case):
    return np.linalg.inv(usable(case.own, "3.7", "T_c")) @ usable(case.own, "3.7", "T")


def own_rank(own):
    """The rank of the controllability matrix of the student's own model, its columns made equally long."""
    try:
        T = ctrb(*own_voltage_model(own, srv02()))
        return float(np.linalg.matrix_rank(T / np.linalg.norm(T, axis=0)))
    except EVALUATION_ERRORS as error:
        raise LookupError("no model") from error


def own_controllable(own, bench):
    return "yes" if own("3.6", "rank") >= 4 else "no"


#: Notebook 06 takes the companion form from the model; by hand it is that of 3.3, or of the polynomial.
T_C = (
    ("that of the companion form of your own model", lambda case: T_c(np.poly(own_model(case)[0]).real)),
    ("that of your own companion form", lambda case: ctrb(usable(case.own, "3.3", "A_c"), np.array([0, 0, 0, 1.0]))),
    ("that of your own polynomial", lambda case: T_c(np.ravel(usable(case.own, "3.2", "polynomial")))),
)


def T_c(polynomial):
    return ctrb(companion(polynomial), np.array([0, 0, 0, 1.0]))


def own_W(case):
    return usable(case.own, "3.7", "T") @ np.linalg.inv(usable(case.own, "3.7", "T_c"))


def W_of_own_model(case):
    A, B = own_voltage_model(case.own, case.bench.servo)
    return ctrb(A, B) @ np.linalg.inv(T_c(np.poly(A).real))


OWN_K_C = "it is the gain in companion form, which belongs to other states: multiply it by the inverse of W"
GAIN_SLIPS = (
    (OWN_K_C, lambda K, case: usable(case.own, "3.5", "K_c")),
    ("K_c is multiplied by W, not by its inverse", lambda K, case: own_K_c_and_W(case)),
    ("all its signs are turned round", lambda K, case: -K),
    ("it is per degree; the states are in rad", lambda K, case: K * DEG),
    ("the states are in another order: theta, alpha, theta_dot, alpha_dot", lambda K, case: K[[0, 2, 1, 3]]),
    ("it is for the model with the torque as input", lambda K, case: torque_gain(case)),
)


def own_K_c_and_W(case):
    return np.ravel(usable(case.own, "3.5", "K_c")) @ usable(case.own, "3.7", "W")


DESIGN = {
    "3.6": {
        "rank": Number(
            "the number of states",
            lambda bench: 4.0,
            1e-6,
            follow=own_rank,
            follow_what="the controllability matrix of your own model",
            follow_rtol=1e-6,
        ),
        "controllable": ChoiceIs(
            "yes",
            "The controllability matrix has full rank.",
            follow=own_controllable,
            follow_what="your own rank",
        ),
        "explanation": ForAPerson(),
    },
    "3.7": {
        "T": ArrayFrom(
            "the controllability matrix",
            lambda d: d.transformation[0],
            rtol=tolerances.CONTROLLABILITY,
            follow=(("that of your own model", own_ctrb),),
            slips=(("its columns go the other way round", lambda t: t[:, ::-1]),),
            others=(("it is that of the model with the torque as input", torque_ctrb),),
        ),
        "T_c": ArrayFrom(
            "the controllability matrix of the companion form",
            lambda d: d.transformation[1],
            rtol=tolerances.CONTROLLABILITY,
            follow=T_C,
            slips=(("it is the inverse of what is asked for", np.linalg.inv),),
        ),
        "W": ArrayFrom(
            "the transformation matrix",
            lambda d: d.transformation[2],
            rtol=tolerances.CONTROLLABILITY,
            follow=(
                ("T times the inverse of T_c, with your own", own_W),
                ("the transformation of your own model", W_of_own_model),
            ),
            slips=(("it is the inverse of what is asked for", np.linalg.inv),),
            others=(("the order of the factors: T comes first, then the inverse of T_c", W_the_wrong_way),),
        ),
    },
    "3.8": {
        "K": GainPlaces(
            follow=(("your own gain in companion form times the inverse of your own W", by_own_companion),),
            slips=GAIN_SLIPS,
        ),
    },
    "3.9": {
        "poles": ClosedLoopPoles(),
        "conclusion": ForAPerson(),
    },
    "3.10": {"K": GainPlaces(slips=GAIN_SLIPS)},
}


# --- Sections 3.4.2 to 3.4.4: responses -----------------------------------------------------------------------------


TORQUE = "the model with the torque as input was simulated; the controller sets a voltage"
FEEDBACKS = {"full": run_again("full"), "partial": run_again("partial")}
#: Recording, measurements, how it is run again, and what else the recording may be of: what was done → what it gives.
EXPERIMENTS = {
    "sim": ("3.11", "3.12", simulated_again, {TORQUE: torque_simulated}),
    "fsf": ("3.13", "3.14", FEEDBACKS["full"], {"the feedback was partial": FEEDBACKS["partial"]}),
    "psf": ("3.15", "3.16", FEEDBACKS["partial"], {"the feedback was full": FEEDBACKS["full"]}),
}


def experiment(suffix):
    """The check of a response and its figure, and of what is measured on it."""
    recorded, measured, again, slips = EXPERIMENTS[suffix]
    response = (recorded, "response")
    numbers = {
        name: Measured(name, again, response, measured, slips=tuple(slips.values()), **room)
        for name, room in tolerances.MEASURED.items()
    }
    return {
        recorded: {
            "response": ResponseOf(again, channels=("theta", "alpha", "vm"), slips=slips),
            "figure": FigureShows(again, own=response, channels=("theta", "alpha", "vm")),
        },
        measured: {
            **numbers,
            "satisfied": Satisfied(measured, again, response, numbers),
            "conclusion": ForAPerson(),
        },
    }


RESPONSES = {
    **experiment("sim"),
    **experiment("fsf"),
    **experiment("psf"),
    "3.17": {
        "explanation": ForAPerson(),
    },
}


# --- Section 3.5 ----------------------------------------------------------------------------------------------------


def measured(suffix):
    recorded, source, again, slips = EXPERIMENTS[suffix]
    return {
        f"{name}_{suffix}": Measured(
            name,
            again,
            (recorded, "response"),
            source,
            carried=(source, name),
            slips=tuple(slips.values()),
            **tolerances.MEASURED[name],
        )
        for name in ("t_s", "PO", "alpha_max_deg")
    }


USED = "the gain that your recording says it was made with"
OWN_GAIN = carried("3.8", "K")
PARTIAL = (
    ("your own gain with the two zeros", lambda case: np.ravel(usable(case.own, "3.8", "K")) * LEFT),
    ("the gain of your recording with the two zeros", lambda case: gain_used(case, "3.15") * LEFT),
)
LEFT = [1, 0, 1, 0]

TABLE_3 = {
    "Table 3": {
        "desired_poles": PolesAre(
            "the desired poles",
            lambda bench: desired_poles(),
            follow=lambda own: usable(own, "3.4", "desired_poles"),
            follow_what=CARRIED,
        ),
        "K_c": ArrayFrom(
            "the gain in companion form",
            lambda d: (desired_polynomial() - d.polynomial)[:0:-1],
            follow=(*carried("3.5", "K_c"), *K_C),
        ),
        "W": ArrayFrom("the transformation matrix", lambda d: d.transformation[2], follow=carried("3.7", "W")),
        "K": GainPlaces(follow=OWN_GAIN),
        "poles": ClosedLoopPoles(follow=carried("3.9", "poles")),
        **measured("sim"),
        "K_fsf": GainPlaces(follow=(*OWN_GAIN, (USED, lambda case: gain_used(case, "3.13")))),
        **measured("fsf"),
        "K_psf": ArrayFrom("the gain of partial state feedback", lambda d: np.ravel(d.K) * LEFT, follow=PARTIAL),
        **measured("psf"),
    },
}
CONTROL = {**PRELAB, **DESIGN, **RESPONSES, **TABLE_3}
