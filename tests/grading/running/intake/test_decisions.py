"""Which of several files counts, and what an instructor decides otherwise; programs in place of notebooks."""

import json
from datetime import UTC, datetime

import pytest
from checkout import ROOT
from packings import WANTED, lay, notebook, work, zipped

from labcourse.answers.notebooks import as_released
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.running import intake
from labcourse.grading.running.intake import OWNER, TIME, scripts
from labcourse.grading.running.intake.times import parsed
from labcourse.run import alignment

A, B, C = WANTED
EARLY, LATE = datetime(2026, 11, 20, 9, 0, tzinfo=UTC), datetime(2026, 11, 20, 9, 1, tzinfo=UTC)
ANSWERED, EMPTY = notebook(A, "x = 1"), notebook(A, "")
MASTERS = {name: {cell["id"]: cell for cell in json.loads(notebook(name, ""))["cells"]} for name in WANTED}


def read(root, decisions=None):
    (submission,) = intake.find(root).submissions
    (delivered,) = intake.read(submission, WANTED, MASTERS, decisions=decisions)
    return delivered


def source_of_first(delivered):
    return delivered.notebooks[A][0].source


COPY = "01_first_look (1).ipynb"
FULLER = notebook(A, "x = 1").replace(b"pass  # q1-2", b"y = 2  # longer")


@pytest.mark.parametrize(
    ("plain", "copy", "taken"),
    [
        ((EARLY, EMPTY), (LATE, ANSWERED), COPY),
        ((LATE, EMPTY), (EARLY, ANSWERED), COPY),  # who downloaded the course again has not emptied their work
        ((LATE, ANSWERED), (EARLY, FULLER), A),
        ((EARLY, FULLER), (LATE, ANSWERED), COPY),
        ((LATE, ANSWERED), (LATE, FULLER), COPY),
        ((LATE, ANSWERED), (LATE, ANSWERED), A),
        ((LATE, b"{"), (EARLY, ANSWERED), COPY),
    ],
    ids=["newer", "newer but empty", "newer original", "newer copy", "fuller", "equal", "unreadable"],
)
def test_of_two_files_the_newer_counts_else_the_fuller_and_both_are_named(tmp_path, plain, copy, taken):
    for name, (when, content) in ((A, plain), (COPY, copy)):
        lay(tmp_path / "ada", {name: content}, when)
    delivered = read(tmp_path)
    (doubt,) = delivered.doubts
    other = A if taken == COPY else COPY
    assert (doubt.submission, doubt.about, doubt.assumed, doubt.alternatives) == ("ada", A, taken, other)
    (note,) = delivered.notes
    assert taken in note and other in note and doubt.why in note

    decided = read(tmp_path, {("ada", A): other})
    other_content = plain[1] if other == A else copy[1]
    if other_content != b"{":
        assert source_of_first(decided) == json.loads(other_content)["cells"][0]["source"]


def test_a_decision_for_a_file_that_is_not_there_is_reported(tmp_path):
    lay(tmp_path / "ada", {A: ANSWERED, COPY: EMPTY})
    delivered = read(tmp_path, {("ada", A): "02.ipynb"})
    assert source_of_first(delivered) == "x = 1"
    assert "'02.ipynb'" in intake.problems([delivered])[0]


def test_an_instructor_decides_owner_and_time(tmp_path):
    lay(tmp_path, {"my work.zip": zipped(work(None)), "cleo.zip": zipped(work("cleo"))})
    lay(tmp_path, {"loose.ipynb": notebook(A)})
    roster = [StudentRecord("ada"), StudentRecord("bob"), StudentRecord("cleo")]
    found = intake.find(tmp_path, roster)
    assert [one.student for one in found.submissions] == ["cleo", "my work"]  # who is not on the roster
    assert [one.submission for one in found.doubts if one.about == OWNER] == ["loose.ipynb", "my work.zip"]
    decisions = {
        ("my work.zip", OWNER): "ada",
        ("loose.ipynb", OWNER): "bob",
        ("cleo.zip", OWNER): "nobody at all",
        ("cleo.zip", TIME): "2026-11-19 08:00",
    }
    found = intake.find(tmp_path, roster, decisions=decisions)
    assert [one.student for one in found.submissions] == ["ada", "bob", "cleo"]
    (piece,) = found.submissions[2].pieces
    assert piece.received == parsed("2026-11-19 08:00") and any("nobody at all" in one for one in found.ignored)


def test_an_empty_notebook_that_came_later_does_not_replace_an_answered_one(tmp_path):
    monday = {A: ANSWERED, B: notebook(B, "")}
    friday = {A: EMPTY, B: notebook(B, "x = 2"), C: notebook(C, "")}
    for name, files, when in (("ada (1).zip", monday, EARLY), ("ada (2).zip", friday, LATE)):
        lay(tmp_path, {name: zipped(files, when)})
    (submission,) = intake.find(tmp_path).submissions
    read = intake.read(submission, WANTED, MASTERS)
    counts = intake.newest([item for one in read for item in one.items()], WANTED)[0].notebooks
    assert [counts[name][0].source for name in WANTED] == ["x = 1", "x = 2", ""]
    (note,) = intake.notes(read)
    assert A in note and "ada (2).zip" in note


def test_a_page_in_place_of_a_notebook_is_named(tmp_path):
    lay(tmp_path / "ada", {A: ANSWERED, B.replace(".ipynb", ".md"): b"# Text", C: notebook(C)})
    (problem,) = intake.problems([read(tmp_path)])
    assert B.replace(".ipynb", ".md") in problem and B in problem


@pytest.mark.parametrize("partner", ["bob", ["bob"]])
def test_a_partner_may_stand_in_a_list_or_alone(tmp_path, partner):
    lay(tmp_path / "ada", {A: ANSWERED, "course.json": json.dumps({"student": "ada", "with": partner}).encode()})
    assert [one.student for one in intake.find(tmp_path).submissions] == ["ada", "bob"]


def test_a_notebook_that_is_packed_by_itself_is_named(tmp_path):
    lay(tmp_path / "ada", {A: ANSWERED, f"{B}.gz": b"\x1f\x8b", C: notebook(C)})
    assert any(f"{B}.gz" in problem for problem in intake.problems([read(tmp_path)]))


# --- programs in place of notebooks -----------------------------------------------------------------------------------

RELEASED = json.loads((ROOT / "notebooks" / "02_finding_stiffness.ipynb").read_text(encoding="utf-8"))
ANSWERS = {
    "q2-10": "# mine\ndef spectrum(x, dt):\n    return x\n\n\nf_hz = 1",
    "q2-11-explanation": "Because\n\nof it.",
}


def exported(cells, form):
    """A program as JupyterLab exports it, with or without numbers of cells, and as VS Code does."""
    parts = []
    for cell in cells:
        if cell.kind == "code":
            mark = {"lab": "# In[7]:\n\n\n", "plain": "", "code": "# %%\n"}[form]
            parts.append(f"{mark}{cell.source}")
        elif form != "plain":
            mark = "# %% [markdown]\n" if form == "code" else ""
            parts.append(mark + "\n".join(f"# {line}" for line in cell.source.split("\n")))
    return "\n\n\n".join(["#!/usr/bin/env python", *parts]).encode()


def first_line(source):
    return source.partition("\n")[0]


@pytest.mark.parametrize("form", ["lab", "plain", "code"])
def test_an_exported_program_holds_the_same_cells(form):
    master = RELEASED["cells"]
    banner = {cell.id: first_line(cell.source) for cell in as_released(RELEASED)}
    answers = {name: f"{banner[name]}\n{text}" for name, text in ANSWERS.items()}
    cells = as_released(RELEASED, answers)
    again = {cell.id: cell.source for cell in scripts.cells_of(exported(cells, form), master) if cell.id}
    for cell in cells:
        if cell.kind == "code":
            assert again[cell.id].strip() == cell.source.strip(), cell.id
    text = "q2-11-explanation"
    assert (again[text] == answers[text]) if form != "plain" else text not in again
    roles = [one.what for one in alignment.align(master, scripts.cells_of(exported(cells, form), master)).changes]
    assert alignment.Happened.CHANGED not in roles and alignment.Happened.MOVED not in roles


def test_a_program_is_taken_for_the_missing_notebook_and_another_is_named(tmp_path):
    masters = {**MASTERS, "02_finding_stiffness.ipynb": {cell["id"]: cell for cell in RELEASED["cells"]}}
    files = {
        "02_finding_stiffness.py": exported(as_released(RELEASED), "lab"),
        "01_first_look.py": b"omega_n = 21\n",
        "03_results.py": b"G = 2\n",
        "03_results.ipynb": notebook(C),
    }
    lay(tmp_path / "ada", files)
    (submission,) = intake.find(tmp_path).submissions
    (delivered,) = intake.read(submission, [*WANTED, "02_finding_stiffness.ipynb"], masters)
    assert set(delivered.notebooks) == {C, "02_finding_stiffness.ipynb"}
    assert "'02_finding_stiffness.py'" in delivered.notes[0]
    assert "03_results.py" in delivered.files and "02_finding_stiffness.py" not in delivered.files
    (problem,) = intake.problems([delivered])
    assert "'01_first_look.py'" in problem and ".ipynb" in problem
