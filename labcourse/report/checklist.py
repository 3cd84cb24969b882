"""What is missing in a report: texts, answers, captions, units, figures that no text mentions, and pages too many.

Nothing here is a mark. How a text is written is not looked at; :data:`NOT_CHECKED` says so.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence

from labcourse.answers.figures import normalized, unit_places
from labcourse.report.document import Document, Notice, Place, Recorded, Section, Text
from labcourse.report.markup import Markup, Numbered, mentioned_figures

NOT_CHECKED = (
    "The list covers missing texts and answers, captions, units, figures that no text mentions, and the page limit. "
    "It does not cover spelling, style, formulas, sources, or whether numbers and claims are right: read the report "
    "once more."
)
NOT_CHECKED_OF_PDF = (
    "The program looks at three things in your own PDF: the number of pages, the headings of its parts, and whether "
    "the text mentions each figure with a caption. Go through the list in the notebook yourself for everything else."
)

_DECIMAL = re.compile(r"[-−+]?\d+[.,]\d+")  # a measured number, and no count
#: Quantities that have no unit.
_WITHOUT_UNIT = re.compile(
    r"\b(?:number|counts?|index|samples?|ratio|normali[sz]ed|relative|probability|rank|order|dimensionless|units?)\b"
)
_LONGEST_HEADING = 60  # characters of a line in a PDF; three quarters of a line
_HEADING_BEGINS = 6  # letters by which a heading is known: "Conclu" of Conclusion and Conclusions
_CAPTION = re.compile(r"^\s*(?:figure|fig\.)\s+(\d{1,3})\s*[.:|–—-](?!\d)", re.IGNORECASE | re.MULTILINE)


def faults(document: Document, markup: Markup, pages: int) -> list[Notice]:
    """Return what is missing in a report, in the order of its sections.

    Parameters
    ----------
    document : the report
    markup : made of it
    pages : how many it has as PDF
    """
    notices = list(_too_long(pages, document.page_limit, document.front))
    for section in document.sections:
        notices += _empty(section)
        for item in markup.numbered[section.number]:
            notices += _in_text(item) if item.recorded is None else _recorded(item, item.recorded, markup.mentioned)
    return notices


def _too_long(pages: int, limit: int | None, place: Place) -> Iterator[Notice]:
    if limit is not None and pages > limit:
        message = f"The report has {pages} pages, cover and contents included; your course allows {limit}. Shorten it."
        yield Notice(message, place, "pages")


def _empty(section: Section) -> Iterator[Notice]:
    """Yield texts that are not written, and results that are not recorded."""
    name = f"{section.number} {section.heading}"
    if section.missing:
        message = f"{name}: not recorded: {', '.join(section.missing)}. Run the cell that records it."
        yield Notice(message, section.place, "answer")
    if any(isinstance(piece, Text) and not piece.markdown.strip() for piece in section.pieces):
        message = f"{name}: nothing is written. Write the text into its cell, and save the notebook."
        yield Notice(message, section.place, "text")


def _recorded(item: Numbered, recorded: Recorded, mentioned: Collection[str]) -> Iterator[Notice]:
    if recorded.missing and item.kind == "table":
        message = f"{item}: not filled in: {', '.join(recorded.missing)}. Fill it in, and record the table again."
        yield Notice(message, item.place, "answer")
    elif recorded.missing:
        message = f"{item} is not recorded. Run the cell that draws it and the one below it."
        yield Notice(message, item.place, "answer")
    if not item.captioned:
        how = "Write it into the cell of authors, captions and sources: what is shown, and what to look at."
        yield Notice(f"{item} has no caption of yours. {how}", recorded.caption.place, "caption")
    labels = [(axis, label) for pair in recorded.axes for axis, label in zip("xy", pair, strict=True)]
    for axis, label in dict.fromkeys(labels):
        if not _has_unit(label):
            what = f"the {axis} axis “{label}” has no unit" if label.strip() else f"the {axis} axis has no label"
            how = "Write quantity and unit, as in “time (s)”, and record the figure again."
            yield Notice(f"{item}: {what}. {how}", item.place, "unit")
    if item.kind == "figure" and f"figure-{item.number}" not in mentioned:
        message = f"{item}: no text mentions it by its number. Write “{recorded.label}” where you use it."
        yield Notice(message, item.place, "mention")


def _in_text(item: Numbered) -> Iterator[Notice]:
    if not item.captioned:
        above = "Write it above the table, with a blank line between, and begin it with “Table:”."
        how = above if item.kind == "table" else "Write it into the square brackets before the picture’s name."
        yield Notice(f"{item} has no caption of yours. {how}", item.place, "caption")
    words = [entry for entry in item.entries if not _DECIMAL.fullmatch(entry)]
    if len(words) < len(item.entries) and not any(map(_has_unit, words)):
        yield Notice(f"{item} names no unit. Put it behind the quantity, as in “time (s)”.", item.place, "unit")


def _has_unit(text: str) -> bool:
    """Check whether something stands where a unit may, or none is needed."""
    known = normalized(text)
    return bool(unit_places(text) or known.endswith(("°", "%")) or _WITHOUT_UNIT.search(known))


# --- a student's own PDF ---------------------------------------------------------------------------------------------


def faults_of_pdf(pages: Sequence[str], name: str, titles: Collection[str], limit: int | None) -> list[Notice]:
    """Return what is missing in a PDF that a student wrote elsewhere, as far as the text of its pages tells.

    Parameters
    ----------
    pages : the text of each
    name : of its file
    titles : of the parts that the course asks for
    limit : pages that the course allows; None for no limit
    """
    place, text = Place(name), "\n".join(pages)
    notices = list(_too_long(len(pages), limit, place))
    if not text.strip():
        message = "There is no text in it: its pages are pictures, of which nothing else can be looked at."
        return [*notices, Notice(message, place, "scanned")]
    lines = [line.casefold() for line in text.split("\n") if len(line.strip()) <= _LONGEST_HEADING]
    missing = [title for title in titles if not any(title.casefold()[:_HEADING_BEGINS] in line for line in lines)]
    if missing:
        message = (
            f"No heading is found for {', '.join(missing)}. Give each part the heading that the course has for it."
        )
        notices.append(Notice(message, place, "headings"))
    mentioned = mentioned_figures(_CAPTION.sub("", text))
    for number in dict.fromkeys(_CAPTION.findall(text)):
        if number not in mentioned:
            message = f"Figure {number}: no text mentions it by its number. Name it where you use it."
            notices.append(Notice(message, place, "mention"))
    return notices
