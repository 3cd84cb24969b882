"""What a release is known by: its term, and a digest of all that students work with. The same content, the same name.

How to install it does not count, nor do recordings that may be handed out with it.
"""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse.course_file import RELEASE, STUDENT
from labcourse.files import COURSE_FILE

NOTEBOOKS, DATA = "notebooks", "data"  #: folders of a release, beside those of the packages
_LONGEST = 40  # characters of the term; it stands in a file's name
_DIGITS = 8  # of the digest; 32 bits tell a course's releases apart


def contents(folder: Path) -> dict[str, bytes]:
    """What counts of a release that lies in a folder: relative path, with "/" → content."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if counts(name)}


def counts(name: str) -> bool:
    """Whether a file of a release, by its relative path, has a part in its name."""
    place = PurePosixPath(name)
    return (
        len(place.parts) > 1
        and place.parts[0] != DATA
        and place != PurePosixPath(NOTEBOOKS, COURSE_FILE)
        and place.suffix != ".pyc"
    )


def name_of(files: Mapping[str, bytes], about: Mapping[str, Any], term: str) -> str:
    """The name of a release, as "2026-autumn-3f2a9c41".

    Parameters
    ----------
    files : that count, see :func:`contents`
    about : what its ``course.json`` says
    term : to begin the name with
    """
    digest = hashlib.sha256()
    said = {key: value for key, value in about.items() if key not in (STUDENT, RELEASE)}
    for name, content in [*sorted(files.items()), (COURSE_FILE, json.dumps(said, sort_keys=True).encode())]:
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return f"{_in_ascii(term) or 'release'}-{digest.hexdigest()[:_DIGITS]}"


def digest(folder: Path) -> str:
    """Return some digits that stand for all files in a folder."""
    whole = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content = path.read_bytes()
        whole.update(f"{path.relative_to(folder).as_posix()} {len(content)}\n".encode() + content)
    return whole.hexdigest()[:_DIGITS]


def _in_ascii(words: str) -> str:
    """Words as they can stand in a file's name anywhere."""
    plain = unicodedata.normalize("NFKD", words).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain)[:_LONGEST].strip("-")
