"""Hostile answers of students, and what of a page could do harm."""

import re
from html.parser import HTMLParser
from typing import Any

HOSTILE = [
    "<script>window.ran = 1</script>",
    "<img src=x onerror='window.ran=1'>",
    "</textarea></div><svg onload=window.ran=1>",
    "[click](javascript:window.ran=1) ![x](javascript:window.ran=1)",
    "![x](https://example.com/beacon.png) <https://example.com>",
    "\u202egnp.exe {{ 7 * 7 }} {% raw %}",
    "$\\href{javascript:window.ran=1}{x}$ &lt;script&gt;",
    '" autofocus onfocus="window.ran=1',
]


#: Tags of the page's own, of Markdown, and of MathML.
TAGS = """
    html head meta title link body main header section article aside div span p h1 h2 ul ol li dl dt dd details summary
    label input textarea button kbd strong em b code pre a table thead tbody tr th td progress
    blockquote form math mrow mi mo mn mtext semantics annotation mstyle msub msup
"""


def harm(page: str) -> list[Any]:
    """Tags and attributes that are not the page's own, or that lead or load from elsewhere or run something."""
    found = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag not in TAGS.split():
                found.append(tag)
            for name, value in attrs:
                own = name in ("href", "action") and re.match(r"(?=[\w.])[\w./]*([?].*)?$|data:,$", value)
                if name.startswith("on") or name == "style" or (name in ("href", "src", "action") and not own):
                    found.append((tag, name, value))

    Reader(convert_charrefs=True).feed(page)
    return found
