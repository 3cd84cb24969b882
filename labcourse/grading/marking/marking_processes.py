"""Mark answers in separate processes: claims can be built to be expensive, and must not stop anything.

Each answer has a time limit, each process a memory limit. If a process dies while it marks a submission, a person must
look at that submission, and the next one is marked in a new process.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import labcourse
from labcourse import student_id
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import course as courses
from labcourse.grading.course import OUTCOMES_FILE, RUBRIC_FILE, SHEETS_FILE, Course, package_folder
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marks import Mark
from labcourse.grading.settings import SETTINGS_FILE
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem, Reason

_T = TypeVar("_T")
_Marked = tuple[tuple[Mark, ...], list[Problem], list[Problem]]  # marks, problems, notes
_MEMORY = 4 * 1024**3  # bytes of address space; twice what a run has
_LIBRARIES = ("PIL.PngImagePlugin", "control", "scipy.optimize", "scipy.signal", "sympy")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_TIME_LIMIT = 600.0  # s for all answers of a submission; as long as the submission's run may take
_LONGEST_BENCH = 200  # characters of what answers say of their bench, in a message


class Marker(contextlib.AbstractContextManager["Marker"]):
    """Marks answers by a course's key.

    Parameters
    ----------
    course : each process loads it from its folder
    processes : number of submissions to mark at a time
    """

    def __init__(self, course: Course, processes: int) -> None:
        self._course, self._processes = course, processes
        self._lock = threading.Lock()
        self._pool = self._new_pool(processes)

    def _new_pool(self, processes: int) -> ProcessPoolExecutor:
        """Return a pool of marking processes, which are started when there is work."""
        for name in _THREADS:  # each process calculates on one processor: there are others, and sandboxes beside them
            os.environ.setdefault(name, "1")
        # Not forked: this program has threads.
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(processes, mp_context=context, initializer=_start, initargs=(self._course.folder,))

    def __exit__(self, *_: object) -> None:
        self._end_pool(self._pool)

    def warm_up(self) -> None:
        """Start a marking process, if none is idle, while there is something else to wait for."""
        with contextlib.suppress(RuntimeError):  # the pool is broken: mark() will make a new one
            _submit(self._pool, _import_libraries)

    def mark(self, submission: Submission) -> None:
        """Mark a submission's answers: fill in the marks, and add problems and notes about the answers.

        Parameters
        ----------
        submission : as the gradebook stores it, without its files: all of it goes to another process

        Raises
        ------
        GradingError
            If the answers killed the process that marked them, or took it too long.
        """
        submission.marks, problems, notes = self._marked(submission)
        submission.problems += problems
        submission.notes += notes

    def _marked(self, submission: Submission) -> _Marked:
        """Return the marks of a submission, and problems and notes about its answers; raise as :meth:`mark` does.

        If the pool breaks meanwhile, it is replaced, and the answers are marked once more, in a process of their own.
        """
        pool = self._pool
        try:
            return _submit(pool, _mark_answers, submission).result(timeout=_TIME_LIMIT)
        except (RuntimeError, TimeoutError, CancelledError):  # broken, or ended by another thread because it was
            with self._lock:
                if self._pool is pool:
                    self._pool = self._new_pool(self._processes)
                    self._end_pool(pool)
        # Another submission's answers may have broken the pool: try these alone.
        alone = self._new_pool(1)
        try:
            return _submit(alone, _mark_answers, submission).result(timeout=_TIME_LIMIT)
        except (BrokenExecutor, TimeoutError) as error:
            raise GradingError(f"The answers could not be marked ({type(error).__name__}).") from None
        finally:
            self._end_pool(alone)

    @staticmethod
    def _end_pool(pool: ProcessPoolExecutor) -> None:
        """End a pool now, even if its processes are busy."""
        for process in list((pool._processes or {}).values()):
            process.kill()
        pool.shutdown(cancel_futures=True)


def _submit(pool: ProcessPoolExecutor, work: Callable[..., _T], *arguments: object) -> Future[_T]:
    """Submit a call to a pool. A process that is started for it ignores Ctrl-C, which this program handles."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        return pool.submit(work, *arguments)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return pool.submit(work, *arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- in the marking process -------------------------------------------------------------------------------------------

_courses: list[Course] = []  # of this process: one, from its start on


def _start(folder: Path) -> None:
    """Prepare a marking process: limit its memory, tie it to the program, and load the course."""
    with contextlib.suppress(ImportError):  # Windows has no such limits
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _courses[:] = [courses.load(folder)]


def _import_libraries() -> None:
    """Import the libraries that checks would import when they are called: there is time while the submission is run."""
    for name in _LIBRARIES:
        importlib.import_module(name)


def _end_with_parent() -> None:
    """Wait until the program that started this process ends, then end: else it would wait for ever for work."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _mark_answers(submission: Submission) -> _Marked:
    """Decode and mark the answers of a submission; return the marks, and problems and notes on decoding and marking."""
    (course,) = _courses
    owner, policy, asked = submission.bench_of, submission.policy, submission.asked
    claims = decoding.decode(submission.answers, submission.probe_seed, course.catalogue)
    if claims.student and student_id.caseless(claims.student) != student_id.caseless(owner):
        claims.notes.append(Problem.of(Code.ANSWERS_OF_ANOTHER, student=claims.student[: student_id.LONGEST]))
    bench = course.true_bench(owner, policy, submission.evidence)
    claims.problems.extend(getattr(bench, "problems", ()))
    claims.notes.extend(getattr(bench, "notes", ()))
    claims.problems.extend(_other_bench(course, bench, claims))
    decoding.add_words(claims, submission.words, course.catalogue)
    if asked is not None:
        given = course.given_values(owner, policy or course.settings.bench, asked)
        claims.values.update(given)
        claims.notes += [Problem.of(Code.GIVEN_TO_CLASS, names=[*map(" ".join, given)])] if given else []
    marks = marking.mark(course, claims, bench, submission)
    notes = (*claims.notes, *marking.unmarked(course.key, claims))
    return tuple(marks), [*map(_as_problem, claims.problems)], [*map(_as_problem, notes)]


def _as_problem(said: Reason) -> Problem:
    """Return a problem as it is, and a text, in which a course's bench says something, as a problem."""
    return Problem.of(Code.SAID_BY_COURSE, text=said) if isinstance(said, str) else said


def _other_bench(course: Course, bench: Any, claims: Claims) -> list[Problem]:
    """Return one problem if answers claim to come from another bench than the given true one; else an empty list."""
    identity = getattr(bench, "identity", None)
    if not claims.bench or identity is None:
        return []
    # Only names in both are compared: earlier releases wrote fewer of them.
    if all(claims.bench[name] == value for name, value in identity.items() if name in claims.bench):
        return []
    claimed = json.dumps(claims.bench, sort_keys=True)[:_LONGEST_BENCH]
    return [Problem.of(Code.ANSWERS_OF_ANOTHER_BENCH, bench=claimed)]


# --- the digest of all that marks depend on ---------------------------------------------------------------------------

_PACKAGE = Path(labcourse.__file__).parent
#: Modules and folders of labcourse that have no part in marking. One that is forgotten here costs time, but no mark.
_NOT_MARKING = tuple(
    _PACKAGE / "grading" / name
    for name in (
        *("accounts.py", "assignments.py", "commands.py", "course_check.py", "erasure.py", "executed.py"),
        *("feedback_zip.py", "outcomes.py", "overview.py", "platforms.py", "sheets.py", "todo.py"),
        *("gradebook", "intake", "isolation", "release", "reports", "running", "scoring"),
    )
)

#: Files of the course that marks do not depend on. By pattern: notebooks, also as text, because runs have digests of
#: theirs. By name: what a run left, what only persons mark by, what is made from marks, and the settings, of which
#: only those count that marks depend on.
_EXCLUDED_PATTERNS = ("*.ipynb", "[0-9]*.py", "*.pyc")
_EXCLUDED_NAMES = (ANSWERS_FILE, RUBRIC_FILE, OUTCOMES_FILE, SHEETS_FILE, SETTINGS_FILE)


def marking_digest(course: Course) -> str:
    """Return the digest of all that marks depend on. If it has changed, answers are marked again, without another run.

    It covers the course's folder without its notebooks, its rubric, what is made from marks, and what is hidden (a key
    may read a table that lies beside it); the settings on which marks depend, so that another deadline marks nothing
    again; the modules of the packages that students get (the true bench is made by them); and the modules of this
    package that mark.
    """
    digest = hashlib.sha256(repr(course.settings.of_marking()).encode())
    for path in _files_marks_depend_on(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files_marks_depend_on(course: Course) -> Iterator[Path]:
    """Yield the files on which marks depend.

    These are all files of the course's folder but notebooks, excluded names, and what is hidden or in a hidden folder;
    the .py files of labcourse that mark; and those of the students' packages.
    """
    for path in sorted(course.folder.rglob("*")):
        folders = path.relative_to(course.folder).parts[:-1]
        hidden = path.name.startswith(".") or any(part.startswith((".", "__")) for part in folders)
        excluded = hidden or path.name in _EXCLUDED_NAMES or any(map(path.match, _EXCLUDED_PATTERNS))
        if path.is_file() and not excluded:
            yield path
    for folder in dict.fromkeys([_PACKAGE, *map(package_folder, course.packages)]):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NOT_MARKING):
                yield path
