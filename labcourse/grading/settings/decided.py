"""What is decided of a course for a term: plain data, each with what counts where ``course.toml`` says nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime

from labcourse import course_file
from labcourse.benches import THEIR_OWN, BenchPolicy

#: Digits of a share of points: sums of points are off in the last digit of a float, and a threshold is to be reached.
SHARE_DIGITS = 9


@dataclass(frozen=True)
class FeedbackSettings:
    """What students see of their marks, and when. (Never what the key has for right.)

    Attributes
    ----------
    points : how many points each answer earned
    reasons : what the key says to it, besides whether it was right
    opens : when it may be seen; at once where it is None
    """

    points: bool = True
    reasons: bool = True
    opens: datetime | None = None

    def is_open(self, now: datetime) -> bool:
        """Whether students may see it at a time, which knows its time zone."""
        return self.opens is None or now >= self.opens


@dataclass(frozen=True)
class ReflectSettings:
    """Whether and when ``lab.reflect()`` asks students about what in their own answers does not go together.

    Attributes
    ----------
    asks : whether it does
    opens : from when on; at once where it is None
    """

    asks: bool = True
    opens: datetime | None = None

    def plain(self) -> str:
        """What stands under "reflect" in ``course.json``."""
        if not self.asks:
            return course_file.OFF
        return course_file.ON if self.opens is None else self.opens.isoformat()


@dataclass(frozen=True)
class ReportSettings:
    """What a lab report may be like.

    Attributes
    ----------
    page_limit : pages, cover and contents included; None where there is no limit
    """

    page_limit: int | None = None


@dataclass(frozen=True)
class MarkSettings:
    """What marks come to.

    Attributes
    ----------
    drop : names of what does not count, neither in points nor in what they are out of: a question, or a question and a
        part, as "1.2" or "1.2 speed"
    weights : names, as above → by what points and what they are out of are multiplied; a part's own counts before its
        question's
    out_of : the scale of the final grade; where it is None, that is the sum of points
    decimals : of the final grade, which is rounded half up
    predictions : points on top for each prediction that was made
    """

    drop: tuple[str, ...] = ()
    weights: Mapping[str, float] = field(default_factory=dict)
    out_of: float | None = None
    decimals: int = 2
    predictions: float = 0.0

    def dropped_as(self, question: str, part: str) -> str:
        """The name by which a part of a question is left out; "" where it counts."""
        return _named(question, part, self.drop)

    def weighted_as(self, question: str, part: str) -> str:
        """The name by which a part of a question has another weight than 1; "" where it has none."""
        name = _named(question, part, self.weights)
        return name if self.weights.get(name, 1) != 1 else ""

    def weight(self, question: str, part: str) -> float:
        """By what the points of a part of a question are multiplied."""
        return self.weights.get(_named(question, part, self.weights), 1.0)


def _named(question: str, part: str, names: Collection[str]) -> str:
    """The name that a part of a question has among these: its own, or else its question's."""
    return next((name for name in (f"{question} {part}", question) if name in names), "")


@dataclass(frozen=True)
class LevelSettings:
    """Levels of answers: 4, the best, to 1; and 0, where there is nothing of worth.

    Attributes
    ----------
    shares : level → the share (0 to 1) of the points that it is worth
    thresholds : level → the share of the points from which on work has it; nothing earned is level 0
    """

    shares: Mapping[int, float] = field(default_factory=lambda: {4: 1.0, 3: 0.75, 2: 0.5, 1: 0.25, 0: 0.0})
    thresholds: Mapping[int, float] = field(default_factory=lambda: {4: 0.9, 3: 0.75, 2: 0.5, 1: 0.0})

    def level_of(self, share: float) -> int:
        """The level of a share (0 to 1) of the points: the highest whose threshold it reaches; 0 for nothing."""
        earned = round(share, SHARE_DIGITS)
        reached = (level for level, least in self.thresholds.items() if earned >= round(least, SHARE_DIGITS))
        return max(reached, default=0) if earned > 0 else 0


@dataclass(frozen=True)
class Deadline:
    """When notebooks are due.

    Attributes
    ----------
    due : the last moment that is in time
    notebooks : names, without their ending; all of the course's where there are none
    section : of the roster, for which it is; "" for all
    """

    due: datetime
    notebooks: tuple[str, ...] = ()
    section: str = ""


@dataclass(frozen=True)
class Extension:
    """More time for somebody.

    Attributes
    ----------
    until : the last moment that is in time
    students : IDs, or other names that the roster has for them
    section : of the roster, all of whose students have it; "" for those named alone
    notebooks : names, without their ending; all of the course's where there are none
    """

    until: datetime
    students: tuple[str, ...] = ()
    section: str = ""
    notebooks: tuple[str, ...] = ()


@dataclass(frozen=True)
class LateSettings:
    """What lateness costs.

    Attributes
    ----------
    per_day : %, of the points that a notebook earned, for each day that has begun
    cap : %, the most that is taken
    grace_hours : h, after what was due, in which nothing is taken; days are counted from their end on
    """

    per_day: float = 0.0
    cap: float = 100.0
    grace_hours: float = 0.0


@dataclass(frozen=True)
class OutcomeSettings:
    """When an outcome counts as attained.

    Attributes
    ----------
    level : which a student has to reach in it
    share : %, of the students who have to
    fewest : students of the smallest group that is shown
    """

    level: int = 3
    share: float = 70.0
    fewest: int = 5


@dataclass(frozen=True)
class CourseSettings:
    """What is decided of a course for a term.

    Attributes
    ----------
    title : of the course, for people; "" leaves it to ``course.py``
    term : as "2026 autumn"
    python : which grades, major and minor version; "" where it is the one that makes the release
    bench : which bench each student has
    given : name of what is given to a class that begins in the middle; "" where it begins at the beginning
    feedback : what students see of their marks, and when
    reflect : whether and when their own answers are held against each other for them
    report : what their lab reports may be like
    releases : the folder in which releases are kept, from the one above the course's
    marks : what counts, by how much, and on which scale
    levels : what levels are worth, and from where on work has them
    deadlines, extensions : what is due when, and who has more time
    late : what lateness costs
    outcomes : when an outcome counts as attained
    """

    title: str = ""
    term: str = ""
    python: str = ""
    bench: BenchPolicy = THEIR_OWN
    given: str = ""
    feedback: FeedbackSettings = field(default_factory=FeedbackSettings)
    reflect: ReflectSettings = field(default_factory=ReflectSettings)
    report: ReportSettings = field(default_factory=ReportSettings)
    releases: str = "releases"
    marks: MarkSettings = field(default_factory=MarkSettings)
    levels: LevelSettings = field(default_factory=LevelSettings)
    deadlines: tuple[Deadline, ...] = ()
    extensions: tuple[Extension, ...] = ()
    late: LateSettings = field(default_factory=LateSettings)
    outcomes: OutcomeSettings = field(default_factory=OutcomeSettings)

    def of_marking(self) -> CourseSettings:
        """These, with what has no part in marking answers as it usually is: what is made of marks, and who sees them.

        Settings that are equal in this way mark alike.
        """
        usual = CourseSettings()
        return replace(
            self,
            python=usual.python,
            given=usual.given,  # each run knows its own
            feedback=usual.feedback,
            report=usual.report,
            marks=usual.marks,
            levels=usual.levels,
            deadlines=usual.deadlines,
            extensions=usual.extensions,
            late=usual.late,
            outcomes=usual.outcomes,
        )
