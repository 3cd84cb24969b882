"""``lab.report(…)``: a student's report in their folder, made of the notebook or their own PDF, and what it lacks."""

from __future__ import annotations

import html
import io
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import clock, course_file, files
from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.own_files import megabytes
from labcourse.errors import AnswerError
from labcourse.messages import plural
from labcourse.report import checklist
from labcourse.report.document import Notice
from labcourse.run import by_program, from_notebook

if TYPE_CHECKING:
    from labcourse.session import Session

#: Libraries that make a report: name to import → name to install.
NEEDED = {"pypandoc": "pypandoc_binary", "typst": "typst"}
MOST_PAGES = 150  #: of a document that is looked through; a report has a tenth
_READER = "pypdf"  # pure Python, and small


def report(lab: Session, folder: Path, name: str, cell: str = "", pdf: str | os.PathLike[str] = "") -> None:
    """Write a report as HTML and as PDF, and show where they are and what is still to be done.

    Parameters
    ----------
    lab : the student's session
    folder : of the notebooks; the files are written there
    name : of the report, or how its name begins
    cell : id of the cell that asks for it; "" if it is not known
    pdf : a document of the student's own, to be handed in as the report; "" for none

    Raises
    ------
    AnswerError
        If there is no such report, or its notebook cannot be read.
    """
    number = find(lab.catalogue.reports, name)
    missing = [installed for imported, installed in NEEDED.items() if find_spec(imported) is None]
    if by_program():
        print(from_notebook.nothing_here("lab.report()"))
    elif pdf:
        attach(folder, lab.catalogue, number, pdf)
    elif missing:
        print(f"The report is not made, and nothing is written. Not installed: {', '.join(missing)}.")
        print(_how_to_install(missing))
        print("Then run this cell again.")
    elif not from_notebook.is_saved(folder, cell):
        print("The report is made from the saved notebook, and this notebook has changes that are not saved.")
        print("Save it (Ctrl+S, on a Mac ⌘+S), and run this cell again.")
    elif own := lab.own_document(number):
        print(
            f"{own.name} is a document of your own, and you hand it in as your report. Nothing is made. To hand in "
            f"the texts of the notebook instead, delete {own.name}, and run this cell again."
        )
    else:
        _make(lab, folder, number)


def _how_to_install(names: Sequence[str]) -> str:
    """Say how to install libraries where this Python is. An environment of ``uv tool`` or ``pipx`` has no pip."""
    if find_spec("pip") is not None:
        return f"Install it once, in a cell of your own (about 75 MB):   %pip install {' '.join(names)}"
    return (
        "This Python has no pip, as uv or pipx made it. In a terminal, in the folder of the course's README, type once "
        '(about 75 MB): uv tool install --force ".[report]"   or: pipx install --force ".[report]". Then start again.'
    )


def find(reports: Iterable[str], name: str) -> str:
    """Return the number of the report with this name, or the only one that begins with it.

    Raises
    ------
    AnswerError
        If there is none, or there are several.
    """
    known = list(reports)
    wanted = name.casefold().strip()
    matches = [number for number in known if wanted and number.casefold().startswith(wanted)]
    exact = [number for number in matches if number.casefold() == wanted]
    if len(exact or matches) != 1:
        raise AnswerError(f"There is no report {name!r}; there are {', '.join(known)}.")
    return (exact or matches)[0]


def _make(lab: Session, folder: Path, number: str) -> None:
    from labcourse.report import composing, pandoc, writing  # they need the libraries

    started = time.perf_counter()
    document = composing.compose(lab, folder, number, clock.now().astimezone())
    pdf, page = (folder / name for name in report_files.made_files([report_files.file_name(number)]))
    try:
        made = writing.write(document)
        files.write(pdf, made.pdf)
        files.write(page, made.page)
    except (pandoc.ReportError, OSError) as error:
        print(f"The report is not made, and nothing is written: {error}")
        return
    notebook = lab.catalogue.reports[number].notebook + ".ipynb"
    saved = datetime.fromtimestamp((folder / notebook).stat().st_mtime)
    pages = plural(made.pages, "{count} page", "{count} pages")
    took = time.perf_counter() - started
    summary = f"Written in {took:.1f} s: {pages}, from {notebook} as it was saved at {saved:%H:%M:%S}."
    sections = {
        "What could not be taken over, or is missing:": list(made.markup.notices),
        "Before you hand it in:": checklist.faults(document, made.markup, made.pages),
    }
    _show([pdf.name, page.name], summary, sections)


def _show(names: Sequence[str], summary: str, sections: Mapping[str, Sequence[Notice]]) -> None:
    """Show what was written and what there is to do, with links to the cells; outside of a notebook as text."""
    lines = [", ".join(names), summary]
    page = [" · ".join(_link(name, name) for name in names), html.escape(summary)]
    for heading, notices in sections.items():
        if notices:
            lines += ["", heading, *(f"  {notice.place.notebook}: {notice.message}" for notice in notices)]
            items = (f"{html.escape(one.message)} {_link(one.place.link, one.place.notebook)}" for one in notices)
            page.append(f"<b>{html.escape(heading)}</b><ul><li>{'<li>'.join(items)}</ul>")
    nothing = [] if any(sections.values()) else ["The program finds nothing that is missing or left out."]
    lines += [*nothing, "", checklist.NOT_CHECKED]
    page += map(html.escape, [*nothing, checklist.NOT_CHECKED])
    from_notebook.show("".join(f"<div>{part}</div>" for part in page), "\n".join(lines))


def _link(target: str, shown: str) -> str:
    return f'<a href="{html.escape(target)}" target="_blank" rel="noopener">{html.escape(shown)}</a>'


# --- a button --------------------------------------------------------------------------------------------------------


def button(report: str, lab: Session) -> None:
    """Show a button that makes a report, and below it what there is to say of it.

    Parameters
    ----------
    report : its number, as in "First report"
    lab : the student's session

    Raises
    ------
    AnswerError
        If there is no such report.
    """
    find(lab.catalogue.reports, report)
    if by_program():  # nobody can press it
        lab.report(report)
        return
    import ipywidgets
    from IPython.display import display

    label, layout = "Make the report (PDF and web page)", {"width": "max-content"}
    pressed = ipywidgets.Button(description=label, icon="file-pdf-o", button_style="primary", layout=layout)
    shown = ipywidgets.Output()

    def make(_button: Any) -> None:
        shown.clear_output()
        with shown:
            print("Making the report …")
            lab.report(report)

    pressed.on_click(make)
    display(ipywidgets.VBox([pressed, shown]))


# --- a document of the student's own ---------------------------------------------------------------------------------


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
        print(f"{path.name} was made from the texts of the notebook. You hand it in as {target.name} ({length}).")
    else:
        print(f"Your report is now {path.name} ({length}). It lies beside the notebooks as {target.name};")
        print("lab.submit() packs it. After each change of it, run this cell again.")
        print(f"To go back to the notebook’s texts, delete {target.name}.")
        print("If a text cell is empty, the text is read from this document, under the same heading.")
    if texts is None:
        print(f"The program did not look for missing parts: that needs the library {_READER}.")
        print(_how_to_install([_READER]))
        return
    limit = (course_file.of(folder) or {}).get(course_file.PAGE_LIMIT)
    titles = list(dict.fromkeys(item.heading.partition(":")[0] for item in catalogue.items(report) if not item.judged))
    faults = checklist.faults_of_pdf(texts, target.name, titles, limit if isinstance(limit, int) else None)
    messages = [f"  * {fault.message}" for fault in faults] or ["The program finds nothing that is missing."]
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
