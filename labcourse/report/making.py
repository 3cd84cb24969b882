"""``lab.report(…)``: write a student's report into their folder, and show in the notebook what is still missing."""

from __future__ import annotations

import html
import os
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import files
from labcourse.answers import report_files
from labcourse.errors import AnswerError
from labcourse.messages import plural
from labcourse.report import attaching, checklist
from labcourse.report.document import Notice
from labcourse.run import by_program, from_notebook

if TYPE_CHECKING:
    from labcourse.session import Session

#: Libraries that make a report: name to import → name to install.
NEEDED = {"pypandoc": "pypandoc_binary", "typst": "typst"}


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
        attaching.attach(folder, lab.catalogue, number, pdf)
    elif missing:
        print(f"The report is not made, and nothing is written. Not installed: {', '.join(missing)}.")
        print(f"Install it once, in a cell of your own (about 75 MB):   %pip install {' '.join(missing)}")
        print("Then run this cell again.")
    elif not from_notebook.is_saved(folder, cell):
        print("This notebook is not saved as it stands here, and the report is made of the saved file.")
        print("Save it (Ctrl+S, on a Mac ⌘+S), and run this cell again.")
    elif own := lab.own_document(number):
        print(
            f"{own.name} is a document of your own, and is handed in as your report. It is left as it is: "
            f"nothing is made. To hand in the notebook’s texts instead, delete {own.name}, and run this cell again."
        )
    else:
        _make(lab, folder, number)


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
    document = composing.compose(lab, folder, number, datetime.now())
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
    nothing = (
        [] if any(sections.values()) else ["Nothing is missing and nothing was left out, as far as a program sees."]
    )
    lines += [*nothing, "", checklist.NOT_CHECKED]
    page += map(html.escape, [*nothing, checklist.NOT_CHECKED])
    ipython = sys.modules.get("IPython")
    if ipython is not None and getattr(ipython.get_ipython(), "kernel", None) is not None:
        content: Any = {"text/html": "".join(f"<div>{part}</div>" for part in page), "text/plain": "\n".join(lines)}
        ipython.display.display(content, raw=True)
    else:
        print("\n".join(lines))


def _link(target: str, shown: str) -> str:
    return f'<a href="{html.escape(target)}" target="_blank" rel="noopener">{html.escape(shown)}</a>'
