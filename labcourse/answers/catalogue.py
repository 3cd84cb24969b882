"""A course's catalogue: its questions, results tables and reports, by number. It says nothing of what is right.

A course's settings say which of its optional notebooks a class has, and which other notebooks it does without;
``course.json`` then names them under ``"optional"`` and ``"without"``. Of notebooks that the class does not have, no
question is asked, nor entries of tables that repeat such an answer, nor rows of reports that use only such answers.
Where other notebooks need such an answer, the class is given a value (:meth:`labcourse.session.Session.given_value`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from labcourse import course_file
from labcourse.answers.parts import WHOLE, Part, Predictable, Question, ReportItem, prose
from labcourse.errors import AnswerError, ConfigurationError


class Catalogue:
    """All that can be answered in a course.

    Parameters
    ----------
    questions : in the order in which they are asked
    warm_up : questions that give no points
    tables : results tables
    report_items : the rows of the reports' scoring sheets, in order
    reports : number of a report → its section, notebook and title
    outcomes : what the outcome codes stand for
    predictions : number of a question → what can be predicted of its experiment
    optional : names of the notebooks that a class has only if the course's settings name them
    bench_word : what the course calls a student's bench in messages, as in "oven"
    whole : the catalogue that this one is reduced from; None if it is not reduced

    Attributes
    ----------
    warm_up, questions, tables, reports : number → question; a report's parts are the texts that it asks for
    report_items, outcomes, predictions, optional, bench_word : as given
    whole : the catalogue with all questions; this one, if it is not reduced
    everything : all that can be answered, by number
    judged : the reports as a whole, by number: a person judges them so; there is nothing to answer, and no cell
    report_judged : number of a report as a whole → number of the report
    marked : all that gets marks, by number: everything, and what is judged
    notebooks : names of the notebooks with something to answer, in order
    """

    def __init__(
        self,
        questions: Iterable[Question],
        *,
        warm_up: Iterable[Question] = (),
        tables: Iterable[Question] = (),
        report_items: Iterable[ReportItem] = (),
        reports: Mapping[str, tuple[str, str, str]] | None = None,
        outcomes: Mapping[str, str] | None = None,
        predictions: Mapping[str, tuple[Predictable, ...]] | None = None,
        optional: Iterable[str] = (),
        bench_word: str = "bench",
        whole: Catalogue | None = None,
    ) -> None:
        self.optional, self.bench_word, self.whole = tuple(optional), bench_word, whole or self
        self.warm_up = _by_number("warm_up", warm_up)
        self.questions = _by_number("questions", questions)
        self.tables = _by_number("tables", tables)
        self.report_items = tuple(report_items)
        self.reports: dict[str, Question] = {}
        self.judged: dict[str, Question] = {}
        self.report_judged: dict[str, str] = {}
        self._about_reports = dict(reports or {})
        for number, about in self._about_reports.items():
            self._add_report(number, about)
        self.outcomes = dict(outcomes or {})
        self.predictions = dict(predictions or {})
        groups = (self.warm_up, self.questions, self.tables, self.reports)
        self.everything = _by_number("the catalogue", (question for group in groups for question in group.values()))
        self.marked = self.everything | self.judged
        self.notebooks = tuple(sorted({question.notebook for question in self.everything.values()}))

    def _add_report(self, report: str, about: tuple[str, str, str]) -> None:
        """Add a report: a prose part for each row that is written, and what is judged of it as a whole."""
        texts, sides = [], []
        for item in self.items(report):
            prompt = f"{item.heading}. {item.prompt}"
            texts += [prose(item.part, item.outcomes[0], prompt)] if item.part else []
            sides += [replace(prose(item.judged, item.outcomes[0], prompt), kind=WHOLE)] if item.judged else []
        self.reports[report] = _of_parts(report, *about, texts)
        if sides:
            number = f"{report}, as a whole"
            self.judged[number] = _of_parts(number, *about, sides)
            self.report_judged[number] = report

    def items(self, report: str) -> list[ReportItem]:
        """Return the rows of a report's scoring sheet."""
        return [item for item in self.report_items if item.report == report]

    def find(self, number: Any) -> Question:
        """Return the question, table or report of a number such as ``"1.2"``, ``"Table 1"`` or ``"First report"``.

        Raises
        ------
        AnswerError
            If there is none; the message names the most similar numbers.
        """
        if not isinstance(number, str):
            example = next(iter(self.questions), "")
            raise AnswerError(
                f'Give the number of the question as text, as in "{example}" (1.10 and 1.1 are two questions, '
                f"but one number); it is {number!r}."
            )
        if number in self.judged:
            raise AnswerError(
                f"There is nothing to answer to {number!r}: a person judges it when they have read the texts of "
                f"{self.report_judged[number]!r}. Write those."
            )
        if number not in self.everything:
            near = get_close_matches(number, self.everything, n=3) or [*self.everything][:3]
            raise AnswerError(f"There is no question {number!r}. There are, for example, {', '.join(near)}.")
        return self.everything[number]

    def find_notebooks(self, *beginnings: str) -> tuple[str, ...]:
        """Return the notebooks with questions. Beginnings of names, such as "02", restrict them to those notebooks.

        Raises
        ------
        AnswerError
            If no notebook's name starts with one of the beginnings.
        """
        for beginning in beginnings:
            if not (beginning and any(name.startswith(beginning) for name in self.notebooks)):
                known = ", ".join(self.notebooks)
                raise AnswerError(f"There is no notebook {beginning!r} with questions; there are {known}.")
        return tuple(name for name in self.notebooks if not beginnings or name.startswith(beginnings))

    def find_marked(self, number: Any) -> Question:
        """Return what :meth:`find` does, or a report as a whole: all that gets marks.

        Raises
        ------
        AnswerError
            If there is none; the message names the most similar numbers.
        """
        return self.judged.get(number) or self.find(number)

    def without(self, notebooks: Collection[str]) -> Catalogue:
        """Return the catalogue of a class that does not have some notebooks; this one, if there are none."""
        if not notebooks:
            return self

        def is_asked(number: str, name: str) -> bool:
            """Check whether a part is asked, or, without its name, any part of the question."""
            question = self.everything[number]
            parts = [part for part in question.parts if name in ("", part.name)]
            here = question.notebook not in notebooks
            return here and any(part.shows is None or is_asked(*part.shows) for part in parts)

        def asked(questions: Mapping[str, Question]) -> Iterator[Question]:
            for question in questions.values():
                parts = tuple(part for part in question.parts if is_asked(question.number, part.name))
                if parts:
                    yield replace(question, parts=parts)

        items = []
        for item in self.report_items:
            shows = tuple(where for where in item.shows if is_asked(*where))
            if self.reports[item.report].notebook not in notebooks and (shows or not item.shows):
                items.append(replace(item, shows=shows))
        reports = {item.report for item in items}
        predicted = [number for number in self.predictions if self.everything[number].notebook not in notebooks]
        return Catalogue(
            asked(self.questions),
            warm_up=asked(self.warm_up),
            tables=asked(self.tables),
            report_items=items,
            reports={report: about for report, about in self._about_reports.items() if report in reports},
            outcomes=self.outcomes,
            predictions={number: self.predictions[number] for number in predicted},
            optional=self.optional,
            bench_word=self.bench_word,
            whole=self.whole,
        )

    def of_release(self, course: Mapping[str, Any]) -> Catalogue:
        """Return the catalogue of a release, by its ``course.json``. A checkout is no release: it has all.

        Raises
        ------
        ConfigurationError
            If the entry "optional" or "without" is broken.
        """
        optional = course.get(course_file.OPTIONAL, [] if course_file.RELEASE_KEY in course else self.optional)
        without = course.get(course_file.WITHOUT, [])
        for names in (optional, without):
            if not isinstance(names, list | tuple):
                raise ConfigurationError(f"Notebooks should be named in a list; it is {names!r:.80}.")
        return self.without([*without, *(name for name in self.optional if name not in optional)])


def _of_parts(number: str, section: str, notebook: str, title: str, parts: list[Part]) -> Question:
    """Return a question with the outcomes of its parts."""
    outcomes = dict.fromkeys(part.outcome for part in parts)
    return Question(number, section, notebook, title, tuple(outcomes), tuple(parts))


def _by_number(what: str, given: Iterable[Question]) -> dict[str, Question]:
    """Return questions by number.

    Raises
    ------
    TypeError
        If an entry is something else, as a tuple by a comma too many.
    ValueError
        If two questions have the same number, or two parts of one the same name.
    """
    questions: dict[str, Question] = {}
    for place, question in enumerate(given, start=1):
        if not isinstance(question, Question):
            raise TypeError(f"entry {place} of {what} is a {type(question).__name__}, not a Question")
        if question.number in questions:
            raise ValueError(f"question {question.number} is in {what} twice: give one of the two another number")
        if twice := [name for name in dict.fromkeys(question.names) if question.names.count(name) > 1]:
            raise ValueError(f"question {question.number} has two parts {twice[0]!r}: give one of them another name")
        questions[question.number] = question
    return questions
