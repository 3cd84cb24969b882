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
from labcourse.run import restore
from labcourse.run.restore import Changes, updated


def stubbed(cell):
    """An answer cell as a release has it."""
    return {**cell, "metadata": {**cell["metadata"], "labcourse": {"stub": restore.stub_digest(cell["source"])}}}


OLD = notebook(
    text("title", "# Springs"),
    code("parameters", 'student = ""', ["parameters"]),
    locked("setup", "import math"),
    text("q1-text", "How stiff?"),
    stubbed(answer("q1", "# ✎ Your answer: 1 ────\nk = None  # N/m\n# Your code here.")),
    locked("q1-answer", 'lab.answer("1", k=k)'),
    stubbed(answer("q2", 'why = ""\n# Your code here.')),
    locked("q2-answer", 'lab.answer("2", why=why)'),
    stubbed(answer("q3", "n = None\n# Your code here.")),
    locked("q3-answer", 'lab.answer("3", n=n)'),
)
WORDS = {**text("q2", "*Write here.*"), "metadata": {"nbgrader": {**ANSWER, "grade_id": "q2"}, "deletable": False}}
NEW = notebook(
    text("title", "# Springs and masses"),
    code("parameters", 'student = ""', ["parameters"]),
    locked("setup", "import math\nimport cmath"),
    text("q1-text", "How stiff?"),
    stubbed(answer("q1", "k = error = None  # N/m\n# Your code here.")),
    locked("q1-answer", 'lab.answer("1", k=k, error=error)'),
    stubbed(WORDS),
    text("q4-text", "How fast?"),
    stubbed(answer("q4", "omega = None\n# Your code here.")),
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
    assert changes == Changes()


def test_answers_added_cells_parameters_and_outputs_stay_where_they_are():
    own = worked(q1="k = 3.5", parameters='student = "ada"')
    own["cells"][4]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "3.5"}]
    own["cells"].insert(4, code("mine", "half = 2"))
    own["cells"].insert(6, text("note", "my note"))
    done, changes = brought(own)
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
    # The course has another text for the answer cell: that is told once.
    assert changes.theirs == ("q1",) and not brought(done)[1].theirs


def test_an_answer_that_is_another_kind_of_cell_now_is_turned_into_it_with_all_pieces():
    own = worked(q2='why = """It rubs."""')
    own["cells"].insert(7, {**copy.deepcopy(own["cells"][6]), "id": "piece", "source": "why += '!'"})
    done, changes = brought(own)
    place = [cell["id"] for cell in done["cells"]].index("q2")
    assert shown(done)[place : place + 2] == [("q2", 'why = """It rubs."""'), ("piece", "why += '!'")]
    assert {cell["cell_type"] for cell in done["cells"][place : place + 2]} == {"markdown"}
    assert changes.converted == ("q2",)


def test_an_answer_that_is_no_longer_asked_for_stays_as_their_own_and_what_recorded_it_goes():
    done, changes = brought(worked(q3="n = 4"))
    assert by_id(done)["q3"]["source"] == "n = 4" and "nbgrader" not in by_id(done)["q3"]["metadata"]
    assert "q3-answer" not in by_id(done)
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
    own = worked(q1="k = 3.5")
    for source in ("k = round(k)", ""):
        own["cells"].insert(5, {**copy.deepcopy(own["cells"][4]), "id": f"piece-{len(source)}", "source": source})
    done, _changes = brought(own)
    assert [cell["source"] for cell in done["cells"]][4:7] == ["k = 3.5", "", "k = round(k)"]


def test_only_an_answer_cell_as_it_was_released_is_replaced():
    for source in (
        "k = None\n# Your code here.",
        "",
        "# ✎ Your answer: 1 ────\nk = None  # N/m, 3?\n# Your code here.",
    ):
        assert by_id(brought(worked(q1=source))[0])["q1"]["source"] == source
    own = worked(q1=by_id(OLD)["q1"]["source"] + "  \n")  # white space cannot be seen
    assert by_id(brought(own)[0])["q1"] == by_id(NEW)["q1"]


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
    assert again == done and not changes.converted


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
    lines, whole = restore.update(desk, released, "2026-x")
    assert whole
    theirs, done = lines
    assert theirs.startswith("a.ipynb: ") and theirs.endswith(": q1.")
    assert all(text in done for text in ("2026-x: a, b.", str(desk / ".before-2026-x")))
    kept = {path.name: path.read_bytes() for path in (desk / ".before-2026-x").iterdir()}
    assert kept == {name: content for name, content in before.items() if name.endswith(".ipynb")}
    assert by_id(json.loads((desk / "a.ipynb").read_text()))["q1"]["source"] == "k = 3.5"
    assert not (desk / "c.ipynb").exists()
    assert (desk / "own.py").read_text() == "x = 1" and (desk / "answers.json").read_text() == "{}"
    assert restore.update(desk, released, "2026-x") == ([], True)
    (desk / "a.ipynb").write_bytes(saved(worked(q1="k = 4")))
    restore.update(desk, released, "2026-x")  # what is saved is never overwritten
    assert (desk / ".before-2026-x" / "a.ipynb").read_bytes() == before["a.ipynb"]
    assert (desk / ".before-2026-x" / "2-a.ipynb").read_bytes() == saved(worked(q1="k = 4"))


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
        restore.update(desk, released, "2026-x")
    monkeypatch.undo()
    for path in desk.glob("*.ipynb"):
        json.loads(path.read_text())
    assert json.loads((desk / "b.ipynb").read_text()) == OLD
    _lines, whole = restore.update(desk, released, "2026-x")
    assert whole and by_id(json.loads((desk / "b.ipynb").read_text()))["title"]["source"] == "# Springs and masses"
    assert (desk / ".before-2026-x" / "a.ipynb").read_bytes() == before
    assert len(list((desk / ".before-2026-x").iterdir())) == 2


def test_a_notebook_that_cannot_be_read_or_written_is_told_and_is_as_it_was(desk, released):
    (desk / "a.ipynb").write_text("{")
    lines, whole = restore.update(desk, released, "2026-x")
    assert not whole and any("a.ipynb" in line and "JSON" in line for line in lines)
    assert (desk / "a.ipynb").read_text() == "{"
    assert by_id(json.loads((desk / "b.ipynb").read_text()))["title"]["source"] == "# Springs and masses"
    (desk / "b.ipynb").write_bytes(saved(OLD))
    (desk / ".before-2026-y").write_text("in the way")
    with pytest.raises(ConfigurationError, match=r"b\.ipynb.*2026-y"):
        restore.update(desk, released, "2026-y")
    assert (desk / "b.ipynb").read_bytes() == saved(OLD)
