"""Grade a class: from submissions to marks in the gradebook.

Each submission is read, prepared, identified, run in a sandbox, explained, marked and stored, in this order, by the
methods of :class:`Batch` of these names. Submissions are independent: whatever one does, the others are graded. A
submission that is done is in the gradebook at once. Equal content is not run again: a run is identified by the content
of all that it depends on.
"""

from __future__ import annotations

import hmac
import threading
from collections import defaultdict, deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import labcourse
from labcourse import course_file
from labcourse.answers import report_files, schema
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.benches import REAL
from labcourse.errors import IsolationError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading import counting, graded_run, intake
from labcourse.grading.assignments import of_course
from labcourse.grading.course import Course
from labcourse.grading.gradebook import DECIDED, Arrival, Delivery, Gradebook, Graded, Stored, StudentRecord
from labcourse.grading.intake.platforms import parse_time
from labcourse.grading.marking import marking
from labcourse.grading.marking.marking_processes import Marker, marking_digest
from labcourse.grading.marks import Mark, Status
from labcourse.grading.running import runner
from labcourse.grading.running.bundle import Bundle, Bundles
from labcourse.grading.running.prepared import (
    content_digest,
    not_run,
    prepare,
    program_digest,
    run_content,
    submission_digest,
)
from labcourse.grading.running.supplied import Supplied, values_for
from labcourse.grading.settings import Assignment
from labcourse.grading.submission import NEVER, TIME_RECEIVED, Decisions, Submission
from labcourse.grading.versions import (
    Folder,
    HandInKey,
    Lateness,
    NotebookVersion,
    Rules,
    StoredHandIn,
    Versions,
    in_order,
    run_what_may_count,
)
from labcourse.problems import OF_READING, Code, Problem, Reason, Where
from labcourse.run.inside import EVIDENCE_FILE
from labcourse.run.reasons import explain
from labcourse.student_id import caseless

PROBE_SEED_BITS = 48  #: of a seed that nobody can guess, and that is exact as a float


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a class is graded.

    Attributes
    ----------
    limits : on the run of a submission
    jobs : number of submissions to grade at a time, on this machine
    scheduler : address of a dask.distributed scheduler, to run them on its workers instead
    probe_seed : for the inputs on which functions are tried; drawn from the gradebook's secret unless given
    isolated : whether submissions are run in a sandbox; else with the rights of whoever grades
    every_cell : run the cells that only show something, too
    supplied : values that the instructor gives in place of missing answers
    times : name of a file or folder among the submissions, or a student's ID → when it was handed in
    zone : time zone of times in names and in zips, which do not say their zone
    again : IDs of persons who were erased, and are taken in again as new persons
    decisions : what the instructor decided about submissions (``intake.csv``)
    only : the assignment for which the submissions were handed in; None for all
    platform : the learning platform that named the submissions; "" if their names say it
    """

    limits: runner.RunLimits = field(default_factory=runner.RunLimits)
    jobs: int = 1
    scheduler: str | None = None
    probe_seed: int | None = None
    isolated: bool = True
    every_cell: bool = False
    supplied: tuple[Supplied, ...] = ()
    times: Mapping[str, datetime] = field(default_factory=dict)
    zone: tzinfo = UTC
    again: tuple[str, ...] = ()
    decisions: Decisions = field(default_factory=dict)
    only: Assignment | None = None
    platform: str = ""


class Batch:
    """The submissions of a class, to be graded together.

    Parameters
    ----------
    submissions : folder that holds a folder or a zip for each student; or IDs of students, to grade the files that the
        gradebook has of them
    course : the course, with its key
    gradebook : where results are stored
    settings : how to grade

    Attributes
    ----------
    ignored : why things are not taken in: what lies among the submissions, erased persons, and stored releases
    students : IDs of the students with a submission to grade
    sources : what was read, to which rows of ``intake.csv`` belong: archives, folders, files, and students
    absent : students of the gradebook's roster who have not handed in anything
    doubts : what an instructor may decide otherwise; complete when all are graded

    Raises
    ------
    GradingError
        If there are no submissions, or if a part of the course is missing.
    """

    def __init__(
        self,
        submissions: Path | Collection[str],
        course: Course,
        gradebook: Gradebook,
        settings: Settings | None = None,
    ) -> None:
        self._course, self._gradebook = course, gradebook
        self._settings = settings = settings or Settings()
        self._key_digest, self._secret = marking_digest(course), gradebook.secret()
        roster = [student for student in gradebook.students() if student.enrolled]
        named, erased = partial(students_named_before, gradebook), partial(erased_in, gradebook, settings.again)
        find = partial(intake.find, zone=settings.zone, decisions=settings.decisions, platform=settings.platform)
        if isinstance(submissions, Path):
            collected = find(submissions, roster, settings.times, earlier=named, erased=erased)
        else:
            collected = intake.ClassFolder([Submission(student=student) for student in submissions], [])
        # A declined partner who handed in nothing and has no marks is left out.
        found = [
            one
            for one in collected.submissions
            if one.pieces or one.unconfirmed or not isinstance(submissions, Path) or gradebook.current(one.student)
        ]
        taken, left_out = leave_out_erased(gradebook, found, settings.again)
        taken += [*take_from_earlier_owners(gradebook, taken), *no_longer_named(gradebook, taken)]
        again = [] if not isinstance(submissions, Path) else outdated(gradebook, course, taken)
        self._as_stored = {one.student for one in again} if isinstance(submissions, Path) else {*submissions}
        self._waiting = deque((*taken, *again))
        self.students = [submission.student for submission in self._waiting]
        self.sources = collected.read
        self._bundles = Bundles(course)
        self._how = [labcourse.__version__, asdict(settings.limits), settings.isolated, settings.every_cell]
        given = [*self._how, settings.probe_seed, settings.supplied]
        self._basis = content_digest([self._bundles.digest(), program_digest(), given])
        self._masters = {name: self._bundles.masters(name)[0] for name in self._bundles.current.pristine}
        reports = report_files.names(course.catalogue)
        self._reports = {pdf: f"{course.notebook_of(number)}.ipynb" for number, pdf in reports.items()}
        self._roster = {caseless(student.student): student for student in gradebook.students()}
        self._publications = gradebook.publications()
        self._changed: dict[str, bool] = {}  # digest of a notebook → whether a student wrote something in it
        self._released: dict[str, str] = {}  # digest of a course.json → name of the release
        self._possible = counting.possible(course)
        self._running = defaultdict[str, threading.Lock](threading.Lock)
        self.ignored: list[Reason] = [*collected.ignored, *left_out, *self._bundles.problems]
        time_matters = course.settings.dues and course.settings.late.per_day
        self.doubts = [one for one in collected.doubts if one.about != TIME_RECEIVED or (time_matters and one.assumed)]
        self._undated = {one.submission: one for one in collected.doubts if time_matters and one.about == TIME_RECEIVED}
        present = {caseless(student) for student in (*self.students, *gradebook.handed_in())}
        self.absent = [student.student for student in roster if caseless(student.student) not in present]

    def grade(self) -> Iterator[Submission]:
        """Grade all submissions, several at a time. Yield each as soon as it is in the gradebook.

        Raises
        ------
        IsolationError
            If submissions cannot be isolated; what was graded until then stays.
        """
        scheduler = self._settings.scheduler
        place = runner.local(self._settings.jobs) if scheduler is None else runner.cluster(scheduler)
        with (
            place as pool,
            Marker(self._course, pool.capacity) as marker,
            ThreadPoolExecutor(pool.capacity, thread_name_prefix="labcourse-grade") as threads,
        ):
            waiting = self._begun()
            # No more are begun than can run at a time, so that a large class takes no more memory than a small one.
            busy = {threads.submit(self._grade, each, pool, marker) for each in islice(waiting, pool.capacity)}
            try:
                while busy:
                    done, busy = wait(busy, return_when=FIRST_COMPLETED)
                    failed = {future for future in done if future.exception()}  # by an IsolationError
                    room = 0 if failed else len(done)
                    busy |= {threads.submit(self._grade, each, pool, marker) for each in islice(waiting, room)}
                    for future in (*(done - failed), *failed):  # what is graded is stored before the error is raised
                        yield self._store(future.result())
            finally:  # on an interrupt, too: end what is running
                pool.stop()

    def _begun(self) -> Iterator[Submission]:
        """Yield the submissions that wait to be graded, and keep none: each holds all its files once it is read.

        If a student's work is run in a partner's folder, the partner's submission is read and stored first.
        """
        folders = {piece.folder_of for one in self._waiting for piece in one.pieces if piece.folder_of != one.student}
        for submission in (one for one in self._waiting if one.student in folders):
            with suppress(Exception):  # it is raised again when this submission is graded, and fails that one only
                self._receive(submission)
        while self._waiting:
            yield self._waiting.popleft()

    def _grade(self, submission: Submission, pool: runner.Pool, marker: Marker) -> Submission:
        """Grade one submission, without changing what counts. Only IsolationError is raised; others make it fail."""
        submission.before = current = self._gradebook.current(submission.student)
        try:
            marked = current if current and current.key_digest == self._key_digest else None  # by the key as it is
            has_row = self._undated.keys() & submission.sources  # of intake.csv, which reading writes
            was_read = marked and not any(map(_is_of_reading, marked.run.problems))  # what was not may be by now
            if marked and was_read and not has_row and not submission.prepared_from:
                found = self._prepared_from(submission, intake.found_digest(submission))
                if marked.run.prepared_from == found:
                    return _unchanged(submission, marked)
            if not submission.prepared_from:
                self._receive(submission)
            if marked and marked.run.prepared_from == submission.prepared_from:
                return _unchanged(submission, marked)
            submission.has_run = False  # until a folder is run
            submission.graded = self._count(submission, pool, marker)
            if marked and _identity(marked) == _identity(submission.graded):
                self._gradebook.note_prepared(marked.run.key, submission.prepared_from)
                return _unchanged(submission, marked)
        except IsolationError:
            raise
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            submission.has_run, submission.graded = True, self._failed(submission, error)
        return submission

    # --- what was handed in -------------------------------------------------------------------------------------------

    def _receive(self, submission: Submission) -> None:
        """Read the files of a submission, and of what waits until a person confirms a partner; store what is new."""
        names, masters, decisions = self._bundles.names, self._masters, self._settings.decisions
        reports, only, student = [*self._reports], self._settings.only, submission.student
        found = intake.found_digest(submission)
        intake.read(submission, names, masters, packages=self._course.packages, reports=reports, decisions=decisions)
        self.doubts += submission.doubts
        if student in self._as_stored and (before := self._gradebook.current(student)):
            of_reading = graded_run.submission_of(before.run)
            submission.problems += filter(_is_of_reading, of_reading.problems)
            submission.notes += filter(_is_of_reading, of_reading.notes)
        for piece in submission.unconfirmed:
            partner = piece.owner.students[0]
            theirs = intake.read(Submission(student=partner, pieces=(piece,)), names, masters)
            for name in {item.name for item in theirs.items} & {*names}:
                submission.waiting.setdefault(name, []).append(partner)
        earlier = [row.name for row in self._gradebook.stored(student)]
        for item in submission.items:
            item.assignment = only.title if only else ""
        self._set_decided_times(submission)
        self._gradebook.deliver(student, submission.items)
        store_common_work(self._gradebook, submission)
        versions = self._versions(submission)
        self._note_empty(submission, versions)
        self._limit_unread(submission, versions)
        submission.problems += intake.unread_problems(submission, earlier) if submission.pieces else []
        submission.items.clear()  # they are stored
        submission.prepared_from = self._prepared_from(submission, found)

    def _set_decided_times(self, submission: Submission) -> None:
        """Set the time of files that came before to the one that an instructor decided then, if that decision stands.

        Add a row for the instructor for each hand-in with other files, if only the student's computer says their time.
        """
        decisions, zone = self._settings.decisions.items(), self._settings.zone
        times = {(source, parse_time(text, zone)) for (source, about), text in decisions if TIME_RECEIVED in about}
        stored = [row for row in self._gradebook.stored(submission.student) if (row.source, row.received) in times]
        decided = {(row.name, row.digest): row.received for row in stored if row.clock == DECIDED}
        for item in submission.items:
            if (known := decided.get((item.name, item.digest))) and (item.clock == "" or known < item.received):
                item.received, item.clock = known, DECIDED
        undated = {item.source for item in submission.items if item.clock == ""}
        self.doubts += [self._undated[source] for source in undated & self._undated.keys()]

    def _versions(self, submission: Submission) -> Versions:
        """Return the versions of a student's notebooks, of all that the gradebook has of them."""
        student, course = submission.student, self._course
        rows = {student: self._gradebook.stored(student)}
        for owner in {row.folder_of for row in rows[student]} - {student, ""}:
            theirs = self._gradebook.stored(owner)
            known = {(row.name, row.source, row.received) for row in theirs}
            used = [row for row in rows[student] if row.folder_of == owner]
            rows[owner] = theirs and [*theirs, *(r for r in used if (r.name, r.source, r.received) not in known)]
        for one, stored in rows.items():
            self._learn(one, stored)
        about = self._roster.get(caseless(student), StudentRecord(student))
        hand_ins = {one: in_order(stored) for one, stored in rows.items()}

        def lateness(notebook: str, hand_in: StoredHandIn) -> Lateness:
            arrival = Arrival(hand_in.received, hand_in.clock)
            return counting.how_late(course, about, notebook.removesuffix(".ipynb"), arrival)

        rules = Rules(
            notebooks=self._bundles.names,
            reports=self._reports,
            is_changed=lambda _name, digest: self._changed[digest],
            release_of=self._released.__getitem__,
            lateness=lateness,
            closed=self._closed(hand_ins[student]),
            taken={
                f"{name}.ipynb": (act.source, act.received)
                for name, act in self._gradebook.takes(student).items()
                if act.received is not None
            },
        )
        return Versions(student, hand_ins, rules)

    def _learn(self, student: str, rows: Sequence[Stored]) -> None:
        """Read which of a student's stored notebooks are changed, and which releases their course.json name."""
        names = {*self._bundles.names}
        unknown = {row.digest: row.name for row in rows if row.name in names and row.digest not in self._changed}
        files = {row.digest: row.name for row in rows if row.name == COURSE_FILE and row.digest not in self._released}
        for digest, content in self._gradebook.contents(student, {**unknown, **files}).items():
            if digest in unknown:
                masters = self._bundles.masters(unknown[digest])
                self._changed[digest] = intake.is_changed(content, masters)
            else:
                self._released[digest] = str(intake.course_data(content).get(course_file.RELEASE_KEY, ""))

    def _closed(self, hand_ins: Sequence[StoredHandIn]) -> dict[str, datetime]:
        """Return notebook's file name → when its assignment was given back to a student with something counting."""
        first: dict[str, datetime] = {}
        for hand_in in hand_ins:
            for name, digest in hand_in.files.items():
                if name in self._bundles.names and self._changed[digest]:
                    first[name] = min(hand_in.since, first.get(name, hand_in.since))
        closed: dict[str, datetime] = {}
        for assignment in of_course(self._course):
            own = [f"{name}.ipynb" for name in assignment.notebooks]
            begun = min((first[name] for name in own if name in first), default=None)
            for publication in self._publications:
                if begun is not None and begun <= publication.when:
                    given = (f"{name}.ipynb" for name in publication.notebooks)
                    for name in {*own}.intersection(given if publication.notebooks else own):
                        closed.setdefault(name, publication.when)
        return closed

    def _note_empty(self, submission: Submission, versions: Versions) -> None:
        """Note the notebooks in which nothing is written, where an earlier version is changed and counts."""
        newest = versions.newest()
        for item in submission.items:
            if item.name in self._bundles.names and not self._changed[item.digest]:
                earlier = newest.came.get(item.name)
                if earlier and self._changed[newest.files[item.name]] and earlier.received <= item.received:
                    note = Problem.of(Code.EMPTY_BESIDE_ANSWERED, item.name, source=item.source)
                    submission.notes.append(note)

    def _limit_unread(self, submission: Submission, versions: Versions) -> None:
        """Say which notebooks an unreadable piece leaves undecided: those of its assignment without any version.

        Pieces that could not be read before are still unread, unless they are read now, or a later piece was.
        """
        only = self._settings.only
        concerned = [f"{name}.ipynb" for name in only.notebooks] if only else [*self._bundles.names]
        pieces = {(piece.source, piece.received.isoformat()) for piece in submission.pieces}
        before = submission.before or self._gradebook.current(submission.student)
        earlier = [
            one
            for one in (before.run.problems if before else ())
            if isinstance(one, Problem)
            and one.code is Code.SUBMISSION_UNREAD
            and (one.where, one.parameters.get("received")) not in pieces
        ]
        about = {"notebooks": concerned, "of_assignment": only is not None}
        submission.unreadable = [replace(one, parameters={**one.parameters, **about}) for one in submission.unreadable]
        found, submission.unreadable = [*earlier, *submission.unreadable], []
        for one in found:
            is_replaced = one in earlier and not one.parameters["of_assignment"] and submission.has_notebooks
            open_ = [name for name in one.parameters["notebooks"] if not versions.of(name)]
            if is_replaced or not open_:
                submission.notes.append(one)
            else:
                submission.unreadable.append(replace(one, parameters={**one.parameters, "notebooks": open_}))

    def _prepared_from(self, submission: Submission, found: str) -> str:
        """Return the digest of all that preparing a submission depends on: if it is the same, nothing is prepared.

        It is the same before a submission is read and afterwards, unless that finds something for ``intake.csv``.

        Parameters
        ----------
        submission : as it was found, or read
        found : from :func:`labcourse.grading.intake.found_digest`, before it was read
        """
        student, only = submission.student, self._settings.only
        who = [student, submission.bench_of, submission.partners]
        own = self._gradebook.stored(student)
        sources = submission.sources | {one.source for one in own}
        decided = sorted(row for row in self._settings.decisions.items() if row[0][0] in sources)
        how = [self._basis, only and only.title, decided, submission.doubts]
        benches = sorted({row.folder_of for row in own} - {student, ""})
        rows = [own, *map(self._gradebook.stored, benches)]
        stored = [[row._replace(stored=NEVER) for row in of_one] for of_one in rows]  # when it was stored is no part
        settings, before = self._course.settings, self._gradebook.current(student)
        about = self._roster.get(caseless(student), StudentRecord(student))
        when = [settings.late, settings.dues, settings.extensions, about.section, about.aliases]
        given_back = [(one.when, one.notebooks) for one in self._publications]
        taken = [(name, act.source, act.received) for name, act in sorted(self._gradebook.takes(student).items())]
        by_persons: list[Any] = []
        if before is not None and counting.is_choice(before.run.versions):  # which depends on what persons gave
            by_persons = [vars(mark) for mark in before.marks if mark.status == Status.BY_A_PERSON]
        chosen_by = [when, given_back, taken, by_persons]
        return content_digest([how, who, found, stored, chosen_by])

    # --- what counts of it --------------------------------------------------------------------------------------------

    def _count(self, submission: Submission, pool: runner.Pool, marker: Marker) -> Graded:
        """Run the folders that are needed, and return what counts: each notebook of the version that is worth most."""
        versions, course = self._versions(submission), self._course
        given, folders = self._gradebook.given_marks(submission.student), list[tuple[Folder, Graded]]()

        def run(folder: Folder) -> Graded:
            folders.append((folder, self._graded_folder(submission, folder, pool, marker)))
            return folders[-1][1]

        def worth(graded: Graded, version: NotebookVersion) -> Fraction:
            points = counting.worth(course, graded, given, version.notebook.removesuffix(".ipynb"))
            return points * (1 - version.late[1])

        holds = partial(counting.holds, course)
        ran = run_what_may_count(versions, self._bundles.names, run, worth, self._possible, holds)
        if not folders:
            run(versions.newest())
        newest, base = max(folders, key=lambda one: one[0].place)
        entries = counting.entries_of(course, ran, versions, base.run.key, newest)
        about = self._roster.get(caseless(submission.student), StudentRecord(submission.student))
        runs = {graded.run.key: graded for _folder, graded in folders}
        if counting.is_choice(entries):
            for graded in runs.values():
                self._gradebook.keep(graded)
        made = counting.assembled(course, about, entries, runs, given)
        return replace(made, run=replace(made.run, prepared_from=submission.prepared_from))

    def _graded_folder(self, submission: Submission, folder: Folder, pool: runner.Pool, marker: Marker) -> Graded:
        """Run and mark a folder of a student's, or return the stored run of an equal one with its marks."""
        part = replace(submission, bench_of=folder.bench_of, has_run=True)
        part.problems, part.notes = [*submission.problems], [*submission.notes]
        part.doubts, part.items = [], []
        self._prepare(part, folder)
        self._identify(part)
        known = self._gradebook.find_made(part.key)
        if known and known.key_digest == self._key_digest and known.run.submission == part.digest:
            return known
        with self._running[part.ran] if part.partners else nullcontext():  # a pair's folder is run once
            self._run(part, pool, marker)
            self._explain(part)
            self._mark(part, marker)
            if part.partners:
                self._gradebook.keep(part.graded)
        submission.has_run |= part.has_run
        return part.graded

    def _prepare(self, submission: Submission, folder: Folder) -> None:
        """Prepare a folder for its run. Problems and notes are added to the submission."""
        absent = intake.choose_newest(
            submission, self._files(submission, folder), self._bundles.names, [*self._reports]
        )
        chosen = self._bundles.choose(submission.notebooks, submission.course)
        submission.problems += chosen.problems
        catalogue = chosen.bundle.catalogue
        wanted = {f"{catalogue.everything[question].notebook}.ipynb" for question, _part in chosen.bundle.asked_parts}
        submission.notes += [note for note in absent if note.where in wanted]
        submission.notes += chosen.notes
        every_cell, supplied = self._settings.every_cell, self._supplied(submission)
        prepare(submission, chosen.bundle, self._course.catalogue, every_cell=every_cell, supplied=supplied)

    def _files(self, submission: Submission, folder: Folder) -> list[Delivery]:
        """Return the files of a folder, with their contents."""
        contents: dict[str, bytes] = {}
        for owner in dict.fromkeys((submission.student, *(one.folder_of for one in folder.came.values()))):
            contents |= self._gradebook.contents(owner, {*folder.files.values()} - {*contents}) if owner else {}
        return [
            Delivery(name, digest, contents[digest], came.received, came.source, came.clock)
            for name, digest in sorted(folder.files.items())
            if (came := folder.came[name])
        ]

    def _identify(self, submission: Submission) -> None:
        """Set the digests by which an equal submission is known: of what is run, of what is marked, and of all of it.

        Set the probe seed, too: that of the settings, or else one drawn from the gradebook's secret and the run.
        """
        content = run_content(submission)
        run = content_digest([content, self._how])
        seed = self._settings.probe_seed
        if seed is None:  # only somebody who has the gradebook can compute it
            drawn = hmac.digest(self._secret, run.encode(), "sha256")
            seed = int.from_bytes(drawn) % 2**PROBE_SEED_BITS
        submission.ran, submission.probe_seed = content_digest([run, seed]), seed
        submission.key = content_digest([submission.student, submission.ran, not_run(submission)])
        submission.digest = submission_digest(submission, content)

    def _run(self, submission: Submission, pool: runner.Pool, marker: Marker) -> None:
        """Run a submission, or take what came back from the run of equal content that the gradebook has.

        If there are no notebooks of the course, nothing is run.
        """
        if known := self._gradebook.run_of(submission.ran):
            run = graded_run.submission_of(known)
            submission.answers, submission.cell_reports = run.answers, run.cell_reports
            submission.ended, submission.evidence, submission.has_run = run.ended, run.evidence, False
            return
        marker.warm_up()
        if not submission.handed_in:
            return
        job = self._job(submission)
        files, submission.ended = pool.run(runner.run, submission.bundle.packed, job)
        cells = {(name, cell["id"]) for name, notebook in job.notebooks.items() for cell in notebook["cells"]}
        submission.answers = files.get(ANSWERS_FILE)
        submission.cell_reports = schema.read_reports(files.get(REPORTS_FILE, b"")).of(cells)
        submission.evidence = files.get(EVIDENCE_FILE, b"")

    def _job(self, submission: Submission) -> runner.Job:
        """Return the run of a submission that was prepared."""
        bundle, settings = submission.bundle, self._settings
        return runner.Job(
            student=submission.bench_of,
            notebooks=submission.merged.notebooks,
            probe_seed=submission.probe_seed,
            parameters=bundle.parameters,
            imports=bundle.imports,
            files=submission.files,
            limits=settings.limits,
            isolated=settings.isolated,
            evidence=self._course.evidence if bundle.policy.which == REAL else "",
        )

    def rerun(
        self, student: str, wanted: Mapping[str, HandInKey], seed: int
    ) -> Iterator[tuple[runner.Job, runner.Ran]]:
        """Run versions of a student's notebooks for what they show, with as few runs as that takes; store nothing.

        Parameters
        ----------
        student : ID
        wanted : notebook's file name → the hand-in with the version; it is left out if there is none
        seed : for the inputs of functions

        Yields
        ------
        tuple
            a run, with the notebooks in it that are shown; and what came back

        Raises
        ------
        IsolationError
            If it cannot be isolated.
        """
        submission = Submission(student=student, before=self._gradebook.current(student))
        versions, done = self._versions(submission), list[Folder]()
        waiting = [one for name, key in wanted.items() if (one := versions.at(key, name)) is not None]
        while waiting:
            done.append(folder := versions.newest_for(waiting, done))
            shown = tuple(one.notebook for one in waiting if versions.covers(folder, one))
            waiting = [one for one in waiting if one.notebook not in shown]
            part = replace(submission, bench_of=folder.bench_of, probe_seed=seed)
            self._prepare(part, folder)
            needed = {name: one for name, one in part.merged.notebooks.items() if name <= max(shown)}
            job = replace(self._job(part), notebooks=needed, shown=shown, evidence="")
            yield job, runner.run(part.bundle.packed, job)

    def _explain(self, submission: Submission) -> None:
        """Fill in what marking needs besides the answers; add problems and notes on what stopped or is missing."""
        bundle, catalogue, cells = submission.bundle, self._course.catalogue, submission.cell_reports
        submission.documents = documents = report_files.of_files(submission.pdfs, catalogue)
        submission.asked, submission.policy = self._asked(bundle), bundle.policy
        has_syntax_error = any(cell.error and cell.error.type == "SyntaxError" for cell in cells.cells)
        recorded = graded_run.recorded_in(submission.answers) | set(submission.words)
        reasons = explain(
            bundle.pristine,
            submission.merged,
            cells,
            recorded - submission.supplied_parts,
            bundle.catalogue,
            handed_in=submission.handed_in,
            claim=submission.claim,
            seconds=self._settings.limits.cell if submission.ended else None,
            python=submission.python if has_syntax_error else None,
        )
        absent = _not_there(submission, catalogue)
        submission.missing = {**absent, **reasons.missing}
        submission.waits = [
            where for where in absent if f"{catalogue.marked[where[0]].notebook}.ipynb" in submission.waiting
        ]
        if submission.waits:
            names = sorted({name for partners in submission.waiting.values() for name in partners})
            submission.problems.insert(0, Problem.of(Code.CONFIRMATION_NEEDED, names=names))
        stops = (*reasons.stops, *reasons.harmless)
        submission.problems += [
            problem for problem in submission.ended if not runner.is_covered_by_cells(problem, stops)
        ]
        for pdf in documents.values():
            if pdf.encrypted:
                submission.problems.append(Problem.of(Code.MAY_ASK_FOR_PASSWORD, pdf.report, name=pdf.name))
            submission.notes.append(pdf.note)
        submission.problems += [*reasons.stops, *reasons.lost]
        submission.notes += reasons.harmless

    def _mark(self, submission: Submission, marker: Marker) -> None:
        """Mark a run by the key; give no points if no notebook and no report of the course could be read."""
        run = graded_run.record_of(submission, isolated=self._settings.isolated)
        if submission.handed_in or submission.pdfs:
            submission.graded = graded_run.mark(run, marker, self._key_digest)
            return
        marks = self._no_points(Problem.of(Code.NOTHING_READ), Status.MISSING, submission.bundle)
        submission.graded = Graded(run, graded_run.with_unconfirmed(marks, submission.waits), self._key_digest)

    def _store(self, submission: Submission) -> Submission:
        """Store a submission's run and marks, if they are new; return the submission with the marks that count."""
        if submission.is_new:
            reason = "run" if submission.has_run else "marked again"
            submission.graded = graded_run.store(self._gradebook, submission.graded, "labcourse grade", reason)
        return submission

    def _failed(self, submission: Submission, error: Exception) -> Graded:
        """Return the run and the marks to store if grading fails.

        The marks are the student's earlier ones, with a problem that says so; without any, all are "not marked".

        The key's digest is "", so that the submission is graded again the next time.
        """
        student, current, fault = submission.student, submission.before, f"{type(error).__name__}: {error}"
        supplied = {value.name: value.value for value in self._supplied(submission)}  # so that they are not lost
        if current is not None and not graded_run.is_failed(current.run):
            stays = Problem.of(Code.EARLIER_MARKS_STAY, error=fault)
            problems = dict.fromkeys((*graded_run.submission_of(current.run).problems, stays))
            return Graded(replace(current.run, problems=tuple(problems), supplied=supplied), current.marks, "")
        bundle, problem = self._bundles.current, Problem.of(Code.GRADING_FAILED, error=fault)
        failed = Submission(student=student, problems=[problem], key=f"failed: {student}", supplied=supplied)
        failed.bundle = bundle
        marks = self._no_points(Problem.of(Code.NOT_GRADED), Status.NOT_MARKED, bundle)
        return Graded(graded_run.record_of(failed, isolated=self._settings.isolated), marks, "")

    def _supplied(self, submission: Submission) -> list[Supplied]:
        """Return the values for a student's missing answers: of the gradebook, or in their place of the settings."""
        earlier = submission.before.run.supplied if submission.before else {}
        return values_for(submission.student, earlier, self._settings.supplied, self._course.catalogue)

    def _asked(self, bundle: Bundle) -> list[Where] | None:
        """Return the (question, part) that a bundle's release asks for; None if that is all that the course asks."""
        if bundle.release != self._bundles.current.release:
            return sorted(bundle.asked_parts)
        asked = self._course.asked_catalogue
        if asked is asked.whole:
            return None
        # The class may get another notebook later. This work was not asked for it.
        return [(number, name) for number, question in asked.marked.items() for name in question.names]

    def _no_points(self, reason: Problem, status: Status, bundle: Bundle) -> tuple[Mark, ...]:
        """Return marks of 0 points, with this reason and status, for all that the release of a bundle asks for."""
        return marking.nothing_earned(self._course, reason, status, self._asked(bundle))


def _is_of_reading(message: Reason) -> bool:
    """Return whether a message is about how a hand-in was found and read, which is not done again."""
    return isinstance(message, Problem) and message.code in OF_READING


def _identity(graded: Graded) -> tuple[object, ...]:
    """Return by what it is known that what counts is the same."""
    return graded.run.key, graded.run.submission, [*graded.run.versions]


def _unchanged(submission: Submission, current: Graded) -> Submission:
    """Return a submission with the run and the marks that counted before, as nothing about it has changed."""
    submission.graded, submission.has_run, submission.is_new = current, False, False
    return submission


def _not_there(submission: Submission, catalogue: Catalogue) -> dict[Where, Problem]:
    """Return (question, part) → why there is no answer, for notebooks that were not handed in or cannot be read."""
    why: dict[Where, Problem] = {}
    for number, question in catalogue.marked.items():
        notebook = f"{question.notebook}.ipynb"
        if notebook not in submission.handed_in:
            is_unread = intake.is_unread(notebook, submission.problems)
            code = Code.NOTEBOOK_OF_IT_UNREAD if is_unread else Code.NOTEBOOK_OF_IT_ABSENT
            why |= {(number, part): Problem.of(code, notebook) for part in question.names}
    return why


# --- what the gradebook has of earlier submissions --------------------------------------------------------------------


def store_common_work(gradebook: Gradebook, submission: Submission) -> None:
    """Store for a student what partners handed in before in both names, when nobody had confirmed that yet."""
    student = submission.student
    own = {(row.source, row.received) for row in gradebook.stored(student)}
    for partner in submission.partners:
        rows = [row for row in gradebook.stored(partner) if row.name == COURSE_FILE]
        contents = gradebook.contents(partner, {row.digest for row in rows})
        for row in rows:
            named = map(caseless, intake.students_in(contents[row.digest]))
            if (row.source, row.received) not in own and caseless(student) in named:
                gradebook.copy_files(partner, student, row.source, row.received)


def students_named_before(gradebook: Gradebook, student: str) -> list[str] | None:
    """Return the students whom a student's last ``course.json`` names; [] if there is none that can be read.

    Return None if the student handed in no files besides notebooks.
    """
    delivered = {delivery.name: delivery for delivery in gradebook.delivered(student, notebooks=False)}
    if not delivered:
        return None
    return intake.students_in(delivered[COURSE_FILE].content) if COURSE_FILE in delivered else []


def take_from_earlier_owners(gradebook: Gradebook, submissions: Sequence[Submission]) -> list[Submission]:
    """Delete the stored files of a submission from students who are not its owner, if the instructor decided who is.

    The owner's are stored with the submission.

    Returns
    -------
    list
        An empty submission for each student who lost files and has no submission now, so that their marks are made
        anew.
    """
    present = {caseless(submission.student) for submission in submissions}
    emptied: dict[str, Submission] = {}
    for owner, piece in ((submission.student, piece) for submission in submissions for piece in submission.pieces):
        if piece.owner.is_decided or piece.owner.declined:
            reason = Problem.of(Code.GIVEN_TO_OWNER, piece.source, owner=owner)
            for student in gradebook.delete_of_others(piece.source, piece.received, piece.owner.everybody):
                emptied[student] = Submission(student=student, problems=[reason])
    return [submission for student, submission in emptied.items() if caseless(student) not in present]


def no_longer_named(gradebook: Gradebook, submissions: Sequence[Submission]) -> list[Submission]:
    """Return an empty submission for each student who waits to be confirmed as a partner, and is not named any more.

    Their marks are made anew, since nobody would be asked about them.
    """
    present = {caseless(submission.student) for submission in submissions}
    before = (students_named_before(gradebook, one.student) or () for one in submissions if one.pieces)
    names = {caseless(name) for named in before for name in named} - present
    current = filter(None, map(gradebook.current, sorted(names)))
    return [Submission(student=one.run.student) for one in current if graded_run.submission_of(one.run).waits]


def outdated(gradebook: Gradebook, course: Course, submissions: Sequence[Submission]) -> list[Submission]:
    """Return an empty submission for each student who needs another choice of versions.

    Deadlines or extensions have changed since, or persons gave so few points that a version may win that was not run.
    """
    present, rules = {caseless(one.student) for one in submissions}, counting.rules_of(course)
    chosen = (
        (student, entries) for student, entries in gradebook.versions().items() if caseless(student) not in present
    )
    return [
        Submission(student=student)
        for student, entries in chosen
        if entries and (entries[0]["rules"] != rules or counting.to_be_run(entries))
    ]


def erased_in(gradebook: Gradebook, again: Sequence[str], *students: str) -> dict[str, str]:
    """Return student → the date on which they were erased; without those who are taken in again, as new persons."""
    anew, erased = {*map(caseless, again)}, gradebook.persons.erased(students).items()
    return {student: f"{when:%Y-%m-%d}" for student, when in erased if caseless(student) not in anew}


def leave_out_erased(
    gradebook: Gradebook, submissions: Sequence[Submission], again: Sequence[str]
) -> tuple[list[Submission], list[Problem]]:
    """Leave out the submissions of persons who were erased.

    Parameters
    ----------
    gradebook : which knows who was erased
    submissions : in the class's folder
    again : IDs of erased persons who are taken in again, as new persons

    Returns
    -------
    tuple
        the other submissions; and a problem for each submission of an erased person, or on an erased person's bench
    """
    named = {each.student for each in submissions} | {each.bench_of for each in submissions if each.bench_of}
    erased = erased_in(gradebook, again, *sorted(named))
    taken, problems = [], []
    for submission in submissions:
        student, partner = submission.student, submission.bench_of
        if student in erased:
            sources = list(dict.fromkeys(piece.source for piece in submission.pieces))
            when = erased[student]
            problems.append(Problem.of(Code.ERASED_HANDED_IN, student=student, when=when, sources=sources))
            continue
        taken.append(submission)
        if partner in erased:
            when = erased[partner]
            problems.append(Problem.of(Code.ERASED_NAMED, student=student, partner=partner, when=when))
    return taken, problems
