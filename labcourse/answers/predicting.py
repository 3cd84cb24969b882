"""Predicting, step by step: what a student says before an experiment, and what they read when it is done.

Each function returns the lines to be printed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from labcourse.answers import forms
from labcourse.answers.answers import AnswerBook
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.forms import FormError, NotAnswered
from labcourse.answers.json_values import clean
from labcourse.answers.predictions import LONGEST, SAID, WHY, Foretold, beside, of_question, shown
from labcourse.errors import AnswerError


def predict(book: AnswerBook, catalogue: Catalogue, question: str, said: Mapping[str, Any]) -> list[str]:
    """Keep what is said of an experiment, unless something was said before; that stands.

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question, or not this.
    """
    known = {one.part.name: one for one in of_question(catalogue.predictions, question)}
    strange = [name for name in said if name not in known]
    if strange:
        raise AnswerError(f"Of question {question}, you can predict {', '.join(known)}, not {', '.join(strange)}.")
    book.refresh()
    if not said:
        return _overview(book, question, known)
    before = book.predicted(question).get(SAID, {})
    new: dict[str, dict[str, Any]] = {}
    lines = []
    for name, value in said.items():
        content, line = _taken(question, known[name], value, before.get(name))
        lines.append(line)
        if content is not None and name not in before:
            new[name] = content
    if new:
        book.predict(question, new)
    return lines


def _taken(
    question: str, one: Foretold, value: Any, before: dict[str, Any] | None
) -> tuple[dict[str, Any] | None, str]:
    """A prediction as plain data, None if it has not the form, and what is said to it."""
    start = f"{question}  "
    try:
        content = forms.encode(one.part, value, 0).content
    except NotAnswered:
        kept = "" if before is None else f" (you said {forms.show(one.part, before)})"
        return None, start + f"{one.part.name}  not predicted yet{kept}: {one.part.prompt}"
    except FormError as error:
        return None, start + f"{one.part.name}  not kept: {error}"
    words = forms.show(one.part, content)
    if before is None:
        return content, start + f"predicted: {words}. It stands now; run the experiment."
    if before == content:
        return content, start + f"predicted: {words}."
    return (
        content,
        start + f"You said {forms.show(one.part, before)} before, and that stands. Wrong predictions cost nothing.",
    )


def _overview(book: AnswerBook, question: str, known: Mapping[str, Foretold]) -> list[str]:
    said = {one.part.name: words for one, _value, words in shown(tuple(known.values()), book.predicted(question))}
    return [
        f"{question}  " + (f"predicted: {said[name]}." if name in said else f"{_named(one)}: {one.part.prompt}")
        for name, one in known.items()
    ]


def _named(one: Foretold) -> str:
    part = one.part
    return f"{part.name} ({', '.join(map(repr, part.choices)) or part.unit})"


def observed(
    book: AnswerBook, catalogue: Catalogue, question: str, why: str, find: Callable[[str, str], Any]
) -> list[str]:
    """What was predicted beside what was recorded; a sentence on it is kept.

    Parameters
    ----------
    why : the sentence, "" if none is given
    find : (question, part) → the answer; raises AnswerError where there is none

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question, or the sentence is none.
    """
    foretold = of_question(catalogue.predictions, question)
    if why is not None and not isinstance(why, str):
        raise AnswerError(f"why should be a sentence, text between quotes; it is a {type(why).__name__}.")
    sentence = clean(why or "").strip()
    if len(sentence) > LONGEST:
        raise AnswerError(f"One sentence is asked for: at most {LONGEST} characters.")
    if sentence and sentence != book.predicted(question).get(WHY):
        book.predict(question, {}, sentence)
    said = {one.part.name: words for one, _value, words in shown(foretold, book.predicted(question))}
    lines = []
    for one in foretold:
        seen = beside(one, find)
        if one.part.name in said:
            predicted = said[one.part.name]
            lines.append(f"{question}  You predicted {predicted}.")
        else:
            lines.append(f"{question}  You predicted nothing here.")
        if seen:
            lines.append(f"      Recorded: {seen}.")
            lines.append(f"      {one.ask}")
        else:
            missing = ", ".join(" ".join(where) for where in one.found_in)
            lines.append(f"      There is nothing to compare it with yet: answer {missing}.")
    kept = book.predicted(question).get(WHY)
    if kept:
        lines.append(f"      Your words: {kept}")
    else:
        lines.append(f'      Keep a sentence on it: lab.observed("{question}", why="...")')
    return lines


def value(book: AnswerBook, catalogue: Catalogue, question: str, name: str) -> Any:
    """What was predicted; None if nothing was.

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question.
    """
    foretold = of_question(catalogue.predictions, question)
    found = {one.part.name: value for one, value, _words in shown(foretold, book.predicted(question))}
    return found.get(name)
