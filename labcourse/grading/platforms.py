"""Put marks into a file that a learning platform exported. Only one cell of each student changes, and no other byte.

A platform is an entry of :data:`PLATFORMS`: its column names, and three rules: by which columns a student is matched,
which columns take points, and which cells are written. Headings are those of the platform's English:

===========  =========================================================================================================
Canvas       ``Student,ID,SIS User ID,SIS Login ID,Section,Lab 3 (1234),…``; a row "Points Possible"
Moodle       the gradebook: ``First name,Last name,ID number,…,Email address,Assignment: Lab 3 (Real),…``, and an
             assignment's grading worksheet: ``Identifier,Full name,Email address,Status,Grade,Maximum Grade,…``
Brightspace  ``OrgDefinedId,Username,…,Lab 3 Points Grade <Numeric MaxPoints:100 …>,End-of-Line Indicator``
Blackboard   ``Last Name,First Name,Username,Student ID,Last Access,Availability,Lab 3 [Total Pts: 100 Score] |123456``
===========  =========================================================================================================
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import NamedTuple

from labcourse import program
from labcourse.errors import GradingError
from labcourse.grading.accounts import Account, AssignmentGrade, account_of, half_up, in_full
from labcourse.grading.assignments import Handed, State
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.gradebook.roster import NO_STUDENTS, PARTICIPANT, by_key, contradict
from labcourse.grading.intake.platforms import BLACKBOARD, BRIGHTSPACE, CANVAS, MOODLE
from labcourse.grading.marks import Status
from labcourse.grading.reports.result import account_in, nothing_given
from labcourse.grading.settings import Assignment
from labcourse.messages import listed
from labcourse.student_id import caseless

WORKSHEET = "Moodle's grading worksheet"  #: of one assignment, beside the export of Moodle's gradebook
_SHOWN, _NAMED = 12, 6  # headings, and parts that wait, in a message
_EXCUSED = "excused"
#: States of work with which a person has to do something.
WAITING = (State.NOT_GRADED, State.HANDED_IN, State.WAITS)
_NUMBER = re.compile(r"-?\d+(?:\.\d+|,(?!\d{3}$)\d+)?")  # "1,000" may be a thousand, and is no number here


@dataclass(frozen=True)
class Platform:
    """What a platform's file looks like.

    Attributes
    ----------
    name : of the platform
    known_by : headings by which its file is recognised, separated by commas; several sets if it has several forms
    keys : headings of the columns by which a student is matched
    names : headings of the columns with the parts of a student's name, in order
    points : pattern of the heading of a column of points. Its groups are ``most``, what the column is out of, and other
        names by which the column may be called
    example : what a column of points looks like, for messages
    own_key : the one of ``keys`` with the platform's own numbers, which may by chance be another student's ID; ""
        without such numbers
    most_column : heading of the column that says what a column of points is out of; "" if there is none
    locked : heading of a column that says "No" where the platform takes no mark; "" if there is none
    empty : text of a cell without a mark; a blank cell has none either
    closed : text of a cell that stays as it is, in small letters → why
    excused : text that the platform takes in the cell of an excused student; "" if it takes none
    """

    name: str
    known_by: tuple[str, ...]
    keys: tuple[str, ...]
    names: tuple[str, ...]
    points: str
    example: str
    own_key: str = ""
    most_column: str = ""
    locked: str = ""
    empty: str = "-"
    closed: Mapping[str, str] = field(default_factory=dict)
    excused: str = ""


#: A file belongs to the first platform with headings that fit. Brightspace's file may have all of Blackboard's.
PLATFORMS = (
    Platform(
        CANVAS,
        ("Student,ID,Section", "LastName,FirstName,ID,Section"),
        ("SIS User ID", "SIS Login ID", "Integration ID", "ID"),
        ("FirstName", "LastName", "Student"),
        # Canvas ignores each heading that has the name of a sum that it computes.
        r"(?!.*(?:Current|Final|Override) (?:Score|Points|Grade|Status))(?P<title>.*\S)\s*\((?P<number>\d+)\)",
        "'Lab 3 (1234)', a title and Canvas's number; it is none that Canvas computes or has as read only",
        own_key="ID",
        closed={"n/a": "Canvas has not assigned it to them (N/A).", "ex": "they are excused on Canvas (EX)."},
        excused="EX",
    ),
    Platform(
        WORKSHEET,
        ("Identifier,Grade",),
        ("ID number", "Username", "Email address", "Identifier"),
        ("Full name",),
        "Grade",
        "'Grade', with the same 'Maximum Grade' in each row; an assignment that is graded by a scale has none",
        own_key="Identifier",
        most_column="Maximum Grade",
        locked="Grade can be changed",
    ),
    Platform(
        MOODLE,
        ("First name,Last name", "First name,Surname"),
        ("ID number", "Student ID", "Username", "Email address"),
        ("First name", "Last name", "Surname"),
        r"(?!(?:Course|(?!Assignment:|Quiz:).*\S) total \()(?P<title>(?:[^:]+: )?(?P<short>.*\S)) \(Real\)",
        "'Assignment: Lab 3 (Real)', and it is no total; export the gradebook with grade display type 'Real'",
    ),
    Platform(
        BRIGHTSPACE,
        ("OrgDefinedId,End-of-Line Indicator", "Username,End-of-Line Indicator"),
        ("OrgDefinedId", "Username", "Email"),
        ("First Name", "Last Name"),
        r"(?P<title>.*\S) Points Grade(?: <(?=Numeric|MaxPoints)(?:.*?\bMaxPoints:(?P<most>[\d.,]+))?.*>)?",
        "'Lab 3 Points Grade <Numeric MaxPoints:100>', of no other kind",
    ),
    Platform(
        BLACKBOARD,
        ("Last Name,First Name,Username",),
        ("Username", "Student ID"),
        ("First Name", "Last Name"),
        r"(?P<title>.*\S) \[Total Pts: (?P<most>[\d.,]+)(?: (?:Score)?)?\] ?\|(?P<number>\w+)",
        "'Lab 3 [Total Pts: 100 Score] |123456', with Blackboard's number; it is of no other kind, nor 'up to' a sum",
        empty="Needs Grading",
        closed={"in progress": "they are still at work on it on Blackboard (In Progress)."},
    ),
)


# --- a file, byte by byte ---------------------------------------------------------------------------------------------

SEPARATORS = (",", ";", "\t")  #: that platforms write
#: Separator → pattern of a cell and what ends it. As in every CSV, quotes count only where a cell begins with one.
_CELLS = {
    sign: re.compile(rf'(?:"(?P<inside>(?:[^"]|"")*+)"|(?!"))(?P<rest>[^{sign}\r\n]*)(?P<end>{sign}|\r\n|\r|\n|\Z)')
    for sign in SEPARATORS
}


class CsvCell(NamedTuple):
    """A cell: where it begins and ends in the file's text, quotes included; its own text; and whether it has quotes."""

    start: int
    end: int
    text: str
    quoted: bool


@dataclass(frozen=True)
class CsvTable:
    """The cells of a file, by rows; an empty line has none. ``text`` is the whole file, byte-order mark included."""

    text: str
    codec: str
    separator: str
    rows: list[list[CsvCell]]

    def cell(self, row: int, place: int) -> str:
        """Return the text of a cell without white space around it; "" if its row is shorter."""
        cells = self.rows[row]
        return cells[place].text.strip() if place < len(cells) else ""

    def line(self, row: int) -> int:
        """Return the number of the line in which a row begins."""
        return _line(self.text, self.rows[row][0].start if self.rows[row] else 0)

    def changed(self, new: Mapping[tuple[int, int], str]) -> bytes:
        """Return the file's bytes with other text in some cells; ``new`` is (row, place in it), both from 0 → text."""
        pieces, done = [], 0
        for (row, place), text in sorted(new.items()):
            cell = self.rows[row][place]
            quoted = cell.quoted or any(sign in text for sign in (self.separator, '"', "\r", "\n"))
            pieces += [self.text[done : cell.start], '"' + text.replace('"', '""') + '"' if quoted else text]
            done = cell.end
        return "".join([*pieces, self.text[done:]]).encode(self.codec, "surrogateescape")


def table(data: bytes, separator: str) -> CsvTable:
    """Read the cells of a file.

    It may be UTF-8, or UTF-16 as Blackboard writes it, with or without a byte-order mark. Bytes that are not UTF-8 stay
    as they are.

    Raises
    ------
    GradingError
        If it is damaged: it is not UTF-16 as it says, or a quote is never closed.
    """
    codec = "utf-8"
    for mark, other, zero in ((codecs.BOM_UTF16_LE, "utf-16-le", 1), (codecs.BOM_UTF16_BE, "utf-16-be", 0)):
        if data.startswith(mark) or data[zero : zero + 1] == b"\0":
            codec = other
    try:
        text = data.decode(codec, "surrogateescape" if codec == "utf-8" else "strict")
    except UnicodeDecodeError as error:
        raise GradingError(f"It is damaged: its byte {error.start} is not {codec.upper()}. Export it again.") from None
    return CsvTable(text, codec, separator, list(_rows(text, separator)))


def _rows(text: str, separator: str) -> Iterator[list[CsvCell]]:
    """Yield the cells of each row of a text; none for an empty line. Raises GradingError if a quote is never closed."""
    place, row = int(text.startswith("\ufeff")), list[CsvCell]()
    while place < len(text) or row:
        match = _CELLS[separator].match(text, place)
        if match is None:
            line = _line(text, place)
            raise GradingError(f"A quote that is opened in line {line} is never closed: the file is damaged.")
        inside, place = match["inside"], match.end()
        content = "" if inside is None else inside.replace('""', '"')
        row.append(CsvCell(match.start(), match.start("end"), content + match["rest"], inside is not None))
        if match["end"] != separator:
            yield row if len(row) > 1 or row[0].start < row[0].end else []
            row = []


def _line(text: str, place: int) -> int:
    """Return the number, from 1, of the line in which a place of a text is."""
    return len(re.findall(r"\r\n|\r|\n", text[:place])) + 1


# --- a platform's file ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PointsColumn:
    """A column of points.

    Attributes
    ----------
    place, heading : place of the column, from 0, and its heading
    names : what it may be called besides its heading: its title, the platform's number
    most : what it is out of, as the file says it; "" if it does not
    """

    place: int
    heading: str
    names: list[str]
    most: str


@dataclass(frozen=True)
class Export:
    """A platform's file: its cells and headings, the rows of its students, and its columns of points."""

    platform: Platform
    table: CsvTable
    head: list[str]
    students: list[int] = field(default_factory=list)
    columns: list[PointsColumn] = field(default_factory=list)

    def under(self, row: int, heading: str) -> str:
        """Return the text of a row's cell under a heading; "" if there is no such column."""
        return self.table.cell(row, self.head.index(heading)) if heading and heading in self.head else ""

    def name(self, row: int) -> str:
        """Return the name of the student in a row."""
        return " ".join(filter(None, (self.under(row, heading) for heading in self.platform.names)))

    def described(self, row: int) -> str:
        """Return as text whom a row is of: the first key of the student, the name, and the number of the line."""
        known = next(filter(None, (self.under(row, heading) for heading in self.platform.keys)), "–")
        return f"{known} ({', '.join(filter(None, (self.name(row), f'line {self.table.line(row)}')))})"

    def column(self, wanted: str | None = None) -> PointsColumn:
        """Return the column for the marks.

        Parameters
        ----------
        wanted : its heading, or else its title or number; None for the only column of points

        Raises
        ------
        GradingError
            If there is no such column, or more than one.
        """
        there = self.columns
        if wanted is not None:
            named = [column for column in there if _same(wanted, column.heading)]
            there = named or [column for column in there if any(_same(wanted, name) for name in column.names)]
        names = listed([repr(column.heading) for column in there or self.columns], _SHOWN)
        if len(there) > 1:
            raise GradingError(f"Several columns may be meant: say which by --column, by its whole heading. {names}")
        if not there:
            missing = "It has no column" if wanted is None else f"It has no column {wanted!r}"
            raise GradingError(
                f"{missing} that takes points, and none is made. In a file of {self.platform.name} such columns look "
                f"like {self.platform.example}. It has: {names or 'none'}."
            )
        return there[0]

    def maximum(self, column: PointsColumn, out_of: float | None = None) -> Decimal:
        """Return what a column is out of, as the file says it, or else the instructor (``out_of``).

        Raises
        ------
        GradingError
            If neither says it, if they contradict each other, or if it is not above 0.
        """
        there, given = _number(column.most), None if out_of is None else Decimal(str(out_of))
        maximum = given if there is None else there
        if maximum is None or not maximum.is_finite() or maximum <= 0 or given not in (None, maximum):
            raise GradingError(
                f"What {column.heading!r} is out of: {self.platform.name}'s file says {column.most or 'nothing'}, and "
                f"--out-of says {'nothing' if out_of is None else out_of}. One number above 0 is needed: set the "
                "points on the platform and export the file again, or give by --out-of what the file does not say."
            )
        return maximum.normalize()


def read(data: bytes) -> Export:
    """Read a platform's file: try each separator, and return the first form of a known platform that fits.

    Raises
    ------
    GradingError
        If no platform fits: the damage found with the first separator that failed, else a list of the headings needed.
    """
    damaged: GradingError | None = None
    longest: list[str] = []
    for separator in SEPARATORS:
        try:
            cells = table(data, separator)
        except GradingError as error:  # a quote that is none, as the cells have another separator
            damaged = damaged or error
            continue
        head = [cell.text.strip() for cell in cells.rows[0]] if cells.rows else []
        for platform in PLATFORMS:
            known = any({*form.split(",")} <= {*head} for form in platform.known_by)
            if known and {*platform.keys} & {*head}:
                return _with_rows_and_columns(Export(platform, cells, head))
        longest = max(longest, [heading[:40] for heading in head[:8]], key=len)
    needed = "; ".join(f"{platform.name}: {' or '.join(platform.known_by)}" for platform in PLATFORMS)
    raise damaged or GradingError(
        "It is not a file of Canvas, Moodle, Blackboard or Brightspace, or not as the platform wrote it. Its "
        f"first line has {', '.join(map(repr, longest)) or 'nothing'}. These headings are needed: {needed}. Export it "
        "again as CSV, with the platform in English, and do not save it in Excel."
    )


def _with_rows_and_columns(export: Export) -> Export:
    """Add the rows that name a student, and the columns that take points, to a platform's file; return it.

    Canvas's row of maximum points is none of a student, and so is that of its test student. A column takes points if
    its heading matches and it is not read only; where the maximum stands in a column of the file, only if all rows have
    the same.
    """
    platform, cells = export.platform, export.table
    known = (*platform.keys, *platform.names)
    rows = [row for row in range(1, len(cells.rows)) if any(export.under(row, heading) for heading in known)]
    nobody = NO_STUDENTS if platform.name == CANVAS else ()
    most_row = next((row for row in rows if export.name(row) in nobody[:1]), None)
    export.students.extend(row for row in rows if export.name(row) not in nobody or export.under(row, "SIS User ID"))
    in_rows = {export.under(row, platform.most_column) for row in export.students}
    for place, heading in enumerate(export.head):
        match = re.fullmatch(platform.points, heading, re.DOTALL)
        most = cells.cell(most_row, place) if most_row is not None else "".join(in_rows)
        has_one_maximum = len(in_rows) < 2 and (not platform.most_column or platform.most_column in export.head)
        if match and has_one_maximum and not most.startswith("("):  # Canvas writes (read only)
            names = match.groupdict()
            most = names.pop("most", None) or most
            export.columns.append(PointsColumn(place, heading, [*filter(None, names.values())], most))
    return export


def _same(first: str, second: str) -> bool:
    """Return whether two texts are the same but for capitals and white space."""
    return " ".join(first.casefold().split()) == " ".join(second.casefold().split())


def _number(text: str) -> Decimal | None:
    """Read a number with a point or a comma before its decimals; return None for any other text."""
    return Decimal(text.replace(",", ".")) if _NUMBER.fullmatch(text) else None


def _words(text: str) -> str:
    """Return the words and numbers of a text between spaces, so that "Lab 2" is in "Lab 02: speed (1234)"."""
    words = re.findall(r"[^\W\d_]+|\d+", text.casefold())
    return f" {' '.join(word.lstrip('0') or word for word in words)} "


def maxima(course: Course) -> dict[str, Fraction]:
    """Return title of each assignment → what its column is out of, for a student who is excused from nothing."""
    grades = account_of(course, Handed(StudentRecord("-"), nothing_given(course))).assignments
    return {grade.title: grade.out_of for grade in grades if grade.title}


def misplaced(maxima: Mapping[str, Fraction], own: str, column: PointsColumn, maximum: Decimal, file: str) -> str:
    """Return the title of another assignment, if a column seems to be of that one; "" if not.

    It is the one with its title in the column's heading, or else in the file's name, or else with its maximum.

    Parameters
    ----------
    maxima : from :func:`maxima`
    own : title of the assignment that is put into the column; "" for all that counts
    column, maximum : the column, and what it is out of
    file : name of the file
    """
    titles = sorted(maxima, key=lambda title: (len(title), title == own), reverse=True)
    named = [title for text in (column.heading, file) for title in titles if _words(title) in _words(text)]
    if not named and own and maxima[own] != maximum:
        named = [title for title in titles if maxima[title] == maximum]
    return named[0] if named and len(maxima) > 1 and named[0] != own else ""


# --- how a student is matched -----------------------------------------------------------------------------------------


class Matches(NamedTuple):
    """Which row belongs to which student.

    Attributes
    ----------
    students : row → student
    unknown : rows of students whom the gradebook does not have
    refused : row → why it is nobody's: it may be several students', other rows are theirs, too, or the names contradict
    missing : IDs of students of the gradebook to whom no row leads
    """

    students: dict[int, StudentRecord]
    unknown: list[int]
    refused: dict[int, str]
    missing: list[str]


def match(export: Export, students: Sequence[StudentRecord]) -> Matches:
    """Find the students of a gradebook in a platform's file: by the keys of a row, never by name or by a guess.

    A key leads to the student with this ID, e-mail address or other name (alias).

    A platform's own number counts only where nothing else leads to a student, and not if the names contradict it.
    """
    records = {student.student: student for student in students}
    keys, numbers = (by_key(students, pattern) for pattern in ("", PARTICIPANT))
    candidates: dict[int, str] = {}
    refused: dict[int, str] = {}
    unknown, seen = list[int](), set[str]()
    own_key = export.platform.own_key
    for row in export.students:
        values = [export.under(row, key).removeprefix("#") for key in export.platform.keys if key != own_key]
        certain = set[str]().union(*(keys.get(caseless(value), ()) for value in values if value))
        own_number = PARTICIPANT.sub("", export.under(row, own_key))
        several = certain or numbers.get(caseless(own_number), set())
        seen |= several
        if not several:
            unknown.append(row)
        elif len(several) > 1:
            refused[row] = f"it may be one or another: {', '.join(sorted(several))}."
        elif not certain and contradict(export.name(row), records[min(several)].name):
            of_whom = f"leads to {min(several)!r}, who has another name."
            refused[row] = f"only a number of {export.platform.name}'s own {of_whom}"
        else:
            candidates[row] = min(several)
    rows = Counter(candidates.values())
    refused |= {row: f"several lines lead to {who!r}." for row, who in candidates.items() if rows[who] > 1}
    found = {row: records[who] for row, who in candidates.items() if rows[who] == 1}
    return Matches(found, unknown, dict(sorted(refused.items())), [who for who in records if who not in seen])


# --- what is written --------------------------------------------------------------------------------------------------


class Earned(NamedTuple):
    """What a student has earned, in an assignment or in all that counts.

    Attributes
    ----------
    share : points earned of what they are out of, exactly; 1 for all of them; None if there is no mark to write
    remark : why there is no mark, or why it is not final; "" if it is
    state : of the work, or "excused"; "" if nothing is known to be handed in, or all that counts is not due yet
    """

    share: Fraction | None
    remark: str = ""
    state: str = ""


def earned(book: Gradebook, course: Course, assignment: Assignment | None = None) -> dict[str, Earned]:
    """Return what each student in the gradebook and its roster has earned, by ID.

    Parameters
    ----------
    book, course : the class
    assignment : of which the points are returned; None for all that counts
    """
    handed_in = set(map(caseless, book.handed_in()))
    found: dict[str, Earned] = {}
    for about in book.students():
        graded = book.current(about.student)
        account = account_in(book, course, graded, about)
        grade = next((one for one in account.assignments if one.assignment == assignment), None)
        has_marks = any(one.all_items for one in account.assignments)
        if grade is not None and (has_marks or grade.is_excused):
            entry = _earned_in(grade)
        elif not has_marks:
            entry = Earned(None, "nothing handed in.")
            if caseless(about.student) in handed_in:
                entry = Earned(None, "handed in, and not graded yet.", State.HANDED_IN)
        elif graded and graded.marks and all(mark.status == Status.NOT_MARKED for mark in graded.marks if mark.out_of):
            entry = Earned(None, f"grading failed; say {program.name()} grade again.", State.NOT_GRADED)
        else:
            entry = _earned_in_all(account)
        found[about.student] = entry
    return found


def _earned_in_all(account: Account) -> Earned:
    """Return what a student has earned in all that counts."""
    if not account.out_of:
        return Earned(None, "it is out of no points.")
    share = account.earned / account.out_of
    if account.undecided:
        waits = listed([f"{item.question} {item.part}" for item in account.undecided], _NAMED)
        return Earned(share, f"still waits for a person: {waits}.", State.WAITS)
    if account.later:
        return Earned(share, f"only what is due so far: not {account.later}.")
    nothing = all(one.state is State.MISSING for one in account.so_far if one.title)
    return Earned(share, state=State.MISSING if nothing else State.MARKED)


def _earned_in(grade: AssignmentGrade) -> Earned:
    """Return what a student has earned in an assignment."""
    if grade.is_excused:
        return Earned(None, f"{_EXCUSED}.", _EXCUSED)
    if grade.is_empty or not grade.possible:
        return Earned(None, f"{grade.state}.", grade.state)
    share = grade.points / grade.out_of
    if grade.undecided:
        waits = listed([f"{item.question} {item.part}" for item in grade.undecided], _NAMED)
        return Earned(share, f"{grade.state}: {waits}.", State.WAITS)
    return Earned(share, f"{grade.state}." if grade.state is State.NOT_GRADED else "", grade.state)


@dataclass(frozen=True)
class StudentCell:
    """A student's cell.

    Attributes
    ----------
    before, after : its text, and the text to write; None if no mark is written
    remark : why it is left, or what is worth knowing about the mark
    waits : whether somebody has to act before all of the student's marks are in it
    """

    before: str
    after: str | None
    remark: str = ""
    waits: bool = False


def fill(
    export: Export,
    column: PointsColumn,
    maximum: Decimal,
    matches: Matches,
    earned: Mapping[str, Earned],
    *,
    decimals: int,
    unfinished: bool = False,
    cap: bool = False,
) -> tuple[bytes, dict[str, StudentCell]]:
    """Write everybody's mark into one column.

    Parameters
    ----------
    export, column, maximum : the file, the column, and what it is out of
    matches : which row belongs to which student
    earned : student → what they have earned
    decimals : of a mark, which is rounded half up
    unfinished : whether the points decided so far are written if more waits
    cap : whether a mark above the maximum is written as the maximum

    Returns
    -------
    bytes
        The file.
    dict[str, StudentCell]
        Student → what became of their cell. If it has the mark already, ``after`` equals ``before``.

    Raises
    ------
    GradingError
        If the column has letters or words, or marks would be above the maximum; the message lists all of them.
    """
    _check_points(export, column)
    comma = _has_decimal_commas(export.table)
    entries, new, above = dict[str, StudentCell](), dict[tuple[int, int], str](), dict[str, str]()
    for row, about in sorted(matches.students.items()):
        mark, before = earned[about.student], export.table.cell(row, column.place)
        why = _why_left(export, column, row)
        after: str | None = None
        remark, is_excused = why or mark.remark, mark.state == _EXCUSED
        if not why and is_excused and export.platform.excused:
            after = export.platform.excused
        elif not why and mark.share is not None and (unfinished or not mark.remark):
            exactly = half_up(mark.share * Fraction(maximum), decimals)
            value = min(exactly, Fraction(maximum))
            if exactly > maximum:
                above[about.student] = in_full(exactly)
                remark = f"cut to the maximum, from {in_full(exactly)}."
            elif mark.state == State.MISSING:
                remark = remark or f"{State.MISSING}."
            after = before if _number(before) == value else in_full(value).replace(".", "," if comma else ".")
        waits = mark.state in WAITING or (is_excused and after is None and not _is_empty(export.platform, before))
        if why:
            waits = before.casefold() not in export.platform.closed
        entries[about.student] = StudentCell(before, after, remark, waits)
        if after not in (None, before):
            new[row, column.place] = after
    if above and not cap:
        most, those = in_full(Fraction(maximum)), ", ".join(f"{who}: {value}" for who, value in above.items())
        raise GradingError(
            f"Nothing is written: {column.heading!r} is out of {most}, and these would have more: {those}. "
            "A platform cuts, refuses or takes that as it likes. Raise its points on the platform and export the file "
            f"again, or say --cap, and {most} is written for them. (If it is by rounding, say more --decimals.)"
        )
    return export.table.changed(new), entries


def _check_points(export: Export, column: PointsColumn) -> None:
    """Raise GradingError if a column has texts and not one number: it has letters or words for marks."""
    platform, cells = export.platform, [export.table.cell(row, column.place) for row in export.students]
    filled = [text for text in cells if not _is_empty(platform, text) and text.casefold() not in platform.closed]
    if filled and not any(map(_number, filled)):
        raise GradingError(f"{column.heading!r} has {filled[0]!r} and the like, and no points.")


def _why_left(export: Export, column: PointsColumn, row: int) -> str:
    """Return why the cell of a row must not be written, as a sentence; "" if it may."""
    before, platform = export.table.cell(row, column.place), export.platform
    if column.place >= len(export.table.rows[row]):
        return f"line {export.table.line(row)} of the file is too short: it has no such cell."
    if export.under(row, platform.locked) == "No":
        return f"Moodle takes no mark of theirs ({platform.locked!r} says No)."
    if _is_empty(platform, before) or _number(before) is not None:
        return ""
    return platform.closed.get(before.casefold(), f"it says {before!r} there, which is no number.")


def _is_empty(platform: Platform, text: str) -> bool:
    """Return whether a cell has no mark; what stands in brackets at its end does not count."""
    return re.sub(r"\(.*\)$", "", text).strip() in ("", platform.empty)


def _has_decimal_commas(table: CsvTable) -> bool:
    """Return whether numbers in a file have commas before their decimals: some have, and none has a point."""
    numbers = [cell.text.strip() for row in table.rows for cell in row if _NUMBER.fullmatch(cell.text.strip())]
    return any("," in text for text in numbers) and not any("." in text for text in numbers)


def summary(export: Export, entries: Mapping[str, StudentCell], matches: Matches, *, dry: bool = False) -> list[str]:
    """Return lines that say what was written and what was not, the counts first.

    Parameters
    ----------
    export, entries, matches : the file, what became of each cell, and which row belongs to which student
    dry : whether nothing is written; then each mark for an empty cell is listed, too
    """
    left = [entry for entry in entries.values() if entry.after is None]
    new = {who: entry for who, entry in entries.items() if entry.after not in (None, entry.before)}
    old = {who: entry for who, entry in new.items() if not _is_empty(export.platform, entry.before)}
    first = [f"{who}: {entry.after}" for who, entry in new.items() if who not in old and dry]
    replaced = [f"{who}: {entry.before} → {entry.after}" for who, entry in old.items()]
    lists = (
        (f"{len(first)} into empty cells", ", ".join(first)),
        (f"{len(old)} replaced", ", ".join(replaced)),
        ("In the file, and not in the gradebook", "; ".join(map(export.described, matches.unknown))),
        ("In the gradebook, and not in the file", ", ".join(matches.missing)),
    )
    return [
        f"{len(new)} written ({len(old)} of them in place of another mark), {len(entries) - len(new) - len(left)} as "
        f"they were, {len(left)} left as they are, {len(matches.unknown) + len(matches.refused)} of theirs not found "
        f"in the gradebook, {len(matches.missing)} of the gradebook not found in the file.",
        *(f"{what}: {those}" for what, those in lists if those),
        *(
            f"{who}: {'left' if entry.after is None else entry.after}; {entry.remark}"
            for who, entry in entries.items()
            if entry.remark
        ),
        *(f"{export.described(row)}: nobody's; {why}" for row, why in matches.refused.items()),
    ]
