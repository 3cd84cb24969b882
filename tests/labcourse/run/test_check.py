"""What a check at home finds in a student's folder, and how it says so. The kernels are real."""

import copy
import json
from pathlib import Path

import pytest
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse.answers.answers import AnswerBook
from labcourse.run import commands
from labcourse.run.check import Checked, Part, State, check
from labcourse.run.portability import HERE, version_text
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


def recorded_at_home(folder, recorded, cells=None):
    book = AnswerBook(folder / "answers.json", "Ada", {}, student_seed("ada"))
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
    recorded_at_home(folder, RECORDED)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    begun = []
    found = check(folder, MASTERS, CATALOGUE, report=begun.append)
    recorded = [(question, part) for question, parts in RECORDED.items() for part in parts]
    assert states(found) == {("2.11", "explanation"): State.WRITTEN, **dict.fromkeys(recorded, State.RECORDED)}
    assert found.good and (found.advice, found.notes) == ((), ())
    assert found.summary == "All there: 3 questions." and begun == list(MASTERS)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before  # nothing of the student's is touched


def test_what_stopped_and_what_builds_on_it_is_told_and_no_value_is(folder):
    put(folder, {**GOOD, "q1": "omega = 20.0\nomega_n = omgea"})
    recorded_at_home(folder, RECORDED)
    edit(folder / "01_swing.ipynb", lambda cells: cells[2].update(source="import cmath"))
    edit(folder / "01_swing.ipynb", lambda cells: cells.pop(0))
    found = check(folder, MASTERS, CATALOGUE)
    missing = {where for where, state in states(found).items() if state is State.MISSING}
    assert missing == {("2.11", "omega_n"), ("2.12", "J_l"), ("2.12", "K_s")} and not found.good
    assert states(found)["2.11", "explanation"] is State.EMPTY
    assert found.summary == "1 of 3 questions are all there."
    assert found.stops == ("2.11 stopped: NameError, name 'omgea' is not defined, line 2; 2.12 builds on it.",)
    (changes,) = [note for note in found.notes if "restore" in note]
    assert "changed: setup; deleted: title." in changes and 'lab.restore("01")' in changes
    said = "\n".join(commands.lines(found))
    assert "    2.11 explanation: empty" in said
    (loss,) = [line for line in said.splitlines() if "omgea" in line]  # told once, with all that it costs
    assert loss.endswith(
        "2.11 omega_n; 2.12 J_l, K_s: not recorded. 2.11 stopped: NameError, name 'omgea' is not defined, line 2."
    )
    assert not {"20.0", "0.004", "0.0015", "1.6"} & set(said.replace(str(folder), "").split())


def test_what_is_said_fits_a_screen_and_says_how_to_see_the_rest():
    parts = [
        Part(f"{n:02}_x.ipynb", f"{n}.{m}", "a", State.MISSING, f"It took {n}.{m} s.")
        for n in range(9)
        for m in range(5)
    ]
    parts += [Part("09_x.ipynb", "9.1", "a", State.EMPTY), Part("10_x.ipynb", "10.1", "a", State.RECORDED)]
    checked = Checked("ada", Path("work"), tuple(parts), notes=tuple(f"Note {n}." for n in range(9)))
    said = [*commands.lines(checked)]
    assert len(said) <= 36 and sum("check --everything" in line for line in said) == 2
    everything = "\n".join(commands.lines(checked, everything=True))
    assert all(part.why in everything for part in parts) and "Note 8." in everything and "more line" not in everything
    asked = "\n".join(commands.lines(checked, "03_x.ipynb"))
    assert [f"It took {n}.2 s." in asked for n in (2, 3, 4)] == [False, True, False]
    assert "something is missing: 00_x, 01_x, 02_x, 04_x" in asked
    assert "nothing yet: 09_x" in asked and "all there: 10_x" in asked


def test_an_answer_other_than_on_the_page_or_missing_is_told_with_what_to_do(folder):
    put(folder, {**GOOD, "q1": "omega_n = 21.0", "q2": "K_s = 1.6\nJ_l = None"})
    recorded_at_home(folder, RECORDED)
    found = check(folder, MASTERS, CATALOGUE)
    assert states(found)["2.11", "omega_n"] is State.DIFFERENT
    (unlike,) = found.unlike
    assert "2.11 in 01_swing.ipynb, 2.12 in 01_swing.ipynb." in unlike and unlike in found.advice


def test_a_notebook_that_is_missing_or_broken_and_one_that_ends_python_are_told(folder):
    put(folder, {**GOOD, "q1": "omega_n = 20.0\nexit()"})
    (folder / "02_later.ipynb").rename(folder / "02_later (1).ipynb")
    found = check(folder, MASTERS, CATALOGUE)
    assert not found.good and states(found)["0.1", "resolution"] is State.EMPTY
    assert "Is it 02_later (1).ipynb?" in found.problems[0] and "exit()" in found.stops[0]
    assert any("There is no answers.json here" in note for note in found.notes)
    (folder / "02_later.ipynb").write_text("<html>")
    assert "02_later.ipynb cannot be read: it is not JSON" in check(folder, MASTERS, CATALOGUE).problems[0]


def test_what_works_at_home_only_is_told_before_handing_in(folder):
    elsewhere = folder.parent / "curve.npz"
    elsewhere.touch()
    # nbval is installed for tests only; no course brings it.
    modules = "import nbval, scipy, helper\nomega_n = 20.0"
    reads = f"open({str(elsewhere)!r}).close()\nresolution = 0.0015"
    put(folder, {**GOOD, "q1": modules, "q2": "import nowhere_to_be_found", "q3": reads})
    (folder / "helper.py").write_text("import json\n")
    (folder / "course.json").write_text('{"student": "ada", "python": "3.10"}')
    found = check(folder, MASTERS, CATALOGUE)
    assert [note for note in found.notes if "Python 3.10 grades" in note]
    assert any("02_later.ipynb" in note and str(elsewhere) in note for note in found.notes)
    assert [note.split()[0] for note in found.notes if "does not come with the course" in note] == ["nbval"]
    assert "nowhere_to_be_found is not installed here" in found.stops[0]
    (folder / "course.json").write_text(json.dumps({"student": "ada", "python": version_text(HERE)}))
    assert not [note for note in check(folder, MASTERS, CATALOGUE).notes if "grades" in note]


def test_another_students_answers_are_not_compared_with(folder):
    put(folder, GOOD)
    recorded_at_home(folder, RECORDED)
    found = check(folder, MASTERS, CATALOGUE, student="bob")
    assert found.student == "bob"
    assert any("answers of 'Ada'" in note for note in found.notes)
