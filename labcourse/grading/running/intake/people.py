"""Which student a name means: by their ID, or by what the roster knows of them. Nobody is guessed."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from labcourse import student_id
from labcourse.errors import StudentIDError
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.running.intake import labels, names
from labcourse.grading.running.intake.labels import Label
from labcourse.student_id import caseless

_PAIR = "+"  #: between the IDs of those who hand in together
_MOODLES_NUMBER = re.compile(r"\w+ (?=\d+$)")  # its grading worksheet has "Participant 1234567"
MOST_TOGETHER = 4  #: students of one hand-in; as many as stand around a bench


@dataclass(frozen=True)
class Match:
    """Whom a name means.

    Attributes
    ----------
    students : IDs; none where it is nobody's, several for a pair
    rule : how they were found, in words
    certain : whether the roster has them, or the name is of a form that only a hand-in has
    attempt : of something handed in again
    why_not : where there is nobody, the reason
    perhaps : IDs of a pair, where the name as a whole may also be an ID
    """

    students: tuple[str, ...] = ()
    rule: str = ""
    certain: bool = False
    attempt: int = 0
    why_not: str = ""
    perhaps: tuple[str, ...] = ()


class People:
    """The students of a roster, by all the names that they have.

    Parameters
    ----------
    roster : the students; with none, any valid ID counts
    """

    def __init__(self, roster: Sequence[StudentRecord] = ()) -> None:
        self._records = {caseless(one.student): one for one in roster}
        self._ids = {key: one.student for key, one in self._records.items()}
        self._names: dict[str, set[str]] = {}
        self._plain_names: dict[str, set[str]] = {}
        self._aliases: dict[str, set[str]] = {}
        for one in roster:
            for alias in filter(None, (one.email, *one.aliases)):
                for form in {alias, _MOODLES_NUMBER.sub("", alias)}:
                    self._aliases.setdefault(caseless(form), set()).add(one.student)
            for turned in filter(names.letters, _turned(one.name)):
                self._names.setdefault(names.letters(turned), set()).add(one.student)
                self._plain_names.setdefault(names.plain_letters(turned), set()).add(one.student)

    def __bool__(self) -> bool:
        return bool(self._ids)

    def known(self, given: str) -> str | None:
        """A student's ID as the roster spells it; without a roster, as it is kept. None if it is nobody's."""
        if self._ids:
            return self._ids.get(caseless(given))
        try:
            return student_id.normalised(given)
        except StudentIDError:
            return None

    def labelled(self, label: Label) -> Match:
        """Whom a platform's name means."""
        by_name = next(filter(None, map(self._called, label.people)), set[str]())
        by_number = self._numbered(label.number) if label.number else set()
        found = by_name
        if len(by_name) != 1 and by_number:
            # A number alone may be another platform's, of somebody else.
            alone = {one for one in by_number if not label.people or self._nameless(one)}
            found = by_name & by_number if by_name else alone
        elif by_number and not by_name <= by_number:
            both = ", ".join(sorted(by_name | by_number))
            why = f"its name and its number are of different students ({both})."
            return Match(why_not=why)
        if len(found) == 1:
            by_platform = f"{label.platform}'s name, by the roster"
            return Match((found.pop(),), by_platform if label.platform else "the ID in its name", True)
        return Match(why_not=self._nobody(by_name, label))

    def beginning(self, name: str) -> Label | None:
        """Of a file's name that begins with the ID of a student on the roster, the ID and the rest."""
        places = [place for place, letter in enumerate(name[: 2 * student_id.LONGEST]) if letter in "_- "]
        known = [place for place in places if caseless(name[:place]) in self._ids]
        return Label("", (name[: known[-1]],), rest=name[known[-1] + 1 :]) if known else None

    def _nobody(self, several: Collection[str], label: Label) -> str:
        if several:
            return f"it may be any of {', '.join(sorted(several))}."
        if not self._ids:
            return f"{label.platform} named it, and there is no roster to say who that is."
        return f"{label.platform} named it, and nobody on the roster is called so."

    def named(self, name: str, siblings: Collection[str] = ()) -> Match:
        """Whom the name of a folder, or of a zip without its ending, means.

        Parameters
        ----------
        name : as people read it
        siblings : names beside it, by which ``ada-1`` is told to be ada's second
        """
        for one in dict.fromkeys(names.alternatives(name)):
            match = self._on_the_roster(one)
            if match.students:
                return match
        if match.why_not:
            return match
        return self._by_itself(names.readable(name), siblings)

    def _on_the_roster(self, name: str) -> Match:
        """By the roster; nobody where there is none."""
        if not self._ids:
            return Match()
        repeated = labels.again(name)
        for one, attempt in [(name, 0), *([repeated] if repeated else [])]:
            student = self._ids.get(caseless(one))
            if student is not None:
                return Match((student,), "the ID in its name", True, attempt)
            together = self._together(one)
            if together:
                return Match(together, "the IDs in its name", True, attempt)
            several = self._called(one)
            if len(several) == 1:
                return Match((several.pop(),), "its name, by the roster", True, attempt)
            if several:
                return Match(why_not=f"it may be any of {', '.join(sorted(several))}.")
        return Match()

    def _by_itself(self, name: str, siblings: Collection[str]) -> Match:
        """By its form as an ID alone."""
        repeated = labels.again(name)
        if repeated is not None:
            one, attempt = repeated
            bracketed = name.endswith(")")
            if bracketed or caseless(one) in {caseless(other) for other in siblings}:
                name = one
            else:
                attempt = 0
        else:
            attempt = 0
        together = () if self._ids else self._together(name)  # or it is an ID that has a + in it
        try:
            student = student_id.normalised(name)
            return Match((student,), "the ID in its name", False, attempt, perhaps=together)
        except StudentIDError as error:
            return Match(why_not=f"it is not named by a student's ID. {error}")

    def _together(self, name: str) -> tuple[str, ...]:
        """The students of ``ada+bob``; none where that is no pair."""
        if _PAIR not in name:
            return ()
        parts = [self.known(part) for part in name.split(_PAIR)]
        students = tuple(dict.fromkeys(part for part in parts if part is not None))
        return students if len(students) == len(parts) and 1 < len(students) <= MOST_TOGETHER else ()

    def _called(self, name: str) -> set[str]:
        """Students of this ID, name or other name."""
        student = self._ids.get(caseless(name))
        if student is not None:
            return {student}
        found = self._aliases.get(caseless(name), set()) | self._names.get(names.letters(name), set())
        return set(found or self._plain_names.get(names.plain_letters(name), set()))

    def _numbered(self, number: str) -> set[str]:
        student = self._ids.get(caseless(number))
        return set(self._aliases.get(caseless(number), ())) | ({student} if student is not None else set())

    def _nameless(self, student: str) -> bool:
        return not self._records[caseless(student)].name


def _turned(name: str) -> Iterator[str]:
    """A name, beginning with each of its words: ``Ada King Lovelace`` is ``Lovelace, Ada King`` as well."""
    words = name.replace(",", " ").split()
    for place in range(len(words)):
        yield " ".join([*words[place:], *words[:place]])


def ids(people: People, given: Iterable[object]) -> tuple[list[str], list[str]]:
    """Of what somebody wrote as IDs, those that are known, and those that are not."""
    known, unknown = [], []
    for one in given:
        student = people.known(one) if isinstance(one, str) else None
        if student is None:
            unknown.append(str(one)[: student_id.LONGEST])
        else:
            known.append(student)
    return known, unknown
