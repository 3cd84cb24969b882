"""Files of a hand-in, wherever they lie: in a folder, in a zip or a tar, or in an archive within an archive.

All is read as untrusted input: bounded in size and number, never unpacked to disk, links never followed, names never
used for writing.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import IO, Any, Protocol

from labcourse.grading.running.intake import limits, names

_DAMAGED = (
    *(zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError),
    *(NotImplementedError, struct.error, RuntimeError, MemoryError, lzma.LZMAError, tarfile.TarError),
)
#: What a compressed tar begins with → what reads it.
_COMPRESSED: dict[bytes, Callable[[Any], Any]] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\0": lzma.open}
_FIRST_TIME, _LAST_TIME = 315_532_800, 4_294_967_294  # s since 1970: of 1980 and 2106, between which a zip's times are
_USTAR = slice(257, 262)  # where a tar that is not compressed says so
_PIECE = 1_000_000  # bytes that are read at a time
_UTF8_NAME = 0x800  # flag of a zip's entry
_NO_TIME = (1980, 1, 2)  # what has an earlier one has none: it is the first that a zip can hold


class Unreadable(Exception):
    """What cannot be read; the message says why."""


@dataclass(frozen=True)
class Entry:
    """A file in a store.

    Attributes
    ----------
    key : by which its store reads it
    size : bytes, as the store says
    modified : when; of a zip's, as its writer's clock showed it, without a zone
    """

    key: str
    size: int
    modified: datetime | None = None


@dataclass(frozen=True)
class Listing:
    """What lies in a store.

    Attributes
    ----------
    files : path, with "/" → ordinary file
    others : paths of what is no ordinary file, or leads outside, each with what it is
    """

    files: Mapping[str, Entry] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Where:
    """How to come to a store: a folder or a zip on disk, and the zips to open in it, one within another."""

    path: Path
    zips: tuple[str, ...] = ()


class Store(Protocol):
    """An opened folder or zip."""

    def listing(self, most: int) -> Listing:
        """What is there; raises Unreadable if there are more than ``most`` files and folders."""

    def read(self, key: str, limit: int) -> bytes:
        """The content of a file; raises Unreadable if there is more than ``limit``."""


@contextmanager
def opened(where: Where, whole_class: bool = False) -> Iterator[Store]:
    """A store, opened.

    Raises
    ------
    Unreadable
        If it cannot be opened, or is too large.
    """
    with ExitStack() as stack:
        if where.path.is_dir() and not where.path.is_symlink():
            store: Store = FolderStore(where.path)
        else:
            store = _archive(stack.enter_context(_archive_on_disk(where.path, whole_class)))
        for inner in where.zips:
            store = _archive(io.BytesIO(store.read(inner, limits.MAX_INNER_ARCHIVE)))
        yield store


class Shelf(ExitStack):
    """Keeps the store that was asked for last open, as much is asked of one after the other. A context manager."""

    _last: tuple[Where, Store] | None = None

    def store(self, where: Where) -> Store:
        """A store, opened; see :func:`opened`."""
        if self._last is None or self._last[0] != where:
            self.close()
            self._last = None
            self._last = where, self.enter_context(opened(where, whole_class=True))
        return self._last[1]


@contextmanager
def _archive_on_disk(path: Path, whole_class: bool) -> Iterator[IO[bytes]]:
    most = limits.MAX_CLASS_ARCHIVE if whole_class else limits.MAX_ARCHIVE
    try:
        descriptor = _open(path)
    except OSError as error:
        raise Unreadable(f"{error.strerror}.") from None
    with _InPieces(descriptor, whole_class) as file:
        if os.fstat(descriptor).st_size > most:
            raise Unreadable(f"it has more than {most} bytes.")
        yield file


def _open(path: Path) -> int:
    """Neither a link nor a pipe that somebody put there since is waited for."""
    flags = (getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    descriptor = os.open(path, sum(flags, os.O_RDONLY))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise Unreadable("it is not an ordinary file.")
    return descriptor


# --- folders ----------------------------------------------------------------------------------------------------------


class FolderStore:
    """A folder on disk."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def listing(self, most: int) -> Listing:
        """See :class:`Store`."""
        found, others, seen = {}, {}, 0
        waiting = [""]
        while waiting:
            folder = waiting.pop(0)
            entries = self._scan(folder, most)
            seen += len(entries)
            if seen > most:
                raise Unreadable(f"it has more than {most} files and folders.")
            for entry in entries:
                key = f"{folder}{entry.name}"
                path = names.readable(key)
                if entry.is_dir(follow_symlinks=False):
                    if key.count("/") < limits.MAX_DEPTH:
                        waiting.append(f"{key}/")
                    else:
                        others[path] = f"it lies deeper than {limits.MAX_DEPTH} folders"
                elif path in found:
                    others[path] = "it is there twice; the first is taken"
                elif entry.is_file(follow_symlinks=False):
                    about = entry.stat(follow_symlinks=False)
                    found[path] = Entry(key, about.st_size, datetime.fromtimestamp(about.st_mtime, UTC))
                else:
                    others[path] = "it is a link, or another thing than a file"
        return Listing(found, others)

    def _scan(self, folder: str, most: int) -> list[os.DirEntry[str]]:
        try:
            with os.scandir(self._root / folder) as found:
                return sorted(islice(found, most + 1), key=lambda entry: entry.name)
        except OSError as error:
            raise Unreadable(f"{error.strerror}.") from None

    def read(self, key: str, limit: int) -> bytes:
        """See :class:`Store`."""
        try:
            with open(_open(self._root / key), "rb") as file:
                data = file.read(limit + 1)
        except OSError as error:
            raise Unreadable(f"{error.strerror}.") from None
        return _bounded(data, limit)


def _bounded(data: bytes, limit: int) -> bytes:
    if len(data) > limit:
        raise Unreadable(f"it has more than {limit} bytes.")
    return data


# --- zips -------------------------------------------------------------------------------------------------------------


class _InPieces(io.FileIO):
    """A file that is not read in large pieces: all that a zip needs to read in one piece is its table of contents."""

    def __init__(self, descriptor: int, whole_class: bool) -> None:
        super().__init__(descriptor)
        self._largest = limits.MAX_CLASS_DIRECTORY if whole_class else limits.MAX_DIRECTORY

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > self._largest:
            raise _long_directory(self._largest)
        return super().read(self._largest if size is None or size < 0 else size)


def _long_directory(most: int) -> Unreadable:
    return Unreadable(f"its table of contents has more than {most} bytes.")


def _archive(file: IO[bytes]) -> Store:
    """Open a zip or a tar, by what it begins with."""
    start = bytearray(_USTAR.stop)
    file.readinto(start)  # type: ignore[attr-defined]  # IO has no readinto; read() refuses what a zip need not ask for
    file.seek(0)
    for mark, read in _COMPRESSED.items():
        if start.startswith(mark):
            return ZipStore(_tar_as_zip(read(file)))
    return ZipStore(_tar_as_zip(file) if start[_USTAR] == b"ustar" else file)


class ZipStore:
    """A zip, opened."""

    def __init__(self, file: IO[bytes]) -> None:
        self._by_key: dict[str, zipfile.ZipInfo] = {}
        try:
            self._zip = zipfile.ZipFile(file)
        except _DAMAGED as error:
            raise Unreadable(f"it is not a zip that can be read ({type(error).__name__}).") from None

    def listing(self, most: int) -> Listing:
        """See :class:`Store`."""
        entries = self._zip.infolist()
        if len(entries) > most:
            raise Unreadable(f"it has more than {most} files and folders.")
        found: dict[str, Entry] = {}
        others: dict[str, str] = {}
        for entry in entries:
            path, written = _path(entry), entry.filename
            if not entry.filename or entry.is_dir():  # of a nameless one, is_dir() would not know what to say
                continue
            why = self._objection(entry, path, found)
            if why:
                others[path or written] = why
            else:
                self._by_key[entry.filename] = entry
                found[path] = Entry(entry.filename, entry.file_size, _modified(entry))
        return Listing(found, others)

    def _objection(self, entry: zipfile.ZipInfo, path: str, found: Mapping[str, Entry]) -> str:
        if stat.S_IFMT(entry.external_attr >> 16) not in (0, stat.S_IFREG):
            return "it is a link, or another thing than a file"
        if not path or ".." in path.split("/"):
            return "its name leads outside"
        if path in found or entry.filename in self._by_key:
            return "it is there twice; the first is taken"
        if path.count("/") > limits.MAX_DEPTH:
            return f"it lies deeper than {limits.MAX_DEPTH} folders"
        return ""

    def read(self, key: str, limit: int) -> bytes:
        """See :class:`Store`."""
        if not self._by_key:
            self.listing(limits.MAX_CLASS_ENTRIES)
        try:
            entry = self._by_key[key]
        except KeyError:  # the zip is another one than it was
            raise Unreadable("it is no longer there.") from None
        if entry.flag_bits & 1:
            raise Unreadable("it is encrypted.")
        try:
            with self._zip.open(entry) as file:
                data = _in_pieces(file, limit + 1)
        except NotImplementedError:
            raise Unreadable("it is compressed in an unusual way; use an ordinary zip.") from None
        except _DAMAGED as error:
            raise Unreadable(f"the zip is damaged ({type(error).__name__}).") from None
        return _bounded(data, limit)


def _tar_as_zip(file: IO[bytes]) -> IO[bytes]:
    """Repack a tar in memory, where it has a table of contents. Links and devices are written as empty links."""
    packed = io.BytesIO()
    try:
        data = _bounded(_in_pieces(file, limits.MAX_INNER_ARCHIVE + 1), limits.MAX_INNER_ARCHIVE)
        with tarfile.open(fileobj=io.BytesIO(data), mode="r:") as tar, zipfile.ZipFile(packed, "w") as archive:
            for member in filter(lambda member: not member.isdir(), tar):
                saved = datetime.fromtimestamp(min(max(member.mtime, _FIRST_TIME), _LAST_TIME), UTC)
                entry = zipfile.ZipInfo(member.name, saved.timetuple()[:6])
                entry.external_attr = (stat.S_IFREG if member.isreg() else stat.S_IFLNK) << 16
                content = tar.extractfile(member) if member.isreg() else None
                archive.writestr(entry, content.read() if content else b"")
    except _DAMAGED as error:
        raise Unreadable(f"it is not a tar that can be read ({type(error).__name__}).") from None
    return packed


def _in_pieces(file: IO[bytes], most: int) -> bytes:
    """A file's content, or the first ``most`` bytes of it: unlike a table of contents, it may be long."""
    found = bytearray()
    while piece := file.read(min(_PIECE, most - len(found))):
        found += piece
    return bytes(found)


def _path(entry: zipfile.ZipInfo) -> str:
    """An entry's path as people would read it, from the top of the zip."""
    written = entry.filename.replace("\\", "/")
    path = written if entry.flag_bits & _UTF8_NAME else names.unflagged(written)
    return "/".join(part for part in names.readable(path).split("/") if part not in ("", "."))


def _modified(entry: zipfile.ZipInfo) -> datetime | None:
    try:
        found = datetime(*entry.date_time)
    except ValueError:
        return None
    return None if found <= datetime(*_NO_TIME) else found
