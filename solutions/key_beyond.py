"""How the answers of notebook 11 are marked. Part of ``key.py``, which has the policy."""

from functools import partial

import numpy as np

from labcourse.grading.marking.checks import ChoiceIs, ForAPerson, Number
from labcourse.grading.marking.expression_checks import ExpressionIs, value_at
from rotflex import design, observers, sampled
from rotflex.config import srv02
from rotflex.units import DEG

from . import tolerances
from .beyond_checks import (
    HELD,
    OBSERVERS,
    PLANTS,
    InUnits,
    LostAt,
    NumberFrom,
    TurnOf,
    along_square,
    by_models,
    derivatives,
    deviation,
    gains,
    kalman,
    largest_by_own,
    limit_ms,
    observed,
    observed_by_either,
    own_observer,
    own_plant,
    own_poles,
    peak_emulated,
    peak_sampled,
    planned,
    plant_in_z,
    sampled_design,
    turned,
    with_own_recording,
)
from .motion import slope
from .own_answers import usable
from .own_model import own_voltage_model
from .response_checks import Measured, ResponseOf
from .wanted import desired_poles

CHANNELS = ("theta", "alpha", "vm")
MODEL = "your own model"
LOOP = "your own model and gain"
WISH = "your own model and desired poles"


def gain(place):
    """The student's own gain, or the second with which the notebook may go on."""
    return lambda case: gains(case)[place]


def inertia(case):
    return case.bench.J_l


# --- observers --------------------------------------------------------------------------------------------------------


def own_rank(encoder):
    """The rank with one encoder (a row of C) and the student's own model."""
    return lambda own: float(observers.observability(own_voltage_model(own, srv02())[0], np.eye(4)[encoder]).rank)


def own_spare(own, bench):
    """Which encoder is spare by the student's own ranks."""
    if own("4.1", "rank_servo") >= 4:
        return "link"
    return "servo" if own("4.1", "rank_link") >= 4 else "neither"


def rank(encoder, expected):
    return Number(
        f"the rank with the {('servo', 'link')[encoder]}'s encoder alone",
        lambda bench: expected,
        1e-6,
        follow=own_rank(encoder),
        follow_what="the observability matrix of your own model",
        follow_rtol=1e-6,
    )


def rate_known(what, encoders):
    other = 3 - encoders
    return NumberFrom(
        f"the deviation with {what}",
        lambda d: deviation(*d.voltage_model, encoders),
        rtol=tolerances.DEVIATION,
        follow=by_models(MODEL, partial(deviation, encoders=encoders)),
        slips=(
            ("the variance of rounding is the resolution squared, divided by 12", lambda x: x * np.sqrt(12)),
            ("it is in rad/s", lambda x: x * DEG),
            ("an integral over time is a sum of samples times the sample time", lambda x: x / np.sqrt(0.002)),
            ("an integral over time is a sum of samples times the sample time", lambda x: x * np.sqrt(0.002)),
            ("it is the variance; take its square root, then change to degrees", lambda x: (x * DEG) ** 2 / DEG),
        ),
        others=(
            *by_models("it is that with the other encoders", partial(deviation, encoders=other)),
            *by_models("it is that of the deflection, not of its rate", partial(deviation, encoders=encoders, state=1)),
        ),
    )


def of_both(A, B, J_l):
    return kalman(A, B, J_l, servo_only=False)[:, :1]


SENSORS = {
    "4.1": {
        "rank_servo": rank(0, 4.0),
        "rank_link": rank(1, 3.0),
        "spare": ChoiceIs(
            "link",
            "The servo's encoder alone gives full rank; the link's alone does not see where the servo stands.",
            follow=own_spare,
            follow_what="your own ranks",
        ),
    },
    "4.2": {
        "deviation_servo": rate_known("the servo's encoder alone", 1),
        "deviation_both": rate_known("both encoders", 2),
        "explanation": ForAPerson(),
    },
    "4.3": {
        "L": InUnits(
            "Kalman's gain",
            lambda d: kalman(*d.voltage_model, d.joint.J_l),
            follow=by_models(MODEL, kalman, inertia),
            others=(
                *(pair for words, slip in OBSERVERS.items() for pair in by_models(words, slip, inertia)),
                *by_models("it is a column of the gain for both encoders", of_both, inertia),
            ),
        ),
    },
    "4.4": {
        "response": ResponseOf(
            along_square(observed_by_either),
            CHANNELS,
            rtol=tolerances.OBSERVED,
            slips={
                "the rates are the 33 Hz derivatives, not the observer's": along_square(derivatives),
            },
        ),
        "noise_derivatives": Measured("noise", along_square(derivatives), ("4.4", "response"), rtol=tolerances.NOISE),
        "noise_observer": Measured(
            "noise",
            along_square(observed),
            ("4.4", "response"),
            rtol=tolerances.NOISE,
            slips=(along_square(partial(observed, servo_only=False)),),
        ),
        "swing_deg": Measured(
            "swing_deg", with_own_recording("4.4", along_square(observed)), ("4.4", "response"), **tolerances.SWING
        ),
    },
}

# --- sampled design ---------------------------------------------------------------------------------------------------


UNDELAYED = PLANTS["the delay is missing"]


def Phi(A, B, build=plant_in_z):
    return build(A, B, HELD).A


def Gamma(A, B, build=plant_in_z):
    return build(A, B, HELD).B


def rest_of_own_Phi(A, B, own_Phi):
    """The hold over the whole sample, without what the student's own Phi has for the last voltage."""
    return np.vstack([sampled.sample(A, B, HELD).B - own_Phi[:4, 4:], [[1.0]]])


def sampled_slips(function):
    """Usual slips, and the model with the torque as input."""
    by_torque = "it is for the model with the torque as input"
    return (
        *(pair for words, build in PLANTS.items() for pair in by_models(words, partial(function, build=build))),
        *by_models("it is for a sample time of 2 ms", partial(function, build=lambda A, B, h: UNDELAYED(A, B, 0.002))),
        (by_torque, lambda case: function(usable(case.own, "2.14", "A"), usable(case.own, "2.14", "B"))),
    )


def place(A, B, poles):
    return design.gain_by_place(A, B, poles)


def sampled_gain(A, B, poles):
    return sampled.gain_by_place(plant_in_z(A, B, HELD), poles)


def by_own_plant(case):
    """The gain for the student's own Phi and Gamma."""
    poles = np.append(np.exp(own_poles(case) * HELD), 0)
    return place(usable(case.own, "4.5", "Phi"), usable(case.own, "4.5", "Gamma"), poles)


def poles_in_s(A, B, poles):
    return place(Phi(A, B), Gamma(A, B), np.append(poles, 0))


def other_sample_time(A, B, poles):
    return place(Phi(A, B), Gamma(A, B), np.append(np.exp(poles * 0.002), 0))


def without_delay(A, B, poles):
    plant = sampled.sample(A, B, HELD)
    return np.append(sampled.gain_by_place(plant, poles), 0)


def continuous(case):
    """The gain of 3.8 with a zero for the last voltage."""
    return np.append(gains(case)[0], 0)


def by_own_loop(function):
    """With the student's own gain, or that of the workbook where the notebook goes on with it; and their own plant."""
    return (
        *by_models(LOOP, function, gain(0)),
        *by_models("the gain of the workbook", function, gain(1)),
        *by_models("your own Phi, Gamma and gain", function, gain(0), own_plant),
    )


def more_forgiving(own, bench):
    return "emulated" if usable(own, "4.8", "peak_emulated") < usable(own, "4.8", "peak_sampled") else "sampled"


DECIBELS = (("it is in dB", lambda x: 20 * np.log10(x)),)

SAMPLED = {
    "4.5": {
        "Phi": InUnits(
            "the model from sample to sample",
            lambda d: Phi(*d.voltage_model),
            follow=by_models(MODEL, Phi),
            others=sampled_slips(Phi),
        ),
        "Gamma": InUnits(
            "the effect of the new voltage",
            lambda d: Gamma(*d.voltage_model),
            follow=(
                *by_models(MODEL, Gamma),
                *by_models("your own Phi", rest_of_own_Phi, lambda case: usable(case.own, "4.5", "Phi")),
            ),
            others=sampled_slips(Gamma),
        ),
    },
    "4.6": {
        "K": InUnits(
            "the gain for the poles in z",
            lambda d: sampled_gain(*d.voltage_model, desired_poles()),
            follow=(
                ("your own Phi and Gamma, and your own desired poles", by_own_plant),
                *by_models(WISH, sampled_gain, own_poles),
            ),
            slips=(("all its signs are turned round", np.negative),),
            others=(
                *by_models("the poles are in s; in z they are exp(s h)", poles_in_s, own_poles),
                *by_models("the poles are for a sample time of 2 ms", other_sample_time, own_poles),
                *by_models("it is for the model without delay, and 0 for the last voltage", without_delay, own_poles),
                ("it is the gain in continuous time, and 0 for the last voltage", continuous),
            ),
        ),
        "response": ResponseOf(along_square(sampled_design, HELD), CHANNELS, rtol=tolerances.OBSERVED),
    },
    "4.7": {
        "limit_ms": NumberFrom(
            "the longest stable sample time",
            lambda d: limit_ms(*d.voltage_model, d.K),
            rtol=tolerances.LIMIT,
            follow=by_own_loop(limit_ms),
            slips=(("it is in seconds", lambda x: x / 1e3),),
            others=by_models("the delay of 2 ms is missing", partial(limit_ms, plant_in_z=UNDELAYED), gain(0)),
        ),
        "lost_ms": LostAt(),
    },
    "4.8": {
        "peak_emulated": NumberFrom(
            "M_s of the emulated design",
            lambda d: peak_emulated(*d.voltage_model, d.K),
            rtol=tolerances.PEAK,
            follow=by_own_loop(peak_emulated),
            slips=DECIBELS,
            others=by_models("the delay of 2 ms is missing", partial(peak_emulated, plant_in_z=UNDELAYED), gain(0)),
        ),
        "peak_sampled": NumberFrom(
            "M_s of the sampled design",
            lambda d: peak_sampled(*d.voltage_model, d.joint.J_l, desired_poles()),
            rtol=tolerances.PEAK,
            follow=(
                *by_models(WISH, peak_sampled, inertia, own_poles),
                *by_models("your own Phi, Gamma and L", peak_sampled, inertia, own_poles, own_plant, own_observer),
            ),
            slips=DECIBELS,
        ),
        "forgives": ChoiceIs(
            "sampled",
            "Its sensitivity peak is the smaller one.",
            follow=more_forgiving,
            follow_what="your own sensitivity peaks",
        ),
    },
}

# --- feed-forward -----------------------------------------------------------------------------------------------------

RATES = ("gamma_dot", "gamma_ddot", "gamma_3", "gamma_4")


def alpha(p):
    return -p["J_l"] / p["K_s"] * p["gamma_ddot"]


def V_m(p, damping="B_eq", emf="b", sign=1.0, spring=1.0):
    """By the servo's equation of motion, with theta = gamma - alpha."""
    c = sign * p["J_l"] / p["K_s"]
    rate, acceleration = p["gamma_dot"] + c * p["gamma_3"], p["gamma_ddot"] + c * p["gamma_4"]
    friction = (p.get(damping, 0.0) + p.get(emf, 0.0)) * rate
    return (p["J_eq"] * acceleration + friction + spring * p["J_l"] * p["gamma_ddot"]) / p["a"]


def V_m_by_own_alpha(own, p):
    """With the student's own deflection, and its derivatives by those of gamma in it."""
    expression = usable(own, "4.9", "alpha")
    slopes = {name: slope(expression, name, p) for name in RATES}

    def derivative(order):
        return sum(s * p[RATES[RATES.index(name) + order]] for name, s in slopes.items() if s)

    rate, acceleration = p["gamma_dot"] - derivative(1), p["gamma_ddot"] - derivative(2)
    return (p["J_eq"] * acceleration + (p["B_eq"] + p["b"]) * rate - p["K_s"] * value_at(expression, p)) / p["a"]


def largest_planned(state):
    """The largest deflection of the planned turn in deg, or the largest voltage in V."""
    if state == "alpha":
        return lambda A, B: np.abs(planned(A, B).states[1]).max() / DEG
    return lambda A, B: np.abs(planned(A, B).volts).max()


def planned_largest(what, state, rtol, unit):
    largest = largest_planned(state)
    return NumberFrom(
        what,
        lambda d: largest(*d.voltage_model),
        rtol=rtol,
        follow=(
            ("your own expressions of question 4.9", lambda case: largest_by_own(case, state) / unit),
            *by_models(MODEL, largest),
        ),
        slips=(("it is in rad; wanted is deg", lambda x: x * DEG),) if unit == DEG else (),
    )


FEEDFORWARD = {
    "4.9": {
        "alpha": ExpressionIs(
            alpha,
            slips={
                "look at its sign": lambda p: -alpha(p),
                "the spring turns the link, so that J_l is its inertia": lambda p: alpha(p | {"J_l": p["J_eq"]}),
                "stiffness and inertia are exchanged": lambda p: alpha(p | {"J_l": p["K_s"], "K_s": p["J_l"]}),
                "look at the order of the derivative": lambda p: alpha(p | {"gamma_ddot": p["gamma_dot"]}),
            },
        ),
        "V_m": ExpressionIs(
            V_m,
            follow=V_m_by_own_alpha,
            follow_what="your own deflection",
            slips={
                "the friction B_eq is missing": lambda p: V_m(p, damping=""),
                "the motor's back-EMF, b, is missing": lambda p: V_m(p, emf=""),
                "look at the sign of alpha in theta = gamma - alpha": lambda p: V_m(p, sign=-1.0),
                "the spring's torque on the servo is missing": lambda p: V_m(p, spring=0.0),
                "look at the sign of the spring's torque": lambda p: V_m(p, spring=-1.0),
                "the third and the fourth derivative are exchanged": lambda p: V_m(
                    p | {"gamma_3": p["gamma_4"], "gamma_4": p["gamma_3"]}
                ),
                "the servo turns by gamma - alpha, not by gamma": lambda p: V_m(p, sign=0.0),
                "it is the torque; a turns volts into it": lambda p: V_m(p) * p["a"],
            },
        ),
    },
    "4.10": {
        "alpha_max_deg": planned_largest("the largest planned deflection", "alpha", tolerances.PLAN["deflection"], DEG),
        "V_max": planned_largest("the largest planned voltage", "V_m", tolerances.PLAN["volts"], 1.0),
        "response": TurnOf(turned, CHANNELS, rtol=tolerances.OBSERVED),
        "swing_deg": Measured(
            "swing_deg", with_own_recording("4.10", turned), ("4.10", "response"), **tolerances.SWING
        ),
    },
    "4.11": {"conclusion": ForAPerson()},
}

BEYOND = {**SENSORS, **SAMPLED, **FEEDFORWARD}
