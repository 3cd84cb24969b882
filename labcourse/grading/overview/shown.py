"""A class at a glance, as text for a terminal, and as a page: no script, nothing loaded, all text escaped."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from labcourse.grading.overview.glance import Glance
from labcourse.grading.overview.section import Section, Table
from labcourse.grading.reports.templating import templates
from labcourse.safe_text import no_escapes

CLASS_FILE = "class.html"  #: in the folder of results
_WIDTH = 100  # columns of a terminal
_GAP = "  "
_LEAST = 12  # columns of a cell that has to be folded


def page(glance: Glance) -> str:
    """The page, as HTML."""
    return templates("overview/templates").get_template("class.html").render(glance=glance)


def lines(glance: Glance) -> Iterator[str]:
    """The same for a terminal, without what would steer it."""
    yield no_escapes(glance.about)
    if glance.left_out:
        yield from textwrap.wrap(no_escapes(glance.left_out), _WIDTH)
    for section in glance.sections:
        yield ""
        yield from map(no_escapes, _section(section))


def _section(section: Section) -> Iterator[str]:
    yield section.title.upper() + (" (to do)" if section.urgent else "")
    for sentence in (section.first, *section.more):
        yield from textwrap.wrap(sentence, _WIDTH, initial_indent=_GAP, subsequent_indent=_GAP)
    for table in section.tables:
        if table.rows:
            yield ""
            yield from (f"{_GAP}{line}" for line in _table(table))


def _table(table: Table) -> Iterator[str]:
    """Columns, the last of which takes what is left of the width, and is folded."""
    if table.caption:
        yield f"{table.caption}:"
    rows = [table.head, *(tuple(cell or "–" for cell in row) for row in table.rows)]
    widths = [max(_longest(row[place]) for row in rows) for place in range(len(table.head))]
    room = _WIDTH - len(_GAP) - sum(len(_GAP) + width for width in widths)
    for place in sorted(range(len(widths)), key=lambda place: -widths[place]):
        if room < 0:  # the widest first
            narrower = max(_LEAST, widths[place] + room)
            room += widths[place] - narrower
            widths[place] = narrower
    for number, row in enumerate(rows):
        yield from _row(row, widths, table.numbers)
        if number == 0:
            yield _GAP.join("-" * width for width in widths)


def _row(row: Sequence[str], widths: Sequence[int], numbers: frozenset[int]) -> Iterator[str]:
    folded = [
        [piece for line in cell.splitlines() for piece in textwrap.wrap(line, width) or [""]]
        for cell, width in zip(row, widths, strict=True)
    ]
    for number in range(max(map(len, folded))):
        cells = [pieces[number] if number < len(pieces) else "" for pieces in folded]
        placed = (
            cell.rjust(width) if place in numbers else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(cells, widths, strict=True))
        )
        yield _GAP.join(placed).rstrip()


def _longest(cell: str) -> int:
    return max(map(len, cell.splitlines()), default=0)
