"""The questions. Students have this file: it does not say what is right."""

from typing import Any

import numpy as np

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import (
    YES_NO,
    Predictable,
    Probe,
    Question,
    ReportItem,
    choice,
    entry,
    expression,
    figure,
    function,
    matrix,
    number,
    poles,
    prose,
    recording,
)

LAB, REPORT = "01_first_lab", "02_report"  # notebooks

FOUND = Question("1.2", "1", LAB, "Gain and time constant", ("measures",), (
    number("k", "K/V", (1.0, 20.0), "measures", "The gain of your oven."),
    number("tau", "s", (1.0, 100.0), "measures", "The time constant of your oven.", points=2),
))  # fmt: skip

QUESTIONS = [
    Question("1.1", "1", LAB, "A step of the heater", ("measures",), (
        recording(
            "run", {"experiment": "step"}, ("u", "T"), "measures", "Your oven.", units={"u": "V", "T": "K"}
        ),
        figure("plot", "measures", "The temperature against time."),
    )),
    FOUND,
    Question("1.3", "1", LAB, "A formula", ("models",), (
        expression("rise", ("k", "tau", "u", "t"), "models", "The temperature at the time t."),
    )),
    Question("1.4", "1", LAB, "A model", ("models",), (
        function("model", Probe.scalar("model(t)", (0.0, 100.0), "T in K"), "models", "The model of your oven."),
    )),
    Question("1.5", "2", LAB, "The closed loop", ("models",), (
        matrix("A", (2, 2), "models", "The matrix of the closed loop."),
        poles("p", 2, "models", "Its poles."),
        choice("overshoots", YES_NO, "models", "Does the temperature overshoot?"),
        prose("why", "models", "How do the poles tell?"),
    )),
]  # fmt: skip

TABLE = Question("Table 1", "2", REPORT, "The oven", ("measures",), (entry(FOUND, "k"), entry(FOUND, "tau")))

# A row shows answers; a row with a part is a text to write, and one that is judged is the report as a whole.
ROWS = [
    ReportItem("Report", "1", "Procedure", "What was done?", ("measures",), (("1.1", ""),), part="procedure"),
    ReportItem("Report", "2", "Results", "What came out.", ("measures",), (("1.1", "plot"), ("Table 1", ""))),
    ReportItem("Report", "3", "Conclusion", "What is the model good for?", ("models",), part="conclusion"),
    ReportItem("Report", "4", "As a whole", "Is it clear?", ("models",), judged="clarity"),
]


def warm_up_time(run: dict[str, Any]) -> float:
    """Return the time in s at which a recording, as it is kept, reaches half of its last temperature."""
    T = run["channels"]["T"]["values"]
    return float(np.argmax(T[-1] / 2 <= T) * run["n"] * run["sample_time"] / T.size)


CATALOGUE = Catalogue(
    QUESTIONS,
    tables=[TABLE],
    reports={"Report": ("2", REPORT, "Report on the oven")},
    report_items=ROWS,
    bench_word="oven",
    outcomes={"measures": "measures with care", "models": "finds a model, and its limits"},
    predictions={
        "1.1": (
            Predictable(
                number("half", "s", (0.0, 100.0), "", "When will the oven be half as warm as in the end?", points=0),
                (("1.1", "run"),),
                warm_up_time,
                "What would make it slower?",
            ),
        )
    },
)
