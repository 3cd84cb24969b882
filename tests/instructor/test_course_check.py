"""``rotflex check-course``: what is forgotten or contradicts itself is told, with its place."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass, replace
from typing import Any

import pytest
from checkout import ROOT
from made_courses import OURS

from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.parts import Question, number
from rotflex.instructor import course_check
from rotflex.instructor.course import Stated
from rotflex.instructor.course_check import solved
from rotflex.instructor.marking.checks import Number

pytestmark = pytest.mark.slow


def found(course, run=False):
    return [str(finding) for finding in course_check.check(course, run)]


def with_key(question, **checks):
    """This course with other checks of a question's parts."""
    return replace(OURS, key={**OURS.key, question: {**OURS.key[question], **checks}})


def test_this_course_is_whole():
    assert found(OURS) == []


# --- catalogue, key and cells -----------------------------------------------------------------------------------------


def another_question(notebook="02_finding_stiffness"):
    asked = Question("2.19", "2.3.1", notebook, "Period", (), (number("T", "s", None, "", "The period."),))
    catalogue = Catalogue([*OURS.catalogue.questions.values(), asked])
    rest = {one: checks for one, checks in OURS.key.items() if one in catalogue.everything}
    return replace(OURS, catalogue=catalogue, key=rest)


def test_a_question_that_was_only_put_into_the_catalogue_is_missed_in_key_and_cells():
    said = found(another_question())
    assert "the key: question 2.19 has no entry." in said
    assert "question 2.19, T: no cell of 02_finding_stiffness records it." in said


def test_a_question_of_a_notebook_that_is_not_there_is_told():
    assert "question 2.19: there is no notebook 02_nonsense." in found(another_question("02_nonsense"))


@pytest.fixture
def copy(tmp_path):
    """This course in a folder of its own, with its student notebooks."""
    shutil.copytree(ROOT / "solutions", tmp_path / "solutions", ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    shutil.copytree(ROOT / "notebooks", tmp_path / "notebooks", ignore=shutil.ignore_patterns("*.json"))
    return replace(OURS, folder=tmp_path / "solutions")


def edit(course, name, change):
    """Change the cells of a notebook, by id."""
    path = course.folder / name
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = {cell["id"]: cell for cell in notebook["cells"]}
    change(cells)
    notebook["cells"] = list(cells.values())
    path.write_text(json.dumps(notebook), encoding="utf-8")


STIFFNESS = "02_finding_stiffness.ipynb"


def test_a_cell_that_no_longer_records_is_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells.pop("q2-11-answer"))
    said = found(copy)
    assert (
        f"{STIFFNESS}, cell 'q2-11': an answer cell, but the cell after it records nothing (lab.answer(...))." in said
    )
    assert "question 2.11, omega_n: no cell of 02_finding_stiffness records it." in said


def test_a_cell_that_records_what_there_is_not_is_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells["q2-11-answer"].update(source='lab.answer("2.91", omega_n=omega_n)'))
    assert any("q2-11-answer" in line and "no question '2.91'" in line for line in found(copy))


# --- answers in words -------------------------------------------------------------------------------------------------

EXPLANATION = "q2-11-explanation"


def test_words_that_no_text_cell_asks_for_are_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells.pop(EXPLANATION))
    assert "question 2.11, explanation: no cell of 02_finding_stiffness records it." in found(copy)


def without(path, table):
    """A rubric without one of its tables."""
    text = path.read_text(encoding="utf-8")
    start = text.index(f"{table}\n")
    assert text.count(f"{table}\n") == 1
    path.write_text(text[:start] + text[text.index("\n[", start) + 1 :], encoding="utf-8")


def test_a_rubric_that_lacks_a_part_is_told(copy):
    without(copy.folder / "rubric.toml", '["2.11".explanation]')
    without(copy.folder / "rubric.toml", '["Control report, as a whole".organisation]')
    assert found(copy) == [
        'rubric.toml: ["2.11".explanation] is missing: a person marks it.',
        'rubric.toml: ["Control report, as a whole".organisation] is missing: a person marks it.',
    ]


def test_a_course_without_a_rubric_is_whole(copy):
    (copy.folder / "rubric.toml").unlink()
    assert found(copy) == []


def test_a_map_to_outcomes_and_sheets_that_cannot_be_used_are_told(copy):
    for name, old, new in (("outcomes.toml", "GS-2 =", "GS-3 ="), ("sheets.toml", '"2.10"', '"2.99"')):
        path = copy.folder / name
        path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    told = " ".join(found(copy))
    assert "codes.GS-3: the course has no such code" in told and "there is no question '2.99'" in told


def test_what_carries_a_code_and_is_on_no_sheet_is_told(copy):
    path = copy.folder / "sheets.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"II.3" = ["2.18"]', ""), encoding="utf-8")
    assert found(copy) == ["sheets.toml: 2.18, poles: it carries K-1, and is on no sheet."]


def test_a_course_without_map_and_sheets_is_whole(copy):
    (copy.folder / "outcomes.toml").unlink()
    (copy.folder / "sheets.toml").unlink()
    assert found(copy) == []


def test_a_report_as_a_whole_without_a_key_is_told():
    number = "Modeling report, as a whole"
    key = {one: checks for one, checks in OURS.key.items() if one != number}
    assert found(replace(OURS, key=key)) == [f"the key: question {number} has no entry."]


def test_words_that_a_cell_with_code_records_as_well_are_told(copy):
    def change(cells):
        cells["q2-11-answer"]["source"] = 'lab.answer("2.11", omega_n=omega_n, explanation=None)'

    edit(copy, STIFFNESS, change)
    places = "; ".join(f"{STIFFNESS}, cell '{cell}'" for cell in (EXPLANATION, "q2-11-answer"))
    assert f"question 2.11, explanation: 2 cells record it: {places}." in found(copy)


@pytest.mark.parametrize(
    ("about", "told"),
    [
        ({"question": "2.91", "part": "explanation"}, "There is no question '2.91'."),
        ({"question": "2.11", "part": "reason"}, "Question 2.11 has no part 'reason'; it has omega_n, explanation."),
        ({"question": "2.11", "part": "omega_n"}, "omega_n is no answer in words, but of kind number."),
        ({"question": "2.16", "part": "comparison"}, "it records question 2.16, which the catalogue has in 03_"),
        ({}, 'its metadata should have "rotflex": {"question": ..., "part": ...}.'),
    ],
    ids=["question", "part", "kind", "notebook", "nothing"],
)
def test_a_text_cell_for_what_there_is_not_is_told(copy, about, told):
    edit(copy, STIFFNESS, lambda cells: cells[EXPLANATION]["metadata"].update(rotflex=about))
    assert any(line.startswith(f"{STIFFNESS}, cell '{EXPLANATION}': {told}") for line in found(copy))


def test_a_text_cell_without_a_heading_or_with_anothers_is_told(copy):
    def change(cells):
        cells[EXPLANATION]["source"] = cells[EXPLANATION]["source"][1:]

    edit(copy, STIFFNESS, change)
    assert any("it should begin with one heading for students" in line for line in found(copy))

    def double(cells):
        cells["q2-5-strategy"]["source"][0] = cells["q2-4-strategy"]["source"][0]

    edit(copy, "01_modeling_prelab.ipynb", double)
    assert "01_modeling_prelab.ipynb, cell 'q2-5-strategy': it has the heading of cell 'q2-4-strategy', too." in found(
        copy
    )


def test_a_model_answer_in_a_cell_that_is_no_answer_cell_is_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells[EXPLANATION]["metadata"]["nbgrader"].update(solution=False))
    assert (
        f"{STIFFNESS}, cell '{EXPLANATION}': it has a solution, but its metadata do not make it an answer cell."
        in found(copy)
    )


def test_a_model_answer_that_is_not_there_is_missed(copy, sandbox):
    def empty(cells):
        cells[EXPLANATION]["source"][2:] = ["<!-- BEGIN SOLUTION -->\n", "<!-- END SOLUTION -->"]

    edit(copy, STIFFNESS, empty)
    assert "the key, 2.11 explanation: the solution records no answer: does its cell run to its end?" in found(
        copy, run=True
    )


def test_a_part_that_is_recorded_twice_and_one_that_is_not_are_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells["q2-12-answer"].update(source='lab.answer("2.11", omega_n=K_s)'))
    said = found(copy)
    assert any(line.startswith("question 2.11, omega_n: 2 cells record it") for line in said)
    assert "question 2.12, K_s: no cell of 02_finding_stiffness records it." in said


def test_student_notebooks_that_are_out_of_step_are_told(copy):
    edit(copy, STIFFNESS, lambda cells: cells["title"].update(source="# Another title"))
    assert found(copy) == [f"notebooks/{STIFFNESS}: it is not what is derived now: say rotflex notebooks."]


def test_points_of_the_catalogue_reach_the_derived_notebooks():
    q = OURS.catalogue.find("2.11")
    dearer = replace(q, parts=(replace(q.parts[0], points=7), *q.parts[1:]))
    catalogue = Catalogue(
        [dearer if one.number == "2.11" else one for one in OURS.catalogue.questions.values()],
        warm_up=OURS.catalogue.warm_up.values(),
        tables=OURS.catalogue.tables.values(),
        report_items=OURS.catalogue.report_items,
        reports={one.number: (one.section, one.notebook, one.title) for one in OURS.catalogue.reports.values()},
        outcomes=OURS.catalogue.outcomes,
    )
    assert found(replace(OURS, catalogue=catalogue)) == [
        f"notebooks/{STIFFNESS}: it is not what is derived now: say rotflex notebooks."
    ]


def test_a_name_that_is_not_preset_is_told(copy):
    def forget(cells):
        kept = [line for line in cells["q2-12"]["source"] if not line.startswith("J_l")]
        assert len(kept) < len(cells["q2-12"]["source"])
        cells["q2-12"]["source"] = ["### BEGIN SOLUTION\n", "J_l, K_s = 1, 2\n", "### END SOLUTION"]

    edit(copy, STIFFNESS, forget)
    said = found(copy)
    assert (
        f"{STIFFNESS}, cell 'q2-12-answer': J_l is not there until a solution is written: preset it, as J_l = None."
        in said
    )


def test_a_solution_outside_of_an_answer_cell_and_a_missing_tag_are_told(copy):
    def change(cells):
        cells["q2-12"]["metadata"]["nbgrader"]["solution"] = False
        cells["parameters"]["metadata"]["tags"] = []

    edit(copy, STIFFNESS, change)
    said = found(copy)
    assert f"{STIFFNESS}, cell 'q2-12': it has a solution, but its metadata do not make it an answer cell." in said
    assert any(line.startswith(f"{STIFFNESS}: 0 cells are tagged 'parameters'") for line in said)


def test_follow_through_that_feedback_cannot_name_is_told():
    course = with_key("2.11", omega_n=Number("it", lambda bench: bench.omega_n, 0.05, follow=lambda own: 1.0))
    assert found(course) == ["the key, 2.11 omega_n: it has follow, and no follow_what: what feedback says of it."]


@pytest.mark.parametrize(("words", "told"), [("your own poles", 0), ("", 1)])
def test_where_an_answer_may_follow_from_several_each_needs_its_words(words, told):
    @dataclass(frozen=True)
    class Several(Number):
        follow: Any = (("your own model", lambda own: 1.0), (words, lambda own: 1.0))

    course = with_key("2.11", omega_n=Several("it", lambda bench: bench.omega_n, 0.05))
    assert sum("no follow_what" in line for line in found(course)) == told


# --- numbers in texts -------------------------------------------------------------------------------------------------


def test_each_number_that_texts_repeat_is_missed_when_it_changes():
    changed = [replace(one, what=f"number {n}", value=one.value + 1) for n, one in enumerate(OURS.stated)]
    said = found(replace(OURS, stated=changed))
    for one in changed:
        assert any(f"{one.what} is {one.value:g}; this text says" in line for line in said), one.pattern
    assert all("this text says" in line for line in said)


def test_a_pattern_that_no_text_has_is_told():
    (said,) = found(replace(OURS, stated=[Stated("the answer", r"the answer is (\d+)", 42)]))
    assert said.startswith("stated, the answer: no text has it as")


# --- the key, on the solutions ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def claims(sandbox):
    return solved.answers_of_solutions(OURS)


def judged(course, claims):
    return [str(finding) for finding in solved.judged(course, claims)]


def test_the_solutions_earn_all_and_wrong_answers_nothing(claims):
    assert claims.problems == []
    assert judged(OURS, claims) == []


def omega_n(expected, **others):
    return with_key("2.11", omega_n=Number("it", expected, **{"rtol": 0.05, **others}))


@pytest.mark.parametrize(
    ("course", "words"),
    [
        (omega_n(lambda bench: 2 * bench.omega_n), "the solution gets 0 of 2 points, wrong"),
        (omega_n(lambda bench: bench.omega), "it fails: AttributeError"),
        (omega_n(lambda bench: bench.omega_n, rtol=0.9), "is taken for right"),
        (omega_n(lambda bench: bench.omega_n, slips=lambda bench: {"x": bench.nothing}), "on a wrong answer, it fails"),
        (omega_n(lambda bench: bench.omega_n, follow=lambda own: nobody), "it fails: NameError"),  # noqa: F821
        (omega_n(lambda bench: bench.omega_n, follow=lambda own: own("2.91", "x")), "follows what there is not"),
    ],
    ids=["expected", "lambda", "too wide", "slip", "follow-through", "no such question"],
)
def test_a_slip_in_the_key_is_told_with_its_question(course, words, claims):
    (said,) = [line for line in judged(course, claims) if line.startswith("the key, 2.11 omega_n: ")]
    assert words in said
