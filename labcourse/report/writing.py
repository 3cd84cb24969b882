"""A report as one page of HTML and as one PDF, the same on every computer."""

from __future__ import annotations

import base64
import json
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files as resources
from pathlib import Path
from typing import Any

import typst

from labcourse.report import pandoc
from labcourse.report.document import Document, Place
from labcourse.report.markup import Markup
from labcourse.report.pandoc import ReportError

_ACCESSIBLE: Any = ["ua-1"]  # standard of the PDF: a screen reader can read it aloud
_PAGE = re.compile(rb"/Type\s*/Page(?![A-Za-z])")
_SMALLEST = 0.6  # of its size, to which a formula may be shrunk; its letters are then as small as those of a footnote
_LONGEST = 300  # characters of a student's text or of a program's output in a message
_MOST_CHARACTERS = 20  # that no font has, in a message
_POSITION = re.compile(r"main\.typ:(\d+):(\d+)")
_FORMULA = re.compile(r"<((?:formula|equation|entry)-\d+)>")
_NO_GLYPH = re.compile(r"the text `\"(.+?)\"` could not be displayed")
_ESCAPED = re.compile(r"\\u\{([0-9a-f]+)\}")  # as typst names characters that cannot be printed


@dataclass(frozen=True)
class Report:
    """A report, ready to be saved.

    Attributes
    ----------
    page : HTML
    pdf : PDF
    pages : how many the PDF has
    markup : what is in it, with all notices
    """

    page: str
    pdf: bytes
    pages: int
    markup: Markup


def write(document: Document) -> Report:
    """Write a report in both formats.

    Raises
    ------
    ReportError
        If a program that is needed is missing or fails; the message says which, and what to do.
    """
    try:
        return _Writing(document).report()
    except RecursionError:
        raise ReportError("A text has lists or quotes within each other too many times; make it plainer.") from None


class _Writing:
    def __init__(self, document: Document) -> None:
        self._markup = Markup(document)
        self._document = document

    def report(self) -> Report:
        for name, (image, content) in self._markup.pictures.items():
            media = "svg+xml" if name.endswith(".svg") else "png"
            image["c"][2][0] = f"data:image/{media};base64,{base64.b64encode(content).decode('ascii')}"
        page = self._written("html5", _resource("page.html"), **self._document.cover)
        for name, (image, _content) in self._markup.pictures.items():
            image["c"][2][0] = name
        pdf = self._pdf()
        return Report(page, pdf, len(_PAGE.findall(pdf)), self._markup)

    def _written(self, to: str, template: str = "", **values: str) -> str:
        """Write the document. What pandoc does not understand of a formula stands there as it is typed."""
        text, refused = pandoc.write(self._markup.blocks, to, template, **values)
        for latex, reason in refused.items():
            self._refuse(latex, reason)
        return self._written(to, template, **values) if refused else text

    def _refuse(self, latex: str, reason: str) -> None:
        """Show a formula as it is typed from now on, and say so."""
        lines = [line.strip() for line in reason.strip().split("\n")]  # of pandoc: the formula, a mark, the reason
        reason = next((line for line in lines if line.startswith("unexpected")), lines[0])
        message = "This formula is not understood, and stands in the report as it is typed:"
        for node, place in self._markup.formulas.values():
            if node["c"][-1] == latex:
                node |= {"t": "Code", "c": [["", [], []], latex]}
                self._markup.note(f"{message} {latex[:_LONGEST]} ({reason[:_LONGEST]})", place)

    def _pdf(self) -> bytes:
        template = _resource("template.typ")
        data = {**self._document.cover, "keyword": self._document.keyword, "alt": self._markup.alt}
        pictures = {name: content for name, (_image, content) in self._markup.pictures.items()}
        inputs = {**pictures, "report.json": json.dumps(data).encode()}
        while True:
            text = template + self._written("typst")
            try:
                pdf, shrunk, missing = _compiled({**inputs, "main.typ": text.encode()})
            except typst.TypstError as error:
                left = {name: node["c"][1] for name, (node, _) in self._markup.formulas.items() if node["t"] == "Math"}
                name = _formula_at(text, len(template), error.diagnostic)
                if name not in left:
                    raise ReportError(f"typst could not set the report: {str(error)[:_LONGEST]}") from None
                self._refuse(left[name], str(error))
                continue
            self._note(shrunk, missing)
            return pdf

    def _note(self, shrunk: Mapping[str, float], missing: str) -> None:
        for name, scale in shrunk.items():
            if scale < _SMALLEST:
                self._markup.note(
                    f"Equation ({name.rpartition('-')[2]}) is too wide for the page: it is shrunk to "
                    f"{round(100 * scale)} % of its size, and hard to read. Break it into lines: "
                    "\\begin{aligned} … \\\\ … \\end{aligned}.",
                    self._markup.formulas[name][1],
                )
        if missing:
            self._markup.note(
                f"No font on this computer has {' '.join(missing[:_MOST_CHARACTERS])}: the PDF has an empty box there. "
                "The web page has them. Write them in Latin letters, as a name in your passport, or take them out.",
                Place(self._document.front.notebook),
            )


def _resource(name: str) -> str:
    return (resources("labcourse.report") / name).read_text(encoding="utf-8")


def _compiled(inputs: Mapping[str, bytes]) -> tuple[bytes, dict[str, float], str]:
    """Compile files to a PDF; return it, formulas that were shrunk with their scales, and characters without a font.

    Fonts are typst's own, so that it is the same everywhere. If they lack characters, those of the computer are used.
    If these lack some, too, the PDF has empty boxes and does not conform to the standard: no name stops a report.
    """
    missing = ""
    with tempfile.TemporaryDirectory() as folder:  # typst reads nothing else
        for name, content in inputs.items():
            Path(folder, name).write_bytes(content)
        main = str(Path(folder, "main.typ"))
        for standards, system_fonts in ((_ACCESSIBLE, False), (_ACCESSIBLE, True), ([], True)):
            options: Any = {"root": folder, "ignore_system_fonts": not system_fonts}
            try:
                pdf: Any = typst.compile(main, pdf_standards=standards, timestamp=0, **options)
                break
            except typst.TypstError as error:
                pieces = _NO_GLYPH.findall(error.diagnostic)
                if not pieces:
                    raise
                text = "".join(_ESCAPED.sub(lambda match: chr(int(match[1], 16)), piece) for piece in pieces)
                missing = "".join(dict.fromkeys(text))
        shrunk = json.loads(typst.query(main, "<shrunk>", field="value", **options))
    return pdf, dict(shrunk), "" if standards else missing


def _formula_at(text: str, start: int, diagnostic: str) -> str:
    """Return the name of the formula that an error is about; "" if it is about something else.

    Parameters
    ----------
    text : typst's markup
    start : where the document begins, after the template
    diagnostic : of the error, with line and column
    """
    match = _POSITION.search(diagnostic)
    if match is None:
        return ""
    lines = text.splitlines(keepends=True)
    position = sum(map(len, lines[: int(match[1]) - 1])) + int(match[2])
    label = _FORMULA.search(text, position) if position >= start else None
    return label[1] if label else ""
