"""Erase a person, or copy what is stored about them.

The database of the gradebook is erased by :mod:`labcourse.grading.gradebook.persons`. Here are the runs and files of
other students in it, the folder of results, what still names the person, and the copy to which a person has a right.
"""

from __future__ import annotations

import io
import json
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse import files
from labcourse.benches import OWN, SAME, BenchPolicy
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading import intake, outcomes, overview, sheets
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, RunRecord, StudentRecord
from labcourse.grading.gradebook.persons import OfOthers, Person
from labcourse.grading.graded_run import Facts, facts_of
from labcourse.grading.reports.grades import Reports
from labcourse.student_id import GRADEBOOK_FILE, GRADES_FILE, HINTS_FILE, caseless

RECORD_FILE, HANDED_IN = "record.json", "handed_in"  #: in the copy: all rows; each version of all files
MOST_BYTES = 50_000_000  #: of a file that is searched; a class's answers in a spreadsheet
_ZIPS = (".zip", ".xlsx", ".docx", ".ods", ".odt")
_UNREADABLE = (".pdf", ".png", ".jpg")  # in which letters do not stand as such


def _same(student: str, other: str) -> bool:
    return caseless(student) == caseless(other)


# --- other students ---------------------------------------------------------------------------------------------------


def of_others(book: Gradebook, course: Course, student: str) -> OfOthers:
    """Return how other students' runs and files change when a student is erased.

    Partners keep their work and their marks. Their bench was drawn from the student's ID: it is stored by its seed
    instead, under the ID of the first of the partners. Recordings of a laboratory's bench name nobody.
    """
    owners = [graded.run.student for graded in book.all_current() if _same(student, facts_of(graded.run).bench_of)]
    first = min((owner for owner in owners if not _same(student, owner)), key=caseless, default="")

    def run(record: RunRecord, person: Person) -> RunRecord:
        before, content = facts_of(record), record.answers
        new = _redacted(before, person)
        policy = _same_bench(before, course, student) if _same(student, before.bench_of) else None
        if policy is not None:
            new = new.model_copy(update={"policy": policy, "bench_of": first or record.student})
            data = _object(content or b"")
            content = content if data is None else json.dumps({**data, "student": first or record.student}).encode()
        if new == before and content == record.answers:
            return record
        problems, notes = (tuple(map(person.redacted, texts)) for texts in (record.problems, record.notes))
        cells = new.as_json() if record.cells else ()
        return replace(record, answers=content, cells=cells, problems=problems, notes=notes)

    return OfOthers(run, _file, lambda record, person: _same(student, facts_of(record).bench_of))


def _redacted(facts: Facts, person: Person) -> Facts:
    messages = {name: tuple(map(person.redacted, getattr(facts, name))) for name in ("ended", "problems", "notes")}
    missing = [(question, part, person.redacted(why)) for question, part, why in facts.missing]
    unused = tuple((notebook, name, person.redacted(value)) for notebook, name, value in facts.reports.unused)
    reports = replace(facts.reports, unused=unused)
    return facts.model_copy(update={**messages, "missing": missing, "reports": reports})


def _same_bench(facts: Facts, course: Course, student: str) -> BenchPolicy | None:
    """Return the policy that gives the same bench without the student's ID; None if there is none."""
    policy = course.settings.bench if facts.policy is None else facts.policy
    if policy.which != OWN:
        return policy
    return None if course.own_seed is None else BenchPolicy(SAME, course.own_seed(student), draw=policy.draw)


def _object(content: bytes) -> dict[str, Any] | None:
    """Return the object in a file of JSON; None if there is none."""
    try:
        data = files.from_json(content)
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


def _file(name: str, content: bytes, person: Person) -> bytes:
    """Take the person out of a file that names its students. Other files stay as they are."""
    data = _object(content) if name in (COURSE_FILE, ANSWERS_FILE) and person.named_in(content) else None
    if data is None:
        return content
    if _same(person.student, str(data.get("student"))):
        data["student"] = ""
    if isinstance(data.get("with"), list):
        data["with"] = [partner for partner in data["with"] if not _same(person.student, str(partner))]
    return (json.dumps(data, ensure_ascii=False) + "\n").encode()


# --- the folder of results --------------------------------------------------------------------------------------------


class Results:
    """The folder of results of a gradebook.

    Parameters
    ----------
    folder : the folder; it need not be there
    course : the course
    """

    def __init__(self, folder: Path, course: Course) -> None:
        self.folder, self._course = folder, course

    def own(self, student: str) -> list[Path]:
        """Return the folders of one student alone."""
        inside = sorted(self.folder.iterdir()) if self.folder.is_dir() else ()
        return [path for path in inside if path.is_dir() and _same(path.name, student)]

    def of_class(self) -> list[Path]:
        """Return the files that are made of the whole class, if they exist."""
        return [self.folder / name for names in self._writers() for name in names if (self.folder / name).is_file()]

    def remove(self, student: str) -> None:
        """Delete the folders of one student, and the files of the whole class, until they are written anew.

        Raises
        ------
        GradingError
            If something cannot be deleted.
        """
        try:
            for folder in self.own(student):
                shutil.rmtree(folder)
            for path in self.of_class():
                path.unlink()
        except OSError as error:
            raise GradingError(
                f"{error.filename} cannot be removed: {error.strerror}. The gradebook is as it was; nobody is erased."
            ) from None

    def write(self, book: Gradebook, there: list[Path]) -> list[str]:
        """Write files of the class anew, without the student; return a sentence on each that could not be written."""
        before, unwritten = {path.name for path in there}, []
        for names, write in self._writers().items():
            if before & set(names) and book.students():
                try:
                    write(book)
                except (GradingError, OSError) as error:
                    missing = ", ".join(sorted(before & set(names)))
                    unwritten.append(f"{missing}: taken away, and not written anew. {error}")
        return unwritten

    def _writers(self) -> dict[tuple[str, ...], Callable[[Gradebook], object]]:
        """Return the names of files that are written together → what writes them."""
        folder, course = self.folder, self._course
        page, report = folder / overview.PAGE_FILE, (outcomes.ATTAINMENT_FILE, outcomes.LEVELS_FILE)
        return {
            (GRADES_FILE, HINTS_FILE): lambda book: Reports(folder, course, book).write_all(),
            (page.name,): lambda book: files.write(
                page, overview.as_page(overview.class_overview(book, course, folder))
            ),
            report: lambda book: outcomes.write_report(folder, course, book),
            (sheets.PAGE_FILE,): self._write_sheets,
        }

    def _write_sheets(self, book: Gradebook) -> None:
        """Write the sheets of students who have some: there may be sheets of a few only."""
        there = {caseless(path.parent.name) for path in self.folder.glob(f"*/{sheets.PAGE_FILE}")}
        if left := [about.student for about in book.students() if caseless(about.student) in there]:
            sheets.write(self.folder, self._course, book, left)


# --- what still names the person --------------------------------------------------------------------------------------


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
                if any(map(person.named_in, _contents(path))):
                    yield str(path)
            except (OSError, EOFError, zipfile.BadZipFile, zlib.error, RuntimeError):
                yield f"{path} (it could not be searched)"


def _contents(path: Path) -> Iterator[str | bytes]:
    """Yield the content of a file, and of a zip the names and contents in it. Raises OSError for one too large."""
    if path.suffix.lower() not in _ZIPS:
        if path.stat().st_size > MOST_BYTES:
            raise OSError
        yield path.read_bytes()
        return
    with zipfile.ZipFile(path) as packed:
        inside = packed.infolist()
        if any(file.file_size > MOST_BYTES for file in inside):
            raise OSError
        for file in inside:
            yield file.filename
            yield packed.read(file)


def in_submissions(submissions: Path, book: Gradebook, student: str) -> Iterator[str]:
    """Yield what a person handed in of a folder of submissions. The person has to be in the gradebook still."""
    enrolled = [about for about in book.students() if about.enrolled]
    for submission in intake.find(submissions, enrolled).submissions:
        paths = [submissions / piece.source for piece in submission.pieces]
        if _same(submission.student, student):
            yield from map(str, paths)
        elif caseless(student) in map(caseless, (submission.bench_of, *submission.partners)):
            yield from (f"{path}, which is also {submission.student}'s" for path in paths)


def in_settings(course: Course, about: StudentRecord) -> Iterator[str]:
    """Yield where the course's settings name somebody."""
    names = set(map(caseless, (about.student, *about.aliases)))
    for extension in course.settings.extensions:
        if names & set(map(caseless, extension.students)):
            yield f"course.toml, in an extension until {extension.until:%Y-%m-%d}"


# --- the copy ---------------------------------------------------------------------------------------------------------


def write_copy(path: Path, book: Gradebook, results: Results | None, student: str) -> int:
    """Write all that is stored about a student into a zip.

    Parameters
    ----------
    path : the zip; an older file is replaced
    book, results : where the data is
    student : ID

    Returns
    -------
    int
        How many files they handed in, each version counted.

    Raises
    ------
    GradingError
        If it cannot be written.
    GradebookError
        If there is no such student.
    """
    rows, handed_in = book.persons.everything_of(student)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr(RECORD_FILE, json.dumps(rows, indent=1, ensure_ascii=False, default=_as_json) + "\n")
        for number, file in enumerate(handed_in, start=1):
            inside = [part for part in PurePosixPath(file.name.replace("\\", "/")).parts if part not in ("..", "/")]
            made.writestr("/".join((HANDED_IN, f"{number:04} {file.received:%Y-%m-%d}", *inside)), file.content)
        base, own = (results.folder, results.own(student)) if results is not None else (Path(), [])
        for page in (page for folder in own for page in sorted(folder.rglob("*")) if page.is_file()):
            made.write(page, page.relative_to(base).as_posix())
    try:
        files.write(path, packed.getvalue())
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}.") from None
    return len(handed_in)


def _as_json(value: Any) -> Any:
    return value.isoformat() if isinstance(value, date) else bytes(value).decode("utf-8", "replace")
