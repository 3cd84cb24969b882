"""Read folders, zips and tars of strangers alike: bounded, never unpacked to disk, links never followed.

The limits are constants of this module; ``docs/handing_in.md`` states them.
"""

from __future__ import annotations

import bz2
import io
import lzma
import os
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, tzinfo
from functools import partial
from itertools import islice
from pathlib import Path
from typing import IO, Any

from labcourse.answers.own_files import RECEIPTS, is_leftover
from labcourse.files import ANSWERS_FILE, COURSE_FILE, reason
from labcourse.grading.intake.platforms import in_utc, readable
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

MAX_CLASS_ENTRIES = 100_000  #: files and folders of the whole class; 1000 students with 100 each
MAX_ENTRIES = 5_000  #: files and folders of one submission
MAX_LOOKED_THROUGH = 50_000  #: files and folders of all archives within one submission, those that are skipped too
MAX_SUBMISSION = 500_000_000  #: bytes that are read of one student's files, unpacked, in all archives together
MAX_DEPTH = 8  #: folders within folders
MAX_PATH = 500  #: characters of a file's path
MAX_CLASS_ARCHIVE = 4_000_000_000  #: bytes of a zip of the whole class; 1000 students of 4 MB each
MAX_ARCHIVE = 200_000_000  #: bytes of one student's zip
MAX_INNER_ARCHIVE = 100_000_000  #: bytes of a zip within a zip, and of an unpacked tar
MAX_DIRECTORY = 10_000_000  #: bytes of a zip's table of contents; 46 of each file, and its path

NOTEBOOK_ENDINGS = (".ipynb.txt", ".ipynb.json", ".ipynb")  #: endings of notebooks, also as browsers write them
ARCHIVES = (".zip", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz", ".tar")  #: that Python's library reads
OTHER_ARCHIVES = (".7z", ".rar", ".gz", ".bz2", ".xz", ".zipx")  #: that it does not
_DAMAGED = (
    *(zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError),
    *(NotImplementedError, struct.error, RuntimeError, MemoryError, lzma.LZMAError, tarfile.TarError),
)
SLOW = 10  #: how many times a byte counts that is unpacked by bzip2 or xz: that takes so much longer
#: The first bytes of a compressed tar → what reads it.
_COMPRESSED: dict[bytes, Callable[[], Any]] = {
    b"\x1f\x8b": lambda: zlib.decompressobj(zlib.MAX_WBITS + 16),
    b"BZh": bz2.BZ2Decompressor,
    b"\xfd7zXZ\0": lzma.LZMADecompressor,
}
_NEGATIVE, _EXTENDED = 0o377, b"gxXLK"  # first byte of a size below 0 in a tar; kinds of headers that say more
MAX_HEADER, MAX_HEADERS = 4_096, 1_000_000_000  # bytes of such a header; sum of the squares of these
_USTAR = slice(257, 262)  # where a tar that is not compressed has its mark
_FIRST_TIME, _LAST_TIME = 315_532_800, 4_294_967_294  # s since 1970: a zip's times lie between 1980 and 2106
_NO_TIME = datetime(1980, 1, 2)  # an entry with an earlier time has none: 1980-01-01 is the first that a zip can have
_PIECE = 1_000_000  # bytes that are read at a time
_MOST_NAMED = 5  # files in a problem
_TWICE, _TOO_DEEP = Problem.of(Code.THERE_TWICE), Problem.of(Code.TOO_DEEP, most=MAX_DEPTH)
_NOT_A_FILE = Problem.of(Code.NOT_A_FILE)


class Unreadable(Exception):
    """A folder, archive or file that cannot be read; ``problem`` says why."""

    def __init__(self, code: Code, **parameters: Any) -> None:
        self.problem = Problem.of(code, **parameters)
        super().__init__(self.problem)

    def __str__(self) -> str:
        return sentence(self.problem)


@dataclass(frozen=True)
class StoredFile:
    """A file in a folder or archive.

    Attributes
    ----------
    store : the folder on disk, or the archive, in which the file lies
    key : name of the file in the store
    size : size in bytes, as the store says
    modified : time when it was saved, UTC, by the clock of the computer that saved it; None if it is not known
    checksum : CRC-32 of the content, as an archive's table of contents says; None for a file on disk
    """

    store: Path | StoredFile
    key: str
    size: int
    modified: datetime | None = None
    checksum: int | None = None


@dataclass(frozen=True)
class Listing:
    """The content of a folder or archive.

    Attributes
    ----------
    files : path in it, with "/" → file
    refused : path in it of what is not read → reason
    """

    files: dict[str, StoredFile] = field(default_factory=dict)
    refused: dict[str, Problem] = field(default_factory=dict)

    def add(self, path: str, content: StoredFile | Problem) -> None:
        """Add a file, or the reason why it is refused; refuse a file that is there twice, or too deep in folders."""
        if isinstance(content, Problem):
            self.refused[path] = content
        elif path in self.files:
            self.refused[path] = _TWICE
        elif path.count("/") > MAX_DEPTH:
            self.refused[path] = _TOO_DEEP
        else:
            self.files[path] = content


def is_archive(name: str) -> bool:
    """Return whether a file is an archive of a kind that can be read, by its name."""
    return name.casefold().endswith(ARCHIVES)


def is_other_archive(name: str) -> bool:
    """Return whether a file is an archive of a kind that cannot be read, by its name."""
    return name.casefold().endswith(OTHER_ARCHIVES) and not is_archive(name)


def without_ending(name: str) -> str:
    """Return a name without the ending of an archive, readable or not."""
    endings = (ending for ending in (*ARCHIVES, *OTHER_ARCHIVES) if name.casefold().endswith(ending))
    return name[: -len(next(endings, "")) or None]


def is_notebook(path: str) -> bool:
    """Return whether a file is a notebook, by its name."""
    return path.casefold().endswith(NOTEBOOK_ENDINGS)


def is_work(path: str) -> bool:
    """Return whether a file is a notebook, ``course.json`` or ``answers.json``, by its name."""
    return is_notebook(path) or path.rpartition("/")[2] in (COURSE_FILE, ANSWERS_FILE)


def _is_skipped(path: str) -> bool:
    """Return whether a file is passed over without a message: a system, a program or a platform wrote it for itself."""
    return any(is_leftover(part) or part.endswith(RECEIPTS) for part in path.split("/"))


def named(paths: Sequence[str]) -> dict[str, Any]:
    """Return the parameters of a problem about files: the paths of the first ones, and how many more there are."""
    more = len(paths[_MOST_NAMED:])
    return {"files": paths[:_MOST_NAMED]} | ({"more": more} if more else {})


class Shelf(ExitStack):
    """Reads files in folders and archives. The last archive stays open, with those around it. A context manager.

    Parameters
    ----------
    zone : time zone of the times in zips, which do not say it
    """

    def __init__(self, zone: tzinfo = UTC) -> None:
        super().__init__()
        self.zone = zone
        self._archives: list[tuple[StoredFile, _Zip]] = []  # each lies in the one before it
        self.begin_student()

    def begin_student(self) -> None:
        """Begin to read another student's files: count bytes and files, which are limited for each student, from 0."""
        self._left, self._listed, self._looked_through = MAX_SUBMISSION, 0, 0

    def read(self, entry: StoredFile, most: int) -> bytes:
        """Read a file of at most ``most`` bytes; raise Unreadable if it is larger or cannot be read."""
        return self.bounded(partial(self.open(entry.store).read, entry.key), most, entry.size)

    def held(self, files: Mapping[str, StoredFile]) -> Iterator[bytes]:
        """Yield the path of each file, in order, and what it holds: in an archive, its checksum.

        Of a file that cannot be read, it is the reason.
        """
        for path, file in sorted(files.items()):
            try:
                content = self.read(file, MAX_SUBMISSION) if file.checksum is None else b"%d" % file.checksum
            except Unreadable as error:
                content = repr(error.problem).encode()
            yield from (path.encode(), content)

    def listing(self, store: Path | StoredFile, most: int = MAX_ENTRIES) -> Listing:
        """List a folder on disk or an archive.

        Raises
        ------
        Unreadable
            If it cannot be read, or has more than ``most`` entries; for a student, those that were listed before count.
        """
        listing, before = Listing(), self._listed
        for number, (path, content) in enumerate(self.open(store).entries(), before + 1):
            if number > most:
                raise Unreadable(Code.TOO_MANY_FILES, most=most, with_others=before > 0)
            if content is not None:
                listing.add(path, content)
            if most <= MAX_ENTRIES:  # a class's do not count as one student's
                self._listed = number
        return listing

    def look_through(self, number: int) -> None:
        """Count entries of an archive within a submission; raise Unreadable if its archives have too many together."""
        self._looked_through += number
        if self._looked_through > MAX_LOOKED_THROUGH:
            raise Unreadable(Code.TOO_MANY_FILES, most=MAX_LOOKED_THROUGH, with_others=True)

    def open(self, store: Path | StoredFile) -> _Folder | _Zip:
        """Open a folder on disk or an archive; raise Unreadable if that cannot be done."""
        if isinstance(store, Path):
            return _Folder(store)
        open_now = [archive for archive, _opened in self._archives]
        if store in open_now:
            del self._archives[open_now.index(store) + 1 :]
            return self._archives[-1][1]
        if isinstance(store.store, Path):
            self.close()
            self._archives.clear()
            file = self.enter_context(_open_file(store.store / store.key))
        else:
            read = partial(self.open(store.store).read, store.key)
            file = io.BytesIO(self.bounded(read, MAX_INNER_ARCHIVE, store.size))
        opened = _Zip(store, file, self)
        self._archives.append((store, opened))
        return opened

    def bounded(self, read: Callable[[int], bytes], most: int, size: int, times: int = 1) -> bytes:
        """Read a file, and count its bytes; raise Unreadable if it has too many, alone or with the student's others.

        Parameters
        ----------
        read : function of a number of bytes, which reads at most so many
        most : bytes that the file may have
        size : bytes that it has, as its folder or archive says; if reading fails, so many are counted
        times : how many times each byte counts
        """
        left = self._left // times
        expected = min(size, most, left) * times
        self._left -= expected
        data = read(min(most, left) + 1) if left else b""
        self._left = max(self._left + expected - len(data) * times, 0)
        if not left or len(data) > left:
            raise Unreadable(Code.TOO_MANY_BYTES, most=MAX_SUBMISSION // times, with_others=True)
        if len(data) > most:
            raise Unreadable(Code.TOO_MANY_BYTES, most=most)
        return data


def _open_file(path: Path) -> IO[bytes]:
    """Open an ordinary file; raise Unreadable for anything else. A link is not followed, and a pipe not waited for."""
    flags = (getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    try:
        descriptor = os.open(path, sum(flags, os.O_RDONLY))
    except OSError as error:
        raise Unreadable(Code.SYSTEM_ERROR, error=reason(error)) from None
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise Unreadable(Code.NOT_ORDINARY)
    return open(descriptor, "rb")


#: Path of each thing in a folder or archive, and the file, the reason why it is refused, or None for a folder.
_Entries = Iterator[tuple[str, StoredFile | Problem | None]]


class _Folder:
    """A folder on disk."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def entries(self, within: str = "") -> _Entries:
        """Yield what lies in a folder in it (``within``, with "/" at its end), and in the folders below."""
        for item in scan(self._root / within):
            key = f"{within}{item.name}"
            if item.is_file(follow_symlinks=False):
                yield readable(key), on_disk(self._root, item, key)
            elif not item.is_dir(follow_symlinks=False):
                yield readable(key), _NOT_A_FILE
            elif key.count("/") == MAX_DEPTH:
                yield readable(key), _TOO_DEEP
            else:
                yield readable(key), None
                yield from self.entries(f"{key}/")

    def read(self, key: str, size: int) -> bytes:
        """Read the first ``size`` bytes of a file."""
        with _open_file(self._root / key) as file:
            return file.read(size)


def scan(folder: Path) -> list[os.DirEntry[str]]:
    """Return what lies in a folder on disk, by name, without leftovers: at most one more entry than a class may have.

    Raise Unreadable if it cannot be read.
    """
    try:
        with os.scandir(folder) as items:
            submitted = (item for item in items if not _is_skipped(item.name))
            return sorted(islice(submitted, MAX_CLASS_ENTRIES + 1), key=lambda item: item.name)
    except OSError as error:
        raise Unreadable(Code.SYSTEM_ERROR, error=reason(error)) from None


def on_disk(folder: Path, item: os.DirEntry[str] | Path, key: str) -> StoredFile:
    """Return the record of a file on disk, with its size and time; ``key`` is its path in ``folder``."""
    about = item.stat(follow_symlinks=False)
    return StoredFile(folder, key, about.st_size, datetime.fromtimestamp(about.st_mtime, UTC))


class _Bounded:
    """A file that refuses to read a large piece at once: zipfile reads a zip's table of contents in one piece."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def read(self, size: int = -1) -> bytes:
        if size > MAX_DIRECTORY:
            raise Unreadable(Code.LONG_TABLE_OF_CONTENTS, most=MAX_DIRECTORY)
        return self._file.read(MAX_DIRECTORY if size < 0 else size)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


class _Zip:
    """A zip, or a tar, which is packed again as a zip in memory: that has a table of contents."""

    def __init__(self, archive: StoredFile, file: IO[bytes], shelf: Shelf) -> None:
        self._archive, self._zone = archive, shelf.zone
        start = file.read(_USTAR.stop)
        file.seek(0)
        unpack = next((unpack for mark, unpack in _COMPRESSED.items() if start.startswith(mark)), None)
        try:
            if unpack is not None or start[_USTAR] == b"ustar":
                times = SLOW if unpack in (bz2.BZ2Decompressor, lzma.LZMADecompressor) else 1
                if_damaged = archive.size * SLOW // times
                data = shelf.bounded(lambda size: _unpacked(size, file, unpack), MAX_INNER_ARCHIVE, if_damaged, times)
                file = _tar_as_zip(data, shelf)
            self._zip = _open_zip(_Bounded(file))
        except _DAMAGED as error:
            raise Unreadable(Code.NOT_AN_ARCHIVE, error=type(error).__name__) from None
        if isinstance(archive.store, StoredFile):
            shelf.look_through(len(self._zip.infolist()))
        self._entries = {entry.filename: entry for entry in reversed(self._zip.infolist()) if entry.filename}

    def entries(self) -> _Entries:
        """Yield what lies in it and in the folders below."""
        for entry in self._zip.infolist():
            if not entry.filename or entry.is_dir():  # is_dir() fails without a name
                yield entry.filename, None
                continue
            name = readable(entry.filename[:MAX_PATH].replace("\\", "/"))  # a long one may take minutes to compose
            parts = [part for part in name.split("/") if part not in ("", ".")]
            path = "/".join(parts) or entry.filename
            if not parts or ".." in parts:
                yield path, Problem.of(Code.LEADS_OUTSIDE)
            elif len(entry.filename) > MAX_PATH:
                yield path, Problem.of(Code.LONG_PATH, most=MAX_PATH)
            elif _is_skipped(path):
                continue
            elif stat.S_IFMT(entry.external_attr >> 16) not in (0, stat.S_IFREG):
                yield path, _NOT_A_FILE
            elif self._entries[entry.filename] is not entry:
                yield path, _TWICE
            else:
                about = entry.file_size, _modified(entry, self._zone), entry.CRC
                yield path, StoredFile(self._archive, entry.filename, *about)

    def read(self, key: str, size: int) -> bytes:
        """Read the first ``size`` bytes of a file; raise Unreadable if that cannot be done."""
        entry = self._entries.get(key)
        if entry is None:
            raise Unreadable(Code.GONE)
        if entry.flag_bits & 1:
            raise Unreadable(Code.ENCRYPTED)
        try:
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # the others take long
                raise NotImplementedError
            with self._zip.open(entry) as file:
                return _first(size, file)
        except NotImplementedError:
            raise Unreadable(Code.UNUSUAL_COMPRESSION) from None
        except _DAMAGED as error:
            raise Unreadable(Code.ARCHIVE_DAMAGED, error=type(error).__name__) from None


def _first(size: int, file: IO[bytes]) -> bytes:
    """Read the first ``size`` bytes of a file, a piece at a time."""
    data = bytearray()
    while piece := file.read(min(_PIECE, size - len(data))):
        data += piece
    return bytes(data)


def _unpacked(size: int, file: IO[bytes], unpack: Callable[[], Any] | None) -> bytes:
    """Read the first ``size`` bytes of a tar, which is decompressed at once: a million empty pieces would take long.

    Parameters
    ----------
    size : bytes, decompressed
    file : the tar
    unpack : returns what decompresses it; None for a tar that is not compressed
    """
    if unpack is None:
        return _first(size, file)
    stream = unpack()
    data: bytes = stream.decompress(file.read(), size)
    if stream.unused_data.strip(b"\0"):
        raise Unreadable(Code.SEVERAL_PIECES)
    if not stream.eof and len(data) < size:
        raise EOFError
    return data


def _check_headers(data: bytes) -> None:
    """Raise Unreadable if Python's tarfile would read a tar slowly or for ever.

    It would if a 512-byte block is a valid header with a negative size, or an extended header that is too long, alone
    or with the others: the time for these grows with the square of their length. Check every block, because tarfile
    may take any for a header.
    """
    squares = 0
    # In each block, byte 124 is the first one of a header's size, and byte 156 its type.
    for number, (sign, kind) in enumerate(zip(data[124::512], data[156::512], strict=False)):
        if sign == _NEGATIVE or kind in _EXTENDED:
            with suppress(tarfile.HeaderError):  # it is content, and no header
                size = tarfile.TarInfo.frombuf(data[512 * number : 512 * (number + 1)], "utf-8", "replace").size
                squares += size**2
                if size < 0 or size > MAX_HEADER or squares > MAX_HEADERS:
                    raise Unreadable(Code.UNUSUAL_HEADERS)


def _tar_as_zip(data: bytes, shelf: Shelf) -> IO[bytes]:
    """Pack a tar as a zip. Links, devices, and sparse files, which may be huge when unpacked, become empty links."""
    _check_headers(data)
    packed = io.BytesIO()
    with tarfile.TarFile(fileobj=io.BytesIO(data), errors="replace") as tar, zipfile.ZipFile(packed, "w") as archive:
        for member in tar:
            shelf.look_through(1)
            if member.isdir():
                continue
            saved = datetime.fromtimestamp(min(max(member.mtime, _FIRST_TIME), _LAST_TIME), UTC)
            entry = zipfile.ZipInfo(member.name, saved.timetuple()[:6])
            is_file = member.isreg() and not member.issparse()
            entry.external_attr = (stat.S_IFREG if is_file else stat.S_IFLNK) << 16
            content = tar.extractfile(member) if is_file else None
            archive.writestr(entry, content.read() if content else b"")
    return packed


def _open_zip(file: Any) -> zipfile.ZipFile:
    """Open a zip. Names in it are taken as UTF-8 where it does not say how they are encoded, unless one cannot be."""
    try:
        return zipfile.ZipFile(file, metadata_encoding="utf-8")
    except UnicodeDecodeError:
        return zipfile.ZipFile(file)


def _modified(entry: zipfile.ZipInfo, zone: tzinfo) -> datetime | None:
    """Return when an entry was saved, UTC; None if the zip does not say it."""
    try:
        modified = datetime(*entry.date_time)
    except ValueError:
        return None
    return in_utc(modified, zone) if modified > _NO_TIME else None
