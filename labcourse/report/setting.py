"""A report as pandoc's blocks, in order, for one of its two formats."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from labcourse.answers.attached_pictures import PICTURE
from labcourse.report import pandoc
from labcourse.report.document import Block, Document, Equation, Figure, Place, Prose, Section, Table
from labcourse.report.dress import Dress
from labcourse.report.pandoc import Node
from labcourse.report.referring import References
from labcourse.report.tree import Counts, Gathered, Text, words

#: Share of a page's width of each column of a results table: what it is, its symbol, its value, its unit.
_WIDTHS = (0.32, 0.14, 0.43, 0.11)
_NOTHING = ["", [], []]  # attributes


@dataclass(frozen=True)
class Part:
    """What sections of one kind have in common, as "I Procedure".

    Attributes
    ----------
    number, title : of the part; both "" where a course's headings have no parts
    sections : each with its number and its heading within the part
    """

    number: str
    title: str
    sections: tuple[tuple[Section, str], ...]


def parts(document: Document) -> list[Part]:
    """The sections by parts: where all of a part's headings begin with the same words and a colon, it is called so."""
    by_number: dict[str, list[Section]] = {}
    for section in document.sections:
        by_number.setdefault(section.number.partition(".")[0], []).append(section)
    found = []
    for number, sections in by_number.items():
        titles = {section.heading.partition(": ")[0] for section in sections}
        if len(titles) == 1 and all(": " in section.heading for section in sections):
            headings = [section.heading.partition(": ")[2] for section in sections]
            shown = [(one, text[:1].upper() + text[1:]) for one, text in zip(sections, headings, strict=True)]
            found.append(Part(number, titles.pop(), tuple(shown)))
        else:
            found.append(Part("", "", tuple((one, one.heading) for one in sections)))
    return found


@dataclass
class Read:
    """The Markdown of a document as pandoc has read it: each text once, for both formats.

    Attributes
    ----------
    blocks : Markdown → blocks
    """

    blocks: Mapping[str, list[Node]]

    @classmethod
    def of(cls, document: Document) -> Read:
        """All texts of a document.

        Raises
        ------
        ReportError
            If pandoc is not there, or cannot read them.
        """
        texts = list(dict.fromkeys(_texts(document)))
        return cls(dict(zip(texts, pandoc.read(texts), strict=True)))

    def line(self, text: str) -> list[Node]:
        """A text of one paragraph, as what stands in a line."""
        found: list[Node] = []
        for block in self.blocks[text]:
            if block["t"] in ("Para", "Plain"):
                found += [*([{"t": "Space"}] if found else []), *block["c"]]
        return found


def _texts(document: Document) -> Iterator[str]:
    for section in document.sections:
        for block in section.blocks:
            if isinstance(block, Prose):
                yield block.text
            elif isinstance(block, Figure | Table):
                yield block.caption
            if isinstance(block, Table) and not block.in_text:
                yield from (entry for row in block.rows for entry in row)
    yield from (one.text for one in document.references)


@dataclass
class Setting:
    """A document on its way into one format.

    Attributes
    ----------
    document, read, dress : what, as pandoc read it, and for which format
    verbatim : formulas that are shown as they are typed
    gathered : what came up
    """

    document: Document
    read: Read
    dress: Dress
    verbatim: frozenset[str] = frozenset()
    gathered: Gathered = field(default_factory=Gathered)

    def __post_init__(self) -> None:
        self._counts = Counts()
        self._references = References.of(self.document)

    def blocks(self) -> list[Node]:
        """All that stands after the cover and the contents."""
        found: list[Node] = []
        for part in parts(self.document):
            if part.number:
                found.append(self._heading(1, f"part-{part.number}", f"{part.number} {part.title}"))
            for section, heading in part.sections:
                found.append(self._heading(2, f"section-{section.number}", f"{section.number} {heading}"))
                found += self._section(section)
        if self.document.references:
            found.append(self._heading(1, "sources", "References"))
            for one in self.document.references:
                found += self.dress.source(one.key, self._text(one.place).inlines(self.read.line(one.text)))
        return found

    def heading(self, text: str) -> str:
        """A heading as it is shown, with the numbers that things have in this report."""
        return "".join(one.shown for one in self._references.found(text, self.document.front, lambda _what: None))

    def _heading(self, level: int, anchor: str, text: str) -> Node:
        return {"t": "Header", "c": [level, [anchor, [], []], words(self.heading(text))]}

    def _section(self, section: Section) -> Iterator[Node]:
        in_text = False
        for block in section.blocks:
            if isinstance(block, Prose):
                in_text = True  # what follows stands in the text
                yield from self._prose(block, section.number)
            elif not in_text:
                yield from self._shown(block)
        if not in_text and not section.blocks:
            yield _emphasised("Nothing is recorded yet.")

    def _prose(self, prose: Prose, section: str) -> Iterator[Node]:
        if not prose.text:
            yield _emphasised("This text is not written yet.")
            return
        sought = frozenset(match["in"] or match["out"] for match in PICTURE.finditer(prose.text))
        text = replace(self._text(prose.place, prose.pictures, sought), section=section)
        yield from text.blocks(self.read.blocks[prose.text])

    def _shown(self, block: Block) -> Iterator[Node]:
        if isinstance(block, Equation):
            text = self._text(block.place)
            yield {"t": "Para", "c": text.inlines([_displayed(block.latex)])}
        elif isinstance(block, Figure):
            number, caption = self._counts.next("figure"), self._caption(block)
            if block.svg:
                yield from self.dress.figure(number, f"figure-{number}.svg", block.svg.encode(), block.alt, caption)
            else:
                yield from self.dress.missing(number, block.alt, caption)
        elif isinstance(block, Table):
            yield from self.dress.table(self._counts.next("table"), self._caption(block), self._table(block))

    def _caption(self, block: Figure | Table) -> list[Node]:
        return self._text(block.written).inlines(self.read.line(block.caption))

    def _table(self, table: Table) -> Node:
        columns = [[{"t": "AlignLeft"}, {"t": "ColWidth", "c": width}] for width in _WIDTHS]
        text = self._text(table.place)
        rows = [[self._entry(text, self.read.line(entry)) for entry in row] for row in table.rows]
        head = [_NOTHING, [_row([words(one) for one in table.head])]]
        body = [_NOTHING, 0, [], [_row(row) for row in rows]]
        return {"t": "Table", "c": [_NOTHING, [None, []], columns, head, [body], [_NOTHING, []]]}

    def _entry(self, text: Text, nodes: list[Node]) -> list[Node]:
        if len(nodes) == 1 and nodes[0]["t"] == "Math":
            return self.dress.entry(nodes[0]["c"][1])
        return text.inlines(nodes)

    def _text(
        self, place: Place, pictures: Mapping[str, bytes] | None = None, sought: frozenset[str] = frozenset()
    ) -> Text:
        return Text(
            self.dress, self._counts, self._references, self.gathered, place, pictures or {}, sought, self.verbatim
        )


def _row(cells: list[list[Node]]) -> list[object]:
    return [_NOTHING, [[_NOTHING, {"t": "AlignDefault"}, 1, 1, [{"t": "Plain", "c": cell}]] for cell in cells]]


def _displayed(latex: str) -> Node:
    return {"t": "Math", "c": [{"t": "DisplayMath"}, latex]}


def _emphasised(text: str) -> Node:
    return {"t": "Para", "c": [{"t": "Emph", "c": words(text)}]}
