"""A file of another program, cell by cell. What is not changed stays as it is, byte for byte.

The file is never written anew from its cells: a new cell is put in the place of the old one, and all around it is what
was there. So encoding, byte-order mark, separators, quotes, line ends and empty lines are the platform's own.
"""

from __future__ import annotations

import codecs
import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass

from labcourse.errors import GradingError

SEPARATORS = (",", ";", "\t")  #: that platforms write
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_LINE_END = re.compile(r"\r\n|\r|\n")
_EXCEL = b"PK\x03\x04"  # how a zip begins, and so Excel's own files


@dataclass(frozen=True)
class Cell:
    """A cell: where it stands in the text, quotes included, and what it says."""

    start: int
    end: int
    text: str
    quoted: bool


@dataclass(frozen=True)
class Text:
    """A file as text, with what it takes to have its bytes again."""

    text: str
    codec: str
    mark: bytes = b""

    def data(self, text: str | None = None) -> bytes:
        """The bytes of this text, or of another in its place."""
        return self.mark + (self.text if text is None else text).encode(self.codec)


def read(data: bytes) -> Text:
    """A file's bytes as text.

    UTF-8, or UTF-16 as Blackboard writes it, with or without a byte-order mark; what is neither is taken byte by byte,
    so that it stays what it is.

    Raises
    ------
    GradingError
        If it is Excel's, or damaged.
    """
    if data.startswith(_EXCEL):
        raise GradingError(
            "It is a file of Excel's own. Export it from the platform as CSV again, and give that file as it comes."
        )
    mark, codec = next(((mark, codec) for mark, codec in _MARKS if data.startswith(mark)), (b"", ""))
    body = data[len(mark) :]
    codec = codec or _codec(body)
    try:
        return Text(body.decode(codec), codec, mark)
    except UnicodeDecodeError as error:
        raise GradingError(
            f"It says that it is {codec.upper()}, and its byte {len(mark) + error.start} is not: it is damaged. "
            "Export it again."
        ) from None


def _codec(body: bytes) -> str:
    """How a file without a byte-order mark is written."""
    if body[1:2] == b"\0":
        return "utf-16-le"
    if body[:1] == b"\0":
        return "utf-16-be"
    try:
        body.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


@dataclass(frozen=True)
class Table:
    """The cells of a file.

    Attributes
    ----------
    source : the file as text
    separator : between its cells
    rows : of cells; an empty line has none
    """

    source: Text
    separator: str
    rows: tuple[tuple[Cell, ...], ...]

    def cell(self, row: int, place: int) -> str:
        """What a cell says; "" where its row is shorter."""
        cells = self.rows[row]
        return cells[place].text if place < len(cells) else ""

    def line(self, row: int) -> int:
        """The line on which a row begins, counted from 1."""
        cells = self.rows[row]
        start = cells[0].start if cells else 0
        return len(_LINE_END.findall(self.source.text, 0, start)) + 1

    def changed(self, new: Mapping[tuple[int, int], str]) -> bytes:
        """The file's bytes with other text in some of its cells.

        Parameters
        ----------
        new : row and place, counted from 0 → what the cell is to say
        """
        text, pieces, done = self.source.text, [], 0
        for (row, place), said in sorted(new.items()):
            cell = self.rows[row][place]
            pieces += [text[done : cell.start], self._written(said, cell.quoted)]
            done = cell.end
        return self.source.data("".join([*pieces, text[done:]]))

    def _written(self, said: str, quoted: bool) -> str:
        """A cell as it stands in the file: in quotes if the old one was, or if it has to be."""
        if quoted or any(one in said for one in (self.separator, '"', "\r", "\n")):
            return '"' + said.replace('"', '""') + '"'
        return said


def table(source: Text, separator: str) -> Table:
    """The cells of a text.

    Raises
    ------
    GradingError
        If a quote is opened and never closed.
    """
    one_cell = _pattern(separator)
    text, place = source.text, 0
    rows: list[tuple[Cell, ...]] = []
    row: list[Cell] = []
    while place < len(text) or row:
        found = one_cell.match(text, place)
        if found is None:
            line = len(_LINE_END.findall(text, 0, place)) + 1
            raise GradingError(f"A quote that is opened in line {line} is never closed: the file is damaged.")
        inside, rest, then = found["inside"], found["rest"], found["then"]
        said = rest if inside is None else inside.replace('""', '"') + rest
        cell = Cell(place, found.start("then"), said, inside is not None)
        place = found.end()
        row.append(cell)
        if then == separator:
            continue
        blank = len(row) == 1 and cell.start == cell.end
        rows.append(() if blank else tuple(row))
        row = []
    return Table(source, separator, tuple(rows))


@functools.cache
def _pattern(separator: str) -> re.Pattern[str]:
    """One cell and what ends it. As in every CSV, quotes count only where a cell begins with one."""
    not_ended = f"[^{re.escape(separator)}\r\n]*"
    quoted = r'"(?P<inside>(?:[^"]|"")*+)"'
    return re.compile(rf'(?:{quoted}|(?!"))(?P<rest>{not_ended})(?P<then>{re.escape(separator)}|\r\n|\r|\n|\Z)')
