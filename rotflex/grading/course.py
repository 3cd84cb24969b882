"""The course that submissions are run with: as students have it, built once for a batch, sent along as one zip."""

from __future__ import annotations

import compileall
import hashlib
import io
import json
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotflex.errors import GradingError
from rotflex.grading import notebooks, release

INSIDE, FONTS = "inside", "matplotlib"  #: folders beside the package
_PROGRAMS = Path(__file__).resolve().parent / "inside"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # every file bears it, so that the same course gives the same bytes


@dataclass(frozen=True)
class Course:
    """What all submissions of a batch are run with. Made by :func:`build`.

    Attributes
    ----------
    packed : a zip of the students' package (without the instructor's rooms), and of the programs that run notebooks
    pristine : notebook's file name → notebook as released
    answer_cells : notebook's file name → ids of the cells that students fill in
    digest : of all of this; another digest is another course
    """

    packed: bytes
    pristine: Mapping[str, dict[str, Any]]
    answer_cells: Mapping[str, list[str]]
    digest: str


def build(source: Path) -> Course:
    """The course of a checkout.

    Raises
    ------
    GradingError
        If a part of it is missing or cannot be derived.
    """
    with tempfile.TemporaryDirectory(prefix="rotflex-course-") as scratch:
        folder = Path(scratch) / "course"
        names = release.build(source, folder, with_data=False)
        texts = {name: (folder / "notebooks" / name).read_text(encoding="utf-8") for name in names}
        cells = {name: notebooks.answer_cells(notebooks.read(folder / "notebooks" / name)) for name in names}
        packed = _pack(folder / "rotflex")
    digest = hashlib.sha256(packed + json.dumps(texts, sort_keys=True).encode()).hexdigest()
    return Course(packed, {name: json.loads(text) for name, text in texts.items()}, cells, digest)


def _pack(package: Path) -> bytes:
    """A zip of the students' package, and of the programs that run the notebooks."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for folder, name in ((package, "rotflex"), (_PROGRAMS, INSIDE)):
            for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"):
                entry = zipfile.ZipInfo(f"{name}/{path.relative_to(folder).as_posix()}", _EPOCH)
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# --- where it is run --------------------------------------------------------------------------------------------------

_unpacked: dict[str, tempfile.TemporaryDirectory[str]] = {}
_unpacking = threading.Lock()


def unpacked(packed: bytes) -> Path:
    """A folder with what a course's :attr:`~Course.packed` holds, compiled, and with matplotlib's list of fonts.

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
        raise GradingError("The released course cannot be compiled.")
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
