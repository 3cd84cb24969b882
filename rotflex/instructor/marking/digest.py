"""What a mark depends on, by content: the course, and all code that may have a part in marking."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import rotflex
from rotflex.instructor.course import Course, package_folder

_PACKAGE = Path(rotflex.__file__).parent
#: What marks are made for, run from and kept in, but not made by. Whatever is not named here counts: to forget a name
#: costs time, and no mark.
_NO_PART = tuple(_PACKAGE / "instructor" / name for name in ("gradebook", "isolation", "release", "reports", "running"))


def marking_digest(course: Course) -> str:
    """Another digest is another way of marking: answers are marked again, without being run again.

    It covers the modules of the course's folder and of the packages that students get (the truth of a bench is made of
    them), and of this package, those that mark.
    """
    digest = hashlib.sha256()
    for path in _files(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files(course: Course) -> Iterator[Path]:
    folders = [course.folder, _PACKAGE, *map(package_folder, course.packages)]
    for folder in dict.fromkeys(folders):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NO_PART):
                yield path
