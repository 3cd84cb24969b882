"""What is missing in a report: texts, answers, captions, units, figures that no text mentions, and pages too many.

Nothing here is a mark. How a text is written is not looked at; :data:`NOT_CHECKED` tells students so.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from labcourse.answers.labels import normalized, unit_places
from labcourse.report.document import Document, Figure, Place, Prose, Section, Table
from labcourse.report.referring import References

NOT_CHECKED = (
    "The list covers missing texts and answers, captions, units, figures that no text mentions, and the page limit. "
    "It does not cover spelling, style, formulas, sources, or whether numbers and claims are right: read the report "
    "once more."
)
NOT_CHECKED_OF_PDF = (
    "Of your own PDF, only the number of pages, the headings of its parts, and whether the text mentions each figure "
    "that has a caption are looked at. Go through the list in the notebook yourself for everything else."
)

_VALUE = 2  # column of a results table that was recorded
_DECIMAL = re.compile(r"[-−+]?\d+[.,]\d+")  # a measured number, and no count
#: Quantities that have no unit.
_WITHOUT_UNIT = re.compile(
    r"\b(?:number|counts?|index|samples?|ratio|normali[sz]ed|relative|probability|rank|order|dimensionless|units?)\b"
)
_LONGEST_HEADING = 60  # characters of a line in a PDF; three quarters of a line
_HEADING_BEGINS = 6  # letters by which a heading is known: "Conclu" of Conclusion and Conclusions
_CAPTION = re.compile(r"^\s*(?:figure|fig\.)\s+(\d{1,3})\s*[.:|–—-](?!\d)", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Fault:
    """Something to put right in a report.

    Attributes
    ----------
    kind : "pages", "text", "answer", "caption", "unit" or "mention"; of a PDF also "headings" and "scanned"
    message : what is missing, and what to do
    place : the cell in which to do it
    """

    kind: str
    message: str
    place: Place


def faults(document: Document, pages: int) -> list[Fault]:
    """Return what is missing in a report, in the order of its sections.

    Parameters
    ----------
    document : the report
    pages : how many it has as PDF
    """
    references = References.of(document)
    mentioned = {anchor for text in document.texts for anchor in _anchors(text.text, references, text.place)}
    found = list(_too_long(pages, document.page_limit, document.front))
    for section in document.sections:
        found += _empty(section)
        for block in section.blocks:
            if isinstance(block, Figure | Table):
                found += _caption(block)
            if isinstance(block, Figure):
                found += _axes(block)
                if not block.in_text and f"figure-{block.number}" not in mentioned:
                    message = (
                        f"{_name(block)}: no text mentions it by its number. Write “{block.label}” where you use it."
                    )
                    found.append(Fault("mention", message, block.place))
            elif isinstance(block, Table) and block.in_text and not _names_unit(block):
                message = f"{_name(block)} names no unit. Put it behind the quantity, as in “time (s)”."
                found.append(Fault("unit", message, block.place))
    return found


def _too_long(pages: int, limit: int | None, place: Place) -> Iterator[Fault]:
    if limit is not None and pages > limit:
        message = f"The report has {pages} pages, cover and contents included; your course allows {limit}. Shorten it."
        yield Fault("pages", message, place)


def _empty(section: Section) -> Iterator[Fault]:
    """Texts that are not written, and answers that are not recorded."""
    name = f"{section.number} {section.heading}"
    if section.missing:
        message = f"{name}: not recorded: {', '.join(section.missing)}. Run the cell that records it."
        yield Fault("answer", message, section.place)
    for block in section.blocks:
        if isinstance(block, Prose) and not block.text.strip():
            message = f"{name}: nothing is written. Write the text into its cell, and save the notebook."
            yield Fault("text", message, block.place)
        elif isinstance(block, Figure) and not block.in_text and not block.svg:
            message = f"{_name(block)} is not recorded. Run the cell that draws it and the one below it."
            yield Fault("answer", message, block.place)
        elif isinstance(block, Table) and not block.in_text:
            empty = ", ".join(row[0] for row in block.rows if not row[_VALUE].strip())
            if empty:
                message = f"{_name(block)}: not filled in: {empty}. Fill it in, and record the table again."
                yield Fault("answer", message, block.place)


def _caption(block: Figure | Table) -> Iterator[Fault]:
    if block.own_caption:
        return
    if not block.in_text:
        how = "Write it into the cell of authors, captions and sources: what is shown, and what to look at."
    elif isinstance(block, Table):
        how = "Write it above the table, with a blank line between, and begin it with “Table:”."
    else:
        how = "Write it into the square brackets before the picture’s name."
    yield Fault("caption", f"{_name(block)} has no caption of yours. {how}", block.written)


def _axes(figure: Figure) -> Iterator[Fault]:
    labels = [(axis, label) for one in figure.axes for axis, label in (("x", one.x_label), ("y", one.y_label))]
    for axis, label in dict.fromkeys(labels):
        if not label.strip():
            what = f"the {axis} axis has no label"
        elif not _has_unit(label):
            what = f"the {axis} axis “{label}” has no unit"
        else:
            continue
        message = f"{_name(figure)}: {what}. Write quantity and unit, as in “time (s)”, and record the figure again."
        yield Fault("unit", message, figure.place)


def _has_unit(text: str) -> bool:
    """Return whether something stands where a unit may, or none is needed. What it is, is not looked at."""
    known = normalized(text)
    return bool(unit_places(text) or known.endswith(("°", "%")) or _WITHOUT_UNIT.search(known))


def _names_unit(table: Table) -> bool:
    """Return whether a table of a student's text names a unit anywhere, or needs none."""
    entries = [entry.strip(" *$") for row in (table.head, *table.rows) for entry in row]
    words = [entry for entry in entries if not _DECIMAL.fullmatch(entry)]
    return len(words) == len(entries) or any(map(_has_unit, words))


def _anchors(text: str, references: References, place: Place) -> set[str]:
    """Return the anchors of all that a text refers to, as the report links them."""
    return {piece.anchor for piece in references.found(text, place, lambda _missing: None)}


def _name(block: Figure | Table) -> str:
    """Return the number of a figure or table in the report, and its label if that is another."""
    name = f"{'Figure' if isinstance(block, Figure) else 'Table'} {block.number}"
    return name if block.in_text or block.label == name else f"{name} ({block.label})"


# --- a student's own PDF ---------------------------------------------------------------------------------------------


def faults_of_pdf(pages: Sequence[str], name: str, titles: Collection[str], limit: int | None) -> list[Fault]:
    """Return what is missing in a PDF that a student wrote elsewhere, as far as the text of its pages tells.

    Parameters
    ----------
    pages : the text of each
    name : of its file
    titles : of the parts that the course asks for
    limit : pages that the course allows; None for any number
    """
    place, text = Place(name), "\n".join(pages)
    found = list(_too_long(len(pages), limit, place))
    if not text.strip():
        message = "There is no text in it: its pages are pictures, of which nothing else can be looked at."
        return [*found, Fault("scanned", message, place)]
    lines = [line.casefold() for line in text.split("\n") if len(line.strip()) <= _LONGEST_HEADING]
    missing = [title for title in titles if not any(title.casefold()[:_HEADING_BEGINS] in line for line in lines)]
    if missing:
        message = (
            f"No heading is found for {', '.join(missing)}. Give each part the heading that the course has for it."
        )
        found.append(Fault("headings", message, place))
    captioned = dict.fromkeys(_CAPTION.findall(text))
    mentioned = _anchors(
        _CAPTION.sub("", text),
        References({"figure": {number: int(number) for number in captioned}, "table": {}}),
        place,
    )
    for number in captioned:
        if f"figure-{int(number)}" not in mentioned:
            message = f"Figure {number}: no text mentions it by its number. Name it where you use it."
            found.append(Fault("mention", message, place))
    return found
