"""What is to be said at home of a report's PDF that is handed in along with the notebooks."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Where
from labcourse.answers.report_files import ReportFile
from labcourse.messages import listed
from labcourse.run.student_folder import Work

_ROUGHLY = 2.0  # s by which the times of files may differ; FAT counts in two
_NAMED = 6  # parts that are named before "and 12 more"


def notes(
    work: Work, along: Mapping[str, ReportFile], written: Collection[Where], catalogue: Catalogue
) -> Iterator[str]:
    """Which PDFs are handed in, and what is read in them rather than in the text cells.

    Parameters
    ----------
    work : the student's
    along : number of a report → its PDF
    written : the texts that stand in their cells
    catalogue : of the course
    """
    for number, one in along.items():
        yield str(one)
        report = catalogue.reports[number]
        missing = [name for name in report.names if (number, name) not in written]
        if one.own and missing:
            yield (
                f"{number}: {listed(missing, _NAMED)} are not written in their cells. Whoever scores them looks "
                f"for them in your own document, {one.name}: let its headings say which is which."
            )
        if one.own and len(missing) < len(report.names):
            yield (
                f"{number}: some text cells are filled in, too. Whoever scores those reads the cell first; empty "
                "it if only your document counts."
            )
        if not one.own and _is_older(work, one, f"{report.notebook}.ipynb"):
            yield (
                f"{one.name} was made before {report.notebook} was saved last. If you changed a text, a figure "
                "or a table since, run the cell with lab.report() again: whoever judges the report as a whole "
                "reads the PDF."
            )


def _is_older(work: Work, one: ReportFile, notebook: str) -> bool:
    try:
        made = (work.folder / one.name).stat().st_mtime
    except OSError:
        return False
    return made + _ROUGHLY < work.saved.get(notebook, 0.0)
