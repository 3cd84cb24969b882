"""A new course: the files of ``template``, with the name of the course put in. They release and grade as they are."""

from __future__ import annotations

import importlib.util
import keyword
import re
from pathlib import Path

from labcourse.errors import GradingError

_TEMPLATE = Path(__file__).parent / "template"
_PLACEHOLDER = "NAME"


def make(name: str, parent: Path) -> Path:
    """Write a course into a new folder of its name, and return the folder.

    Parameters
    ----------
    name : of the folder, and of the package that students get
    parent : where the folder is made

    Raises
    ------
    GradingError
        If the name cannot be one, or is taken.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or keyword.iskeyword(name):
        raise GradingError(
            f"{name!r} cannot be the name of a course: students import it. Use small letters a to z, digits and _, "
            "and begin with a letter, as in tank or two_tanks."
        )
    folder = parent / name
    if folder.exists():
        raise GradingError(f"There is a folder {folder} already. Choose another name, or move the folder.")
    if importlib.util.find_spec(name) is not None:
        raise GradingError(
            f"There is a Python package {name!r} already, which this one would hide. Choose another name."
        )
    for source in sorted(path for path in _TEMPLATE.rglob("*") if path.is_file() and path.suffix != ".pyc"):
        target = folder / _named(source.relative_to(_TEMPLATE).as_posix(), name)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(_named(source.read_text(encoding="utf-8"), name), encoding="utf-8", newline="\n")
    return folder


def _named(text: str, name: str) -> str:
    return re.sub(rf"\b{_PLACEHOLDER}\b", name, text)
