"""Which release a submission is run and marked under: the one that it was begun with, as far as can be told.

A student's ``course.json`` names it. Loose notebooks come without, and a folder may have another than its notebooks: so
the cells that the course wrote, and that releases differ by, are looked at, too.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.answers.notebooks import HandIn, Notebook
from labcourse.course_file import RELEASE
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.release.releases import Releases
from labcourse.grading.running import bundle
from labcourse.grading.running.bundle import Bundle

_SHOWN = 60  # characters of a name that a student's file gives

Cells = frozenset[tuple[str, str]]  # notebook's file name, source


@dataclass(frozen=True)
class Chosen:
    """What a submission is to be run and marked under, and what an instructor should, or may want to, know of it."""

    bundle: Bundle
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class Bundles:
    """The bundles of a course: as it is now, and of the releases that are kept. Threads may share it.

    Parameters
    ----------
    course : the course

    Attributes
    ----------
    current : the course as it is now
    releases : those that are kept
    names : file names of the notebooks of all of them

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """

    def __init__(self, course: Course) -> None:
        self._course = course
        self.current = bundle.build(course)
        self.releases = Releases(course)
        self._older = {one.id: one for one in self.releases.all if one.id != self.current.release}
        self._cells = {self.current.release: _cells_of_course(self.current.pristine)}
        for name, one in self._older.items():
            self._cells[name] = _cells_of_course(one.notebooks())
        pristine = {name for cells in self._cells.values() for name, _source in cells}
        self.names = tuple(sorted(pristine | set(self.current.pristine)))
        self._built = {self.current.release: self.current}
        self._building = threading.Lock()

    def of(self, hand_in: HandIn) -> Chosen:
        """What a submission is to be run and marked under.

        Raises
        ------
        GradingError
            If that release cannot be read any more.
        """
        named = hand_in.course.get(RELEASE)
        named = named if isinstance(named, str) else ""
        seen = frozenset((name, cell.source.strip()) for name, cells in hand_in.notebooks.items() for cell in cells)
        closest = max(self._cells, key=lambda one: len(seen & self._cells[one]))  # the first, if there are several
        problems, notes = [], []
        meant = closest
        if named in self._cells:
            others = [one for one in self._cells if self._is_rather(seen, one, named)]
            meant = closest if closest in others else next(iter(others), named)
            if meant != named:
                notes.append(f"{COURSE_FILE} names the release {named}, but the notebooks are those of {meant}.")
        elif named:
            problems.append(
                f"{COURSE_FILE} names the release {named[:_SHOWN]!a}, which is not kept in "
                f"{self.releases.folder}: put the zip that was handed out there, and grade again. Until then, "
                f"{meant} counts, which the notebooks are most like."
            )
        if meant != self.current.release:
            notes.append(f"Run and marked under an earlier release, {meant}.")
        built = self.built(meant)
        if built.start is not None:
            given = ", ".join(f"{question} {part}" for question, part in built.start.gives)
            told = "Given to this class: {title} ({parts}). It was not asked; later answers may follow from it."
            notes.append(told.format(title=built.start.title, parts=given))
        return Chosen(built, tuple(problems), tuple(notes))

    def built(self, name: str) -> Bundle:
        """The bundle of a release.

        Raises
        ------
        GradingError
            If the release cannot be read any more.
        """
        with self._building:
            if name not in self._built:
                self._built[name] = bundle.of_release(self._older[name], self._course)
            return self._built[name]

    def _is_rather(self, seen: Cells, one: str, named: str) -> bool:
        """Whether notebooks have what is only in one release, and nothing of what is only in the named one."""
        only_one, only_named = self._cells[one] - self._cells[named], self._cells[named] - self._cells[one]
        return bool(seen & only_one) and not seen & only_named


def _cells_of_course(notebooks: Mapping[str, Any]) -> Cells:
    """What the course wrote into its notebooks, and students leave as it is."""
    found = set()
    for name, notebook in notebooks.items():
        for cell, read in zip(notebook["cells"], Notebook.read(json.dumps(notebook).encode()).cells, strict=True):
            if read.source.strip() and not cell["metadata"].get("nbgrader", {}).get("solution"):
                found.add((name, read.source.strip()))
    return frozenset(found)
