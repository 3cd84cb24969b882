"""Count the pages of reports that were handed in as PDF. A student's PDF is opened in a sandbox only."""

from __future__ import annotations

import inspect
import json
import threading
from collections.abc import Iterator, Mapping
from dataclasses import replace

from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.report_files import ReportFile
from labcourse.grading.isolation import sandbox
from labcourse.grading.isolation.process import MIB, Ending, Limits
from labcourse.grading.running.runner import Pool

MOST_PAGES = 2000  #: ten times what anybody hands in; a higher number is not believed
_RESULT, _LARGEST = "pages.json", 1000  # bytes
_LIMITS = Limits(seconds=20.0, memory=1024 * MIB, processes=20, file_size=MIB, folder=MIB, output=10_000)


def count_pages(
    content: Mapping[str, bytes], catalogue: Catalogue, pool: Pool, isolated: bool
) -> Iterator[tuple[str, ReportFile]]:
    """Count the pages of the reports that were handed in as PDF.

    Parameters
    ----------
    content : file name → the PDF
    catalogue : of the course
    pool : where the sandboxes run
    isolated : in a sandbox, or with the rights of whoever grades

    Yields
    ------
    tuple
        number of the report, and its file with the number of pages, or with the reason why there is none

    Raises
    ------
    IsolationError
        If it cannot be isolated as asked; then nothing is opened.
    """
    for number, file in report_files.of_files(content, catalogue).items():
        yield number, _with_pages(file, pool.run(work, content[file.name], isolated))


def work(data: bytes, isolated: bool, cancelled: threading.Event | None = None) -> bytes | None:
    """Run :func:`_describe` on a PDF in a sandbox. Return its JSON, unchecked; None if there is none."""
    # As text: the sandbox does not show our own package.
    program = f"{inspect.getsource(_describe)}\n_describe()"
    outcome = sandbox.run(
        [str(sandbox.python()), "-P", "-c", program],
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


def _describe() -> None:
    """Write ``pages.json`` about the PDF on standard input: its pages, and whether it needs a password.

    It runs alone in the sandbox. Where it fails it leaves no file.
    """
    import io
    import json
    import sys
    from pathlib import Path

    import pypdf

    reader = pypdf.PdfReader(io.BytesIO(sys.stdin.buffer.read()))
    # With an empty password the file opens for everybody; only printing or changing it may be forbidden.
    locked = reader.is_encrypted and not reader.decrypt("")
    about = {"pages": 0 if locked else len(reader.pages), "encrypted": locked}
    Path("pages.json").write_text(json.dumps(about), encoding="utf-8")


def _with_pages(file: ReportFile, output: bytes | None) -> ReportFile:
    """Add the number of pages. The sandbox's output is a claim: only a credible number is taken from it."""
    try:
        about = json.loads(output or b"{}")
    except (ValueError, RecursionError):
        about = {}
    match about:
        case {"encrypted": True}:
            return replace(file, trouble="asks for a password, so that nobody can read it")
        case {"pages": int(pages)} if not isinstance(pages, bool) and 0 < pages <= MOST_PAGES:
            return replace(file, pages=pages)
    return replace(file, trouble="may be damaged: its pages could not be counted")
