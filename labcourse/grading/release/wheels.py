"""The wheels of a release, and the project that installs them all by ``pip install .``.

Each has a local version by its content, so that a corrected release replaces an earlier one in an environment, and
the wheels of two courses stand beside each other.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
from collections import defaultdict
from collections.abc import Sequence
from importlib.metadata import Distribution
from pathlib import Path
from typing import Any

import labcourse
from labcourse.courses import GROUP

_ENGINE = labcourse.__name__
_INSTRUCTORS_EXTRAS = ("grading", "postgres", "cluster")  # extras of labcourse that students have no use for
_EXTRA_MARKER = re.compile(r"\s*(?:;|\band\b)\s*extra == ['\"]([^'\"]+)['\"]$")  # the end of a requirement
_PROJECT = """\
[build-system]
requires = ["hatchling>=1.24"]
build-backend = "hatchling.build"

[project]
name = {name}
version = "0"
description = {title}
requires-python = ">={python}"
dependencies = {dependencies}

[tool.hatch.metadata]
allow-direct-references = true

[tool.hatch.build.targets.wheel]
bypass-selection = true
"""


def build(package: Path, local: str, out: Path, course: str = "", requires: Sequence[str] = ()) -> Path:
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
    """
    from hatchling.builders.wheel import WheelBuilder
    from hatchling.metadata.core import ProjectMetadata
    from hatchling.plugin.manager import PluginManager

    root = str(package.parent)
    tool = {"hatch": {"build": {"ignore-vcs": True, "targets": {"wheel": {"packages": [package.name]}}}}}
    config = {"project": _wheel_metadata(package.name, local, course, requires), "tool": tool}
    builder = WheelBuilder(root, metadata=ProjectMetadata(root, PluginManager(), config))
    out.mkdir(exist_ok=True)
    return Path(next(iter(builder.build(directory=str(out), versions=["standard"]))))


def _wheel_metadata(package: str, local: str, course: str, requires: Sequence[str]) -> dict[str, Any]:
    """Return the metadata of a wheel, as in the table ``[project]``. Parameters as for :func:`build`, by name."""
    distribution = _installed_distribution(package)
    needed, extras = _requirements(distribution)
    entry_points: dict[str, dict[str, str]] = defaultdict(dict)
    for point in distribution.entry_points if distribution else ():
        entry_points[point.group][point.name] = point.value
    if course:
        entry_points[GROUP].setdefault(course.partition(".")[0], course)
    is_engine = package == _ENGINE
    return {
        "name": distribution.name if distribution else package,
        "version": f"{distribution.version if distribution else labcourse.__version__}+{local}",
        "requires-python": f">={python()}",
        "dependencies": needed if is_engine else [*needed, f"{_ENGINE}=={labcourse.__version__}", *requires],
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
    """Return the requirements of a distribution, and those of its extras for students: extra → requirements."""
    needed: list[str] = []
    extras: dict[str, list[str]] = {}
    for requirement in (distribution.requires or []) if distribution else []:
        extra = _EXTRA_MARKER.search(requirement)
        if extra is None:
            needed.append(requirement)
        elif extra[1] not in _INSTRUCTORS_EXTRAS:
            extras.setdefault(extra[1], []).append(requirement[: extra.start()])
    return needed, extras


def release_project(name: str, title: str, wheel_files: Sequence[Path]) -> str:
    """Write the ``pyproject.toml`` of a release: a project without files, which needs the wheels beside it."""
    wheels = [f"{path.name.partition('-')[0]} @ {{root:uri}}/{path.parent.name}/{path.name}" for path in wheel_files]
    texts = {"name": name, "title": title, "dependencies": wheels}  # texts and lists in JSON are valid TOML, too
    as_toml = {key: json.dumps(value, ensure_ascii=False) for key, value in texts.items()}
    return _PROJECT.format(python=python(), **as_toml)


def python() -> str:
    """Return the oldest version of Python that labcourse runs on, as "3.11"."""
    return importlib.metadata.metadata(_ENGINE)["Requires-Python"].removeprefix(">=")


def licence() -> str:
    """Return the text of labcourse's licence."""
    return importlib.metadata.distribution(_ENGINE).read_text("licenses/LICENSE") or ""
