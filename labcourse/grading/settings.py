"""A course's settings: ``course.toml`` in its folder, what an instructor decides for a term without any Python.

Each table of the file is a class here. Each entry has its type, its limits, and what a message says about it: what is
expected, and an example. pydantic checks the file by them; what Python code makes of the classes is not checked.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, is_dataclass, replace
from datetime import date, datetime, time
from decimal import Decimal
from difflib import get_close_matches
from functools import partial, reduce
from itertools import pairwise
from operator import getitem, itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

from pydantic import AliasPath, Field, GetCoreSchemaHandler, GetPydanticSchema, Strict, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic.functional_validators import AfterValidator, PlainValidator
from pydantic_core import CoreSchema, ErrorDetails
from pydantic_core.core_schema import no_info_after_validator_function

from labcourse import course_file
from labcourse.benches import MOST_SEED, OWN, PRESET, REAL, SAME, THEIR_OWN, BenchPolicy
from labcourse.errors import AnswerError, GradingError

if TYPE_CHECKING:  # commands are quick to say what they can do
    from labcourse.answers.catalogue import Catalogue

SETTINGS_FILE = "course.toml"  #: in the course's folder, optional
#: Digits to which shares are compared: sums of floats are off in the last digit, and must still reach a threshold.
SHARE_DIGITS = 9

Place = tuple[str | int, ...]  #: of an entry in the file, as ("deadline", 0, "due")
Fault = tuple[Place, str]  #: place of an entry, and what is wrong with it


# --- types of entries -------------------------------------------------------------------------------------------------


def _check_printable(text: str) -> str:
    """Return a text; raise ValueError if it has unprintable characters, or white space at its ends."""
    if not text.isprintable() or text != text.strip():
        raise ValueError
    return text


def _datetime(time_of_day: time, value: object) -> datetime:
    """Return a date, or a date and time, of TOML as a time with a zone; raise ValueError for anything else.

    Parameters
    ----------
    time_of_day : for a date alone
    value : from the file; a time without a zone is in that of this computer
    """
    if not isinstance(value, date) or not 2000 <= value.year < 3000:  # a datetime is a date, too
        raise ValueError
    moment = value if isinstance(value, datetime) else datetime.combine(value, time_of_day)
    return moment if moment.tzinfo else moment.astimezone()


def _shares(defaults: Mapping[int, float], value: object) -> dict[int, float]:
    """Read a table of per cents of levels as level → share, with defaults for the levels that it leaves out."""
    percents = _PERCENTS.validate_python(value)
    return {**defaults, **{int(level): float(Decimal(str(percent)) / 100) for level, percent in percents.items()}}


def _entry(expected: str, example: str, path: Sequence[str] = (), **limits: Any) -> Any:
    """Return the pydantic field of an entry.

    Parameters
    ----------
    expected : what a message says is expected, after "it should be"
    example : value as it is written in the file
    path : table and entry in the file, if they differ from those of the classes
    limits : of :func:`pydantic.Field`, as ``ge`` and ``max_length``
    """
    alias = AliasPath(*path) if path else None
    return Field(description=expected, examples=[example], validation_alias=alias, **limits)


def _number(example: str, least: float, most: float, expected: str = "a number") -> Any:
    """Return the field of a number between two limits."""
    return _entry(f"{expected} from {least} to {most}", example, ge=least, le=most)


def _moment(example: str, *path: str) -> Any:
    """Return the field of a date, or a date and time."""
    return _entry("a date, or a date and time, of the years 2000 to 2999", example, path)


_Line = Annotated[str, Strict(), Field(max_length=120), AfterValidator(_check_printable)]
_Name = Annotated[_Line, Field(min_length=1)]
_Notebook = Annotated[_Name, AfterValidator(lambda name: name.removesuffix(".ipynb"))]
_Number = Annotated[int, Strict()] | Annotated[float, Strict()]  # 100 stays an int, and is shown without a point
_Switch = Annotated[bool, Strict(), _entry("true or false", "true")]
_Whole = Annotated[int, Strict()]
_Weight = Annotated[_Number, Field(ge=0.001, le=1000)]
_PERCENTS = TypeAdapter(dict[Literal["4", "3", "2", "1"], Annotated[_Number, Field(ge=0, le=100)]])
_START, _END = PlainValidator(partial(_datetime, time.min)), PlainValidator(partial(_datetime, time.max))
_SHARES: Mapping[int, float] = {4: 1.0, 3: 0.75, 2: 0.5, 1: 0.25, 0: 0.0}
_THRESHOLDS: Mapping[int, float] = {4: 0.9, 3: 0.75, 2: 0.5, 1: 0.0}
_READ_SHARES = PlainValidator(partial(_shares, _SHARES))
_READ_THRESHOLDS = PlainValidator(partial(_shares, _THRESHOLDS))
_PARTS = "names of questions, or of a question and a part"
_WEIGHTS = f"{_PARTS}, in quotes, each with a number from 0.001 to 1000"
_LEVELS = "numbers from 0 to 100, in per cent, for levels of 4, 3, 2, 1"
_PERCENT_SHARES = _entry(_LEVELS, "{4 = 100, 3 = 75, 2 = 50, 1 = 25}")
_PERCENT_THRESHOLDS = _entry(_LEVELS, "{4 = 90, 3 = 75, 2 = 50, 1 = 0}")
_LINE = "a line of text of at most 120 characters"
_THIS_PYTHON = f'"3.{sys.version_info.minor}"'
_PYTHON = _entry("a version of Python, in quotes", _THIS_PYTHON, path=("course", "python"), pattern=r"^3\.[0-9]{1,2}$")
_GIVEN = _entry("what is given to a class that begins in the middle", '"speed"', path=("given", "from"))
_NOTEBOOKS = _entry("names of the course's notebooks", '["01_first_lab"]', min_length=1)
_WHICH = _entry('"own", "same", "preset" or "real"', '"own"')
_SECTION = _entry("the name of a section of the roster", '"B"')


# --- tables -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FeedbackSettings:
    """What students see of their marks, and when. (They never see the right answers of the key.)

    Attributes
    ----------
    points : how many points each answer earned
    reasons : the key's comment on each answer, besides whether it was right
    opens : when students may see it; at once where it is None
    """

    points: _Switch = True
    reasons: _Switch = True
    opens: Annotated[datetime | None, _START, _moment("2026-12-01T12:00:00+01:00", "from")] = None

    def is_open(self, now: datetime) -> bool:
        """Return whether students may see it at a time, which has a time zone."""
        return self.opens is None or now >= self.opens


@dataclass(frozen=True)
class ReflectSettings:
    """Whether and when ``lab.reflect()`` asks students about answers of theirs that contradict each other.

    Attributes
    ----------
    asks : whether it does
    opens : from when on; at once where it is None
    """

    asks: _Switch = True
    opens: Annotated[datetime | None, _START, _moment("2026-11-02T08:00:00+01:00", "from")] = None

    def as_json(self) -> str:
        """Return what stands under "reflect" in ``course.json``."""
        if not self.asks:
            return course_file.OFF
        return course_file.ON if self.opens is None else self.opens.isoformat()


@dataclass(frozen=True)
class ReportSettings:
    """What a lab report may be like.

    Attributes
    ----------
    page_limit : pages, cover and contents included; None where there is no limit
    """

    page_limit: Annotated[_Whole | None, _number("12", 1, 1000, "a whole number")] = None


@dataclass(frozen=True)
class MarkSettings:
    """How marks become a final grade.

    Attributes
    ----------
    drop : names of what does not count, neither in points nor in what they are out of: a question, or a question and a
        part, as "1.2" or "1.2 speed"
    weights : names, as above → factor of the points and of what they are out of; the weight of a part replaces that of
        its question
    out_of : the scale of the final grade; where it is None, that is the sum of points
    decimals : of the final grade, which is rounded half up
    predictions : additional points for each prediction that was made
    """

    drop: Annotated[tuple[_Name, ...], _entry(_PARTS, '["1.2", "1.3 speed"]', min_length=1)] = ()
    weights: Annotated[Mapping[_Name, _Weight], _entry(_WEIGHTS, '{"1.2" = 2.0, "1.3 speed" = 0.5}')] = field(
        default_factory=dict
    )
    out_of: Annotated[_Number | None, _number("100", 0.001, 1000)] = None
    decimals: Annotated[_Whole, _number("2", 0, 4, "a whole number")] = 2
    predictions: Annotated[_Number, _number("0.5", 0, 100, "a number of points")] = 0.0

    def dropped_as(self, question: str, part: str) -> str:
        """Return the entry of ``drop`` that leaves out a part of a question; "" if the part counts."""
        return _matching_name(question, part, self.drop)

    def weighted_as(self, question: str, part: str) -> str:
        """Return the entry of ``weights`` that gives a part another weight than 1; "" if there is none."""
        name = _matching_name(question, part, self.weights)
        return name if self.weights.get(name, 1) != 1 else ""

    def weight(self, question: str, part: str) -> float:
        """Return the factor of the points of a part of a question."""
        return self.weights.get(_matching_name(question, part, self.weights), 1.0)


def _matching_name(question: str, part: str, names: Collection[str]) -> str:
    """Return the name among these that is of a part ("1.2 speed"), else of its question ("1.2"); "" if neither is."""
    return next((name for name in (f"{question} {part}", question) if name in names), "")


@dataclass(frozen=True)
class LevelSettings:
    """Levels of answers: 4, the best, to 1; and 0 for an answer that earns nothing.

    Attributes
    ----------
    shares : level → the share (0 to 1) of the points that it is worth
    thresholds : level → the least share of the points that has this level; no points are level 0
    """

    shares: Annotated[Mapping[int, float], _READ_SHARES, _PERCENT_SHARES] = field(default_factory=lambda: _SHARES)
    thresholds: Annotated[Mapping[int, float], _READ_THRESHOLDS, _PERCENT_THRESHOLDS] = field(
        default_factory=lambda: _THRESHOLDS
    )

    def level_of(self, share: float) -> int:
        """Return the level of a share (0 to 1) of the points: the highest threshold that it reaches; 0 for nothing."""
        earned = round(share, SHARE_DIGITS)
        reached = (level for level, least in self.thresholds.items() if earned >= round(least, SHARE_DIGITS))
        return max(reached, default=0) if earned > 0 else 0


@dataclass(frozen=True)
class Deadline:
    """When notebooks are due.

    Attributes
    ----------
    due : the last moment that is in time
    notebooks : names, without their ending; all of the course's where there are none
    section : of the roster, for which it is; "" for all
    """

    due: Annotated[datetime, _END, _moment("2026-11-21")]
    notebooks: Annotated[tuple[_Notebook, ...], _NOTEBOOKS] = ()
    section: Annotated[_Name, _SECTION] = ""


@dataclass(frozen=True)
class Extension:
    """More time for some students.

    Attributes
    ----------
    until : the last moment that is in time
    students : IDs, or other names that the roster has for them
    section : of the roster, all of whose students have it; "" for the named students alone
    notebooks : names, without their ending; all of the course's where there are none
    """

    until: Annotated[datetime, _END, _moment("2026-11-28T12:00:00+01:00")]
    students: Annotated[tuple[_Name, ...], _entry("students' IDs", '["ada"]', min_length=1)] = ()
    section: Annotated[_Name, _SECTION] = ""
    notebooks: Annotated[tuple[_Notebook, ...], _NOTEBOOKS] = ()


@dataclass(frozen=True)
class LateSettings:
    """What lateness costs.

    Attributes
    ----------
    per_day : %, of the points that a notebook earned, for each day that has begun
    cap : %, the most that is taken
    grace_hours : h, after the deadline, in which nothing is taken; days are counted from their end on
    """

    per_day: Annotated[_Number, _number("10", 0, 100, "a number of per cent")] = 0.0
    cap: Annotated[_Number, _number("50", 0, 100, "a number of per cent")] = 100.0
    grace_hours: Annotated[_Number, _number("2", 0, 1000, "a number of hours")] = 0.0


@dataclass(frozen=True)
class OutcomeSettings:
    """When an outcome counts as attained.

    Attributes
    ----------
    level : which a student has to reach in it
    share : %, of the students who have to
    fewest : students of the smallest group that is shown
    """

    level: Annotated[_Whole, _number("3", 1, 4, "a whole number")] = 3
    share: Annotated[_Number, _number("70", 0, 100, "a number of per cent")] = 70.0
    fewest: Annotated[_Whole, _number("5", 1, 1000, "a whole number")] = 5


@dataclass(frozen=True)
class _Bench:
    """The table of the benches, as it stands in the file."""

    which: Annotated[Literal["own", "same", "preset", "real"], _WHICH] = "own"
    seed: Annotated[_Whole, _number("2026", 0, MOST_SEED, "a whole number")] = 0
    preset: Annotated[_Name, _entry("the name of a bench", '"workshop"')] = ""
    benches: Annotated[tuple[_Name, ...], _entry("names of the laboratory's benches", '["north"]', min_length=1)] = ()


def _bench_schema(_type: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
    """Return pydantic's schema of a BenchPolicy: the file's table, as :class:`_Bench`, is checked and converted."""
    return no_info_after_validator_function(lambda bench: BenchPolicy(**vars(bench)), handler(_Bench))


@dataclass(frozen=True)
class CourseSettings:
    """What is decided of a course for a term.

    Attributes
    ----------
    title : of the course, for people; "" leaves it to ``course.py``
    term : as "2026 autumn"
    python : version that grades, major and minor; "" for the one that makes the release
    bench : which bench each student has
    given : name of what is given to a class that begins in the middle; "" for a class that begins at the beginning
    feedback : what students see of their marks, and when
    reflect : whether and when students are asked about contradictions between their answers
    report : what their lab reports may be like
    releases : the folder in which releases are stored, from the one above the course's
    marks : what counts, by how much, and on which scale
    levels : what levels are worth, and their thresholds
    deadlines, extensions : what is due when, and who has more time
    late : what lateness costs
    outcomes : when an outcome counts as attained
    """

    title: Annotated[_Name, _entry(_LINE, '"Control laboratory"', path=("course", "title"))] = ""
    term: Annotated[_Line, _entry(_LINE, '"2026 autumn"', path=("course", "term"))] = ""
    python: Annotated[_Line, _PYTHON] = ""
    bench: Annotated[BenchPolicy, GetPydanticSchema(_bench_schema)] = THEIR_OWN
    given: Annotated[_Name, _GIVEN] = ""
    feedback: FeedbackSettings = FeedbackSettings()
    reflect: ReflectSettings = ReflectSettings()
    report: ReportSettings = ReportSettings()
    releases: Annotated[_Name, _entry("the path of a folder", '"releases"', path=("releases", "folder"))] = "releases"
    marks: MarkSettings = field(default_factory=MarkSettings)
    levels: LevelSettings = field(default_factory=LevelSettings)
    deadlines: Annotated[tuple[Deadline, ...], Field(validation_alias=AliasPath("deadline"))] = ()
    extensions: Annotated[tuple[Extension, ...], Field(validation_alias=AliasPath("extension"))] = ()
    late: LateSettings = LateSettings()
    outcomes: OutcomeSettings = OutcomeSettings()

    def of_marking(self) -> CourseSettings:
        """Return a copy with defaults for all that the marking of answers does not depend on.

        Equal copies mark alike. (``given`` is not among what marking depends on, because each run stores it.)
        """
        defaults = CourseSettings()
        without = ("python", "given", "feedback", "report", "marks", "levels", "deadlines", "extensions", "late")
        return replace(self, **{name: getattr(defaults, name) for name in (*without, "outcomes")})


# --- from the file to the settings ------------------------------------------------------------------------------------


def read_toml(file: Path) -> dict[str, Any]:
    """Read a TOML file of the course's folder, which a person wrote.

    Raises
    ------
    FileNotFoundError
        If there is none.
    GradingError
        If it cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise
    except tomllib.TOMLDecodeError as error:
        raise GradingError(f"{file} is not TOML: {error}") from None
    except (OSError, ValueError) as error:
        raise GradingError(f"{file} cannot be read: {error}") from None


def refuse(file: Path, faults: Iterable[str]) -> None:
    """Raise GradingError if there are faults in a file; the message lists each."""
    if lines := list(faults):
        raise GradingError("\n  ".join([f"{file} cannot be used:", *lines]))


def are_texts(value: object) -> bool:
    """Return whether a value is a list of texts; it may be empty."""
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def read(
    folder: Path,
    presets: Collection[str] = (),
    draw: int = THEIR_OWN.draw,
    benches: Mapping[str, str] | None = None,
    catalogue: Catalogue | None = None,
) -> CourseSettings:
    """Read the settings of the course in a folder; without a file, they are the defaults.

    Parameters
    ----------
    folder : of the course
    presets : names of the benches that the course has
    draw : version of how the course draws benches
    benches : names of the laboratory's benches whose truth the course has → what is wrong with their file; "" for
        nothing
    catalogue : of the course's questions, to check names of questions and notebooks; without it they are not checked

    Returns
    -------
    CourseSettings
        What the file says, and defaults for the rest.

    Raises
    ------
    GradingError
        If the file cannot be read, or something in it is wrong. The message has a line for each fault: line of the
        file, table, entry, what is wrong, and what is expected.
    """
    file = folder / SETTINGS_FILE
    data = read_toml(file) if file.exists() else {}
    faults = dict(_unknown_entries(data))
    try:
        settings = TypeAdapter(CourseSettings).validate_python(data)
    except ValidationError as error:
        faults = {**dict(_refused_entry(details, data) for details in error.errors()), **faults}
    _refuse_places(file, faults.items())
    settings = replace(settings, bench=replace(settings.bench, draw=draw))
    bench = _bench_faults(data.get("bench", {}), presets, benches or {})
    names = () if catalogue is None else _unknown_names(settings, catalogue)
    _refuse_places(file, [*bench, *_contradictions(data, settings), *_level_faults(settings.levels), *names])
    return settings


# --- faults, with their places ----------------------------------------------------------------------------------------


def _refuse_places(file: Path, faults: Iterable[Fault]) -> None:
    """Raise GradingError if there are faults of the settings file; the message lists each with its line and place."""
    rows = [(_line_number(file.read_text(encoding="utf-8"), place), place, fault) for place, fault in faults]
    refuse(file, (f"line {line}: {_dotted(place)}: {fault}" for line, place, fault in sorted(rows, key=itemgetter(0))))


def _dotted(place: Place) -> str:
    """Write a place for people: "feedback.from", or "deadline 1.due", counted from 1."""
    return "".join(f" {part + 1}" if isinstance(part, int) else f".{part}" for part in place)[1:]


def _line_number(text: str, place: Place) -> int:
    """Return the number of the line in which an entry of a TOML file begins; that of its table if it is missing.

    The file is read with one more line at a time, until the entry is there.
    """
    lines, first = text.split("\n"), 1
    for count in range(1, len(lines) + 1):
        with suppress(tomllib.TOMLDecodeError):  # a value goes on in the next line
            if _entry_at(tomllib.loads("\n".join(lines[:count])), place) is not None:
                return first
            first = count + 1
    return _line_number(text, place[:-1]) if place else 1


def _entry_at(data: Any, place: Place) -> Any:
    """Return the entry at a place of the file's data; None if it is missing."""
    try:
        return reduce(getitem, place, data)
    except (KeyError, IndexError, TypeError):
        return None


def _entries(table: Any, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], FieldInfo]]:
    """Yield all entries that the file may have.

    Parameters
    ----------
    table : class of a table
    above : names of the tables that it is in

    Yields
    ------
    tuple
        (table, entry), and the pydantic field that describes it.
    """
    for name, hint in get_type_hints(table, include_extras=True).items():
        info = [part for part in get_args(hint) if isinstance(part, FieldInfo)]
        alias = info[-1].validation_alias if info else None
        place = above + (tuple(map(str, alias.path)) if isinstance(alias, AliasPath) else (name,))
        if info and info[-1].description:
            yield place, info[-1]
        elif is_dataclass(inner := _TABLES.get(place[-1], hint)):
            yield from _entries(inner, place)


_ROWS: Mapping[str, type] = {"deadline": Deadline, "extension": Extension}  # tables of which there may be several
_TABLES = {**_ROWS, "bench": _Bench}
_ENTRIES = dict(_entries(CourseSettings))


def _heading(table: str) -> str:
    """Return the line of the file that begins a table."""
    return f"[[{table}]]" if table in _ROWS else f"[{table}]"


def _unknown_entries(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield a fault for each table and entry that does not exist, and for each name of a table that is none."""
    tables = {table: _heading(table) for table, _name in _ENTRIES}
    for table, content in data.items():
        rows = content if table in _ROWS else [content]
        if table not in tables:
            homes = [f"It belongs under {tables[home]}." for home, name in _ENTRIES if name == table]
            yield (table,), f"there is no such section. {(*homes, _suggestion(table, tables))[0]}"
        elif not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            yield (table,), f"it should be a section: a line {tables[table]}, and its entries below."
        else:
            known = {name: name for home, name in _ENTRIES if home == table}
            for number, row in enumerate(rows):
                for name in row.keys() - known.keys():
                    place = (table, number, name) if table in _ROWS else (table, name)
                    yield place, f"there is no such entry. {_suggestion(name, known)}"


def _suggestion(name: str, known: Mapping[str, str]) -> str:
    """Return a text that suggests the most similar known names, and lists all; ``known`` is name → as it is shown."""
    near = "".join(f"Did you mean {known[match]}? " for match in get_close_matches(name, known, 1))
    return f"{near}There are {', '.join(known.values())}."


def _refused_entry(details: ErrorDetails, data: Mapping[str, Any]) -> Fault:
    """Return the fault for an error of pydantic's: the entry as it is, what is expected, and an example."""
    length = 3 if details["loc"][0] in _ROWS else 2  # ("deadline", 0, "due") or ("bench", "seed")
    place: Place = details["loc"][:length]
    if (place[0], place[-1]) not in _ENTRIES:
        return place[:1], ""  # the whole table is broken: the fault of _unknown_entries replaces this one
    value = _entry_at(data, place)
    shown = str(value) if isinstance(value, date | time) else ascii(value)
    problem = "it is missing. It" if value is None else f"it is {shown:.80}, and"
    return place, f"{problem} {_expectation(str(place[0]), str(place[-1]))}"


def _expectation(table: str, name: str) -> str:
    """Return the end of a message: what an entry should be, and an example."""
    entry = _ENTRIES[table, name]
    return f"should be {entry.description}, as in: {name} = {(entry.examples or [''])[0]}"


def _name_list(names: Collection[str]) -> str:
    """Return names in quotes and in order; "none" if there are none."""
    return ", ".join(json.dumps(name) for name in sorted(names)) or "none"


def _bench_faults(bench: Mapping[str, Any], presets: Collection[str], benches: Mapping[str, str]) -> Iterator[Fault]:
    """Yield faults of the table ``bench``: entries that do not fit ``which``, and benches that the course lacks.

    Parameters
    ----------
    bench : the table as it stands in the file
    presets, benches : as for :func:`read`
    """
    which = bench.get("which", OWN)
    for name, needed_by in (("seed", SAME), ("preset", PRESET), ("benches", REAL)):
        if which == needed_by and name not in bench:
            yield ("bench", name), f'which = "{which}" needs it. It {_expectation("bench", name)}'
        elif which != needed_by and name in bench:
            yield ("bench", name), f'it goes with which = "{needed_by}", and which is "{which}". Leave one of them out.'
    if which == PRESET and bench.get("preset", "") not in {*presets, ""}:
        yield ("bench", "preset"), f"the course has no bench {bench['preset']!a}; it has {_name_list(presets)}."
    for name in bench.get("benches", ()):
        missing = f"the course does not have the truth of {name!a}; it has that of {_name_list(benches)}."
        if fault := benches.get(name, missing):
            yield ("bench", "benches"), fault


def _contradictions(data: Mapping[str, Any], settings: CourseSettings) -> Iterator[Fault]:
    """Yield a fault for each pair of entries that contradict each other; ``data`` is what the file has."""
    if not settings.reflect.asks and settings.reflect.opens:
        yield ("reflect", "from"), "it goes with asks = true, and asks is false. Leave one of them out."
    for name in {*settings.marks.weights}.intersection(settings.marks.drop):
        yield ("marks", "weights"), f"{name!a} is dropped, so that it has no weight. Leave one of them out."
    if "late" in data and not settings.deadlines:
        yield ("late",), "there is no [[deadline]], so that nothing can be late. Add one, or leave [late] out."
    for number, extension in enumerate(settings.extensions):
        place, until = ("extension", number), extension.until
        if not extension.students and not extension.section:
            yield place, "it is for nobody. Add students or a section; for everybody, move the deadline."
        due = min((deadline.due for deadline in settings.deadlines if _overlap(deadline, extension)), default=None)
        if due is None:
            yield place, "there is no [[deadline]] of these notebooks, so that there is nothing to extend."
        elif until <= due:
            gain = f"it is {until:%Y-%m-%d %H:%M}, which gives nobody more time: they are due on {due:%Y-%m-%d %H:%M}"
            yield (*place, "until"), f"{gain} at the earliest. Is the year right?"


def _overlap(deadline: Deadline, extension: Extension) -> bool:
    """Return whether a deadline and an extension are for some notebook in common; without names, each is for all."""
    both_name_some = deadline.notebooks and extension.notebooks
    return not both_name_some or not set(deadline.notebooks).isdisjoint(extension.notebooks)


def _level_faults(levels: LevelSettings) -> Iterator[Fault]:
    """Yield faults of levels: a higher level that has less, and a level that is worth what is another level."""
    default = "(What you leave out has its default.)"
    for entry, of_level in (("shares", levels.shares), ("thresholds", levels.thresholds)):
        for low, high in pairwise(sorted(of_level)):
            if of_level[low] > of_level[high]:
                less = f"level {high} has {100 * of_level[high]:g} %, and level {low} has {100 * of_level[low]:g} %"
                yield ("levels", entry), f"{less}. A higher level should have at least as much. {default}"
    for level, share in levels.shares.items():
        if share and (reached := levels.level_of(share)) != level:
            worth = f"level {level} is worth {100 * share:g} % of the points, which the thresholds make level {reached}"
            yield ("levels",), f"{worth}. Let them agree. {default}"


def _unknown_names(settings: CourseSettings, catalogue: Catalogue) -> Iterator[Fault]:
    """Yield a fault for each name of a notebook, question, part or start that the catalogue does not have."""
    notebooks = [(("deadline", number), row.notebooks) for number, row in enumerate(settings.deadlines)]
    notebooks += [(("extension", number), row.notebooks) for number, row in enumerate(settings.extensions)]
    for place, names in notebooks:
        for name in sorted({*names}.difference(catalogue.notebooks)):
            yield (*place, "notebooks"), f"there is no notebook {name!a}; there are {_name_list(catalogue.notebooks)}."
    for entry, names in (("drop", settings.marks.drop), ("weights", tuple(settings.marks.weights))):
        for name in names:
            question, _space, part = name.rpartition(" ")
            try:
                if name not in catalogue.marked and question in catalogue.marked:
                    catalogue.find_marked(question).part(part)
                else:
                    catalogue.find_marked(name)
            except AnswerError as error:
                yield ("marks", entry), str(error)
    yield from _start_faults(settings, catalogue)


def _start_faults(settings: CourseSettings, catalogue: Catalogue) -> Iterator[Fault]:
    """Yield faults of the start of a class that begins in the middle: it is unknown, or not for these benches."""
    starts, bench = {start.name: start for start in catalogue.starts}, settings.bench
    start, place = starts.get(settings.given), ("given", "from")
    if settings.given and start is None:
        yield place, f"the course gives nothing called {settings.given!a}; it has {_name_list(starts)}."
    elif start is not None and bench.which == OWN and start.on_own_bench is None:
        why = f'"{start.name}" is for classes with the same bench for everybody: on own benches, students\' computers'
        why += " would have to work it out, with code that answers what other classes are asked."
        yield place, f'{why} Choose [bench] which = "same" or "preset", or one bench of the laboratory ("real").'
    elif start is not None and bench.which == REAL and len(bench.benches) > 1:
        several = f"what is given is of one bench, and [bench] names {len(bench.benches)}"
        yield place, f"{several}. Name one, or hand out a release for each."
