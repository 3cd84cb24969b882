"""``rotflex check-course``: what is forgotten or contradicts itself is told, with its place."""

import json
import shutil
from copy import copy
from dataclasses import replace

import pytest
from checkout import ROOT
from made_courses import OURS, WITH_OPTIONAL

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, number
from labcourse.grading import course_check
from labcourse.grading.course import StatedNumber
from labcourse.grading.marking.checks import Number
from labcourse.grading.running import bundle

pytestmark = pytest.mark.slow


def places(course):
    return [finding.where for finding in course_check.check(course, run=False)]


def test_this_course_is_whole():
    assert places(WITH_OPTIONAL) == []


STIFFNESS, MODELING, VALIDATION = (
    f"{name}.ipynb" for name in ("02_finding_stiffness", "01_modeling_prelab", "03_model_validation")
)
EXPLANATION = "q2-11-explanation"


def another_question(notebook="02_finding_stiffness"):
    asked = Question("2.19", "2.3.1", notebook, "Period", (), (number("T", "s", None, "", "The period."),))
    catalogue = Catalogue([*OURS.catalogue.questions.values(), asked])
    rest = {one: checks for one, checks in OURS.key.items() if one in catalogue.everything}
    return replace(OURS, catalogue=catalogue, key=rest)


def dearer_question():
    asked = OURS.catalogue.find("2.11")
    dearer = replace(asked, parts=(replace(asked.parts[0], points=7), *asked.parts[1:]))
    catalogue = copy(OURS.catalogue)
    for name in ("questions", "everything", "marked"):
        setattr(catalogue, name, {**getattr(catalogue, name), "2.11": dearer})
    return replace(OURS, catalogue=catalogue)


def test_a_question_that_was_only_put_into_the_catalogue_is_missed_in_key_and_cells():
    assert {"question 2.19, T", "the key"} <= set(places(another_question()))
    elsewhere = course_check.check_cells(another_question("02_nonsense"))
    assert "question 2.19" in {finding.where for finding in elsewhere}


def test_an_outcome_that_the_catalogue_does_not_have_is_missed_in_questions_and_in_parts():
    of_question, of_part, known = (
        Question(place, "2.3.1", "02_finding_stiffness", "Period", outcomes, (number("T", "s", None, outcome, ""),))
        for place, outcomes, outcome in (("2.19", ("x",), ""), ("2.20", (), "x"), ("2.21", ("a",), "a"))
    )
    catalogue = Catalogue([of_question, of_part, known], outcomes={"a": "to analyse"})
    found = [finding.where for finding in course_check.check_files(replace(OURS, catalogue=catalogue))]
    assert [where for where in found if where.startswith("question")] == ["question 2.19", "question 2.20"]


def test_what_catalogue_key_and_numbers_forget_is_reported_with_its_place():
    without = {one: checks for one, checks in OURS.key.items() if one != "Modeling report, as a whole"}
    key = {number: OURS.key[number] for number in without}
    stated = [StatedNumber("the answer", r"the answer is (\d+)", 42)]
    course = replace(dearer_question(), key=key, stated=stated)
    assert places(course) == ["the key", f"notebooks/{STIFFNESS}", "stated, the answer"]


@pytest.fixture
def copied(tmp_path):
    """A copy of this course, with its student notebooks."""
    for name in ("solutions", "notebooks"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    return replace(OURS, folder=tmp_path / "solutions")


def edit(course, name, change):
    path = course.folder / name
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = {cell["id"]: cell for cell in notebook["cells"]}
    change(cells)
    notebook["cells"] = list(cells.values())
    path.write_text(json.dumps(notebook), encoding="utf-8")


def without_heading(cells):
    cells[EXPLANATION]["source"] = cells[EXPLANATION]["source"][1:]


def same_heading(cells):
    cells["q2-5-strategy"]["source"][0] = cells["q2-4-strategy"]["source"][0]


def no_answer_cell(cells):
    cells["q2-12"]["metadata"]["nbgrader"]["solution"] = False
    cells[EXPLANATION]["metadata"]["nbgrader"].update(solution=False)
    cells["parameters"]["metadata"]["tags"] = []


def without(cell):
    return lambda cells: cells.pop(cell)


def recording(cell, source):
    return lambda cells: cells[cell].update(source=source)


def asking(cell, **about):
    return lambda cells: cells[cell]["metadata"].update(labcourse=about)


def in_cell(notebook, cell):
    return f"{notebook}, cell '{cell}'"


DERIVED = [f"notebooks/{MODELING}", f"notebooks/{STIFFNESS}"]
#: What is wrong in which notebooks, and the places of what is found.
SPOILT = {
    "recorded nowhere": (
        [(STIFFNESS, without("q2-11-answer")), (MODELING, without("q2-4-strategy"))],
        [in_cell(STIFFNESS, "q2-11"), "question 2.4, strategy", "question 2.11, omega_n", *DERIVED],
    ),
    "recorded twice, or for what there is not": (
        [
            (STIFFNESS, recording("q2-11-answer", 'lab.answer("2.11", omega_n=omega_n, explanation=None)')),
            (STIFFNESS, recording("q2-12-answer", 'lab.answer("2.11", omega_n=K_s)')),
            (MODELING, recording("q2-1-answer", 'lab.answer("2.91", V=V)')),
        ],
        [
            in_cell(MODELING, "q2-1-answer"),
            *("question 2.1, V", "question 2.11, omega_n", "question 2.11, explanation"),
            *("question 2.12, J_l", "question 2.12, K_s"),
        ],
    ),
    "text cells for no question, no part, a number, another notebook, nothing": (
        [
            (STIFFNESS, asking(EXPLANATION, question="2.91", part="explanation")),
            (MODELING, asking("q2-4-strategy", question="2.4", part="reason")),
            (MODELING, asking("q2-5-strategy", question="2.5", part="equation")),
            (VALIDATION, asking("q2-16-comparison", question="2.11", part="explanation")),
            (VALIDATION, asking("q2-17-reason")),
        ],
        [
            *(in_cell(MODELING, "q2-4-strategy"), in_cell(MODELING, "q2-5-strategy"), in_cell(STIFFNESS, EXPLANATION)),
            *(in_cell(VALIDATION, "q2-16-comparison"), in_cell(VALIDATION, "q2-17-reason")),
            *("question 2.4, strategy", "question 2.5, strategy", "question 2.5, equation"),
            *("question 2.16, comparison", "question 2.17, reason"),
        ],
    ),
    "headings": (
        [(STIFFNESS, without_heading), (MODELING, same_heading)],
        [in_cell(MODELING, "q2-5-strategy"), in_cell(STIFFNESS, EXPLANATION), *DERIVED],
    ),
    "solutions outside of answer cells, and a missing tag": (
        [(STIFFNESS, no_answer_cell)],
        [STIFFNESS, in_cell(STIFFNESS, EXPLANATION), in_cell(STIFFNESS, "q2-12"), "question 2.11, explanation"],
    ),
}


@pytest.mark.parametrize("what", SPOILT)
def test_what_is_wrong_in_notebooks_is_reported_with_its_place(copied, what):
    edits, expected = SPOILT[what]
    for notebook, spoil in edits:
        edit(copied, notebook, spoil)
    found = [one.where for one in (*course_check.check_cells(copied), *course_check.check_derived(copied))]
    assert [place for place in found if place != "the student notebooks"] == expected


def a_table(text, heading):
    """Return a table of a TOML file with its heading."""
    start = text.index(f"{heading}\n")
    return text[start : text.index("\n[", start) + 1]


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("rubric.toml", '["2.11".explanation]', None, '["2.11".explanation]'),
        ("outcomes.toml", "GS-2 =", "GS-3 =", "codes.GS-3"),
        ("sheets.toml", '"II.3" = ["2.18"]', "", "2.18, poles"),
        ("sheets.toml", '"2.10"', '"2.99"', "modeling_report.also"),
    ],
)
def test_what_is_wrong_in_rubric_map_and_sheets_is_reported(copied, name, old, new, said):
    path = copied.folder / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(a_table(text, old) if new is None else old, new or ""), encoding="utf-8")
    (finding,) = course_check.check_files(copied)
    assert finding.where == name and said in finding.what


def test_each_number_that_texts_repeat_is_missed_when_it_changes():
    changed = [replace(one, what=f"number {n}", value=one.value + 1) for n, one in enumerate(OURS.stated)]
    said = [str(finding) for finding in course_check.check_numbers(replace(OURS, stated=changed))]
    for one in changed:
        assert any(f"{one.what} is {one.value:g}; this text says" in line for line in said), one.pattern
    assert all("this text says" in line for line in said)


@pytest.fixture(scope="module")
def claims(sandbox):
    return course_check.answers_of_solutions(OURS, bundle.build(OURS))[0]


def judged(course, claims):
    return [str(finding) for finding in course_check.check_verdicts(course, claims, {})]


def test_the_solutions_earn_all_and_wrong_answers_nothing(claims):
    assert claims.problems == []
    assert judged(OURS, claims) == []


def omega_n(expected, **others):
    check = Number("it", expected, **{"rtol": 0.05, **others})
    return replace(OURS, key={"2.11": {**OURS.key["2.11"], "omega_n": check}})


@pytest.mark.parametrize(
    ("course", "said"),
    [
        (omega_n(lambda bench: 2 * bench.omega_n), "the solution gets 0 of 2 points"),
        (omega_n(lambda bench: bench.omega), "it fails: AttributeError: 'TrueBench' object has no attribute 'omega'"),
        (omega_n(lambda bench: bench.omega_n, rtol=0.9), "a wrong answer ("),
        (
            omega_n(lambda bench: bench.omega_n, follow=lambda own: own("2.11", "omega_n"), follow_rtol=0.9),
            "a wrong answer (",
        ),
        (omega_n(lambda bench: bench.omega_n, slips=lambda bench: {"x": bench.nothing}), "on a wrong answer, it fails"),
        (omega_n(lambda bench: bench.omega_n, follow=lambda own: nobody), "what follows from right answers fails"),  # noqa: F821
        (omega_n(lambda bench: bench.omega_n, follow=lambda own: own("2.91", "x")), "it uses an answer that"),
    ],
    ids=["expected", "lambda", "too wide", "follows too widely", "slip", "follow-through", "no such question"],
)
def test_a_slip_in_the_key_is_reported_with_its_question(claims, course, said):
    (found,) = [line for line in judged(course, claims) if "2.11 omega_n" in line]
    assert found.startswith(f"the key, 2.11 omega_n: {said}")
