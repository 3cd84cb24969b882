"""The same file of what was measured in several hand-ins: for an instructor to look at, and never a verdict.

Signatures tell it, too, but only where the file is signed. Whoever handed in together has one bench, and is one here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rotflex.courseware import signed_files
from rotflex.courseware.json_values import plural
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import caseless
from rotflex.instructor.gradebook import Graded
from rotflex.instructor.graded_run import facts_of


@dataclass(frozen=True)
class Measured:
    """What somebody measured.

    Attributes
    ----------
    student : the ID
    bench_of : ID of the student whose bench it was; of whoever handed in together, the same
    files : digest → name of each file
    """

    student: str
    bench_of: str
    files: Mapping[str, str]


def measured(graded: Graded) -> Measured:
    """The files that a student's bench is known by."""
    facts = facts_of(graded.run)
    files = {
        signed_files.digest(content): name
        for name, content in sorted(facts.evidence.items())
        if not name.endswith(signed_files.ENDING)
    }
    return Measured(graded.run.student, caseless(facts.bench_of or graded.run.student), files)


def hints(everybody: Iterable[Measured]) -> list[str]:
    """A line for each group of students who handed in the same files, and not together."""
    owners: dict[str, list[Measured]] = {}
    for one in everybody:
        for digest in one.files:
            owners.setdefault(digest, []).append(one)
    found: dict[tuple[str, ...], list[str]] = {}
    for digest, those in owners.items():
        if len({one.bench_of for one in those}) > 1:
            found.setdefault(tuple(one.student for one in those), []).append(those[0].files[digest])
    return [
        _("{students} handed in the same {files}: {first}{more}.").format(
            students=", ".join(students),
            files=plural(len(names), _("file")),
            first=names[0],
            more=_(" and others") if len(names) > 1 else "",
        )
        for students, names in found.items()
    ]


def text(found: Iterable[str]) -> str:
    """The part of the file for instructors."""
    head = _(
        "# The same measurements in several hand-ins\n\n"
        "**A hint, never a verdict.** Two who worked at one bench together have the same files; so has whoever took "
        "them from somebody. No mark depends on it. Ask before you conclude anything.\n"
    )
    return "\n".join([head, *(f"* {one}" for one in found), ""])
