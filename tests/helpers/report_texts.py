"""Reports of a few pieces, to be written: what a report does with one text."""

import io
from collections.abc import Mapping

from PIL import Image

from labcourse.answers.report_files import COMPOSED
from labcourse.report.contents import Contents, Exhibit, Heading, Text

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="20" height="10"/></svg>'
TABLE = (
    "| What | Symbol | Value | Unit |\n|---|---|---|---|\n| The mass | $m$ | "
    r"$$\begin{bmatrix}1&2\\3&4\end{bmatrix}$$ | kg |"
)
COVER = {
    "title": "The first <report>",
    "course": "A course",
    "term": "2026",
    "authors": "Ada Lovelace, Charles Babbage",
}
COVER |= {"student": "ada", "date": "2026-11-23"}


def png(colour: str = "red") -> bytes:
    """A small picture."""
    packed = io.BytesIO()
    Image.new("RGB", (40, 20), colour).save(packed, "PNG")
    return packed.getvalue()


def of_text(text: str, pictures: Mapping[str, bytes] | None = None, **cover: str) -> Contents:
    """A report with a figure, a table, one text, and a source."""
    pieces = (
        Heading(1, "I Results"),
        Heading(2, "I.1 Table 3: Results"),
        Text("It was fast."),
        Exhibit("Figure 1.2", "The speed $v$.", svg=SVG, alt="A black box."),
        Exhibit("Table 3", "Results.", table=TABLE),
        Heading(2, "II.1 What follows"),
        Text(text, pictures or {}),
        Heading(1, "References"),
        Text("A. Author, *A title*.", source="1"),
    )
    return Contents(COVER | cover, pieces, COMPOSED)
