"""A notebook that is written as text: its cells, names, metadata and points."""

from ast import literal_eval
from dataclasses import replace

import nbformat
import pytest
from made_courses import OURS

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, number, prose
from labcourse.errors import GradingError
from labcourse.grading.release import percent, student_notebooks

CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01_tank", "Flow", (), (number("q", "m³/s", None, "", ""), prose("why", "", ""))),
        Question("1.10", "1", "01_tank", "Both", (), tuple(number(name, "", None, "", "", 2) for name in "ab")),
    ],
    tables=[Question("Table 1", "1", "01_tank", "All", (), (number("q_max", "m³/s", None, "", ""),))],
)
COURSE = replace(
    OURS, catalogue=CATALOGUE, imports=("tanklab.lab",), parameters={"bench": "virtual", "room": 'Mach\'s "lab"'}
)
TEXT = """\
# %% [markdown]
# # A tank

# %% tags=["illustration"]
# %matplotlib inline
print("water")

# %% [markdown]
# How much?

# %% [markdown]
# And why?

# %% words 1.1 why [markdown]
# It *falls*.

# %% answer 1.1
q = 2.5e-4

# %% answer 1.10 a
def twice(x):
    ### BEGIN SOLUTION
    return 2 * x
    ### END SOLUTION
a = twice(2)

# %% answer 1.10 b
b = 3

# %% answer Table 1
q_max = q

# %% [markdown]
# That is all.
"""


@pytest.fixture(scope="module")
def made():
    notebook = percent.notebook(TEXT, "01_tank.py", COURSE)
    nbformat.validate(notebook)
    return {cell.id: cell for cell in notebook.cells}


def test_cells_have_names_that_do_not_depend_on_how_many_there_are_before(made):
    assert [*made] == [
        *("title", "parameters", "setup", "q1-1-why-code", "q1-1-why-text", "q1-1-why-text-2", "q1-1-why"),
        *("q1-1", "q1-1-answer", "q1-10-a", "q1-10-a-answer", "q1-10-b", "q1-10-b-answer"),
        *("table-1", "table-1-answer", "end-text"),
    ]


def test_what_records_an_answer_is_made_of_the_catalogue(made):
    recorded = {name: cell.source for name, cell in made.items() if name.endswith("-answer")}
    assert recorded == {
        "q1-1-answer": 'lab.answer("1.1", q=q)',
        "q1-10-a-answer": 'lab.answer("1.10", a=a)',
        "q1-10-b-answer": 'lab.answer("1.10", b=b)',
        "table-1-answer": 'lab.answer("Table 1", q_max=q_max)',
    }
    assert {
        name: cell.metadata.nbgrader.points for name, cell in made.items() if student_notebooks.is_answer(cell)
    } == {**{"q1-1-why": 1, "q1-1": 1, "q1-10-a": 2, "q1-10-b": 2, "table-1": 1}}


def test_the_student_gets_what_is_not_solved(made):
    notebook = percent.notebook(TEXT, "01_tank.py", COURSE)
    students = {cell.id: cell for cell in student_notebooks.student_version(notebook, "01_tank", CATALOGUE).cells}
    assert students["q1-1"].source.splitlines()[1:] == ["q = None  # m³/s", "# Your code here."]
    assert students["q1-10-a"].source.splitlines()[1:] == ["def twice(x):", "    # Your code here.", "a = twice(2)"]
    assert words.where_of(students["q1-1-why"]) == ("1.1", "why") and "falls" not in students["q1-1-why"].source
    assert students["parameters"].source.startswith('student = ""\nbench = "virtual"\n')
    assert literal_eval(students["parameters"].source.rpartition("= ")[2]) == COURSE.parameters["room"]
    assert students["setup"].source.endswith("lab = tanklab.lab.start(student)")
    code = students["q1-1-why-code"]
    assert code.source.startswith("%matplotlib inline") and code.metadata.tags == ["illustration"]
    assert code.metadata.nbgrader.locked and code.metadata.nbgrader.grade_id == code.id


@pytest.mark.parametrize("title", ["answer 1.2", "answer 1.1 r", "answer", "words 1.1 why"])
def test_a_cell_that_answers_what_there_is_not_is_refused(title):
    with pytest.raises(GradingError, match=r"01_tank\.py"):
        percent.notebook(f"# %% {title}\nq = 1\n", "01_tank.py", COURSE)


def test_a_notebook_is_made_anew_only_where_its_text_gives_another(tmp_path):
    course = replace(COURSE, folder=tmp_path)
    (tmp_path / "01_tank.py").write_text(TEXT, encoding="utf-8")
    (tmp_path / "key.py").write_text("KEY = {}")
    path = tmp_path / "01_tank.ipynb"
    assert list(percent.outdated(course)) == [path]
    percent.write(course)
    run = nbformat.read(path, as_version=4)
    run.cells[3].outputs = [nbformat.v4.new_output("stream", text="water")]
    nbformat.write(run, path)
    before = path.read_bytes()
    percent.write(course)
    assert path.read_bytes() == before and not percent.outdated(course)
    (tmp_path / "01_tank.py").write_text(TEXT.replace("# A tank", "# Two tanks"), encoding="utf-8")
    assert list(percent.outdated(course)) == [path]


def test_the_cell_of_a_reports_authors_can_be_filled_in_and_is_no_answer():
    text = f"{TEXT}\n# %% front First report [markdown]\n# * **Authors:**\n"
    (cell,) = [cell for cell in percent.notebook(text, "01_tank.py", COURSE).cells if "front" in cell.id]
    assert cell.source == f"{words.heading('Your text: authors, captions and sources')}\n\n* **Authors:**"
    assert cell.metadata == {words.KEY: {"front": "First report"}, "tags": ["open"]}
