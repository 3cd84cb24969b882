"""Find where a person who is erased is still named, for the instructor to decide."""

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
    """Yield the files of a folder of results that name somebody, and those that cannot be read."""
    person = Person(about, 0)
    for path in sorted(folder.rglob("*")) if folder.is_dir() else ():
        if not path.is_file() or path.name.startswith(GRADEBOOK_FILE):
            continue
        if person.named_in(str(path.relative_to(folder))):
            yield f"{path}: its name"
        elif path.suffix.lower() not in _UNREADABLE:  # those of this software go with the folder of their student
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
        files = packed.infolist()
        if any(file.file_size > MOST_BYTES for file in files):
            raise OSError
        return any(person.named_in(file.filename) or person.named_in(packed.read(file)) for file in files)


def in_submissions(submissions: Path, book: Gradebook, student: str) -> Iterator[str]:
    """Yield what a person handed in of a folder of submissions. The person has to be in the gradebook still."""
    enrolled = [about for about in book.students() if about.enrolled]
    for submission in intake.find(submissions, enrolled).submissions:
        paths = [submissions / piece.source for piece in submission.pieces]
        if caseless(submission.student) == caseless(student):
            yield from map(str, paths)
        elif caseless(student) in map(caseless, (submission.bench_of, *submission.partners)):
            yield from (f"{path}, which is also {submission.student}'s" for path in paths)


def in_settings(course: Course, about: StudentRecord) -> Iterator[str]:
    """Yield where the course's settings name somebody."""
    names = set(map(caseless, (about.student, *about.aliases)))
    for extension in course.settings.extensions:
        if names & set(map(caseless, extension.students)):
            yield f"course.toml, in an extension until {extension.until:%Y-%m-%d}"
