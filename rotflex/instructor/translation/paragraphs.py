"""A text cell in pieces that are translated at a time: paragraphs, headings, list items, rows of tables.

A small piece outlives changes around it: where one sentence of a cell is changed, the other paragraphs keep their
translation.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rotflex.courseware import words
from rotflex.instructor.translation import unchanged

#: What a line begins with that is no text: its indent, and signs of lists, headings and quotations.
_SIGNS = re.compile(r"[ \t]*(?:(?:[*+-]|\d{1,9}[.)]|#{1,6}|>)[ \t]+)*")
_ROW = re.compile(r"[ \t]*\|")
_FENCE = re.compile(r"[ \t]*(`{3,}|~{3,})")
_WORD = re.compile(r"[^\W\d_]{2}")  # two letters in a row


@dataclass(frozen=True)
class Piece:
    """A stretch of a text cell: with words to be translated, or what stands between these and stays."""

    text: str
    words: bool


def pieces(source: str) -> list[Piece]:
    """All pieces of a text cell: their texts in a row are the cell's."""
    found: list[Piece] = []
    for stretch, plain in _stretches(source):
        found.extend(_cut(stretch) if plain else [Piece(stretch, False)])
    return found


def to_translate(source: str) -> list[str]:
    """What is to be translated of a text cell, in order."""
    return [piece.text for piece in pieces(source) if piece.words]


def is_one(text: str) -> bool:
    """Whether a text is one piece: no blank line, and no sign of a list or a heading before it."""
    return [piece.text for piece in pieces(text)] == [text]


def _stretches(source: str) -> Iterator[tuple[str, bool]]:
    """A text cell in stretches of lines, and whether each is text: fenced code and model answers are not."""
    lines: list[str] = []
    plain, closing = True, ""
    for line in source.splitlines(keepends=True):
        opened = "" if not plain else _closing(line)
        if opened:
            if lines:
                yield "".join(lines), True
            lines, plain, closing = [line], False, opened
            continue
        lines.append(line)
        if not plain and _closes(line, closing):
            yield "".join(lines), False
            lines, plain = [], True
    if lines:
        yield "".join(lines), plain


def _closing(line: str) -> str:
    """By what a stretch ends that begins with this line; "" where it begins none."""
    fence = _FENCE.match(line)
    if fence:
        return fence[1]
    return words.END if line.strip() == words.BEGIN else ""


def _closes(line: str, closing: str) -> bool:
    bare = line.strip()
    return bare == closing or (closing != words.END and bare.startswith(closing) and not bare.strip(closing[0]))


def _cut(text: str) -> Iterator[Piece]:
    """Text at blank lines and where a list item, a heading or a row begins; never within a formula or a comment."""
    inside = ""
    for line in text.splitlines(keepends=True):
        if unchanged.goes_on(inside):
            inside += line
            continue
        signs = _signs(line).strip()
        if not line.strip() or signs or _ROW.match(line) or _ROW.match(inside):
            yield from _bounded(inside)
            inside = ""
        inside += line
        if not line.strip() or signs.endswith("#"):  # a heading is one line
            yield from _bounded(inside)
            inside = ""
    yield from _bounded(inside)


def _signs(text: str) -> str:
    found = _SIGNS.match(text)
    return found[0] if found else ""


def _bounded(text: str) -> Iterator[Piece]:
    """A piece without the signs before it and the white space about it, which stay."""
    begin, end = len(_signs(text)), len(text.rstrip())
    if not _WORD.search(unchanged.without_kept(text[begin:end])):
        yield Piece(text, False)
        return
    for part, is_words in ((text[:begin], False), (text[begin:end], True), (text[end:], False)):
        if part:
            yield Piece(part, is_words)
