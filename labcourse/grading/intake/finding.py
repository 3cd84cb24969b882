"""Find the submissions of each student in a class's folder, however a platform packed and named them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any

from labcourse import messages, program
from labcourse.errors import GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.gradebook.records import DECIDED, StudentRecord
from labcourse.grading.intake import archives, owners, platforms
from labcourse.grading.intake.archives import Entry, Listing, Place, Shelf, Unreadable, Where, is_hidden, shown
from labcourse.grading.intake.notebooks import is_notebook, is_work
from labcourse.grading.intake.owners import Owner, Roster, nobody_before, student_in
from labcourse.grading.intake.platforms import Label, in_utc, label_of
from labcourse.student_id import LONGEST, caseless

MAX_CLASS_DEPTH = 3  #: folders and zips around those of the students; a platform's zip, its folder, and a section's
MAX_NESTING = 3  #: archives within archives
MAX_INNER_ARCHIVES = 20  #: archives within one submission
MAX_COURSE_FILE = 10_000  #: bytes of course.json; a name, a release, and partners

OWNER, TIME = "owner", "time received"  #: what an instructor may decide, besides a file (by its name in the course)
#: :attr:`Doubt.key` → what was decided.
Decisions = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Doubt:
    """A row of ``intake.csv``: something that an instructor may decide.

    Attributes
    ----------
    submission : name of the folder, archive or file, from the class's folder on
    about : :data:`OWNER`, :data:`TIME`, or the name of the course's file that several files may be
    assumed : what counts without a decision; "" for nothing
    why : reason
    alternatives : what else it may be
    """

    submission: str
    about: str
    assumed: str
    why: str
    alternatives: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """Identify the row. A decision on a time holds for files that were saved then, if the row says when."""
        saved = f": {self.alternatives}" if self.about == TIME and self.alternatives else ""
        return self.submission, f"{self.about}{saved}"


@dataclass(frozen=True)
class Piece:
    """What a student handed in at one time: a folder, an archive, or loose files.

    Attributes
    ----------
    source : its name for people, from the class's folder on
    where : the store that holds its files
    files : path → entry
    refused : path → reason why it is not read
    received : time of receipt, UTC
    clock : how the time is known; "" where only the student's computer wrote it
    rule : how the student was identified
    order : of pieces received at one time, the higher came later
    trouble : why nothing of it can be read; "" where it can
    """

    source: str
    where: Where
    files: Mapping[str, Entry]
    received: datetime
    clock: str
    rule: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)
    order: tuple[int, datetime, int] = (0, datetime.min, 0)
    trouble: str = ""


@dataclass(frozen=True)
class Submission:
    """All that a student handed in.

    Attributes
    ----------
    student : ID
    pieces : in order of time
    bench_of : ID of the student whose bench it is to be run on; a partner's, where several handed in together
    partners : IDs of those with whom it was handed in
    claimed_by : ID of the partner whose course.json alone says that it is this student's, too; "" for their own
    problems : contradictions about its owner
    notes : other messages about its owner
    """

    student: str
    pieces: tuple[Piece, ...] = ()
    bench_of: str = ""
    partners: tuple[str, ...] = ()
    claimed_by: str = ""
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ClassFolder:
    """What lies in a class's folder.

    Attributes
    ----------
    submissions : one for each student, by ID
    ignored : a message on everything that is not read
    doubts : what an instructor may decide
    """

    submissions: list[Submission]
    ignored: list[str]
    doubts: list[Doubt] = field(default_factory=list)


@dataclass(frozen=True)
class _Found:
    """A piece without an owner and a time.

    Attributes
    ----------
    by_name : whom its name means; None if course.json is to decide between several meanings
    archived : when the archive among the submissions was written
    attempt : number of a copy, as an archive within it says
    """

    name: str
    place: Place
    label: Label | None = None
    by_name: Owner | None = None
    files: Mapping[str, Entry] = field(default_factory=dict)
    trouble: str = ""
    archived: datetime | None = None
    attempt: int = 0
    course: Mapping[str, Any] = field(default_factory=dict)


def find(
    folder: Path,
    roster: Sequence[StudentRecord] = (),
    times: Mapping[str, datetime] | None = None,
    zone: tzinfo = UTC,
    earlier: Callable[[str], Collection[str] | None] = nobody_before,
    decisions: Decisions | None = None,
) -> ClassFolder:
    """Find the submissions in a class's folder, or in a zip of it.

    Parameters
    ----------
    folder : holds a folder, a zip or loose files for each student
    roster : the students, by whose names those that platforms give are recognised
    times : name of what lies there, or a student's ID or name → time of receipt, from :func:`.platforms.read_times`
    zone : of times in names and in zips, which have none
    earlier : students whom a student named who handed in before; None for a student who did not
    decisions : owners and times, by the instructor

    Raises
    ------
    GradingError
        If there is no such folder, or no submission in it.
    """
    if not (folder.is_dir() or folder.is_file()):
        raise GradingError(f"There is no folder {folder}.")
    with Shelf() as shelf:
        finder = _Finder(Roster(roster), times or {}, zone, shelf, decisions or {})
        try:
            finder.start(folder)
        except Unreadable as error:
            raise GradingError(f"{folder} cannot be read: {error}") from None
        submissions = finder.submissions(earlier)
    ignored = finder.messages()
    if not submissions:
        nothing = f"There are no submissions in {folder}: it should hold a folder or a zip for each student."
        raise GradingError(" ".join([nothing, *ignored]))
    return ClassFolder(submissions, ignored, finder.doubts)


class _Finder:
    """Goes through the folders and zips around those of the students."""

    def __init__(
        self, roster: Roster, times: Mapping[str, datetime], zone: tzinfo, shelf: Shelf, decisions: Decisions
    ) -> None:
        self.doubts: list[Doubt] = []
        self._roster, self._zone, self._shelf, self._decisions = roster, zone, shelf, decisions
        self._times = {caseless(name): in_utc(time, UTC) for name, time in times.items()}
        self._found: list[_Found] = []
        self._ignored: dict[str, list[str]] = {}
        self._invalid: list[str] = []  # decisions
        self._archives_left = 0

    # --- where submissions are ----------------------------------------------------------------------------------------

    def start(self, folder: Path) -> None:
        """Go through a class's folder or zip, or a student's own folder."""
        if folder.is_file():
            places = [place for place in archives.on_disk_in(folder.parent) if place.where.path / folder.name == folder]
            self._explore([next(place for place in places if place.entry and place.entry.key == folder.name)], 0)
            return
        inside = [*archives.on_disk_in(folder)]
        files = [place.name for place in inside if place.entry is not None]
        if COURSE_FILE in files and any(map(is_notebook, files)) and not any(label_of(one.name) for one in inside):
            self._take(Place(folder.name, Where(folder)), by_name=Owner(why_not="it does not say who handed it in."))
        else:
            self._explore(inside, 0)

    def _explore(self, places: Sequence[Place], depth: int) -> None:
        places = [place for place in places if not is_hidden(place.name)]
        loose: dict[tuple[object, ...], list[tuple[Place, Label]]] = {}
        for place in places:
            label = label_of(place.name)
            if label is None and place.entry is not None and is_notebook(place.name):
                label = self._roster.before_underscore(place.name)
            if place.why_not:
                self._ignore(place, place.why_not)
            elif label is not None and label.is_receipt:
                self._ignore(place, f"{label.platform} itself wrote it.")
            elif label is not None and label.file and place.entry is not None:
                same = (label.platform, label.people, label.number, label.time)
                loose.setdefault(same, []).append((place, label))
            elif place.is_folder or place.is_archive:
                self._look_into(place, label, depth, is_alone=len(places) == 1)
            else:
                self._take_file(place, label)
        for files in loose.values():
            self._take_loose(files)

    def _look_into(self, place: Place, label: Label | None, depth: int, is_alone: bool) -> None:
        """Take one student's folder or archive, or go through that of a class."""
        if label is None and not self._named(place).is_certain and depth < MAX_CLASS_DEPTH:
            self._shelf.begin_student()
            try:
                inside = place.children(self._shelf)
            except Unreadable:
                inside = []  # the reason is given when it is read as a student's
            if self._is_class(inside, depth):
                # Anybody can put folders with others' names into a zip: without a roster, which knows that the name of
                # the zip is nobody's, only a zip that lies alone is a class's.
                if self._roster or is_alone:
                    self._explore(inside, depth + 1)
                    return
                if any(label_of(one.name) for one in inside):
                    take_in = f"Unpack it, or take in a roster ({program.name()} roster)."
                    self._ignore(place, f"it holds the hand-ins of several. {take_in}")
                    return
        self._take(place, label)

    def _named(self, place: Place, course_student: str = "") -> Owner:
        return self._roster.by_name(place.stem, course_student)

    def _is_class(self, places: Sequence[Place], depth: int) -> bool:
        places = [place for place in places if not (is_hidden(place.name) or place.why_not)]
        loose = [place for place in places if place.entry is not None and not place.is_archive]
        if any(is_work(place.name) and label_of(place.name) is None for place in loose):
            return False
        if any(map(self._is_a_students, places)):
            return True
        folders = [place for place in places if place.is_folder]
        if len(folders) != 1 or depth + 1 >= MAX_CLASS_DEPTH or any(place.is_archive for place in places):
            return False
        try:
            return self._is_class(folders[0].children(self._shelf), depth + 1)
        except Unreadable:
            return False

    def _is_a_students(self, place: Place) -> bool:
        label = label_of(place.name)
        if label is not None:
            is_usual = place.is_folder or place.is_archive or is_work(label.file)
            return is_usual or bool(self._roster.by_label(label).students)
        if place.entry is not None and not place.is_archive:
            return False
        owner = self._named(place)
        if self._roster or not owner.students:
            return owner.is_certain
        try:
            looked = place.look(self._shelf)
            student = student_in(self._course(looked, looked.files))
        except Unreadable:
            return False
        return caseless(student) in map(caseless, self._named(place, student).students)

    # --- what they hold -----------------------------------------------------------------------------------------------

    def _take(self, place: Place, label: Label | None = None, by_name: Owner | None = None) -> None:
        """Take a folder or an archive of one student."""
        self._begin_student()
        archived = self._utc(place.entry.modified) if place.entry else None
        found = _Found(place.stem, place, label, self._roster.by_label(label) if label else by_name, archived=archived)
        try:
            self._found += self._pieces(replace(found, place=place.look(self._shelf)))
        except Unreadable as error:
            self._found.append(replace(found, trouble=str(error)))

    def _begin_student(self) -> None:
        self._shelf.begin_student()
        self._archives_left = MAX_INNER_ARCHIVES

    def _take_file(self, place: Place, label: Label | None) -> None:
        """Take a file that no platform named: a notebook, whose owner is asked for, or an archive that is not read."""
        assert place.entry is not None
        why = "it is neither a folder nor a zip."
        if is_notebook(place.name):
            nobody = "it does not say who handed it in. Put it into a folder that is named by the student's ID."
            listing = Listing({place.name: place.entry})
            loose = Place(place.source, place.where, listing=listing)
            self._found.append(_Found(place.name, loose, label, Owner(why_not=nobody), listing.files))
            return
        if place.name.casefold().endswith(archives.OTHER_ARCHIVES):
            why = "it is packed in a way that is not read. Unpack it, or ask for an ordinary zip."
            owner = self._roster.by_label(label) if label else self._named(place)
            if owner.students:  # their feedback says why nothing of it counts
                archived = self._utc(place.entry.modified)
                self._found.append(_Found(place.stem, place, label, owner, trouble=why, archived=archived))
                return
        self._ignore(place, why)

    def _take_loose(self, files: Sequence[tuple[Place, Label]]) -> None:
        """Take files of one student that a platform named, side by side."""
        newest_first = sorted(files, key=lambda one: -one[1].attempt)
        latest = newest_first[0][1]
        loose: dict[str, Place] = {}
        for place, label in newest_first:
            if place.is_archive:
                self._take(place, label)
            elif label.file in loose:
                self._ignore(place, "there is a newer one of the same name.")
            else:
                loose[label.file] = place
        if not loose:
            return
        entries = {name: place.entry for name, place in loose.items() if place.entry}
        if latest.platform == platforms.CANVAS:
            entries |= platforms.without_canvas_counts(entries)
        first = min(loose.values(), key=lambda place: place.source)
        source = messages.listed(sorted(place.source for place in loose.values()), 1)
        self._begin_student()
        together = Place(source, first.where, listing=Listing(entries))
        self._found += self._pieces(_Found(first.name, together, latest, self._roster.by_label(latest)))

    def _pieces(self, found: _Found, nesting: int = 0) -> list[_Found]:
        """Split a place that was looked into: each archive with work in it, and the rest."""
        assert found.place.listing is not None
        files, refused = dict(found.place.files), found.place.listing.refused
        pieces: list[_Found] = []
        for path in [path for path in files if archives.is_archive(path) and not is_hidden(path)]:
            try:
                inside = self._inside(found, path, nesting)
            except Unreadable as error:
                refused[path] = str(error).rstrip(".")
                del files[path]
                continue
            if any(is_work(name) for piece in inside for name in piece.files):
                pieces += inside
                del files[path]
        if pieces and all(map(is_hidden, files)):
            assert pieces[0].place.listing is not None
            pieces[0].place.listing.refused.update(refused)
            return pieces
        trouble = ""
        if not pieces and not any(map(is_work, files)):
            broken = [path for path in refused if archives.is_archive(path)]
            trouble = " ".join(f"{shown(path)} cannot be read: {refused[path]}." for path in broken)
            if packed := [path for path in files if path.casefold().endswith(archives.OTHER_ARCHIVES)]:
                trouble += f"{archives.listed(packed)}: packed in a way that is not read; hand in an ordinary zip."
        return [replace(found, files=files, trouble=trouble, course=self._course(found.place, files)), *pieces]

    def _inside(self, found: _Found, path: str, nesting: int) -> list[_Found]:
        """Return the pieces of an archive within a piece."""
        if nesting == MAX_NESTING or not self._archives_left:
            raise Unreadable(f"of archives in a submission, {MAX_INNER_ARCHIVES} are read, {MAX_NESTING} in each other")
        self._archives_left -= 1
        entry = found.place.files[path]
        archived = found.archived
        if archived is None and found.label is not None and not nesting:  # the platform wrote it into its folder
            archived = self._utc(entry.modified)
        place = Place(f"{found.place.source}/{path}", found.place.where, entry)
        copy = platforms.without_copy_number(archives.without_ending(path.rpartition("/")[2]))
        attempt = max(found.attempt, copy[1] if copy else 0)
        inner = replace(found, place=place.look(self._shelf), archived=archived, attempt=attempt)
        return self._pieces(inner, nesting + 1)

    def _course(self, place: Place, files: Mapping[str, Entry]) -> dict[str, Any]:
        """Read the course.json with the fewest folders above it; nothing without one."""
        paths = [path for path in files if path.rpartition("/")[2] == COURSE_FILE and is_work(path)]
        if not paths:
            return {}
        entry = files[min(paths, key=lambda path: (path.count("/"), path))]
        try:
            return owners.course_data(self._shelf.read(place.where, entry, MAX_COURSE_FILE))
        except Unreadable:
            return {}

    # --- their owners and times ---------------------------------------------------------------------------------------

    def submissions(self, earlier: Callable[[str], Collection[str] | None]) -> list[Submission]:
        """Return the submission of each student."""
        named = [found.by_name or self._roster.by_name(found.name, student_in(found.course)) for found in self._found]
        present = {one for owner in named if owner.is_certain or not self._roster for one in owner.students}
        taken: list[tuple[Owner, Piece]] = []
        for number, (found, by_name) in enumerate(zip(self._found, named, strict=True)):
            owner = self._owner(found, replace(by_name, attempt=max(by_name.attempt, found.attempt)), present)
            if owner.students:
                taken.append((owner, self._piece(found, owner, number)))
        resolved = owners.resolve_partners([owner for owner, _piece in taken], earlier)
        pieces = [(owner, piece) for owner, (_before, piece) in zip(resolved, taken, strict=True)]
        students = {caseless(one): one for owner in reversed(resolved) for one in reversed(owner.everybody)}
        return [_submission(student, pieces) for _key, student in sorted(students.items())]

    def _owner(self, found: _Found, by_name: Owner, present: Collection[str]) -> Owner:
        """Determine an owner, and add a row for the instructor where that is in doubt."""
        source = found.place.source
        owner = owners.owner_of(
            found.name, by_name, found.course, self._roster, any(map(is_work, found.files)), present
        )
        given = self._decisions.get((source, OWNER))
        student = self._roster.known(given) if given else None
        unlisted = any(self._roster.known(one) is None for one in owner.students)
        if owner.problems or owner.why_not or unlisted or student:
            why = " ".join((*owner.problems, *owner.notes, owner.why_not)).strip()
            self.doubts.append(Doubt(source, OWNER, " ".join(owner.students), why, student_in(found.course)[:LONGEST]))
        if given and student is None:
            self._invalid.append(f"intake.csv: {shown(given)}, the owner of {shown(source)}, is unknown.")
        if student:
            return Owner((student,), (), student, DECIDED)
        if not owner.students:
            roster = f"put the student on the roster ({program.name()} roster)"
            what_to_do = f"Rename it to the student's ID, {roster}, or write the ID into intake.csv."
            self._ignore(found.place, " ".join(filter(None, (found.trouble, owner.why_not, what_to_do))))
        return owner

    def _piece(self, found: _Found, owner: Owner, number: int) -> Piece:
        place = found.place
        saved = self._saved(found)
        received, clock = self._time_received(found, owner, saved)
        if clock == DECIDED:
            self.doubts.append(self._doubt_of_time(found, saved, f"{received:%Y-%m-%d %H:%M} UTC", clock))
        elif not clock and found.files:
            self.doubts.append(
                self._doubt_of_time(found, saved, why="only the student's computer says when it was saved")
            )
        refused = place.listing.refused if place.listing else {}
        order = (owner.attempt, saved, number)
        return Piece(place.source, place.where, found.files, received, clock, owner.rule, refused, order, found.trouble)

    def _doubt_of_time(self, found: _Found, saved: datetime, assumed: str = "", why: str = "") -> Doubt:
        # A row that an instructor wrote holds for whatever was saved.
        is_written = (found.place.source, TIME) in self._decisions
        return Doubt(
            found.place.source, TIME, assumed, why, "" if is_written else f"saved {saved:%Y-%m-%d %H:%M:%S} UTC"
        )

    def _time_received(self, found: _Found, owner: Owner, saved: datetime) -> tuple[datetime, str]:
        """Return the time of receipt, and how it is known: "" if only files say when they were saved."""
        label = found.label
        if decided := self._decisions.get(self._doubt_of_time(found, saved).key):
            if (time := platforms.parse_time(decided, self._zone)) is not None:
                return time, DECIDED
            self._invalid.append(f"intake.csv: {shown(decided)} is not a time; write it as 2026-11-21 13:05.")
        if label is not None and label.time is not None:
            return in_utc(label.time, self._zone), "the time in its name"
        names = [found.place.name, found.name, *owner.students]
        if label is not None:
            names += [*label.people, label.number, f"Participant {label.number}"]
        if times := [self._times[caseless(name)] for name in names if caseless(name) in self._times]:
            return times[0], "the list of times"
        if found.archived is not None:
            return found.archived, "the time of the archive among the submissions"
        return saved, ""

    def _saved(self, found: _Found) -> datetime:
        """Return when the newest of its files was saved, by the clock of whoever wrote it."""
        times = (self._utc(entry.modified) for entry in found.files.values())
        saved = max(filter(None, times), default=found.archived or datetime.fromtimestamp(0, UTC))
        return min(saved, datetime.now(UTC))

    def _utc(self, time: datetime | None) -> datetime | None:
        return None if time is None else in_utc(time, self._zone)

    # --- messages -----------------------------------------------------------------------------------------------------

    def _ignore(self, place: Place, why: str) -> None:
        self._ignored.setdefault(why, []).append(place.source)

    def messages(self) -> list[str]:
        """Return a message for each reason why something is not read, and on decisions that cannot be followed."""
        ignored = [
            f"{', '.join(map(shown, sources))} {'are' if len(sources) > 1 else 'is'} not read: {why}"
            for why, sources in self._ignored.items()
        ]
        return [*ignored, *self._invalid]


def _submission(student: str, pieces: Iterable[tuple[Owner, Piece]]) -> Submission:
    """Collect all pieces of a student."""
    key = caseless(student)
    own = sorted(
        ((owner, piece) for owner, piece in pieces if key in map(caseless, owner.everybody)),
        key=lambda one: (one[1].received, one[1].order),
    )
    newest = own[-1][0]
    is_claimed = all(key not in map(caseless, owner.students) for owner, _piece in own)
    notes = dict.fromkeys(note for owner, _piece in own for note in owner.notes)
    if is_claimed:
        notes[f"Handed in by {newest.students[0]}, whose {COURSE_FILE} says that it was made together."] = None
    together = {caseless(one): one for owner, _piece in own for one in owner.everybody}
    return Submission(
        student,
        tuple(piece for _owner, piece in own),
        newest.bench_of,
        tuple(one for other, one in sorted(together.items()) if other != key),
        newest.students[0] if is_claimed else "",
        tuple(dict.fromkeys(problem for owner, _piece in own for problem in owner.problems)),
        tuple(notes),
    )
