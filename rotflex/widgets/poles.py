"""The pole explorer: drag the desired poles, and see gain, response and verdicts follow (Section 3.4)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from labcourse.pictures import Picture
from labcourse.scene.explorer import Explorer
from labcourse.scene.saved_pictures import save
from labcourse.scene.scene import Button, Choice, Column, Readout, Scene, Slider
from rotflex.errors import DesignError
from rotflex.specifications import AMPLITUDE
from rotflex.widgets import pole_plots, pole_words
from rotflex.widgets.cloud import Cloud, cloud, spread_of
from rotflex.widgets.dragging import OMEGA, REAL, ZETA, dragged, within
from rotflex.widgets.margins import Margins, margins
from rotflex.widgets.mechanism import mechanism
from rotflex.widgets.optimal import DEFLECTION, ERROR, lqr
from rotflex.widgets.placement import Design, Dominant, design, matrices, with_gain
from rotflex.widgets.pole_picture import picture
from rotflex.widgets.pole_plots import P3, P4
from rotflex.widgets.region import Region

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_FEEDBACK = {"full": "full state", "partial": "partial (servo only)"}
_BESIDE = {
    "step": "nothing",
    "margins": "margins (Bode)",
    "cloud": "uncertain K_s (cloud)",
    "lqr": "LQR, to compare",
}
_WEIGHTS = {"error": (5.0, 90.0, 1.0), "deflection": (5.0, 60.0, 1.0)}  # deg
_MOST_GHOSTS = 3


class PoleExplorer(Explorer):
    """Desired poles to be dragged, on a student's own model.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    K : (1, 4) the student's own gain, drawn for comparison
    lab : the student's session; "Keep this design" stores the gain there
    question, part : the answer that it is stored as
    start : the poles to begin with, and to go back to
    spread : relative standard uncertainty of K_s; as ``04_modeling_results`` works it out unless given

    Raises
    ------
    DesignError
        If a matrix has the wrong shape, or the model's poles cannot be placed.
    """

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike,
        K: ArrayLike | None = None,
        lab: Lab | None = None,
        question: str = "3.8",
        part: str = "K",
        start: Dominant | None = None,
        spread: float | None = None,
    ) -> None:
        self._a, self._b = matrices(A, B)
        self._lab, self._question, self._part = lab, question, part
        self._start = start or Dominant()
        self._outline: tuple[Any, Any] = (None, [])
        self.ghosts: list[Design] = []
        self.wanted, self.feedback, self.beside = self._start, "full", "step"
        self.weights = {"error": ERROR, "deflection": DEFLECTION}
        self._spread = spread
        self._own = None if K is None else with_gain(self._a, self._b, K)
        self.design = design(self._a, self._b, self._start.poles)  # first: it says so if the model cannot be controlled
        self._region = Region(self._a, self._b)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A slider or the switch."""
        if name == "feedback":
            if value not in _FEEDBACK:
                raise DesignError(f'The feedback is "full" or "partial", not {value!r}.')
            self._redesign(self.wanted, str(value))
            return
        if name == "beside":
            if value not in _BESIDE:
                raise DesignError(f"There is no {value!r} to be shown; there are {', '.join(_BESIDE)}.")
            self.beside = str(value)
        elif name in _WEIGHTS:
            low, high, _step = _WEIGHTS[name]
            self.weights = {**self.weights, name: min(max(float(value), low), high)}
        else:
            self._redesign(within(replace(self.wanted, **{name: float(value)})))

    def move(self, name: str, x: float, y: float) -> None:
        """A pole was dragged."""
        self._redesign(dragged(self.wanted, name, x, y))

    def press(self, name: str) -> None:
        """A button."""
        if name == "reset":
            self._redesign(self._start, "full")
        elif name == "ghost":
            self.ghosts = [*self.ghosts, self.design][-_MOST_GHOSTS:]
        elif name == "forget":
            self.ghosts = []
        elif name == "keep":
            self.keep()
        elif name == "figure":
            files = save(self.picture(), Path.cwd(), "pole_design")
            self.notice = f"Saved for your report: {' and '.join(path.name for path in files)}."

    def keep(self) -> None:
        """Store the gain as the student's answer.

        Raises
        ------
        DesignError
            If there is no session to store it in.
        """
        if self._lab is None:
            raise DesignError("There is no session to keep the design in: make the explorer with lab=lab.")
        replies = self._lab.record(self._question, **{self._part: self.design.K})
        messages = [
            *replies,
            "The notebooks that follow use it from now on. Marks come from the code in your cell of question "
            f"{self._question}, which this button does not change: running that cell stores its own gain again.",
        ]
        if self.design.runaway is not None:
            messages.append("This design is unstable: nothing can be recorded with it on a bench.")
        if not np.allclose(self.design.wanted, self._start.poles):
            messages.append(
                f"Question {self._question} asks for the workbook's poles, and these are others: for the report, "
                "set them back, or explain your choice."
            )
        self.notice = "\n".join(messages)

    def _redesign(self, wanted: Dominant, feedback: str | None = None) -> None:
        chosen = feedback or self.feedback
        self.design = design(self._a, self._b, wanted.poles, chosen)
        self.wanted, self.feedback = wanted, chosen
        if self._own is not None and feedback is not None:
            self._own = with_gain(self._a, self._b, self._own.K, chosen)

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """The s-plane beside the response and the arm, verdicts and gain below."""
        found, other = self.design, self._optimal()
        plane = pole_plots.plane(self._a, self.wanted, self._where_met())
        margin, scattered = self._margins(), self._cloud()
        start = -AMPLITUDE if found.motion is None else float(found.motion["theta"][0])
        if self._own is not None:
            pole_plots.marks(plane, self._own.poles, "highlight", "square", "your K")
        if self.feedback == "partial":
            pole_plots.marks(plane, found.poles, "model", "square", "closed loop, partial")
        if other is not None:
            pole_plots.marks(plane, other.poles, "model", "circle", "LQR", 8)
        if scattered is not None:
            pole_plots.scattered(plane, scattered)
        if self.beside == "margins":
            traces = pole_plots.loop_gain(self._a, self._b, found, margin)
        else:
            traces = pole_plots.traces(found, self.ghosts, other)
        return Scene(
            alt=pole_words.alt_text_of(found),
            columns=[Column([plane], 1.0), Column(traces, 1.1), Column([mechanism(start, 0.0)], 0.55)],
            controls=self._controls(),
            readouts=self._readouts(other, margin, scattered),
            height=460,
            play=pole_plots.played(found),
        )

    def picture(self) -> Picture:
        """The same as a static figure."""
        return picture(self.design, self.ghosts)

    def _controls(self) -> list[list[Slider | Choice | Button]]:
        wanted = self.wanted
        rows: list[list[Slider | Choice | Button]] = [
            [
                Slider("zeta", "ζ", "", *ZETA, 0.01, wanted.zeta),
                Slider("omega_n", "ωₙ", "rad/s", *OMEGA, 0.1, wanted.omega_n),
            ],
            [
                Slider(P3, "third pole", "rad/s", *REAL, 0.5, wanted.p3),
                Slider(P4, "fourth pole", "rad/s", *REAL, 0.5, wanted.p4),
            ],
        ]
        if self.beside == "lqr":
            rows.append(
                [
                    Slider("error", "LQR: θ + α of", "deg", *_WEIGHTS["error"], self.weights["error"]),
                    Slider("deflection", "LQR: α of", "deg", *_WEIGHTS["deflection"], self.weights["deflection"]),
                ]
            )
        keep = f"Store K as answer {self._question}; marks come from the code in that question's cell"
        return [
            *rows,
            [
                Choice("feedback", "feedback", _FEEDBACK, self.feedback),
                Choice("beside", "show as well", _BESIDE, self.beside),
            ],
            [
                Button("reset", "Workbook's poles"),
                Button("ghost", "Leave a ghost", title="Keep this response in the plots, to compare others with it"),
                Button("forget", "Clear ghosts", disabled=not self.ghosts),
                Button("figure", "Figure for the report", title="Save it as PNG and SVG beside the notebook"),
                Button("keep", "Keep this design", "main", self._lab is None, keep),
            ],
        ]

    def _readouts(self, other: Design | None, margin: Margins | None, scattered: Cloud | None) -> list[Readout]:
        more = []
        if self.beside == "margins":
            more.append(pole_words.margin_rows(margin))
        if other is not None:
            more.append(pole_words.weight_rows(self.weights))
        if scattered is not None:
            more.append(pole_words.cloud_rows(scattered))
        found = self.design
        return [pole_words.verdicts(found), pole_words.gain(found, other), *more, pole_words.polynomial(found)]

    def _optimal(self) -> Design | None:
        if self.beside != "lqr":
            return None
        return with_gain(self._a, self._b, lqr(self._a, self._b, **self.weights))

    def _margins(self) -> Margins | None:
        if self.beside != "margins":
            return None
        return margins(self._a, self._b, self.design.applied)

    def _cloud(self) -> Cloud | None:
        if self.beside != "cloud":
            return None
        spread = spread_of(self._a) if self._spread is None else self._spread
        return cloud(self._a, self._b, self.design.applied, spread)

    def _where_met(self) -> list[tuple[Any, Any]]:
        asked = (self.wanted.p3, self.wanted.p4, self.feedback)
        if self._outline[0] != asked:
            self._outline = (asked, self._region.outline(*asked))
        curves: list[tuple[Any, Any]] = self._outline[1]
        return curves


def explore_poles(A: ArrayLike, B: ArrayLike, K: ArrayLike | None = None, lab: Lab | None = None) -> PoleExplorer:
    """The pole explorer, as a notebook makes it; see :class:`PoleExplorer`."""
    return PoleExplorer(A, B, K, lab)
