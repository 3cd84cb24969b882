"""A report as pandoc's document: texts as pandoc reads them, with numbers, captions and links.

Others open a report. So a student's text brings in only words, formulas, tables, lists, code, links to web addresses
and attached pictures: no attributes, no HTML, no other files. A notice says what is left out.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from labcourse.report import pandoc
from labcourse.report.document import Document, Notice, Place, Recorded, Section, Text
from labcourse.report.pandoc import Node

_NO_ATTRIBUTES: list[Any] = ["", [], []]
_WIDTHS = (0.32, 0.14, 0.43, 0.11)  # of the columns of a results table: shares of the page's width
_TEXT_HEADING = 3  # level of headings in a student's text
_SHOWN = 60  # characters of a student's text in a message
_SPACES = {"Space": " ", "SoftBreak": "\n", "LineBreak": " "}
#: Nodes that are copied, with their contents.
_COPIED = {"Para", "Plain", "BlockQuote", "BulletList", "OrderedList", "Note", "Str", "Emph", "Strong", "Strikeout"}
_WEB = re.compile(r"(?:https?://|mailto:)", re.IGNORECASE)
_BREAK = re.compile(r"\s*<br\s*/?>\s*", re.IGNORECASE)

_TAG = re.compile(r"\\(?:tag\*?|label)\s*\{([^{}]{0,60})\}")
_MATH_REFERENCE = re.compile(r"\s*(\\(?:eq)?ref)\s*(\{[^{}]*\})\s*")  # in dollars, as a notebook shows one
_LINES = re.compile(r"\\[hc]line\b|\\begin\s*\{array\}\s*\{[^{}]*\|")
_COMMAND = re.compile(r"\\(?:[A-Za-z]+\*?|.)", re.DOTALL)
#: Spaces that pandoc does not know, or writes with a wrong width for typst → a similar space.
_REPLACED = {r"\;": r"\:", r"\!": "", r"\negthinspace": "", r"\thinspace": r"\, ", r"\enspace": r"\ "}
_BARE_COLUMNS = re.compile(r"\\begin\s*\{(array|matrix|smallmatrix)\}.*?\\end\s*\{\1\}", re.DOTALL)

_NUMBER = r"\d+(?:\.\d+)*"
_REFERENCE = (
    rf"(?<!\w)(?P<kind>fig(?:ures?|s?\.)|tables?)\s+"
    rf"(?P<numbers>{_NUMBER}(?:(?:,\s*|,?\s+(?:and|or|to)\s+|\s*[-–]\s*){_NUMBER})*)"
    r"|\((?P<tag>(?-i:TAGS))\)|(?<!\w)(?P<equation>equations?|eqs?\.)\s+\((?P<unknown>[^()]{1,60})\)"
    r"|\\(?:eq)?ref\{(?P<ref>[^{}]{1,60})\}"
    r"|\[(?P<keys>[\w.:-]{1,30}(?:\s*,\s*[\w.:-]{1,30})*)(?P<pages>,\s*pp?\.[^\[\]]{1,40})?\]"
)
_OF_A_SOURCE = re.compile(r"\s*,?\s+(?:of|in|from)\s+\[")  # "Figure 2 of [1]" is not a figure of this report


@dataclass(frozen=True)
class Numbered:
    """A figure or a table in a report.

    Attributes
    ----------
    kind : "figure" or "table"
    number : in the report, from 1
    place : the cell that has it
    captioned : whether the student wrote its caption
    recorded : None if it is in a text of the student's
    entries : texts of the cells of a table in a text
    """

    kind: str
    number: int
    place: Place
    captioned: bool
    recorded: Recorded | None = None
    entries: tuple[str, ...] = ()

    def __str__(self) -> str:
        name = f"{self.kind.title()} {self.number}"
        return name if self.recorded is None or self.recorded.label == name else f"{name} ({self.recorded.label})"


class Markup:
    """A report as pandoc's document.

    Parameters
    ----------
    document : the report

    Attributes
    ----------
    blocks : pandoc's nodes
    pictures : name of a picture's file → its node and its content
    formulas : name of a formula → its node and its cell
    alt : name of a picture or a formula → its description
    numbered : number of a section → the figures and tables in it
    mentioned : names that the student's texts refer to, as in "figure-2"
    notices : what was left out, each once

    Raises
    ------
    ReportError
        If pandoc is missing or cannot read the texts.
    """

    def __init__(self, document: Document) -> None:
        self.blocks: list[Node] = []
        self.pictures: dict[str, tuple[Node, bytes]] = {}
        self.formulas: dict[str, tuple[Node, Place]] = {}
        self.alt: dict[str, str] = {}
        self.numbered: dict[str, list[Numbered]] = {section.number: [] for section in document.sections}
        self.mentioned: set[str] = set()
        self.notices: dict[Notice, None] = dict.fromkeys(document.notices)
        self._document = document
        self._count: Counter[str] = Counter()
        self._labels: dict[str, str] = {}  # label of a recorded figure or table, as in "figure 1.2" → its name
        self._names: dict[str, str] = {}  # kind and number of a figure or a table, as in "figure 2" → its name
        self._tags: dict[str, dict[Place, str]] = {}  # tag of an equation → cell → its name
        self._texts: list[_Cleaned] = []
        texts = list(dict.fromkeys(_markdown(document)))
        self._read = dict(zip(texts, pandoc.read(texts), strict=True))
        self._add_sections()
        self._add_sources()
        self._add_links()

    def note(self, message: str, place: Place, section: str = "") -> None:
        """Add a notice about a cell."""
        self.notices[Notice(f"Section {section}: {message}" if section else message, place)] = None

    # --- sections and what they show -------------------------------------------------------------------------------

    def _add_sections(self) -> None:
        parts: dict[str, list[Section]] = {}
        for section in self._document.sections:
            parts.setdefault(section.number.partition(".")[0], []).append(section)
        for number, sections in parts.items():
            # "Procedure: measuring" and "Procedure: modelling" are in the part "Procedure".
            titles = {section.heading.partition(": ")[0] for section in sections}
            grouped = len(titles) == 1 and all(": " in section.heading for section in sections)
            if grouped:
                self._add_heading(1, f"part-{number}", f"{number} {titles.pop()}")
            for section in sections:
                text = section.heading.partition(": ")[2] if grouped else section.heading
                text = f"{section.number} {text[:1].upper()}{text[1:]}"
                self._add_heading(2, f"section-{section.number}", text)
                blocks = [block for piece in section.pieces for block in self._piece(piece, section.number)]
                self.blocks += blocks or [{"t": "Para", "c": [_emphasised("Nothing is written or recorded yet.")]}]

    def _add_heading(self, level: int, name: str, text: str) -> None:
        words = _words(text)
        self._texts.append(_Cleaned(self, self._document.front, nodes=words))
        self.blocks.append({"t": "Header", "c": [level, [name, [], []], words]})

    def _piece(self, piece: Text | Recorded, section: str) -> list[Node]:
        if isinstance(piece, Text):
            return self._text(piece, section).nodes
        text = _Cleaned(self, piece.place, section, in_results=True)
        caption = self._line(piece.caption)
        if piece.table:
            content = self._read[piece.table][0]["c"]
            content[2] = [[{"t": "AlignLeft"}, {"t": "ColWidth", "c": width}] for width in _WIDTHS]
            return [text.table(content, caption, recorded=piece, captioned=piece.own_caption)]
        picture = _emphasised(piece.alt)
        if piece.svg:
            picture = self.picture(piece.svg.encode(), "figure.svg", piece.alt)
        return [text.figure(picture, caption, recorded=piece, captioned=piece.own_caption)]

    def _text(self, text: Text, section: str = "") -> _Cleaned:
        cleaned = _Cleaned(self, text.place, section, text.pictures)
        cleaned.nodes += cleaned.copied(self._read[text.markdown])
        self._texts.append(cleaned)
        return cleaned

    def _line(self, text: Text) -> list[Node]:
        """Return the contents of the first paragraph of a text."""
        return next((block["c"] for block in self._text(text).nodes if block["t"] in ("Para", "Plain")), [])

    def _add_sources(self) -> None:
        if sources := self._document.sources:
            self._add_heading(1, "sources", "References")
            for key, text in sources.items():
                line = self._line(text)
                line[:0] = [_span(f"source-{key}", [{"t": "Str", "c": f"[{key}]"}]), {"t": "Space"}]
                self.blocks.append({"t": "Para", "c": line})

    # --- what has a name or a number -------------------------------------------------------------------------------

    def add_numbered(self, kind: str, section: str, place: Place, about: Mapping[str, Any]) -> Numbered:
        """Add a figure or a table, with the next number."""
        self._count[kind] += 1
        item = Numbered(kind, self._count[kind], place, **about)
        self.numbered[section].append(item)
        self._names[f"{kind} {item.number}"] = f"{kind}-{item.number}"
        if item.recorded:
            self._labels.setdefault(item.recorded.label.casefold(), f"{kind}-{item.number}")
        return item

    def picture(self, content: bytes, suffix: str, alt: str) -> Node:
        """Store a picture, and return its node. The template takes its size by ``suffix``."""
        alt = alt.strip() or "A picture without a description."  # typst makes no PDF for a screen reader without one
        name = f"{len(self.pictures) + 1}-{suffix}"
        image = {"t": "Image", "c": [_NO_ATTRIBUTES, _words(alt), [name, ""]]}
        self.pictures[name] = (image, content)
        self.alt[name] = alt
        return image

    def formula(self, kind: str, latex: str, place: Place) -> Node:
        """Return a formula with a name: an "equation", which has a number, a "formula", or an "entry" of a table."""
        self._count[kind] += 1
        name = f"{kind}-{self._count[kind]}"
        for tag in _TAG.findall(latex):
            self._tags.setdefault(tag.strip(), {}).setdefault(place, name)
        latex = _COMMAND.sub(lambda match: _REPLACED.get(match[0], match[0]), _TAG.sub("", latex).strip())
        latex = _BARE_COLUMNS.sub(lambda match: re.sub(r"(?<!\\)&", r"\\quad &", match[0]), latex)
        math = {"t": "Math", "c": [{"t": "InlineMath" if kind == "formula" else "DisplayMath"}, latex]}
        self.formulas[name], self.alt[name] = (math, place), latex
        return _span(name, [math], {"number": str(self._count[kind])} if kind == "equation" else {})

    # --- references ------------------------------------------------------------------------------------------------

    def _add_links(self) -> None:
        self._pattern = _references(self._tags)
        for text in self._texts:
            self._link(text.nodes, text)

    def _link(self, item: Any, text: _Cleaned) -> None:
        """Replace references by links in all lists of inline nodes, in place. Spans have names and numbers."""
        if isinstance(item, dict) and item["t"] not in ("Link", "Image", "Span", "Code", "CodeBlock"):
            self._link(item.get("c"), text)
        elif isinstance(item, list):
            for child in item:
                self._link(child, text)
            if any(isinstance(child, dict) and child["t"] == "Str" for child in item):
                item[:] = self._linked(item, text)

    def _linked(self, nodes: list[Node], text: _Cleaned) -> list[Node]:
        linked: list[Node] = []
        run = ""
        for node in [*nodes, None]:
            if node and node["t"] in ("Str", "Space", "SoftBreak"):
                run += plain(node)
                continue
            at = 0
            for match in self._pattern.finditer(run):
                linked += _words(run[at : match.start()]) + self._reference(match, text)
                at = match.end()
            linked += _words(run[at:]) + ([node] if node else [])
            run = ""
        return linked

    def _reference(self, match: re.Match[str], text: _Cleaned) -> list[Node]:
        if match["numbers"] and not _OF_A_SOURCE.match(match.string, match.end()):
            return self._numbers(match, text)
        if tag := match["tag"] or match["unknown"] or match["ref"]:
            return self._equation(match["equation"], tag, text)
        return self._cited(match, text) if match["keys"] else _words(match[0])

    def _numbers(self, match: re.Match[str], text: _Cleaned) -> list[Node]:
        kind = "figure" if match["kind"].casefold().startswith("f") else "table"
        nodes: list[Node] = []
        before = f"{match['kind']}\N{NO-BREAK SPACE}"
        for separator, label in re.findall(rf"(\D*)({_NUMBER})", match["numbers"]):
            name = self._labels.get(f"{kind} {label}") or self._names.get(f"{kind} {label}")
            number = name.rpartition("-")[2] if name else label
            nodes += [*_words(separator), *text.link(before + number, name, f"no {kind.title()} {label}")]
            before = ""
        return nodes

    def _equation(self, word: str | None, tag: str, text: _Cleaned) -> list[Node]:
        names = self._tags.get(tag, {})
        name = names.get(text.place) or next(iter(names.values()), None)
        if len(names) > 1 and text.place not in names:
            text.note(f"Several equations have the tag {tag}; give each its own.")
        number = name.rpartition("-")[2] if name else tag
        before = _words(f"{word}\N{NO-BREAK SPACE}") if word else []
        return [*before, *text.link(f"({number})", name, f"no equation ({tag})")]

    def _cited(self, match: re.Match[str], text: _Cleaned) -> list[Node]:
        sources = self._document.sources
        keys = re.split(r"\s*,\s*", match["keys"])
        if not any(key in sources for key in keys) and not (sources and all(map(str.isdecimal, keys))):
            return _words(match[0])  # brackets with something else
        nodes: list[Node] = []
        for key in keys:
            name = f"source-{key}" if key in sources else None
            nodes += [*_words(", " if nodes else "["), *text.link(key, name, f"no source [{key}]")]
        return [*nodes, *_words(f"{match['pages'] or ''}]")]


@dataclass
class _Cleaned:
    """What may stand in a report of a text as pandoc has read it.

    Attributes
    ----------
    markup : of the report
    place : the text's cell
    section : its number; "" for captions and sources
    pictures : name → PNG
    in_results : whether it is a results table, whose formulas are as large as its cells allow
    nodes : the result
    """

    markup: Markup
    place: Place
    section: str = ""
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    in_results: bool = False
    nodes: list[Node] = field(default_factory=list)

    def note(self, message: str) -> None:
        """Add a notice about the text."""
        self.markup.note(message, self.place, self.section)

    def link(self, shown: str, name: str | None, missing: str) -> list[Node]:
        """Return a link to what has a name in the report; without a name, plain text, with a notice."""
        if name is None:
            self.note(f"There is {missing} in this report.")
            return _words(shown)
        if self.section:
            self.markup.mentioned.add(name)
        return [{"t": "Link", "c": [_NO_ATTRIBUTES, _words(shown), [f"#{name}", ""]]}]

    def copied(self, content: Any) -> Any:
        """Return what may stand in a report of nodes, or of lists with nodes in them."""
        if not isinstance(content, list):
            return content
        if content and isinstance(content[0], dict):
            return [new for node in _with_captions(content) for new in self._node(node["t"], node.get("c"))]
        return [self.copied(item) for item in content]

    def _node(self, kind: str, content: Any) -> list[Node]:
        if kind == "Para" and [node["t"] for node in content] == ["Image"]:  # for pandoc, a figure has a caption
            kind, content = "Figure", [_NO_ATTRIBUTES, [None, []], [{"t": "Plain", "c": content}]]
        if kind == "Plain" and self.in_results and [node["t"] for node in content] == ["Math"]:
            return [{"t": kind, "c": [self.markup.formula("entry", content[0]["c"][1], self.place)]}]
        if kind in _COPIED:
            return [{"t": kind, "c": self.copied(content)}]
        if kind in (*_SPACES, "HorizontalRule"):
            return [{"t": kind}]
        if kind in ("Code", "CodeBlock"):
            return [{"t": kind, "c": [_NO_ATTRIBUTES, content[1]]}]
        if kind == "Header":
            return [{"t": kind, "c": [_TEXT_HEADING, _NO_ATTRIBUTES, self.copied(content[2])]}]
        known = {"Math": self._math, "Link": self._link, "Image": self._image, "Figure": self._figure}
        known |= {"Table": self._table, "RawInline": self._html, "RawBlock": self._html}
        if kind not in known:
            self.note(f"Something is left out: {kind}.")
        return list(known[kind](content)) if kind in known else []

    def _math(self, content: Any) -> Iterator[Node]:
        if match := _MATH_REFERENCE.fullmatch(content[1]):
            yield {"t": "Str", "c": "".join(match.groups())}
            return
        if _LINES.search(content[1]):
            self.note("Lines between rows and columns of a formula (\\hline, |) are not drawn; a table has such lines.")
        kind = "equation" if content[0]["t"] == "DisplayMath" else "formula"
        yield self.markup.formula(kind, content[1], self.place)

    def _link(self, content: Any) -> Iterator[Node]:
        shown, target = self.copied(content[1]), content[2][0]
        if _WEB.match(target):
            yield {"t": "Link", "c": [_NO_ATTRIBUTES, shown, [target, ""]]}
            return
        self.note(f"The link to {target[:_SHOWN]!r} is left out: only web addresses stay.")
        yield from shown

    def _image(self, content: Any, suffix: str = "in-line.png") -> Iterator[Node]:
        """Yield a picture that is attached; leave out another one, with a notice."""
        name = content[2][0]
        is_noted = any(repr(name[:_SHOWN]) in notice.message for notice in self.markup.notices)  # with the reason
        if name in self.pictures:
            yield self.markup.picture(self.pictures[name], suffix, plain(content[1]))
        elif not is_noted:
            self.note(f"The picture {name[:_SHOWN]!r} is left out: paste it into the cell.")

    def _figure(self, content: Any) -> Iterator[Node]:
        image = content[2][0]["c"][0]["c"]
        for picture in self._image(image, "figure.png"):
            yield self.figure(picture, self.copied(image[1]), captioned=bool(image[1]))

    def _table(self, content: Any) -> Iterator[Node]:
        entries = tuple(plain(cell[4]) for part in (content[3], *content[4]) for row in part[-1] for cell in row[1])
        caption = self.copied(content[1][1])
        yield self.table(content, caption, captioned=bool(caption), entries=entries)

    def figure(self, picture: Node, caption: list[Node], **about: Any) -> Node:
        """Return a figure with its number and caption."""
        return {"t": "Figure", "c": [*self._numbered("figure", caption, about), [{"t": "Plain", "c": [picture]}]]}

    def table(self, content: Any, caption: list[Node], **about: Any) -> Node:
        """Return a table with its number and caption."""
        return {"t": "Table", "c": [*self._numbered("table", caption, about), content[2], *self.copied(content[3:])]}

    def _numbered(self, kind: str, caption: list[Node], about: Mapping[str, Any]) -> list[Any]:
        """Return name and caption of a figure or a table, with the next number."""
        item = self.markup.add_numbered(kind, self.section, self.place, about)
        caption[:0] = [_span("", [{"t": "Strong", "c": _words(f"{kind.title()} {item.number}.")}]), {"t": "Space"}]
        return [[f"{kind}-{item.number}", [], []], [None, [{"t": "Plain", "c": caption}]]]

    def _html(self, content: Any) -> Iterator[Node]:
        if _BREAK.fullmatch(content[1]):
            yield {"t": "LineBreak"}
        elif not content[1].lstrip().startswith(("<!--", "</")):  # a closing tag has an opening one
            self.note(f"HTML is left out: {content[1].strip()[:_SHOWN]}")


def _with_captions(nodes: list[Node]) -> list[Node]:
    """Move the paragraph "Table: …" above or below each table into its caption."""
    result: list[Node] = []
    for node in nodes:
        before = result[-1] if result else {"t": ""}
        table, paragraph = (node, before) if node["t"] == "Table" else (before, node)
        is_caption = paragraph["t"] == "Para" and plain(paragraph["c"][:1]) in ("Table:", "Caption:")
        if table["t"] == "Table" and is_caption and not table["c"][1][1]:
            content = table["c"]
            result[-1] = {"t": "Table", "c": [content[0], [None, paragraph["c"][2:]], *content[2:]]}
        else:
            result.append(node)
    return result


def _markdown(document: Document) -> Iterator[str]:
    """Yield all Markdown in a document."""
    for section in document.sections:
        for piece in section.pieces:
            yield from (piece.markdown,) if isinstance(piece, Text) else (piece.caption.markdown, piece.table)
    yield from (text.markdown for text in document.sources.values())


def _references(tags: Collection[str] = ()) -> re.Pattern[str]:
    """Return a pattern for references, given the tags of all equations."""
    known = "|".join(map(re.escape, sorted(tags, key=len, reverse=True))) or "(?!)"
    return re.compile(_REFERENCE.replace("TAGS", known), re.IGNORECASE)


def mentioned_figures(text: str) -> set[str]:
    """Return the numbers of the figures that a text refers to."""
    matches = (match for match in _references().finditer(text) if (match["kind"] or "").casefold().startswith("f"))
    return {number for match in matches for number in re.findall(_NUMBER, match["numbers"])}


def plain(nodes: Any) -> str:
    """Return the text of nodes."""
    if isinstance(nodes, list):
        return "".join(map(plain, nodes))
    if not isinstance(nodes, dict):
        return ""
    kind = nodes["t"]
    content: Any = nodes.get("c")
    if kind in ("Str", *_SPACES):
        return str(_SPACES.get(kind, content))
    return str(content[1]) if kind in ("Code", "Math") else plain(content)


def _words(text: str) -> list[Node]:
    names = {" ": "Space", "\n": "SoftBreak"}
    pieces = filter(None, re.split(r"([ \n])", text))
    return [{"t": names[piece]} if piece in names else {"t": "Str", "c": piece} for piece in pieces]


def _emphasised(text: str) -> Node:
    return {"t": "Emph", "c": _words(text)}


def _span(name: str, nodes: list[Node], values: Mapping[str, str] | None = None) -> Node:
    return {"t": "Span", "c": [[name, [], list(map(list, (values or {}).items()))], nodes]}
