"""Reduce a course for a class: leave out optional notebooks, or begin in the middle.

A course lists in its catalogue which notebooks are optional. The course's settings choose those that a class has, and
``course.json`` then has them under ``"optional"``. Nothing is asked of the others.

A class that begins in the middle is given the results of the notebooks that it skips. A course lists in its catalogue
where a class may begin. The course's settings choose one of these, and ``course.json`` then has
``"given": {"from": name, "values": {question: {part: value}}}``. It has no values if each student has a bench of their
own: then their session works them out. Given values are not asked, and neither are the other questions of skipped
notebooks, entries of tables that repeat such an answer, and rows of reports that use only such answers. A given value
replaces what a student records: later answers are marked as following from it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from labcourse import course_file
from labcourse.answers import forms
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question, ReportItem, Where
from labcourse.answers.reflection import Check
from labcourse.errors import ConfigurationError

GIVEN, OPTIONAL = "given", "optional"  #: in course.json
Values = Mapping[Where, Any]


@dataclass(frozen=True)
class Start:
    """Where a class may begin.

    Attributes
    ----------
    name : in the settings, as "speed"
    gives : (question, part) of each given value; their notebooks are skipped
    skips : notebooks that are not handed out
    title : what is given, for students
    on_own_bench : the student's session → the values, where each student has a bench of their own; None where only
        the solutions can work them out, so that everybody needs the same bench
    """

    name: str
    gives: tuple[Where, ...]
    skips: tuple[str, ...]
    title: str
    on_own_bench: Callable[[Any], Values] | None = None

    def asks(self, catalogue: Catalogue, question: Question, part: Part) -> bool:
        """Check whether a class that begins here is asked a part."""
        if question.notebook in self.skips or (question.number, part.name) in self.gives:
            return False
        return part.shows is None or self.asks_any(catalogue, part.shows)

    def asks_any(self, catalogue: Catalogue, where: Where) -> bool:
        """Check whether such a class is asked a part, or, without its name, any part of the question."""
        number, name = where
        question = catalogue.everything[number]
        wanted = [question.part(name)] if name else question.parts
        return any(self.asks(catalogue, question, part) for part in wanted)

    def keeps(self, catalogue: Catalogue, item: ReportItem) -> bool:
        """Check whether the reports of such a class have a row."""
        if catalogue.reports[item.report].notebook in self.skips:
            return False
        return not item.shows or any(self.asks_any(catalogue, where) for where in item.shows)


def find(catalogue: Catalogue, name: str) -> Start:
    """Find a start by its name. Raises ConfigurationError if the course has no such start."""
    for start in catalogue.starts:
        if start.name == name:
            return start
    known = ", ".join(f'"{start.name}"' for start in catalogue.starts) or "none"
    raise ConfigurationError(f"In this course, a class can be given {known}, not {name!r:.80}.")


def chosen(course: Mapping[str, Any], catalogue: Catalogue) -> Start | None:
    """Return the start that a ``course.json`` names; None if the class begins at the beginning.

    Raises
    ------
    ConfigurationError
        If its entry is broken.
    """
    given = course.get(GIVEN)
    if given is None:
        return None
    if not isinstance(given, Mapping) or not isinstance(given.get("from"), str):
        raise ConfigurationError(f'"given" should be as {{"from": "…"}}; it is {given!r:.80}.')
    return find(catalogue, given["from"])


def as_json(start: Start, values: Values | None) -> dict[str, Any]:
    """Return the entry "given" of ``course.json``. Without values, each student's session works them out."""
    if values is None:
        return {"from": start.name}
    plain_values: dict[str, dict[str, Any]] = {}
    for question, part in start.gives:
        plain_values.setdefault(question, {})[part] = np.asarray(values[question, part]).tolist()
    return {"from": start.name, "values": plain_values}


def values_in(course: Mapping[str, Any], start: Start) -> Values | None:
    """Return the given values in a ``course.json``; None if it has none.

    Raises
    ------
    ConfigurationError
        If some are missing.
    """
    values = course[GIVEN].get("values")
    if values is None:
        return None
    try:
        given = {(question, part): values[question][part] for question, part in start.gives}
    except (KeyError, TypeError):
        raise ConfigurationError('course.json: values are missing in "given".') from None
    return {where: np.array(value) if isinstance(value, list) else value for where, value in given.items()}


def narrowed(catalogue: Catalogue, start: Start | None) -> Catalogue:
    """Reduce a catalogue to the questions for a class that begins at a start; without one, return it unchanged."""
    if start is None:
        return catalogue

    def asked(questions: Collection[Question]) -> Iterator[Question]:
        for question in questions:
            parts = tuple(part for part in question.parts if start.asks(catalogue, question, part))
            if parts:
                yield replace(question, parts=parts)

    items = [
        replace(item, shows=tuple(where for where in item.shows if start.asks_any(catalogue, where)))
        for item in catalogue.report_items
        if start.keeps(catalogue, item)
    ]
    reports = {item.report for item in items}
    return Catalogue(
        asked(catalogue.questions.values()),
        warm_up=asked(catalogue.warm_up.values()),
        tables=asked(catalogue.tables.values()),
        report_items=items,
        reports={
            number: (report.section, report.notebook, report.title)
            for number, report in catalogue.reports.items()
            if number in reports
        },
        outcomes=catalogue.outcomes,
        predictions={
            number: predictable
            for number, predictable in catalogue.predictions.items()
            if catalogue.everything[number].notebook not in start.skips
        },
        starts=catalogue.starts,
        optional=catalogue.optional,
        whole=catalogue.whole,
    )


def with_optional(catalogue: Catalogue, names: Collection[str]) -> Catalogue:
    """Reduce a catalogue to the questions for a class that has these optional notebooks, and no others."""
    off = tuple(name for name in catalogue.optional if name not in names)
    return narrowed(catalogue, Start("", (), off, "") if off else None)


def handed_out(catalogue: Catalogue, course: Mapping[str, Any]) -> Catalogue:
    """Reduce a catalogue to the questions of a release, by its ``course.json``. A checkout is no release: it has all.

    Raises
    ------
    ConfigurationError
        If the entry "optional" is broken.
    """
    names = course.get(OPTIONAL, [] if course_file.RELEASE in course else catalogue.optional)
    if not isinstance(names, list | tuple):
        raise ConfigurationError(f'"optional" should be a list of names of notebooks; it is {names!r:.80}.')
    return with_optional(catalogue, names)


class Beginning:
    """Where a student's class begins: what it is asked, and the values that it is given.

    Parameters
    ----------
    course : content of ``course.json``
    catalogue : of the course
    session : works out the values of the student's own bench, if the course does not bring them

    Attributes
    ----------
    whole : the questions of the release
    start : where it begins; None for at the beginning
    catalogue : what is asked

    Raises
    ------
    ConfigurationError
        If the entry in ``course.json`` is broken.
    """

    def __init__(self, course: Mapping[str, Any], catalogue: Catalogue, session: Any) -> None:
        self.whole, self._session = handed_out(catalogue, course), session
        self.start = chosen(course, self.whole)
        self.catalogue = narrowed(self.whole, self.start)
        self._values = None if self.start is None else values_in(course, self.start)
        self._announced: set[Where] = set()

    @property
    def skips(self) -> tuple[str, ...]:
        """The notebooks that the class does not have."""
        return () if self.start is None else tuple(self.start.skips)

    def is_given(self, question: str, part: str) -> bool:
        """Check whether the value of a part is given."""
        return self.start is not None and (question, part) in self.start.gives

    def is_asked(self, question: str, part: str) -> bool:
        """Check whether a part is asked."""
        asked = self.catalogue.everything.get(question)
        return asked is not None and part in asked.names

    def content(self, question: str, part: str) -> dict[str, Any] | None:
        """Return a given value as the JSON data of an answer; None if it is not given."""
        if self.start is None or not self.is_given(question, part):
            return None
        if self._values is None:
            assert self.start.on_own_bench is not None  # or the release would bring them
            self._values = self.start.on_own_bench(self._session)
        wanted, seed = self.whole.find(question).part(part), self._session.book.probe_seed
        return forms.encode(wanted, self._values[question, part], seed).content

    def announce(self, question: str, part: str) -> None:
        """Print, once, that a value is given."""
        if self.is_given(question, part) and (question, part) not in self._announced:
            self._announced.add((question, part))
            print(f"{question}  {part}  is given to your class; it is not asked")

    def split(self, question: str, parts: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
        """Return the parts of an answer that are asked, and a message about the others.

        Raises
        ------
        AnswerError
            If the course has no such part.
        """
        others = [name for name in parts if self.whole.find(question).part(name) and not self.is_asked(question, name)]
        message = f"{question}  not asked in your class: {', '.join(others)}"
        return {name: value for name, value in parts.items() if name not in others}, [message] if others else []

    def possible(self, checks: Iterable[Check]) -> list[Check]:
        """Return the checks of own answers that need only parts that are asked or given."""
        return [
            check for check in checks if all(self.is_asked(*where) or self.is_given(*where) for where in check.about)
        ]

    def lines(self) -> list[str]:
        """Return what a session prints about it when it begins."""
        if self.start is None:
            return []
        named, skipped = ", ".join(map(" ".join, self.start.gives)), ", ".join(self.start.skips)
        return [f"Given     {self.start.title} ({named}). Notebooks that your course does not have: {skipped}."]
