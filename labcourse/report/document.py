"""A lab report as data: its contents in order, and the notebook cell that each piece comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Place:
    """Where a piece of a report is written or recorded.

    Attributes
    ----------
    notebook : file name, as in "04_results.ipynb"
    cell : id of the cell; "" if it is not known
    """

    notebook: str
    cell: str = ""

    @property
    def link(self) -> str:
        """A link from the folder of the notebooks; JupyterLab opens the notebook at the cell."""
        return f"{self.notebook}#cell-id={self.cell}" if self.cell else self.notebook


@dataclass(frozen=True)
class Notice:
    """A message to the student about a cell.

    Attributes
    ----------
    message : what was left out or is missing, and what to do
    place : the cell
    kind : of a missing piece: "pages", "text", "answer", "caption", "unit", "mention", "headings" or "scanned"
    """

    message: str
    place: Place
    kind: str = ""


@dataclass(frozen=True)
class Text:
    """A text in Markdown.

    Attributes
    ----------
    markdown : the text; "" if nothing is written yet
    place : its cell
    pictures : name, as the text has it in ``![…](name)`` → PNG
    """

    markdown: str
    place: Place
    pictures: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Recorded:
    """A figure or a results table that was recorded.

    Attributes
    ----------
    label : how texts refer to it: "Figure 1.2", after its question, or "Table 1"
    caption : Markdown, and the cell where it is to be written
    own_caption : whether the student wrote the caption; otherwise it is the course's
    place : the cell that records it
    missing : what is not recorded yet
    table : Markdown; "" for a figure
    svg : of a figure; "" for a table, and if nothing is recorded yet
    alt : a description of a figure for readers who do not see it
    axes : labels (x, y) of each diagram of a figure; "" for no label
    """

    label: str
    caption: Text
    own_caption: bool
    place: Place
    missing: tuple[str, ...] = ()
    table: str = ""
    svg: str = ""
    alt: str = ""
    axes: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Section:
    """A numbered section.

    Attributes
    ----------
    number : as on the scoring sheet, as in "II.1"
    heading : of the section
    pieces : its contents in order
    place : where its text is written, or what it shows is recorded
    missing : names of results that it shows as equations and that are not recorded yet
    """

    number: str
    heading: str
    pieces: tuple[Text | Recorded, ...]
    place: Place
    missing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes
    ----------
    cover : "title", "course", "term", "authors", "student" (ID of the folder's owner), "date" → text; it may be ""
    page_limit : pages that the course allows, cover and contents included; None for no limit
    sections : in order
    sources : key, as in "1" for [1] → its text
    front : the cell of authors, captions and sources
    keyword : of the PDF, see :func:`labcourse.answers.report_files.keyword`
    notices : what was left out of the student's cells, and why
    """

    cover: Mapping[str, str]
    page_limit: int | None
    sections: tuple[Section, ...]
    sources: Mapping[str, Text]
    front: Place
    keyword: str
    notices: tuple[Notice, ...] = ()
