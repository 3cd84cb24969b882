"""Run a submission: pristine notebooks with its answer cells, in a child process that is watched and ended from here.

The only thing read back is ``answers.json``. This version does not isolate: the child has the rights of whoever grades.
What it does hold to: a deadline, a folder of its own for each submission, an environment with nothing of the grader's
in it, and that no process of a submission outlives its run.
"""

from __future__ import annotations

import compileall
import contextlib
import copy
import json
import os
import secrets
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil  # type: ignore[import-untyped]

from rotflex.errors import GradingError
from rotflex.grading import notebooks, release, run_notebooks

MAX_ANSWERS = 2_000_000  #: bytes
ANSWERS_FILE = "answers.json"
BENCH = "virtual"  #: what every submission is run on
_MARK = "ROTFLEX_RUN"  # environment variable by which a run's processes are known
_ENDINGS = {
    run_notebooks.FINE: (),
    run_notebooks.TIMED_OUT: ("A cell took longer than {cell} s and was stopped; what came after it was run.",),
    run_notebooks.DIED: ("The Python process died while a notebook was run; the rest of that notebook was not run.",),
}
_ENDED_EARLY = ("The run ended before all notebooks were run.",)


@dataclass(frozen=True)
class Limits:
    """Time that a cell and a whole submission may take, s."""

    cell: int = 60
    submission: float = 600.0


@dataclass(frozen=True)
class Run:
    """What came back from a run: the bytes of the answers, if any, and what went wrong."""

    answers: bytes | None
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class Course:
    """What all submissions of a batch are run with: the course as students have it. Made by :func:`prepare`."""

    folder: Path
    pristine: Mapping[str, dict[str, Any]]
    answer_cells: Mapping[str, list[str]]


@contextlib.contextmanager
def prepare(source: Path) -> Iterator[Course]:
    """The course built from ``source`` in a temporary folder, for as long as the ``with`` block lasts.

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    with tempfile.TemporaryDirectory(prefix="rotflex-course-") as scratch:
        folder = Path(scratch) / "course"
        names = release.build(source, folder, with_data=False)
        pristine = {name: json.loads((folder / "notebooks" / name).read_text(encoding="utf-8")) for name in names}
        cells = {name: notebooks.answer_cells(notebooks.read(folder / "notebooks" / name)) for name in names}
        _warm_up(folder)
        yield Course(folder, pristine, cells)


def _warm_up(folder: Path) -> None:
    """Compile the package and let matplotlib list its fonts once, rather than in each submission."""
    compileall.compile_dir(folder / "rotflex", quiet=2)
    fonts = folder / "matplotlib"
    fonts.mkdir()
    done = subprocess.run(
        [sys.executable, "-P", "-c", "import rotflex.lab, matplotlib.font_manager"],
        env=_environment(folder, folder, fonts),
        cwd=folder,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise GradingError(f"The released course cannot be imported: {said[-1] if said else done.returncode}")


def run(
    course: Course,
    student: str,
    sources: Mapping[str, Mapping[str, str]],
    probe_seed: int,
    limits: Limits,
    cancelled: threading.Event | None = None,
) -> Run:
    """Run the notebooks with a submission's answer cells.

    Parameters
    ----------
    course : from :func:`prepare`
    student : whose bench it is run on
    sources : notebook's file name → answer cell's id → source; where one is missing, the stub stays
    probe_seed : from which the inputs of functions are drawn
    limits : on time
    cancelled : set from another thread to give up
    """
    with tempfile.TemporaryDirectory(prefix="rotflex-run-", ignore_cleanup_errors=True) as scratch:
        private = Path(scratch)
        work, home = private / "work", private / "home"
        for folder in (work, home):
            folder.mkdir()
        # A package of its own: one submission cannot change what another one runs with.
        shutil.copytree(course.folder / "rotflex", private / "package" / "rotflex")
        shutil.copytree(course.folder / "matplotlib", home / "matplotlib")
        for name, notebook in course.pristine.items():
            merged = _merged(notebook, sources.get(name, {}))
            (work / name).write_text(json.dumps(merged), encoding="utf-8")
        spec = {"notebooks": list(course.pristine), "student": student, "bench": BENCH, "cell_timeout": limits.cell}
        (private / "spec.json").write_text(json.dumps(spec), encoding="utf-8")
        environment = _environment(home, private / "package", home / "matplotlib")
        environment["ROTFLEX_PROBE_SEED"] = str(probe_seed)
        # The folder is held open: should the run put another one in its place, the answers are still sought here.
        opened = os.open(work, os.O_RDONLY | os.O_DIRECTORY)
        try:
            problems = _watched(private / "spec.json", work, environment, limits, cancelled)
            answers, unreadable = read_answers(opened)
        finally:
            os.close(opened)
    return Run(answers, problems + unreadable)


def _merged(notebook: Mapping[str, Any], sources: Mapping[str, str]) -> dict[str, Any]:
    """The notebook with these sources, going on to the next cell whatever happens in one."""
    merged: dict[str, Any] = copy.deepcopy(dict(notebook))
    for cell in merged["cells"]:
        if cell["cell_type"] == "code":
            cell["source"] = sources.get(cell["id"], cell["source"])
            cell["metadata"]["tags"] = [*cell["metadata"].get("tags", []), "raises-exception"]
    return merged


def _environment(home: Path, package: Path, matplotlib: Path) -> dict[str, str]:
    """All environment variables that a submission gets."""
    return {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.defpath]),
        "LANG": "C.UTF-8",
        "HOME": str(home),
        "TMPDIR": str(home),
        "IPYTHONDIR": str(home / "ipython"),
        "JUPYTER_CONFIG_DIR": str(home / "jupyter"),
        "JUPYTER_DATA_DIR": str(home / "jupyter"),
        "JUPYTER_RUNTIME_DIR": str(home / "jupyter"),
        "MPLCONFIGDIR": str(matplotlib),
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        "PYTHONPATH": str(package),  # comes before where this rotflex is installed
        "PYTHONDONTWRITEBYTECODE": "1",
        "ROTFLEX_PROGRESS": "off",
        # Submissions share the processors; each calculates on one.
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
    }


# --- the child --------------------------------------------------------------------------------------------------------


def _watched(
    spec: Path, work: Path, environment: dict[str, str], limits: Limits, cancelled: threading.Event | None
) -> tuple[str, ...]:
    """Start the child, wait for it until the deadline, end all that it started; and what went wrong."""
    token = secrets.token_hex(16)
    child = subprocess.Popen(
        [sys.executable, "-P", run_notebooks.__file__, str(spec)],
        cwd=work,
        env={**environment, _MARK: token},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + limits.submission
    try:
        code = _wait(child, deadline, cancelled or threading.Event())
    finally:
        _end_all(child, token)
    if code is None:
        return (f"The run took longer than {limits.submission:g} s and was stopped.",)
    return tuple(text.format(cell=limits.cell) for text in _ENDINGS.get(code, _ENDED_EARLY))


def _wait(child: subprocess.Popen[bytes], deadline: float, cancelled: threading.Event) -> int | None:
    """The child's exit code, or None if the deadline came first, or the word to give up."""
    while not cancelled.is_set() and (left := deadline - time.monotonic()) > 0:
        with contextlib.suppress(subprocess.TimeoutExpired):
            return child.wait(timeout=min(left, 0.5))
    return None


def _end_all(child: subprocess.Popen[bytes], token: str) -> None:
    """Kill the child's process group, and every process that bears the run's mark.

    Kernels, and whatever a submission starts, may have left the group; the environment that they were born with stays.
    """
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()
    for _ in range(100):  # a process that forks faster than that is for the sandbox
        found = _marked(token)
        if not found:
            return
        for process in found:
            with contextlib.suppress(psutil.Error):
                process.kill()
        psutil.wait_procs(found, timeout=1)


def _marked(token: str) -> list[psutil.Process]:
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if process.environ().get(_MARK) == token and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


def read_answers(folder: int) -> tuple[bytes | None, tuple[str, ...]]:
    """The bytes of ``answers.json`` in an open folder (a descriptor), and what was wrong with it.

    What a stranger left there may be a link, a pipe or anything else; only an ordinary file of bounded size is read.
    """
    try:
        descriptor = os.open(ANSWERS_FILE, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)
    except FileNotFoundError:
        return None, ()
    except OSError as error:
        return None, (f"{ANSWERS_FILE} cannot be read: {error.strerror}.",)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return None, (f"{ANSWERS_FILE} is not an ordinary file.",)
        with open(descriptor, "rb", closefd=False) as file:
            data = file.read(MAX_ANSWERS + 1)
    finally:
        os.close(descriptor)
    if len(data) > MAX_ANSWERS:
        return None, (f"{ANSWERS_FILE} has more than {MAX_ANSWERS} bytes.",)
    return data, ()
