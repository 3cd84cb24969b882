"""The releases of a course that were handed out: each is kept as its zip, for work that was begun under it."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse import benches, files
from labcourse.answers.handed_in import NotebookError, cells_of
from labcourse.benches import BenchPolicy
from labcourse.course_file import RELEASE
from labcourse.errors import ConfigurationError, GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.release import identity, student_course
from labcourse.grading.release.identity import DATA, NOTEBOOKS

_PROJECT = "pyproject.toml"  # where it lies is the release's own folder


@dataclass(frozen=True)
class KeptRelease:
    """A release that was handed out. Made by :func:`read`.

    Attributes
    ----------
    id : its name; of a release from before there were names, what its name would be
    archive : its zip
    about : what its ``course.json`` says
    policy : which bench each student has
    packages : import names of the packages that it brings
    """

    id: str
    archive: Path
    about: Mapping[str, Any]
    policy: BenchPolicy
    packages: tuple[str, ...]

    @property
    def term(self) -> str:
        """Of its students; "" where it does not say."""
        return str(self.about.get("term", ""))

    def notebooks(self) -> dict[str, dict[str, Any]]:
        """Its notebooks: file name → notebook.

        Raises
        ------
        GradingError
            If one of them cannot be read.
        """
        found = {}
        for name, content in sorted(_contents(self.archive).items()):
            place = PurePosixPath(name)
            if place.parent == PurePosixPath(NOTEBOOKS) and place.suffix == ".ipynb":
                try:
                    cells_of(content)
                except NotebookError as error:
                    raise _unusable(self.archive, f"{place.name}: {error}") from None
                found[place.name] = json.loads(content)
        return found

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
    """The releases of a course that are kept.

    Parameters
    ----------
    course : the course

    Attributes
    ----------
    folder : where they are kept
    problems : on what lies there and cannot be read
    """

    def __init__(self, course: Course) -> None:
        self.folder = course.releases
        self.problems: list[str] = []

    @cached_property
    def all(self) -> tuple[KeptRelease, ...]:
        """All of them, each once, in the order of their files' names."""
        found: dict[str, KeptRelease] = {}
        for archive in sorted(self.folder.glob("*.zip")):
            try:
                release = read(archive)
            except GradingError as error:
                self.problems.append(str(error))
            else:
                found.setdefault(release.id, release)
        return tuple(found.values())

    def find(self, name: str) -> KeptRelease | None:
        """The one of a name."""
        return next((one for one in self.all if one.id == name), None)


def keep(course: Course, made: student_course.Release) -> Path:
    """Keep a release that was made just now, and return its file.

    Raises
    ------
    GradingError
        If it cannot be kept; the message says what to do.
    """
    kept = course.releases / f"{made.id}.zip"
    if kept.exists():  # the same content, by its name
        return kept
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        files.write(kept, made.archive.read_bytes())
    except OSError as error:
        raise GradingError(
            f"The release is in {made.archive}, but it cannot be kept in {kept.parent}: {error.strerror}. Put a "
            "copy there, or name another folder in course.toml: grading needs it for work that is begun under "
            "this release."
        ) from None
    return kept


def read(archive: Path) -> KeptRelease:
    """A release from its zip.

    Raises
    ------
    GradingError
        If it is none.
    """
    found = _contents(archive)
    about = _about(archive, found.pop(str(PurePosixPath(NOTEBOOKS, COURSE_FILE)), b"{}"))
    try:
        policy = benches.policy_of(about)
    except ConfigurationError as error:
        raise _unusable(archive, f"{COURSE_FILE}: {error}") from None
    packages = sorted({top for name in found if f"{(top := name.partition('/')[0])}/__init__.py" in found})
    named = about.get(RELEASE)
    # Those of before bear no name; the term of the digest is not known, either.
    name = named if isinstance(named, str) and named else identity.name_of(found, about, "unnamed")
    release = KeptRelease(name, archive, about, policy, tuple(packages))
    release.notebooks()  # or it is told now
    return release


def _about(archive: Path, content: bytes) -> dict[str, Any]:
    try:
        about = json.loads(content)
    except ValueError as error:
        raise _unusable(archive, f"{COURSE_FILE}: {error}") from None
    if not isinstance(about, dict):
        raise _unusable(archive, f"its {COURSE_FILE} is no object")
    return about


def _contents(archive: Path) -> dict[str, bytes]:
    """What counts of a release, and its ``course.json``: relative path → content."""
    try:
        with zipfile.ZipFile(archive) as packed:
            root = _root(packed)
            if root is None:
                raise _unusable(archive, f"it holds no {_PROJECT}")
            found = dict(_counting(packed, root))
    except (OSError, zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError) as error:
        raise _unusable(archive, error) from None
    if not any(name.startswith(f"{NOTEBOOKS}/") and name.endswith(".ipynb") for name in found):
        raise _unusable(archive, "it holds no notebooks")
    return found


def _root(packed: zipfile.ZipFile) -> PurePosixPath | None:
    """The release's own folder in its zip: whoever packed it anew may have put others around it."""
    places = [PurePosixPath(name) for name in packed.namelist()]
    return min(
        (place.parent for place in places if place.name == _PROJECT), key=lambda one: len(one.parts), default=None
    )


def _counting(packed: zipfile.ZipFile, root: PurePosixPath) -> Iterator[tuple[str, bytes]]:
    wanted = str(PurePosixPath(NOTEBOOKS, COURSE_FILE))
    for entry in packed.infolist():
        place = PurePosixPath(entry.filename)
        if entry.is_dir() or not place.is_relative_to(root) or ".." in place.parts:
            continue
        name = str(place.relative_to(root))
        if place.suffix == ".whl":
            yield from _of_wheel(packed.read(entry))
        elif identity.counts(name) or name == wanted:
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
