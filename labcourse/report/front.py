"""What a student writes for a report besides its texts: authors, captions and sources, in a text cell of their own.

The cell is a list that reads well in a notebook; each entry has its name in bold, and what is written after it::

    * **Authors:** Ada Lovelace, Charles Babbage
    * **Figure 1.2:** The speed against time.
    * **[1]** A. Author, *A title*, 2020.

It carries ``{"front": NUMBER OF THE REPORT}`` in its metadata (:data:`labcourse.answers.words.KEY`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from labcourse.answers.json_values import clean
from labcourse.answers.notebooks import TEXT
from labcourse.answers.words import KEY, source_of
from labcourse.report.document import Place, Reference

FRONT = "front"  #: in the metadata of the cell: the report's number
_ENTRY = re.compile(
    r"[ \t]{0,3}[*+-][ \t]+\*\*\s*(?P<name>[^*\n]{1,80}?)\s*(?P<colon>:?)\*\*[ \t]*:?[ \t]*(?P<text>.*)"
)
_KEY = re.compile(r"\[(?P<key>[\w.:-]{1,30})\]")
_LONGEST = 2000  # characters of an entry; a third of a page
_MOST = 100  # entries; twenty are many


@dataclass
class Front:
    """The entries of the cell.

    Attributes
    ----------
    place : of the cell
    authors : names; none if none are written
    title, course, date : as written; "" where they are not, and are those of the course or of today
    captions : label, as in "Figure 1.2" → Markdown; without those that are empty
    references : the sources
    told : what was not understood
    """

    place: Place
    authors: tuple[str, ...] = ()
    title: str = ""
    course: str = ""
    date: str = ""
    captions: dict[str, str] = field(default_factory=dict)
    references: tuple[Reference, ...] = ()
    told: list[tuple[str, Place]] = field(default_factory=list)


def read(cells: Sequence[Any], notebook: str, report: str, labels: Mapping[str, str]) -> Front:
    """What is written of a report's front in a notebook.

    Parameters
    ----------
    cells : of the notebook's file
    notebook : file name
    report : number of the report
    labels : names of entries for captions → what the figure or table is called by; one may have several names
    """
    found = [cell for cell in cells if _is_front(cell, report)]
    if not found:
        front = Front(Place(notebook))
        front.told.append(
            ("The cell for authors, captions and sources is missing: lab.restore() gives it back.", front.place)
        )
        return front
    places = [Place(notebook, str(cell.get("id", ""))) for cell in found]
    front = Front(places[0])
    references: dict[str, Reference] = {}
    for cell, place in zip(found, places, strict=True):
        for name, text in _entries(clean(source_of(cell))):
            _take(front, references, place, labels, name, text)
    front.references = tuple(references.values())
    return front


def _is_front(cell: Any, report: str) -> bool:
    metadata = cell.get("metadata") if isinstance(cell, Mapping) else None
    about = metadata.get(KEY) if isinstance(metadata, Mapping) else None
    return isinstance(about, Mapping) and about.get(FRONT) == report and cell.get("cell_type") == TEXT


def _entries(source: str) -> Iterator[tuple[str, str]]:
    """Name and text of each entry. A text may go on over several lines, up to a blank one."""
    entries: list[tuple[str, list[str]]] = []
    open_entry = False
    for line in source.split("\n"):
        if match := _ENTRY.fullmatch(line):
            entries.append((match["name"], [match["text"]]))
            open_entry = True
        elif line.strip() and open_entry:
            entries[-1][1].append(line.strip())
        else:
            open_entry = False
    for name, lines in entries[:_MOST]:
        yield name, "\n".join(lines).strip()[:_LONGEST]


def _take(
    front: Front,
    references: dict[str, Reference],
    place: Place,
    labels: Mapping[str, str],
    name: str,
    text: str,
) -> None:
    """Put an entry in its place; an empty one leaves what was there."""
    key = _KEY.fullmatch(name)
    if key and text:
        if key["key"] in references and references[key["key"]].place == place:
            front.told.append((f"There are two sources [{key['key']}]; the last counts.", place))
        references[key["key"]] = Reference(key["key"], text, place)
    elif name in ("Authors", "Authors"):
        front.authors = tuple(filter(None, (one.strip() for one in re.split(r"[;,\n]", text)))) or front.authors
    elif name in (lines := _lines()):
        setattr(front, lines[name], " ".join(text.split()) or getattr(front, lines[name]))
    elif name in labels:
        front.captions.update({labels[name]: text} if text else {})
    elif text and not key:
        front.told.append(
            (
                "{name!r} is none of the report's entries, and is left out; there are {labels}.".format(
                    name=name,
                    labels=", ".join(["Authors", "Title", "Course", "Date", *_called(labels), "[1]"]),
                ),
                place,
            )
        )


def _called(labels: Mapping[str, str]) -> list[str]:
    return list(dict.fromkeys(labels.values()))


def _lines() -> dict[str, str]:
    """Names of entries of one line → the attribute that each is kept under."""
    known = {"title": ("Title", "Title"), "course": ("Course", "Course"), "date": ("Date", "Date")}
    return {name: kept for kept, names in known.items() for name in names}
