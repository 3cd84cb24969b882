"""``course.toml`` → :class:`~labcourse.grading.settings.decided.CourseSettings`, or all that is not understood."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from datetime import date, datetime, time
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse.benches import THEIR_OWN, BenchPolicy
from labcourse.grading.settings import toml_file
from labcourse.grading.settings.contradictions import Known, contradictions
from labcourse.grading.settings.decided import (
    CourseSettings,
    Deadline,
    Extension,
    FeedbackSettings,
    LateSettings,
    LevelSettings,
    MarkSettings,
    OutcomeSettings,
    ReflectSettings,
    ReportSettings,
)
from labcourse.grading.settings.entries import misfits

if TYPE_CHECKING:  # commands are quick to say what they can do
    from labcourse.answers.catalogue import Catalogue

SETTINGS_FILE = "course.toml"  #: in the course's folder; there need not be one


def read(
    folder: Path,
    presets: Collection[str] = (),
    draw: int = THEIR_OWN.draw,
    benches: Mapping[str, str] | None = None,
    catalogue: Catalogue | None = None,
) -> CourseSettings:
    """The settings of the course in a folder; the usual ones where there is no file.

    Parameters
    ----------
    folder : of the course
    presets : names of the benches that the course has
    draw : version of how the course draws benches
    benches : names of the laboratory's benches whose truth the course has, and what is wrong with its file, if anything
    catalogue : of the course's questions, by which names of questions and notebooks are checked; they are not without

    Raises
    ------
    GradingError
        If the file cannot be read, or not all of it is understood: each fault is told, with what is expected.
    """
    file = folder / SETTINGS_FILE
    try:
        found = toml_file.read(file)
    except FileNotFoundError:
        found = {}
    toml_file.refuse(file, misfits(found))
    decided = _settings(found, draw)
    toml_file.refuse(file, contradictions(found, decided, Known(presets, benches or {}, catalogue)))
    return decided


def _settings(found: Mapping[str, Any], draw: int) -> CourseSettings:
    about, bench, seen, reflect = (found.get(section, {}) for section in ("course", "bench", "feedback", "reflect"))
    usual = CourseSettings()
    return CourseSettings(
        title=about.get("title", usual.title),
        term=about.get("term", usual.term),
        python=about.get("python", usual.python),
        bench=BenchPolicy(**bench, draw=draw),
        given=found.get("given", {}).get("from", usual.given),
        feedback=FeedbackSettings(
            points=seen.get("points", usual.feedback.points),
            reasons=seen.get("reasons", usual.feedback.reasons),
            opens=_instant(seen["from"]) if "from" in seen else None,
        ),
        reflect=ReflectSettings(
            asks=reflect.get("asks", usual.reflect.asks),
            opens=_instant(reflect["from"]) if "from" in reflect else None,
        ),
        report=ReportSettings(**found.get("report", {})),
        releases=found.get("releases", {}).get("folder", usual.releases),
        marks=_marks(found.get("marks", {})),
        levels=_levels(found.get("levels", {}), usual.levels),
        deadlines=tuple(map(_deadline, found.get("deadline", ()))),
        extensions=tuple(map(_extension, found.get("extension", ()))),
        late=LateSettings(**found.get("late", {})),
        outcomes=OutcomeSettings(**found.get("outcomes", {})),
    )


def _marks(given: Mapping[str, Any]) -> MarkSettings:
    return MarkSettings(**{**given, "drop": tuple(given.get("drop", ()))})


def _levels(given: Mapping[str, Any], usual: LevelSettings) -> LevelSettings:
    """Levels of which nothing is said are as usual. 70.7 % is 0.707, and not what lies next to it."""
    shares, thresholds = (
        {int(level): float(Decimal(str(percent)) / 100) for level, percent in given.get(name, {}).items()}
        for name in ("shares", "thresholds")
    )
    return LevelSettings({**usual.shares, **shares}, {**usual.thresholds, **thresholds})


def _deadline(given: Mapping[str, Any]) -> Deadline:
    return Deadline(_end(given["due"]), _stems(given), given.get("section", ""))


def _extension(given: Mapping[str, Any]) -> Extension:
    students = tuple(given.get("students", ()))
    return Extension(_end(given["until"]), students, given.get("section", ""), _stems(given))


def _stems(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Notebooks, without their ending, as the course's questions name them."""
    return tuple(name.removesuffix(".ipynb") for name in given.get("notebooks", ()))


def _instant(given: date) -> datetime:
    """A time that knows its zone: this computer's where none is given; the beginning of a day."""
    return _in_zone(given if isinstance(given, datetime) else datetime.combine(given, time()))


def _end(given: date) -> datetime:
    """As :func:`_instant`, but the end of a day: its last moment."""
    return _in_zone(given if isinstance(given, datetime) else datetime.combine(given, time.max))


def _in_zone(when: datetime) -> datetime:
    return when if when.tzinfo else when.astimezone()
