"""All that is stored about a person, in one zip, for them: a person has a right to a copy."""

from __future__ import annotations

import io
import json
import zipfile
from datetime import date, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.erasure.results import Results
from labcourse.grading.gradebook import Gradebook

RECORD_FILE, HANDED_IN = "record.json", "handed_in"  #: in the zip: all rows; each version of all files


def write(path: Path, book: Gradebook, results: Results | None, student: str) -> int:
    """Write the copy.

    Parameters
    ----------
    path : the zip, in place of one that is there
    book, results : where it stands
    student : whose

    Returns
    -------
    int
        How many files they handed in, each version counted.

    Raises
    ------
    GradingError
        If it cannot be written.
    GradebookError
        If there is no such student.
    """
    rows, handed_in = book.persons.everything_of(student)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr(RECORD_FILE, json.dumps(rows, indent=1, ensure_ascii=False, default=_plain) + "\n")
        for number, one in enumerate(handed_in, start=1):
            inside = [part for part in PurePosixPath(one.name.replace("\\", "/")).parts if part not in ("..", "/")]
            made.writestr("/".join((HANDED_IN, f"{number:04} {one.received:%Y-%m-%d}", *inside)), one.content)
        for folder in results.own(student) if results is not None else ():
            within = folder.parent.relative_to(results.folder) if results is not None else Path()
            for file in sorted(folder.rglob("*")):
                if file.is_file():
                    made.write(file, PurePosixPath(within, file.relative_to(folder.parent)).as_posix())
    try:
        files.write(path, packed.getvalue())
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}.") from None
    return len(handed_in)


def _plain(value: Any) -> Any:
    if isinstance(value, datetime | date):
        return value.isoformat()
    return bytes(value).decode("utf-8", "replace")  # what a run left is JSON
