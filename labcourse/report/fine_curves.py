"""The curves of a recorded figure with more points than an answer keeps, so that a report can show them as they were.

An answer keeps up to 200 points of a curve (:mod:`labcourse.answers.figures`), too few for a picture of a vibration. So
the curves are also saved beside the notebooks, in a hidden folder that is not handed in. The answer does not need them.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse import files
from labcourse.answers import figures
from labcourse.answers.json_values import rounded, thin
from labcourse.answers.parts import Question

if TYPE_CHECKING:
    from labcourse.answers.answers import AnswerBook

FOLDER = ".labcourse-figures"  #: beside the notebooks
_POINTS = 10_000  # of a curve: 20 s of 500 samples per second
_MAX_BYTES = 50_000_000  # of a file: 8 diagrams of 24 curves, 13 characters a number


def keep_recorded(folder: Path, question: Question, recorded: Mapping[str, Any], book: AnswerBook) -> None:
    """Save the curves of the figures that were recorded just now. If they cannot be written, nothing is saved.

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
        axes = [
            {"scales": [axis.get_xscale(), axis.get_yscale()], "lines": list(map(_thinned, figures.most_of(lines)))}
            for axis, lines in figures.seen_diagrams(value)
        ]
        with contextlib.suppress(OSError):
            path = _path(folder, question.number, name)
            path.parent.mkdir(exist_ok=True)
            files.write(path, json.dumps({"of": _digest(content), "axes": axes}))


def refined(
    folder: Path, question: str, part: str, content: Mapping[str, Any], axes: list[dict[str, Any]]
) -> tuple[list[dict[str, Any]], bool]:
    """Return the diagrams of an answer with all points that were saved, and whether none are missing.

    Parameters
    ----------
    folder : of the notebooks
    question, part : that the figure answers
    content : the stored answer
    axes : its diagrams, as :func:`labcourse.answers.forms.decode` returns them
    """
    try:
        saved = json.loads(files.read(_path(folder, question, part), _MAX_BYTES))
        if saved["of"] != _digest(content):
            raise ValueError("of another figure")
        for axis, fine in zip(axes, saved["axes"], strict=True):
            axis["scales"] = fine["scales"]
            for line, points in zip(axis["lines"], fine["lines"], strict=True):
                line |= {name: np.array(points[name], dtype=float) for name in ("x", "y")}
        return axes, True
    except (OSError, ValueError, TypeError, KeyError):
        return axes, not any(line["n"] > line["x"].size for axis in axes for line in axis["lines"])


def _path(folder: Path, question: str, part: str) -> Path:
    return folder / FOLDER / f"{re.sub(r'[^A-Za-z0-9.]+', '-', f'{question} {part}')}.json"


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _thinned(line: Mapping[str, Any]) -> dict[str, list[float]]:
    places = thin(line["n"], _POINTS)
    return {name: rounded(line[name][places]) for name in ("x", "y")}
