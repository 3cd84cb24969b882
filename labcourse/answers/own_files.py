"""Files that students put beside their notebooks, which come along to a run: modules, tables, measurements.

The same rules hold where work is graded and where it is checked at home. What programs leave behind (caches, hidden
folders, virtual environments) stays behind without a word; what else is not taken is told.
"""

from __future__ import annotations

import functools
import pkgutil
import site
import sys
import sysconfig
import unicodedata
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from labcourse import files
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.messages import plural
from labcourse.student_id import caseless

MAX_FILES = 200  #: that come along; docs/handing_in.md states it, and the next two
MAX_FILE = 10_000_000  #: bytes of one
MAX_TOTAL = 30_000_000  #: bytes of all
MAX_DEPTH = 8  #: folders within folders; as in what is handed in
LONGEST_PATH = 240  #: characters; Windows has few more
KEPT_COPY = ".before-restore"  #: in the name of a notebook's copy, which restoring it leaves behind
RECEIPT_FILE = "receipt.json"  #: that a zip was made with; it is another each time, and no run should be
RECEIPTS = "-receipts.txt"  #: at the end of the name of a student's receipts

_ENVIRONMENT = "pyvenv.cfg"  # lies in a virtual environment
_CACHES = {"__pycache__", "__macosx", "node_modules"}
_LEAVINGS = {"thumbs.db", "desktop.ini", ANSWERS_FILE, COURSE_FILE}  # those of the course are made anew for each run
_SETTINGS = {
    "matplotlibrc": "it would change matplotlib's settings",
    "ipython_config.py": "it would change Python's settings",
    "ipython_config.json": "it would change Python's settings",
    "ipython_kernel_config.py": "it would change Python's settings",
    "ipython_kernel_config.json": "it would change Python's settings",
    REPORTS_FILE.casefold(): "a run writes a file of that name",
}
_AT_START = {"sitecustomize", "usercustomize", "__main__", "ipykernel_launcher"}  # Python looks for these by itself
_MODULES = (".py", ".pyc", ".pyd", ".so", ".pyw")


@dataclass(frozen=True)
class Chosen:
    """Which files come along.

    Attributes
    ----------
    paths : relative to the folder of the notebooks
    notes : what does not, and why
    """

    paths: tuple[PurePosixPath, ...]
    notes: tuple[str, ...]


@dataclass
class OwnFiles:
    """A student's own files: relative path, with "/" → content; and what is to be told of others."""

    files: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def chosen(
    found: Iterable[tuple[PurePosixPath, int]], notebooks: Collection[str], modules: Collection[str] = ()
) -> Chosen:
    """Which of a student's files come along to a run.

    Parameters
    ----------
    found : all ordinary files, relative to the folder of the notebooks, with their sizes in bytes
    notebooks : file names of the course's
    modules : names of the course's packages; those that Python has, and that are installed here, are added
    """
    everything = sorted(found, key=lambda one: (len(one[0].parts), str(one[0])))
    environments = {path.parent for path, _size in everything if path.name == _ENVIRONMENT}
    within = [path for path, _size in everything if len(path.parts) == 2]
    packages = {path.parts[0] for path in within if _module(path.name) == "__init__"}
    never = {caseless(name) for name in notebooks}
    taken = {name.casefold() for name in (*modules, *_AT_START)} | _importable()
    paths: list[PurePosixPath] = []
    notes: list[str] = []
    total = 0
    for path, size in everything:
        if _left_behind(path, environments, never):
            continue
        why = _refusal(path, size, packages, taken)
        if not why and total + size > MAX_TOTAL:
            why = f"with it, your own files have more than {megabytes(MAX_TOTAL)}"
        if not why and len(paths) == MAX_FILES:
            why = f"{MAX_FILES} files at most come along"
        if why:
            notes.append(f"{files.shown(path)} does not come along: {why}.")
        else:
            paths.append(path)
            total += size
    return Chosen(tuple(paths), _few(notes))


def read(folder: Path, notebooks: Collection[str], modules: Collection[str] = ()) -> OwnFiles:
    """A student's own files in the folder that they work in. Links are not followed.

    Parameters
    ----------
    folder : with the notebooks in it
    notebooks, modules : as for :func:`chosen`
    """
    others: list[str] = []
    choice = chosen(_ordinary_files(folder, PurePosixPath(), others), notebooks, modules)
    own = OwnFiles(notes=[*choice.notes, *_few(others)])
    for path in choice.paths:
        try:
            name = unicodedata.normalize("NFC", str(path))  # as it is named where it is graded
            own.files[name] = files.read(folder / path)
        except OSError as error:
            own.notes.append(f"{path} cannot be read: {error.strerror}.")
    return own


def megabytes(size: int) -> str:
    """As in "10 MB"."""
    return f"{size / 1e6:.3g} MB"


def _ordinary_files(folder: Path, within: PurePosixPath, others: list[str]) -> Iterator[tuple[PurePosixPath, int]]:
    """Find files below a folder, but not those that would be left behind in any case, of which there may be thousands.

    ``others`` gets a note on each link, pipe and device: none of them is opened.
    """
    try:
        entries = sorted((folder / within).iterdir())
    except OSError:
        return
    if within.parts and any(entry.name == _ENVIRONMENT for entry in entries):
        return
    for entry in entries:
        path = within / entry.name
        if _is_leaving(entry.name):
            continue
        if entry.is_dir() and not entry.is_symlink():
            if len(path.parts) <= MAX_DEPTH + 1:
                yield from _ordinary_files(folder, path, others)
            continue
        try:
            yield path, files.ordinary(entry).st_size
        except OSError as error:
            others.append(f"{files.shown(path)} does not come along: {error.strerror}.")


def _left_behind(path: PurePosixPath, environments: Collection[PurePosixPath], never: Collection[str]) -> bool:
    """Whether a file stays behind without a word."""
    name = caseless(path.name)
    kept_for_the_student = name.endswith((RECEIPTS, f"{KEPT_COPY}.ipynb")) or _is_put_aside(name)
    return (
        any(map(_is_leaving, path.parts))
        or kept_for_the_student
        or (len(path.parts) == 1 and name in {*never, RECEIPT_FILE})
        or any(folder in path.parents for folder in environments)
    )


def _is_leaving(name: str) -> bool:
    return name.startswith((".", "~$")) or name.casefold() in _CACHES | _LEAVINGS


def _is_put_aside(name: str) -> bool:
    """Answers that could not be read, or another student's: ``answers.broken.json``."""
    stem, _dot, ending = ANSWERS_FILE.rpartition(".")
    return name.startswith(f"{stem}.") and name.endswith(f".{ending}")


def _refusal(path: PurePosixPath, size: int, packages: Collection[str], taken: Collection[str]) -> str:
    """Why a file cannot come along; "" if it can."""
    name, top = path.name.casefold(), path.parts[0]
    for part in map(str.casefold, path.parts):
        if part in _SETTINGS:
            return _SETTINGS[part]
    module = _module(top)
    is_module = top in packages or (len(path.parts) == 1 and name.endswith(_MODULES))
    if is_module and module in taken:
        return f"Python has a module {module} already; give yours another name"
    if size > MAX_FILE:
        return f"it has more than {megabytes(MAX_FILE)}"
    if len(path.parts) > MAX_DEPTH + 1:
        return f"it lies in more than {MAX_DEPTH} folders within folders"
    if len(str(path)) > LONGEST_PATH or any(not part.isprintable() or "\\" in part for part in path.parts):
        return "its name is too long, or has characters that cannot be seen"
    return ""


def _module(name: str) -> str:
    """What a file is imported as: the name up to its first dot, as in ``x.cpython-312-x86_64-linux-gnu.so``."""
    return name.partition(".")[0].casefold()


def _few(notes: list[str], most: int = 20) -> tuple[str, ...]:
    if len(notes) <= most:
        return tuple(notes)
    rest = plural(len(notes) - most, "{count} more file", "{count} more files")
    return (*notes[:most], f"{rest} of yours do not come along, either.")


@functools.cache
def _importable() -> frozenset[str]:
    """Names of modules that Python has, and of those that are installed beside it."""
    places = {sysconfig.get_paths()[kind] for kind in ("purelib", "platlib")} | set(site.getsitepackages())
    installed = {module.name for module in pkgutil.iter_modules(sorted(places))}
    return frozenset(name.casefold() for name in {*sys.stdlib_module_names, *sys.builtin_module_names, *installed})
