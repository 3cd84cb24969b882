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
from labcourse.report.contents import Contents
from labcourse.report.markup import Markup
from labcourse.report.pandoc import ReportError

_ACCESSIBLE: Any = ["ua-1"]  # standard of the PDF: a screen reader can read it aloud
_PAGE = re.compile(rb"/Type\s*/Page(?![A-Za-z])")
_LONGEST = 300  # characters of a student's text or of a program's output in a message
_POSITION = re.compile(r"main\.typ:(\d+):(\d+)")
_FORMULA = re.compile(r"<(formula-\d+)>")
_NO_GLYPH = re.compile(r"the text `\"(.+?)\"` could not be displayed")


@dataclass(frozen=True)
class Report:
    """A report, ready to be saved.

    Attributes
    ----------
    page : HTML
    pdf : PDF
    pages : how many the PDF has
    problems : what is not in it as the student left it
    """

    page: str
    pdf: bytes
    pages: int
    problems: tuple[str, ...]


def write(contents: Contents) -> Report:
    """Write a report in both formats.

    Raises
    ------
    ReportError
        If a program that is needed is missing or fails; the message says which, and what to do.
    """
    try:
        markup = Markup(contents)
        page = _page(markup, contents.cover)
        pdf = _pdf(markup, contents)
    except RecursionError:
        raise ReportError("A text has lists or quotes within each other too many times; make it plainer.") from None
    return Report(page, pdf, len(_PAGE.findall(pdf)), tuple(markup.problems))


def _page(markup: Markup, cover: Mapping[str, str]) -> str:
    for name, (image, content) in markup.pictures.items():
        media = "svg+xml" if name.endswith(".svg") else "png"
        image["c"][2][0] = f"data:image/{media};base64,{base64.b64encode(content).decode('ascii')}"
    page, refused = pandoc.write(markup.blocks, "html5", _resource("page.html"), **cover)
    for name, (image, _content) in markup.pictures.items():
        image["c"][2][0] = name
    for latex, reason in refused.items():
        _refuse(markup, latex, reason)
    return page


def _refuse(markup: Markup, latex: str, reason: str) -> None:
    lines = [line.strip() for line in reason.strip().split("\n")]  # of pandoc: the formula, a mark, the reason
    reason = next((line for line in lines if line.startswith("unexpected")), lines[0])
    message = "This formula is not understood, and stands in the report as it is typed:"
    markup.problems[f"{message} {latex[:_LONGEST]} ({reason[:_LONGEST]})"] = None


def _pdf(markup: Markup, contents: Contents) -> bytes:
    """Set the report by typst. A formula that typst refuses stands there as it is typed."""
    template = _resource("template.typ")
    data = {**contents.cover, "keyword": contents.keyword, "alt": markup.alt, "tags": markup.tags}
    pictures = {name: content for name, (_image, content) in markup.pictures.items()}
    inputs = {**pictures, "report.json": json.dumps(data).encode()}
    while True:
        text = template + pandoc.write(markup.blocks, "typst")[0]
        try:
            pdf, missing = _compiled({**inputs, "main.typ": text.encode()})
            break
        except typst.TypstError as error:
            node = markup.formulas.get(_formula_at(text, len(template), error.diagnostic), {})
            if node.get("t") != "Math":
                raise ReportError(f"typst could not set the report: {str(error)[:_LONGEST]}") from None
            latex = node["c"][1]
            node |= {"t": "Code", "c": [["", [], []], latex]}
            _refuse(markup, latex, str(error))
    if missing:
        markup.problems[
            f"No font on this computer has {missing[:_LONGEST]}: the PDF has an empty box there. The web page has "
            "them. Write them in Latin letters, as a name in your passport, or take them out."
        ] = None
    return pdf


def _resource(name: str) -> str:
    return (resources("labcourse.report") / name).read_text(encoding="utf-8")


def _compiled(inputs: Mapping[str, bytes]) -> tuple[bytes, str]:
    """Compile files to a PDF; return it, and characters without a font.

    Fonts are typst's own, so that it is the same everywhere. If they lack characters, those of the computer are used.
    If these lack some, too, the PDF has empty boxes and does not conform to the standard: no name stops a report.
    """
    missing = ""
    with tempfile.TemporaryDirectory() as folder:  # typst reads nothing else
        for name, content in inputs.items():
            Path(folder, name).write_bytes(content)
        for standards, system_fonts in ((_ACCESSIBLE, False), (_ACCESSIBLE, True), ([], True)):
            options: Any = {"root": folder, "ignore_system_fonts": not system_fonts, "pdf_standards": standards}
            try:
                pdf: Any = typst.compile(str(Path(folder, "main.typ")), timestamp=0, **options)
                break
            except typst.TypstError as error:
                pieces = _NO_GLYPH.findall(error.diagnostic)
                if not pieces:
                    raise
                missing = " ".join(dict.fromkeys(pieces))
    return pdf, "" if standards else missing


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
