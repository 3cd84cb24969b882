"""A course's settings: ``course.toml`` in its folder, what an instructor decides for a term without any Python.

Each table of the file is a class here, and pydantic checks the file by it. A new table is a new class, a field of
:class:`CourseSettings` and an entry of ``_TABLES``. What Python code makes of the classes is not checked.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import date, datetime, time
from decimal import Decimal
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, AliasPath, Field, GetPydanticSchema, PlainValidator, Strict, TypeAdapter
from pydantic import ValidationError as Invalid
from pydantic_core import CoreSchema, ErrorDetails
from pydantic_core.core_schema import no_info_after_validator_function

from labcourse import course_file
from labcourse.benches import MOST_SEED, OWN, PRESET, REAL, SAME, THEIR_OWN, BenchPolicy
from labcourse.errors import AnswerError, GradingError

if TYPE_CHECKING:  # commands are quick to say what they can do
    from pydantic import GetCoreSchemaHandler

    from labcourse.answers.catalogue import Catalogue

SETTINGS_FILE = "course.toml"  #: in the course's folder, optional
#: Digits to which shares are compared: sums of floats are off in the last digit, and must still reach a threshold.
SHARE_DIGITS = 9

EntryPath = tuple[str | int, ...]  #: of an entry in the file, as ("deadline", 0, "due")
Fault = tuple[EntryPath, str]  #: place of an entry, and what is wrong with it


# --- types of entries -------------------------------------------------------------------------------------------------


def _one_line(text: str) -> str:
    """Return a text as it is; raise ValueError if it has unprintable characters, or white space at its ends."""
    if not text.isprintable() or text != text.strip():
        raise ValueError("Input should be one line of printable characters, without spaces at its ends")
    return text


def _datetime(time_of_day: time, value: object) -> datetime:
    """Return a date, or a date and time, as a datetime with a zone; raise ValueError for anything else.

    Parameters
    ----------
    time_of_day : for a date alone
    value : from the file; one without a zone is in the zone of this computer
    """
    if not isinstance(value, date) or not 2000 <= value.year < 3000:  # a datetime is a date, too
        raise ValueError("Input should be a date, or a date and time, as 2026-11-21 or 2026-11-21T18:00:00+01:00")
    moment = value if isinstance(value, datetime) else datetime.combine(value, time_of_day)
    return moment if moment.tzinfo else moment.astimezone()


def _shares(defaults: Mapping[int, float], value: object) -> dict[int, float]:
    """Read a table, "level" → %, as level → share (0 to 1), with defaults for the levels that it leaves out."""
    percents = TypeAdapter(dict[Literal["4", "3", "2", "1"], _Percent]).validate_python(value)
    return {**defaults, **{int(level): float(Decimal(str(percent)) / 100) for level, percent in percents.items()}}


_Line = Annotated[str, Strict(), Field(max_length=120), AfterValidator(_one_line)]
_Name = Annotated[str, Strict(), Field(min_length=1, max_length=120), AfterValidator(_one_line)]
_Notebook = Annotated[_Name, AfterValidator(lambda name: name.removesuffix(".ipynb"))]
_Number = Annotated[int, Strict()] | Annotated[float, Strict()]  # 100 stays an int, and is shown without a point
_Percent = Annotated[_Number, Field(ge=0, le=100)]
_Switch = Annotated[bool, Strict()]
_Whole = Annotated[int, Strict()]
_Start = Annotated[datetime, PlainValidator(partial(_datetime, time.min))]
_End = Annotated[datetime, PlainValidator(partial(_datetime, time.max))]
_SHARES: Mapping[int, float] = {4: 1.0, 3: 0.75, 2: 0.5, 1: 0.25, 0: 0.0}
_THRESHOLDS: Mapping[int, float] = {4: 0.9, 3: 0.75, 2: 0.5, 1: 0.0}


# --- tables -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FeedbackSettings:
    """What students see of their marks, and when. (They never see the right answers of the key.)

    Attributes
    ----------
    points : how many points each answer earned
    reasons : the key's comment on each answer, besides whether it was right
    opens : when students may see their feedback ("from" in the file); None for at once
    """

    points: _Switch = True
    reasons: _Switch = True
    opens: Annotated[_Start | None, Field(validation_alias="from")] = None

    def is_open(self, now: datetime) -> bool:
        """Return whether students may see their feedback at a time (``now``, with a time zone)."""
        return self.opens is None or now >= self.opens


@dataclass(frozen=True)
class ReflectSettings:
    """Whether and when ``lab.reflect()`` asks students about answers of theirs that contradict each other.

    Attributes
    ----------
    asks : whether students are asked at all
    opens : from when on they are asked ("from" in the file); None for at once
    """

    asks: _Switch = True
    opens: Annotated[_Start | None, Field(validation_alias="from")] = None

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

    page_limit: Annotated[_Whole | None, Field(ge=1, le=1000)] = None


@dataclass(frozen=True)
class MarkSettings:
    """What counts, and by how much.

    Attributes
    ----------
    drop : names of what does not count, neither in points nor in what they are out of: a question, or a question and a
        part, as "1.2" or "1.2 speed"
    weights : names, as above → factor of the points and of what they are out of; the weight of a part replaces that of
        its question
    """

    drop: Annotated[tuple[_Name, ...], Field(min_length=1)] = ()
    weights: Mapping[_Name, Annotated[_Number, Field(ge=0.001, le=1000)]] = field(default_factory=dict)

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
    """Return the entry of ``names`` that names a part ("1.2 speed"), else its question ("1.2"); "" if none does."""
    return next((name for name in (f"{question} {part}", question) if name in names), "")


@dataclass(frozen=True)
class LevelSettings:
    """Levels of answers: 4, the best, to 1; and 0 for an answer that earns nothing.

    Attributes
    ----------
    shares : level → the share (0 to 1) of the points that it is worth
    thresholds : level → the least share of the points that has this level; no points are level 0
    """

    shares: Annotated[Mapping[int, float], PlainValidator(partial(_shares, _SHARES))] = field(
        default_factory=lambda: _SHARES
    )
    thresholds: Annotated[Mapping[int, float], PlainValidator(partial(_shares, _THRESHOLDS))] = field(
        default_factory=lambda: _THRESHOLDS
    )

    def level_of(self, share: float) -> int:
        """Return the level of a share (0 to 1) of the points: the highest threshold that is reached; 0 for none."""
        earned = round(share, SHARE_DIGITS)
        reached = (level for level, least in self.thresholds.items() if earned >= round(least, SHARE_DIGITS))
        return max(reached, default=0) if earned > 0 else 0


@dataclass(frozen=True)
class Assignment:
    """What is handed in together, and has a column of its own.

    Attributes
    ----------
    title : for people
    notebooks : names, without their ending
    due : deadline for everybody (the last moment that is in time); None without one
    out_of : possible points of its column; None for the possible points of its notebooks
    """

    title: _Name
    notebooks: Annotated[tuple[_Notebook, ...], Field(min_length=1)]
    due: _End | None = None
    out_of: Annotated[_Number, Field(ge=0.001, le=1000)] | None = None


@dataclass(frozen=True)
class Deadline:
    """When notebooks are due.

    Attributes
    ----------
    due : the last moment that is in time
    notebooks : names, without their ending
    section : section of the roster that the deadline is for; "" for all
    assignments : titles; without these and ``notebooks``, the deadline is for all notebooks of the course
    """

    due: _End
    notebooks: Annotated[tuple[_Notebook, ...], Field(min_length=1)] = ()
    section: _Name = ""
    assignments: Annotated[tuple[_Name, ...], Field(min_length=1)] = ()


@dataclass(frozen=True)
class Extension:
    """More time for some students.

    Attributes
    ----------
    until : the last moment that is in time
    students : IDs, or other names that the roster has for them
    section : section of the roster with students who all have more time, too; "" for the named students alone
    notebooks : names, without their ending
    assignments : titles; without these and ``notebooks``, the extension is for all notebooks of the course
    """

    until: _End
    students: Annotated[tuple[_Name, ...], Field(min_length=1)] = ()
    section: _Name = ""
    notebooks: Annotated[tuple[_Notebook, ...], Field(min_length=1)] = ()
    assignments: Annotated[tuple[_Name, ...], Field(min_length=1)] = ()


@dataclass(frozen=True)
class LateSettings:
    """What lateness costs.

    Attributes
    ----------
    per_day : what each day that has begun costs, in % of the points that a notebook earned
    cap : the most that lateness costs, in % of these points
    grace_hours : hours after the deadline in which lateness costs nothing; days are counted from their end on
    """

    per_day: _Percent = 0.0
    cap: _Percent = 100.0
    grace_hours: Annotated[_Number, Field(ge=0, le=1000)] = 0.0


@dataclass(frozen=True)
class OutcomeSettings:
    """When an outcome counts as attained.

    Attributes
    ----------
    level : that a student has to reach in the outcome
    share : how many of the students have to reach it, in %
    fewest : number of students in the smallest group that is shown
    """

    level: Annotated[_Whole, Field(ge=1, le=4)] = 3
    share: _Percent = 70.0
    fewest: Annotated[_Whole, Field(ge=1, le=1000)] = 5


@dataclass(frozen=True)
class _Bench:
    """The table ``bench`` of the file; its entries are fields of :class:`labcourse.benches.BenchPolicy`."""

    which: Literal["own", "same", "preset", "real"] = "own"
    seed: Annotated[_Whole, Field(ge=0, le=MOST_SEED)] = 0
    preset: _Name = ""
    benches: Annotated[tuple[_Name, ...], Field(min_length=1)] = ()


def _bench_schema(_type: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
    """Return pydantic's schema of a BenchPolicy: the file's table, as :class:`_Bench`, is checked and converted."""
    return no_info_after_validator_function(lambda bench: BenchPolicy(**vars(bench)), handler(_Bench))


def _in_table(table: str, entry: str) -> Any:
    """Return the pydantic field for an entry of a table that has no class of its own."""
    return Field(validation_alias=AliasPath(table, entry))


@dataclass(frozen=True)
class CourseSettings:
    """What is decided of a course for a term.

    Attributes
    ----------
    title : of the course, for people; "" leaves it to ``course.py``
    term : as "2026 autumn"
    python : version that grades, major and minor; "" for the one that makes the release
    bench : which bench each student has
    optional : names of the optional notebooks that the class has, without their ending
    without : names of the other notebooks that the class does not have
    feedback : what students see of their marks, and when
    reflect : whether and when students are asked about contradictions between their answers
    report : what their lab reports may be like
    releases : the folder in which releases are stored, relative to the folder above the course's
    marks : what counts, and by how much
    levels : what levels are worth, and their thresholds
    assignments : those in the file; :func:`labcourse.grading.assignments.of_course` adds the others
    deadlines, extensions : what is due when, and who has more time
    late : what lateness costs
    outcomes : when an outcome counts as attained
    """

    title: Annotated[_Name, _in_table("course", "title")] = ""
    term: Annotated[_Line, _in_table("course", "term")] = ""
    python: Annotated[str, Strict(), Field(pattern=r"^3\.[0-9]{1,2}$"), _in_table("course", "python")] = ""
    bench: Annotated[BenchPolicy, GetPydanticSchema(_bench_schema)] = THEIR_OWN
    optional: Annotated[tuple[_Notebook, ...], _in_table("optional", "notebooks")] = ()
    without: Annotated[tuple[_Notebook, ...], _in_table("optional", "without")] = ()
    feedback: FeedbackSettings = FeedbackSettings()
    reflect: ReflectSettings = ReflectSettings()
    report: ReportSettings = ReportSettings()
    releases: Annotated[_Name, _in_table("releases", "folder")] = "releases"
    marks: MarkSettings = field(default_factory=MarkSettings)
    levels: LevelSettings = field(default_factory=LevelSettings)
    assignments: Annotated[tuple[Assignment, ...], Field(validation_alias="assignment")] = ()
    deadlines: Annotated[tuple[Deadline, ...], Field(validation_alias="deadline")] = ()
    extensions: Annotated[tuple[Extension, ...], Field(validation_alias="extension")] = ()
    late: LateSettings = LateSettings()
    outcomes: OutcomeSettings = OutcomeSettings()

    @property
    def dues(self) -> tuple[Deadline, ...]:
        """All deadlines: those of assignments, and those in tables of their own."""
        of_assignments = (Deadline(one.due, one.notebooks) for one in self.assignments if one.due is not None)
        return (*of_assignments, *self.deadlines)

    def notebooks_of(self, rule: Deadline | Extension) -> frozenset[str]:
        """Return the notebooks that a deadline or an extension is for, without ending; an empty set stands for all."""
        of_assignments = (name for one in self.assignments if one.title in rule.assignments for name in one.notebooks)
        return frozenset([*rule.notebooks, *of_assignments])

    def of_marking(self) -> CourseSettings:
        """Return a copy with defaults in place of what the marking of answers does not depend on.

        Settings with equal copies mark alike. (Marking does not depend on ``without``, because each run stores what was
        asked.)
        """
        defaults = CourseSettings()
        unmarked = ("python", "without", "feedback", "report", "marks", "levels", "deadlines", "extensions", "late")
        more = ("assignments", "outcomes")
        return replace(self, **{name: getattr(defaults, name) for name in (*unmarked, *more)})


# --- from the file to the settings ------------------------------------------------------------------------------------


def read_toml(file: Path) -> dict[str, Any]:
    """Read a TOML file of the course's folder, which a person wrote.

    Raises
    ------
    OSError
        If it cannot be read.
    GradingError
        If it is not TOML.
    """
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:  # also of text that is not UTF-8
        raise GradingError(f"{file} is not TOML: {error}") from None


def refuse(file: Path, faults: Iterable[str]) -> None:
    """Raise GradingError if there are faults in a file; the message lists each."""
    if lines := list(faults):
        raise GradingError("\n  ".join([f"{file} cannot be used:", *lines]))


def read(
    folder: Path,
    presets: Collection[str] = (),
    draw: int | None = None,
    benches: Mapping[str, str] | None = None,
    catalogue: Catalogue | None = None,
) -> CourseSettings:
    """Read the settings of the course in a folder; without a file, they are the defaults.

    Parameters
    ----------
    folder : of the course
    presets : names of the benches that all students may be given
    draw : version of how the course draws benches
    benches : name of each of the laboratory's benches with known truth → what is wrong with its file; "" for nothing
    catalogue : of the course's questions, to check names of questions and notebooks; without it they are not checked

    Returns
    -------
    CourseSettings
        What the file says, and defaults for the rest.

    Raises
    ------
    GradingError
        If the file is not TOML, or an entry is wrong. The message has a line for each wrong entry: table, entry, and
        what is wrong.
    OSError
        If the file cannot be read.
    """
    file = folder / SETTINGS_FILE
    data = read_toml(file) if file.exists() else {}
    faults = dict(_unknown_entries(data))
    try:
        settings = TypeAdapter(CourseSettings).validate_python(data)
    except Invalid as error:
        for details in error.errors():
            faults.setdefault(*_refused_entry(details))
    _refuse_places(file, faults.items())
    settings = replace(settings, bench=replace(settings.bench, draw=draw))
    bench = _bench_faults(data.get("bench", {}), presets, benches or {})
    names = () if catalogue is None else _unknown_names(settings, catalogue)
    _refuse_places(file, [*bench, *_contradictions(data, settings), *names])
    return settings


# --- faults, with their places ----------------------------------------------------------------------------------------

#: Tables of which there may be several.
_ROWS: Mapping[str, type] = {"assignment": Assignment, "deadline": Deadline, "extension": Extension}
_TABLES: Mapping[str, type] = {
    **{"bench": _Bench, "feedback": FeedbackSettings, "reflect": ReflectSettings, "report": ReportSettings},
    **{"marks": MarkSettings, "levels": LevelSettings, "late": LateSettings, "outcomes": OutcomeSettings, **_ROWS},
}
#: Table → names of its entries.
_ENTRIES: Mapping[str, list[str]] = {
    **{"course": ["title", "term", "python"], "optional": ["notebooks", "without"], "releases": ["folder"]},
    **{name: ["from" if entry.name == "opens" else entry.name for entry in fields(t)] for name, t in _TABLES.items()},
}


def _refuse_places(file: Path, faults: Iterable[Fault]) -> None:
    """Raise GradingError if there are faults of the settings file; the message lists each with its table and entry."""
    refuse(file, (f"{_dotted(place)}: {fault}" for place, fault in faults))


def _dotted(place: EntryPath) -> str:
    """Return the place of an entry as text: "feedback.from", or "deadline 1.due", counted from 1."""
    return "".join(f" {part + 1}" if isinstance(part, int) else f".{part}" for part in place)[1:]


def _unknown_entries(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield a fault for each table and entry that does not exist, and for each that should be a table and is not."""
    for table, content in data.items():
        rows = content if table in _ROWS else [content]
        if table not in _ENTRIES:
            homes = [f"It belongs under [{home}]. " for home, names in _ENTRIES.items() if table in names]
            yield (table,), f"there is no such table. {(*homes, '')[0]}{_suggestion(table, [*_ENTRIES])}"
        elif not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            heading = f"[[{table}]]" if table in _ROWS else f"[{table}]"
            yield (table,), f"it should be a table: a line {heading}, and its entries below."
        else:
            for number, row in enumerate(rows):
                for name in row.keys() - _ENTRIES[table]:
                    place = (table, number, name) if table in _ROWS else (table, name)
                    yield place, f"there is no such entry. {_suggestion(name, _ENTRIES[table])}"


def _suggestion(name: str, known: Sequence[str]) -> str:
    """Return a text that suggests the most similar known name, if one is similar, and lists all."""
    near = "".join(f"Did you mean {match}? " for match in get_close_matches(name, known, 1))
    return f"{near}There are {', '.join(known)}."


def _refused_entry(details: ErrorDetails) -> Fault:
    """Return the fault for an error of pydantic's: what is expected, and what is there."""
    place: EntryPath = details["loc"][: 3 if details["loc"][0] in _ROWS else 2]
    if not isinstance(place[-1], str):
        place = place[:1]  # a row is no table: the fault of _unknown_entries replaces this one
    message = details["msg"].removeprefix("Value error, ").replace("a valid tuple", "a list, in brackets")
    value = details["input"]
    shown = str(value) if isinstance(value, date | time) else ascii(value)
    return place, "it is missing." if details["type"] == "missing" else f"{message}; it is {shown:.80}."


def _name_list(names: Collection[str]) -> str:
    """Return names as text, in quotes and sorted; "none" if there are none."""
    return ", ".join(json.dumps(name) for name in sorted(names)) or "none"


def _bench_faults(bench: Mapping[str, Any], presets: Collection[str], benches: Mapping[str, str]) -> Iterator[Fault]:
    """Yield faults of the table ``bench``: entries that do not fit ``which``, and benches that cannot be used.

    Parameters
    ----------
    bench : the table as it stands in the file
    presets, benches : as for :func:`read`
    """
    which = bench.get("which", OWN)
    for name, needed_by in (("seed", SAME), ("preset", PRESET), ("benches", REAL)):
        if which == needed_by and name not in bench:
            yield ("bench", name), f'it is missing: which = "{which}" needs it.'
        elif which != needed_by and name in bench:
            yield ("bench", name), f'it goes with which = "{needed_by}", and which is "{which}". Leave one of them out.'
    if which == PRESET and bench.get("preset", "") not in {*presets, ""}:
        yield ("bench", "preset"), f"the course has no bench {bench['preset']!a}; it has {_name_list(presets)}."
    for name in bench.get("benches", ()):
        missing = f"the course does not have the truth of {name!a}; it has that of {_name_list(benches)}."
        if fault := benches.get(name, missing):
            yield ("bench", "benches"), fault


def _contradictions(data: Mapping[str, Any], settings: CourseSettings) -> Iterator[Fault]:
    """Yield a fault for each entry that has no effect or contradicts others; ``data`` is the content of the file."""
    if "late" in data and not settings.dues:
        add = "Add due to an [[assignment]], add a [[deadline]], or leave [late] out."
        yield ("late",), f"nothing has a deadline, so that nothing can be late. {add}"
    for number, extension in enumerate(settings.extensions):
        if not extension.students and not extension.section:
            yield (
                ("extension", number),
                "it is for nobody. Add students or a section; for everybody, move the deadline.",
            )
        some = settings.notebooks_of(extension)
        extended = ((one.due, settings.notebooks_of(one)) for one in settings.dues)
        due = [moment for moment, names in extended if not some or not names or some & names]
        if not due:
            yield ("extension", number), "these notebooks have no deadline, so that nothing is extended."
        elif extension.until <= min(due):
            dates = (
                f"{extension.until:%Y-%m-%d %H:%M}; the notebooks are due on {min(due):%Y-%m-%d %H:%M} at the earliest"
            )
            yield ("extension", number, "until"), f"it gives nobody more time: it is {dates}. Is the year right?"
    levels = settings.levels
    for level, share in levels.shares.items():
        if share and (reached := levels.level_of(share)) != level:
            worth = f"level {level} is worth {100 * share:g} % of the points, which the thresholds make level {reached}"
            yield ("levels",), f"{worth}. Let them agree; what you leave out has its default."


def _unknown_names(settings: CourseSettings, catalogue: Catalogue) -> Iterator[Fault]:
    """Yield a fault for each name of a notebook, assignment, question or part that does not exist, or is off."""
    rows: list[tuple[EntryPath, Assignment | Deadline | Extension]] = []
    rows += [(("assignment", number), row) for number, row in enumerate(settings.assignments)]
    rows += [(("deadline", number), row) for number, row in enumerate(settings.deadlines)]
    rows += [(("extension", number), row) for number, row in enumerate(settings.extensions)]
    titles = [assignment.title for assignment in settings.assignments]
    others = {*catalogue.notebooks}.difference(catalogue.optional)
    yield from _missing(("optional", "notebooks"), settings.optional, catalogue.optional, "optional notebook")
    yield from _missing(("optional", "without"), settings.without, others, "such notebook")
    off = {*catalogue.optional}.difference(settings.optional)
    for place, row in rows:
        yield from _missing((*place, "notebooks"), row.notebooks, catalogue.notebooks, "notebook")
        yield from (((*place, "notebooks"), _OFF.format(name)) for name in row.notebooks if name in off)
        yield from _missing((*place, "assignments"), getattr(row, "assignments", ()), titles, "[[assignment]]")
    yield from _doubled(settings.assignments)
    for entry, names in (("drop", settings.marks.drop), ("weights", tuple(settings.marks.weights))):
        for name in names:
            question, _space, part = name.rpartition(" ")
            is_part = name not in catalogue.marked and question in catalogue.marked
            try:
                found = catalogue.find_marked(question if is_part else name)
                if is_part:
                    found.part(part)
            except AnswerError as error:
                yield ("marks", entry), str(error)
            else:
                if found.notebook in off:
                    yield ("marks", entry), f"{name} is in {found.notebook}. {_OFF.format(found.notebook)}"


def _missing(place: EntryPath, names: Iterable[str], known: Collection[str], what: str) -> Iterator[Fault]:
    """Yield a fault, at a place, for each of ``names`` that is not known; ``what`` says what they should name."""
    for name in sorted({*names}.difference(known)):
        yield place, f"there is no {what} {name!a}; there are: {_name_list(known)}."


_OFF = "{} is optional, and the class does not have it. Name it in [optional] notebooks, or leave this entry out."


def _doubled(assignments: Sequence[Assignment]) -> Iterator[Fault]:
    """Yield a fault for each title or notebook of an assignment that an earlier one, or the same, has already."""
    taken: dict[tuple[str, str], str] = {}
    for number, assignment in enumerate(assignments):
        entries = [("title", assignment.title), *(("notebooks", name) for name in assignment.notebooks)]
        for entry in entries:
            if entry in taken:
                yield ("assignment", number, entry[0]), f"{entry[1]!a} is in assignment {taken[entry]!a} already."
            taken[entry] = assignment.title
