"""What the checklist finds missing in a report, one thing at a time; and in the reports of the solved notebooks."""

from dataclasses import replace
from datetime import datetime

import pytest
from checkout import ROOT
from report_texts import FRONT, HERE, RECORDED, of_text, png

from labcourse.report import composing
from labcourse.report.checklist import faults
from labcourse.report.document import Axes
from labcourse.session import Session
from rotflex.course.questions import CATALOGUE

WORDS = "Figure 1.2 shows the speed, from which the mass in Table 3 follows."


FIGURE, TABLE = 0, 1  # places of the blocks of a good report


def changed(place, **changes):
    report = of_text(WORDS)
    blocks = list(report.sections[0].blocks)
    blocks[place] = replace(blocks[place], **changes)
    return replace(report, sections=(replace(report.sections[0], blocks=tuple(blocks)), *report.sections[1:]))


def labelled(x, y):
    return changed(FIGURE, axes=(Axes(x, y),))


def written_table(head, row):
    return of_text(f"{WORDS}\n\nTable: Both runs.\n\n{head}\n|---|---|\n{row}")


GOOD = {
    "all there": of_text(WORDS),
    "called by its number in the report": of_text("Figure 1 shows it."),
    "in a list": of_text("See Figs. 1.2 and 1."),
    "labels": labelled("time (s)", r"$\alpha$ / °"),
    "a number without unit": labelled("frequency in Hz", "damping ratio"),
    "a table with units": written_table("| run | T (s) |", "| 1 | 2.01 |"),
    "a table with a column of units": written_table("| length | Unit |", "| 2.01 | m |"),
    "a table of counts": written_table("| run | swings |", "| 1 | 20 |"),
    "a picture": of_text(f"{WORDS}\n\n![The bench](attachment:a.png)", {"attachment:a.png": png()}),
}
POOR = {
    "a text": (of_text(" \n"), ["mention", "text"], [RECORDED, HERE]),
    "a figure": (changed(FIGURE, svg=""), ["answer"], [RECORDED]),
    "a row of a table": (changed(TABLE, rows=(("mass", "$m$", "", "kg"),)), ["answer"], [RECORDED]),
    "a caption": (changed(FIGURE, own_caption=False), ["caption"], [FRONT]),
    "a table's caption": (changed(TABLE, own_caption=False), ["caption"], [FRONT]),
    "a label": (labelled("time (s)", ""), ["unit"], [RECORDED]),
    "a unit": (labelled("time", "angle (deg)"), ["unit"], [RECORDED]),
    "a mention": (of_text("The speed is shown above."), ["mention"], [RECORDED]),
    "a unit in a table": (written_table("| run | T |", "| 1 | 2,01 |"), ["unit"], [HERE]),
    "a caption in a text": (of_text(f"{WORDS}\n\n| T (s) |\n|---|\n| 1 |"), ["caption"], [HERE]),
}


def test_what_is_missing_is_found_with_its_cell_and_nothing_in_a_report_that_has_it_all():
    assert {what: faults(document, 10) for what, document in GOOD.items()} == {what: [] for what in GOOD}
    for what, (document, kinds, places) in POOR.items():
        found = faults(document, 10)
        assert ([one.kind for one in found], [one.place for one in found]) == (kinds, places), what
    report = of_text(WORDS)
    first = replace(report.sections[0], missing=("T_c",))
    (fault,) = faults(replace(report, sections=(first, *report.sections[1:])), 10)
    assert (fault.kind, fault.place) == ("answer", RECORDED) and "T_c" in fault.message
    for pages, limit, kinds in ((11, 10, ["pages"]), (10, 10, []), (100, None, [])):
        assert [one.kind for one in faults(replace(report, page_limit=limit), pages)] == kinds


@pytest.mark.parametrize("name", CATALOGUE.reports)
def test_the_texts_of_the_solved_notebooks_lack_nothing(name, tmp_path):
    """Their answers are not recorded here."""
    for path in (ROOT / "solutions").glob("*_results.ipynb"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    lab = Session("ada", tmp_path, CATALOGUE, {}, 1)
    document = composing.composed(lab, tmp_path, name, datetime(2026, 11, 23))
    assert len(list(document.texts)) >= 6 and len(list(document.figures)) >= 3
    assert {one.kind for one in faults(document, 10)} == {"answer"}
