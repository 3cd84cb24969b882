"""A student's scoring sheet: in each cell the level, the points, and whose marks they are; what waits as "…"."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.outcomes.levels import Evidence, Judged, LevelOf, Standing, evidence
from labcourse.grading.outcomes.sheet_layout import Layout, Where
from labcourse.grading.reports.result import points

WAITS = "…"  #: what a person has yet to decide, or what could not be marked
MACHINE, PERSON = "m", "p"  #: whose marks they are


@dataclass(frozen=True)
class Scored:
    """What the parts in a cell came to.

    Attributes
    ----------
    machine, person : of the parts that the machine marked, and that a person marked; ``waiting`` is in neither
    waiting : of the parts that wait
    level : from all that is decided; None where nothing is
    """

    machine: Evidence
    person: Evidence
    waiting: Evidence
    level: int | None

    @property
    def all(self) -> Evidence:
        """All of it together."""
        both = (self.machine, self.person, self.waiting)
        return Evidence(
            sum(one.earned for one in both),
            sum(one.decided for one in both),
            sum(one.possible for one in both),
            sum(one.waiting for one in both),
        )

    @property
    def level_word(self) -> str:
        """As "3", or "3 …" where something waits, or "…"."""
        found = [] if self.level is None else [str(self.level)]
        return " ".join(found + ([WAITS] if self.waiting.waiting else []))

    @property
    def points_words(self) -> list[str]:
        """As "2/2 m" and "0.5/1 p" and "…/1": by the machine, by a person, and what waits; as far as there is any."""
        words = [
            f"{points(one.earned)}/{points(one.possible)} {who}"
            for one, who in ((self.machine, MACHINE), (self.person, PERSON))
            if one.possible
        ]
        return words + ([f"{WAITS}/{points(self.waiting.possible)}"] if self.waiting.possible else [])

    @property
    def by(self) -> str:
        """Whose marks they are, as "m", "p" or "m+p"."""
        return "+".join(who for one, who in ((self.machine, MACHINE), (self.person, PERSON)) if one.possible)


@dataclass(frozen=True)
class Line:
    """A row as it is filled in; a code is there only if something is scored under it."""

    group: str
    number: str
    heading: str
    cells: Mapping[str, Scored]


@dataclass(frozen=True)
class Sheet:
    """A student's scoring sheet.

    Attributes
    ----------
    layout : of which it is
    about : whose it is
    lines : the rows
    totals : code → all cells of its column
    """

    layout: Layout
    about: StudentRecord
    lines: tuple[Line, ...]
    totals: Mapping[str, Scored]

    @property
    def total(self) -> str:
        """All points of the sheet in words."""
        earned = sum(one.all.earned for one in self.totals.values())
        decided = sum(one.all.decided for one in self.totals.values())
        possible = sum(one.all.possible for one in self.totals.values())
        if possible and not decided:
            return f"nothing decided yet, of {points(possible)} points"
        if decided == possible:
            return f"{points(earned)} of {points(possible)} points"
        return f"{points(earned)} of {points(decided)} points; {points(possible - decided)} of {points(possible)} wait"


def filled(layout: Layout, standing: Standing, level_of: LevelOf) -> Sheet:
    """A sheet of a student.

    Parameters
    ----------
    layout : of the sheet
    standing : the student, and the parts of their work that carry codes. A part that the student was not asked for, or
        that was dropped, is on no sheet
    level_of : the level of a share of points
    """
    there = {part.mark.where: part for part in standing.parts}
    lines = [
        Line(
            row.group,
            row.number,
            row.heading,
            {code: _scored(found, level_of) for code, places in row.cells.items() if (found := _found(places, there))},
        )
        for row in layout.rows
    ]
    columns = {
        code: _found([where for row in layout.rows for where in row.cells.get(code, ())], there)
        for code in layout.columns
    }
    totals = {code: _scored(found, level_of) for code, found in columns.items() if found}
    return Sheet(layout, standing.about, tuple(lines), totals)


def _found(places: Iterable[Where], there: Mapping[Where, Judged]) -> list[Judged]:
    return [there[where] for where in places if where in there]


def _scored(parts: Iterable[Judged], level_of: LevelOf) -> Scored:
    parts = list(parts)
    share = evidence(parts).share
    return Scored(
        evidence(one for one in parts if one.decided and not one.by_a_person),
        evidence(one for one in parts if one.decided and one.by_a_person),
        evidence(one for one in parts if not one.decided),
        None if share is None else level_of(share),
    )
