"""Work packed to be handed in: one zip named by the student's ID, and a receipt that says what is in it."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import labcourse
from labcourse import files, program, student_id
from labcourse.answers import own_files, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Notebook
from labcourse.answers.own_files import RECEIPT_FILE
from labcourse.answers.report_files import ReportFile
from labcourse.course_file import NOBODY
from labcourse.errors import CheckError, StudentIDError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.messages import plural
from labcourse.run import student_folder
from labcourse.run.check import Checked
from labcourse.run.check_words import brief

MAX_OUTPUT = 200_000  #: characters, as JSON, of what a cell shows; more is left out: it is for people, and not needed
_SHOWN = 16  # digits of the content's hash that are printed; 64 bits, which nobody hits by chance


@dataclass(frozen=True)
class Submitted:
    """What was packed.

    Attributes
    ----------
    path : of the zip
    digest : of its content; the same content has the same
    lines : the receipt, for people
    receipts : file beside the zip that all of a student's receipts are added to
    """

    path: Path
    digest: str
    lines: tuple[str, ...]
    receipts: Path


def submit(
    folder: Path,
    notebooks: Sequence[str],
    *,
    student: str = "",
    partners: Sequence[str] = (),
    out: Path | None = None,
    checked: Checked | None = None,
    modules: Sequence[str] = (),
    catalogue: Catalogue | None = None,
    now: datetime | None = None,
) -> Submitted:
    """Pack a student's work.

    Parameters
    ----------
    folder : the student's
    notebooks : file names of the course's
    student : ID; else as the folder says
    partners : IDs of those who hand in the same work; else as ``course.json`` says
    out : folder for the zip; the one above the student's unless given
    checked : what a check found; None if there was none
    modules : names of the course's packages
    catalogue : of the course, which has reports; without it no report's PDF is handed in
    now : time of the receipt

    Raises
    ------
    CheckError
        If there is no ID to name it by, or it cannot be written.
    """
    work = student_folder.read(folder, notebooks, modules, catalogue)
    student = owner(work, student)
    partners = _partners(partners or work.hand_in.course.get("with", ()), student)
    out = (out or folder.parent).resolve()
    if out == folder.resolve() or folder.resolve() in out.parents:
        raise CheckError("The zip cannot lie in the folder that is packed: choose another place by --out.")
    content, told = _content(folder, work, student, partners)
    along = report_files.of_files(work.hand_in.reports, catalogue) if catalogue is not None else {}
    digest = _digest(content)
    time = now or datetime.now(UTC)
    receipt = _receipt(student, partners, digest, time, checked, content, told)
    target = out / f"{student}.zip"
    replaced = target.exists()
    lines = (*_lines(receipt, checked, along.values(), told, time), *_what_to_do(target, replaced))
    receipts = out / f"{student}{own_files.RECEIPTS}"
    content = {**content, RECEIPT_FILE: (json.dumps(receipt, ensure_ascii=False, indent=1) + "\n").encode()}
    try:
        out.mkdir(parents=True, exist_ok=True)
        files.write(target, lambda path: _pack(path, content, time))
        earlier = files.read(receipts) if receipts.exists() else b""
        files.write(receipts, earlier + ("\n".join(lines) + "\n\n").encode())
    except OSError as error:
        raise CheckError(
            f"{error.filename or target} cannot be written: {error.strerror}. Choose another folder by --out."
        ) from None
    return Submitted(target, digest, lines, receipts)


def owner(work: student_folder.Work, student: str = "") -> str:
    """The ID by which work is handed in: as given, else as the folder says.

    Raises
    ------
    CheckError
        If there is none.
    """
    named = student_folder.student_of(work, student)
    if named == NOBODY:
        raise CheckError(
            f"Whose work is this? Say {program.name()} submit --student YOUR-ID, with the ID that your instructor "
            f"knows you by. (Your bench is made from it: {program.name()} lab --student YOUR-ID says it once for all.)"
        )
    return named


def _partners(given: Any, student: str) -> list[str]:
    """IDs of partners, each once, and not the student's own."""
    if not isinstance(given, list | tuple):
        raise CheckError(f'{COURSE_FILE}: "with" should be a list of IDs.')
    found: dict[str, str] = {}
    for one in given:
        try:
            name = student_id.normalised(one)
        except StudentIDError as error:
            raise CheckError(f"With whom? {error}") from None
        if student_id.caseless(name) != student_id.caseless(student):
            found.setdefault(student_id.caseless(name), name)
    return list(found.values())


# --- what goes in -----------------------------------------------------------------------------------------------------


def _content(
    folder: Path, work: student_folder.Work, student: str, partners: Sequence[str]
) -> tuple[dict[str, bytes], list[str]]:
    """The files that are handed in, and what is to be told of them."""
    told = [*work.problems, *work.notes]
    content = {**work.hand_in.files, **work.hand_in.reports}
    for name in work.saved:
        data, dropped = slim(files.read(folder / name))
        content[name] = data
        if dropped:
            told.append(
                f"{name}: what {plural(dropped, '{count} cell', '{count} cells')} had shown is left out, for its "
                "size. Marking needs none of it."
            )
    if work.hand_in.claim is not None:
        content[ANSWERS_FILE] = work.hand_in.claim
    course = {**work.hand_in.course, "student": student, **({"with": list(partners)} if partners else {})}
    content[COURSE_FILE] = (json.dumps(course, ensure_ascii=False) + "\n").encode()
    return content, told


def slim(data: bytes) -> tuple[bytes, int]:
    """A notebook without what takes much room and nobody needs, and of how many cells the output was dropped.

    Sources, and pictures in text, stay as they are; so does all that cells have shown up to :data:`MAX_OUTPUT`.
    """
    notebook = Notebook.read(data).content
    dropped = 0
    for cell in notebook["cells"]:
        if len(json.dumps(cell.get("outputs"))) > MAX_OUTPUT:
            cell["outputs"] = []
            dropped += 1
    widgets = notebook.get("metadata", {}).pop("widgets", None)
    if not dropped and widgets is None:
        return data, 0
    return (json.dumps(notebook, indent=1) + "\n").encode(), dropped


def _digest(content: Mapping[str, bytes]) -> str:
    """Of names and contents, whatever the time and the way in which they are packed."""
    return hashlib.sha256(json.dumps(_digests(content), sort_keys=True).encode()).hexdigest()


def _digests(content: Mapping[str, bytes]) -> dict[str, str]:
    return {name: hashlib.sha256(data).hexdigest() for name, data in sorted(content.items())}


def _pack(path: Path, content: Mapping[str, bytes], time: datetime) -> None:
    local = time.astimezone().timetuple()[:6]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in sorted(content.items()):
            entry = zipfile.ZipInfo(name, local)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # whatever made it: attributes are Unix's
            entry.external_attr = 0o644 << 16
            packed.writestr(entry, data)


# --- the receipt ------------------------------------------------------------------------------------------------------


def _receipt(
    student: str,
    partners: Sequence[str],
    digest: str,
    time: datetime,
    checked: Checked | None,
    content: Mapping[str, bytes],
    told: Sequence[str],
) -> dict[str, Any]:
    questions = checked.questions if checked else {}
    return {
        "student": student,
        "with": list(partners),
        "time": time.astimezone(UTC).isoformat(timespec="seconds"),
        "content": digest,
        "software": f"labcourse {labcourse.__version__}",
        "checked": checked is not None,
        "answered": [question for question, there in questions.items() if there],
        "not_answered": [question for question, there in questions.items() if not there],
        "files": _digests(content),
        "notes": list(told),
    }


def _lines(
    receipt: Mapping[str, Any],
    checked: Checked | None,
    along: Iterable[ReportFile],
    told: Sequence[str],
    time: datetime,
) -> tuple[str, ...]:
    """The receipt in words."""
    utc, local = time.astimezone(UTC), time.astimezone()
    who = ", ".join((receipt["student"], *receipt["with"]))
    found = [
        f"Receipt    {who}",
        f"Time       {local:%Y-%m-%d %H:%M:%S %z} ({utc:%Y-%m-%d %H:%M:%S} UTC)",
        "Content    {digest} ({files})".format(
            digest=receipt["content"][:_SHOWN], files=plural(len(receipt["files"]), "{count} file", "{count} files")
        ),
    ]
    found += [f"Report     {one}" for one in along]
    if checked is None:
        found.append("Questions  not checked, as you asked: what is recorded when it is run is not known.")
    else:
        found.append(f"Questions  {brief(checked)}")
        if receipt["not_answered"]:
            found.append(f"Not there  {', '.join(receipt['not_answered'])}")
    return (*found, *(f"Note       {note}" for note in told))


def _what_to_do(target: Path, replaced: bool) -> list[str]:
    again = " It replaces the one that was there." if replaced else ""
    return [
        f"Upload     {target}: this one file is all that you hand in.{again}",
    ]
