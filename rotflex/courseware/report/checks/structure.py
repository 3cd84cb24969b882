"""What is missing in a report, and how long its texts are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from rotflex.courseware.kinds.values import LONGEST_PROSE
from rotflex.courseware.messages import _, plural
from rotflex.courseware.report.checks.faults import Fault
from rotflex.courseware.report.checks.prose import Reading
from rotflex.courseware.report.document import Document, Figure, Table

LEFT_OUT = "left out"  #: the kind of what is not in the report as it was written
PICTURE = "picture"  #: the kind of a picture that is missing
_NUMBER = re.compile(r"[\s$(\[]*[-−+±]?\d(?!\s*/)")  # and not the unit 1/s
_SHOWN = 60  # characters of a picture's name in a message
FEWEST_WORDS = 15  #: of a text; one with fewer says that something was done, and not what
MOST_WORDS = 450  #: of a text; a reader loses the thread of one with more


def faults(document: Document, readings: Sequence[Reading], pages: int | None) -> Iterator[Fault]:
    """What is missing, too short, or too long. ``pages`` is None where it is not known."""
    yield from _cover(document)
    beside = {
        section.number for section in document.sections for one in section.blocks if isinstance(one, Figure | Table)
    }
    for reading in readings:
        yield from _length(reading, few_will_do=reading.where in beside)
    shown = {name for reading in readings for name in reading.pictures}
    for figure in document.figures:
        if not figure.svg and figure.label not in shown:
            yield _not_recorded(figure)
    for table in document.tables:
        yield from _entries(table)
    for reading in readings:
        yield from (_picture(document, name, reading) for name in reading.pictures)
    if not document.references:
        yield Fault(
            "references",
            _("No source is listed."),
            _(
                "A reader cannot see what is yours and what you took over: a manual, a data sheet, the text of this "
                "course."
            ),
            _("List what you used, and cite each where you use it, as in “… is taken from [1]”."),
            document.front,
        )
    if pages is not None and document.page_limit is not None and pages > document.page_limit:
        yield Fault(
            "pages",
            _("The report has {pages} pages; {limit} are allowed.").format(pages=pages, limit=document.page_limit),
            _("Who reads many reports stops at the limit."),
            _("Shorten the texts; what the reader can see in a figure need not be said."),
            document.front,
        )
    for told, place in document.told:
        yield Fault(
            LEFT_OUT,
            told,
            _("It is not in your report as you wrote it."),
            _("Put it right in the cell, and make the report again."),
            place,
        )


def _cover(document: Document) -> Iterator[Fault]:
    wanted = (
        (
            document.title,
            ("title", _("Title")),
            _("The cover has no title."),
            _("A reader cannot tell what it is about."),
        ),
        (
            document.course,
            ("course", _("Course")),
            _("The cover does not name the course."),
            _("Reports of several courses lie together."),
        ),
        (
            "".join(document.authors),
            ("author", _("Authors")),
            _("The cover names no author."),
            _("Nobody can tell whose work it is."),
        ),
        (
            document.date,
            ("date", _("Date")),
            _("The cover has no date."),
            _("A reader cannot tell which of two versions is newer."),
        ),
    )
    for there, (kind, line), what, why in wanted:
        if not there.strip():
            advice = _("Write it into the cell of authors, captions and sources, in a line “* **{line}:** …”.")
            yield Fault(kind, what, why, advice.format(line=line), document.front)


def _length(reading: Reading, few_will_do: bool) -> Iterator[Fault]:
    """Too few words, but where figures and tables stand beside them; or too many."""
    name = f"{reading.where} {reading.heading}".strip()
    if not (reading.words or reading.formulas or reading.pictures):
        yield Fault(
            "text",
            _("{name}: nothing is written.").format(name=name),
            _("Each section answers a question that the reader has; here it stays open."),
            _("Write the text into its cell, and save the notebook."),
            reading.place,
        )
        return
    count = len(reading.words)
    many = plural(count, "{count} word", "{count} words")
    if count < FEWEST_WORDS and not (reading.formulas or few_will_do):
        yield Fault(
            "short",
            _("{name}: the text has {words}.").format(name=name, words=many),
            _("In so few words nobody can be told what was done, how and why."),
            _("Read what the section asks for, and answer all of it."),
            reading.place,
        )
    if count > MOST_WORDS:
        yield Fault(
            "long",
            _("{name}: the text has {words}.").format(name=name, words=many),
            _("A reader who looks for one thing does not find it in so long a text."),
            _("Say each thing once, and leave out what a figure or the table shows."),
            reading.place,
        )
    elif len(reading.source) > LONGEST_PROSE:
        yield Fault(
            "long",
            _("{name}: the text has more than {most} characters.").format(name=name, most=LONGEST_PROSE),
            _("What comes after them is not read."),
            _("Shorten it."),
            reading.place,
        )


def _not_recorded(figure: Figure) -> Fault:
    return Fault(
        "figure",
        _("Figure {number} ({label}) is not recorded.").format(number=figure.number, label=figure.label),
        _("There is an empty space where the reader looks for your result."),
        _("Run the cell that draws it and the one below it, which records it."),
        figure.place,
    )


def _entries(table: Table) -> Iterator[Fault]:
    """A table with rows that have nothing where the others have their numbers."""
    values = _values_column(table)
    empty = [row for row in table.rows if values is not None and not _entry(row, values)]
    if not empty:
        return
    names = ", ".join(next((entry for entry in row if entry.strip()), "?") for row in empty)
    yield Fault(
        "table",
        _("Table {number}: not filled in: {rows}.").format(number=table.number, rows=names),
        _("A reader cannot tell whether it was forgotten or could not be measured."),
        _("Fill it in, and record the table again; or say in the text why there is none."),
        table.place,
    )


def _values_column(table: Table) -> int | None:
    """Where a table has its numbers: the last column with digits in most rows; else one in which nothing is yet."""
    columns = range(max(map(len, table.rows), default=0))
    filled = {column: [entry for row in table.rows if (entry := _entry(row, column))] for column in columns}
    nothing = [column for column in columns if not filled[column]]
    numbers = [
        column
        for column in columns[1:]
        if 2 * len(filled[column]) >= len(table.rows) and any(map(_NUMBER.match, filled[column]))
    ]
    return numbers[-1] if numbers else nothing[0] if nothing else None


def _entry(row: Sequence[str], column: int) -> str:
    return row[column].strip() if column < len(row) else ""


def _picture(document: Document, name: str, reading: Reading) -> Fault:
    there = any(name in text.pictures for text in document.texts)
    shown = name.removeprefix("attachment:")[:_SHOWN]
    if not there:
        return Fault(
            PICTURE,
            _("{where}: the picture {name} is not there.").format(where=reading.where, name=shown),
            _("The reader sees a gap, or its name."),
            _("Paste it into the cell again, or put the file beside the notebook."),
            reading.place,
            shown,
        )
    return Fault(
        "drawn",
        _("{where}: is the picture {name} drawn by hand, or photographed?").format(where=reading.where, name=shown),
        _("What is drawn by hand is hard to read, and a photograph of a screen is harder."),
        _("If so, draw it with a program. If it is a diagram of yours that is sharp in print, all is well."),
        reading.place,
    )
