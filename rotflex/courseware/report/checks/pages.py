"""The pages of a document held against the same list, as far as its text can be told from them.

A PDF says where letters stand, and not what they are: what is a heading, a caption, a formula is guessed from the text
of each page. So less is looked at here than in the cells of a notebook, and what is only likely is not told.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence

from rotflex.courseware.messages import _, listed
from rotflex.courseware.report.checks import languages, numbers, wording
from rotflex.courseware.report.checks.faults import Fault
from rotflex.courseware.report.checks.mentions import FIGURE, NAMES, TABLE, cited, of_text
from rotflex.courseware.report.checks.prose import Reading, words
from rotflex.courseware.report.document import Place

_FEWEST_WORDS = 20  # on a page, on average, of a document that is text
_NAMED = 4  # pages or sections that are named
_MOST_OF = 0.5  # of the pages have a number, where pages are numbered
_LONGEST_HEADING = 60  # characters
_BEGINNING = 6  # letters by which a heading is known: "Conclusion", "Conclusions"
_SOURCES = re.compile(
    r"^\W*[\dIVX.]*\s*(?:references?|bibliography|sources|literature(?: cited)?|literatur\w*|quellen\w*)\s*:?\s*$",
    re.IGNORECASE | re.MULTILINE,
)
_ENTRY = re.compile(r"^\s*\[(\d{1,3})\]", re.MULTILINE)
_WHOLE = re.compile(r"(?<![\d.,])\d{1,3}(?![\d,])")
_YEAR = re.compile(r"\b20\d\d\b|\b\d{1,2}[./]\s?\d{1,2}[./]\s?\d{2}\b")


def faults(pages: Sequence[str], name: str, titles: Collection[str], limit: int | None) -> Iterator[Fault]:
    """What a reader would mind in the format of a document.

    Parameters
    ----------
    pages : the text of each
    name : of its file
    titles : of the parts that the course asks for, in its language
    limit : pages that the course allows; None for any number
    """
    place = Place(name)
    if limit is not None and len(pages) > limit:
        yield Fault(
            "pages",
            _("It has {pages} pages; {limit} are allowed.").format(pages=len(pages), limit=limit),
            _("Who reads many reports stops at the limit."),
            _("Shorten it, and hand it in again."),
            place,
        )
    if not has_text(pages):
        yield Fault(
            "scanned",
            _("There is hardly any text in it: its pages are pictures."),
            _("Nobody can search in it, and who does not see it cannot have it read out. It may be hard to read."),
            _("If it was scanned or photographed, type it, and export that as PDF. No more can be told of it here."),
            place,
        )
        return
    readings = [_reading(number, text, place) for number, text in enumerate(pages, start=1)]
    language = languages.of([one.bare for one in readings])
    yield from _numbered(pages, place)
    yield from _cover(pages, place)
    if language is languages.KNOWN["en"]:
        yield from _sections(pages, titles, place)
    yield from _captions(readings, place, known_language=language is not None)
    yield from _sources(pages, place)
    yield from wording.faults(readings, language, of_pages=True)
    yield from numbers.of_pages(readings, language)


def has_text(pages: Sequence[str]) -> bool:
    """Whether a document is text, and not pictures of pages."""
    return sum(len(words(page)) for page in pages) >= _FEWEST_WORDS * len(pages)


def _reading(number: int, text: str, place: Place) -> Reading:
    plain = re.sub(r"(?<=[^\W\d_])-\n(?=[^\W\d_A-Z])", "", text)  # a word that was divided
    plain = " ".join(plain.split())
    where = _("page {number}").format(number=number)
    return Reading(where, "", place, text, plain, plain, formulas=(), pictures=(), unclosed=False, begun=False)


def _numbered(pages: Sequence[str], place: Place) -> Iterator[Fault]:
    """Whether most pages bear a number that goes up by one from page to page; a cover need not."""
    if len(pages) < 2:
        return
    counts: dict[int, int] = {}
    for number, text in enumerate(pages, start=1):
        lines = [line for line in text.split("\n") if line.strip()]
        there = {
            int(one) for line in (*lines[:2], *lines[-2:]) for one in re.findall(r"(?<![\d.,])\d{1,3}(?![\d,])", line)
        }
        for shown in there:
            counts[shown - number] = counts.get(shown - number, 0) + 1
    if max(counts.values(), default=0) < max(2, _MOST_OF * (len(pages) - 1)):
        yield Fault(
            "page numbers",
            _("The pages have no numbers."),
            _("A remark such as “see page 4” has nothing to refer to."),
            _("Number them; a cover may be left out."),
            place,
        )


def _cover(pages: Sequence[str], place: Place) -> Iterator[Fault]:
    if not _YEAR.search(pages[0]):
        yield Fault(
            "date",
            _("There is no date on the first page."),
            _("A reader cannot tell which of two versions is newer."),
            _("Write title, course, your name and the date there."),
            place,
        )


def _sections(pages: Sequence[str], titles: Collection[str], place: Place) -> Iterator[Fault]:
    lines = [line.casefold() for text in pages for line in text.split("\n") if len(line.strip()) <= _LONGEST_HEADING]
    missing = [title for title in titles if not any(title.casefold()[:_BEGINNING] in line for line in lines)]
    if missing:
        yield Fault(
            "sections",
            _("No heading is found for {titles}.").format(titles=listed(missing, _NAMED)),
            _("Who scores your report looks for each part by its heading."),
            _("Give each part that is asked for a heading of its own, with the name that the course has for it."),
            place,
        )


def _captions(readings: Sequence[Reading], place: Place, known_language: bool) -> Iterator[Fault]:
    """Captions and mentions of figures and tables: numbers that lack, are not referred to, or are not there."""
    shown = {FIGURE: _("Figure {number}"), TABLE: _("Table {number}")}
    for sort, text in shown.items():
        begins = re.compile(rf"^\s*(?:{NAMES[sort]})\s*(\d{{1,3}})\s*[.:–-]", re.IGNORECASE | re.MULTILINE)
        captioned = [int(number) for one in readings for number in begins.findall(one.source)]
        named = [mention.number for one in readings for mention in of_text(one.running, place) if mention.sort == sort]
        whole = [int(number) for number in named if number.isdigit()]
        # Without a sign behind the number, a line that goes on in capitals, or ends, may be a caption as well.
        may_begin = re.compile(
            rf"^\s*(?i:{NAMES[sort]})\s*(\d{{1,3}})(?=[ \t]*(?:[.:–—|-]|$)|[ \t]+[A-ZÄÖÜ])", re.MULTILINE
        )
        perhaps = {*captioned, *(int(number) for one in readings for number in may_begin.findall(one.source))}
        for number in dict.fromkeys(captioned) if known_language else ():
            if whole.count(number) <= captioned.count(number):
                yield Fault(
                    "not referred to",
                    _("{name}: no text refers to it.").format(name=text.format(number=number)),
                    _("A reader does not learn what it is there for, or when to look at it."),
                    _("Name it where you use it, as in “Figure 2 shows …”."),
                    place,
                )
        for number in dict.fromkeys(whole):
            if number not in perhaps:
                yield Fault(
                    "dangling",
                    _("The text refers to {name}, and no caption of it is found.").format(
                        name=text.format(number=number)
                    ),
                    _("A reader looks for it, and does not know which one is meant."),
                    _("Look up its number, and correct it; begin each caption with its name and number."),
                    place,
                )


def _sources(pages: Sequence[str], place: Place) -> Iterator[Fault]:
    whole = "\n".join(pages)
    heading = [*_SOURCES.finditer(whole)]
    if not heading:
        yield Fault(
            "references",
            _("No list of sources is found."),
            _("A reader cannot see what is yours and what you took over: a manual, a data sheet, this course."),
            _("List what you used at the end, under “References”, and cite each where you use it."),
            place,
        )
        return
    entries = _ENTRY.findall(whole[heading[-1].end() :])
    used = cited(" ".join(whole[: heading[-1].start()].split()))
    if not entries:  # they may be listed in another way
        return
    for key in dict.fromkeys(key for key in used if key not in entries):
        yield Fault(
            "no entry",
            _("[{key}] is cited, and there is no such source in the list.").format(key=key),
            _("A reader cannot look it up."),
            _("Add it to the list of references, or correct the number."),
            place,
        )
    for key in entries:
        if key not in used:
            yield Fault(
                "never cited",
                _("Source [{key}] is listed, and no text cites it.").format(key=key),
                _("A reader cannot tell what you took from it."),
                _("Cite it where you use it, as in “… [{key}]”, or take it from the list.").format(key=key),
                place,
            )
