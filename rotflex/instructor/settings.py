"""A course's settings: ``course.toml`` in its folder, what an instructor decides for a term without any Python."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from rotflex.courseware import course_file
from rotflex.courseware.benches import (
    MOST_SEED,
    OWN,
    PRESET,
    REAL,
    SAME,
    THEIR_OWN,
    WHICH,
    BenchPolicy,
    is_names,
    is_seed,
)
from rotflex.courseware.messages import _
from rotflex.errors import GradingError

SETTINGS_FILE = "course.toml"  #: in the course's folder; there need not be one
_LONGEST = 120  # characters of a title


@dataclass(frozen=True)
class FeedbackSettings:
    """What students see of their marks, and when. (Never what the key has for right.)

    Attributes
    ----------
    points : how many points each answer earned
    reasons : what the key says to it, besides whether it was right
    opens : when it may be seen; at once where it is None
    """

    points: bool = True
    reasons: bool = True
    opens: datetime | None = None

    def is_open(self, now: datetime) -> bool:
        """Whether students may see it at a time, which knows its time zone."""
        return self.opens is None or now >= self.opens


@dataclass(frozen=True)
class ReflectSettings:
    """Whether and when ``lab.reflect()`` asks students about what in their own answers does not go together.

    Attributes
    ----------
    asks : whether it does
    opens : from when on; at once where it is None
    """

    asks: bool = True
    opens: datetime | None = None

    def plain(self) -> str:
        """What stands under "reflect" in ``course.json``."""
        if not self.asks:
            return course_file.OFF
        return course_file.ON if self.opens is None else self.opens.isoformat()


@dataclass(frozen=True)
class CourseSettings:
    """What is decided of a course for a term.

    Attributes
    ----------
    title : of the course, for people; "" leaves it to ``course.py``
    term : as "2026 autumn"
    bench : which bench each student has
    feedback : what students see of their marks, and when
    reflect : whether and when their own answers are held against each other for them
    releases : the folder in which releases are kept, from the one above the course's
    """

    title: str = ""
    term: str = ""
    bench: BenchPolicy = THEIR_OWN
    feedback: FeedbackSettings = field(default_factory=FeedbackSettings)
    reflect: ReflectSettings = field(default_factory=ReflectSettings)
    releases: str = "releases"


@dataclass(frozen=True)
class _Entry:
    """What may stand under a name."""

    expected: str
    example: str
    fits: Callable[[Any], bool]


def _is_line(value: object) -> bool:
    return isinstance(value, str) and value.isprintable() and len(value) <= _LONGEST and value == value.strip()


def _is_bool(value: object) -> bool:
    return isinstance(value, bool)


def _is_date(value: object) -> bool:
    return isinstance(value, date)  # a date and time is one, too


_LINE = _("a line of text of at most {longest} characters").format(longest=_LONGEST)
_ENTRIES: Mapping[str, Mapping[str, _Entry]] = {
    "course": {
        "title": _Entry(_LINE, 'title = "Control laboratory"', lambda value: _is_line(value) and bool(value)),
        "term": _Entry(_LINE, 'term = "2026 autumn"', _is_line),
    },
    "bench": {
        "which": _Entry('"own", "same", "preset" or "real"', 'which = "own"', lambda value: value in WHICH),
        "seed": _Entry(_("a whole number from 0 to {most}").format(most=MOST_SEED), "seed = 2026", is_seed),
        "preset": _Entry(
            _("the name of a bench"), 'preset = "workshop"', lambda value: _is_line(value) and bool(value)
        ),
        "benches": _Entry(
            _("names of the laboratory's benches"), 'benches = ["north"]', lambda value: is_names(value) and bool(value)
        ),
    },
    "feedback": {
        "points": _Entry(_("true or false"), "points = true", _is_bool),
        "reasons": _Entry(_("true or false"), "reasons = true", _is_bool),
        "from": _Entry(_("a date, or a date and time"), "from = 2026-12-01T12:00:00+01:00", _is_date),
    },
    "reflect": {
        "asks": _Entry(_("true or false"), "asks = true", _is_bool),
        "from": _Entry(_("a date, or a date and time"), "from = 2026-11-02T08:00:00+01:00", _is_date),
    },
    "releases": {
        "folder": _Entry(
            _("the path of a folder"), 'folder = "releases"', lambda value: _is_line(value) and bool(value)
        ),
    },
}


def read(
    folder: Path,
    presets: Collection[str] = (),
    draw: int = THEIR_OWN.draw,
    benches: Mapping[str, str] | None = None,
) -> CourseSettings:
    """The settings of the course in a folder; the usual ones where there is no file.

    Parameters
    ----------
    folder : of the course
    presets : names of the benches that the course has
    draw : version of how the course draws benches
    benches : names of the laboratory's benches whose truth the course has, and what is wrong with its file, if anything

    Raises
    ------
    GradingError
        If the file cannot be read, or not all of it is understood: each fault is told, with what is expected.
    """
    file = folder / SETTINGS_FILE
    try:
        content = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        content = ""
    except (OSError, ValueError) as error:
        raise GradingError(_("{file} cannot be read: {error}").format(file=file, error=error)) from None
    try:
        found = tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise GradingError(_("{file} is not TOML: {error}").format(file=file, error=error)) from None
    faults = [*_misfits(found)] or [*_contradictions(found, presets, benches or {})]
    if faults:
        raise GradingError("\n  ".join([_("{file} cannot be used:").format(file=file), *faults]))
    return _settings(found, draw)


def _misfits(found: Mapping[str, Any]) -> Iterator[str]:
    """Unknown names, and values of another form than is expected."""
    for section, given in found.items():
        entries = _ENTRIES.get(section)
        if entries is None:
            places = [f"[{name}]" for name, known in _ENTRIES.items() if section in known]
            hint = _("it belongs under {place}").format(place=places[0]) if places else _known(_ENTRIES, "[{}]")
            yield _("{key}: there is no such section; {hint}.").format(key=section, hint=hint)
        elif not isinstance(given, Mapping):
            yield _("{key}: it should be a section, a line [{key}] with its entries below.").format(key=section)
        else:
            for name, value in given.items():
                entry = entries.get(name)
                if entry is None:
                    yield _("{key}: there is no such entry; {known}.").format(
                        key=f"{section}.{name}", known=_known(entries, "{}")
                    )
                elif not entry.fits(value):
                    yield _wanted(section, name, _("it is {value!a:.80}, and should be").format(value=value))


def _known(names: Collection[str], form: str) -> str:
    return _("there are {names}").format(names=", ".join(form.format(name) for name in names))


def _wanted(section: str, name: str, what: str) -> str:
    """A fault in an entry, with what is expected there, and an example."""
    entry = _ENTRIES[section][name]
    return _("{key}: {what} {expected}, as in: {example}").format(
        key=f"{section}.{name}", what=what, expected=entry.expected, example=entry.example
    )


def _contradictions(found: Mapping[str, Any], presets: Collection[str], benches: Mapping[str, str]) -> Iterator[str]:
    """Entries that do not go with each other, or with the course."""
    bench = found.get("bench", {})
    which = bench.get("which", OWN)
    for name, needed_by in (("seed", SAME), ("preset", PRESET), ("benches", REAL)):
        if which == needed_by and name not in bench:
            missing = _('which = "{which}" needs it. It should be').format(which=which)
            yield _wanted("bench", name, missing)
        elif which != needed_by and name in bench:
            yield _(
                'bench.{name}: it goes with which = "{needed}", and which is "{which}". Leave one of them out.'
            ).format(name=name, needed=needed_by, which=which)
    if which == PRESET and "preset" in bench and bench["preset"] not in presets:
        known = ", ".join(json.dumps(name) for name in sorted(presets)) or _("none")
        yield _("bench.preset: the course has no bench {name!a}; it has {known}.").format(
            name=bench["preset"], known=known
        )
    for name in bench.get("benches", ()):
        if name not in benches:
            known = ", ".join(json.dumps(one) for one in sorted(benches)) or _("none")
            yield _("bench.benches: of {name!a} the course has no truth; it has that of {known}.").format(
                name=name, known=known
            )
        elif benches[name]:
            yield _("bench.benches: {fault}").format(fault=benches[name])
    reflect = found.get("reflect", {})
    if not reflect.get("asks", True) and "from" in reflect:
        yield _("reflect.from: it goes with asks = true, and asks is false. Leave one of them out.")


def _settings(found: Mapping[str, Any], draw: int) -> CourseSettings:
    about, bench, seen, reflect = (found.get(section, {}) for section in ("course", "bench", "feedback", "reflect"))
    usual = CourseSettings()
    return CourseSettings(
        title=about.get("title", usual.title),
        term=about.get("term", usual.term),
        bench=BenchPolicy(**bench, draw=draw),
        feedback=FeedbackSettings(
            points=seen.get("points", usual.feedback.points),
            reasons=seen.get("reasons", usual.feedback.reasons),
            opens=_instant(seen["from"]) if "from" in seen else None,
        ),
        reflect=ReflectSettings(
            asks=reflect.get("asks", usual.reflect.asks),
            opens=_instant(reflect["from"]) if "from" in reflect else None,
        ),
        releases=found.get("releases", {}).get("folder", usual.releases),
    )


def _instant(given: date) -> datetime:
    """A time that knows its zone: this computer's where none is given; the beginning of a day."""
    when = given if isinstance(given, datetime) else datetime.combine(given, time())
    return when if when.tzinfo else when.astimezone()
