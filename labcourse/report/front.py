"""What a student writes for a report besides its texts: authors, captions and sources, in a text cell of their own.

The cell is a list that reads well in a notebook. Each entry has its name in bold, and then its text::

    * **Authors:** Ada Lovelace, Charles Babbage
    * **Figure 1.2:** The speed against time.
    * **[1]** A. Author, *A title*, 2020.

Its metadata has ``{"front": NUMBER OF THE REPORT}`` (:data:`labcourse.answers.words.KEY`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from labcourse.answers.json_values import clean
from labcourse.answers.notebooks import TEXT
from labcourse.answers.words import KEY, source_of
from labcourse.report.document import Notice, Place, Text

FRONT = "front"  #: in the metadata of the cell: the report's number
_ENTRY = re.compile(r"[ \t]{0,3}[*+-][ \t]+\*\*\s*(?P<name>[^*\n]{1,80}?)\s*:?\*\*[ \t]*:?[ \t]*(?P<text>.*)")
_SOURCE = re.compile(r"\[(?P<key>[\w.:-]{1,30})\]")
_LINES = ("Authors", "Title", "Course", "Date")  # entries for the cover
_LONGEST = 2000  # characters of an entry; a third of a page
_MOST = 100  # entries; twenty are many


@dataclass
class Front:
    """The entries of the cell.

    Attributes
    ----------
    place : of the cell
    lines : "Authors", "Title", "Course" or "Date" → text, without empty ones
    captions : label, as in "Figure 1.2" → Markdown, without empty ones
    sources : key, as in "1" → its text
    notices : what was not understood
    """

    place: Place
    lines: dict[str, str] = field(default_factory=dict)
    captions: dict[str, str] = field(default_factory=dict)
    sources: dict[str, Text] = field(default_factory=dict)
    notices: list[Notice] = field(default_factory=list)


def read(cells: Sequence[Any], notebook: str, report: str, labels: Sequence[str]) -> Front:
    """Read the entries from a notebook.

    Parameters
    ----------
    cells : of the notebook's file
    notebook : file name
    report : number of the report
    labels : of the figures and tables that have a caption
    """
    own = [cell for cell in cells if _is_front(cell, report)]
    places = [Place(notebook, str(cell.get("id", ""))) for cell in own]
    front = Front(places[0] if places else Place(notebook))
    if not own:
        message = "The cell for authors, captions and sources is missing: lab.restore() gives it back."
        front.notices.append(Notice(message, front.place))
    for cell, place in zip(own, places, strict=True):
        for name, text in _entries(clean(source_of(cell))):
            if text:
                _add(front, place, labels, name, text)
    return front


def _is_front(cell: Any, report: str) -> bool:
    about = cell["metadata"].get(KEY)
    return isinstance(about, Mapping) and about.get(FRONT) == report and cell.get("cell_type") == TEXT


def _entries(source: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of each entry. A text may go on over several lines, up to a blank one."""
    entries: list[tuple[str, list[str]]] = []
    is_open = False
    for line in source.split("\n"):
        if match := _ENTRY.fullmatch(line):
            entries.append((match["name"], [match["text"]]))
        elif line.strip() and is_open:
            entries[-1][1].append(line.strip())
        is_open = bool(match or (line.strip() and is_open))
    for name, lines in entries[:_MOST]:
        yield name, "\n".join(lines).strip()[:_LONGEST]


def _add(front: Front, place: Place, labels: Sequence[str], name: str, text: str) -> None:
    if name in _LINES:
        front.lines[name] = text
    elif name in labels:
        front.captions[name] = text
    elif match := _SOURCE.fullmatch(name):
        if match["key"] in front.sources and front.sources[match["key"]].place == place:
            front.notices.append(Notice(f"There are two sources {name}; the last counts.", place))
        front.sources[match["key"]] = Text(text, place)
    else:
        known = ", ".join([*_LINES, *labels, "[1]"])
        message = f"{name!r} is none of the report's entries, and is left out; there are {known}."
        front.notices.append(Notice(message, place))
