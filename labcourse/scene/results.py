"""A course's results tables, fed by the answers, to be taken along as CSV or HTML."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from labcourse import safe_text
from labcourse.answers.answers import HEADS
from labcourse.scene.explorer import Explorer, written
from labcourse.scene.scene import Button, Readout, Row, Scene

if TYPE_CHECKING:
    from labcourse.session import Session

_EMPTY = "not filled in yet"
_BUTTONS = {"refresh": "Read the answers again", "csv": "Save as CSV", "html": "Save as HTML"}
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif }} table {{ border-collapse: collapse }} caption {{ font-weight: bold;
text-align: left }} th, td {{ border-bottom: 1px solid #999; padding: 3px 10px; vertical-align: top }}</style></head>
<body>{table}</body></html>
"""


class ResultsExplorer(Explorer):
    """A results table that follows the answers.

    Parameters
    ----------
    session : the student's
    number : of the table, as in "Table 1"

    Raises
    ------
    AnswerError
        If there is no such table.
    """

    def __init__(self, session: Session, number: str) -> None:
        self._session, self._number = session, number
        self.table = session.table(number)
        super().__init__()

    def press(self, name: str) -> None:
        """Read the answers again, or write a file."""
        self.table = self._session.table(self._number)
        if name == "refresh":
            return
        file_name = f"{self._number.lower().replace(' ', '_')}.{name}"
        if name == "csv":  # the mark at the beginning tells spreadsheets that it is UTF-8
            content = safe_text.as_csv([HEADS, *self.table.rows]).encode("utf-8-sig")
        else:
            content = _PAGE.format(title=escape(self.table.title), table=self.table._repr_html_()).encode()
        path = written(Path.cwd() / file_name, content)
        self.notice = f"Saved as {path.name}, beside the notebook."

    def view(self) -> Scene:
        """The table, and the buttons."""
        missing = sum(not entry for _prompt, _name, entry, _unit in self.table.rows)
        rows = [Row(prompt, (name, entry or _EMPTY, unit)) for prompt, name, entry, unit in self.table.rows]
        left = f"{missing} of {len(rows)} entries are missing." if missing else "All entries are there."
        return Scene(
            alt=str(self.table),
            controls=[[Button(name, label) for name, label in _BUTTONS.items()]],
            readouts=[Readout(f"{self.table.title}. {left}", rows, HEADS)],
            height=0,
        )

    def static_view(self) -> tuple[dict[str, str], dict[str, str]]:
        """The table itself."""
        return {"text/html": self.table._repr_html_()}, {}

    def __repr__(self) -> str:
        return str(self.table)


def results_table(session: Session, number: str) -> ResultsExplorer:
    """A results table, as a notebook makes it; see :class:`ResultsExplorer`."""
    return ResultsExplorer(session, number)
