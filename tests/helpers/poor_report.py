"""A report as a student in a hurry hands it in, and a list of what is wrong with it.

The list was written down before there was a check. Each entry of :data:`FAULTS` is a fault that a reader would mark;
one of them no program finds without a dictionary.
"""

from __future__ import annotations

from rotflex.courseware.report.document import (
    Axes,
    Document,
    Equation,
    Figure,
    Place,
    Prose,
    Reference,
    Section,
    Table,
)

NOTEBOOK = "04_results.ipynb"

#: number → what is wrong, as a reader would write it at the margin
FAULTS = {
    1: "No author on the cover",
    2: "No date on the cover",
    3: "III.2 is not written",
    4: "Figure 3 (validation) was never recorded",
    5: "The table has a row that is not filled in",
    6: "Figure 1 has no label at its vertical axis",
    7: "Figure 2 has no unit at its horizontal axis",
    8: "Figure 2 shows two curves, and does not say which is which",
    9: "The caption of Figure 1 is a symbol",
    10: "The caption of Figure 3 is the caption of Figure 2",
    11: "Figure 3 is nowhere referred to",
    12: "The table is nowhere referred to",
    13: "The text refers to a Figure 9, which there is not",
    14: "Equation (2) is numbered, and nowhere referred to",
    15: "Equation (2) comes before equation (1)",
    16: "A formula in III.1 lacks a closing brace",
    17: r"A command in a formula is misspelt: \omgea",
    18: "A formula is typed as if for a program, with * and ^",
    19: "TODO is left in I.2",
    20: "??? stands for a number in IV.1",
    21: "the the",
    22: "A sentence of I.1 stands in I.3 again, word for word",
    23: "II.2 interprets: because, good agreement",
    24: "The stiffness in III.1 is not that of the table",
    25: "The natural frequency in III.1 has no unit",
    26: "A decimal comma among decimal points",
    27: "Ten digits of a measured value",
    28: "[3] is cited, and there is no [3]",
    29: "Reference [2] is never cited, and is a bare address",
    30: "IV.1 has a spelling mistake (osciliation) and breaks off in the middle of a sentence",
}


def _at(cell: str) -> Place:
    return Place(NOTEBOOK, cell)


def _text(part: str, text: str) -> Prose:
    return Prose(part, text, _at(f"report-{part}"))


def _figure(number: int, question: str, caption: str, svg: str = "<svg/>", axes: tuple[Axes, ...] = ()) -> Figure:
    place = Place("02_shaking.ipynb", f"q{question.replace('.', '-')}")
    return Figure(f"Figure {question}", number, caption, True, svg, "", axes, place, _at("front"))


_SHAKEN = (
    "The joint was shaken with a sine whose frequency rose from 1 Hz to 5 Hz within 15 s, and the servo followed it "
    "with "
    "an amplitude of 4 deg."
)

POOR = Document(
    report="Modeling report",
    title="Modelling of a flexible joint",
    course="Laboratory of control",
    term="",
    student="ada",
    authors=(),
    date="",
    page_limit=10,
    sections=(
        Section(
            "I.1",
            "Procedure: finding the stiffness",
            (
                _text(
                    "stiffness",
                    f"The goal was to find the stiffness of the joint. {_SHAKEN} Angles were recorded every 2 ms, "
                    f"which "
                    "gave the the signal in Figure 2.9. A position loop held the servo, as in [3].",
                ),
            ),
            _at("report-stiffness"),
        ),
        Section(
            "I.2",
            "Procedure: loading the model",
            (
                _text(
                    "loading",
                    "The equations of motion were written as matrices for the state of the four angles and rates. "
                    "TODO: "
                    "say where the inertia comes from. The input of the model is the voltage of the motor.",
                ),
            ),
            _at("report-loading"),
        ),
        Section(
            "I.3",
            "Procedure: validation",
            (
                _text(
                    "validation",
                    f"A square wave of 1,5 V and 0.5 Hz was put on the motor for 10 s. {_SHAKEN} Measured and "
                    f"simulated "
                    "angles were plotted over each other. The constants of the motor are those of [1].",
                ),
            ),
            _at("report-validation"),
        ),
        Section(
            "II.1",
            "Results: the sweep and its spectrum",
            (
                _figure(1, "2.9", r"$\alpha$", axes=(Axes("", "time (s)", "", ("",)),)),
                _figure(
                    2,
                    "2.10",
                    "Amplitude spectrum of the deflection during the sweep from 1 Hz to 5 Hz.",
                    axes=(Axes("", "frequency", "amplitude (deg)", ("", "")),),
                ),
            ),
            Place("02_shaking.ipynb", "q2-9"),
        ),
        Section(
            "II.2",
            "Results: validation",
            (
                _figure(
                    3,
                    "2.15",
                    "Amplitude spectrum of the deflection during the sweep from 1 Hz to 5 Hz.",
                    svg="",
                ),
                _text(
                    "shown",
                    "The measured and the simulated deflection were recorded for 10 s. They are in good agreement, "
                    "because "
                    "the stiffness was measured well.",
                ),
            ),
            Place("03_validation.ipynb", "q2-15"),
        ),
        Section(
            "II.3",
            "Results: table",
            (
                Table(
                    "Table 2",
                    1,
                    "What was measured of the joint, and what was computed from it.",
                    True,
                    ("Description", "Symbol", "Value", "Unit"),
                    (
                        ("natural frequency", r"$\omega_n$", "24.2", "rad/s"),
                        ("stiffness", "$K_s$", "2.02", "N·m/rad"),
                        ("poles", "poles", "", "1/s"),
                    ),
                    _at("table-2"),
                    _at("front"),
                ),
            ),
            _at("table-2"),
        ),
        Section(
            "III.1",
            "Analysis: stiffness",
            (
                _text(
                    "analysis",
                    "The spectrum (Figure 2.10) has its peak at 3.851562500 Hz, so that the natural frequency is "
                    r"$\omega_n$ = 24.2. Figure 9 shows the same for a softer joint. With the inertia of the link,"
                    "\n\n"
                    r"$$ \omgea_n^2 = \frac{K_s}{J_l \tag{2} $$"
                    "\n\n"
                    r"$$ J_l\ddot\alpha = -K_s\alpha \tag{1} $$"
                    "\n\n"
                    "and by equation (1) the stiffness follows as K = J*w^2, which gives $K_s$ = 1.30 N·m/rad with an "
                    "uncertainty of 4 %.",
                ),
                Equation(1, r"\omgea_n^2 = \frac{K_s}{J_l", "2", _at("report-analysis")),
                Equation(2, r"J_l\ddot\alpha = -K_s\alpha", "1", _at("report-analysis")),
            ),
            _at("report-analysis"),
        ),
        Section("III.2", "Analysis: differences", (_text("differences", ""),), _at("report-differences")),
        Section(
            "IV.1",
            "Conclusion: the model",
            (
                _text(
                    "conclusion",
                    "The model describes each osciliation of the bench to within ??? per cent up to voltages of 1.5 "
                    "V. It "
                    "may be used for the design of a controller, as long as the friction of the servo is not too "
                    "large and",
                ),
            ),
            _at("report-conclusion"),
        ),
    ),
    references=(
        Reference("1", "Acme, *Data sheet of the motor M-1*, 2019.", _at("front")),
        Reference("2", "https://example.org/motors/index.html", _at("front")),
    ),
    language="en",
    front=_at("front"),
)
