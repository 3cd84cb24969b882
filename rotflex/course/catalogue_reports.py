"""The rows of the two reports' scoring sheets (Sections 5.1 and 5.2; Sections 7 and 9), but for those on the whole.

Which outcome code is scored in which row is ours: the code of the step that the row is about. The workbook's sheet for
modeling has no column for K-1 and K-3, and its report leaves out the spectrum; here it is shown beside the sweep.
"""

from __future__ import annotations

from labcourse.answers.parts import ReportItem

MODELING_REPORT = "Modeling report"
CONTROL_REPORT = "Control report"
_MEASURED = ("t_s", "PO", "alpha_max_deg", "V_max")


def _all(number: str, names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((number, name) for name in names)


MODELING_ITEMS = (
    ReportItem(
        MODELING_REPORT,
        "I.1",
        "Procedure: finding the stiffness",
        "In a few sentences: the aim, and what was done to record the sweep.",
        ("B-5",),
        (("2.9", "sweep"),),
        "stiffness_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "I.2",
        "Procedure: loading the model",
        "In a few sentences: the aim, and what was done to put numbers into the model.",
        ("B-5",),
        (("2.14", ""),),
        "model_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "I.3",
        "Procedure: model validation",
        "In a few sentences: the aim, and what was done to compare the model with the bench.",
        ("B-5",),
        (("2.15", "validation"),),
        "validation_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "II.1",
        "Results: the sweep and its spectrum",
        "The figures of both.",
        ("K-2", "K-3"),
        (("2.9", "figure"), ("2.10", "figure")),
    ),
    ReportItem(MODELING_REPORT, "II.2", "Results: model validation", "The figure.", ("K-2",), (("2.15", "figure"),)),
    ReportItem(MODELING_REPORT, "II.3", "Results: Table 2", "The table, filled in.", ("B-6",), (("Table 2", ""),)),
    ReportItem(
        MODELING_REPORT,
        "III.1",
        "Analysis: stiffness",
        "How the stiffness follows from what was measured.",
        ("B-7",),
        (("2.11", ""), ("2.12", "")),
        "stiffness_analysis",
    ),
    ReportItem(
        MODELING_REPORT,
        "III.2",
        "Analysis: what the model leaves out",
        "Where the differences between model and bench come from.",
        ("B-8",),
        (("2.17", "reason"),),
        "discrepancy_analysis",
    ),
    ReportItem(
        MODELING_REPORT,
        "IV.1",
        "Conclusion: the model",
        "How well the model stands for the bench, and what it may be used for.",
        ("B-9",),
        (("2.16", "comparison"),),
        "model_conclusion",
    ),
)

CONTROL_ITEMS = (
    ReportItem(
        CONTROL_REPORT,
        "I.1",
        "Procedure: control design",
        "In a few sentences: the aim, and what was done to find the transformation to companion form.",
        ("B-5",),
        (("3.7", ""),),
        "design_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.2",
        "Procedure: simulation",
        "In a few sentences: the aim, and what was done to simulate the closed loop.",
        ("B-5",),
        (("3.11", "response"),),
        "simulation_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.3",
        "Procedure: full state feedback",
        "In a few sentences: the aim, and what was done to run it on the bench.",
        ("B-5",),
        (("3.13", "response"),),
        "full_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.4",
        "Procedure: partial state feedback",
        "In a few sentences: the aim, and what was done to run it on the bench.",
        ("B-5",),
        (("3.15", "response"),),
        "partial_procedure",
    ),
    ReportItem(CONTROL_REPORT, "II.1", "Results: transformation", "The matrices.", ("K-3",), (("3.7", ""),)),
    ReportItem(CONTROL_REPORT, "II.2", "Results: simulation", "The figure.", ("K-3",), (("3.11", "figure"),)),
    ReportItem(CONTROL_REPORT, "II.3", "Results: full state feedback", "The figure.", ("K-3",), (("3.13", "figure"),)),
    ReportItem(
        CONTROL_REPORT,
        "II.4",
        "Results: partial state feedback",
        "The figure.",
        ("K-3",),
        (("3.15", "figure"),),
    ),
    ReportItem(CONTROL_REPORT, "II.5", "Results: Table 3", "The table, filled in.", ("B-6",), (("Table 3", ""),)),
    ReportItem(
        CONTROL_REPORT,
        "III.1",
        "Analysis: controllability",
        "How it was found, and why the test works.",
        ("K-1", "B-7"),
        (("3.6", ""),),
        "controllability_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.2",
        "Analysis: closed-loop poles",
        "How they were computed.",
        ("K-1",),
        (("3.9", "poles"),),
        "poles_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.3",
        "Analysis: control gain",
        "The commands that give the gain.",
        ("K-1",),
        (("3.10", "K"),),
        "gain_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.4",
        "Analysis: simulated response",
        "How settling time, overshoot, deflection and voltage were measured.",
        ("K-1",),
        _all("3.12", _MEASURED),
        "simulation_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.5",
        "Analysis: full state feedback",
        "How settling time, overshoot, deflection and voltage were measured.",
        ("K-1",),
        _all("3.14", _MEASURED),
        "full_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.6",
        "Analysis: partial state feedback",
        "How settling time, overshoot, deflection and voltage were measured.",
        ("K-1",),
        _all("3.16", _MEASURED),
        "partial_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.7",
        "Analysis: full against partial",
        "What the missing feedback does to the response.",
        ("B-7",),
        (("3.17", "explanation"),),
        "comparison_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.1",
        "Conclusion: closed-loop poles",
        "Whether they are where they should be.",
        ("B-9",),
        (("3.9", "conclusion"),),
        "poles_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.2",
        "Conclusion: simulation",
        "Whether the specifications are met.",
        ("B-9",),
        _all("3.12", ("satisfied", "conclusion")),
        "simulation_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.3",
        "Conclusion: full state feedback",
        "Whether the specifications are met.",
        ("B-9",),
        _all("3.14", ("satisfied", "conclusion")),
        "full_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.4",
        "Conclusion: partial state feedback",
        "Whether the specifications are met.",
        ("B-9",),
        _all("3.16", ("satisfied", "conclusion")),
        "partial_conclusion",
    ),
)
