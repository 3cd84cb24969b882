"""What is in a student's hand-in: the cells of the course's notebooks, own files, and what was recorded at home."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import PurePosixPath
from typing import Any

import labcourse
from labcourse import course_file
from labcourse.answers import answers, notebooks, own_files, report_files
from labcourse.answers.notebooks import Cell, Notebook, NotebookError
from labcourse.errors import ConfigurationError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.gradebook.records import DECIDED
from labcourse.grading.running.intake import limits, names, notebook_names, places, scripts
from labcourse.grading.running.intake.decisions import Decisions, Doubt
from labcourse.grading.running.intake.delivered import Item
from labcourse.grading.running.intake.hand_ins import Piece, Submission
from labcourse.grading.running.intake.notebook_names import Fit
from labcourse.grading.running.intake.stores import Entry, Store, Unreadable, opened
from labcourse.grading.running.intake.times import in_utc
from labcourse.run.alignment import source_of
from labcourse.run.portability import Version, version

_UNREAD = "{name} cannot be read: {error}"
_MOST_SHOWN = 5  # files that are named in a message
_MOST_COMPARED = 10  # files that may be the same notebook
_SAME_TIME = timedelta(seconds=2)  # to which a zip rounds
#: Of each notebook, its cells by their ids.
Masters = Mapping[str, Mapping[str, Mapping[str, Any]]]


@dataclass
class Delivered:
    """What was read of one piece of a submission.

    Attributes
    ----------
    piece : as it was found
    notebooks : notebook's file name → its cells
    files : own file's path from the notebooks' folder → its content
    reports : file name of a report's PDF → its content
    claim : the student's answers.json
    course_file : their course.json
    unreadable : why all of it could not be read; "" where it could
    unread : file of the course → why it could not be read
    problems : what else could not be read as it should
    notes : what a student or an instructor may want to know
    doubts : what an instructor may decide otherwise
    pythons : the Python that each notebook was saved with; None where one does not say it
    """

    piece: Piece
    notebooks: dict[str, tuple[Cell, ...]] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    reports: dict[str, bytes] = field(default_factory=dict)
    claim: bytes | None = None
    course_file: bytes | None = None
    unreadable: str = ""
    unread: dict[str, str] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    doubts: list[Doubt] = field(default_factory=list)
    pythons: list[Version | None] = field(default_factory=list)

    @property
    def received(self) -> datetime:
        """When it was handed in, UTC."""
        return self.piece.received

    @property
    def source(self) -> str:
        """What it came in, for people."""
        return self.piece.source

    def items(self) -> list[Item]:
        """All of it as plain bytes, from which :func:`.delivered.newest` makes the same again."""
        content = {name: notebooks.to_bytes(cells) for name, cells in self.notebooks.items()}
        content |= self.files | self.reports
        for name, data in ((ANSWERS_FILE, self.claim), (COURSE_FILE, self.course_file)):
            if data is not None:
                content[name] = data
        return [Item(name, data, self.received, self.source, self.piece.clock) for name, data in content.items()]


def read(
    submission: Submission,
    wanted: Sequence[str],
    masters: Masters | None = None,
    packages: Collection[str] = (labcourse.__name__,),
    reports: Sequence[str] = (),
    decisions: Decisions | None = None,
) -> list[Delivered]:
    """Read a submission's pieces, in order of time. Whatever one of them is, the others are read.

    Parameters
    ----------
    submission : as found
    wanted : file names of the course's notebooks
    masters : the cells of each of these, by which a notebook of another name is recognised
    packages : names of the course's packages, which are not own files
    reports : file names of the course's reports, as PDF
    decisions : which of several files counts, by the instructor
    """
    found, bounded = [], _Bounded()
    for piece in submission.pieces:
        delivered = Delivered(piece)
        found.append(delivered)
        if piece.trouble:
            delivered.unreadable = _unreadable(piece, piece.trouble)
        if not piece.files:
            continue
        try:
            with ExitStack() as stack:
                store = stack.enter_context(opened(piece.where))
                _Reader(delivered, store, wanted, masters or {}, packages, reports, decisions or {}, bounded).read()
        except Unreadable as error:
            delivered.unreadable = _unreadable(piece, str(error))
    _leave_out_empty(found, masters or {})
    return found


def _written(cells: Iterable[Cell], master: Mapping[str, Mapping[str, Any]]) -> int:
    """Return how many cells a student changed so that they are longer than the course's."""
    released = {name: source_of(cell).strip() for name, cell in master.items()}
    changed = [cell for cell in cells if cell.source.strip() not in released.values()]
    return sum(len(cell.source.strip()) > len(released.get(cell.id, "")) for cell in changed)


def _leave_out_empty(found: Sequence[Delivered], masters: Masters) -> None:
    """Leave a notebook out of which an earlier piece has one with answers, if nothing is written in it."""
    answered: set[str] = set()
    for delivered in found:
        for name in list(delivered.notebooks):
            if name in masters and not _written(delivered.notebooks[name], masters[name]):
                if name in answered:
                    del delivered.notebooks[name]
                    source = names.shown(delivered.source)
                    delivered.notes.append(f"{name} in {source} is empty; the one that was handed in before it counts.")
            else:
                answered.add(name)


def _unreadable(piece: Piece, why: str) -> str:
    return f"The submission cannot be read: {names.shown(piece.source)}: {why}"


def _instead(found: Sequence[Delivered]) -> str:
    """What there is where notebooks should be."""
    held = sorted({name.rpartition("/")[2] for one in found for name in one.piece.files})
    if not held:
        return ""
    listed = ", ".join(map(names.shown, held[:_MOST_SHOWN])) + (", …" if len(held) > _MOST_SHOWN else "")
    return f" It holds {listed}. A notebook's name ends in .ipynb; pages printed of it cannot be run."


def problems(found: Sequence[Delivered], earlier: Collection[str] = ()) -> list[str]:
    """What could not be read as it should, and is not made good by a later piece.

    Parameters
    ----------
    found : all pieces of a submission, in order of time
    earlier : names of what is known from hand-ins before these
    """
    told: list[str] = []
    unread: dict[str, str] = {}
    there = set(earlier)
    for place, delivered in enumerate(found):
        told += delivered.problems
        if delivered.unreadable and not _made_good(found, place):
            told.append(delivered.unreadable)
        unread.update(delivered.unread)
        for item in delivered.items():
            unread.pop(item.name, None)
            there.add(item.name)
    for name, why in unread.items():
        counts = " The one that was handed in before it counts." if name in there else ""
        told.append(_UNREAD.format(name=name, error=why) + counts)
    none = not any(delivered.notebooks for delivered in found)
    if none and not unread and not any(map(notebook_names.is_notebook, earlier)):
        told.append("There is no notebook of the course in the submission." + _instead(found))
    return list(dict.fromkeys(told))


def is_unread(name: str, told: Collection[str]) -> bool:
    """Whether it is among the problems of a run that a file was handed in and could not be read."""
    return any(line.startswith(_UNREAD.format(name=name, error="")) for line in told)


def notes(found: Sequence[Delivered]) -> list[str]:
    """What a student or an instructor may want to know of a submission's pieces, in order of time."""
    told: list[str] = []
    for place, delivered in enumerate(found):
        told += delivered.notes
        if delivered.unreadable and _made_good(found, place):
            told.append(delivered.unreadable)
    return list(dict.fromkeys(told))


def _made_good(found: Sequence[Delivered], place: int) -> bool:
    """Whether a piece that could not be read was followed by one with notebooks."""
    return any(later.notebooks for later in found[place + 1 :])


def _folders(path: str) -> list[str]:
    """The folders that a path lies in."""
    parts = path.split("/")
    return ["/".join(parts[:place]) for place in range(1, len(parts))]


def _depth(folder: str) -> int:
    return len(folder.split("/")) if folder else 0


class _Bounded:
    """Reads one student's files, as long as there are bytes and time left."""

    def __init__(self) -> None:
        self._until = time.monotonic() + limits.MAX_SECONDS
        self._left = limits.MAX_SUBMISSION

    def read(self, store: Store, key: str, most: int) -> bytes:
        """Read a file; raise Unreadable if it is too large, or what came before it was."""
        if time.monotonic() > self._until:
            raise Unreadable(f"reading the files before it took more than {limits.MAX_SECONDS} s.")
        if not self._left:
            raise Unreadable(f"the files before it have {limits.MAX_SUBMISSION} bytes, and no more are read.")
        data = store.read(key, min(most, self._left))
        self._left -= len(data)
        return data


class _Reader:
    """Reads one piece."""

    def __init__(
        self,
        delivered: Delivered,
        store: Store,
        wanted: Sequence[str],
        masters: Masters,
        packages: Collection[str],
        reports: Sequence[str],
        decisions: Decisions,
        bounded: _Bounded,
    ) -> None:
        self._bounded = bounded
        self._decisions = decisions
        self._delivered, self._store, self._wanted = delivered, store, wanted
        self._masters, self._packages, self._reports = masters, packages, reports
        self._files = delivered.piece.files
        self._used: set[str] = set()

    def read(self) -> None:
        """Fill what was delivered."""
        seen = [path for path in self._files if not any(map(names.is_hidden, path.split("/")))]
        fits = notebook_names.fitting(seen, self._wanted)
        base = self._base(fits, seen)
        for name in self._wanted:
            self._notebook(name, sorted(fits.get(name, []), key=lambda one: self._preference(one, base)))
        self._by_their_cells([path for path in seen if path not in self._used], base)
        self._exported(seen, base)
        for name, candidates in notebook_names.fitting(seen, self._reports, notebook_names.is_pdf).items():
            self._report(name, sorted(candidates, key=lambda one: self._preference(one, base)))
        self._delivered.claim = self._of_the_course(seen, ANSWERS_FILE, answers.MAX_BYTES, base)
        self._delivered.course_file = self._of_the_course(seen, COURSE_FILE, limits.MAX_COURSE_FILE, base)
        try:
            course_file.parse(self._delivered.course_file or b"{}")
        except ConfigurationError as error:
            self._note(str(error))
        self._own_files(base)
        self._tell_others()

    def _read(self, key: str, most: int) -> bytes:
        return self._bounded.read(self._store, key, most)

    def _read_notebook(self, path: str) -> tuple[tuple[Cell, ...], list[str]]:
        notebook = Notebook.without_outputs(self._read(self._files[path].key, notebooks.MAX_FILE))
        self._delivered.pythons.append(version(notebook.python))
        return notebook.cells, [*notebook.problems]

    @staticmethod
    def _preference(fit: tuple[Fit, str], base: str) -> tuple[object, ...]:
        """The names that fit best come first; of these, what lies where most notebooks do."""
        quality, path = fit
        return quality.changes, path.rpartition("/")[0] != base, quality

    def _base(self, fits: Mapping[str, Sequence[tuple[Fit, str]]], seen: Sequence[str]) -> str:
        """The folder of most of the course's notebooks; where there are none, of its other files, or the top."""
        found: dict[str, set[str]] = {}
        for name, candidates in fits.items():
            for _fit, path in candidates:
                found.setdefault(path.rpartition("/")[0], set()).add(name)
        if not found:
            others = (path.rpartition("/") for path in seen)
            found = {folder: set() for folder, _slash, name in others if name in (ANSWERS_FILE, COURSE_FILE)}
        return min(found, key=lambda folder: (-len(found[folder]), _depth(folder), folder), default="")

    def _notebook(self, name: str, candidates: Sequence[tuple[Fit, str]]) -> None:
        if candidates:
            self._cells(name, self._best(name, candidates))

    def _best(self, name: str, candidates: Sequence[tuple[Fit, str]]) -> str:
        """Return the path of the file that counts; say which others there are, and if it has another name."""
        self._used.update(path for _fit, path in candidates)
        path = candidates[0][1]
        if len(candidates) > 1:
            path, why = self._chosen(name, [path for _fit, path in candidates])
            rest = [other for _fit, other in candidates if other != path]
            others = names.listed(rest)
            self._note(f"There are {len(candidates)} files {name}; {names.shown(path)} counts, {why}; not {others}.")
            self._delivered.doubts.append(Doubt(self._delivered.source, name, path, why, "; ".join(rest)))
        elif candidates[0][0].changes:
            self._note(f"{names.shown(path)} is taken for {name}.")
        return path

    def _chosen(self, name: str, paths: Sequence[str]) -> tuple[str, str]:
        """Return which of several files counts, and why: the newer, or the fuller of those of one time."""
        decided = self._decisions.get((self._delivered.source, name))
        if decided and decided in paths:
            return decided, DECIDED
        if decided:
            self._delivered.problems.append(f"intake.csv: there is no file {names.shown(decided)} that may be {name}.")
        filled = {path: self._filled(name, path) for path in paths[:_MOST_COMPARED]}
        readable = [path for path in filled if filled[path] >= 0] or paths[:1]
        begun = [path for path in readable if filled[path]] or list(readable)
        known = {path: in_utc(time, UTC) for path in begun if (time := self._files[path].modified)}
        newest = max(known.values(), default=datetime.min.replace(tzinfo=UTC))
        recent = begun if len(known) < len(begun) else [one for one in begun if newest - known[one] <= _SAME_TIME]
        path = max(recent, key=lambda path: filled[path])
        if len(begun) < len(readable):
            why = "as it is not empty"
        elif len(recent) < len(begun):
            why = f"as it is the newest ({known[path]:%Y-%m-%d %H:%M} UTC)"
        elif any(filled[other] != filled[path] for other in recent):
            why = "as more of it is filled in"
        else:
            why = "as its name or folder fits best"
        return path, why

    def _filled(self, name: str, path: str) -> int:
        """Return in how many cells of a notebook a student wrote; -1 if it cannot be read."""
        if not notebook_names.is_notebook(path):
            return 0
        try:
            cells, _left_out = self._read_notebook(path)
        except (Unreadable, NotebookError):
            return -1
        return _written(cells, self._masters.get(name, {}))

    def _report(self, name: str, candidates: Sequence[tuple[Fit, str]]) -> None:
        """A report's PDF: its bytes. Only their beginning and their number are looked at here."""
        path = self._best(name, candidates)
        try:
            data = self._read(self._files[path].key, report_files.MAX_BYTES)
        except Unreadable as error:
            self._delivered.problems.append(_UNREAD.format(name=name, error=error))
            return
        if why := report_files.refusal(data):
            self._delivered.problems.append(_UNREAD.format(name=name, error=f"{why}."))
        else:
            self._delivered.reports[name] = data

    def _cells(self, name: str, path: str) -> None:
        try:
            cells, left_out = self._read_notebook(path)
        except (Unreadable, NotebookError) as error:
            self._delivered.unread[name] = str(error)
        else:
            self._delivered.notebooks[name] = cells
            self._delivered.problems += [f"{name}: {why}" for why in left_out]

    def _by_their_cells(self, paths: Iterable[str], base: str) -> None:
        """Notebooks whose names say nothing."""
        missing = {name: self._masters[name] for name in self._wanted if name in self._masters}
        for name in (*self._delivered.notebooks, *self._delivered.unread):
            missing.pop(name, None)
        strangers = [path for path in paths if notebook_names.is_notebook(path)] if missing else []
        strangers.sort(key=lambda path: (path.rpartition("/")[0] != base, path.count("/"), path))
        for path in strangers[: limits.MAX_STRANGERS]:
            try:
                cells, left_out = self._read_notebook(path)
            except (Unreadable, NotebookError):
                continue
            name = notebook_names.by_cells(cells, self._masters) or ""
            if name in missing:
                del missing[name]
                self._used.add(path)
                self._delivered.notebooks[name] = cells
                self._delivered.problems += [f"{name}: {why}" for why in left_out]
                self._note(f"{names.shown(path)} is taken for {name}, by its cells.")
        unknown = [path for path in strangers if path not in self._used]
        if missing and unknown:
            why = "not recognised as notebooks of the course, by their names or by the course's cells in them."
            self._tell("{files}: {why}", unknown, why)

    def _exported(self, seen: Sequence[str], base: str) -> None:
        """Programs in place of notebooks that are not there, as editors export them."""
        there = {*self._delivered.notebooks, *self._delivered.unread}
        missing = [name for name in self._wanted if name not in there and name in self._masters]
        found = notebook_names.fitting(seen, missing, lambda path: path.casefold().endswith(scripts.ENDING))
        for name, candidates in found.items():
            path = min(candidates, key=lambda one: self._preference(one, base))[1]
            try:
                data = self._read(self._files[path].key, notebooks.MAX_NOTEBOOK)
                cells = scripts.cells_of(data, list(self._masters[name].values()))
            except (Unreadable, NotebookError) as error:
                self._delivered.unread[name] = f"{names.shown(path)}: {error}"
            else:
                self._used.add(path)
                self._delivered.notebooks[name] = cells
                self._note(f"{names.shown(path)} is a program; it is taken for {name}, by the course's cells in it.")
        for name in [name for name in missing if name not in self._delivered.notebooks]:
            stem = name.casefold().removesuffix(notebook_names.ENDING)
            printed = [one for one in seen if PurePosixPath(one.casefold()).stem == stem and one not in self._used]
            if printed and name not in self._delivered.unread:
                self._delivered.unread[name] = f"{names.listed(printed)} is no notebook. Hand in {name}."
        unread = [one for one in seen if one.casefold().endswith(places.OTHER_ARCHIVES) and not places.is_archive(one)]
        if unread and len(there) < len(self._wanted) and not self._delivered.unreadable:
            packed = names.listed(unread)
            self._delivered.problems.append(f"{packed}: packed in a way that is not read; hand it in plain.")

    def _of_the_course(self, seen: Iterable[str], name: str, limit: int, base: str) -> bytes | None:
        paths = [path for path in seen if path.rpartition("/")[2] == name]
        if not paths:
            return None
        path = min(paths, key=lambda path: (path.rpartition("/")[0] != base, path.count("/"), path))
        self._used.update(paths)
        try:
            return self._read(self._files[path].key, limit)
        except Unreadable as error:
            self._note(f"{name} is not read: {error}")
            return None

    def _own_files(self, base: str) -> None:
        """The rest, as far as it lies with the notebooks or below."""
        beside: dict[str, Entry] = {}
        outside = []
        for path, entry in self._files.items():
            if path in self._used:
                continue
            if not base or path.startswith(f"{base}/"):
                beside[path[len(base) + 1 if base else 0 :]] = entry
            elif not any(map(names.is_hidden, path.split("/"))):
                outside.append(path)
        in_the_way = [path for path in beside if any(map(beside.__contains__, _folders(path)))]
        for path in in_the_way:
            del beside[path]
        found = ((PurePosixPath(path), entry.size) for path, entry in beside.items())
        choice = own_files.choose(found, [*self._wanted, *report_files.made_files(self._reports)], self._packages)
        for note in choice.notes:
            self._note(note)
        size = 0
        for path in map(str, choice.paths):
            try:
                content = self._read(beside[path].key, min(own_files.MAX_FILE, own_files.MAX_TOTAL - size))
            except Unreadable as error:
                self._note(f"{names.shown(path)} does not come along: {error}")
            else:
                self._delivered.files[path] = content
                size += len(content)
        self._tell("{files}: not taken along: a file has the name of its folder.", in_the_way)
        self._tell("{files}: not taken along: not in the notebooks' folder.", sorted(outside))

    def _tell_others(self) -> None:
        reasons: dict[str, list[str]] = {}
        for path, why in self._delivered.piece.others.items():
            reasons.setdefault(why, []).append(path)
        for why, paths in reasons.items():
            self._tell("{files}: not read: {why}.", paths, why)

    def _tell(self, text: str, paths: Sequence[str], why: str = "") -> None:
        if paths:
            self._note(text.format(files=names.listed(paths), why=why))

    def _note(self, text: str) -> None:
        self._delivered.notes.append(text)
