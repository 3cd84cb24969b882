"""A student's text as pandoc read it, made safe and dressed: only what is known is kept, numbered, and referred to.

A report is opened by others. So nothing of a text gets into it but words, formulas, tables, lists, code, links to web
addresses, and the student's own pictures: no attribute of anything, no HTML, no other file. What is left out is told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from labcourse.report.counting import CAPTION, untagged
from labcourse.report.document import Place
from labcourse.report.dress import Dress, spaced
from labcourse.report.pandoc import Node
from labcourse.report.referring import References

_NOTHING: list[Any] = ["", [], []]  # attributes
_WEB = re.compile(r"(?:https?://|mailto:)", re.IGNORECASE)
_BREAK = re.compile(r"<br\s*/?>", re.IGNORECASE)
_LINES = re.compile(r"\\[hc]line\b|\\begin\s*\{array\}\s*\{[^{}]*\|")
_REFERENCE = re.compile(r"\s*\\(?:eq)?ref\s*\{[^{}]*\}\s*")
_HEADING = 3  # level of a heading within a section
_EMPHASES = ("Emph", "Strong", "Strikeout", "Superscript", "Subscript")
_SPACES = {"Space": " ", "SoftBreak": "\n"}
_SHOWN = 60  # characters of something in a message


@dataclass
class Counts:
    """The last number of each kind, over all texts of a report."""

    equation: int = 0
    figure: int = 0
    table: int = 0
    picture: int = 0  # in a line: these are not numbered for readers

    def next(self, kind: str) -> int:
        """One more of a kind."""
        setattr(self, kind, getattr(self, kind) + 1)
        return int(getattr(self, kind))


@dataclass
class Gathered:
    """What comes up while the texts of a report are dressed.

    Attributes
    ----------
    told : what is left out or missing, and the cell; each once
    formulas : LaTeX as pandoc gets it → as it is written, and its cell
    """

    told: dict[tuple[str, Place], None] = field(default_factory=dict)
    formulas: dict[str, tuple[str, Place]] = field(default_factory=dict)


@dataclass
class Text:
    """A text on its way into a report.

    Attributes
    ----------
    dress : of the format
    counts : shared by all texts
    references : what can be referred to
    gathered : shared by all texts
    place : the text's cell
    pictures : name → PNG
    sought : names of pictures of which it is told already where they are missing
    verbatim : formulas that are shown as they are typed, for they cannot be set
    section : number of its section; "" for what stands in none, as a caption
    """

    dress: Dress
    counts: Counts
    references: References
    gathered: Gathered
    place: Place
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    sought: frozenset[str] = frozenset()
    verbatim: frozenset[str] = frozenset()
    section: str = ""

    def tell(self, what: str) -> None:
        """Tell something of this text."""
        if self.section:
            what = f"Section {self.section}: {what}"
        self.gathered.told[what, self.place] = None

    # --- blocks ----------------------------------------------------------------------------------------------------

    def blocks(self, nodes: list[Node]) -> list[Node]:
        """Blocks, as they may stand in a report."""
        captions = _captions(nodes)
        taken = {at for at, _inlines in captions.values()}
        found: list[Node] = []
        for at, node in enumerate(nodes):
            if node["t"] == "Table":
                number = self.counts.next("table")
                _at, caption = captions.get(at, (0, []))
                found += self.dress.table(number, self.inlines(caption), self._table(node["c"]))
            elif at not in taken:
                found += self._block(node["t"], node.get("c"))
        return found

    def _block(self, kind: str, content: Any) -> list[Node]:
        if kind in ("Para", "Plain"):
            return self._paragraph(kind, content)
        if kind == "Div":
            return self.blocks(content[1])
        if kind == "RawBlock":
            return self._html(content[1])
        made: dict[str, Callable[[], Any]] = {
            "Header": lambda: [_HEADING, _NOTHING, self.inlines(content[2])],
            "CodeBlock": lambda: [_NOTHING, content[1]],
            "BlockQuote": lambda: self.blocks(content),
            "BulletList": lambda: [self.blocks(item) for item in content],
            "OrderedList": lambda: [content[0], [self.blocks(item) for item in content[1]]],
        }
        if kind in made:
            return [{"t": kind, "c": made[kind]()}]
        return [{"t": kind}] if kind == "HorizontalRule" else self._unknown(kind)

    def _paragraph(self, kind: str, content: Any) -> list[Node]:
        if kind == "Para" and (image := _alone(content)):
            return self._picture_alone(image)
        inside = self.inlines(content)
        return [{"t": kind, "c": inside}] if inside else []

    def _table(self, content: Any) -> Node:
        _attributes, _caption, columns, head, bodies, foot = content
        widths = [[alignment, {"t": "ColWidthDefault"}] for alignment, _width in columns]
        bodies = [[_NOTHING, heads, self._rows(above), self._rows(rows)] for _attr, heads, above, rows in bodies]
        head, foot = ([_NOTHING, self._rows(part[1])] for part in (head, foot))
        return {"t": "Table", "c": [_NOTHING, [None, []], widths, head, bodies, foot]}

    def _rows(self, rows: Any) -> list[Any]:
        return [
            [_NOTHING, [[_NOTHING, cell[1], cell[2], cell[3], self.blocks(cell[4])] for cell in cells]]
            for _attributes, cells in rows
        ]

    def _picture_alone(self, content: Any) -> list[Node]:
        _attributes, alt, (name, _title) = content
        if name not in self.pictures:
            self._no_picture(name)
            return []
        number = self.counts.next("figure")
        return self.dress.figure(number, f"picture-{number}.png", self.pictures[name], _words(alt), self.inlines(alt))

    # --- inlines -----------------------------------------------------------------------------------------------------

    def inlines(self, nodes: list[Node]) -> list[Node]:
        """What stands in lines, as it may stand in a report."""
        found: list[Node] = []
        run = ""
        for node in [*nodes, {"t": "end"}]:
            if node["t"] == "Str" or node["t"] in _SPACES:
                run += node["c"] if node["t"] == "Str" else _SPACES[node["t"]]
                continue
            if run:
                found += self._referring(run)
                run = ""
            if node["t"] != "end":
                found += self._inline(node["t"], node.get("c"))
        return found

    def _inline(self, kind: str, content: Any) -> list[Node]:
        made: dict[str, Callable[[], Any]] = {
            **dict.fromkeys(_EMPHASES, lambda: self.inlines(content)),
            "Code": lambda: [_NOTHING, content[1]],
            "Note": lambda: self.blocks(content),
        }
        if kind in made:
            return [{"t": kind, "c": made[kind]()}]
        others: dict[str, Callable[[], list[Node]]] = {
            "Math": lambda: self._formula(content[0]["t"] == "DisplayMath", content[1]),
            "LineBreak": lambda: [{"t": kind}],
            "Link": lambda: self._link(content),
            "Image": lambda: self._picture(content),
            **dict.fromkeys(("Span", "Quoted", "Cite"), lambda: self.inlines(content[1])),
            "RawInline": lambda: self._html(content[1]),
        }
        return others.get(kind, lambda: self._unknown(kind))()

    def _unknown(self, kind: str) -> list[Node]:
        self.tell(f"Something is left out: {kind}.")
        return []

    def _referring(self, run: str) -> list[Node]:
        found: list[Node] = []
        for one in self.references.found(run, self.place, self.tell):
            inside = words(one.shown)
            found += self.dress.link(one.anchor, inside) if one.anchor else inside
        return found

    def _formula(self, on_its_own: bool, latex: str) -> list[Node]:
        if _REFERENCE.fullmatch(latex):
            return self._referring(latex.strip())
        if _LINES.search(latex):
            self.tell("Lines between rows and columns of a formula (\\hline, |) are not drawn; a table has such lines.")
        plain, _tag = untagged(latex)
        number = self.counts.next("equation") if on_its_own else 0
        if plain in self.verbatim:
            return [{"t": "Code", "c": [_NOTHING, plain]}, *(words(f" ({number})") if number else [])]
        for as_given in (plain, spaced(plain)):
            self.gathered.formulas.setdefault(as_given, (plain, self.place))
        return self.dress.equation(number, plain) if on_its_own else self.dress.math(plain)

    def _link(self, content: Any) -> list[Node]:
        _attributes, inside, (target, _title) = content
        shown = self.inlines(inside)
        if _WEB.match(target):
            return [{"t": "Link", "c": [_NOTHING, shown, [target, ""]]}]
        self.tell(f"The link to {target[:_SHOWN]!r} is left out: only web addresses stay.")
        return shown

    def _picture(self, content: Any) -> list[Node]:
        _attributes, alt, (name, _title) = content
        if name not in self.pictures:
            self._no_picture(name)
            return []
        file = f"in-line-{self.counts.next('picture')}.png"
        return self.dress.picture(file, self.pictures[name], _words(alt))

    def _no_picture(self, name: str) -> None:
        if name not in self.sought:
            self.tell(f"The picture {name[:_SHOWN]!r} is left out: paste it into the cell.")

    def _html(self, markup: str) -> list[Node]:
        if _BREAK.fullmatch(markup.strip()):
            return [{"t": "LineBreak"}]
        if not markup.lstrip().startswith(("<!--", "</")):  # what was opened is told
            self.tell(f"HTML is left out: {markup.strip()[:_SHOWN]}")
        return []


def words(text: str) -> list[Node]:
    """Text as nodes."""
    found: list[Node] = []
    for piece in re.split(r"([ \n])", text):
        if piece in (" ", "\n"):
            found.append({"t": "Space" if piece == " " else "SoftBreak"})
        elif piece:
            found.append({"t": "Str", "c": piece})
    return found


def _words(nodes: list[Node]) -> str:
    """The words of nodes, without the rest."""
    found: list[str] = []
    for node in nodes:
        content: Any = node.get("c")
        if node["t"] == "Str":
            found.append(content)
        elif node["t"] in (*_SPACES, "LineBreak"):
            found.append(" ")
        elif node["t"] in _EMPHASES:
            found.append(_words(content))
        elif node["t"] in ("Code", "Math"):
            found.append(content[1])
    return "".join(found)


def _alone(nodes: list[Node]) -> Any:
    """The picture that a paragraph consists of; None where there is more or none."""
    rest = [node for node in nodes if node["t"] not in _SPACES]
    return rest[0]["c"] if len(rest) == 1 and rest[0]["t"] == "Image" else None


def _captions(nodes: list[Node]) -> dict[int, tuple[int, list[Node]]]:
    """Place of a table → place of the paragraph with its caption, just above or just below it, and the caption."""
    found: dict[int, tuple[int, list[Node]]] = {}
    taken: set[int] = set()
    for at, node in enumerate(nodes):
        if node["t"] != "Table":
            continue
        for beside in (at - 1, at + 1):
            if 0 <= beside < len(nodes) and beside not in taken and (caption := _caption(nodes[beside])):
                found[at] = (beside, caption)
                taken.add(beside)
                break
    return found


def _caption(node: Node) -> list[Node]:
    """The caption that a paragraph is, without the word at its beginning; nothing where it is none."""
    if node["t"] != "Para" or not node["c"] or not CAPTION.fullmatch(_words(node["c"])):
        return []
    first, *rest = node["c"]
    while rest and rest[0]["t"] in _SPACES:
        rest = rest[1:]
    return rest if first["t"] in ("Str", "Strong") and _words([first]).endswith(":") else []
