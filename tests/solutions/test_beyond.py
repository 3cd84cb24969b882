"""Notebook 11: right answers in several ways have full marks, slips cost their own points, and others' numbers none."""

import re
from dataclasses import replace

import control
import numpy as np
import pytest
import scipy.optimize
import sympy
from beyond_answers import (
    BOTH,
    COUNT,
    POLES,
    SERVO_ONLY,
    B_eq,
    J_eq,
    J_l,
    K_s,
    Student,
    a,
    b,
    gamma_3,
    gamma_4,
    gamma_ddot,
    gamma_dot,
    peak,
    square,
    with_delay,
    zoh,
)
from remembered import remembered
from working_through import digits

from labcourse.answers import forms
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex import response, signals
from rotflex.course.questions import BEYOND, CATALOGUE
from rotflex.hil.controllers import ObserverFeedback, StateFeedback
from solutions.key import KEY
from solutions.true_bench import TrueBench

SOFT, STIFF, BETWEEN = "s0", "s5", "s17"  # emulation is lost at 30 ms, at 50 ms, and at one or the other
STUDENTS = (SOFT, STIFF, BETWEEN)
BENCHES = {name: TrueBench(name) for name in STUDENTS}
OFF = dict(zip(STUDENTS, (1.02, 0.98, 1.0), strict=True))  # the stiffness is as a sweep shows it
WORKED = {name: Student(name, BENCHES[name], OFF[name] * BENCHES[name].K_s) for name in STUDENTS}
MARKED = [(q.number, p.name) for q in BEYOND for p in q.parts if p.marked == "auto"]


@pytest.fixture(autouse=True, scope="module")
def runs_made_once():
    with remembered():
        yield


def stored(where, value):
    part = CATALOGUE.find(where[0]).part(where[1])
    return forms.decode(part, forms.encode(part, value, 7).content)


def verdict(name, where, value, own, virtual=True):
    known = {at: stored(at, one) for at, one in own.items()}
    case = Case(BENCHES[name], lambda question, part: known[question, part], 7, virtual)
    return KEY[where[0]][where[1]].verdict(CATALOGUE.find(where[0]).part(where[1]), stored(where, value), case)


def lost(name, answers, own):
    """The answers that do not have full marks, each with its reason."""
    found = {where: verdict(name, where, value, own) for where, value in answers.items()}
    return {where: one.reason for where, one in found.items() if one.share < 1}


@pytest.mark.parametrize("name", STUDENTS)
def test_right_answers_have_full_marks(name):
    student = WORKED[name]
    assert set(student.answers) == set(MARKED)
    assert lost(name, student.answers, student.before | student.answers) == {}


def test_right_answers_have_full_marks_also_where_nothing_was_answered_before():
    assert OFF[BETWEEN] == 1.0
    assert lost(BETWEEN, WORKED[BETWEEN].answers, {}) == {}


# --- other ways -------------------------------------------------------------------------------------------------------


class OwnObserver:
    """An observer of a student's own, with names of their own, and lists for matrices."""

    def __init__(self, Phi, Gamma, L, K):
        self.model, self.gains, self.expected = (Phi, Gamma), (L, K), None

    def reset(self):
        self.expected = None

    def __call__(self, reference, theta, alpha):
        (Phi, Gamma), (L, K) = self.model, self.gains
        if self.expected is None:
            self.expected = np.zeros(len(Phi))
            self.expected[0] = theta
        now = self.expected + L[:, 0] * (theta - self.expected[0])
        volts = min(max(float(K[0, 0] * (reference - now[0]) - K[0, 1:] @ now[1:]), -10.0), 10.0)
        self.expected = Phi @ now + Gamma[:, 0] * volts
        return volts


def observing(student, controller):
    """Answers to 4.4 with a controller."""
    run = student.run(controller, square(0.002))
    swings = np.rad2deg(response.swing(run))
    return {
        ("4.4", "response"): run,
        ("4.4", "noise_observer"): float(f"{response.voltage_noise(run):.2g}"),
        ("4.4", "swing_deg"): round(swings, 2),
    }


def noise_of_all_turns(student):
    """With the half turn at the start."""
    run = student.run(StateFeedback(student.K), square(0.002))
    turns = np.arange(0, 10, 0.5 / 0.33)
    parts = [np.diff(run["vm"][(run.time >= t + 0.2) & (run.time < t + 0.5 / 0.33)]) for t in turns]
    return np.sqrt(np.mean(np.concatenate(parts) ** 2))


def of_other_noise(student, own):
    """The run at 30 ms; the motor's noise passes through the delay as the voltage does."""
    Phi, Gamma, _, K = student.sampled(0.03)
    torque = np.array([[0], [0], [0], [1 / student.bench.J_l]])
    effect = zoh(student.model[0], torque, 0.03)[1]
    Q = 0.01 * Gamma @ Gamma.T
    Q[:4, :4] += 0.005**2 * effect @ effect.T
    C, R = np.eye(1, 5), np.array([[COUNT**2 / 12]])
    P = control.dlqe(Phi, np.eye(5), C, Q, R)[1]
    L = P @ C.T / (C @ P @ C.T + R)
    controller = OwnObserver(Phi, Gamma, L, K) if own else ObserverFeedback(Phi, Gamma, L, digits(3)(K), 0.03)
    return student.run(controller, square(0.03), 0.03)


def of_both(student):
    """The run at 30 ms with both encoders."""
    Phi, Gamma, _, K = student.sampled(0.03)
    L = student.filter_gain(Phi, np.eye(2, 5), 0.03)
    return student.run(ObserverFeedback(Phi, Gamma, L, K, 0.03), square(0.03), 0.03)


def turning(run):
    return {("4.10", "response"): run, ("4.10", "swing_deg"): np.rad2deg(response.swing(run))}


WAYS = {
    "4.2 with both ends, two digits": lambda s: {
        ("4.2", "deviation_servo"): digits(2)(s.deviation(SERVO_ONLY, range(51))),
        ("4.2", "deviation_both"): digits(2)(s.deviation(BOTH, range(51))),
    },
    "4.3 to three digits": lambda s: {("4.3", "L"): digits(3)(s.L).ravel()},
    "4.4 with an observer of one's own": lambda s: (
        observing(s, OwnObserver(*zoh(*s.model, 0.002), s.L, s.K))
        | {("4.4", "noise_derivatives"): noise_of_all_turns(s)}
    ),
    "4.4 with both encoders": lambda s: observing(s, s.controller(BOTH)),
    "4.4 rounded": lambda s: observing(
        s, ObserverFeedback(*zoh(*s.model, 0.002), digits(3)(s.L), digits(3)(s.K), 0.002)
    ),
    "4.6 by Ackermann, with other noise": lambda s: {
        ("4.6", "K"): digits(3)(control.acker(*s.sampled(0.03)[:2], [*np.exp(POLES * 0.03), 0])),
        ("4.6", "response"): of_other_noise(s, own=False),
    },
    "4.6 with an observer of one's own": lambda s: {("4.6", "response"): of_other_noise(s, own=True)},
    "4.7 off a plot": lambda s: {("4.7", "limit_ms"): round(2 * s.limit_ms()) / 2},
    "4.8 on a coarse grid": lambda s: {
        ("4.8", name): digits(2)(peak(loop, 0.02, 300))
        for name, loop in zip(("peak_emulated", "peak_sampled"), s.loops(), strict=True)
    },
    "4.10 with friction, three digits": lambda s: {
        ("4.10", "alpha_max_deg"): digits(3)(s.answers["4.10", "alpha_max_deg"]),
        ("4.10", "V_max"): digits(3)(s.answers["4.10", "V_max"] + 0.07),
        **turning(s.turned(friction=0.0)),
    },
    "4.10 by a polynomial of degree 11": lambda s: turning(s.turned(power=5)),
    "4.10 with a longer rest": lambda s: turning(s.turned(start=1.0)),
    "4.6 with both encoders": lambda s: {("4.6", "response"): of_both(s)},
}


@pytest.mark.parametrize(("way", "name"), [(way, STUDENTS[i % len(STUDENTS)]) for i, way in enumerate(WAYS)])
def test_another_way_has_full_marks(way, name):
    student = WORKED[name]
    answers = WAYS[way](student)
    assert lost(name, answers, student.before | student.answers | answers) == {}


# --- slips ------------------------------------------------------------------------------------------------------------


def predictor(s):
    return zoh(*s.model, 0.002)[0] @ s.L


def exchanged(s, h=0.03):
    """Phi and Gamma with what the last and the new voltage do exchanged."""
    Phi, Gamma = with_delay(*s.model, h, 0.002)
    Phi[:4, 4:], Gamma[:4] = Gamma[:4].copy(), Phi[:4, 4:].copy()
    return Phi, Gamma


def without_delay(s):
    return with_delay(*s.model, 0.03, 0.03 * 1e-9)


def poles_in_s(s):
    return control.place(*s.sampled(0.03)[:2], [*POLES, 0])


def five_from_four(s):
    return np.append(control.place(*zoh(*s.model, 0.03), np.exp(POLES * 0.03)), 0)


def stepped(s):
    """A step in place of the plan."""
    return s.run(StateFeedback(s.K), signals.step(signals.time_axis(2.5, 0.002), np.deg2rad(40), 0.5))


def ramp(degrees, seconds):
    """A command that rises so far, in so long."""
    rise = np.clip((signals.time_axis(3.0, 0.002) - 0.5) / seconds, 0, 1)
    return lambda s: s.run(StateFeedback(s.K), np.deg2rad(degrees) * rise)


def volts(s):
    return s.answers["4.9", "V_m"]


#: (question, part) → what is given in place of the right answer, and what the reason must say.
SLIPS = {
    "a rank of 4 for the link": (("4.1", "rank_link"), lambda s: 4, "rank"),
    "no twelfth": (("4.2", "deviation_servo"), lambda s: np.sqrt(12) * s.deviation(SERVO_ONLY), "divided by 12"),
    "radians": (("4.2", "deviation_both"), lambda s: np.deg2rad(s.deviation(BOTH)), "rad/s"),
    "the other encoders": (("4.2", "deviation_servo"), lambda s: s.deviation(BOTH), "other encoders"),
    "the predictor's gain": (("4.3", "L"), predictor, "predictor"),
    "the resolution in degrees": (
        ("4.3", "L"),
        lambda s: replace(s, count=np.rad2deg(COUNT)).L,
        "degrees where the model has radians",
    ),
    "the derivatives": (("4.4", "response"), lambda s: s.run(StateFeedback(s.K), square(0.002)), "33 Hz"),
    "all deflections": (
        ("4.4", "swing_deg"),
        lambda s: np.rad2deg(np.abs(s.answers["4.4", "response"]["alpha"]).max()),
        "later than 0.5 s",
    ),
    "Phi with the new voltage": (("4.5", "Phi"), lambda s: exchanged(s)[0], "exchanged"),
    "Gamma of the last voltage": (("4.5", "Gamma"), lambda s: exchanged(s)[1], "exchanged"),
    "no delay": (("4.5", "Phi"), lambda s: without_delay(s)[0], "delay is missing"),
    "poles in s": (("4.6", "K"), poles_in_s, "in s"),
    "no pole for the delay": (("4.6", "K"), five_from_four, "without delay"),
    "a limit without delay": (("4.7", "limit_ms"), lambda s: s.limit_ms(1e-9), "delay of 2 ms is missing"),
    "decibels": (("4.8", "peak_emulated"), lambda s: 20 * np.log10(s.answers["4.8", "peak_emulated"]), "dB"),
    "the sign of alpha": (("4.9", "alpha"), lambda s: J_l / K_s * gamma_ddot, "sign"),
    "no friction": (("4.9", "V_m"), lambda s: volts(s).subs(B_eq, 0), "B_eq is missing"),
    "derivatives confused": (
        ("4.9", "V_m"),
        lambda s: volts(s).subs({gamma_3: gamma_4, gamma_4: gamma_3}, simultaneous=True),
        "exchanged",
    ),
    "a plan in radians": (
        ("4.10", "alpha_max_deg"),
        lambda s: np.deg2rad(s.answers["4.10", "alpha_max_deg"]),
        "wanted is deg",
    ),
    "a step": (("4.10", "response"), stepped, "bends much more"),
    "too short a turn": (("4.10", "response"), ramp(25, 0.5), "by 40 deg"),
    "a slow turn": (("4.10", "response"), ramp(40, 2.0), "much longer"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_costs_its_own_points_and_the_reason_teaches(slip):
    """All that comes after it is right, whatever the student has there."""
    student = WORKED[SOFT]
    where, change, told = SLIPS[slip]
    own = student.before | student.answers | {where: change(student)}
    after = {at: value for at, value in student.answers.items() if at[0] >= where[0] and at != where}
    assert lost(SOFT, after, own) == {}
    found = verdict(SOFT, where, own[where], own)
    assert found.status is Status.WRONG and re.search(told, found.reason), found.reason


def carried(**changed):
    """A student who goes on with a slip: what they have is worked out from it."""
    student = Student(SOFT, BENCHES[SOFT], BENCHES[SOFT].K_s)
    vars(student).update(changed)
    return student


def growth(s, h, plant):
    """Largest pole in z of the emulated loop, less 1, for other Phi and Gamma."""
    controller = StateFeedback(s.K, sample_time=h, cutoff=1 / h).system()
    loop = control.feedback(control.ss(*plant, np.eye(2, 5), 0, h), controller, sign=1)
    return np.abs(loop.poles()).max() - 1


def with_L(s):
    """The predictor's gain, at 2, 30 and 20 ms."""
    slipped = carried(L=predictor(s))
    after = observing(slipped, slipped.controller())
    for h, where in ((0.03, ("4.6", "response")), (0.02, ("4.8", "peak_sampled"))):
        Phi, Gamma, L, K = s.sampled(h)
        controller = ObserverFeedback(Phi, Gamma, Phi @ L, K, h)
        plant = control.ss(Phi, Gamma, np.eye(2, 5), 0, h)
        after[where] = peak(-controller.system() * plant, h) if h == 0.02 else s.run(controller, square(h), h)
    return {("4.3", "L"): slipped.L}, after


def with_Phi(s):
    Phi, Gamma = exchanged(s)
    K = control.place(Phi, Gamma, [*np.exp(POLES * 0.03), 0])
    L = s.filter_gain(Phi, np.eye(1, 5), 0.03)
    run = s.run(ObserverFeedback(Phi, Gamma, L, K, 0.03), square(0.03), 0.03)
    limit = 1e3 * scipy.optimize.brentq(lambda h: growth(s, h, exchanged(s, h)), 0.01, 0.09)
    after = {("4.5", "Gamma"): Gamma, ("4.6", "K"): K, ("4.6", "response"): run, ("4.7", "limit_ms"): limit}
    return {("4.5", "Phi"): Phi}, after


def with_alpha(s):
    """The sign of alpha goes on into the voltage and the plan."""
    c = -J_l / K_s
    torque = J_eq * (gamma_ddot + c * gamma_4) + B_eq * (gamma_dot + c * gamma_3) - K_s * J_l / K_s * gamma_ddot
    V = (torque + b * (gamma_dot + c * gamma_3)) / a
    servo = s.bench.servo
    known = {J_eq: servo.J_eq, B_eq: servo.B_eq, J_l: s.bench.J_l, K_s: s.K_s}
    known |= {a: servo.torque_per_volt, b: servo.back_emf_damping}
    largest = np.abs(
        sympy.lambdify((gamma_dot, gamma_ddot, gamma_3, gamma_4), V.subs(known))(
            *s.gamma(signals.time_axis(2.5, 0.002))[1:]
        )
    ).max()
    return {("4.9", "alpha"): -c * gamma_ddot}, {("4.9", "V_m"): V, ("4.10", "V_max"): largest}


def with_gain(s):
    """A gain for other poles than those of 3.4."""
    slipped = carried(K=np.asarray(control.place(*s.model, [-10 + 8j, -10 - 8j, -25, -35])))
    return {("3.8", "K"): slipped.K}, {
        at: value for at, value in slipped.answers.items() if at[0] in ("4.4", "4.7", "4.8")
    }


CARRIED = (with_L, with_Phi, with_alpha, with_gain)


@pytest.mark.parametrize("slip", CARRIED)
@pytest.mark.scheduled
def test_what_follows_from_a_slip_has_full_marks(slip):
    student = Student(SOFT, BENCHES[SOFT], BENCHES[SOFT].K_s)
    own, after = slip(student)
    assert lost(SOFT, after, student.before | student.answers | own | after) == {}


def test_peaks_and_ranks_decide_what_is_chosen():
    own = {("4.8", "peak_emulated"): 1.4, ("4.8", "peak_sampled"): 6.9}
    assert verdict(SOFT, ("4.8", "forgives"), "emulated", own).status is Status.FOLLOW_THROUGH
    assert verdict(SOFT, ("4.8", "forgives"), "emulated", {}).status is Status.WRONG
    own = {("4.1", "rank_servo"): 3, ("4.1", "rank_link"): 3}
    assert verdict(SOFT, ("4.1", "spare"), "neither", own).status is Status.FOLLOW_THROUGH
    assert verdict(SOFT, ("4.1", "spare"), "servo", own).status is Status.WRONG


# --- what is not one's own, and what is odd ---------------------------------------------------------------------------

OF_THE_BENCH = ["4.3 L", "4.4 response", "4.4 noise_derivatives", "4.5 Phi", "4.5 Gamma", "4.6 K", "4.6 response"]
OF_THE_BENCH += ["4.7 limit_ms", "4.8 peak_emulated", "4.10 alpha_max_deg", "4.10 response"]


@pytest.mark.parametrize("where", OF_THE_BENCH)
def test_the_answer_of_another_bench_is_wrong(where):
    where = tuple(where.split())
    own = WORKED[SOFT].before | WORKED[SOFT].answers | {where: WORKED[STIFF].answers[where]}
    assert verdict(SOFT, where, own[where], own).status is Status.WRONG


NUMBERS = [at for at in MARKED if CATALOGUE.find(at[0]).part(at[1]).kind in ("number", "matrix") and at[0] != "4.4"]


def test_zeros_are_wrong_and_nothing_follows_from_them():
    nothing = {at: 0 * np.asarray(WORKED[SOFT].answers[at]) for at in NUMBERS if at[1] != "swing_deg"}
    assert [at for at, value in nothing.items() if verdict(SOFT, at, value, nothing).share > 0] == []


@pytest.mark.parametrize("K", [-1.0, 1e-3], ids=["stops the bench", "does not follow"])
def test_with_a_gain_that_is_of_no_use_the_spare_one_counts(K):
    student = carried(K=np.array([[18.2356, -17.1547, 1.5893, 0.6327]]))
    own = student.before | {("3.8", "K"): K * WORKED[SOFT].K}
    after = {("4.7", "limit_ms"): student.limit_ms(), ("4.10", "response"): student.turned()}
    assert lost(SOFT, after, own) == {}


def test_a_stiffness_beyond_all_measure_breaks_nothing():
    own = {("2.12", "K_s"): 1e12, ("2.12", "J_l"): BENCHES[SOFT].J_l}
    with np.errstate(all="ignore"):
        for where in (("4.2", "deviation_servo"), ("4.3", "L"), ("4.5", "Phi"), ("4.6", "K"), ("4.8", "peak_sampled")):
            assert verdict(SOFT, where, 1.5 * WORKED[SOFT].answers[where], own).status is Status.WRONG, where


def test_what_was_measured_at_an_unknown_bench_is_for_a_person():
    for where in [at for at in MARKED if at[1] in ("response", "lost_ms", "swing_deg")]:
        found = verdict(SOFT, where, WORKED[SOFT].answers[where], {}, virtual=False)
        assert found.status is Status.FOR_A_PERSON, where
