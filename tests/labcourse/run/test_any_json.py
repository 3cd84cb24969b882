"""Any JSON value anywhere in a file of a student's folder costs at most this file, in words and without a traceback."""

import copy
import json
import os
import sys
import tempfile
import zipfile
from datetime import datetime
from pathlib import Path

import nbformat
import pytest
from any_json import ANSWERS, COURSE, one_damaged
from hypothesis import given, settings
from made_notebooks import ANSWER, answer, code, locked, notebook, saved, text

from labcourse import course_file
from labcourse.answers import answers, reflection, schema
from labcourse.answers.notebooks import Notebook
from labcourse.errors import AnswerError, ConfigurationError, CourseError
from labcourse.problems import Code, has
from labcourse.run import check, from_notebook, restore, student_folder, submit
from labcourse.session import Session
from rotflex.course.questions import CATALOGUE

FIRST, BROKEN = "01_swing.ipynb", "02_finding_stiffness.ipynb"


def words(name, question, part):
    grading = {**ANSWER, "grade_id": name, "cell_type": "markdown"}
    about = {"question": question, "part": part}
    return {**text(name, "Because."), "metadata": {"nbgrader": grading, "labcourse": about}}


MASTER = notebook(
    text("title", "# Swing"),
    code("parameters", 'student = ""', ["parameters"]),
    words("why", "2.11", "explanation"),
    answer("q1", "omega_n = None\n# Your code here."),
    locked("q1-answer", 'lab.answer("2.11", omega_n=omega_n)'),
)
MASTERS = {FIRST: MASTER, BROKEN: MASTER}
NEW = copy.deepcopy(MASTER)
NEW["cells"][0]["attachments"] = {"a.png": {"image/png": "AAAA"}}
NEW["cells"][3] |= {"source": ["omega_n = 20.0\n", "omega_n"], "execution_count": 3}
NEW["cells"][3]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": ["20.0"]}]
NEW["metadata"]["widgets"] = {"state": {}}


def laid(folder, files):
    for name, content in files.items():
        folder.joinpath(name).parent.mkdir(parents=True, exist_ok=True)
        folder.joinpath(name).write_bytes(content)
    return folder


@pytest.fixture(scope="module", autouse=True)
def _nothing_is_run():
    """Instead of the kernels' book of answers, the check gets the one that is to be compared with it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(check, "_run", lambda work, *_others: (work.hand_in.claim, schema.read_reports(b"")))
        yield


@settings(max_examples=300, deadline=None, derandomize=True)
@given(one_damaged(BROKEN, NEW))
def test_the_other_files_are_read_and_this_one_is_or_is_named(broken):
    name, content = broken
    good = {FIRST: saved(NEW), BROKEN: saved(NEW)}
    good |= {"answers.json": json.dumps(ANSWERS).encode(), "course.json": json.dumps(COURSE).encode()}
    with tempfile.TemporaryDirectory() as scratch:
        folder = laid(Path(scratch, "work"), {**good, name: content})
        _packed_and_checked(folder, name)
        _session(folder, name)
        _mended(folder, name)


def _packed_and_checked(folder, name):
    work = student_folder.read(folder, list(MASTERS), catalogue=CATALOGUE)
    assert work.hand_in.notebooks[FIRST] == Notebook.read(saved(NEW)).cells
    assert (BROKEN in work.hand_in.notebooks) != has(Code.NOTEBOOK_UNREAD, work.problems, BROKEN)
    for act in (
        lambda: submit.submit(folder, MASTERS, CATALOGUE, student="ada"),
        lambda: check.check(folder, MASTERS, CATALOGUE, student="ada"),
    ):
        try:
            act()
        except CourseError as error:  # partners that cannot be any, as a person would write them
            assert name == "course.json" and "with" in str(error).casefold()


def _session(folder, name):
    assert from_notebook.saved_cells(folder / FIRST)
    from_notebook.saved_cells(folder / BROKEN)
    try:
        course_file.bench_policy(folder)
        reflection.silence(course_file.of(folder), datetime.now().astimezone())
        lab = Session("ada", folder, CATALOGUE, {}, 1)
    except ConfigurationError as error:
        assert name == "course.json" and name in str(error)
        return
    lab.refresh()
    broken = has(Code.TEXTS_UNREAD, lab.saved_texts.notices, BROKEN)
    assert not broken or name == BROKEN
    lab.print_notices()
    try:
        assert lab.value("2.11", "omega_n", 20.0) == 20.0 or name == "answers.json"
    except AnswerError as error:
        assert name == "answers.json" and "2.11" in str(error)
    lab.summary()
    lab.observed("2.9")
    lab.answer("2.11", omega_n=21.0)
    assert answers.parse((folder / "answers.json").read_bytes())["answers"]["2.11"]["omega_n"]["value"] == 21.0


def _mended(folder, name):
    try:
        list(restore.restore(folder, MASTERS, [BROKEN]))
    except CourseError as error:
        assert name == BROKEN and name in str(error)
        return
    nbformat.v4.reads((folder / BROKEN).read_text(encoding="utf-8"))
    assert list(restore.restore(folder, MASTERS, [BROKEN]))[-1] == f"{BROKEN}: all that is the course's is there."
    restore.mend((folder / BROKEN).read_bytes(), MASTERS[BROKEN], "another release")


NOT_UTF_8 = os.fsdecode(b"02_\xff.ipynb")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
def test_a_file_name_that_is_no_utf_8_is_named_and_all_else_is_packed(tmp_path):
    folder = laid(
        tmp_path / "work", {FIRST: saved(NEW), NOT_UTF_8: b"{}", os.fsdecode(b"\xfe.csv"): b"1", "a.csv": b"2"}
    )
    done = submit.submit(folder, MASTERS, CATALOGUE, student="ada")
    with zipfile.ZipFile(done.path) as packed:
        assert {FIRST, "a.csv"} <= set(packed.namelist())
    told = "\n".join(done.lines).encode().decode()
    assert "02_?.ipynb" in told and "?.csv" in told


@pytest.mark.parametrize(("source", "becomes"), [(["a", 1], "a1"), (5, "5"), (None, ""), ({"a": 1}, '{"a": 1}')])
def test_a_source_that_is_no_text_is_given_back_as_one(source, becomes):
    broken = notebook(*MASTER["cells"], {**code("mine", ""), "source": source})
    done, lines = restore.mend(saved(broken), MASTER)
    nbformat.validate(nbformat.from_dict(done))
    assert ("".join(done["cells"][-1]["source"]), len(lines)) == (becomes, 1)
