"""Beginning a course in the middle: what is given to a class that skips the notebooks before, and what is then asked.

A course says in its catalogue where a class may begin; its settings choose one, which stands in ``course.json`` as
``"given": {"from": name, "values": {question: {part: value}}}``. Values are there where everybody has the same bench;
of a bench of their own, a student's session works them out. What is given is not asked, nor is anything else of the
notebooks that are skipped, an entry of a table that carries such an answer over, or a row of a report that rests on
such answers alone. Given values hold whatever a student records: later answers are marked as following from them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question, ReportItem
from labcourse.errors import ConfigurationError

GIVEN = "given"  #: in course.json
Where = tuple[str, str]  # question and part
Values = Mapping[Where, Any]


@dataclass(frozen=True)
class Start:
    """Where a class may begin.

    Attributes
    ----------
    name : in the settings, as "speed"
    gives : (question, part) of what is given, each of a notebook that is skipped
    skips : notebooks that are not handed out
    title : what is given, in words
    on_own_bench : the student's session → the values, where each student has a bench of their own; None where that
        cannot be worked out without what the course asks for, so that everybody needs the same bench
    """

    name: str
    gives: tuple[Where, ...]
    skips: tuple[str, ...]
    title: str
    on_own_bench: Callable[[Any], Values] | None = None

    def asks(self, catalogue: Catalogue, question: Question, part: Part) -> bool:
        """Whether a part is asked of a class that begins here."""
        if question.notebook in self.skips or (question.number, part.name) in self.gives:
            return False
        return part.shows is None or self._asks(catalogue, part.shows)

    def _asks(self, catalogue: Catalogue, where: Where) -> bool:
        number, name = where
        question = catalogue.everything[number]
        wanted = [question.part(name)] if name else question.parts
        return any(self.asks(catalogue, question, part) for part in wanted)

    def keeps(self, catalogue: Catalogue, item: ReportItem) -> bool:
        """Whether a row of a report is there for such a class."""
        if catalogue.reports[item.report].notebook in self.skips:
            return False
        return not item.shows or any(self._asks(catalogue, where) for where in item.shows)


def find(catalogue: Catalogue, name: str) -> Start:
    """The start of a name. Raises ConfigurationError if the course has none."""
    for start in catalogue.starts:
        if start.name == name:
            return start
    there = ", ".join(f'"{start.name}"' for start in catalogue.starts) or "none"
    raise ConfigurationError(
        f"A class can begin with what is given as {there} in this course, and not with {name!r:.80}."
    )


def chosen(course: Mapping[str, Any], catalogue: Catalogue) -> Start | None:
    """Where a ``course.json`` lets students begin; None for at the beginning.

    Raises
    ------
    ConfigurationError
        If it cannot be understood.
    """
    said = course.get(GIVEN)
    if said is None:
        return None
    if not isinstance(said, Mapping) or not isinstance(said.get("from"), str):
        raise ConfigurationError(f'"given" should be as {{"from": "…"}}; it is {said!r:.80}.')
    return find(catalogue, said["from"])


def plain(start: Start, values: Values | None) -> dict[str, Any]:
    """What stands under "given" in ``course.json``; without values, each student's session works them out."""
    if values is None:
        return {"from": start.name}
    found: dict[str, dict[str, Any]] = {}
    for question, part in start.gives:
        found.setdefault(question, {})[part] = np.asarray(values[question, part]).tolist()
    return {"from": start.name, "values": found}


def values_in(course: Mapping[str, Any], start: Start) -> Values | None:
    """The values that a ``course.json`` gives; None where it has none. Raises ConfigurationError if one is missing."""
    values = course[GIVEN].get("values")
    if values is None:
        return None
    try:
        found = {(question, part): values[question][part] for question, part in start.gives}
    except (KeyError, TypeError):
        raise ConfigurationError('course.json: not all is there that is "given".') from None
    return {where: np.array(value) if isinstance(value, list) else value for where, value in found.items()}


def narrowed(catalogue: Catalogue, start: Start | None) -> Catalogue:
    """A catalogue with what is asked of a class that begins at a start, and nothing else; itself without one."""
    if start is None:
        return catalogue

    def kept(questions: Collection[Question]) -> Iterator[Question]:
        for question in questions:
            parts = tuple(part for part in question.parts if start.asks(catalogue, question, part))
            if parts:
                yield replace(question, parts=parts)

    items = [
        replace(item, shows=tuple(where for where in item.shows if start._asks(catalogue, where)))
        for item in catalogue.report_items
        if start.keeps(catalogue, item)
    ]
    there = {item.report for item in items}
    return Catalogue(
        kept(catalogue.questions.values()),
        warm_up=kept(catalogue.warm_up.values()),
        tables=kept(catalogue.tables.values()),
        report_items=items,
        reports={
            number: (one.section, one.notebook, one.title)
            for number, one in catalogue.reports.items()
            if number in there
        },
        outcomes=catalogue.outcomes,
        predictions={
            number: foretold
            for number, foretold in catalogue.predictions.items()
            if catalogue.everything[number].notebook not in start.skips
        },
        starts=catalogue.starts,
    )
