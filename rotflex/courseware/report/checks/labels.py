"""What is written at figures and tables: axes, curves, captions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from rotflex.courseware.kinds.axis_labels import plain, unit_places
from rotflex.courseware.messages import _
from rotflex.courseware.report import counting
from rotflex.courseware.report.checks.faults import Fault, named
from rotflex.courseware.report.checks.prose import typed, words
from rotflex.courseware.report.document import Axes, Document, Figure, Prose, Section, Table

FEWEST_WORDS = 4  #: of a caption that says what is to be seen
_BARE = re.compile(
    r"^\W*(?:figure|fig|table|tab|abbildung|abb|bild|tabelle|diagramm|plot|graph)\b\W*[\d.]*\W*", re.IGNORECASE
)
#: What is counted, or compared with its like, has no unit.
_WITHOUT_UNIT = re.compile(
    r"\b(?:number|count|counts|index|samples?|ratio|normali[sz]ed|relative|probability|rank|order|dimensionless"
    r"|anzahl|nummer|zähler|verhältnis|normiert\w*|relativ\w*|wahrscheinlichkeit|dimensionslos\w*)\b"
)
_FEWEST_ROWS = 2  # of a table whose columns can be told
_NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:\s*±\s*\d+(?:\.\d+)?)?")
_UNIT_COLUMN = re.compile(r"\b(?:units?|einheit(?:en)?)\b", re.IGNORECASE)
#: Quantities that are numbers, as their names say; what cannot be told is not told.
_IS_NUMBER = re.compile(
    r"\b(?:damping|zeta|factor|coefficient|coherence|error|gain|poles?|eigenvalues?|dämpfung\w*|faktor|"
    r"koeffizient|kohärenz|fehler|verstärkung|pole?|eigenwerte?)\b|ζ",
    re.IGNORECASE,
)


def faults(document: Document) -> Iterator[Fault]:
    """Axes without label or unit, curves that cannot be told apart, captions that say nothing."""
    for figure in document.figures:
        if figure.svg:
            yield from _axes(figure, document)
            yield from _curves(figure, document)
    for section in document.sections:
        yield from _own_tables(section, document)
    captioned: list[Figure | Table] = [*document.figures, *document.tables]
    for one in captioned:
        yield from _caption(one, document)
    yield from _twice(captioned, document)


def _axes(figure: Figure, document: Document) -> Iterator[Fault]:
    drawn = figure.axes
    if not drawn:
        return
    # Diagrams above each other share the lower one's axis, and those side by side the left one's.
    no_x = all(not one.x_label.strip() for one in drawn)
    side_by_side = len(drawn) > 1 and bool(drawn[0].y_label.strip()) and all(one.x_label.strip() for one in drawn)
    no_y = any(not one.y_label.strip() for one in drawn) and not side_by_side
    axes = [
        *([_("horizontal")] if no_x else []),
        *([_("vertical")] if no_y else []),
    ]
    for axis in axes:
        yield Fault(
            "axis",
            _("{figure}: the {axis} axis has no label.").format(figure=named(figure, document), axis=axis),
            _("A reader cannot tell what is drawn."),
            _("Write quantity and unit at it, where the figure is drawn, as in “time (s)”; then record it again."),
            figure.place,
        )
    labels = dict.fromkeys(label for one in drawn for label in (one.x_label, one.y_label) if label.strip())
    for label in labels:
        if not _has_unit(label):
            yield Fault(
                "unit",
                _("{figure}: there is no unit at the axis “{label}”.").format(
                    figure=named(figure, document), label=label
                ),
                _("The numbers at it can be anything: degrees, radians, milliseconds."),
                _("Put it behind the quantity, as in “time (s)”; (1) or (–) if there is none. Then record it again."),
                figure.place,
            )


def _has_unit(label: str) -> bool:
    """Whether something stands where a unit may, or needs none. What it is, is not looked at."""
    text = plain(label)
    return bool(unit_places(label) or text.endswith(("°", "%")) or _WITHOUT_UNIT.search(text))


def _own_tables(section: Section, document: Document) -> Iterator[Fault]:
    """Columns of numbers in tables of a text, which say nowhere what their unit is."""
    texts = [block for block in section.blocks if isinstance(block, Prose)]
    written = [rows for text in texts for rows in counting.tables(text.text)]
    there = [block for block in section.blocks if isinstance(block, Table) and block.place == block.written]
    for table, rows in zip(there, written, strict=False):
        column = next((head for at, head in enumerate(table.head) if _lacks_unit(table, rows, at)), None)
        if column is not None:
            yield Fault(
                "unit",
                _("{table}: there is no unit in the column “{head}”.").format(
                    table=named(table, document), head=column
                ),
                _("The numbers in it can be anything: degrees, radians, milliseconds."),
                _("Put it behind the quantity, as in “time (s)”; (1) or (–) if there is none."),
                table.place,
            )


def _lacks_unit(table: Table, rows: Sequence[Sequence[str]], at: int) -> bool:
    """Whether a column is of numbers alone, measured ones among them, and none of its places for a unit has one."""
    entries = [row[at].strip(" $*") if at < len(row) else "" for row in rows]
    numbers = [entry for entry in entries if _NUMBER.fullmatch(entry)]
    measured = len(numbers) >= _FEWEST_ROWS and any("." in number for number in numbers)
    if not measured or len(numbers) < len([entry for entry in entries if entry]):
        return False
    said = [typed(table.head[at]), *([typed(row[0]) for row in rows if row] if at else [])]
    beside = any(_UNIT_COLUMN.search(head) for head in table.head)
    return not (beside or any(_has_unit(one) or _IS_NUMBER.search(one) for one in said))


def _curves(figure: Figure, document: Document) -> Iterator[Fault]:
    if any(_cannot_be_told(one) for one in figure.axes):
        yield Fault(
            "curves",
            _("{figure}: it shows several curves, and does not say which is which.").format(
                figure=named(figure, document)
            ),
            _("A reader who was not there cannot tell what was measured from what was computed."),
            _("Give each curve a label where it is drawn, and show the legend; then record it again."),
            figure.place,
        )


def _cannot_be_told(one: Axes) -> bool:
    """Whether two curves or more have no name at all; a line to guide the eye beside named ones is none of them."""
    return len(one.curves) > 1 and not any(name.strip() for name in one.curves)


def _caption(one: Figure | Table, document: Document) -> Iterator[Fault]:
    caption = one.caption.strip()
    if not caption:
        what = _("{one} has no caption.")
    elif not one.own_caption:
        what = _("{one} has no caption of yours: what stands there is the course’s, and says only what it is.")
    elif len(words(_BARE.sub("", _said(caption)))) < FEWEST_WORDS:
        what = _("{one}: the caption “{caption}” says too little.")
    else:
        return
    advice = (
        _("Say what is shown, of which experiment, and what to look at, in a sentence or two.")
        if isinstance(one, Figure)
        else _("Say what the table holds, and of which experiment, in a sentence.")
    )
    if isinstance(one, Table) and not caption and one.place == one.written:  # in a text
        advice += " " + _("Write it above the table, with a blank line between, and begin it with “Table:”.")
    yield Fault(
        "caption",
        what.format(one=named(one, document), caption=caption),
        _("Many look at figures and tables first. A caption has to be understood without the text."),
        advice,
        one.written,
    )


def _said(caption: str) -> str:
    """A caption without its formulas: a symbol is no word."""
    return re.sub(r"\$[^$]*\$", " ", caption)


def _twice(captioned: Sequence[Figure | Table], document: Document) -> Iterator[Fault]:
    seen: dict[str, Figure | Table] = {}
    for one in captioned:
        said = " ".join(typed(_BARE.sub("", one.caption)).casefold().split())
        if not said:
            continue
        if said in seen:
            yield Fault(
                "same caption",
                _("{one} has the same caption as {other}.").format(
                    one=named(one, document), other=named(seen[said], document)
                ),
                _("A reader cannot tell what is different between them."),
                _("Say in each what sets it apart."),
                one.written,
            )
        seen.setdefault(said, one)
