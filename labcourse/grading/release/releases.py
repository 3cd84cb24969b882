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
_ABOUT = f"{NOTEBOOKS}/{COURSE_FILE}"
_PROJECT = "pyproject.toml"  # it lies in the release's own folder


# --- names ------------------------------------------------------------------------------------------------------------


def digest(contents: Iterable[tuple[str, bytes]]) -> str:
    """Return 8 hexadecimal digits that stand for files, by name and content: they tell a course's releases apart."""
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


def name_of(stored: Mapping[str, bytes], about: Mapping[str, Any], term: str) -> str:
    """Make the name of a release, as "2026-autumn-3f2a9c41".

    Parameters
    ----------
    stored : its files; those that do not count are passed over
    about : the content of its ``course.json``
    term : to begin the name with
    """
    content = {key: value for key, value in about.items() if key not in (STUDENT, RELEASE)}
    counting = [(name, data) for name, data in sorted(stored.items()) if _counts(name)]
    ascii_only = unicodedata.normalize("NFKD", term).encode("ascii", "ignore").decode().lower()
    stem = re.sub(r"[^a-z0-9]+", "-", ascii_only)[:40].strip("-")  # it stands in a file's name
    return f"{stem or 'release'}-{digest([*counting, (COURSE_FILE, json.dumps(content, sort_keys=True).encode())])}"


def _counts(name: str) -> bool:
    """Return whether a file of a release, by its relative path, has a part in its name."""
    place = PurePosixPath(name)
    return len(place.parts) > 1 and place.parts[0] != DATA and name != _ABOUT and place.suffix != ".pyc"


# --- stored zips ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredRelease:
    """A release that was handed out. Made by :func:`read`.

    Attributes
    ----------
    id : its name; of a release from before there were names, what its name would be
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
        return _notebooks(self.archive, _contents(self.archive))

    def unpack(self, folder: Path) -> None:
        """Put all that counts of it into a folder.

        Raises
        ------
        GradingError
            If the zip cannot be read any more.
        """
        for name, content in _contents(self.archive).items():
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
        If it is none.
    """
    found = _contents(archive)
    try:
        about = course_file.parse(found.pop(_ABOUT, b"{}"))
        policy = benches.policy_of(about)
    except ConfigurationError as error:
        raise _unusable(archive, f"{COURSE_FILE}: {error}") from None
    _notebooks(archive, found)  # raises if one of them cannot be read
    packages = sorted({top for name in found if f"{(top := name.partition('/')[0])}/__init__.py" in found})
    name = about.get(RELEASE)
    # Releases from before there were names do not say their term, either.
    return StoredRelease(
        name if isinstance(name, str) and name else name_of(found, about, "unnamed"), archive, policy, tuple(packages)
    )


def _notebooks(archive: Path, found: Mapping[str, bytes]) -> dict[str, dict[str, Any]]:
    notebooks = {}
    for place, content in sorted((PurePosixPath(name), content) for name, content in found.items()):
        if place.parent == PurePosixPath(NOTEBOOKS) and place.suffix == ".ipynb":
            try:
                Notebook.read(content)
            except NotebookError as error:
                raise _unusable(archive, f"{place.name}: {error}") from None
            notebooks[place.name] = json.loads(content)
    return notebooks


def _contents(archive: Path) -> dict[str, bytes]:
    """Read what counts of a release, and its ``course.json``: relative path → content."""
    try:
        with zipfile.ZipFile(archive) as packed:
            # Somebody who packed it again may have put other folders around it.
            projects = [place for name in packed.namelist() if (place := PurePosixPath(name)).name == _PROJECT]
            if not projects:
                raise _unusable(archive, f"it holds no {_PROJECT}")
            found = dict(_counting(packed, min(projects, key=lambda place: len(place.parts)).parent))
    except (OSError, zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError) as error:
        raise _unusable(archive, error) from None
    if not any(name.startswith(f"{NOTEBOOKS}/") and name.endswith(".ipynb") for name in found):
        raise _unusable(archive, "it holds no notebooks")
    return found


def _counting(packed: zipfile.ZipFile, root: PurePosixPath) -> Iterator[tuple[str, bytes]]:
    for entry in packed.infolist():
        place = PurePosixPath(entry.filename)
        if entry.is_dir() or not place.is_relative_to(root) or ".." in place.parts:
            continue
        name = str(place.relative_to(root))
        if place.suffix == ".whl":
            yield from _of_wheel(packed.read(entry))
        elif _counts(name) or name == _ABOUT:
            yield name, packed.read(entry)


def _of_wheel(content: bytes) -> Iterator[tuple[str, bytes]]:
    """Read the package of a wheel, without the notebooks and data that an installed course has in it."""
    with zipfile.ZipFile(io.BytesIO(content)) as wheel:
        for name in wheel.namelist():
            parts = PurePosixPath(name).parts
            if not parts[0].endswith(".dist-info") and not {NOTEBOOKS, DATA}.intersection(parts[:-1]):
                yield name, wheel.read(name)


def _unusable(archive: Path, why: object) -> GradingError:
    return GradingError(
        f"{archive} is not a release of the course: {why}. Replace it by the zip that was handed out, or remove it."
    )
