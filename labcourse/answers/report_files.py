"""Reports: their PDFs beside the notebooks, and their texts as far as they are recorded.

A report has one file, ``first_report.pdf`` for "First report". It is either made of the notebook's texts, which a word
among its key words says (:data:`COMPOSED`), or the student's own document. Nothing here parses a PDF.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from labcourse import files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Cell, why_unread
from labcourse.answers.own_files import megabytes
from labcourse.answers.parts import ReportItem
from labcourse.errors import AnswerError
from labcourse.patterns import ANSWER, pattern
from labcourse.problems import Code, Problem

PDF, HTML = ".pdf", ".html"
MAX_BYTES = 20_000_000  #: of a report; ten photographs as telephones make them
COMPOSED = "labcourse-composed"  #: a key word of a PDF that is made of the notebook's texts; see :func:`keyword`
#: Fixed: a person's mark of a report as a whole holds for as long as what they read stays the same.
NOT_WRITTEN = "*not written yet*"
_ENCRYPTED = b"/Encrypt"  # an entry of a PDF's trailer, which is never compressed
_MAGIC, _WITHIN = b"%PDF-", 1024  # a PDF begins with it, or nearly so
_SHOWN = 12  # digits of a digest, by which people tell the files of a class apart
_GIVEN = pattern(r"^\[PDF: [\w.-]+, SHA-256 [0-9a-f]{64}\]$", ANSWER, re.MULTILINE)
_SIGNS = pattern(r"\W+")


class ReportSession(Protocol):
    """What a report needs of a student's session: the questions, who they are, and their answers."""

    catalogue: Catalogue
    student: str

    def refresh(self) -> None: ...

    def content(self, question: str, part: str) -> dict[str, Any] | None: ...

    def own_document(self, report: str) -> ReportFile | None: ...

    def report(self, name: str, pdf: str | os.PathLike[str] = "") -> None: ...


def file_name(report: str) -> str:
    """Return the name of a report's PDF: ``first_report.pdf`` for "First report"."""
    return _SIGNS.sub("_", report.casefold()).strip("_") + PDF


def names(catalogue: Catalogue) -> dict[str, str]:
    """Return the names of the reports' PDFs: number of the report → name."""
    return {number: file_name(number) for number in catalogue.reports}


def made_files(pdfs: Iterable[str]) -> list[str]:
    """Return the names of all files that are made for reports: PDFs, and a page of HTML for the student beside each."""
    return [name for pdf in pdfs for name in (pdf, pdf.removesuffix(PDF) + HTML)]


def refusal(data: bytes) -> Problem | None:
    """Return why a file cannot be a report, by its size and its first bytes; None if it can."""
    if len(data) > MAX_BYTES:
        return Problem.of(Code.REPORT_TOO_LARGE, bytes=len(data), most=MAX_BYTES)
    if _MAGIC not in data[:_WITHIN]:
        return Problem.of(Code.NOT_A_PDF)
    return None


def is_composed(data: bytes) -> bool:
    """Check whether a PDF says that it was made of the notebook's texts."""
    return COMPOSED.encode() in data


def keyword(cells: Iterable[Cell]) -> str:
    """Return the key word of a PDF that is made of a notebook with these cells, which has a digest of them."""
    return f"{COMPOSED}-{hashlib.sha256(json.dumps([cell.source for cell in cells]).encode()).hexdigest()}"


@dataclass(frozen=True)
class ReportFile:
    """A report's PDF, handed in or beside the notebooks.

    Attributes
    ----------
    report : number of the report
    name : of the file
    digest : SHA-256 of its content
    size : bytes
    own : whether it is the student's own document; else it is made of the notebook's texts
    encrypted : whether it may ask for a password, or forbids something
    """

    report: str
    name: str
    digest: str
    size: int
    own: bool
    encrypted: bool = False

    @property
    def given(self) -> str:
        """The text that stands for the PDF in an answer: a mark holds until it changes."""
        return f"[PDF: {self.name}, SHA-256 {self.digest}]"

    @property
    def about(self) -> str:
        """A description as "PDF, 1.2 MB"."""
        return f"PDF, {megabytes(self.size)}"

    @property
    def note(self) -> Problem:
        """A note that the report was handed in as this PDF."""
        about = {"name": self.name, "own": self.own, "bytes": self.size, "digest": self.digest[:_SHOWN]}
        return Problem.of(Code.REPORT_IN_PDF, self.report, **about)


def of_data(report: str, data: bytes) -> ReportFile:
    """Describe a report's PDF by its content."""
    name, digest = file_name(report), hashlib.sha256(data).hexdigest()
    return ReportFile(report, name, digest, len(data), not is_composed(data), _ENCRYPTED in data)


def of_files(files: Mapping[str, bytes], catalogue: Catalogue) -> dict[str, ReportFile]:
    """Describe the reports' PDFs among some files: number of the report → its PDF.

    Parameters
    ----------
    files : file name → content
    catalogue : of the course
    """
    return {number: of_data(number, files[name]) for number, name in names(catalogue).items() if name in files}


def is_given(text: str) -> bool:
    """Check whether an answer is a PDF, or has one as a part: then its pages cannot be compared as text."""
    return bool(_GIVEN.search(text))


def named_in(text: str) -> str:
    """Return the PDF in an answer, for people; "" if there is none."""
    match = _GIVEN.search(text)
    return without_digests(match[0]) if match else ""


def without_digests(text: str) -> str:
    """Shorten each PDF in an answer to its name, for people."""
    return _GIVEN.sub(lambda match: match[0].partition(",")[0] + "]", text)


def own_document(folder: Path, catalogue: Catalogue, report: str) -> ReportFile | None:
    """Return a report's PDF in a student's folder if it is the student's own document, and can be handed in."""
    if report not in catalogue.reports:
        return None
    try:
        data = files.read(folder / file_name(report), MAX_BYTES)
    except OSError:
        return None
    return None if refusal(data) or is_composed(data) else of_data(report, data)


def read_all(folder: Path, catalogue: Catalogue) -> tuple[dict[str, bytes], list[Problem]]:
    """Read the reports' PDFs in a folder: file name → content; and say which cannot be handed in, and why."""
    contents: dict[str, bytes] = {}
    problems = []
    for name in names(catalogue).values():
        try:
            data = files.read(folder / name)
            why = refusal(data)
        except FileNotFoundError:
            continue
        except OSError as error:
            why = why_unread(error)
        if why:
            problems.append(Problem.of(Code.REPORT_NOT_HANDED_IN, name, why=why))
        else:
            contents[name] = data
    return contents, problems


# --- the texts of a report --------------------------------------------------------------------------------------------


def outline(report: str, lab: ReportSession) -> str:
    """List the rows of a report as a Markdown table: text, the questions that it uses, and what is still missing.

    Parameters
    ----------
    report : its number, as in "First report"
    lab : the student's session, with their answers

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    if report not in lab.catalogue.reports:
        raise AnswerError(f"There is no report {report!r}; there are {', '.join(lab.catalogue.reports)}.")
    lab.refresh()
    rows = ["| | text | what it says | questions | state |", "|---|---|---|---|---|"]
    for item in lab.catalogue.items(report):
        rests_on = ", ".join(dict.fromkeys(number for number, _part in item.shows))
        rows.append(f"| {item.number} | {item.heading} | {item.prompt} | {rests_on} | {_progress(item, lab)} |")
    return "\n".join(rows)


def in_one_piece(items: Iterable[ReportItem], texts: Mapping[str, str]) -> str:
    """Join the texts of a report, in order, under their headings.

    Parameters
    ----------
    items : the rows of the report
    texts : name of a part → its text
    """
    return "\n\n".join(
        f"**{item.number} {item.heading}**\n\n{texts.get(item.part, NOT_WRITTEN)}" for item in items if item.part
    )


def _progress(item: ReportItem, lab: ReportSession) -> str:
    """Say which answers of a report's row are missing: those that it shows, and its own text.

    With an own document, the text counts as written. For a row on the report as a whole, return "".
    """
    wanted = [*item.shows, *([(item.report, item.part)] if item.part else [])]
    parts = [
        (number, part) for number, name in wanted for part in ([name] if name else lab.catalogue.find(number).names)
    ]
    missing = [where for where in parts if lab.content(*where) is None]
    own = lab.own_document(item.report) if (item.report, item.part) in missing else None
    if own is not None:
        missing.remove((item.report, item.part))
    if missing:
        return f"missing: {', '.join(map(' '.join, missing))}"
    if own is not None:
        return f"in your own document, {own.name}"
    return "recorded" if parts else ""
