"""A student's own PDF as the report: looked through, and copied beside the notebooks under the report's name."""

from __future__ import annotations

import io
import os
from importlib.util import find_spec
from pathlib import Path

from labcourse import course_file, files
from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.own_files import megabytes
from labcourse.errors import AnswerError
from labcourse.messages import plural
from labcourse.report import checklist

MOST_PAGES = 150  #: of a document that is looked through; a report has a tenth
_READER = "pypdf"  # pure Python, and small


def attach(folder: Path, catalogue: Catalogue, report: str, pdf: str | os.PathLike[str]) -> None:
    """Take a document as the report, and print what is missing in it.

    Parameters
    ----------
    folder : of the notebooks
    catalogue : of the course
    report : its number
    pdf : the document; relative to the folder

    Raises
    ------
    AnswerError
        If there is no such file, it cannot be handed in, or it has the name of another report.
    """
    path = folder / pdf
    if path.name in {report_files.file_name(other) for other in catalogue.reports if other != report}:
        raise AnswerError(
            f"{path.name} is not taken: by its name it is another report than the {report}. If it is the right "
            "one, save it under another name."
        )
    data = _data(path)
    texts = read(data, path.name) if find_spec(_READER) is not None else None
    target = folder / report_files.file_name(report)
    if not (target.exists() and path.samefile(target)):
        files.write(target, data)
    length = megabytes(len(data)) if texts is None else plural(len(texts), "{count} page", "{count} pages")
    if report_files.is_composed(data):
        print(f"{path.name} was made of the notebook’s texts, and is handed in as that, as {target.name} ({length}).")
    else:
        print(f"Your report is now {path.name} ({length}). It lies beside the notebooks as {target.name};")
        print("lab.submit() packs it. After each change of it, run this cell again.")
        print(f"To go back to the notebook’s texts, delete {target.name}.")
        print("A text that is not in its cell is looked for in it, by its heading. What is in a cell, is read there.")
    if texts is None:
        print(f"What may be missing in it was not looked at: that needs the library {_READER}. %pip install {_READER}")
        return
    limit = (course_file.of(folder) or {}).get(course_file.PAGE_LIMIT)
    titles = list(dict.fromkeys(item.heading.partition(":")[0] for item in catalogue.items(report) if not item.judged))
    faults = checklist.faults_of_pdf(texts, target.name, titles, limit if isinstance(limit, int) else None)
    messages = [f"  * {fault.message}" for fault in faults] or ["Nothing is missing, as far as its text tells."]
    print("", *messages, checklist.NOT_CHECKED_OF_PDF, sep="\n")


def _data(path: Path) -> bytes:
    try:
        data = files.read(path)
    except OSError as error:
        raise AnswerError(
            f"{path} cannot be read: {error.strerror}. Give the file’s name as it is in this folder, or its whole path."
        ) from None
    if why := report_files.refusal(data):
        raise AnswerError(f"{path.name} is not taken: {why}.")
    return data


def read(data: bytes, name: str) -> list[str]:
    """Return the text of each page of a PDF.

    Raises
    ------
    AnswerError
        If it asks for a password, is damaged, or has too many pages.
    """
    import pypdf

    try:
        reader = pypdf.PdfReader(io.BytesIO(data))
        if reader.is_encrypted and not reader.decrypt(""):
            raise AnswerError(f"{name} is not taken: it asks for a password. Export it without one.")
        if len(reader.pages) > MOST_PAGES:
            raise AnswerError(
                f"{name} is not taken: it has {len(reader.pages)} pages; a report has {MOST_PAGES} at most."
            )
        return [page.extract_text() for page in reader.pages]
    except AnswerError:
        raise
    except Exception as error:  # whatever a broken file leads to, in a library that was made for sound files
        raise AnswerError(
            f"{name} is not taken: it cannot be read as a PDF ({type(error).__name__}). Export it anew."
        ) from None
