"""What the checklist finds missing in a report, one thing at a time; and in the reports of the solved notebooks."""

from dataclasses import replace
from datetime import datetime

import pytest
from checkout import ROOT
from report_texts import FRONT, HERE, RECORDED, of_text, png

from labcourse.report import checklist, composing
from labcourse.report.markup import Markup
from labcourse.session import Session
from rotflex.course.questions import CATALOGUE

WORDS = "Figure 1.2 shows the speed, from which the mass in Table 3 follows."
FIGURE, TABLE = 0, 1  # places of the pieces of a good report


def changed(place, **changes):
    report = of_text(WORDS)
    pieces = list(report.sections[0].pieces)
    pieces[place] = replace(pieces[place], **changes)
    return replace(report, sections=(replace(report.sections[0], pieces=tuple(pieces)), *report.sections[1:]))


def labelled(x, y):
    return changed(FIGURE, axes=((x, y),))


def written_table(head, row):
    return of_text(f"{WORDS}\n\nTable: Both runs.\n\n{head}\n|---|---|\n{row}")


def faults(document, pages=10):
    return checklist.faults(document, Markup(document), pages)


CASES = {
    "all there": (of_text(WORDS), [], []),
    "its number in the report": (of_text("Figure 1 shows it."), [], []),
    "in a list": (of_text("See Figs. 1.2 and 1."), [], []),
    "in brackets": (of_text("It is fast (Figure 1.2)."), [], []),
    "labels": (labelled("time (s)", r"$\alpha$ / °"), [], []),
    "a number without unit": (labelled("frequency in Hz", "damping ratio"), [], []),
    "a table with units": (written_table("| run | T (s) |", "| 1 | 2.01 |"), [], []),
    "a table with a column of units": (written_table("| length | Unit |", "| 2.01 | m |"), [], []),
    "a table of counts": (written_table("| run | swings |", "| 1 | 20 |"), [], []),
    "a picture": (of_text(f"{WORDS}\n\n![The bench](attachment:a.png)", {"attachment:a.png": png()}), [], []),
    "no text": (of_text(" \n"), ["mention", "text"], [RECORDED, HERE]),
    "no figure": (changed(FIGURE, svg="", missing=("figure",)), ["answer"], [RECORDED]),
    "a row of a table": (changed(TABLE, missing=("mass",)), ["answer"], [RECORDED]),
    "no caption": (changed(FIGURE, own_caption=False), ["caption"], [FRONT]),
    "no caption of a table": (changed(TABLE, own_caption=False), ["caption"], [FRONT]),
    "no label": (labelled("time (s)", ""), ["unit"], [RECORDED]),
    "no unit": (labelled("time", "angle (deg)"), ["unit"], [RECORDED]),
    "no mention": (of_text("The speed is shown above."), ["mention"], [RECORDED]),
    "no unit in a table": (written_table("| run | T |", "| 1 | 2,01 |"), ["unit"], [HERE]),
    "no caption in a text": (of_text(f"{WORDS}\n\n| T (s) |\n|---|\n| 1 |"), ["caption"], [HERE]),
}


@pytest.mark.parametrize(("document", "kinds", "places"), CASES.values(), ids=CASES)
def test_what_is_missing_is_listed_with_its_cell(document, kinds, places):
    found = faults(document)
    assert ([one.kind for one in found], [one.place for one in found]) == (kinds, places)


def test_missing_results_and_the_page_limit_are_checked():
    report = of_text(WORDS)
    first = replace(report.sections[0], missing=("T_c",))
    (fault,) = faults(replace(report, sections=(first, *report.sections[1:])))
    assert (fault.kind, fault.place) == ("answer", RECORDED) and "T_c" in fault.message
    for pages, limit, kinds in ((11, 10, ["pages"]), (10, 10, []), (100, None, [])):
        assert [one.kind for one in faults(replace(report, page_limit=limit), pages)] == kinds


@pytest.mark.parametrize("name", CATALOGUE.reports)
def test_the_texts_of_the_solved_notebooks_lack_nothing(name, tmp_path):
    """Their answers are not recorded here."""
    for path in (ROOT / "solutions").glob("*_results.ipynb"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    document = composing.compose(Session("ada", tmp_path, CATALOGUE, {}, 1), tmp_path, name, datetime(2026, 11, 23))
    markup = Markup(document)
    assert len(markup.pictures) == 0 and sum(map(len, markup.numbered.values())) >= 4 and len(document.sections) >= 9
    assert {one.kind for one in checklist.faults(document, markup, 10)} == {"answer"}
    assert not markup.notices
