"""A report as one page of HTML and as one PDF: written from the same source, and the same on every machine."""

from __future__ import annotations

import html
import json
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files as resources
from pathlib import Path
from string import Template
from typing import Any

from labcourse.answers.report_files import COMPOSED
from labcourse.report import pandoc
from labcourse.report.document import Document, Equation, Place, Table
from labcourse.report.dress import Html, Typst, words_for
from labcourse.report.pandoc import ReportError
from labcourse.report.setting import Read, Setting, parts

_HERE = "labcourse.report"
_STANDARD = "ua-1"  #: of the PDF: it can be read aloud
_PAGE = re.compile(rb"/Type\s*/Page(?![A-Za-z])")
_SMALLEST = 0.6  # of its size, to which a formula may be shrunk: its letters are then as small as a footnote's
_LONGEST_WORD = 60  # characters of a word, in a message; a line has about 80
_LONGEST = 300  # characters of what a program says, in a message
_MOST_CHARACTERS = 20  # of those that no font has, in a message
_LACKING = re.compile(r"the text `\"(.+?)\"` could not be displayed")
_ESCAPED = re.compile(r"\\u\{([0-9a-f]+)\}")  # as typst names what is not printed
_FORMULA_ALONE = "#let formula(alt, body) = body\n#let equation(number, alt, body) = body\n"


class _NoGlyphs(ReportError):
    """Typst's fonts lack characters.

    Attributes
    ----------
    characters : each once
    """

    def __init__(self, characters: str) -> None:
        super().__init__(f"typst could not set the report: {characters[:_MOST_CHARACTERS]}")
        self.characters = characters


@dataclass(frozen=True)
class Written:
    """A report, ready to be kept.

    Attributes
    ----------
    page : HTML
    pdf : PDF
    pages : how many the PDF has
    told : what was left out, is missing, or could not be set, and its cell
    """

    page: str
    pdf: bytes
    pages: int
    told: tuple[tuple[str, Place], ...]


def written(document: Document) -> Written:
    """A report in both formats.

    Raises
    ------
    ReportError
        If a program that is needed is missing or fails; the message says which, and what to do.
    """
    read = Read.of(document)
    page, seen = _html(document, read)
    pdf, refused = _pdf(document, read)
    told = dict.fromkeys([*document.told, *seen, *refused])
    return Written(page, pdf, len(_PAGE.findall(pdf)), tuple(told))


# --- HTML ----------------------------------------------------------------------------------------------------------


def _html(document: Document, read: Read) -> tuple[str, list[tuple[str, Place]]]:
    setting = Setting(document, read, Html())
    # The page's title is the heading of level 1.
    body, _refused = pandoc.write(setting.blocks(), "html5", ["--mathml", "--shift-heading-level-by=1"])
    escape = html.escape
    before = [f"<p>{escape(line)}</p>" for line in (document.course, document.term) if line]
    rows = [f"<dt>{escape(what)}</dt><dd>{escape(who)}</dd>" for what, who in _rows(document)]
    page = Template((resources(_HERE) / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(document.title),
        before="".join(before),
        rows="".join(rows),
        contents=escape("Contents"),
        entries="".join(_contents(document, setting)),
        body=body,
    )
    return page, list(setting.gathered.told)


def _contents(document: Document, setting: Setting) -> Iterator[str]:
    for part in parts(document):
        inside = "".join(
            _entry(f"section-{section.number}", f"{section.number} {setting.heading(heading)}")
            for section, heading in part.sections
        )
        yield (
            _entry(f"part-{part.number}", f"{part.number} {part.title}", f"<ol>{inside}</ol>")
            if part.number
            else inside
        )
    if document.references:
        yield _entry("sources", "References")


def _entry(anchor: str, text: str, inside: str = "") -> str:
    return f'<li><a href="#{html.escape(anchor)}">{html.escape(text)}</a>{inside}</li>'


def _rows(document: Document) -> list[tuple[str, str]]:
    """What stands on the cover below the title."""
    by = ", ".join(document.authors)
    rows = [("Authors", by), ("Student ID", document.student), ("Date", document.date)]
    return [(what, who) for what, who in rows if who]


# --- PDF -----------------------------------------------------------------------------------------------------------


def _pdf(document: Document, read: Read) -> tuple[bytes, list[tuple[str, Place]]]:
    """The PDF, and formulas that it has only as they are typed."""
    told: list[tuple[str, Place]] = []
    verbatim: frozenset[str] = frozenset()
    while True:
        dress = Typst()
        setting = Setting(document, read, dress, verbatim)
        body, refused = pandoc.write(setting.blocks(), "typst")
        known = setting.gathered.formulas
        told += [_not_understood(*known[latex], why) for latex, why in refused.items() if latex in known]
        beside = {**dress.files, "cover.json": _cover(document)}
        try:
            pdf, noted = _compiled(_template() + body, beside)
            return pdf, [*told, *_squeezed(noted, document)]
        except _NoGlyphs as error:
            pdf, noted, lacking = _with_other_fonts(_template() + body, beside, error)
            return pdf, [*told, *_squeezed(noted, document), *_not_shown(lacking, document)]
        except ReportError:
            failing = {} if verbatim else _failing(list(known))
            if not failing:
                raise
            told = [_not_understood(*known[latex], why) for latex, why in failing.items()]
            verbatim = frozenset(known[latex][0] for latex in failing)


def _with_other_fonts(markup: str, beside: dict[str, bytes], error: _NoGlyphs) -> tuple[bytes, list[Any], str]:
    """The PDF where typst's fonts lack characters, and the characters that this computer's fonts lack, too.

    A name must not stop a report: with other fonts it may be set otherwise elsewhere, or have empty boxes.
    """
    try:
        return *_compiled(markup, beside, system_fonts=True), ""
    except _NoGlyphs as again:
        error = again
    return *_compiled(markup, beside, standard=None, system_fonts=True), error.characters


def _squeezed(noted: list[Any], document: Document) -> list[tuple[str, Place]]:
    """What had to be made too small to be read, or broken: as the template notes it."""
    told = []
    for one in noted:
        things: list[Equation | Table] = [*(document.equations if one["kind"] == "equation" else document.tables)]
        thing = next((thing for thing in things if thing.number == one["number"]), None)
        if thing is None or one.get("scale", 0) >= _SMALLEST:
            continue
        if isinstance(thing, Equation):
            what = (
                f"Equation ({thing.number}) is too wide for the page: it is shrunk to "
                f"{round(100 * one['scale'])} % of its size, and hard to read. Break it into lines: "
                "\\begin{aligned} … \\\\ … \\end{aligned}."
            )
        else:
            what = (
                f"Table {thing.number}: “{one['word'][:_LONGEST_WORD]}” is too long for its column, and may be "
                "broken anywhere. Shorten it, or put spaces into it."
            )
        section = next((section.number for section in document.sections if thing in section.blocks), "")
        told.append((f"Section {section}: {what}", thing.place))
    return told


def _not_shown(characters: str, document: Document) -> list[tuple[str, Place]]:
    if not characters:
        return []
    said = (
        "No font on this computer has {characters}: the PDF has an empty box there. The web page has them. Write them "
        "in Latin letters, as a name in your passport, or take them out."
    )
    return [(said.format(characters=" ".join(characters[:_MOST_CHARACTERS])), Place(document.front.notebook))]


def _not_understood(latex: str, place: Place, why: str) -> tuple[str, Place]:
    lines = [line.strip() for line in why.split("\n")]  # the formula again, a mark below it, and then the reason
    reason = next((line for line in lines if line.startswith("unexpected")), lines[-1])
    return (
        (
            f"This formula is not understood, and stands in the report as it is typed: {latex[:_LONGEST]} "
            f"({reason[:_LONGEST]})"
        ),
        place,
    )


def _failing(formulas: list[str]) -> dict[str, str]:
    """Which formulas cannot be set, and why: each is tried by itself."""
    found = {}
    for latex in formulas:
        markup, _refused = pandoc.write([{"t": "Para", "c": Typst().math(latex)}], "typst")
        try:
            _compiled(_FORMULA_ALONE + markup, {}, standard=None)
        except ReportError as error:
            found[latex] = str(error)
    return found


def _template() -> str:
    return (resources(_HERE) / "template.typ").read_text(encoding="utf-8")


def _cover(document: Document) -> bytes:
    cover = {
        "title": document.title,
        "course": document.course,
        "term": document.term,
        "authors": list(document.authors) or [document.student],
        "rows": _rows(document),
        "keywords": [COMPOSED],
        "words": {"figure": words_for("figure"), "table": words_for("table"), "contents": "Contents"},
    }
    return json.dumps(cover).encode()


def _compiled(
    markup: str, beside: dict[str, bytes], standard: str | None = _STANDARD, system_fonts: bool = False
) -> tuple[bytes, list[Any]]:
    """Markup as PDF, and what the template notes.

    Fonts are typst's own, so that it is the same everywhere, or also the computer's.
    """
    try:
        import typst
    except ImportError:
        raise ReportError("typst is not installed.") from None
    standards: Any = [standard] if standard else []
    with tempfile.TemporaryDirectory() as folder:  # which is all that the markup could read
        main = str(Path(folder, "main.typ"))
        for name, content in {"main.typ": markup.encode(), **beside}.items():
            Path(folder, name).write_bytes(content)
        try:
            made = typst.compile(
                main, root=folder, ignore_system_fonts=not system_fonts, pdf_standards=standards, timestamp=0
            )
            asked = typst.query(main, "<noted>", field="value", root=folder, ignore_system_fonts=not system_fonts)
        except RuntimeError as error:  # typst's own errors are
            if lacking := _LACKING.findall(str(getattr(error, "diagnostic", "") or error)):
                characters = "".join(_ESCAPED.sub(lambda match: chr(int(match[1], 16)), one) for one in lacking)
                raise _NoGlyphs("".join(dict.fromkeys(characters))) from None
            raise ReportError(f"typst could not set the report: {str(error)[:_LONGEST]}") from None
    assert isinstance(made, bytes)
    return made, list(json.loads(asked))
