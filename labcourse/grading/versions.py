"""Which version of a notebook counts, of all that a student handed in.

The folder at a time has, of each notebook, the newest version that is changed, and of each other file the newest. A
notebook needs itself, the notebooks before it, the student's own files, its report, the bench and the release. For each
lateness, its version is the folder at the last hand-in that was received so late; a version that needs the same as one
that is less late *is* that version. The version that is worth most counts, less its own lateness; of equals, the
earlier. What a person took counts before all of this.

Everything here is computed from what the gradebook stores, so that neither the order nor the number of gradings changes
a mark. Nothing is run here: :func:`run_what_may_count` asks for the runs that it needs.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from fractions import Fraction
from typing import TypeVar

from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.gradebook import Stored

_Result = TypeVar("_Result")
#: Whether a person has to say if it is late, and the share (0 to 1) of the points that lateness costs. What is known
#: comes first, then what costs less.
Lateness = tuple[bool, Fraction]
HandInKey = tuple[str, datetime]  #: source and time of receipt of a hand-in


@dataclass(frozen=True, kw_only=True)
class StoredHandIn:
    """What came at one time.

    Attributes
    ----------
    source : path in the class's folder
    received : time of receipt, UTC; when it was saved, if only that is known
    clock : how the time is known; "" if only the student's computer wrote it
    folder_of : ID of the student whom its course.json names; "" without one
    stored : when the gradebook got it, UTC
    files : name → digest of the content
    """

    source: str
    received: datetime
    clock: str | None
    folder_of: str
    stored: datetime
    files: Mapping[str, str] = field(hash=False)

    @property
    def key(self) -> HandInKey:
        """What tells it from other hand-ins."""
        return self.source, self.received

    @property
    def since(self) -> datetime:
        """The time from which it was certainly there."""
        return self.stored if self.clock == "" else self.received


@dataclass(frozen=True)
class Folder:
    """What a student's folder holds at a time.

    Attributes
    ----------
    bench_of : ID of the student with the bench
    files : name → digest of the content
    came : name → the hand-in that brought this content
    place : number of the student's hand-ins until then
    """

    bench_of: str
    files: Mapping[str, str]
    came: Mapping[str, StoredHandIn]
    place: int = 0


@dataclass(frozen=True)
class NotebookVersion:
    """A version of a notebook.

    Attributes
    ----------
    notebook : file name
    hand_in : the first, among those of its lateness, with which all was there that the notebook needs
    late : its lateness
    folder : with all that it needs
    needs : what it needs; equal for equal results
    """

    notebook: str
    hand_in: StoredHandIn
    late: Lateness
    folder: Folder = field(hash=False)
    needs: tuple[object, ...] = ()


def in_order(rows: Iterable[Stored]) -> list[StoredHandIn]:
    """Return the hand-ins of which a gradebook stores the files, in order of receipt.

    Where only the student's computer says when, hand-ins for one assignment are in the order of their attempts, copies,
    and then of that clock.
    """
    groups = defaultdict[HandInKey, list[Stored]](list)
    for row in rows:
        groups[row.source, row.received].append(row)
    latest, moments = dict[str, datetime](), dict[HandInKey, datetime]()
    for key, (first, *_others) in sorted(groups.items(), key=lambda group: _attempt(group[1][0])):
        moments[key] = first.received
        if first.clock == "":
            moments[key] = latest[first.assignment] = max(first.received, latest.get(first.assignment, first.received))
    return [
        StoredHandIn(
            source=first.source,
            received=first.received,
            clock=first.clock,
            folder_of=max(row.folder_of for row in group),
            stored=min(row.stored for row in group),
            files={row.name: row.digest for row in group},
        )
        for key, group in sorted(groups.items(), key=lambda group: (moments[group[0]], _attempt(group[1][0])))
        for first in group[:1]
    ]


def _attempt(row: Stored) -> tuple[int, int, datetime, str]:
    return row.attempt, row.copy, row.received, row.source


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What the versions of a student depend on, besides what was handed in.

    Attributes
    ----------
    notebooks : file names of the course's notebooks, in order
    reports : file name of a report's PDF → file name of its notebook
    is_changed : function of a notebook's file name and digest: whether a student wrote something in it
    release_of : function of the digest of a course.json: name of the release
    lateness : function of a notebook's file name and a hand-in
    closed : file name of a notebook → when its marks were given back with something counting; what came later does not
        count by itself
    taken : file name of a notebook → the hand-in that an instructor took
    """

    notebooks: Sequence[str]
    reports: Mapping[str, str]
    is_changed: Callable[[str, str], bool]
    release_of: Callable[[str], str]
    lateness: Callable[[str, StoredHandIn], Lateness]
    closed: Mapping[str, datetime] = field(default_factory=dict)
    taken: Mapping[str, HandInKey] = field(default_factory=dict)


class Versions:
    """The versions of a student's notebooks.

    Parameters
    ----------
    student : ID
    hand_ins : ID → hand-ins in order: of the student, and of each partner who owns a folder that was used
    rules : what else versions depend on
    """

    def __init__(self, student: str, hand_ins: Mapping[str, Sequence[StoredHandIn]], rules: Rules) -> None:
        self._student, self._hand_ins, self._rules = student, hand_ins, rules
        self._found: dict[str, list[NotebookVersion]] = {}
        self._own = {hand_in.key for hand_in in hand_ins[student]}
        self._folders = {
            hand_in.key: self._folder_at(hand_in, place) for place, hand_in in enumerate(hand_ins[student], start=1)
        }

    def _folder_at(self, hand_in: StoredHandIn, place: int) -> Folder:
        """Return the folder of the student whom a hand-in's course.json names, as it was when this came.

        Without a course.json it is the student's own folder, and the bench that of the newest course.json before it.
        """
        owner = hand_in.folder_of if self._hand_ins.get(hand_in.folder_of) else self._student
        files, came, bench_of = dict[str, str](), dict[str, StoredHandIn](), owner
        for each in self._hand_ins[owner]:
            for name, digest in each.files.items():
                if name in files and self._is_written(name, files[name]) and not self._is_written(name, digest):
                    continue
                files[name], came[name] = digest, each
            bench_of = each.folder_of or bench_of
            if each.key == hand_in.key:
                break
        return Folder(bench_of, files, came, place)

    def newest(self) -> Folder:
        """Return the folder at the last hand-in; an empty one if nothing was handed in."""
        hand_ins = self._hand_ins[self._student]
        return self._folders[hand_ins[-1].key] if hand_ins else Folder(self._student, {}, {})

    def _is_written(self, name: str, digest: str) -> bool:
        return name not in self._rules.notebooks or self._rules.is_changed(name, digest)

    def needs(self, folder: Folder, notebook: str) -> tuple[object, ...]:
        """Return all that the results of a notebook depend on: two folders with the same give the same results."""
        rules, place = self._rules, self._rules.notebooks.index(notebook)
        later, answers = rules.notebooks[place + 1 :], (ANSWERS_FILE, COURSE_FILE)
        files = sorted(
            (name, digest)
            for name, digest in folder.files.items()
            if name not in later
            and name not in answers
            and rules.reports.get(name, notebook) == notebook
            and self._is_written(name, digest)
        )
        course = folder.files.get(COURSE_FILE)
        return (folder.bench_of, rules.release_of(course) if course else "", *files)

    def of(self, notebook: str) -> list[NotebookVersion]:
        """Return the versions of a notebook, those that are less late first; only the one that was taken, if any."""
        if notebook not in self._found:
            self._found[notebook] = self._versions_of(notebook)
        return self._found[notebook]

    def _versions_of(self, notebook: str) -> list[NotebookVersion]:
        by_lateness = defaultdict[Lateness, list[NotebookVersion]](list)
        for hand_in in self._hand_ins[self._student]:
            version = self._at(hand_in, notebook)
            if version is not None and hand_in.key == self._rules.taken.get(notebook):
                return [version]
            if version is not None and not self.is_closed(hand_in, notebook):
                by_lateness[version.late].append(version)
        found: list[NotebookVersion] = []
        for late in sorted(by_lateness):
            last = by_lateness[late][-1]
            if all(last.needs != earlier.needs for earlier in found):
                first = next(version for version in by_lateness[late] if version.needs == last.needs)
                found.append(replace(last, hand_in=first.hand_in))
        return found

    def at(self, key: HandInKey, notebook: str) -> NotebookVersion | None:
        """Return the version of a notebook at a hand-in; None if the student has handed in nothing of it by then."""
        found = (hand_in for hand_in in self._hand_ins[self._student] if hand_in.key == key)
        return next((self._at(hand_in, notebook) for hand_in in found), None)

    def after_given_back(self, notebook: str) -> list[NotebookVersion]:
        """Return the versions that came after the marks of a notebook were given back, unless a person took one."""
        if notebook in self._rules.taken:
            return []
        later = (one for one in self._hand_ins[self._student] if self.is_closed(one, notebook))
        counting = {version.folder.files[notebook] for version in self.of(notebook)}
        return [
            version
            for hand_in in later
            if (version := self._at(hand_in, notebook)) and version.folder.came[notebook].key == hand_in.key
            if version.folder.files[notebook] not in counting
        ]

    def of_others(self, folder: Folder) -> list[str]:
        """Return the notebooks in a folder that only the student's partner handed in."""
        names = [name for name in self._rules.notebooks if name in folder.files]
        return [name for name in names if not self.of(name) and folder.came[name].key not in self._own]

    def is_taken(self, version: NotebookVersion) -> bool:
        """Return whether an instructor took a version."""
        return self._rules.taken.get(version.notebook) == version.hand_in.key

    def _at(self, hand_in: StoredHandIn, notebook: str) -> NotebookVersion | None:
        """Return the version of a notebook at a hand-in; None if the student has handed in nothing of it by then."""
        folder = self._folders[hand_in.key]
        digest = folder.files.get(notebook)
        if digest is None or not self._rules.is_changed(notebook, digest) or folder.came[notebook].key not in self._own:
            return None
        late = self._rules.lateness(notebook, hand_in)
        return NotebookVersion(notebook, hand_in, late, folder, self.needs(folder, notebook))

    def covers(self, folder: Folder, version: NotebookVersion) -> bool:
        """Return whether all that a version needs is the same in a folder."""
        return version.notebook in folder.files and self.needs(folder, version.notebook) == version.needs

    def newest_for(self, versions: Collection[NotebookVersion], done: Collection[Folder]) -> Folder:
        """Return the newest folder, of those that are not ``done``, that covers one of some versions."""
        return next(
            folder
            for folder in reversed(self._folders.values())
            if all(folder is not other for other in done) and any(self.covers(folder, one) for one in versions)
        )

    def is_closed(self, hand_in: StoredHandIn, notebook: str) -> bool:
        """Return whether a hand-in came after the marks of a notebook were given back."""
        closed = self._rules.closed.get(notebook)
        return closed is not None and hand_in.since > closed


# --- what may count ---------------------------------------------------------------------------------------------------


def run_what_may_count(
    versions: Versions,
    notebooks: Collection[str],
    run: Callable[[Folder], _Result],
    worth: Callable[[_Result, NotebookVersion], Fraction],
    possible: Mapping[str, Fraction],
    holds: Callable[[_Result, NotebookVersion], bool] = lambda result, version: True,
) -> dict[str, list[tuple[NotebookVersion, _Result]]]:
    """Run the versions of notebooks, with as few runs as that takes, and without those that cannot be worth most.

    Parameters
    ----------
    versions : of a student's notebooks
    notebooks : file names
    run : function that runs a folder, or takes the stored result of an equal one
    worth : function of a result and a version: its points less its lateness; of a text that nobody has scored, all
    possible : file name of a notebook → all of its points; no version is worth more than these less its lateness
    holds : function that returns whether the result of a later folder with equal needs may stand for a version

    Returns
    -------
    dict
        File name of each notebook with a version → versions that were run, with their results, less late ones first.
    """
    waiting = {name: [*versions.of(name)] for name in notebooks}
    results: list[tuple[Folder, _Result]] = []
    found = defaultdict[str, list[tuple[NotebookVersion, _Result]]](list)
    best: dict[str, Fraction] = {}

    def result_for(version: NotebookVersion) -> list[_Result]:
        """Return the result of a run that stands for a version, in a list; an empty one if there is none yet."""
        return [
            result
            for folder, result in results
            if folder is version.folder or (versions.covers(folder, version) and holds(result, version))
        ][:1]

    while waiting:
        for name, queue in [*waiting.items()]:
            while queue and name in best and possible[name] * (1 - queue[0].late[1]) <= best[name]:
                queue.pop(0)  # it cannot be worth more
            if not queue:
                del waiting[name]
        ready = [(queue.pop(0), result) for queue in waiting.values() for result in result_for(queue[0])]
        for version, result in ready:
            name, value = version.notebook, worth(result, version)
            found[name].append((version, result))
            best[name] = max(value, best.get(name, value))
        if waiting and not ready:
            done = [folder for folder, _result in results]
            folder = versions.newest_for([queue[0] for queue in waiting.values()], done)
            results.append((folder, run(folder)))
    return dict(found)
