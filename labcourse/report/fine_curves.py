"""The curves of a figure with more of their points than an answer keeps, so that a report can show it as it was.

An answer keeps up to 200 points of a curve (:mod:`labcourse.answers.figures`), which is too few for a picture of
a vibration. When a figure is recorded, its curves are kept beside the notebooks, too, in a hidden folder that is not
handed in. It is no part of the answer: a report says where it had to do without.
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
from numpy.typing import NDArray

from labcourse import files
from labcourse.answers import bounds, figures
from labcourse.answers.json_values import read_dict, read_list, read_vector, rounded
from labcourse.answers.parts import Question
from labcourse.errors import AnswerError

if TYPE_CHECKING:
    from labcourse.answers.answers import AnswerBook

FOLDER = ".labcourse-figures"  #: beside the notebooks
_POINTS = 2000  # of a curve: a dozen to each millimetre of a page's width
_MAX_BYTES = 20_000_000  # of a file: all curves that a figure may have; 8 diagrams of 24 curves, 13 characters a number


def keep_recorded(folder: Path, question: Question, recorded: Mapping[str, Any], book: AnswerBook) -> None:
    """Keep the curves of the figures among the parts of a question that were recorded just now.

    Parameters
    ----------
    folder : of the notebooks
    question : which
    recorded : name of a part → what was given
    book : which has the answers
    """
    for name, value in recorded.items():
        content = book.get(question.number, name)
        if content and question.part(name).kind == "figure":
            keep(folder, question.number, name, value, content)


def keep(folder: Path, question: str, part: str, figure: Any, content: Mapping[str, Any]) -> None:
    """Keep the curves of a figure that was recorded just now. Where it cannot be written, nothing is kept.

    Parameters
    ----------
    folder : of the notebooks
    question, part : that it answers
    figure : as it was given
    content : the answer, as :func:`labcourse.answers.forms.encode` gave it
    """
    axes = [
        {"scales": [axis.get_xscale(), axis.get_yscale()], "lines": [_kept(line) for line in figures.most_of(lines)]}
        for axis, lines in figures.seen_diagrams(figure)
    ]
    with contextlib.suppress(OSError):
        path = _path(folder, question, part)
        path.parent.mkdir(exist_ok=True)
        files.write(path, json.dumps({"of": _digest(content), "axes": axes}))


def find(folder: Path, question: str, part: str, content: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """What was kept of the figure that an answer was made of; None if nothing was, or of another figure.

    Returns
    -------
    list
        For each diagram ``{"scales": (x, y), "lines": [{"x": array (n,), "y": array (n,)}]}``.
    """
    path = _path(folder, question, part)
    try:
        kept = read_dict(path.name, json.loads(files.read(path, _MAX_BYTES)), {"of", "axes"})
        if kept["of"] != _digest(content):
            return None
        return [_axes(one) for one in read_list("axes", kept["axes"], 1, bounds.MOST_AXES)]
    except (OSError, ValueError, RecursionError, AnswerError):
        return None


def _path(folder: Path, question: str, part: str) -> Path:
    return folder / FOLDER / f"{re.sub(r'[^A-Za-z0-9.]+', '-', f'{question} {part}')}.json"


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _kept(line: Mapping[str, Any]) -> dict[str, list[float]]:
    kept = envelope(line["y"], _POINTS)
    return {name: rounded(line[name][kept]) for name in ("x", "y")}


def envelope(values: NDArray[np.float64], most: int) -> NDArray[np.intp]:
    """Indices of at most ``most`` of the values (n,) that look like all: extremes of each stretch, and both ends."""
    if values.size <= most:
        return np.arange(values.size)
    stretches = np.array_split(np.arange(values.size), most // 2 - 1)
    extremes = [stretch[[values[stretch].argmin(), values[stretch].argmax()]] for stretch in stretches]
    return np.unique(np.concatenate([[0], *extremes, [values.size - 1]]))


def _axes(item: Any) -> dict[str, Any]:
    axis = read_dict("diagram", item, {"scales", "lines"})
    scales = ["log" if scale == "log" else "linear" for scale in read_list("scales", axis["scales"], 2, 2)]
    lines = [_line(line) for line in read_list("lines", axis["lines"], 1, bounds.MOST_LINES)]
    return {"scales": tuple(scales), "lines": lines}


def _line(item: Any) -> dict[str, NDArray[np.float64]]:
    line = read_dict("curve", item, {"x", "y"})
    x = read_vector("x", line["x"], 0, _POINTS)
    return {"x": x, "y": read_vector("y", line["y"], x.size, x.size)}
