"""The checklist on a poor report, whose faults were listed beforehand, and on good ones in several styles."""

from __future__ import annotations

import dataclasses
from datetime import datetime

import pytest
from checkout import ROOT
from good_reports import FRENCH, GERMAN, GOOD, NARRATIVE, TERSE, equation, figure, table, text
from poor_report import FAULTS, NOTEBOOK, POOR

from rotflex.courseware import words
from rotflex.courseware.report import composing
from rotflex.courseware.report.checklist import Fault, faults, listed, not_looked_at
from rotflex.courseware.report.checks import units
from rotflex.courseware.report.checks.faults import named
from rotflex.courseware.report.document import Document, Place, Prose
from rotflex.courseware.session import Session
from rotflex.workbook.questions import CATALOGUE

#: Number of a fault in the list → the kind by which the checklist tells it, and a piece of what it says. What no
#: program finds without a dictionary is not here: the spelling mistake that is one half of the last.
TOLD = {
    1: ("author", "no author"),
    2: ("date", "no date"),
    3: ("text", "III.2"),
    4: ("figure", "Figure 3"),
    5: ("table", "poles"),
    6: ("axis", "Figure 1 (Figure 2.9): the vertical"),
    7: ("unit", "frequency"),
    8: ("curves", "Figure 2"),
    9: ("caption", "Figure 1"),
    10: ("same caption", "Figure 3"),
    11: ("not referred to", "Figure 3"),
    12: ("not referred to", "Table 1"),
    13: ("dangling", "Figure 9"),
    14: ("not referred to", "Equation (2)"),
    15: ("order", "Equation (1)"),
    16: ("latex", "not closed"),
    17: ("latex", r"\omgea"),
    18: ("typed", "J*w^2"),
    19: ("draft", "TODO"),
    20: ("draft", "???"),
    21: ("repeated word", "the the"),
    22: ("twice", "I.1"),
    23: ("interprets", "II.2"),
    24: ("other number", "K_s"),
    25: ("no unit", "omega_n"),
    26: ("comma", "1,5"),
    27: ("digits", "3.851562500"),
    28: ("no entry", "[3]"),
    29: ("never cited", "[2]"),
    30: ("breaks off", "not too large and"),
}


def kinds(document: Document, pages: int | None = None) -> list[str]:
    return [fault.kind for fault in faults(document, pages)]


@pytest.fixture(scope="module")
def found() -> list[Fault]:
    return faults(POOR)


def test_the_faults_of_the_poor_report_are_found(found):
    assert set(TOLD) <= set(FAULTS)
    missed = [
        FAULTS[number]
        for number, (kind, piece) in TOLD.items()
        if not any(one.kind == kind and piece in one.what for one in found)
    ]
    assert missed == []


def test_nothing_is_found_in_it_that_is_not_in_the_list(found):
    # Two have a second side: an address alone is a poor source; and a misspelt command stands in the broken formula.
    known = [*TOLD.values(), ("reference", "[2]")]
    assert [one for one in found if not any(one.kind == kind and piece in one.what for kind, piece in known)] == []


def test_each_fault_says_what_why_and_what_to_do_in_sentences_and_where(found):
    for one in found:
        assert one.why.endswith((".", "?"))
        assert one.advice.endswith(".")
        assert one.place.notebook.endswith(".ipynb")
    (unit,) = [one for one in found if one.kind == "no unit"]
    assert f"{NOTEBOOK}#cell-id=report-analysis" in listed([unit])


def test_of_two_numbers_that_differ_both_are_told_as_they_are_written_and_not_which_is_right(found):
    (other,) = [one for one in found if one.kind == "other number"]
    assert other.what == "III.1: K_s is 1.30 N·m/rad in the text, and 2.02 N·m/rad in Table 1."


@pytest.mark.parametrize("name", GOOD)
def test_of_a_good_report_there_is_nothing_to_say(name):
    assert [str(one) for one in faults(GOOD[name], pages=10)] == []


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The reports of the solved notebooks, of whose recorded answers none are here: by report."""
    folder = tmp_path_factory.mktemp("solved")
    for path in (ROOT / "solutions").glob("*_results.ipynb"):
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "course.json").write_text('{"student": "ada", "title": "A course"}')
    lab = Session("ada", folder, CATALOGUE, {}, 1)
    return {number: composing.composed(lab, folder, number, datetime(2026, 11, 23)) for number in CATALOGUE.reports}


@pytest.mark.parametrize("name", CATALOGUE.reports)
def test_of_the_reports_of_the_solved_notebooks_there_is_nothing_to_say_but_what_is_not_recorded_here(solved, name):
    document = solved[name]
    assert len(list(document.texts)) >= 6 and len(list(document.figures)) >= 3
    assert set(kinds(document)) == {"figure", "table"}


def test_what_is_not_looked_at_is_told():
    assert len(not_looked_at(TERSE)) == len(not_looked_at(GERMAN)) == 1
    (_spelling, unknown) = not_looked_at(FRENCH)
    assert "English, German" in unknown


def one_text(words: str, heading: str = "Analysis", language: str = "en") -> Document:
    """The good report with one text put in the place of its last."""
    base = {"en": TERSE, "de": GERMAN}[language]
    last = dataclasses.replace(base.sections[-1], heading=heading, blocks=(text("new", words),))
    return dataclasses.replace(base, sections=(*base.sections[:-1], last))


ENOUGH = "This sentence is here so that the text which follows it is long enough to be one of a report."
GENUG = "Dieser Satz steht hier, damit der Text, der ihm folgt, lang genug ist für einen in einem Bericht."


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        ("It was done.", "short"),
        (f"{ENOUGH} The sum is $a + b.", "latex"),
        (f"{ENOUGH} The sum is $a + b}}$.", "latex"),
        (f"{ENOUGH} It is $\\left( a + b )$.", "latex"),
        (f"{ENOUGH} It was 3.2 khz.", "unit spelt"),
        (f"{ENOUGH} It took 15s.", "unit close"),
        (f"{ENOUGH} It was 4°.", "mixed units"),
        (f"{ENOUGH} The applied voltage was 1.5.", "no unit"),
        (f"{ENOUGH} Look at the figure above.", "vague"),
        (f"{ENOUGH} We clicked on the start button.", "buttons"),
        (f"{ENOUGH} The signal was recieved.", "spelling"),
        (f"{ENOUGH} It was fast , and good.", "punctuation"),
        (f"{ENOUGH} See Table 7.", "dangling"),
        (f"{ENOUGH} See equation (7).", "dangling"),
        (f"{ENOUGH} ![a sketch](sketch.png)", "picture"),
        (f"{ENOUGH} " * 30, "long"),
        (f"{ENOUGH} We saw it in [7].", "no entry"),
        (f"{ENOUGH}\n\n{words.STUB}", "draft"),
        (f"{ENOUGH} It was higher by xx %.", "draft"),
        (f"{ENOUGH} It is $K_s = X.XX$ N·m/rad.", "draft"),
        (f"{ENOUGH} It had an amplitude of 4 and began at rest.", "no unit"),
        (f"{ENOUGH} Both were recorded every 0.002.", "no unit"),
        (f"{ENOUGH} It is $K_s$ = 2.02 (Table 2).", "no unit"),
        (f"{ENOUGH} It is $K_s$ = 2.02 N/m.", "other unit"),
        (f"{ENOUGH} It is $K_s$ = 1.10 N/m, and not more.", "other unit"),
        (f"{ENOUGH} It is $\\omega_n$ = 24.2 Hz.", "other unit"),
        (f"{ENOUGH} It is $K_s = J_l\\,\\omega_n^2 = 2.02~\\mathrm{{N/m}}$.", "other unit"),
        (f"{ENOUGH} As was said above, it is $K_s$ = 1.30 N·m/rad, and nothing is below it.", "other number"),
        (f"{ENOUGH} It is $K_s$ = 1.30 N·m/rad, more or less.", "other number"),
        (f"{ENOUGH} The length is (1.5 ± 0.0561) m.", "uncertainty"),
        (f"{ENOUGH} The length is (1.53 ± 0.0561) m.", "uncertainty"),
        (f"{ENOUGH} The length is $1.5312 \\pm 0.06$ m.", "uncertainty"),
    ],
)
def test_one_fault_alone_is_found_alone(words, kind):
    assert list(dict.fromkeys(kinds(one_text(words)))) == [kind] or kind == "long"
    assert kind in kinds(one_text(words))


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (f"{GENUG} Die Spannung war 1,5.", "no unit"),
        (f"{GENUG} Es waren 1.5 V.", "comma"),
        (f"{GENUG} Das zeigt zeigt Tabelle 1.", "repeated word"),
        (f"{GENUG} Abbildung 8 zeigt es.", "dangling"),
        (f"{GENUG} Wir haben auf Start geklickt.", "buttons"),
        (f"{GENUG} Die obige Abbildung zeigt es.", "vague"),
        (f"{GENUG} Daraus folgt $K_s$ = 2,50 N·m/rad.", "other number"),
        (f"{GENUG} Unter der Last und über der Platte ist es $K_s$ = 2,50 N·m/rad.", "other number"),
    ],
)
def test_german_texts_are_read_as_german(words, kind):
    assert kinds(one_text(words, language="de")) == [kind]


@pytest.mark.parametrize(
    "words",
    [
        f"{ENOUGH} The handbook has $K_s$ = 1.30 N·m/rad instead.",  # another's number
        f"{ENOUGH} It is $K_s$ = 2.0 N·m/rad.",  # rounded
        f"{ENOUGH} It is $K_s$ = 2020 mN·m/rad.",  # in another unit
        f"{ENOUGH} The speed was 12 times as high, the time 0.",
        f"{ENOUGH} The frequency was 2, 3 and 5 Hz.",
        f"{ENOUGH} Look at Figure 7 of the handbook, and at Figure 7 in [2].",
        f"{ENOUGH} Look at Figure 2a.",
        f"{ENOUGH} It is in [0, 1].",
        f"{ENOUGH} In `the the x = a*b^2` the code is as it is.",
        f"{ENOUGH} He said that that had had no effect.",
        f"{ENOUGH} The address is https://example.org/a,,b/TODO and no more.",
        f"{ENOUGH} The fit gives $K_s$ = 2.11 N·m/rad, which is 4 % above that of Table 2.",  # a second one, told apart
        f"{ENOUGH} It is $\\omega_n$ = 24.2 1/s.",  # an angle has no unit of its own
        f"{ENOUGH} It is $\\omega_n$ = 3.85 Hz.",  # the same, in another unit
        f"{ENOUGH} It is $K_s$ = 2.02 N m/rad, by the root $\\sqrt{{K_s/J_l}}$ = 24.2 rad/s.",
        f"{ENOUGH} The length is (1.53 ± 0.06) m, the angle (40 ± 2) deg, the mass (0.125 ± 0.010) kg.",
        f"{ENOUGH} Let $xx^T$ be a matrix, and section XX of [2] its source.",
        f"{ENOUGH} It was read every 2 ms, with an amplitude of 4 and 5 deg.",
    ],
)
def test_what_only_looks_like_a_fault_is_none(words):
    assert kinds(one_text(words)) == []


@pytest.mark.parametrize(
    ("language", "words"),
    [
        ("en", "As Figure 1 shows, the frequency is 3.85 Hz."),
        ("en", "The stiffness was found to be 2.02 N·m/rad."),
        ("de", "Wie Abbildung 1 zeigt, sind es 3,85 Hz."),
        ("de", "Die Steifigkeit ergab sich zu 2,02 N·m/rad."),
    ],
)
def test_a_result_belongs_to_the_results_and_not_into_the_procedure(language, words):
    words = f"{ENOUGH if language == 'en' else GENUG} {words}"
    heading = {"en": "Procedure", "de": "Durchführung"}[language]
    assert kinds(one_text(words, heading, language)) == ["result"]
    assert kinds(one_text(words, "Analysis", language)) == []


def test_what_stands_twice_in_one_text_is_not_said_to_stand_in_another():
    (one,) = faults(one_text(f"{ENOUGH}\n\n{ENOUGH}"))
    assert one.kind == "twice" and one.what.endswith("stands there twice, word for word.")


def test_what_the_cover_lacks_is_told_with_the_line_to_write_it_in():
    (one,) = faults(dataclasses.replace(TERSE, course=""))
    assert one.kind == "course" and "“* **Course:** …”" in one.advice


def test_a_thing_is_named_once_and_the_advice_names_it(found):
    told = {one.what: one for one in found if one.kind == "not referred to"}
    assert "“Table 2 shows …”" in told["Table 1 (Table 2): no text refers to it."].advice
    assert named(ROWS, TERSE) == "Table 1"
    assert "“Equation (2) shows …”" in told["Equation (2): no text refers to it."].advice


@pytest.mark.parametrize(
    ("one", "other", "relation"),
    [
        ("N·m/rad", "N/m", "another quantity"),
        ("N·m/rad", "Nm", "the same"),
        ("kg·m²", "kg·m^2", "the same"),
        ("N·m", "kg·m²/s²", "the same"),
        ("N·m/(rad/s)", "N·m·s", "the same"),
        ("V·s/rad", "V/(rad/s)", "the same"),
        ("N·m/(rad·s)", "N·m/rad·s", "not understood"),  # the second can be read in two ways
        ("V/(rad/s)", "V/rad", "another quantity"),
        ("W", "V·A", "the same"),
        ("J", "W·s", "the same"),
        ("Ω", "V/A", "the same"),
        ("Pa", "N/m²", "the same"),
        ("ms", "s", "another size"),
        ("deg/s", "rad/s", "another size"),
        ("Hz", "rad/s", "another size"),
        ("Hz", "s", "another quantity"),
        ("rad·s⁻¹", "rad/s", "the same"),
        ("mm", "min", "another quantity"),
        ("apples", "m", "not understood"),
    ],
)
def test_units_are_of_the_quantity_that_their_definitions_say(one, other, relation):
    first, second = units.parsed(one), units.parsed(other)
    if first is None or second is None:
        said = "not understood"
    elif first.powers != second.powers:
        said = "another quantity"
    else:
        said = "the same" if first.size == pytest.approx(second.size) else "another size"
    assert said == relation


def test_more_pages_than_allowed_are_told():
    assert kinds(TERSE, pages=11) == ["pages"]
    assert kinds(TERSE, pages=10) == []
    assert kinds(dataclasses.replace(TERSE, page_limit=None), pages=100) == []


def test_what_was_left_out_of_a_text_is_told_with_its_cell():
    place = Place("04_results.ipynb", "d")
    (fault,) = faults(dataclasses.replace(TERSE, told=(("The picture a.gif could not be taken in.", place),)))
    assert (fault.kind, fault.place) == ("left out", place)


def test_of_a_picture_in_a_text_it_is_asked_whether_it_is_drawn_by_hand():
    shown = Prose("new", f"{ENOUGH} ![setup](setup.png)", Place("04_results.ipynb", "d"), {"setup.png": b""})
    last = dataclasses.replace(TERSE.sections[-1], blocks=(shown,))
    (fault,) = faults(dataclasses.replace(TERSE, sections=(*TERSE.sections[:-1], last)))
    assert fault.kind == "drawn"
    assert fault.what.endswith("?")


def with_results(*blocks: object) -> Document:
    """The narrative report with other results, which its text names."""
    words = text("b", "Figure 1 and Figure 2, and Table 1 and Table 2, are what came out of it, all of them together.")
    section = dataclasses.replace(NARRATIVE.sections[1], blocks=(words, *blocks))
    return dataclasses.replace(NARRATIVE, sections=(NARRATIVE.sections[0], section, *NARRATIVE.sections[2:]))


FULL = "What was measured in the second run of the day."
ONE = figure("Figure 1", 1, "What was measured in the first run of the day.", ("time (s)", "angle (deg)", ("",)))
ROWS = table("Table 1", 1, "Lengths of the pendulum in both runs.", ("run", "l (m)"), ("1", "1.00"), ("2", "1.01"))
MORE_ROWS = table("Table 2", 2, "Times of the pendulum in both runs.", ("run", "T (s)"), ("1", "2.00"), ("2", "2.01"))


@pytest.mark.parametrize(
    ("two", "kind"),
    [
        (figure("Figure 2", 2, FULL, ("time (s)", "", ("",)), ("", "b (V)", ("",))), ["axis"]),
        (figure("Figure 2", 2, FULL, ("", "a (V)", ("",)), ("", "b (V)", ("",))), ["axis"]),
        (figure("Figure 2", 2, FULL, ("", "a (V)", ("",)), ("time (s)", "b (V)", ("",))), []),
        (figure("Figure 2", 2, FULL, ("time (s)", "a (V)", ("",)), ("time (s)", "", ("",))), []),
        (figure("Figure 2", 2, FULL, ("time", "a (V)", ("",))), ["unit"]),
        (figure("Figure 2", 2, FULL, (r"$t$ in s", r"$|a/b|$", ("a", "b"))), []),
        (figure("Figure 2", 2, "Figure 2", ("time (s)", "a (V)", ("",))), ["caption"]),
        (figure("Figure 2", 2, "", ("time (s)", "a (V)", ("",))), ["caption"]),
        (dataclasses.replace(figure("Figure 2", 2, FULL), own_caption=False), ["caption"]),
    ],
)
def test_what_is_written_at_figures(two, kind):
    assert kinds(with_results(ONE, two, ROWS, MORE_ROWS)) == kind


def test_a_table_that_is_empty_and_one_without_caption():
    two = figure("Figure 2", 2, FULL, ("time (s)", "a (V)", ("",)))
    empty = dataclasses.replace(ROWS, rows=(("1", ""), ("2", "")))
    assert kinds(with_results(ONE, two, empty, dataclasses.replace(MORE_ROWS, caption=""))) == ["table", "caption"]


def test_two_equations_of_one_number():
    last = dataclasses.replace(TERSE.sections[-1], blocks=(*TERSE.sections[-1].blocks, equation(3, "a = b", "2")))
    assert kinds(dataclasses.replace(TERSE, sections=(*TERSE.sections[:-1], last))) == ["order"]


def test_one_word_is_no_words():
    (one,) = [fault for fault in faults(one_text("Done.")) if fault.kind == "short"]
    assert one.what.endswith("the text has 1 word.")


OWN = dataclasses.replace(MORE_ROWS, label="", caption="", rows=(), written=MORE_ROWS.place)


def test_a_table_in_a_text_is_asked_for_a_caption_and_how_to_write_one_is_said():
    two = figure("Figure 2", 2, FULL, ("time (s)", "a (V)", ("",)))
    (one,) = faults(with_results(ONE, two, ROWS, OWN))
    assert one.what == "Table 2 has no caption." and "“Table:”" in one.advice
    assert kinds(with_results(ONE, two, ROWS, dataclasses.replace(OWN, caption=MORE_ROWS.caption))) == []


@pytest.mark.parametrize(
    ("written", "lacks"),
    [
        ("| run | T |\n|---|---|\n| 1 | 2.00 |\n| 2 | 2.01 |", True),
        ("| run | T (s) |\n|---|---|\n| 1 | 2.00 |\n| 2 | 2.01 |", False),
        ("| run | T | Unit |\n|---|---|---|\n| 1 | 2.00 | s |\n| 2 | 2.01 | s |", False),
        ("| run | damping ratio |\n|---|---|\n| 1 | 0.02 |\n| 2 | 0.03 |", False),
        ("| run | T |\n|---|---|\n| 1 | 2.00 s |\n| 2 | 2.01 s |", False),
        ("| run | swings |\n|---|---|\n| 1 | 20 |\n| 2 | 21 |", False),
        ("| quantity | value |\n|---|---|\n| length (m) | 1.00 |\n| period (s) | 2.01 |", False),
        ("| quantity | value |\n|---|---|\n| length | 1.00 |\n| period | 2.01 |", True),
    ],
)
def test_a_column_of_measured_numbers_in_a_table_of_ones_own_has_a_unit(written, lacks):
    two = figure("Figure 2", 2, FULL, ("time (s)", "a (V)", ("",)))
    head = tuple(one.strip() for one in written.split("\n")[0].strip("|").split("|"))
    of_own = dataclasses.replace(OWN, caption=MORE_ROWS.caption, head=head)
    report = with_results(ONE, two, ROWS)
    words = text("b", "Figure 1, Figure 2, Table 1 and Table 2 are what came out of it, all of them together.", written)
    section = report.sections[1]
    section = dataclasses.replace(
        section,
        blocks=(words, dataclasses.replace(of_own, place=words.place, written=words.place), *section.blocks[1:]),
    )
    report = dataclasses.replace(report, sections=(report.sections[0], section, *report.sections[2:]))
    assert kinds(report) == (["unit"] if lacks else [])


def test_a_picture_in_a_text_is_called_by_its_section():
    name = "attachment:image.png"
    shown = Prose("new", f"{ENOUGH}\n\n![]({name})", Place("04_results.ipynb", "d"), {name: b""})
    picture = dataclasses.replace(figure(name, 1, ""), svg="", place=shown.place, written=shown.place)
    last = dataclasses.replace(TERSE.sections[-1], number="III.1", blocks=(shown, picture))
    told = [one.what for one in faults(dataclasses.replace(TERSE, sections=(*TERSE.sections[:-1], last)))]
    assert "Figure 1 (the picture in section III.1) has no caption." in told
    assert not any("attachment:" in what for what in told)
