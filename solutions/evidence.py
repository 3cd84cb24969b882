"""What a student hands in of a laboratory's bench: whose word each recording has, and whether it can be of that bench.

Nothing is read of a file before a machine of the laboratory's is known to have signed it.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rotflex import plausible
from rotflex.courseware.messages import _, plural
from rotflex.courseware.signed_files import ENDING, Statement, verified
from rotflex.courseware.student_id import caseless
from rotflex.errors import RecordingError, SignatureError
from rotflex.recording import Recording

from .real_benches import KnownBench


@dataclass
class Evidence:
    """What was found.

    Attributes
    ----------
    bench : at which the recordings were made; None where none is signed
    recordings : that count, in the order in which they were signed
    counted : their names
    problems, notes : what an instructor should, or may want to, know
    """

    bench: KnownBench | None = None
    recordings: list[Recording] = field(default_factory=list)
    counted: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _left_out: bool = False

    @property
    def whole(self) -> bool:
        """Whether there is a recording, and none was left out."""
        return bool(self.recordings) and not self._left_out

    def leave_out(self, name: str, why: str) -> None:
        """Not to count a file, and to say why."""
        self._left_out = True
        self.problems.append(
            _("{name} does not count, and a person should look at it: {why}.").format(name=name, why=why)
        )


def examine(student: str, benches: Sequence[KnownBench], files: Mapping[str, bytes]) -> Evidence:
    """Look at all recordings of a hand-in.

    Parameters
    ----------
    student : whose hand-in it is
    benches : of the laboratory's
    files : path → content
    """
    found = Evidence()
    signed = [one for name in sorted(files) if name.endswith(".mat") and (one := _signed(name, benches, files, found))]
    at = Counter(bench.name for _name, _statement, bench in signed).most_common()
    if not at:
        found.problems.append(
            _("There is no recording that a bench of the laboratory's signed: what was measured is for a person.")
        )
        return found
    found.bench = next(bench for bench in benches if bench.name == at[0][0])
    for name, _statement, bench in sorted(signed, key=lambda one: _number(one[1])):
        if bench is not found.bench:
            found.leave_out(
                name, _("it is of the bench {other}, and most are of {name}").format(other=bench.name, name=at[0][0])
            )
            continue
        _take(name, files[name], bench, found)
    found.notes.append(_marked_with(found.bench, found.counted))
    _say_whose(student, [statement for _name, statement, bench in signed if bench is found.bench], found)
    return found


def _number(statement: Statement) -> int:
    number = statement.about.get("number")
    return number if isinstance(number, int) else 0


def _signed(
    name: str, benches: Sequence[KnownBench], files: Mapping[str, bytes], found: Evidence
) -> tuple[str, Statement, KnownBench] | None:
    """A file that a machine of the laboratory's signed; None, and a word on it, where none did."""
    by_key = {key: bench for bench in benches for key in bench.keys}
    beside = files.get(name + ENDING)
    if beside is None:
        found.leave_out(name, _("it is not signed"))
        return None
    try:
        statement = verified(files[name], beside, by_key)
    except SignatureError as error:
        found.leave_out(name, str(error))
        return None
    return name, statement, by_key[statement.key]


def _take(name: str, content: bytes, bench: KnownBench, found: Evidence) -> None:
    """Take a signed recording, if it can be one of the bench."""
    with tempfile.TemporaryDirectory(prefix="rotflex-evidence-") as folder:
        path = Path(folder, "recording.mat")
        path.write_bytes(content)
        try:
            recording = Recording.load(path)
            doubts = list(plausible.look(recording, bench.servo, bench.parameters).doubts())
        except RecordingError as error:
            doubts = [str(error).rstrip(".")]
    if doubts:
        found.leave_out(name, "; ".join(doubts))
    else:
        found.recordings.append(recording)
        found.counted.append(Path(name).stem)


def _marked_with(bench: KnownBench, counted: Sequence[str]) -> str:
    """A line on which bench it was, and which of its recordings count."""
    return _("Marked with the bench {name} and {count} of it: {listed}.").format(
        name=bench.name,
        count=plural(len(counted), "{count} recording", "{count} recordings"),
        listed=", ".join(counted) or _("none counts"),
    )


def _say_whose(student: str, statements: Sequence[Statement], found: Evidence) -> None:
    """In whose name others were made: of a pair at one bench, or a class-mate's."""
    others = Counter(one.text("student") for one in statements if caseless(one.text("student")) != caseless(student))
    for other, count in others.items():
        found.problems.append(
            _(
                "{count} signed in the name of {other}: right where the two worked at the bench "
                "together, and else not {student}'s own."
            ).format(count=plural(count, "{count} recording", "{count} recordings"), other=other, student=student)
        )
