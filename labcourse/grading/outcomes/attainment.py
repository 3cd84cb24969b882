"""How a class and its groups do in each criterion: levels, attainment, and mean shares by question."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean

from labcourse.grading.outcomes.levels import Evidence, Judged, LevelOf, Standing, evidence
from labcourse.grading.outcomes.small_groups import withheld
from labcourse.grading.settings import OutcomeSettings


@dataclass(frozen=True)
class Figures:
    """What is said of a group in a criterion.

    Attributes
    ----------
    students : of whom something is decided in it
    provisional : of these, those of whom something waits
    levels : level → how many of the students are at it
    attained : how many are at the level that is aimed at, or above
    mean : of the students' shares of points, 0 to 1
    """

    students: int
    provisional: int
    levels: Mapping[int, int]
    attained: int
    mean: float

    @property
    def attainment(self) -> float:
        """In %."""
        return 100 * self.attained / self.students


@dataclass(frozen=True)
class Cell:
    """A group in a criterion: its figures, or why there are none; ``withheld`` where there are some to be shown."""

    figures: Figures | None = None
    why: str = ""
    withheld: bool = False


@dataclass(frozen=True)
class Attainment:
    """A criterion, of the whole class and of each group.

    Attributes
    ----------
    criterion : a code, or the key of an outcome
    everybody : the whole class
    groups : group → the same, in the order of the groups
    questions : number of a question that gives evidence → mean of the students' shares there, 0 to 1, and how many
        students these are; None where they are too few
    """

    criterion: str
    everybody: Cell
    groups: Mapping[str, Cell] = field(default_factory=dict)
    questions: Mapping[str, tuple[float, int] | None] = field(default_factory=dict)


def too_few(fewest: int) -> str:
    """In place of the figures of a small group."""
    return f"fewer than {fewest}: not shown"


def too_telling(fewest: int) -> str:
    """In place of the figures from which those of a small group could be worked out."""
    return f"not shown: it would tell of a group of fewer than {fewest}"


def attainments(
    standings: Sequence[Standing],
    criteria: Mapping[str, Collection[str]],
    level_of: LevelOf,
    goal: OutcomeSettings,
    group_of: Callable[[Standing], str] | None = None,
) -> list[Attainment]:
    """How a class does.

    Parameters
    ----------
    standings : everybody of whom anything is marked
    criteria : name of a criterion → the codes of its parts
    level_of : the level of a share of points
    goal : what counts as attained, and what is too small to be shown
    group_of : the group that a student is in; without it there are no groups
    """
    groups: dict[str, list[Standing]] = {}
    if group_of is not None:
        for one in standings:
            groups.setdefault(group_of(one), []).append(one)
    return [
        Attainment(
            name,
            _cell(_shares(standings, codes), level_of, goal),
            _by_group({group: _shares(groups[group], codes) for group in sorted(groups)}, level_of, goal),
            _by_question(standings, codes, goal.fewest),
        )
        for name, codes in criteria.items()
    ]


def _shares(standings: Iterable[Standing], codes: Collection[str]) -> list[Evidence]:
    """What counts of each student in a criterion; those of whom nothing is decided in it are left out."""
    found = (evidence(part for part in one.parts if part.code in codes) for one in standings)
    return [one for one in found if one.share is not None]


def _by_group(shares: Mapping[str, list[Evidence]], level_of: LevelOf, goal: OutcomeSettings) -> dict[str, Cell]:
    hidden = withheld({group: len(found) for group, found in shares.items()}, goal.fewest)
    return {
        group: Cell(why=too_telling(goal.fewest), withheld=True)
        if group in hidden and len(found) >= goal.fewest
        else _cell(found, level_of, goal)
        for group, found in shares.items()
    }


def _cell(counted: Sequence[Evidence], level_of: LevelOf, goal: OutcomeSettings) -> Cell:
    if not counted:
        return Cell(why="nothing decided yet")
    if len(counted) < goal.fewest:
        return Cell(why=too_few(goal.fewest), withheld=True)
    shares = [one.share for one in counted if one.share is not None]
    levels = [level_of(share) for share in shares]
    return Cell(
        Figures(
            len(shares),
            sum(one.waiting > 0 for one in counted),
            Counter(levels),
            sum(level >= goal.level for level in levels),
            fmean(shares),
        )
    )


def _by_question(
    standings: Sequence[Standing], codes: Collection[str], fewest: int
) -> dict[str, tuple[float, int] | None]:
    shares: dict[str, list[float]] = {}
    for one in standings:
        parts: dict[str, list[Judged]] = {}
        for part in one.parts:
            if part.code in codes:
                parts.setdefault(part.mark.question, []).append(part)
        for question, found in parts.items():
            share = evidence(found).share
            shares.setdefault(question, []).extend([] if share is None else [share])
    return {
        question: (fmean(found), len(found)) if len(found) >= max(fewest, 1) else None
        for question, found in shares.items()
    }
