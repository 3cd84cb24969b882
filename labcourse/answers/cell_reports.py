"""Report what becomes of each cell of a run: a line for each event, written while it goes on.

:func:`begin` is called in the process of each notebook before its first cell. Reports remain if that process dies.
Reports are not trusted, because a student's code can change them: :func:`labcourse.answers.schema.read_reports` reads
them strictly.
"""

from __future__ import annotations

import contextlib
import json
import os
import traceback
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from labcourse import job  # noqa: F401 (this module is imported before any cell is run)
from labcourse.student_id import caseless

LEFT = "exit()"  #: the type of error that stands for a cell that ended Python
REPORTS_FILE = "cell_reports.jsonl"  #: in the folder in which notebooks are run
MAX_BYTES = 1_000_000  #: of the file; a thousand cells with a message each
LONGEST = 300  #: characters of a message, or a name
MOST_LINES = 10**6  #: of a cell


@dataclass(frozen=True)
class CellError:
    """What stopped a cell.

    Attributes
    ----------
    type, message : of the exception
    line : of the cell, from 1; None if it is not known
    """

    type: str
    message: str
    line: int | None = None


@dataclass(frozen=True)
class CellReport:
    """A cell that was run.

    Attributes
    ----------
    notebook, cell : file name and id
    finished : whether it came to an end; else the process died in it, or was ended
    error : what stopped it
    lacked : (question, part) of earlier answers that it asked for and that were not there
    """

    notebook: str
    cell: str
    finished: bool
    error: CellError | None = None
    lacked: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Refusal:
    """An answer that was not recorded: for its form, or, if ``why`` is empty, because it had no value."""

    question: str
    part: str
    why: str


@dataclass(frozen=True)
class CellReports:
    """All that a run says of its cells, in order.

    Attributes
    ----------
    cells : those that were run
    refusals : answers that were not recorded
    unused : (notebook, "student" or "bench", value) that a notebook gives and that is not the job's
    """

    cells: tuple[CellReport, ...] = ()
    refusals: tuple[Refusal, ...] = ()
    unused: tuple[tuple[str, str, str], ...] = ()

    def of(self, cells: Collection[tuple[str, str]]) -> CellReports:
        """Return those on some cells, by notebook and id: a run adds others, with ids that differ every time."""
        return replace(self, cells=tuple(report for report in self.cells if (report.notebook, report.cell) in cells))


# --- while notebooks are run ------------------------------------------------------------------------------------------

_writing: list[tuple[Path, str]] = []  # where to, and in which notebook this process is; empty where nobody asked


def begin(path: str | os.PathLike[str], notebook: str) -> None:
    """Report from now on what becomes of the cells of this process, an IPython kernel.

    Parameters
    ----------
    path : file that the lines are added to
    notebook : name of the notebook whose cells are run
    """
    _writing[:] = [(Path(path).absolute(), notebook)]
    shell = _shell()
    shell.events.register("pre_run_cell", _starts)
    shell.events.register("post_run_cell", _ends)


def refused(question: str, part: str, why: str) -> None:
    """Report that an answer was not recorded (:class:`Refusal`). Where nobody asked for reports, nothing happens."""
    _write({"event": "refused", "question": question, "part": part, "why": _bounded(why)})


def lacked(question: str, part: str) -> None:
    """Report that an earlier answer was asked for that is not there. As for :func:`refused`."""
    _write({"event": "lacked", "question": question, "part": part})


def unused(name: str, given: object, own: str) -> None:
    """Report a student or a bench that a notebook gives, if it is not the job's own. As for :func:`refused`."""
    if given and caseless(str(given)) != caseless(own):
        _write({"event": "unused", "name": name, "value": _bounded(str(given))})


def _starts(info: Any) -> None:
    if info.cell_id is not None:
        _write({"event": "started", "cell": info.cell_id})


def _ends(result: Any) -> None:
    """Report the end of a cell, and what stopped it."""
    cell = result.info.cell_id
    if cell is not None:
        error = result.error_before_exec or result.error_in_exec
        stopped = None if error is None else of_exception(error)
        if stopped is None and getattr(_shell(), "exit_now", False):
            stopped = CellError(LEFT, "")
        _write({"event": "ended", "cell": cell, "error": None if stopped is None else asdict(stopped)})


def _shell() -> Any:
    from IPython.core.getipython import get_ipython

    return get_ipython()


def _write(line: Mapping[str, Any]) -> None:
    """Add a line to the reports, if they were asked for."""
    for path, notebook in _writing:
        # The run is worth more than its log.
        with contextlib.suppress(OSError), path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"notebook": notebook, **line}) + "\n")


def of_exception(error: BaseException) -> CellError:
    """Return what stopped a cell, in bounded size."""
    try:
        message = str(error.msg or "" if isinstance(error, SyntaxError) else error)
    except Exception:  # a class of the student's may fail at this, too
        message = ""
    return CellError(_bounded(type(error).__name__), _bounded(message), _line(error))


def _bounded(text: str) -> str:
    return text[:LONGEST].encode(errors="replace").decode()  # halves of surrogate pairs are in names of files


def _line(error: BaseException) -> int | None:
    """Return the line of the cell: the innermost one that was being run."""
    if isinstance(error, SyntaxError):
        line = error.lineno  # or whatever a cell raised it with
        return line if type(line) is int and 0 < line < MOST_LINES else None
    cell = line = None
    for frame, number in traceback.walk_tb(error.__traceback__):
        if cell is None and frame.f_globals.get("__name__") == "__main__":
            cell = frame.f_code.co_filename
        if frame.f_code.co_filename == cell:
            line = number
    return line
