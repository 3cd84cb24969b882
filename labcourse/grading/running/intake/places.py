"""Folders and zips, and what lies in them, alike: a class as it is downloaded, and each hand-in of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from labcourse.course_file import parse
from labcourse.errors import ConfigurationError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.running.intake import limits, names
from labcourse.grading.running.intake.notebook_names import is_notebook
from labcourse.grading.running.intake.stores import Entry, Listing, Shelf, Unreadable, Where, opened

ARCHIVES = (".zip", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz", ".tar")  #: that Python's own library reads
OTHER_ARCHIVES = (".7z", ".rar", ".gz", ".bz2", ".xz", ".zipx")  #: that it does not


@dataclass(frozen=True)
class Place:
    """A folder or a zip, with what lies in it.

    Attributes
    ----------
    source : its name for people, from the class's folder on
    where : the store that has its files
    listing : paths from here
    """

    source: str
    where: Where
    listing: Listing


@dataclass(frozen=True)
class Child:
    """What lies in a place, not yet looked into.

    Attributes
    ----------
    name : of the file or folder, as people read it
    source : the same, from the class's folder on
    where : of a folder or zip that has a store of its own; else of the store that it lies in
    entry : of a file in a store
    listing : of a folder within a zip
    why_not : what is wrong with what is neither a file nor a folder
    """

    name: str
    source: str
    where: Where
    entry: Entry | None = None
    listing: Listing | None = None
    why_not: str = ""

    @property
    def is_archive(self) -> bool:
        """Whether it is a zip or a tar, by its name."""
        return self.entry is not None and is_archive(self.name)

    @property
    def is_folder(self) -> bool:
        """Whether it is a folder."""
        return self.entry is None and not self.why_not

    @property
    def stem(self) -> str:
        """Its name, without an archive's ending."""
        return without_ending(self.name) if self.is_archive else self.name

    def look(self, whole_class: bool = False) -> Place:
        """What lies in it.

        Raises
        ------
        Unreadable
            If it cannot be read, or holds too much.
        """
        most = limits.MAX_CLASS_ENTRIES if whole_class else limits.MAX_ENTRIES
        if self.listing is not None:
            if len(self.listing.files) > most:
                raise Unreadable(f"it has more than {most} files and folders.")
            return Place(self.source, self.where, self.listing)
        where = self.where if self.entry is None else within(self.where, self.entry)
        with opened(where, whole_class) as store:
            return Place(self.source, where, store.listing(most))


def is_archive(name: str) -> bool:
    """Say whether a file is a zip or a tar, by its name."""
    return name.casefold().endswith(ARCHIVES)


def without_ending(name: str) -> str:
    """Return a name without the ending of an archive, read or not."""
    endings = (one for one in (*ARCHIVES, *OTHER_ARCHIVES) if name.casefold().endswith(one))
    return name[: -len(next(endings, "")) or None]


def within(where: Where, entry: Entry) -> Where:
    """How to come to a zip that lies in a store."""
    if not where.zips and where.path.is_dir():
        return Where(where.path / entry.key)
    return Where(where.path, (*where.zips, entry.key))


def on_disk(folder: Path, source: str = "") -> Iterator[Child]:
    """What lies in a folder on disk, by name: each folder as a place of its own, so that none can hide the others."""
    try:
        with os.scandir(folder) as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except OSError as error:
        raise Unreadable(f"{error.strerror}.") from None
    for entry in entries:
        name = names.readable(entry.name)
        shown = f"{source}{name}"
        if entry.is_dir(follow_symlinks=False):
            yield Child(name, shown, Where(folder / entry.name))
        elif entry.is_file(follow_symlinks=False):
            about = entry.stat(follow_symlinks=False)
            changed = datetime.fromtimestamp(about.st_mtime, UTC)
            yield Child(name, shown, Where(folder), Entry(entry.name, about.st_size, changed))
        else:
            why = "it is neither a folder nor a zip."
            yield Child(name, shown, Where(folder), why_not=why)


def children(place: Place) -> Iterator[Child]:
    """What lies in a place, by name."""
    if not place.where.zips and place.where.path.is_dir():
        yield from on_disk(place.where.path, f"{place.source}/")
        return
    folders: dict[str, tuple[dict[str, Entry], dict[str, str]]] = {}
    found = []
    for path, entry in place.listing.files.items():
        first, slash, rest = path.partition("/")
        if slash:
            folders.setdefault(first, ({}, {}))[0][rest] = entry
        else:
            found.append(Child(path, f"{place.source}/{path}", place.where, entry))
    for path, why in place.listing.others.items():
        first, slash, rest = path.partition("/")
        if slash:
            folders.setdefault(first, ({}, {}))[1][rest] = why
        else:
            found.append(Child(path, f"{place.source}/{path}", place.where, why_not=f"{why}."))
    for name, (files, others) in folders.items():
        listing = Listing(files, others)
        found.append(Child(name, f"{place.source}/{name}", place.where, listing=listing))
    yield from sorted(found, key=lambda child: child.name)


def holds_work(listing: Listing) -> bool:
    """Whether there is a notebook, or what a notebook of the course leaves."""
    return any(is_work(path) for path in listing.files)


def is_work(path: str) -> bool:
    """Whether a file is a notebook, or what a notebook of the course leaves."""
    parts = path.split("/")
    if any(map(names.is_hidden, parts)):
        return False
    return is_notebook(path) or parts[-1] in (COURSE_FILE, ANSWERS_FILE)


def course_file(place: Place, shelf: Shelf) -> dict[str, Any]:
    """What the course file with the fewest folders above it says; nothing where there is none that can be read."""
    paths = [path for path in place.listing.files if path.rpartition("/")[2] == COURSE_FILE and is_work(path)]
    if not paths:
        return {}
    entry = place.listing.files[min(paths, key=lambda path: (path.count("/"), path))]
    try:
        return course_data(shelf.store(place.where).read(entry.key, limits.MAX_COURSE_FILE))
    except Unreadable:
        return {}


def course_data(data: bytes) -> dict[str, Any]:
    """The content of a course file; nothing if it is not such a file."""
    try:
        return parse(data)
    except ConfigurationError:
        return {}
