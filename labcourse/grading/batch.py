"""Grade a class: from submissions to marks in the gradebook.

Each submission is read, prepared, identified, run in a sandbox, explained, marked and stored, in this order, by the
methods of :class:`Batch` of these names. Submissions are independent: whatever one does, the others are graded. A
submission that is done is in the gradebook at once. Equal content is not run again: a run is identified by the content
of all that it depends on.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import labcourse
from labcourse.answers import report_files, schema
from labcourse.answers.catalogue import Catalogue
from labcourse.benches import REAL
from labcourse.errors import AnswerError, CourseError, GradingError, IsolationError
from labcourse.files import COURSE_FILE
from labcourse.grading import graded_run, intake
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Delivery, EarlierRun, Gradebook, Graded, RunRecord
from labcourse.grading.graded_run import Facts, facts_of
from labcourse.grading.marking import marking
from labcourse.grading.marking.marking_processes import Marker, marking_digest
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.grading.running import runner
from labcourse.grading.running.bundle import Bundle, Bundles
from labcourse.grading.running.prepared import Prepared, content_digest, prepare
from labcourse.grading.running.supplied import Supplied, values_for
from labcourse.grading.settings import Assignment
from labcourse.problems import Code, Problem, Reason, Where
from labcourse.run.reasons import explain
from labcourse.student_id import caseless

ISOLATED, NOT_ISOLATED = "Run in isolation.", "Run without isolation."
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
    again : IDs of persons who were erased, and begin anew
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
    decisions: intake.Decisions = field(default_factory=dict)
    only: Assignment | None = None
    platform: str = ""


@dataclass(frozen=True)
class GradedSubmission:
    """A submission that is graded and stored.

    Attributes
    ----------
    graded : its run and marks, as in the gradebook
    ran : whether it was run just now; else the gradebook had the run already
    new : whether its marks were made just now
    before : the run and the marks that counted before; None without any
    """

    graded: Graded
    ran: bool
    new: bool = True
    before: Graded | None = None


class Batch:
    """The submissions of a class, to be graded together.

    Parameters
    ----------
    submissions : folder that holds a folder or a zip for each student; or, to grade what the gradebook holds of an
        earlier one, ID of each student → what to know of their run
    course : the course, with its key
    gradebook : where results are stored
    settings : how to grade

    Attributes
    ----------
    ignored : why something among the submissions is not taken in
    sources : what was read, to which rows of ``intake.csv`` belong: archives, folders, files, and students
    absent : students of the gradebook's roster who have not handed in anything
    doubts : what an instructor may decide otherwise; complete when all are graded
    left_out : notebooks that are not taken, as they are of another assignment; complete as above

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
        self._submissions = [*taken, *take_from_earlier_owners(gradebook, taken), *no_longer_named(gradebook, taken)]
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
        self.doubts = [doubt for doubt in collected.doubts if doubt.about != intake.TIME_RECEIVED or time_matters]
        self.left_out: list[Problem] = []
        present = {caseless(student) for student in (*self.students, *gradebook.handed_in())}
        self.absent = [student.student for student in roster if caseless(student.student) not in present]

    @property
    def students(self) -> list[str]:
        """IDs of the students with a submission to grade."""
        return [submission.student for submission in self._submissions]

    def grade(self) -> Iterator[GradedSubmission]:
        """Grade all submissions. Yield each as soon as it is in the gradebook.

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
            waiting = iter(self._submissions)
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

    def _grade(self, submission: intake.Submission, pool: runner.Pool, marker: Marker) -> GradedSubmission:
        """Grade one submission; only IsolationError is raised, and any other error becomes a failed grading."""
        current = self._gradebook.current(submission.student)
        try:
            read = self._read(submission)
            if current and (current.key_digest, current.run.prepared_from) == (
                self._key_digest,
                self._prepared_from(submission, read),
            ):
                return GradedSubmission(current, ran=False, new=False, before=current)
            prepared = self._prepare(submission, read)
            run = self._identify(submission.student, prepared)
            identity = (run.key, run.submission, self._key_digest)
            if current and (current.run.key, current.run.submission, current.key_digest) == identity:
                self._gradebook.note_prepared(run.key, run.prepared_from)
                return GradedSubmission(current, ran=False, new=False, before=current)
            known = self._gradebook.find(run.key)
            if known is None:
                marker.warm_up()
                run = self._run(run, prepared, pool)
            else:
                run = replace(run, answers=known.run.answers, cells=known.run.cells)
            run = self._explain(run, prepared)
            return GradedSubmission(self._mark(run, prepared, marker), ran=known is None, before=current)
        except IsolationError:
            raise
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            return GradedSubmission(self._failed(submission.student, error), ran=True, before=current)

    def _read(self, submission: intake.Submission) -> intake.ReadSubmission:
        """Read the files of a submission."""
        owner, decisions = submission.claimed_by or submission.student, self._settings.decisions
        read_files = partial(intake.read, packages=self._course.packages, reports=self._reports, decisions=decisions)
        before = partial(self._gradebook.delivered, owner)
        read = read_files(submission, self._bundles.names, self._masters, earlier=before)
        self.doubts += read.doubts
        self._leave_out_others(read, {name: digest for name, digest, *_ in self._gradebook.stored(owner)})
        return read

    def _leave_out_others(self, read: intake.ReadSubmission, before: Mapping[str, str]) -> None:
        """Leave out the notebooks of other assignments that the student has handed in before.

        Parameters
        ----------
        read : what was read of a submission
        before : name of a file that the student handed in before → digest of its newest version
        """
        if (only := self._settings.only) is None:
            return
        others = {*self._bundles.names} - {f"{name}.ipynb" for name in only.notebooks}
        for one in [item for item in read.items if item.name in others and item.name in before]:
            read.items.remove(one)
            if one.digest != before[one.name]:
                note = Problem.of(Code.OTHER_ASSIGNMENT, one.name, source=one.source, title=only.title)
                read.notes.append(note)
                self.left_out.append(note)

    def _prepared_from(self, submission: intake.Submission, read: intake.ReadSubmission) -> str:
        """Return the digest of all that a submission is prepared from: it is prepared again only if this changes.

        These are the course, the program, the settings, the content of all files that are read, what is said about
        them, and the files that the gradebook has of the student.
        """
        about = {**vars(submission), **vars(read), "pieces": 0, "items": 0, "doubts": 0, "names": sorted(read.names)}
        about["unconfirmed"] = self._waits(submission)
        files = [(item.name, item.digest, item.received, item.source, item.clock) for item in read.items]
        stored = [self._gradebook.stored(one) for one in (submission.student, submission.claimed_by) if one]
        return content_digest([self._basis, about, files, stored])

    def _waits(self, submission: intake.Submission) -> dict[str, list[str]]:
        """Return the notebooks of others who name this student as a partner, unconfirmed: file name → their IDs."""
        waits: dict[str, list[str]] = {}
        for piece in submission.unconfirmed:
            read = intake.read(replace(submission, pieces=(piece,)), self._bundles.names, self._masters)
            for name in {item.name for item in read.items} & {*self._bundles.names}:
                waits.setdefault(name, []).append(piece.owner.students[0])
        return waits

    def _prepare(self, submission: intake.Submission, read: intake.ReadSubmission) -> Prepared:
        """Store the new files of a submission, and prepare for the run what counts: the newest of each notebook."""
        names = self._bundles.names
        earlier = store_submission(self._gradebook, submission, read)
        basis = self._prepared_from(submission, read)  # what another program stores from now on is new the next time
        hand_in, arrivals = intake.newest(
            delivered(self._gradebook, submission, read, self._masters), names, self._reports, unread=read.unread
        )
        chosen = self._bundles.choose(hand_in)
        catalogue = chosen.bundle.catalogue
        wanted = {f"{catalogue.everything[question].notebook}.ipynb" for question, _part in chosen.bundle.asked_parts}
        arrivals = [note for note in arrivals if note.code is not Code.NOT_HANDED_IN or note.where in wanted]
        prepared = prepare(
            hand_in,
            chosen.bundle,
            self._course.catalogue,
            submission.bench_of or submission.student,
            every_cell=self._settings.every_cell,
            supplied=self._supplied(submission.student),
        )
        unread = read.problems(earlier) if submission.pieces else ()
        problems = (*submission.problems, *unread, *chosen.problems, *prepared.problems)
        notes = (*submission.notes, *read.notes, *arrivals, *chosen.notes, *prepared.notes)
        waits = self._waits(submission)
        return replace(prepared, problems=problems, notes=notes, python=read.python, prepared_from=basis, waits=waits)

    def _identify(self, student: str, prepared: Prepared) -> RunRecord:
        """Make the record of a run before it is run; its key is a digest of all that the run depends on.

        The probe seed is the settings', or else drawn from the gradebook's secret.
        """
        settings = self._settings
        content = content_digest([student, prepared.run_content(), self._how])
        seed = settings.probe_seed
        if seed is None:  # only somebody who has the gradebook can compute it
            drawn = hmac.digest(self._secret, content.encode(), "sha256")
            seed = int.from_bytes(drawn) % 2**PROBE_SEED_BITS
        return self._run_record(
            student,
            prepared.bundle,
            key=content_digest([content, seed]),
            submission=prepared.digest(),
            probe_seed=seed,
            claim=dict(prepared.claim or {}),
            words=graded_run.words_as_json(prepared.words),
            supplied=prepared.supplied,
            release=prepared.bundle.release,
            files=tuple(prepared.files),
            prepared_from=prepared.prepared_from,
        )

    def _run_record(self, student: str, bundle: Bundle, **fields: Any) -> RunRecord:
        """Make the record of a run, or of a failed grading without a run; ``fields`` are the record's other fields."""
        isolation = ISOLATED if self._settings.isolated else NOT_ISOLATED
        software = f"labcourse {labcourse.__version__}"
        return RunRecord(student=student, master=bundle.digest, software=software, isolation=isolation, **fields)

    def _run(self, run: RunRecord, prepared: Prepared, pool: runner.Pool) -> RunRecord:
        """Run a submission. Return its record with the answers, and with what its cells reported.

        Without notebooks nothing is run, and the record is returned unchanged.
        """
        if not prepared.handed_in:
            return run
        bundle, settings = prepared.bundle, self._settings
        job = runner.Job(
            student=prepared.bench_of,
            notebooks=prepared.merged.notebooks,
            probe_seed=run.probe_seed,
            parameters=bundle.parameters,
            imports=bundle.imports,
            files=prepared.files,
            limits=settings.limits,
            isolated=settings.isolated,
            evidence=self._course.evidence if bundle.policy.which == REAL else "",
        )
        result = pool.run(runner.run, bundle.packed, job)
        cells = {(name, cell["id"]) for name, notebook in job.notebooks.items() for cell in notebook["cells"]}
        reports = schema.read_reports(result.reports).of(cells)
        facts = Facts(reports=reports, ended=result.problems, evidence=result.evidence)
        return replace(run, answers=result.answers, cells=facts.as_json())

    def _explain(self, run: RunRecord, prepared: Prepared) -> RunRecord:
        """Return the run with all messages: what stopped, why answers are missing, and which reports are PDFs."""
        facts, bundle, catalogue = facts_of(run), prepared.bundle, self._course.catalogue
        documents = report_files.of_files(prepared.reports, catalogue)
        locked = [
            Problem.of(Code.MAY_ASK_FOR_PASSWORD, pdf.report, name=pdf.name)
            for pdf in documents.values()
            if pdf.encrypted
        ]
        has_syntax_error = any(cell.error and cell.error.type == "SyntaxError" for cell in facts.reports.cells)
        reasons = explain(
            bundle.pristine,
            prepared.merged,
            facts.reports,
            (graded_run.recorded_in(run.answers) | set(prepared.words)) - graded_run.supplied_parts(run),
            bundle.catalogue,
            handed_in=prepared.handed_in,
            claim=prepared.claim,
            seconds=self._settings.limits.cell if facts.ended else None,
            python=prepared.python if has_syntax_error else None,
        )
        stops = (*reasons.stops, *reasons.harmless)
        ended = [problem for problem in facts.ended if not runner.is_covered_by_cells(problem, stops)]
        absent = _not_there(prepared, catalogue)
        missing = {**absent, **reasons.missing}
        waits = [where for where in absent if f"{catalogue.marked[where[0]].notebook}.ipynb" in prepared.waits]
        names = sorted({name for partners in prepared.waits.values() for name in partners})
        confirm = Problem.of(Code.CONFIRMATION_NEEDED, names=names)
        additional = {
            "problems": (
                *([confirm] if waits else []),
                *prepared.problems,
                *ended,
                *locked,
                *reasons.stops,
                *reasons.lost,
            ),
            "notes": (*prepared.notes, *(document.note for document in documents.values()), *reasons.harmless),
            "missing": [(*where, reason) for where, reason in missing.items()],
            "asked": self._asked(bundle),
            "bench_of": prepared.bench_of,
            "policy": bundle.policy,
            "reports_in_pdf": documents,
            "untouched": prepared.untouched,
            "waits": waits,
        }
        facts = facts.model_copy(update=additional)
        return replace(run, problems=facts.problems, notes=facts.notes, cells=facts.as_json())

    def _mark(self, run: RunRecord, prepared: Prepared, marker: Marker) -> Graded:
        """Mark a run by the key; give no points if nothing of the course could be read in the submission."""
        if prepared.handed_in or prepared.reports:
            return graded_run.mark(run, marker, self._key_digest)
        reason = Problem.of(Code.NOTHING_READ)
        marks = self._no_points(reason, Status.MISSING, prepared.bundle)
        return Graded(run, graded_run.with_unconfirmed(marks, facts_of(run)), self._key_digest)

    def _store(self, done: GradedSubmission) -> GradedSubmission:
        """Store a submission's marks, if they are new; return it with the marks that count."""
        if not done.new:
            return done
        reason = "run" if done.ran else "marked again"
        return replace(done, graded=_record(self._gradebook, done.graded, "labcourse grade", reason))

    def _failed(self, student: str, error: Exception) -> Graded:
        """Return what to store if grading fails: the student's marks so far, or marks that say "not marked".

        The key's digest is "", so that the submission is graded again the next time.
        """
        fault = f"{type(error).__name__}: {error}"
        supplied = {value.name: value.value for value in self._supplied(student)}  # so that they are not lost
        current = self._gradebook.current(student)
        if current is not None and not graded_run.is_failed(current.run):
            stays = Problem.of(Code.EARLIER_MARKS_STAY, error=fault)
            problems = dict.fromkeys((*facts_of(current.run).problems, stays))
            return Graded(replace(current.run, problems=tuple(problems), supplied=supplied), current.marks, "")
        bundle = self._bundles.current
        key = f"failed: {student}"
        run = self._run_record(student, bundle, key=key, submission="", probe_seed=0, supplied=supplied)
        marks = self._no_points(Problem.of(Code.NOT_GRADED), Status.NOT_MARKED, bundle)
        return Graded(replace(run, problems=(Problem.of(Code.GRADING_FAILED, error=fault),)), marks, "")

    def _supplied(self, student: str) -> list[Supplied]:
        """Return the values for a student's missing answers: those in the gradebook, and those of the settings."""
        current = self._gradebook.current(student)
        earlier = current.run.supplied if current else {}
        return values_for(student, earlier, self._settings.supplied, self._course.catalogue)

    def _asked(self, bundle: Bundle) -> list[tuple[str, str]] | None:
        """Return the (question, part) that a release asks for; None if that is the whole course."""
        if bundle.release != self._bundles.current.release:
            return sorted(bundle.asked_parts)
        asked = self._course.asked_catalogue
        if asked is asked.whole:
            return None
        # The class may get another notebook later. This work was not asked for it.
        return [(number, name) for number, question in asked.marked.items() for name in question.names]

    def _no_points(self, reason: Problem, status: Status, bundle: Bundle) -> tuple[Mark, ...]:
        """Return marks without points for all that the release asks."""
        return marking.nothing_earned(self._course, reason, status, marking.Context(asked_parts=self._asked(bundle)))


def _code_digest() -> str:
    """Return the digest of this package's modules, by which submissions are prepared."""
    digest = hashlib.sha256()
    for path in sorted(Path(labcourse.__file__).parent.rglob("*.py")):
        digest.update(f"{path} ".encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _not_there(prepared: Prepared, catalogue: Catalogue) -> dict[Where, Problem]:
    """Return why there are no answers in notebooks that are not there or cannot be read: (question, part) → why."""
    why: dict[Where, Problem] = {}
    for number, question in catalogue.marked.items():
        notebook = f"{question.notebook}.ipynb"
        if notebook not in prepared.handed_in:
            is_unread = intake.is_unread(notebook, prepared.problems)
            code = Code.NOTEBOOK_OF_IT_UNREAD if is_unread else Code.NOTEBOOK_OF_IT_ABSENT
            why |= {(number, part): Problem.of(code, notebook) for part in question.names}
    return why


def _record(gradebook: Gradebook, graded: Graded, actor: str, reason: str) -> Graded:
    """Store a submission's run and marks in one transaction. Return them as they count: marks by persons stay.

    Parameters
    ----------
    gradebook : where they are stored
    graded : the submission
    actor : who changes marks, for the audit trail
    reason : why
    """
    gradebook.record(graded, actor=actor, reason=reason)
    return gradebook.current(graded.run.student) or graded


def _stored(runs: Mapping[str, EarlierRun], named: Callable[[str], Collection[str] | None]) -> list[intake.Submission]:
    """Return a submission for each student; the files are in the gradebook, as theirs or as their partner's.

    Parameters
    ----------
    runs : ID of each student → what to know of their run
    named : function that returns the students whom the ``course.json`` of a student names
    """
    submissions = []
    for student, run in runs.items():
        bench_of = run.bench_of or student
        # The bench may be the student's own, although a partner handed in.
        partners = (one for one, other in runs.items() if other.has_files and other.bench_of == run.bench_of)
        of_both = (one for one in partners if caseless(student) in map(caseless, named(one) or ()))
        partner = student if run.has_files else next(of_both, bench_of)
        submission = intake.Submission(student, bench_of=bench_of)
        if partner != student:
            note = Problem.of(Code.HANDED_IN_BY_PARTNER, partner=partner)
            submission = replace(submission, claimed_by=partner, notes=(note,))
        submissions.append(submission)
    return submissions


# --- what the gradebook has of earlier submissions --------------------------------------------------------------------


def store_submission(gradebook: Gradebook, submission: intake.Submission, contents: intake.ReadSubmission) -> list[str]:
    """Store the files of a submission that are not in the gradebook yet.

    If a partner handed in for this student, the files stay the partner's.

    Parameters
    ----------
    gradebook : where it is stored
    submission : as it was found
    contents : its content

    Returns
    -------
    list
        Names of the files that were there before.
    """
    students = filter(None, (submission.student, submission.claimed_by))
    earlier = [name for student in students for name, *_about in gradebook.stored(student)]
    if not submission.claimed_by:
        gradebook.deliver(submission.student, contents.items)
    return earlier


def delivered(
    gradebook: Gradebook,
    submission: intake.Submission,
    contents: intake.ReadSubmission,
    masters: Mapping[str, intake.Master],
) -> list[Delivery]:
    """Return all files that were handed in for a student until now; parameters as for :func:`store_submission`.

    What a partner handed in, whatever its time, replaces no notebook in which the student wrote something and that they
    handed in themselves. ``masters`` are the course's notebooks, by file name.
    """
    own = gradebook.delivered(submission.student)
    if not submission.claimed_by:
        return own
    answered = {one.name for one in own if one.name in masters and intake.is_answered(one, masters[one.name])}
    partners = [*gradebook.delivered(submission.claimed_by), *contents.items]
    partners = [one for one in partners if one.name not in answered]
    names = {one.name for one in partners}
    return [*partners, *(one for one in own if one.name not in names)]


def students_named_before(gradebook: Gradebook, student: str) -> list[str] | None:
    """Return whom the ``course.json`` that a student handed in last names; None if the student handed in nothing.

    Somebody who names this student as a partner should be among them.
    """
    delivered = {delivery.name: delivery for delivery in gradebook.delivered(student, notebooks=False)}
    if not delivered:
        return None
    return intake.students_in(delivered[COURSE_FILE].content) if COURSE_FILE in delivered else []


def take_from_earlier_owners(gradebook: Gradebook, submissions: Sequence[intake.Submission]) -> list[intake.Submission]:
    """Delete files that are stored as one student's, and are another's as the instructor decided.

    The owner gets them when the submission is stored.

    Returns
    -------
    list
        An empty submission for each earlier owner without a submission now, so that their marks are made anew.
    """
    present = {caseless(submission.student) for submission in submissions}
    emptied: dict[str, intake.Submission] = {}
    for owner, piece in ((submission.student, piece) for submission in submissions for piece in submission.pieces):
        if piece.owner.is_decided:
            reason = Problem.of(Code.GIVEN_TO_OWNER, piece.source, owner=owner)
            for student in gradebook.delete_of_others(piece.source, piece.received, owner):
                emptied[student] = intake.Submission(student, problems=(reason,))
    return [submission for student, submission in emptied.items() if caseless(student) not in present]


def no_longer_named(gradebook: Gradebook, submissions: Sequence[intake.Submission]) -> list[intake.Submission]:
    """Return an empty submission for each student who waits to be confirmed as a partner, and is not named any more.

    Their marks are made anew, since nobody would be asked about them.
    """
    present = {caseless(submission.student) for submission in submissions}
    before = (students_named_before(gradebook, one.student) or () for one in submissions if one.pieces)
    names = {caseless(name) for named in before for name in named} - present
    current = filter(None, map(gradebook.current, sorted(names)))
    return [intake.Submission(one.run.student) for one in current if facts_of(one.run).waits]


def leave_out_erased(
    gradebook: Gradebook, submissions: Sequence[intake.Submission], again: Sequence[str]
) -> tuple[list[intake.Submission], list[Problem]]:
    """Leave out the submissions of persons who were erased.

    Parameters
    ----------
    gradebook : which knows who was erased
    submissions : in the class's folder
    again : IDs of erased persons who are taken in again, as new persons

    Returns
    -------
    tuple
        the other submissions, and a problem for each erased person who is in a submission
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


# --- marking again ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Regraded:
    """A student's marks before and after.

    Attributes
    ----------
    before, after : as in the gradebook
    problem : why they could not be marked again; "" where they could
    unchanged : marks by persons, which stay, where the key gives other points: question, part, "points", and "by_key"
    """

    before: Graded
    after: Graded
    problem: str = ""
    unchanged: tuple[dict[str, Any], ...] = ()


def regrade(gradebook: Gradebook, course: Course, questions: Collection[str] = (), jobs: int = 1) -> Iterator[Regraded]:
    """Mark all students' stored answers by the key as it is now. If that fails for a student, their marks stay.

    Parameters
    ----------
    gradebook : with the answers
    course : the course, with its key
    questions : numbers of the questions to mark again; all if there are none
    jobs : submissions to mark at a time

    Raises
    ------
    GradingError
        If the gradebook has no answers, or the key does not have one of the questions.

    Yields
    ------
    Regraded
        Each student's marks before and after.
    """
    for number in questions:
        try:
            course.catalogue.find_marked(number)
        except AnswerError as error:
            raise GradingError(str(error)) from None
        if number not in course.key:
            raise GradingError(f"The key has no question {number}.")
    with Marker(course, jobs) as marker, ThreadPoolExecutor(jobs) as threads:
        current = list(gradebook.all_current())
        if not current:
            raise GradingError("There is nothing in the gradebook to mark again.")
        digest = marking_digest(course)
        for regraded in threads.map(lambda graded: _marked_again(graded, marker, questions, digest), current):
            yield regraded if regraded.problem else _store_regraded(gradebook, regraded, questions)


def _marked_again(graded: Graded, marker: Marker, questions: Collection[str], digest: str) -> Regraded:
    """Mark a student's stored answers anew, without storing anything. Parameters as for :func:`regrade`.

    Only the marks of the chosen questions change; ``digest`` is that of the key as it is now.
    """
    run = graded.run
    if run.answers is None and not run.words and not facts_of(run).reports_in_pdf:
        return Regraded(graded, graded)  # nothing could be read of it, or it could not be run
    try:
        after = graded_run.mark(run, marker, digest)
    except CourseError as error:
        return Regraded(graded, graded, str(error))
    if questions:
        new = {mark.where: mark for mark in after.marks if mark.question in questions}
        marks = [new.pop(mark.where, mark) for mark in graded.marks]
        # The other marks are still by the earlier key, so its digest stays: the next grading marks them again.
        after = replace(graded, marks=(*marks, *new.values()))
    return Regraded(graded, after)


def _store_regraded(gradebook: Gradebook, regraded: Regraded, questions: Collection[str]) -> Regraded:
    """Store the new marks. Return them as they count, with the marks by persons that stay."""
    reason = f"marked again: {', '.join(questions) or 'all questions'}"
    after = _record(gradebook, regraded.after, "labcourse regrade", reason)
    by_key = {mark.where: mark.points for mark in regraded.after.marks if mark.status not in UNDECIDED}
    unchanged = tuple(
        {"question": mark.question, "part": mark.part, "points": mark.points, "by_key": by_key[mark.where]}
        for mark in after.marks
        if mark.status == Status.BY_A_PERSON and by_key.get(mark.where, mark.points) != mark.points
    )
    return replace(regraded, after=after, unchanged=unchanged)
