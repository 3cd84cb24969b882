"""What a report has that Markdown has not, in typst's markup and in HTML: numbers, captions, links, descriptions.

Each of the two gives nodes of pandoc's tree: what pandoc is to write, between raw markup of ours. Whatever a student
wrote gets there as pandoc writes it, or as an escaped string.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from typing import Any, Protocol

from labcourse.report.pandoc import Node

_TOKEN = re.compile(r"\\(?:[A-Za-z]+\*?|.)(?:\s*\{[^{}]*\})?", re.DOTALL)
#: Spaces that pandoc's typst has lost or overdone: of a control word or sign → what stands for it.
_SPACES = {r"\;": r"\:", r"\!": "", r"\thinspace": r"\,", r"\enspace": r"\ ", r"\negthinspace": ""}
_BARE = re.compile(r"\\begin\s*\{(array|matrix|smallmatrix)\}.*?\\end\s*\{\1\}", re.DOTALL)
_COLUMN = re.compile(r"(?<!\\)&")
_WIDE = (r"\hspace", r"\hskip", r"\mspace", r"\kern", r"\mkern")  # with a length: the same space for all


def words_for(kind: str) -> str:
    """What a thing with a number is called."""
    return {"figure": "Figure", "table": "Table", "equation": "Equation"}[kind]


def inline(latex: str) -> Node:
    """A formula in a line."""
    return {"t": "Math", "c": [{"t": "InlineMath"}, latex]}


def displayed(latex: str) -> Node:
    """A formula on a line of its own."""
    return {"t": "Math", "c": [{"t": "DisplayMath"}, latex]}


class Dress(Protocol):
    """What one of the two formats has to say."""

    def math(self, latex: str) -> list[Node]:
        """A formula in a line."""

    def entry(self, latex: str) -> list[Node]:
        """A formula by itself in a cell of a table: as large as the cell allows."""

    def equation(self, number: int, latex: str) -> list[Node]:
        """A displayed formula with its number."""

    def link(self, anchor: str, inside: list[Node]) -> list[Node]:
        """A link to something with a number."""

    def picture(self, name: str, content: bytes, alt: str) -> list[Node]:
        """A picture in a line."""

    def figure(self, number: int, name: str, content: bytes, alt: str, caption: list[Node]) -> list[Node]:
        """A figure with its number and caption, as blocks."""

    def missing(self, number: int, why: str, caption: list[Node]) -> list[Node]:
        """The place of a figure that is not there yet."""

    def table(self, number: int, caption: list[Node], table: Node) -> list[Node]:
        """A table with its number and caption, as blocks."""

    def source(self, key: str, inside: list[Node]) -> list[Node]:
        """An entry of the list of sources, as blocks."""


class Typst:
    """For typst, with the functions of ``template.typ``.

    Attributes
    ----------
    files : the pictures, by the names that the markup gives them
    """

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}

    def math(self, latex: str) -> list[Node]:
        return [_raw("typst", f"#formula({quoted(latex)})["), inline(spaced(latex)), _raw("typst", "];")]

    def entry(self, latex: str) -> list[Node]:
        return [_raw("typst", f"#entry({quoted(latex)})["), inline(spaced(latex)), _raw("typst", "];")]

    def equation(self, number: int, latex: str) -> list[Node]:
        opened = f"#equation({number}, {quoted(latex)})["
        return [_raw("typst", opened), displayed(spaced(latex)), _raw("typst", "];")]

    def link(self, anchor: str, inside: list[Node]) -> list[Node]:
        return [_raw("typst", f"#to({quoted(anchor)})["), *inside, _raw("typst", "];")]

    def picture(self, name: str, content: bytes, alt: str) -> list[Node]:
        return [_raw("typst", f"#picture({quoted(self._file(name, content))}, {quoted(alt)});")]

    def figure(self, number: int, name: str, content: bytes, alt: str, caption: list[Node]) -> list[Node]:
        opened = f"#numbered-figure({number}, {quoted(self._file(name, content))}, {quoted(alt)})["
        return [_block("typst", opened), _para(caption), _block("typst", "]")]

    def missing(self, number: int, why: str, caption: list[Node]) -> list[Node]:
        return [_block("typst", f"#missing-figure({number}, {quoted(why)})["), _para(caption), _block("typst", "]")]

    def table(self, number: int, caption: list[Node], table: Node) -> list[Node]:
        table["c"][0] = ["", ["typst:no-figure"], []]
        columns = [width["t"] for _alignment, width in table["c"][2]]
        # Where columns have widths of their own, none has a share.
        share = len(columns) if set(columns) == {"ColWidthDefault"} else 1
        return [
            _block("typst", f"#numbered-table({number}, {share})["),
            _para(caption),
            _block("typst", "]["),
            table,
            _block("typst", "]"),
        ]

    def source(self, key: str, inside: list[Node]) -> list[Node]:
        return [_block("typst", f"#source({quoted(key)})["), _para(inside), _block("typst", "]")]

    def _file(self, name: str, content: bytes) -> str:
        self.files[name] = content
        return name


class Html:
    """For a page that holds everything itself."""

    def math(self, latex: str) -> list[Node]:
        return [inline(latex)]

    def entry(self, latex: str) -> list[Node]:
        return [inline(latex)]

    def equation(self, number: int, latex: str) -> list[Node]:
        opened = f'<span class="equation" id="equation-{number}"><span class="wide">'
        closed = f'</span><span class="number">({number})</span></span>'
        return [_raw("html", opened), displayed(latex), _raw("html", closed)]

    def link(self, anchor: str, inside: list[Node]) -> list[Node]:
        return [{"t": "Link", "c": [["", [], []], inside, [f"#{anchor}", ""]]}]

    def picture(self, name: str, content: bytes, alt: str) -> list[Node]:
        return [_raw("html", _image(name, content, alt))]

    def figure(self, number: int, name: str, content: bytes, alt: str, caption: list[Node]) -> list[Node]:
        return self._figure(number, _image(name, content, alt), caption)

    def missing(self, number: int, why: str, caption: list[Node]) -> list[Node]:
        return self._figure(number, f'<p class="missing">{html.escape(why)}</p>', caption)

    def table(self, number: int, caption: list[Node], table: Node) -> list[Node]:
        told = [*_strong(f"{words_for('table')} {number}."), {"t": "Space"}, *caption]
        table["c"][1] = [None, [{"t": "Plain", "c": told}]]
        opened = f'<div class="table" id="table-{number}">'
        return [_block("html", opened), table, _block("html", "</div>")]

    def source(self, key: str, inside: list[Node]) -> list[Node]:
        opened = f'<p class="source" id="source-{html.escape(key)}">'
        body = [*_text(f"[{key}]"), {"t": "Space"}, *inside]
        return [_block("html", opened), {"t": "Plain", "c": body}, _block("html", "</p>")]

    def _figure(self, number: int, shown: str, caption: list[Node]) -> list[Node]:
        told = [*_strong(f"{words_for('figure')} {number}."), {"t": "Space"}, *caption]
        opened = f'<figure id="figure-{number}">{shown}<figcaption>'
        return [_block("html", opened), {"t": "Plain", "c": told}, _block("html", "</figcaption></figure>")]


def spaced(latex: str) -> str:
    """LaTeX with spaces that pandoc writes for typst.

    It makes nothing of ``\\;``, too much of ``\\!``, and puts nothing between columns that no brackets enclose.
    """

    def of(match: re.Match[str]) -> str:
        word = re.split(r"[\s{]", match[0], maxsplit=1)[0]
        if word in _WIDE and "{" in match[0]:
            return r"\quad "
        kept = match[0][len(word) :]
        return (_SPACES[word] + (" " if word[1:].isalpha() else "") + kept) if word in _SPACES else match[0]

    return _BARE.sub(lambda match: _COLUMN.sub(r" \\quad & ", match[0]), _TOKEN.sub(of, latex))


def quoted(text: str) -> str:
    """A string of typst's. (Its escapes are JSON's, but for control characters, which are not let through.)"""
    return json.dumps(re.sub(r"[\x00-\x08\x0b-\x1f\x7f]", " ", text), ensure_ascii=False)


def _image(name: str, content: bytes, alt: str) -> str:
    media = "image/svg+xml" if name.endswith(".svg") else "image/png"
    data = base64.b64encode(content).decode("ascii")
    return f'<img src="data:{media};base64,{data}" alt="{html.escape(alt)}">'


def _raw(into: str, markup: str) -> Node:
    return {"t": "RawInline", "c": [into, markup]}


def _block(into: str, markup: str) -> Node:
    return {"t": "RawBlock", "c": [into, markup]}


def _para(inside: Sequence[Any]) -> Node:
    return {"t": "Plain", "c": list(inside)}


def _text(text: str) -> list[Node]:
    """Words as nodes."""
    return [node for word in text.split(" ") for node in ({"t": "Space"}, {"t": "Str", "c": word})][1:]


def _strong(text: str) -> list[Node]:
    return [{"t": "Strong", "c": _text(text)}]
