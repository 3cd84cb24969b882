"""Find the submissions of each student in a class's folder, however a platform packed and named them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any

from labcourse import messages, program
from labcourse.errors import GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.gradebook.records import DECIDED, StudentRecord
from labcourse.grading.intake import archives, owners, platforms
from labcourse.grading.intake.archives import Entry, Listing, Shelf, Unreadable, is_notebook, is_work, shown
from labcourse.grading.intake.owners import Owner, Roster, student_in
from labcourse.grading.intake.platforms import Label, in_utc, label_of, readable
from labcourse.student_id import LONGEST, caseless

MAX_CLASS_DEPTH = 3  #: folders and zips around those of the students; a platform's zip, its folder, and a section's
MAX_NESTING = 3  #: archives within archives
MAX_INNER_ARCHIVES = 20  #: archives within one submission
MAX_COURSE_FILE = 10_000  #: bytes of course.json; a name, a release, and partners

_NEVER = datetime.fromtimestamp(0, UTC)
_NO_NAME = "it does not say who handed it in."
_NEITHER = "it is neither a folder nor a zip"

OWNER, TIME = "owner", "time received"  #: what an instructor may decide, besides a file (by its name in the course)
#: :attr:`Doubt.key` → what was decided.
Decisions = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Doubt:
    """A row of ``intake.csv``: something that an instructor may decide.

    Attributes
    ----------
    submission : name of the folder, archive or file, from the class's folder on
    about : :data:`OWNER` or :data:`TIME`; or the name of a file of the course, if several of the submission may be it
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
    source : path in the class's folder, which may lead through archives
    name : name of the folder, archive or file, without the ending of an archive
    label : what the name says if a platform gave it; None if the student did
    archived : time of the archive among the submissions, UTC; None without one
    copy : number of the copy in the name of an archive within the submission; the higher, the later
    files : path → file
    refused : path → reason why it is not read
    trouble : why nothing of it can be read; "" if it can be read
    course : content of its course.json
    owner : the students to whom it belongs
    received : time of receipt, UTC
    clock : how the time is known; "" if only the student's computer wrote it
    saved : when it was saved, UTC, by the student's computer
    """

    source: str
    name: str
    label: Label | None = None
    archived: datetime | None = None
    copy: int = 0
    files: Mapping[str, Entry] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    trouble: str = ""
    course: Mapping[str, Any] = field(default_factory=dict)
    owner: Owner = field(default_factory=Owner)
    received: datetime = _NEVER
    clock: str = ""
    saved: datetime = _NEVER


@dataclass(frozen=True)
class Submission:
    """All that a student handed in.

    Attributes
    ----------
    student : ID
    pieces : all that the student handed in, in order of time
    bench_of : ID of the student with the bench for the run: a partner's, if several handed in together
    partners : IDs of the students with whom it was handed in
    claimed_by : ID of the partner who handed in, if nothing but their course.json names this student; "" otherwise
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
class Place:
    """A file, a folder or an archive somewhere in a class's folder.

    Attributes
    ----------
    source : path in the class's folder, which may lead through archives
    content : a file; a listing of a folder in an archive, or of files side by side; the path of a folder on disk; or
        a text: the reason why it is not read
    """

    source: str
    content: Entry | Listing | Path | str

    @property
    def name(self) -> str:
        """The last part of its path."""
        return self.source.rpartition("/")[2]

    @property
    def stem(self) -> str:
        """Its name, without the ending of an archive."""
        return archives.without_ending(self.name) if self.file else self.name

    @property
    def label(self) -> Label | None:
        """What its name says if a platform gave it; None for another name."""
        return label_of(self.name)

    @property
    def file(self) -> Entry | None:
        """The file, if it is one."""
        return self.content if isinstance(self.content, Entry) else None

    @property
    def is_store(self) -> bool:
        """Whether it is a folder, or an archive that can be read, by its name."""
        return archives.is_archive(self.name) if self.file else not isinstance(self.content, str)

    def look(self, shelf: Shelf, whole_class: bool = False) -> Listing:
        """Look into a folder or an archive.

        Raises
        ------
        Unreadable
            If it cannot be read, or is too large for one student (or for a class).
        """
        most = archives.MAX_CLASS_ENTRIES if whole_class else archives.MAX_ENTRIES
        largest = archives.MAX_CLASS_ARCHIVE if whole_class else archives.MAX_ARCHIVE
        if isinstance(self.content, Listing):
            if len(self.content.files) > most:
                raise Unreadable(archives.TOO_MANY.format(most))
            return self.content
        if isinstance(self.content, str) or not self.is_store:
            raise Unreadable("it is packed in a way that is not read. Unpack it, or ask for an ordinary zip.")
        if isinstance(self.content, Entry) and self.content.size > largest:
            raise Unreadable(f"it has more than {largest} bytes.")
        return shelf.listing(self.content, most)

    def children(self, shelf: Shelf) -> list[Place]:
        """Return what lies in it, sorted by name; nothing if it cannot be read.

        Folders on disk are not looked into here, so that one that cannot be read does not spoil the others.
        """
        try:
            if isinstance(self.content, Path):
                return [*on_disk_in(self.content, f"{self.source}/")]
            listing = self.look(shelf, whole_class=True)
        except Unreadable:
            return []
        places: list[Place] = []
        folders: dict[str, Listing] = defaultdict(Listing)
        contents: list[tuple[str, Entry | str]] = [*listing.files.items(), *listing.refused.items()]
        for path, content in contents:
            name, slash, rest = path.partition("/")
            if slash:
                folders[name].add(rest, content)
            else:
                places.append(Place(f"{self.source}/{name}", content))
        places += [Place(f"{self.source}/{name}", folder) for name, folder in folders.items()]
        return sorted(places, key=lambda place: place.source)


def on_disk_in(folder: Path, prefix: str = "") -> Iterator[Place]:
    """Find what lies in a folder on disk, by name."""
    for item in archives.scan(folder):
        source = f"{prefix}{readable(item.name)}"
        if item.is_dir(follow_symlinks=False):
            yield Place(source, folder / item.name)
        elif item.is_file(follow_symlinks=False):
            yield Place(source, archives.on_disk(folder, item, item.name))
        else:
            yield Place(source, _NEITHER)


def _together(places: Mapping[str, Place]) -> Place:
    """Make one place of files that lie side by side; the keys are their names in it."""
    source = messages.listed(sorted({place.source for place in places.values()}), 1)
    return Place(source, Listing({name: place.file for name, place in places.items() if place.file}))


def find(
    folder: Path,
    roster: Sequence[StudentRecord] = (),
    times: Mapping[str, datetime] | None = None,
    zone: tzinfo = UTC,
    earlier: Callable[[str], Collection[str] | None] = lambda student: None,
    decisions: Decisions | None = None,
) -> ClassFolder:
    """Find the submissions in a class's folder, or in a zip of it.

    Parameters
    ----------
    folder : holds a folder, a zip or loose files for each student
    roster : the students; names that platforms give are compared with theirs
    times : name of what lies there, or a student's ID or name → time of receipt, from :func:`.platforms.read_times`
    zone : of times in names and in zips, which have none
    earlier : function that returns the students whom a student named when they handed in before; None for a student
        who did not
    decisions : owners and times, by the instructor

    Raises
    ------
    GradingError
        If there is no such folder, or no submission in it.
    """
    if not (folder.is_dir() or folder.is_file()):
        raise GradingError(f"There is no folder {folder}.")
    folder = folder.resolve()
    with Shelf(zone) as shelf:
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
    """Collects the pieces of a class's folder; then determines their owners and their times of receipt."""

    def __init__(
        self, roster: Roster, times: Mapping[str, datetime], zone: tzinfo, shelf: Shelf, decisions: Decisions
    ) -> None:
        self.doubts: list[Doubt] = []
        self._roster, self._zone, self._shelf, self._decisions = roster, zone, shelf, decisions
        self._times = {caseless(name): in_utc(time, UTC) for name, time in times.items()}
        self._pieces: list[Piece] = []
        self._ignored: dict[str, list[str]] = defaultdict(list)
        self._invalid: list[str] = []  # decisions
        self._archives_left = 0

    # --- where submissions are ----------------------------------------------------------------------------------------

    def start(self, folder: Path) -> None:
        """Go through a class's folder or zip, or a student's own folder."""
        name = readable(folder.name)
        if folder.is_file():
            self._explore([Place(name, archives.on_disk(folder.parent, folder, folder.name))], 0)
            return
        inside = [*on_disk_in(folder)]
        files = [place.name for place in inside if place.file]
        if COURSE_FILE in files and any(map(is_notebook, files)) and not any(place.label for place in inside):
            self._take(Place(name, folder), None, owners.nobody(_NO_NAME))
        else:
            self._explore(inside, 0)

    def _explore(self, places: Sequence[Place], depth: int) -> None:
        """Take the submissions that lie in a class's folder or archive, at a depth of folders around them."""
        loose: dict[tuple[object, ...], list[tuple[Place, Label]]] = defaultdict(list)
        for place in places:
            label = place.label or self._roster.before_underscore(place.name)
            if isinstance(place.content, str):
                self._ignore(place.source, f"{place.content}.")
            elif label is not None and label.is_receipt:
                self._ignore(place.source, f"{label.platform} itself wrote it.")
            elif label is not None and label.file and place.file:
                loose[label.platform, label.people, label.number, label.time].append((place, label))
            elif place.is_store:
                self._look_into(place, label, depth, is_alone=len(places) == 1)
            elif is_notebook(place.name):
                nobody = owners.nobody(f"{_NO_NAME} Put it into a folder that is named by the student's ID.")
                self._take(_together({place.name: place}), label, nobody)
            elif archives.is_other_archive(place.name):
                self._take(place, label)
            else:
                self._ignore(place.source, f"{_NEITHER}.")
        for files in loose.values():
            self._take_loose(files)

    def _look_into(self, place: Place, label: Label | None, depth: int, is_alone: bool) -> None:
        """Take one student's folder or archive, or go through that of a class."""
        if label is None and depth < MAX_CLASS_DEPTH and not self._roster.by_name(place.stem).is_certain:
            self._shelf.begin_student()
            inside = place.children(self._shelf)
            if self._is_class(inside, depth):
                # Anybody can put folders with others' names into a zip: without a roster, which knows that the name of
                # the zip is nobody's, only a zip that lies alone is a class's.
                if self._roster or is_alone:
                    self._explore(inside, depth + 1)
                    return
                if any(child.label for child in inside):
                    take_in = f"Unpack it, or take in a roster ({program.name()} roster)."
                    self._ignore(place.source, f"it holds the hand-ins of several. {take_in}")
                    return
        self._take(place, label)

    def _is_class(self, places: Sequence[Place], depth: int) -> bool:
        """Check whether what lies in a folder or an archive are the submissions of a class, and not one student's."""
        places = [place for place in places if not isinstance(place.content, str)]
        if any(is_work(place.name) and not (place.is_store or place.label) for place in places):
            return False
        if any(map(self._is_a_students, places)):
            return True
        stores = [place for place in places if place.is_store]
        is_wrapped = len(stores) == 1 and not stores[0].file and depth + 1 < MAX_CLASS_DEPTH
        return is_wrapped and self._is_class(stores[0].children(self._shelf), depth + 1)

    def _is_a_students(self, place: Place) -> bool:
        """Check whether a place is named by a student. Without a roster, the course.json in it must name them, too."""
        if (label := place.label) is not None:
            return place.is_store or is_work(label.file) or bool(self._roster.by_label(label).students)
        owner = self._roster.by_name(place.stem)
        if self._roster or not (place.is_store and owner.students):
            return place.is_store and owner.is_certain
        try:
            student = student_in(self._course(place.look(self._shelf).files))
        except Unreadable:
            return False
        return self._roster.spelled(student) in self._roster.by_name(place.stem, student).students

    # --- what they hold -----------------------------------------------------------------------------------------------

    def _take(
        self,
        place: Place,
        label: Label | None,
        owner: Owner | None = None,
        name: str = "",
        archived: datetime | None = None,
    ) -> None:
        """Take what one student handed in, and determine its owner by name.

        Parameters
        ----------
        place : the folder, the archive, or the loose files
        label : what its name says if a platform gave it
        owner : owner of what has no name of a student
        name : name that says who handed it in, if not the place's
        archived : when a platform received loose files
        """
        self._shelf.begin_student()
        self._archives_left = MAX_INNER_ARCHIVES
        archived = place.file.modified if place.file else archived
        whole = Piece(place.source, name or place.stem, label, archived)
        try:
            pieces = self._split(whole, place)
        except Unreadable as error:
            pieces = [replace(whole, trouble=str(error))]
        owner = self._roster.by_label(label) if label else owner
        for piece in pieces:
            by_name = owner or self._roster.by_name(piece.name, student_in(piece.course))
            self._pieces.append(replace(piece, owner=by_name))

    def _take_loose(self, files: Sequence[tuple[Place, Label]]) -> None:
        """Take files of one student that a platform named, side by side."""
        newest_first = sorted(files, key=lambda file: -file[1].attempt)
        loose: dict[str, Place] = {}
        for place, label in newest_first:
            if place.is_store:
                self._take(place, label)
            elif label.file in loose:
                self._ignore(place.source, "there is a newer one of the same name.")
            else:
                loose[label.file] = place
        if loose:
            latest = newest_first[0][1]
            if latest.platform == platforms.CANVAS:
                loose |= platforms.without_canvas_counts(loose)
            name = min(place.name for place in loose.values())
            times = [place.file.modified for place in loose.values() if place.file and place.file.modified]
            self._take(_together(loose), latest, name=name, archived=max(times, default=None))

    def _split(self, whole: Piece, place: Place, nesting: int = 0) -> list[Piece]:
        """Look into a place, and split it: each archive with work in it is a piece, and so is the rest.

        Parameters
        ----------
        whole : the submission before it is split, with its name and the time of its archive
        place : the folder, the archive, or the loose files
        nesting : number of archives around the place in this submission
        """
        listing = place.look(self._shelf)
        files, refused = dict(listing.files), dict(listing.refused)
        pieces: list[Piece] = []
        for path in filter(archives.is_archive, listing.files):
            try:
                inside = self._inside(whole, Place(f"{place.source}/{path}", files[path]), nesting)
            except Unreadable as error:
                refused[path] = str(error).rstrip(".")
                del files[path]
                continue
            if any(is_work(name) for piece in inside for name in piece.files):
                pieces += inside
                del files[path]
        if pieces and not files:
            return [replace(pieces[0], refused={**pieces[0].refused, **refused}), *pieces[1:]]
        trouble = ""
        if not pieces and not any(map(is_work, files)):
            broken = [path for path in refused if archives.is_archive(path)]
            trouble = " ".join(f"{shown(path)} cannot be read: {refused[path]}." for path in broken)
            if packed := [*filter(archives.is_other_archive, files)]:
                trouble += f"{archives.listed(packed)}: packed in a way that is not read; hand in an ordinary zip."
        course = self._course(files)
        rest = replace(whole, source=place.source, files=files, refused=refused, trouble=trouble, course=course)
        return [rest, *pieces]

    def _inside(self, whole: Piece, place: Place, nesting: int) -> list[Piece]:
        """Return the pieces of an archive within a submission; parameters as for :meth:`_split`."""
        if nesting == MAX_NESTING or not self._archives_left:
            raise Unreadable(f"of archives in a submission, {MAX_INNER_ARCHIVES} are read, {MAX_NESTING} in each other")
        self._archives_left -= 1
        if whole.archived is None and whole.label and not nesting and place.file:  # the platform wrote it there
            whole = replace(whole, archived=place.file.modified)
        copy = platforms.without_copy_number(place.stem)
        whole = replace(whole, copy=max(whole.copy, copy[1] if copy else 0))
        return self._split(whole, place, nesting + 1)

    def _course(self, files: Mapping[str, Entry]) -> dict[str, Any]:
        """Read the course.json with the fewest folders above it; nothing without one."""
        paths = [path for path in files if path.rpartition("/")[2] == COURSE_FILE]
        try:
            path = min(paths, key=lambda path: (path.count("/"), path))
            return owners.course_data(self._shelf.read(files[path], MAX_COURSE_FILE))
        except (ValueError, Unreadable):  # there is none, or it cannot be read
            return {}

    # --- their owners and times ---------------------------------------------------------------------------------------

    def submissions(self, earlier: Callable[[str], Collection[str] | None]) -> list[Submission]:
        """Return the submission of each student."""
        by_name = [piece.owner for piece in self._pieces]
        present = {student for owner in by_name if owner.is_certain or not self._roster for student in owner.students}
        owned = [replace(piece, owner=self._owner(piece, present)) for piece in self._pieces]
        pieces = [self._with_time(piece) for piece in owned if piece.owner.students]
        resolved = owners.resolve_partners([piece.owner for piece in pieces], self._roster, earlier)
        pieces = [replace(piece, owner=owner) for piece, owner in zip(pieces, resolved, strict=True)]
        students = {student for owner in resolved for student in owner.everybody}
        return [_submission(student, pieces) for student in sorted(students, key=caseless)]

    def _owner(self, piece: Piece, present: Collection[str]) -> Owner:
        """Determine the owner of a piece, and add a row for the instructor if that is in doubt.

        Parameters
        ----------
        piece : with its owner by name
        present : students who handed in under their own names
        """
        holds_work = any(map(is_work, piece.files))
        owner = owners.owner_of(piece.name, piece.owner, piece.course, self._roster, holds_work, present)
        decision = self._decisions.get((piece.source, OWNER))
        decided = self._roster.known(decision) if decision else None
        unlisted = any(self._roster.known(student) is None for student in owner.students)
        if owner.problems or unlisted or decided:
            why = " ".join((*owner.problems, *owner.notes))
            instead = student_in(piece.course)[:LONGEST]
            self.doubts.append(Doubt(piece.source, OWNER, " ".join(owner.students), why, instead))
        if decided:
            return Owner((decided,), bench_of=decided, is_decided=True)
        if decision:
            self._invalid.append(f"intake.csv: {shown(decision)}, the owner of {shown(piece.source)}, is unknown.")
        if not owner.students:
            roster = f"put the student on the roster ({program.name()} roster)"
            what_to_do = f"Rename it to the student's ID, {roster}, or write the ID into intake.csv."
            self._ignore(piece.source, " ".join(filter(None, (piece.trouble, *owner.problems, what_to_do))))
        return owner

    def _with_time(self, piece: Piece) -> Piece:
        """Add the time of receipt to a piece, and a row for the instructor if only files say it, or if it is decided.

        The row's key has the time when the files were saved, so a decision does not hold for files that were saved
        later, unless the instructor wrote the row without that time.
        """
        times = filter(None, (entry.modified for entry in piece.files.values()))
        saved = min(max(times, default=piece.archived or _NEVER), datetime.now(UTC))
        is_written = (piece.source, TIME) in self._decisions
        when_saved = "" if is_written else f"saved {saved:%Y-%m-%d %H:%M:%S} UTC"
        doubt = Doubt(piece.source, TIME, "", "only the student's computer says when it was saved", when_saved)
        received, clock = self._time_received(piece, self._decisions.get(doubt.key))
        if clock == DECIDED:
            self.doubts.append(replace(doubt, assumed=f"{received:%Y-%m-%d %H:%M} UTC", why=clock))
        elif not clock and piece.files:
            self.doubts.append(doubt)
        return replace(piece, received=received or saved, clock=clock, saved=saved)

    def _time_received(self, piece: Piece, decided: str | None) -> tuple[datetime | None, str]:
        """Return the time of receipt, and how it is known; None and "" if only files say when they were saved.

        Parameters
        ----------
        piece : with its owner
        decided : the instructor's decision; None without one
        """
        label = piece.label
        if decided:
            if (time := platforms.parse_time(decided, self._zone)) is not None:
                return time, DECIDED
            self._invalid.append(f"intake.csv: {shown(decided)} is not a time; write it as 2026-11-21 13:05.")
        if label is not None and label.time is not None:
            return in_utc(label.time, self._zone), "the time in its name"
        names = [piece.source.rpartition("/")[2], piece.name, *piece.owner.students]
        if label is not None:
            names += [*label.people, label.number, f"Participant {label.number}"]
        if times := [self._times[caseless(name)] for name in names if caseless(name) in self._times]:
            return times[0], "the list of times"
        return piece.archived, "the time of the archive among the submissions" if piece.archived else ""

    # --- messages -----------------------------------------------------------------------------------------------------

    def _ignore(self, source: str, why: str) -> None:
        """Note that something is not read, and why."""
        self._ignored[why].append(source)

    def messages(self) -> list[str]:
        """Return a message for each reason why something is not read, and on decisions that cannot be followed."""
        ignored = [
            f"{', '.join(map(shown, sources))} {'are' if len(sources) > 1 else 'is'} not read: {why}"
            for why, sources in self._ignored.items()
        ]
        return [*ignored, *self._invalid]


def _submission(student: str, pieces: Iterable[Piece]) -> Submission:
    """Collect all pieces of a student."""
    own = [piece for piece in pieces if student in piece.owner.everybody]
    own.sort(key=lambda piece: (piece.received, max(piece.owner.attempt, piece.copy), piece.saved))
    newest = own[-1].owner
    is_claimed = all(student not in piece.owner.students for piece in own)
    notes = dict.fromkeys(note for piece in own for note in piece.owner.notes)
    if is_claimed:
        notes[f"Handed in by {newest.students[0]}: their {COURSE_FILE} says that it was made together."] = None
    together = {partner for piece in own for partner in piece.owner.everybody}
    return Submission(
        student,
        tuple(own),
        newest.bench_of,
        tuple(sorted(together - {student}, key=caseless)),
        newest.students[0] if is_claimed else "",
        tuple(dict.fromkeys(problem for piece in own for problem in piece.owner.problems)),
        tuple(notes),
    )
