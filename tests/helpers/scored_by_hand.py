"""What marks, levels and reports of the class in ``scored_class.py`` come to, worked out anew from the documentation.

Nothing of rotflex reckons here: plain Python, exact fractions and numpy; the definitions are those of
docs/settings_and_releases.md, docs/outcomes.md and docs/scoring.md. The course's own files (settings, sheets, outcomes)
and its catalogue are read for what stands in them.
"""

import math
import tomllib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from fractions import Fraction

from made_courses import OURS
from scored_class import (
    BY_MACHINE,
    COURSE_TOML,
    FOR_A_PERSON,
    KEY_FAULT,
    NOTEBOOK,
    PARTS,
    SECTIONS,
    Drawn,
    Person,
    Student,
    Where,
)

TERM = tomllib.loads(COURSE_TOML)
SHARES = {int(level): Fraction(share, 100) for level, share in TERM["levels"]["shares"].items()} | {0: Fraction(0)}
THRESHOLDS = {int(level): Fraction(least, 100) for level, least in TERM["levels"]["thresholds"].items()}
_SECTIONS = {question.section for question in OURS.catalogue.questions.values()}
#: Without the sheet of an optional notebook that is off.
SHEETS = {
    name: layout
    for name, layout in tomllib.loads((OURS.folder / "sheets.toml").read_text(encoding="utf-8")).items()
    if layout.get("section", "2.2") in _SECTIONS
}
MAPPED = tomllib.loads((OURS.folder / "outcomes.toml").read_text(encoding="utf-8"))
LEVELS = (4, 3, 2, 1, 0)
ATTAINED, FEWEST = 3, 5  # as docs/settings_and_releases.md has them where nothing is said
_ALIAS = {f"platform-{n:02}": f"s{n:02}" for n in range(100)}


def fraction(number: float) -> Fraction:
    """A number as it is written."""
    return Fraction(str(number))


def half_up(number: Fraction, decimals: int = 2) -> str:
    """Rounded, with all decimals."""
    whole = math.floor(number * 10**decimals + Fraction(1, 2))
    return f"{whole // 10**decimals}.{whole % 10**decimals:0{decimals}}"


@dataclass(frozen=True)
class Mark:
    """Points as they are in the end; None while they are not decided. ``by`` is m or p, the machine or a person."""

    where: Where
    points: Fraction | None
    out_of: Fraction
    by: str
    status: str


def marks(one: Student) -> list[Mark]:
    """All that is worth points, in the catalogue's order."""
    found = []
    for where, part in PARTS.items():
        out_of = fraction(part.points)
        if where in one.persons:
            found.append(_by_person(where, one.persons[where], out_of))
        elif out_of:
            status = one.machine[where]
            points = None if status == KEY_FAULT else fraction(BY_MACHINE[status]) * out_of
            found.append(Mark(where, points, out_of, "m", status))
    return found


def _by_person(where: Where, person: Person, out_of: Fraction) -> Mark:
    if not person.text:
        return Mark(where, Fraction(0), out_of, "m", "missing")
    level = person.first if person.decided is None else person.decided
    if level is not None:
        return Mark(where, SHARES[level] * out_of, out_of, "p", "given by a person")
    if person.points is not None:
        return Mark(where, fraction(person.points), out_of, "p", "given by a person")
    return Mark(where, None, out_of, "p", FOR_A_PERSON)


def by_thresholds(earned: Fraction, out_of: Fraction) -> int:
    """The highest level from whose threshold on the share is; nothing earned is level 0."""
    return max((n for n, least in THRESHOLDS.items() if earned and earned / out_of >= least), default=0)


def of_points(found: Iterable[Mark]) -> tuple[Fraction, Fraction]:
    """Earned, as far as decided, and possible."""
    found = list(found)
    return sum((one.points or Fraction(0) for one in found), Fraction(0)), sum(one.out_of for one in found)


def dropped(where: Where) -> bool:
    """By course.toml: its question, or this part of it."""
    return where[0] in TERM["marks"]["drop"] or " ".join(where) in TERM["marks"]["drop"]


def weight(where: Where) -> Fraction:
    """A part's own counts in place of its question's."""
    weights = TERM["marks"]["weights"]
    return fraction(weights.get(" ".join(where), weights.get(where[0], 1)))


def days_late(one: Student, notebook: str) -> int:
    """The latest of all deadlines and extensions counts; days that have begun, after the grace."""
    received = one.received.get(notebook)
    if received is None:
        return 0
    dues: list[datetime] = []
    for entry in TERM["deadline"]:
        if notebook in entry["notebooks"] and entry.get("section", one.section) == one.section:
            dues.append(entry["due"])
    for entry in TERM["extension"]:
        named = {_ALIAS.get(name, name) for name in entry.get("students", [])}
        theirs = one.name in named or entry.get("section") == one.section
        if theirs and notebook in entry.get("notebooks", [notebook]):
            dues.append(entry["until"])
    late = received - max(dues) - timedelta(hours=TERM["late"]["grace_hours"])
    return max(0, math.ceil(late / timedelta(days=1)))


def earned_of(one: Student) -> tuple[Fraction, Fraction, bool]:
    """Earned by the settings, what it is out of, and whether all that counts is decided."""
    earned = possible = Fraction(0)
    decided = True
    for mark in marks(one):
        if dropped(mark.where):
            continue
        late = days_late(one, NOTEBOOK[mark.where[0]])
        taken = Fraction(min(late * TERM["late"]["per_day"], TERM["late"]["cap"]), 100)
        earned += weight(mark.where) * (mark.points or 0) * (1 - taken)
        possible += weight(mark.where) * mark.out_of
        decided = decided and mark.points is not None
    return earned, possible, decided


@dataclass(frozen=True)
class Cell:
    """What several parts came to: level (None where nothing is decided), sums, how many wait, and whose marks."""

    level: int | None
    earned: Fraction
    decided: Fraction
    possible: Fraction
    waiting: int
    by: str

    @property
    def share(self) -> Fraction | None:
        return self.earned / self.decided if self.decided else None


def cell(found: Iterable[Mark]) -> Cell | None:
    """By the one rule of docs/outcomes.md; None where there is nothing to score."""
    there = [one for one in found if not dropped(one.where)]
    if not there:
        return None
    known = [one for one in there if one.points is not None]
    earned, decided = of_points(known)
    level = by_thresholds(earned, decided) if decided else None
    by = "+".join(who for who in "mp" if any(one.by == who for one in known))
    return Cell(level, earned, Fraction(decided), Fraction(of_points(there)[1]), len(there) - len(known), by)


def criteria() -> dict[tuple[str, str], set[str]]:
    """Kind and name → codes."""
    codes = {("code", code): {code} for code in OURS.catalogue.outcomes}
    goes = {
        outcome: {code for code, where in MAPPED["codes"].items() if outcome in where} for outcome in MAPPED["outcomes"]
    }
    return codes | {("outcome", outcome): those for outcome, those in goes.items() if those}


def by_criterion(one: Student) -> dict[tuple[str, str], Cell | None]:
    """A student's cells, for each code and each outcome."""
    own = marks(one)
    return {
        name: cell(mark for mark in own if PARTS[mark.where].outcome in codes) for name, codes in criteria().items()
    }


def sheet_cells(one: Student) -> dict[tuple[str, str, str], Cell]:
    """Sheet, row and code → what stands there; the row "total" has all of its column."""
    own = {mark.where: mark for mark in marks(one)}
    found: dict[tuple[str, str, str], Cell] = {}
    for name, layout in SHEETS.items():
        columns: dict[str, list[Mark]] = {}
        for row, parts in _rows(layout):
            for code in (*layout["codes"], *layout.get("format", ())):
                there = [own[where] for where in parts if where in own and PARTS[where].outcome == code]
                columns.setdefault(code, []).extend(there)
                scored = cell(there)
                found |= {(name, row, code): scored} if scored else {}
        totals = {(name, "total", code): cell(there) for code, there in columns.items()}
        found |= {place: scored for place, scored in totals.items() if scored}
    return found


def _rows(layout: dict) -> Iterator[tuple[str, list[Where]]]:
    """Number of a row, and what may be scored there."""
    if "section" in layout:
        for number, question in OURS.catalogue.questions.items():
            if question.section == layout["section"]:
                yield number, [where for where in PARTS if where[0] == number]
        return
    report = layout["report"]
    for item in OURS.catalogue.report_items:
        if item.report != report:
            continue
        shown = [
            where for where in PARTS for number, part in item.shows if where[0] == number and part in ("", where[1])
        ]
        own = [(report, item.part), (f"{report}, as a whole", item.judged)]
        parts = [where for where in PARTS if where in own or where in shown]
        parts = [where for where in parts if PARTS[where].outcome in item.outcomes]
        also = layout.get("also", {}).get(item.number, [])
        yield item.number, [where for where in PARTS if where in parts or where[0] in also]


@dataclass(frozen=True)
class Attained:
    """A line of attainment.csv."""

    students: int
    provisional: int
    levels: dict[int, int]
    attained: int
    mean: Fraction


def attained(cells: Collection[Cell | None]) -> Attained | None:
    """Of those of whom something is decided; None where there is nobody."""
    known = [one for one in cells if one is not None and one.share is not None]
    if not known:
        return None
    levels = Counter(one.level for one in known)
    return Attained(
        len(known),
        sum(one.waiting > 0 for one in known),
        {level: levels[level] for level in LEVELS},
        sum(one.level >= ATTAINED for one in known if one.level is not None),
        sum((one.share for one in known if one.share is not None), Fraction(0)) / len(known),
    )


def attainment(drawn: Drawn) -> dict[tuple[str, str, str], Attained | None]:
    """Group, kind and criterion → figures; None where the group is too small, or would tell of one that is."""
    cells = {name: by_criterion(one) for name, one in drawn.students.items()}
    groups = {section: [one.name for one in drawn.students.values() if one.section == section] for section in SECTIONS}
    smallest = sorted(groups, key=lambda section: len(groups[section]))
    hidden = {section for section in groups if len(groups[section]) < FEWEST}
    while hidden and (len(hidden) < 2 or sum(len(groups[section]) for section in hidden) < FEWEST):
        hidden.add(next(section for section in smallest if section not in hidden))
    found = {}
    for kind, name in criteria():
        for group, those in {"everybody": list(cells), **groups}.items():
            figures = attained([cells[one][kind, name] for one in those])
            found[group, kind, name] = None if group in hidden else figures
    return found
