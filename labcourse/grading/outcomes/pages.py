"""The room's templates and tables: everything that is put into them is text, whatever it says."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from labcourse.grading.reports.templating import templates

_ROOM = "labcourse.grading.outcomes"


def page(name: str, **values: Any) -> str:
    """A page from its template; all text in it is escaped, and steers nothing."""
    return templates("outcomes/templates").get_template(name).render(**values) + "\n"


def source(name: str) -> bytes:
    """A template as it is."""
    return files(_ROOM).joinpath("templates", name).read_bytes()
