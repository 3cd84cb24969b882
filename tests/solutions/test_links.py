"""Links in the notebooks: each question and notebook that a text names has one, and each leads somewhere."""

import json
import re

import link_questions
import pytest
from made_courses import WITH_OPTIONAL

from labcourse.grading.release import student_course, student_notebooks

NAMES = [path.stem for path in WITH_OPTIONAL.notebooks]
LINK = re.compile(r"\]\((\d\d_\w+\.ipynb)?(?:#([^)\s]+))?\)")
PLACES = link_questions.places_of({path.stem: student_notebooks.read(path) for path in WITH_OPTIONAL.notebooks})


def texts(notebook):
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "markdown"]


STUDENTS = {name: json.loads(text) for name, text in student_course.derive_notebooks(WITH_OPTIONAL).items()}


@pytest.mark.parametrize("name", NAMES)
def test_each_question_and_notebook_that_is_named_has_a_link(name):
    for text in texts(STUDENTS[f"{name}.ipynb"]):
        assert link_questions.linked(text, name, PLACES) == text


def test_each_link_leads_to_a_heading_that_is_there():
    headings = {
        name: {line.lstrip("# ").replace(" ", "-") for text in texts(notebook) for line in text.split("\n")}
        | {f"cell-id={cell['id']}" for cell in notebook["cells"]}
        for name, notebook in STUDENTS.items()
    }
    links = [
        (here, link) for here, notebook in STUDENTS.items() for text in texts(notebook) for link in LINK.findall(text)
    ]
    assert len(links) > 60
    for here, (there, heading) in links:
        assert there in (*headings, "") and (not heading or heading in headings[there or here]), (here, there, heading)


def test_a_notebook_that_is_not_handed_out_has_no_link():
    text = "In [`02_a`](02_a.ipynb), question [2.11](02_a.ipynb#Question-2.11); [`03_b`](03_b.ipynb)"
    assert student_notebooks.without_links(text, ["02_a", "01"]) == "In `02_a`, question 2.11; [`03_b`](03_b.ipynb)"
