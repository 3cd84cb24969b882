"""A report as a PDF beside the notebooks: its fixed name, and what can be told of it without reading a page.

A report has one file, ``first_report.pdf`` for "First report". It is either made of the notebook's texts, or the
student's own; which of the two, a word among its key words tells (:data:`COMPOSED`). Nothing here parses a PDF: where
it came from a stranger, that is done in a sandbox.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.own_files import megabytes
from labcourse.messages import plural

PDF, HTML = ".pdf", ".html"
MAX_BYTES = 20_000_000  #: of a report; ten photographs as telephones make them
COMPOSED = "labcourse-composed"  #: a key word of a PDF that is made of the notebook's texts
_MAGIC, _WITHIN = b"%PDF-", 1024  # a PDF begins with it, or nearly so
_SHOWN = 12  # digits of a digest by which people tell two files apart; of a class no two begin alike
_GIVEN = re.compile(r"^\[PDF: [\w.-]+, SHA-256 [0-9a-f]{64}\]$", re.MULTILINE)


def file_name(report: str) -> str:
    """The name that a report's PDF has beside the notebooks: of "First report", ``first_report.pdf``."""
    return re.sub(r"\W+", "_", report.casefold()).strip("_") + PDF


def names(catalogue: Catalogue) -> dict[str, str]:
    """Number of each report of a course → the name of its PDF."""
    return {number: file_name(number) for number in catalogue.reports}


def made_files(pdfs: Iterable[str]) -> list[str]:
    """All files that a report makes: beside each PDF a page of HTML, which is for its student alone."""
    return [name for pdf in pdfs for name in (pdf, pdf.removesuffix(PDF) + HTML)]


def refusal(data: bytes) -> str:
    """Why a file cannot be a report, by its size and its first bytes; "" if it can."""
    if len(data) > MAX_BYTES:
        return f"it has {megabytes(len(data))}, of which there may be {megabytes(MAX_BYTES)}: save its pictures smaller"
    if _MAGIC not in data[:_WITHIN]:
        return "it is no PDF, whatever its name is: save or export it as PDF"
    return ""


def is_composed(data: bytes) -> bool:
    """Whether a PDF says that it was made of the notebook's texts."""
    return COMPOSED.encode() in data


@dataclass(frozen=True)
class ReportFile:
    """A report's PDF as it was handed in, or lies beside the notebooks.

    Attributes
    ----------
    report : number of the report
    name : of the file
    digest : SHA-256 of its content
    size : bytes
    own : whether it is the student's own; else it is made of the notebook's texts
    pages : None where they could not be counted, or were not
    trouble : why they could not be; "" where nothing went wrong
    """

    report: str
    name: str
    digest: str
    size: int
    own: bool
    pages: int | None = None
    trouble: str = ""

    @property
    def given(self) -> str:
        """By which a mark knows it: a mark holds for as long as what was given stays the same."""
        return f"[PDF: {self.name}, SHA-256 {self.digest}]"

    @property
    def about(self) -> str:
        """In words, as in "PDF, 7 pages"."""
        return "PDF" if self.pages is None else f"PDF, {plural(self.pages, '{count} page', '{count} pages')}"

    def __str__(self) -> str:
        text = (
            "{report}: your own document, {name} ({about}; {digest})."
            if self.own
            else "{report}: {name}, made of the notebook’s texts ({about}; {digest})."
        )
        return text.format(report=self.report, name=self.name, about=self.about, digest=self.digest[:_SHOWN])

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return dict(vars(self))

    @classmethod
    def from_plain(cls, content: Mapping[str, Any]) -> ReportFile:
        """What :meth:`plain` gave."""
        return cls(**content)


def of_data(report: str, data: bytes) -> ReportFile:
    """What is known of a report's PDF by its bytes."""
    return ReportFile(report, file_name(report), hashlib.sha256(data).hexdigest(), len(data), not is_composed(data))


def of_files(files: Mapping[str, bytes], catalogue: Catalogue) -> dict[str, ReportFile]:
    """Number of each report → its PDF, of those that are there.

    Parameters
    ----------
    files : file name → content
    catalogue : of the course
    """
    return {number: of_data(number, files[name]) for number, name in names(catalogue).items() if name in files}


def is_given(text: str) -> bool:
    """Whether what was given is a PDF, or one is part of it: its pages cannot be compared by their words."""
    return bool(_GIVEN.search(text))


def named_in(text: str) -> str:
    """The PDF that is part of what was given, for people; "" if there is none."""
    found = _GIVEN.search(text)
    return without_digests(found[0]) if found else ""


def without_digests(text: str) -> str:
    """What was given, with each PDF by its name only: for people, who look at the PDF itself."""
    return _GIVEN.sub(lambda found: found[0].partition(",")[0] + "]", text)


class FolderReports:
    """The reports' PDFs in a student's folder, read again when a file has changed.

    Parameters
    ----------
    folder : with the notebooks in it
    catalogue : of the course
    """

    def __init__(self, folder: Path, catalogue: Catalogue) -> None:
        self._paths = {number: folder / name for number, name in names(catalogue).items()}
        self._known: dict[str, tuple[tuple[int, ...], ReportFile | None]] = {}

    def get(self, report: str) -> ReportFile | None:
        """A report's PDF; None where there is none that can be handed in."""
        path = self._paths.get(report)
        try:
            seen = path.lstat() if path is not None else None
        except OSError:
            seen = None
        if path is None or seen is None or path.is_symlink() or seen.st_size > MAX_BYTES:
            return None
        identity = (seen.st_ino, seen.st_size, seen.st_mtime_ns)
        if self._known.get(report, ((), None))[0] != identity:
            self._known[report] = (identity, _read(report, path))
        return self._known[report][1]

    def own(self, report: str) -> ReportFile | None:
        """A report's PDF, if it is the student's own."""
        found = self.get(report)
        return found if found is not None and found.own else None


def _read(report: str, path: Path) -> ReportFile | None:
    try:
        data = files.read(path, MAX_BYTES)
    except OSError:
        return None
    return None if refusal(data) else of_data(report, data)


def read_all(folder: Path, catalogue: Catalogue) -> tuple[dict[str, bytes], list[str]]:
    """The reports' PDFs that lie in a folder and can be handed in: file name → content; and why others cannot be."""
    found: dict[str, bytes] = {}
    problems = []
    for name in names(catalogue).values():
        path = folder / name
        try:
            data = files.read(path)
            why = refusal(data)
        except FileNotFoundError:
            continue
        except OSError as error:
            why = error.strerror or str(error)
        if why:
            problems.append(f"{name} is not handed in: {why}.")
        else:
            found[name] = data
    return found, problems
