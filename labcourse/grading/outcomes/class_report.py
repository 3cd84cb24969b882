"""The class report: how a class does in each code and in each outcome, as a page and as tables.

==================  ===================================================================================================
``attainment.html``  levels, attainment, and mean shares by question; nothing of small groups
``attainment.csv``   a row for each criterion of each group, and of everybody; nothing of small groups
``students.csv``     a row for each criterion of each student, with names: for instructors only
==================  ===================================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes import outcome_map, pages, plots
from labcourse.grading.outcomes.attainment import Attainment, Cell, attainments
from labcourse.grading.outcomes.levels import LevelOf, Standing, codes_of, standings
from labcourse.grading.reports.result import points
from labcourse.grading.settings import OutcomeSettings
from labcourse.messages import plural
from labcourse.safe_text import as_csv
from labcourse.student_id import caseless

PAGE_FILE, TABLE_FILE, STUDENTS_FILE = "attainment.html", "attainment.csv", "students.csv"
LEVELS = (4, 3, 2, 1, 0)  #: as columns; 0 is for what is of no worth, or not there
EVERYBODY = "everybody"  #: in the place of a group's name


@dataclass(frozen=True)
class Kind:
    """Codes, or outcomes: the criteria of one sort, and how the class does in them.

    Attributes
    ----------
    name : "code" or "outcome"
    heading : for people
    names : criterion → what it stands for
    criteria : criterion → the codes of its parts
    found : how the class does
    """

    name: str
    heading: str
    names: Mapping[str, str]
    criteria: Mapping[str, Collection[str]]
    found: Sequence[Attainment]


@dataclass(frozen=True)
class Written:
    """What a class report came to: how many students it is of, and what there is to say of it."""

    students: int
    notes: tuple[str, ...]


def write(out: Path, course: Course, book: Gradebook, by_section: bool = True) -> Written:
    """Write the class report in place of an earlier one.

    Parameters
    ----------
    out : folder; made if needed
    course, book : whose questions, and whose marks
    by_section : whether the sections of the class are shown beside each other

    Raises
    ------
    GradingError
        If the map of outcomes cannot be used, or nothing can be written.
    """
    catalogue, goal, level_of = course.catalogue, course.settings.outcomes, course.settings.levels.level_of
    mapped = outcome_map.find(course.folder, catalogue)
    everybody = list(standings(book, catalogue, course.settings.marks))
    group_of = _sections(everybody) if by_section else None
    kinds = [_kind("code", "Criteria", catalogue.outcomes, codes_of(catalogue), everybody, level_of, goal, group_of)]
    if mapped is not None:
        criteria = mapped.criteria()
        kinds.append(_kind("outcome", mapped.scheme, mapped.outcomes, criteria, everybody, level_of, goal, group_of))
    notes = [*_withheld(kinds, goal), *_notes(book, everybody, catalogue.outcomes, mapped, course)]
    term = course.settings.term
    content = {
        PAGE_FILE: _page(course, kinds, goal, notes, len(everybody)),
        TABLE_FILE: _table(kinds, goal, term),
        STUDENTS_FILE: _students(kinds, everybody, level_of, term),
    }
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in content.items():
            files.write(out / name, text)
    except OSError as error:
        raise GradingError(f"{error.filename or out} cannot be written: {error.strerror}.") from None
    return Written(len(everybody), tuple(notes))


def _sections(everybody: Iterable[Standing]) -> Callable[[Standing], str]:
    """The section that a student is in, as the first of its students has it: "a" and "A" are one, as in deadlines."""
    spelt = {caseless(""): "no section"}
    for one in everybody:
        spelt.setdefault(caseless(one.about.section), one.about.section)
    return lambda one: spelt[caseless(one.about.section)]


def _kind(
    name: str,
    heading: str,
    names: Mapping[str, str],
    criteria: Mapping[str, Collection[str]],
    everybody: Sequence[Standing],
    level_of: LevelOf,
    goal: OutcomeSettings,
    group_of: Callable[[Standing], str] | None,
) -> Kind:
    return Kind(name, heading, names, criteria, attainments(everybody, criteria, level_of, goal, group_of))


def _withheld(kinds: Sequence[Kind], goal: OutcomeSettings) -> list[str]:
    """How much is not shown because groups are small, and what decides it."""
    cells = [cell for kind in kinds for one in kind.found for cell in (one.everybody, *one.groups.values())]
    hidden = sum(cell.withheld for cell in cells)
    there = hidden + sum(cell.figures is not None for cell in cells)
    if not hidden:
        return []
    what = (
        (f"This report shows no figures at all: each of its {plural(there, '{count} row', '{count} rows')} is withheld")
        if hidden == there
        else f"Withheld: {hidden} of {plural(there, '{count} row', '{count} rows')}"
    )
    return [
        f"{what}, as it is of fewer than {goal.fewest} students, or would tell of so few (fewest, in [outcomes] "
        "of course.toml)."
    ]


def _notes(
    book: Gradebook,
    everybody: Sequence[Standing],
    codes: Mapping[str, str],
    mapped: outcome_map.OutcomeMap | None,
    course: Course,
) -> list[str]:
    """What is worth knowing of what is in no figure, or may change."""
    notes = []
    known = {caseless(one) for one in (*book.handed_in(), *(one.student for one in book.students()))}
    absent = len(known - {caseless(one.about.student) for one in everybody})
    if absent:
        notes.append(
            "In the gradebook, and in no figure: {students} without marks (nothing handed in, or not graded yet)."
            .format(students=plural(absent, "{count} student", "{count} students"))
        )  # fmt: skip
    waiting = [sum(not part.decided for part in one.parts) for one in everybody]
    if any(waiting):
        notes.append(
            "Not decided, as it waits for a person or could not be marked: {parts} of {students}. Levels may change."
            .format(
                parts=plural(sum(waiting), "{count} part", "{count} parts"),
                students=plural(sum(count > 0 for count in waiting), "{count} student", "{count} students"),
            )
        )  # fmt: skip
    if not codes:
        notes.append("The questions of this course carry no codes: there is nothing to say of levels.")
    if dropped := course.settings.marks.drop:
        notes.append(f"Dropped by course.toml, and no evidence: {', '.join(dropped)}.")
    if mapped is None:
        notes.append(outcome_map.no_map(course.folder))
    else:
        notes += mapped.notes(course.catalogue)
    return notes


# --- the page ---------------------------------------------------------------------------------------------------------


def _page(course: Course, kinds: Sequence[Kind], goal: OutcomeSettings, notes: Sequence[str], students: int) -> str:
    drawn = {
        kind.name: (
            plots.levels(kind.found, kind.names, goal.share, f"{kind.name} levels"),
            plots.groups(kind.found, goal.share, f"{kind.name} groups"),
        )
        for kind in kinds
    }
    groups = sorted({group for kind in kinds for one in kind.found for group in one.groups})
    return pages.page(
        "class.html",
        course=" · ".join(filter(None, (course.title, course.settings.term))),
        kinds=kinds,
        drawn=drawn,
        groups=groups,
        goal=goal,
        levels=LEVELS,
        notes=notes,
        students=students,
        percent=percent,
        by_question=by_question,
    )


def percent(share: float) -> str:
    """A share from 0 to 1 for people."""
    return f"{100 * share:.0f} %"


def by_question(one: Attainment, goal: OutcomeSettings) -> list[str]:
    """The questions that give evidence of a criterion, each with its mean share."""
    return [
        f"{question}: fewer than {goal.fewest} students" if found is None else f"{question}: {percent(found[0])}"
        for question, found in one.questions.items()
    ]


# --- tables -----------------------------------------------------------------------------------------------------------


def _table(kinds: Sequence[Kind], goal: OutcomeSettings, term: str) -> str:
    heading: tuple[str, ...] = ("term", "group", "kind", "criterion", "meaning", "students", "of these provisional")
    heading += tuple(f"at level {level}" for level in LEVELS)
    heading += ("attained", "attained %", "target %", "reached", "mean share %", "note")
    rows = [
        [term, group, kind.name, one.criterion, kind.names[one.criterion], *_figures(cell, goal)]
        for kind in kinds
        for one in kind.found
        for group, cell in {EVERYBODY: one.everybody, **one.groups}.items()
    ]
    return as_csv([heading, *rows])


def _figures(cell: Cell, goal: OutcomeSettings) -> list[str]:
    found = cell.figures
    if found is None:
        return [*[""] * (len(LEVELS) + 7), cell.why]
    return [
        str(found.students),
        str(found.provisional),
        *(str(found.levels.get(level, 0)) for level in LEVELS),
        str(found.attained),
        f"{found.attainment:.1f}",
        f"{goal.share:g}",
        "yes" if found.attainment >= goal.share else "no",
        f"{100 * found.mean:.1f}",
        "",
    ]


def _students(kinds: Sequence[Kind], everybody: Iterable[Standing], level_of: LevelOf, term: str) -> str:
    heading: tuple[str, ...] = (
        "term",
        "student",
        "name",
        "section",
        "kind",
        "criterion",
        "level",
        "share %",
        "earned",
        "decided",
    )
    heading += ("possible", "parts that wait")
    rows = []
    for one in everybody:
        about = one.about
        for kind in kinds:
            for criterion, found in one.by_criterion(kind.criteria).items():
                share = found.share
                shown = ["", ""] if share is None else [str(level_of(share)), f"{100 * share:.1f}"]
                sums = [points(found.earned), points(found.decided), points(found.possible), str(found.waiting)]
                rows.append([term, about.student, about.name, about.section, kind.name, criterion, *shown, *sums])
    return as_csv([heading, *rows])
