"""What submissions are run with: the course as students have it, built once for a batch, sent along as one zip."""

from __future__ import annotations

import compileall
import hashlib
import io
import json
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotflex.courseware.messages import _
from rotflex.errors import GradingError
from rotflex.instructor.course import Course
from rotflex.instructor.release import student_course, student_notebooks

INSIDE, FONTS = "inside", "matplotlib"  #: folders beside the packages
_PROGRAMS = Path(__file__).resolve().parent / "inside"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # every file bears it, so that the same course gives the same bytes


@dataclass(frozen=True)
class Bundle:
    """What all submissions of a batch are run with. Made by :func:`build`.

    Attributes
    ----------
    packed : a zip of the students' packages, and of the programs that run notebooks
    pristine : notebook's file name → notebook as released
    answer_cells : notebook's file name → ids of the cells that students fill in
    parameters : of the notebooks, besides the student
    imports : modules that notebooks use
    digest : of all of this; another digest is another bundle
    """

    packed: bytes
    pristine: Mapping[str, dict[str, Any]]
    answer_cells: Mapping[str, list[str]]
    parameters: Mapping[str, str]
    imports: tuple[str, ...]
    digest: str


def build(course: Course) -> Bundle:
    """The bundle of a course.

    Raises
    ------
    GradingError
        If a part of the course is missing or cannot be derived.
    """
    with tempfile.TemporaryDirectory(prefix="rotflex-course-") as scratch:
        folder = Path(scratch) / "course"
        names = student_course.build(course, folder)
        texts = {name: (folder / "notebooks" / name).read_text(encoding="utf-8") for name in names}
        cells = {
            name: student_notebooks.answer_cells(student_notebooks.read(folder / "notebooks" / name)) for name in names
        }
        packed = _pack([*(folder / name for name in course.packages), _PROGRAMS])
    pristine = {name: json.loads(text) for name, text in texts.items()}
    about = [texts, dict(course.parameters), course.imports]
    digest = hashlib.sha256(packed + json.dumps(about, sort_keys=True).encode()).hexdigest()
    return Bundle(packed, pristine, cells, dict(course.parameters), course.imports, digest)


def _pack(folders: Iterable[Path]) -> bytes:
    """A zip of some folders, side by side."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for folder in folders:
            for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"):
                entry = zipfile.ZipInfo(f"{folder.name}/{path.relative_to(folder).as_posix()}", _EPOCH)
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# --- where it is run --------------------------------------------------------------------------------------------------

_unpacked: dict[str, tempfile.TemporaryDirectory[str]] = {}
_unpacking = threading.Lock()


def unpacked(packed: bytes) -> Path:
    """A folder with what a course's :attr:`~Bundle.packed` holds, compiled, and with matplotlib's list of fonts.

    It is made once in a program, and lasts as long as that.
    """
    digest = hashlib.sha256(packed).hexdigest()
    with _unpacking:
        if digest not in _unpacked:
            scratch = tempfile.TemporaryDirectory(prefix="rotflex-course-")
            _unpack(packed, Path(scratch.name))
            _unpacked[digest] = scratch
    return Path(_unpacked[digest].name) / "course"


def _unpack(packed: bytes, scratch: Path) -> None:
    folder = scratch / "course"
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(folder)
    if not compileall.compile_dir(folder, quiet=2):
        raise GradingError(_("The released course cannot be compiled."))
    _put_fonts(folder / FONTS)
    for path in (folder, *folder.rglob("*")):  # to be read by whoever the sandbox makes of us
        path.chmod(0o755 if path.is_dir() else 0o644)


def _put_fonts(folder: Path) -> None:
    """Matplotlib's list of fonts, or each run would make it anew, for a second."""
    import matplotlib
    import matplotlib.font_manager  # makes the list where there is none

    folder.mkdir()
    for path in Path(matplotlib.get_cachedir()).glob("fontlist-*.json"):
        shutil.copyfile(path, folder / path.name)
