"""A class from submissions to marks in the gradebook.

Submissions are independent of each other: whatever one does, the others are graded. What is done is in the gradebook
at once, and is not run again: a run is known by the content of all that it depends on.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from pathlib import Path

import rotflex
from rotflex.courseware.messages import _
from rotflex.courseware.run.merge import merged
from rotflex.courseware.student_id import caseless
from rotflex.errors import GradingError, IsolationError
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Gradebook, Graded, MarkRecord, RunRecord
from rotflex.instructor.marking import marking
from rotflex.instructor.marking.digest import marking_digest
from rotflex.instructor.marking.marking import Mark
from rotflex.instructor.marking.marking_processes import Marked, Marker
from rotflex.instructor.running import bundle, executors, intake, runner
from rotflex.instructor.running.executors import Pool
from rotflex.instructor.running.intake import Delivered as Intake
from rotflex.instructor.running.intake import Submission
from rotflex.instructor.running.runner import Job, Limits

ISOLATED, NOT_ISOLATED = "Run in isolation.", "Run without isolation."
PROBE_SEED_BITS = 48
ACTOR = "rotflex grade"  #: who changes marks here, in the audit trail
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
    """

    limits: Limits = field(default_factory=Limits)
    jobs: int = 1
    scheduler: str | None = None
    probe_seed: int | None = None
    isolated: bool = True
    every_cell: bool = False


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

    Raises
    ------
    GradingError
        If there is nothing to grade, or nothing to grade it by.
    """

    def __init__(
        self, submissions: Path, course: Course, gradebook: Gradebook, settings: Settings | None = None
    ) -> None:
        self._submissions, self.ignored = intake.submissions(submissions)
        self._course = course
        self._key_digest = marking_digest(course)
        self._bundle = bundle.build(course)
        self._gradebook = gradebook
        self._settings = settings or Settings()
        self._secret = gradebook.secret()
        there = {caseless(one.student) for one in self._submissions}
        self.absent = [one.student for one in gradebook.students() if caseless(one.student) not in there]

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
            graders = stack.enter_context(ThreadPoolExecutor(pool.capacity, thread_name_prefix="rotflex-grade"))
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
            handed_in = intake.read(submission, self._bundle.answer_cells)
            record = self._identity(submission.student, handed_in)
            current = self._gradebook.current(submission.student)
            if current and (current.run.key, current.key_digest) == (record.key, self._key_digest):
                return Step(current, ran=False, new=False)
            known = self._gradebook.find(record.key)
            ran = known is None
            if known is None:
                marker.warm_up()
            record = self._run(record, handed_in, pool) if known is None else known.run
            return Step(self._marked(record, handed_in, marker), ran)
        except IsolationError:
            raise
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            return Step(self._failed(submission.student, error), ran=True)

    def _identity(self, student: str, handed_in: Intake) -> RunRecord:
        """What a submission's run is known by: equal content has been run already."""
        settings = self._settings
        submitted = _digest([handed_in.sources, handed_in.problems, handed_in.notes])
        limits = asdict(settings.limits)
        how = [limits, settings.isolated, settings.every_cell]
        content = _digest([student, submitted, self._bundle.digest, rotflex.__version__, how])
        seed = settings.probe_seed
        if seed is None:  # nobody can know it who does not have the gradebook
            drawn = hmac.digest(self._secret, content.encode(), "sha256")
            seed = int.from_bytes(drawn) % 2**PROBE_SEED_BITS
        return RunRecord(
            key=_digest([content, seed]),
            student=student,
            submission=submitted,
            master=self._bundle.digest,
            software=f"rotflex {rotflex.__version__}",
            probe_seed=seed,
            isolation=ISOLATED if settings.isolated else NOT_ISOLATED,
            answers=None,
            problems=tuple(handed_in.problems),
            notes=tuple(handed_in.notes),
        )

    def _run(self, record: RunRecord, handed_in: Intake, pool: Pool) -> RunRecord:
        """Run a submission, and what its run left."""
        if not handed_in.sources:
            return record
        settings, built = self._settings, self._bundle
        notebooks = merged(built.pristine, handed_in.sources, settings.every_cell)
        job = Job(
            student=record.student,
            notebooks=notebooks,
            probe_seed=record.probe_seed,
            parameters=built.parameters,
            imports=built.imports,
            limits=settings.limits,
            isolated=settings.isolated,
        )
        running = pool.executor.submit(runner.work, runner.job_bytes(job), built.packed)
        run = runner.run_from(running.result())
        if not run.complete:
            raise GradingError(_("the run was called off"))
        return replace(record, answers=run.answers, problems=(*record.problems, *run.problems))

    def _marked(self, record: RunRecord, handed_in: Intake, marker: Marker) -> Graded:
        if not handed_in.sources:
            marks = tuple(marking.nothing_earned(self._course, _NOTHING_READ))
            return Graded(record, mark_records(marks), self._key_digest)
        marked = marker.mark(record.student, record.answers, record.probe_seed)
        return Graded(with_messages(record, marked), mark_records(marked.marks), self._key_digest)

    def _failed(self, student: str, error: Exception) -> Graded:
        """No marks, for a reason that is not the student's. Its key is nobody's, so that it is tried again."""
        fault = _("Grading failed, which is not the student's fault: {error_type}: {error}").format(
            error_type=type(error).__name__, error=error
        )
        record = RunRecord(
            key=f"failed: {student}",
            student=student,
            submission="",
            master=self._bundle.digest,
            software=f"rotflex {rotflex.__version__}",
            probe_seed=0,
            isolation=ISOLATED if self._settings.isolated else NOT_ISOLATED,
            answers=None,
            problems=(fault,),
            notes=(),
        )
        return Graded(record, mark_records(tuple(marking.nothing_earned(self._course, _OUR_FAULT))), self._key_digest)


def with_messages(record: RunRecord, marked: Marked) -> RunRecord:
    """A run with the messages from marking its answers: each once, and by this key."""
    problems = dict.fromkeys((*record.problems, *marked.problems))
    kept = (note for note in record.notes if not note.endswith(marking.UNMARKED))
    notes = dict.fromkeys((*kept, *marked.notes))
    return replace(record, problems=tuple(problems), notes=tuple(notes))


def mark_records(marks: tuple[Mark, ...]) -> tuple[MarkRecord, ...]:
    """Marks as the gradebook takes them."""
    return tuple(
        MarkRecord(one.question, one.part, one.status.value, one.points, one.out_of, one.reason, one.given)
        for one in marks
    )


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
