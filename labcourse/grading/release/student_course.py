"""What students get: a folder and a zip with notebooks, their packages, and how to install them. No solution, no key,
no stored answer.

Of each package, everything is released but its folder ``instructor``.
"""

from __future__ import annotations

import importlib.metadata
import json
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file, files
from labcourse.answers import starts
from labcourse.benches import OWN, PRESET, REAL, SAME
from labcourse.files import COURSE_FILE
from labcourse.grading.course import NOT_RELEASED, Course, package_folder
from labcourse.grading.release import dates, identity, student_notebooks
from labcourse.grading.release.dates import ZipTime
from labcourse.grading.release.identity import DATA, NOTEBOOKS
from rotflex.errors import GradingError

if TYPE_CHECKING:
    pass

DISTRIBUTION = "rotflex"  #: the students' distribution, whose requirements and licence a release has
_COURSE = course_file.RELEASED.parts[0]  # in the package, where an installed one has its notebooks
_NEVER = ("__pycache__", "*.pyc", ".*")

_README = """\
# {title}

You need Python {python} or newer. In this folder, once:

Windows

    py -m venv .venv
    .venv\\Scripts\\pip install .

macOS, Linux

    python3 -m venv .venv
    .venv/bin/pip install .

Then, and every time you go on working (on Windows with `.venv\\Scripts\\rotflex`):

    .venv/bin/rotflex lab

JupyterLab opens `{first}` in the folder `notebooks`. The first time, it asks for the ID that your instructor knows you
by. {bench} (Mistyped? Rename the folder `notebooks`, and start `.venv/bin/rotflex lab --student RIGHT`, which makes a
fresh one. Copy your notebooks and the folder `recordings` from the old one into it, and run them again, in order.)

Write below the lines in colour that begin with ✎: code where it says `# Your code here.`, words in the text cells.
Words are read from the saved notebook, so save it. Cells of your own may stand anywhere, and files of your own beside
the notebooks: when your work is marked, your notebooks are run from the first cell to the last, with your answers, your
cells and your files. The course's own cells are run as the course has them.

Save, and see beforehand what comes of it, and what does not, and why; nothing is marked by it:

    .venv/bin/rotflex check

If you changed or deleted something of the course's in a notebook, say in `02_...`, this gives it back, and touches no
answer:

    .venv/bin/rotflex restore 02

To hand in, say

    .venv/bin/rotflex submit

It checks once more, and packs all that counts into one zip named by your ID (`--with THEIR-ID` if you worked with
somebody), beside the folder `notebooks`. Upload that one file; the receipt says what is in it. (The folder `notebooks`,
or a zip of it, is taken as well.) In a notebook the three are `lab.check()`, `lab.restore("02")` and `lab.submit()`.

If your instructor hands out a newer release: unpack it somewhere else, not over this folder. Then, in this folder, say
`.venv/bin/pip install` with the new folder behind it, and start as always. Your answers stay; the course's own cells
become the new ones, and copies of your notebooks as they were are kept.
"""

_BENCH = {
    OWN: "Your own virtual bench is made from it.",
    SAME: "Everybody in the course has the same virtual bench.",
    PRESET: "Everybody in the course has the same virtual bench.",
    REAL: (
        """\
You are marked by what you record at the laboratory's own bench: your
notebooks keep it in the folder `recordings`, which is handed in with them."""
    ),
}


@dataclass(frozen=True)
class Release:
    """Where a release lies, the names of its notebooks, and what it is known by."""

    folder: Path
    archive: Path
    notebooks: tuple[str, ...]
    id: str


def derived(course: Course) -> dict[str, str]:
    """The student notebooks of a course: file name → text, in order.

    Raises
    ------
    GradingError
        If there are none, or if one cannot be derived.
    """
    if not course.notebooks:
        raise GradingError(f"There are no notebooks in {course.folder}.")
    found = {}
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        found[path.name] = student_notebooks.text(
            student_notebooks.student_version(notebook, path.name, course.catalogue)
        )
    return found


def write_notebooks(course: Course) -> list[Path]:
    """Derive the course's student notebooks anew, and return their paths. Points are written into the course's, too.

    Raises
    ------
    GradingError
        If a notebook cannot be derived, or if there is one there that no solution leads to.
    """
    texts = derived(course)
    folder = course.student_notebooks
    folder.mkdir(exist_ok=True)
    strays = sorted({path.name for path in folder.glob("*.ipynb")} - texts.keys())
    if strays:
        raise GradingError(
            f"{folder} holds {', '.join(strays)}, which no notebook in {course.folder} leads to: remove it."
        )
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        if student_notebooks.set_points(notebook, path.name, course.catalogue):
            files.write(path, student_notebooks.text(notebook))
    for name, content in texts.items():
        files.write(folder / name, content)
    return [folder / name for name in texts]


def build(course: Course, folder: Path, with_data: bool = False) -> tuple[str, ...]:
    """Put the student's course into a new folder, and return the names of its notebooks.

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
    if DISTRIBUTION not in course.packages:
        raise GradingError(
            f"The course's packages are {', '.join(course.packages) or 'none'}: students need {DISTRIBUTION}, too."
        )
    texts = {name: text for name, text in derived(course).items() if not _is_skipped(course, name)}
    distribution = _distribution()
    (folder / NOTEBOOKS).mkdir(parents=True)
    for name, content in texts.items():
        (folder / NOTEBOOKS / name).write_text(content, encoding="utf-8", newline="\n")
    for name in course.packages:
        _copy_package(package_folder(name), folder / name)
    about = course_file.text(_about(course, folder))
    (folder / NOTEBOOKS / COURSE_FILE).write_text(about, encoding="utf-8", newline="\n")
    if with_data:
        if not course.data.is_dir():
            raise GradingError(f"There is no data to hand out: {course.data} is missing.")
        shutil.copytree(course.data, folder / DATA, ignore=shutil.ignore_patterns(*_NEVER))
    (folder / "LICENSE").write_text(_licence(distribution), encoding="utf-8", newline="\n")
    python = (distribution.metadata["Requires-Python"] or "").removeprefix(">=")
    whose = _BENCH[course.settings.bench.which]
    readme = _README.format(title=course.title, python=python, first=Path(next(iter(texts))).stem, bench=whose)
    (folder / "README.md").write_text(readme, encoding="utf-8", newline="\n")
    project = _project_file(course, distribution, with_data)
    (folder / "pyproject.toml").write_text(project, encoding="utf-8", newline="\n")
    return tuple(texts)


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
    if folder.exists() and not replace:
        raise GradingError(f"There is {folder} already: remove it, choose another place, or say --replace.")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".rotflex-release-", dir=out) as scratch:
        built = Path(scratch) / course.name
        names = build(course, built, with_data)
        about = course_file.read(built / NOTEBOOKS) or {}
        sources = [course.folder, *(package_folder(name) for name in course.packages)]
        _write_archive(built, Path(scratch) / archive.name, dates.of_sources(sources))
        if folder.exists():
            shutil.rmtree(folder)
        built.replace(folder)
        (Path(scratch) / archive.name).replace(archive)
    return Release(folder, archive, names, about[course_file.RELEASE])


def _about(course: Course, folder: Path) -> dict[str, Any]:
    """The ``course.json`` of the release in a folder: what of the settings concerns students, and its name."""
    settings = course.settings
    about = {
        course_file.STUDENT: "",
        "title": course.title,
        "term": settings.term,
        "draw": settings.bench.draw,
        "bench": settings.bench.plain(),
        course_file.REFLECT: settings.reflect.plain(),
    }
    if settings.report.page_limit is not None:  # the names of releases stay as they are where there is none
        about[course_file.PAGE_LIMIT] = settings.report.page_limit
    if settings.given:
        about[starts.GIVEN] = _given(course)
    name = identity.name_of(identity.contents(folder), about, settings.term or course.name)
    python = settings.python or f"{sys.version_info.major}.{sys.version_info.minor}"  # work is the same under another
    return {**about, course_file.RELEASE: name, course_file.PYTHON: python}


def _is_skipped(course: Course, file: str) -> bool:
    """Whether a class that begins in the middle does not get a notebook."""
    name = course.settings.given
    return bool(name) and Path(file).stem in starts.find(course.catalogue, name).skips


def _given(course: Course) -> dict[str, Any]:
    """What is given: where benches are the students' own, each session works the values out."""
    start, bench = starts.find(course.catalogue, course.settings.given), course.settings.bench
    if bench.which == OWN:
        return starts.plain(start, None)
    if course.given is None:
        raise GradingError("The course does not say what is given: course.py should define it (Course.given).")
    return starts.plain(start, course.given(start.name, "", bench))


def _copy_package(package: Path, target: Path) -> None:
    """A package without its folder ``instructor``, and without notebooks that an installed one comes with."""
    everywhere = shutil.ignore_patterns(*_NEVER)

    def left_out(folder: str, names: list[str]) -> set[str]:
        here = {_COURSE, NOT_RELEASED} if Path(folder) == package else set()
        return everywhere(folder, names) | here.intersection(names)

    shutil.copytree(package, target, ignore=left_out)


def _distribution() -> importlib.metadata.Distribution:
    try:
        return importlib.metadata.distribution(DISTRIBUTION)
    except importlib.metadata.PackageNotFoundError:
        raise GradingError(
            f"{DISTRIBUTION} is not installed here, so that its requirements are not known: pip install it."
        ) from None


def _licence(about: importlib.metadata.Distribution) -> str:
    for file in about.metadata.get_all("License-File") or ():
        text = about.read_text(f"licenses/{file}")
        if text is not None:
            return text
    raise GradingError(f"{DISTRIBUTION} is installed without its licence.")


def _project_file(course: Course, about: importlib.metadata.Distribution, with_data: bool) -> str:
    """The student's ``pyproject.toml``: what the students' distribution says, and what the course needs besides."""
    needed = [*(one for one in about.requires or () if "extra ==" not in one), *course.requires]
    contents = {
        "name": course.name,
        "description": course.title,
        "requires-python": about.metadata["Requires-Python"],
        "license": about.metadata["License-Expression"],
        "license-files": ["LICENSE"],
        "dynamic": ["version"],
        "dependencies": needed,
    }
    installed = {NOTEBOOKS: f"{DISTRIBUTION}/{course_file.RELEASED.as_posix()}"}
    if with_data:
        installed[DATA] = f"{DISTRIBUTION}/{_COURSE}/{DATA}"
    return "\n".join(
        [
            "[build-system]",
            'requires = ["hatchling>=1.24"]',
            'build-backend = "hatchling.build"',
            "",
            "[project]",
            # What JSON writes of text and lists of text, TOML reads.
            *(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in contents.items()),
            "",
            "[project.scripts]",
            'rotflex = "rotflex.cli:run"',
            "",
            "[tool.hatch.version]",
            'path = "rotflex/__init__.py"',
            "",
            "[tool.hatch.build]",
            "ignore-vcs = true  # wherever this folder is unpacked",
            "",
            "[tool.hatch.build.targets.wheel]",
            f"packages = {json.dumps(course.packages)}",
            "",
            "[tool.hatch.build.targets.wheel.force-include]",
            *(f'"{here}" = "{there}"' for here, there in installed.items()),
            "",
        ]
    )


def _write_archive(folder: Path, archive: Path, date: ZipTime) -> None:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in _files(folder):
            entry = zipfile.ZipInfo(f"{folder.name}/{path.relative_to(folder).as_posix()}", date)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # whatever made it: attributes are Unix's
            entry.external_attr = 0o644 << 16
            packed.writestr(entry, path.read_bytes())


def _files(folder: Path) -> Iterator[Path]:
    return iter(sorted(path for path in folder.rglob("*") if path.is_file()))
