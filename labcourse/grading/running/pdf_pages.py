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
_RESULT_FILE, _MOST_BYTES = "pages.json", 1000
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
    isolated : whether they are opened in a sandbox; else with the rights of whoever grades

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
        yield number, _with_pages(file, pool.run(describe_pdf, content[file.name], isolated))


def describe_pdf(data: bytes, isolated: bool, cancelled: threading.Event | None = None) -> bytes | None:
    """Open a PDF in a sandbox, and return the JSON that :func:`_write_description` writes about it.

    Parameters
    ----------
    data : the PDF
    isolated : whether it is opened in a sandbox; else with the rights of whoever grades
    cancelled : set from another thread to give up

    Returns
    -------
    bytes or None
        JSON, unchecked; None if it failed.

    Raises
    ------
    IsolationError
        If it cannot be isolated as asked; then it is not opened.
    """
    # The program goes into the sandbox as text: labcourse's own package is not shown there.
    program = f"{inspect.getsource(_write_description)}\n_write_description()"
    outcome = sandbox.run(
        [str(sandbox.python()), "-P", "-c", program],
        visible=[],
        wanted={_RESULT_FILE: _MOST_BYTES},
        stdin=data,
        environment={"PYTHONDONTWRITEBYTECODE": "1", "PYTHONNOUSERSITE": "1"},
        limits=_LIMITS,
        cancelled=cancelled,
        isolated=isolated,
    )
    return outcome.files.get(_RESULT_FILE) if outcome.ending is Ending.FINISHED else None


def _write_description() -> None:
    """Write ``pages.json`` about the PDF on standard input: its pages, and whether it needs a password.

    Its source is run alone in the sandbox. If it fails, there is no file.
    """
    import io
    import json
    import sys
    from pathlib import Path

    import pypdf

    reader = pypdf.PdfReader(io.BytesIO(sys.stdin.buffer.read()))
    # With an empty password the file opens for everybody; only printing or changing it may be forbidden.
    locked = reader.is_encrypted and not reader.decrypt("")
    description = {"pages": 0 if locked else len(reader.pages), "encrypted": locked}
    Path("pages.json").write_text(json.dumps(description), encoding="utf-8")


def _with_pages(file: ReportFile, output: bytes | None) -> ReportFile:
    """Return a report's file with its number of pages, or with the trouble why there is none.

    The sandbox's output is a claim: only a credible number is taken from it.
    """
    try:
        description = json.loads(output or b"{}")
    except (ValueError, RecursionError):
        description = {}
    match description:
        case {"encrypted": True}:
            return replace(file, trouble="asks for a password, so that nobody can read it")
        case {"pages": int(pages)} if not isinstance(pages, bool) and 0 < pages <= MOST_PAGES:
            return replace(file, pages=pages)
    return replace(file, trouble="may be damaged: its pages could not be counted")
