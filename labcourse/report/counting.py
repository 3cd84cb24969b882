"""What is counted in a student's text: its displayed equations, its tables, and its pictures that stand alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from labcourse.answers.attached_pictures import PICTURE

EQUATION, TABLE, PICTURE_ALONE = "equation", "table", "picture"
_FENCED = re.compile(r"^ {0,3}(`{3,}|~{3,})[^\n]*\n(?:.*?\n)??(?: {0,3}\1[`~]*[ \t]*$|\Z)", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"(?<!`)(`+)(?!`)(?:(?!\n[ \t]*\n).)+?(?<!`)\1(?!`)", re.DOTALL)
_BLANK_LINE = re.compile(r"\n[ \t]*\n")
_TABLE = re.compile(
    r"^(?P<head>[^\n]*\|[^\n]*)\n[ \t]{0,3}\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)*\|?[ \t]*$", re.MULTILINE
)
_TAG = re.compile(r"\\(?:tag\*?|label)\s*\{([^{}]{0,60})\}")
#: How the caption of a table begins, in a paragraph of its own just above or below it.
CAPTION = re.compile(r"(?:\*\*)?(?:Table|Caption)(?:\*\*)?:(?:\*\*)?\s*(?P<caption>\S.*)", re.DOTALL)


@dataclass(frozen=True)
class Counted:
    """One thing that gets a number.

    Attributes
    ----------
    kind : :data:`EQUATION`, :data:`TABLE` or :data:`PICTURE_ALONE`
    name : the tag of an equation, or the name of a picture; "" where there is none
    content : an equation's LaTeX without its tag, the caption of a table or a picture; "" where there is none
    rows : of a table, the headings of its columns first; entries as they are written
    """

    kind: str
    name: str
    content: str
    rows: tuple[tuple[str, ...], ...] = ()


def untagged(latex: str) -> tuple[str, str]:
    """An equation without its tag or label, and what that says; "" where there is none."""
    tags = [tag.strip() for tag in _TAG.findall(latex)]
    return _TAG.sub("", latex).strip(), next(filter(None, tags), "")


def counted(text: str) -> Iterator[Counted]:
    """What gets a number in a text, in order.

    Parameters
    ----------
    text : Markdown
    """
    seen = _FENCED.sub(_blank, text)
    seen = _CODE.sub(_blank, seen)
    found: list[tuple[int, Counted]] = []
    for at, displayed in _displayed(seen):
        latex, tag = untagged(displayed)
        found.append((at, Counted(EQUATION, tag, latex)))
    for match in _TABLE.finditer(seen):
        found.append((match.start(), Counted(TABLE, "", _caption(seen, match), tuple(_rows(seen, match)))))
    for paragraph in re.finditer(r"(?:^|(?<=\n\n))[^\n]+(?=\n\n|\Z|\n\Z)", re.sub(r"\n[ \t]+\n", _blank_lines, seen)):
        if picture := PICTURE.fullmatch(paragraph[0].strip()):
            name = picture["in"] or picture["out"]
            found.append((paragraph.start(), Counted(PICTURE_ALONE, name, picture["alt"].strip())))
    yield from (one for _at, one in sorted(found, key=lambda item: item[0]))


def _rows(text: str, table: re.Match[str]) -> Iterator[tuple[str, ...]]:
    below = _BLANK_LINE.split(text[table.end() :].removeprefix("\n"), maxsplit=1)[0]
    for line in (table["head"], *(line for line in below.split("\n") if "|" in line)):
        yield tuple(one.strip() for one in line.strip().strip("|").split("|"))


def _displayed(text: str) -> Iterator[tuple[int, str]]:
    """Where each displayed equation begins, and its LaTeX; as pandoc reads it, whose braces go in pairs."""
    at = 0
    while at < len(text):
        if text[at] == "\\":
            at += 2
        elif text.startswith("$$", at) and (end := _closed(text, at + 2)) is not None:
            yield at, text[at + 2 : end]
            at = end + 2
        else:
            at += 1


def _closed(text: str, at: int) -> int | None:
    """Where the "$$" is that closes what begins at a place; None where nothing does."""
    blank = _BLANK_LINE.search(text, at)
    end, depth = blank.start() if blank else len(text), 0
    while at < end:
        if text[at] == "\\":
            at += 1
        elif text[at] == "{":
            depth += 1
        elif text[at] == "}":
            depth -= 1
            if depth < 0:
                return None
        elif text[at] == "$" and not depth:
            return at if text.startswith("$$", at) else None
        at += 1
    return None


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match[0])


def _blank_lines(match: re.Match[str]) -> str:
    return "\n" * (len(match[0]))


def _caption(text: str, table: re.Match[str]) -> str:
    """The caption of a table: of the paragraph just above it, or just below."""
    above = text[: table.start()].rstrip().rpartition("\n\n")[2].strip()
    below = re.split(r"\n[ \t]*\n", text[table.end() :], maxsplit=2)
    for paragraph in (above, *(one.strip() for one in below[1:2])):
        if match := CAPTION.fullmatch(paragraph):
            return " ".join(match["caption"].split())
    return ""
