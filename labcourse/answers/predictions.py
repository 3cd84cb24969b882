"""What a student expects of an experiment, said before it: locked, shown beside what was recorded, never marked.

A course declares what can be predicted (:class:`Foretold`, in its catalogue). What a student says is kept in
``answers.json``, ``{question: {"said": {name: answer}, "why": words}}``; that it was said before the experiment is
their word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.answers import forms
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError

SECTION = "predictions"  #: of answers.json
SAID, WHY = "said", "why"
KINDS = ("number", "choice")  #: what can be predicted
LONGEST = 1000  #: characters: a sentence, and a few more


@dataclass(frozen=True)
class Foretold:
    """Something that can be predicted of an experiment.

    Attributes
    ----------
    part : its name, kind ("number" or "choice"), unit and choices, and what is asked; it is worth no points
    found_in : answers, (question, part), that show it once the experiment is done
    seen : these answers → what they show, a number in the part's unit or one of its choices
    ask : what to think about when both are there
    """

    part: Part
    found_in: tuple[tuple[str, str], ...]
    seen: Callable[..., Any]
    ask: str


def well_formed(section: Any) -> bool:
    """Whether the section of an ``answers.json`` has its outer form."""
    return isinstance(section, dict) and all(
        isinstance(kept, dict)
        and kept.keys() <= {SAID, WHY}
        and isinstance(kept.get(SAID, {}), dict)
        and all(isinstance(content, dict) for content in kept.get(SAID, {}).values())
        and isinstance(kept.get(WHY, ""), str)
        and len(kept.get(WHY, "")) <= LONGEST
        for kept in section.values()
    )


def of_question(predictions: Mapping[str, tuple[Foretold, ...]], question: Any) -> tuple[Foretold, ...]:
    """What can be predicted of a question's experiment.

    Raises
    ------
    AnswerError
        If nothing can; the message names the questions of which something can.
    """
    found = predictions.get(question) if isinstance(question, str) else None
    if not found:
        raise AnswerError(
            f"Nothing is predicted of {question!r:.40}; there is something to predict of "
            f"{', '.join(predictions) or 'no question'}."
        )
    return found


def shown(foretold: tuple[Foretold, ...], kept: Mapping[str, Any]) -> Iterator[tuple[Foretold, Any, str]]:
    """What was predicted, strictly read: what, the value, and the value in words. What cannot be read is left out.

    Parameters
    ----------
    foretold : what can be predicted of the question
    kept : what ``answers.json`` has of it
    """
    said = kept.get(SAID, {})
    for one in foretold:
        if one.part.name in said:
            try:
                value = forms.decode(one.part, said[one.part.name])
            except AnswerError:
                continue
            yield one, value, forms.show(one.part, said[one.part.name])


def beside(one: Foretold, find: Callable[[str, str], Any]) -> str:
    """What the recordings show of it, in words; "" where there are none yet.

    Parameters
    ----------
    one : what was predicted
    find : (question, part) → the answer; raises AnswerError where there is none
    """
    try:
        found = one.seen(*(find(*where) for where in one.found_in))
        return forms.show(one.part, forms.encode(one.part, found, 0).content)
    except (AnswerError, ArithmeticError, LookupError, ValueError):
        return ""
