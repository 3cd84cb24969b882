"""Where a student's class begins: what is asked of it, and what is given to it (:mod:`labcourse.answers.starts`)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from labcourse.answers import forms, starts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.reflection import Check
from labcourse.answers.starts import Where


class Beginning:
    """Where a student's class begins.

    Parameters
    ----------
    course : what ``course.json`` says
    whole : the course's catalogue
    session : whose bench the values are of, where the course does not bring them

    Attributes
    ----------
    whole : as given
    start : where it is in the middle; None at the beginning
    catalogue : of what is asked

    Raises
    ------
    ConfigurationError
        If ``course.json`` cannot be understood.
    """

    def __init__(self, course: Mapping[str, Any], whole: Catalogue, session: Any) -> None:
        self.whole, self._session = whole, session
        self.start = starts.chosen(course, whole)
        self.catalogue = starts.narrowed(whole, self.start)
        self._values = None if self.start is None else starts.values_in(course, self.start)
        self._told: set[Where] = set()

    def is_given(self, question: str, part: str) -> bool:
        """Whether the value of a part is given."""
        return self.start is not None and (question, part) in self.start.gives

    def is_asked(self, question: str, part: str) -> bool:
        """Whether a part is asked."""
        found = self.catalogue.everything.get(question)
        return found is not None and part in found.names

    def content(self, question: str, part: str) -> dict[str, Any] | None:
        """A given value as the plain data of an answer; None of what is not given."""
        if self.start is None or not self.is_given(question, part):
            return None
        if self._values is None:
            assert self.start.on_own_bench is not None  # or the release would bring them
            self._values = self.start.on_own_bench(self._session)
        wanted, seed = self.whole.find(question).part(part), self._session.book.probe_seed
        return forms.encode(wanted, self._values[question, part], seed).content

    def tell(self, question: str, part: str) -> None:
        """Print, once, that a value is given."""
        if self.is_given(question, part) and (question, part) not in self._told:
            self._told.add((question, part))
            print(f"{question}  {part}  is given to your class; it is not asked")

    def tell_unasked(self, question: str, part: str) -> bool:
        """Print of a part that is not asked that it is so; whether it is."""
        if not self.is_asked(question, part):
            print(f"{question}  {part}  is not asked in your class")
        return not self.is_asked(question, part)

    def sorted_out(self, question: str, parts: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
        """Parts of an answer that are asked, and a line on those that are not. AnswerError if there is no such part."""
        names = [name for name in parts if self.whole.find(question).part(name) and not self.is_asked(question, name)]
        told = f"{question}  not asked in your class: {', '.join(names)}"
        return {name: value for name, value in parts.items() if name not in names}, [told] if names else []

    def possible(self, checks: Iterable[Check]) -> list[Check]:
        """Those checks of own answers against each other of which all is asked or given."""
        return [one for one in checks if all(self.is_asked(*part) or self.is_given(*part) for part in one.about)]

    def lines(self) -> Iterable[str]:
        """What to say of it at the beginning of a session."""
        if self.start is not None:
            named = ", ".join(f"{question} {part}" for question, part in self.start.gives)
            yield (
                f"Given     {self.start.title} ({named}). Notebooks that your course does not have: "
                f"{', '.join(self.start.skips)}."
            )
