"""Documents of a few blocks, to be set: what a report does with one text."""

import io
from collections.abc import Mapping

from PIL import Image

from labcourse.report import counting
from labcourse.report.document import (
    Block,
    Document,
    Equation,
    Figure,
    Place,
    Prose,
    Reference,
    Section,
    Table,
)

HERE = Place("04_results.ipynb", "text")
FRONT = Place("04_results.ipynb", "front")
RECORDED = Place("02_measuring.ipynb", "figure")
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="20" height="10"/></svg>'
ROW = ("The mass", "$m$", r"$\begin{bmatrix}1&2\\3&4\end{bmatrix}$", "kg")


def png(colour: str = "red") -> bytes:
    """A small picture."""
    packed = io.BytesIO()
    Image.new("RGB", (40, 20), colour).save(packed, "PNG")
    return packed.getvalue()


def of_text(text: str, pictures: Mapping[str, bytes] | None = None) -> Document:
    """A document with a figure, a table, one text, and a source."""
    shown: tuple[Block, ...] = (
        Figure("Figure 1.2", 1, "The speed $v$.", True, SVG, "A black box.", (), RECORDED, FRONT),
        Table("Table 3", 1, "Results.", True, ("What", "Symbol", "Value", "Unit"), (ROW,), RECORDED, FRONT),
    )
    prose = Prose(text, HERE, pictures or {})
    return Document(
        title="The first <report>",
        course="A course",
        term="2026",
        student="ada",
        authors=("Ada Lovelace", "Charles Babbage"),
        date="2026-11-23",
        page_limit=None,
        sections=(
            Section("I.1", "Results: Table 3", shown, RECORDED),
            Section("II.1", "Analysis: what follows", (prose, *counted(prose)), HERE),
        ),
        references=(Reference("1", "A. Author, *A title*.", FRONT),),
        front=FRONT,
    )


def counted(prose: Prose) -> tuple[Block, ...]:
    """What of a text gets a number, after one figure and one table."""
    numbers = {counting.EQUATION: 0, counting.TABLE: 1, counting.PICTURE_ALONE: 1}
    found: list[Block] = []
    for one in counting.counted(prose.text):
        numbers[one.kind] += 1
        number = numbers[one.kind]
        if one.kind == counting.EQUATION:
            found.append(Equation(number, one.content, one.name, HERE))
        elif one.kind == counting.TABLE:
            head, *rows = one.rows
            found.append(Table("", number, one.content, bool(one.content), head, tuple(rows), HERE, HERE))
        else:
            found.append(Figure(one.name, number, one.content, bool(one.content), "", "", (), HERE, HERE))
    return tuple(found)
