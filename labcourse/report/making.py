"""``lab.report(…)``: a student's report written into their folder, and what there is to say of it, in the notebook."""

from __future__ import annotations

import html
import os
import sys
import time
from collections.abc import Iterable, Sequence
from datetime import datetime
from difflib import get_close_matches
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import files
from labcourse.answers import report_files
from labcourse.errors import AnswerError
from labcourse.messages import plural
from labcourse.report import attaching, checklist
from labcourse.report.document import Place
from labcourse.run import by_program, from_notebook

if TYPE_CHECKING:
    from labcourse.session import Session

#: Libraries that make a report, by the names that they are imported by, and installed by.
NEEDED = {"pypandoc": "pypandoc_binary", "typst": "typst"}

Told = tuple[str, Place]


def report(lab: Session, folder: Path, name: str, cell: str = "", pdf: str | os.PathLike[str] = "") -> None:
    """Write a report as HTML and as PDF, and show where they are and what is still to be done.

    A document of the student's own is taken as the report instead: see :mod:`labcourse.report.attaching`.

    Parameters
    ----------
    lab : the student's session
    folder : of the notebooks; the files are written there
    name : of the report, or how its name begins
    cell : id of the cell that asks for it; "" if it is not known
    pdf : file of the student's own document; "" to make one

    Raises
    ------
    AnswerError
        If there is no such report, or its notebook cannot be read.
    """
    number = find(lab.catalogue.reports, name)
    if by_program():
        print(from_notebook.nothing_here("lab.report()"))
        return
    if pdf:
        attaching.attach(folder, lab.catalogue, number, pdf)
        return
    if missing := [installed for imported, installed in NEEDED.items() if find_spec(imported) is None]:
        print(not_installed(missing))
        return
    if not from_notebook.is_saved(folder, cell):
        print("This notebook is not saved as it stands here, and the report is made of the saved file.")
        print("Save it (Ctrl+S, on a Mac ⌘+S), and run this cell again.")
        return
    if own := lab.own_document(number):
        print(
            f"{own.name} is a document of your own, and is handed in as your report. It is left as it is: "
            f"nothing is made. To hand in the notebook’s texts instead, delete {own.name}, and run this cell "
            "again."
        )
        return
    from labcourse.report import composing, pandoc, writing  # what they need is loaded where it is there

    started = time.perf_counter()
    document = composing.composed(lab, folder, number, datetime.now())
    try:
        made = writing.written(document)
        page, paper = (folder / f"{file_name(number)}.{ending}" for ending in ("html", "pdf"))
        files.write(page, made.page)
        files.write(paper, made.pdf)
    except (pandoc.ReportError, OSError) as error:
        print(f"The report is not made, and nothing is written: {error}")
        return
    took = time.perf_counter() - started
    said = "Written in {seconds:.1f} s: {pages}, from {notebook} as it was saved at {when}.".format(
        seconds=took,
        pages=plural(made.pages, "{count} page", "{count} pages"),
        notebook=document.front.notebook,
        when=datetime.fromtimestamp((folder / document.front.notebook).stat().st_mtime).strftime("%H:%M:%S"),
    )
    found = [(fault.message, fault.place) for fault in checklist.faults(document, made.pages)]
    show([paper.name, page.name], said, made.told, found)


def find(reports: Iterable[str], name: str) -> str:
    """The number of the report that a name, or its beginning, means.

    Raises
    ------
    AnswerError
        If it means none, or several.
    """
    known = list(reports)
    wanted = str(name).casefold().strip()
    fitting = [one for one in known if one.casefold() == wanted] or [
        one for one in known if wanted and one.casefold().startswith(wanted)
    ]
    if len(fitting) == 1:
        return fitting[0]
    first = {one.partition(" ")[0].casefold(): one for one in known}
    if near := get_close_matches(wanted.partition(" ")[0], first, n=1, cutoff=0.85):  # as with another spelling
        return first[near[0]]
    raise AnswerError(f"There is no report {name!r}; there are {', '.join(known)}.")


def file_name(number: str) -> str:
    """The name of a report's files, without their ending."""
    return report_files.file_name(number).removesuffix(report_files.PDF)


def not_installed(missing: Sequence[str]) -> str:
    """What is said where the libraries are missing that make a report."""
    return "\n".join(
        [
            f"The report is not made, and nothing is written. Not installed: {', '.join(missing)}.",
            f"Install it once, in a cell of your own (about 75 MB):   %pip install {' '.join(missing)}",
            "Then run this cell again.",
        ]
    )


# --- in a notebook, and without one ----------------------------------------------------------------------------------


def show(made: Sequence[str], said: str, told: Sequence[Told], found: Sequence[Told]) -> None:
    """Show what was written, and what there is to do, each with a link to its cell; outside a notebook as text."""
    sections = [
        ("What could not be taken over, or is missing:", told),
        ("Before you hand it in:", found),
    ]
    plain = [", ".join(made), said]
    rich = [" · ".join(_link(name, name) for name in made), html.escape(said)]
    for heading, entries in sections:
        if entries:
            plain += ["", heading, *(f"  {place.notebook}: {what}" for what, place in entries)]
            listed = "".join(
                f"<li>{html.escape(what)} {_link(place.link, place.notebook)}</li>" for what, place in entries
            )
            rich.append(f"<b>{html.escape(heading)}</b><ul>{listed}</ul>")
    if not (told or found):
        plain.append("Nothing is missing and nothing was left out, as far as a program sees.")
        rich.append(html.escape(plain[-1]))
    plain += ["", checklist.NOT_CHECKED]
    rich.append(html.escape(checklist.NOT_CHECKED))
    if _in_notebook():
        from IPython.display import display

        content: Any = {"text/html": "".join(f"<div>{one}</div>" for one in rich), "text/plain": "\n".join(plain)}
        display(content, raw=True)
    else:
        print("\n".join(plain))


def _link(target: str, shown: str) -> str:
    return f'<a href="{html.escape(target)}" target="_blank" rel="noopener">{html.escape(shown)}</a>'


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    return ipython is not None and getattr(ipython.get_ipython(), "kernel", None) is not None
