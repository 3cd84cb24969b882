"""Reduce a catalogue to the questions of a class that does not have all notebooks.

A course's settings say which of its optional notebooks a class has, and which other notebooks it does without;
``course.json`` then names them under ``"optional"`` and ``"without"``. Of notebooks that the class does not have, no
question is asked, nor entries of tables that repeat such an answer, nor rows of reports that use only such answers.
Where other notebooks need such an answer, the class is given a value (:meth:`labcourse.session.Session.given_value`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

from labcourse import course_file
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question
from labcourse.errors import ConfigurationError
from labcourse.problems import Where


def reduced(catalogue: Catalogue, notebooks: Collection[str]) -> Catalogue:
    """Reduce a catalogue to the questions for a class without some notebooks; for one with all, return it unchanged."""
    if not notebooks:
        return catalogue

    def is_asked(question: Question, part: Part) -> bool:
        return question.notebook not in notebooks and (part.shows is None or is_any_asked(part.shows))

    def is_any_asked(where: Where) -> bool:
        """Check whether a part is asked, or, without its name, any part of the question."""
        number, name = where
        question = catalogue.everything[number]
        return any(is_asked(question, part) for part in question.parts if name in ("", part.name))

    def asked(questions: Collection[Question]) -> Iterator[Question]:
        for question in questions:
            parts = tuple(part for part in question.parts if is_asked(question, part))
            if parts:
                yield replace(question, parts=parts)

    items = [
        replace(item, shows=tuple(filter(is_any_asked, item.shows)))
        for item in catalogue.report_items
        if catalogue.reports[item.report].notebook not in notebooks
        if not item.shows or any(map(is_any_asked, item.shows))
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
            if catalogue.everything[number].notebook not in notebooks
        },
        optional=catalogue.optional,
        whole=catalogue.whole,
    )


def handed_out(catalogue: Catalogue, course: Mapping[str, Any]) -> Catalogue:
    """Reduce a catalogue to the questions of a release, by its ``course.json``. A checkout is no release: it has all.

    Raises
    ------
    ConfigurationError
        If the entry "optional" or "without" is broken.
    """
    optional = course.get(course_file.OPTIONAL, [] if course_file.RELEASE_KEY in course else catalogue.optional)
    without = course.get(course_file.WITHOUT, [])
    for names in (optional, without):
        if not isinstance(names, list | tuple):
            raise ConfigurationError(f"Notebooks should be named in a list; it is {names!r:.80}.")
    return reduced(catalogue, [*without, *(name for name in catalogue.optional if name not in optional)])
