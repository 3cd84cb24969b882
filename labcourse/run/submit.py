"""Pack work to be handed in: one zip named by the student's ID, with a receipt that says what is in it."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import labcourse
from labcourse import clock, files, program, student_id
from labcourse.answers import notebooks, own_files, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Notebook
from labcourse.course_file import NOBODY
from labcourse.errors import CheckError, StudentIDError
from labcourse.files import ANSWERS_FILE, COURSE_FILE, IN_BROWSER
from labcourse.messages import number_of
from labcourse.problems import Code, Problem
from labcourse.run import student_folder
from labcourse.run.check import Checked
from labcourse.sentences import sentence, sentences

MAX_OUTPUT = 200_000  #: characters, as JSON, of what a cell shows; more is left out: it is for people, and not needed
_SHOWN = 16  # digits of the content's hash that are printed; 64 bits, which nobody hits by chance


@dataclass(frozen=True)
class Submitted:
    """A packed submission.

    Attributes
    ----------
    path : of the zip
    receipt : plain data, as in the zip: student, partners, time, digest of the content, questions, files, notes
    lines : the receipt for people
    new : those of the lines that the check has not shown
    receipts : file beside the zip that has all of a student's receipts
    """

    path: Path
    receipt: Mapping[str, Any]
    lines: tuple[str, ...]
    new: tuple[str, ...]
    receipts: Path


def submit(
    folder: Path,
    masters: Mapping[str, dict[str, Any]],
    catalogue: Catalogue,
    *,
    student: str = "",
    partners: Sequence[str] = (),
    out: Path | None = None,
    checked: Checked | None = None,
    now: datetime | None = None,
) -> Submitted:
    """Pack a student's work.

    Parameters
    ----------
    folder : the student's
    masters : file name → notebook as released
    catalogue : of the course
    student : ID; else as the folder says
    partners : IDs of those who hand in the same work; else as ``course.json`` says
    out : folder for the zip; the one above the student's unless given
    checked : result of a check; None if there was none
    now : time of the receipt

    Raises
    ------
    CheckError
        If there is no ID to name it by, or it cannot be written.
    """
    work = student_folder.read(folder, list(masters), notebooks.packages_of(masters), catalogue)
    student = owner(work, student)
    out = (out or folder.parent).resolve()
    if out.suffix.casefold() == ".zip":
        raise CheckError(f"--out names a folder for the zip, and the zip is named by the student: {out.parent}.")
    if folder.resolve() in (out, *out.parents):
        raise CheckError("The zip cannot lie in the folder that is packed: choose another place by --out.")
    time = now or clock.now()
    work = replace(work, problems=(*work.problems, *student_folder.work_elsewhere(work, masters)))
    content, receipt = _content(work, student, _partners(partners or work.hand_in.course.get("with", ()), student))
    receipt |= {"time": time.astimezone(UTC).isoformat(timespec="seconds"), "checked": checked is not None}
    questions = checked.questions if checked else {}
    receipt["answered"] = [question for question, is_there in questions.items() if is_there]
    receipt["not_answered"] = [question for question, is_there in questions.items() if not is_there]
    target, receipts = out / f"{student}.zip", out / f"{student}{own_files.RECEIPTS}"
    again = " It replaces the one that was there." if target.exists() else ""
    pdfs = report_files.of_files(work.hand_in.reports, catalogue).values()
    of_questions = (
        f"Questions  {checked.summary if checked else 'not checked, as you asked: what a run records is not known.'}",
        *([f"Not there  {', '.join(receipt['not_answered'])}"] if receipt["not_answered"] else []),
    )
    lines = (
        f"Receipt    {', '.join((student, *receipt['with']))}",
        f"Time       {time.astimezone():%Y-%m-%d %H:%M:%S %z} ({time.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC)",
        f"Content    {receipt['content'][:_SHOWN]} ({number_of(len(content), 'file')})",
        *(f"Report     {sentence(pdf.note)}" for pdf in pdfs),
        *of_questions,
        *(f"Note       {note}" for note in receipt["notes"]),
        f"Upload     {shown(target)}: this one file is all that you hand in.{again}",
    )
    packed = {**content, own_files.RECEIPT_FILE: _json(receipt, indent=1)}
    try:
        out.mkdir(parents=True, exist_ok=True)
        files.write(target, lambda path: _pack(path, packed, time))
        earlier = files.read(receipts) if receipts.exists() else b""
        files.write(receipts, earlier + ("\n".join(lines) + "\n\n").encode())
    except OSError as error:
        raise CheckError(
            f"{error.filename or target} cannot be written: {error.strerror}. Choose another folder by --out."
        ) from None
    said = sentences((*checked.problems, *checked.notes)) if checked else ()
    known = {*of_questions, *(f"Note       {note}" for note in said)} if checked else {}
    return Submitted(target, receipt, lines, tuple(line for line in lines if line not in known), receipts)


def shown(path: Path) -> str:
    """Return where a file is, for people: in a browser, it is handed to the downloads."""
    return f"{path.name}, in your browser's downloads" if IN_BROWSER else files.shown(path)


def owner(work: student_folder.StudentFolder, student: str = "") -> str:
    """Return the ID by which work is handed in: as given, else as the folder says.

    Raises
    ------
    CheckError
        If there is none.
    """
    name = student_folder.student_of(work, student)
    if name == NOBODY:
        raise CheckError(
            f"Whose work is this? Say {program.name()} submit --student YOUR-ID, with the ID that your instructor "
            f"knows you by. ({program.name()} lab --student YOUR-ID says it once for all.)"
        )
    return name


def _partners(given: Any, student: str) -> list[str]:
    """Return the IDs of partners, each once, and not the student's own."""
    if not isinstance(given, list | tuple):
        raise CheckError(f'{COURSE_FILE}: "with" should be a list of IDs.')
    try:
        names = [student_id.normalised(partner) for partner in given]
    except StudentIDError as error:
        raise CheckError(f"With whom? {error}") from None
    partners: dict[str, str] = {}
    for name in names:
        partners.setdefault(student_id.caseless(name), name)
    partners.pop(student_id.caseless(student), None)
    return list(partners.values())


def _content(
    work: student_folder.StudentFolder, student: str, partners: list[str]
) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return the files that are handed in, and what their receipt says."""
    waits = (Problem.of(Code.PARTNER_TO_CONFIRM, partner=partner, student=student) for partner in partners)
    notes = [*work.problems, *work.notes, *waits]
    content = {**work.hand_in.files, **work.hand_in.reports}
    for name in work.hand_in.notebooks:
        content[name], dropped = slim(files.read(work.folder / name))
        if dropped:
            notes.append(Problem.of(Code.OUTPUTS_LEFT_OUT, name, count=dropped))
    if work.hand_in.claim is not None:
        content[ANSWERS_FILE] = work.hand_in.claim
    content[COURSE_FILE] = _json(
        {**work.hand_in.course, "student": student, **({"with": partners} if partners else {})}
    )
    digests = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(content.items())}
    receipt = {
        "student": student,
        "with": partners,
        "content": hashlib.sha256(json.dumps(digests, sort_keys=True).encode()).hexdigest(),
        "software": f"labcourse {labcourse.__version__}",
        "files": digests,
        "notes": sentences(notes),
    }
    return content, receipt


def _json(content: Mapping[str, Any], indent: int | None = None) -> bytes:
    return (json.dumps(content, ensure_ascii=False, indent=indent) + "\n").encode()


def slim(data: bytes) -> tuple[bytes, int]:
    """Leave out of a notebook what takes much room and nobody needs; return it, and the number of cells concerned.

    Sources, and pictures in text, stay as they are; so does all that cells have shown up to :data:`MAX_OUTPUT`.
    """
    notebook = Notebook.read(data).content
    large = [cell for cell in notebook["cells"] if len(json.dumps(cell.get("outputs"))) > MAX_OUTPUT]
    for cell in large:
        cell["outputs"] = []
    widgets = notebook.get("metadata", {}).pop("widgets", None)
    if not large and widgets is None:
        return data, 0
    return (json.dumps(notebook, indent=1) + "\n").encode(), len(large)


def _pack(path: Path, content: Mapping[str, bytes], time: datetime) -> None:
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in sorted(content.items()):
            entry = zipfile.ZipInfo(name, time.astimezone().timetuple()[:6])
            entry.create_system, entry.external_attr = 3, 0o644 << 16  # as on Unix, whatever made it
            packed.writestr(entry, data, zipfile.ZIP_DEFLATED)
