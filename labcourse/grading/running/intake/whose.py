"""Whose a hand-in is: by its name, and by what its course.json says. A contradiction is told, and nobody is guessed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from labcourse import student_id
from labcourse.files import COURSE_FILE
from labcourse.grading.running.intake import labels, names, people, places
from labcourse.grading.running.intake.people import Match, People
from labcourse.student_id import caseless

_ANYBODY = People()  # takes any valid ID


@dataclass(frozen=True)
class Owners:
    """Whose a hand-in is.

    Attributes
    ----------
    students : by its name, or, where that means nobody, by its course.json
    claimed : students whom only the course.json names beside these
    bench_of : whose bench it was made on
    rule : how they were found, in words
    attempt : of something handed in again
    problems, notes : what is to be told about it
    why_not : where it is nobody's, the reason
    """

    students: tuple[str, ...] = ()
    claimed: tuple[str, ...] = ()
    bench_of: str = ""
    rule: str = ""
    attempt: int = 0
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    why_not: str = ""


@dataclass(frozen=True)
class _Says:
    """What a course.json says."""

    student: str | None = None
    partners: tuple[str, ...] = ()
    unknown: tuple[str, ...] = field(default=())


def owners(
    name: str,
    match: Match,
    course: Mapping[str, Any],
    people_known: People,
    holds_work: bool,
    present: Collection[str] = (),
) -> Owners:
    """Whose a hand-in is.

    Parameters
    ----------
    name : of the folder, zip or file, for messages
    match : whom the name means
    course : what its course.json says
    people_known : the roster
    holds_work : whether there is anything of the course in it
    present : those who handed in under their own names; for them, nobody's course.json speaks
    """
    says = _says(course, people_known)
    is_taken = says.student is not None and caseless(says.student) in set(map(caseless, present))
    if match.students and (match.certain or is_taken or not people_known):
        return _by_name(name, match, says)
    if is_taken:
        why = "its {course_file} names {student}, who handed in under that name as well."
        return Owners(why_not=why.format(course_file=COURSE_FILE, student=says.student))
    if says.student is not None:
        return _by_course_file(match, says, people_known)
    if match.students and holds_work:
        note = "{student} is not on the roster: by the name of {name} alone."
        told = note.format(student=match.students[0], name=names.shown(name))
        return Owners(match.students, (), match.students[0], match.rule, match.attempt, notes=(told,))
    if match.students:
        return Owners(why_not="nobody on the roster is called so, and there is nothing of the course in it.")
    return Owners(why_not=match.why_not)


def _says(course: Mapping[str, Any], known: People) -> _Says:
    """What a course.json says. Its student need not be on the roster; partners must be."""
    given = course.get("student")
    student = None
    if isinstance(given, str) and given.strip():
        student = known.known(given) or _ANYBODY.known(given)
        if student is None:
            return _Says(unknown=(given[: student_id.LONGEST],))
    found, unknown = people.ids(known, _partners(course))
    others = dict.fromkeys(one for one in found if student is None or caseless(one) != caseless(student))
    return _Says(student, tuple(others), tuple(unknown))


def _partners(course: Mapping[str, Any]) -> list[Any]:
    given = course.get("with")
    return given[: people.MOST_TOGETHER] if isinstance(given, list) else [given] if isinstance(given, str) else []


def _by_name(name: str, match: Match, says: _Says) -> Owners:
    named, attempt = _borne_out(name, match, says)
    folded = {caseless(one) for one in named}
    plain = Owners(named, (), named[0], match.rule, attempt, notes=_unknown(says))
    if says.student is None:
        if says.unknown and not says.partners:
            return replace(plain, problems=(_contradiction(named[0], says.unknown[0]),), notes=())
        return plain
    together = dict.fromkeys((says.student, *says.partners))
    if caseless(says.student) in folded:
        bench_of = next(one for one in named if caseless(one) == caseless(says.student))
        claimed = tuple(one for one in together if caseless(one) not in folded)
        return replace(plain, bench_of=bench_of, claimed=claimed)
    if len(named) == 1 and folded <= {caseless(one) for one in says.partners}:
        return replace(
            plain, bench_of=says.student, claimed=tuple(one for one in together if caseless(one) not in folded)
        )
    return replace(plain, problems=(_contradiction(named[0], says.student),))


def _borne_out(name: str, match: Match, says: _Says) -> tuple[tuple[str, ...], int]:
    """What a name means that may mean several things, if the course.json bears one of them out."""
    if match.certain or says.student is None:
        return match.students, match.attempt
    student = caseless(says.student)
    if student in map(caseless, match.students):
        return match.students, match.attempt
    if student in map(caseless, match.perhaps):
        return match.perhaps, match.attempt
    for one in names.alternatives(places.without_ending(name)):
        again = labels.again(one)
        if again is not None and caseless(again[0]) == student:  # ada's second, not the first of one called ada-1
            return (says.student,), again[1]
        if caseless(one) == student:
            return (says.student,), match.attempt
    return match.students, match.attempt


def _contradiction(student: str, says: str) -> str:
    return (
        f"{COURSE_FILE} names the student {says!r}; this counts as {student!r}'s work. It was handed in under "
        "that name; if it is not theirs, rename what was handed in."
    )


def _by_course_file(match: Match, says: _Says, known: People) -> Owners:
    assert says.student is not None
    notes = list(_unknown(says))
    if known and known.known(says.student) is None:
        notes.append(f"{says.student} is not on the roster: by {COURSE_FILE} alone.")
    rule = f"the ID in {COURSE_FILE}"
    return Owners((says.student,), says.partners, says.student, rule, match.attempt, notes=tuple(notes))


def _unknown(says: _Says) -> tuple[str, ...]:
    return tuple(f"{COURSE_FILE} says that it was made with {name!r}, whom nobody knows." for name in says.unknown)


def nobody_earlier(student: str) -> Collection[str] | None:
    """Of whom is known that they handed in before, and with whom: nobody."""
    return None


def named_in(data: bytes) -> list[str]:
    """All students whom a course.json names, as they are written."""
    course = places.course_data(data)
    given = [course.get("student"), *_partners(course)]
    return [one for one in given if isinstance(one, str)]


def agreed(given: Sequence[Owners], earlier: Callable[[str], Collection[str] | None] = nobody_earlier) -> list[Owners]:
    """Owners, with partners whom only a course.json names as far as they have not handed in something else themselves.

    Anybody can write anybody's ID into a course.json. So nobody's own hand-in gives way to it, and nobody's work is run
    on the bench of a student who handed in without naming them; now, or in an earlier stage.

    Parameters
    ----------
    given : of all that is handed in now
    earlier : whom a student named who handed in before; None for one who did not
    """
    named = {caseless(one): set[str]() for owner in given for one in owner.students}
    for one in {caseless(other): other for owner in given for other in owner.claimed}.values():
        before = earlier(one)
        if before is not None and caseless(one) not in named:
            named[caseless(one)] = {caseless(one), *map(caseless, before)}
    for owner in given:
        for one in owner.students:
            named[caseless(one)].update(caseless(other) for other in (*owner.students, *owner.claimed))
    return [_agreed(owner, named) for owner in given]


def _agreed(owner: Owners, named: Mapping[str, set[str]]) -> Owners:
    own = {caseless(one) for one in owner.students}
    kept: list[str] = []
    refused: list[str] = []
    for one in owner.claimed:
        theirs = named.get(caseless(one))
        (kept if theirs is None or theirs & own else refused).append(one)
    if not refused:
        return owner
    problem = (
        f"{COURSE_FILE} says that it was made with {', '.join(refused)}, who handed in something else, and did "
        f"not say so. It counts as {', '.join(owner.students)}'s alone, on their own bench."
    )
    on_theirs = caseless(owner.bench_of) in {caseless(one) for one in refused}
    bench_of = owner.students[0] if on_theirs else owner.bench_of
    return replace(owner, claimed=tuple(kept), bench_of=bench_of, problems=(*owner.problems, problem))


def of_each(given: Iterable[Owners]) -> list[str]:
    """All students, each once, in order."""
    found: dict[str, str] = {}
    for owner in given:
        for one in (*owner.students, *owner.claimed):
            found.setdefault(caseless(one), one)
    return [found[key] for key in sorted(found)]
