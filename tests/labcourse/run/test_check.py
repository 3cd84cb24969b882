"""What a check at home finds in a student's folder, and how it says so. The kernels are real."""

import copy
import json
from pathlib import Path

import pytest
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse.answers.answers import AnswerBook
from labcourse.problems import Code, Problem, has
from labcourse.run import commands, student_folder
from labcourse.run.check import Checked, CheckedPart, CheckState, check
from labcourse.run.portability import HERE, version_text
from labcourse.run.submit import submit
from labcourse.sentences import sentence
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
    assert states(found) == {
        ("2.11", "explanation"): CheckState.WRITTEN,
        **dict.fromkeys(recorded, CheckState.RECORDED),
    }
    assert found.good and (found.advice, found.notes) == ((), ())
    assert found.summary == "Complete: 3 questions." and begun == list(MASTERS)
    assert "1 written, 4 recorded" in "\n".join(commands.lines(found))
    assert {path: path.read_bytes() for path in folder.iterdir()} == before  # nothing of the student's is touched


def test_what_stopped_and_what_builds_on_it_is_told_and_no_value_is(folder):
    put(folder, {**GOOD, "q1": "omega = 20.0\nomega_n = omgea"})
    recorded_at_home(folder, RECORDED)
    edit(folder / "01_swing.ipynb", lambda cells: cells[2].update(source="import cmath"))
    edit(folder / "01_swing.ipynb", lambda cells: cells.pop(0))
    found = check(folder, MASTERS, CATALOGUE)
    missing = {where for where, state in states(found).items() if state is CheckState.MISSING}
    assert missing == {("2.11", "omega_n"), ("2.12", "J_l"), ("2.12", "K_s")} and not found.good
    assert states(found)["2.11", "explanation"] is CheckState.EMPTY
    assert found.summary == "Complete: 1 of 3 questions."
    (stop,) = found.stops
    assert sentence(stop) == "2.11 stopped: NameError, name 'omgea' is not defined, line 2; 2.12 builds on it."
    assert found.advice == ()  # it is told with the parts
    (changes,) = [note for note in found.notes if note.code is Code.CELLS_CHANGED]
    assert (changes.where, changes.parameters["cells"]) == (
        "01_swing.ipynb",
        [["changed", ["setup"]], ["deleted", ["title"]]],
    )
    assert "changed: setup; deleted: title." in sentence(changes) and 'lab.restore("01")' in sentence(changes)
    said = "\n".join(commands.lines(found))
    assert "    2.11 explanation: empty" in said
    (loss,) = [line for line in said.splitlines() if "omgea" in line]  # told once, with all that it costs
    assert loss.endswith(
        "2.11 omega_n; 2.12 J_l, K_s: not recorded. 2.11 stopped: NameError, name 'omgea' is not defined, line 2."
    )
    assert not {"20.0", "0.004", "0.0015", "1.6"} & set(said.replace(str(folder), "").split())


def test_what_is_said_fits_a_screen_and_says_how_to_see_the_rest():
    parts = [
        CheckedPart(
            f"{n:02}_x.ipynb", f"{n}.{m}", "a", CheckState.MISSING, Problem.of(Code.REFUSED, why=f"took {n}.{m} s")
        )
        for n in range(9)
        for m in range(5)
    ]
    parts += [
        CheckedPart("09_x.ipynb", "9.1", "a", CheckState.EMPTY),
        CheckedPart("10_x.ipynb", "10.1", "a", CheckState.RECORDED),
    ]
    notes = tuple(Problem.of(Code.SAID_BY_COURSE, text=f"Note {n}.") for n in range(9))
    checked = Checked("ada", Path("work"), tuple(parts), notes=notes)
    said = [*commands.lines(checked)]
    assert len(said) <= 36 and sum("check --everything" in line for line in said) == 2
    everything = "\n".join(commands.lines(checked, everything=True))
    assert all(sentence(part.why) in everything for part in parts if part.why)
    assert "Note 8." in everything and "more line" not in everything
    asked = "\n".join(commands.lines(checked, "03_x.ipynb"))
    assert [f"took {n}.2 s." in asked for n in (2, 3, 4)] == [False, True, False]
    assert "something is missing: 00_x, 01_x, 02_x, 04_x" in asked
    assert "nothing yet: 09_x" in asked and "complete: 10_x" in asked


def test_an_answer_other_than_on_the_page_or_missing_is_told_with_what_to_do(folder):
    put(folder, {**GOOD, "q1": "omega_n = 21.0", "q2": "K_s = 1.6\nJ_l = None"})
    recorded_at_home(folder, RECORDED)
    found = check(folder, MASTERS, CATALOGUE)
    assert states(found)["2.11", "omega_n"] is CheckState.DIFFERENT
    answers = ["2.11 in 01_swing.ipynb", "2.12 in 01_swing.ipynb"]
    assert found.advice == found.unlike == (Problem.of(Code.ANSWERS_UNLIKE, answers=answers),)


def test_a_notebook_that_is_missing_or_broken_and_one_that_ends_python_are_told(folder):
    put(folder, {**GOOD, "q1": "omega_n = 20.0\nexit()"})
    (folder / "02_later.ipynb").rename(folder / "02_later (1).ipynb")
    found = check(folder, MASTERS, CATALOGUE)
    assert not found.good and states(found)["0.1", "resolution"] is CheckState.EMPTY
    assert found.problems == (Problem.of(Code.MISNAMED, "02_later.ipynb", similar=["02_later (1).ipynb"]),)
    assert "Is it '02_later (1).ipynb'?" in sentence(found.problems[0])
    assert found.stops[0].parameters["why"].code is Code.LEFT_PYTHON
    assert has(Code.HOME_ANSWERS_ABSENT, found.notes, "answers.json")
    (folder / "02_later.ipynb").write_text("<html>")
    (unread,) = check(folder, MASTERS, CATALOGUE).problems
    assert (unread.code, unread.where) == (Code.NOTEBOOK_UNREAD, "02_later.ipynb")
    assert unread.parameters["why"].code is Code.NOT_JSON


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
    assert Problem.of(Code.OLDER_PYTHON_GRADES, here=version_text(HERE), there="3.10") in found.notes
    assert Problem.of(Code.FILE_NOT_HANDED_IN, "02_later.ipynb", file=str(elsewhere)) in found.notes
    foreign = [note.parameters["module"] for note in found.notes if note.code is Code.MODULE_NOT_OF_COURSE]
    assert foreign == ["nbval"]
    assert "nowhere_to_be_found is not installed here" in sentence(found.stops[0])
    (folder / "course.json").write_text(json.dumps({"student": "ada", "python": version_text(HERE)}))
    assert not has(Code.OLDER_PYTHON_GRADES, check(folder, MASTERS, CATALOGUE).notes)


def test_another_students_answers_are_not_compared_with(folder):
    put(folder, GOOD)
    recorded_at_home(folder, RECORDED)
    found = check(folder, MASTERS, CATALOGUE, student="bob")
    assert found.student == "bob"
    assert Problem.of(Code.HOME_ANSWERS_OF_ANOTHER, "answers.json", student="Ada") in found.notes


# --- what was meant --------------------------------------------------------------------------------------------------

SPECTRUM = 'def spectrum(x, dt):\n    """Frequencies and amplitudes."""\n    # Your code here.'
#: One question for each thing that a student may do: number and part → what is written in its cell.
WRITTEN = {
    ("2.10", "spectrum"): SPECTRUM + "\n    f_hz, amplitude = [0.0, 1.0], x[:2]",
    ("2.11", "omega_n"): "omega_n = float(input('rad/s: '))",
    ("2.12", "J_l"): "J_l = 1\nbreakpoint()\nJ_l = 2",
    ("2.12", "K_s"): "def doubled(x):\n    2 * x\n\n\nK_s = 1 + doubled(3)",
}
ONE_EACH = {
    "01_swing.ipynb": notebook(
        PARAMETERS,
        SETUP,
        *(
            cell
            for number, part in WRITTEN
            for cell in (
                answer(f"q-{part}", f"{part} = None"),
                locked(f"q-{part}-answer", f'lab.answer("{number}", {part}={part})'),
            )
        ),
    )
}


def test_a_forgotten_return_and_a_question_to_nobody_are_named_and_a_breakpoint_stops_nothing(folder):
    put(folder, {f"q-{part}": source for (_number, part), source in WRITTEN.items()}, ONE_EACH)
    found = check(folder, ONE_EACH, CATALOGUE)
    assert states(found).pop(("2.12", "J_l")) is CheckState.RECORDED
    why = {part.name: part.why for part in found.parts if part.state is CheckState.MISSING}
    assert why["spectrum"].code is Code.REFUSED and "return" in why["spectrum"].parameters["why"]
    stops = {name: why[name].parameters["why"].code for name in ("omega_n", "K_s")}
    assert stops == {"omega_n": Code.INPUT_NEEDED, "K_s": Code.NONE_USED}


@pytest.mark.parametrize("kind", ["markdown", "raw"])
def test_an_answer_cell_for_code_that_became_text_is_run_and_it_is_said(folder, kind):
    put(folder, {"q1": "omega_n = 20.0", "q2": "J_l = 1\nK_s = omega_n"})
    edit(folder / "01_swing.ipynb", lambda cells: cells[4].update(cell_type=kind))
    found = check(folder, MASTERS, CATALOGUE)
    assert {states(found)[where] for where in (("2.11", "omega_n"), ("2.12", "K_s"))} == {CheckState.RECORDED}
    assert Problem.of(Code.CELL_IS_TEXT, "01_swing.ipynb", cell="q1") in found.notes
    assert not has(Code.CELLS_CHANGED, found.notes)


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("01_swing-Copy1.ipynb", Code.COPY_NOT_CHECKED),
        ("Kopie von 01_swing (2).ipynb", Code.COPY_NOT_CHECKED),
        (".ipynb_checkpoints/01_swing-checkpoint.ipynb", Code.CHECKPOINT_HAS_MORE),
    ],
)
def test_answers_in_a_copy_or_a_checkpoint_beside_an_empty_notebook_are_found(folder, name, code):
    put(folder, GOOD)
    recorded_at_home(folder, RECORDED)
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / "01_swing.ipynb").rename(folder / name)
    (folder / "01_swing.ipynb").write_bytes(saved(MASTERS["01_swing.ipynb"]))
    (folder / "01_swing.before-restore.ipynb").write_bytes((folder / name).read_bytes())
    (problem,) = check(folder, MASTERS, CATALOGUE).advice  # and not that the notebook should be saved
    assert problem == Problem.of(code, "01_swing.ipynb", file=Path(name).name)
    receipt = submit(folder, MASTERS, CATALOGUE).receipt
    assert sentence(problem) in receipt["notes"]


def test_a_copy_or_a_checkpoint_with_no_more_in_it_is_not_spoken_of(folder):
    put(folder, GOOD)
    (folder / "01_swing-Copy1.ipynb").write_bytes((folder / "01_swing.ipynb").read_bytes())
    (folder / ".ipynb_checkpoints").mkdir()
    (folder / ".ipynb_checkpoints" / "01_swing-checkpoint.ipynb").write_bytes((folder / "01_swing.ipynb").read_bytes())
    edit(folder / "01_swing.ipynb", lambda cells: cells.append(code("mine", "2 + 2")))
    edit(folder / "01_swing-Copy1.ipynb", lambda cells: cells[4].update(source="omega_n = 21.0"))
    work = student_folder.read(folder, list(MASTERS))
    assert [*student_folder.work_elsewhere(work, MASTERS)] == []


def test_a_notebook_that_was_saved_as_json_is_named(folder):
    put(folder, GOOD)
    (folder / "01_swing.ipynb").rename(folder / "01_swing.json")
    (folder / "01_table.json").write_text("{}")  # of the student's
    work = student_folder.read(folder, list(MASTERS))
    assert work.problems == (Problem.of(Code.MISNAMED, "01_swing.ipynb", similar=["01_swing.json"]),)
