"""What a mark depends on, by content: the course, and all code that may have a part in marking."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import labcourse
from labcourse.files import ANSWERS_FILE
from labcourse.grading.course import OUTCOMES_FILE, RUBRIC_FILE, SHEETS_FILE, Course, package_folder
from labcourse.grading.settings import SETTINGS_FILE

_PACKAGE = Path(labcourse.__file__).parent
#: What marks are made for, run from and kept in, but not made by. Whatever is not named here counts: to forget a name
#: costs time, and no mark.
_NO_PART = tuple(
    _PACKAGE / "grading" / name
    for name in (
        *("accounts", "gradebook", "isolation", "outcomes", "overview", "platforms"),
        *("release", "reports", "running", "scoring"),
    )
)

#: In the course's folder: the notebooks that are run are known by themselves, also where they are written as text.
_NOT_OF_THE_KEY = ("*.ipynb", "[0-9]*.py", "*.pyc")
#: There, too: what a run left; what only persons mark by; what is made of marks; and what of the settings has a part is
#: taken from them.
_NAMED_APART = (ANSWERS_FILE, RUBRIC_FILE, OUTCOMES_FILE, SHEETS_FILE, SETTINGS_FILE)


def marking_digest(course: Course) -> str:
    """Another digest is another way of marking: answers are marked again, without being run again.

    It covers the course's folder, but for its notebooks, its rubric and what is made of marks (a key may read a table
    that lies beside it); of its settings those that marks depend on, so that another deadline marks nothing again; the
    modules of the packages that students get (the truth of a bench is made of them); and of this package, those that
    mark.
    """
    digest = hashlib.sha256(repr(course.settings.of_marking()).encode())
    for path in _files(course):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _files(course: Course) -> Iterator[Path]:
    for path in sorted(course.folder.rglob("*")):
        hidden = any(part.startswith((".", "__")) for part in path.relative_to(course.folder).parts[:-1])
        if (
            path.is_file()
            and not hidden
            and path.name not in _NAMED_APART
            and not any(map(path.match, _NOT_OF_THE_KEY))
        ):
            yield path
    for folder in dict.fromkeys([_PACKAGE, *map(package_folder, course.packages)]):
        for path in sorted(folder.rglob("*.py")):
            if not any(path.is_relative_to(other) for other in _NO_PART):
                yield path
