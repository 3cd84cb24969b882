"""Show a student's text as a person reads it: Markdown with formulas and pictures, as harmless HTML.

There is no HTML of the student's in it, no link, and no picture but those that came along, which are part of the page.
Formulas are MathML, which browsers show without a script. The page needs ``img-src data:`` in its policy, and nothing
else. Size and time are limited.
"""

from __future__ import annotations

import base64
import binascii
import html
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote
from xml.etree.ElementTree import Element

from markupsafe import Markup, escape

from labcourse.answers.words import MAX_STORED
from labcourse.patterns import pattern
from labcourse.safe_text import no_escapes

if TYPE_CHECKING:
    from markdown_it import MarkdownIt
    from markdown_it.token import Token

LONGEST = 20_000  #: characters that are rendered; an answer has fewer
MOST_BYTES = 300_000  #: of the HTML, without pictures
LONGEST_FORMULA = 1000  #: characters; it fits on a page
MOST_NODES = 3000  #: of a formula's tree
_DEEPEST = 48  # levels of a text: a quote is one, a list two
_DEEPEST_FORMULA = 80  # levels of a formula's tree
_WIDEST = 40  # bars in a line, which may make columns of a table
_PNG = b"\x89PNG\r\n\x1a\n"
_SOURCE, _DATA = Markup('<img src="{}" alt="'), "data:image/png;base64,"
_PICTURE = Markup('<img src="{}" alt="{}">')
_NOTE = Markup('<span class="words-note">[{}: {}]</span>')
_ELEMENT = pattern(
    "math|mrow|mi|mn|mo|ms|mtext|mspace|msup|msub|msubsup|mfrac|msqrt|mroot|mover|munder|munderover|mtable|mtr|mtd|"
    "mlabeledtr|mstyle|mpadded|mphantom|menclose|mfenced|mmultiscripts|mprescripts|none|merror"
)
_ATTRIBUTE = pattern(
    "display|mathvariant|stretchy|fence|separators?|form|accent|accentunder|displaystyle|scriptlevel|linethickness|"
    "largeop|movablelimits|symmetric|(min|max)size|[lr]space|width|height|depth|voffset|(column|row)(align|lines|spacing)|"
    "frame|notation|open|close"
)
_VALUE = pattern(r"[\w .%+-]{0,60}")


class FormulaError(Exception):
    """A text cannot be shown as a formula."""


def answer_as_html(written: Mapping[str, Any]) -> Markup:
    """Show an answer from a text cell: ``{"text": ..., "pictures": {name: PNG in base64}}``."""
    return as_html(written["text"], pictures_of(written))


def pictures_of(written: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the pictures of an answer from a text cell; one that cannot be read is left out."""
    pictures = {}
    for name, coded in written.get("pictures", {}).items():
        try:
            pictures[name] = base64.b64decode(coded, validate=True)
        except (binascii.Error, TypeError, ValueError):
            continue
    return pictures


def as_html(text: str, pictures: Mapping[str, bytes] | None = None) -> Markup:
    """Show Markdown as HTML that can be put into any page.

    Parameters
    ----------
    text : Markdown, untrusted
    pictures : name, as in the text → PNG; anything else, and a picture that is too large, is left out

    Returns
    -------
    Markup
        HTML. The text is shown as it was typed if it is nested too deeply, becomes too large, or cannot be rendered. Of
        a text longer than ``LONGEST``, only the beginning is shown, as it was typed.
    """
    text = no_escapes(text)
    if len(text) > LONGEST:
        return _as_typed(text[:LONGEST], "This is the beginning; it is too long to be shown.")
    shown = {unquote(name): data for name, data in (pictures or {}).items()}
    shown = {name: data for name, data in shown.items() if data.startswith(_PNG) and len(data) <= MAX_STORED}
    page = _rendered(text, tuple(shown))
    for number, data in enumerate(shown.values()):
        page = page.replace(_SOURCE.format(number), _SOURCE.format(_DATA + base64.b64encode(data).decode("ascii")))
    return page


@lru_cache(maxsize=256)
def _rendered(text: str, pictures: tuple[str, ...]) -> Markup:
    """Render a text without escapes; a picture has its place in ``pictures`` in place of its data.

    The scoring server shows the same texts again and again, and somebody may write one that takes long.
    """
    reader = _reader(all(line.count("|") <= _WIDEST for line in text.split("\n")))
    env = {"pictures": pictures, "seen": set()}  # each picture is put into the page once
    try:
        tokens = reader.parse(text, env)
        if any(token.level > _DEEPEST for token in tokens):  # beyond them, the parser leaves words out
            return _as_typed(text, "As it was typed; it is too deeply nested to be shown otherwise.")
        page = str(reader.renderer.render(tokens, reader.options, env))
    except (RecursionError, ValueError, IndexError):
        return _as_typed(text, "As it was typed; it cannot be shown otherwise.")
    if len(page) > MOST_BYTES:
        return _as_typed(text, "As it was typed; it is too large to be shown otherwise.")
    return Markup(no_escapes(page))  # once more: a reference such as &#x202e; has become what it stands for


def _as_typed(text: str, why: str) -> Markup:
    return Markup('<p class="words-note">{}</p>\n<pre class="words-source">{}</pre>\n').format(why, text)


@lru_cache
def _reader(tables: bool) -> MarkdownIt:
    """Return a parser of Markdown as in notebooks, with formulas, without HTML, and with links left as typed."""
    from markdown_it import MarkdownIt
    from mdit_py_plugins.amsmath import amsmath_plugin
    from mdit_py_plugins.dollarmath import dollarmath_plugin

    reader = MarkdownIt("commonmark", {"html": False, "maxNesting": _DEEPEST + 2}).enable("strikethrough")
    reader.disable(["link", "autolink", "reference"])
    if tables:
        reader.enable("table")
    reader.use(dollarmath_plugin, allow_labels=False, double_inline=True).use(amsmath_plugin)
    for name in ("math_inline", "math_inline_double", "math_block", "amsmath"):
        reader.add_render_rule(name, _show_formula)
    for name in ("heading_open", "heading_close"):
        reader.add_render_rule(name, _show_heading)
    reader.add_render_rule("image", _show_picture)
    return reader


def _show_formula(_self: Any, tokens: Sequence[Token], index: int, _options: Any, _env: Any) -> str:
    """Show a formula as MathML, or its LaTeX as code if it cannot be converted (a rule of markdown-it)."""
    token = tokens[index]
    delimiter = "" if token.type == "amsmath" else token.markup
    try:
        formula = as_mathml(token.content.strip(), block=delimiter != "$")
    except FormulaError:
        formula = Markup("<code>{0}{1}{0}</code>").format(delimiter, token.content)
    return f"<p>{formula}</p>\n" if token.block else str(formula)


def _show_heading(_self: Any, tokens: Sequence[Token], index: int, _options: Any, _env: Any) -> str:
    """Show a heading as a line in bold: headings are the page's."""
    return "<p><strong>" if tokens[index].nesting == 1 else "</strong></p>\n"


def _show_picture(_self: Any, tokens: Sequence[Token], index: int, _options: Any, env: Any) -> str:
    """Show a picture the first time, and its words if there is none."""
    name, words = unquote(str(tokens[index].attrs.get("src", ""))), tokens[index].content
    if name not in env["pictures"]:
        return _NOTE.format("picture not available", words or name[:60])
    if name in env["seen"]:
        return _NOTE.format("picture as above", words or name[:60])
    env["seen"].add(name)
    return _PICTURE.format(env["pictures"].index(name), words or "a picture of the student's")


# --- formulas ---------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=256)  # a class writes the same short formulas
def as_mathml(latex: str, block: bool = False) -> Markup:
    """Convert a formula to MathML.

    The library's own text output does not escape what stands in a formula, and takes over links and styles. So its tree
    is written here: known elements, known attributes with simple values, and text escaped.

    Parameters
    ----------
    latex : what stands between the dollar signs
    block : on a line of its own

    Raises
    ------
    FormulaError
        If it is not understood, is too long, or is nested too deeply.
    """
    from latex2mathml.converter import convert_to_element

    if len(latex) > LONGEST_FORMULA:
        raise FormulaError
    try:
        tree = convert_to_element(latex, display="block" if block else "inline")
    except Exception:  # the library raises all sorts of errors on what it does not know
        raise FormulaError from None
    if sum(1 for _node in tree.iter()) > MOST_NODES or _depth(tree) > _DEEPEST_FORMULA:
        raise FormulaError
    return Markup(_written(tree))


def _depth(node: Element) -> int:
    """Count the levels of a formula's tree."""
    return 1 + max(map(_depth, node), default=0)


def _written(node: Element) -> str:
    """Write an element and all in it as text of a page; of an unknown element, only what is in it.

    The library nh3 would need the same two lists, and would silently drop the letters of ``\\mathop{abc}``.
    """
    inner = "".join([escape(html.unescape(node.text or "")), *map(_written, node)])
    if not _ELEMENT.fullmatch(node.tag):
        return inner
    attributes = "".join(
        f' {name}="{value}"'
        for name, value in node.attrib.items()
        if _ATTRIBUTE.fullmatch(name) and _VALUE.fullmatch(value)
    )
    return f"<{node.tag}{attributes}>{inner}</{node.tag}>"
