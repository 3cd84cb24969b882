"""Answers in words: what a student wrote in the text cells of a notebook, read from the saved file.

A cell of the course for such an answer carries ``{"question", "part"}`` in its metadata (:data:`KEY`). It begins with
a heading of its own, which says what is to be written there, and a line to be written over (:data:`STUB`). Students
split cells, renew their ids, turn them into other kinds, or write in a cell of their own just below: their words are
taken wherever it is clear whose they are, and what is not clear is told.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from labcourse.answers import attached_pictures
from labcourse.answers.attached_pictures import Budget, Pictures
from labcourse.answers.handed_in import CODE, TEXT, Cell
from labcourse.answers.json_values import clean
from labcourse.answers.kinds.values import LONGEST_PROSE, STUBS, of_few_words

KEY = "labcourse"  #: of a cell's metadata: {"question": ..., "part": ...}
INSTRUCTOR = "instructor"  #: tag of cells that only an instructor's notebook has
MARK = "✎"  #: what a place to write begins with, in every notebook
STUB = (
    "*Double-click here, and write in place of this line. Formulas between `$` signs and pasted pictures are welcome.*"
)
#: Lines of the instructor's notebooks between which a model answer stands; they are not seen when it is rendered.
BEGIN, END = "<!-- BEGIN SOLUTION -->", "<!-- END SOLUTION -->"

Where = tuple[str, str]  # question, part

_IN_ITALICS = re.compile(r"\*[^*\n]+\*")
_HEADING = re.compile(rf'(?:<div class="[\w -]{{1,60}}"><b>|\*\*){MARK}[^*<>\n]{{1,200}}(?:</b></div>|\*\*)')
#: How text begins that somebody wrote into a code cell: some words in a row, and no keyword of Python first.
_PROSE = re.compile(r"\s*(?!(?:from|for|if|while|with|not|lambda|assert|del|import)\b)\w+(?:,? [^\W\d_]{1,40}){3}")


@dataclass(frozen=True)
class Words:
    """An answer in words.

    Attributes
    ----------
    text : Markdown, of at most :data:`~labcourse.answers.kinds.values.LONGEST_PROSE` characters
    pictures : name, as the text has it in ``![…](name)`` → PNG
    """

    text: str
    pictures: Mapping[str, bytes] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """As plain data, with pictures in base64."""
        return {
            "text": self.text,
            "pictures": {name: base64.b64encode(data).decode("ascii") for name, data in self.pictures.items()},
        }

    @classmethod
    def from_plain(cls, content: Mapping[str, Any]) -> Words:
        """What :meth:`plain` gave.

        Raises
        ------
        ValueError
            If it is something else.
        """
        try:
            pictures = {name: base64.b64decode(data, validate=True) for name, data in content["pictures"].items()}
            return cls(str(content["text"]), pictures)
        except (KeyError, TypeError, AttributeError, binascii.Error) as error:
            raise ValueError(repr(error)) from None


@dataclass
class Written:
    """What a student wrote in a notebook's text cells.

    Attributes
    ----------
    words : (question, part) → words; what is not there was not written
    notes : what a person may want to know, such as words that were found in another place
    problems : what is not read as the student left it
    asked : what is read as it is, and asked about
    """

    words: dict[Where, Words] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


def where_of(cell: Mapping[str, Any]) -> Where | None:
    """Of which question and part a cell of the course is the answer in words; None for any other cell."""
    metadata = cell.get("metadata")
    about = metadata.get(KEY) if isinstance(metadata, Mapping) else None
    if cell.get("cell_type") != TEXT or not isinstance(about, Mapping):
        return None
    question, part = about.get("question"), about.get("part")
    return (question, part) if isinstance(question, str) and isinstance(part, str) else None


def words_of(
    master_cells: Sequence[Mapping[str, Any]],
    student_cells: Sequence[Cell],
    files: Mapping[str, bytes] | None = None,
) -> dict[Where, Words]:
    """The words of a notebook, see :func:`written`."""
    return written(master_cells, student_cells, files).words


def written(
    master_cells: Sequence[Mapping[str, Any]],
    student_cells: Sequence[Cell],
    files: Mapping[str, bytes] | None = None,
    with_pictures: bool = True,
) -> Written:
    """The answers in words that a student's notebook holds.

    Parameters
    ----------
    master_cells : of the course's notebook as released
    student_cells : of the student's
    files : the student's own files beside the notebook, for pictures that a text shows from there
    with_pictures : decode them; else the text is all that is wanted
    """
    found, budget = Written(), Budget()
    places = _Places(master_cells, student_cells)
    for where, master in places.asked.items():
        label = f"{where[0]}, {where[1]}"
        cells, notes = places.cells_for(master)
        found.notes += [f"{label}: {note}" for note in notes]
        pieces = dict.fromkeys(piece for cell in cells if (piece := without_stub(cell.source, master)))
        text = clean("\n\n".join(pieces)).strip()
        if not text:
            continue
        attachments = {name: content for cell in reversed(cells) for name, content in cell.attachments.items()}
        if with_pictures:
            shown = attached_pictures.pictures_of(text, attachments, files, budget)
        else:
            shown = Pictures(attached_pictures.lifted(text)[0])
        found.problems += [f"{label}: {told}" for told in shown.told]
        if len(shown.text) > LONGEST_PROSE:
            found.problems.append(
                f"{label}: it has {len(shown.text)} characters, of which the first {LONGEST_PROSE} are read; "
                "shorten it."
            )
        if question := of_few_words(text):
            found.asked.append(f"{label}: {question}.")
        found.words[where] = Words(shown.text[:LONGEST_PROSE], shown.kept)
    return found


def without_stub(source: str, master: Mapping[str, Any]) -> str:
    """What a student wrote in a cell, without what the course had put there."""
    stubs = stubs_of(master)
    given = {line.strip() for line in [*source_of(master).split("\n"), *stubs, BEGIN, END]}
    lines = []
    for line in source.replace("\r\n", "\n").split("\n"):
        rest = _HEADING.sub("", line, count=1) if _HEADING.match(line.lstrip()) else line
        for stub in stubs:
            rest = rest.replace(stub, "")
        lines.append("" if rest.strip() in given or (rest != line and not rest.strip()) else rest)
    text = "\n".join(lines).strip()
    return "" if text.casefold().rstrip(".") in STUBS else text


def stubs_of(master: Mapping[str, Any]) -> list[str]:
    """The lines to be written over that a cell of the course may have."""
    given = [line.strip() for line in source_of(master).split("\n")]
    return list(dict.fromkeys([STUB, *(line for line in given if _IN_ITALICS.fullmatch(line))]))


def source_of(cell: Mapping[str, Any]) -> str:
    """The text of a cell as a notebook's file has it."""
    source = cell.get("source", "")
    return "".join(source) if isinstance(source, list) else str(source)


def heading(label: str) -> str:
    """The line with which an answer cell for words begins: a band in colour in JupyterLab, plain elsewhere."""
    return f'<div class="alert alert-success"><b>{MARK} {label}</b></div>'


def headings(source: str) -> list[str]:
    """The headings that say what is to be written in a cell."""
    return _HEADING.findall(source)


# --- which cells hold an answer ---------------------------------------------------------------------------------------


class _Places:
    """A student's cells beside the course's: which cell is whose, and which are the student's own."""

    def __init__(self, masters: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> None:
        self._cells = cells
        self._order = [_id(master) for master in masters]
        self.asked = {where: master for master in masters if (where := where_of(master)) is not None}
        self._answers = {_id(master): master for master in self.asked.values()}
        self._owners = _owners(masters, cells)

    def cells_for(self, master: Mapping[str, Any]) -> tuple[list[Cell], list[str]]:
        """The cells that hold an answer, in order, and what is worth saying of how they were found."""
        own, notes = self._pieces(master)
        filled = [place for place in own if self._filled(place, master)]
        below = self._texts(self._after(own[-1])) if own else []
        if any(self._cells[place].kind != TEXT for place in filled):
            notes.append("written in a cell that is no text cell any more.")
        if filled and below:
            notes.append("with the text of an added cell just below the answer cell.")
        elif below:
            notes.append("taken from an added cell just below the answer cell, which is empty.")
        elif not filled and (below := self._texts(self._gap(_id(master), own))):
            notes.append(
                "taken from an added cell just above the answer cell, which is empty."
                if own
                else "taken from an added cell where the answer cell is missing."
            )
        elif not filled and any(map(self._may_be_words, self._near(_id(master), own))):
            notes.append("nothing is written in its cell; an added cell beside it is not read as the answer.")
        return [self._cells[place] for place in [*filled, *below]], notes

    def _filled(self, place: int, master: Mapping[str, Any]) -> bool:
        return bool(without_stub(self._cells[place].source, master))

    def _pieces(self, master: Mapping[str, Any]) -> tuple[list[int], list[str]]:
        """The pieces of an answer cell that stand together, or the only ones with something in them."""
        own = [place for place, owner in enumerate(self._owners) if owner == _id(master)]
        stretches: list[list[int]] = []
        for place in own:
            if stretches and not any(self._owners[stretches[-1][-1] + 1 : place]):
                stretches[-1].append(place)
            else:
                stretches.append([place])
        filled = [one for one in stretches if any(self._filled(place, master) for place in one)]
        texts = {"\n\n".join(self._cells[place].source for place in one) for one in filled}
        if len(texts) < 2:
            return (filled or stretches or [[]])[0], []
        told = "there are {count} copies of its cell that differ; all are read, one after the other."
        return own, [told.format(count=len(filled))]

    def _after(self, place: int) -> list[int]:
        """The student's own cells that follow a cell, up to the next of the course."""
        found = []
        for later in range(place + 1, len(self._cells)):
            if self._owners[later]:
                break
            found.append(later)
        return found

    def _texts(self, places: Iterable[int]) -> list[int]:
        """Those with text in them."""
        return [place for place in places if self._cells[place].kind in (TEXT, "raw") and self._filled(place, {})]

    def _may_be_words(self, place: int) -> bool:
        cell = self._cells[place]
        return self._filled(place, {}) if cell.kind in (TEXT, "raw") else bool(_PROSE.match(cell.source))

    def _before(self, name: str) -> str:
        """The course's cell before one, of those that the student still has; "" if there is none."""
        at = self._order.index(name)
        return next((one for one in reversed(self._order[:at]) if one in self._owners), "")

    def _near(self, name: str, own: Sequence[int]) -> list[int]:
        """The student's own cells about an answer cell, or about where it is missing."""
        before = self._before(name)
        above = self._after(max(place for place, owner in enumerate(self._owners) if owner == before) if before else -1)
        return [*above, *(self._after(own[-1]) if own else [])]

    def _gap(self, name: str, own: Sequence[int]) -> list[int]:
        """The student's own cells just above an answer cell, or where it is missing; none that may be another's."""
        before = self._before(name)
        if before in self._answers and not any(
            owner == before and self._filled(place, self._answers[before]) for place, owner in enumerate(self._owners)
        ):
            return []
        gap = self._near(name, ())
        if own:
            return gap if gap and gap[-1] + 1 == own[0] else []
        missing = []
        for one in self._order[self._order.index(before) + 1 if before else 0 :]:
            if one in self._owners:
                break
            missing.append(one)
        return gap if [one for one in missing if one in self._answers] == [name] else []


def _id(cell: Mapping[str, Any]) -> str:
    return str(cell.get("id", ""))


def _owners(masters: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> list[str]:
    """For each of the student's cells, the id of the course's cell that it is; "" for one of their own."""
    ids = {_id(master) for master in masters}
    by_grade_id = {grade_id(master): _id(master) for master in masters if grade_id(master)}
    by_heading = {
        heading: _id(master) for master in masters if where_of(master) for heading in headings(source_of(master))
    }
    by_source: dict[str, list[str]] = {}
    for master in masters:
        by_source.setdefault(source_of(master).strip(), []).append(_id(master))

    def owner(cell: Cell) -> str:
        if cell.id and cell.id in ids:
            return cell.id
        if cell.grade_id in by_grade_id:
            return by_grade_id[cell.grade_id]
        if named := [by_heading[one] for one in headings(cell.source) if one in by_heading]:
            return named[0]
        alike = by_source.get(cell.source.strip(), []) if cell.source.strip() else []
        return alike[0] if len(alike) == 1 else ""

    return [owner(cell) for cell in cells]


def grade_id(cell: Mapping[str, Any]) -> str:
    """As a cell's grading metadata say; "" where there are none."""
    metadata = cell.get("metadata")
    about = metadata.get("nbgrader") if isinstance(metadata, Mapping) else None
    found = about.get("grade_id") if isinstance(about, Mapping) else None
    return found if isinstance(found, str) else ""


def _for_instructors(cell: Mapping[str, Any]) -> bool:
    metadata = cell.get("metadata") if isinstance(cell, Mapping) else None
    tags = metadata.get("tags") if isinstance(metadata, Mapping) else None
    return isinstance(tags, list) and INSTRUCTOR in tags


def own_masters(cells: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The course's cells, as far as a student's own copy of a notebook shows them: by their metadata.

    Cells that have been split are there once. A notebook with cells for instructors is theirs, and none of it added.
    """
    found: dict[str, Mapping[str, Any]] = {}
    whole = any(_for_instructors(cell) for cell in cells)
    for cell in cells:
        metadata = cell.get("metadata") if isinstance(cell, Mapping) else None
        if not isinstance(metadata, Mapping):
            continue
        if whole or grade_id(cell) or metadata.get("deletable") is False or metadata.get("editable") is False:
            name = grade_id(cell) or str(cell.get("id", ""))
            kind = TEXT if KEY in metadata else cell.get("cell_type", CODE)
            found.setdefault(name, {"id": name, "cell_type": kind, "metadata": metadata, "source": ""})
    return list(found.values())
