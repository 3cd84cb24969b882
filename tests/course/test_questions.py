"""The catalogue against the workbook: numbers, sections, outcome codes."""

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


def test_all_35_questions_are_there_in_order_with_the_workbooks_sections_and_outcomes():
    every_class = CATALOGUE.without(CATALOGUE.optional)
    catalogue = [(q.number, (q.section, " ".join(q.outcomes))) for q in every_class.questions.values()]
    assert catalogue == list(WORKBOOK.items())
    assert len(catalogue) == 35


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
