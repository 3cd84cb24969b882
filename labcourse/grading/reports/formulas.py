"""Students' formulas, from LaTeX to MathML that browsers show by themselves: no script, no request.

The library's own text output writes what stands in a formula without escaping it, and takes over links and styles. So
its tree is written here: known elements, known attributes with plain values, and text escaped.
"""

from __future__ import annotations

import html
import re
from xml.etree.ElementTree import Element

from markupsafe import Markup, escape

LONGEST = 1000  #: characters of a formula that is shown as one; it fits on a page
MOST_NODES = 3000  #: of its tree
_DEEPEST = 25  # groups in each other
_ELEMENT = re.compile(
    "math|mrow|mi|mn|mo|ms|mtext|mspace|msup|msub|msubsup|mfrac|msqrt|mroot|mover|munder|munderover|mtable|mtr|mtd|"
    "mlabeledtr|mstyle|mpadded|mphantom|menclose|mfenced|mmultiscripts|mprescripts|none|merror"
)
_ATTRIBUTE = re.compile(
    "display|mathvariant|stretchy|fence|separators?|form|accent|accentunder|displaystyle|scriptlevel|linethickness|"
    "largeop|movablelimits|symmetric|(min|max)size|[lr]space|width|height|depth|voffset|(column|row)(align|lines|spacing)|"
    "frame|notation|open|close"
)
_VALUE = re.compile(r"[\w .%+-]{0,60}")


class FormulaError(Exception):
    """It cannot be shown as a formula."""


def as_mathml(latex: str, block: bool = False) -> Markup:
    """A formula as MathML.

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

    if len(latex) > LONGEST or _depth(latex) > _DEEPEST:
        raise FormulaError
    try:
        tree = convert_to_element(latex, display="block" if block else "inline")
    except Exception:  # the library raises all sorts of errors on what it does not know
        raise FormulaError from None
    if sum(1 for _node in tree.iter()) > MOST_NODES:
        raise FormulaError
    return _written(tree)


def _depth(latex: str) -> int:
    """How deep groups stand in each other, at most: braces, environments, \\left."""
    level = deepest = 0
    for opening in re.finditer(r"\\(?:begin|left|end|right)\b|\\.|[{}]|\^|_", latex):
        word = opening[0]
        if word in ("{", r"\begin", r"\left"):
            level += 1
        elif word in ("}", r"\end", r"\right"):
            level -= 1
        deepest = max(deepest, level)
    # Each of these takes what follows as its argument, so that a row of them is nested as well.
    rows = max((len(row[0]) for row in re.finditer(r"(?:\\[a-zA-Z]+\s*){2,}|[\^_]{2,}", latex)), default=0)
    return max(deepest, rows // 8)


def _written(node: Element) -> Markup:
    """An element and all in it, as text of a page."""
    inner = Markup("").join([escape(html.unescape(node.text or "")), *map(_written, node)])
    if not _ELEMENT.fullmatch(node.tag):
        return inner
    attributes = Markup("").join(
        Markup(' {}="{}"').format(name, value)
        for name, value in node.attrib.items()
        if _ATTRIBUTE.fullmatch(name) and _VALUE.fullmatch(value)
    )
    return Markup("<{0}{1}>{2}</{0}>").format(Markup(node.tag), attributes, inner)
