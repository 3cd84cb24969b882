"""Submissions: which there are, and the source of their answer cells.

A submission is a folder or a zip, named by the student's ID. It is read as untrusted input: bounded in size, never
unpacked, links never followed, its names never used for writing. Of all that it holds, only the source of the answer
cells goes on.
"""

from __future__ import annotations

import io
import json
import os
import stat
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any

from rotflex.courseware import student_id
from rotflex.courseware.files import COURSE_FILE
from rotflex.courseware.messages import _
from rotflex.errors import GradingError, StudentIDError

MAX_NOTEBOOK = 5_000_000  #: bytes
MAX_ARCHIVE = 50_000_000  #: bytes of a zip
MAX_DIRECTORY = 2_000_000  #: bytes of a zip's table of contents
MAX_ENTRIES = 5_000  #: files and folders of a submission
MAX_DEPTH = 8  #: folders within folders
MAX_SOURCE = 200_000  #: characters of a cell


@dataclass(frozen=True)
class Submission:
    """What a student handed in, unread."""

    student: str
    path: Path


@dataclass
class Intake:
    """What was found in a submission.

    Attributes
    ----------
    sources : for each notebook that was found, answer cell's id → source
    problems : why the submission could not be read as it should
    notes : what an instructor may want to know
    """

    sources: dict[str, dict[str, str]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class _Unreadable(Exception):
    """A file that cannot be read; the message says why."""


def submissions(folder: Path) -> tuple[list[Submission], list[str]]:
    """The submissions in a folder, by student, and a message on everything else there.

    Raises
    ------
    GradingError
        If there is no such folder, or no submission in it.
    """
    if not folder.is_dir():
        raise GradingError(_("There is no folder {folder}.").format(folder=folder))
    found: dict[str, Submission] = {}
    ignored = []
    # A folder goes before a zip of the same name, whoever packed which.
    for path in sorted(folder.iterdir(), key=lambda path: (path.is_file(), path.name)):
        if path.name.startswith("."):
            continue
        try:
            one = _submission(path)
            same = found.setdefault(student_id.caseless(one.student), one)
            if same is not one:
                why = _("it is the same student's as {other!r}, though its name is written otherwise.")
                raise _Unreadable(why.format(other=same.path.name))
        except _Unreadable as error:
            ignored.append(_("{name!r} is not read: {why}").format(name=path.name, why=error))
    if not found:
        nothing = _("There are no submissions in {folder}: it should hold a folder or a zip for each student.")
        raise GradingError(" ".join([nothing.format(folder=folder), *ignored]))
    return [found[student] for student in sorted(found)], ignored


def _submission(path: Path) -> Submission:
    """What lies at a path, as a submission."""
    zipped = path.suffix.lower() == ".zip"
    if path.is_symlink() or not (path.is_dir() or zipped):
        raise _Unreadable(_("it is neither a folder nor a zip."))
    try:
        return Submission(student_id.normalised(path.stem if zipped and path.is_file() else path.name), path)
    except StudentIDError as error:
        raise _Unreadable(_("it is not named by a student's ID. {why}").format(why=error)) from None


def read(submission: Submission, wanted: Mapping[str, Sequence[str]]) -> Intake:
    """Read a submission's answer cells.

    Parameters
    ----------
    submission : as handed in
    wanted : notebook's file name → ids of its answer cells
    """
    intake = Intake()
    try:
        files = _Archive(submission.path) if submission.path.is_file() else _Folder(submission.path)
        with files:
            found = _shallowest(files.names(), {*wanted, COURSE_FILE}, intake)
            _check_student(submission, files, found.pop(COURSE_FILE, None), intake)
            for name, ids in wanted.items():
                if name not in found:
                    intake.notes.append(_("{name} was not handed in.").format(name=name))
                    continue
                try:
                    cells = _cells(files.read(found[name], MAX_NOTEBOOK))
                except _Unreadable as error:
                    intake.problems.append(_("{name} cannot be read: {error}").format(name=name, error=error))
                else:
                    intake.sources[name] = _answers(name, cells, ids, intake)
    except _Unreadable as error:
        intake.problems.append(_("The submission cannot be read: {error}").format(error=error))
    else:
        if not found:
            intake.problems.append(_("There is no notebook of the course in the submission."))
    return intake


def _shallowest(names: Iterator[PurePosixPath], wanted: set[str], intake: Intake) -> dict[str, PurePosixPath]:
    """For each wanted file name, the path with the fewest folders above it."""
    found: dict[str, list[PurePosixPath]] = {}
    for path in names:
        hidden = any(part.startswith((".", "__MACOSX")) for part in path.parts)
        if path.name in wanted and not hidden:
            found.setdefault(path.name, []).append(path)
    for name, paths in found.items():
        paths.sort(key=lambda path: (len(path.parts), str(path)))
        if len(paths) > 1:
            intake.notes.append(
                _("There are {count} files {name}; the one at {path!r} is taken.").format(
                    count=len(paths), name=name, path=str(paths[0])
                )
            )
    return {name: paths[0] for name, paths in found.items()}


def _check_student(submission: Submission, files: _Files, path: PurePosixPath | None, intake: Intake) -> None:
    """Note where the course file names somebody else."""
    if path is None:
        return
    try:
        course = _json(files.read(path, 10_000))
    except _Unreadable:
        return  # it is the submission's name that counts
    named = course.get("student") if isinstance(course, dict) else None
    known = {"", student_id.caseless(submission.student)}
    if isinstance(named, str) and student_id.caseless(named) not in known:
        shown = named[: student_id.LONGEST]
        intake.notes.append(
            _("{course_file} names the student {shown!r}; this counts as {student!r}'s work.").format(
                course_file=COURSE_FILE, shown=shown, student=submission.student
            )
        )


# --- a notebook's cells -----------------------------------------------------------------------------------------------


def _json(data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _Unreadable(_("it is not JSON ({error_type}).").format(error_type=type(error).__name__)) from None


def _cells(data: bytes) -> list[Any]:
    notebook = _json(data)
    cells = notebook.get("cells") if isinstance(notebook, dict) else None
    if not isinstance(cells, list):
        raise _Unreadable(_("it is JSON, but not a notebook with cells."))
    return cells


def _answers(name: str, cells: list[Any], ids: Sequence[str], intake: Intake) -> dict[str, str]:
    """The sources of a notebook's answer cells by id. What is missing or malformed is noted, and its stub stays."""
    named = [(_id(cell), cell) for cell in cells if isinstance(cell, dict)]
    counts = Counter(cell_id for cell_id, _cell in named)
    sources = {}
    for wanted in ids:
        if not counts[wanted]:
            intake.notes.append(_("{name}: the answer cell {wanted} is missing.").format(name=name, wanted=wanted))
            continue
        if counts[wanted] > 1:
            intake.notes.append(
                _("{name}: the answer cell {wanted} is there {times} times; the first is taken.").format(
                    name=name, wanted=wanted, times=counts[wanted]
                )
            )
        cell = next(cell for cell_id, cell in named if cell_id == wanted)
        try:
            sources[wanted] = _source(cell)
        except _Unreadable as error:
            intake.notes.append(
                _("{name}: the answer cell {wanted} is not taken: {error}").format(
                    name=name, wanted=wanted, error=error
                )
            )
    return sources


def _id(cell: dict[str, Any]) -> str:
    """A cell's id; from its grading metadata where a program saved it in an older format, which knows no ids."""
    cell_id = cell.get("id")
    if isinstance(cell_id, str):
        return cell_id
    metadata = cell.get("metadata")
    grading = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    grade_id = grading.get("grade_id") if isinstance(grading, dict) else None
    return grade_id if isinstance(grade_id, str) else ""


def _source(cell: dict[str, Any]) -> str:
    if cell.get("cell_type") != "code":
        raise _Unreadable(_("it is no longer a code cell."))
    source = cell.get("source")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    if not isinstance(source, str):
        raise _Unreadable(_("its source is not text."))
    if len(source) > MAX_SOURCE:
        raise _Unreadable(_("its source has more than {max_source} characters.").format(max_source=MAX_SOURCE))
    try:
        source.encode()
    except UnicodeEncodeError:
        raise _Unreadable(_("its source is not valid text.")) from None
    return source


# --- files, from a folder or a zip ------------------------------------------------------------------------------------


class _Files:
    """A submission's files: their paths, and bounded reading. A context manager."""

    def __enter__(self) -> _Files:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close what is open."""

    def names(self) -> Iterator[PurePosixPath]:
        """Paths of ordinary files; more than ``MAX_ENTRIES`` raise _Unreadable."""
        raise NotImplementedError

    def read(self, path: PurePosixPath, limit: int) -> bytes:
        """The content of one of them; raises _Unreadable if there is more than ``limit``."""
        raise NotImplementedError


class _Folder(_Files):
    def __init__(self, root: Path) -> None:
        self._root = root

    def names(self) -> Iterator[PurePosixPath]:
        seen = 0
        waiting = [PurePosixPath()]
        while waiting:
            folder = waiting.pop(0)
            try:
                with os.scandir(self._root / folder) as found:
                    entries = sorted(islice(found, MAX_ENTRIES - seen + 1), key=lambda entry: entry.name)
            except OSError as error:
                raise _Unreadable(f"{error.strerror}.") from None
            seen += len(entries)
            if seen > MAX_ENTRIES:
                raise _Unreadable(
                    _("it has more than {max_entries} files and folders.").format(max_entries=MAX_ENTRIES)
                )
            for entry in entries:
                path = folder / entry.name
                if entry.is_dir(follow_symlinks=False) and len(path.parts) <= MAX_DEPTH:
                    waiting.append(path)
                elif entry.is_file(follow_symlinks=False):
                    yield path

    def read(self, path: PurePosixPath, limit: int) -> bytes:
        try:
            # Neither a link nor a pipe that somebody put there since is waited for.
            descriptor = os.open(self._root / path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
            with open(descriptor, "rb") as file:
                if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                    raise _Unreadable(_("it is not an ordinary file."))
                data = file.read(limit + 1)
        except OSError as error:
            raise _Unreadable(f"{error.strerror}.") from None
        if len(data) > limit:
            raise _Unreadable(_("it has more than {limit} bytes.").format(limit=limit))
        return data


class _InPieces(io.FileIO):
    """A file that is not read in large pieces: all that a zip needs to read in one piece is its table of contents."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > MAX_DIRECTORY:
            raise _Unreadable(
                _("its table of contents has more than {max_directory} bytes.").format(max_directory=MAX_DIRECTORY)
            )
        return super().read(MAX_DIRECTORY if size is None or size < 0 else size)


class _Archive(_Files):
    def __init__(self, path: Path) -> None:
        if path.stat().st_size > MAX_ARCHIVE:
            raise _Unreadable(_("the zip has more than {max_archive} bytes.").format(max_archive=MAX_ARCHIVE))
        try:
            self._file = _InPieces(path)
        except OSError as error:
            raise _Unreadable(f"{error.strerror}.") from None
        try:
            self._zip = zipfile.ZipFile(self._file)
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, struct.error) as error:
            self.close()
            raise _Unreadable(
                _("it is not a zip that can be read ({error_type}).").format(error_type=type(error).__name__)
            ) from None
        except _Unreadable:
            self.close()
            raise
        if len(self._zip.infolist()) > MAX_ENTRIES:
            self.close()
            raise _Unreadable(_("it has more than {max_entries} files and folders.").format(max_entries=MAX_ENTRIES))

    def close(self) -> None:
        self._file.close()

    def names(self) -> Iterator[PurePosixPath]:
        self._entries: dict[PurePosixPath, zipfile.ZipInfo] = {}
        for entry in self._zip.infolist():
            path = PurePosixPath(entry.filename.replace("\\", "/"))
            kind = stat.S_IFMT(entry.external_attr >> 16)
            nameless = not entry.filename  # of which is_dir() would not know what to say
            if nameless or entry.is_dir() or kind not in (0, stat.S_IFREG) or path in self._entries:
                continue
            self._entries[path] = entry
            yield path

    def read(self, path: PurePosixPath, limit: int) -> bytes:
        entry = self._entries[path]
        if entry.flag_bits & 1:
            raise _Unreadable(_("it is encrypted."))
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise _Unreadable(_("it is compressed in an unusual way; use an ordinary zip."))
        try:
            with self._zip.open(entry) as file:
                data = file.read(limit + 1)
        except (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, NotImplementedError) as error:
            raise _Unreadable(_("the zip is damaged ({error_type}).").format(error_type=type(error).__name__)) from None
        if len(data) > limit:
            raise _Unreadable(_("it has more than {limit} bytes.").format(limit=limit))
        return data
