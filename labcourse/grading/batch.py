"""A class from submissions to marks in the gradebook.

Submissions are independent of each other: whatever one does, the others are graded. What is done is in the gradebook
at once, and is not run again: a run is known by the content of all that it depends on.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, tzinfo
from itertools import islice
from pathlib import Path
from typing import Any

import labcourse
from labcourse.answers import cell_reports, report_files
from labcourse.answers.cell_reports import Reports
from labcourse.benches import REAL
from labcourse.errors import GradingError, IsolationError
from labcourse.grading import stages
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded, MarkRecord, RunRecord
from labcourse.grading.graded_run import (
    FAILED,
    Facts,
    facts_of,
    mark_records,
    plain_words,
    recorded_in,
    supplied_parts,
    to_be_marked,
    with_messages,
)
from labcourse.grading.marking import marking
from labcourse.grading.marking.digest import marking_digest
from labcourse.grading.marking.marking import About
from labcourse.grading.marking.marking_processes import Marker
from labcourse.grading.running import counted_pages, executors, intake, runner
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.bundles import Bundles
from labcourse.grading.running.executors import Pool
from labcourse.grading.running.intake import Decisions, Submission, newest
from labcourse.grading.running.prepared import Prepared, prepare
from labcourse.grading.running.runner import Job, Limits
from labcourse.grading.running.supplied import Supplied, together
from labcourse.grading.verdicts import Status
from labcourse.run.portability import Version
from labcourse.run.reasons import explain
from labcourse.student_id import caseless

ISOLATED, NOT_ISOLATED = "Run in isolation.", "Run without isolation."
PROBE_SEED_BITS = 48  #: not to be guessed, and exact as a float
ACTOR = "labcourse grade"  #: who changes marks here, in the audit trail
_NOTHING_READ = "Nothing of the course could be read in what you handed in."
_OUR_FAULT = "Grading failed; ask your instructor."


@dataclass(frozen=True)
class Settings:
    """How a class is graded.

    Attributes
    ----------
    limits : on what a submission may take
    jobs : submissions at a time, on this machine
    scheduler : address of a dask.distributed scheduler, to run them on its workers instead
    probe_seed : for the inputs on which functions are tried; drawn from the gradebook's secret unless given
    isolated : in a sandbox, or with the rights of whoever grades
    every_cell : run the cells that only show something, too
    supplied : values in place of missing answers
    times : name of what lies among the submissions, or a student's, → when it was handed in
    zone : of times in names and in zips, which do not say theirs
    again : IDs of persons who were erased, and begin anew
    decisions : what the instructor decided of submissions (``intake.csv``)
    """

    limits: Limits = field(default_factory=Limits)
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


@dataclass(frozen=True)
class Step:
    """A submission that is done.

    Attributes
    ----------
    graded : what is in the gradebook of it
    ran : whether it was run just now; else it was known
    new : whether its marks were made just now
    """

    graded: Graded
    ran: bool
    new: bool = True


class Batch:
    """The submissions of a class, to be graded together.

    Parameters
    ----------
    submissions : folder that holds a folder or a zip for each student
    course : the course, with its key
    gradebook : where results go
    settings : how

    Attributes
    ----------
    ignored : a message on what lies among the submissions and is none
    absent : students of the gradebook's roster who have not handed in anything
    doubts : what an instructor may decide otherwise; complete when all are graded

    Raises
    ------
    GradingError
        If there is nothing to grade, or nothing to grade it by.
    """

    def __init__(
        self, submissions: Path, course: Course, gradebook: Gradebook, settings: Settings | None = None
    ) -> None:
        self._settings = settings or Settings()
        roster = [one for one in gradebook.students() if one.enrolled]
        self._gradebook = gradebook
        known = stages.named_in(gradebook)
        times, zone, decisions = self._settings.times, self._settings.zone, self._settings.decisions
        found = intake.find(submissions, roster, times, zone, known, decisions)
        self._submissions, erased = stages.without_erased(gradebook, found.submissions, self._settings.again)
        self._submissions += stages.given_over(gradebook, self._submissions)
        lateness_counts = course.settings.deadlines and course.settings.late.per_day
        self.doubts = [one for one in found.doubts if one.about != intake.TIME or lateness_counts]
        self.ignored = [*found.ignored, *erased]
        self._course, self._key_digest = course, marking_digest(course)
        self._bundles = Bundles(course)
        self.ignored += self._bundles.releases.problems
        self._masters = {
            name: {cell["id"]: cell for cell in notebook["cells"]}
            for name, notebook in self._bundles.current.pristine.items()
        }
        self._reports = list(report_files.names(course.catalogue).values())
        self._secret = gradebook.secret()
        there = {caseless(one.student) for one in self._submissions}
        there |= {caseless(one) for one in gradebook.handed_in()}
        self.absent = [one.student for one in roster if caseless(one.student) not in there]

    @property
    def students(self) -> list[str]:
        """IDs of those whose hand-ins are there."""
        return [one.student for one in self._submissions]

    def __len__(self) -> int:
        return len(self._submissions)

    def grade(self) -> Iterator[Step]:
        """Grade all, and give each as soon as it is in the gradebook.

        Raises
        ------
        IsolationError
            If submissions cannot be isolated; what was graded until then stays.
        """
        with ExitStack() as stack:
            pool = stack.enter_context(self._pool())
            marker = stack.enter_context(Marker(self._course, pool.capacity))
            graders = stack.enter_context(ThreadPoolExecutor(pool.capacity, thread_name_prefix="labcourse-grade"))
            coming = iter(self._submissions)
            # No more are begun than can run at a time, so that a large class takes no more memory than a small one.
            busy = {graders.submit(self._grade, one, pool, marker) for one in islice(coming, pool.capacity)}
            try:
                while busy:
                    done, busy = wait(busy, return_when=FIRST_COMPLETED)
                    steps = [future.result() for future in done]  # without isolation, nothing more is begun
                    busy |= {graders.submit(self._grade, one, pool, marker) for one in islice(coming, len(done))}
                    for step in steps:
                        yield self._keep(step)
            finally:  # on an interrupt, too: end what is running
                pool.stop()

    def _pool(self) -> AbstractContextManager[Pool]:
        scheduler = self._settings.scheduler
        return executors.local(self._settings.jobs) if scheduler is None else executors.cluster(scheduler)

    def _keep(self, step: Step) -> Step:
        if not step.new:
            return step
        self._gradebook.record(step.graded, actor=ACTOR, reason="run" if step.ran else "marked again")
        # As it is in the gradebook: there, a mark that a person gave has stayed.
        return replace(step, graded=self._gradebook.current(step.graded.run.student) or step.graded)

    def _grade(self, submission: Submission, pool: Pool, marker: Marker) -> Step:
        """Grade one submission, whatever happens, unless it cannot be isolated."""
        try:
            taken = self._taken_in(submission)
            record = self._identity(taken)
            current = self._gradebook.current(submission.student)
            if current and _is_known(current, record, self._key_digest):
                return Step(current, ran=False, new=False)
            known = self._gradebook.find(record.key)
            if known is None:
                marker.warm_up()
                ran = self._run(record, taken, pool)
            else:
                facts = facts_of(known.run)
                ran = _Ran(known.run.answers, facts.ended, facts.reports, facts.evidence)
            return Step(self._marked(self._explained(record, ran, taken, pool), taken, marker), known is None)
        except IsolationError:
            raise
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            return Step(self._failed(submission.student, error), ran=True)

    def _taken_in(self, submission: Submission) -> _Taken:
        """Read a submission, keep what is new of it, and make ready what counts: of each notebook the newest."""
        packages, decisions = self._course.packages, self._settings.decisions
        read = intake.read(submission, self._bundles.names, self._masters, packages, self._reports, decisions)
        self.doubts += [doubt for one in read for doubt in one.doubts]
        earlier, delivered = stages.kept(self._gradebook, submission, read)
        problems = [*submission.problems, *intake.problems(read, earlier)]
        notes = [*submission.notes, *intake.notes(read)]
        hand_in, said = newest(delivered, self._bundles.names, self._reports)
        chosen = self._bundles.of(hand_in)
        student = submission.bench_of or submission.student
        supplied = self._supplied(submission.student)
        prepared = prepare(hand_in, chosen.bundle, self._course.catalogue, student, self._settings.every_cell, supplied)
        said += [f"Your instructor supplied {one.name} = {one.value}." for one in supplied]
        return _Taken(
            submission,
            prepared,
            chosen.bundle,
            {one.name: one.value for one in supplied},
            (*problems, *chosen.problems, *prepared.problems),
            (*notes, *said, *chosen.notes, *prepared.notes),
            max((python for one in read for python in one.pythons if python), default=None),
        )

    def _identity(self, taken: _Taken) -> RunRecord:
        """What a submission's run is known by: equal content has been run already."""
        settings, student = self._settings, taken.submission.student
        how = [asdict(settings.limits), settings.isolated, settings.every_cell]
        what = [student, taken.bench_of, taken.prepared.content()]
        content = _digest([what, taken.bundle.digest, labcourse.__version__, how])
        seed = settings.probe_seed
        if seed is None:  # nobody can know it who does not have the gradebook
            drawn = hmac.digest(self._secret, content.encode(), "sha256")
            seed = int.from_bytes(drawn) % 2**PROBE_SEED_BITS
        return RunRecord(
            key=_digest([content, seed]),
            student=student,
            submission=_digest([taken.prepared.digest(), taken.problems, taken.notes]),
            master=taken.bundle.digest,
            software=f"labcourse {labcourse.__version__}",
            probe_seed=seed,
            isolation=ISOLATED if settings.isolated else NOT_ISOLATED,
            claim={} if taken.prepared.claim is None else dict(taken.prepared.claim.cells),
            words=plain_words(taken.prepared.words),
            supplied=taken.supplied,
            release=taken.bundle.release,
            files=tuple(taken.prepared.files),
        )

    def _run(self, record: RunRecord, taken: _Taken, pool: Pool) -> _Ran:
        """Run a submission, and what its run left."""
        if not taken.prepared.handed_in:
            return _Ran(None, (), Reports())
        job = Job(
            student=taken.bench_of,
            notebooks=taken.prepared.merged.notebooks,
            probe_seed=record.probe_seed,
            parameters=taken.bundle.parameters,
            imports=taken.bundle.imports,
            files=taken.prepared.files,
            limits=self._settings.limits,
            isolated=self._settings.isolated,
            evidence=self._course.evidence if taken.bundle.policy.which == REAL else "",
        )
        running = pool.executor.submit(runner.work, runner.job_bytes(job), taken.bundle.packed)
        run = runner.run_from(running.result())
        if not run.complete:
            raise GradingError("the run was called off")
        ours = {(name, cell["id"]) for name, notebook in job.notebooks.items() for cell in notebook["cells"]}
        return _Ran(run.answers, run.problems, cell_reports.read(run.reports).of(ours), run.evidence)

    def _explained(self, record: RunRecord, ran: _Ran, taken: _Taken, pool: Pool) -> RunRecord:
        """A run with what is to be said of it: what stopped, and what was recorded at home and is missing here."""
        prepared, bundle_ = taken.prepared, taken.bundle
        in_pdf = counted_pages.counted(prepared.reports, self._course.catalogue, pool, self._settings.isolated)
        unreadable = any(one.error and one.error.type == "SyntaxError" for one in ran.reports.cells)
        reasons = explain(
            bundle_.pristine,
            prepared.merged,
            ran.reports,
            (recorded_in(ran.answers) | set(prepared.words)) - supplied_parts(record),
            bundle_.catalogue or self._course.catalogue,
            handed_in=prepared.handed_in,
            claim=prepared.claim,
            seconds=self._settings.limits.cell,
            python=taken.python if unreadable else None,
        )
        facts = Facts(
            ran.reports,
            ran.ended,
            (*taken.problems, *ran.ended, *in_pdf.problems, *reasons.stops, *reasons.lost),
            (*taken.notes, *in_pdf.notes, *reasons.harmless),
            reasons.missing,
            self._asked_by(bundle_),
            taken.bench_of,
            bundle_.policy,
            bundle_.start.name if bundle_.start else "",
            ran.evidence,
            in_pdf.files,
        )
        return replace(record, answers=ran.answers, problems=facts.problems, notes=facts.notes, cells=facts.plain())

    def _marked(self, record: RunRecord, taken: _Taken, marker: Marker) -> Graded:
        if not (taken.prepared.handed_in or taken.prepared.reports):
            return Graded(record, self._nothing_earned(_NOTHING_READ, taken.bundle), self._key_digest)
        marked = marker.mark(to_be_marked(record))
        return Graded(with_messages(record, marked), mark_records(marked.marks), self._key_digest)

    def _asked_by(self, bundle: Bundle) -> list[tuple[str, str]] | None:
        """What a release asks for; None if that is all that the course asks."""
        is_all = bundle.start is None and bundle.release == self._bundles.current.release
        return None if is_all else sorted(bundle.asked)

    def _nothing_earned(self, why: str, under: Bundle, status: Status = Status.MISSING) -> tuple[MarkRecord, ...]:
        about = About(asked=self._asked_by(under))
        return mark_records(tuple(marking.nothing_earned(self._course, why, status, about)))

    def _supplied(self, student: str) -> Sequence[Supplied]:
        """What stands in place of a student's missing answers: given before, and not taken back, or given now."""
        current = self._gradebook.current(student)
        before = current.run.supplied if current else {}
        return together(student, before, self._settings.supplied, self._course.catalogue)

    def _failed(self, student: str, error: Exception) -> Graded:
        """What stays where grading fails for a reason that is not the student's: what was there, or nothing marked yet.

        It has nobody's key, so that it is tried again.
        """
        fault = f"Grading failed, which is not the student's fault: {type(error).__name__}: {error}"
        supplied = {one.name: one.value for one in self._supplied(student)}  # is not lost
        current = self._gradebook.current(student)
        if current is not None and not current.run.key.startswith(FAILED):
            problems = dict.fromkeys((*facts_of(current.run).problems, fault))
            return Graded(replace(current.run, problems=tuple(problems), supplied=supplied), current.marks, "")
        record = RunRecord(
            key=f"{FAILED}{student}",
            student=student,
            submission="",
            master=self._bundles.current.digest,
            software=f"labcourse {labcourse.__version__}",
            probe_seed=0,
            isolation=ISOLATED if self._settings.isolated else NOT_ISOLATED,
            problems=(f"Not graded. {fault}",),
            supplied=supplied,
        )
        return Graded(record, self._nothing_earned(_OUR_FAULT, self._bundles.current, Status.NOT_MARKED), "")


@dataclass(frozen=True)
class _Taken:
    """A submission that was read: what is to be run, with what, and what there is to say of it."""

    submission: Submission
    prepared: Prepared
    bundle: Bundle
    supplied: Mapping[str, Any]
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    python: Version | None

    @property
    def bench_of(self) -> str:
        """Whose bench it is run on."""
        return self.submission.bench_of or self.submission.student


@dataclass(frozen=True)
class _Ran:
    """What a run left, and what went wrong with it as a whole."""

    answers: bytes | None
    ended: tuple[str, ...]
    reports: Reports
    evidence: bytes = b""


def _is_known(current: Graded, record: RunRecord, key_digest: str) -> bool:
    """Whether nothing has changed since: neither what is run, nor words, nor key."""
    before = current.run
    return (before.key, before.submission, current.key_digest) == (record.key, record.submission, key_digest)


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
