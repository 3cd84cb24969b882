"""Digest of everything that a mark depends on: the course, and all code that may take part in marking."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import labcourse
from labcourse.files import ANSWERS_FILE
from labcourse.grading.course import OUTCOMES_FILE, RUBRIC_FILE, SHEETS_FILE, Course, package_folder
from labcourse.grading.settings import SETTINGS_FILE

_PACKAGE = Path(labcourse.__file__).parent
#: Folders that make no marks. All others count: a name that is forgotten here costs time, and no mark.
_NO_PART = tuple(
    _PACKAGE / "grading" / name
    for name in (
        *("accounts", "gradebook", "isolation", "outcomes", "overview", "platforms"),
        *("release", "reports", "running", "scoring"),
    )
)

#: Files of the course that do not count, by pattern: the notebooks that are run have digests of their own, also where
#: they are written as text; and by name: what a run left, what only persons mark by, what is made from marks, and the
#: settings, of which only those count that marks depend on.
_NOT_OF_THE_KEY = ("*.ipynb", "[0-9]*.py", "*.pyc")
_NAMED_APART = (ANSWERS_FILE, RUBRIC_FILE, OUTCOMES_FILE, SHEETS_FILE, SETTINGS_FILE)


def marking_digest(course: Course) -> str:
    """Return the digest of a way of marking: where it differs, answers are marked again, without another run.

    It covers the course's folder without its notebooks, its rubric and what is made from marks (a key may read a table
    that lies beside it); the settings on which marks depend, so that another deadline marks nothing again; the modules
    of the packages that students get (the true bench is made by them); and the modules of this package that mark.
    """
    digest = hashlib.sha256(repr(course.settings.of_marking()).encode())
    for path in _files(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files(course: Course) -> Iterator[Path]:
    for path in sorted(course.folder.rglob("*")):
        hidden = any(part.startswith((".", "__")) for part in path.relative_to(course.folder).parts[:-1])
        apart = hidden or path.name in _NAMED_APART or any(map(path.match, _NOT_OF_THE_KEY))
        if path.is_file() and not apart:
            yield path
    for folder in dict.fromkeys([_PACKAGE, *map(package_folder, course.packages)]):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NO_PART):
                yield path
