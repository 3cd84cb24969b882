"""Read untrusted files, and write files atomically: a crash leaves the old file or the new one."""

from __future__ import annotations

import contextlib
import errno
import itertools
import json
import math
import os
import stat
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path, PurePath
from typing import IO, Any, TypeVar

from labcourse.safe_text import no_escapes

IN_BROWSER = sys.platform == "emscripten"  #: whether Python itself is in the browser
ANSWERS_FILE = "answers.json"  #: beside the notebooks: what a student has answered
KERNEL = Path(__file__).parent / "jupyter" / "kernel.py"  #: the program of a notebook's kernel
LAB_EXTENSIONS = KERNEL.parent / "labextensions"  #: JupyterLab's extension that runs a notebook's first cells
COURSE_FILE = "course.json"  #: beside the notebooks: {"student": "..."}
MAX_BYTES = 200_000_000  #: of a file in a student's folder; a notebook with all that it shows has some millions
MAX_DEPTH = 100  #: lists and objects within each other in a JSON file; Python can copy and write ten times as many

Content = str | bytes | Callable[[Path], object]

_count = itertools.count()  # two threads may write the same file

# On Windows, a file cannot be replaced while another program has it open (a search, a virus scanner, a cloud's copy,
# another notebook), nor read while it is being replaced. On other systems, a refusal is final.
_MAY_BE_OPEN = sys.platform == "win32"
_PATIENCE = 2.0  # s until it is an error; a virus scanner has a new file for a second
_PAUSE = 0.05  # s between two tries; a program that reads a small file has it for less
_LONGEST_LOCK = 5.0  # s to wait for a program that changes the same file, which takes milliseconds

_Result = TypeVar("_Result")


def patiently(act: Callable[[], _Result], seconds: float | None = None) -> _Result:
    """Repeat an operation that another program may block for a moment until it succeeds.

    Parameters
    ----------
    act : the operation
    seconds : how long to repeat it; by default two on Windows, and none elsewhere

    Raises
    ------
    OSError
        If it still fails then.
    """
    until = time.monotonic() + (_MAY_BE_OPEN * _PATIENCE if seconds is None else seconds)
    while True:
        try:
            return act()
        except (BlockingIOError, PermissionError):
            if time.monotonic() >= until:
                raise
        time.sleep(_PAUSE)


def lock(file: IO[bytes]) -> None:
    """Lock a file until it is closed, or its program ends. (Laboratory and engine have the same function.)

    Raises
    ------
    BlockingIOError, PermissionError
        If another program has it locked.
    OSError
        If its file system has no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    elif sys.platform != "emscripten":  # a browser has no locks
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[str]:
    """Let no other program that uses this function change a file in the meantime.

    What is locked is an empty hidden file beside it, which stays there: the file itself is replaced when it is written.

    Yields
    ------
    str
        Why nothing is locked: some network drives have no locks, and a program that does not come to its end has the
        file locked for ever. "" if it is locked.
    """
    with contextlib.ExitStack() as stack:
        problem, flags = "", os.O_WRONLY | os.O_CREAT
        try:
            file = patiently(lambda: os.fdopen(_opener(path.with_name(f".{path.name}.lock"), flags), "wb"))
            stack.enter_context(file)
            patiently(lambda: lock(file), _LONGEST_LOCK)
        except OSError as error:
            problem = reason(error)
        yield problem


def ordinary(path: Path) -> os.stat_result:
    """Return the status of an ordinary file in a student's folder.

    Raises
    ------
    OSError
        If it is not there, or is a link (which might lead anywhere), a folder, a pipe or a device.
    """
    about = path.lstat()
    if stat.S_ISLNK(about.st_mode):
        raise OSError(errno.ELOOP, "it is a link, which is not followed; put the file itself there", str(path))
    if not stat.S_ISREG(about.st_mode):
        raise OSError(errno.EINVAL, "it is not an ordinary file", str(path))
    return about


def read(path: Path, most: int | None = None) -> bytes:
    """Read an untrusted file in a student's folder.

    Raises
    ------
    OSError
        If it cannot be read, is not an ordinary file (see :func:`ordinary`), or has more than ``most`` bytes
        (:data:`MAX_BYTES` unless given).
    """
    most = MAX_BYTES if most is None else most

    def content() -> bytes:
        ordinary(path)
        with open(path, "rb", opener=_opener) as file:
            return file.read(most + 1)

    data = patiently(content)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:.3g} MB", str(path))
    return data


def _opener(name: str | Path, flags: int) -> int:
    """Open a file that may have been replaced just now by a link or a pipe."""
    if not IN_BROWSER:  # JupyterLite writes anew what was opened with them, even for reading
        flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    return os.open(name, flags, 0o666)


def version(path: Path) -> tuple[int, ...] | None:
    """Return numbers that change when a file is written or replaced; None if it is not there."""
    try:
        return _version(path.lstat())
    except OSError:
        return None


def _version(about: os.stat_result) -> tuple[int, ...]:
    return about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns


def reason(error: Exception) -> str:
    """Return why a file could not be read, without the system's number and path."""
    return getattr(error, "strerror", None) or str(error)


def replace_file(source: Path, target: Path) -> None:
    """Move a file to another's place, atomically.

    Raises
    ------
    OSError
        If it cannot be done.
    """
    patiently(lambda: os.replace(source, target))


def from_json(data: bytes, max_depth: int = MAX_DEPTH, *, allow_nan: bool = True, **hooks: Any) -> Any:
    """Parse an untrusted JSON file; the result can always be copied and written again.

    Halves of surrogate pairs, which UTF-8 does not have, become question marks.

    Parameters
    ----------
    data : the file's content
    max_depth : how many lists and objects may lie within each other
    allow_nan : whether numbers may be NaN or infinite
    hooks : for :func:`json.loads`

    Raises
    ------
    ValueError
        If it is not JSON, is nested too deeply, or has a number that is not allowed.
    """
    text = data.decode(json.detect_encoding(data), "surrogatepass")
    try:
        value = json.loads(text, **hooks)
        depth, numbers = _examined(value)
        if depth > max_depth:
            raise RecursionError
    except RecursionError:
        raise ValueError(f"it is nested too deeply: more than {max_depth} lists or objects within each other") from None
    if text.isascii() and "\\ud" not in text and "\\uD" not in text and (allow_nan or math.isfinite(numbers)):
        return value  # no half of a surrogate pair; to write it takes longer than to read it
    text = json.dumps(value, ensure_ascii=False, allow_nan=allow_nan)
    written = text.encode(errors="replace")
    return value if written.decode() == text else json.loads(written, **hooks)


def object_in(data: bytes) -> dict[str, Any]:
    """Return the object that an untrusted JSON file holds; {} if it holds another value, or is not JSON."""
    try:
        value = from_json(data)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}


def _examined(value: Any) -> tuple[int, float]:
    """Return how many lists and objects lie within each other, and a number that is finite only if all numbers are."""
    depth, numbers, level = 0, 0.0, [value]
    while level:
        numbers += sum([each for each in level if isinstance(each, float)])
        inner = [each for each in level if isinstance(each, (dict, list))]
        level = [each for holder in inner for each in (holder.values() if isinstance(holder, dict) else holder)]
        depth += bool(inner)
    return depth, numbers


def shown(path: str | PurePath) -> str:
    """Return a path as text that can be printed, though its name may not be valid UTF-8."""
    return no_escapes(str(path).encode(errors="replace").decode())


def write(target: str | os.PathLike[str], content: Content) -> tuple[int, ...]:
    """Write a file atomically, under a temporary name first.

    Parameters
    ----------
    target : the file
    content : bytes; or text, which is written as UTF-8 with its line ends unchanged; or a function that writes the
        file to a path, which has another ending than the target

    Returns
    -------
    tuple
        The :func:`version` of the written file, taken before it got its name: another program may have replaced it
        since.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    target = Path(target)
    scratch = target.with_name(f".{target.name}.{os.getpid()}-{next(_count)}.tmp")
    try:
        if callable(content):
            content(scratch)
        else:
            scratch.write_bytes(content.encode() if isinstance(content, str) else content)
        written = _version(scratch.stat())
        replace_file(scratch, target)
    finally:
        with contextlib.suppress(OSError):  # on success it is gone; on failure, the first error says more
            scratch.unlink()
    return written
