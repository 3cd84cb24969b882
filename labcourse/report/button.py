"""A button that makes a report, for a notebook: the same as ``lab.report(…)``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from labcourse.report import making
from labcourse.run import by_program

if TYPE_CHECKING:
    from labcourse.session import Session


def button(report: str, lab: Session) -> None:
    """Show a button that makes a report, and below it what there is to say of it.

    Parameters
    ----------
    report : its number, as in "First report"
    lab : the student's session

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    making.find(lab.catalogue.reports, report)
    if by_program():  # nobody can press it
        lab.report(report)
        return
    import ipywidgets
    from IPython.display import display

    label = "Make the report (PDF and web page)"
    pressed = ipywidgets.Button(
        description=label, icon="file-pdf-o", button_style="primary", layout={"width": "max-content"}
    )
    shown = ipywidgets.Output()

    def make(_button: Any) -> None:
        pressed.disabled = True
        shown.clear_output()
        try:
            with shown:
                print("Making the report …")
                lab.report(report)
        finally:
            pressed.disabled = False

    pressed.on_click(make)
    display(ipywidgets.VBox([pressed, shown]))
