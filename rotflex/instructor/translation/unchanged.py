"""What a translation has to have as its source has it: what students compute with, follow, or run; and numbers.

The order may be another, for sentences are built otherwise. The words of links, and those that describe pictures, are
for the translator.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from rotflex.courseware import words
from rotflex.courseware.messages import _

#: In the order in which they are looked for: what stands in code is no formula.
_PROTECTED = re.compile(
    rf"""
      (?P<code> (?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`) )
    | (?P<comment> <!--.*?--> )
    | (?P<formula> (?<!\\)\$\$.+?\$\$ | (?<!\\)\$(?:\\.|[^$\\])+\$ | \\\(.+?\\\) | \\\[.+?\\\]
                 | \\begin\{{(?P<name>\w+\*?)\}}.*?\\end\{{(?P=name)\}} )
    | (?P<address> <?https?://[^\s<>()\]]+>? )
    | (?P<tag> </?[a-zA-Z](?:[^<>"']|"[^"]*"|'[^']*')*> )
    | (?P<picture> !(?=\[) )
    | (?P<target> \]\([^()]*(?:\([^()]*\)[^()]*)*\) | \]\[[^\]]*\] )
    | (?P<entity> &(?:\w+|\#\w+); )
    | (?P<placeholder> \{{\w+\}} )
    | (?P<mark> {words.MARK} )
    | (?P<number> \d+(?:[.,]\d+)* )
    """,
    re.DOTALL | re.VERBOSE,
)
_READ_ALOUD = re.compile(r"""\b(alt|title|aria-label)=(?:"[^"]*"|'[^']*')""")  # words for people, in a tag
_VOID = ("area", "br", "col", "hr", "img", "input", "source", "wbr")  # elements of HTML without an end
_TAG = re.compile(r"<(/?)([a-zA-Z][\w-]*)")
_LONGEST = 60  # characters of what is quoted

Kept = tuple[str, str]  # kind, as it stands


def differences(source: str, translation: str) -> list[str]:
    """What a translation of a piece has otherwise than its source, in words; none if it can be used."""
    before, after = Counter(_kept(source)), Counter(_kept(translation))
    told = [_("{what} is missing").format(what=_named(one)) for one in (before - after)]
    told += [_("{what} is not in the source").format(what=_named(one)) for one in (after - before)]
    if not told and _unclosed(source) != _unclosed(translation):
        told.append(_("its tags are not closed in the order in which they are opened"))
    columns = [_columns(text) for text in (source, translation)]
    if source.startswith("|") and columns[0] != columns[1]:
        told.append(
            _("the row has {given} signs |, and should have {right}").format(given=columns[1], right=columns[0])
        )
    return told


def without_kept(text: str) -> str:
    """A text without what is kept of it."""
    return _PROTECTED.sub(" ", text)


def goes_on(text: str) -> bool:
    """Whether a displayed formula or a comment is not at its end where a text ends."""
    rest = without_kept(text)
    return "$$" in rest or "<!--" in rest


def _kept(text: str) -> Iterator[Kept]:
    for match in _PROTECTED.finditer(text):
        kind = match.lastgroup or ""
        found = match[0]
        if kind == "tag":
            found = _READ_ALOUD.sub(r'\1=""', found)
        yield kind, found


def _named(one: Kept) -> str:
    kind, text = one
    kinds = {
        "code": _("the code {text}"),
        "comment": _("the comment {text}"),
        "formula": _("the formula {text}"),
        "address": _("the address {text}"),
        "tag": _("the tag {text}"),
        "picture": _("the picture's sign {text}"),
        "target": _("the link's target {text}"),
        "entity": _("the character {text}"),
        "placeholder": _("the placeholder {text}"),
        "mark": _("the sign {text}"),
        "number": _("the number {text}"),
    }
    return kinds[kind].format(text=text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…")


def _unclosed(text: str) -> list[str]:
    """Tags that remain when each end is taken away with the beginning that it is next to; none for plain nesting."""
    left: list[str] = []
    for kind, found in _kept(text):
        match = _TAG.match(found) if kind == "tag" else None
        if match is None or match[2].lower() in _VOID or found.endswith("/>"):
            continue
        if match[1] and left and left[-1] == match[2]:
            left.pop()
        else:
            left.append(match[1] + match[2])
    return left


def _columns(text: str) -> int:
    return without_kept(text).replace(r"\|", "").count("|")
