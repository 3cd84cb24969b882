"""Derive levels of codes and outcomes from marks, and write how students and a class do.

There is one rule, whoever gave the marks: the points earned of the points possible, over all decided parts with a code,
are a share, and the share is a level by the course's thresholds. What waits for a person, or was not marked for a fault
of the key, is not decided and is counted. What is missing when it is due earned nothing; excused work is left out. An
accreditation outcome has all parts of all codes that go to it. ``docs/outcomes.md`` has an example to compute by hand.

===================  ==================================================================================================
``attainment.csv``   a row for each criterion of each group, and of everybody; nothing of small groups
``levels.csv``       a row for each criterion of each student, with names: for instructors only
===================  ==================================================================================================
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Annotated, NamedTuple, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from labcourse import files
from labcourse.answers.catalogue import Catalogue
from labcourse.grading.accounts import points
from labcourse.grading.course import OUTCOMES_FILE, Course
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.grading.reports.result import account_in
from labcourse.grading.scoring.rubric import LEVELS
from labcourse.grading.settings import SHARE_DIGITS, CourseSettings, MarkSettings, read_toml, refuse
from labcourse.messages import number_of
from labcourse.safe_text import as_csv
from labcourse.student_id import caseless

ATTAINMENT_FILE, LEVELS_FILE = "attainment.csv", "levels.csv"
EVERYBODY = "everybody"  #: in place of a group's name
_UNDECIDED = "nothing decided yet"

_Content = TypeVar("_Content")
Criteria = Mapping[str, Collection[str]]  #: name of a criterion (a code, or the key of an outcome) → codes


# --- levels of a student ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Judged:
    """A part of a question, answered by a student: the code of which it gives evidence, and its mark."""

    code: str
    mark: Mark

    @property
    def decided(self) -> bool:
        """Whether its points are known."""
        return self.mark.status not in UNDECIDED

    @property
    def by_a_person(self) -> bool:
        """Whether a person gave its points."""
        return self.mark.status == Status.BY_A_PERSON


class Evidence(NamedTuple):
    """The sums of several parts of a student.

    Attributes
    ----------
    earned, decided : points earned, and points possible, of the decided parts
    possible : points possible, of all parts
    waiting : number of parts that are not decided
    """

    earned: float
    decided: float
    possible: float
    waiting: int

    @property
    def share(self) -> float | None:
        """Points earned of points possible, 0 to 1, of the decided parts; None if nothing is decided."""
        return round(self.earned / self.decided, SHARE_DIGITS) if self.decided else None


def evidence(parts: Iterable[Judged], codes: Collection[str] | None = None) -> Evidence:
    """Sum up parts: those with one of some codes; all if ``codes`` is None."""
    parts = [part for part in parts if codes is None or part.code in codes]
    decided = [part.mark for part in parts if part.decided]
    earned, out_of = sum(mark.points for mark in decided), sum(mark.out_of for mark in decided)
    return Evidence(earned, out_of, sum(part.mark.out_of for part in parts), len(parts) - len(decided))


class Standing(NamedTuple):
    """A student, and the parts of their work that carry a code, count and are worth points."""

    about: StudentRecord
    parts: list[Judged]


def standing(about: StudentRecord, marks: Iterable[Mark], catalogue: Catalogue, counted: MarkSettings) -> Standing:
    """Return a student's parts that carry a code and are worth points, without those that ``counted`` drops."""
    codes = {
        (number, part.name): part.outcome
        for number, question in catalogue.marked.items()
        for part in question.parts
        if part.outcome and not counted.dropped_as(number, part.name)
    }
    return Standing(about, [Judged(codes[mark.where], mark) for mark in marks if mark.where in codes and mark.out_of])


def standings(book: Gradebook, course: Course) -> list[Standing]:
    """Return all graded students, by ID, without notebooks that are excused, unreadable, or neither due nor there."""
    found = []
    for about in book.students():
        if (graded := book.current(about.student)) is None:
            continue
        account = account_in(book, course, graded, about)
        works = [work for one in account.assignments for work in one.works]
        left_out = {work.notebook for work in works if work.excuse or work.is_blank or work.is_unread}
        marks = [mark for mark in graded.marks if course.notebook_of(mark.question) not in left_out]
        found.append(standing(about, marks, course.catalogue, course.settings.marks))
    return found


# --- the map to outcomes of an accreditation --------------------------------------------------------------------------


class OutcomeMap(BaseModel):
    """Which codes give evidence of which outcomes: ``outcomes.toml`` in the course's folder.

    Attributes
    ----------
    scheme : what the outcomes are of, as an accreditation and a year
    outcomes : key of an outcome, as "1" → its short name
    codes : code → keys of the outcomes that it gives evidence of
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    scheme: Annotated[str, Field(min_length=1)]
    outcomes: Annotated[dict[str, str], Field(min_length=1)]
    codes: dict[str, list[str]]

    @property
    def criteria(self) -> dict[str, list[str]]:
        """Key of each outcome → the codes that give evidence of it; outcomes without any are left out."""
        by_outcome = {key: [code for code, goes_to in self.codes.items() if key in goes_to] for key in self.outcomes}
        return {key: codes for key, codes in by_outcome.items() if codes}

    def notes(self, catalogue: Catalogue) -> list[str]:
        """Return notes on codes without an outcome and outcomes without a code; either may be intended."""
        without = ", ".join(code for code in catalogue.outcomes if not self.codes.get(code))
        unused = "; ".join(f"{key} ({name})" for key, name in self.outcomes.items() if key not in self.criteria)
        notes = [f"{without}: no outcome in {OUTCOMES_FILE}, so they are in no outcome's figures."] if without else []
        return notes + ([f"Of these outcomes the course gives no evidence: {unused}."] if unused else [])


def read_map(folder: Path, catalogue: Catalogue) -> OutcomeMap | None:
    """Read the map to outcomes of the course in a folder; return None if it has none.

    Raises
    ------
    GradingError
        If it cannot be used; the message lists each fault.
    """
    file = folder / OUTCOMES_FILE
    try:
        mapped = read_as(OutcomeMap, file)
    except FileNotFoundError:
        return None
    known, keys = ", ".join(catalogue.outcomes) or "none", ", ".join(mapped.outcomes)
    unknown = [
        f"codes.{code}: the course has no such code; it has {known}."
        for code in mapped.codes.keys() - catalogue.outcomes.keys()
    ]
    unknown += [
        f"codes.{code}: there is no outcome {key!r} under [outcomes]; there are {keys}."
        for code, goes_to in mapped.codes.items()
        for key in goes_to
        if key not in mapped.outcomes
    ]
    refuse(file, unknown)
    return mapped


def read_as(kind: type[_Content], file: Path) -> _Content:
    """Read a TOML file of a course as a type that pydantic knows.

    Raises
    ------
    FileNotFoundError
        If there is none.
    GradingError
        If the file is not TOML or does not fit the type; the message lists each fault, with its place.
    """
    try:
        return TypeAdapter(kind).validate_python(read_toml(file))
    except ValidationError as error:
        refuse(file, (f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}." for fault in error.errors()))
        raise


# --- attainment of a class --------------------------------------------------------------------------------------------


class Figures(NamedTuple):
    """What is shown of a group in a criterion.

    Attributes
    ----------
    students : number of students with a decided part in it
    provisional : how many of them also have a part that is not decided
    levels : level → how many students are at it
    attained : how many are at the level that is aimed at, or above
    mean : of the students' shares of points, 0 to 1
    """

    students: int
    provisional: int
    levels: Counter[int]
    attained: int
    mean: float

    @property
    def attainment(self) -> float:
        """Students who attained it, of all with a decided part, in %."""
        return 100 * self.attained / self.students


Groups = dict[str, Figures | str]  #: :data:`EVERYBODY` and each group → its figures, or why they are not shown


class Kind(NamedTuple):
    """The codes, or the outcomes of a scheme.

    Attributes
    ----------
    name, scheme : "code" or "outcome", and what the outcomes are of ("" for codes)
    criteria, meanings : name of a criterion → its codes, and → what it stands for
    """

    name: str
    scheme: str
    criteria: Criteria
    meanings: Mapping[str, str]


def attainments(
    students: Sequence[Standing],
    criteria: Criteria,
    settings: CourseSettings,
    group_of: Callable[[Standing], str] | None = None,
) -> dict[str, Groups]:
    """Compute how a class does in each criterion.

    Parameters
    ----------
    students : all with marks
    criteria : name of a criterion → the codes of its parts
    settings : levels, what counts as attained, and what is too small to be shown
    group_of : function that returns the group of a student; None for no groups

    Returns
    -------
    dict
        Name of a criterion → groups, and for each its figures or why they are not shown.
    """
    groups: dict[str, list[Standing]] = {}
    if group_of is not None:
        for student in students:
            groups.setdefault(group_of(student), []).append(student)
    fewest, result = settings.outcomes.fewest, dict[str, Groups]()
    for name, codes in criteria.items():
        shares = {group: _evidence_of(groups[group], codes) for group in sorted(groups)}
        hidden = withheld({group: len(those) for group, those in shares.items()}, fewest)
        shown = {group: _figures(those, settings, group in hidden) for group, those in shares.items()}
        result[name] = {EVERYBODY: _figures(_evidence_of(students, codes), settings), **shown}
    return result


def _evidence_of(students: Iterable[Standing], codes: Collection[str]) -> list[Evidence]:
    """Return the evidence of each student in a criterion. Students without a decided part are left out."""
    return [sums for student in students if (sums := evidence(student.parts, codes)).share is not None]


def _figures(group: Sequence[Evidence], settings: CourseSettings, hidden: bool = False) -> Figures | str:
    """Return the figures of a group in a criterion; or why they are not shown, as text.

    Parameters
    ----------
    group : evidence of each student with a decided part
    settings : levels, the level to reach, and the smallest group
    hidden : whether it is withheld although it is large enough
    """
    goal = settings.outcomes
    if not group:
        return _UNDECIDED
    if len(group) < goal.fewest:
        return f"fewer than {goal.fewest}: not shown"
    if hidden:
        return f"not shown: it would tell of a group of fewer than {goal.fewest}"
    shares = [sums.share for sums in group if sums.share is not None]
    levels = Counter(map(settings.levels.level_of, shares))
    attained = sum(count for level, count in levels.items() if level >= goal.level)
    return Figures(len(shares), sum(sums.waiting > 0 for sums in group), levels, attained, fmean(shares))


def withheld(sizes: Mapping[str, int], fewest: int) -> frozenset[str]:
    """Return the groups that are too small for their figures to be shown.

    The figures of a hidden group must not follow from the whole class and the groups that are shown. So the next
    smallest groups are hidden, too, until the hidden groups together have enough students.

    Parameters
    ----------
    sizes : group → number of its students with a decided part; each student is in one group
    fewest : students of the smallest group that may be shown
    """
    there = sorted((size, name) for name, size in sizes.items() if size)
    hidden = [entry for entry in there if entry[0] < fewest]
    others = there[len(hidden) :]
    while hidden and others and sum(size for size, _name in hidden) < fewest:
        hidden.append(others.pop(0))
    return frozenset(name for _size, name in hidden)


# --- the report -------------------------------------------------------------------------------------------------------


def write_report(out: Path, course: Course, book: Gradebook, *, by_section: bool = True) -> tuple[int, list[str]]:
    """Write the report on a class in place of an earlier one.

    Parameters
    ----------
    out : folder; made if needed
    course, book : the course with its questions, and the gradebook with the marks
    by_section : whether the sections of the class are shown beside each other

    Returns
    -------
    int
        Number of graded students.
    list[str]
        Notes: what is withheld, undecided or in no figure.

    Raises
    ------
    GradingError
        If the map of outcomes cannot be used.
    OSError
        If something cannot be written.
    """
    settings, catalogue = course.settings, course.catalogue
    mapped = read_map(course.folder, catalogue)
    students = standings(book, course)
    sections = {caseless(""): "no section"}  # "a" and "A" are one section, as in deadlines
    for student in students:
        sections.setdefault(caseless(student.about.section), student.about.section)
    group_of = (lambda student: sections[caseless(student.about.section)]) if by_section else None
    kinds = [Kind("code", "", {code: [code] for code in catalogue.outcomes}, catalogue.outcomes)]
    if mapped is not None:
        kinds.append(Kind("outcome", mapped.scheme, mapped.criteria, mapped.outcomes))
    attained = [(kind, attainments(students, kind.criteria, settings, group_of)) for kind in kinds]
    shown = [figures for _kind, criteria in attained for groups in criteria.values() for figures in groups.values()]
    out.mkdir(parents=True, exist_ok=True)
    files.write(out / ATTAINMENT_FILE, _attainment(attained, settings))
    files.write(out / LEVELS_FILE, _levels(kinds, students, settings))
    notes = [
        *_withheld_note(shown, settings.outcomes.fewest),
        *_notes(len(book.students()) - len(students), students, mapped, course),
    ]
    return len(students), notes


def _withheld_note(shown: Iterable[Figures | str], fewest: int) -> Iterator[str]:
    """Yield a note on how many rows are withheld because groups are small, if any are."""
    cells = [cell for cell in shown if cell != _UNDECIDED]
    hidden = sum(isinstance(cell, str) for cell in cells)
    what = f"Withheld: {hidden} of {number_of(len(cells), 'row')}"
    if hidden == len(cells):
        what = f"This report shows no figures at all: each of its {number_of(hidden, 'row')} is withheld"
    if hidden:
        small = f"of fewer than {fewest} students, or would tell of so few (fewest, in [outcomes] of course.toml)"
        yield f"{what}, as it is {small}."


def _notes(absent: int, students: Sequence[Standing], mapped: OutcomeMap | None, course: Course) -> Iterator[str]:
    """Yield notes on what is in no figure, or may change; ``absent`` is the number of students without marks."""
    if absent:
        without = "without marks (nothing handed in, or not graded yet)"
        yield f"In the gradebook, and in no figure: {number_of(absent, 'student')} {without}."
    waiting = [count for student in students if (count := sum(not part.decided for part in student.parts))]
    if waiting:
        what = f"{number_of(sum(waiting), 'part')} of {number_of(len(waiting), 'student')}"
        yield f"Not decided, as it waits for a person or could not be marked: {what}. Levels may change."
    if not course.catalogue.outcomes:
        yield "The questions of this course carry no codes: there is nothing to say of levels."
    if dropped := course.settings.marks.drop:
        yield f"Dropped by course.toml, and no evidence: {', '.join(dropped)}."
    if mapped is not None:
        yield from mapped.notes(course.catalogue)
    else:
        what = "its codes have levels, and outcomes of an accreditation have none"
        yield f"This course has no {OUTCOMES_FILE} in {course.folder}: {what}."


def _attainment(attained: Iterable[tuple[Kind, Mapping[str, Groups]]], settings: CourseSettings) -> str:
    """Return the text of ``attainment.csv``."""
    target = settings.outcomes.share
    rows = [
        [settings.term, group, kind.name, kind.scheme, name, kind.meanings[name], *_cells(figures, target)]
        for kind, criteria in attained
        for name, groups in criteria.items()
        for group, figures in groups.items()
    ]
    heading = ["term", "group", "kind", "scheme", "criterion", "meaning", "students", "of these provisional"]
    heading += [f"at level {level}" for level in LEVELS]
    return as_csv([[*heading, "attained", "attained %", "target %", "reached", "mean share %", "note"], *rows])


def _cells(figures: Figures | str, target: float) -> list[str]:
    """Return the cells of figures, or of why there are none; ``target`` is the % of students who have to attain it."""
    if isinstance(figures, str):
        return [*[""] * (len(LEVELS) + 7), figures]
    counts = [figures.students, figures.provisional, *(figures.levels[level] for level in LEVELS), figures.attained]
    reached = "yes" if figures.attainment >= target else "no"
    return [*map(str, counts), f"{figures.attainment:.1f}", f"{target:g}", reached, f"{100 * figures.mean:.1f}", ""]


def _levels(kinds: Iterable[Kind], students: Iterable[Standing], settings: CourseSettings) -> str:
    """Return the text of ``levels.csv``."""
    rows = [["term", "student", "name", "section", "kind", "criterion", "points", "decided", "waiting", "level"]]
    for about, parts in students:
        who = [settings.term, about.student, about.name, about.section]
        for kind in kinds:
            for name, codes in kind.criteria.items():
                sums = evidence(parts, codes)
                level = "" if sums.share is None else str(settings.levels.level_of(sums.share))
                rows.append(
                    [*who, kind.name, name, points(sums.earned), points(sums.decided), str(sums.waiting), level]
                )
    return as_csv(rows)
