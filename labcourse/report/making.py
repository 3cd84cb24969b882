"""``lab.report(…)``: a student's report in their folder, made of the notebook, or their own PDF."""

from __future__ import annotations

import html
import os
import time
from collections.abc import Iterable, Sequence
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from labcourse import clock, course_file, files
from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.own_files import megabytes
from labcourse.errors import AnswerError
from labcourse.files import IN_BROWSER
from labcourse.messages import number_of
from labcourse.problems import Reason
from labcourse.run import by_program, from_notebook
from labcourse.sentences import sentence

#: Libraries that make a report: name to import → name to install.
NEEDED = {"pypandoc": "pypandoc_binary", "typst": "typst"}
_NOT_CHECKED = "Now read it. Are all texts, answers and captions there, and does a text refer to each figure?"


def report(
    lab: report_files.ReportSession, folder: Path, name: str, cell: str = "", pdf: str | os.PathLike[str] = ""
) -> None:
    """Write a report as HTML and as PDF, and show where they are and what is not in them.

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
    elif missing and IN_BROWSER:
        print("A browser cannot make the report as PDF and page. Write it with another program, and hand your PDF in")
        print('by lab.report(..., pdf="my report.pdf"). Or go on with your zip on a computer with the course.')
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


def _make(lab: report_files.ReportSession, folder: Path, number: str) -> None:
    from labcourse.report import contents, pandoc, writing  # they need the libraries

    started = time.perf_counter()
    pdf, page = (folder / name for name in report_files.made_files([report_files.file_name(number)]))
    try:
        made = writing.write(contents.read(lab, folder, number, clock.now().astimezone()))
        files.write(pdf, made.pdf)
        files.write(page, made.page)
    except (pandoc.ReportError, OSError) as error:
        print(f"The report is not made, and nothing is written: {error}")
        return
    notebook = lab.catalogue.reports[number].notebook + ".ipynb"
    saved = datetime.fromtimestamp((folder / notebook).stat().st_mtime)
    pages = number_of(made.pages, "page")
    took = time.perf_counter() - started
    limit = (course_file.of(folder) or {}).get(course_file.PAGE_LIMIT)
    problems = list(made.problems)
    if isinstance(limit, int) and 0 < limit < made.pages:
        problems.append(f"The report has {pages}, cover and contents included; your course allows {limit}. Shorten it.")
    lines = [
        f"Written in {took:.1f} s: {pages}, from {notebook} as it was saved at {saved:%H:%M:%S}.",
        *(f"* {problem}" for problem in problems),
        _NOT_CHECKED,
    ]
    links = " · ".join(map(_link, (pdf.name, page.name)))
    page_lines = [links, *map(html.escape, lines)]
    from_notebook.show(
        "".join(f"<div>{line}</div>" for line in page_lines), "\n".join([f"{pdf.name}, {page.name}", *lines])
    )


def _link(name: str) -> str:
    return f'<a href="{html.escape(name)}" target="_blank" rel="noopener">{html.escape(name)}</a>'


# --- a button --------------------------------------------------------------------------------------------------------


def button(report: str, lab: report_files.ReportSession) -> None:
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
    """Take a document as the report.

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
    try:
        data = files.read(path)
    except OSError as error:
        raise AnswerError(
            f"{path} cannot be read: {error.strerror}. Give the file’s name as it is in this folder, or its whole path."
        ) from None
    why: Reason | None = report_files.refusal(data)
    if not why and report_files.of_data(report, data).encrypted:
        why = "it asks for a password, or forbids printing or copying: export it without."
    if why:
        raise AnswerError(f"{path.name} is not taken: {sentence(why)}")
    target = folder / report_files.file_name(report)
    if not (target.exists() and path.samefile(target)):
        files.write(target, data)
    if report_files.is_composed(data):
        print(f"{path.name} was made from the texts of the notebook. You hand it in as {target.name}.")
        return
    print(f"Your report is now {path.name} ({megabytes(len(data))}). It lies beside the notebooks as {target.name};")
    print("lab.submit() packs it. After each change of it, run this cell again.")
    print(f"To go back to the notebook’s texts, delete {target.name}.")
    print("If a text cell is empty, the text is read from this document, under the same heading.")
    print("The program looks at nothing in it: go through the list in the notebook yourself.")
