"""The same file in several hand-ins: for an instructor to look at, and never a verdict.

Of a student's own files, recordings among them, those are compared that are no text (:mod:`.same_code` reads these),
were not handed out, and are not in many hand-ins. Whoever handed in together has one bench, and is one here.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from rotflex.courseware.messages import _, plural
from rotflex.courseware.student_id import caseless
from rotflex.instructor.gradebook import Graded
from rotflex.instructor.graded_run import facts_of
from rotflex.instructor.reports.overlaps import MOST_ALIKE

_MATLAB, _HEAD = b"MATLAB 5.0 MAT-file", 128  # how such a file begins, and how many bytes say so


@dataclass(frozen=True)
class Measured:
    """What somebody measured.

    Attributes
    ----------
    student : the ID
    bench_of : ID of the student whose bench it was; of whoever handed in together, the same
    files : digest → name of each of their files that are compared
    """

    student: str
    bench_of: str
    files: Mapping[str, str]


def measured(graded: Graded, delivered: Mapping[str, bytes], given: Collection[str] = ()) -> Measured:
    """Return a student's files that are no text.

    Parameters
    ----------
    graded : the run that counts
    delivered : what was handed in last: name → content
    given : digests (:func:`digest`) of files that were handed out
    """
    files = {
        known: name
        for name, content in sorted(delivered.items())
        if content and not _is_text(content) and (known := digest(content)) not in given
    }
    group = facts_of(graded.run).bench_of or graded.run.student
    return Measured(graded.run.student, caseless(group), files)


def _is_text(content: bytes) -> bool:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return b"\0" not in content


def digest(content: bytes) -> str:
    """By which equal files are known; a MATLAB file without its head, which says when it was written."""
    return hashlib.sha256(content[_HEAD:] if content.startswith(_MATLAB) else content).hexdigest()


def hints(everybody: Iterable[Measured]) -> list[tuple[tuple[str, ...], str]]:
    """Groups of students who handed in the same files, and not together, and a line on each."""
    owners: dict[str, list[Measured]] = {}
    for one in everybody:
        for known in one.files:
            owners.setdefault(known, []).append(one)
    found: dict[tuple[str, ...], list[str]] = {}
    for known, those in owners.items():
        groups = len({one.bench_of for one in those})
        if 1 < groups <= MOST_ALIKE:
            found.setdefault(tuple(one.student for one in those), []).append(those[0].files[known])
    return [(students, _line(students, names)) for students, names in found.items()]


def _line(students: Iterable[str], names: Sequence[str]) -> str:
    return _("{students} handed in the same {files}: {first}{more}.").format(
        students=", ".join(students),
        files=plural(len(names), "{count} file", "{count} files"),
        first=names[0],
        more=_(" and others") if len(names) > 1 else "",
    )
