"""Erase a person: from the gradebook, from the work of their partners, and from the folder of results.

The database of the gradebook is erased by :mod:`labcourse.grading.gradebook.persons`.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from labcourse import files
from labcourse.benches import OWN, SAME, BenchPolicy
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading import outcomes, overview, sheets
from labcourse.grading.course import Course
from labcourse.grading.feedback_zip import PACKED_FILE
from labcourse.grading.gradebook import Delivery, Erased, Gradebook, RunRecord, StudentRecord
from labcourse.grading.gradebook.persons import Person
from labcourse.grading.graded_run import facts_as_json, submission_of
from labcourse.grading.submission import Submission
from labcourse.student_id import GRADEBOOK_FILE, caseless

_OF_CLASS = (overview.OVERVIEW_FILE, outcomes.ATTAINMENT_FILE, outcomes.LEVELS_FILE, sheets.SHEETS_PAGE)
_NOT_SEARCHED = (".pdf", ".png", ".jpg")  # endings of files in which letters do not stand as such


def _same(student: str, other: str) -> bool:
    return caseless(student) == caseless(other)


# --- the gradebook ----------------------------------------------------------------------------------------------------


def erase(book: Gradebook, course: Course, student: str, actor: str, dry_run: bool = False) -> Erased:
    """Erase a person from the gradebook.

    Students who handed in together with the person keep their work and their marks. If their run was on the person's
    bench, which was drawn from the person's ID, the bench is stored by its seed instead, under the ID of the first of
    these partners. (Recordings of a laboratory's bench name nobody.)

    Parameters
    ----------
    book, course : the gradebook and its course
    student, actor : the person to erase, and the person who does it
    dry_run : whether only to return what would be done

    Raises
    ------
    GradebookError
        As for :meth:`labcourse.grading.gradebook.persons.Persons.erase`.
    """
    owners = [graded.run.student for graded in book.all_current() if _same(student, submission_of(graded.run).bench_of)]
    partners = sorted((owner for owner in owners if not _same(student, owner)), key=caseless)

    def change(record: RunRecord | Delivery, person: Person) -> None:
        if isinstance(record, Delivery):
            record.content = _without(record, student)
            record.folder_of = "" if _same(student, record.folder_of) else record.folder_of
            return
        submission = submission_of(record)
        _redact(submission, person)
        policy = _same_bench(submission, course, student) if _same(student, submission.bench_of) else None
        if policy is not None:
            owner = partners[0] if partners else record.student
            submission.policy, submission.bench_of = policy, owner
            if data := files.object_in(record.answers or b""):
                record.answers = json.dumps({**data, "student": owner}).encode()
            record.versions = tuple(
                {**entry, "bench_of": owner if _same(student, entry.get("bench_of", "")) else entry.get("bench_of", "")}
                for entry in record.versions
            )
        if record.cells and (facts := facts_as_json(submission)) != record.cells:
            record.cells = facts

    return book.persons.erase(student, actor, change, dry_run)


def _redact(submission: Submission, person: Person) -> None:
    """Replace the person's names in a submission: in messages, and in the students and benches that notebooks give."""
    for name in ("ended", "problems", "notes"):
        setattr(submission, name, person.redacted(getattr(submission, name)))
    submission.missing = {where: person.redacted(why) for where, why in submission.missing.items()}
    reports = submission.cell_reports
    unused = tuple((notebook, name, person.redacted(value)) for notebook, name, value in reports.unused)
    submission.cell_reports = replace(reports, unused=unused)


def _same_bench(submission: Submission, course: Course, student: str) -> BenchPolicy | None:
    """Return the policy of benches that gives a run the same bench without the student's ID; None if there is none."""
    policy = course.settings.bench if submission.policy is None else submission.policy
    if policy.which != OWN:
        return policy
    return None if course.own_seed is None else BenchPolicy(SAME, course.own_seed(student), draw=policy.draw)


def _without(file: Delivery, student: str) -> bytes:
    """Return the content of a file; of a ``course.json`` or ``answers.json``, without a student's ID."""
    data = files.object_in(file.content) if file.name in (COURSE_FILE, ANSWERS_FILE) else {}
    new = {**data, "student": ""} if _same(student, str(data.get("student"))) else {**data}
    if isinstance(data.get("with"), list):
        new["with"] = [partner for partner in data["with"] if not _same(student, str(partner))]
    return file.content if new == data else (json.dumps(new, ensure_ascii=False) + "\n").encode()


# --- the folder of results --------------------------------------------------------------------------------------------


def results_of(folder: Path, student: str) -> list[Path]:
    """Return what to delete in a folder of results: a student's folder, and files about the whole class.

    Files about the class that ``labcourse report`` writes are not among them.
    """
    inside = sorted(folder.iterdir()) if folder.is_dir() else ()
    own = [path for path in inside if path.is_dir() and _same(path.name, student)]
    return own + [folder / name for name in (*_OF_CLASS, PACKED_FILE) if (folder / name).is_file()]


def still_named_in(folder: Path, about: StudentRecord) -> Iterator[str]:
    """Yield the path of each file in a folder of results that names a person, or that cannot be searched.

    A file names them in its own name or in its content. In PDFs and pictures, only the name is looked at; the gradebook
    is not searched.
    """
    person = Person(about)
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.name.startswith(GRADEBOOK_FILE):
            try:
                if any(map(person.is_named_in, _contents(path))):
                    yield str(path)
            except (OSError, EOFError, zipfile.BadZipFile, zlib.error, RuntimeError):
                yield f"{path} (it could not be searched)"


def _contents(path: Path) -> Iterator[str | bytes]:
    """Yield the name and the content of a file; of a zip, its name, and name and content of each file in it.

    A spreadsheet is a zip. Of a PDF or a picture, only the name is yielded.
    """
    yield path.name
    if path.suffix.lower() in _NOT_SEARCHED:
        return
    if not zipfile.is_zipfile(path):
        yield path.read_bytes()
        return
    with zipfile.ZipFile(path) as packed:
        for name in packed.namelist():
            yield name
            yield packed.read(name)
