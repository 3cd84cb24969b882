"""The catalogue of this course: the workbook's questions, its results tables, and the items of its reports. Public.

Numbers, sections and outcome codes are the workbook's; titles and prompts are ours. Question 3.8 has no code there, and
so none here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

from labcourse.answers import parts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.json_values import FormError
from labcourse.answers.parts import (
    YES_NO,
    Part,
    Question,
    ReportItem,
    Usual,
    choice,
    expression,
    figure,
    function,
    matrix,
    number,
    poles,
    prose,
)
from rotflex.course.predictions import PREDICTIONS
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.errors import RecordingError
from rotflex.recording import PUSHED, UNITS, Recording
from rotflex.specifications import SETTLING_BAND

OUTCOMES = {
    "A-1": "has a strategy to solve the problem",
    "A-2": "performs the calculations",
    "A-3": "explains the results",
    "B-5": "follows the procedure",
    "B-6": "documents the data",
    "B-7": "uses appropriate analysis",
    "B-8": "accounts for uncertainty",
    "B-9": "interprets the results against the hypothesis",
    "K-1": "uses software for analysis",
    "K-2": "uses software to present data",
    "K-3": "uses software to simulate",
    "GS-1": "content and organisation of the report",
    "GS-2": "professional appearance",
}


def _pushed(given: Recording) -> str | None:
    """Return that a recording cannot be an answer, as a hand pushed the arm; None if none did."""
    if PUSHED not in given.channels or not (torque := given[PUSHED]).any():
        return None
    largest = int(abs(torque).argmax())
    return (
        f"this recording has a push of your hand in it, {torque[largest]:.2g} N·m at {given.time[largest]:.2f} s: "
        "record it again without touching the arm"
    )


def _read(given: Any) -> Any:
    """Return a time response of python-control as a recording, and anything else as it is.

    Raises
    ------
    FormError
        If a signal of the response is no channel of a recording.
    """
    if not hasattr(given, "output_labels"):
        return given
    try:
        return Recording.of_response(given)
    except RecordingError as error:
        raise FormError(f"{error} Name the signals of the system: control.ss(..., inputs=..., outputs=...)") from None


recording = partial(parts.recording, units=UNITS, unfit=_pushed, read=_read)


# Both take a heading, and return a function of what stands below it: _asked("2.13", "The model in code")(part, ...).


def _section(section: str, notebook: str) -> Callable[..., tuple[Question, ...]]:
    """Begin a section of the workbook, and its notebook; its questions follow."""
    return lambda *questions: tuple(replace(question, section=section, notebook=notebook) for question in questions)


def _asked(number: str, title: str, codes: str = "") -> Callable[..., Question]:
    """Begin a question; its parts follow. Its codes, in the workbook's order, are those of the parts unless given."""

    def question(*asked: Part) -> Question:
        outcomes = codes.split() or [part.outcome for part in asked if part.outcome]
        return Question(number, "", "", title, tuple(dict.fromkeys(outcomes)), asked)

    return question


# --- Section 2: the model, the stiffness, the validation --------------------------------------------------------------

_PARAMETERS = ("J_eq", "J_l", "B_eq", "B_l", "K_s")
_STATE = ("theta", "alpha", "theta_dot", "alpha_dot")
_ENERGY = (*_STATE, *_PARAMETERS)
_MOTION = (*_STATE, "theta_ddot", "alpha_ddot", "tau", *_PARAMETERS)
_UNDAMPED_LINK = ("J_eq", "J_l", "B_eq", "K_s")
_ACCELERATION = (*_STATE, "tau", *_UNDAMPED_LINK)
_DDOT = "The acceleration of the {}, from angles, rates and torque; without damping of the link."
_MISLEADS = (
    "Drive the motor with the sweep as a voltage instead, and the peak of alpha is somewhere else. Why does it mislead?"
)
_SPECTRUM = (
    "spectrum(x, dt) -> (f_hz, amplitude): the single-sided amplitude spectrum of samples x taken every dt seconds. A "
    "sine of amplitude 1 on a bin shows as 1."
)
_STATE_SPACE = (
    "state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D): your model with the torque as input and the two angles as "
    "outputs."
)
_RESOLUTION = "By what angle of the load shaft do two neighbouring encoder counts differ?"

WARM_UP = _section("4", "00_start")(
    _asked("0.1", "Resolution of the encoder")(number("resolution", "rad", (2e-4, 1e-2), "", _RESOLUTION, points=0)),
)
MODELING = (
    *_section("2.2", "01_modeling_prelab")(
        _asked("2.1", "Potential energy")(
            expression("V", _ENERGY, "A-2", "The energy stored in the flexible joint when the link is deflected."),
        ),
        _asked("2.2", "Kinetic energy")(
            expression("T", _ENERGY, "A-2", "The kinetic energy of servo and link together."),
        ),
        _asked("2.3", "Lagrangian")(expression("L", _ENERGY, "A-2", "The Lagrangian of the system.", points=1)),
        _asked("2.4", "Equation of motion of the servo")(
            prose("strategy", "A-1", "How do you get from the Lagrangian to this equation of motion?"),
            Part(
                "equation",
                "equation",
                2,
                "The Euler-Lagrange equation of theta, with the torque tau (not the motor voltage) as its input.",
                "A-2",
                symbols=_MOTION,
            ),
        ),
        _asked("2.5", "Equation of motion of the link")(
            prose("strategy", "A-1", "What differs from the derivation for the servo, and what stays the same?"),
            Part("equation", "equation", 2, "The Euler-Lagrange equation of alpha.", "A-2", symbols=_MOTION),
        ),
        _asked("2.6", "Angular accelerations")(
            prose("strategy", "A-1", "How do you separate the two accelerations?"),
            expression("theta_ddot", _ACCELERATION, "A-2", _DDOT.format("servo angle"), points=1),
            expression("alpha_ddot", _ACCELERATION, "A-2", _DDOT.format("deflection"), points=1),
        ),
        _asked("2.7", "State-space matrices")(
            prose("strategy", "A-1", "How do the accelerations become rows of A and B?"),
            Part(
                "A",
                "symbolic_matrix",
                2,
                "A, for the state [theta, alpha, theta_dot, alpha_dot].",
                "A-2",
                shape=(4, 4),
                symbols=_UNDAMPED_LINK,
            ),
            Part("B", "symbolic_matrix", 1, "B, for the torque as input.", "A-2", shape=(4, 1), symbols=_UNDAMPED_LINK),
        ),
        _asked("2.8", "Inertia of the link")(
            prose("strategy", "A-1", "Which theorems give the inertia of two arms about one pivot?"),
            expression(
                "J_l",
                ("m_1", "L_1", "m_2", "L_2", "d_12"),
                "A-2",
                "The inertia of the whole link about the pivot, from masses, lengths and the place of the top arm.",
            ),
        ),
    ),
    *_section("2.3.1", "02_finding_stiffness")(
        _asked("2.9", "Response to the sweep")(
            recording(
                "sweep",
                {"experiment": "sweep"},
                ("alpha",),
                "B-5",
                "A recording of the sweep from 1 Hz to 5 Hz.",
                usual=Usual(settings=(("drive", "position"),)),
            ),
            figure("figure", "K-2", "The deflection of the link over time."),
        ),
        _asked("2.10", "Amplitude spectrum")(
            function("spectrum", COMPOUND_SINES, "K-3", _SPECTRUM),
            figure("figure", "K-3", "The spectrum of the deflection, up to 10 Hz."),
        ),
        _asked("2.11", "Natural frequency")(
            number("omega_n", "rad/s", (8.0, 60.0), "B-7", "The natural frequency of the link.", points=2),
            prose("explanation", "B-7", _MISLEADS),
        ),
        _asked("2.12", "Stiffness of the joint")(
            number(
                "J_l",
                "kg·m²",
                (0.0005, 0.02),
                "B-7",
                "The inertia of the link with the top arm as it is on your bench.",
            ),
            number("K_s", "N·m/rad", (0.2, 10.0), "B-7", "The stiffness of the joint.", points=2),
        ),
    ),
    *_section("2.3.2", "03_model_validation")(
        _asked("2.13", "The model in code")(function("state_space", PLANT_PARAMETERS, "K-3", _STATE_SPACE)),
        _asked("2.14", "The model in numbers")(
            matrix("A", (4, 4), "B-5", "A with your stiffness and inertia, torque as input."),
            matrix("B", (4, 1), "B-5", "B, torque as input.", points=0.5),
            replace(matrix("C", (2, 4), "B-5", "C, for the outputs theta and alpha.", 0.25), row_names=_STATE),
            replace(matrix("D", (2, 1), "B-5", "D.", 0.25), row_names=_STATE),
        ),
        _asked("2.15", "Model and bench side by side")(
            recording(
                "validation",
                {"experiment": "validation"},
                ("theta", "alpha", "theta_model", "alpha_model"),
                "B-5",
                "A recording of the bench and your model under the same input.",
            ),
            figure("figure", "K-2", "Both angles over time, measured and modeled."),
        ),
        _asked("2.16", "How good is the model?")(
            prose("comparison", "B-9", "Where does the model follow the bench, and where does it not?", points=2),
        ),
        _asked("2.17", "Why is it not perfect?")(
            prose("reason", "B-8", "At least one thing that the bench does and the model leaves out.", points=2),
        ),
        _asked("2.18", "Open-loop poles")(
            poles("poles", 4, "K-1", "The poles of the model with the motor voltage as input.", points=2),
        ),
    ),
)


# --- Section 3: pole placement, simulation, full and partial state feedback -------------------------------------------

#: On the benches that are drawn, the largest entry of the right gain is 10 to 24 V/rad; per degree, it is below 0.5.
_GAIN = Usual(largest=(5.0, 60.0), unit="V/rad", digits=3)
_POLYNOMIAL = "The {} characteristic polynomial: its coefficients, highest power of s first."
_FOLLOWING = figure("figure", "K-3", "Servo angle with its reference, deflection and voltage over time.")


def _response(prompt: str, **settings: str) -> Part:
    return recording("response", settings, ("theta_ref", "theta", "alpha", "vm"), "B-5", prompt)


def _specifications(angle: str) -> tuple[Part, ...]:
    """What is measured on a closed-loop response and compared with the specifications of Section 3.1."""
    band = f"{100 * SETTLING_BAND:g} %"
    return (
        number("t_s", "s", (0.02, 3.0), "K-1", f"Settling time of {angle} (to {band} of the final angle)."),
        number("PO", "%", (0.0, 100.0), "K-1", f"Overshoot of {angle}, in per cent of the step."),
        number("alpha_max_deg", "deg", (2.0, 60.0), "K-1", "The largest deflection of the link."),
        number("V_max", "V", (0.5, 24.0), "K-1", "The largest motor voltage."),
        choice("satisfied", YES_NO, "B-9", "Are all four specifications of Section 3.1 met?"),
        prose("conclusion", "B-9", "Which specification is met or missed by how much, and is that what you expected?"),
    )


CONTROL = (
    *_section("3.3", "05_control_prelab")(
        _asked("3.1", "Stability")(
            choice(
                "stability",
                ("stable", "marginally stable", "unstable"),
                "A-1",
                "What do the open-loop poles make of the system?",
            ),
            prose("explanation", "A-3", "Does that agree with how the bench behaved?"),
        ),
        _asked("3.2", "Characteristic polynomial")(
            prose("strategy", "A-1", "How do poles and characteristic equation belong together?"),
            matrix("polynomial", (5,), "A-2", _POLYNOMIAL.format("open-loop"), points=2),
        ),
        _asked("3.3", "Companion form")(
            matrix("A_c", (4, 4), "A-2", "The companion matrix of A."),
            matrix("B_c", (4, 1), "A-2", "The companion matrix of B."),
        ),
        _asked("3.4", "Desired poles")(
            prose("strategy", "A-1", "How do damping ratio and natural frequency fix the dominant poles?"),
            poles("desired_poles", 4, "A-2", "All four desired closed-loop poles."),
            matrix("polynomial", (5,), "A-2", _POLYNOMIAL.format("desired")),
        ),
        _asked("3.5", "Gain in companion form")(
            prose("strategy", "A-1", "What does the feedback do to the last row, and how does that give the gain?"),
            matrix("K_c", (1, 4), "A-2", "The gain that places the poles of the companion form.", 2, Usual(digits=3)),
        ),
    ),
    *_section("3.4.1", "06_control_design")(
        _asked("3.6", "Controllability", codes="B-7 K-1")(
            number("rank", "", None, "K-1", "The rank of the controllability matrix."),
            choice("controllable", YES_NO, "B-7", "Is the system controllable?"),
            prose("explanation", "B-7", "Why?"),
        ),
        _asked("3.7", "Transformation to companion form")(
            matrix("T", (4, 4), "B-5", "The controllability matrix of the model with the motor voltage as input."),
            matrix("T_c", (4, 4), "B-5", "The controllability matrix of the companion form."),
            matrix("W", (4, 4), "K-3", "The transformation matrix.", points=2),
        ),
        _asked("3.8", "Control gain")(
            matrix("K", (1, 4), "", "The gain for the original states, by way of the companion form.", 2, _GAIN),
        ),
        _asked("3.9", "Closed-loop poles")(
            poles("poles", 4, "K-1", "The poles of the closed loop with your gain."),
            prose("conclusion", "B-9", "Are they where you wanted them? If not, where did the design go astray?"),
        ),
        _asked("3.10", "Control gain, by a library")(
            matrix("K", (1, 4), "K-1", "The gain that a library's pole placement gives.", 2, _GAIN),
        ),
    ),
    *_section("3.4.2", "07_control_simulation")(
        _asked("3.11", "Simulated response")(
            _response("The simulated closed-loop response.", experiment="closed_loop", feedback="full"),
            _FOLLOWING,
        ),
        _asked("3.12", "Specifications, simulated")(*_specifications("the simulated servo angle")),
    ),
    *_section("3.4.3", "08_full_state_feedback")(
        _asked("3.13", "Response with full state feedback")(
            _response("A recording with full state feedback.", experiment="tracking", feedback="full"),
            _FOLLOWING,
        ),
        _asked("3.14", "Specifications with full state feedback")(*_specifications("the measured servo angle")),
    ),
    *_section("3.4.4", "09_partial_state_feedback")(
        _asked("3.15", "Response with partial state feedback")(
            _response("A recording with partial state feedback.", experiment="tracking", feedback="partial"),
            _FOLLOWING,
        ),
        _asked("3.16", "Specifications with partial state feedback")(*_specifications("the measured servo angle")),
        _asked("3.17", "Full against partial state feedback")(
            prose("explanation", "B-7", "How do the two responses differ, and what in the loop makes it so?", points=2),
        ),
    ),
)


# --- beyond the workbook: observers, sampling, robustness, feed-forward; optional ------------------------------------

_FLAT = ("gamma_dot", "gamma_ddot", "gamma_3", "gamma_4", "J_eq", "J_l", "K_s", "B_eq", "a", "b")
_ENCODERS = ("servo", "link", "neither")
_TRIED_MS = ("2", "10", "20", "30", "50")
_OF_RATE = "Standard deviation of the deflection's rate, known from 0.1 s of samples of {}."
_NOISE = "RMS change of the voltage from sample to sample, later than 0.2 s in each turn, with {}."
_LOST = "The first sample time (ms) at which a turn does not settle on the bench, or a limit stops it."
_PEAK = "Sensitivity peak M_s of the loop with {}."
_SWING = number("swing_deg", "deg", (0.0, 20.0), "B-7", "The largest deflection later than 0.5 s after a turn begins.")


BEYOND = _section("beyond", "11_beyond_the_workbook")(
    _asked("4.1", "What the encoders know")(
        number("rank_servo", "", None, "K-1", "The rank of the observability matrix of the servo's encoder alone."),
        number("rank_link", "", None, "K-1", "The rank of the observability matrix of the link's encoder alone."),
        choice("spare", _ENCODERS, "B-7", "Without which encoder is the state still known?"),
    ),
    _asked("4.2", "How well they know it")(
        number("deviation_servo", "deg/s", (0.05, 50.0), "K-1", _OF_RATE.format("the servo's encoder alone")),
        number("deviation_both", "deg/s", (0.05, 50.0), "K-1", _OF_RATE.format("both encoders")),
        prose("explanation", "B-7", "How can the servo's encoder know how fast the link swings?"),
    ),
    _asked("4.3", "Gain of the observer")(
        matrix("L", (4, 1), "K-1", "Kalman's gain for the servo's encoder alone, at 2 ms, in filter form.", 2),
    ),
    _asked("4.4", "Observer against derivatives")(
        _response("A recording with your observer and your gain, on the servo's encoder alone.", experiment="follow"),
        number("noise_derivatives", "V", (1e-3, 5.0), "B-7", _NOISE.format("the 33 Hz derivatives")),
        number("noise_observer", "V", (1e-4, 5.0), "B-7", _NOISE.format("your observer")),
        _SWING,
    ),
    _asked("4.5", "The plant from sample to sample")(
        matrix(
            "Phi", (5, 5), "A-2", "The model at 30 ms with a delay of 2 ms; the fifth state is the last voltage.", 2
        ),
        matrix("Gamma", (5, 1), "A-2", "How the new voltage acts on the five states until the next sample."),
    ),
    _asked("4.6", "Sampled design")(
        matrix("K", (1, 5), "K-1", "The gain for your poles of 3.4, as poles in z at 30 ms, and the pole 0.", 2),
        _response("A recording with your observer and your sampled design, at 30 ms.", experiment="follow"),
    ),
    _asked("4.7", "When emulation is lost")(
        number("limit_ms", "ms", (3.0, 100.0), "K-1", "The longest sample time with which your K is stable.", points=2),
        choice("lost_ms", _TRIED_MS, "B-9", _LOST),
    ),
    _asked("4.8", "Which design forgives")(
        number("peak_emulated", "", (1.0, 50.0), "K-1", _PEAK.format("your K emulated at 20 ms")),
        number("peak_sampled", "", (1.0, 50.0), "K-1", _PEAK.format("observer and sampled design at 20 ms")),
        choice("forgives", ("emulated", "sampled"), "B-9", "Which of the two forgives more of what is not modelled?"),
    ),
    _asked("4.9", "From the motion to the voltage")(
        expression("alpha", _FLAT, "A-2", "The deflection, from derivatives of gamma = theta + alpha.", points=1),
        expression("V_m", _FLAT, "A-2", "The motor voltage, from derivatives of gamma."),
    ),
    _asked("4.10", "A turn without swing")(
        number("alpha_max_deg", "deg", (0.5, 20.0), "K-3", "The largest deflection of your planned turn."),
        number("V_max", "V", (0.2, 10.0), "K-3", "The largest voltage of your planned turn."),
        _response("A recording of your planned turn on the bench, with feedback.", experiment="follow"),
        replace(_SWING, prompt="The largest deflection after the end of the turn."),
    ),
    _asked("4.11", "Your choice")(
        prose("conclusion", "B-9", "Which design would you leave on the bench, and which numbers decide it?", points=2),
    ),
)


# --- the results tables -----------------------------------------------------------------------------------------------

_ASKED = {(question.number, part.name): part for question in (*MODELING, *CONTROL) for part in question.parts}
#: What stands in Table 2 beside matrices: they are the model's, whoever found them.
_MATRICES = {
    "A": "System matrix, torque as input.",
    "B": "Input matrix, torque as input.",
    "C": "Output matrix: servo angle, deflection.",
    "D": "Feedthrough matrix.",
}
_IN_TABLE_2 = (("2.11", "omega_n"), ("2.12", "K_s"), *(("2.14", name) for name in _MATRICES), ("2.18", "poles"))


def _entry(question: str, part: str, points: float, name: str = "", prompt: str = "") -> Part:
    """The entry of a results table that carries an answer over, under its own name and prompt."""
    asked = _ASKED[question, part]
    name, prompt = name or asked.name, prompt or asked.prompt
    return replace(asked, name=name, prompt=prompt, points=points, outcome="B-6", shows=(question, part))


def _measured(question: str, suffix: str, where: str) -> tuple[Part, ...]:
    names = {"t_s": "Settling time", "PO": "Overshoot", "alpha_max_deg": "Largest deflection"}
    return tuple(_entry(question, name, 0.25, f"{name}_{suffix}", f"{what}, {where}.") for name, what in names.items())


(TABLE_2,) = _section("2.4", "04_modeling_results")(
    _asked("Table 2", "Results of the modeling laboratory")(
        *(_entry(question, part, 0.5, prompt=_MATRICES.get(part, "")) for question, part in _IN_TABLE_2),
    ),
)
(TABLE_3,) = _section("3.5", "10_control_results")(
    _asked("Table 3", "Results of the control laboratory")(
        _entry("3.4", "desired_poles", 0.25),
        _entry("3.5", "K_c", 0.25),
        _entry("3.7", "W", 0.25),
        _entry("3.8", "K", 0.25),
        _entry("3.9", "poles", 0.25, prompt="The poles of the closed loop."),
        *_measured("3.12", "sim", "simulated"),
        _entry("3.8", "K", 0.25, "K_fsf", "The gain used with full state feedback."),
        *_measured("3.14", "fsf", "bench with full state feedback"),
        # Not what 3.8 asks for, but made of it: the gain of partial state feedback.
        _entry("3.8", "K", 0.25, "K_psf", "The gain used with partial state feedback, for all four states."),
        *_measured("3.16", "psf", "bench with partial state feedback"),
    ),
)


# --- the reports (Sections 5.1 and 5.2; scoring sheets of Sections 7 and 9) -------------------------------------------

# Which outcome code is scored in which row is ours: the code of the step that the row is about. The workbook's sheet
# for modeling has no column for K-1 and K-3, and its report leaves out the spectrum; here it is beside the sweep.
# A group's rows: title, name of the text ("" if answers are shown as they are), codes, answers shown, prompt.
Rows = dict[str, tuple[tuple[str, str, str, str, str], ...]]
_DONE = "In a few sentences: the aim, and what was done to {}."
_HOW = "How settling time, overshoot, deflection and voltage were measured."
_MET = "Whether the specifications are met."
_FOUR = "{0}:t_s, {0}:PO, {0}:alpha_max_deg, {0}:V_max"
_VERDICT = "{0}:satisfied, {0}:conclusion"
_LEFT_OUT = "Where the differences between model and bench come from."
_USE = "How well the model stands for the bench, and what it may be used for."
_MISSING = "What the missing feedback does to the response."
_MODELING_ROWS: Rows = {
    "Procedure": (
        ("finding the stiffness", "stiffness", "B-5", "2.9:sweep", _DONE.format("record the sweep")),
        ("building the model", "model", "B-5", "2.14", _DONE.format("put numbers into the model")),
        ("model validation", "validation", "B-5", "2.15:validation", _DONE.format("compare the model with the bench")),
    ),
    "Results": (
        ("the sweep and its spectrum", "", "K-2 K-3", "2.9:figure, 2.10:figure", "Both figures."),
        ("model validation", "", "K-2", "2.15:figure", "The figure."),
        ("Table 2", "", "B-6", "Table 2", "The table, filled in."),
    ),
    "Analysis": (
        ("stiffness", "stiffness", "B-7", "2.11, 2.12", "How the stiffness follows from what was measured."),
        ("what the model leaves out", "discrepancy", "B-8", "2.17:reason", _LEFT_OUT),
    ),
    "Conclusion": (("the model", "model", "B-9", "2.16:comparison", _USE),),
}
_CONTROL_ROWS: Rows = {
    "Procedure": (
        ("control design", "design", "B-5", "3.7", _DONE.format("find the transformation to companion form")),
        ("simulation", "simulation", "B-5", "3.11:response", _DONE.format("simulate the closed loop")),
        ("full state feedback", "full", "B-5", "3.13:response", _DONE.format("run it on the bench")),
        ("partial state feedback", "partial", "B-5", "3.15:response", _DONE.format("run it on the bench")),
    ),
    "Results": (
        ("transformation", "", "K-3", "3.7", "The matrices."),
        ("simulation", "", "K-3", "3.11:figure", "The figure."),
        ("full state feedback", "", "K-3", "3.13:figure", "The figure."),
        ("partial state feedback", "", "K-3", "3.15:figure", "The figure."),
        ("Table 3", "", "B-6", "Table 3", "The table, filled in."),
    ),
    "Analysis": (
        ("controllability", "controllability", "K-1 B-7", "3.6", "How it was found, and why the test works."),
        ("closed-loop poles", "poles", "K-1", "3.9:poles", "How they were computed."),
        ("control gain", "gain", "K-1", "3.10:K", "The commands that give the gain."),
        ("simulated response", "simulation", "K-1", _FOUR.format("3.12"), _HOW),
        ("full state feedback", "full", "K-1", _FOUR.format("3.14"), _HOW),
        ("partial state feedback", "partial", "K-1", _FOUR.format("3.16"), _HOW),
        ("full against partial", "comparison", "B-7", "3.17:explanation", _MISSING),
    ),
    "Conclusion": (
        ("closed-loop poles", "poles", "B-9", "3.9:conclusion", "Whether they are where they should be."),
        ("simulation", "simulation", "B-9", _VERDICT.format("3.12"), _MET),
        ("full state feedback", "full", "B-9", _VERDICT.format("3.14"), _MET),
        ("partial state feedback", "partial", "B-9", _VERDICT.format("3.16"), _MET),
    ),
}


def _items(report: str, rows: Rows) -> Iterable[ReportItem]:
    """The rows of a report's scoring sheet; the last two are about the report as a whole."""
    for numeral, (group, about) in zip(("I", "II", "III", "IV"), rows.items(), strict=True):
        for row, (title, name, codes, shows, prompt) in enumerate(about, 1):
            where = tuple((question, part) for question, _, part in (one.partition(":") for one in shows.split(", ")))
            text = f"{name}_{group.lower()}" if name else ""
            yield ReportItem(report, f"{numeral}.{row}", f"{group}: {title}", prompt, tuple(codes.split()), where, text)
    whole = "The report as a whole: "
    agrees = f"{whole}each part has what belongs there, and no part contradicts another."
    lists = f"{whole}the lists at the end of `04_modeling_results` say what to look for."
    yield ReportItem(report, "Format.1", "Content and organisation", agrees, ("GS-1",), judged="organisation")
    yield ReportItem(report, "Format.2", "Professional appearance", lists, ("GS-2",), judged="appearance")


CATALOGUE = Catalogue(
    (*MODELING, *CONTROL, *BEYOND),
    warm_up=WARM_UP,
    tables=(TABLE_2, TABLE_3),
    report_items=(*_items("Modeling report", _MODELING_ROWS), *_items("Control report", _CONTROL_ROWS)),
    reports={
        "Modeling report": ("5.1", TABLE_2.notebook, "Report on the modeling laboratory"),
        "Control report": ("5.2", TABLE_3.notebook, "Report on the control laboratory"),
    },
    outcomes=OUTCOMES,
    predictions=PREDICTIONS,
    optional=(BEYOND[0].notebook,),
)
