"""Find the submissions of each student in a class's folder, however a platform packed and named them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any

from labcourse import clock, messages
from labcourse.errors import GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.gradebook.records import DECIDED, ON_DISK, StudentRecord
from labcourse.grading.intake import archives, owners, platforms
from labcourse.grading.intake.archives import Listing, Shelf, StoredFile, Unreadable, is_notebook, is_work, named
from labcourse.grading.intake.owners import Roster, student_in
from labcourse.grading.intake.platforms import Label, in_utc, label_of, platforms_of, readable
from labcourse.grading.submission import (
    NEVER,
    OWNER,
    PARTNER,
    PLATFORM,
    TIME_RECEIVED,
    Decisions,
    Doubt,
    Owner,
    Piece,
    Submission,
    content_name,
)
from labcourse.problems import Code, Problem
from labcourse.sentences import sentences
from labcourse.student_id import LONGEST, caseless

MAX_CLASS_DEPTH = 3  #: folders and zips around those of the students; a platform's zip, its folder, and a section's
MAX_NESTING = 3  #: archives within archives
MAX_INNER_ARCHIVES = 20  #: archives within one submission
MAX_COURSE_FILE = 10_000  #: bytes of course.json; a name, a release, and partners

_NO_FOLDER_NO_ZIP = Problem.of(Code.NO_FOLDER_NO_ZIP)

YES, NO = "yes", "no"  #: decisions on a partner
NOBODY = "nobody"  #: decision on an owner: it counts for no one
NO_PLATFORM = "none"  #: decision on a platform: names are the students' IDs
#: What lies at a place: a file, the content of a folder or an archive, a folder on disk, or why it is not read.
PlaceContent = StoredFile | Listing | Path | Problem


@dataclass(frozen=True)
class ClassFolder:
    """What lies in a class's folder.

    Attributes
    ----------
    submissions : one for each student, by ID
    ignored : why something is not read, for everything of which that is so; and decisions that cannot be followed
    doubts : what an instructor may decide; while the platform of a download is not decided, there are no submissions
    read : what rows of ``intake.csv`` may be about: archives, folders and files, and students
    """

    submissions: list[Submission]
    ignored: list[Problem]
    doubts: list[Doubt] = field(default_factory=list)
    read: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class Place:
    """A file, a folder or an archive somewhere in a class's folder.

    Attributes
    ----------
    source : path in the class's folder, which may lead through archives
    content : a file; a listing of a folder in an archive, or of files side by side; the path of a folder on disk; or
        the reason why it is not read
    """

    source: str
    content: PlaceContent

    @property
    def name(self) -> str:
        """The last part of its path."""
        return self.source.rpartition("/")[2]

    @property
    def stem(self) -> str:
        """Its name, without the ending of an archive."""
        return archives.without_ending(self.name) if self.file else self.name

    @property
    def file(self) -> StoredFile | None:
        """The file, if it is one."""
        return self.content if isinstance(self.content, StoredFile) else None

    @property
    def is_store(self) -> bool:
        """Whether it is a folder, or an archive that can be read, by its name."""
        return archives.is_archive(self.name) if self.file else not isinstance(self.content, Problem)

    def look(self, shelf: Shelf, whole_class: bool = False) -> Listing:
        """List a folder or an archive, with all that lies below.

        Raises
        ------
        Unreadable
            If it is neither a folder nor an archive, cannot be read, or is too large for one student (for a class, if
            ``whole_class``).
        """
        most = archives.MAX_CLASS_ENTRIES if whole_class else archives.MAX_ENTRIES
        largest = archives.MAX_CLASS_ARCHIVE if whole_class else archives.MAX_ARCHIVE
        if isinstance(self.content, Listing):
            if len(self.content.files) > most:
                raise Unreadable(Code.TOO_MANY_FILES, most=most)
            return self.content
        if isinstance(self.content, Problem) or not self.is_store:
            raise Unreadable(Code.PACKED_OTHERWISE)
        if isinstance(self.content, StoredFile) and self.content.size > largest:
            raise Unreadable(Code.TOO_MANY_BYTES, most=largest)
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
        contents: list[tuple[str, StoredFile | Problem]] = [*listing.files.items(), *listing.refused.items()]
        for path, content in contents:
            name, slash, rest = path.partition("/")
            if slash:
                folders[name].add(rest, content)
            else:
                places.append(Place(f"{self.source}/{name}", content))
        places += [Place(f"{self.source}/{name}", folder) for name, folder in folders.items()]
        return sorted(places, key=lambda place: place.source)


def on_disk_in(folder: Path, prefix: str = "") -> Iterator[Place]:
    """Yield what lies in a folder on disk, by name; ``prefix`` begins the paths. Raises Unreadable."""
    for item in archives.scan(folder):
        source = f"{prefix}{readable(item.name)}"
        if item.is_dir(follow_symlinks=False):
            yield Place(source, folder / item.name)
        elif item.is_file(follow_symlinks=False):
            yield Place(source, archives.on_disk(folder, item, item.name))
        else:
            yield Place(source, _NO_FOLDER_NO_ZIP)


def _together(places: Mapping[str, Place]) -> Place:
    """Make one place of files that lie side by side; ``places`` are the files, by their names in it."""
    source = messages.listed(sorted({place.source for place in places.values()}), 1)
    return Place(source, Listing({name: place.file for name, place in places.items() if place.file}))


def find(
    folder: Path,
    roster: Sequence[StudentRecord] = (),
    times: Mapping[str, datetime] | None = None,
    *,
    zone: tzinfo = UTC,
    earlier: Callable[[str], Collection[str] | None] = lambda student: None,
    decisions: Decisions | None = None,
    platform: str = "",
    erased: Callable[[str], object] = lambda student: False,
) -> ClassFolder:
    """Find the submissions in a class's folder, or in a zip of it.

    Parameters
    ----------
    folder : holds a folder, a zip or loose files for each student
    roster : the students; names that platforms give are compared with theirs
    times : name of what lies there, or a student's ID or other name → time of receipt, from
        :func:`.platforms.read_times`
    zone : of times in names and in zips, which have none
    earlier : function of a student's ID: returns the students whom their last course.json named; None if they handed in
        nothing before
    decisions : owners, times, partners and platforms, by the instructor
    platform : name of the platform that named the submissions, used where their names fit several; "" if not known
    erased : function of an ID: returns whether this person was erased; nobody is asked about what only names them

    Raises
    ------
    GradingError
        If there is no such folder, if it cannot be read, or if it has neither a submission nor anything to decide.
    """
    if not (folder.is_dir() or folder.is_file()):
        raise GradingError(f"There is no folder {folder}.")
    folder = folder.resolve()
    with Shelf(zone) as shelf:
        finder = _Finder(Roster(roster), times or {}, zone, shelf, decisions or {}, platform, erased)
        try:
            finder.start(folder)
        except Unreadable as error:
            raise GradingError(f"{folder} cannot be read: {error}") from None
        submissions = finder.submissions(earlier)
    ignored = finder.ignored()
    if not submissions and not finder.doubts:
        nothing = f"There are no submissions in {folder}: it should hold a folder or a zip for each student."
        raise GradingError(" ".join([nothing, *sentences(ignored)]))
    return ClassFolder(submissions, ignored, finder.doubts, finder.read)


class _Finder:
    """Collects the pieces of a class's folder; then determines their owners and their times of receipt."""

    def __init__(
        self,
        roster: Roster,
        times: Mapping[str, datetime],
        zone: tzinfo,
        shelf: Shelf,
        decisions: Decisions,
        platform: str,
        erased: Callable[[str], object],
    ) -> None:
        self.doubts: list[Doubt] = []
        self.read: set[str] = set()
        self.is_undecided = False
        self._roster, self._zone, self._shelf, self._decisions = roster, zone, shelf, decisions
        self._with_owner = {source for source, about in decisions if about.startswith(OWNER)}
        self._erased, self._given_platform, self._is_given_zip = erased, platform, False
        self._times = {caseless(name): in_utc(time, UTC) for name, time in times.items()}
        self._pieces: list[Piece] = []
        self._ignored: dict[tuple[Problem, ...], list[str]] = defaultdict(list)
        self._invalid: list[Problem] = []  # decisions
        self._archives_left = 0

    # --- where submissions are ----------------------------------------------------------------------------------------

    def start(self, folder: Path) -> None:
        """Collect the pieces in a class's folder or zip, or in a student's own folder."""
        name = readable(folder.name)
        if folder.is_file():
            self._is_given_zip = True
            self._explore(name, [Place(name, archives.on_disk(folder.parent, folder, folder.name))], 0)
            return
        inside = [*on_disk_in(folder)]
        files = [place.name for place in inside if place.file]
        if COURSE_FILE in files and any(map(is_notebook, files)) and not any(map(platforms_of, files)):
            self._take(own := Place(name, folder), None, self._owner_of_folder(own))
        else:
            self._explore(name, inside, 0)

    def _owner_of_folder(self, place: Place) -> Owner:
        """Return the owner of a student's own folder: by its name if that is on the roster.

        Without a roster, it is the student in its course.json. Otherwise it is nobody.
        """
        by_name = self._roster.by_name(place.name)
        student = self._roster.spelled(student_in(self._course(place.look(self._shelf).files)))
        if by_name.is_certain or self._roster.is_given or not student:
            return by_name if by_name.is_certain else owners.nobody(Problem.of(Code.NAMES_NOBODY))
        return Owner((student,), bench_of=student)

    def _platform(self, source: str, places: Sequence[Place]) -> str | None:
        """Return the platform that named what lies in a folder or an archive: the only one that fits all names.

        Leave out names that fit no platform if they are on the roster or cannot be a submission, and all names of what
        is not read. Ask for the instructor's decision, by --platform or a row of intake.csv, only if not exactly one
        platform fits all names that are left. A student chose the end of each name, so single names may fit several.

        Returns
        -------
        str | None
            Name of the platform; "" if no name is a platform's, or if the instructor decided so; None if the instructor
            has to decide
        """
        fits = {place.name: platforms_of(place.name) for place in places if not isinstance(place.content, Problem)}
        strangers = {place.name for place in places if _may_be_submission(place) and not self._is_on_roster(place)}
        names = [name for name in fits if fits[name] or name in strangers]
        possible = sorted({platform for name in names for platform in fits[name]})
        fitting = [platform for platform in possible if all(platform in fits[name] for name in names)]
        if len(fitting) == 1 or not possible:
            return "".join(fitting)
        self.read.add(source)
        choices = [*possible, NO_PLATFORM]
        decided = caseless(self._given_platform or self._decisions.get((source, PLATFORM), ""))
        chosen = next((choice for choice in choices if caseless(choice) == decided), "")
        several = Problem.of(Code.NAMES_OF_SEVERAL_PLATFORMS)
        why = Problem.of(Code.NAMES_FIT_PLATFORMS, platforms=fitting) if fitting else several
        self.doubts.append(Doubt(source, PLATFORM, chosen, (why,), ", ".join(choices)))
        if not chosen:
            self.is_undecided = True
            self._ignore(source, Problem.of(Code.PLATFORM_UNDECIDED, why=why, choices=choices))
        return "" if chosen == NO_PLATFORM else chosen or None

    def _is_on_roster(self, place: Place) -> bool:
        """Return whether a place has a name on the roster, or is a notebook with a name that begins with such an ID."""
        return self._roster.by_name(place.stem).is_certain or self._roster.before_underscore(place.name) is not None

    def _explore(self, source: str, places: Sequence[Place], depth: int) -> None:
        """Take the submissions that lie in a class's folder or archive, and in the classes in it.

        Parameters
        ----------
        source : path of the folder or archive
        places : what lies in it
        depth : number of folders and archives of the class around it
        """
        platform = self._platform(source, places)
        if platform is None:
            return
        labels = {
            place.source: label_of(place.name, platform) or self._roster.before_underscore(place.name)
            for place in places
        }
        classes = self._classes([place for place in places if labels[place.source] is None], depth)
        submissions = [place for place in places if labels[place.source] or _may_be_submission(place)]
        # Anybody can put folders with others' names into a zip, so it is a class's only if all beside it are, too;
        # without a roster, which knows that the name of a zip is nobody's, only if nothing lies beside it.
        are_classes = len(classes) == len(submissions) and (self._roster.is_given or len(submissions) == 1)
        loose: dict[tuple[object, ...], list[tuple[Place, Label]]] = defaultdict(list)
        for place in places:
            label = labels[place.source]
            if isinstance(place.content, Problem):
                self._ignore(place.source, place.content)
            elif label is not None and label.is_receipt:
                self._ignore(place.source, Problem.of(Code.WRITTEN_BY_PLATFORM, platform=label.platform))
            elif label is not None and label.file and place.file:
                loose[label.platform, label.people, label.number, label.time].append((place, label))
            elif place.source in classes and are_classes:
                self._explore(place.source, classes[place.source], depth + 1)
            elif any(self._roster.is_given or platforms_of(inside.name) for inside in classes.get(place.source, ())):
                self._ignore(place.source, Problem.of(Code.SEVERAL_HAND_INS))
            elif place.is_store:
                self._take(place, label)
            elif is_notebook(place.name):
                loose_notebook = owners.nobody(Problem.of(Code.LOOSE_NOTEBOOK))
                self._take(_together({place.name: place}), label, loose_notebook)
            elif archives.is_other_archive(place.name):
                self._take(place, label)
            else:
                self._ignore(place.source, _NO_FOLDER_NO_ZIP)
        for files in loose.values():
            self._take_loose(files)

    def _classes(self, places: Sequence[Place], depth: int) -> dict[str, list[Place]]:
        """Return path → content of the folders and archives that hold what looks like a class's submissions.

        A name on the roster is a student's; too deep in other folders, nothing is looked into.
        """
        classes: dict[str, list[Place]] = {}
        for place in places if depth < MAX_CLASS_DEPTH else ():
            if place.is_store and not self._roster.by_name(place.stem).is_certain:
                self._shelf.begin_student()
                inside = place.children(self._shelf)
                if self._is_class(inside, depth):
                    classes[place.source] = inside
        return classes

    def _is_class(self, places: Sequence[Place], depth: int) -> bool:
        """Return whether what lies in a folder or an archive are the submissions of a class, and not one student's."""
        places = [place for place in places if not isinstance(place.content, Problem)]
        if any(is_work(place.name) and not (place.is_store or platforms_of(place.name)) for place in places):
            return False
        if any(map(self._is_a_students, places)):
            return True
        stores = [place for place in places if place.is_store]
        is_wrapped = len(stores) == 1 and not stores[0].file and depth + 1 < MAX_CLASS_DEPTH
        return is_wrapped and self._is_class(stores[0].children(self._shelf), depth + 1)

    def _is_a_students(self, place: Place) -> bool:
        """Return whether a place has the name of a student, or one that a platform gave.

        Without a roster, the course.json in it must name the student, too.
        """
        if platforms_of(place.name) and (place.is_store or is_notebook(place.name)):
            return True
        owner = self._roster.by_name(place.stem)
        if self._roster.is_given or not (place.is_store and owner.students):
            return place.is_store and owner.is_certain
        self._shelf.begin_student()
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
        received: tuple[datetime | None, str] = (None, ""),
    ) -> None:
        """Take what one student handed in, and determine its owner by name.

        Parameters
        ----------
        place : the folder, the archive, or the loose files
        label : what its name says if a platform gave it
        owner : owner of what has no name of a student
        name : name that says who handed it in, if not the place's
        received : when a platform received loose files, and how that is known
        """
        self._shelf.begin_student()
        self._archives_left = MAX_INNER_ARCHIVES
        archived, clock = self._time_of(place, label) if place.file else received
        whole = Piece(
            source=place.source,
            name=name or place.stem,
            outer=name or place.name,
            label=label,
            archived=archived,
            clock=clock,
        )
        try:
            pieces = self._split(whole, place)
        except Unreadable as error:
            pieces = [replace(whole, trouble=(error.problem,))]
        if label and label.platform and archived is None and isinstance(place.content, Listing):
            known = [self._time_of(Place(path, file), label) for path, file in place.content.files.items()]
            when, clock = max((one for one in known if one[0]), default=(None, ""))  # the platform wrote them there
            pieces = [replace(one, archived=when, clock=clock) if one.source == place.source else one for one in pieces]
        owner = self._roster.by_label(label) if label else owner
        for piece in pieces:
            by_name = owner or self._roster.by_name(piece.name, student_in(piece.course))
            self._pieces.append(replace(piece, owner=by_name))

    def _time_of(self, place: Place, label: Label | None) -> tuple[datetime | None, str]:
        """Return when a file was received (UTC), and how that is known: by the grader's disk or a platform's archive.

        Return (None, "") for a folder, for a file without a time, and for one in an archive that may be a student's.

        Parameters
        ----------
        place : the file
        label : what its name says if a platform gave it
        """
        if place.file is None or place.file.modified is None:
            return None, ""
        if isinstance(place.file.store, Path):
            return place.file.modified, ON_DISK
        is_platforms = self._is_given_zip or (label is not None and label.platform)
        return (place.file.modified, "the time in the archive of the class") if is_platforms else (None, "")

    def _take_loose(self, files: Sequence[tuple[Place, Label]]) -> None:
        """Take the files of one student that lie side by side, with names that a platform gave.

        Each archive is taken by itself, the other files together. Of equal names, that of the newest attempt counts.
        """
        newest_first = sorted(files, key=lambda file: -file[1].attempt)
        loose: dict[str, Place] = {}
        for place, label in newest_first:
            if place.is_store:
                self._take(place, label)
            elif label.file in loose:
                self._ignore(place.source, Problem.of(Code.NEWER_OF_SAME_NAME))
            else:
                loose[label.file] = place
        if loose:
            latest = newest_first[0][1]
            if latest.platform == platforms.CANVAS:
                loose |= platforms.without_canvas_counts(loose)
            name = min(place.name for place in loose.values())
            times = [known for place in loose.values() if (known := self._time_of(place, latest))[0]]
            self._take(_together(loose), latest, name=name, received=max(times, default=(None, "")))

    def _split(self, whole: Piece, place: Place, nesting: int = 0) -> list[Piece]:
        """Look into a place, and split it into pieces: the rest, then each archive with work in it, however deep.

        There is no rest if all files are in such archives.

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
                refused[path] = error.problem
                del files[path]
                continue
            if any(is_work(name) for piece in inside for name in piece.files):
                pieces += inside
                del files[path]
        if pieces and not files:
            return [replace(pieces[0], refused={**pieces[0].refused, **refused}), *pieces[1:]]
        trouble: list[Problem] = []
        if not pieces and not any(map(is_work, files)):
            broken = filter(archives.is_archive, refused)
            trouble += [Problem.of(Code.ARCHIVE_UNREAD, path, why=refused[path]) for path in broken]
            if packed := [*filter(archives.is_other_archive, files)]:
                trouble.append(Problem.of(Code.PACKED_ARCHIVES, **named(packed)))
        course = self._course(files)
        rest = replace(whole, source=place.source, files=files, refused=refused, trouble=tuple(trouble), course=course)
        return [rest, *pieces]

    def _inside(self, whole: Piece, place: Place, nesting: int) -> list[Piece]:
        """Return the pieces of an archive within a submission; parameters as for :meth:`_split`."""
        if nesting == MAX_NESTING or not self._archives_left:
            raise Unreadable(Code.TOO_MANY_ARCHIVES, most=MAX_INNER_ARCHIVES, nested=MAX_NESTING)
        self._archives_left -= 1
        if whole.archived is None and whole.label and not (nesting or archives.is_archive(whole.outer)):
            # The platform wrote it into its folder.
            archived, clock = self._time_of(place, whole.label)
            whole = replace(whole, archived=archived, clock=clock)
        copy = platforms.without_copy_number(place.stem)
        whole = replace(whole, copy=max(whole.copy, copy[1] if copy else 0))
        return self._split(whole, place, nesting + 1)

    def _course(self, files: Mapping[str, StoredFile]) -> dict[str, Any]:
        """Read the course.json with the fewest folders above it; return {} if there is none or it cannot be read."""
        paths = [path for path in files if path.rpartition("/")[2] == COURSE_FILE]
        try:
            path = min(paths, key=lambda path: (path.count("/"), path))
            return owners.course_data(self._shelf.read(files[path], MAX_COURSE_FILE))
        except (ValueError, Unreadable):  # there is none, or it cannot be read
            return {}

    # --- their owners and times ---------------------------------------------------------------------------------------

    def submissions(self, earlier: Callable[[str], Collection[str] | None]) -> list[Submission]:
        """Return one submission for each student, by ID; none while the platform of a download is not decided.

        Parameters
        ----------
        earlier : as for :func:`find`
        """
        if self.is_undecided:
            return []
        self._pieces = [*owners.told_apart(self._pieces, self._roster)]
        owned = [replace(piece, owner=self._owner(piece)) for piece in self._pieces]
        self.read |= {piece.source for piece in owned} | {name for piece in owned for name in piece.owner.students}
        pieces = [self._with_time(piece) for piece in owned if piece.owner.students]
        resolved = owners.resolve_partners(
            [piece.owner for piece in pieces], self._roster, earlier, self._decided_partner
        )
        pieces = [replace(piece, owner=owner) for piece, owner in zip(pieces, resolved, strict=True)]
        for student, partner in [(owner.students[0], name) for owner in resolved for name in owner.waiting]:
            why = Problem.of(Code.ONLY_THEIR_COURSE_FILE, student=student)
            self.doubts.append(Doubt(student, PARTNER, "", (why,), partner))
        students = {student for owner in resolved for student in (*owner.students, *owner.claimed)}
        return [_submission(student, pieces) for student in sorted(students, key=caseless)]

    def _decided_partner(self, student: str, partner: str) -> bool | None:
        """Return whether two students are partners as the instructor decided; None without a decision."""
        for one, other in ((student, partner), (partner, student)):
            decision = caseless(self._decisions.get(Doubt(one, PARTNER, "", (), other).key, ""))
            if decision in (YES, NO):
                return decision == YES
            if decision:
                self._invalid.append(Problem.of(Code.DECISION_ON_PARTNER_UNCLEAR, one, partner=other))
        return None

    def _owner(self, piece: Piece) -> Owner:
        """Determine the owner of a piece, and note that the piece is ignored if it has none.

        Add a row to intake.csv if the owner has a problem, is not on the roster, or was decided by the instructor. A
        valid decision replaces the owner; an invalid one is noted, and is no reason for a row by itself.
        """
        holds_work = any(map(is_work, piece.files))
        owner = owners.owner_of(piece.name, piece.owner, piece.course, self._roster, holds_work)
        unlisted = any(self._roster.known(student) is None for student in owner.students)
        decision, decided = "", None
        if owner.problems or unlisted or piece.source in self._with_owner:
            assumed, instead = " ".join(owner.students), student_in(piece.course)[:LONGEST]
            why = owner.problems + owner.notes
            doubt = Doubt(piece.source, OWNER, assumed, why, instead, self._content(piece))
            decision = doubt.decided(self._decisions)
            decided = self._roster.known(decision) if decision else None
            if not (owner.students or decision) and self._erased(instead):
                return Owner((instead,), bench_of=instead)  # so that nobody is asked about them
            if owner.problems or unlisted or decided:
                self.doubts.append(doubt)
            if caseless(decision) == NOBODY and not decided:
                return owners.nobody()
        if decided:
            return Owner((decided,), bench_of=decided, is_decided=True)
        if decision:
            self._invalid.append(Problem.of(Code.DECIDED_OWNER_UNKNOWN, piece.source, owner=decision))
        if not owner.students:
            self._ignore(piece.source, *piece.trouble, *owner.problems, Problem.of(Code.OWNER_TO_BE_GIVEN))
        return owner

    def _content(self, piece: Piece) -> str:
        """Return a name for what a piece holds; for one that cannot be opened, a name for when it was received."""
        self._shelf.begin_student()
        return content_name(self._shelf.held(piece.files) if piece.files else [f"{piece.archived}".encode()])

    def _with_time(self, piece: Piece) -> Piece:
        """Return a piece with its time of receipt; add a row for the instructor if only files say it, or it is decided.

        The row's key has the time when the files were saved, so a decision does not hold for files that were saved
        later.
        """
        times = filter(None, (entry.modified for entry in piece.files.values()))
        saved = min(max(times, default=piece.archived or NEVER), clock.now())
        when_saved = f"saved {saved:%Y-%m-%d %H:%M:%S} UTC"
        doubt = Doubt(piece.source, TIME_RECEIVED, "", (Problem.of(Code.ONLY_THEIR_COMPUTER),), when_saved)
        received, evidence = self._time_received(piece, doubt.decided(self._decisions))
        if evidence == DECIDED:
            why = (Problem.of(Code.DECIDED),)
            self.doubts.append(replace(doubt, assumed=f"{received:%Y-%m-%d %H:%M} UTC", why=why))
        elif not evidence and piece.files:
            self.doubts.append(doubt)
        return replace(piece, received=received or saved, clock=evidence, saved=saved)

    def _time_received(self, piece: Piece, decided: str) -> tuple[datetime | None, str]:
        """Return the time of receipt, and how it is known; None and "" if only files say when they were saved.

        Parameters
        ----------
        piece : with its owner
        decided : the instructor's decision; "" without one
        """
        label = piece.label
        if decided:
            if (time := platforms.parse_time(decided, self._zone)) is not None:
                return time, DECIDED
            self._invalid.append(Problem.of(Code.DECIDED_TIME_UNCLEAR, piece.source, time=decided))
        if label is not None and label.time is not None:
            return in_utc(label.time, self._zone), "the time in its name"
        names = [piece.outer, piece.name, *piece.owner.students]
        if label is not None:
            its = [
                name for name in (*label.people, label.number) if self._roster.lookup(name) & {*piece.owner.students}
            ]
            names += [*its, f"Participant {label.number}"]
        if times := [self._times[caseless(name)] for name in names if caseless(name) in self._times]:
            return times[0], "the list of times"
        return piece.archived, piece.clock

    # --- what is not read ---------------------------------------------------------------------------------------------

    def _ignore(self, source: str, *why: Problem) -> None:
        """Note that what lies at a path is not read, and why."""
        self._ignored[why].append(source)

    def ignored(self) -> list[Problem]:
        """Return a problem for each reason why something is not read, and for each decision that cannot be followed.

        A problem has the paths of all that is not read for its reason: whoever grades has to look at all of them.
        """
        return [
            *(Problem(Code.IGNORED, "", {"files": files, "why": [*why]}) for why, files in self._ignored.items()),
            *self._invalid,
        ]


def _may_be_submission(place: Place) -> bool:
    """Return whether a place may be a submission that no platform named: a folder, an archive or a notebook."""
    return place.is_store or is_notebook(place.name) or archives.is_other_archive(place.name)


def _submission(student: str, pieces: Iterable[Piece]) -> Submission:
    """Return the submission of a student, with all pieces that belong to them."""
    pieces = [piece for piece in pieces if student in (*piece.owner.students, *piece.owner.claimed)]
    own = [piece for piece in pieces if student in piece.owner.everybody]
    own.sort(key=lambda piece: (piece.received, max(piece.owner.attempt, piece.copy), piece.saved))
    claimed_by = own[-1].owner.students[0] if own and all(student not in piece.owner.students for piece in own) else ""
    problems = dict.fromkeys(problem for piece in own for problem in piece.owner.problems)
    notes = dict.fromkeys(note for piece in own for note in piece.owner.notes)
    if claimed_by:
        notes[Problem.of(Code.HANDED_IN_BY_PARTNER, partner=claimed_by)] = None
    for piece in pieces:
        if student in piece.owner.declined:
            notes[Problem.of(Code.DECLINED_AS_PARTNER, owners=piece.owner.students, student=student)] = None
    together = {partner for piece in own for partner in piece.owner.everybody}
    return Submission(
        student=student,
        problems=[*problems],
        notes=[*notes],
        pieces=tuple(own),
        bench_of=own[-1].owner.bench_of if own else "",
        partners=tuple(sorted(together - {student}, key=caseless)),
        unconfirmed=tuple(piece for piece in pieces if student in piece.owner.waiting),
    )
