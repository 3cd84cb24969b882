"""The rows of the two reports' scoring sheets (Sections 5.1 and 5.2; Sections 7 and 9), but for those on the whole.

Which outcome code is scored in which row is ours: the code of the step that the row is about. The workbook's sheet for
modeling has no column for K-1 and K-3, and its report leaves out the spectrum; here it is shown beside the sweep.
"""

from __future__ import annotations

from rotflex.courseware.messages import N_
from rotflex.courseware.parts import ReportItem

MODELING_REPORT = "Modeling report"
CONTROL_REPORT = "Control report"
_MEASURED = ("t_s", "PO", "alpha_max_deg", "V_max")


def _all(number: str, names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((number, name) for name in names)


MODELING_ITEMS = (
    ReportItem(
        MODELING_REPORT,
        "I.1",
        N_("Procedure: finding the stiffness"),
        N_("In a few sentences: the aim, and what was done to record the sweep."),
        ("B-5",),
        (("2.9", "sweep"),),
        "stiffness_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "I.2",
        N_("Procedure: loading the model"),
        N_("In a few sentences: the aim, and what was done to put numbers into the model."),
        ("B-5",),
        (("2.14", ""),),
        "model_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "I.3",
        N_("Procedure: model validation"),
        N_("In a few sentences: the aim, and what was done to compare the model with the bench."),
        ("B-5",),
        (("2.15", "validation"),),
        "validation_procedure",
    ),
    ReportItem(
        MODELING_REPORT,
        "II.1",
        N_("Results: the sweep and its spectrum"),
        N_("The figures of both."),
        ("K-2", "K-3"),
        (("2.9", "figure"), ("2.10", "figure")),
    ),
    ReportItem(
        MODELING_REPORT, "II.2", N_("Results: model validation"), N_("The figure."), ("K-2",), (("2.15", "figure"),)
    ),
    ReportItem(
        MODELING_REPORT, "II.3", N_("Results: Table 2"), N_("The table, filled in."), ("B-6",), (("Table 2", ""),)
    ),
    ReportItem(
        MODELING_REPORT,
        "III.1",
        N_("Analysis: stiffness"),
        N_("How the stiffness follows from what was measured."),
        ("B-7",),
        (("2.11", ""), ("2.12", "")),
        "stiffness_analysis",
    ),
    ReportItem(
        MODELING_REPORT,
        "III.2",
        N_("Analysis: what the model leaves out"),
        N_("Where the differences between model and bench come from."),
        ("B-8",),
        (("2.17", "reason"),),
        "discrepancy_analysis",
    ),
    ReportItem(
        MODELING_REPORT,
        "IV.1",
        N_("Conclusion: the model"),
        N_("How well the model stands for the bench, and what it may be used for."),
        ("B-9",),
        (("2.16", "comparison"),),
        "model_conclusion",
    ),
)

CONTROL_ITEMS = (
    ReportItem(
        CONTROL_REPORT,
        "I.1",
        N_("Procedure: control design"),
        N_("In a few sentences: the aim, and what was done to find the transformation to companion form."),
        ("B-5",),
        (("3.7", ""),),
        "design_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.2",
        N_("Procedure: simulation"),
        N_("In a few sentences: the aim, and what was done to simulate the closed loop."),
        ("B-5",),
        (("3.11", "response"),),
        "simulation_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.3",
        N_("Procedure: full state feedback"),
        N_("In a few sentences: the aim, and what was done to run it on the bench."),
        ("B-5",),
        (("3.13", "response"),),
        "full_procedure",
    ),
    ReportItem(
        CONTROL_REPORT,
        "I.4",
        N_("Procedure: partial state feedback"),
        N_("In a few sentences: the aim, and what was done to run it on the bench."),
        ("B-5",),
        (("3.15", "response"),),
        "partial_procedure",
    ),
    ReportItem(CONTROL_REPORT, "II.1", N_("Results: transformation"), N_("The matrices."), ("K-3",), (("3.7", ""),)),
    ReportItem(CONTROL_REPORT, "II.2", N_("Results: simulation"), N_("The figure."), ("K-3",), (("3.11", "figure"),)),
    ReportItem(
        CONTROL_REPORT, "II.3", N_("Results: full state feedback"), N_("The figure."), ("K-3",), (("3.13", "figure"),)
    ),
    ReportItem(
        CONTROL_REPORT,
        "II.4",
        N_("Results: partial state feedback"),
        N_("The figure."),
        ("K-3",),
        (("3.15", "figure"),),
    ),
    ReportItem(
        CONTROL_REPORT, "II.5", N_("Results: Table 3"), N_("The table, filled in."), ("B-6",), (("Table 3", ""),)
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.1",
        N_("Analysis: controllability"),
        N_("How it was found, and why the test works."),
        ("K-1", "B-7"),
        (("3.6", ""),),
        "controllability_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.2",
        N_("Analysis: closed-loop poles"),
        N_("How they were computed."),
        ("K-1",),
        (("3.9", "poles"),),
        "poles_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.3",
        N_("Analysis: control gain"),
        N_("The commands that give the gain."),
        ("K-1",),
        (("3.10", "K"),),
        "gain_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.4",
        N_("Analysis: simulated response"),
        N_("How settling time, overshoot, deflection and voltage were measured."),
        ("K-1",),
        _all("3.12", _MEASURED),
        "simulation_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.5",
        N_("Analysis: full state feedback"),
        N_("How settling time, overshoot, deflection and voltage were measured."),
        ("K-1",),
        _all("3.14", _MEASURED),
        "full_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.6",
        N_("Analysis: partial state feedback"),
        N_("How settling time, overshoot, deflection and voltage were measured."),
        ("K-1",),
        _all("3.16", _MEASURED),
        "partial_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "III.7",
        N_("Analysis: full against partial"),
        N_("What the missing feedback does to the response."),
        ("B-7",),
        (("3.17", "explanation"),),
        "comparison_analysis",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.1",
        N_("Conclusion: closed-loop poles"),
        N_("Whether they are where they should be."),
        ("B-9",),
        (("3.9", "conclusion"),),
        "poles_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.2",
        N_("Conclusion: simulation"),
        N_("Whether the specifications are met."),
        ("B-9",),
        _all("3.12", ("satisfied", "conclusion")),
        "simulation_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.3",
        N_("Conclusion: full state feedback"),
        N_("Whether the specifications are met."),
        ("B-9",),
        _all("3.14", ("satisfied", "conclusion")),
        "full_conclusion",
    ),
    ReportItem(
        CONTROL_REPORT,
        "IV.4",
        N_("Conclusion: partial state feedback"),
        N_("Whether the specifications are met."),
        ("B-9",),
        _all("3.16", ("satisfied", "conclusion")),
        "partial_conclusion",
    ),
)
