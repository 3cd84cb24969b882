"""What the gradebook keeps of a run besides its answers, and what marking is told of it.

All of it is plain data, so that answers can be marked again, and reasons told again, without running anything.
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from labcourse.answers import answers
from labcourse.answers.cell_reports import CellError, CellReport, Refusal, Reports
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import Where, Words
from labcourse.benches import BenchPolicy
from labcourse.errors import AnswerError
from labcourse.grading.gradebook import Graded, MarkRecord, RunRecord
from labcourse.grading.marking.marking import KEY_FAILED, UNMARKED, About, Mark
from labcourse.grading.marking.marking_processes import Asked, Marked
from labcourse.grading.verdicts import Status

FAILED = "failed: "  #: begins the key of what stands for a run where grading itself failed


@dataclass(frozen=True)
class Facts:
    """What is known of a run.

    Attributes
    ----------
    reports : on its cells
    ended : what went wrong with the run as a whole
    problems, notes : all that there is to say, but for what marking says
    missing : (question, part) → why there is no answer
    asked : (question, part) that the student's release asks; None if it is the course's
    bench_of : whose bench it was run on
    policy : which bench each student had; None if it is not known
    start : name of what was given to a class that began in the middle; "" where it began at the beginning
    reports_in_pdf : number of a report → the PDF that was handed in
    evidence : what the course read of the student's files in the sandbox, JSON: a claim
    """

    reports: Reports = field(default_factory=Reports)
    ended: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    missing: Mapping[Where, str] | None = None
    asked: Sequence[Where] | None = None
    bench_of: str = ""
    policy: BenchPolicy | None = None
    start: str = ""
    evidence: bytes = b""
    reports_in_pdf: Mapping[str, ReportFile] = field(default_factory=dict)

    def plain(self) -> tuple[dict[str, Any], ...]:
        """As the gradebook keeps it."""
        about = {
            "ended": list(self.ended),
            "problems": list(self.problems),
            "notes": list(self.notes),
            "missing": [[*where, why] for where, why in (self.missing or {}).items()],
            "asked": None if self.asked is None else [list(where) for where in self.asked],
            "bench_of": self.bench_of,
            "policy": None if self.policy is None else asdict(self.policy),
            "refusals": [asdict(one) for one in self.reports.refusals],
        }
        if self.start:
            about["start"] = self.start
        if self.evidence:
            about["evidence_read"] = b64encode(zlib.compress(self.evidence)).decode("ascii")
        if self.reports_in_pdf:
            about["reports_in_pdf"] = [one.plain() for one in self.reports_in_pdf.values()]
        return (about, *(_plain(report) for report in self.reports.cells))


def _plain(report: CellReport) -> dict[str, Any]:
    found = asdict(report)
    found["lacked"] = [list(where) for where in report.lacked]
    return {name: value for name, value in found.items() if value not in (None, [])}


def facts_of(record: RunRecord) -> Facts:
    """What the gradebook has of a run. Of those of earlier versions it has only what was said of them."""
    if not record.cells:
        notes = tuple(note for note in record.notes if not note.endswith((UNMARKED, UNMARKED)))
        return Facts(problems=record.problems, notes=notes, bench_of=record.student)
    about, *cells = record.cells
    reports = Reports(
        tuple(
            CellReport(
                cell["notebook"],
                cell["cell"],
                cell["finished"],
                CellError(**cell["error"]) if "error" in cell else None,
                tuple((question, part) for question, part in cell.get("lacked", ())),
            )
            for cell in cells
        ),
        tuple(Refusal(**one) for one in about["refusals"]),
    )
    asked = about["asked"]
    return Facts(
        reports,
        tuple(about["ended"]),
        tuple(about["problems"]),
        tuple(about["notes"]),
        {(question, part): why for question, part, why in about["missing"]},
        None if asked is None else [(question, part) for question, part in asked],
        about["bench_of"],
        None if about["policy"] is None else BenchPolicy(**about["policy"]),
        about.get("start", ""),
        zlib.decompress(b64decode(about["evidence_read"])) if "evidence_read" in about else b"",
        {one["report"]: ReportFile.from_plain(one) for one in about.get("reports_in_pdf", ())},
    )


def words_of(record: RunRecord) -> dict[Where, Words]:
    """The answers in words that belong to a run."""
    return {
        (question, part): Words.from_plain(content)
        for question, parts in record.words.items()
        for part, content in parts.items()
    }


def plain_words(words: Mapping[Where, Words]) -> dict[str, dict[str, Any]]:
    """Answers in words, as the gradebook keeps them."""
    found: dict[str, dict[str, Any]] = {}
    for (question, part), one in words.items():
        found.setdefault(question, {})[part] = one.plain()
    return found


def recorded_in(data: bytes | None) -> set[Where]:
    """(question, part) of all that an ``answers.json`` holds, by its own account; nothing if it cannot be read."""
    try:
        content = answers.parse(data or b"")
    except AnswerError:
        return set()
    return {(question, part) for question, parts in content["answers"].items() for part in parts}


def supplied_parts(record: RunRecord) -> set[Where]:
    """(question, part) of the values that an instructor supplied."""
    return {(question, part) for question, _dot, part in (name.rpartition(".") for name in record.supplied)}


def to_be_marked(record: RunRecord) -> Asked:
    """What marking is given of a run."""
    facts = facts_of(record)
    about = About(facts.missing or {}, supplied_parts(record), facts.asked, facts.start, facts.reports_in_pdf)
    student = facts.bench_of or record.student
    return Asked(student, record.answers, record.probe_seed, words_of(record), about, facts.policy, facts.evidence)


def with_messages(record: RunRecord, marked: Marked) -> RunRecord:
    """A run with what marking says of its answers: each once, and by this key alone."""
    facts = facts_of(record)
    problems = dict.fromkeys((*facts.problems, *marked.problems))
    notes = dict.fromkeys((*facts.notes, *marked.notes))
    return replace(record, problems=tuple(problems), notes=tuple(notes))


def mark_records(marks: tuple[Mark, ...]) -> tuple[MarkRecord, ...]:
    """Marks as the gradebook takes them."""
    return tuple(
        MarkRecord(one.question, one.part, one.status.value, one.points, one.out_of, one.reason, one.given)
        for one in marks
    )


def key_faults(graded: Graded) -> list[str]:
    """What marking said of parts that it could not mark, for a fault of the key; with file and line."""
    parts = [one for one in graded.marks if one.status == Status.NOT_MARKED]
    told = [KEY_FAILED.format(number=one.question, part=one.part, fault="") for one in parts]
    return [line for line in graded.run.problems if line.startswith(tuple(told))]
