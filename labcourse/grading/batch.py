"""Grade a class: from submissions to marks in the gradebook.

Each submission is read, prepared, identified, run in a sandbox, explained, marked and stored, in this order, by the
methods of :class:`Batch` of these names. Submissions are independent: whatever one does, the others are graded. A
submission that is done is in the gradebook at once. Equal content is not run again: a run is identified by the content
of all that it depends on.
"""

from __future__ import annotations

import hashlib
import hmac
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from functools import partial
from itertools import islice
from pathlib import Path

import labcourse
from labcourse.answers import report_files, schema
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.benches import REAL
from labcourse.errors import IsolationError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading import graded_run, intake
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Delivery, EarlierRun, Gradebook, Graded
from labcourse.grading.marking import marking
from labcourse.grading.marking.marking_processes import Marker, marking_digest
from labcourse.grading.marks import Mark, Status
from labcourse.grading.running import runner
from labcourse.grading.running.bundle import Bundle, Bundles
from labcourse.grading.running.prepared import content_digest, prepare, run_content, submission_digest
from labcourse.grading.running.supplied import Supplied, values_for
from labcourse.grading.settings import Assignment
from labcourse.grading.submission import TIME_RECEIVED, Decisions, Submission
from labcourse.problems import Code, Problem, Reason, Where
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
    submissions : folder that holds a folder or a zip for each student; or, to grade the files that the gradebook has
        taken over from an earlier one, ID of each student → what to know of their run
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
    left_out : problems that name notebooks that are not taken, as they are of another assignment; complete when all are
        graded

    Raises
    ------
    GradingError
        If there are no submissions, or if a part of the course is missing.
    """

    def __init__(
        self,
        submissions: Path | Mapping[str, EarlierRun],
        course: Course,
        gradebook: Gradebook,
        settings: Settings | None = None,
    ) -> None:
        self._course, self._gradebook = course, gradebook
        self._settings = settings = settings or Settings()
        self._key_digest, self._secret = marking_digest(course), gradebook.secret()
        roster = [student for student in gradebook.students() if student.enrolled]
        named = partial(students_named_before, gradebook)
        find = partial(intake.find, zone=settings.zone, decisions=settings.decisions, platform=settings.platform)
        if isinstance(submissions, Path):
            collected = find(submissions, roster, settings.times, earlier=named)
        else:
            collected = intake.ClassFolder(_stored(submissions, named), [])
        # A declined partner who handed in nothing and has no marks is left out.
        found = [
            one
            for one in collected.submissions
            if one.pieces or one.unconfirmed or not isinstance(submissions, Path) or gradebook.current(one.student)
        ]
        taken, erased = leave_out_erased(gradebook, found, settings.again)
        self._waiting = deque((*taken, *take_from_earlier_owners(gradebook, taken), *no_longer_named(gradebook, taken)))
        self.students = [submission.student for submission in self._waiting]
        self.sources = collected.read
        self._bundles = Bundles(course)
        self._how = [labcourse.__version__, asdict(settings.limits), settings.isolated, settings.every_cell]
        given = [*self._how, settings.probe_seed, settings.supplied]
        self._basis = content_digest([self._bundles.digest(), _code_digest(), given])
        self._masters = {
            name: {cell["id"]: cell for cell in notebook["cells"]}
            for name, notebook in self._bundles.current.pristine.items()
        }
        self._reports = list(report_files.names(course.catalogue).values())
        self.ignored: list[Reason] = [*collected.ignored, *erased, *self._bundles.problems]
        time_matters = course.settings.dues and course.settings.late.per_day
        self.doubts = [doubt for doubt in collected.doubts if doubt.about != TIME_RECEIVED or time_matters]
        self.left_out: list[Problem] = []
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
        """Yield the submissions that wait to be graded, and keep none: each holds all its files once it is read."""
        while self._waiting:
            yield self._waiting.popleft()

    def _grade(self, submission: Submission, pool: runner.Pool, marker: Marker) -> Submission:
        """Grade one submission, without storing marks. Only IsolationError is raised; others make it fail."""
        submission.before = current = self._gradebook.current(submission.student)
        try:
            self._read(submission)
            marked = current if current and current.key_digest == self._key_digest else None  # by the key as it is
            if marked and marked.run.prepared_from == submission.prepared_from:
                return _unchanged(submission, marked)
            self._prepare(submission)
            self._identify(submission)
            if marked and (marked.run.key, marked.run.submission) == (submission.key, submission.digest):
                self._gradebook.note_prepared(submission.key, submission.prepared_from)
                return _unchanged(submission, marked)
            self._run(submission, pool, marker)
            self._explain(submission)
            self._mark(submission, marker)
        except IsolationError:
            raise
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            submission.has_run, submission.graded = True, self._failed(submission, error)
        return submission

    def _read(self, submission: Submission) -> None:
        """Read the files of a submission, and of what waits until a person confirms a partner."""
        names, masters, decisions = self._bundles.names, self._masters, self._settings.decisions
        owner = submission.claimed_by or submission.student
        read = partial(intake.read, packages=self._course.packages, reports=self._reports, decisions=decisions)
        read(submission, names, masters, earlier=partial(self._gradebook.delivered, owner))
        self.doubts += submission.doubts
        for piece in submission.unconfirmed:
            partner = piece.owner.students[0]
            theirs = intake.read(Submission(student=partner, pieces=(piece,)), names, masters)
            for name in {item.name for item in theirs.items} & {*names}:
                submission.waiting.setdefault(name, []).append(partner)
        if self._settings.only is not None:
            self._limit_to(self._settings.only, submission, owner)
        submission.prepared_from = self._prepared_from(submission)

    def _limit_to(self, only: Assignment, submission: Submission, owner: str) -> None:
        """Leave out notebooks of other assignments that the student handed in before with something written in them.

        One that differs from the version before is noted.

        What cannot be read of the submission makes only notebooks of the assignment undecided.

        Parameters
        ----------
        only : the assignment for which the submission was handed in
        submission : as it was read
        owner : ID of the student who handed in
        """
        own = {f"{name}.ipynb" for name in only.notebooks}
        before = {
            file.name: file.digest
            for file in self._gradebook.delivered(owner)
            if file.name in self._masters.keys() - own and intake.is_answered(file, self._masters[file.name])
        }
        submission.unreadable = [
            replace(problem, parameters={**problem.parameters, "notebooks": sorted(own)})
            for problem in submission.unreadable
        ]
        for item in [item for item in submission.items if item.name in before]:
            submission.items.remove(item)
            if item.digest != before[item.name]:
                note = Problem.of(Code.OTHER_ASSIGNMENT, item.name, source=item.source, title=only.title)
                submission.notes.append(note)
                self.left_out.append(note)

    def _prepared_from(self, submission: Submission) -> str:
        """Return the digest of all that preparing a submission depends on: if it is the same, nothing is prepared."""
        course_program_and_settings = self._basis
        found = [submission.student, submission.bench_of, submission.partners, submission.claimed_by]
        files = [(item.name, item.digest, item.received, item.source, item.clock) for item in submission.items]
        read = [sorted(submission.names), submission.python, submission.waiting]
        said = [submission.problems, submission.notes, submission.faults, submission.unread, submission.unreadable]
        stored = [self._gradebook.stored(one) for one in (submission.student, submission.claimed_by) if one]
        return content_digest([course_program_and_settings, found, files, read, said, stored])

    def _prepare(self, submission: Submission) -> None:
        """Store the student's new files (not a partner's), then prepare the newest version of each file for the run.

        Problems and notes are added to the submission.
        """
        handed_in_before = store_submission(self._gradebook, submission)
        # If another program stores a file after this line, the next batch finds another digest, and prepares it again.
        submission.prepared_from = self._prepared_from(submission)
        files = delivered(self._gradebook, submission, self._masters)
        arrivals = intake.choose_newest(submission, files, self._bundles.names, self._reports)
        chosen = self._bundles.choose(submission.notebooks, submission.course)
        submission.problems += intake.unread_problems(submission, handed_in_before) if submission.pieces else []
        submission.problems += chosen.problems
        catalogue = chosen.bundle.catalogue
        wanted = {f"{catalogue.everything[question].notebook}.ipynb" for question, _part in chosen.bundle.asked_parts}
        submission.notes += [note for note in arrivals if note.code is not Code.NOT_HANDED_IN or note.where in wanted]
        submission.notes += chosen.notes
        every_cell, supplied = self._settings.every_cell, self._supplied(submission)
        prepare(submission, chosen.bundle, self._course.catalogue, every_cell=every_cell, supplied=supplied)

    def _identify(self, submission: Submission) -> None:
        """Set two digests by which an equal submission is known: of all that its run depends on, and of all of it.

        Set the probe seed, too: that of the settings, or else one drawn from the gradebook's secret and the run.
        """
        content = run_content(submission)
        run = content_digest([submission.student, content, self._how])
        seed = self._settings.probe_seed
        if seed is None:  # only somebody who has the gradebook can compute it
            drawn = hmac.digest(self._secret, run.encode(), "sha256")
            seed = int.from_bytes(drawn) % 2**PROBE_SEED_BITS
        submission.key, submission.probe_seed = content_digest([run, seed]), seed
        submission.digest = submission_digest(submission, content)

    def _run(self, submission: Submission, pool: runner.Pool, marker: Marker) -> None:
        """Run a submission, or take what came back from the run of equal content that the gradebook has.

        If there are no notebooks of the course, nothing is run.
        """
        if known := self._gradebook.find(submission.key):
            run = graded_run.submission_of(known.run)
            submission.answers, submission.cell_reports = run.answers, run.cell_reports
            submission.ended, submission.evidence, submission.has_run = run.ended, run.evidence, False
            return
        marker.warm_up()
        if not submission.handed_in:
            return
        bundle, settings = submission.bundle, self._settings
        job = runner.Job(
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
        files, submission.ended = pool.run(runner.run, bundle.packed, job)
        cells = {(name, cell["id"]) for name, notebook in job.notebooks.items() for cell in notebook["cells"]}
        submission.answers = files.get(ANSWERS_FILE)
        submission.cell_reports = schema.read_reports(files.get(REPORTS_FILE, b"")).of(cells)
        submission.evidence = files.get(EVIDENCE_FILE, b"")

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


def _unchanged(submission: Submission, current: Graded) -> Submission:
    """Return a submission with the run and the marks that counted before, as nothing about it has changed."""
    submission.graded, submission.has_run, submission.is_new = current, False, False
    return submission


def _code_digest() -> str:
    """Return the digest of all modules of labcourse; submissions are prepared again when one changes."""
    digest = hashlib.sha256()
    for path in sorted(Path(labcourse.__file__).parent.rglob("*.py")):
        digest.update(f"{path} ".encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


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


def _stored(runs: Mapping[str, EarlierRun], named: Callable[[str], Collection[str] | None]) -> list[Submission]:
    """Return a submission without pieces for each student of an earlier gradebook, with the partner who handed in.

    The files are in the gradebook already.

    Parameters
    ----------
    runs : ID of each student → what to know of their run
    named : function of a student's ID: returns the students whom their ``course.json`` names; None without files
    """
    submissions = []
    for student, run in runs.items():
        bench_of = run.bench_of or student
        # The bench may be the student's own, although a partner handed in.
        same_bench = (one for one, other in runs.items() if other.has_files and other.bench_of == run.bench_of)
        partners = (one for one in same_bench if caseless(student) in map(caseless, named(one) or ()))
        partner = student if run.has_files else next(partners, bench_of)
        submission = Submission(student=student, bench_of=bench_of)
        if partner != student:
            submission.claimed_by = partner
            submission.notes.append(Problem.of(Code.HANDED_IN_BY_PARTNER, partner=partner))
        submissions.append(submission)
    return submissions


# --- what the gradebook has of earlier submissions --------------------------------------------------------------------


def store_submission(gradebook: Gradebook, submission: Submission) -> list[str]:
    """Store the files of a submission that are not in the gradebook yet.

    If a partner handed in for this student, the files stay the partner's.

    Parameters
    ----------
    gradebook : where it is stored
    submission : as it was read

    Returns
    -------
    list
        Names of the files that were handed in before, by the student or by that partner.
    """
    students = filter(None, (submission.student, submission.claimed_by))
    earlier = [name for student in students for name, *_about in gradebook.stored(student)]
    if not submission.claimed_by:
        gradebook.deliver(submission.student, submission.items)
    return earlier


def delivered(gradebook: Gradebook, submission: Submission, masters: Mapping[str, intake.Master]) -> list[Delivery]:
    """Return the files that were handed in for a student until now. Two versions of a partner's file may be among them.

    A partner's files replace the student's own of the same names, whatever their times; but no notebook that the
    student handed in themselves with something written in it.

    Parameters
    ----------
    gradebook, submission : as for :func:`store_submission`
    masters : file name → cells of the course's notebooks
    """
    own = gradebook.delivered(submission.student)
    if not submission.claimed_by:
        return own
    answered = {one.name for one in own if one.name in masters and intake.is_answered(one, masters[one.name])}
    partners = [*gradebook.delivered(submission.claimed_by), *submission.items]
    partners = [one for one in partners if one.name not in answered]
    names = {one.name for one in partners}
    return [*partners, *(one for one in own if one.name not in names)]


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
        if piece.owner.is_decided:
            reason = Problem.of(Code.GIVEN_TO_OWNER, piece.source, owner=owner)
            for student in gradebook.delete_of_others(piece.source, piece.received, owner):
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
    anew = set(map(caseless, again))
    erased = {
        student: f"{when:%Y-%m-%d}"
        for student, when in gradebook.persons.erased(sorted(named)).items()
        if caseless(student) not in anew
    }
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
