"""Untrusted text made harmless for a terminal and for a spreadsheet."""

from __future__ import annotations

import unicodedata

#: Where a spreadsheet would begin to calculate.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
_KEPT = "\n\t\u200c\u200d"  # lines, tabs, and how letters and emoji join


def no_escapes(text: str) -> str:
    """Text without what steers a terminal or turns the direction of writing: each such character as "\\x1b"."""
    return "".join(one if one in _KEPT or not _steers(one) else ascii(one)[1:-1] for one in text)


def _steers(character: str) -> bool:
    # Cc: escapes and other controls; Cf: invisible and direction marks; Cs: halves of characters.
    return unicodedata.category(character) in ("Cc", "Cf", "Cs")


def spreadsheet_cell(text: str) -> str:
    """Text that a spreadsheet takes for text."""
    text = no_escapes(text)
    return f"'{text}" if text.lstrip(" \xa0").startswith(_FORMULA) else text


def from_spreadsheet_cell(text: str) -> str:
    """Return a text without the sign that :func:`spreadsheet_cell` puts before what looks like a formula."""
    return text[1:] if text.startswith("'") and spreadsheet_cell(text[1:]) == text else text
