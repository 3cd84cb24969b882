"""The course as students have it, as one zip to run submissions with; and the choice of a release for a submission.

A submission is run and marked under the release that it was begun with: the course as it is now, or one that was
handed out before. A student's ``course.json`` names it. Loose notebooks come without one, and a folder may have the
``course.json`` of another release, so the course's own cells, by which releases differ, are compared as well.
"""

from __future__ import annotations

import compileall
import functools
import hashlib
import io
import json
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import course_file
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Cell
from labcourse.benches import THEIR_OWN, BenchPolicy
from labcourse.courses import NOTEBOOKS
from labcourse.errors import ConfigurationError, GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.release import releases, student_course, student_notebooks
from labcourse.grading.release.releases import StoredRelease
from labcourse.problems import Code, Problem
from labcourse.run import inside
from labcourse.run.alignment import asked_cells, source_of

INSIDE = "labcourse_inside"  #: package beside the course's packages: the warm process
FONTS = "matplotlib"  #: folder beside them, with matplotlib's list of fonts
_PROGRAMS = Path(inside.__file__).resolve().parent

Cells = frozenset[tuple[str, str]]  # notebook's file name, source


@dataclass(frozen=True)
class Bundle:
    """A release to run submissions with. Made by :func:`build` or :func:`of_release`.

    Attributes
    ----------
    packed : a zip of the students' packages, and of the programs that run notebooks
    pristine : notebook's file name → notebook as released
    parameters : of the notebooks, besides the student
    imports : modules that notebooks use
    digest : of all of this; another digest is another bundle
    catalogue : the course's questions, without those of notebooks that the release leaves out
    release : name of the release
    policy : which bench each student has
    asked_parts : the (question, part) that its notebooks ask for, of these questions
    """

    packed: bytes
    pristine: Mapping[str, dict[str, Any]]
    parameters: Mapping[str, str]
    imports: tuple[str, ...]
    digest: str
    catalogue: Catalogue
    release: str = ""
    policy: BenchPolicy = THEIR_OWN
    asked_parts: frozenset[tuple[str, str]] = frozenset()


@dataclass(frozen=True)
class Chosen:
    """The bundle for a submission, and problems and notes on the choice for the instructor."""

    bundle: Bundle
    problems: tuple[Problem, ...] = ()
    notes: tuple[Problem, ...] = ()


class Bundles:
    """The bundles of a course: as it is now, and of its stored releases. Threads may share it.

    Parameters
    ----------
    course : the course

    Attributes
    ----------
    current : the course as it is now
    problems : messages about stored releases that cannot be read
    names : file names of the notebooks of the course and of its stored releases, in order

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """

    def __init__(self, course: Course) -> None:
        self._course = course
        self.current = build(course)
        self._older, self.problems = releases.read_all(course)
        self._older.pop(self.current.release, None)
        self._cells = {self.current.release: _course_cells(self.current.pristine)}
        self._cells |= {name: _course_cells(release.notebooks) for name, release in self._older.items()}
        names = {name for cells in self._cells.values() for name, _source in cells}
        self.names = tuple(sorted(names | set(self.current.pristine)))
        self._built = {self.current.release: self.current}
        self._building = threading.Lock()

    def digest(self) -> str:
        """Return a digest of the course as it is now and of all stored releases."""
        digest = hashlib.sha256(f"{self.current.digest} {self.problems}".encode())
        for name, release in sorted(self._older.items()):
            digest.update(f"{name} {release.policy}".encode())
            for path, content in sorted(release.files.items()):
                digest.update(f"{path} ".encode() + hashlib.sha256(content).digest())
        return digest.hexdigest()

    def masters(self, name: str) -> list[dict[str, Any]]:
        """Return a notebook, by file name, as it is in each release, the present one first: id → cell."""
        releases = [self.current.pristine, *(release.notebooks for release in self._older.values())]
        notebooks = [notebooks[name] for notebooks in releases if name in notebooks]
        return [{cell["id"]: cell for cell in notebook["cells"]} for notebook in notebooks]

    def choose(self, notebooks: Mapping[str, Iterable[Cell]], course_json: Mapping[str, Any]) -> Chosen:
        """Choose the bundle under which a submission is run and marked.

        It is that of the release which its ``course.json`` names. If it names none that is known, or the notebooks
        contradict it, it is that of the release with most of its own cells in the notebooks.

        Parameters
        ----------
        notebooks : notebook's file name → its cells
        course_json : content of the submission's ``course.json``
        """
        named = course_json.get(course_file.RELEASE_KEY)
        cells = frozenset((name, cell.source.strip()) for name, cells in notebooks.items() for cell in cells)
        release = closest = max(self._cells, key=lambda name: len(cells & self._cells[name]))
        problems, notes = list[Problem](), list[Problem]()
        if isinstance(named, str) and named in self._cells:
            of_named, of_closest = cells & self._cells[named], cells & self._cells[closest]
            # The file counts unless the closest release has all its cells that were handed in, and further ones.
            if of_named - of_closest or not of_closest - of_named:
                release = named
            else:
                notes.append(Problem.of(Code.RELEASE_CONTRADICTED, named=named, release=release))
        elif isinstance(named, str) and named:
            about = {"named": named, "folder": self._course.releases.name, "closest": closest}
            problems.append(Problem.of(Code.RELEASE_UNKNOWN, **about))
        if release != self.current.release:
            notes.append(Problem.of(Code.RELEASE_EARLIER, release=release))
        return Chosen(self.built(release), tuple(problems), tuple(notes))

    def built(self, name: str) -> Bundle:
        """Return the bundle of a release, by the name of the release. Each bundle is made only once."""
        with self._building:
            if name not in self._built:
                self._built[name] = of_release(self._older[name], self._course)
            return self._built[name]


def _course_cells(notebooks: Mapping[str, Any]) -> Cells:
    """Return the cells of notebooks as released that are no answers and not empty; students leave them unchanged."""
    return frozenset(
        (name, source)
        for name, notebook in notebooks.items()
        for cell in notebook["cells"]
        if not student_notebooks.is_answer(cell) and (source := source_of(cell).strip())
    )


# --- making a bundle --------------------------------------------------------------------------------------------------


def build(course: Course) -> Bundle:
    """Make the bundle of a course as it is now.

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    with tempfile.TemporaryDirectory(prefix="labcourse-course-") as scratch:
        folder = Path(scratch) / "course"
        student_course.build(course, folder)
        release = (course_file.read(folder / NOTEBOOKS) or {})[course_file.RELEASE_KEY]
        return _bundle(course, folder, (student_course.PACKAGE, *course.packages), release, course.settings.bench)


def of_release(release: StoredRelease, course: Course) -> Bundle:
    """Make the bundle of a release that was handed out before, with its notebooks and packages as they were.

    Parameters
    ----------
    release : as it was stored
    course : as it is now

    Raises
    ------
    GradingError
        If its ``course.json`` is broken.
    """
    with tempfile.TemporaryDirectory(prefix="labcourse-release-") as scratch:
        release.unpack(Path(scratch))
        return _bundle(course, Path(scratch), release.packages, release.id, release.policy)


def _bundle(course: Course, folder: Path, packages: tuple[str, ...], release: str, policy: BenchPolicy) -> Bundle:
    """Make the bundle of a release that lies in a folder.

    Parameters
    ----------
    course : as it is now
    folder : with the folder of the notebooks, and those of the packages
    packages : import names of the packages in the folder
    release : its name
    policy : which bench each student has

    Raises
    ------
    GradingError
        If its ``course.json`` is broken.
    """
    paths = sorted((folder / NOTEBOOKS).glob("*.ipynb"))
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    pristine = {name: json.loads(text) for name, text in texts.items()}
    catalogue = _place_course_file(folder, course)
    packed = _pack({**{name: folder / name for name in packages}, INSIDE: _PROGRAMS})
    names = ("labcourse.answers.schema", *course.imports)  # a session imports that with its first answer
    imports = tuple(name for name in names if _can_be_imported(name, folder, packages))
    depends = [texts, dict(course.parameters), imports]
    return Bundle(
        packed=packed,
        pristine=pristine,
        parameters=dict(course.parameters),
        imports=imports,
        digest=hashlib.sha256(packed + json.dumps(depends, sort_keys=True).encode()).hexdigest(),
        catalogue=catalogue,
        release=release,
        policy=policy,
        asked_parts=frozenset(where for *_cell, parts in asked_cells(pristine, catalogue) for where in parts),
    )


def _place_course_file(folder: Path, course: Course) -> Catalogue:
    """Copy the ``course.json`` of a release into the course's package, where an installed release has it.

    Returns
    -------
    Catalogue
        The questions of the release.

    Raises
    ------
    GradingError
        If the file is broken.
    """
    file = folder / NOTEBOOKS / COURSE_FILE
    place = folder.joinpath(*course.package.split("."), NOTEBOOKS)
    place.mkdir(parents=True)
    shutil.copyfile(file, place / COURSE_FILE)
    try:
        return course.catalogue.of_release(json.loads(file.read_bytes()))
    except (ValueError, ConfigurationError) as error:
        raise GradingError(f"{COURSE_FILE}: {error}") from None


def _can_be_imported(module: str, folder: Path, packages: tuple[str, ...]) -> bool:
    """Return whether a release has a module; an older one may not have all that the course imports now.

    Modules of other packages, such as libraries, are taken to be there.
    """
    path = folder.joinpath(*module.split("."))
    is_of_library = module.partition(".")[0] not in packages
    return is_of_library or path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def _pack(packages: Mapping[str, Path]) -> bytes:
    """Return a zip of packages, name → folder, with one date for all files: equal packages give equal bytes."""
    files: dict[str, Path] = {}
    for package, folder in packages.items():
        paths = releases.files_in(folder)
        files |= {f"{package}/{name}": path for name, path in paths.items() if path.suffix != ".pyc"}
    return student_course.zip_files(files)


# --- where it is run --------------------------------------------------------------------------------------------------

_unpacking = threading.Lock()


def unpacked(packed: bytes) -> Path:
    """Return a folder with the content of :attr:`Bundle.packed`, compiled, and with matplotlib's list of fonts.

    It is made once in a program, and lasts as long as the program.

    Raises
    ------
    GradingError
        If a module in it cannot be compiled.
    """
    with _unpacking:
        return Path(_unpack(packed).name) / "course"


@functools.cache
def _unpack(packed: bytes) -> tempfile.TemporaryDirectory[str]:
    """Unpack and compile a bundle in a temporary folder that lasts as long as the program; see :func:`unpacked`."""
    scratch = tempfile.TemporaryDirectory(prefix="labcourse-course-")
    folder = Path(scratch.name) / "course"
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(folder)
    if not compileall.compile_dir(folder, quiet=2):
        raise GradingError("The released course cannot be compiled.")
    _copy_fonts(folder / FONTS)
    for path in (folder, *folder.rglob("*")):  # the sandbox reads it as another user
        path.chmod(0o755 if path.is_dir() else 0o644)
    return scratch


def _copy_fonts(folder: Path) -> None:
    """Copy matplotlib's list of fonts into a new folder: without it, each run would take a second to make the list."""
    import matplotlib
    import matplotlib.font_manager  # makes the list where there is none

    folder.mkdir()
    for path in Path(matplotlib.get_cachedir()).glob("fontlist-*.json"):
        shutil.copyfile(path, folder / path.name)
