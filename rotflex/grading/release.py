"""What students get: a folder and a zip with notebooks, the package without its instructor-only rooms, and how to
install it. No solution, no key, no stored answer.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rotflex.errors import GradingError
from rotflex.grading import notebooks

FOLDER = "rotflex-course"
#: Rooms of the package that build what the questions ask for, or that mark it.
INSTRUCTOR_ROOMS = ("design.py", "model.py", "stiffness.py", "symbolic.py", "gradebook", "grading", "isolation")
_NEVER = ("__pycache__", "*.pyc", ".*")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold; every file bears it, so that bytes repeat

_README = """\
# The rotary flexible joint laboratory

You need Python {python} or newer. In this folder, once:

Windows

    py -m venv .venv
    .venv\\Scripts\\pip install .

macOS, Linux

    python3 -m venv .venv
    .venv/bin/pip install .

Then, and every time you go on working (on Windows with `.venv\\Scripts\\rotflex`):

    .venv/bin/rotflex lab --student YOUR-ID

JupyterLab opens on the folder `notebooks`. Begin with `00_start`. Use the ID that your instructor knows you by: your
own virtual bench is made from it.

Write in the cells that say `# Your code here.` and leave the others as they are: when your work is marked, the code of
those cells is taken over, and nothing else. Before you hand in, choose *Kernel → Restart Kernel and Run All Cells…* in
each notebook and see that it runs to its end.

Hand in the folder `notebooks`, or a zip of it.
"""


@dataclass(frozen=True)
class Release:
    """Where a release lies, and the names of its notebooks."""

    folder: Path
    archive: Path
    notebooks: tuple[str, ...]


def student_notebooks(source: Path) -> dict[str, str]:
    """The student notebooks derived from ``source/solutions``: file name → text, in order.

    Raises
    ------
    GradingError
        If there are none, or if one cannot be derived.
    """
    return {
        path.name: notebooks.text(notebooks.student_version(notebooks.read(path), path.name))
        for path in notebooks.instructor_notebooks(source)
    }


def write_notebooks(source: Path) -> list[str]:
    """Derive ``source/notebooks`` from ``source/solutions`` anew, and return the names.

    Raises
    ------
    GradingError
        If a notebook cannot be derived, or if there is one there that no solution leads to.
    """
    texts = student_notebooks(source)
    folder = source / "notebooks"
    folder.mkdir(exist_ok=True)
    strays = sorted({path.name for path in folder.glob("*.ipynb")} - texts.keys())
    if strays:
        raise GradingError(f"{folder} holds {', '.join(strays)}, which nothing in solutions/ leads to: remove it.")
    for name, content in texts.items():
        (folder / name).write_text(content, encoding="utf-8", newline="\n")
    return list(texts)


def build(source: Path, folder: Path, with_data: bool = False) -> tuple[str, ...]:
    """Put the student's course into a new folder, and return the names of its notebooks.

    Parameters
    ----------
    source : a checkout of the course
    folder : must not exist yet
    with_data : hand out the sample recordings, too

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    for needed in ("rotflex", "LICENSE", "pyproject.toml"):
        if not (source / needed).exists():
            raise GradingError(f"{source.resolve()} is not a checkout of the course: it has no {needed}.")
    texts = student_notebooks(source)
    (folder / "notebooks").mkdir(parents=True)
    for name, content in texts.items():
        (folder / "notebooks" / name).write_text(content, encoding="utf-8", newline="\n")
    _copy_package(source / "rotflex", folder / "rotflex")
    if with_data:
        shutil.copytree(source / "data", folder / "data", ignore=shutil.ignore_patterns(*_NEVER))
    shutil.copyfile(source / "LICENSE", folder / "LICENSE")
    project = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    readme = _README.format(python=project["requires-python"].removeprefix(">="))
    (folder / "README.md").write_text(readme, encoding="utf-8", newline="\n")
    (folder / "pyproject.toml").write_text(_project_file(project, with_data), encoding="utf-8", newline="\n")
    return tuple(texts)


def release(source: Path, out: Path, with_data: bool = False, replace: bool = False) -> Release:
    """Build the student's course as ``out/rotflex-course`` and ``out/rotflex-course.zip``.

    Parameters
    ----------
    source : a checkout of the course
    out : where to; made if needed
    with_data : hand out the sample recordings, too
    replace : an earlier release in ``out`` may be deleted

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived, or if there is a release in ``out`` already.
    """
    folder, archive = out / FOLDER, out / f"{FOLDER}.zip"
    if folder.exists() and not replace:
        raise GradingError(f"There is {folder} already: remove it, choose another place, or say --replace.")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".rotflex-release-", dir=out) as scratch:
        built = Path(scratch) / FOLDER
        names = build(source, built, with_data)
        _write_archive(built, Path(scratch) / archive.name)
        if folder.exists():
            shutil.rmtree(folder)
        built.replace(folder)
        (Path(scratch) / archive.name).replace(archive)
    return Release(folder, archive, names)


def _copy_package(package: Path, target: Path) -> None:
    """The package without the instructor's rooms, which are all at its top."""
    everywhere = shutil.ignore_patterns(*_NEVER)

    def left_out(folder: str, names: list[str]) -> set[str]:
        here = {"_course", *INSTRUCTOR_ROOMS} if Path(folder) == package else set()
        return everywhere(folder, names) | here.intersection(names)

    shutil.copytree(package, target, ignore=left_out)


def _project_file(project: dict[str, object], with_data: bool) -> str:
    """The student's ``pyproject.toml``: what the checkout's says, without what instructors and tests need."""
    copied = ("name", "description", "requires-python", "license", "license-files", "dynamic", "dependencies")
    # What JSON writes of text and lists of text, TOML reads.
    lines = [f"{key} = {json.dumps(project[key], ensure_ascii=False)}" for key in copied]
    course = {"notebooks": "rotflex/_course/notebooks"} | ({"data": "rotflex/_course/data"} if with_data else {})
    return "\n".join(
        [
            "[build-system]",
            'requires = ["hatchling>=1.24"]',
            'build-backend = "hatchling.build"',
            "",
            "[project]",
            *lines,
            "",
            "[project.scripts]",
            'rotflex = "rotflex.cli:app"',
            "",
            "[tool.hatch.version]",
            'path = "rotflex/__init__.py"',
            "",
            "[tool.hatch.build]",
            "ignore-vcs = true  # wherever this folder is unpacked",
            "",
            "[tool.hatch.build.targets.wheel]",
            'packages = ["rotflex"]',
            "",
            "[tool.hatch.build.targets.wheel.force-include]",
            *(f'"{here}" = "{there}"' for here, there in course.items()),
            "",
        ]
    )


def _write_archive(folder: Path, archive: Path) -> None:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in _files(folder):
            entry = zipfile.ZipInfo(f"{folder.name}/{path.relative_to(folder).as_posix()}", _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # whatever made it: attributes are Unix's
            entry.external_attr = 0o644 << 16
            packed.writestr(entry, path.read_bytes())


def _files(folder: Path) -> Iterator[Path]:
    return iter(sorted(path for path in folder.rglob("*") if path.is_file()))
