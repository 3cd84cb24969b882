"""Work packed to be handed in, and its receipt."""

import json
import os
import sys
import zipfile
from datetime import UTC, datetime
from pathlib import Path

import pytest
from made_notebooks import answer, locked, notebook, saved

from labcourse.answers.catalogue import Catalogue
from labcourse.errors import CheckError
from labcourse.problems import Code, Problem
from labcourse.run.check import Checked, CheckedPart, CheckState
from labcourse.run.submit import MAX_OUTPUT, slim, submit

NAME = "01_swing.ipynb"
NOTEBOOK = notebook(answer("q1", "k = 3.5"), locked("q1-answer", 'lab.answer("1", k=k)'))
NOON = datetime(2026, 3, 1, 12, 0, 0, tzinfo=UTC)
WHY = Problem.of(Code.BUILDS_ON_UNANSWERED, on="1")
CHECKED = Checked(
    "ada",
    Path(),
    (CheckedPart(NAME, "1", "k", CheckState.RECORDED), CheckedPart(NAME, "2", "omega", CheckState.MISSING, WHY)),
)


@pytest.fixture
def folder(tmp_path):
    work = tmp_path / "desk" / "work"
    work.mkdir(parents=True)
    (work / NAME).write_bytes(saved(NOTEBOOK))
    (work / "course.json").write_text('{"student": "ada", "release": "r1"}')
    (work / "answers.json").write_text('{"student": "ada"}')
    (work / "helpers.py").write_text("x = 1")
    return work


def pack(folder, **options):
    return submit(folder, {NAME: NOTEBOOK}, Catalogue([]), **{"now": NOON, "checked": CHECKED, **options})


def content(path):
    with zipfile.ZipFile(path) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def test_a_zip_named_by_the_id_holds_what_counts_and_a_receipt(folder):
    done = pack(folder)
    assert done.path == folder.parent / "ada.zip"
    found = content(done.path)
    receipt = json.loads(found.pop("receipt.json"))
    assert found == {
        NAME: saved(NOTEBOOK),
        "answers.json": b'{"student": "ada"}',
        "course.json": b'{"student": "ada", "release": "r1"}\n',
        "helpers.py": b"x = 1",
    }
    assert (receipt["student"], receipt["with"], receipt["time"]) == ("ada", [], "2026-03-01T12:00:00+00:00")
    assert (receipt["answered"], receipt["not_answered"], receipt["checked"]) == (["1"], ["2"], True)
    assert receipt == {**done.receipt} and receipt["files"].keys() == found.keys()


def test_the_receipt_is_printed_and_added_to_those_before(folder):
    (folder / "numpy.py").write_text("")  # does not come along
    first, second = pack(folder), pack(folder, now=NOON.replace(hour=13), checked=None)
    receipts = "\n".join([*first.lines, "", *second.lines, "", ""])
    assert (folder.parent / "ada-receipts.txt").read_text() == receipts
    assert first.receipt["content"] == second.receipt["content"] and first.receipt["content"][:16] in receipts
    assert [text in receipts for text in ("2026-03-01", "(4 files)", "1 of 2", "not checked", "numpy.py")] == [True] * 5
    assert [line[:9] for line in first.lines if line not in first.new] == ["Questions", "Not there"]
    assert second.new == second.lines  # nothing was checked
    assert "It replaces" not in first.lines[-1] and "It replaces" in second.lines[-1]
    assert json.loads(content(second.path)["receipt.json"])["checked"] is False
    assert "numpy.py" not in content(second.path)
    elsewhere = pack(folder, now=NOON.replace(year=2027), out=folder.parent / "new")
    assert elsewhere.receipt["content"] == first.receipt["content"]
    (folder / "helpers.py").write_text("x = 2")
    assert pack(folder).receipt["content"] != first.receipt["content"]


def test_partners_are_named_in_the_course_file(folder):
    for given, course, found in (
        (["bob", "Bob", "ada"], '{"student": "ada"}', ["bob"]),
        ([], '{"student": "ada", "with": ["carl"]}', ["carl"]),
        (["bob"], '{"student": "ada", "with": ["carl"]}', ["bob"]),
    ):
        (folder / "course.json").write_text(course)
        done = pack(folder, partners=given)
        assert json.loads(content(done.path)["course.json"])["with"] == found
        assert done.lines[0].endswith(f"ada, {found[0]}")
    with pytest.raises(CheckError, match="a/b"):
        pack(folder, partners=["a/b"])


def test_without_an_id_it_says_how_to_give_one_and_the_answers_may_know_it(folder):
    (folder / "course.json").unlink()
    assert pack(folder).path.name == "ada.zip"
    (folder / "answers.json").unlink()
    with pytest.raises(CheckError, match="rotflex submit --student YOUR-ID"):
        pack(folder)
    assert pack(folder, student="bob").path.name == "bob.zip"


def test_the_zip_does_not_lie_in_what_it_holds_and_a_place_that_cannot_be_written_is_told(folder, tmp_path):
    for place in (folder, folder / "out", folder.parent / "ada.zip"):
        with pytest.raises(CheckError, match="--out"):
            pack(folder, out=place)
    (tmp_path / "file").write_text("")
    with pytest.raises(CheckError, match="--out"):
        pack(folder, out=tmp_path / "file")
    assert sorted(path.name for path in folder.parent.iterdir()) == ["work"]


def test_large_outputs_are_left_out_and_told_and_small_ones_stay(folder):
    own = notebook(*NOTEBOOK["cells"])
    small = [{"output_type": "stream", "name": "stdout", "text": "3.5"}]
    own["cells"][0]["outputs"] = small
    own["cells"][1]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": "x" * MAX_OUTPUT}]
    own["metadata"]["widgets"] = {"state": "y" * 1000}
    data, dropped = slim(saved(own))
    assert dropped == 1
    slimmed = json.loads(data)
    assert [cell["outputs"] for cell in slimmed["cells"]] == [small, []]
    assert slimmed["metadata"] == NOTEBOOK["metadata"]
    assert [cell["source"] for cell in slimmed["cells"]] == [cell["source"] for cell in own["cells"]]
    (folder / NAME).write_bytes(saved(own))
    assert any("1 cell " in line for line in pack(folder).lines)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere, names of folders are Unicode")
def test_a_folder_with_a_name_that_is_no_utf8_is_packed_with_a_receipt(folder):
    work = folder.parent / os.fsdecode(b"R\xe9gulation") / "work"
    work.parent.mkdir()
    done = pack(folder.rename(work))
    assert content(done.path).keys() == {NAME, "answers.json", "course.json", "helpers.py", "receipt.json"}
    assert done.receipts.read_text(encoding="utf-8") == "\n".join([*done.lines, "", ""])
