"""The questions of Section 2: the model, the stiffness, the validation; Table 2."""

from __future__ import annotations

from labcourse.answers.parts import Part, Question, Usual, expression, figure, function, matrix, number, poles, prose
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.course.recordings import recording

PRELAB = "01_modeling_prelab"
STIFFNESS = "02_finding_stiffness"
VALIDATION = "03_model_validation"
RESULTS = "04_modeling_results"

_PARAMETERS = ("J_eq", "J_l", "B_eq", "B_l", "K_s")
_STATE = ("theta", "alpha", "theta_dot", "alpha_dot")
_ENERGY = (*_STATE, *_PARAMETERS)
_MOTION = (*_STATE, "theta_ddot", "alpha_ddot", "tau", *_PARAMETERS)
_UNDAMPED_LINK = ("J_eq", "J_l", "B_eq", "K_s")

OMEGA_N = (8.0, 60.0)
K_S = (0.2, 10.0)

WARM_UP_QUESTION = Question(
    "0.1",
    "4",
    "00_start",
    "Resolution of the encoder",
    (),
    (
        number(
            "resolution",
            "rad",
            (2e-4, 1e-2),
            "",
            "By what angle of the load shaft do two neighbouring encoder counts differ?",
            points=0,
        ),
    ),
)

MODELING = (
    Question(
        "2.1",
        "2.2",
        PRELAB,
        "Potential energy",
        ("A-2",),
        (expression("V", _ENERGY, "A-2", "The energy stored in the flexible joint when the link is deflected."),),
    ),
    Question(
        "2.2",
        "2.2",
        PRELAB,
        "Kinetic energy",
        ("A-2",),
        (expression("T", _ENERGY, "A-2", "The kinetic energy of servo and link together."),),
    ),
    Question(
        "2.3",
        "2.2",
        PRELAB,
        "Lagrangian",
        ("A-2",),
        (expression("L", _ENERGY, "A-2", "The Lagrangian of the system.", points=1),),
    ),
    Question(
        "2.4",
        "2.2",
        PRELAB,
        "Equation of motion of the servo",
        ("A-1", "A-2"),
        (
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
    ),
    Question(
        "2.5",
        "2.2",
        PRELAB,
        "Equation of motion of the link",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "What differs from the derivation for the servo, and what stays the same?"),
            Part("equation", "equation", 2, "The Euler-Lagrange equation of alpha.", "A-2", symbols=_MOTION),
        ),
    ),
    Question(
        "2.6",
        "2.2",
        PRELAB,
        "Angular accelerations",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "How do you separate the two accelerations?"),
            expression(
                "theta_ddot",
                (*_STATE, "tau", *_UNDAMPED_LINK),
                "A-2",
                "The acceleration of the servo angle, from angles, rates and torque; without damping of the link.",
                points=1,
            ),
            expression(
                "alpha_ddot",
                (*_STATE, "tau", *_UNDAMPED_LINK),
                "A-2",
                "The acceleration of the deflection, from angles, rates and torque; without damping of the link.",
                points=1,
            ),
        ),
    ),
    Question(
        "2.7",
        "2.2",
        PRELAB,
        "State-space matrices",
        ("A-1", "A-2"),
        (
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
            Part(
                "B",
                "symbolic_matrix",
                1,
                "B, for the torque as input.",
                "A-2",
                shape=(4, 1),
                symbols=_UNDAMPED_LINK,
            ),
        ),
    ),
    Question(
        "2.8",
        "2.2",
        PRELAB,
        "Inertia of the link",
        ("A-1", "A-2"),
        (
            prose("strategy", "A-1", "Which theorems give the inertia of two arms about one pivot?"),
            expression(
                "J_l",
                ("m_1", "L_1", "m_2", "L_2", "d_12"),
                "A-2",
                "The inertia of the whole link about the pivot, from masses, lengths and the place of the top arm.",
            ),
        ),
    ),
    Question(
        "2.9",
        "2.3.1",
        STIFFNESS,
        "Response to the sweep",
        ("B-5", "K-2"),
        (
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
    ),
    Question(
        "2.10",
        "2.3.1",
        STIFFNESS,
        "Amplitude spectrum",
        ("K-3",),
        (
            function(
                "spectrum",
                COMPOUND_SINES,
                "K-3",
                "spectrum(x, dt) -> (f_hz, amplitude): the single-sided amplitude spectrum of samples x taken "
                "every dt seconds. A sine of amplitude 1 on a bin shows as 1.",
            ),
            figure("figure", "K-3", "The spectrum of the deflection, up to 10 Hz."),
        ),
    ),
    Question(
        "2.11",
        "2.3.1",
        STIFFNESS,
        "Natural frequency",
        ("B-7",),
        (
            number("omega_n", "rad/s", OMEGA_N, "B-7", "The natural frequency of the link.", points=2),
            prose(
                "explanation",
                "B-7",
                "Drive the motor with the sweep as a voltage instead, and the peak of alpha is somewhere else. "
                "Why does it mislead?",
            ),
        ),
    ),
    Question(
        "2.12",
        "2.3.1",
        STIFFNESS,
        "Stiffness of the joint",
        ("B-7",),
        (
            number(
                "J_l",
                "kg·m²",
                (5e-4, 2e-2),
                "B-7",
                "The inertia of the link with the top arm as it is on your bench.",
            ),
            number("K_s", "N·m/rad", K_S, "B-7", "The stiffness of the joint.", points=2),
        ),
    ),
    Question(
        "2.13",
        "2.3.2",
        VALIDATION,
        "The model in code",
        ("K-3",),
        (
            function(
                "state_space",
                PLANT_PARAMETERS,
                "K-3",
                "state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D): your model with the torque as input and "
                "the two angles as outputs.",
            ),
        ),
    ),
    Question(
        "2.14",
        "2.3.2",
        VALIDATION,
        "The model in numbers",
        ("B-5",),
        (
            matrix("A", (4, 4), "B-5", "A with your stiffness and inertia, torque as input."),
            matrix("B", (4, 1), "B-5", "B, torque as input.", points=0.5),
            matrix("C", (2, 4), "B-5", "C, for the outputs theta and alpha.", points=0.25),
            matrix("D", (2, 1), "B-5", "D.", points=0.25),
        ),
    ),
    Question(
        "2.15",
        "2.3.2",
        VALIDATION,
        "Model and bench side by side",
        ("B-5", "K-2"),
        (
            recording(
                "validation",
                {"experiment": "validation"},
                ("theta", "alpha", "theta_model", "alpha_model"),
                "B-5",
                "A recording of the bench and your model under the same input.",
            ),
            figure("figure", "K-2", "Both angles over time, measured and modeled."),
        ),
    ),
    Question(
        "2.16",
        "2.3.2",
        VALIDATION,
        "How good is the model?",
        ("B-9",),
        (prose("comparison", "B-9", "Where does the model follow the bench, and where does it not?", points=2),),
    ),
    Question(
        "2.17",
        "2.3.2",
        VALIDATION,
        "Why is it not perfect?",
        ("B-8",),
        (prose("reason", "B-8", "At least one thing that the bench does and the model leaves out.", points=2),),
    ),
    Question(
        "2.18",
        "2.3.2",
        VALIDATION,
        "Open-loop poles",
        ("K-1",),
        (poles("poles", 4, "K-1", "The poles of the model with the motor voltage as input.", points=2),),
    ),
)


#: What stands in the table beside matrices: they are the model's, whoever found them.
_DESCRIPTIONS = {
    "A": "System matrix, torque as input.",
    "B": "Input matrix, torque as input.",
    "C": "Output matrix: servo angle, deflection.",
    "D": "Feedthrough matrix.",
}


def _entry(part: Part, source: str) -> Part:
    """The entry of a results table that carries the part of the same name over."""
    return Part(
        name=part.name,
        kind=part.kind,
        points=0.5,
        prompt=_DESCRIPTIONS.get(part.name, part.prompt),
        outcome="B-6",
        unit=part.unit,
        plausible=part.plausible,
        shape=part.shape,
        count=part.count,
        shows=(source, part.name),
    )


_ASKED = {(question.number, part.name): part for question in MODELING for part in question.parts}

TABLE_2 = Question(
    "Table 2",
    "2.4",
    RESULTS,
    "Results of the modeling laboratory",
    ("B-6",),
    tuple(
        _entry(_ASKED[source], source[0])
        for source in (
            ("2.11", "omega_n"),
            ("2.12", "K_s"),
            ("2.14", "A"),
            ("2.14", "B"),
            ("2.14", "C"),
            ("2.14", "D"),
            ("2.18", "poles"),
        )
    ),
)
