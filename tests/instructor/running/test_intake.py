"""Submissions are read as untrusted input: what is taken, what is noted, what is refused."""

from __future__ import annotations

import json
import os
import stat
import struct
import zipfile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.errors import GradingError
from rotflex.instructor.running import intake

WANTED = {"a.ipynb": ["q1", "q2"], "b.ipynb": ["q3"]}


def cell(cell_id="q1", source="x = 1", **changes):
    return {"id": cell_id, "cell_type": "code", "source": source, "metadata": {}} | changes


def notebook(*cells):
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": list(cells)})


A = notebook(cell("q1", "x = 1"), cell("q2", ["y = 2\n", "z = 3"]), cell("other", "import os"))
B = notebook(cell("q3", "w = 4"))


def as_folder(root, files):
    for name, content in files.items():
        (root / "ada" / name).parent.mkdir(parents=True, exist_ok=True)
        (root / "ada" / name).write_text(content, encoding="utf-8")
    return intake.Submission("ada", root / "ada")


def as_zip(root, files):
    with zipfile.ZipFile(root / "ada.zip", "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    return intake.Submission("ada", root / "ada.zip")


@pytest.fixture(params=[as_folder, as_zip])
def taken(request, tmp_path):
    """Take in files, once from a folder and once from a zip."""
    return lambda files: intake.read(request.param(tmp_path, files), WANTED)


# --- what is taken ----------------------------------------------------------------------------------------------------


def test_only_answer_cells_are_taken_by_their_ids(taken):
    result = taken({"a.ipynb": A, "b.ipynb": B, "c.ipynb": A, "answers.json": "{}"})
    assert result.sources == {"a.ipynb": {"q1": "x = 1", "q2": "y = 2\nz = 3"}, "b.ipynb": {"q3": "w = 4"}}
    assert (result.problems, result.notes) == ([], [])


def test_the_shallowest_of_several_is_taken_and_noted_and_hidden_folders_are_not_looked_at(taken):
    result = taken(
        {
            "x/y/a.ipynb": notebook(cell("q1", "deep")),
            "x/a.ipynb": A,
            ".ipynb_checkpoints/a.ipynb": notebook(cell("q1", "old")),
            "__MACOSX/b.ipynb": "junk",
            "x/b.ipynb": B,
        }
    )
    assert result.sources["a.ipynb"]["q1"] == "x = 1"
    assert result.sources["b.ipynb"]["q3"] == "w = 4"
    assert result.problems == []
    assert len(result.notes) == 1 and "2 files a.ipynb" in result.notes[0]


def test_of_doubled_cells_the_first_is_taken_and_it_is_noted(taken):
    result = taken({"a.ipynb": notebook(cell("q1", "first"), cell("q2"), cell("q1", "second")), "b.ipynb": B})
    assert result.sources["a.ipynb"]["q1"] == "first"
    assert result.notes == ["a.ipynb: the answer cell q1 is there 2 times; the first is taken."]


def test_a_missing_cell_is_noted_and_the_others_are_taken(taken):
    result = taken({"a.ipynb": notebook(cell("q2", "y")), "b.ipynb": B})
    assert result.sources["a.ipynb"] == {"q2": "y"}
    assert result.notes == ["a.ipynb: the answer cell q1 is missing."]


def test_a_cell_that_lost_its_id_is_known_by_its_grading_metadata(taken):
    lost = cell("q1", "x", metadata={"nbgrader": {"grade_id": "q1"}})
    del lost["id"]
    assert taken({"a.ipynb": notebook(lost, cell("q2")), "b.ipynb": B}).sources["a.ipynb"]["q1"] == "x"


@pytest.mark.parametrize(
    "changes",
    [{"source": 5}, {"source": ["x", 5]}, {"source": None}, {"cell_type": "markdown"}, {"source": "\ud800"}],
    ids=["number", "list with a number", "null", "no code cell", "half a character"],
)
def test_a_malformed_cell_is_noted_and_the_others_are_taken(taken, changes):
    result = taken({"a.ipynb": notebook(cell("q1", **changes), cell("q2", "y")), "b.ipynb": B})
    assert result.sources["a.ipynb"] == {"q2": "y"}
    assert "q1 is not taken" in result.notes[0]


def test_a_cell_of_enormous_source_is_not_taken(taken):
    result = taken({"a.ipynb": notebook(cell("q1", "x" * (intake.MAX_SOURCE + 1))), "b.ipynb": B})
    assert "q1" not in result.sources["a.ipynb"]


@pytest.mark.parametrize("content", ["{", "[]", "null", '{"cells": 3}', "", "[" * 100_000, '{"worksheets": []}'])
def test_what_is_no_notebook_is_a_problem_and_the_others_are_taken(taken, content):
    result = taken({"a.ipynb": content, "b.ipynb": B})
    assert list(result.sources) == ["b.ipynb"]
    assert result.problems[0].startswith("a.ipynb cannot be read")


def test_a_notebook_that_is_not_there_is_noted(taken):
    assert taken({"b.ipynb": B}).notes == ["a.ipynb was not handed in."]


def test_a_submission_without_any_notebook_is_a_problem(taken):
    assert taken({"essay.txt": "I think that"}).problems == ["There is no notebook of the course in the submission."]


def test_a_notebook_of_enormous_size_is_refused(taken, monkeypatch):
    monkeypatch.setattr(intake, "MAX_NOTEBOOK", 1000)
    result = taken({"a.ipynb": A + " " * 1000, "b.ipynb": B})
    assert list(result.sources) == ["b.ipynb"]
    assert "more than 1000 bytes" in result.problems[0]


def test_too_many_files_are_refused(taken, monkeypatch):
    monkeypatch.setattr(intake, "MAX_ENTRIES", 10)
    result = taken({f"{number}.txt": "" for number in range(11)})
    assert result.sources == {} and "more than 10 files" in result.problems[0]


def test_the_name_of_the_submission_counts_and_a_course_file_of_somebody_else_is_noted(taken):
    result = taken({"a.ipynb": A, "b.ipynb": B, "course.json": '{"student": "Grace"}'})
    assert result.notes == ["course.json names the student 'Grace'; this counts as 'ada''s work."]
    assert taken({"a.ipynb": A, "b.ipynb": B, "course.json": '{"student": "ADA "}'}).notes == []
    assert taken({"a.ipynb": A, "b.ipynb": B, "course.json": "[["}).notes == []


# --- folders ----------------------------------------------------------------------------------------------------------


def test_links_and_pipes_in_a_folder_are_not_followed(tmp_path):
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "a.ipynb").write_text(A)
    submission = as_folder(tmp_path, {"b.ipynb": B})
    (submission.path / "a.ipynb").symlink_to(tmp_path / "secret" / "a.ipynb")
    (submission.path / "linked").symlink_to(tmp_path / "secret", target_is_directory=True)
    (submission.path / "pipes").mkdir()
    os.mkfifo(submission.path / "pipes" / "a.ipynb")
    result = intake.read(submission, WANTED)
    assert list(result.sources) == ["b.ipynb"]


def test_a_folder_that_leads_to_itself_ends(tmp_path):
    submission = as_folder(tmp_path, {"b.ipynb": B})
    (submission.path / "again").symlink_to(submission.path, target_is_directory=True)
    assert list(intake.read(submission, WANTED).sources) == ["b.ipynb"]


# --- zips -------------------------------------------------------------------------------------------------------------


def test_names_in_a_zip_that_point_elsewhere_write_nothing_anywhere(tmp_path):
    before = set(tmp_path.rglob("*"))
    submission = as_zip(tmp_path, {"../../evil/a.ipynb": A, "/etc/b.ipynb": B})
    result = intake.read(submission, WANTED)
    assert set(tmp_path.rglob("*")) - before == {submission.path}
    assert result.sources["b.ipynb"] == {"q3": "w = 4"}


def test_a_link_in_a_zip_is_not_taken_for_a_notebook(tmp_path):
    link = zipfile.ZipInfo("a.ipynb")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(tmp_path / "ada.zip", "w") as packed:
        packed.writestr(link, "/etc/passwd")
        packed.writestr("b.ipynb", B)
    assert list(intake.read(intake.Submission("ada", tmp_path / "ada.zip"), WANTED).sources) == ["b.ipynb"]


def test_a_zip_that_swells_is_read_no_further_than_the_limit(tmp_path):
    swelling = as_zip(tmp_path, {"a.ipynb": "[" + " " * (20 * intake.MAX_NOTEBOOK), "b.ipynb": B})
    assert swelling.path.stat().st_size < 200_000
    result = intake.read(swelling, WANTED)
    assert list(result.sources) == ["b.ipynb"]
    assert f"more than {intake.MAX_NOTEBOOK} bytes" in result.problems[0]


def test_a_zip_with_an_endless_table_of_contents_is_not_read(tmp_path):
    entry = b"PK\1\2" + bytes(42) + b"a"
    entry = entry[:28] + b"\1" + entry[29:]  # a name of one letter
    table = entry * (intake.MAX_DIRECTORY // len(entry) + 1)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 1, 1, len(table), 0, 0)
    (tmp_path / "ada.zip").write_bytes(table + end)
    result = intake.read(intake.Submission("ada", tmp_path / "ada.zip"), WANTED)
    assert result.problems == [
        f"The submission cannot be read: its table of contents has more than {intake.MAX_DIRECTORY} bytes."
    ]


@pytest.mark.parametrize("content", [b"", b"PK", b"this is no zip at all", b"PK\x05\x06" + b"\xff" * 18])
def test_what_is_no_zip_is_a_problem(tmp_path, content):
    (tmp_path / "ada.zip").write_bytes(content)
    result = intake.read(intake.Submission("ada", tmp_path / "ada.zip"), WANTED)
    assert result.sources == {} and "cannot be read" in result.problems[0]


def test_a_file_without_a_name_in_a_zip_is_passed_over(tmp_path):
    submission = as_zip(tmp_path, {"?name?": "", "b.ipynb": B})
    submission.path.write_bytes(submission.path.read_bytes().replace(b"?name?", b"\0name?"))
    assert list(intake.read(submission, WANTED).sources) == ["b.ipynb"]


@given(data=st.data())
def test_a_damaged_zip_never_raises(data, tmp_path_factory):
    root = tmp_path_factory.mktemp("damaged")
    path = as_zip(root, {"a.ipynb": A, "b.ipynb": B}).path
    content = bytearray(path.read_bytes())
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=8)):
        content[place] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    result = intake.read(intake.Submission("ada", path), WANTED)
    assert set(result.sources) <= set(WANTED)


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text() | st.sampled_from(["q1", "code"]),
        lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["cells", "id", "source", "metadata"]), inner),
        max_leaves=20,
    )
)
def test_json_of_any_shape_never_raises(tmp_path_factory, content):
    submission = as_folder(tmp_path_factory.mktemp("shape"), {"a.ipynb": json.dumps(content), "b.ipynb": B})
    assert intake.read(submission, WANTED).sources["b.ipynb"] == {"q3": "w = 4"}


# --- which submissions there are --------------------------------------------------------------------------------------

COMPOSED, APART = "j\u00fcrgen", "ju\u0308rgen"


def test_submissions_are_folders_and_zips_by_the_students_names(tmp_path):
    for folder in ("grace", "Ada L", ".git"):
        (tmp_path / folder).mkdir()
    (tmp_path / "emmy.ZIP").write_bytes(b"")
    (tmp_path / "readme.txt").write_text("")
    (tmp_path / "linked").symlink_to(tmp_path / "grace", target_is_directory=True)
    found, ignored = intake.submissions(tmp_path)
    assert [one.student for one in found] == ["Ada L", "emmy", "grace"]
    assert len(ignored) == 2 and any("readme.txt" in word for word in ignored)


def test_of_two_submissions_of_one_student_the_folder_is_taken_and_the_other_reported(tmp_path):
    (tmp_path / "ada.zip").write_bytes(b"")
    (tmp_path / "Ada").mkdir()
    found, ignored = intake.submissions(tmp_path)
    assert [one.path.name for one in found] == ["Ada"]
    assert "'ada.zip'" in ignored[0] and "'Ada'" in ignored[0]


@pytest.mark.parametrize(
    "name", ["grades.csv", "Gradebook.sqlite", "gradebook.sqlite-wal", "a\nb", "x" * 81, "NUL", "a:b", "ada."]
)
def test_a_name_that_cannot_be_an_id_is_reported_and_not_used(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / "ada").mkdir()
    found, ignored = intake.submissions(tmp_path)
    assert [one.student for one in found] == ["ada"]
    assert "not named by a student's ID" in ignored[0]


def test_a_name_as_macs_write_it_and_spaces_around_it_are_the_students_own(tmp_path):
    (tmp_path / APART).mkdir()
    (tmp_path / " ada .zip").write_bytes(b"")
    found, ignored = intake.submissions(tmp_path)
    assert [(one.student, one.path.name) for one in found] == [("ada", " ada .zip"), (COMPOSED, APART)]
    assert ignored == []


@pytest.mark.parametrize("other", [APART, APART.upper(), COMPOSED.upper(), f"{APART} "])
def test_names_that_differ_in_accents_capitals_or_spaces_only_are_one_students(tmp_path, other):
    (tmp_path / COMPOSED).mkdir()
    (tmp_path / f"{other}.zip").write_bytes(b"")
    found, ignored = intake.submissions(tmp_path)
    assert [one.path.name for one in found] == [COMPOSED]
    assert len(ignored) == 1 and "the same student's" in ignored[0] and repr(COMPOSED) in ignored[0]


def test_the_course_file_may_write_the_same_student_otherwise(tmp_path):
    submission = as_folder(tmp_path, {"a.ipynb": A, "b.ipynb": B, "course.json": json.dumps({"student": APART})})
    named = intake.Submission(COMPOSED, submission.path)
    assert intake.read(named, WANTED).notes == []
    other = intake.Submission("jurgen", submission.path)
    assert "names the student" in intake.read(other, WANTED).notes[0]


def test_no_folder_and_an_empty_folder_are_errors(tmp_path):
    with pytest.raises(GradingError, match="no folder"):
        intake.submissions(tmp_path / "nowhere")
    with pytest.raises(GradingError, match="no submissions"):
        intake.submissions(tmp_path)


def test_where_nothing_can_be_read_each_reason_is_told(tmp_path):
    (tmp_path / "notes.txt").write_text("x")
    (tmp_path / "ada.").mkdir()
    with pytest.raises(GradingError, match=r"There are no submissions in .*'ada\.' is not read: .*'notes\.txt'"):
        intake.submissions(tmp_path)
