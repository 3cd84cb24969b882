"""What a student's marks come to. All of it is reckoned exactly; the final grade alone is rounded, once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Protocol

from labcourse.answers import answers, predictions
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError
from labcourse.grading.accounts import in_words
from labcourse.grading.accounts.exact import exact, half_up
from labcourse.grading.accounts.lateness import Timing, timing
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Arrival, RunRecord, StudentRecord
from labcourse.grading.settings import LateSettings, MarkSettings
from labcourse.grading.verdicts import UNDECIDED

_ENDING = ".ipynb"


class AMark(Protocol):
    """What of a mark is needed here; a gradebook's record of it is such a thing, too."""

    @property
    def question(self) -> str: ...
    @property
    def part(self) -> str: ...
    @property
    def status(self) -> str: ...
    @property
    def points(self) -> float: ...
    @property
    def out_of(self) -> float: ...


@dataclass(frozen=True)
class Line:
    """One mark, and how it counts.

    Attributes
    ----------
    question, part : which
    notebook : where it is asked, without ending; "" if the course does not ask it any more
    points : earned; None while nothing is decided
    out_of : what there is
    dropped_as : the name by which the settings leave it out; "" where it counts
    weighted_as : the name by which they give it another weight; "" where it has none
    weight : by which both are multiplied
    taken : share of the points that the notebook's lateness costs
    """

    question: str
    part: str
    notebook: str
    points: Fraction | None
    out_of: Fraction
    dropped_as: str = ""
    weighted_as: str = ""
    weight: Fraction = Fraction(1)
    taken: Fraction = Fraction(0)

    @property
    def counts(self) -> bool:
        """Whether it is not left out."""
        return not self.dropped_as

    @property
    def weighted(self) -> Fraction:
        """Points with their weight, before anything is taken for lateness."""
        return self.weight * (self.points or 0) if self.counts else Fraction(0)

    @property
    def earned(self) -> Fraction:
        """Points as they count."""
        return self.weighted * (1 - self.taken)

    @property
    def possible(self) -> Fraction:
        """What they are out of, as it counts."""
        return self.weight * self.out_of if self.counts else Fraction(0)


@dataclass(frozen=True)
class Bonus:
    """Points on top.

    Attributes
    ----------
    what : of which there are some, in words
    number : how many
    each : points for each
    """

    what: str
    number: int
    each: Fraction

    @property
    def points(self) -> Fraction:
        """Of all of them."""
        return self.number * self.each


@dataclass(frozen=True)
class Account:
    """What a student's marks come to.

    Attributes
    ----------
    lines : each mark that is worth points
    bonus : points on top
    timings : notebooks that came late, in time by an extension alone, or nobody knows when
    marks, late : the settings that it was made by
    """

    lines: tuple[Line, ...]
    bonus: tuple[Bonus, ...]
    timings: tuple[Timing, ...]
    marks: MarkSettings
    late: LateSettings

    @property
    def earned(self) -> Fraction:
        """Points as they count, as far as they are decided."""
        return sum((one.earned for one in self.lines), Fraction(0)) + sum(one.points for one in self.bonus)

    @property
    def out_of(self) -> Fraction:
        """What these are out of, undecided ones included."""
        return sum((one.possible for one in self.lines), Fraction(0))

    @property
    def undecided(self) -> tuple[Line, ...]:
        """What counts, and nobody has given or refused yet."""
        return tuple(one for one in self.lines if one.counts and one.points is None)

    @property
    def scaled(self) -> Fraction:
        """What is earned on the scale of the final grade, before it is rounded. There has to be something to earn."""
        return self.earned if self.marks.out_of is None else self.earned / self.out_of * exact(self.marks.out_of)

    @property
    def final(self) -> float | None:
        """The final grade; None while something that counts is not decided, or where nothing counts."""
        if self.undecided or not self.out_of:
            return None
        return float(half_up(self.scaled, self.marks.decimals))

    @property
    def final_out_of(self) -> float:
        """The scale of the final grade."""
        return float(self.out_of) if self.marks.out_of is None else self.marks.out_of

    @property
    def is_plain(self) -> bool:
        """Whether the final grade is the sum of the points, and nothing has to be said of it."""
        usual = MarkSettings()
        special = any(one.dropped_as or one.weighted_as for one in self.lines) or self.bonus or self.timings
        return not special and (self.marks.out_of, self.marks.decimals) == (usual.out_of, usual.decimals)

    def how(self) -> list[str]:
        """What is special about it, in short words without points."""
        return in_words.how(self)

    def steps(self) -> list[str]:
        """How the final grade came about, in words and numbers, so that it can be done again by hand."""
        return in_words.steps(self)

    def as_data(self) -> dict[str, Any]:
        """What it comes to, as plain data."""
        return {
            "earned": float(self.earned),
            "out_of": float(self.out_of),
            "final": self.final,
            "final_out_of": self.final_out_of,
            "how": self.how(),
            "steps": self.steps(),
        }


def account_of(
    marks: Iterable[AMark],
    course: Course,
    record: StudentRecord,
    received: Mapping[str, Arrival],
    run: RunRecord | None = None,
) -> Account:
    """What a student's marks come to by the settings of a course.

    Parameters
    ----------
    marks : all of the student's, persons' included
    course : with its settings, and its catalogue for where questions are asked
    record : the student, as the roster has them
    received : file name of a notebook → when it was handed in
    run : that counts, for the predictions that were made; none were without
    """
    settings = course.settings
    lines = [_line(one, course) for one in marks if one.out_of]
    timings = {}
    for notebook in dict.fromkeys(one.notebook for one in lines if one.notebook):
        found = timing(settings, record, notebook, received.get(f"{notebook}{_ENDING}"))
        if found is not None:
            timings[notebook] = found
    lines = [_late(one, timings, bool(settings.late.per_day)) for one in lines]
    there = {one.notebook for one in lines if one.counts and (one.points is None or one.points)}
    told = (one for one in timings.values() if one.days or one.extended or one.received is None)
    return Account(
        tuple(lines),
        tuple(_bonus(settings.marks, run, course.catalogue)),
        tuple(one for one in told if one.notebook in there),
        settings.marks,
        settings.late,
    )


def _line(mark: AMark, course: Course) -> Line:
    decided = course.settings.marks
    asked = course.catalogue.marked.get(mark.question)
    return Line(
        mark.question,
        mark.part,
        "" if asked is None else asked.notebook,
        None if mark.status in UNDECIDED else exact(mark.points),
        exact(mark.out_of),
        decided.dropped_as(mark.question, mark.part),
        decided.weighted_as(mark.question, mark.part),
        exact(decided.weight(mark.question, mark.part)),
    )


def _late(line: Line, timings: Mapping[str, Timing], costs: bool) -> Line:
    """A line with what lateness takes of it; it is not decided while the time that decides it is not known."""
    found = timings.get(line.notebook)
    if found is None:
        return line
    return replace(line, taken=found.taken, points=None if found.waits and costs else line.points)


def _bonus(decided: MarkSettings, run: RunRecord | None, catalogue: Catalogue) -> Iterator[Bonus]:
    if decided.predictions:
        yield Bonus("predictions made", _predicted(decided, run, catalogue), exact(decided.predictions))


def _predicted(decided: MarkSettings, run: RunRecord | None, catalogue: Catalogue) -> int:
    """How many predictions were made, of questions that count; each is read as strictly as an answer."""
    try:
        said = answers.parse(b"" if run is None else run.answers or b"").get(predictions.SECTION, {})
    except AnswerError:
        return 0
    asked = {number: foretold for number, foretold in catalogue.predictions.items() if number not in decided.drop}
    return sum(len([*predictions.read(foretold, said.get(number, {}))]) for number, foretold in asked.items())
