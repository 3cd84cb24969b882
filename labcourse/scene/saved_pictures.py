"""Files beside the notebook: figures and tables for the report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from labcourse import files
from labcourse.errors import CourseError
from labcourse.pictures import DOTS_PER_INCH, Picture, style


def save(picture: Picture, folder: Path, name: str) -> list[Path]:
    """A picture as PNG and as SVG; earlier ones of that name are replaced.

    Raises
    ------
    CourseError
        If they cannot be written.
    """

    def draw(kind: str) -> Callable[[Path], None]:
        def write(path: Path) -> None:
            with style():
                picture.savefig(path, format=kind, dpi=2 * DOTS_PER_INCH, facecolor="white")

        return write

    return [written(folder / f"{name}.{kind}", draw(kind)) for kind in ("png", "svg")]


def written(path: Path, content: files.Content) -> Path:
    """Write a file whole or not at all, see :func:`labcourse.files.write`.

    Raises
    ------
    CourseError
        If it cannot be written.
    """
    try:
        files.write(path, content)
    except OSError as error:
        raise CourseError(f"{path.name} cannot be written: {error.strerror or error}.") from None
    return path
