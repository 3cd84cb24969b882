"""The courses that are installed: packages that name themselves by an entry point, and the one that is worked on now.

A course's package says in its ``pyproject.toml``::

    [project.entry-points."labcourse.courses"]
    pendulum = "pendulum.course"

The notebooks as handed out are in the package's folder ``notebooks``; in a checkout, in the folder ``notebooks`` beside
the package or above it.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from labcourse.errors import ConfigurationError

GROUP = "labcourse.courses"  #: of entry points: name of a course → its package
requested = ""  #: the course that --course names: in a folder of another course it is refused
COURSE_VARIABLE = "LABCOURSE_COURSE"  #: environment variable: name or package of the course that is worked on
NOTEBOOKS = "notebooks"


@dataclass(frozen=True)
class InstalledCourse:
    """A course as students have it.

    Attributes
    ----------
    package : import name of its package
    place : the package's folder
    """

    package: str
    place: Path

    @property
    def above(self) -> list[Path]:
        """The folders above the package's, up to the one that holds the outermost package."""
        return list(self.place.parents)[: self.package.count(".") + 1]

    @property
    def notebooks(self) -> Path:
        """The folder of the notebooks as handed out.

        Raises
        ------
        ConfigurationError
            If there are none.
        """
        for place in (self.place, *self.above):
            if any((place / NOTEBOOKS).glob("*.ipynb")):
                return place / NOTEBOOKS
        raise ConfigurationError(
            f"The installed package {self.package} comes without notebooks: install it from the course's folder."
        )

    @property
    def draw(self) -> int | None:
        """The version of how the course draws students' benches now: what its package's ``draw()`` returns, if any."""
        return getattr(importlib.import_module(self.package), "draw", lambda: None)()


def installed() -> dict[str, str]:
    """Return the courses that are installed: name → import name of the package."""
    return {entry.name: entry.value for entry in entry_points(group=GROUP)}


def name_of(package: str) -> str:
    """Return the name of the course in a package: that of its entry point, or else that of the package."""
    return next((name for name, value in installed().items() if value == package), package)


def notebooks() -> dict[str, set[str]]:
    """Return the file names of the notebooks of the courses that are installed: name of a course → names."""
    names: dict[str, set[str]] = {}
    for name, package in installed().items():
        if place := _folder(package):
            with contextlib.suppress(ConfigurationError):
                names[name] = {path.name for path in InstalledCourse(package, place).notebooks.glob("*.ipynb")}
    return names


def use(course: str) -> None:
    """Make a course the one that is worked on, in this process and in those that it starts.

    Parameters
    ----------
    course : name of an installed course, or import name of its package
    """
    os.environ[COURSE_VARIABLE] = course


def current() -> InstalledCourse:
    """Return the course that is worked on: the one that :func:`use` named, else the only one that is installed.

    Raises
    ------
    ConfigurationError
        If there is none, or if several are installed and none was named.
    """
    name = os.environ.get(COURSE_VARIABLE, "")
    if "." in name and (place := _folder(name)):  # a session names the package; to look through all of them takes time
        return InstalledCourse(name, place)
    known = installed()
    name = name or (next(iter(known)) if len(known) == 1 else "")
    listed = ", ".join(sorted(known)) or "none"
    if not name:
        raise ConfigurationError(
            f"Which course? Installed are: {listed}. Name one by --course NAME, or by the environment variable "
            f"{COURSE_VARIABLE}."
        )
    package = known.get(name, name)
    place = _folder(package)
    if place is None:
        raise ConfigurationError(f"There is no course {name!r} here. Installed are: {listed}.")
    return InstalledCourse(package, place)


def _folder(package: str) -> Path | None:
    """Return the folder of a package, by its import name; None if there is no such package."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return None
    folders = (spec.submodule_search_locations if spec else None) or []
    return next((Path(folder).resolve() for folder in folders), None)
