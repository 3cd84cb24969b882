"""Run a submission: pristine notebooks with its answer cells, in a sandbox; only bounded plain files come back.

A run is a function of bytes to bytes (:func:`work`), so that it can be sent to another process or machine. Nothing of
the key goes into it.
"""

from __future__ import annotations

import json
import threading
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import labcourse
from labcourse.answers.cell_reports import MAX_BYTES, REPORTS_FILE
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading.isolation import sandbox
from labcourse.grading.isolation.sandbox import Ending, Outcome
from labcourse.grading.running import inside
from labcourse.grading.running.bundle import FONTS, INSIDE, unpacked
from labcourse.run import RUNNING

MAX_ANSWERS = 2_000_000  #: bytes: twice those of answers.json, for others' formats
MAX_EVIDENCE = 40_000_000  #: bytes: 20 recordings of 30,000 samples in four channels, 13 characters each
_GIB = 1024**3
_PARTLY = {
    inside.FINE: "",
    inside.TIMED_OUT: "A cell took longer than {cell} s and was stopped; what came after it was run where it could.",
    inside.DIED: "The Python process died while a notebook was run; the rest of that notebook was not run.",
}
# Matplotlib's list of fonts has to lie where it could be written.
_WITH_FONTS = 'mkdir -p "$HOME/.cache" && cp -R "$0" "$HOME/.cache/matplotlib" && exec "$@"'
_NOT_RUN = "The released course cannot be run here: {reason}"
_ENDED_EARLY = "The run ended before all notebooks were run."


@dataclass(frozen=True)
class Limits:
    """What a submission may take.

    Attributes
    ----------
    cell, submission : time, s (of a cell; of everything, wall time); a whole course takes a minute at most
    memory : bytes; twice what a notebook with all libraries needs
    processes : at a time; libraries start threads, on many processors
    folder : bytes that can be written: recordings and pictures
    """

    cell: int = 60
    submission: float = 600.0
    memory: int = 2 * _GIB
    processes: int = 100
    folder: int = _GIB // 4

    def of_sandbox(self) -> sandbox.Limits:
        """The same, for the sandbox."""
        return sandbox.Limits(seconds=self.submission, memory=self.memory, processes=self.processes, folder=self.folder)


@dataclass(frozen=True)
class Job:
    """All that a run depends on, besides the course.

    Attributes
    ----------
    student : whose bench it is run on
    notebooks : file name → notebook with the answer cells in it, from :func:`labcourse.run.merge.merged`
    probe_seed : from which the inputs of functions are drawn
    parameters : of the notebooks, besides the student
    imports : modules that the notebooks use
    files : the student's own, beside the notebooks: relative path → content
    limits : on time and size
    isolated : in a sandbox, or with the rights of whoever grades
    evidence : function of the course's, "package.module:function", that reads the student's files in the sandbox; ""
        for none
    """

    student: str
    notebooks: Mapping[str, dict[str, Any]]
    probe_seed: int
    parameters: Mapping[str, str] = field(default_factory=dict)
    imports: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)
    isolated: bool = True
    evidence: str = ""


@dataclass(frozen=True)
class Run:
    """What came back from a run: the bytes of the answers, if any, and what went wrong.

    Attributes
    ----------
    answers : an untrusted claim
    problems : what went wrong
    complete : whether it ended by itself or by a limit, and so need not be run again
    reports : on its cells, as :func:`labcourse.answers.cell_reports.read` takes them; an untrusted claim, too
    evidence : what the course's function read of the student's files, JSON; an untrusted claim, too
    """

    answers: bytes | None
    problems: tuple[str, ...] = ()
    complete: bool = True
    reports: bytes = b""
    evidence: bytes = b""


# --- here -------------------------------------------------------------------------------------------------------------


def run(packed: bytes, job: Job, cancelled: threading.Event | None = None) -> Run:
    """Run a submission.

    Parameters
    ----------
    packed : the bundle's, see :class:`~labcourse.grading.running.bundle.Bundle`
    job : what to run
    cancelled : set from another thread to give up

    Raises
    ------
    IsolationError
        If it cannot be isolated as asked; it is not run, then.
    GradingError
        If the course cannot be imported, or a library is not one that notebooks can be run with.
    """
    outcome = _run(packed, job, cancelled)
    if outcome.code == inside.BROKEN:  # or so it claims: the submission may have caused it
        _check_course(packed, job)
    complete = outcome.ending is not Ending.CANCELLED
    reports, evidence = (outcome.others.get(name, b"") for name in (REPORTS_FILE, inside.EVIDENCE_FILE))
    return Run(outcome.file, _problems(outcome, job.limits), complete, reports, evidence)


def _check_course(packed: bytes, job: Job) -> None:
    """Raise GradingError if the course does not even run without any notebooks."""
    outcome = _run(packed, replace(job, notebooks={}), None)
    if outcome.code == inside.BROKEN:
        lines = outcome.output.decode(errors="replace").strip().splitlines()
        raise GradingError(_NOT_RUN.format(reason=lines[-1] if lines else "it says nothing"))


def _run(packed: bytes, job: Job, cancelled: threading.Event | None) -> Outcome:
    folder = unpacked(packed)
    spec = {
        "notebooks": dict(job.notebooks),
        "parameters": {**job.parameters, "student": job.student},
        "imports": list(job.imports),
        "files": {name: b64encode(content).decode("ascii") for name, content in job.files.items()},
        "cell_timeout": job.limits.cell,
        "evidence": job.evidence,
    }
    return sandbox.run(
        ["sh", "-c", _WITH_FONTS, str(folder / FONTS), str(sandbox.python()), "-P", str(folder / INSIDE / "main.py")],
        visible=[folder],
        wanted=ANSWERS_FILE,
        largest=MAX_ANSWERS,
        also={REPORTS_FILE: MAX_BYTES, **({inside.EVIDENCE_FILE: MAX_EVIDENCE} if job.evidence else {})},
        stdin=json.dumps(spec).encode(),
        environment=_environment(folder, job),
        limits=job.limits.of_sandbox(),
        cancelled=cancelled,
        isolated=job.isolated,
    )


def _environment(folder: Path, job: Job) -> dict[str, str]:
    """Environment variables that a submission gets, besides those of its sandbox."""
    return {
        "LANG": "C.UTF-8",
        "PYTHONPATH": str(folder),  # comes before where this package is installed
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONNOUSERSITE": "1",
        "TQDM_DISABLE": "1",
        RUNNING: "grade",
        "LABCOURSE_PROBE_SEED": str(job.probe_seed),
        # Submissions share the processors; each calculates on one.
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
    }


def _problems(outcome: Outcome, limits: Limits) -> tuple[str, ...]:
    ended = {
        Ending.DEADLINE: f"The run took longer than {limits.submission:g} s and was stopped.",
        Ending.OUTPUT: "The run was stopped: it said too much.",
        Ending.CANCELLED: "The run was called off.",
        Ending.FINISHED: _PARTLY.get(-1 if outcome.code is None else outcome.code, _ENDED_EARLY),
    }[outcome.ending].format(cell=limits.cell)
    left = f"{ANSWERS_FILE} {outcome.trouble}." if outcome.trouble else ""
    return tuple(filter(None, (ended, left)))


# --- anywhere ---------------------------------------------------------------------------------------------------------


def work(job: bytes, packed: bytes, cancelled: threading.Event | None = None) -> bytes:
    """:func:`run`, for a worker: bytes in, bytes out. (The event is for workers that are threads of this program.)

    Raises
    ------
    GradingError
        If the worker has another version of this package.
    """
    asked = json.loads(job)
    asked["files"] = {name: b64decode(content) for name, content in asked["files"].items()}
    if asked.pop("software") != labcourse.__version__:
        raise GradingError(f"This worker has version {labcourse.__version__}; install the version that grades.")
    done = run(packed, Job(**{**asked, "limits": Limits(**asked["limits"])}), cancelled)
    answers = None if done.answers is None else b64encode(done.answers).decode("ascii")
    found = {"answers": answers, "problems": done.problems, "complete": done.complete}
    found |= {name: b64encode(getattr(done, name)).decode("ascii") for name in ("reports", "evidence")}
    return json.dumps(found).encode()


def job_bytes(job: Job) -> bytes:
    """A job as :func:`work` takes it."""
    files = {name: b64encode(content).decode("ascii") for name, content in job.files.items()}
    return json.dumps({**asdict(job), "files": files, "software": labcourse.__version__}).encode()


def run_from(data: bytes) -> Run:
    """What :func:`work` returned."""
    found = json.loads(data)
    answers = None if found["answers"] is None else b64decode(found["answers"])
    reports, evidence = b64decode(found["reports"]), b64decode(found["evidence"])
    return Run(answers, tuple(found["problems"]), found["complete"], reports, evidence)
