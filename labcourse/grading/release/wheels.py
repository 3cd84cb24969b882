"""The wheels of a release, and the project that installs them all by ``pip install .``.

Each bears a local version by its content, so that a corrected release replaces an earlier one in an environment, and
the wheels of two courses stand beside each other.
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import labcourse
from labcourse.courses import GROUP

_ENGINE = labcourse.__name__
_INSTRUCTORS = ("grading", "postgres", "cluster")  # extras of labcourse that students have no use for
_TABLES = """
[build-system]
requires = ["hatchling>=1.24"]
build-backend = "hatchling.build"
"""


def build(package: Path, local: str, out: Path, course: str = "", requires: Sequence[str] = ()) -> Path:
    """Make the wheel of a package as students get it.

    Parameters
    ----------
    package : its folder; of an installed distribution, the metadata is taken from that
    local : the local part of the version, as "course.3f2a9c41"
    out : folder for the wheel; made if needed
    course : import name of the course's package, if it is in this one
    requires : what the course needs besides, as pip takes it

    Returns
    -------
    Path
        The wheel.
    """
    from hatchling.builders.wheel import WheelBuilder

    about = _distribution(package.name)
    version = about.version if about else labcourse.__version__
    needed = list(about.requires or ()) if about else []
    contents: dict[str, Any] = {
        "name": about.name if about else package.name,
        "version": f"{version}+{local}",
        "requires-python": f">={python()}",
        "dependencies": [one for one in needed if "extra ==" not in one],
    }
    if package.name == _ENGINE:
        contents["optional-dependencies"] = _extras(needed)
    else:
        contents["dependencies"] += [f"{_ENGINE}=={labcourse.__version__}", *requires]
    points = {name: value for name, group, value in _entry_points(about) if group == GROUP} if about else {}
    if course:
        points.setdefault(course.partition(".")[0], course)
    scripts = {name: value for name, group, value in _entry_points(about) if group == "console_scripts"}
    text = _TABLES + _table("project", contents)
    text += _table("project.scripts", scripts) + _table(f'project.entry-points."{GROUP}"', points)
    text += _table("tool.hatch.build", {"ignore-vcs": True})
    text += _table("tool.hatch.build.targets.wheel", {"packages": [package.name]})
    project = package.parent / "pyproject.toml"
    project.write_text(text, encoding="utf-8", newline="\n")
    out.mkdir(exist_ok=True)
    made = next(iter(WheelBuilder(str(package.parent)).build(directory=str(out), versions=["standard"])))
    project.unlink()
    return Path(made)


def project_of_all(name: str, title: str, made: Sequence[Path]) -> str:
    """Write the ``pyproject.toml`` of a release: a project of no files of its own, which needs the wheels beside it."""
    contents = {
        "name": name,
        "version": "0",
        "description": title,
        "requires-python": f">={python()}",
        "dependencies": [
            f"{path.name.partition('-')[0]} @ {{root:uri}}/{path.parent.name}/{path.name}" for path in made
        ],
    }
    return (
        _TABLES
        + _table("project", contents)
        + _table("tool.hatch.metadata", {"allow-direct-references": True})
        + _table("tool.hatch.build.targets.wheel", {"bypass-selection": True})
    ).lstrip()


def python() -> str:
    """Return the oldest version of Python that labcourse runs on, as "3.11"."""
    return importlib.metadata.metadata(_ENGINE)["Requires-Python"].removeprefix(">=")


def licence() -> str:
    """Return the text of labcourse's licence."""
    return importlib.metadata.distribution(_ENGINE).read_text("licenses/LICENSE") or ""


def _distribution(package: str) -> importlib.metadata.Distribution | None:
    """Find the distribution that a package was installed by; None for a package that lies beside a course."""
    names = importlib.metadata.packages_distributions().get(package, [package])
    try:
        return importlib.metadata.distribution(names[0])
    except importlib.metadata.PackageNotFoundError:
        return None


def _entry_points(about: importlib.metadata.Distribution | None) -> list[tuple[str, str, str]]:
    return [(point.name, point.group, point.value) for point in about.entry_points] if about else []


def _extras(needed: Sequence[str]) -> dict[str, list[str]]:
    """Sort the requirements that have a mark of an extra by extra, but for the instructors' ones."""
    extras: dict[str, list[str]] = {}
    for one in needed:
        requirement, _mark, extra = one.partition("extra == ")
        if extra and (name := extra.strip("'\"")) not in _INSTRUCTORS:
            extras.setdefault(name, []).append(requirement.strip().rstrip(";").strip())
    return extras


def _table(name: str, contents: Mapping[str, Any]) -> str:
    """Write a table of TOML. What JSON writes of text, lists of text and truth, TOML reads."""
    rows = [
        f"{key} = {json.dumps(value, ensure_ascii=False)}"
        for key, value in contents.items()
        if not isinstance(value, Mapping)
    ]
    text = "\n".join(["", f"[{name}]", *rows, ""]) if rows else ""
    inner = [_table(f"{name}.{key}", value) for key, value in contents.items() if isinstance(value, Mapping)]
    return text + "".join(inner)
