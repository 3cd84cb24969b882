"""What a mark depends on, by content: the course, and all code that may have a part in marking."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import rotflex
from rotflex.courseware.files import ANSWERS_FILE
from rotflex.instructor.course import Course, package_folder

_PACKAGE = Path(rotflex.__file__).parent
#: What marks are made for, run from and kept in, but not made by. Whatever is not named here counts: to forget a name
#: costs time, and no mark.
_NO_PART = tuple(_PACKAGE / "instructor" / name for name in ("gradebook", "isolation", "release", "reports", "running"))

_NOT_OF_THE_KEY = (".ipynb", ".pyc")  # suffixes, in the course's folder; what is run is known by itself


def marking_digest(course: Course) -> str:
    """Another digest is another way of marking: answers are marked again, without being run again.

    It covers the course's folder, but for its notebooks (a key may read a table that lies beside it); the modules of
    the packages that students get (the truth of a bench is made of them); and of this package, those that mark.
    """
    digest = hashlib.sha256()
    for path in _files(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files(course: Course) -> Iterator[Path]:
    for path in sorted(course.folder.rglob("*")):
        hidden = any(part.startswith((".", "__")) for part in path.relative_to(course.folder).parts[:-1])
        if path.is_file() and not hidden and path.suffix not in _NOT_OF_THE_KEY and path.name != ANSWERS_FILE:
            yield path
    for folder in dict.fromkeys([_PACKAGE, *map(package_folder, course.packages)]):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NO_PART):
                yield path
