"""What students get: a folder and a zip with notebooks, wheels, and a README. No solution, no key, no stored answer.

The wheels are labcourse without its folder ``grading``, and the course's packages without the modules that the course
withholds. The notebooks are in the course's package, too, as an installed course has them.
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import labcourse
from labcourse import course_file, files, program
from labcourse.answers import starts
from labcourse.benches import OWN, PRESET, REAL, SAME
from labcourse.courses import NOTEBOOKS
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course, package_folder
from labcourse.grading.release import percent, releases, student_notebooks, wheels
from labcourse.grading.release.releases import DATA, files_in

ZipTime = tuple[int, int, int, int, int, int]  #: year, month, day, hour, minute, second
PACKAGE = labcourse.__name__
WHEELS = "wheels"  #: folder of a release
_README = Path(__file__).with_name("student_readme.md")
_NOT_FOR_STUDENTS = ("grading", "LICENSE", "pyproject.toml")  # of labcourse
_UNCOPIED = ("__pycache__", "*.pyc", ".*")
# The times that a zip can hold, s since 1970, UTC: from 1980 to 2107.
_FIRST_ZIP_TIME, _LAST_ZIP_TIME = 315_532_800, 4_354_819_198
_NOT_SOURCE = re.compile(rf"/(\.|__pycache__|{re.escape(ANSWERS_FILE)})")  # what is hidden, or left by a run

#: The content of a withheld module in a release.
_STUB = """\
raise ImportError(
    "{module} is not in your course, because its questions ask you to build what it holds. "
    "Engineers and instructors have it in the full package."
)
"""

_BENCH_TEXT = {
    OWN: "Your own virtual bench is made from it.",
    SAME: "Everybody in the course has the same virtual bench.",
    PRESET: "Everybody in the course has the same virtual bench.",
    REAL: (
        "You are marked by what you record at the laboratory's own bench: your\nnotebooks store it in the folder "
        "`recordings`, which is handed in with them."
    ),
}


@dataclass(frozen=True)
class Release:
    """Folder and zip of a release, the names of its notebooks, and the name of the release."""

    folder: Path
    archive: Path
    notebooks: tuple[str, ...]
    id: str


def derive_notebooks(course: Course) -> dict[str, str]:
    """Derive the student notebooks of a course: file name → text, in order.

    Raises
    ------
    GradingError
        If there are none, if one cannot be derived, or if one differs from what its text (percent format) gives.
    """
    for path in percent.outdated(course):
        raise GradingError(f"{path.name} is not what {path.stem}.py gives: say {program.name()} make-notebooks.")
    if not course.notebooks:
        raise GradingError(f"There are no notebooks in {course.folder}.")
    notebooks = {path.name: student_notebooks.read(path) for path in course.notebooks}
    return {
        name: student_notebooks.text(student_notebooks.student_version(notebook, name, course.catalogue))
        for name, notebook in notebooks.items()
    }


def write_notebooks(course: Course) -> list[Path]:
    """Derive the course's student notebooks anew, and return their paths.

    Before that, the course's notebooks that are written as text are made. Points are written into the course's
    notebooks, too. Notebooks that were made or derived earlier are removed if their source is gone.

    Raises
    ------
    GradingError
        If a notebook cannot be derived.
    """
    percent.write(course)
    texts = derive_notebooks(course)
    folder = course.student_notebooks
    folder.mkdir(exist_ok=True)
    for path in sorted(folder.glob("*.ipynb")):
        if path.name not in texts and student_notebooks.is_derived(student_notebooks.read(path)):
            path.unlink()  # its solution has another name now
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        if student_notebooks.set_points(notebook, path.name, course.catalogue):
            files.write(path, student_notebooks.text(notebook))
    for name, content in texts.items():
        files.write(folder / name, content)
    return [folder / name for name in texts]


def build(course: Course, folder: Path, with_data: bool = False) -> tuple[str, ...]:
    """Put the contents of a release into a new folder, with packages as folders; return the notebooks' file names.

    Parameters
    ----------
    course : the course
    folder : must not exist yet
    with_data : hand out the sample recordings, too

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    given = course.settings.given
    skipped = starts.find(course.catalogue, given).skips if given else ()  # by a class that begins in the middle
    texts = {name: text for name, text in derive_notebooks(course).items() if Path(name).stem not in skipped}
    (folder / NOTEBOOKS).mkdir(parents=True)
    for name, content in texts.items():
        _write_text(folder / NOTEBOOKS / name, content)
    for name in (PACKAGE, *course.packages):
        _copy_package(package_folder(name), folder / name)
    for module in course.withheld:
        path = folder / f"{module.replace('.', '/')}.py"
        if not path.is_file():
            raise GradingError(f"The course withholds {module}, and none of its packages has such a module.")
        _write_text(path, _STUB.format(module=module))
    _write_text(folder / NOTEBOOKS / COURSE_FILE, course_file.text(_course_json(course, folder)))
    if with_data:
        if not course.data.is_dir():
            raise GradingError(f"There is no data to hand out: {course.data} is missing.")
        shutil.copytree(course.data, folder / DATA, ignore=shutil.ignore_patterns(*_UNCOPIED))
    readme = _README.read_text(encoding="utf-8").format(
        title=course.title,
        python=wheels.python(),
        first=Path(next(iter(texts))).stem,
        bench=_BENCH_TEXT[course.settings.bench.which],
        command=course.command,
    )
    _write_text(folder / "README.md", readme)
    return tuple(texts)


def _write_text(path: Path, text: str) -> None:
    """Write a text with the same line ends on every system."""
    path.write_text(text, encoding="utf-8", newline="\n")


def release(course: Course, out: Path, with_data: bool = False, replace: bool = False) -> Release:
    """Build the student's course as a folder of its name in ``out``, and as a zip.

    Parameters
    ----------
    course : the course
    out : where to; made if needed
    with_data : hand out the sample recordings, too
    replace : an earlier release in ``out`` may be deleted

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived, or if there is a release in ``out`` already.
    """
    folder, archive = out / course.name, out / f"{course.name}.zip"
    if not replace and (earlier := [path for path in (folder, archive) if path.exists()]):
        raise GradingError(f"There is {earlier[0]} already: remove it, choose another place, or say --replace.")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".labcourse-release-", dir=out) as scratch:
        built = Path(scratch) / course.name
        names = build(course, built, with_data)
        course_json = course_file.read(built / NOTEBOOKS) or {}
        _pack_wheels(course, built, course_json[course_file.RELEASE])
        sources = [course.folder, *map(package_folder, (PACKAGE, *course.packages))]
        named = {f"{course.name}/{name}": path for name, path in files_in(built).items()}
        packed = zip_files(named, zip_time_of(sources))
        files.write(archive, packed)  # first: if the disk is full, the earlier release stays whole
        if folder.exists():
            shutil.rmtree(folder)
        built.replace(folder)
    return Release(folder, archive, names, course_json[course_file.RELEASE])


def _course_json(course: Course, folder: Path) -> dict[str, Any]:
    """Return the content of ``course.json`` for a release: its name, and the settings for students.

    Parameters
    ----------
    course : the course
    folder : of the release, with its notebooks and packages, and nothing else yet
    """
    settings = course.settings
    course_json = {
        course_file.STUDENT: "",
        "title": course.title,
        "term": settings.term,
        "draw": settings.bench.draw,
        "bench": settings.bench.as_json(),
        course_file.REFLECT: settings.reflect.as_json(),
    }
    if settings.report.page_limit is not None:  # without one, names of releases stay the same
        course_json[course_file.PAGE_LIMIT] = settings.report.page_limit
    if settings.given:
        course_json[starts.GIVEN] = _given_values(course)
    name = releases.name_of(folder, course_json, settings.term or course.name)
    # The version of Python is no part of the name: work under another version is the same.
    python = settings.python or f"{sys.version_info.major}.{sys.version_info.minor}"
    return {**course_json, course_file.RELEASE: name, course_file.PYTHON: python}


def _given_values(course: Course) -> dict[str, Any]:
    """Return what is given to a class that begins in the middle, for ``course.json``.

    With own benches it has no values: each student's session works them out.

    Raises
    ------
    GradingError
        If the course has no function ``given``.
    """
    start, bench = starts.find(course.catalogue, course.settings.given), course.settings.bench
    if bench.which == OWN:
        return starts.as_json(start, None)
    if course.given is None:
        raise GradingError("The course does not say what is given: course.py should define it (Course.given).")
    return starts.as_json(start, course.given(start.name, "", bench))


def _copy_package(package: Path, target: Path) -> None:
    """Copy a package as students get it, without notebooks: a release has them beside its packages."""
    ignored = (*_UNCOPIED, NOTEBOOKS, *(_NOT_FOR_STUDENTS if package.name == PACKAGE else ()))
    shutil.copytree(package, target, ignore=shutil.ignore_patterns(*ignored))


def _pack_wheels(course: Course, folder: Path, release: str) -> None:
    """Replace the packages in a release's folder by wheels, and write the ``pyproject.toml`` that installs these.

    Parameters
    ----------
    course : the course
    folder : of the release; the licences are put into it, too
    release : its name
    """
    home = folder.joinpath(*course.package.split("."))
    for name in (NOTEBOOKS, DATA):
        if (folder / name).is_dir():
            shutil.copytree(folder / name, home / name)
    _write_text(folder / "LICENSE", wheels.licence())
    wheel_files = [wheels.build(folder / PACKAGE, f"students.{releases.digest(folder / PACKAGE)}", folder / WHEELS)]
    (folder / "LICENSE").unlink()  # that was labcourse's, for its wheel; the course has its own, or none
    if (licence := course.folder.parent / "LICENSE").is_file():
        shutil.copy(licence, folder / licence.name)
    for name in course.packages:
        brings = course.package if course.package.partition(".")[0] == name else ""
        local = f"course.{release.rpartition('-')[2]}"
        wheel_files.append(wheels.build(folder / name, local, folder / WHEELS, brings, course.requires))
    for name in (PACKAGE, *course.packages):
        shutil.rmtree(folder / name)
    _write_text(folder / "pyproject.toml", wheels.release_project(course.name, course.title, wheel_files))


def zip_files(files: Mapping[str, Path], date: ZipTime) -> bytes:
    """Zip files; the same names, contents and date give the same bytes.

    Parameters
    ----------
    files : name in the zip → file
    date : of all of them
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, path in files.items():
            entry = zipfile.ZipInfo(name, date)
            entry.create_system = 3  # Unix, on whatever system it is made: the attributes are Unix's
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def zip_time_of(folders: Iterable[Path]) -> ZipTime:
    """Return the time of the last commit that changed something in one of the folders, in UTC, as zips have it.

    The same sources give the same bytes. A folder that is in no repository, as that of an installed package, counts by
    its newest file.
    """
    newest = max(map(_source_time, folders))
    return time.gmtime(min(max(newest, _FIRST_ZIP_TIME), _LAST_ZIP_TIME))[:6]


def _source_time(folder: Path) -> float:
    """Return when something in a folder was committed last, or else when its newest file was written, s since 1970."""
    command = ["git", "log", "-1", "--format=%ct", "--", "."]
    with contextlib.suppress(OSError, subprocess.SubprocessError, ValueError):  # no git, no repository, or no commit
        return int(subprocess.run(command, cwd=folder, capture_output=True, timeout=20, check=True).stdout)
    sources = (path for name, path in files_in(folder).items() if not _NOT_SOURCE.search(f"/{name}"))
    return max(path.stat().st_mtime for path in sources)
