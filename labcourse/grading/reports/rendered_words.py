"""A student's words as a person reads them: Markdown with formulas and pictures, as harmless HTML.

No HTML of the student's, no link that leads anywhere, no picture but those that came along, which stand in the page
themselves. The page needs ``img-src data:`` in its policy, and nothing else.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from markupsafe import Markup, escape

from labcourse.answers.attached_pictures import MAX_STORED
from labcourse.grading.reports.formulas import FormulaError, as_mathml
from labcourse.safe_text import no_escapes

if TYPE_CHECKING:
    from markdown_it import MarkdownIt
    from markdown_it.rules_block import StateBlock
    from markdown_it.rules_inline import StateInline
    from markdown_it.token import Token

LONGEST = 20_000  #: characters that are rendered; an answer has fewer
MOST_BYTES = 300_000  #: of the HTML, without pictures
_DEEPEST = 12  # quotes and lists in each other
_WIDEST = 40  # bars in a line, which may make columns of a table
_MARKERS = re.compile(r"(?:[ \t]*(?:>|[*+-](?=[ \t]|$)|\d{1,9}[.)](?=[ \t]|$)))+", re.MULTILINE)
_MARKER = re.compile(r">|[*+-]|\d{1,9}[.)]")
_INDENTED = re.compile(rf"^[ \t]{{{4 * _DEEPEST},}}", re.MULTILINE)
_PNG = b"\x89PNG\r\n\x1a\n"
_ENVIRONMENT = re.compile(r"\\begin\{([a-zA-Z]{1,20}\*?)\}")


def as_html(text: str, pictures: Mapping[str, bytes] | None = None) -> Markup:
    """Words as HTML that can be put into any page. It is bounded in size, and so is the time that it takes.

    Parameters
    ----------
    text : Markdown, a stranger's
    pictures : name, as in the text → PNG

    Returns
    -------
    Markup
        The text as it was typed, where it is nested or built so that nobody wrote it to be read.
    """
    text = no_escapes(text)
    if len(text) > LONGEST:
        return _as_typed(text[:LONGEST], "This is the beginning; it is too long to be shown.")
    if _overdone(text):
        return _as_typed(text, "As it was typed; it is too deeply nested to be shown otherwise.")
    shown = _Shown(pictures or {})
    try:
        tables = all(line.count("|") <= _WIDEST for line in text.split("\n"))
        page = str(_reader(tables).render(text, {"shown": shown}))
    except (RecursionError, ValueError, IndexError):
        return _as_typed(text, "As it was typed; it cannot be shown otherwise.")
    if len(page) - shown.size > MOST_BYTES:
        return _as_typed(text, "As it was typed; it is too large to be shown otherwise.")
    return Markup(no_escapes(page))  # once more: a reference such as &#x202e; has become what it stands for


def _as_typed(text: str, why: str) -> Markup:
    return Markup('<p class="words-note">{}</p>\n<pre class="words-source">{}</pre>\n').format(why, text)


def _overdone(text: str) -> bool:
    """Whether lists and quotes stand in each other deeper than anybody reads."""
    if _INDENTED.search(text):
        return True
    return any(len(_MARKER.findall(match[0])) > _DEEPEST for match in _MARKERS.finditer(text))


class _Shown:
    """The pictures of a text: each is put into the page once."""

    def __init__(self, pictures: Mapping[str, bytes]) -> None:
        self._pictures = {unquote(name): data for name, data in pictures.items()}
        self._seen: set[str] = set()
        self.size = 0

    def html(self, source: str, words: str) -> Markup:
        """A picture, or words in its place."""
        name = unquote(source)
        data = self._pictures.get(name, b"")
        if not data.startswith(_PNG) or len(data) > MAX_STORED:
            return Markup('<span class="words-note">[{}]</span>').format(f"picture not available: {words or name[:60]}")
        if name in self._seen:
            return Markup('<span class="words-note">[{}]</span>').format(f"picture as above: {words or name[:60]}")
        self._seen.add(name)
        picture = Markup('<img src="data:image/png;base64,{}" alt="{}">').format(
            base64.b64encode(data).decode("ascii"), words or "a picture of the student's"
        )
        self.size += len(picture)
        return picture


@lru_cache
def _reader(tables: bool) -> MarkdownIt:
    """What reads Markdown: the usual of notebooks, with formulas, and without HTML."""
    from markdown_it import MarkdownIt

    reader = MarkdownIt("commonmark", {"html": False, "maxNesting": 4 * _DEEPEST}).enable("strikethrough")
    if tables:
        reader.enable("table")
    reader.inline.ruler.before("escape", "formula", _formula)
    reader.block.ruler.before("fence", "formula", _formula_lines, {"alt": ["paragraph", "blockquote", "list"]})
    for name, rule in {
        "formula": _show_formula,
        "image": _show_picture,
        "link_open": _show_nothing,
        "link_close": _show_address,
        "heading_open": _show_heading,
        "heading_close": _show_heading,
    }.items():
        reader.add_render_rule(name, rule)
    return reader


# --- formulas in the text ---------------------------------------------------------------------------------------------


def _formula(state: StateInline, silent: bool) -> bool:
    """``$…$`` and ``$$…$$`` within a paragraph."""
    if state.src[state.pos] != "$":
        return False
    mark = "$$" if state.src.startswith("$$", state.pos) else "$"
    start = state.pos + len(mark)
    end = state.src.find(mark, start, state.posMax)
    while end > 0 and state.src[end - 1] == "\\":
        end = state.src.find(mark, end + 1, state.posMax)
    latex = state.src[start:end].strip() if end > 0 else ""
    if not latex or "$" in latex.replace("\\$", ""):
        return False
    if not silent:
        token = state.push("formula", "", 0)
        token.content, token.markup = latex, mark
    state.pos = end + len(mark)
    return True


def _formula_lines(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """``$$`` and ``\\begin{…}`` at the beginning of a line, with all up to what closes them."""
    first = state.src[state.bMarks[start] + state.tShift[start] : state.eMarks[start]]
    opened = _ENVIRONMENT.match(first)
    if not opened and not first.startswith("$$"):
        return False
    mark = "$$" if not opened else f"\\end{{{opened[1]}}}"
    lines = [first if opened else first[2:]]
    line = start
    while mark not in lines[-1]:
        line += 1
        if line >= end or state.sCount[line] < state.blkIndent:
            return False
        lines.append(state.getLines(line, line + 1, state.blkIndent, False))
    latex, _mark, rest = "\n".join(lines).partition(mark)
    if rest.strip() or not latex.strip():
        return False
    if not silent:
        token = state.push("formula", "", 0)
        token.content, token.markup, token.block = (latex + mark if opened else latex).strip(), "$$", True
        token.map = [start, line + 1]
    state.line = line + 1
    return True


# --- how it is shown --------------------------------------------------------------------------------------------------


def _show_formula(_self: Any, tokens: Sequence[Token], index: int, _options: Any, _env: Any) -> str:
    token = tokens[index]
    try:
        shown = as_mathml(token.content, block=token.markup == "$$")
    except FormulaError:
        shown = Markup("<code>{0}{1}{0}</code>").format(token.markup, token.content)
    return f"<p>{shown}</p>\n" if token.block else str(shown)


def _show_picture(_self: Any, tokens: Sequence[Token], index: int, _options: Any, env: Any) -> str:
    token = tokens[index]
    return str(env["shown"].html(str(token.attrs.get("src", "")), token.content))


def _show_nothing(_self: Any, _tokens: Sequence[Token], _index: int, _options: Any, _env: Any) -> str:
    return ""


def _show_address(_self: Any, tokens: Sequence[Token], index: int, _options: Any, _env: Any) -> str:
    """After the words of a link, where it leads; it cannot be followed."""
    level, opening = 0, index
    while opening >= 0:
        level += {"link_close": 1, "link_open": -1}.get(tokens[opening].type, 0)
        if level == 0:
            break
        opening -= 1
    address = str(tokens[opening].attrs.get("href", ""))
    words = "".join(token.content for token in tokens[opening + 1 : index])
    return "" if words in (address, unquote(address)) else str(escape(f" ({unquote(address)[:200]})"))


def _show_heading(_self: Any, tokens: Sequence[Token], index: int, _options: Any, _env: Any) -> str:
    """As a line in bold: headings are the page's."""
    return "<p><strong>" if tokens[index].nesting == 1 else "</strong></p>\n"
