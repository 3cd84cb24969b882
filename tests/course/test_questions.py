"""The catalogue against the workbook: numbers, sections, outcome codes."""

import keyword

import numpy as np
import pytest

from labcourse.answers import left_out
from rotflex.course.questions import CATALOGUE

# As the workbook has them: section, and the codes in front of the question (the same as at its answer).
SECTIONS = {
    "2.2": {**dict.fromkeys(["2.1", "2.2", "2.3"], "A-2"), **dict.fromkeys([f"2.{n}" for n in range(4, 9)], "A-1 A-2")},
    "2.3.1": {"2.9": "B-5 K-2", "2.10": "K-3", "2.11": "B-7", "2.12": "B-7"},
    "2.3.2": {"2.13": "K-3", "2.14": "B-5", "2.15": "B-5 K-2", "2.16": "B-9", "2.17": "B-8", "2.18": "K-1"},
    "3.3": {"3.1": "A-1 A-3", "3.2": "A-1 A-2", "3.3": "A-2", "3.4": "A-1 A-2", "3.5": "A-1 A-2"},
    "3.4.1": {"3.6": "B-7 K-1", "3.7": "B-5 K-3", "3.8": "", "3.9": "K-1 B-9", "3.10": "K-1"},
    "3.4.2": {"3.11": "B-5 K-3", "3.12": "K-1 B-9"},
    "3.4.3": {"3.13": "B-5 K-3", "3.14": "K-1 B-9"},
    "3.4.4": {"3.15": "B-5 K-3", "3.16": "K-1 B-9", "3.17": "B-7"},
}
WORKBOOK = {number: (section, codes) for section, asked in SECTIONS.items() for number, codes in asked.items()}


def every_part():
    return [(question, part) for question in CATALOGUE.everything.values() for part in question.parts]


def test_all_35_questions_are_there_in_order_with_the_workbooks_sections_and_outcomes():
    every_class = left_out.reduced(CATALOGUE, CATALOGUE.optional)
    catalogue = [(q.number, (q.section, " ".join(q.outcomes))) for q in every_class.questions.values()]
    assert catalogue == list(WORKBOOK.items())
    assert len(catalogue) == 35


@pytest.mark.parametrize(("question", "part"), every_part(), ids=lambda value: getattr(value, "name", None))
def test_a_part_says_all_that_its_kind_needs(question, part):
    assert part.name.isidentifier()
    assert not keyword.iskeyword(part.name)
    assert part.prompt.endswith((".", "?")) or part.kind == "function"
    needed = {
        "number": part.plausible is None or part.plausible[0] < part.plausible[1],
        "matrix": part.shape,
        "poles": part.count,
        "choice": part.choices,
        "prose": part.marked == "person",
        "expression": part.symbols,
        "equation": part.symbols,
        "symbolic_matrix": part.symbols and len(part.shape) == 2,
        "function": part.probe is not None,
        "figure": True,
        "recording": part.channels and part.settings,
    }
    assert needed[part.kind]
    assert part.marked in ("auto", "person")


def test_every_question_counts_but_the_warm_up():
    assert CATALOGUE.warm_up["0.1"].points == 0
    assert all(part.points > 0 for question, part in every_part() if question.number not in CATALOGUE.warm_up)
    assert not set(CATALOGUE.warm_up) & set(CATALOGUE.questions)


def test_questions_are_asked_in_the_notebooks_of_their_section():
    assert [name[:2] for name in CATALOGUE.notebooks] == [f"{number:02}" for number in range(12)]
    notebook_of_section = {}
    for question in CATALOGUE.everything.values():
        if question.number not in CATALOGUE.reports:
            assert notebook_of_section.setdefault(question.section, question.notebook) == question.notebook


def test_tables_carry_over_answers_of_the_same_kind_unit_and_shape():
    for table in CATALOGUE.tables.values():
        for entry in table.parts:
            source = CATALOGUE.find(entry.shows[0]).part(entry.shows[1])
            assert (entry.kind, entry.unit, entry.shape) == (source.kind, source.unit, source.shape)
    assert len(CATALOGUE.tables["Table 2"].parts) == 7
    assert len(CATALOGUE.tables["Table 3"].parts) == 5 + 3 + 4 + 4


def test_report_items_show_answers_that_exist_and_their_text_can_be_answered():
    for item in CATALOGUE.report_items:
        for number, name in item.shows:
            assert not name or CATALOGUE.find(number).part(name)
        if item.part:
            assert CATALOGUE.reports[item.report].part(item.part).outcome in item.outcomes


def test_report_rows_are_those_of_the_scoring_sheets():
    rows = {name: [one.number for one in CATALOGUE.report_items if one.report == name] for name in CATALOGUE.reports}
    formats = ["Format.1", "Format.2"]
    assert rows["Modeling report"] == ["I.1", "I.2", "I.3", "II.1", "II.2", "II.3", "III.1", "III.2", "IV.1", *formats]
    numbers = [(part, n) for part, count in (("I", 4), ("II", 5), ("III", 7), ("IV", 4)) for n in range(1, count + 1)]
    assert rows["Control report"] == [*(f"{part}.{n}" for part, n in numbers), *formats]


def test_the_workbooks_own_results_are_plausible():
    # What the workbook prints must not draw a hint.
    printed = {
        ("2.11", "omega_n"): 19.9,
        ("2.12", "J_l"): 3.28e-3,
        ("2.12", "K_s"): 1.3,
        ("3.14", "t_s"): 0.43,
        ("3.14", "PO"): 0.0,
        ("3.16", "alpha_max_deg"): 10.2,
        ("3.12", "V_max"): 8.6,
        ("0.1", "resolution"): 2 * np.pi / 4096,
    }
    for (number, name), value in printed.items():
        lowest, highest = CATALOGUE.find(number).part(name).plausible
        assert lowest <= value <= highest
