"""Recorded figures for a report, as the student drew them.

An answer keeps up to 200 points of a curve (:mod:`labcourse.answers.figures`), too few for a picture of a vibration. So
each figure is also saved as SVG when it is recorded, in a hidden folder beside the notebooks that is not handed in. The
answer does not need it: where it is missing, the report has the curves that the answer keeps.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse import files
from labcourse.answers import figures
from labcourse.answers.parts import Question

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from labcourse.answers.answers import AnswerBook

FOLDER = ".labcourse-figures"  #: beside the notebooks
_MAX_BYTES = 5_000_000  # of an SVG: a hundred thousand points
_LARGEST = 1e300  # no axis goes so far; beyond, differences are infinite
_DIGITS = 16  # of a digest, in the name of a file
#: The same figure is the same file, and its letters are paths: no font of the reader's computer is needed.
_STYLE: Any = {"svg.hashsalt": "report", "svg.fonttype": "path"}


def keep_recorded(folder: Path, question: Question, recorded: Mapping[str, Any], book: AnswerBook) -> None:
    """Save the figures that were recorded just now. One that cannot be drawn or written is not saved.

    Parameters
    ----------
    folder : of the notebooks
    question : that was answered
    recorded : name of a part → the value that was given
    book : with the answers
    """
    for name, value in recorded.items():
        content = book.get(question.number, name)
        if not content or question.part(name).kind != "figure":
            continue
        with contextlib.suppress(Exception):  # whatever a student's figure leads to: its answer is recorded already
            path, older = _path(folder, question.number, name, content)
            svg = _svg(figures.figure_of(value))
            if len(svg) <= _MAX_BYTES:
                path.parent.mkdir(exist_ok=True)
                for file in path.parent.glob(older):
                    file.unlink()
                files.write(path, svg)


def drawing(
    folder: Path, question: str, part: str, content: Mapping[str, Any], axes: Sequence[Mapping[str, Any]]
) -> tuple[str, bool]:
    """Return the SVG of a recorded figure, and whether it is the student's own.

    Parameters
    ----------
    folder : of the notebooks
    question, part : that the figure answers
    content : the stored answer
    axes : its diagrams, as :func:`labcourse.answers.forms.decode` returns them; drawn if nothing is saved
    """
    with contextlib.suppress(OSError, UnicodeDecodeError):
        return files.read(_path(folder, question, part, content)[0], _MAX_BYTES).decode(), True
    from matplotlib.figure import Figure  # it takes a moment

    from labcourse import pictures

    with pictures.style():
        figure = Figure(figsize=(pictures.WIDTH, 1 + 1.8 * len(axes)), layout="constrained")
        for ax, axis in zip(figure.subplots(len(axes), squeeze=False)[:, 0], axes, strict=True):
            for line in axis["lines"]:
                x, y = (np.clip(line[name], -_LARGEST, _LARGEST) for name in ("x", "y"))
                ax.plot(x, y, label=_plain(line["label"]) or None)
            if any(line["label"] for line in axis["lines"]):
                ax.legend()
            longest = max((line["x"] for line in axis["lines"]), key=len)
            ax.set_xscale("log" if figures.evenly_logarithmic(longest) else "linear")
            ax.set(**{name: _plain(axis[name]) for name in ("title", "xlabel", "ylabel")})
        return _svg(figure), False


def _plain(label: str) -> str:
    """Return a label without TeX, which matplotlib might refuse."""
    return figures.readable(label).replace("$", r"\$")


def _svg(figure: Figure) -> str:
    import matplotlib as mpl

    drawn = io.StringIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(drawn, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    return drawn.getvalue()


def _path(folder: Path, question: str, part: str, content: Mapping[str, Any]) -> tuple[Path, str]:
    """Return where the figure of an answer is saved, and a pattern for all files of its part."""
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:_DIGITS]
    name = re.sub(r"[^A-Za-z0-9.]+", "-", f"{question} {part}")
    return folder / FOLDER / f"{name}.{digest}.svg", f"{name}.{'[0-9a-f]' * len(digest)}.svg"
