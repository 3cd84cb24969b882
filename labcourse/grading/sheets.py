"""Fill in the scoring sheets of a course, as pages to be printed: a file for each student, and one for the class.

``sheets.toml`` in the course's folder has the layout. A sheet has a row for each question of a section, or each item of
a report, and a column for each code. A cell scores the parts of its row that carry its code; it shows the level, the
points, and whether the machine or a person marked them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from labcourse import files, program
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question, ReportItem
from labcourse.errors import GradingError
from labcourse.grading.accounts import points
from labcourse.grading.course import SHEETS_FILE, Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes import Evidence, Judged, Standing, evidence, read_as, standings
from labcourse.grading.reports.templating import templates
from labcourse.grading.settings import LevelSettings, refuse
from labcourse.problems import Where
from labcourse.student_id import caseless

SHEETS_PAGE = "sheets.html"  #: in the folder of results for the class, and in each student's folder
UNMARKED = "…"  #: what a person has yet to decide, or what was not marked
MACHINE, PERSON = "m", "p"  #: who marked


# --- layout -----------------------------------------------------------------------------------------------------------


class _Sheet(BaseModel):
    """A sheet in ``sheets.toml``: its rows are those of a section or of a report."""

    model_config = ConfigDict(extra="forbid", strict=True)

    title: str
    codes: list[str]
    section: str | None = None
    report: str | None = None
    format: list[str] = []
    also: dict[str, list[str]] = {}


@dataclass(frozen=True)
class SheetRow:
    """A row of a sheet.

    Attributes
    ----------
    group : heading of the rows that it belongs to; "" if there is none
    number, heading : of the question or the item
    cells : code → the parts that are scored there
    """

    group: str
    number: str
    heading: str
    cells: Mapping[str, Sequence[Where]]


@dataclass(frozen=True)
class Layout:
    """A sheet that is not filled in.

    Attributes
    ----------
    title, about : for people; what its rows are
    codes, format : the codes of the columns: of content, and of format
    rows : in order
    """

    title: str
    about: str
    codes: list[str]
    format: list[str]
    rows: list[SheetRow]

    @property
    def columns(self) -> list[str]:
        """All codes, in order."""
        return self.codes + self.format

    @property
    def parts(self) -> list[Where]:
        """All that is scored on the sheet."""
        return [where for row in self.rows for parts in row.cells.values() for where in parts]


def read_layouts(folder: Path, catalogue: Catalogue) -> list[Layout]:
    """Read the layouts of the course in a folder.

    Raises
    ------
    GradingError
        If it has none, or they cannot be used; the message lists each fault.
    """
    file = folder / SHEETS_FILE
    try:
        tables = read_as(dict[str, _Sheet], file)
    except FileNotFoundError:
        what = f"there is no {file}. (docs/outcomes.md says what it holds.)"
        raise GradingError(f"This course has no scoring sheets: {what}") from None
    refuse(file, (fault for name, sheet in tables.items() for fault in _faults(name, sheet, catalogue.whole)))
    all_layouts = [_layout(sheet, catalogue) for sheet in tables.values()]
    layouts = [layout for layout in all_layouts if layout.rows]  # a sheet of an optional notebook may have none
    twice = [where for where, count in Counter(where for one in layouts for where in one.parts).items() if count > 1]
    refuse(file, (f"{question}, {part}: it is scored in two places." for question, part in twice))
    return layouts


def _faults(name: str, sheet: _Sheet, catalogue: Catalogue) -> Iterator[str]:
    """Yield a fault for each name in the layout of a sheet that the course does not have.

    There is also a fault if it names both a section and a report, or neither.
    """
    if (sheet.section is None) == (sheet.report is None):
        yield f"{name}: its rows are those of a section or of a report; name one of them."
    named = {
        "section": ([sheet.section or ""], ["", *(question.section for question in catalogue.questions.values())]),
        "report": ([sheet.report or ""], ["", *catalogue.reports]),
        "codes": (sheet.codes, catalogue.outcomes),
        "format": (sheet.format, catalogue.outcomes),
        "also": (sheet.also, [item.number for item in catalogue.items(sheet.report or "")]),
        "also, questions": ([number for those in sheet.also.values() for number in those], catalogue.marked),
    }
    for entry, (names, there) in named.items():
        known = ", ".join(filter(None, dict.fromkeys(there))) or "none"
        yield from (f"{name}.{entry}: there is no {one!r}; there are {known}." for one in names if one not in there)


def _layout(sheet: _Sheet, catalogue: Catalogue) -> Layout:
    """Return the layout of a sheet of the file, with rows for the questions or items that the catalogue has."""
    codes = sheet.codes + sheet.format
    if sheet.section is not None:
        about = f"The rows are the questions of Section {sheet.section}."
        rows = [
            SheetRow("", question.number, question.title, _by_code(_parts(question), codes))
            for question in catalogue.questions.values()
            if question.section == sheet.section
        ]
    else:
        about = f"The rows are the items of the {sheet.report}."
        items = catalogue.items(sheet.report or "")
        rows = [_row(item, sheet.also.get(item.number, ()), codes, catalogue) for item in items]
    return Layout(sheet.title, about, sheet.codes, sheet.format, rows)


def _row(item: ReportItem, also: Iterable[str], codes: Collection[str], catalogue: Catalogue) -> SheetRow:
    """Return the row of a report's item, with the parts that are scored in each column.

    Place in it the item's own text, the answers that it shows, and the part by which the report is judged in it, each
    only if its code is one of the item's; and all scored parts of the questions in ``also``, whatever the item's codes.
    Keep only the columns in ``codes``. Split the item's heading at ": " into group and heading.
    """
    parts: dict[Where, str] = {}
    if item.part:
        parts[item.report, item.part] = catalogue.reports[item.report].part(item.part).outcome
    for number, name in item.shows:
        parts |= {where: code for where, code in _parts(catalogue.marked[number]).items() if name in ("", where[1])}
    for number, report in catalogue.report_judged.items():
        if report == item.report and item.judged:
            parts[number, item.judged] = catalogue.marked[number].part(item.judged).outcome
    parts = {where: code for where, code in parts.items() if code in item.outcomes}
    for number in [one for one in also if one in catalogue.marked]:
        parts |= _parts(catalogue.marked[number])
    before, colon, after = item.heading.partition(": ")
    prefix, point, _number = item.number.partition(".")
    group = f"{prefix}. {before}" if colon else prefix if point else ""
    heading = after if colon else before
    return SheetRow(group, item.number, heading[:1].upper() + heading[1:], _by_code(parts, codes))


def _parts(question: Question) -> dict[Where, str]:
    """Return the parts of a question that are worth points, with their codes."""
    return {(question.number, part.name): part.outcome for part in question.parts if part.points}


def _by_code(parts: Mapping[Where, str], codes: Iterable[str]) -> dict[str, list[Where]]:
    """Return code → the parts that carry it, for those of the codes that a part carries."""
    by_code = {code: [where for where, own in parts.items() if own == code] for code in codes}
    return {code: carriers for code, carriers in by_code.items() if carriers}


def on_no_sheet(layouts: Iterable[Layout], catalogue: Catalogue) -> Iterator[tuple[str, Part]]:
    """Yield the parts that are worth points and are on no sheet, each after the number of its question."""
    placed = {where for layout in layouts for where in layout.parts}
    for number, question in catalogue.marked.items():
        for part in question.parts:
            if part.points and (number, part.name) not in placed:
                yield number, part


# --- a student's sheet ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Scored:
    """What the parts in a cell come to.

    Attributes
    ----------
    by_whom : :data:`MACHINE`, :data:`PERSON` and :data:`UNMARKED` → the sums of their parts, as far as there are any
    all : the sums of all parts
    level : of the decided points; None if nothing is decided
    """

    by_whom: dict[str, Evidence]
    all: Evidence
    level: int | None

    @property
    def level_text(self) -> str:
        """The level as "3", as "3 …" if some parts are not decided, or as "…" if none is."""
        return " ".join([*([] if self.level is None else [str(self.level)]), *([UNMARKED] if self.all.waiting else [])])

    @property
    def points_texts(self) -> list[str]:
        """Points earned of points possible, as "2/2 m" (machine), "0.5/1 p" (person) and "…/1" (not decided)."""
        waiting = [f"{UNMARKED}/{points(self.by_whom[UNMARKED].possible)}"] if UNMARKED in self.by_whom else []
        marked = ((who, sums) for who, sums in self.by_whom.items() if who != UNMARKED)
        return [f"{points(sums.earned)}/{points(sums.possible)} {who}" for who, sums in marked] + waiting

    @property
    def by_a_person(self) -> bool:
        """Whether a person marked some of it."""
        return PERSON in self.by_whom


def score(parts: Iterable[Judged], levels: LevelSettings) -> Scored:
    """Sum up the parts in a cell."""
    groups: dict[str, list[Judged]] = {MACHINE: [], PERSON: [], UNMARKED: []}
    for part in parts:
        groups[(PERSON if part.by_a_person else MACHINE) if part.decided else UNMARKED].append(part)
    by_whom = {who: evidence(those) for who, those in groups.items() if those}
    everything = total_of(by_whom.values())
    return Scored(by_whom, everything, None if everything.share is None else levels.level_of(everything.share))


def total_of(sums: Iterable[Evidence]) -> Evidence:
    """Add up what several groups of parts come to."""
    sums = list(sums)
    return Evidence(*(sum(numbers) for numbers in zip(*sums, strict=True))) if sums else evidence(())


@dataclass(frozen=True)
class Sheet:
    """A student's scoring sheet: of each row, and of the totals, code → what is scored there."""

    layout: Layout
    standing: Standing
    rows: list[tuple[SheetRow, dict[str, Scored]]]
    totals: dict[str, Scored]

    @property
    def total(self) -> str:
        """All points of the sheet in words."""
        earned, decided, possible, _waiting = total_of(scored.all for scored in self.totals.values())
        if decided == possible:
            return f"{points(earned)} of {points(possible)} points"
        if not decided:
            return f"nothing decided yet, of {points(possible)} points"
        rest = f"{points(possible - decided)} of {points(possible)} wait"
        return f"{points(earned)} of {points(decided)} points; {rest}"


def fill(layout: Layout, standing: Standing, levels: LevelSettings) -> Sheet:
    """Fill in a sheet with a student's parts. Cells without any are left out.

    Parameters
    ----------
    layout : of the sheet
    standing : the student, and the parts that carry codes: without those that were not asked for, are dropped or
        excused, or are neither due nor handed in
    levels : of shares of points
    """
    judged = {part.mark.where: part for part in standing.parts}

    def scored(cells: Mapping[str, Iterable[Where]]) -> dict[str, Scored]:
        scored_parts = {code: [judged[where] for where in places if where in judged] for code, places in cells.items()}
        return {code: score(parts, levels) for code, parts in scored_parts.items() if parts}

    columns = {code: [where for row in layout.rows for where in row.cells.get(code, ())] for code in layout.columns}
    return Sheet(layout, standing, [(row, scored(row.cells)) for row in layout.rows], scored(columns))


# --- files ------------------------------------------------------------------------------------------------------------


def write(out: Path, course: Course, book: Gradebook, students: Sequence[str] = ()) -> tuple[int, list[str]]:
    """Write the sheets of a class in place of earlier ones.

    Parameters
    ----------
    out : folder; made if needed
    course, book : the course with its sheets, and the gradebook with the marks
    students : IDs of the students who get a file and stand in the file of the class; all students if it is empty

    Returns
    -------
    int
        Number of students with sheets.
    list[str]
        Notes: which parts are on no sheet, what the settings drop, and which students have no marks.

    Raises
    ------
    GradingError
        If the course has no sheets, or a student is not known.
    OSError
        If something cannot be written.
    """
    settings, layouts = course.settings, read_layouts(course.folder, course.catalogue)
    everybody = {caseless(one.about.student): one for one in standings(book, course)}
    known = {caseless(about.student): about.student for about in book.students()}
    for student in students:
        if caseless(student) not in known:
            where = f"({program.name()} report lists them in grades.csv.)"
            raise GradingError(f"There is no student {student!r} in this gradebook. {where}")
    wanted = dict.fromkeys(map(caseless, students)) or known
    marked = [everybody[one] for one in wanted if one in everybody]
    sheets = {
        standing.about.student: [fill(layout, standing, settings.levels) for layout in layouts] for standing in marked
    }
    pages = {out / student / SHEETS_PAGE: own for student, own in sheets.items()}
    pages[out / SHEETS_PAGE] = [sheet for own in sheets.values() for sheet in own]
    for path, those in pages.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write(path, as_page(those, course))
    notes = {
        "On no sheet, as no row and code has it": [
            f"{number} {part.name}" for number, part in on_no_sheet(layouts, course.catalogue)
        ],
        "Dropped by course.toml, and on no sheet": settings.marks.drop,
        "Without marks, and so without sheets": [known[one] for one in wanted if one not in everybody],
    }
    return len(marked), [f"{what}: {', '.join(names)}." for what, names in notes.items() if names]


def as_page(sheets: Sequence[Sheet], course: Course) -> str:
    """Return sheets as an HTML page; on paper, each begins on a page of its own."""
    signs = {"machine": MACHINE, "person": PERSON, "unmarked": UNMARKED}
    return templates("templates").get_template("sheets.html").render(sheets=sheets, course=course, **signs) + "\n"
