"""Pack feedback pages into a zip, under the names by which a learning platform takes them."""

from __future__ import annotations

import hashlib
import json
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path, PurePosixPath

from labcourse import clock, files, program
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.roster import PARTICIPANT
from labcourse.grading.intake.platforms import BLACKBOARD, BRIGHTSPACE, CANVAS, MOODLE, Label, label_of
from labcourse.grading.platforms import WORKSHEET, Export, Matches
from labcourse.grading.release.student_course import zip_files
from labcourse.grading.reports.grades import FEEDBACK_FILE, Reports
from labcourse.messages import number_of
from labcourse.student_id import letters

PACKED_FILE = "feedback_zips.json"  #: in the folder of results, or beside the zip: which pages were packed
_NOT_IN_A_NAME = {*map(chr, range(32)), *'/\\:*?"<>|_'}  # Moodle takes what is between two _ for the number


def places(export: Export, matches: Matches, submissions: Sequence[str] = ()) -> tuple[dict[str, str], dict[str, str]]:
    """Find the names in a zip under which a platform takes feedback pages.

    Moodle goes by the participants' numbers in its grading worksheet, Canvas and Brightspace by the names in their own
    download of submissions. Blackboard takes no files of a whole class.

    Parameters
    ----------
    export, matches : the platform's file, and which row belongs to which student
    submissions : paths in the platform's download of submissions

    Returns
    -------
    dict[str, str]
        Student → path of the page in the zip.
    dict[str, str]
        Student → why there is no path for them, as a sentence.

    Raises
    ------
    GradingError
        If the platform takes no such files, or the download is needed and not given.
    """
    platform = export.platform.name
    if platform in (MOODLE, BLACKBOARD):
        raise GradingError(
            f"{platform} takes no feedback files of a whole class by this file. (Moodle does by the grading worksheet "
            f"of an assignment: give that by --into.) Leave --feedback out; {program.name()} report writes a page for "
            "each student."
        )
    if platform != WORKSHEET and not submissions:
        raise GradingError(
            f"{platform} takes feedback only under the names that it gave what was handed in. Download "
            "all submissions of the assignment there, and give that zip by --submissions."
        )
    find = {WORKSHEET: _place_in_moodle, CANVAS: _place_in_canvas, BRIGHTSPACE: _place_in_brightspace}[platform]
    paths, without = dict[str, str](), dict[str, str]()
    for row, about in matches.students.items():
        try:
            paths[about.student] = find(export, row, submissions)
        except LookupError as error:
            (without[about.student],) = error.args
    return paths, without


def _place_in_moodle(export: Export, row: int, _submissions: Sequence[str]) -> str:
    """Return the path under which Moodle takes the page of the student in a row.

    Raises
    ------
    LookupError
        If the worksheet has no number of theirs; the message is a sentence.
    """
    number = PARTICIPANT.sub("", export.under(row, "Identifier"))
    if not number.isdigit():
        raise LookupError("the worksheet has no number of theirs.")
    name = "".join(" " if sign in _NOT_IN_A_NAME else sign for sign in export.name(row)).strip(" .")
    return f"{name or 'Participant'}_{number}_assignsubmission_file_/{FEEDBACK_FILE}"


def _place_in_canvas(export: Export, row: int, submissions: Sequence[str]) -> str:
    """Return the file name under which Canvas takes the page of the student in a row: that of their newest zip or page.

    Raises
    ------
    LookupError
        If the download has neither a zip nor a page (HTML) of theirs; the message is a sentence.
    """
    there = [
        (name.lower().endswith((".zip", ".html")), label.attempt, name)
        for label, name in _labels((PurePosixPath(path).name for path in submissions), CANVAS)
        if label.number == export.under(row, "ID")
    ]
    if not there:
        raise LookupError("nothing of theirs is in the download of submissions.")
    fits, _attempt, name = max(there)
    if not fits:
        raise LookupError(f"Canvas would show the page as {name!r}; only a zip or a page can take its place.")
    return name


def _place_in_brightspace(export: Export, row: int, submissions: Sequence[str]) -> str:
    """Return the path under which Brightspace takes the page of the student in a row: in their newest folder.

    Raises
    ------
    LookupError
        If no folder of the download has their name, or if several students may have it: in the download, where each has
        a number, or in the platform's file. The message is a sentence.
    """
    own, *names = (letters(export.name(other)) for other in (row, *export.students))
    folders = {PurePosixPath(path).parts[0] for path in submissions if "/" in path}
    there = [
        (label.time or datetime.min, folder)
        for label, folder in _labels(folders, BRIGHTSPACE)
        if [name for name in map(letters, label.people) if name in names][:1] == [own]
    ]
    if not there:
        raise LookupError("no folder of the download bears their name.")
    numbers = {folder.split(" ")[0] for _time, folder in there}  # one for each student
    if len(numbers) > 1 or names.count(own) > 1:
        raise LookupError(f"{export.name(row)!r} may be the name of several students.")
    return f"{max(there)[1]}/{FEEDBACK_FILE}"


def _labels(names: Iterable[str], platform: str) -> Iterator[tuple[Label, str]]:
    """Yield the names that fit a platform's pattern, each after its parsed form."""
    labels = ((label_of(name, platform), name) for name in names)
    return ((label, name) for label, name in labels if label is not None)


def names_in(path: Path) -> list[str]:
    """Return the paths of the files in a platform's download, without unpacking it.

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


def pack(
    book: Gradebook, course: Course, paths: Mapping[str, str], without: Mapping[str, str], record: Path, all_pages: bool
) -> tuple[bytes, bytes, list[str]]:
    """Pack students' feedback pages, as they would be written now, under the names from :func:`places`.

    Leave out pages that are as they were packed before feedback was last given back: so the same command packs the same
    twice. Where the platform takes a page under the name of a zip, the page is packed into a zip of its own.

    Parameters
    ----------
    book, course : the class
    paths, without : student → path in the zip, and student → why there is none
    record : JSON file with the digests of pages that were packed, which need not exist
    all_pages : whether to pack pages that have not changed, too

    Returns
    -------
    bytes
        The zip; equal pages make equal zips. Empty if no page has changed.
    bytes
        The new content of the record: path in a zip → number of publications, digest of the page that was packed before
        the last of them, and digest of the page now.
    list[str]
        A line with the number of pages, then a line for each student without a page, with the reason.

    Raises
    ------
    GradingError
        If students may not see feedback yet.
    """
    opens = course.settings.feedback.opens
    if opens is not None and not course.settings.feedback.is_open(clock.now()):
        raise GradingError(
            f"Feedback opens at {opens:%Y-%m-%d %H:%M %Z} (course.toml): until then there are no pages to hand out."
        )
    packed = files.object_in(record.read_bytes()) if record.is_file() else {}
    count, changed = len(book.publications()), dict[str, Path]()
    with tempfile.TemporaryDirectory() as folder:
        Reports(Path(folder), course, book).write_all()
        pages = {paths[who]: Path(folder) / who / FEEDBACK_FILE for who in paths}
        there = {name: page for name, page in pages.items() if page.is_file()}
        for name, page in there.items():
            digest = hashlib.sha256(page.read_bytes()).hexdigest()
            counted, former, last = packed.get(name, (count, "", ""))
            packed[name] = (count, former if counted == count else last, digest)
            if all_pages or packed[name][1] != digest:
                changed[name] = page
            if name.lower().endswith(".zip"):
                page.write_bytes(zip_files({FEEDBACK_FILE: page}))
        data = zip_files(changed) if changed else b""
    without = {**without, **{who: "nothing of theirs is graded." for who in paths if paths[who] not in there}}
    same = f"; {len(there) - len(changed)} have not changed (--all)" if len(changed) < len(there) else ""
    first = f"{number_of(len(changed), 'page')} of feedback in the zip{same}."
    return data, json.dumps(packed).encode(), [first, *(f"{who}: no page; {why}" for who, why in without.items())]
