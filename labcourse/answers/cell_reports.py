"""What became of each cell of a run: written down while it goes on, a line for each event, and strictly read.

Where notebooks are run, :func:`begin` is called in the process of each before its first cell. A report survives the
process that wrote it. It is taken as a claim by a stranger: what a cell can do, it can do to its own report, too.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

LEFT = "exit()"  #: the type of error of a cell that ended Python, which is none
REPORTS_FILE = "cell_reports.jsonl"  #: in the folder in which notebooks are run
MAX_BYTES = 1_000_000  #: of the file; a thousand cells with a message each
_MOST_LINES = 6_000  # eleven notebooks of at most some hundred cells
_LONGEST = {"type": 60, "message": 300, "name": 100}  # characters
_MOST_LACKED = 50  # answers of others that a cell asks for


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
    """An answer that was given and not recorded, for its form."""

    question: str
    part: str
    why: str


@dataclass(frozen=True)
class Reports:
    """All that a run says of its cells, in order."""

    cells: tuple[CellReport, ...] = ()
    refusals: tuple[Refusal, ...] = ()

    def of(self, cells: Collection[tuple[str, str]]) -> Reports:
        """Those on some cells, by notebook and id: a run has others of its own, with ids that differ every time."""
        return replace(self, cells=tuple(one for one in self.cells if (one.notebook, one.cell) in cells))


# --- while notebooks are run ------------------------------------------------------------------------------------------

_writing: list[tuple[Path, str]] = []  # where to, and in which notebook this process is; empty where nobody asked


def begin(path: str | os.PathLike[str], notebook: str) -> None:
    """Report from now on what becomes of the cells of this process, an IPython kernel.

    Parameters
    ----------
    path : file that the lines are added to
    notebook : name of the notebook whose cells are run
    """
    from IPython.core.getipython import get_ipython

    _writing[:] = [(Path(path).absolute(), notebook)]
    shell = get_ipython()
    assert shell is not None
    shell.events.register("pre_run_cell", _starts)
    shell.events.register("post_run_cell", _ends)


def refused(question: str, part: str, why: str) -> None:
    """Report that an answer was not recorded. Where nobody asked for reports, nothing happens."""
    if _writing:
        _write({"event": "refused", "question": question, "part": part, "why": why[: _LONGEST["message"]]})


def lacked(question: str, part: str) -> None:
    """Report that an earlier answer was asked for that is not there. As for :func:`refused`."""
    if _writing:
        _write({"event": "lacked", "question": question, "part": part})


def _starts(info: Any) -> None:
    if info.cell_id is not None:
        _write({"event": "started", "cell": info.cell_id})


def _ends(result: Any) -> None:
    cell = result.info.cell_id
    if cell is not None:
        error = result.error_before_exec or result.error_in_exec
        told = None if error is None else of_exception(error)
        if told is None and _has_left():
            told = CellError(LEFT, "")
        _write({"event": "ended", "cell": cell, "error": None if told is None else asdict(told)})


def _has_left() -> bool:
    """Whether a cell has asked the kernel to end."""
    from IPython.core.getipython import get_ipython

    return bool(getattr(get_ipython(), "exit_now", False))


def _write(line: Mapping[str, Any]) -> None:
    path, notebook = _writing[0]
    with contextlib.suppress(OSError), path.open("a", encoding="utf-8") as file:  # the run is worth more than its log
        file.write(json.dumps({"notebook": notebook, **line}) + "\n")


def of_exception(error: BaseException) -> CellError:
    """What stopped a cell, as plain data of bounded size."""
    try:
        message = str(error)
    except Exception:  # a class of the student's may fail at this, too
        message = ""
    if isinstance(error, SyntaxError):
        message = error.msg or ""
    return CellError(type(error).__name__[: _LONGEST["type"]], message[: _LONGEST["message"]], _line(error))


def _line(error: BaseException) -> int | None:
    """The line of the cell: the innermost one that was being run."""
    if isinstance(error, SyntaxError):
        return error.lineno
    trace = error.__traceback__
    cell = line = None
    while trace is not None:
        name = trace.tb_frame.f_code.co_filename
        if cell is None and trace.tb_frame.f_globals.get("__name__") == "__main__":
            cell = name
        if name == cell:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


# --- afterwards -------------------------------------------------------------------------------------------------------


def read(data: bytes) -> Reports:
    """What a run left. Lines that are none of ours are passed over, and so is all beyond the bounds."""
    cells: dict[tuple[str, str], CellReport] = {}
    refusals: dict[tuple[str, str], Refusal] = {}
    latest = ("", "")
    for line in _lines(data):
        match line:
            case {"event": "started", "notebook": str(notebook), "cell": str(cell)}:
                latest = _short(notebook), _short(cell)
                cells[latest] = CellReport(*latest, finished=False)
            case {"event": "ended", "notebook": str(notebook), "cell": str(cell), "error": None | dict() as error}:
                where = _short(notebook), _short(cell)
                before = cells.get(where, CellReport(*where, finished=False))
                cells[where] = replace(before, finished=True, error=_error(error))
            case {"event": "lacked", "question": str(question), "part": str(part)} if latest in cells:
                before = cells[latest]
                more = dict.fromkeys((*before.lacked, (_short(question), _short(part))))
                cells[latest] = replace(before, lacked=tuple(more)[:_MOST_LACKED])
            case {"event": "refused", "question": str(question), "part": str(part), "why": str(why)}:
                name = _short(question), _short(part)
                refusals[name] = Refusal(*name, why[: _LONGEST["message"]])
    return Reports(tuple(cells.values()), tuple(refusals.values()))


def _lines(data: bytes) -> Iterable[Any]:
    for line in data[:MAX_BYTES].splitlines()[:_MOST_LINES]:
        try:
            yield json.loads(line)
        except (ValueError, RecursionError):
            continue


def _short(text: str) -> str:
    return text[: _LONGEST["name"]]


def _error(content: dict[str, Any] | None) -> CellError | None:
    if content is None:
        return None
    kind, message, line = content.get("type"), content.get("message"), content.get("line")
    return CellError(
        kind[: _LONGEST["type"]] if isinstance(kind, str) else "",
        message[: _LONGEST["message"]] if isinstance(message, str) else "",
        line if isinstance(line, int) and not isinstance(line, bool) and 0 < line < 10**6 else None,
    )
