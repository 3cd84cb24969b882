"""A lab report as data: what stands in it, in order, and from which cell of a notebook each piece comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Place:
    """Where a piece of a report is written or recorded.

    Attributes
    ----------
    notebook : file name, as in "04_results.ipynb"
    cell : id of the cell; "" where it is not known
    """

    notebook: str
    cell: str = ""

    @property
    def link(self) -> str:
        """A link from the folder of the notebooks; JupyterLab opens the notebook at the cell."""
        return f"{self.notebook}#cell-id={self.cell}" if self.cell else self.notebook


@dataclass(frozen=True)
class Axes:
    """What is written at the axes of one diagram of a figure, as the student gave it; "" for no label."""

    x_label: str
    y_label: str


@dataclass(frozen=True)
class Prose:
    """A text of the student's.

    Attributes
    ----------
    text : Markdown; "" where nothing is written yet
    place : its cell
    pictures : name, as the text has it in ``![…](name)`` → PNG
    """

    text: str
    place: Place
    pictures: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Figure:
    """A figure that was recorded, drawn anew from its numbers, or a picture of the student's in a text.

    Attributes
    ----------
    label : what texts call it by, as in "Figure 1.2", after its question; of a picture, its name in the text
    number : in this report, from 1
    caption : Markdown
    own_caption : whether the student wrote the caption; else it is the course's, and says only what the figure is
    svg : the picture; "" where nothing is recorded yet, and for a picture of a text
    alt : it in words, for who does not see it
    axes : of each diagram; none for a picture of a text
    place : the cell that records it
    written : the cell where the caption is to be written
    """

    label: str
    number: int
    caption: str
    own_caption: bool
    svg: str
    alt: str
    axes: tuple[Axes, ...]
    place: Place
    written: Place

    @property
    def in_text(self) -> bool:
        """Return whether it stands in a text of the student's, and was not recorded."""
        return bool(self.place.cell) and self.place == self.written


@dataclass(frozen=True)
class Table:
    """A table: of results that were recorded, or of the student's own in a text.

    Attributes
    ----------
    label : what texts call it by, as in "Table 1" of the course; "" for one in a text
    number : in this report, from 1
    caption : Markdown; "" for one in a text that has none
    own_caption : whether the student wrote the caption
    head : headings of the columns
    rows : entries of each row, Markdown; "" where nothing is filled in yet
    place : the cell that records it, or that has it in its text
    written : the cell where the caption is to be written
    """

    label: str
    number: int
    caption: str
    own_caption: bool
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    place: Place
    written: Place

    @property
    def in_text(self) -> bool:
        """Return whether it stands in a text of the student's, and was not recorded."""
        return bool(self.place.cell) and self.place == self.written


@dataclass(frozen=True)
class Equation:
    """A displayed equation of a text, or a result that is shown as one.

    Attributes
    ----------
    number : in this report, from 1
    latex : without its tag
    tag : what the student called it by, as in ``\\tag{1}``; "" where they did not
    place : its cell
    """

    number: int
    latex: str
    tag: str
    place: Place


Block = Prose | Figure | Table | Equation


@dataclass(frozen=True)
class Section:
    """A numbered section, after an item of the report.

    Attributes
    ----------
    number : as on the scoring sheet, as in "II.1"
    heading : of the section
    blocks : in order. What a text holds (its equations, tables and pictures) follows it, to be counted; it is not
        shown a second time.
    place : where the section's text is written, or what it shows is recorded
    missing : names of results that it shows as equations, and that are not recorded yet
    """

    number: str
    heading: str
    blocks: tuple[Block, ...]
    place: Place
    missing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reference:
    """A source that is listed.

    Attributes
    ----------
    key : as texts cite it, as in "1" for [1]
    text : Markdown
    place : the cell where it is written
    """

    key: str
    text: str
    place: Place


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes
    ----------
    title, course, term : for the cover; term may be ""
    student : ID of whose folder it is
    authors : names for the cover, as the student wrote them; none if they wrote none
    date : as on the cover
    page_limit : pages that the course allows, cover and contents included; None where it sets no limit
    sections, references : in order
    front : the cell where authors, captions and references are written
    told : what was left out of the student's texts or could not be read, in words, and the cell of each
    """

    title: str
    course: str
    term: str
    student: str
    authors: tuple[str, ...]
    date: str
    page_limit: int | None
    sections: tuple[Section, ...]
    references: tuple[Reference, ...]
    front: Place
    told: tuple[tuple[str, Place], ...] = ()

    @property
    def texts(self) -> Iterator[Prose]:
        """All texts of the student's, in order; those not written yet, too."""
        return (block for section in self.sections for block in section.blocks if isinstance(block, Prose))

    @property
    def figures(self) -> Iterator[Figure]:
        """All figures, in the order of their numbers."""
        return (block for section in self.sections for block in section.blocks if isinstance(block, Figure))

    @property
    def tables(self) -> Iterator[Table]:
        """All tables, in the order of their numbers."""
        return (block for section in self.sections for block in section.blocks if isinstance(block, Table))

    @property
    def equations(self) -> Iterator[Equation]:
        """All numbered equations, in the order of their numbers."""
        return (block for section in self.sections for block in section.blocks if isinstance(block, Equation))
