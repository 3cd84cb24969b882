"""How long grading and scoring took, as far as the gradebook knows, and what is left of the scoring."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from labcourse.grading.gradebook import Act, Answer, AuditRecord
from labcourse.grading.overview.section import Section, Table, moment
from labcourse.grading.scoring.desk import Where
from labcourse.grading.scoring.progress import PAUSE, Reading, readings, usual
from labcourse.messages import plural

_PAUSE = timedelta(seconds=PAUSE)
_PROGRAM = "labcourse "  # how the actors of the audit trail begin that are commands


@dataclass(frozen=True)
class Session:
    """Changes of marks by a command, without a pause.

    Attributes
    ----------
    actor : the command
    began, ended : the first and the last
    students : of whom marks were changed
    """

    actor: str
    began: datetime
    ended: datetime
    students: int


def sessions(trail: Iterable[AuditRecord]) -> list[Session]:
    """When commands changed marks. What they found as it was left no trace."""
    found: list[list[AuditRecord]] = []
    for entry in trail:
        if not entry.actor.startswith(_PROGRAM):
            continue
        if found and found[-1][0].actor == entry.actor and entry.when - found[-1][-1].when <= _PAUSE:
            found[-1].append(entry)
        else:
            found.append([entry])
    return [
        Session(those[0].actor, those[0].when, those[-1].when, len({one.student for one in those})) for those in found
    ]


@dataclass(frozen=True)
class Pace:
    """How somebody scores.

    Attributes
    ----------
    actor : who
    acts : how many answers they decided or asked about, those that were taken back included
    readings : how long each time took, as far as that is known
    """

    actor: str
    acts: int
    readings: tuple[Reading, ...]

    @property
    def usual(self) -> float | None:
        """What an answer takes, s; None where too few times are known."""
        return usual(self.readings)


def paces(acts: Sequence[Act]) -> list[Pace]:
    """How each scorer scores."""
    by_actor: dict[str, list[Act]] = {}
    for act in acts:
        by_actor.setdefault(act.actor, []).append(act)
    return [
        Pace(actor, sum(act.undoes is None for act in those), tuple(readings(those)))
        for actor, those in sorted(by_actor.items())
    ]


def left(found: Sequence[Pace], answers: Sequence[Answer]) -> float | None:
    """What is left of the scoring, s, for one person: each waiting answer as usual in its part, or else in all."""
    every = [one for pace in found for one in pace.readings]
    overall = usual(every)
    if overall is None:
        return None
    by_part: dict[Where, list[Reading]] = {}
    for one in every:
        by_part.setdefault(one.where, []).append(one)
    known = {where: usual(those) for where, those in by_part.items()}
    return sum(known.get(one.where) or overall for one in answers if one.waiting)


def section(runs: int, trail: Sequence[AuditRecord], acts: Sequence[Act], answers: Sequence[Answer]) -> Section:
    """The same, to be shown.

    Parameters
    ----------
    runs : how many count
    trail : every change of a mark
    acts : all that scorers did
    answers : all that persons read or have marked
    """
    batches, found = sessions(trail), paces(acts)
    remaining = left(found, answers)
    waiting = sum(one.waiting for one in answers)
    first = f"{plural(runs, '{count} run', '{count} runs')} counted."
    if remaining is not None and waiting:
        first += (
            f" Left to score: {plural(waiting, '{count} answer', '{count} answers')}, about {lasting(remaining)} "
            "for one person."
        )
    elif waiting:
        first += (
            f" Left to score: {plural(waiting, '{count} answer', '{count} answers')}; how long that takes is "
            "known once a few have been scored."
        )
    batch_rows = tuple(
        (one.actor, moment(one.began), lasting((one.ended - one.began).total_seconds()), str(one.students))
        for one in batches
    )
    pace_rows = tuple(
        (one.actor, str(one.acts), "not known yet" if one.usual is None else lasting(one.usual)) for one in found
    )
    more = ("How long a run took is not kept; the first to the last change of a mark is.",) if batches else ()
    return Section(
        "Time",
        first,
        more,
        (
            Table(
                ("Command", "From", "First to last change of a mark", "Students"),
                batch_rows,
                frozenset({3}),
                "Grading",
            ),
            Table(
                ("Scorer", "Answers", "Median time of an answer"),
                pace_rows,
                frozenset({1}),
                "Scoring; pauses of ten minutes and more, and what came from a table, are left out",
            ),
        ),
    )


def lasting(seconds: float) -> str:
    """A time as "40 s", "12 min", "3 h 05 min"."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02} min"
