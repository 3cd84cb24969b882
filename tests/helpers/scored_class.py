"""A class of sixty on this course, made up from a seed, of which all is known: marks, levels, errors, copies.

No notebook is run. The machine's marks are drawn; each answer in words has a true level; a scorer gives levels with
errors by a rule. ``scored_book.py`` puts it into a gradebook; what it comes to is worked out in ``scored_by_hand.py``.
"""

import random
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from typing import Any

from made_courses import OURS

from labcourse.benches import BenchPolicy
from rotflex.hil.student_benches import DRAW
from solutions.true_bench import TrueBench

Where = tuple[str, str]

SIZE, SEED = 60, 2026
CET = timezone(timedelta(hours=1))
FIRST_HALF = ("01_modeling_prelab", "02_finding_stiffness", "03_model_validation", "04_modeling_results")
SECOND_HALF = (
    *("05_control_prelab", "06_control_design", "07_control_simulation", "08_full_state_feedback"),
    *("09_partial_state_feedback", "10_control_results"),
)
DUE_FIRST, DUE_SECOND = datetime(2026, 11, 20, 18, tzinfo=CET), datetime(2026, 12, 11, 18, tzinfo=CET)

COURSE_TOML = """
[course]
term = "2026 autumn"

[marks]
drop = ["2.16", "2.14 D", "2.15", "3.8"]

[marks.weights]
"2.11" = 2.0
"2.11 explanation" = 0.5
"3.17" = 1.5
"Table 3" = 1.1
"Modeling report" = 0.35
"Control report, as a whole" = 0.7

[levels]
shares = {4 = 100, 3 = 80, 2 = 55, 1 = 30}
thresholds = {4 = 88, 3 = 72, 2 = 50, 1 = 0}

[[deadline]]
due = 2026-11-20T18:00:00+01:00
notebooks = ["01_modeling_prelab", "02_finding_stiffness", "03_model_validation", "04_modeling_results"]

[[deadline]]
due = 2026-11-22T18:00:00+01:00
notebooks = ["01_modeling_prelab", "02_finding_stiffness", "03_model_validation", "04_modeling_results"]
section = "B"

[[deadline]]
due = 2026-12-11T18:00:00+01:00
notebooks = ["05_control_prelab", "06_control_design", "07_control_simulation", "08_full_state_feedback", \
"09_partial_state_feedback", "10_control_results"]

[[extension]]
until = 2026-11-27T18:00:00+01:00
students = ["s03", "platform-04"]
notebooks = ["02_finding_stiffness", "03_model_validation"]

[[extension]]
until = 2026-12-14T12:00:00+01:00
section = "C"

[late]
per_day = 10
cap = 35
grace_hours = 2

[outcomes]
share = 65
"""

#: Section → how many; C is so small that nothing of it is shown.
SECTIONS = {"A": 24, "B": 20, "C": 4, "D": 12}
#: Sections whose second report nobody has written yet: all of it is missing.
NOT_YET = {"B": "10_control_results", "D": "10_control_results"}
#: On the roster, and never seen.
ABSENT = ("t01", "t02")
#: Worth their points as a share: of what the machine marks.
BY_MACHINE = {
    "right": 1.0,
    "right, given your own earlier answers": 1.0,
    "partly right": 0.5,
    "wrong": 0.0,
    "missing": 0.0,
}
MISSING, FOR_A_PERSON, KEY_FAULT = "missing", "for a person", "not marked: key fault"
ANN, TEACHER = "Ann Lee", "Dr. T."
ONE_OFF = 0.15  #: share of the answers to which a scorer gives the level next to the true one
MEASURED = {("2.11", "omega_n"), ("2.12", "J_l"), ("2.12", "K_s")}

#: Answers that nobody reads, and one that the teacher is asked about and does not decide.
WAITING = (("s07", "2.17", "reason"), ("s52", "3.17", "explanation"))
ASKED_STILL = ("s08", "3.17", "explanation")

#: Who copies → of whom, and what.
COPIES: dict[str, tuple[str, str]] = {
    **{f"s{21 + 2 * n}": (f"s{20 + 2 * n}", "recording") for n in range(3)},
    **{f"s{31 + 2 * n}": (f"s{30 + 2 * n}", "numbers") for n in range(3)},
}


@dataclass
class Person:
    """An answer that a person reads: what is true of it, and what scorers said.

    Attributes
    ----------
    text : its words; each has a number that no other answer has
    true : its level; None where it was left blank
    first : the level that the first scorer gave; None where nobody did
    points : given without a level
    asked : whether the first scorer asked
    decided : the level that the teacher gave, who was asked
    """

    text: str = ""
    true: int | None = None
    first: int | None = None
    points: float | None = None
    asked: bool = False
    decided: int | None = None


@dataclass
class Student:
    """A student, and all that is true of their work.

    Attributes
    ----------
    name : the ID
    section : of the roster
    machine : part that the machine marks → status
    persons : part that a person reads → what is true of it
    received : notebook → when what counts came; None where nobody knows. What is not there was not handed in
    numbers : what they measured, right or not
    predictions : question → name → what they predicted
    """

    name: str
    section: str
    machine: dict[Where, str] = field(default_factory=dict)
    persons: dict[Where, Person] = field(default_factory=dict)
    received: dict[str, datetime | None] = field(default_factory=dict)
    numbers: dict[Where, float] = field(default_factory=dict)
    predictions: dict[str, dict[str, Any]] = field(default_factory=dict)


#: All that is worth points → who marks it, its points and its code, as the catalogue has them.
PARTS = {(number, part.name): part for number, question in OURS.catalogue.marked.items() for part in question.parts}
NOTEBOOK = {number: question.notebook for number, question in OURS.catalogue.marked.items()}
READ = [where for where, part in PARTS.items() if part.marked == "person"]

_WORDS = """
    the a of and so then because peak joint spring arm servo sweep noise friction sample model data curve time
    angle pole gain voltage signal error small large near far slow fast early late more less bench motor gear
    link inertia stiff loose ring decay step sine ramp plot axis line slope height width fit guess measure
    compare repeat average reject explain agree differ follow lead drop rise hold move stop start turn bend push
    pull swing settle drift shake listen look read write take give find lose keep change choose doubt trust know
    think see hear feel expect suppose assume conclude
"""  # of which answers are made
_OF_THE_LECTURE = "as we saw in the lecture the energy goes back and forth between the spring and the arm"


class Drawn:
    """The class, drawn; nothing of it is in a gradebook yet.

    Attributes
    ----------
    students : by ID
    """

    def __init__(self, size: int = SIZE, seed: int = SEED) -> None:
        self._rng = random.Random(seed)
        self._number = 10_000
        sections = [name for name, count in SECTIONS.items() for _ in range(count)]
        self.students = {f"s{n:02}": Student(f"s{n:02}", sections[n]) for n in range(size)}
        for one in self.students.values():
            self._draw(one)
        for copier, (mate, what) in COPIES.items():
            if what == "numbers":
                self._copy_numbers(self.students[copier], self.students[mate])
        self._exceptions()

    def _draw(self, one: Student) -> None:
        rng, diligence = self._rng, self._rng.uniform(0.4, 0.95)
        for where, part in PARTS.items():
            there = NOTEBOOK[where[0]] != NOT_YET.get(one.section)
            if part.marked == "person":
                one.persons[where] = self._person(diligence) if there else Person()
            elif not there:
                one.machine[where] = MISSING
            elif part.points:
                wrong = ("partly right", "partly right", "wrong", "wrong", MISSING)
                right = ("right", "right", "right", "right, given your own earlier answers")
                one.machine[where] = rng.choice(right if rng.random() < diligence else wrong)
        self._measure(one)
        for number, asked in OURS.catalogue.predictions.items():
            if rng.random() < 0.7:
                said = {each.part.name: _predicted(each.part, rng) for each in asked if rng.random() < 0.9}
                one.predictions |= {number: said} if said else {}
        for notebook in (*FIRST_HALF, *SECOND_HALF):
            if notebook != NOT_YET.get(one.section):
                one.received[notebook] = self._when(DUE_FIRST if notebook in FIRST_HALF else DUE_SECOND)

    def _person(self, diligence: float) -> Person:
        rng = self._rng
        if rng.random() < 0.08:
            return Person()
        likely = [(1 - diligence) / 2, (1 - diligence), 0.4, diligence]
        true = 0 if rng.random() < 0.03 else rng.choices((1, 2, 3, 4), likely)[0]
        found = Person(self._text(), true)
        found.asked = rng.random() < 0.006
        if rng.random() < 0.03:
            found.points = rng.choice((0.1, 0.2, 0.45, 0.6, 0.7, 0.95))  # at the middle of no two levels
        else:
            found.first = _off(true, rng) if rng.random() < ONE_OFF else true
        return found

    def _text(self) -> str:
        """Words of one's own, some of them with what the teacher said; and a number that nobody else has."""
        rng = self._rng
        self._number += rng.randrange(1, 9)
        words = rng.choices(_WORDS.split(), k=rng.randrange(8, 40))
        if rng.random() < 0.1:
            words.insert(rng.randrange(len(words)), _OF_THE_LECTURE)
        return f"{' '.join(words).capitalize()}, in {self._number} samples."

    def _measure(self, one: Student) -> None:
        """What the bench of one's own gives, read off a scale; or with one of the usual slips."""
        bench, rng = TrueBench(one.name, BenchPolicy(draw=DRAW)), self._rng
        omega, J = 0.38 * round(bench.omega_n / 0.38), float(f"{bench.J_l:.4g}")
        slip = rng.choice(("hertz", "inertia", "stiffness")) if rng.random() < 0.25 else ""
        if slip == "hertz":
            omega /= 6.2832
        if slip == "inertia":
            J = float(f"{J * rng.uniform(0.2, 0.7):.4g}")
        K = float(f"{J * omega**2 * (rng.uniform(1.5, 9) if slip == 'stiffness' else 1):.4g}")
        one.numbers = {("2.11", "omega_n"): omega, ("2.12", "J_l"): J, ("2.12", "K_s"): K}
        bad = {"hertz": ("omega_n", "K_s"), "inertia": ("J_l", "K_s"), "stiffness": ("K_s",)}.get(slip, ())
        one.machine |= {where: "wrong" if where[1] in bad else "right" for where in MEASURED}

    @staticmethod
    def _copy_numbers(one: Student, mate: Student) -> None:
        bench = TrueBench(mate.name, BenchPolicy(draw=DRAW))
        omega = 0.38 * round(bench.omega_n / 0.38)
        J = float(f"{bench.J_l:.4g}")
        right = {("2.11", "omega_n"): omega, ("2.12", "J_l"): J, ("2.12", "K_s"): float(f"{J * omega**2:.4g}")}
        mate.numbers, one.numbers = dict(right), dict(right)
        mate.machine |= dict.fromkeys(MEASURED, "right")
        one.machine |= dict.fromkeys(MEASURED, "wrong")

    def _exceptions(self) -> None:
        """What waits in the end: an answer that nobody has read, one that the teacher is asked about, a key's fault."""
        for student, *where in (*WAITING, ASKED_STILL):
            self.students[student].persons[where[0], where[1]] = Person(self._text(), 2)
        self.students[ASKED_STILL[0]].persons[ASKED_STILL[1:]].asked = True
        self.students["s09"].machine["2.18", "poles"] = KEY_FAULT
        self.students["s51"].received = dict.fromkeys(self.students["s51"].received)
        for one in self.students.values():
            for where, person in one.persons.items():
                if person.asked and (one.name, *where) != ASKED_STILL:
                    person.decided, person.first, person.points = person.true, None, None

    def _when(self, due: datetime) -> datetime:
        rng = self._rng
        after = rng.choices((-rng.uniform(1, 300), rng.uniform(0, 2), rng.uniform(0, 150)), (0.7, 0.1, 0.2))[0]
        return due + timedelta(seconds=round(3600 * after))


def _off(true: int, rng: random.Random) -> int:
    """The level next to the true one."""
    return max(0, min(4, true + rng.choice((-1, 1)))) if 0 < true < 4 else abs(true - 1)


def _predicted(part: Any, rng: random.Random) -> dict[str, Any]:
    if part.kind == "choice":
        return {"kind": "choice", "value": rng.choice(part.choices)}
    return {"kind": "number", "value": round(rng.uniform(1, 5), 2)}
