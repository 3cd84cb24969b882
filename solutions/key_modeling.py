"""How the answers of Section 2 are marked. Part of ``key.py``, which has the policy."""

from functools import partial

import numpy as np

from labcourse.grading.marking import expression_checks
from labcourse.grading.marking.checks import ForAPerson, Number, RecordingOf
from labcourse.grading.marking.expression_checks import ExpressionIs, value_at
from labcourse.grading.marking.figure_checks import FigureFollows, FigureOfSpectrum
from labcourse.grading.verdicts import OwnBench
from rotflex.hil.student_benches import FIRST_RUN
from rotflex.simulation import zero_order_hold
from rotflex.units import DEG, HZ

from . import tolerances
from .design_checks import DISCRETE, ArrayFrom, Design, PolesFrom, StateSpaceFunction, carried, logarithm
from .figure_shows import FigureShows
from .motion import MOTION, STATE, accelerations, euler_lagrange, link_acceleration, slope
from .own_answers import usable
from .own_model import from_own_function, own_voltage_model
from .quantities import ANGLE, FREQUENCY
from .reading_checks import K_S, OMEGA_N, NaturalFrequency, Stiffness, inertia_slips
from .repeated import validated_again
from .response_checks import ResponseOf
from .spectrum_checks import SpectrumFunction

EquationIs = partial(expression_checks.EquationIs, motion=MOTION)
SymbolicMatrixIs = partial(expression_checks.SymbolicMatrixIs, own_symbols=STATE)


def sweep(bench, run=FIRST_RUN):
    return bench.sweep(run)


# --- Section 2.2: the derivation, as functions of a point p ---------------------------------------------------------


def V(p):
    return p["K_s"] * p["alpha"] ** 2 / 2


def T(p):
    return p["J_eq"] * p["theta_dot"] ** 2 / 2 + p["J_l"] * (p["theta_dot"] + p["alpha_dot"]) ** 2 / 2


def servo_equation(p):
    inertia = (p["J_eq"] + p["J_l"]) * p["theta_ddot"] + p["J_l"] * p["alpha_ddot"]
    return inertia + p["B_eq"] * p["theta_dot"] - p["tau"]


def link_equation(p, damping="alpha_dot"):
    return p["J_l"] * (p["theta_ddot"] + p["alpha_ddot"]) + p["B_l"] * p[damping] + p["K_s"] * p["alpha"]


def servo_alone(p):
    """The servo cut free by Newton: its equation with that of the link put in for alpha_ddot."""
    return servo_equation(p) - link_equation(p)


def link_without_theta_ddot(p):
    """The link's equation, with that of the servo alone put in for theta_ddot."""
    return link_equation(p) - p["J_l"] / p["J_eq"] * servo_alone(p)


def theta_ddot(p):
    return (p["tau"] - p["B_eq"] * p["theta_dot"] + p["K_s"] * p["alpha"]) / p["J_eq"]


def alpha_ddot(p):
    return -theta_ddot(p) - p["K_s"] * p["alpha"] / p["J_l"]


def A(p):
    k, b = p["K_s"] / p["J_eq"], p["B_eq"] / p["J_eq"]
    return [[0, 0, 1, 0], [0, 0, 0, 1], [0, k, -b, 0], [0, -k - p["K_s"] / p["J_l"], b, 0]]


def B(p):
    return [[0], [0], [1 / p["J_eq"]], [-1 / p["J_eq"]]]


def J_l(p):
    return p["m_1"] * p["L_1"] ** 2 / 3 + p["m_2"] * (p["L_2"] ** 2 / 12 + p["d_12"] ** 2)


def own_lagrangian_gives(coordinate, force):
    """The equation of motion that the student's own Lagrangian leads to."""
    return lambda own, p: euler_lagrange(usable(own, "2.3", "L"), coordinate, p) - force(p)


def own_theta_ddot(own, p):
    return accelerations(usable(own, "2.4", "equation"), usable(own, "2.5", "equation"), p)[0]


def own_alpha_ddot(own, p):
    """By the link's own equation of motion, with the student's own acceleration of the servo if they gave one."""
    link = usable(own, "2.5", "equation")
    try:
        return link_acceleration(link, usable(own, "2.6", "theta_ddot"), p)
    except (LookupError, ZeroDivisionError):
        return accelerations(usable(own, "2.4", "equation"), link, p)[1]


def own_rows(inputs):
    """The matrix whose last rows are the slopes of the student's own accelerations."""
    first = [[0, 0, 1, 0], [0, 0, 0, 1]] if len(inputs) == 4 else [[0], [0]]
    return lambda own, p: (
        first + [[slope(usable(own, "2.6", f"{q}_ddot"), x, p) for x in inputs] for q in ("theta", "alpha")]
    )


ANGLES = STATE[:4]

PRELAB = {
    "2.1": {
        "V": ExpressionIs(
            V,
            slips={
                "look at the factor in front": lambda p: 2 * V(p),
                "the springs are bent by alpha, not by theta": lambda p: p["K_s"] * p["theta"] ** 2 / 2,
            },
        ),
    },
    "2.2": {
        "T": ExpressionIs(
            T,
            slips={
                "the link turns through theta + alpha in the room, not through alpha": lambda p: (
                    p["J_eq"] * p["theta_dot"] ** 2 / 2 + p["J_l"] * p["alpha_dot"] ** 2 / 2
                ),
                "look at the factor in front": lambda p: 2 * T(p),
            },
        ),
    },
    "2.3": {
        "L": ExpressionIs(
            lambda p: T(p) - V(p),
            follow=lambda own, p: value_at(usable(own, "2.2", "T"), p) - value_at(usable(own, "2.1", "V"), p),
            follow_what="T - V with your own T and V",
            slips={"this is the total energy": lambda p: T(p) + V(p)},
        ),
    },
    "2.4": {
        "strategy": ForAPerson(),
        "equation": EquationIs(
            servo_equation,
            others=(servo_alone,),
            follow=own_lagrangian_gives("theta", lambda p: p["tau"] - p["B_eq"] * p["theta_dot"]),
            follow_what="what your own Lagrangian leads to",
            slips={
                "look at the sign of the friction": lambda p: servo_equation(p) - 2 * p["B_eq"] * p["theta_dot"],
                "the friction is missing": lambda p: servo_equation(p) - p["B_eq"] * p["theta_dot"],
                "look at the sign of the torque": lambda p: servo_equation(p) + 2 * p["tau"],
            },
        ),
    },
    "2.5": {
        "strategy": ForAPerson(),
        "equation": EquationIs(
            link_equation,
            others=(link_without_theta_ddot,),
            follow=own_lagrangian_gives("alpha", lambda p: -p["B_l"] * p["alpha_dot"]),
            follow_what="what your own Lagrangian leads to",
            slips={
                "the link's damping goes with alpha_dot": lambda p: link_equation(p, "theta_dot"),
                "look at the sign of the spring's torque": lambda p: link_equation(p) - 2 * p["K_s"] * p["alpha"],
            },
        ),
    },
    "2.6": {
        "strategy": ForAPerson(),
        "theta_ddot": ExpressionIs(
            theta_ddot,
            follow=own_theta_ddot,
            follow_what="your own two equations of motion",
            slips={
                "look at the sign of the spring's torque": lambda p: (
                    theta_ddot(p) - 2 * p["K_s"] * p["alpha"] / p["J_eq"]
                ),
                "look at the sign of the friction": lambda p: (
                    theta_ddot(p) + 2 * p["B_eq"] * p["theta_dot"] / p["J_eq"]
                ),
            },
        ),
        "alpha_ddot": ExpressionIs(
            alpha_ddot,
            follow=own_alpha_ddot,
            follow_what="your own equations of motion",
            slips={
                "this is the acceleration of theta + alpha, of the link in the room": lambda p: (
                    -p["K_s"] * p["alpha"] / p["J_l"]
                ),
            },
        ),
    },
    "2.7": {
        "strategy": ForAPerson(),
        "A": SymbolicMatrixIs(A, follow=own_rows(ANGLES), follow_what="your own accelerations"),
        "B": SymbolicMatrixIs(B, follow=own_rows(("tau",)), follow_what="your own accelerations"),
    },
    "2.8": {
        "strategy": ForAPerson(),
        "J_l": ExpressionIs(
            J_l,
            slips={
                "the top arm is not on the pivot: mind the parallel-axis theorem": lambda p: (
                    p["m_1"] * p["L_1"] ** 2 / 3 + p["m_2"] * p["L_2"] ** 2 / 12
                ),
                "the bottom arm turns about its end": lambda p: J_l(p) - p["m_1"] * p["L_1"] ** 2 / 4,
                "the distance of the top arm is that of its middle": lambda p: J_l(p) + p["m_2"] * p["L_2"] ** 2 / 4,
            },
        ),
    },
}

# --- Section 2.3: on the bench --------------------------------------------------------------------------------------

STIFFNESS = {
    "2.9": {
        "sweep": RecordingOf(
            sweep,
            channel="alpha",
            rtol=tolerances.RECORDING,
            runs=True,
            slips={("drive", "position"): "The servo did not follow the sweep: it was sent to the motor as a voltage."},
        ),
        "figure": FigureFollows(sweep, own=("2.9", "sweep"), channel="alpha", quantity=ANGLE),
    },
    "2.10": {
        "spectrum": SpectrumFunction(rtol=tolerances.SPECTRUM),
        "figure": FigureOfSpectrum(sweep, own=("2.9", "sweep"), channel="alpha", frequency=FREQUENCY, band=(1.0, 5.0)),
    },
    "2.11": {
        # Many benches have their peak in the same bin: an equal omega_n says nothing by itself.
        "omega_n": NaturalFrequency(
            own_bench=OwnBench(lambda b: b.omega_n, tolerances.ALIKE["omega_n"], is_discriminating=False)
        ),
        "explanation": ForAPerson(),
    },
    "2.12": {
        "J_l": Number(
            what="the inertia of the link on your bench",
            expected=lambda bench: bench.J_l,
            rtol=tolerances.J_L,
            slips=inertia_slips,
            fewest_digits=tolerances.FEWEST_DIGITS,
            own_bench=OwnBench(lambda b: b.J_l, tolerances.ALIKE["J_l"]),
        ),
        "K_s": Stiffness(own_bench=OwnBench(lambda b: b.K_s, tolerances.ALIKE["K_s"])),
    },
}


def own_model(index):
    """A matrix of the model, from the student's own stiffness and inertia."""

    def follow(case):
        k, inertia = usable(case.own, "2.12", "K_s"), usable(case.own, "2.12", "J_l")
        p = {"K_s": k, "J_l": inertia, "J_eq": case.bench.servo.J_eq, "B_eq": case.bench.servo.B_eq}
        return np.array((A(p), B(p))[index])

    return follow


OWN_STIFFNESS = "the model that your own K_s and J_l give"


def own_function(name):
    """A matrix that the student's own function gives, with their own numbers."""
    return ("what your own function of question 2.13 gives", lambda case: from_own_function(case, name))


def sampled_B(case):
    """B of the right model from one sample to the next, with the sample time that the student's own A shows."""
    sample_time = float(np.real(logarithm(usable(case.own, "2.14", "A"))[0, 2]))
    A, B, *_outputs = Design(case.bench.servo, case.bench.joint, case.bench.K_s).torque_model
    return zero_order_hold(A, B, sample_time)[1]


def of_torque(case):
    """The poles of the student's own model as it is in 2.14."""
    return np.linalg.eigvals(usable(case.own, "2.14", "A"))


def with_motor(case):
    """The poles of the student's own model with the voltage as input."""
    return np.linalg.eigvals(own_voltage_model(case.own, case.bench.servo)[0])


#: To be compared with answers to question 2.17.
STEADY_SPEED = r"""When the servo turns steadily forward,

$$ a\,V_m-b\,\dot\theta = B_{eq}\,\dot\theta + F
\qquad\Longrightarrow\qquad
\dot\theta=\frac{a}{b+B_{eq}}\left(V_m-\frac{F}{a}\right) . $$

Viscous friction changes the **slope** of this line. So does the motor: a wrong slope can have two causes. Coulomb
friction **shifts** the line: the speed is smaller by the same amount at every voltage, and zero at $F/a$. Of the seven
causes, only Coulomb friction does this. If the speed backward differs from the forward one, the friction is not the
same in both directions."""

VALIDATION = {
    "2.13": {"state_space": StateSpaceFunction()},
    "2.14": {
        "A": ArrayFrom(
            "the matrix A",
            lambda d: d.torque_model[0],
            follow=((OWN_STIFFNESS, own_model(0)), own_function("A")),
            slips=(("its last row has the other sign", lambda a: np.vstack([a[:3], -a[3:]])),),
        ),
        "B": ArrayFrom(
            "the matrix B",
            lambda d: d.torque_model[1],
            follow=(own_function("B"),),
            slips=(("what pushes the servo forward leaves the link behind: a minus is missing", np.abs),),
            others=((DISCRETE, sampled_B),),
        ),
        "C": ArrayFrom(
            "the matrix C for the outputs theta and alpha",
            lambda d: d.torque_model[2],
            follow=(own_function("C"),),
            slips=(("its rows are swapped", lambda c: c[::-1]),),
        ),
        "D": ArrayFrom(
            "the matrix D for the outputs theta and alpha", lambda d: d.torque_model[3], follow=(own_function("D"),)
        ),
    },
    "2.15": {
        "validation": ResponseOf(validated_again, channels=("theta", "alpha"), model=("theta_model", "alpha_model")),
        "figure": FigureShows(
            validated_again,
            own=("2.15", "validation"),
            channels=("theta", "theta_model", "alpha", "alpha_model"),
            command="vm",
        ),
    },
    "2.16": {
        "comparison": ForAPerson(),
    },
    "2.17": {
        "reason": ForAPerson(compare=STEADY_SPEED),
    },
    "2.18": {
        "poles": PolesFrom(
            "the open-loop poles",
            lambda d: d.poles,
            follow=(("the poles of your own model with the motor", with_motor),),
            slips=(("they look like frequencies in Hz; they are in rad/s", lambda p: p * HZ),),
            others=(("they are those of the model with the torque as input, without the motor", of_torque),),
        ),
    },
}


TABLE_2 = {
    "Table 2": {
        "omega_n": NaturalFrequency(carried=OMEGA_N),
        "K_s": Stiffness(carried=K_S),
        **{
            name: ArrayFrom(
                f"the matrix {name}",
                lambda d, i=i: d.torque_model[i],
                follow=carried("2.14", name),
            )
            for i, name in enumerate("ABCD")
        },
        "poles": PolesFrom(
            "the open-loop poles",
            lambda d: d.poles,
            follow=carried("2.18", "poles"),
            others=(("they are those of the model with the torque as input, without the motor", of_torque),),
        ),
    },
}

MODELING = {**PRELAB, **STIFFNESS, **VALIDATION, **TABLE_2}
WARM_UP = {
    "0.1": {
        "resolution": Number(
            what="the encoder's resolution",
            expected=lambda bench: bench.servo.K_enc,
            rtol=tolerances.RESOLUTION,
            slips=lambda bench: {"these are degrees": bench.servo.K_enc / DEG},
        ),
    },
}
