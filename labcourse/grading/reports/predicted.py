"""What a student predicted of experiments, by their own word: read strictly from the run's answers, never marked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from labcourse.answers import answers, forms, predictions
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.json_values import clean
from labcourse.errors import AnswerError
from labcourse.grading.gradebook import RunRecord


@dataclass(frozen=True)
class Predicted:
    """What was predicted of a question's experiment.

    Attributes
    ----------
    lines : what was predicted, each beside what was recorded
    why : what the student thought of it afterwards; "" if they did not say
    """

    lines: tuple[str, ...]
    why: str


def predicted(run: RunRecord | None, catalogue: Catalogue) -> dict[str, Predicted]:
    """Number of a question → what was predicted of it, where anything was."""
    if run is None or not catalogue.predictions:
        return {}
    try:
        content = answers.parse(run.answers or b"")
    except AnswerError:
        return {}
    kept = content.get(predictions.SECTION, {})
    find = partial(_answer, content["answers"], catalogue)
    found = {}
    for number, foretold in catalogue.predictions.items():
        about = kept.get(number, {})
        lines = []
        for one, _value, words in predictions.read(foretold, about):
            seen = predictions.describe_result(one, find)
            lines.append(f"{words}; recorded: {seen}" if seen else words)
        why = clean(about.get("why", ""))
        if lines or why:
            found[number] = Predicted(tuple(lines), why)
    return found


def _answer(given: dict[str, Any], catalogue: Catalogue, question: str, part: str) -> Any:
    """An answer of the run. Raises AnswerError where there is none, or none that can be read."""
    return forms.decode(catalogue.everything[question].part(part), given.get(question, {}).get(part))
