"""Files that students put beside their notebooks, and that a run needs: modules, tables, measurements.

The same rules hold at home and where work is graded. Files that programs leave behind (caches, hidden folders, virtual
environments) are skipped without a message; for other files that are not taken, a note says why.
"""

from __future__ import annotations

import functools
import pkgutil
import site
import sys
import sysconfig
import unicodedata
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path, PurePosixPath

from labcourse import files
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.answers.notebooks import why_unread
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.problems import Code, Problem
from labcourse.student_id import caseless

MAX_FILES = 200  #: that come along; docs/handing_in.md states it, and the next two
MAX_FILE = 10_000_000  #: bytes of a file
MAX_TOTAL = 30_000_000  #: bytes of all
MAX_DEPTH = 8  #: folders within folders; as in what is handed in
LONGEST_PATH = 240  #: characters; Windows has few more
BACKUP = ".before-restore"  #: in the name of a notebook's copy, which restoring it leaves behind
RECEIPT_FILE = "receipt.json"  #: of a zip; it is different each time, and no run needs it
RECEIPTS = "-receipts.txt"  #: at the end of the name of a student's receipts

_MOST_NOTES = 20
_ENVIRONMENT = "pyvenv.cfg"  # is in each virtual environment
_LEFTOVERS = {"__pycache__", "__macosx", "node_modules", "thumbs.db", "desktop.ini", "icon\r"}
_OF_PYTHON = ("ipython_config.py", "ipython_config.json", "ipython_kernel_config.py", "ipython_kernel_config.json")
_SETTINGS = {
    "matplotlibrc": Problem.of(Code.CHANGES_SETTINGS, program="matplotlib"),
    **dict.fromkeys(_OF_PYTHON, Problem.of(Code.CHANGES_SETTINGS, program="Python")),
    REPORTS_FILE.casefold(): Problem.of(Code.WRITTEN_BY_RUN),
}
_AT_START = {"sitecustomize", "usercustomize", "__main__", "ipykernel_launcher"}  # Python looks for these by itself
_MODULES = (".py", ".pyc", ".pyd", ".so", ".pyw")


def choose(
    candidates: Iterable[tuple[PurePosixPath, int]], notebooks: Collection[str], modules: Collection[str] = ()
) -> tuple[list[PurePosixPath], list[Problem]]:
    """Choose the student's files that come along to a run.

    Parameters
    ----------
    candidates : all ordinary files, relative to the folder of the notebooks, with their sizes in bytes
    notebooks : file names of the course's notebooks
    modules : names of the course's packages; Python's modules and the installed ones are added

    Returns
    -------
    tuple
        The paths of those that come along; and notes on those that do not, and why.
    """
    everything = sorted(candidates, key=lambda candidate: (len(candidate[0].parts), str(candidate[0])))
    environments = {path.parent for path, _size in everything if path.name == _ENVIRONMENT}
    packages = {str(path.parent) for path, _size in everything if _module(path.name) == "__init__"}
    excluded = {caseless(name) for name in (*notebooks, RECEIPT_FILE)}
    taken = {name.casefold() for name in (*modules, *_AT_START)} | _importable()
    paths: list[PurePosixPath] = []
    notes: list[Problem] = []
    total = 0
    for path, size in everything:
        if _is_skipped(path, environments, excluded):
            continue
        why = _refusal(path, size, packages, taken)
        if not why and total + size > MAX_TOTAL:
            why = Problem.of(Code.OWN_FILES_TOO_LARGE, most=MAX_TOTAL)
        if not why and len(paths) == MAX_FILES:
            why = Problem.of(Code.TOO_MANY_OWN_FILES, most=MAX_FILES)
        if why:
            notes.append(Problem.of(Code.OWN_FILE_REFUSED, files.shown(path), why=why))
        else:
            paths.append(path)
            total += size
    return paths, _few(notes)


def read(
    folder: Path, notebooks: Collection[str], modules: Collection[str] = ()
) -> tuple[dict[str, bytes], list[Problem]]:
    """Read a student's own files in the folder of the notebooks. Links are not followed.

    Parameters
    ----------
    folder : with the notebooks
    notebooks, modules : as for :func:`choose`

    Returns
    -------
    tuple
        Relative path, with "/" → content; and notes on files that do not come along.
    """
    refused: list[Problem] = []
    paths, notes = choose(_ordinary_files(folder, PurePosixPath(), refused), notebooks, modules)
    contents: dict[str, bytes] = {}
    notes += _few(refused)
    for path in paths:
        try:
            name = unicodedata.normalize("NFC", str(path))  # as it is named where it is graded
            contents[name] = files.read(folder / path)
        except OSError as error:
            notes.append(_refused(path, error))
    return contents, notes


def megabytes(size: int) -> str:
    """Format a size in bytes, as "10 MB"."""
    return f"{size / 1e6:.3g} MB"


def _ordinary_files(folder: Path, within: PurePosixPath, refused: list[Problem]) -> Iterator[tuple[PurePosixPath, int]]:
    """Find the files below a folder. Skipped folders, which may hold thousands of files, are not entered.

    ``refused`` gets a note on each link, pipe and device: none of them is opened.
    """
    try:
        entries = sorted((folder / within).iterdir())
    except OSError:
        return
    if within.parts and any(entry.name == _ENVIRONMENT for entry in entries):
        return
    for entry in entries:
        path = within / entry.name
        if is_leftover(entry.name):
            continue
        if entry.is_dir() and not entry.is_symlink():
            if len(path.parts) <= MAX_DEPTH + 1:
                yield from _ordinary_files(folder, path, refused)
            continue
        try:
            yield path, files.ordinary(entry).st_size
        except OSError as error:
            refused.append(_refused(path, error))


def _refused(path: PurePosixPath, error: OSError) -> Problem:
    return Problem.of(Code.OWN_FILE_REFUSED, files.shown(path), why=why_unread(error))


def _is_skipped(path: PurePosixPath, environments: set[PurePosixPath], excluded: Collection[str]) -> bool:
    """Check whether a file does not come along, without a message."""
    name = caseless(path.name)
    stem, _dot, ending = ANSWERS_FILE.rpartition(".")
    return (
        any(is_leftover(part) or part.casefold() in (ANSWERS_FILE, COURSE_FILE) for part in path.parts)
        or name.endswith((RECEIPTS, f"{BACKUP}.ipynb"))
        or (name.startswith(f"{stem}.") and name.endswith(f".{ending}"))  # set aside, as answers.broken.json
        or (len(path.parts) == 1 and name in excluded)
        or not environments.isdisjoint(path.parents)
    )


def is_leftover(name: str) -> bool:
    """Check whether a system or a program wrote a file or folder of this name for itself."""
    return name.startswith((".", "~$")) or name.casefold() in _LEFTOVERS


def _refusal(path: PurePosixPath, size: int, packages: Collection[str], taken: Collection[str]) -> Problem | None:
    """Return why a file cannot come along; None if it can."""
    top = path.parts[0]
    for part in map(str.casefold, path.parts):
        if part in _SETTINGS:
            return _SETTINGS[part]
    module = _module(top)
    is_module = top in packages or (len(path.parts) == 1 and top.casefold().endswith(_MODULES))
    if is_module and module in taken:
        return Problem.of(Code.HIDES_MODULE, module=module)
    if size > MAX_FILE:
        return Problem.of(Code.OWN_FILE_TOO_LARGE, most=MAX_FILE)
    if len(path.parts) > MAX_DEPTH + 1:
        return Problem.of(Code.OWN_FILE_TOO_DEEP, most=MAX_DEPTH)
    if len(str(path)) > LONGEST_PATH or any(not part.isprintable() or "\\" in part for part in path.parts):
        return Problem.of(Code.UNUSUAL_NAME)
    return None


def _module(name: str) -> str:
    """Return the name that imports a file: up to its first dot, as in ``x.cpython-312-x86_64-linux-gnu.so``."""
    return name.partition(".")[0].casefold()


def _few(notes: list[Problem]) -> list[Problem]:
    """Shorten a long list of notes; the last one counts the rest."""
    if len(notes) <= _MOST_NOTES:
        return notes
    return [*notes[:_MOST_NOTES], Problem.of(Code.MORE_OWN_FILES_REFUSED, count=len(notes) - _MOST_NOTES)]


@functools.cache
def _importable() -> frozenset[str]:
    """Return the names of Python's modules, and of those that are installed."""
    places = {sysconfig.get_paths()[kind] for kind in ("purelib", "platlib")} | set(site.getsitepackages())
    installed = {module.name for module in pkgutil.iter_modules(sorted(places))}
    return frozenset(name.casefold() for name in {*sys.stdlib_module_names, *sys.builtin_module_names, *installed})
