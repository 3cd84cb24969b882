"""What in ``course.toml`` does not go with each other, or with the course; each entry by itself is as it should be."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from labcourse.benches import OWN, PRESET, REAL, SAME
from labcourse.errors import AnswerError
from labcourse.grading.settings.decided import CourseSettings, Deadline, Extension
from labcourse.grading.settings.entries import SECTIONS, SEVERAL, numbered

if TYPE_CHECKING:
    from labcourse.answers.catalogue import Catalogue


@dataclass(frozen=True)
class Known:
    """What a course has, by which its settings are checked.

    Attributes
    ----------
    presets : names of benches
    benches : names of the laboratory's benches, and what is wrong with their files
    catalogue : of its questions; None if it is not known
    """

    presets: Collection[str]
    benches: Mapping[str, str]
    catalogue: Catalogue | None


def contradictions(found: Mapping[str, Any], decided: CourseSettings, known: Known) -> Iterator[str]:
    """Faults, in words.

    Parameters
    ----------
    found : what stands in the file; each entry fits
    decided : what was made of it
    known : what the course has
    """
    yield from _of_bench(found.get("bench", {}), known)
    yield from _of_given(decided, known)
    reflect = found.get("reflect", {})
    if not reflect.get("asks", True) and "from" in reflect:
        yield "reflect.from: it goes with asks = true, and asks is false. Leave one of them out."
    yield from _of_marks(decided, known)
    yield from _of_levels(decided)
    yield from _of_notebooks(found, known)
    yield from _of_deadlines(found, decided)


def _of_bench(bench: Mapping[str, Any], known: Known) -> Iterator[str]:
    which = bench.get("which", OWN)
    for name, needed_by in (("seed", SAME), ("preset", PRESET), ("benches", REAL)):
        if which == needed_by and name not in bench:
            missing = f'which = "{which}" needs it. It should be'
            yield SECTIONS["bench"][name].wanted(f"bench.{name}", missing)
        elif which != needed_by and name in bench:
            yield (f'bench.{name}: it goes with which = "{needed_by}", and which is "{which}". Leave one of them out.')
    if which == PRESET and "preset" in bench and bench["preset"] not in known.presets:
        yield f"bench.preset: the course has no bench {bench['preset']!a}; it has {_listed(known.presets)}."
    for name in bench.get("benches", ()):
        if name not in known.benches:
            yield f"bench.benches: of {name!a} the course has no truth; it has that of {_listed(known.benches)}."
        elif known.benches[name]:
            yield f"bench.benches: {known.benches[name]}"


def _of_given(decided: CourseSettings, known: Known) -> Iterator[str]:
    """What is wrong with beginning in the middle: what the course does not give, or not on such benches."""
    if not decided.given or known.catalogue is None:
        return
    there = {start.name: start for start in known.catalogue.starts}
    start = there.get(decided.given)
    if start is None:
        yield f"given.from: the course gives nothing called {decided.given!a}; it has {_listed(there)}."
    elif decided.bench.which == OWN and start.on_own_bench is None:
        yield (
            f'given.from: "{start.name}" is for classes in which everybody has the same bench. On benches of '
            "their own it could only be worked out on students' machines, by code that answers what other "
            'classes are asked. Choose [bench] which = "same" or "preset", or one bench of the laboratory\'s '
            '("real").'
        )
    elif decided.bench.which == REAL and len(decided.bench.benches) > 1:
        yield (
            f"given.from: what is given is of one bench, and [bench] names {len(decided.bench.benches)} of the "
            "laboratory's. Name one, or hand out a release for each."
        )


def _listed(names: Collection[str]) -> str:
    return ", ".join(json.dumps(name) for name in sorted(names)) or "none"


def _of_marks(decided: CourseSettings, known: Known) -> Iterator[str]:
    marks = decided.marks
    for entry, names in (("drop", marks.drop), ("weights", marks.weights)):
        for name in names:
            fault = _unknown(name, known.catalogue) if known.catalogue is not None else ""
            if fault:
                yield f"marks.{entry}: {fault}"
    for name in marks.weights:
        if name in marks.drop:
            yield f"marks.weights: {name!a} is dropped, so that it has no weight. Leave one of them out."


def _unknown(name: str, catalogue: Catalogue) -> str:
    """What is wrong with the name of a question, or of a question and a part; "" if nothing is."""
    number, _space, part = name.rpartition(" ")
    try:
        if name not in catalogue.marked and number in catalogue.marked:
            catalogue.find_marked(number).part(part)
        else:
            catalogue.find_marked(name)
    except AnswerError as error:
        return str(error)
    return ""


def _of_levels(decided: CourseSettings) -> Iterator[str]:
    for entry, of, of_level in (
        ("shares", "is worth", decided.levels.shares),
        ("thresholds", "begins at", decided.levels.thresholds),
    ):
        for lower, higher in pairwise(sorted(of_level)):
            if of_level[lower] > of_level[higher]:
                yield (
                    f"levels.{entry}: level {lower} {of} {100 * of_level[lower]:g} %, more than level {higher} "
                    f"with {100 * of_level[higher]:g} %. A higher level should have as much at least. (What you "
                    "leave out is as usual.)"
                )

    for level, worth in decided.levels.shares.items():
        counted = decided.levels.level_of(worth)
        if worth and counted != level:
            yield (
                f"levels: a person's level {level} is worth {100 * worth:g} % of the points, and by the "
                f"thresholds so many points are level {counted}. Let them agree. (What you leave out is as "
                "usual.)"
            )


def _of_notebooks(found: Mapping[str, Any], known: Known) -> Iterator[str]:
    if known.catalogue is None:
        return
    for section in SEVERAL:
        for place, one in enumerate(found.get(section, ()), 1):
            for name in one.get("notebooks", ()):
                if name.removesuffix(".ipynb") not in known.catalogue.notebooks:
                    yield (
                        f"{numbered(section, place)}.notebooks: the course has no notebook {name!a}; it has "
                        f"{_listed(known.catalogue.notebooks)}."
                    )


def _of_deadlines(found: Mapping[str, Any], decided: CourseSettings) -> Iterator[str]:
    if "late" in found and not decided.deadlines:
        yield "late: there is no [[deadline]], so that nothing can be late. Add one, or leave [late] out."
    for place, extension in enumerate(decided.extensions, 1):
        key = numbered("extension", place)
        if not extension.students and not extension.section:
            yield f"{key}: it says for nobody. Add students or a section; for everybody, move the deadline."
        extended = [one for one in decided.deadlines if _overlap(one, extension)]
        if not extended:
            yield f"{key}: there is no [[deadline]] of these notebooks, so that there is nothing to extend."
        elif extension.until <= min(one.due for one in extended):
            yield (
                f"{key}.until: it is {extension.until:%Y-%m-%d %H:%M}, which gives nobody more time: that is due "
                f"on {min(one.due for one in extended):%Y-%m-%d %H:%M} at the earliest. Is the year right?"
            )


def _overlap(deadline: Deadline, extension: Extension) -> bool:
    """Whether they are for some notebook in common."""
    if not deadline.notebooks or not extension.notebooks:
        return True
    return not set(deadline.notebooks).isdisjoint(extension.notebooks)
