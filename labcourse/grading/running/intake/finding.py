"""What is in a class's folder: the hand-ins of each student, however a platform packed and named them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any

from labcourse import program, student_id
from labcourse.errors import GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.gradebook.records import DECIDED, StudentRecord
from labcourse.grading.running.intake import labels, limits, names, places, whose
from labcourse.grading.running.intake.decisions import OWNER, TIME, Decisions, Doubt
from labcourse.grading.running.intake.hand_ins import Found, Piece, Submission
from labcourse.grading.running.intake.labels import Label
from labcourse.grading.running.intake.notebook_names import is_notebook
from labcourse.grading.running.intake.people import Match, People
from labcourse.grading.running.intake.places import Child, Place
from labcourse.grading.running.intake.stores import Entry, Listing, Shelf, Unreadable, Where
from labcourse.grading.running.intake.times import folded, in_utc, parsed
from labcourse.messages import listed
from labcourse.student_id import caseless


@dataclass
class _Raw:
    """A piece that has no owner and no time yet. ``archived``: when the archive among the submissions was written."""

    name: str
    place: Place
    match: Match
    label: Label | None
    files: Mapping[str, Entry] = field(default_factory=dict)
    trouble: str = ""
    archived: datetime | None = None


def find(
    folder: Path,
    roster: Sequence[StudentRecord] = (),
    times: Mapping[str, datetime] | None = None,
    zone: tzinfo = UTC,
    earlier: Callable[[str], Collection[str] | None] = whose.nobody_earlier,
    decisions: Decisions | None = None,
) -> Found:
    """What is in a class's folder, or in a zip of it.

    Parameters
    ----------
    folder : holds a folder, a zip or loose files for each student
    roster : by which the names that platforms give are told
    times : name of what lies there, or a student's ID or name → when it was handed in, from :func:`.times.read`
    zone : of times in names and in zips, which do not say theirs
    earlier : whom a student named who handed in before; None for one who did not
    decisions : owners and times, by the instructor

    Raises
    ------
    GradingError
        If there is no such folder, or no submission in it.
    """
    if not (folder.is_dir() or folder.is_file()):
        raise GradingError(f"There is no folder {folder}.")
    with Shelf() as shelf:
        explorer = _Explorer(People(roster), times or {}, zone, shelf, decisions or {})
        try:
            explorer.start(folder)
        except Unreadable as error:
            raise GradingError(f"{folder} cannot be read: {error}") from None
        submissions = explorer.submissions(earlier)
    ignored = [*explorer.ignored(), *explorer.wrong]
    if not submissions:
        nothing = "There are no submissions in {folder}: it should hold a folder or a zip for each student."
        raise GradingError(" ".join([nothing.format(folder=folder), *ignored]))
    return Found(submissions, ignored, explorer.doubts)


class _Explorer:
    """Goes through folders and zips around those of the students."""

    def __init__(
        self, people: People, times: Mapping[str, datetime], zone: tzinfo, shelf: Shelf, decisions: Decisions
    ) -> None:
        self.doubts: list[Doubt] = []
        self.wrong: list[str] = []  # decisions that cannot be followed
        self._decisions = decisions
        self._people = people
        self._times = folded(times)
        self._zone = zone
        self._shelf = shelf
        self._raws: list[_Raw] = []
        self._inner_left = 0  # zips within the hand-in that is looked at, that may still be looked into
        self._told: dict[str, list[str]] = {}

    # --- where hand-ins are -------------------------------------------------------------------------------------------

    def start(self, folder: Path) -> None:
        """Look at the class's folder or zip."""
        if folder.is_dir():
            within = list(places.on_disk(folder))
            if self._is_one_hand_in(within):
                self._take(Child(folder.name, folder.name, Where(folder)), Match())
            else:
                self._explore(within, 0)
            return
        whole = next(child for child in places.on_disk(folder.parent) if child.where.path / folder.name == folder)
        self._explore([replace(whole, source=folder.name)], 0)

    def _explore(self, within: Sequence[Child], depth: int) -> None:
        within = [child for child in within if not names.is_hidden(child.name)]
        siblings = [child.stem for child in within]
        loose: dict[tuple[object, ...], list[tuple[Child, Label]]] = {}
        for child in within:
            label = labels.read(child.stem if child.is_folder else child.name)
            if label is None and child.entry is not None and is_notebook(child.name):
                label = self._people.beginning(child.name)
            if child.why_not:
                self._ignore(child.source, child.why_not)
            elif label is not None and label.own:
                self._ignore(child.source, f"{label.platform} itself wrote it.")
            elif child.is_folder:
                self._look_into(child, label, siblings, depth)
            elif label is None or not label.rest:
                self._file(child, label, siblings, depth)
            else:
                loose.setdefault((label.platform, label.people, label.number, label.time), []).append((child, label))
        for files in loose.values():
            self._take_loose(files)

    def _file(self, child: Child, label: Label | None, siblings: Sequence[str], depth: int) -> None:
        """A file that is of no platform's form."""
        if child.is_archive:
            self._look_into(child, label, siblings, depth)
            return
        if is_notebook(child.name):
            why = "it does not say who handed it in. Put it into a folder that is named by the student's ID."
            assert child.entry is not None
            place = Place(child.source, child.where, Listing({child.name: child.entry}))
            self._raws.append(_Raw(child.name, place, Match(why_not=why), label, place.listing.files))
            return
        if child.name.casefold().endswith(places.OTHER_ARCHIVES):
            why = "it is packed in a way that is not read. Unpack it, or ask for an ordinary zip."
            stem = places.without_ending(child.name)
            match = self._people.named(stem, siblings) if label is None else self._people.labelled(label)
            if match.students:  # it is theirs, and they are to read why nothing of it counts
                self._take_unread(child, match, label, why)
                return
        else:
            why = "it is neither a folder nor a zip."
        self._ignore(child.source, why)

    def _look_into(self, child: Child, label: Label | None, siblings: Sequence[str], depth: int) -> None:
        """A folder or a zip: one student's, or a class's."""
        match = self._people.named(child.stem, siblings) if label is None else self._people.labelled(label)
        certain = match.certain or label is not None
        if not certain and depth < limits.MAX_CLASS_DEPTH:
            try:
                place = child.look(whole_class=True)
                within = list(places.children(place))
            except Unreadable:
                within = []  # and why is told when it is read as a student's
            if self._is_class(within, depth):
                # Anybody can put folders with others' names into a zip: without a roster, which knows that the name of
                # the zip is nobody's, it is believed of what lies alone.
                if self._people or len(siblings) == 1:
                    self._explore(within, depth + 1)
                    return
                if any(labels.read(one.name) for one in within):
                    why = f"it holds the hand-ins of several. Unpack it, or take in a roster ({program.name()} roster)."
                    self._ignore(child.source, why)
                    return
        self._take(child, match, label)

    def _is_one_hand_in(self, within: Sequence[Child]) -> bool:
        """Whether what lies together is one student's, and not a class's."""
        there = [child.name for child in within if child.entry is not None]
        return (
            COURSE_FILE in there and any(map(is_notebook, there)) and not any(labels.read(one.name) for one in within)
        )

    def _is_class(self, within: Sequence[Child], depth: int) -> bool:
        within = [child for child in within if not (names.is_hidden(child.name) or child.why_not)]
        loose = [child for child in within if child.entry is not None and not child.is_archive]
        if any(places.is_work(child.name) and labels.read(child.name) is None for child in loose):
            return False
        if any(map(self._is_surely_somebodys, within)):
            return True
        folders = [child for child in within if child.is_folder]
        if len(folders) != 1 or depth + 1 >= limits.MAX_CLASS_DEPTH or any(child.is_archive for child in within):
            return False
        try:
            return self._is_class(list(places.children(folders[0].look(whole_class=True))), depth + 1)
        except Unreadable:
            return False

    def _is_surely_somebodys(self, child: Child) -> bool:
        label = labels.read(child.name)
        if label is not None:
            usual = child.is_folder or child.is_archive or places.is_work(label.rest)
            return usual or bool(self._people.labelled(label).students)
        if child.entry is not None and not child.is_archive:
            return False
        match = self._people.named(child.stem)
        if self._people or not match.students:
            return match.certain
        try:
            says = places.course_file(child.look(), self._shelf).get("student")
        except Unreadable:
            return False
        return isinstance(says, str) and caseless(says) in {caseless(one) for one in match.students}

    # --- what they hold -----------------------------------------------------------------------------------------------

    def _take(self, child: Child, match: Match, label: Label | None = None) -> None:
        """A folder or a zip of one student."""
        try:
            place = child.look()
        except Unreadable as error:
            self._take_unread(child, match, label, str(error))
        else:
            self._inner_left = limits.MAX_INNER_ARCHIVES
            self._raws += self._pieces(child.name, place, match, label, self._archived(child))

    def _take_unread(self, child: Child, match: Match, label: Label | None, why: str) -> None:
        empty = Place(child.source, child.where, Listing())
        self._raws.append(_Raw(child.name, empty, match, label, trouble=why, archived=self._archived(child)))

    def _archived(self, child: Child) -> datetime | None:
        """Return when an archive was written among the submissions; None for a folder."""
        return self._utc(child.entry.modified) if child.entry is not None else None

    def _take_loose(self, files: Sequence[tuple[Child, Label]]) -> None:
        """Files of one student that a platform named, side by side."""
        latest = max(files, key=lambda one: one[1].attempt)[1]
        match = self._people.labelled(latest)
        together: dict[str, Entry] = {}
        loose: list[Child] = []
        for child, label in sorted(files, key=lambda one: -one[1].attempt):
            assert child.entry is not None
            if child.is_archive:
                self._take(child, match, label)
            elif label.rest in together:
                self._ignore(child.source, "there is a newer one of the same name.")
            else:
                together[label.rest] = child.entry
                loose.append(child)
        if not loose:
            return
        if latest.platform == labels.CANVAS:
            together |= labels.before_canvas(together)
        first = min(loose, key=lambda child: child.source)
        source = listed(sorted(child.source for child in loose), 1)
        place = Place(source, first.where, Listing(together))
        self._raws += self._pieces(first.name, place, match, latest)

    def _pieces(
        self,
        name: str,
        place: Place,
        match: Match,
        label: Label | None,
        archived: datetime | None = None,
        nesting: int = 0,
    ) -> list[_Raw]:
        """What of a place was handed in at one time: the zips with notebooks in it, and the rest."""
        files = dict(place.listing.files)
        found: list[_Raw] = []
        broken = []
        for path in [path for path in files if places.is_archive(path) and not names.is_hidden(path)]:
            if nesting == limits.MAX_NESTING or not self._inner_left:
                break
            self._inner_left -= 1
            entry = files[path]
            try:
                inner = Child(path, f"{place.source}/{path}", place.where, entry).look()
            except Unreadable as error:
                broken.append(f"{names.shown(path)} cannot be read: {error}")
                continue
            # In a folder that a platform named, the platform wrote the archive, too.
            written = archived if archived is not None or label is None or nesting else self._utc(entry.modified)
            within = self._pieces(name, inner, self._counted(match, path), label, written, nesting + 1)
            if any(places.is_work(one) for raw in within for one in raw.files):
                found += within
                del files[path]
        if found and not any(not names.is_hidden(path) for path in files):
            return found
        packed = [path for path in files if path.casefold().endswith(places.OTHER_ARCHIVES)]
        trouble = ""
        if not found and not any(map(places.is_work, files)):
            trouble = " ".join(broken)
            if packed:
                trouble += f"{names.listed(packed)}: packed in a way that is not read; hand in an ordinary zip."
        return [_Raw(name, place, match, label, files, trouble, archived), *found]

    @staticmethod
    def _counted(match: Match, path: str) -> Match:
        """An owner, with the number in the name of a zip of several."""
        repeated = labels.again(places.without_ending(path.rpartition("/")[2]))
        return replace(match, attempt=max(match.attempt, repeated[1] if repeated else 0))

    # --- whose they are, and when they came ---------------------------------------------------------------------------

    def submissions(self, earlier: Callable[[str], Collection[str] | None]) -> list[Submission]:
        """One for each student."""
        taken: list[tuple[whose.Owners, Piece]] = []
        what_to_do = (
            f"Rename it to the student's ID, put the student on the roster ({program.name()} roster), or write the ID "
            "into intake.csv."
        )
        known = [raw.match for raw in self._raws if raw.match.certain or not self._people]
        present = {one for match in known for one in match.students}
        for place, raw in enumerate(self._raws):
            course = self._course_file(raw)
            holds_work = any(map(places.is_work, raw.files))
            owners = whose.owners(raw.name, raw.match, course, self._people, holds_work, present)
            decided = self._decided_owner(raw.place.source)
            unlisted = any(self._people.known(one) is None for one in owners.students)
            if owners.problems or owners.why_not or unlisted or decided:
                why = " ".join((*owners.problems, *owners.notes, owners.why_not)).strip()
                says = str(course.get("student") or "")[: student_id.LONGEST]
                self.doubts.append(Doubt(raw.place.source, OWNER, " ".join(owners.students), why, says))
            owners = decided or owners
            if owners.students:
                taken.append((owners, self._piece(raw, owners, course, place)))
            else:
                self._ignore(raw.place.source, f"{owners.why_not} {what_to_do}")
        agreed = whose.agreed([owners for owners, _piece in taken], earlier)
        pieces = [(owners, piece) for owners, (_before, piece) in zip(agreed, taken, strict=True)]
        return [_submission(student, pieces) for student in whose.of_each(agreed)]

    def _decided_owner(self, source: str) -> whose.Owners | None:
        """Return the owner that the instructor decided; None without a decision, or if it cannot be followed."""
        given = self._decisions.get((source, OWNER))
        if not given:
            return None
        student = self._people.known(given)
        if student is None:
            self.wrong.append(f"intake.csv: {names.shown(given)}, the owner of {names.shown(source)}, is unknown.")
            return None
        return whose.Owners((student,), (), student, DECIDED)

    def _course_file(self, raw: _Raw) -> dict[str, Any]:
        return places.course_file(replace(raw.place, listing=Listing(raw.files)), self._shelf)

    def _piece(self, raw: _Raw, owners: whose.Owners, course: Mapping[str, Any], place: int) -> Piece:
        saved = self._saved(raw)
        received, clock = self._received(raw, owners, saved)
        if clock == DECIDED:
            self.doubts.append(self._doubt_of_time(raw, saved, f"{received:%Y-%m-%d %H:%M} UTC", clock))
        elif not clock and raw.files:
            why = "only the student's computer says when it was saved"
            self.doubts.append(self._doubt_of_time(raw, saved, "", why))
        attempt = max(owners.attempt, raw.label.attempt if raw.label and raw.label.rest else 0)
        return Piece(
            source=raw.place.source,
            where=raw.place.where,
            files=raw.files,
            received=received,
            clock=clock,
            rule=owners.rule,
            others=raw.place.listing.others,
            order=(attempt, saved, place),
            course=course,
            trouble=raw.trouble,
        )

    def _doubt_of_time(self, raw: _Raw, saved: datetime, assumed: str = "", why: str = "") -> Doubt:
        doubt = Doubt(raw.place.source, TIME, assumed, why, f"saved {saved:%Y-%m-%d %H:%M:%S} UTC")
        # A row that an instructor wrote holds for whatever was saved.
        return replace(doubt, alternatives="") if (raw.place.source, TIME) in self._decisions else doubt

    def _received(self, raw: _Raw, owners: whose.Owners, saved: datetime) -> tuple[datetime, str]:
        decided = self._decisions.get(self._doubt_of_time(raw, saved).key)
        if decided:
            if (time := parsed(decided, self._zone)) is not None:
                return time, DECIDED
            self.wrong.append(f"intake.csv: {names.shown(decided)} is not a time; write it as 2026-11-21 13:05.")
        if raw.label is not None and raw.label.time is not None:
            return in_utc(raw.label.time, self._zone), "the time in its name"
        given = [raw.name, places.without_ending(raw.name), *owners.students]
        if raw.label is not None:
            given += [*raw.label.people, raw.label.number, f"Participant {raw.label.number}"]
        listed_time = next((self._times[caseless(one)] for one in given if caseless(one) in self._times), None)
        if listed_time is not None:
            return listed_time, "the list of times"
        if raw.archived is not None:
            return raw.archived, "the time of the archive among the submissions"
        return saved, ""

    def _saved(self, raw: _Raw) -> datetime:
        """When the newest of its files was saved, by the clock of whoever wrote it."""
        saved = max(filter(None, (self._utc(entry.modified) for entry in raw.files.values())), default=None)
        return min(saved or raw.archived or datetime.fromtimestamp(0, UTC), datetime.now(UTC))

    def _utc(self, time: datetime | None) -> datetime | None:
        return None if time is None else in_utc(time, self._zone)

    # --- what is told -------------------------------------------------------------------------------------------------

    def _ignore(self, source: str, why: str) -> None:
        self._told.setdefault(why, []).append(source)

    def ignored(self) -> list[str]:
        """A sentence for each reason, naming what it is about."""
        return [
            f"{', '.join(map(names.shown, sources))}: not read: {why}"
            if len(sources) > 1
            else f"{names.shown(sources[0])} is not read: {why}"
            for why, sources in self._told.items()
        ]


def _submission(student: str, pieces: Iterable[tuple[whose.Owners, Piece]]) -> Submission:
    """A student's, of all pieces."""
    folded = caseless(student)
    own = [
        (owners, piece)
        for owners, piece in pieces
        if folded in {caseless(one) for one in (*owners.students, *owners.claimed)}
    ]
    own.sort(key=lambda one: one[1].when)
    newest = own[-1][0]
    claimed = all(folded not in {caseless(one) for one in owners.students} for owners, _piece in own)
    notes = dict.fromkeys(note for owners, _piece in own for note in owners.notes)
    if claimed:
        told = "Handed in by {other}, whose {course_file} says that it was made together."
        notes[told.format(other=newest.students[0], course_file=COURSE_FILE)] = None
    together = {caseless(one): one for owners, _piece in own for one in (*owners.students, *owners.claimed)}
    return Submission(
        student=student,
        pieces=tuple(piece for _owners, piece in own),
        bench_of=newest.bench_of,
        partners=tuple(one for key, one in sorted(together.items()) if key != folded),
        claimed_by=newest.students[0] if claimed else "",
        problems=tuple(dict.fromkeys(problem for owners, _piece in own for problem in owners.problems)),
        notes=tuple(notes),
    )
