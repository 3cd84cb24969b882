"""The room's templates and tables: everything that is put into them is text, whatever it says."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import Any

from rotflex.instructor.reports.safe_text import spreadsheet_cell
from rotflex.instructor.reports.templating import templates

_ROOM = "rotflex.instructor.outcomes"


def page(name: str, **values: Any) -> str:
    """A page from its template; all text in it is escaped, and steers nothing."""
    return templates("outcomes/templates").get_template(name).render(**values) + "\n"


def source(name: str) -> bytes:
    """A template as it is."""
    return files(_ROOM).joinpath("templates", name).read_bytes()


def table(rows: Iterable[Sequence[str]]) -> str:
    """Rows as CSV, in which a spreadsheet finds nothing to calculate."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows([spreadsheet_cell(cell) for cell in row] for row in rows)
    return text.getvalue()
