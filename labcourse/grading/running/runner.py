"""Run a submission's notebooks with its answer cells, in a sandbox; only bounded plain files come back.

A run depends on its arguments alone, so that it can be sent to another machine: a :class:`Pool` is this machine or a
cluster of dask.distributed. Nothing of the key goes into it.
"""

from __future__ import annotations

import contextlib
import json
import threading
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from typing import Any

import labcourse
from labcourse.answers.cell_reports import MAX_BYTES, REPORTS_FILE
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading.isolation import sandbox
from labcourse.grading.isolation.sandbox import Ending, Outcome
from labcourse.grading.running.bundle import FONTS, INSIDE, unpacked
from labcourse.job import VARIABLE as JOB
from labcourse.problems import Code, Problem, Reason, codes
from labcourse.run import RUNNING, inside

MAX_ANSWERS = 2_000_000  #: bytes: twice those of answers.json, for others' formats
MAX_EVIDENCE = 40_000_000  #: bytes: 20 recordings of 30,000 samples in four channels, 13 characters each
MAX_EXECUTED = 40_000_000  #: bytes of a notebook with its outputs: twice those that it may output
_GIB = 1024**3
_CONNECT = 15  # s to find a scheduler and a worker; a scheduler answers within one
#: A problem of a whole run → reasons why cells stopped that say the same.
_SAID_BY = {
    Code.CELL_TIMED_OUT: {Code.TOOK_TOO_LONG},
    Code.PYTHON_DIED: {Code.PYTHON_ENDED, Code.LEFT_PYTHON},
}
#: Name → content of the files that came back, which are untrusted claims: those of answers, of reports on cells
#: (:func:`labcourse.answers.schema.read_reports`) and of evidence; and what went wrong.
Ran = tuple[Mapping[str, bytes], tuple[Problem, ...]]
_RETRIES = 3  # of a submission after its worker was lost
# Copy matplotlib's list of fonts ($0, its folder) to where matplotlib could write it; then become the command ($@).
_WITH_FONTS = 'mkdir -p "$HOME/.cache" && cp -R "$0" "$HOME/.cache/matplotlib" && exec "$@"'


@dataclass(frozen=True, kw_only=True)
class RunLimits:
    """The limits of a submission.

    Attributes
    ----------
    cell : time of a cell, s
    submission : wall time of the whole run, s; a whole course takes a minute at most
    memory : bytes; twice what a notebook with all libraries needs
    processes : at a time, threads included; libraries start threads, on many processors
    folder : bytes that it can write, as recordings and pictures
    """

    cell: int = 60
    submission: float = 600.0
    memory: int = 2 * _GIB
    processes: int = 100
    folder: int = _GIB // 4


@dataclass(frozen=True)
class Job:
    """All that a run depends on, besides the course.

    Attributes
    ----------
    student : ID of the student with the bench on which it is run
    notebooks : file name → notebook with the answer cells in it, from :func:`labcourse.run.merge.merged`
    probe_seed : from which the inputs of functions are drawn
    parameters : of the notebooks, besides the student
    imports : modules that the notebooks use
    files : the student's own, beside the notebooks: relative path → content
    limits : on time and size
    isolated : whether it is run in a sandbox; else with the rights of whoever grades
    evidence : function of the course's, "package.module:function", that reads the student's files in the sandbox; ""
        for none
    shown : file names of notebooks that are to come back with their outputs (:data:`.inside.EXECUTED`)
    """

    student: str
    notebooks: Mapping[str, dict[str, Any]]
    probe_seed: int
    _: KW_ONLY
    parameters: Mapping[str, str] = field(default_factory=dict)
    imports: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    limits: RunLimits = field(default_factory=RunLimits)
    isolated: bool = True
    evidence: str = ""
    shown: tuple[str, ...] = ()


def run(packed: bytes, job: Job, cancelled: threading.Event | None = None) -> Ran:
    """Run a submission. Return the files that came back, and what went wrong with the run as a whole.

    Parameters
    ----------
    packed : zip of the bundle, see :class:`~labcourse.grading.running.bundle.Bundle`
    job : what to run
    cancelled : set from another thread to give up

    Raises
    ------
    IsolationError
        If it cannot be isolated as asked; then it is not run.
    GradingError
        If it was cancelled, if the course cannot be imported, or if notebooks cannot be run with a library's version.
    """
    outcome = _run_in_sandbox(packed, job, cancelled)
    if outcome.ending is Ending.CANCELLED:
        raise GradingError("The run was cancelled.")
    if outcome.code == inside.BROKEN and job.notebooks:  # a claim: try the course alone, which raises if it is true
        run(packed, replace(job, notebooks={}, files={}, evidence="", shown=()), cancelled)
    elif outcome.code == inside.BROKEN:
        lines = outcome.output.decode(errors="replace").strip().splitlines()
        why = lines[-1] if lines else "it printed nothing"
        if why.startswith("ModuleNotFoundError"):
            why += ". In course.py, packages and requires name what students get."
        raise GradingError(f"The released course cannot be run here: {why}")
    return outcome.files, tuple(_problems(outcome, job.limits))


def _run_in_sandbox(packed: bytes, job: Job, cancelled: threading.Event | None) -> Outcome:
    """Run the warm process on a job, in a sandbox if the job says so; return how it ended and what it left."""
    folder, limits = unpacked(packed), job.limits
    specification = {  # as inside/main.py reads it
        "notebooks": dict(job.notebooks),
        "parameters": {**job.parameters, "student": job.student},
        "imports": [f"import {name}" for name in job.imports],
        "files": {name: b64encode(content).decode("ascii") for name, content in job.files.items()},
        "cell_timeout": limits.cell,
        "evidence": job.evidence,
        "shown": job.shown,
    }
    more = {inside.EVIDENCE_FILE: MAX_EVIDENCE} if job.evidence else {}
    more |= {f"{inside.EXECUTED}{name}": MAX_EXECUTED for name in job.shown}
    environment = {
        "LANG": "C.UTF-8",
        "PYTHONPATH": str(folder),  # comes before where this package is installed
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONNOUSERSITE": "1",
        "TQDM_DISABLE": "1",
        JOB: json.dumps(specification["parameters"]),
        RUNNING: "grade",
        "LABCOURSE_PROBE_SEED": str(job.probe_seed),
        # Submissions share the processors; each calculates on one.
        **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    }
    return sandbox.run(
        ["sh", "-c", _WITH_FONTS, str(folder / FONTS), str(sandbox.python()), "-P", "-m", f"{INSIDE}.main"],
        visible=[folder],
        wanted={ANSWERS_FILE: MAX_ANSWERS, REPORTS_FILE: MAX_BYTES, **more},
        stdin=json.dumps(specification).encode(),
        environment=environment,
        limits=sandbox.Limits(
            seconds=limits.submission, memory=limits.memory, processes=limits.processes, folder=limits.folder
        ),
        cancelled=cancelled,
        isolated=job.isolated,
    )


def is_covered_by_cells(problem: Problem, stops: Iterable[Reason]) -> bool:
    """Return whether a problem of a whole run says no more than one of ``stops``, problems of cells that stopped."""
    return any(_SAID_BY.get(problem.code, set()) & codes(stop) for stop in stops)


def _problems(outcome: Outcome, limits: RunLimits) -> Iterator[Problem]:
    """Yield what went wrong with a run as a whole: why it ended early, and which files cannot be read."""
    if outcome.ending is Ending.DEADLINE:
        yield Problem.of(Code.RUN_TIMED_OUT, seconds=limits.submission)
    elif outcome.ending is Ending.OUTPUT:
        yield Problem.of(Code.PRINTED_TOO_MUCH)
    elif outcome.code == inside.TIMED_OUT:
        yield Problem.of(Code.CELL_TIMED_OUT, seconds=limits.cell)
    elif outcome.code == inside.DIED:
        yield Problem.of(Code.PYTHON_DIED)
    elif outcome.code != inside.FINE:
        yield Problem.of(Code.RUN_ENDED_EARLY)
    for name, error in outcome.troubles.items():
        yield Problem.of(Code.RESULT_UNREAD, name, error=error)


# --- here, or on a cluster --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pool:
    """A place to run submissions.

    Attributes
    ----------
    run : function that is given a function and its arguments, calls it there, waits for it, and returns its result;
        threads may share it
    capacity : number of submissions at a time
    stop : function that ends what is running
    """

    run: Callable[..., Any]
    capacity: int
    stop: Callable[[], None]


@contextlib.contextmanager
def local(jobs: int) -> Iterator[Pool]:
    """Run submissions on this machine, in the thread of the caller, which waits for its sandbox.

    Each function is also given an event as ``cancelled``. It is set to end what is running.

    Parameters
    ----------
    jobs : number of submissions at a time
    """
    cancelled = threading.Event()
    try:
        yield Pool(lambda function, *arguments: function(*arguments, cancelled=cancelled), jobs, cancelled.set)
    finally:
        cancelled.set()


@contextlib.contextmanager
def cluster(scheduler: str) -> Iterator[Pool]:
    """Run submissions on the workers of a dask.distributed scheduler, such as ``tcp://host:8786``.

    A call raises GradingError on a worker with another version of labcourse.

    Raises
    ------
    GradingError
        If dask is not installed, or if there is no scheduler at the address, or no worker.
    """
    try:
        from distributed import Client
    except ImportError:
        raise GradingError("A cluster needs dask: pip install 'labcourse[cluster]'.") from None
    try:
        client = Client(scheduler, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise GradingError(f"There is no scheduler at {scheduler}: {error}") from None
    with contextlib.closing(client):
        try:
            client.wait_for_workers(1, timeout=_CONNECT)
        except TimeoutError:
            raise GradingError(f"The scheduler at {scheduler} has no workers.") from None
        # Not pure: dask must not take the result of an equal call for that of another student's.
        executor = client.get_executor(pure=False, retries=_RETRIES)

        def call(function: Callable[..., Any], *arguments: Any) -> Any:
            return executor.submit(call_on_worker, labcourse.__version__, function, *arguments).result()

        yield Pool(call, sum(client.nthreads().values()), partial(executor.shutdown, wait=False))


def call_on_worker(version: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function on a worker of a cluster, if the worker has the version of labcourse that grades.

    Raises
    ------
    GradingError
        If the worker has another version.
    """
    if version != labcourse.__version__:
        raise GradingError(f"This worker has version {labcourse.__version__}; install {version}, which grades.")
    return function(*arguments)
