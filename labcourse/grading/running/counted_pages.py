"""How many pages a report's PDF has: it is a stranger's file, and so it is opened in a sandbox only.

What is in it nobody here reads: a person looks at it in a browser, which has a sandbox of its own for that. What comes
back from ours is a number.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.report_files import ReportFile
from labcourse.grading.isolation import sandbox
from labcourse.grading.isolation.process import MIB, Ending, Limits
from labcourse.grading.running.executors import Pool

MOST_PAGES = 2000  #: of a report, to be believed; ten times what anybody hands in
_RESULT, _LARGEST = "pages.json", 1000  # bytes
_LIMITS = Limits(seconds=20.0, memory=1024 * MIB, processes=20, file_size=MIB, folder=MIB, output=10_000)
_PROGRAM = Path(__file__).with_name("page_counter.py")


@dataclass(frozen=True)
class Counted:
    """Reports as PDF, by the number of the report, and what there is to say of them."""

    files: dict[str, ReportFile]
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def counted(content: Mapping[str, bytes], catalogue: Catalogue, pool: Pool, isolated: bool) -> Counted:
    """The reports that were handed in as PDF, with their numbers of pages, or with why these could not be counted.

    Parameters
    ----------
    content : file name → the PDF
    catalogue : of the course
    pool : where the sandboxes are put up
    isolated : in a sandbox, or with the rights of whoever grades

    Raises
    ------
    IsolationError
        If it cannot be isolated as asked; then nothing is opened.
    """
    known = report_files.of_files(content, catalogue)
    asked = {number: pool.executor.submit(work, content[one.name], isolated) for number, one in known.items()}
    files = {number: _read(known[number], job.result()) for number, job in asked.items()}
    told = "{report}: {name} {why}."
    problems = (told.format(report=one.report, name=one.name, why=one.trouble) for one in files.values() if one.trouble)
    return Counted(files, tuple(problems), tuple(str(one) for one in files.values() if not one.trouble))


def work(data: bytes, isolated: bool, cancelled: threading.Event | None = None) -> bytes | None:
    """What the program in the sandbox says of a PDF, unchecked; None if it says nothing."""
    # As text: what lies in our own package is not shown in the sandbox.
    command = [str(sandbox.python()), "-P", "-c", _PROGRAM.read_text(encoding="utf-8")]
    outcome = sandbox.run(
        command,
        visible=[],
        wanted=_RESULT,
        largest=_LARGEST,
        stdin=data,
        environment={"PYTHONDONTWRITEBYTECODE": "1", "PYTHONNOUSERSITE": "1"},
        limits=_LIMITS,
        cancelled=cancelled,
        isolated=isolated,
    )
    return outcome.file if outcome.ending is Ending.FINISHED else None


def _read(file: ReportFile, said: bytes | None) -> ReportFile:
    """What was said is a claim: a number is taken where it is one that can be, and nothing else of it is shown."""
    try:
        found = json.loads(said or b"null")
    except (ValueError, RecursionError):
        found = None
    pages = found.get("pages") if isinstance(found, dict) else None
    if isinstance(found, dict) and found.get("encrypted") is True:
        return replace(file, trouble="asks for a password, so that nobody can read it")
    if type(pages) is int and 0 < pages <= MOST_PAGES:
        return replace(file, pages=pages)
    return replace(file, trouble="may be damaged: its pages could not be counted")
