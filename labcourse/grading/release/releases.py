"""The releases of a course: their names, and their zips, which are stored for work that was begun under them.

The name of a release is its term and a digest of all that students work with: the same content has the same name. How
to install it does not count, nor do recordings that may be handed out with it.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse import benches, course_file, files
from labcourse.answers.notebooks import Notebook, NotebookError
from labcourse.benches import BenchPolicy
from labcourse.course_file import RELEASE, STUDENT
from labcourse.errors import ConfigurationError, GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course

NOTEBOOKS, DATA = "notebooks", "data"  #: folders of a release, beside those of the packages
_COURSE_FILE = f"{NOTEBOOKS}/{COURSE_FILE}"
_PROJECT = "pyproject.toml"  # it lies in the release's own folder


# --- names ------------------------------------------------------------------------------------------------------------


def digest(contents: Iterable[tuple[str, bytes]]) -> str:
    """Return a digest of files, by name and content, of 8 hexadecimal digits: to tell a course's releases apart."""
    whole = hashlib.sha256()
    for name, content in contents:
        whole.update(f"{name} {len(content)}\n".encode() + content)
    return whole.hexdigest()[:8]


def contents(folder: Path) -> dict[str, bytes]:
    """Read all files in a folder: relative path, with "/" → content, in the order of the paths."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files_in(folder)}


def files_in(folder: Path) -> list[Path]:
    """List all files in a folder and below it, in order."""
    return sorted(path for path in folder.rglob("*") if path.is_file())


def name_of(stored: Mapping[str, bytes], course_json: Mapping[str, Any], term: str) -> str:
    """Make the name of a release, as "2026-autumn-3f2a9c41".

    Parameters
    ----------
    stored : relative path → content of its files; those that have no part in the name are left out here
    course_json : the content of its ``course.json``
    term : text to begin the name with
    """
    content = {key: value for key, value in course_json.items() if key not in (STUDENT, RELEASE)}
    counting = [(name, data) for name, data in sorted(stored.items()) if _is_in_name(name)]
    ascii_only = unicodedata.normalize("NFKD", term).encode("ascii", "ignore").decode().lower()
    stem = re.sub(r"[^a-z0-9]+", "-", ascii_only)[:40].strip("-")  # it stands in a file's name
    return f"{stem or 'release'}-{digest([*counting, (COURSE_FILE, json.dumps(content, sort_keys=True).encode())])}"


def _is_in_name(name: str) -> bool:
    """Return whether the name of a release depends on a file of it, given by its relative path.

    It does not on files in the release's own folder (how to install it), on data, on ``course.json``, of which the
    content has a part of its own, and on compiled Python.
    """
    place = PurePosixPath(name)
    return len(place.parts) > 1 and place.parts[0] != DATA and name != _COURSE_FILE and place.suffix != ".pyc"


# --- stored zips ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredRelease:
    """A stored release that was handed out. Made by :func:`read`.

    Attributes
    ----------
    id : its name; of an old release without a name, the name that it would have
    archive : its zip
    policy : which bench each student has
    packages : import names of the packages that it brings
    """

    id: str
    archive: Path
    policy: BenchPolicy
    packages: tuple[str, ...]

    def notebooks(self) -> dict[str, dict[str, Any]]:
        """Read its notebooks: file name → notebook.

        Raises
        ------
        GradingError
            If one of them cannot be read.
        """
        return _read_notebooks(self.archive, _release_files(self.archive))

    def unpack(self, folder: Path) -> None:
        """Write its notebooks, packages and ``course.json`` into a folder.

        Raises
        ------
        GradingError
            If the zip cannot be read any more.
        """
        for name, content in _release_files(self.archive).items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)


class Releases:
    """The stored releases of a course.

    Parameters
    ----------
    course : the course

    Attributes
    ----------
    folder : where they are stored
    all : the releases, each once, in the order of their files' names
    problems : messages about files there that cannot be read
    """

    def __init__(self, course: Course) -> None:
        self.folder = course.releases
        self.problems: list[str] = []
        by_name: dict[str, StoredRelease] = {}
        for archive in sorted(self.folder.glob("*.zip")):
            try:
                release = read(archive)
                by_name.setdefault(release.id, release)
            except GradingError as error:
                self.problems.append(str(error))
        self.all = tuple(by_name.values())


def store(course: Course, archive: Path, name: str) -> Path:
    """Store the zip of a release that was made just now, and return the stored file.

    Raises
    ------
    GradingError
        If it cannot be stored; the message says what to do.
    """
    stored = course.releases / f"{name}.zip"
    if stored.exists():  # the same content, by its name
        return stored
    try:
        stored.parent.mkdir(parents=True, exist_ok=True)
        files.write(stored, archive.read_bytes())
    except OSError as error:
        raise GradingError(
            f"The release is in {archive}, but it cannot be kept in {stored.parent}: {error.strerror}. Put a copy "
            "there, or name another folder in course.toml: grading needs it for work that is begun under this release."
        ) from None
    return stored


def read(archive: Path) -> StoredRelease:
    """Read a release from its zip.

    Raises
    ------
    GradingError
        If the zip cannot be read or is not a release.
    """
    entries = _release_files(archive)
    try:
        course_json = course_file.parse(entries.pop(_COURSE_FILE, b"{}"))
        policy = benches.policy_of(course_json)
    except ConfigurationError as error:
        raise _unusable(archive, f"{COURSE_FILE}: {error}") from None
    _read_notebooks(archive, entries)  # raises if one of them cannot be read
    packages = sorted({top for name in entries if f"{(top := name.partition('/')[0])}/__init__.py" in entries})
    own_name = course_json.get(RELEASE)
    # Old releases have neither a name nor a term.
    name = own_name if isinstance(own_name, str) and own_name else name_of(entries, course_json, "unnamed")
    return StoredRelease(name, archive, policy, tuple(packages))


def _read_notebooks(archive: Path, entries: Mapping[str, bytes]) -> dict[str, dict[str, Any]]:
    """Return file name → notebook of a release's files; raise GradingError, which names the zip, if one is invalid."""
    notebooks = {}
    for place, content in sorted((PurePosixPath(name), content) for name, content in entries.items()):
        if place.parent == PurePosixPath(NOTEBOOKS) and place.suffix == ".ipynb":
            try:
                Notebook.read(content)
            except NotebookError as error:
                raise _unusable(archive, f"{place.name}: {error}") from None
            notebooks[place.name] = json.loads(content)
    return notebooks


def _release_files(archive: Path) -> dict[str, bytes]:
    """Read the files of a release that its name depends on, and its ``course.json``: relative path → content.

    Raises
    ------
    GradingError
        If the zip cannot be read, or holds no project or no notebooks.
    """
    try:
        with zipfile.ZipFile(archive) as packed:
            # The release is where its pyproject.toml is: the zip may have been packed again with folders around it.
            projects = [place for name in packed.namelist() if (place := PurePosixPath(name)).name == _PROJECT]
            if not projects:
                raise _unusable(archive, f"it holds no {_PROJECT}")
            entries = dict(_counted_files(packed, min(projects, key=lambda place: len(place.parts)).parent))
    except (OSError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError) as error:
        raise _unusable(archive, error) from None
    if not any(name.startswith(f"{NOTEBOOKS}/") and name.endswith(".ipynb") for name in entries):
        raise _unusable(archive, "it holds no notebooks")
    return entries


def _counted_files(packed: zipfile.ZipFile, root: PurePosixPath) -> Iterator[tuple[str, bytes]]:
    """Yield (path, content) of the files below a folder of a zip that count; those of wheels, too."""
    for entry in packed.infolist():
        place = PurePosixPath(entry.filename)
        if entry.is_dir() or not place.is_relative_to(root) or ".." in place.parts:
            continue
        name = str(place.relative_to(root))
        if place.suffix == ".whl":
            yield from _package_files(packed.read(entry))
        elif _is_in_name(name) or name == _COURSE_FILE:
            yield name, packed.read(entry)


def _package_files(content: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield (path, content) of the package in a wheel, without the notebooks and data in it."""
    with zipfile.ZipFile(io.BytesIO(content)) as wheel:
        for name in wheel.namelist():
            parts = PurePosixPath(name).parts
            if not parts[0].endswith(".dist-info") and not {NOTEBOOKS, DATA}.intersection(parts[:-1]):
                yield name, wheel.read(name)


def _unusable(archive: Path, why: object) -> GradingError:
    """Return the error that a zip is not a release, and what to do."""
    return GradingError(
        f"{archive} is not a release of the course: {why}. Replace it by the zip that was handed out, or remove it."
    )
