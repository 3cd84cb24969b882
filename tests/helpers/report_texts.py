"""Documents of a few pieces, to be written: what a report does with one text."""

import io
from collections.abc import Mapping

from PIL import Image

from labcourse.answers.report_files import COMPOSED
from labcourse.report.document import Document, Place, Recorded, Section, Text

HERE = Place("04_results.ipynb", "text")
FRONT = Place("04_results.ipynb", "front")
RECORDED = Place("02_measuring.ipynb", "figure")
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="20" height="10"/></svg>'
TABLE = (
    "| What | Symbol | Value | Unit |\n|---|---|---|---|\n| The mass | $m$ | "
    r"$\begin{bmatrix}1&2\\3&4\end{bmatrix}$ | kg |"
)


def png(colour: str = "red") -> bytes:
    """A small picture."""
    packed = io.BytesIO()
    Image.new("RGB", (40, 20), colour).save(packed, "PNG")
    return packed.getvalue()


def of_text(text: str, pictures: Mapping[str, bytes] | None = None) -> Document:
    """A document with a figure, a table, one text, and a source."""
    caption = Text("The speed $v$.", FRONT)
    figure = Recorded("Figure 1.2", caption, True, RECORDED, svg=SVG, alt="A black box.")
    table = Recorded("Table 3", Text("Results.", FRONT), True, RECORDED, table=TABLE)
    return Document(
        cover={
            "title": "The first <report>",
            "course": "A course",
            "term": "2026",
            "authors": "Ada Lovelace, Charles Babbage",
            "student": "ada",
            "date": "2026-11-23",
        },
        page_limit=None,
        keyword=COMPOSED,
        sections=(
            Section("I.1", "Results: Table 3", (figure, table), RECORDED),
            Section("II.1", "Analysis: what follows", (Text(text, HERE, pictures or {}),), HERE),
        ),
        sources={"1": Text("A. Author, *A title*.", FRONT)},
        front=FRONT,
    )
