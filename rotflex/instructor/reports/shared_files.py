"""The same file in several hand-ins: for an instructor to look at, and never a verdict.

Of what a bench is known by, signatures tell it, too, but only where the file is signed. Of other files of a student's
own, those are compared that are no text (:mod:`.same_code` reads these), were not handed out, and are not in many
hand-ins. Whoever handed in together has one bench, and is one here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from rotflex.courseware import signed_files
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
    files : digest → name of each file that their bench is known by
    others : the same of their other files
    """

    student: str
    bench_of: str
    files: Mapping[str, str]
    others: Mapping[str, str] = field(default_factory=dict)


def measured(graded: Graded, delivered: Mapping[str, bytes] | None = None, given: Collection[str] = ()) -> Measured:
    """The files that a student's bench is known by, and their other files that are no text.

    Parameters
    ----------
    graded : the run that counts
    delivered : what was handed in last: name → content
    given : digests (:func:`digest`) of files that were handed out
    """
    facts = facts_of(graded.run)
    files = {digest(content): name for name, content in _unsigned(facts.evidence)}
    others = {
        known: name
        for name, content in _unsigned(delivered or {})
        if content and not _is_text(content) and (known := digest(content)) not in {*files, *given}
    }
    return Measured(graded.run.student, caseless(facts.bench_of or graded.run.student), files, others)


def _unsigned(files: Mapping[str, bytes]) -> list[tuple[str, bytes]]:
    return sorted((name, content) for name, content in files.items() if not name.endswith(signed_files.ENDING))


def _is_text(content: bytes) -> bool:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return b"\0" not in content


def digest(content: bytes) -> str:
    """By which equal files are known; a MATLAB file without its head, which says when it was written."""
    return signed_files.digest(content[_HEAD:] if content.startswith(_MATLAB) else content)


def hints(everybody: Iterable[Measured]) -> list[tuple[tuple[str, ...], str]]:
    """Groups of students who handed in the same files, and not together, and a line on each."""
    owners: dict[str, list[Measured]] = {}
    for one in everybody:
        for known in (*one.files, *one.others):
            owners.setdefault(known, []).append(one)
    found: dict[tuple[str, ...], list[str]] = {}
    for known, those in owners.items():
        groups = len({one.bench_of for one in those})
        first = those[0]
        if groups > 1 and (known in first.files or groups <= MOST_ALIKE):
            name = first.files.get(known) or first.others[known]
            found.setdefault(tuple(one.student for one in those), []).append(name)
    return [(students, _line(students, names)) for students, names in found.items()]


def _line(students: Iterable[str], names: Sequence[str]) -> str:
    return _("{students} handed in the same {files}: {first}{more}.").format(
        students=", ".join(students),
        files=plural(len(names), "{count} file", "{count} files"),
        first=names[0],
        more=_(" and others") if len(names) > 1 else "",
    )
