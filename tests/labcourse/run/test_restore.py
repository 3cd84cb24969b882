"""What restoring a notebook gives back, of the same release and of another one, and what it leaves as it is."""

import copy
import json
import os

import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse import courses, files
from labcourse.answers.notebooks import Notebook
from labcourse.courses import InstalledCourse
from labcourse.errors import CheckError
from labcourse.run import restore
from labcourse.run.alignment import align

MASTER = notebook(
    text("title", "# Springs"),
    code("parameters", 'student = ""', ["parameters"]),
    locked("setup", "import math"),
    text("q1-text", "How stiff?"),
    answer("q1", "k = None\n# Your code here."),
    locked("q1-answer", 'lab.answer("1", k=k)'),
    text("q2-text", "How fast?"),
    answer("q2", "omega = None\n# Your code here."),
    locked("q2-answer", 'lab.answer("2", omega=omega)'),
    locked("end", "lab.summary()"),
)


def worked():
    own = copy.deepcopy(MASTER)
    own["cells"][4]["source"] = "k = 3.5"
    own["cells"][7]["source"] = "omega = math.sqrt(k)"
    own["cells"][7]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "1.87"}]
    own["cells"].insert(7, code("mine", "half = k / 2"))
    return own


def restored(own):
    done, lines = restore.mend(saved(own), MASTER)
    nbformat.validate(nbformat.from_dict(done))
    return done, lines


def test_changed_deleted_and_moved_cells_are_given_back_and_answers_stay():
    own = worked()
    own["cells"][2]["source"] = "import cmath"
    own["cells"][2]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "old"}]
    del own["cells"][0]
    own["cells"].append(own["cells"].pop([cell["id"] for cell in own["cells"]].index("q1-answer")))
    done, lines = restored(own)
    assert [cell["id"] for cell in done["cells"]] == [cell["id"] for cell in worked()["cells"]]
    assert [cell["source"] for cell in done["cells"]] == [cell["source"] for cell in worked()["cells"]]
    assert done["cells"][2]["outputs"] == []  # they were the changed code's
    assert done["cells"][8]["outputs"] == worked()["cells"][8]["outputs"]
    given = ("changed: setup", "deleted: title", "moved: q1-answer")
    assert lines == [f"gave back what was {line}" for line in given]


def test_what_a_student_set_in_the_metadata_stays_and_a_lost_lock_comes_back():
    master = copy.deepcopy(MASTER)
    master["cells"][2]["metadata"] |= {"editable": False, "deletable": False}
    own = copy.deepcopy(master)
    own["cells"][2] = {**own["cells"][2], "metadata": {"collapsed": True}, "source": "import this"}
    done, _ = restore.mend(saved(own), master)
    assert done["cells"][2]["metadata"] == {"collapsed": True, **master["cells"][2]["metadata"]}


def test_words_in_the_courses_text_go_into_the_answer_cell_before_that_text_is_given_back():
    master = copy.deepcopy(MASTER)
    about = {**answer("q3", "")["metadata"], "labcourse": {"question": "3", "part": "why"}}
    why = {**text("q3", "*Double-click here*"), "metadata": about}
    master["cells"][-1:-1] = [text("q3-text", "Why does it swing?"), why]
    own = copy.deepcopy(master)
    own["cells"][-3]["source"] += "\n\nThe spring pulls it back."
    done, lines = restore.mend(saved(own), master)
    assert done["cells"][-3]["source"] == "Why does it swing?"
    assert done["cells"][-2]["source"] == "*Double-click here*\n\nThe spring pulls it back."
    assert lines[-1].endswith(": q3")
    assert restore.mend(saved(done), master) == (done, [])


def test_an_answer_that_was_made_text_is_code_again_but_not_where_a_picture_would_be_lost():
    own = worked()
    own["cells"][4] = {"cell_type": "markdown", "id": "q1", "metadata": {}, "source": "k = 3.5"}
    done, lines = restored(own)
    assert (done["cells"][4]["cell_type"], done["cells"][4]["source"]) == ("code", "k = 3.5")
    assert len(lines) == 1 and lines[0].startswith("gave back ") and lines[0].endswith(": q1")
    own["cells"][4]["attachments"] = {"a.png": {"image/png": "aGVsbG8="}}
    assert restored(own)[0]["cells"][4]["attachments"] == own["cells"][4]["attachments"]


PLACES = st.integers(0, 30)
STEPS = st.lists(
    st.one_of(
        st.tuples(st.sampled_from(["delete", "renew id", "lose names", "copy", "split"]), PLACES),
        st.tuples(st.just("move"), PLACES, PLACES),
        st.tuples(st.just("change"), PLACES, st.sampled_from(["x = 1", "", "lab.summary()", "# Springs", "é"])),
        st.tuples(st.just("add"), PLACES, st.sampled_from(["code", "markdown"])),
    ),
    max_size=12,
)


def mangled(steps):
    own = worked()
    cells = own["cells"]
    for number, (what, *about) in enumerate(steps):
        place = about[0] % max(1, len(cells))
        if what == "add":
            new = {**text(f"new{number}", "n"), "cell_type": about[1]}
            cells.insert(place, code(f"new{number}", "n = 1") if about[1] == "code" else new)
        elif not cells:
            continue
        elif what == "delete":
            del cells[place]
        elif what == "renew id":
            cells[place]["id"] = f"renewed{number}"
        elif what == "lose names":
            cells[place].pop("id", None)
            cells[place]["metadata"] = {}
        elif what == "copy":
            cells.insert(place, {**copy.deepcopy(cells[place]), "id": f"copy{number}"})
        elif what == "split":
            cells.insert(place + 1, {**copy.deepcopy(cells[place]), "id": f"split{number}", "source": "z = 0"})
        elif what == "move":
            cells.insert(about[1] % len(cells), cells.pop(place))
        elif what == "change":
            cells[place]["source"] = about[1]
    return own


@settings(max_examples=150)
@given(STEPS)
def test_after_restoring_nothing_is_missing_and_no_word_of_the_students_is_gone(steps):
    own = mangled(steps)
    cells = Notebook.read(saved(own)).cells
    before = align(MASTER["cells"], cells)
    done, lines = restored(own)
    again = align(MASTER["cells"], Notebook.read(saved(done)).cells)
    assert again.changes == ()
    assert bool(lines) == bool(before.changes)
    theirs = {place.student for place in before.placed if place.role in ("answer", "added", "open")} - {None}
    kept = [cells[place.student].source for place in before.placed if place.student in theirs]
    found = [cell["source"] for cell in done["cells"]]
    places = iter(found)
    assert all(source in places for source in kept)  # in the order in which they are run
    assert restore.mend(saved(done), MASTER) == (done, [])


def said(folder, master=MASTER, name="a.ipynb"):
    """What restoring one notebook says."""
    return "\n".join(restore.restore(folder, {name: master}, [name]))


def test_the_notebook_as_it_was_is_saved_beside_it_and_one_in_order_is_not_written(tmp_path):
    own = worked()
    del own["cells"][2]
    path = tmp_path / "a.ipynb"
    for backup in ("a.before-restore.ipynb", "a-2.before-restore.ipynb"):
        path.write_bytes(saved(own))
        lines = said(tmp_path)
        assert "deleted: setup" in lines and f"saved as {backup}." in lines and "Reload Notebook" in lines
        assert (tmp_path / backup).read_bytes() == saved(own)
        assert json.loads(path.read_bytes())["cells"][2] == MASTER["cells"][2]
    before = path.stat()
    assert said(tmp_path) == "a.ipynb: all that is the course's is there."
    assert path.stat() == before and restored(worked()) == (worked(), [])


def test_one_that_is_not_there_is_given_new(tmp_path):
    assert "without answers" in said(tmp_path)
    assert json.loads((tmp_path / "a.ipynb").read_bytes()) == MASTER


# --- a notebook of another release -----------------------------------------------------------------------------------


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


def begun(**sources):
    own = copy.deepcopy(OLD)
    for cell in own["cells"]:
        cell["source"] = sources.get(cell["id"], cell["source"])
    return own


def brought(own):
    done, lines = restore.mend(saved(own), NEW, "2026-x")
    nbformat.validate(nbformat.from_dict(done))
    return done, lines


def shown(content):
    return [(cell["id"], cell["source"]) for cell in content["cells"]]


def by_id(content):
    return {cell["id"]: cell for cell in content["cells"]}


def test_without_any_answer_it_is_the_new_notebook():
    done, lines = brought(OLD)
    assert done["cells"] == NEW["cells"]
    assert len(lines) == 1 and "2026-x" in lines[0] and brought(NEW) == (NEW, [])


def test_answers_added_cells_parameters_and_outputs_stay_where_they_are():
    own = begun(q1="k = 3.5", parameters='student = "ada"')
    own["cells"][4]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "3.5"}]
    own["cells"].insert(4, code("mine", "half = 2"))
    own["cells"].insert(6, text("note", "my note"))
    done, lines = brought(own)
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
    assert len(lines) == 2 and "another text" in lines[1] and lines[1].endswith(": q1") and not brought(done)[1]


def test_an_answer_that_is_another_kind_of_cell_now_is_turned_into_it_with_all_pieces():
    own = begun(q2='why = """It rubs."""')
    own["cells"].insert(7, {**copy.deepcopy(own["cells"][6]), "id": "piece", "source": "why += '!'"})
    done, lines = brought(own)
    place = [cell["id"] for cell in done["cells"]].index("q2")
    assert shown(done)[place : place + 2] == [("q2", 'why = """It rubs."""'), ("piece", "why += '!'")]
    assert {cell["cell_type"] for cell in done["cells"][place : place + 2]} == {"markdown"}
    assert any("another kind of cell" in line and line.endswith(": q2") for line in lines)


def test_an_answer_that_is_no_longer_asked_for_stays_as_their_own_and_what_recorded_it_goes():
    done, lines = brought(begun(q3="n = 4"))
    assert by_id(done)["q3"]["source"] == "n = 4" and "nbgrader" not in by_id(done)["q3"]["metadata"]
    assert "q3-answer" not in by_id(done)
    assert any("no answer cells any more" in line and line.endswith(": q3") for line in lines)


def test_a_new_answer_cell_is_empty_though_cells_of_their_own_stand_in_its_place():
    own = begun(q1="k = 3.5")
    own["cells"].append(code("mine", "print(k)"))
    done, _lines = brought(own)
    assert by_id(done)["q4"]["source"] == "omega = None\n# Your code here."
    assert by_id(done)["mine"]["source"] == "print(k)"
    order = [cell["id"] for cell in done["cells"]]
    assert order.index("q4") < order.index("q4-answer")


def test_pieces_of_a_split_answer_all_stay():
    own = begun(q1="k = 3.5")
    for source in ("k = round(k)", ""):
        own["cells"].insert(5, {**copy.deepcopy(own["cells"][4]), "id": f"piece-{len(source)}", "source": source})
    done, _lines = brought(own)
    assert [cell["source"] for cell in done["cells"]][4:7] == ["k = 3.5", "", "k = round(k)"]
    own = begun()  # the first piece is as it was released
    own["cells"].insert(5, {**copy.deepcopy(own["cells"][4]), "id": "piece", "source": "k = 3.5"})
    assert [cell["source"] for cell in brought(own)[0]["cells"]][4:6] == [own["cells"][4]["source"], "k = 3.5"]


def test_only_an_answer_cell_as_it_was_released_is_replaced():
    for source in (
        "k = None\n# Your code here.",
        "",
        "# ✎ Your answer: 1 ────\nk = None  # N/m, 3?\n# Your code here.",
    ):
        assert by_id(brought(begun(q1=source))[0])["q1"]["source"] == source
    own = begun(q1=by_id(OLD)["q1"]["source"] + "  \n")  # white space cannot be seen
    assert by_id(brought(own)[0])["q1"] == by_id(NEW)["q1"]


SOURCES = st.text(st.characters(codec="utf-8", exclude_characters="\r"), min_size=1, max_size=20).map("x = 1\n".__add__)


@given(
    answers=st.dictionaries(st.sampled_from(["q1", "q2", "q3"]), SOURCES),
    added=st.lists(st.tuples(st.integers(0, 10), SOURCES, st.booleans()), max_size=4),
    gone=st.sets(st.sampled_from([cell["id"] for cell in OLD["cells"]]), max_size=3),
    new_names=st.booleans(),
)
def test_whatever_a_student_wrote_is_there_and_a_second_time_changes_nothing(answers, added, gone, new_names):
    own = begun(**answers)
    own["cells"] = [cell for cell in own["cells"] if cell["id"] not in gone or cell["id"] in answers]
    for number, (place, source, is_code) in enumerate(added):
        own["cells"].insert(place, code(f"mine-{number}", source) if is_code else text(f"mine-{number}", source))
    if new_names:
        for number, cell in enumerate(own["cells"]):
            cell["id"] = f"x{number}"
    wrote = sorted([*answers.values(), *(source for _, source, _ in added)])
    done, _lines = brought(own)
    left = sorted(cell["source"] for cell in done["cells"] if cell["source"].startswith("x = 1\n"))
    assert left == wrote
    assert [cell["source"] for cell in done["cells"] if cell["id"] == "setup"] == ["import math\nimport cmath"]
    assert brought(done)[0] == done


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A student's folder, begun with another release than the installed one: a worked on, b as released, no c."""
    monkeypatch.setattr(courses, "current", lambda: InstalledCourse("made", tmp_path))
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "notebooks" / "a.ipynb").write_bytes(saved(NEW))
    (tmp_path / "notebooks" / "course.json").write_text('{"student": "", "release": "2026-x", "term": "2026"}')
    folder = tmp_path / "desk"
    folder.mkdir()
    (folder / "a.ipynb").write_bytes(saved(begun(q1="k = 3.5")))
    (folder / "b.ipynb").write_bytes(saved(OLD))
    (folder / "own.py").write_text("x = 1")
    (folder / "answers.json").write_text("{}")
    (folder / "course.json").write_text('{"student": "ada", "release": "2025-y", "with": ["bob"]}')
    return folder


ALL = dict.fromkeys(("a.ipynb", "b.ipynb", "c.ipynb"), NEW)


def release_of(folder):
    return json.loads((folder / "course.json").read_text())["release"]


def test_a_folder_of_another_release_is_brought_to_the_installed_one_and_nothing_of_it_is_lost(desk):
    before = {path.name: path.read_bytes() for path in desk.iterdir()}
    lines = "\n".join(restore.restore(desk, ALL, ["a.ipynb"]))
    assert lines.count("release 2026-x") == 2 and lines.count(": q1") == 1
    for name in ("a", "b"):
        assert (desk / f"{name}.before-restore.ipynb").read_bytes() == before[f"{name}.ipynb"]
        assert by_id(json.loads((desk / f"{name}.ipynb").read_text()))["setup"] == by_id(NEW)["setup"]
    assert by_id(json.loads((desk / "a.ipynb").read_text()))["q1"]["source"] == "k = 3.5"
    assert not (desk / "c.ipynb").exists()
    assert all((desk / name).read_bytes() == before[name] for name in ("own.py", "answers.json"))
    about = json.loads((desk / "course.json").read_text())
    assert about == {"student": "ada", "release": "2026-x", "term": "2026", "with": ["bob"]}
    assert list(restore.restore(desk, ALL)) == []


def test_a_cell_that_stands_for_a_lost_answer_cell_is_taken_for_it_if_no_other_release_is_named(desk):
    """The course's cell would be empty beside it, and a text in it would count for nothing."""
    own = copy.deepcopy(NEW)
    own["cells"][6] = text("mine", "It rubs.")
    (desk / "a.ipynb").write_bytes(saved(own))
    (desk / "course.json").unlink()
    list(restore.restore(desk, ALL, ["a.ipynb"]))
    assert by_id(json.loads((desk / "a.ipynb").read_text()))["q2"]["source"] == "It rubs."
    assert release_of(desk) == "2026-x"


def test_a_program_that_ends_in_between_leaves_whole_files_and_the_next_one_goes_on(desk, monkeypatch):
    before = (desk / "a.ipynb").read_bytes()
    rename, counted = os.replace, []

    def killed(source, target):
        counted.append(target)
        if len(counted) == 4:  # copies of a and b are saved, and a is new
            raise KeyboardInterrupt
        rename(source, target)

    monkeypatch.setattr(files.os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        list(restore.restore(desk, ALL))
    monkeypatch.setattr(files.os, "replace", rename)
    assert json.loads((desk / "b.ipynb").read_text()) == OLD and release_of(desk) == "2025-y"
    list(restore.restore(desk, ALL))
    assert by_id(json.loads((desk / "b.ipynb").read_text()))["setup"] == by_id(NEW)["setup"]
    assert (desk / "a.before-restore.ipynb").read_bytes() == before and release_of(desk) == "2026-x"


@pytest.mark.parametrize("stops", ["reading", "writing"])
def test_a_notebook_that_cannot_be_read_or_written_is_told_and_tried_again_and_the_others_are_restored(
    desk, monkeypatch, stops
):
    def full(path, content):
        if "a." in path.name:
            raise OSError(28, "No space left on device", str(path))
        write(path, content)

    write = files.write
    if stops == "reading":
        (desk / "a.ipynb").write_text("{")
    else:
        monkeypatch.setattr(restore.files, "write", full)
    before = (desk / "a.ipynb").read_bytes()
    with pytest.raises(CheckError, match=r"a\.ipynb cannot be"):
        list(restore.restore(desk, ALL))
    assert (desk / "a.ipynb").read_bytes() == before and release_of(desk) == "2025-y"
    assert by_id(json.loads((desk / "b.ipynb").read_text()))["setup"] == by_id(NEW)["setup"]


NAMES = ["01_springs.ipynb", "02_masses.ipynb", "10_end.ipynb"]


def test_notebooks_are_named_by_their_numbers():
    assert restore.named([], NAMES) == NAMES
    assert restore.named(["02"], NAMES) == restore.named(["2"], NAMES) == ["02_masses.ipynb"]
    assert restore.named(["1"], ["01_a.ipynb", "10_end.ipynb"]) == ["01_a.ipynb"]
    assert restore.named(["02_masses.ipynb", "10", "02"], NAMES) == ["02_masses.ipynb", "10_end.ipynb"]
    for word in ("0", "03", ""):
        with pytest.raises(CheckError, match="01_springs"):
            restore.named([word], NAMES)
