"""The questions of Section 3: pole placement, simulation, full and partial state feedback; Table 3."""

from __future__ import annotations

from labcourse.answers.parts import YES_NO, Part, Question, Usual, choice, figure, matrix, number, poles, prose
from rotflex.course.recordings import recording
from rotflex.specifications import SETTLING_BAND

PRELAB = "05_control_prelab"
DESIGN = "06_control_design"
SIMULATION = "07_control_simulation"
FULL = "08_full_state_feedback"
PARTIAL = "09_partial_state_feedback"
RESULTS = "10_control_results"

SETTLING_TIME = (0.02, 3.0)
OVERSHOOT = (0.0, 100.0)
DEFLECTION = (2.0, 60.0)
VOLTAGE = (0.5, 24.0)
#: On the benches that are drawn, the largest entry of the right gain is 10 to 24 V/rad; per degree, it is below 0.5.
GAIN = Usual(largest=(5.0, 60.0), unit="V/rad", digits=3)

_TRACKING_CHANNELS = ("theta_ref", "theta", "alpha", "vm")


def _specifications(whose: str) -> tuple[Part, ...]:
    """What is measured on a closed-loop response and held against the specifications of Section 3.1."""
    band = f"{100 * SETTLING_BAND:g} %"
    return (
        number(
            "t_s",
            "s",
            SETTLING_TIME,
            "K-1",
            f"Settling time of {whose} (to {band} of the final angle).",
        ),
        number("PO", "%", OVERSHOOT, "K-1", f"Overshoot of {whose}, in per cent of the step."),
        number("alpha_max_deg", "deg", DEFLECTION, "K-1", "The largest deflection of the link."),
        number("V_max", "V", VOLTAGE, "K-1", "The largest motor voltage."),
        choice("satisfied", YES_NO, "B-9", "Are all four specifications of Section 3.1 met?"),
        prose("conclusion", "B-9", "Which specification is met or missed by how much, and is that what you expected?"),
    )


CONTROL = (
    Question(
        "3.1",
        "3.3",
        PRELAB,
        "Stability",
        ("A-1", "A-3"),
        (
            choice(
                "stability",
                ("stable", "marginally stable", "unstable"),
                "A-1",
                "What do the open-loop poles make of the system?",
            ),
            prose("explanation", "A-3", "Does that agree with how the bench behaved?"),
        ),
    ),
    Question(
        "3.2",
        "3.3",
        PRELAB,
        "Characteristic polynomial",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "How do poles and characteristic equation belong together?"),
            matrix(
                "polynomial",
                (5,),
                "A-2",
                "The open-loop characteristic polynomial: its coefficients, highest power of s first.",
                points=2,
            ),
        ),
    ),
    Question(
        "3.3",
        "3.3",
        PRELAB,
        "Companion form",
        ("A-2",),
        (
            matrix("A_c", (4, 4), "A-2", "The companion matrix of A."),
            matrix("B_c", (4, 1), "A-2", "The companion matrix of B."),
        ),
    ),
    Question(
        "3.4",
        "3.3",
        PRELAB,
        "Desired poles",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "How do damping ratio and natural frequency fix the dominant poles?"),
            poles("desired_poles", 4, "A-2", "All four desired closed-loop poles."),
            matrix(
                "polynomial",
                (5,),
                "A-2",
                "The desired characteristic polynomial: its coefficients, highest power of s first.",
            ),
        ),
    ),
    Question(
        "3.5",
        "3.3",
        PRELAB,
        "Gain in companion form",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "What does the feedback do to the last row, and how does that give the gain?"),
            matrix("K_c", (1, 4), "A-2", "The gain that places the poles of the companion form.", 2, Usual(digits=3)),
        ),
    ),
    Question(
        "3.6",
        "3.4.1",
        DESIGN,
        "Controllability",
        ("B-7", "K-1"),
        (
            number("rank", "", None, "K-1", "The rank of the controllability matrix."),
            choice("controllable", YES_NO, "B-7", "Is the system controllable?"),
            prose("explanation", "B-7", "Why?"),
        ),
    ),
    Question(
        "3.7",
        "3.4.1",
        DESIGN,
        "Transformation to companion form",
        ("B-5", "K-3"),
        (
            matrix("T", (4, 4), "B-5", "The controllability matrix of the model with the motor voltage as input."),
            matrix("T_c", (4, 4), "B-5", "The controllability matrix of the companion form."),
            matrix("W", (4, 4), "K-3", "The transformation matrix.", points=2),
        ),
    ),
    Question(
        "3.8",
        "3.4.1",
        DESIGN,
        "Control gain",
        (),
        (matrix("K", (1, 4), "", "The gain for the original states, by way of the companion form.", 2, GAIN),),
    ),
    Question(
        "3.9",
        "3.4.1",
        DESIGN,
        "Closed-loop poles",
        ("K-1", "B-9"),
        (
            poles("poles", 4, "K-1", "The poles of the closed loop with your gain."),
            prose("conclusion", "B-9", "Are they where you wanted them? If not, where did the design go astray?"),
        ),
    ),
    Question(
        "3.10",
        "3.4.1",
        DESIGN,
        "Control gain, by a library",
        ("K-1",),
        (matrix("K", (1, 4), "K-1", "The gain that a library's pole placement gives.", 2, GAIN),),
    ),
    Question(
        "3.11",
        "3.4.2",
        SIMULATION,
        "Simulated response",
        ("B-5", "K-3"),
        (
            recording(
                "response",
                {"experiment": "closed_loop", "feedback": "full"},
                _TRACKING_CHANNELS,
                "B-5",
                "The simulated closed-loop response.",
            ),
            figure("figure", "K-3", "Servo angle with its reference, deflection and voltage over time."),
        ),
    ),
    Question(
        "3.12",
        "3.4.2",
        SIMULATION,
        "Specifications, simulated",
        ("K-1", "B-9"),
        _specifications("the simulated servo angle"),
    ),
    Question(
        "3.13",
        "3.4.3",
        FULL,
        "Response with full state feedback",
        ("B-5", "K-3"),
        (
            recording(
                "response",
                {"experiment": "tracking", "feedback": "full"},
                _TRACKING_CHANNELS,
                "B-5",
                "A recording with full state feedback.",
            ),
            figure("figure", "K-3", "Servo angle with its reference, deflection and voltage over time."),
        ),
    ),
    Question(
        "3.14",
        "3.4.3",
        FULL,
        "Specifications with full state feedback",
        ("K-1", "B-9"),
        _specifications("the measured servo angle"),
    ),
    Question(
        "3.15",
        "3.4.4",
        PARTIAL,
        "Response with partial state feedback",
        ("B-5", "K-3"),
        (
            recording(
                "response",
                {"experiment": "tracking", "feedback": "partial"},
                _TRACKING_CHANNELS,
                "B-5",
                "A recording with partial state feedback.",
            ),
            figure("figure", "K-3", "Servo angle with its reference, deflection and voltage over time."),
        ),
    ),
    Question(
        "3.16",
        "3.4.4",
        PARTIAL,
        "Specifications with partial state feedback",
        ("K-1", "B-9"),
        _specifications("the measured servo angle"),
    ),
    Question(
        "3.17",
        "3.4.4",
        PARTIAL,
        "Full against partial state feedback",
        ("B-7",),
        (prose("explanation", "B-7", "How do the two responses differ, and what in the loop makes it so?", points=2),),
    ),
)

_ASKED = {(question.number, part.name): part for question in CONTROL for part in question.parts}


def _entry(source: tuple[str, str], name: str, prompt: str = "") -> Part:
    """The entry of Table 3, under its own name, that carries ``source`` over."""
    part = _ASKED[source]
    return Part(
        name=name,
        kind=part.kind,
        points=0.25,
        prompt=prompt or part.prompt,
        outcome="B-6",
        unit=part.unit,
        plausible=part.plausible,
        shape=part.shape,
        count=part.count,
        usual=part.usual,
        shows=source,
    )


def _measured(question: str, suffix: str, where: str) -> tuple[Part, ...]:
    said = {"t_s": "Settling time", "PO": "Overshoot", "alpha_max_deg": "Largest deflection"}
    return tuple(_entry((question, name), f"{name}_{suffix}", f"{what}, {where}.") for name, what in said.items())


TABLE_3 = Question(
    "Table 3",
    "3.5",
    RESULTS,
    "Results of the control laboratory",
    ("B-6",),
    (
        _entry(("3.4", "desired_poles"), "desired_poles"),
        _entry(("3.5", "K_c"), "K_c"),
        _entry(("3.7", "W"), "W"),
        _entry(("3.8", "K"), "K"),
        _entry(("3.9", "poles"), "poles", "The poles of the closed loop."),
        *_measured("3.12", "sim", "simulated"),
        _entry(("3.8", "K"), "K_fsf", "The gain used with full state feedback."),
        *_measured("3.14", "fsf", "bench with full state feedback"),
        # Not what 3.8 asks for, but made of it: the gain that partial state feedback leaves.
        _entry(("3.8", "K"), "K_psf", "The gain that partial state feedback leaves, on all four states."),
        *_measured("3.16", "psf", "bench with partial state feedback"),
    ),
)
