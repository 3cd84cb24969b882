"""Courses made for a test: this one with another key, or with notebooks of a test's own."""

import shutil
from collections.abc import Iterable
from pathlib import Path

from checkout import ROOT

from labcourse.grading import course as courses
from labcourse.grading.course import Course


def copied(folder: Path, notebooks: Iterable[str] = (), key: str = "", more: str = "") -> Path:
    """A copy of this course's folder, as ``folder/solutions``, with some of its notebooks.

    Parameters
    ----------
    folder : where to
    notebooks : names of those that it has
    key : source of another ``key.py``
    more : source to be put at the end of ``key.py``
    """
    target = folder / "solutions"
    target.mkdir(parents=True, exist_ok=True)
    for path in (ROOT / "solutions").iterdir():
        if path.name in notebooks or path.suffix == ".py":
            shutil.copyfile(path, target / path.name)
    if key:
        (target / "key.py").write_text(key, encoding="utf-8")
    with (target / "key.py").open("a", encoding="utf-8") as file:
        file.write(more)
    return target


def loaded(folder: Path, notebooks: Iterable[str] = (), key: str = "", more: str = "") -> Course:
    """Such a copy, loaded."""
    return courses.load(copied(folder, notebooks, key, more))


#: This course, as it is; and with all its optional notebooks, whatever its settings say.
OURS = courses.load(ROOT / "solutions")
WITH_OPTIONAL = courses.load(ROOT / "solutions", with_optional=True)
