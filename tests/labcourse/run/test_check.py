"""What a check at home finds in a student's folder, and how it says so. The kernels are real."""

import copy
import json
import os
import time

import pytest
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse.answers.answers import AnswerBook
from labcourse.run import commands
from labcourse.run.check import State, check
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed

pytestmark = pytest.mark.slow

SETUP = locked(
    "setup", "import numpy as np\nimport rotflex.course.lab\nlab = rotflex.course.lab.start(student, quiet=True)"
)
PARAMETERS = code("parameters", 'student = ""', ["parameters"])


def words(name, question, part):
    metadata = {"nbgrader": {**ANSWER, "grade_id": name, "cell_type": "markdown"}}
    return {
        "cell_type": "markdown",
        "id": name,
        "metadata": {**metadata, "labcourse": {"question": question, "part": part}},
        "source": "**✎ Your answer**",
    }


MASTERS = {
    "01_swing.ipynb": notebook(
        text("title", "# Swing"),
        PARAMETERS,
        SETUP,
        words("why", "2.11", "explanation"),
        answer("q1", "omega_n = None\n# Your code here."),
        locked("q1-answer", 'lab.answer("2.11", omega_n=omega_n)'),
        answer("q2", "J_l = None\nK_s = None\n# Your code here."),
        locked("q2-answer", 'lab.answer("2.12", J_l=J_l, K_s=K_s)'),
    ),
    "02_later.ipynb": notebook(
        PARAMETERS,
        SETUP,
        answer("q3", "resolution = None\n# Your code here."),
        locked("q3-answer", 'lab.answer("0.1", resolution=resolution)'),
    ),
}
GOOD = {"q1": "omega_n = 20.0", "q2": "J_l = 0.004\nK_s = J_l * omega_n**2", "q3": "resolution = 0.0015"}
RECORDED = {"2.11": {"omega_n": 20.0}, "2.12": {"J_l": 0.004, "K_s": 1.6}, "0.1": {"resolution": 0.0015}}


def put(folder, sources, masters=MASTERS):
    for name, master in masters.items():
        own = copy.deepcopy(master)
        for cell in own["cells"]:
            cell["source"] = sources.get(cell["id"], cell["source"])
        (folder / name).write_bytes(saved(own))
    (folder / "course.json").write_text('{"student": "ada"}')


def recorded_at_home(folder, recorded, cells=None, clock=time.time):
    book = AnswerBook(folder / "answers.json", "ada", {}, student_seed("ada"), clock)
    for question, parts in recorded.items():
        for part, value in parts.items():
            cell = {"2.11": "q1-answer", "2.12": "q2-answer", "0.1": "q3-answer"}[question]
            book.answer(CATALOGUE.find(question), {part: value}, (cells or {}).get((question, part), cell))


def edit(path, change):
    own = json.loads(path.read_bytes())
    change(own["cells"])
    path.write_bytes(saved(own))


def states(checked):
    return {(part.question, part.name): part.state for part in checked.parts}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


def test_all_that_is_there_is_found_with_helper_cells_own_files_and_words(folder):
    put(folder, {**GOOD, "q1": "omega_n = helper.double(half)", "why": "**✎ Your answer**\n\nWhere it swings *most*."})
    edit(folder / "01_swing.ipynb", lambda cells: cells.insert(4, code("mine", "import helper\nhalf = 10.0")))
    (folder / "helper.py").write_text("def double(x):\n    return 2 * x\n")
    recorded_at_home(folder, RECORDED, clock=lambda: 0)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    told = []
    found = check(folder, MASTERS, CATALOGUE, report=lambda *about: told.append(about))
    recorded = [(question, part) for question, parts in RECORDED.items() for part in parts]
    assert states(found) == {("2.11", "explanation"): State.WRITTEN, **dict.fromkeys(recorded, State.RECORDED)}
    assert found.good and (found.stops, found.lost, found.problems, found.notes) == ((), (), (), ())
    said = list(commands.lines(found))
    assert "All there: 3 questions." in said
    assert said[-2:] == ["  01_swing  all there", "  02_later  all there"]
    assert told[-1][0] == "02_later.ipynb"
    assert {path: path.read_bytes() for path in folder.iterdir()} == before  # nothing of the student's is touched


def test_what_stopped_and_what_builds_on_it_is_told_and_no_value_is(folder):
    put(folder, {**GOOD, "q1": "omega = 20.0\nomega_n = omgea"})
    recorded_at_home(folder, RECORDED, clock=lambda: 0)
    edit(folder / "01_swing.ipynb", lambda cells: cells[2].update(source="import cmath"))
    edit(folder / "01_swing.ipynb", lambda cells: cells.pop(0))
    found = check(folder, MASTERS, CATALOGUE)
    assert not found.good
    assert states(found)["2.11", "omega_n"] is State.MISSING
    assert states(found)["2.12", "K_s"] is State.MISSING
    assert states(found)["2.11", "explanation"] is State.EMPTY
    said = "\n".join(commands.lines(found))
    assert "1 of 3 questions are all there; 2 with something to look at." in said
    assert "2.11 stopped: NameError, name 'omgea' is not defined, line 2; 2.12 builds on it." in said
    assert "2.11  explanation: empty" in said
    assert "01_swing.ipynb: of the course's cells, changed: setup; deleted: title." in said
    assert 'lab.restore("01")' in said
    assert not {"20.0", "0.004", "0.0015", "1.6"} & set(said.replace(str(folder), "").split())


def test_an_answer_other_than_on_the_page_and_a_notebook_that_was_not_saved_since_are_told(folder):
    put(folder, {**GOOD, "q1": "omega_n = 21.0", "q2": ""})
    recorded_at_home(folder, RECORDED)
    then = time.time() - 3600
    os.utime(folder / "01_swing.ipynb", (then, then))
    found = check(folder, MASTERS, CATALOGUE)
    assert states(found)["2.11", "omega_n"] is State.DIFFERENT
    said = "\n".join(commands.lines(found))
    assert "2.11  omega_n: recorded, but other than on your page" in said
    assert "Restart Kernel and Run All Cells" in said
    assert len(found.unsaved) == 1 and "01_swing.ipynb was saved before 2.1" in said
    assert "2.12 stopped: NameError, name 'J_l' is not defined" in said


def test_an_explorers_button_and_a_cell_deleted_since_are_told_as_such(folder):
    put(folder, {**GOOD, "q2": "J_l = K_s = None"})
    recorded_at_home(folder, RECORDED, {("2.12", "J_l"): "", ("2.12", "K_s"): "deleted-cell"}, lambda: 0)
    found = check(folder, MASTERS, CATALOGUE)
    said = "\n".join(commands.lines(found))
    assert "by the button of an explorer" in said
    assert "the cell that did it, deleted-cell, is no longer in 01_swing.ipynb" in said
    assert not found.stops


def test_a_notebook_that_is_missing_or_broken_and_one_that_ends_python_are_told(folder):
    put(folder, {**GOOD, "q1": "omega_n = 20.0\nexit()"})
    (folder / "02_later.ipynb").rename(folder / "02_later (1).ipynb")
    found = check(folder, MASTERS, CATALOGUE)
    assert not found.good
    said = "\n".join(commands.lines(found))
    assert "02_later.ipynb is not there. (Is it 02_later (1).ipynb?" in said
    assert "2.11 stopped: it called exit(), which ends Python" in said
    assert "02_later  nothing yet" in said
    assert "There is no answers.json here" in said and "That costs no points" in said
    (folder / "02_later.ipynb").write_text("<html>")
    assert any(
        "02_later.ipynb cannot be read: it is not JSON" in one for one in check(folder, MASTERS, CATALOGUE).problems
    )


def test_a_module_that_the_course_does_not_bring_is_told_and_one_that_is_not_there(folder, monkeypatch):
    # nbval is installed for tests only; no course brings it.
    put(folder, {**GOOD, "q1": "import nbval, scipy, helper\nomega_n = 20.0", "q2": "import nowhere_to_be_found"})
    (folder / "helper.py").write_text("import json\n")
    found = check(folder, MASTERS, CATALOGUE)
    said = "\n".join(commands.lines(found))
    foreign = [line for line in said.splitlines() if "does not come with the course" in line]
    assert len(foreign) == 1 and "nbval" in foreign[0]
    assert any("nowhere_to_be_found" in line and "not installed here" in line for line in said.splitlines())


def test_what_works_at_home_only_is_told_before_handing_in(folder):
    elsewhere = folder.parent / "curve.npz"
    elsewhere.touch()
    newer = "try:\n    omega_n = 20.0\nexcept* ValueError:\n    pass"
    put(folder, {**GOOD, "q1": newer, "q3": f"open({str(elsewhere)!r}).close()\nresolution = 0.0015"})
    (folder / "course.json").write_text('{"student": "ada", "python": "3.10"}')
    found = check(folder, MASTERS, CATALOGUE)
    (problem,) = found.problems
    assert not found.good and all(one in problem for one in ("01_swing.ipynb", "3.10", "Exception groups"))
    assert any("02_later.ipynb" in note and str(elsewhere) in note for note in found.notes)
    (folder / "course.json").write_text('{"student": "ada", "python": "3.11"}')
    assert check(folder, MASTERS, CATALOGUE).problems == ()


def test_another_students_answers_are_not_compared_with(folder):
    put(folder, GOOD)
    recorded_at_home(folder, RECORDED)
    found = check(folder, MASTERS, CATALOGUE, student="bob")
    assert found.student == "bob"
    assert "answers.json has the answers of 'ada', and is not compared with." in found.notes


def test_what_nobody_has_begun_is_empty_and_not_told_to_build_on_others(folder):
    masters = copy.deepcopy(MASTERS)
    later = masters["02_later.ipynb"]["cells"]
    later[1]["source"] += '\nomega_n = lab.value("2.11", "omega_n", None)\nJ_l = lab.value("2.12", "J_l")'
    put(folder, {}, masters)
    found = check(folder, masters, CATALOGUE)
    assert set(states(found).values()) == {State.EMPTY}
    said = list(commands.lines(found))
    assert "0 of 3 questions are all there; 3 empty." in said
    assert "  01_swing  nothing yet" in said and "  02_later  nothing yet" in said
    # Begun, it is told.
    put(folder, {"q3": "resolution = J_l"}, masters)
    found = check(folder, masters, CATALOGUE)
    assert states(found)["0.1", "resolution"] is State.MISSING
