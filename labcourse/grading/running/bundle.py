"""What submissions are run with: the course as students have it, sent along as one zip.

Work is run with the release that it was begun under: the course as it is now, or one that was handed out before.
"""

from __future__ import annotations

import compileall
import hashlib
import io
import json
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file
from labcourse.answers import cell_reports, starts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.starts import Start
from labcourse.benches import THEIR_OWN, BenchPolicy
from labcourse.errors import ConfigurationError, GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.release import student_course, student_notebooks
from labcourse.grading.release.releases import NOTEBOOKS, StoredRelease

if TYPE_CHECKING:
    from nbformat import NotebookNode

INSIDE, FONTS = "inside", "matplotlib"  #: folders beside the packages
_PROGRAMS = Path(__file__).resolve().parent / "inside"
_REPORTS = Path(cell_reports.__file__)  # goes along with them: the packages of an early release do not have it


@dataclass(frozen=True)
class Bundle:
    """What submissions are run with. Made by :func:`build` or :func:`of_release`.

    Attributes
    ----------
    packed : a zip of the students' packages, and of the programs that run notebooks
    pristine : notebook's file name → notebook as released
    answer_cells : notebook's file name → ids of the cells that students fill in
    parameters : of the notebooks, besides the student
    imports : modules that notebooks use
    digest : of all of this; another digest is another bundle
    release : name of the release that it is
    policy : which bench each student has
    asked : the (question, part) that its notebooks ask for, of those that the course has
    start : where it begins in the middle; None for at the beginning
    catalogue : of the course, of what is asked of a class that begins there; None if that is not known
    """

    packed: bytes
    pristine: Mapping[str, dict[str, Any]]
    answer_cells: Mapping[str, list[str]]
    parameters: Mapping[str, str]
    imports: tuple[str, ...]
    digest: str
    release: str = ""
    policy: BenchPolicy = THEIR_OWN
    asked: frozenset[tuple[str, str]] = frozenset()
    start: Start | None = None
    catalogue: Catalogue | None = None


def build(course: Course) -> Bundle:
    """The bundle of a course as it is now.

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    with tempfile.TemporaryDirectory(prefix="labcourse-course-") as scratch:
        folder = Path(scratch) / "course"
        student_course.build(course, folder)
        about = course_file.read(folder / NOTEBOOKS) or {}
        packages = (student_course.PACKAGE, *course.packages)
        return _bundle(course, folder, packages, about[course_file.RELEASE], course.settings.bench)


def of_release(release: StoredRelease, course: Course) -> Bundle:
    """The bundle of a release that was handed out before, with its notebooks and packages as they were.

    Parameters
    ----------
    release : as it was kept
    course : as it is now

    Raises
    ------
    GradingError
        If the release cannot be read.
    """
    with tempfile.TemporaryDirectory(prefix="labcourse-release-") as scratch:
        folder = Path(scratch)
        release.unpack(folder)
        return _bundle(course, folder, release.packages, release.id, release.policy)


def _bundle(course: Course, folder: Path, packages: tuple[str, ...], release: str, policy: BenchPolicy) -> Bundle:
    """The bundle of a release that lies in a folder."""
    paths = sorted((folder / NOTEBOOKS).glob("*.ipynb"))
    notebooks = {path.name: student_notebooks.read(path) for path in paths}
    about = folder / NOTEBOOKS / COURSE_FILE
    start = _start(about, course)
    catalogue = starts.narrowed(course.catalogue, start)
    if about.exists():  # where an installed release has it: it says which bench students have
        place = folder.joinpath(*course.package.split("."), NOTEBOOKS)
        place.mkdir(parents=True)
        shutil.copyfile(about, place / COURSE_FILE)
    packed = _pack([*(folder / name for name in packages), _PROGRAMS], {f"{INSIDE}/{_REPORTS.name}": _REPORTS})
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    imports = tuple(name for name in course.imports if _is_there(name, folder, packages))
    depends = [texts, dict(course.parameters), imports]
    digest = hashlib.sha256(packed + json.dumps(depends, sort_keys=True).encode()).hexdigest()
    return Bundle(
        packed=packed,
        pristine={name: json.loads(text) for name, text in texts.items()},
        answer_cells={name: student_notebooks.answer_cells(notebook) for name, notebook in notebooks.items()},
        parameters=dict(course.parameters),
        imports=imports,
        digest=digest,
        release=release,
        policy=policy,
        asked=frozenset(_asked(notebooks, catalogue)),
        start=start,
        catalogue=catalogue,
    )


def _start(about: Path, course: Course) -> Start | None:
    """Where a release begins, by its ``course.json``."""
    try:
        return (
            starts.chosen(json.loads(about.read_text(encoding="utf-8")), course.catalogue) if about.exists() else None
        )
    except (ValueError, ConfigurationError) as error:
        raise GradingError(f"{COURSE_FILE}: {error}") from None


def _is_there(module: str, folder: Path, packages: tuple[str, ...]) -> bool:
    """Whether a module can be imported: an older release may not have all that the course has now."""
    if module.partition(".")[0] not in packages:
        return True  # of a library
    place = folder.joinpath(*module.split("."))
    return place.with_suffix(".py").is_file() or (place / "__init__.py").is_file()


def _asked(notebooks: Mapping[str, NotebookNode], catalogue: Catalogue) -> Iterator[tuple[str, str]]:
    for notebook in notebooks.values():
        for one in student_notebooks.recorded(notebook):
            question = catalogue.everything.get(one.question)
            if question is not None:
                yield from ((one.question, part) for part in one.of(question) if part in question.names)


def _pack(folders: Iterable[Path], more: Mapping[str, Path]) -> bytes:
    """A zip of some folders, side by side, and of more files: name → where it is.

    No file bears the time that it was made at, so that the same course gives the same bytes.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in more.items():
            archive.writestr(zipfile.ZipInfo(name), path.read_bytes(), zipfile.ZIP_DEFLATED)
        for folder in folders:
            for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"):
                entry = zipfile.ZipInfo(f"{folder.name}/{path.relative_to(folder).as_posix()}")
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# --- where it is run --------------------------------------------------------------------------------------------------

_unpacked: dict[str, tempfile.TemporaryDirectory[str]] = {}
_unpacking = threading.Lock()


def unpacked(packed: bytes) -> Path:
    """A folder with what a course's :attr:`~Bundle.packed` holds, compiled, and with matplotlib's list of fonts.

    It is made once in a program, and lasts as long as that.
    """
    digest = hashlib.sha256(packed).hexdigest()
    with _unpacking:
        if digest not in _unpacked:
            scratch = tempfile.TemporaryDirectory(prefix="labcourse-course-")
            _unpack(packed, Path(scratch.name))
            _unpacked[digest] = scratch
    return Path(_unpacked[digest].name) / "course"


def _unpack(packed: bytes, scratch: Path) -> None:
    folder = scratch / "course"
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(folder)
    if not compileall.compile_dir(folder, quiet=2):
        raise GradingError("The released course cannot be compiled.")
    _put_fonts(folder / FONTS)
    for path in (folder, *folder.rglob("*")):  # to be read by whoever the sandbox makes of us
        path.chmod(0o755 if path.is_dir() else 0o644)


def _put_fonts(folder: Path) -> None:
    """Matplotlib's list of fonts, or each run would make it anew, for a second."""
    import matplotlib
    import matplotlib.font_manager  # makes the list where there is none

    folder.mkdir()
    for path in Path(matplotlib.get_cachedir()).glob("fontlist-*.json"):
        shutil.copyfile(path, folder / path.name)
