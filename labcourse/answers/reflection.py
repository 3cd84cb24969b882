"""Let students reflect on their work: predictions of experiments, and own answers compared with each other.

Neither is ever marked, and the correct answers are not used.

A course declares what can be predicted (:class:`Predictable`, in its catalogue). A prediction is recorded once, and
shown beside the recorded result. In ``answers.json`` it is ``{question: {"said": {name: answer}, "why": sentence}}``.
Whether it was made before the experiment cannot be checked. The functions of a session return the lines to be printed.

A course also defines :class:`Comparison` objects; a student's session fills in the answers. Answers that do not agree
become questions to the student, never verdicts. ``course.json`` may switch this off, or allow it from some time on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse.answers import forms, json_values
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.forms import FormError, NotAnswered
from labcourse.answers.json_values import clean
from labcourse.answers.parts import Predictable
from labcourse.course_file import OFF, ON, REFLECT
from labcourse.errors import AnswerError, ConfigurationError, CourseError
from labcourse.messages import number_of
from labcourse.problems import Where

if TYPE_CHECKING:
    from labcourse.answers.answers import AnswerBook


SECTION = "predictions"  #: of answers.json
Predictions = Mapping[str, tuple[Predictable, ...]]
FindAnswer = Callable[[str, str], Any]  #: (question, part) → the answer; raises AnswerError where there is none


def of_question(predictions: Predictions, question: Any) -> dict[str, Predictable]:
    """Return what can be predicted of a question's experiment, by name.

    Raises
    ------
    AnswerError
        If nothing can; the message names the questions of which something can.
    """
    predictable = predictions.get(question) if isinstance(question, str) else None
    if not predictable:
        raise AnswerError(
            f"Nothing is predicted of {question!r:.40}; there is something to predict of "
            f"{', '.join(predictions) or 'no question'}."
        )
    return {item.part.name: item for item in predictable}


def read(predictable: Iterable[Predictable], stored: Mapping[str, Any]) -> Iterator[tuple[Predictable, Any, str]]:
    """Read stored predictions: what can be predicted, the prediction, and a description. Skip unreadable ones.

    Parameters
    ----------
    predictable : what can be predicted of the question
    stored : what ``answers.json`` has of it
    """
    for item in predictable:
        content = stored.get("said", {}).get(item.part.name)
        try:
            yield item, forms.decode(item.part, content), forms.show(item.part, content)
        except AnswerError:
            continue


def describe_result(item: Predictable, find: FindAnswer) -> str | None:
    """Describe the recorded result of something that can be predicted; None without recordings.

    Parameters
    ----------
    item : what was predicted
    find : (question, part) → the answer; raises AnswerError where there is none
    """
    try:
        seen = item.seen(*(find(*where) for where in item.found_in))
        return forms.show(item.part, forms.encode(item.part, seen, 0).content)
    except (AnswerError, ArithmeticError, LookupError, ValueError):
        return None


def predict(book: AnswerBook, predictions: Predictions, question: str, values: Mapping[str, Any]) -> list[str]:
    """Record what is predicted of an experiment, unless something was predicted before; that stands.

    Parameters
    ----------
    values : name → prediction; without any, it is shown what can be predicted, and what was

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question, or not this.
    """
    items = of_question(predictions, question)
    unknown = [name for name in values if name not in items]
    if unknown:
        raise AnswerError(f"Of question {question}, you can predict {', '.join(items)}, not {', '.join(unknown)}.")
    book.refresh()
    return [f"{question}  {_reply(book, question, items[name], values.get(name))}" for name in values or items]


def _reply(book: AnswerBook, question: str, item: Predictable, value: Any) -> str:
    """Record a prediction that has the form of its part, unless there is an earlier one, and return the reply."""
    part, stored = item.part, book.predicted(question)
    earlier = next((text for _item, _value, text in read([item], stored)), None)
    if earlier is None and part.name in stored.get("said", {}):
        return f"{part.name}  predicted before, in a form that this release cannot read; it stands."
    asked = f"{part.name}  not predicted yet ({', '.join(map(repr, part.choices)) or part.unit}): {part.prompt}"
    try:
        content = forms.encode(part, value, 0).content
    except NotAnswered:
        return f"predicted: {earlier}." if earlier else asked
    except FormError as error:
        return f"{part.name}  not recorded: {error}"
    if earlier is None:
        book.predict(question, {part.name: content})
        return f"predicted: {forms.show(part, content)}. It stands now; run the experiment."
    if stored["said"][part.name] != content:
        return f"You said {earlier} before, and that stands. Wrong predictions cost nothing."
    return f"predicted: {earlier}."


def observed(book: AnswerBook, predictions: Predictions, question: str, why: str, find: FindAnswer) -> list[str]:
    """Show what was predicted beside what was recorded, and record a sentence about it.

    Parameters
    ----------
    why : the sentence, "" if none is given
    find : (question, part) → the answer; raises AnswerError where there is none

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question, or ``why`` is not a sentence.
    """
    items = of_question(predictions, question)
    if not isinstance(why, str | None):
        raise AnswerError(f"why should be a sentence, text between quotes; it is a {type(why).__name__}.")
    sentence = clean(why or "").strip()
    if len(sentence) > json_values.LONGEST_SENTENCE:
        raise AnswerError(f"One sentence is asked for: at most {json_values.LONGEST_SENTENCE} characters.")
    if sentence and sentence != book.predicted(question).get("why"):
        book.predict(question, {}, sentence)
    stored = book.predicted(question)
    predicted = {item.part.name: text for item, _value, text in read(items.values(), stored)}
    lines = []
    for name, item in items.items():
        lines.append(f"{question}  You predicted {predicted.get(name, 'nothing here')}.")
        if result := describe_result(item, find):
            lines += [f"      Recorded: {result}.", f"      {item.ask}"]
        else:
            missing = ", ".join(map(" ".join, item.found_in))
            lines.append(f"      There is nothing to compare it with yet: answer {missing}.")
    if sentence := stored.get("why", ""):
        return [*lines, f"      Your explanation: {sentence}"]
    return [*lines, f'      Write one sentence on it: lab.observed("{question}", why="...")']


def value(book: AnswerBook, predictions: Predictions, question: str, name: str) -> Any:
    """Return what was predicted; None if nothing was.

    Raises
    ------
    AnswerError
        If nothing can be predicted of the question.
    """
    predicted = read(of_question(predictions, question).values(), book.predicted(question))
    return {item.part.name: value for item, value, _text in predicted}.get(name)


# --- own answers, compared with each other ---------------------------------------------------------------------------

#: What a check may raise for some student's numbers.
_COMPUTATION_ERRORS = (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError, CourseError)


@dataclass(frozen=True)
class Comparison:
    """A comparison of a student's own answers.

    Attributes
    ----------
    about : the answers that it needs, (question, part)
    ask : their values, in that order → a question to the student; None if they agree
    """

    about: tuple[Where, ...]
    ask: Callable[..., str | None]

    @property
    def questions(self) -> list[str]:
        """The numbers of its questions, each once."""
        return list(dict.fromkeys(question for question, _part in self.about))


@dataclass
class Reflection:
    """The result of some checks.

    Attributes
    ----------
    asked : numbers of the questions to look at, and the question to the student
    compared : how many checks were made
    missing : answers that are not there yet, or cannot be read; each once, as a key
    unclear : numbers of the questions for which a check failed to compute; each once, as a key
    """

    asked: list[tuple[list[str], str]] = field(default_factory=list)
    compared: int = 0
    missing: dict[Where, None] = field(default_factory=dict)
    unclear: dict[str, None] = field(default_factory=dict)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterable[str]:
        """Describe the result, a line for each question to the student."""
        if self.asked:
            more = " Begin with the first: others may go away with it." if self.asked[1:] else ""
            agreed = self.compared - len(self.asked)
            well = f"In {agreed} of {number_of(self.compared, 'comparison')}, your answers agree. " if agreed else ""
            yield f"{well}{number_of(len(self.asked), 'question')}, from your own answers alone.{more}"
            for numbers, text in self.asked:
                yield f"  {', '.join(numbers)}: {text}"
        elif self.compared:
            compared = number_of(self.compared, "comparison")
            yield f"Your answers agree with each other ({compared}). This does not show that they are right."
        if self.unclear:
            yield (
                f"Nothing can be computed from your answers to {', '.join(self.unclear)}. Are these numbers "
                "very large or zero?"
            )
        if self.missing:
            missing = ", ".join(f"{question} {part}" for question, part in self.missing)
            yield f"Not compared yet, as there is no answer: {missing}."
        if not (self.asked or self.compared or self.unclear or self.missing):
            yield "There is nothing here to compare."


def reflect(checks: Iterable[Comparison], find: FindAnswer) -> Reflection:
    """Compare a student's own answers with each other.

    Parameters
    ----------
    checks : of the course, in order
    find : (question, part) → the answer; raises AnswerError if there is none
    """
    result = Reflection()
    for check in checks:
        values = []
        for where in check.about:
            try:
                values.append(find(*where))
            except AnswerError:
                result.missing[where] = None
        if len(values) < len(check.about):
            continue
        try:
            with np.errstate(all="ignore"):
                text = check.ask(*values)
        except _COMPUTATION_ERRORS:
            result.unclear |= dict.fromkeys(check.questions)
            continue
        result.compared += 1
        if text:
            result.asked.append((check.questions, text))
    return result


def of_notebooks(checks: Iterable[Comparison], catalogue: Catalogue, numbers: Iterable[str]) -> list[Comparison]:
    """Select the checks that are possible when some notebooks are done: their last answer is asked there.

    Parameters
    ----------
    checks : of the course
    catalogue : says where questions are asked
    numbers : beginnings of the notebooks' names, as "02"; all unless given

    Raises
    ------
    AnswerError
        If there is no such notebook.
    """
    notebooks = catalogue.find_notebooks(*numbers)

    def last_notebook(check: Comparison) -> str:
        return max(catalogue.everything[number].notebook for number in check.questions)

    return [check for check in checks if last_notebook(check) in notebooks]


# --- the setting ------------------------------------------------------------------------------------------------------


def silence(course: Mapping[str, Any], now: datetime) -> str | None:
    """Return why answers are not compared now; None if they are.

    Parameters
    ----------
    course : content of ``course.json``
    now : with its time zone

    Raises
    ------
    ConfigurationError
        If the setting is not valid.
    """
    setting = course.get(REFLECT, ON)
    if setting == ON:
        return None
    if setting == OFF:
        return "Your instructor has switched this off. Everything else works without it."
    try:
        opens = datetime.fromisoformat(setting)  # of a date alone: midnight
    except (TypeError, ValueError):
        raise ConfigurationError(
            f'course.json: "{REFLECT}" should be "on", "off" or a date as "2026-12-01"; it is {setting!r:.80}.'
        ) from None
    opens = opens if opens.tzinfo else opens.astimezone()
    return None if now >= opens else f"Your instructor allows this from {opens:%Y-%m-%d %H:%M} on."
