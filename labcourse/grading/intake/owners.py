"""Determine the owner of a submission: by its name and the roster. Its course.json is compared with them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from labcourse import course_file, student_id
from labcourse.errors import ConfigurationError, StudentIDError
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.gradebook.roster import PARTICIPANT, by_key
from labcourse.grading.intake import platforms
from labcourse.grading.intake.archives import is_notebook
from labcourse.grading.intake.platforms import Label, encodings, without_copy_number
from labcourse.grading.submission import Owner, Piece
from labcourse.problems import Code, Problem
from labcourse.student_id import caseless, letters, plain_letters

MOST_TOGETHER = 4  #: students of one submission; as many as stand around a bench
_PAIR = "+"  # between the IDs of those who hand in together


def nobody(*why: Problem) -> Owner:
    """Return the owner of a submission if nobody was identified, for these reasons."""
    return Owner(problems=why)


class Roster:
    """The students of a class, to be looked up by ID, name, e-mail address and other names.

    Parameters
    ----------
    records : the students; without any, each valid ID is a student's

    Attributes
    ----------
    is_given : whether there is a roster: it has students
    """

    def __init__(self, records: Sequence[StudentRecord] = ()) -> None:
        self.is_given = bool(records)
        self._records = {caseless(record.student): record for record in records}
        self._spelled = {name: record.student for name, record in self._records.items()}
        groups = Counter(record.group for record in records)
        # Of more students, it is no laboratory group, but a section.
        self._groups = {record.student: record.group for record in records if groups[record.group] <= MOST_TOGETHER}
        # Moodle's grading worksheet has "Participant 1234567", its downloads the number.
        self._keys = [by_key(records, pattern) for pattern in ("", PARTICIPANT)]
        self._names, self._plain_names = (defaultdict[str, set[str]](set) for _kind in range(2))
        for record in records:
            names = (record.name, *(alias for alias in record.aliases if " " in alias))
            for words in (name.replace(",", " ").split() for name in names):
                for place in range(len(words)):
                    name = "".join([*words[place:], *words[:place]])
                    self._names[letters(name)].add(record.student)
                    self._plain_names[plain_letters(name)].add(record.student)

    def group(self, student: str) -> str:
        """Return the laboratory group of a student, by ID; "" without one, and if it is too large to be one."""
        return self._groups.get(student, "")

    def known(self, text: str) -> str | None:
        """Return a student's ID as the roster spells it; None for another text. Without a roster, take any valid ID."""
        return self.spelled(text) if not self.is_given or caseless(text) in self._records else None

    def spelled(self, text: str) -> str | None:
        """Return an ID as the roster spells it, or else as it was spelled at first; None for a text that is no ID."""
        if caseless(text) not in self._spelled:
            try:
                student = student_id.normalised(text)
            except StudentIDError:
                return None
            return self._spelled.setdefault(caseless(student), student)
        return self._spelled[caseless(text)]

    def lookup(self, name: str) -> set[str]:
        """Return the student's ID if ``name`` is one, or else the IDs of all with this name, e-mail address or alias.

        If students have the name with the same accents, only these are returned; else accents do not count. The set is
        empty if nobody has the name.
        """
        if (record := self._records.get(caseless(name))) is not None:
            return {record.student}
        if not (plain := plain_letters(name)):
            return set()
        by_keys = (keys.get(caseless(name), set()) for keys in self._keys)
        exact = set[str]().union(*by_keys, self._names.get(letters(name), set()))
        return exact or self._plain_names.get(plain, set())

    def by_label(self, label: Label) -> Owner:
        """Identify the student in a file name of a platform.

        Name and number must not contradict each other. A number alone counts only if the file name has no name of a
        person, or the roster has no name of the student. Without a roster, only nbgrader's file names hold an ID.
        """
        if not self.is_given and label.platform == platforms.NBGRADER:
            return self.by_name(label.people[0])
        person = next(filter(self.lookup, label.people), "")
        named = self.lookup(person)
        numbered = self.lookup(label.number) if label.number else set[str]()
        if len(named) == 1 and numbered and not named & numbered:
            return nobody(Problem.of(Code.NAME_AND_NUMBER_DIFFER, students=sorted(named | numbered)))
        students = named & numbered or named
        if not students:  # a number alone may be another platform's, of somebody else
            students = {student for student in numbered if not (label.people and self._records[caseless(student)].name)}
        if len(students) == 1:
            group = label.people[0].removesuffix(person) if label.platform == platforms.MOODLE and label.people else ""
            owner = _owner(tuple(students), label.attempt if label.file else 0, is_certain=True)
            return replace(owner, group=group)
        if students:
            return _ambiguous(students)
        why = Code.PLATFORM_NAME_UNKNOWN if self.is_given else Code.PLATFORM_NAME_WITHOUT_ROSTER
        return nobody(Problem.of(why, platform=label.platform))

    def by_name(self, name: str, course_student: str = "") -> Owner:
        """Identify the students in the name of a folder or of an archive (without its ending).

        The owner is certain if they are on the roster. Otherwise the name must be a valid ID, or IDs of which one is
        ``course_student``.

        Parameters
        ----------
        name : as people read it
        course_student : the student in its course.json, which decides between the meanings of a name that is not on
            the roster
        """
        for names, attempt in _meanings(name) if self.is_given else ():
            ids = tuple(dict.fromkeys(filter(None, map(self.known, names))))
            if len(ids) == len(names):
                return _owner(ids, attempt, is_certain=True)
            named = self.lookup(names[0]) if len(names) == 1 else set()
            if len(named) == 1:
                return _owner(tuple(named), attempt, is_certain=True)
            if named:
                return _ambiguous(named)
        for names, attempt in _meanings(name):
            ids = tuple(filter(None, map(self.spelled, names)))
            if len(ids) == len(names) and self.spelled(course_student) in ids:
                return _owner(ids, attempt)
        base, attempt = (without_copy_number(name) if name.endswith(")") else None) or (name, 0)
        try:
            student = student_id.normalised(base)
        except StudentIDError as error:
            return nobody(Problem.of(Code.NOT_AN_ID, error=str(error)))
        return _owner((self.spelled(student) or student,), attempt)

    def before_underscore(self, name: str) -> Label | None:
        """Read the name of a notebook that begins with an ID of the roster, as ``ada_01_x.ipynb``; None for another."""
        start = name[: 2 * student_id.LONGEST] if is_notebook(name) else ""
        ends = [place for place, letter in enumerate(start) if letter in "_- "]
        known = [name[:end] for end in ends if caseless(name[:end]) in self._records]
        return Label("", (known[-1],), file=name[len(known[-1]) + 1 :]) if known else None


def told_apart(pieces: Sequence[Piece], roster: Roster) -> Iterator[Piece]:
    """Yield pieces; of those that a platform named after one student, but with several numbers, ask about the others.

    In one download, one name with two numbers stands for two persons. The roster may know only one of them.
    """

    def download(piece: Piece) -> tuple[object, ...]:
        return piece.source.partition(piece.outer)[0], piece.owner.students

    numbers = defaultdict[tuple[object, ...], set[str]](set)
    for piece in pieces:
        if piece.label and piece.label.number and piece.owner.students:
            numbers[download(piece)].add(piece.label.number)
    for piece in pieces:
        several = numbers.get(download(piece), set[str]()) if piece.label and piece.label.number else set[str]()
        if piece.label and len(several) > 1 and roster.lookup(piece.label.number) != {*piece.owner.students}:
            student = piece.owner.students[0]
            why = Problem.of(Code.NAME_WITH_OTHER_NUMBERS, student=student, numbers=sorted(several))
            yield replace(piece, owner=nobody(why))
        else:
            yield piece


def _owner(students: tuple[str, ...], attempt: int, is_certain: bool = False) -> Owner:
    """Return the owner of a submission that belongs to these students; it is run on the bench of the first of them."""
    return Owner(students, bench_of=students[0], attempt=attempt, is_certain=is_certain)


def _ambiguous(students: Collection[str]) -> Owner:
    """Return the owner of a submission with a name that several students on the roster have: nobody yet."""
    return replace(nobody(Problem.of(Code.SEVERAL_STUDENTS, students=sorted(students))), is_certain=True)


def _meanings(name: str) -> Iterator[tuple[tuple[str, ...], int]]:
    """Yield what the name of a submission may mean, the likeliest first.

    Yields
    ------
    tuple
        IDs or names of its students; and the number of the copy, as 1 for ``ada (1)``, 0 for no copy
    """
    for text in dict.fromkeys(encodings(name)):
        for base, attempt in filter(None, [(text, 0), without_copy_number(text)]):
            yield (base,), attempt
            if base.count(_PAIR) in range(1, MOST_TOGETHER):
                yield tuple(part.strip() for part in base.split(_PAIR)), attempt


# --- what a course.json says ------------------------------------------------------------------------------------------


def course_data(data: bytes) -> dict[str, Any]:
    """Return the content of a course.json; nothing if it cannot be read."""
    try:
        return course_file.parse(data)
    except ConfigurationError:
        return {}


def students_in(data: bytes) -> list[str]:
    """Return the student and the partners whom a course.json names, as they are written there."""
    course = course_data(data)
    return [name for name in (course.get("student"), *_partners(course)) if isinstance(name, str)]


def _partners(course: Mapping[str, Any]) -> list[Any]:
    """Return the partners whom a course.json names, the first few: usually texts, but a student can write any JSON."""
    partners = course.get("with")
    if isinstance(partners, list):
        return partners[:MOST_TOGETHER]
    return [partners] if isinstance(partners, str) else []


def student_in(course: Mapping[str, Any]) -> str:
    """Return the student whom a course.json names; "" without one."""
    student = course.get("student")
    return student.strip() if isinstance(student, str) else ""


# --- the owner --------------------------------------------------------------------------------------------------------


def owner_of(name: str, by_name: Owner, course: Mapping[str, Any], roster: Roster, holds_work: bool) -> Owner:
    """Determine the owner of a submission by its name, and compare its course.json, which a student wrote.

    Parameters
    ----------
    name : name of the folder, archive or file, for problems
    by_name : owner by this name
    course : content of its course.json
    roster : the students
    holds_work : whether the submission holds a notebook, or a file that the course's notebooks make

    Returns
    -------
    Owner
        With the partners whom the course.json claims, or the contradiction between the two as a problem. If the name is
        not on the roster, it is nobody, unless the submission holds work and its course.json names no other student.
    """
    written = student_in(course)
    student = roster.spelled(written) if written else None
    partners = {str(one): roster.known(one) if isinstance(one, str) else None for one in _partners(course)}
    claimed = tuple(dict.fromkeys(filter(None, partners.values())))
    unknown = [partner for partner, known in partners.items() if not known]
    notes = tuple(Problem.of(Code.PARTNER_UNKNOWN, partner=partner) for partner in unknown)
    if by_name.students and (by_name.is_certain or not roster.is_given):
        return _checked(replace(by_name, notes=notes), written, student, claimed)
    says = [Problem.of(Code.COURSE_FILE_NAMES, named=written)] if written else []
    if not by_name.students:
        return nobody(*by_name.problems, *says)
    if not holds_work:
        return nobody(Problem.of(Code.NOTHING_OF_THE_COURSE))
    if written and student not in by_name.students:
        return nobody(Problem.of(Code.CALLED_LIKE_NOBODY), *says)
    return replace(by_name, notes=(*notes, Problem.of(Code.NOT_ON_ROSTER, name, student=by_name.students[0])))


def _checked(owner: Owner, written: str, student: str | None, partners: Sequence[str]) -> Owner:
    """Compare the owner by name with a course.json, and add its partners, or the contradiction as a problem.

    A student may hand in a folder of which the course.json names another student, and them as the partner.

    Parameters
    ----------
    owner : owner by the name of the submission
    written : the student as the course.json has it; "" for none
    student : ID of this student; None if it is no valid ID
    partners : IDs of the partners in the course.json
    """
    if not written:
        return owner
    in_course = dict.fromkeys((student or written, *partners))
    claimed = tuple(name for name in in_course if name not in owner.students)
    if student in owner.students or (student and len(owner.students) == 1 and owner.students[0] in partners):
        return replace(owner, bench_of=student, claimed=claimed)
    named = (student or written)[: student_id.LONGEST]
    return replace(owner, problems=(Problem.of(Code.OTHER_STUDENT_NAMED, named=named, owner=owner.students[0]),))


def resolve_partners(
    owners: Sequence[Owner],
    roster: Roster,
    earlier: Callable[[str], Collection[str] | None],
    decide: Callable[[str, str], bool | None],
) -> list[Owner]:
    """Decide which partners, whom a course.json names, count as such; the others wait for a person.

    Anybody can write any ID into a course.json. A partner counts if both name each other, each in a submission of their
    own, if they are in one group of the platform or the roster, or if the instructor says so.

    Parameters
    ----------
    owners : the owner of each submission
    roster : the students
    earlier : function of a student's ID: returns the students whom their last course.json named; None if they handed in
        nothing before
    decide : function that returns whether two students are partners as the instructor decided; None without a decision
    """
    named: dict[str, set[str | None]] = defaultdict(set)
    groups: dict[str, set[str]] = defaultdict(set)
    claimed: dict[tuple[str, ...], dict[str, None]] = defaultdict(dict)
    for owner in owners:
        claimed[owner.students] |= dict.fromkeys(owner.claimed)
    owners = [_with_partners(owner, [*claimed[owner.students]][:MOST_TOGETHER]) for owner in owners]
    for owner in owners:
        groups[owner.group].update(owner.students)
        for student in owner.students:
            named[student].update((*owner.students, *owner.claimed))
    for student in {partner for owner in owners for partner in owner.claimed} - {*named}:
        named[student] = {*map(roster.spelled, earlier(student) or ())}

    def is_partner(owner: Owner, partner: str) -> bool | None:
        """Return whether a partner counts; None if a person has to confirm it."""
        decisions = {decide(student, partner) for student in owner.students} - {None}
        in_group = owner.group and len(groups[owner.group]) <= MOST_TOGETHER and partner in groups[owner.group]
        on_roster = roster.group(partner) and roster.group(partner) in map(roster.group, owner.students)
        if decisions or in_group or on_roster or not named[partner].isdisjoint(owner.students):
            return decisions != {False}
        return None

    return [_resolved(owner, {partner: is_partner(owner, partner) for partner in owner.claimed}) for owner in owners]


def _with_partners(owner: Owner, most: Collection[str]) -> Owner:
    """Leave out the partners of an owner who are too many with those of the owner's other submissions.

    Parameters
    ----------
    owner : of one submission
    most : partners that may stay: the first ones in all submissions of the owner
    """
    if not (left_out := [name for name in owner.claimed if name not in most]):
        return owner
    note = Problem.of(Code.TOO_MANY_PARTNERS, most=MOST_TOGETHER, partners=left_out)
    return replace(owner, claimed=tuple(filter(most.__contains__, owner.claimed)), notes=(*owner.notes, note))


def _resolved(owner: Owner, is_partner: Mapping[str, bool | None]) -> Owner:
    """Return the owner with its claimed partners sorted into waiting (None) and declined (False).

    If ``bench_of`` is one of these, use the first student's bench. Add a problem on those who wait, and a note on those
    who are declined.

    Parameters
    ----------
    owner : with the partners whom the course.json claims
    is_partner : claimed partner → whether they count; None if a person has to confirm them
    """
    waiting = tuple(name for name in is_partner if is_partner[name] is None)
    declined = tuple(name for name in is_partner if is_partner[name] is False)
    bench_of = owner.students[0] if owner.bench_of in (*waiting, *declined) else owner.bench_of
    problems, notes = owner.problems, owner.notes
    if waiting:
        problems += (Problem.of(Code.PARTNERS_UNCONFIRMED, partners=waiting, owners=owner.students),)
    if declined:
        notes += (Problem.of(Code.PARTNERS_DECLINED, partners=declined, owners=owner.students),)
    return replace(owner, waiting=waiting, declined=declined, bench_of=bench_of, problems=problems, notes=notes)
