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
#: Modules and folders of labcourse that have no part in marking. One that is forgotten here costs time, but no mark.
_NOT_MARKING = tuple(
    _PACKAGE / "grading" / name
    for name in (
        *("accounts.py", "erasure.py", "outcomes.py", "overview.py", "platforms.py", "sheets.py"),
        *("gradebook", "intake", "isolation", "release", "reports", "running", "scoring"),
    )
)

#: Files of the course that marks do not depend on. By pattern: notebooks, also as text, because runs have digests of
#: theirs. By name: what a run left, what only persons mark by, what is made from marks, and the settings, of which
#: only those count that marks depend on.
_EXCLUDED_PATTERNS = ("*.ipynb", "[0-9]*.py", "*.pyc")
_EXCLUDED_NAMES = (ANSWERS_FILE, RUBRIC_FILE, OUTCOMES_FILE, SHEETS_FILE, SETTINGS_FILE)


def marking_digest(course: Course) -> str:
    """Return the digest of all that marks depend on. If it has changed, answers are marked again, without another run.

    It covers the course's folder without its notebooks, its rubric and what is made from marks (a key may read a table
    that lies beside it); the settings on which marks depend, so that another deadline marks nothing again; the modules
    of the packages that students get (the true bench is made by them); and the modules of this package that mark.
    """
    digest = hashlib.sha256(repr(course.settings.of_marking()).encode())
    for path in _files_that_mark(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files_that_mark(course: Course) -> Iterator[Path]:
    """Yield the files that marks depend on: of the course's folder, of labcourse, and of the students' packages."""
    for path in sorted(course.folder.rglob("*")):
        hidden = any(part.startswith((".", "__")) for part in path.relative_to(course.folder).parts[:-1])
        excluded = hidden or path.name in _EXCLUDED_NAMES or any(map(path.match, _EXCLUDED_PATTERNS))
        if path.is_file() and not excluded:
            yield path
    for folder in dict.fromkeys([_PACKAGE, *map(package_folder, course.packages)]):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NOT_MARKING):
                yield path
