"""Figures, tables, equations and sources: what the texts refer to, and what there is."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.courseware.report.checks.faults import Fault, named
from rotflex.courseware.report.checks.prose import Reading, words
from rotflex.courseware.report.document import Document, Equation, Figure, Place, Table

#: What a text refers to, and how it is called in the languages that are known.
FIGURE, TABLE, EQUATION = "figure", "table", "equation"
NAMES = {
    FIGURE: r"Figures?|Figs?\.?|Abbildung(?:en)?|Abb\.?|Bild(?:er)?",
    TABLE: r"Tables?|Tabs?\.?|Tabellen?",
    EQUATION: r"Equations?|Eqs?\.?|Eqns?\.?|Gleichung(?:en)?|Gl\.?",
}
_NUMBER = r"\(?[A-Z]?\d{1,3}(?:[.\-]\d{1,3})*[a-z]?\)?"
_LIST = rf"{_NUMBER}(?:\s*(?:,|;|and|und|or|oder|to|bis|[-–—]|&)\s*{_NUMBER})*"
#: After which it is another document's: "Figure 2 of the handbook", "Abbildung 2 aus [3]".
_ELSEWHERE = re.compile(r"\s*,?\s*(?:of|in|from|aus|von|des|der|im)\s+(?:the|a|dem|der|\[|[A-Z])|\s*\[")
_RANGE = re.compile(rf"({_NUMBER})\s*(?:to|bis|[-–—])\s*({_NUMBER})")
_CITED = re.compile(r"(?<!\w)\[\s*(\d{1,3}(?:\s*[,;–-]\s*\d{1,3})*)(?:\s*,[^\]\d][^\]]*)?\s*\](?![(\[:\w])")
_INTERVAL = re.compile(r"\s*(?:[µμmkM]?(?:s|Hz|V|A|m|g|rad|deg)\b(?!\.\s\w)|°|%)")
_YEAR = re.compile(r"\b(?:1[89]|20)\d\d\b")
_ADDRESS = re.compile(r"(?:https?://|www\.)\S+", re.IGNORECASE)
_FEWEST_WORDS = 3  # of a source that can be found again


@dataclass(frozen=True)
class Mention:
    """That a text refers to something: what sort it is, its number as written, and where the text is."""

    sort: str
    number: str
    place: Place
    where: str


def of_text(text: str, place: Place, where: str = "") -> list[Mention]:
    """What a running text refers to by numbers; what it refers to in another document is left out."""
    found = []
    for sort, names in NAMES.items():
        for match in re.finditer(rf"(?<!\w)(?i:{names})\s*({_LIST})(?!\w)", text):
            if not _ELSEWHERE.match(text, match.end()):
                found += [Mention(sort, number, place, where) for number in _numbers(match[1])]
    return found


def _numbers(listed: str) -> list[str]:
    """Numbers of a list, ranges spelt out: "1 to 3" as 1, 2, 3."""
    found = [number.strip("()") for number in re.findall(_NUMBER, listed)]
    for first, last in ((one.strip("()"), other.strip("()")) for one, other in _RANGE.findall(listed)):
        if first.isdigit() and last.isdigit() and 0 < int(last) - int(first) < 30:
            found += [str(number) for number in range(int(first) + 1, int(last))]
    return list(dict.fromkeys(found))


def faults(document: Document, readings: Sequence[Reading], known_language: bool) -> Iterator[Fault]:
    """What is referred to and is not there, and what is there and not referred to.

    The latter only of texts in a language that is known: in another, a figure has another name.
    """
    mentions = [one for reading in readings for one in of_text(reading.running, reading.place, reading.where)]
    yield from _dangling(document, mentions)
    if known_language and any(reading.words for reading in readings):
        yield from _unmentioned(document, mentions, " ".join(reading.bare for reading in readings))
    yield from _order(document)
    yield from _citations(document, readings)


def _keys(one: Figure | Table | Equation) -> set[str]:
    """The numbers by which a text may call something: of the course, where it has one, and of this report."""
    if isinstance(one, Equation):
        return {one.tag} if one.tag else {str(one.number)}
    return {one.label.rpartition(" ")[2], str(one.number)} - {""}


def _there(document: Document) -> dict[str, list[Figure | Table | Equation]]:
    return {FIGURE: [*document.figures], TABLE: [*document.tables], EQUATION: [*document.equations]}


def _dangling(document: Document, mentions: Sequence[Mention]) -> Iterator[Fault]:
    told = set()
    names = {FIGURE: _("Figure {number}"), TABLE: _("Table {number}"), EQUATION: _("equation ({number})")}
    for one in mentions:
        there = _there(document)[one.sort]
        keys = {key for thing in there for key in _keys(thing)}
        part = one.number.rstrip("abcdefgh")  # "Figure 2a" is a part of Figure 2
        dotted = "." in one.number and not any("." in key for key in keys)  # the numbers of another text
        if {one.number, part} & keys or dotted or (one.sort, one.number) in told:
            continue
        told.add((one.sort, one.number))
        yield Fault(
            "dangling",
            _("{where}: the text refers to {name}, which there is not.").format(
                where=one.where, name=names[one.sort].format(number=one.number)
            ),
            _("A reader looks for it, and does not know which one is meant."),
            _("Look up its number in the report, and correct it; of another’s text, say whose it is."),
            one.place,
            names[one.sort].format(number=one.number),
        )


def _unmentioned(document: Document, mentions: Sequence[Mention], text: str) -> Iterator[Fault]:
    for sort, things in _there(document).items():
        named = {key for one in mentions if one.sort == sort for key in (one.number, one.number.rstrip("abcdefgh"))}
        for one in things:
            if isinstance(one, Equation) and (not one.tag or f"({one.tag})" in text):
                continue
            if _keys(one) & named:
                continue
            if isinstance(one, Table) and not one.rows:
                continue  # it stands in the text, which is about it
            if isinstance(one, Figure) and not one.svg and not one.axes and _is_picture(document, one):
                continue
            yield _not_named(one, document)


def _is_picture(document: Document, figure: Figure) -> bool:
    return any(figure.label in text.pictures for text in document.texts)


def _not_named(one: Figure | Table | Equation, document: Document) -> Fault:
    if isinstance(one, Equation):
        name = written = _("Equation ({number})").format(number=one.tag)
    else:
        name, written = named(one, document), one.label
    return Fault(
        "not referred to",
        _("{name}: no text refers to it.").format(name=name),
        _("A reader does not learn what it is there for, or when to look at it."),
        _("Name it where you use it, as in “{name} shows …”; what no text needs can be left out.").format(name=written),
        one.place,
    )


def _order(document: Document) -> Iterator[Fault]:
    """Numbers that the student gave to equations: one after the other, and each once."""
    tagged = [one for one in document.equations if one.tag.isdigit()]
    tags = [int(one.tag) for one in tagged]
    for before, one, earlier in zip(tags, tagged[1:], range(len(tags)), strict=False):
        number = int(one.tag)
        if number in tags[: earlier + 1] or number < before:
            yield Fault(
                "order",
                _("Equation ({number}) comes after equation ({before}).").format(number=number, before=before)
                if number != before
                else _("There are two equations ({number}).").format(number=number),
                _("A reader looks for (3) between (2) and (4)."),
                _("Number the equations one after the other, from (1), through all of the report."),
                one.place,
            )


def cited(text: str) -> list[str]:
    """Keys of the sources that a running text cites by numbers, as in [1] and [2, 3]."""
    found = []
    for match in _CITED.finditer(text):
        if _INTERVAL.match(text, match.end()) or re.search(r"(?:^|\D)0", match[1]):
            continue  # an interval: [1, 5] Hz, [0, 1]
        for piece in re.split(r"[,;]", match[1]):
            ends = [end.strip() for end in re.split(r"[–-]", piece)]
            first, last = int(ends[0]), int(ends[-1])
            found += [str(number) for number in range(first, min(last, first + 50) + 1)]
    return found


def _citations(document: Document, readings: Sequence[Reading]) -> Iterator[Fault]:
    listed = {one.key for one in document.references}
    used: set[str] = set()
    for reading in readings:
        keys = dict.fromkeys(cited(reading.bare))
        used.update(keys)
        used.update(key for key in listed if f"[{key}]" in reading.bare or f"@{key}" in reading.bare)
        for key in keys:
            if key not in listed:
                yield Fault(
                    "no entry",
                    _("{where}: [{key}] is cited, and there is no such source in the list.").format(
                        where=reading.where, key=key
                    ),
                    _("A reader cannot look it up."),
                    _("Add it to the list of references, or correct the number."),
                    reading.place,
                    f"[{key}]",
                )
    # Captions cite, too.
    captions = " ".join([*(one.caption for one in document.figures), *(one.caption for one in document.tables)])
    for one in document.references:
        if one.key not in used and f"[{one.key}]" not in captions:
            yield Fault(
                "never cited",
                _("Source [{key}] is listed, and no text cites it.").format(key=one.key),
                _("A reader cannot tell what you took from it."),
                _("Cite it where you use it, as in “… [{key}]”, or take it from the list.").format(key=one.key),
                one.place,
            )
        said = _ADDRESS.sub(" ", one.text)
        if len(words(said)) < _FEWEST_WORDS and not _YEAR.search(said):
            yield Fault(
                "reference",
                _("Source [{key}] says too little to be found.").format(key=one.key),
                _("An address on the web changes; author, title and year do not."),
                _("Write who made it, what it is called, where it appeared, and when."),
                one.place,
            )
