"""The pages of the instructor's guide as tests read them: links, headings, tables, commands, names."""

import re
from pathlib import Path

from checkout import ROOT

GUIDE = ROOT / "docs" / "guide"
PAGES = sorted(GUIDE.glob("*.md"))

_FENCE = re.compile(r"^( *)```(\w*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)


def text(page: Path | str) -> str:
    """A page, by its path or its name in the guide."""
    return (GUIDE / page).read_text(encoding="utf-8")


def without_fences(page: Path | str) -> str:
    return _FENCE.sub("", text(page))


def fences(page: Path | str, language: str) -> list[str]:
    """The blocks of a language, without what indents them."""
    found = [(indent, body) for indent, kind, body in _FENCE.findall(text(page)) if kind == language]
    return [re.sub(rf"^{indent}", "", body, flags=re.MULTILINE) for indent, body in found]


def spans(page: Path | str) -> list[str]:
    """What is set as code within sentences."""
    return _SPAN.findall(without_fences(page))


def links(page: Path | str) -> list[str]:
    return _LINK.findall(_SPAN.sub("", without_fences(page)))


def headings(page: Path | str) -> list[tuple[int, str]]:
    return [(len(marks), words) for marks, words in _HEADING.findall(without_fences(page))]


def anchor(heading: str) -> str:
    """What a link to a heading ends with."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def rows(page: Path | str, heading: str) -> list[list[str]]:
    """The rows of the first table after a line that begins with ``heading``, without its head."""
    after = re.split(rf"^{re.escape(heading)}", text(page), maxsplit=1, flags=re.MULTILINE)[1]
    table = re.search(r"^\|.*?\n(?!\|)", after + "\n", re.MULTILINE | re.DOTALL)
    assert table, (page, heading)
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].strip().split("\n")]
    return cells[2:]
