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
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse import benches, course_file, files
from labcourse.answers.notebooks import Notebook, NotebookError
from labcourse.benches import BenchPolicy
from labcourse.course_file import RELEASE_KEY, STUDENT_KEY
from labcourse.courses import NOTEBOOKS
from labcourse.errors import ConfigurationError, GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course

DATA = "data"  #: folder of a release with the recordings that are handed out
_COURSE_FILE = f"{NOTEBOOKS}/{COURSE_FILE}"
_PROJECT = "pyproject.toml"  # in the release's own folder
_UNREADABLE = (OSError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError)


# --- names ------------------------------------------------------------------------------------------------------------


def digest(folder: Path, *further: tuple[str, bytes]) -> str:
    """Return a digest, 8 hexadecimal digits, of the files in a folder and of further ones (name, content)."""
    whole = hashlib.sha256()
    contents = ((name, path.read_bytes()) for name, path in sorted(files_in(folder).items()))
    for name, content in chain(contents, further):
        whole.update(f"{name} {len(content)}\n".encode() + content)
    return whole.hexdigest()[:8]


def files_in(folder: Path) -> dict[str, Path]:
    """Return all files in a folder and below it: relative path, with "/" → path, in the order of the paths."""
    return {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}


def name_of(folder: Path, course_json: Mapping[str, Any], term: str) -> str:
    """Make the name of a release, as "2026-autumn-3f2a9c41".

    Parameters
    ----------
    folder : with its notebooks and packages, and nothing else yet
    course_json : the content of its ``course.json``
    term : text to begin the name with
    """
    content = {key: value for key, value in course_json.items() if key != STUDENT_KEY}
    ascii_only = unicodedata.normalize("NFKD", term).encode("ascii", "ignore").decode().lower()
    stem = re.sub(r"[^a-z0-9]+", "-", ascii_only)[:40].strip("-")  # it stands in a file's name
    return f"{stem or 'release'}-{digest(folder, (COURSE_FILE, json.dumps(content, sort_keys=True).encode()))}"


# --- stored zips ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredRelease:
    """A stored release that was handed out. Made by :func:`read`.

    Attributes
    ----------
    id : its name
    policy : which bench each student has
    packages : import names of the packages that it brings
    notebooks : file name → notebook
    files : relative path → content, of its notebooks, its packages and its ``course.json``
    """

    id: str
    policy: BenchPolicy
    packages: tuple[str, ...]
    notebooks: Mapping[str, dict[str, Any]]
    files: Mapping[str, bytes]

    def unpack(self, folder: Path) -> None:
        """Write its notebooks, packages and ``course.json`` into a folder."""
        for name, content in self.files.items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)


def read_all(course: Course) -> tuple[dict[str, StoredRelease], list[str]]:
    """Read the stored releases of a course.

    Returns
    -------
    dict
        Name → release, in the order of their files' names; of two with one name, the first.
    list
        A message about each file that cannot be read.
    """
    releases: dict[str, StoredRelease] = {}
    problems = []
    for archive in sorted(course.releases.glob("*.zip")):
        try:
            release = read(archive)
            releases.setdefault(release.id, release)
        except GradingError as error:
            problems.append(str(error))
    return releases, problems


def store(course: Course, archive: Path, name: str) -> Path:
    """Store the zip of a new release, unless one with its name is stored already; return the stored file.

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
            f"The release is in {archive}, but it cannot be stored in {stored.parent}: {error.strerror}. Put a copy "
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
    try:
        entries = _read_files(archive)
        notebooks = {path.name: _read_notebook(path.name, entries[str(path)]) for path in _notebooks_in(entries)}
        course_json = course_file.parse(entries.get(_COURSE_FILE, b"{}"))
        policy, name = benches.policy_of(course_json), course_json.get(RELEASE_KEY)
        if not notebooks:
            raise ConfigurationError("it holds no notebooks")
        if not (isinstance(name, str) and name):
            raise ConfigurationError(f"its {COURSE_FILE} does not name the release")
    except (*_UNREADABLE, ConfigurationError) as error:
        why = str(error).rstrip(".")
        advice = "Replace it by the zip that was handed out, or remove it."
        raise GradingError(f"{archive} is not a release of the course: {why}. {advice}") from None
    packages = sorted({top for path in entries if f"{(top := path.partition('/')[0])}/__init__.py" in entries})
    return StoredRelease(name, policy, tuple(packages), notebooks, entries)


def _notebooks_in(entries: Mapping[str, bytes]) -> list[PurePosixPath]:
    """Return the paths of the notebooks among the files of a release."""
    paths = map(PurePosixPath, sorted(entries))
    return [path for path in paths if path.parent == PurePosixPath(NOTEBOOKS) and path.suffix == ".ipynb"]


def _read_notebook(name: str, content: bytes) -> dict[str, Any]:
    """Return a notebook of a release; raise ConfigurationError, which names it, if it is invalid."""
    try:
        Notebook.read(content)
    except NotebookError as error:
        raise ConfigurationError(f"{name}: {error}") from None
    return dict(json.loads(content))


def _read_files(archive: Path) -> dict[str, bytes]:
    """Read the notebooks, packages and ``course.json`` of a release: relative path → content.

    Raises
    ------
    ConfigurationError
        If the zip has no project.
    """
    entries: dict[str, bytes] = {}
    with zipfile.ZipFile(archive) as packed:
        # The release is where its pyproject.toml is: the zip may have been packed again with folders around it.
        projects = [place for name in packed.namelist() if (place := PurePosixPath(name)).name == _PROJECT]
        if not projects:
            raise ConfigurationError(f"it holds no {_PROJECT}")
        root = min(projects, key=lambda place: len(place.parts)).parent
        for entry in packed.infolist():
            place = PurePosixPath(entry.filename)
            if entry.is_dir() or not place.is_relative_to(root) or ".." in place.parts:
                continue
            if place.suffix == ".whl":
                entries |= _package_files(packed.read(entry))
            elif (name := str(place.relative_to(root))).startswith(f"{NOTEBOOKS}/"):
                entries[name] = packed.read(entry)
    return entries


def _package_files(content: bytes) -> dict[str, bytes]:
    """Read the files in a wheel, without its metadata, notebooks and data: path → content."""
    with zipfile.ZipFile(io.BytesIO(content)) as wheel:
        names = {name: PurePosixPath(name).parts for name in wheel.namelist()}
        return {
            name: wheel.read(name)
            for name, parts in names.items()
            if not parts[0].endswith(".dist-info") and not {NOTEBOOKS, DATA}.intersection(parts[:-1])
        }
