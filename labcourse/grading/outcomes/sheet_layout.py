"""How a course's scoring sheets are laid out: ``sheets.toml`` in its folder.

A sheet has a row for each question of a section, or for each item of a report, and a column for each code. Which parts
are scored in a cell follows from the catalogue: those of the row that carry the column's code.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question, ReportItem
from labcourse.errors import GradingError
from labcourse.grading.course import SHEETS_FILE
from labcourse.grading.outcomes.outcome_map import listed
from labcourse.grading.settings import are_texts, read_toml, refuse

Where = tuple[str, str]  #: question and part


@dataclass(frozen=True)
class Row:
    """A row of a sheet.

    Attributes
    ----------
    group : heading of the rows that it belongs to; "" without
    number, heading : of the question or the item
    cells : code → the parts that are scored there
    """

    group: str
    number: str
    heading: str
    cells: Mapping[str, tuple[Where, ...]]


@dataclass(frozen=True)
class Layout:
    """A sheet, before anything is filled in.

    Attributes
    ----------
    name : of its files
    title : for people
    about : whose rows these are, in words
    codes, format : the codes of the columns: of content, and of format
    rows : in order
    """

    name: str
    title: str
    about: str
    codes: tuple[str, ...]
    format: tuple[str, ...]
    rows: tuple[Row, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """All codes, in order."""
        return self.codes + self.format

    @property
    def parts(self) -> list[Where]:
        """All that is scored on the sheet."""
        return [where for row in self.rows for parts in row.cells.values() for where in parts]


def read(folder: Path, catalogue: Catalogue) -> list[Layout]:
    """The sheets of the course in a folder.

    Raises
    ------
    GradingError
        If it has none, or if they cannot be used; the message tells each fault, and what to do.
    """
    file = folder / SHEETS_FILE
    try:
        found = read_toml(file)
    except FileNotFoundError:
        raise GradingError(
            f"This course has no scoring sheets: there is no {file}. (docs/outcomes.md says what it holds.)"
        ) from None
    refuse(file, (fault for name, given in found.items() for fault in _faults(name, given, catalogue)))
    layouts = [_layout(name, given, catalogue) for name, given in found.items()]
    twice = [where for where, count in Counter(where for one in layouts for where in one.parts).items() if count > 1]
    told = "{question}, {part}: it is scored in two places."
    refuse(file, (told.format(question=question, part=part) for question, part in twice))
    return layouts


def on_no_sheet(layouts: Collection[Layout], catalogue: Catalogue) -> Iterator[tuple[str, Part]]:
    """What is worth points and is on no sheet: parts without a code, and what a layout left out, by their question."""
    placed = {where for one in layouts for where in one.parts}
    for number, question in catalogue.marked.items():
        for part in question.parts:
            if part.points and (number, part.name) not in placed:
                yield number, part


# --- faults -----------------------------------------------------------------------------------------------------------


def _faults(name: str, given: Any, catalogue: Catalogue) -> Iterator[str]:
    """What is wrong with a section of the file, in words."""
    if not isinstance(given, Mapping):
        yield f"{name}: it should be a section, a line [{name}] with its entries below."
        return
    if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        yield f"{name!r}: files are named by it, so it should be letters, digits, _ and -."
    for key in given.keys() - {"title", "section", "report", "codes", "format", "also"}:
        yield f"{name}.{key}: there is no such entry."
    if not isinstance(given.get("title"), str):
        yield f'{name}.title: it should be a line of text, as in: title = "Scoring sheet"'
    sections = dict.fromkeys(question.section for question in catalogue.questions.values())
    if ("section" in given) == ("report" in given):
        yield f"{name}: its rows are those of a section or of a report; name one of them."
    elif given.get("section", next(iter(sections), None)) not in sections:
        yield f"{name}.section: no question is of a section {given['section']!r}; there are {listed(sections)}."
    elif "report" in given and given["report"] not in catalogue.reports:
        yield f"{name}.report: there is no report {given['report']!r}; there are {listed(catalogue.reports)}."
    for entry in ("codes", "format"):
        codes = given.get(entry, [] if entry == "format" else None)
        if not are_texts(codes) or not set(codes) <= set(catalogue.outcomes):
            yield f"{name}.{entry}: it should be a list of codes, of {listed(catalogue.outcomes)}."
    yield from _misplaced(name, given, catalogue)


def _misplaced(name: str, given: Mapping[str, Any], catalogue: Catalogue) -> Iterator[str]:
    """What is wrong with what else is scored in a row."""
    also = given.get("also", {})
    if not isinstance(also, Mapping) or not all(map(are_texts, also.values())):
        yield f'{name}.also: it should have a line for a row, as in: "II.1" = ["1.2"]'
        return
    rows = {item.number for item in catalogue.items(str(given.get("report", "")))}
    for row, numbers in also.items():
        if row not in rows:
            yield f"{name}.also: the report has no item {row!r}."
        for number in numbers:
            if number not in catalogue.marked:
                yield f"{name}.also: there is no question {number!r}."


# --- rows -------------------------------------------------------------------------------------------------------------


def _layout(name: str, given: Mapping[str, Any], catalogue: Catalogue) -> Layout:
    codes, form = tuple(given["codes"]), tuple(given.get("format", ()))
    if "section" in given:
        about = f"The rows are the questions of Section {given['section']}."
        questions = [one for one in catalogue.questions.values() if one.section == given["section"]]
        rows = [_of_question(question, codes + form) for question in questions]
    else:
        about = f"The rows are the items of the {given['report']}."
        also = given.get("also", {})
        rows = [
            _of_item(item, also.get(item.number, ()), codes + form, catalogue)
            for item in catalogue.items(given["report"])
        ]
    return Layout(name, given["title"], about, codes, form, tuple(rows))


def _of_question(question: Question, codes: Collection[str]) -> Row:
    return Row("", question.number, question.title, _by_code(_parts(question), codes))


def _of_item(item: ReportItem, also: Collection[str], codes: Collection[str], catalogue: Catalogue) -> Row:
    found = {where: code for where, code in _of_row(item, catalogue).items() if code in item.outcomes}
    for number in also:
        found |= _parts(catalogue.marked[number])
    before, colon, after = item.heading.partition(": ")
    prefix, point, _number = item.number.partition(".")
    group = f"{prefix}. {before}" if colon else prefix if point else ""
    heading = after if colon else before
    return Row(group, item.number, heading[:1].upper() + heading[1:], _by_code(found, codes))


def _of_row(item: ReportItem, catalogue: Catalogue) -> dict[Where, str]:
    """The parts that a row writes, shows or discusses, or under which its report is judged, with their codes."""
    found: dict[Where, str] = {}
    if item.part:
        found[item.report, item.part] = catalogue.reports[item.report].part(item.part).outcome
    for number, name in item.shows:
        found |= {where: code for where, code in _parts(catalogue.marked[number]).items() if name in ("", where[1])}
    for number, report in catalogue.report_judged.items():
        if report == item.report and item.judged:
            found[number, item.judged] = catalogue.marked[number].part(item.judged).outcome
    return found


def _parts(question: Question) -> dict[Where, str]:
    """The parts of a question that are worth points, with their codes."""
    return {(question.number, part.name): part.outcome for part in question.parts if part.points}


def _by_code(parts: Mapping[Where, str], codes: Collection[str]) -> dict[str, tuple[Where, ...]]:
    found = {code: tuple(where for where, own in parts.items() if own == code) for code in codes}
    return {code: there for code, there in found.items() if there}
