"""A report as pandoc's document: texts as pandoc reads them, with captions, numbers and links.

Others open a report. So a student's text brings in only words, formulas, tables, lists, code, links to web addresses
and attached pictures: no attributes, no HTML, no other files. What is left out is listed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from labcourse.report import pandoc
from labcourse.report.contents import Contents, Exhibit, Heading, Text
from labcourse.report.pandoc import Node

_NO_ATTRIBUTES: list[Any] = ["", [], []]
_WIDTHS = (0.3, 0.17, 0.42, 0.11)  # of the columns of a results table: shares of the page's width
_SHOWN = 60  # characters of a student's text in a message
_SPACES = {"Space": " ", "SoftBreak": "\n", "LineBreak": " "}
#: Nodes that are copied, with their contents.
_COPIED = {"Para", "Plain", "BlockQuote", "BulletList", "OrderedList", "Note", "Str", "Emph", "Strong", "Strikeout"}
_COPIED |= {*_SPACES, "HorizontalRule", "Header", "Code", "CodeBlock"}
#: Node → what replaces the first of its contents: a heading's level, the language of code.
_FIRST = {"Header": 3, "CodeBlock": _NO_ATTRIBUTES}
_NOT_LINKED = ("Link", "Image", "Code", "CodeBlock", "Header", "Span")  # a span has a number, or a formula
_WEB = re.compile(r"(?:https?://|mailto:)", re.IGNORECASE)
_BREAK = re.compile(r"\s*<br\s*/?>\s*", re.IGNORECASE)
_TAG = re.compile(r"\\tag\*?\s*\{([^{}]{0,60})\}")
_MATH_REFERENCE = re.compile(r"\\(?:eq)?ref\s*\{([^{}]{0,60})\}")
_COMMAND = re.compile(r"\\(?:[A-Za-z]+\*?|.)", re.DOTALL)
#: Spaces that pandoc does not know, or writes with a wrong width for typst → a similar space.
_REPLACED = {r"\;": r"\:", r"\!": "", r"\negthinspace": "", r"\thinspace": r"\, ", r"\enspace": r"\ "}

_NUMBER, _KEY = r"\d+(?:\.\d+)*", r"[\w.:-]{1,30}"
#: "Figures 1.2 and 3", but not "Figure 2 of [1]"; "[1, 2]", also "[1, p. 3]".
_REFERENCE = re.compile(
    rf"(?<!\w)(?P<kind>fig(?:ures?|s?\.)|tables?)\s+"
    rf"(?P<numbers>(?>{_NUMBER}(?:(?:,\s*|,?\s+(?:and|or|to)\s+|\s*[-–]\s*){_NUMBER})*))(?!\s*,?\s+(?:of|in|from)\s+\[)"
    rf"|\[(?P<keys>{_KEY}(?:,\s*{_KEY})*)(?=(?:,\s*pp?\.[^\[\]]{{1,40}})?\])",
    re.IGNORECASE,
)
_BEFORE_UNIT = re.compile(
    r"(?:(?<=[\d⁰¹²³⁴-⁹])|(?<=\d\)))[ \n](?=[%°]|[^\W\d_]{1,3}\b|(?:deg|rad|count|sample|second|minute)\w*)"
)
_NO_BREAK = "\N{NO-BREAK SPACE}"


class Markup:
    """A report as pandoc's document.

    Parameters
    ----------
    contents : of the report

    Attributes
    ----------
    blocks : pandoc's nodes
    pictures : name of a picture's file → its node and its content
    formulas : name of a formula → its node
    alt : name of a picture or a formula → its description
    tags : name of an equation → its number or name, as the student gave it
    problems : what was left out, each once

    Raises
    ------
    ReportError
        If pandoc is missing or cannot read the texts.
    """

    def __init__(self, contents: Contents) -> None:
        self.pictures: dict[str, tuple[Node, bytes]] = {}
        self.formulas: dict[str, Node] = {}
        self.alt: dict[str, str] = {}
        self.tags: dict[str, str] = {}
        self.problems: dict[str, None] = dict.fromkeys(contents.problems)
        self._figures = 0
        self._attached: Mapping[str, bytes] = {}  # pictures of the text at hand
        #: (kind, number or key), as in ("figure", "1.2") → name, and what to show
        self._targets: dict[tuple[str, str], tuple[str, str]] = {}
        texts = [piece for piece in contents.pieces if isinstance(piece, Text)]
        recorded = [piece for piece in contents.pieces if isinstance(piece, Exhibit)]
        sources = {text.markdown for text in texts} | {text for one in recorded for text in (one.caption, one.table)}
        ordered = sorted(sources)
        self._read = dict(zip(ordered, pandoc.read(ordered), strict=True))
        self.blocks = [block for number, piece in enumerate(contents.pieces) for block in self._piece(piece, number)]
        self._link(self.blocks)

    def _piece(self, piece: Heading | Text | Exhibit, number: int) -> list[Node]:
        if isinstance(piece, Heading):
            return [{"t": "Header", "c": [piece.level, [f"section-{number}", [], []], _words(piece.text)]}]
        self._attached = piece.pictures if isinstance(piece, Text) else {}
        if isinstance(piece, Text):
            blocks = self._cleaned(self._read[piece.markdown])
            return [self._source(piece.source, _line(blocks))] if piece.source else blocks
        caption = _line(self._cleaned(self._read[piece.caption]))
        if piece.svg or not piece.table:
            emphasised = {"t": "Emph", "c": _words(piece.alt)}
            shown = self._picture(piece.svg.encode(), "figure.svg", piece.alt) if piece.svg else emphasised
            return [self._figure(shown, caption, piece.label)]
        table, *_rest = self._cleaned(self._read[piece.table])
        kind, _space, label = piece.label.partition(" ")
        name = f"table-{number}"
        self._targets[kind.casefold(), label] = name, label
        columns = [[{"t": "AlignLeft"}, {"t": "ColWidth", "c": width}] for width in _WIDTHS]
        table["c"][:3] = [[name, [], []], _captioned(piece.label, caption), columns]
        return [table]

    def _source(self, key: str, line: list[Node]) -> Node:
        name = f"source-{len(self._targets)}"
        self._targets["source", key] = name, key
        return {"t": "Para", "c": [_span(name, _words(f"[{key}]")), {"t": "Space"}, *line]}

    # --- what may stand in a report --------------------------------------------------------------------------------

    def _cleaned(self, content: Any) -> Any:
        """Return what may stand in a report of nodes, or of lists with nodes in them."""
        if not isinstance(content, list):
            return content
        if content and isinstance(content[0], dict):
            return [new for node in content for new in self._node(node["t"], node.get("c"))]
        return [self._cleaned(item) for item in content]

    def _node(self, kind: str, content: Any) -> list[Node]:
        if kind == "Para" and [node["t"] for node in content] == ["Image"]:  # for pandoc, a figure has a caption
            kind, content = "Figure", [None, None, [{"c": content}]]
        changed = {"Math": self._formula, "Link": self._web_link, "Image": self._image, "Figure": self._own_figure}
        changed |= {"RawInline": self._html, "RawBlock": self._html}
        if kind in changed:
            return changed[kind](content)
        if kind == "Table":
            return [{"t": kind, "c": [*content[:3], *self._cleaned(content[3:])]}]
        if kind not in _COPIED:
            self._leave_out(f"something that pandoc calls {kind}")
            return []
        content = self._cleaned(content)
        if kind in _FIRST:
            content[0] = _FIRST[kind]
        return [{"t": kind, "c": content}]

    def _own_figure(self, content: Any) -> list[Node]:
        image = content[2][0]["c"][0]["c"]
        return [self._figure(picture, self._cleaned(image[1])) for picture in self._image(image, "figure.png")]

    def _web_link(self, content: Any) -> list[Node]:
        shown, target = self._cleaned(content[1]), content[2][0]
        if _WEB.match(target):
            return [{"t": "Link", "c": [_NO_ATTRIBUTES, shown, [target, ""]]}]
        self._leave_out(f"the link to {target[:_SHOWN]!r}; only web addresses stay")
        return list(shown)

    def _html(self, content: Any) -> list[Node]:
        if _BREAK.fullmatch(content[1]):
            return [{"t": "LineBreak"}]
        if not content[1].lstrip().startswith(("<!--", "</")):  # a closing tag has an opening one
            self._leave_out(f"the HTML {content[1].strip()[:_SHOWN]}")
        return []

    def _leave_out(self, what: str) -> None:
        self.problems[f"Left out: {what}."] = None

    def _image(self, content: Any, suffix: str = "in-line.png") -> list[Node]:
        """Return a picture that is attached; leave out another one."""
        name = content[2][0]
        if name in self._attached:
            return [self._picture(self._attached[name], suffix, _plain(content[1]))]
        self._leave_out(f"the picture {name[:_SHOWN]!r}; paste it into the cell")
        return []

    def _picture(self, content: bytes, suffix: str, alt: str) -> Node:
        """Store a picture, and return its node. The template takes its size by ``suffix``."""
        alt = alt.strip() or "A picture without a description."  # typst makes no PDF for a screen reader without one
        name = f"{len(self.pictures) + 1}-{suffix}"
        image = {"t": "Image", "c": [_NO_ATTRIBUTES, _words(alt), [name, ""]]}
        self.pictures[name], self.alt[name] = (image, content), alt
        return image

    def _figure(self, shown: Node, caption: list[Node], label: str = "") -> Node:
        """Return a figure with the next number."""
        self._figures += 1
        number = str(self._figures)
        target = f"figure-{number}", number
        self._targets["figure", number] = target
        if label:
            self._targets["figure", label.partition(" ")[2]] = target
        caption = _captioned(f"Figure {number}", caption)
        return {"t": "Figure", "c": [[target[0], [], []], caption, [{"t": "Plain", "c": [shown]}]]}

    def _formula(self, content: Any) -> list[Node]:
        """Return a formula with a name. Its tag is taken out: template and page show it."""
        (kind, latex), name = content, f"formula-{len(self.formulas) + 1}"
        if tag := _TAG.search(latex):
            self.tags[name] = f"({tag[1].strip()})"
        latex = _MATH_REFERENCE.sub(r"\\text{(\1)}", _TAG.sub("", latex).strip())
        latex = _COMMAND.sub(lambda match: _REPLACED.get(match[0], match[0]), latex)
        math = {"t": "Math", "c": [kind, latex]}
        self.formulas[name], self.alt[name] = math, latex or "an empty formula"
        return [_span(name, [math], tag=self.tags.get(name, ""))]

    # --- references ------------------------------------------------------------------------------------------------

    def _link(self, item: Any) -> None:
        """Replace references by links in all lists of inline nodes, in place."""
        if isinstance(item, dict) and item["t"] not in _NOT_LINKED:
            self._link(item.get("c"))
        elif isinstance(item, list):
            for child in item:
                self._link(child)
            if any(isinstance(child, dict) and child["t"] == "Str" for child in item):
                item[:] = self._linked(item)

    def _linked(self, nodes: list[Node]) -> list[Node]:
        linked: list[Node] = []
        run = ""
        for node in [*nodes, None]:
            if node and node["t"] in ("Str", "Space", "SoftBreak"):
                run += _plain(node)
                continue
            last = _plain(linked[-1:])[-1:]  # a number may be a formula, and its unit the text behind it
            run, at = _BEFORE_UNIT.sub(_NO_BREAK, last + run)[len(last) :], 0
            for match in _REFERENCE.finditer(run):
                linked += _words(run[at : match.start()]) + self._reference(match)
                at = match.end()
            linked += _words(run[at:]) + ([node] if node else [])
            run = ""
        return linked

    def _reference(self, match: re.Match[str]) -> list[Node]:
        """Return nodes for a reference, with a link for each number or key that the report has."""
        kind = "source" if match["keys"] else "figure" if match["kind"][0] in "fF" else "table"
        before = f"{match['kind']}{_NO_BREAK}" if match["kind"] else ""
        nodes = [] if before else _words("[")
        for text in filter(None, re.split(f"({_NUMBER if before else _KEY})", match["numbers"] or match["keys"])):
            name, shown = self._targets.get((kind, text), ("", text))
            words, before = _words(before + shown), ""
            nodes += [{"t": "Link", "c": [_NO_ATTRIBUTES, words, [f"#{name}", ""]]}] if name else words
        return nodes


def _captioned(label: str, caption: list[Node]) -> list[Any]:
    """Return a caption with its label before it."""
    before = _span("", [{"t": "Strong", "c": _words(f"{label}.")}])
    return [None, [{"t": "Plain", "c": [before, {"t": "Space"}, *caption]}]]


def _line(blocks: list[Node]) -> list[Node]:
    """Return the contents of the first paragraph."""
    return next((block["c"] for block in blocks if block["t"] in ("Para", "Plain")), [])


def _plain(nodes: Any) -> str:
    """Return the text of nodes."""
    if isinstance(nodes, list):
        return "".join(map(_plain, nodes))
    if not isinstance(nodes, dict):
        return ""
    kind = nodes["t"]
    content: Any = nodes.get("c")
    if kind in ("Str", *_SPACES):
        return str(_SPACES.get(kind, content))
    return str(content[1]) if kind in ("Code", "Math") else _plain(content)


def _words(text: str) -> list[Node]:
    names = {" ": "Space", "\n": "SoftBreak"}
    pieces = filter(None, re.split(r"([ \n])", text))
    return [{"t": names[piece]} if piece in names else {"t": "Str", "c": piece} for piece in pieces]


def _span(name: str, nodes: list[Node], tag: str = "") -> Node:
    return {"t": "Span", "c": [[name, [], [["tag", tag]] if tag else []], nodes]}
