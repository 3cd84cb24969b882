"""Write all that is stored about a person into one zip: a person has a right to a copy."""

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
    """Write the copy of a student's data.

    Parameters
    ----------
    path : the zip; an older file is replaced
    book, results : where the data is
    student : ID

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
        made.writestr(RECORD_FILE, json.dumps(rows, indent=1, ensure_ascii=False, default=_as_json) + "\n")
        for number, file in enumerate(handed_in, start=1):
            inside = [part for part in PurePosixPath(file.name.replace("\\", "/")).parts if part not in ("..", "/")]
            made.writestr("/".join((HANDED_IN, f"{number:04} {file.received:%Y-%m-%d}", *inside)), file.content)
        for folder in results.own(student) if results is not None else ():
            within = folder.parent.relative_to(results.folder) if results is not None else Path()
            for page in filter(Path.is_file, sorted(folder.rglob("*"))):
                made.write(page, PurePosixPath(within, page.relative_to(folder.parent)).as_posix())
    try:
        files.write(path, packed.getvalue())
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}.") from None
    return len(handed_in)


def _as_json(value: Any) -> Any:
    if isinstance(value, datetime | date):
        return value.isoformat()
    return bytes(value).decode("utf-8", "replace")  # what a run left is JSON
