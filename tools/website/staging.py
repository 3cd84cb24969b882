"""Copy what a site shows into a folder for Sphinx, and nothing else.

All has the place there that it has in the repository, so links lead where they lead on any code host. There are two
sites. The public one may be read by students, so no page that gives an answer away is copied for it. The instructors'
has these pages, too.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection
from pathlib import Path, PurePosixPath

from labcourse.grading import course

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

#: Pages, folders and modules that give answers away: in the instructors' site alone.
FOR_INSTRUCTORS = (
    "docs/errata_answers.md",
    "docs/derivation.html",
    "docs/guide",
    "docs/reference/answers.md",
    "labcourse/grading",
    "solutions",
    *(f"{module.replace('.', '/')}.py" for module in course.find(ROOT).withheld),
)
BESIDE = ("CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "contrib/serial/README.md", "contrib/rig/README.md")


def write(folder: Path, instructors: bool = False) -> None:
    """Copy pages, pictures and files into a folder that is not there yet."""

    def left_out(place: str, names: Collection[str]) -> list[str]:
        inside = Path(place).relative_to(ROOT)
        return [name for name in names if not instructors and is_for_instructors((inside / name).as_posix())]

    shutil.copytree(DOCS, folder / "docs", ignore=left_out)
    for name in BESIDE:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)


def is_for_instructors(path: str) -> bool:
    """Tell whether a file of the repository is for instructors only."""
    return any(PurePosixPath(path).is_relative_to(one) for one in FOR_INSTRUCTORS)
