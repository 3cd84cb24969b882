"""What is left over from a first draft, what stands there twice, and what belongs into another section."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from rotflex.courseware.messages import _
from rotflex.courseware.report.checks.faults import Fault
from rotflex.courseware.report.checks.languages import Language
from rotflex.courseware.report.checks.prose import FORMULA, Reading, words
from rotflex.courseware.words import STUB

_SAME = 12  # words of a sentence that nobody writes twice by chance
#: In any language.
_DRAFT = re.compile(
    r"\b(?:TODO|TBD|TBA|FIXME|XXX+|t\.b\.d\.)|\?\?+|(?i:\blorem ipsum\b)"
    r"|(?<![\w.^])(?:x{2,3}|[xX]{1,3}[.,][xX]{1,3})(?![\w^.])|(?<![\w.^])XX(?=\s?(?:%|°|deg|rad|Hz|V\b|N\b|m?s\b))"
    r"|\[(?:\.\.\.|…|\?)\]|<\?>|\b(?i:asdf\w*|qwert\w*)\b"
)
_TWICE = re.compile(r"\b([^\W\d_]{2,})\s+\1\b", re.IGNORECASE)
_STRAY = re.compile(r"(?<=[^\W\d_]) +[,;](?=\s|$)|(?<=[^\W\d_]) +\.(?=\s|$)|,,|;;|(?<!\.)\.\.(?!\.)")
_COMPLETE = re.compile(rf"[.!?…:;»”\"'’)\]|{FORMULA}]\W*$")


def faults(readings: Sequence[Reading], language: Language | None, of_pages: bool = False) -> Iterator[Fault]:
    """What words tell. Where the language is not known, only what needs none.

    Parameters
    ----------
    readings : texts, or the pages of a document
    language : that they are written in
    of_pages : then sentences end on the next page, and signs stand where a program that read them has put them
    """
    for reading in readings:
        yield from _drafts(reading, language)
        if language is not None:
            yield from _in_language(reading, language, of_pages)
            yield from _spoken(reading, language)
            yield from _ends(reading) if not of_pages else ()
    yield from _pasted(readings)


def _drafts(reading: Reading, language: Language | None) -> Iterator[Fault]:
    found = [match[0] for match in _DRAFT.finditer(reading.running)]
    found += [match[0] for match in language.draft.finditer(reading.running)] if language else []
    found += [f"{STUB[1:18]} …"] if reading.begun else []
    for note in dict.fromkeys(found):
        yield Fault(
            "draft",
            _("{where}: “{note}” is left from a draft.").format(where=reading.where, note=note),
            _("A reader sees that it was not finished."),
            _("Write what was to stand there, or take it out."),
            reading.place,
        )


def _in_language(reading: Reading, language: Language, of_pages: bool) -> Iterator[Fault]:
    """Slips of the pen."""
    for match in _TWICE.finditer(reading.bare):
        word = match[1].casefold()
        if word not in language.may_repeat and (not of_pages or word in language.common):
            yield Fault(
                "repeated word",
                _("{where}: “{words}”.").format(where=reading.where, words=" ".join(match[0].split())),
                _("It looks as if nobody had read it again."),
                _("Take one of them out."),
                reading.place,
            )
    wrong = dict.fromkeys(word for word in reading.words if word.casefold() in language.misspelt)
    if wrong:
        yield Fault(
            "spelling",
            _("{where}: misspelt: {words}.").format(where=reading.where, words=", ".join(wrong)),
            _("Slips like these make a reader doubt the numbers, too."),
            _("Correct them. Only a few words are known here: have the whole text looked over as well."),
            reading.place,
        )
    if not of_pages and (stray := _STRAY.search(reading.bare)):
        around = " ".join(reading.bare[max(0, stray.start() - 15) : stray.end()].split())
        yield Fault(
            "punctuation",
            _("{where}: look at the punctuation of “… {around}”.").format(where=reading.where, around=around),
            _("It looks as if nobody had read it again."),
            _("No space before a comma or a full stop, and one of them only."),
            reading.place,
        )


def _spoken(reading: Reading, language: Language) -> Iterator[Fault]:
    """What belongs elsewhere, or is said in a way that does not help a reader."""
    heading = reading.heading.casefold().lstrip()
    if heading.startswith(language.results) and (said := language.interprets.search(reading.bare)):
        yield Fault(
            "interprets",
            _("{where}: “{words}” sounds like an interpretation, among the results.").format(
                where=reading.where, words=said[0]
            ),
            _("Results are what came out. A reader wants to see them before they are told what to think of them."),
            _("Move what it means, and why, to the analysis or the conclusions."),
            reading.place,
        )
    if heading.startswith(language.procedure) and (said := language.results_in.search(reading.running)):
        yield Fault(
            "result",
            _("{where}: “{words}” sounds like a result, in the procedure.").format(where=reading.where, words=said[0]),
            _("A procedure is what somebody else can do again; what came out of it is looked for among the results."),
            _("Move what came out to the results, or to the analysis."),
            reading.place,
        )
    if said := language.buttons.search(reading.bare):
        yield Fault(
            "buttons",
            _("{where}: “{words}” tells which button was pressed.").format(where=reading.where, words=said[0]),
            _("A reader with another program cannot repeat it. They need signal, size, duration, sample time."),
            _("Say what was done to the system, and not to the program."),
            reading.place,
        )
    if said := language.vague.search(reading.bare):
        yield Fault(
            "vague",
            _("{where}: which one is “{words}”?").format(where=reading.where, words=said[0]),
            _("Figures and tables move when a page is set; above and below then are somewhere else."),
            _("Call it by its name and number, as “Figure” with the number of its question."),
            reading.place,
        )


def _ends(reading: Reading) -> Iterator[Fault]:
    """A text whose last sentence has no end."""
    last = reading.paragraphs[-1] if reading.paragraphs else ""
    if len(words(last)) >= 5 and not _COMPLETE.search(last):
        yield Fault(
            "breaks off",
            _("{where}: the text breaks off: “… {end}”.").format(where=reading.where, end=" ".join(last.split()[-4:])),
            _("A reader cannot tell whether something is missing."),
            _("Finish the sentence, with a full stop."),
            reading.place,
        )


def _pasted(readings: Sequence[Reading]) -> Iterator[Fault]:
    """Sentences that stand there twice."""
    seen: dict[str, str] = {}
    for reading in readings:
        told = False
        for sentence in reading.sentences:
            said = " ".join(words(sentence)).casefold()
            if len(said.split()) < _SAME:
                continue
            if said in seen and not told:
                told = True
                begin = " ".join(sentence.split()[:6])
                within = seen[said] == reading.where
                yield Fault(
                    "twice",
                    _("{where}: “{begin} …” stands there twice, word for word.").format(
                        where=reading.where, begin=begin
                    )
                    if within
                    else _("{where}: “{begin} …” stands in {other}, too, word for word.").format(
                        where=reading.where, begin=begin, other=seen[said]
                    ),
                    _("A reader looks for the difference, and there is none."),
                    _("Take one of them out.")
                    if within
                    else _("Say it once, and refer to it: “as in {other}”.").format(other=seen[said]),
                    reading.place,
                )
            seen.setdefault(said, reading.where)
