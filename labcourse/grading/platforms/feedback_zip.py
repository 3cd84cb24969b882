"""Feedback pages in a zip, under the names by which a platform takes them back.

===========  =========================================================================================================
Moodle       ``Ada Lovelace_1234567_assignsubmission_file_/feedback.html``, by the numbers of the grading worksheet
Canvas       the names of its own download of submissions; Canvas shows what comes back under the name of the file that
             was handed in, so a page goes into a zip where that was a zip
Brightspace  ``12345-678910 - Ada Lovelace - Nov 21, 2026 105 PM/feedback.html``: the folders of its own download
Blackboard   takes no files of a whole class
===========  =========================================================================================================
"""

from __future__ import annotations

import io
import re
import tempfile
import zipfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

from labcourse import program
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.intake.platforms import BRIGHTSPACE, CANVAS, MOODLE, label_of, letters
from labcourse.grading.platforms.matching import Matches
from labcourse.grading.platforms.recognised import Export
from labcourse.grading.platforms.rules import WORKSHEET
from labcourse.grading.reports.grades import FEEDBACK_FILE, Reports
from labcourse.messages import plural

_TIME = (1980, 1, 1, 0, 0, 0)  # of every file in a zip: the same pages make the same zip
_NUMBERS = re.compile(r"\d+-\d+")  # at the beginning of Brightspace's folders; those of one student are the same
_NOT_IN_A_NAME = re.compile(r'[\x00-\x1f/\\:*?"<>|_]')  # Moodle takes what is between two _ for the number


@dataclass
class Places:
    """Where in the zip each student's page goes, and who has no place, and why."""

    paths: dict[str, str] = field(default_factory=dict)
    without: dict[str, str] = field(default_factory=dict)


def places(export: Export, matches: Matches, submissions: Sequence[str] = ()) -> Places:
    """Where each student's page goes.

    Parameters
    ----------
    export, matches : the platform's file, and whose row is whose
    submissions : paths in the platform's own download of what was handed in

    Raises
    ------
    GradingError
        If the platform takes no such files, or it cannot be told how it would have them named.
    """
    if export.platform == WORKSHEET:
        return _moodle(export, matches)
    if export.platform not in (CANVAS, BRIGHTSPACE):
        raise GradingError(_why_not(export.platform))
    if not submissions:
        raise GradingError(
            f"{export.platform} takes feedback only under the names that it gave what was handed in. Download "
            "all submissions of the assignment there, and give that zip by --submissions."
        )
    return (_canvas if export.platform == CANVAS else _brightspace)(export, matches, submissions)


def _why_not(platform: str) -> str:
    if platform == MOODLE:
        return (
            "Moodle takes feedback files by the numbers of an assignment's participants, which are in its grading "
            "worksheet and not in this file. In the assignment, download the worksheet and give it by --into."
        )
    return (
        f"{platform} takes no feedback files of a whole class: they are attached one by one. Leave --feedback "
        f"out; {program.name()} report writes a page for each student."
    )


def _moodle(export: Export, matches: Matches) -> Places:
    found = Places()
    place = next(key.place for key in export.keys if key.internal)
    for row, about in matches.found.items():
        number = export.table.cell(row, place).split()[-1:]
        if not number or not number[0].isdigit():
            found.without[about.student] = "the worksheet has no number of theirs."
            continue
        name = _NOT_IN_A_NAME.sub(" ", export.name(row)).strip(" .") or "Participant"
        found.paths[about.student] = f"{name}_{number[0]}_assignsubmission_file_/{FEEDBACK_FILE}"
    return found


def _canvas(export: Export, matches: Matches, submissions: Sequence[str]) -> Places:
    place = next(key.place for key in export.keys if key.internal)
    handed_in: dict[str, list[tuple[int, str]]] = {}
    for path in submissions:
        label = label_of(PurePosixPath(path).name)
        if label is not None and label.platform == CANVAS:
            handed_in.setdefault(label.number, []).append((label.attempt, PurePosixPath(path).name))
    found = Places()
    for row, about in matches.found.items():
        there = handed_in.get(export.table.cell(row, place).strip(), [])
        fit = [one for one in there if one[1].lower().endswith((".zip", ".html"))]
        if fit:
            found.paths[about.student] = max(fit)[1]
        elif there:
            why = "Canvas would show the page as {name!r}, which it is not; only a zip or a page can take its place."
            found.without[about.student] = why.format(name=max(there)[1])
        else:
            found.without[about.student] = "nothing of theirs is in the download of submissions."
    return found


def _brightspace(export: Export, matches: Matches, submissions: Sequence[str]) -> Places:
    """By the names in the platform's own two files, where each is one student's only."""
    named: dict[str, list[int]] = {}
    for row in export.students:
        named.setdefault(letters(export.name(row)), []).append(row)
    folders: dict[int, list[tuple[datetime, str]]] = {}
    for folder in dict.fromkeys(PurePosixPath(path).parts[0] for path in submissions if "/" in path):
        label = label_of(folder)
        if label is None or label.platform != BRIGHTSPACE:
            continue
        rows = next((named[name] for name in map(letters, label.people) if name in named), [])
        if len(rows) == 1:
            folders.setdefault(rows[0], []).append((label.time or datetime.min, folder))
    found = Places()
    for row, about in matches.found.items():
        there = folders.get(row, [])
        numbers = sorted({_NUMBERS.findall(folder)[0] for _time, folder in there})
        if len(numbers) > 1:
            why = "folders of several numbers bear the name {name!r}, and may be of several students: {numbers}."
            found.without[about.student] = why.format(name=export.name(row), numbers=", ".join(numbers))
        elif there:
            found.paths[about.student] = f"{max(there)[1]}/{FEEDBACK_FILE}"
        elif len(named[letters(export.name(row))]) > 1:
            found.without[about.student] = f"several in the file are called {export.name(row)!r}."
        else:
            found.without[about.student] = "no folder of the download bears their name."
    return found


def submissions_in(path: Path) -> list[str]:
    """The paths of the files in a platform's download. Nothing of it is unpacked.

    Raises
    ------
    GradingError
        If it is no zip that can be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return [name for name in archive.namelist() if not name.endswith("/")]
    except (OSError, zipfile.BadZipFile) as error:
        raise GradingError(f"{path} cannot be read as a zip: {error}.") from None


def pages(book: Gradebook, course: Course, students: Collection[str]) -> dict[str, bytes]:
    """The feedback pages of these students, as they would be written now; of those who have none, nothing.

    Raises
    ------
    GradingError
        If students may not see feedback yet.
    """
    opens = course.settings.feedback.opens
    if opens is not None and not course.settings.feedback.is_open(datetime.now(UTC)):
        raise GradingError(
            f"Feedback opens at {opens:%Y-%m-%d %H:%M %Z} (course.toml): until then there are no pages to hand out."
        )
    with tempfile.TemporaryDirectory() as folder:
        Reports(Path(folder), course, book).write_all()
        there = {one: Path(folder) / one / FEEDBACK_FILE for one in students}
        return {student: path.read_bytes() for student, path in there.items() if path.is_file()}


def packed(where: Places, made: Mapping[str, bytes]) -> tuple[bytes, list[str]]:
    """The zip's bytes, and what there is to tell of it.

    Parameters
    ----------
    where : each student's place in it
    made : student → page
    """
    content = io.BytesIO()
    written = [student for student in where.paths if student in made]
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for student in written:
            name, page = where.paths[student], made[student]
            archive.writestr(_about(name), _zipped(page) if name.lower().endswith(".zip") else page)
    without = where.without | {one: "nothing of theirs is graded." for one in where.paths if one not in made}
    told = ["{pages} of feedback in the zip.".format(pages=plural(len(written), "{count} page", "{count} pages"))]
    told += [f"{one}: no page; {why}" for one, why in without.items()]
    return content.getvalue(), told


def _zipped(page: bytes) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_about(FEEDBACK_FILE), page)
    return content.getvalue()


def _about(name: str) -> zipfile.ZipInfo:
    about = zipfile.ZipInfo(name, _TIME)
    about.compress_type, about.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    return about
