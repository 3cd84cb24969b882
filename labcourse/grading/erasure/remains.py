"""Where a person who is erased is named still, as far as it can be looked: it is told, and is somebody's to decide."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

from labcourse.grading import intake
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.gradebook.persons import Person
from labcourse.student_id import GRADEBOOK_FILE, caseless

_ZIPS = (".zip", ".xlsx", ".docx", ".ods", ".odt")
_UNREADABLE = (".pdf", ".png", ".jpg")  # in which letters do not stand as such
MOST_BYTES = 50_000_000  #: of a file that is looked into; a class's answers in a spreadsheet, as scoring takes them


def in_folder(folder: Path, about: StudentRecord) -> Iterator[str]:
    """The files of a folder of results that name somebody, and those that cannot be looked into, in words."""
    person = Person(about, 0)
    for path in sorted(folder.rglob("*")) if folder.is_dir() else ():
        if not path.is_file() or path.name.startswith(GRADEBOOK_FILE):
            continue
        if person.named_in(str(path.relative_to(folder))):
            yield f"{path}: its name"
        elif path.suffix.lower() in _UNREADABLE:
            continue  # those of this software go with the folder of their student
        else:
            try:
                if _names(path, person):
                    yield str(path)
            except (OSError, zipfile.BadZipFile, RuntimeError):
                yield f"{path} (it could not be looked into)"


def _names(path: Path, person: Person) -> bool:
    if path.suffix.lower() not in _ZIPS:
        if path.stat().st_size > MOST_BYTES:
            raise OSError
        return person.named_in(path.read_bytes())
    with zipfile.ZipFile(path) as packed:
        if any(one.file_size > MOST_BYTES for one in packed.infolist()):
            raise OSError
        return any(person.named_in(one.filename) or person.named_in(packed.read(one)) for one in packed.infolist())


def in_submissions(submissions: Path, book: Gradebook, student: str) -> Iterator[str]:
    """What a folder of submissions holds that is a person's, in words. The person has to be in the gradebook still."""
    for one in intake.find(submissions, [about for about in book.students() if about.enrolled]).submissions:
        if caseless(one.student) == caseless(student):
            yield from (str(submissions / piece.source) for piece in one.pieces)
        elif caseless(student) in map(caseless, (one.bench_of, *one.partners)):
            for piece in one.pieces:
                yield f"{submissions / piece.source}, which is also {one.student}'s"


def in_settings(course: Course, about: StudentRecord) -> Iterator[str]:
    """Where the course's settings name somebody, in words."""
    known_by = {caseless(one) for one in (about.student, *about.aliases)}
    for one in course.settings.extensions:
        if known_by & set(map(caseless, one.students)):
            yield f"course.toml, in an extension until {one.until:%Y-%m-%d}"
