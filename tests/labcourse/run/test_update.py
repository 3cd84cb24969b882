"""A half-done notebook brought to another release: the course's cells are new, and what a student wrote is there."""

import copy
import json
import os

import nbformat
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse import files
from labcourse.errors import ConfigurationError
from labcourse.run import update
from labcourse.run.update import Changes, updated

OLD = notebook(
    text("title", "# Springs"),
    code("parameters", 'student = ""', ["parameters"]),
    locked("setup", "import math"),
    text("q1-text", "How stiff?"),
    answer("q1", "# ✎ Your answer: 1 ────\nk = None  # N/m\n# Your code here."),
    locked("q1-answer", 'lab.answer("1", k=k)'),
    answer("q2", 'why = ""\n# Your code here.'),
    locked("q2-answer", 'lab.answer("2", why=why)'),
    answer("q3", "n = None\n# Your code here."),
    locked("q3-answer", 'lab.answer("3", n=n)'),
)


def words(name, source):
    return {**text(name, source), "metadata": {"nbgrader": {**ANSWER, "grade_id": name}, "deletable": False}}


NEW = notebook(
    text("title", "# Springs and masses"),
    code("parameters", 'student = ""', ["parameters"]),
    locked("setup", "import math\nimport cmath"),
    text("q1-text", "How stiff?"),
    answer("q1", "k = error = None  # N/m\n# Your code here."),
    locked("q1-answer", 'lab.answer("1", k=k, error=error)'),
    words("q2", "*Write here.*"),
    text("q4-text", "How fast?"),
    answer("q4", "omega = None\n# Your code here."),
    locked("q4-answer", 'lab.answer("4", omega=omega)'),
)


def worked(**sources):
    own = copy.deepcopy(OLD)
    for cell in own["cells"]:
        cell["source"] = sources.get(cell["id"], cell["source"])
    return own


def brought(own, master=NEW):
    done, changes = updated(saved(own), master)
    nbformat.validate(nbformat.from_dict(done))
    return done, changes


def shown(content):
    return [(cell["id"], cell["source"]) for cell in content["cells"]]


def by_id(content):
    return {cell["id"]: cell for cell in content["cells"]}


def test_without_any_answer_it_is_the_new_notebook():
    done, changes = brought(OLD)
    assert done["cells"] == NEW["cells"]
    assert changes == Changes(changed=3, new=2, gone=3)


def test_a_note_in_an_empty_answer_cell_stays():
    noted = "# ✎ Your answer: 1 ────\nk = None  # N/m\n# about 3?\n# Your code here."
    done, _changes = brought(worked(q1=noted))
    assert by_id(done)["q1"]["source"] == noted


def test_answers_added_cells_parameters_and_outputs_stay_where_they_are():
    own = worked(q1="k = 3.5", parameters='student = "ada"')
    own["cells"][4]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "3.5"}]
    own["cells"].insert(4, code("mine", "half = 2"))
    own["cells"].insert(6, text("note", "my note"))
    done, _changes = brought(own)
    assert shown(done)[:8] == [
        ("title", "# Springs and masses"),
        ("parameters", 'student = "ada"'),
        ("setup", "import math\nimport cmath"),
        ("q1-text", "How stiff?"),
        ("mine", "half = 2"),
        ("q1", "k = 3.5"),
        ("note", "my note"),
        ("q1-answer", 'lab.answer("1", k=k, error=error)'),
    ]
    assert by_id(done)["q1"]["outputs"] == own["cells"][5]["outputs"]


def test_an_answer_that_is_another_kind_of_cell_now_stays_below_as_their_own_and_it_is_told():
    done, changes = brought(worked(q2='why = """It rubs."""'))
    place = [cell["id"] for cell in done["cells"]].index("q2")
    assert shown(done)[place : place + 2] == [("q2", "*Write here.*"), ("q2-before", 'why = """It rubs."""')]
    assert by_id(done)["q2-before"]["cell_type"] == "code"
    assert "nbgrader" not in by_id(done)["q2-before"]["metadata"]
    assert by_id(done)["q2"]["metadata"] == NEW["cells"][6]["metadata"]
    assert changes.aside == ("q2",) and [line for line in changes.lines("a.ipynb") if "q2" in line]


def test_an_answer_that_is_no_longer_asked_for_stays_as_their_own_and_what_recorded_it_goes():
    done, changes = brought(worked(q3="n = 4"))
    assert by_id(done)["q3"]["source"] == "n = 4" and "nbgrader" not in by_id(done)["q3"]["metadata"]
    assert "q3-answer" not in by_id(done)
    assert changes.dropped == ("q3",)
    assert "q3" in [*changes.lines("a.ipynb")][-1]


def test_an_answer_in_words_that_stood_in_code_stays_as_their_own_and_its_new_text_cell_is_empty():
    worded = words("q3-why", "*Write here.*")
    master = notebook(*OLD["cells"][:4], worded)
    done, changes = brought(worked(q1="k = None", q3='why = "It rubs."'), master)
    assert by_id(done)["q3-why"] == worded
    assert by_id(done)["q3"]["source"] == 'why = "It rubs."'
    assert changes.dropped == ("q3",)


def test_a_new_answer_cell_is_empty_though_cells_of_their_own_stand_in_its_place():
    own = worked(q1="k = 3.5")
    own["cells"].append(code("mine", "print(k)"))
    done, _changes = brought(own)
    assert by_id(done)["q4"]["source"] == "omega = None\n# Your code here."
    assert by_id(done)["mine"]["source"] == "print(k)"
    order = [cell["id"] for cell in done["cells"]]
    assert order.index("q4") < order.index("q4-answer")


def test_pieces_of_a_split_answer_all_stay():
    own = worked(q1="k = 3.5", q2='why = "It rubs."')
    for place, source in ((7, "why += '!'"), (5, "k = round(k)"), (5, "")):
        piece = copy.deepcopy(own["cells"][place - 1])
        own["cells"].insert(place, {**piece, "id": f"piece-{place}-{len(source)}", "source": source})
    done, changes = brought(own)
    sources = [cell["source"] for cell in done["cells"]]
    assert sources[4:7] == ["k = 3.5", "", "k = round(k)"]
    assert [cell["source"] for cell in done["cells"] if cell["id"].startswith("q2-before")] == [
        'why = "It rubs."',
        "why += '!'",
    ]
    assert changes.aside == ("q2",)


UNFILLED = ["k = None\n# Your code here.", 'why = ""', "", "run = sweep = None\n  # Your code here.", 'why = """ """']
FILLED = ["k = 0", "k = None  # to do: ask Grace", "k = None\nprint(3)", "k = "]


def test_only_what_holds_nothing_of_a_students_is_replaced():
    for source in UNFILLED:
        assert by_id(brought(worked(q1=source))[0])["q1"]["source"] == "k = error = None  # N/m\n# Your code here."
    for source in [*FILLED, "def f():\n    # Your code here.\n    return None"]:
        assert by_id(brought(worked(q1=source))[0])["q1"]["source"] == source


STUBBED = "def speed(t):\n    # Your code here.\n    return t +"


def released_with(stub):
    master = copy.deepcopy(OLD)
    by_id(master)["q1"].update(source=stub)
    by_id(master)["q1"]["metadata"]["labcourse"] = {"stub": update.stub_digest(stub)}
    return master


def test_a_stub_is_mended_where_nothing_is_written_in_it_and_told_where_there_is():
    old, new = released_with(STUBBED), released_with(STUBBED + " 0")
    done, changes = brought(old, new)
    assert by_id(done)["q1"] == by_id(new)["q1"] and not changes.theirs
    by_id(old)["q1"]["source"] = STUBBED.replace("# Your code here.", "t = 2 * t")
    done, changes = brought(old, new)
    assert "t = 2 * t" in by_id(done)["q1"]["source"]
    assert changes.theirs == ("q1",) and [line for line in changes.lines("a.ipynb") if "q1" in line]
    assert not brought(done, new)[1].theirs  # told once
    assert not brought(old, released_with(STUBBED))[1].theirs


SOURCES = st.text(st.characters(codec="utf-8", exclude_characters="\r"), min_size=1, max_size=20).map("x = 1\n".__add__)


@given(
    answers=st.dictionaries(st.sampled_from(["q1", "q2", "q3"]), SOURCES),
    added=st.lists(st.tuples(st.integers(0, 10), SOURCES, st.booleans()), max_size=4),
    gone=st.sets(st.sampled_from([cell["id"] for cell in OLD["cells"]]), max_size=3),
    new_names=st.booleans(),
)
def test_whatever_a_student_wrote_is_there_and_a_second_time_changes_nothing(answers, added, gone, new_names):
    own = worked(**answers)
    own["cells"] = [cell for cell in own["cells"] if cell["id"] not in gone or cell["id"] in answers]
    for number, (place, source, is_code) in enumerate(added):
        own["cells"].insert(place, code(f"mine-{number}", source) if is_code else text(f"mine-{number}", source))
    if new_names:
        for number, cell in enumerate(own["cells"]):
            cell["id"] = f"x{number}"
    wrote = sorted([*answers.values(), *(source for _, source, _ in added)])
    done, _changes = brought(own)
    left = sorted(cell["source"] for cell in done["cells"] if cell["source"].startswith("x = 1\n"))
    assert left == wrote
    assert [cell["source"] for cell in done["cells"] if cell["id"] == "setup"] == ["import math\nimport cmath"]
    again, changes = updated(saved(done), NEW)
    assert again == done and not changes.aside


@pytest.fixture
def released(tmp_path):
    folder = tmp_path / "released"
    folder.mkdir()
    for name in ("a.ipynb", "b.ipynb", "c.ipynb"):
        (folder / name).write_bytes(saved(NEW))
    return folder


@pytest.fixture
def desk(tmp_path):
    """A student's folder: b as it was released before, a worked on, no c."""
    folder = tmp_path / "desk"
    folder.mkdir()
    (folder / "a.ipynb").write_bytes(saved(worked(q1="k = 3.5")))
    (folder / "b.ipynb").write_bytes(saved(OLD))
    (folder / "own.py").write_text("x = 1")
    (folder / "answers.json").write_text("{}")
    return folder


def test_a_folder_is_brought_to_a_release_and_what_was_there_is_kept(desk, released):
    before = {path.name: path.read_bytes() for path in desk.iterdir()}
    lines, whole = update.update(desk, released, "2026-x")
    assert whole
    assert len(lines) == 4 and "2026-x" in lines[0] and str(desk / ".before-2026-x") in lines[3]
    for name, line in zip(("a.ipynb", "b.ipynb"), lines[1:3], strict=True):
        assert line.startswith(f"{name}: ") and line.endswith("3 changed, 2 new, 3 gone.")
    kept = {path.name: path.read_bytes() for path in (desk / ".before-2026-x").iterdir()}
    assert kept == {name: content for name, content in before.items() if name.endswith(".ipynb")}
    assert by_id(json.loads((desk / "a.ipynb").read_text()))["q1"]["source"] == "k = 3.5"
    assert not (desk / "c.ipynb").exists()
    assert (desk / "own.py").read_text() == "x = 1" and (desk / "answers.json").read_text() == "{}"
    assert update.update(desk, released, "2026-x") == ([], True)


def test_a_notebook_that_cannot_be_read_stays_and_is_told(desk, released):
    (desk / "a.ipynb").write_text("{")
    lines, whole = update.update(desk, released, "2026-x")
    assert not whole
    assert (desk / "a.ipynb").read_text() == "{"
    assert any("a.ipynb" in line and "JSON" in line for line in lines)
    assert by_id(json.loads((desk / "b.ipynb").read_text()))["title"]["source"] == "# Springs and masses"


def test_a_copy_that_is_kept_is_never_overwritten(desk, released):
    update.update(desk, released, "2026-x")
    (desk / "a.ipynb").write_bytes(saved(worked(q1="k = 4")))
    update.update(desk, released, "2026-x")
    sources = {
        path.name: by_id(json.loads(path.read_text()))["q1"]["source"]
        for path in (desk / ".before-2026-x").glob("*a.*")
    }
    assert sources == {"a.ipynb": "k = 3.5", "2-a.ipynb": "k = 4"}


def test_a_program_that_ends_in_between_leaves_whole_files_and_the_next_one_goes_on(desk, released, monkeypatch):
    before = (desk / "a.ipynb").read_bytes()
    rename, counted = os.replace, []

    def killed(source, target):
        counted.append(target)
        if len(counted) == 4:  # the copies of a and b are kept, a is new
            raise KeyboardInterrupt
        rename(source, target)

    monkeypatch.setattr(files.os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        update.update(desk, released, "2026-x")
    monkeypatch.undo()
    for path in desk.glob("*.ipynb"):
        json.loads(path.read_text())
    assert json.loads((desk / "b.ipynb").read_text()) == OLD
    _lines, whole = update.update(desk, released, "2026-x")
    assert whole and by_id(json.loads((desk / "b.ipynb").read_text()))["title"]["source"] == "# Springs and masses"
    assert (desk / ".before-2026-x" / "a.ipynb").read_bytes() == before
    assert len(list((desk / ".before-2026-x").iterdir())) == 2


def test_a_notebook_that_cannot_be_written_is_told_and_is_as_it_was(desk, released):
    before = (desk / "a.ipynb").read_bytes()
    (desk / ".before-2026-x").write_text("in the way")
    with pytest.raises(ConfigurationError, match=r"a\.ipynb.*2026-x"):
        update.update(desk, released, "2026-x")
    assert (desk / "a.ipynb").read_bytes() == before
