"""What students get: a folder and a zip with notebooks, wheels, and a README. No solution, no key, no stored answer.

The wheels are labcourse without its folder ``grading``, and the course's packages without the modules that the course
withholds. The notebooks are in the course's package, too, as an installed course has them.
"""

from __future__ import annotations

import importlib.metadata
import io
import json
import re
import shutil
import sys
import tempfile
import zipfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, entry_points
from pathlib import Path
from typing import Any

import numpy as np

import labcourse
from labcourse import course_file, courses, files, program
from labcourse.benches import OWN, PRESET, REAL, SAME
from labcourse.courses import GROUP, NOTEBOOKS
from labcourse.errors import GradingError
from labcourse.files import COURSE_FILE
from labcourse.grading.course import Course, package_folder
from labcourse.grading.release import percent, releases, student_notebooks
from labcourse.grading.release.releases import DATA, files_in

PACKAGE = labcourse.__name__
WHEELS = "wheels"  #: folder of a release
_README, _PROJECT = (Path(__file__).with_name(f"student_{name}") for name in ("readme.md", "pyproject.toml"))
_NOT_FOR_STUDENTS = ("grading", "LICENSE", "pyproject.toml")  # of labcourse
_UNCOPIED = ("__pycache__", "*.pyc", ".*")
_DATE = (2020, 2, 2, 0, 0, 0)  # of all files in zips, as hatchling has it in wheels: equal contents, equal bytes
_INSTRUCTORS_EXTRAS = ("grading", "postgres", "cluster")  # extras of labcourse that students have no use for
_EXTRA_MARKER = re.compile(r"\s*(?:;|\band\b)\s*extra == ['\"]([^'\"]+)['\"]$")  # the end of a requirement

#: The content of a withheld module in a release.
_STUB = """\
raise ImportError(
    "{module} is not in your course, because its questions ask you to build what it holds. "
    "Engineers and instructors have it in the full package."
)
"""

_SAME_BENCH = "Everybody in the course has the same virtual {word}."
_BENCH_TEXT = {
    OWN: "Your own virtual {word} is made from it.",
    SAME: _SAME_BENCH,
    PRESET: _SAME_BENCH,
    REAL: "You are marked by what you record at the laboratory's own {word}: the folder `recordings` is handed in.",
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
    """Derive the course's student notebooks anew, write them, and return their paths.

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
    without = course.settings.without
    texts = {name: text for name, text in derive_notebooks(course).items() if Path(name).stem not in without}
    (folder / NOTEBOOKS).mkdir(parents=True)
    for name, content in texts.items():
        of_class = student_notebooks.without_lines(content, course.off)
        files.write(folder / NOTEBOOKS / name, student_notebooks.without_links(of_class, without))
    for name in (PACKAGE, *course.packages):
        # A release has notebooks beside its packages.
        ignored = (*_UNCOPIED, NOTEBOOKS, *(_NOT_FOR_STUDENTS if name == PACKAGE else ()))
        shutil.copytree(package_folder(name), folder / name, ignore=shutil.ignore_patterns(*ignored))
    for module in course.withheld:
        path = folder / f"{module.replace('.', '/')}.py"
        if not path.is_file():
            raise GradingError(f"The course withholds {module}, and none of its packages has such a module.")
        files.write(path, _STUB.format(module=module))
    files.write(folder / NOTEBOOKS / COURSE_FILE, course_file.text(_course_json(course, folder)))
    if with_data:
        if not course.data.is_dir():
            raise GradingError(f"There is no data to hand out: {course.data} is missing.")
        shutil.copytree(course.data, folder / DATA, ignore=shutil.ignore_patterns(*_UNCOPIED))
    word = course.catalogue.bench_word
    readme = _README.read_text(encoding="utf-8").format(
        title=course.title,
        python=_python(),
        first=Path(next(iter(texts))).stem,
        bench=_BENCH_TEXT[course.settings.bench.which].format(word=word),
        word=word,
        command=course.command,
    )
    files.write(folder / "README.md", readme)
    return tuple(texts)


def release(course: Course, out: Path, *, with_data: bool = False, replace: bool = False) -> Release:
    """Build a release as a folder with the course's name in ``out``, and as a zip beside it.

    Parameters
    ----------
    course : the course
    out : where to; made if needed
    with_data : hand out the sample recordings, too
    replace : whether an earlier release in ``out`` may be deleted

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
        _pack_wheels(course, built, course_json[course_file.RELEASE_KEY])
        packed = zip_files({f"{course.name}/{name}": path for name, path in files_in(built).items()})
        files.write(archive, packed)  # first: if the disk is full, the earlier release stays whole
        if folder.exists():
            shutil.rmtree(folder)
        built.replace(folder)
    return Release(folder, archive, names, course_json[course_file.RELEASE_KEY])


def _course_json(course: Course, folder: Path) -> dict[str, Any]:
    """Return the content of ``course.json`` for a release: its name, and the settings for students.

    Parameters
    ----------
    course : the course
    folder : of the release, with its notebooks and packages, and nothing else yet
    """
    settings = course.settings
    course_json: dict[str, Any] = {
        course_file.STUDENT_KEY: "",
        course_file.COURSE_KEY: courses.name_of(course.package),
        "title": course.title,
        "term": settings.term,
        "draw": settings.bench.draw,
        "bench": settings.bench.as_json(),
        course_file.REFLECT: settings.reflect.as_json(),
        course_file.WITHOUT: sorted(settings.without),
    }
    if settings.report.page_limit is not None:  # without one, names of releases stay the same
        course_json[course_file.PAGE_LIMIT] = settings.report.page_limit
    if course.catalogue.optional:  # also without any, so that restoring a student's folder takes them out
        course_json[course_file.OPTIONAL] = sorted(settings.optional)
    asked = {(number, name) for number, question in course.asked_catalogue.marked.items() for name in question.names}
    for (question, part), value in course.given_values("", settings.bench, asked).items():
        if value is not None:
            course_json.setdefault(course_file.GIVEN, {}).setdefault(question, {})[part] = np.asarray(value).tolist()
    name = releases.name_of(folder, course_json, settings.term or course.name)
    # The version of Python is no part of the name: work under another version is the same.
    python = settings.python or f"{sys.version_info.major}.{sys.version_info.minor}"
    return {**course_json, course_file.RELEASE_KEY: name, course_file.PYTHON: python}


def _pack_wheels(course: Course, folder: Path, release: str) -> None:
    """Replace the packages in a release's folder by wheels, and write the ``pyproject.toml`` that installs these.

    Parameters
    ----------
    course : the course
    folder : of the release; the licences are put into it, too
    release : name of the release
    """
    home = folder.joinpath(*course.package.split("."))
    for name in (NOTEBOOKS, DATA):
        if (folder / name).is_dir():
            shutil.copytree(folder / name, home / name)
    files.write(folder / "LICENSE", importlib.metadata.distribution(PACKAGE).read_text("licenses/LICENSE") or "")
    wheel_files = [_build_wheel(folder / PACKAGE, f"students.{releases.digest(folder / PACKAGE)}", folder / WHEELS)]
    (folder / "LICENSE").unlink()  # that was labcourse's, for its wheel; the course has its own, or none
    if (licence := course.folder.parent / "LICENSE").is_file():
        shutil.copy(licence, folder / licence.name)
    for name in course.packages:
        brings = course.package if course.package.partition(".")[0] == name else ""
        local = f"course.{release.rpartition('-')[2]}"
        wheel_files.append(_build_wheel(folder / name, local, folder / WHEELS, brings, course.requires))
    for name in (PACKAGE, *course.packages):
        shutil.rmtree(folder / name)
    files.write(folder / "pyproject.toml", _project(course, wheel_files))


def zip_files(files: Mapping[str, Path]) -> bytes:
    """Return a zip of files (name in the zip → path); the same names and contents give the same bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, path in files.items():
            entry = zipfile.ZipInfo(name, _DATE)
            entry.create_system = 3  # Unix, on whatever system it is made: the attributes are Unix's
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# --- wheels, and the project that installs them all by ``pip install .`` ----------------------------------------------


def _build_wheel(package: Path, local: str, out: Path, course: str = "", requires: Sequence[str] = ()) -> Path:
    """Make the wheel of a package as students get it.

    Parameters
    ----------
    package : its folder; if it is of an installed distribution, the metadata is taken from that
    local : the local part of the version, as "course.3f2a9c41"
    out : folder for the wheel; made if needed
    course : import name of the course's package, if it is in this one
    requires : what the course needs besides, as pip takes it

    Returns
    -------
    Path
        The wheel.

    Raises
    ------
    GradingError
        If what the course needs besides is not written as pip takes it.
    """
    from hatchling.builders.wheel import WheelBuilder
    from hatchling.metadata.core import ProjectMetadata
    from hatchling.plugin.manager import PluginManager

    root = str(package.parent)
    tool = {"hatch": {"build": {"ignore-vcs": True, "targets": {"wheel": {"packages": [package.name]}}}}}
    config = {"project": _wheel_metadata(package.name, local, course, requires), "tool": tool}
    builder = WheelBuilder(root, metadata=ProjectMetadata(root, PluginManager(), config))
    out.mkdir(exist_ok=True)
    try:
        return Path(next(iter(builder.build(directory=str(out), versions=["standard"]))))
    except ValueError as error:
        advice = "In course.py, each text in requires=(…) is one package, as pip takes it."
        raise GradingError(f"The wheel of {package.name} cannot be made: {error} {advice}") from None


def _wheel_metadata(package: str, local: str, course: str, requires: Sequence[str]) -> dict[str, Any]:
    """Return the metadata of a wheel, as in the table ``[project]``. Parameters as for :func:`_build_wheel`."""
    distribution = _installed_distribution(package)
    needed, extras = _requirements(distribution)
    entry_points: dict[str, dict[str, str]] = defaultdict(dict)
    for point in distribution.entry_points if distribution else ():
        entry_points[point.group][point.name] = point.value
    if course:
        entry_points[GROUP].setdefault(courses.name_of(course), course)
    is_engine = package == PACKAGE
    return {
        "name": distribution.name if distribution else package,
        "version": f"{distribution.version if distribution else labcourse.__version__}+{local}",
        "requires-python": f">={_python()}",
        "dependencies": needed if is_engine else [*needed, f"{PACKAGE}=={labcourse.__version__}", *requires],
        "optional-dependencies": extras if is_engine else {},
        "scripts": entry_points["console_scripts"],
        "entry-points": {GROUP: entry_points[GROUP]} if entry_points[GROUP] else {},
    }


def _installed_distribution(package: str) -> Distribution | None:
    """Find the distribution that a package was installed by; None for a package that lies beside a course."""
    names = importlib.metadata.packages_distributions().get(package, [package])
    try:
        return importlib.metadata.distribution(names[0])
    except importlib.metadata.PackageNotFoundError:
        return None


def _requirements(distribution: Distribution | None) -> tuple[list[str], dict[str, list[str]]]:
    """Return the requirements of a distribution, and of its extras that students may use: extra → requirements."""
    needed: list[str] = []
    extras: dict[str, list[str]] = {}
    for requirement in (distribution.requires or []) if distribution else []:
        extra = _EXTRA_MARKER.search(requirement)
        if extra is None:
            needed.append(requirement)
        elif extra[1] not in _INSTRUCTORS_EXTRAS:
            extras.setdefault(extra[1], []).append(requirement[: extra.start()])
    return needed, extras


def _project(course: Course, wheel_files: Sequence[Path]) -> str:
    """Write the ``pyproject.toml`` of a release: a project without files, which needs the wheels beside it."""
    wheels = [f"{path.name.partition('-')[0]} @ {{root:uri}}/{path.parent.name}/{path.name}" for path in wheel_files]
    engine = [wheel.replace(PACKAGE, f"{PACKAGE}[report]", 1) for wheel in wheels if wheel.startswith(PACKAGE)]
    # Texts and lists in JSON are valid TOML, too.
    texts = {"name": course.name, "title": course.title, "dependencies": wheels, "report": engine}
    # uv and pipx give a person the commands of this project alone, and not those of its wheels.
    points = entry_points(group="console_scripts", name=course.command)
    scripts = "\n".join(f"{json.dumps(point.name)} = {json.dumps(point.value)}" for point in points)
    as_toml = {key: json.dumps(value, ensure_ascii=False) for key, value in texts.items()}
    return _PROJECT.read_text(encoding="utf-8").format(python=_python(), scripts=scripts, **as_toml)


def _python() -> str:
    """Return the oldest version of Python that labcourse runs on, as "3.11"."""
    return importlib.metadata.metadata(PACKAGE)["Requires-Python"].removeprefix(">=")
