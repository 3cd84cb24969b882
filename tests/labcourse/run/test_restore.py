"""What restoring a notebook gives back, and what it leaves as it is."""

import copy
import json

import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_notebooks import answer, code, locked, notebook, saved, text

from labcourse.answers.notebooks import Notebook
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
    assert lines == ("gave back: setup (changed)", "gave back: title (deleted)", "gave back: q1-answer (moved)")


def test_what_a_student_set_in_the_metadata_stays_and_a_lost_lock_comes_back():
    master = copy.deepcopy(MASTER)
    master["cells"][2]["metadata"] |= {"editable": False, "deletable": False}
    own = copy.deepcopy(master)
    own["cells"][2] = {**own["cells"][2], "metadata": {"collapsed": True}, "source": "import this"}
    done, _ = restore.mend(saved(own), master)
    assert done["cells"][2]["metadata"] == {"collapsed": True, **master["cells"][2]["metadata"]}


def test_an_answer_that_was_made_text_is_code_again_but_not_where_a_picture_would_be_lost():
    own = worked()
    own["cells"][4] = {"cell_type": "markdown", "id": "q1", "metadata": {}, "source": "k = 3.5"}
    done, lines = restored(own)
    assert (done["cells"][4]["cell_type"], done["cells"][4]["source"]) == ("code", "k = 3.5")
    assert len(lines) == 1 and lines[0].startswith("gave back: q1 ")
    own["cells"][4]["attachments"] = {"a.png": {"image/png": "aGVsbG8="}}
    assert restored(own)[0]["cells"][4]["attachments"] == own["cells"][4]["attachments"]


def test_an_older_format_without_ids_gets_them():
    own = worked()
    own["nbformat_minor"] = 4
    for cell in own["cells"]:
        del cell["id"]
    done, _ = restored(own)
    assert not align(MASTER["cells"], Notebook.read(saved(done)).cells).changes
    assert [cell["source"] for cell in done["cells"]] == [cell["source"] for cell in worked()["cells"]]


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
    assert restore.mend(saved(done), MASTER) == (done, ())


def test_the_notebook_as_it_was_is_saved_beside_it_and_one_in_order_is_not_written(tmp_path):
    own = worked()
    del own["cells"][2]
    path = tmp_path / "01_springs.ipynb"
    for backup in ("01_springs.before-restore.ipynb", "01_springs-2.before-restore.ipynb"):
        path.write_bytes(saved(own))
        done = restore.restore(tmp_path, path.name, MASTER)
        assert (done.lines, done.backup) == (("gave back: setup (deleted)",), backup)
        assert (tmp_path / backup).read_bytes() == saved(own)
        assert json.loads(path.read_bytes())["cells"][2] == MASTER["cells"][2]
    before = path.stat()
    assert restore.restore(tmp_path, path.name, MASTER) == restore.Restored(path.name, ())
    assert path.stat() == before and restored(worked()) == (worked(), ())


def test_one_that_is_not_there_is_given_new_and_one_that_cannot_be_read_stays_and_is_told(tmp_path):
    assert len(restore.restore(tmp_path, "a.ipynb", MASTER).lines) == 1
    assert json.loads((tmp_path / "a.ipynb").read_bytes()) == MASTER
    (tmp_path / "a.ipynb").write_text("half a noteb")
    with pytest.raises(CheckError, match=r"a\.ipynb.*JSON"):
        restore.restore(tmp_path, "a.ipynb", MASTER)
    assert (tmp_path / "a.ipynb").read_text() == "half a noteb"


NAMES = ["01_springs.ipynb", "02_masses.ipynb", "10_end.ipynb"]


def test_notebooks_are_named_by_their_numbers():
    assert restore.named([], NAMES) == NAMES
    assert restore.named(["02"], NAMES) == restore.named(["2"], NAMES) == ["02_masses.ipynb"]
    assert restore.named(["1"], ["01_a.ipynb", "10_end.ipynb"]) == ["01_a.ipynb"]
    assert restore.named(["02_masses.ipynb", "10", "02"], NAMES) == ["02_masses.ipynb", "10_end.ipynb"]
    for word in ("0", "03", ""):
        with pytest.raises(CheckError, match="01_springs"):
            restore.named([word], NAMES)
