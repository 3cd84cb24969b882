"""What a term comes to, worked out from ``term_table.py`` in plain fractions, and from nothing of the program."""

from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from fractions import Fraction
from math import ceil
from typing import Any

from term_table import ASSIGNMENTS, CLASS, PARTS, QUESTION, TERM, UNREADABLE, UNTOUCHED, WORDS, at

#: States of a piece of work, from the least advanced.
STATES = ("could not be graded", "missing", "untouched", "not due", "handed in", "waits for a person", "marked")
NOT_GRADED, MISSING, UNTOUCHED_STATE, NOT_DUE, HANDED_IN, WAITS, MARKED = STATES
GRACE, DAY = timedelta(hours=2), timedelta(days=1)


def due_date(student: str, notebook: str) -> datetime | None:
    """The latest date that the settings have for a student's notebook; None for the report, which has none."""
    if notebook == "02_mass" and student == "s6":
        return at("11-13 18:00")
    if notebook in ("01_spring", "02_mass"):
        return at("11-08 18:00" if CLASS[student][1] == "B" else "11-06 18:00")
    return at("11-27 18:00" if student == "s5" else "11-20 18:00") if notebook == "03_motion" else None


def rounded(number: Fraction | None) -> str:
    """With two decimals, half up; "" for None."""
    if number is None:
        return ""
    cents = int(number * 100 + Fraction(1, 2))
    return f"{cents // 100}.{cents % 100:02}"


class ByHand:
    """All that is true after the first days of the term.

    Attributes
    ----------
    came : student and notebook → when it came, and what is in it: the newest
    given : student and part → points by a person, and the words that they are for
    excused : student and assignment
    published : assignments that were given back
    mended : whether the answers were marked by the mended key
    """

    def __init__(self, days: int) -> None:
        self.now, self.lost = at(TERM[days - 1].now), TERM[days - 1].lost
        self.came: dict[tuple[str, str], tuple[datetime, Any]] = {}
        self.given: dict[tuple[str, str], tuple[Fraction, str]] = {}
        self.excused: set[tuple[str, str]] = set()
        self.published: set[str] = set()
        self.mended = False
        self.open: set[tuple[str, str]] = set()
        for day in TERM[:days]:
            for hand_in in sorted(day.hand_ins, key=lambda one: one.when):
                for student in hand_in.students.split("+"):
                    self._take(student, at(hand_in.when), hand_in.notebooks)
            for verb, *about in day.acts:
                getattr(self, f"_{verb}")(*about)

    def _take(self, student: str, when: datetime, notebooks: dict[str, Any]) -> None:
        """The newest counts, with the time at which it came first, unless marks were given back before.

        What is empty or broken replaces nothing. No later version is worth less here: versions_table.py has such.
        """
        names = {name[:2]: name for name in PARTS}
        for number, content in notebooks.items():
            before = self.came.get((student, names[number]))
            title = next(title for title, (own, _out_of) in ASSIGNMENTS.items() if names[number] in own)
            is_new = isinstance(content, dict) and before is not None and content != before[1]
            if before is None or (is_new and title not in self.published):
                self.came[student, names[number]] = when, content

    def _mark(self, student: str, part: str, points: str) -> None:
        self.given[student, part] = Fraction(points), self.answers(student)[part]

    def _excuse(self, student: str, assignment: str) -> None:
        self.excused.add((student, assignment))

    def _undo(self, student: str, assignment: str) -> None:
        self.excused.remove((student, assignment))

    def _request(self, student: str, part: str) -> None:
        self.open.add((student, part))

    def _answer(self, student: str, part: str) -> None:
        self.open.remove((student, part))

    def _publish(self, *assignments: str) -> None:
        self.published |= set(assignments or ASSIGNMENTS)

    def _regrade(self) -> None:
        self.mended = True

    # --- a student's notebook -----------------------------------------------------------------------------------------

    def answers(self, student: str) -> dict[str, Any]:
        """Part → what the student answered, in all notebooks."""
        contents = [content for (who, _), (_, content) in self.came.items() if who == student]
        return {part: value for content in contents if isinstance(content, dict) for part, value in content.items()}

    def content(self, student: str, notebook: str) -> Any:
        """What is written in a notebook, or how it is; None if there is none."""
        return self.came.get((student, notebook), (None, None))[1]

    def earned(self, student: str, part: str) -> Fraction | None:
        """Points of a part as they count, before lateness; None while they are not decided."""
        own = self.answers(student)
        (notebook,) = (name for name, parts in PARTS.items() if part in parts)
        if self.content(student, notebook) == UNREADABLE:
            return None
        if part not in own:
            return Fraction(0)
        if student == self.lost:
            return None
        if part in WORDS:
            points, words = self.given.get((student, part), (None, ""))
            return points if words == own[part] else None
        if part == "load" and not self.mended:
            return None
        right = {"k": 50, "m": 2, "load": 70, "total": 7}[part]
        follows = []
        if part == "m" and self.mended and "k" in own:
            follows = [Fraction(own["k"]) / 25]
        if part == "load" and {"k", "m"} <= own.keys():
            follows = [Fraction(own["k"]) + 10 * Fraction(str(own["m"]))]
        return Fraction(PARTS[notebook][part] if Fraction(str(own[part])) in (right, *follows) else 0)

    def days_late(self, student: str, notebook: str) -> int:
        """Days that have begun since the end of the grace."""
        due, (when, content) = due_date(student, notebook), self.came.get((student, notebook), (self.now, UNTOUCHED))
        return 0 if due is None or isinstance(content, str) else max(0, ceil((when - due - GRACE) / DAY))

    def points(self, student: str, notebook: str) -> Fraction:
        """Points of a notebook as far as they are decided: less what lateness takes."""
        decided = sum((self.earned(student, part) or Fraction(0) for part in PARTS[notebook]), Fraction(0))
        taken = min(10 * self.days_late(student, notebook), 35)
        return decided * (100 - taken) / 100

    def is_due(self, student: str, notebook: str) -> bool:
        """Whether the last date has passed, with the grace; for the report, that of the last notebook with a date."""
        dates = [due_date(student, name) for name in (PARTS if notebook == "04_report" else [notebook])]
        return self.now > max(date for date in dates if date) + GRACE

    def state(self, student: str, notebook: str) -> str:
        """The state of a student's notebook."""
        content = self.content(student, notebook)
        undecided = [part for part in PARTS[notebook] if self.earned(student, part) is None]
        if content == UNREADABLE or "load" in undecided:
            return NOT_GRADED
        if content is None:
            return MISSING if self.is_due(student, notebook) else NOT_DUE
        if content == UNTOUCHED:
            return UNTOUCHED_STATE
        return HANDED_IN if student == self.lost else WAITS if undecided else MARKED

    # --- a student's assignment ---------------------------------------------------------------------------------------

    def states(self, student: str) -> dict[str, str]:
        """Assignment → its state: the least advanced one of its notebooks."""
        return {
            title: min((self.state(student, name) for name in names), key=STATES.index)
            for title, (names, _) in ASSIGNMENTS.items()
        }

    def label(self, student: str, title: str) -> str:
        """The state of an assignment with its flags, as in "marked, 3 days late"."""
        if (student, title) in self.excused:
            return "excused"
        late = max(self.days_late(student, name) for name in ASSIGNMENTS[title][0])
        days = f", {late} day{'s' if late > 1 else ''} late" if late else ""
        return f"{self.states(student)[title]}{days}"

    def counts(self, student: str, title: str) -> bool:
        """Whether all of an assignment is due, and the student is not excused."""
        return (student, title) not in self.excused and all(self.is_due(student, n) for n in ASSIGNMENTS[title][0])

    def is_graded(self, student: str) -> bool:
        """Whether there is anything of a student that was graded: then there is a page."""
        return student != self.lost and any(who == student for who, _name in self.came)

    def is_open(self, student: str, title: str) -> bool:
        """Whether nothing can be said of an assignment yet: it has not been handed in, and is not due."""
        state = self.states(student)[title]
        return state in (NOT_DUE, HANDED_IN) or (state == UNTOUCHED_STATE and not self.counts(student, title))

    def undecided(self, student: str, title: str) -> Iterator[str]:
        """The parts of an assignment on which nobody has decided."""
        parts = (part for name in ASSIGNMENTS[title][0] for part in PARTS[name])
        return (part for part in parts if self.earned(student, part) is None)

    def share(self, student: str, title: str) -> Fraction | None:
        """Earned of possible points of an assignment; None if it is excused, not decided, or not there yet."""
        names, undecided = ASSIGNMENTS[title][0], [*self.undecided(student, title)]
        if undecided or self.is_open(student, title) or (student, title) in self.excused:
            return None
        return sum((self.points(student, name) for name in names), Fraction(0)) / possible(names)

    def column(self, student: str, title: str, out_of: int = 0) -> str:
        """The points of an assignment, in its column or in one of a platform that is out of something else."""
        share = None if student == self.lost else self.share(student, title)
        return rounded(None if share is None else share * (out_of or ASSIGNMENTS[title][1]))

    def so_far(self, student: str, titles: Iterable[str] = ASSIGNMENTS) -> tuple[Fraction, int]:
        """Points of the assignments that count now, as far as they are decided, and what they are out of."""
        counting = [title for title in titles if self.counts(student, title)]
        earned = Fraction(0)
        for names, most in (ASSIGNMENTS[title] for title in counting):
            earned += most * sum((self.points(student, name) for name in names), Fraction(0)) / possible(names)
        return earned, sum(ASSIGNMENTS[title][1] for title in counting)

    # --- what a person must do today ----------------------------------------------------------------------------------

    def to_do(self) -> dict[str, tuple[set[str], Fraction]]:
        """How a task begins → its students, and the points at stake, by the columns of the assignments."""
        tasks: dict[str, tuple[set[str], Fraction]] = {}
        work = [(who, title, name) for who in CLASS for title in ASSIGNMENTS for name in ASSIGNMENTS[title][0]]
        for student, title, name in (one for one in work if one[:2] not in self.excused):
            for part, worth in PARTS[name].items():
                what = self.task(student, title, name, part)
                if what:
                    who, points = tasks.get(what, (set(), Fraction(0)))
                    at_stake = Fraction(worth * ASSIGNMENTS[title][1], possible(ASSIGNMENTS[title][0]))
                    tasks[what] = {*who, student}, points + at_stake
        return tasks

    def task(self, student: str, title: str, name: str, part: str) -> str:
        """How the task begins that is about a part of a notebook; "" if there is nothing to do."""
        state, undecided = self.state(student, name), self.earned(student, part) is None
        is_due = self.is_due(student, name)
        if state == MISSING or (state == UNTOUCHED_STATE and is_due):
            return f"{state}: {title}"
        if state == HANDED_IN:
            return state
        if self.content(student, name) == UNREADABLE:
            return f"{state}: {name}"
        if part == "load" and undecided:
            return f"{NOT_GRADED}: 3.1, load"
        if part in WORDS and undecided and (student, part) in self.given:
            return f"a person's mark for {QUESTION[part]} {part} lapsed"
        return f"{WAITS}: answers of {title}" if part in WORDS and undecided and is_due else ""


def possible(notebooks: Iterable[str]) -> int:
    """Points that notebooks are out of."""
    return sum(sum(PARTS[name].values()) for name in notebooks)
