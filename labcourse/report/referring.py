"""How texts refer to what has a number: "Figure 1.2", "Table 1", "(speed)" for the equation of that tag, "[1]".

A notebook shows these words as they stand, and so they are plain words. In a report each becomes a link, with the
number that the thing has there. A recorded figure is called by its question and a table of the course by its own
number, for these are known before the report is made.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from labcourse.report.document import Document, Place
from labcourse.report.dress import words_for

_NUMBER = r"\d+(?:\.\d+)*"
_LIST = rf"{_NUMBER}(?:(?:,\s*|,?\s+(?:and|or|to)\s+|\s*[-–]\s*){_NUMBER})*"
_CITED = re.compile(r"\[(?P<keys>[\w.:-]{1,30}(?:\s*,\s*[\w.:-]{1,30})*)(?P<more>,\s*pp?\.[^\[\]]{1,40})?\]")
#: Behind the number of a figure or a table that is not this report's: "Figure 2 of [1]".
_ANOTHERS = re.compile(r"\s*,?\s+(?:of|in|from|aus|von)\s+\[")

#: Of LaTeX, for which a report has words: it stays as it is typed.
_COMMAND = r"(?P<command>\\(?:\w*cite\w*\*?|\w*ref\*?|label)(?:\s*\[[^\[\]]{0,60}\])*\s*\{[^{}]{0,60}\})"


@dataclass(frozen=True)
class Referred:
    """A stretch of a text.

    Attributes
    ----------
    shown : what a report has there
    anchor : where it links to; "" where it is text alone
    """

    shown: str
    anchor: str = ""


@dataclass
class References:
    """What a report's texts can refer to.

    Attributes
    ----------
    labels : "figure" or "table" → what texts call one by, without the word → its number
    totals : how many there are of each kind
    tags : of equations → their cells and numbers
    sources : the keys of the sources
    """

    labels: dict[str, dict[str, int]] = field(default_factory=lambda: {"figure": {}, "table": {}})
    totals: dict[str, int] = field(default_factory=lambda: {"figure": 0, "table": 0})
    tags: dict[str, list[tuple[Place, int]]] = field(default_factory=dict)
    sources: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        words = {"figure": ["Figures?", r"Figs?\."], "table": ["Tables?"], "equation": ["Equations?", r"Eqs?\."]}
        tags = "|".join(map(re.escape, sorted(self.tags, key=len, reverse=True)))
        self._pattern = re.compile(
            rf"(?<!\w)(?P<figure>(?i:{'|'.join(words['figure'])}))\s+(?P<figures>{_LIST})"
            rf"|(?<!\w)(?P<table>(?i:{'|'.join(words['table'])}))\s+(?P<tables>{_LIST})"
            rf"|\\(?:eq)?ref\{{(?P<ref>[^{{}}\s]{{1,60}})\}}"
            + (rf"|\((?P<tag>{tags})\)" if tags else "")
            + rf"|(?<!\w)(?P<equation>(?i:{'|'.join(words['equation'])}))\s+\((?P<unknown>[^()\s]{{1,60}})\)"
            + rf"|{_CITED.pattern}|{_COMMAND}"
        )

    @classmethod
    def of(cls, document: Document) -> References:
        """What the texts of a document can refer to."""
        labels: dict[str, dict[str, int]] = {"figure": {}, "table": {}}
        figures, tables = list(document.figures), list(document.tables)
        for kind, things in (("figure", figures), ("table", tables)):
            for one in things:
                number = one.label.rpartition(" ")[2] if not one.in_text else ""
                if re.fullmatch(_NUMBER, number):
                    labels[kind].setdefault(number, one.number)
        tags: dict[str, list[tuple[Place, int]]] = {}
        for equation in document.equations:
            if equation.tag:
                tags.setdefault(equation.tag, []).append((equation.place, equation.number))
        totals = {"figure": len(figures), "table": len(tables)}
        return cls(labels, totals, tags, frozenset(one.key for one in document.references))

    def found(self, text: str, place: Place, tell: Callable[[str], None]) -> Iterator[Referred]:
        """A text in stretches, of which some refer to something.

        Parameters
        ----------
        text : words alone
        place : its cell: of equations with one tag, that of the same cell is meant
        tell : is told what there is not
        """
        at = 0
        for match in self._pattern.finditer(text):
            if match.start() > at:
                yield Referred(text[at : match.start()])
            at = match.end()
            yield from self._referred(match, place, tell)
        if at < len(text):
            yield Referred(text[at:])

    def _referred(self, match: re.Match[str], place: Place, tell: Callable[[str], None]) -> Iterator[Referred]:
        groups = match.groupdict()
        if match["figures"] or match["tables"]:
            kind = "figure" if match["figures"] else "table"
            if _ANOTHERS.match(match.string, match.end()):
                yield Referred(match[0])
            else:
                yield from self._numbered(kind, match[kind], match[f"{kind}s"], tell)
        elif tag := groups.get("tag") or match["ref"]:
            yield self._equation(tag, place, tell, match[0])
        elif match["command"]:
            tell(
                f"{match[0]} stays in the report as it is typed. Write [1] for a source, “Figure 2” for a "
                "figure, and the tag of an equation in brackets."
            )
            yield Referred(match[0])
        elif match["unknown"] in self.tags:
            yield Referred(match["equation"] + "\N{NO-BREAK SPACE}")
            yield self._equation(match["unknown"], place, tell, f"({match['unknown']})")
        elif match["unknown"]:
            tell(f"There is no equation ({match['unknown']}) in this report.")
            yield Referred(match[0])
        else:
            yield from self._cited(match, tell)

    def _numbered(self, kind: str, word: str, numbers: str, tell: Callable[[str], None]) -> Iterator[Referred]:
        before = f"{word}\N{NO-BREAK SPACE}"
        for piece in re.split(rf"({_NUMBER})", numbers):
            if not re.fullmatch(_NUMBER, piece):
                before += piece
                continue
            number = self.labels[kind].get(piece)
            if number is None and piece.isdecimal() and 1 <= int(piece) <= self.totals[kind]:
                number = int(piece)
            if number is None:
                tell(f"There is no {words_for(kind)} {piece} in this report.")
                yield Referred(f"{before}{piece}")
            else:
                yield from ([Referred(before)] if before and not before.startswith(word) else [])
                shown = f"{before if before.startswith(word) else ''}{number}"
                yield Referred(shown, f"{kind}-{number}")
            before = ""
        if before:
            yield Referred(before)

    def _equation(self, tag: str, place: Place, tell: Callable[[str], None], written: str) -> Referred:
        meant = self.tags.get(tag, [])
        here = [number for where, number in meant if where == place]
        if not meant:
            tell(f"There is no equation ({tag}) in this report.")
            return Referred(written)
        if len(here) != 1 and len(meant) > 1:
            tell(f"Several equations have the tag {tag}; give each its own.")
        number = here[0] if here else meant[0][1]
        return Referred(f"({number})", f"equation-{number}")

    def _cited(self, match: re.Match[str], tell: Callable[[str], None]) -> Iterator[Referred]:
        keys = re.split(r"\s*,\s*", match["keys"])
        if not any(key in self.sources for key in keys):
            if all(key.isdecimal() for key in keys) and self.sources:
                for key in keys:
                    tell(f"There is no source [{key}] in this report.")
            yield Referred(match[0])
            return
        yield Referred("[")
        for place, key in enumerate(keys):
            if place:
                yield Referred(", ")
            if key not in self.sources:
                tell(f"There is no source [{key}] in this report.")
            yield Referred(key, f"source-{key}" if key in self.sources else "")
        yield Referred(f"{match['more'] or ''}]")
