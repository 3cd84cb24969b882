"""What the notebooks' code cells say: captions and descriptions of figures, printed lines, labels in plots.

The cells name these texts, and hold none: cells are code, and the same in each language, while what stands here can be
translated. Each notebook has a module of its own here, with ``FIGURES``, by their numbers, and ``LINES``, by a name.
A cell says ``figures.show(figure, **said.figure(4))`` and ``print(said("half a newton", degrees=12.3))``.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from rotflex.courseware.messages import _

_MODULES = {
    "00": "start",
    "01": "modeling_prelab",
    "02": "finding_stiffness",
    "03": "model_validation",
    "04": "modeling_results",
    "05": "control_prelab",
    "06": "control_design",
    "07": "control_simulation",
    "08": "full_state_feedback",
    "09": "partial_state_feedback",
    "10": "control_results",
}


class Texts:
    """The texts of a notebook's code cells, in the reader's language.

    Parameters
    ----------
    figures : number of a figure → "caption" (Markdown), and "alt", its description, where it does not bring one
    lines : name → text, with the names of values in braces
    """

    def __init__(self, figures: Mapping[int, Mapping[str, str]], lines: Mapping[str, str]) -> None:
        self._figures = figures
        self._lines = lines

    def __call__(self, name: str, /, **values: Any) -> str:
        """A text by its name, with values put in."""
        text = _(self._lines[name])
        return text.format(**values) if values else text

    def figure(self, number: int) -> dict[str, str]:
        """Caption and description of a figure, as ``figures.show`` takes them."""
        return {what: _(text) for what, text in self._figures[number].items()}


def of(notebook: str) -> Texts:
    """The texts of a notebook, by the number that its name begins with: "02"."""
    module = importlib.import_module(f"{__name__}.{_MODULES[notebook]}")
    return Texts(module.FIGURES, module.LINES)
