"""How the answers of Section 3 are marked. Part of ``key.py``, which has the policy."""

import numpy as np

from rotflex.instructor.marking.checks import ChoiceIs, ForAPerson, Number

from . import tolerances
from .design_checks import ArrayFrom, GainPlaces, PolesFrom, desired_poles, desired_polynomial, own_voltage_model
from .figure_shows import FigureShows
from .response_checks import Measured, ResponseOf, Satisfied, run_again, simulated_again


def from_own(question, part):
    """An entry of a results table: the student's own answer, carried over."""
    return lambda own, servo: np.asarray(own(question, part))


CARRIED = "your own answer"


# --- Section 3.3: the design on paper -------------------------------------------------------------------------------


def own_polynomial(own, servo):
    return np.poly(np.ravel(own("2.18", "poles"))).real


def own_stability(own, bench):
    """What the workbook's rule makes of the student's own poles."""
    poles = np.ravel(own("2.18", "poles"))
    largest = np.abs(poles).max()
    real = np.where(np.abs(poles.real) < 1e-3 * largest, 0.0, poles.real)
    if np.any(real > 0) or np.sum(np.abs(poles) < 1e-3 * largest) > 1:
        return "unstable"
    return "marginally stable" if np.any(real == 0) else "stable"


def companion(polynomial):
    """The workbook's companion matrix of s⁴ + a₄s³ + a₃s² + a₂s + a₁."""
    matrix = np.eye(4, k=1)
    matrix[3] = -np.ravel(polynomial)[:0:-1]
    return matrix


def own_K_c(own, servo):
    open_loop, desired = np.ravel(own("3.2", "polynomial")), np.ravel(own("3.4", "polynomial"))
    return (desired - open_loop)[:0:-1]


PRELAB = {
    "3.1": {
        "stability": ChoiceIs(
            "marginally stable",
            "One pole is on the imaginary axis, and it is not repeated; all others are in the left half.",
            follow=own_stability,
            follow_what="your own poles",
        ),
        "explanation": ForAPerson(
            "The pole at zero is the servo's angle: with a steady voltage it turns on and on, so the angle never "
            "settles; nothing grows by itself either. Refers to something that was seen on the bench."
        ),
    },
    "3.2": {
        "strategy": ForAPerson("The poles are the roots of det(sI - A): multiply out the four factors."),
        "polynomial": ArrayFrom(
            "the characteristic polynomial",
            lambda d: d.polynomial,
            follow=own_polynomial,
            follow_what="the polynomial of your own poles",
            slips=(("highest power of s first", lambda p: p[::-1]),),
        ),
    },
    "3.3": {
        "A_c": ArrayFrom(
            "the companion matrix",
            lambda d: companion(d.polynomial),
            follow=lambda own, servo: companion(own("3.2", "polynomial")),
            follow_what="the companion matrix of your own polynomial",
            slips=(
                ("the last row has the other sign", lambda a: np.vstack([a[:3], -a[3:]])),
                ("the coefficients of the last row go the other way round", lambda a: np.vstack([a[:3], a[3:, ::-1]])),
            ),
        ),
        "B_c": ArrayFrom("the companion form of B", lambda d: [0, 0, 0, 1]),
    },
    "3.4": {
        "strategy": ForAPerson(
            "sigma = zeta omega_n and omega_d = omega_n sqrt(1 - zeta²) make a conjugate pair; p_3 and p_4 are given."
        ),
        "desired_poles": PolesFrom("the desired poles", lambda d: desired_poles(), rtol=tolerances.DESIRED),
        "polynomial": ArrayFrom(
            "the desired polynomial",
            lambda d: desired_polynomial(),
            rtol=tolerances.DESIRED,
            follow=lambda own, servo: np.poly(np.ravel(own("3.4", "desired_poles"))).real,
            follow_what="the polynomial of your own desired poles",
            slips=(("highest power of s first", lambda p: p[::-1]),),
        ),
    },
    "3.5": {
        "strategy": ForAPerson("The feedback changes the last row only: compare coefficients, power by power."),
        "K_c": ArrayFrom(
            "the gain in companion form",
            lambda d: (desired_polynomial() - d.polynomial)[:0:-1],
            follow=own_K_c,
            follow_what="the difference of your own two polynomials",
            slips=(
                ("the gain for the lowest power of s comes first", lambda k: k[::-1]),
                ("a factor of ten is lost in the first entry", lambda k: k * [0.1, 1, 1, 1]),
                ("the open-loop coefficients were not taken off", lambda k: desired_polynomial()[:0:-1]),
            ),
        ),
    },
}

# --- Section 3.4.1: the design in numbers ---------------------------------------------------------------------------


def ctrb(A, B):
    columns = [np.reshape(B, (4, 1))]
    for _ in range(3):
        columns.append(A @ columns[-1])
    return np.hstack(columns)


def own_companion_ctrb(own, servo):
    return ctrb(companion(own("3.2", "polynomial")), np.array([0, 0, 0, 1.0]))


def closed_loop_poles(own, servo):
    A, B = own_voltage_model(own, servo)
    return np.linalg.eigvals(A - B @ np.reshape(own("3.8", "K"), (1, 4)))


DESIGN = {
    "3.6": {
        "rank": Number("the number of states", lambda bench: 4.0, 1e-6),
        "controllable": ChoiceIs("yes", "The controllability matrix has full rank."),
        "explanation": ForAPerson(
            "Full rank: the columns of T span all four directions, so the voltage can bring any state to any other."
        ),
    },
    "3.7": {
        "T": ArrayFrom(
            "the controllability matrix",
            lambda d: d.transformation[0],
            rtol=tolerances.CONTROLLABILITY,
            follow=lambda own, servo: ctrb(*own_voltage_model(own, servo)),
            follow_what="that of your own model",
        ),
        "T_c": ArrayFrom(
            "the controllability matrix of the companion form",
            lambda d: d.transformation[1],
            rtol=tolerances.CONTROLLABILITY,
            follow=own_companion_ctrb,
            follow_what="that of your own companion form",
        ),
        "W": ArrayFrom(
            "the transformation matrix",
            lambda d: d.transformation[2],
            rtol=tolerances.CONTROLLABILITY,
            follow=lambda own, servo: own("3.7", "T") @ np.linalg.inv(own("3.7", "T_c")),
            follow_what="T times the inverse of T_c, with your own",
            slips=(("it is the inverse of what is asked for", np.linalg.inv),),
        ),
    },
    "3.8": {
        "K": GainPlaces(
            follow=lambda own, servo: np.ravel(own("3.5", "K_c")) @ np.linalg.inv(own("3.7", "W")),
            follow_what="your own gain in companion form times the inverse of your own W",
        ),
    },
    "3.9": {
        "poles": PolesFrom(
            "the desired poles",
            lambda d: desired_poles(),
            follow=closed_loop_poles,
            follow_what="the closed loop of your own model and gain",
        ),
        "conclusion": ForAPerson("Compares with the desired poles; where they differ, says why (a rounded K)."),
    },
    "3.10": {"K": GainPlaces()},
}


# --- Sections 3.4.2 to 3.4.4: responses -----------------------------------------------------------------------------


def experiment(recorded, measured, again):
    """The check of a response and its figure, and of what is measured on it."""
    response = (recorded, "response")
    return {
        recorded: {
            "response": ResponseOf(again, channels=("theta", "alpha", "vm")),
            "figure": FigureShows(again, own=response, channels=("theta", "alpha", "vm")),
        },
        measured: {
            **{name: Measured(name, again, response, **room) for name, room in tolerances.MEASURED.items()},
            "satisfied": Satisfied(measured, again, response),
            "conclusion": ForAPerson(
                "Each specification with its number and margin; what was expected, and why it came out so."
            ),
        },
    }


RESPONSES = {
    **experiment("3.11", "3.12", simulated_again),
    **experiment("3.13", "3.14", run_again("full")),
    **experiment("3.15", "3.16", run_again("partial")),
    "3.17": {
        "explanation": ForAPerson(
            "Without alpha and its rate in the feedback, little but friction damps the link: it is left to swing after "
            "each turn (two poles with little damping). The servo gets where it should, though later. Refers to the "
            "loop."
        ),
    },
}


# --- Section 3.5 ----------------------------------------------------------------------------------------------------


def measured(source, suffix):
    again, response = {
        "3.12": (simulated_again, ("3.11", "response")),
        "3.14": (run_again("full"), ("3.13", "response")),
        "3.16": (run_again("partial"), ("3.15", "response")),
    }[source]
    return {
        f"{name}_{suffix}": Measured(name, again, response, carried=(source, name), **tolerances.MEASURED[name])
        for name in ("t_s", "PO", "alpha_max_deg")
    }


def partial(own, servo):
    return np.ravel(own("3.8", "K")) * [1, 0, 1, 0]


GAIN = GainPlaces(follow=from_own("3.8", "K"), follow_what=CARRIED)

TABLE_3 = {
    "Table 3": {
        "desired_poles": PolesFrom(
            "the desired poles", lambda d: desired_poles(), follow=from_own("3.4", "desired_poles"), follow_what=CARRIED
        ),
        "K_c": ArrayFrom(
            "the gain in companion form",
            lambda d: (desired_polynomial() - d.polynomial)[:0:-1],
            follow=from_own("3.5", "K_c"),
            follow_what=CARRIED,
        ),
        "W": ArrayFrom(
            "the transformation matrix",
            lambda d: d.transformation[2],
            follow=from_own("3.7", "W"),
            follow_what=CARRIED,
        ),
        "K": GAIN,
        "poles": PolesFrom(
            "the desired poles", lambda d: desired_poles(), follow=from_own("3.9", "poles"), follow_what=CARRIED
        ),
        **measured("3.12", "sim"),
        "K_fsf": GAIN,
        **measured("3.14", "fsf"),
        "K_psf": ArrayFrom(
            "the gain that partial feedback leaves",
            lambda d: np.ravel(d.K) * [1, 0, 1, 0],
            follow=partial,
            follow_what="what partial feedback leaves of your own gain",
        ),
        **measured("3.16", "psf"),
    },
}
CONTROL = {**PRELAB, **DESIGN, **RESPONSES, **TABLE_3}
