"""Which of several files counts, and what an instructor decides otherwise; programs in place of notebooks."""

import json
from datetime import UTC, datetime

import pytest
from packings import WANTED, lay, notebook, work, zipped

from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake.platforms import parse_time
from labcourse.grading.reports import intake_table
from labcourse.grading.submission import OWNER, TIME_RECEIVED
from labcourse.problems import Code, Problem

A, B, C = WANTED
EARLY, LATE = datetime(2026, 11, 20, 9, 0, tzinfo=UTC), datetime(2026, 11, 20, 9, 1, tzinfo=UTC)
ANSWERED, EMPTY = notebook(A, "x = 1"), notebook(A, "")
MASTERS = {name: {cell["id"]: cell for cell in json.loads(notebook(name, ""))["cells"]} for name in WANTED}


def read(root, decisions=None):
    (submission,) = intake.find(root).submissions
    return intake.read(submission, WANTED, MASTERS, decisions=decisions)


def source_of_first(submission):
    intake.choose_newest(submission, submission.items, WANTED)
    return submission.notebooks[A][0].source


COPY = "01_first_look (1).ipynb"
OWN_CELL = {"id": "own", "cell_type": "code", "source": "y = 2", "metadata": {}}
FULLER = notebook(A, cells=[*json.loads(ANSWERED)["cells"], OWN_CELL])


@pytest.mark.parametrize(
    ("plain", "copy", "taken"),
    [
        ((LATE, ANSWERED), (EARLY, FULLER), A),
        ((EARLY, FULLER), (LATE, ANSWERED), COPY),
        ((LATE, ANSWERED), (LATE, FULLER), COPY),
        ((LATE, b"{"), (EARLY, EMPTY), COPY),
    ],
    ids=["newer original", "newer copy", "fuller", "unreadable or empty"],
)
def test_of_two_files_the_newer_counts_else_the_fuller_and_both_are_named(tmp_path, plain, copy, taken):
    for name, (when, content) in ((A, plain), (COPY, copy)):
        lay(tmp_path / "ada", {name: content}, when)
    delivered = read(tmp_path)
    (doubt,) = delivered.doubts
    other = A if taken == COPY else COPY
    assert (doubt.submission, doubt.about, doubt.assumed, doubt.alternatives) == ("ada", A, taken, other)
    about = {"count": 2, "chosen": taken, "why": doubt.why[0], "files": [other]}
    assert delivered.notes == [Problem.of(Code.ONE_OF_SEVERAL, A, **about)]

    decided = read(tmp_path, {("ada", A): other})
    other_content = plain[1] if other == A else copy[1]
    if other_content != b"{":
        assert source_of_first(decided) == json.loads(other_content)["cells"][0]["source"]


@pytest.mark.parametrize("other", [(EARLY, ANSWERED), (LATE, EMPTY)], ids=["equal", "empty"])
def test_a_file_in_which_nothing_else_is_written_is_no_row(tmp_path, other):
    for name, (when, content) in ((A, (LATE, ANSWERED)), (COPY, other)):
        lay(tmp_path / "ada", {name: content}, when)
    delivered = read(tmp_path)
    assert source_of_first(delivered) == "x = 1" and (delivered.doubts, delivered.notes) == ([], [])


def test_a_decision_for_a_file_that_is_not_there_is_reported(tmp_path):
    lay(tmp_path / "ada", {A: ANSWERED, COPY: EMPTY})
    delivered = read(tmp_path, {("ada", A): "02.ipynb"})
    assert source_of_first(delivered) == "x = 1"
    assert intake.unread_problems(delivered)[0] == Problem.of(Code.DECISION_ON_NO_FILE, A, file="02.ipynb")


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
        ("cleo.zip", TIME_RECEIVED): "2026-11-19 08:00",
    }
    found = intake.find(tmp_path, roster, decisions=decisions)
    assert [one.student for one in found.submissions] == ["ada", "bob", "cleo"]
    (piece,) = found.submissions[2].pieces
    assert piece.received == parse_time("2026-11-19 08:00")
    assert Problem.of(Code.DECIDED_OWNER_UNKNOWN, "cleo.zip", owner="nobody at all") in found.ignored


def test_an_instructor_may_decide_that_something_counts_for_nobody(tmp_path):
    lay(tmp_path, {"old.ipynb": notebook(A), "ada.zip": zipped(work("ada"))})
    roster, row = [StudentRecord("ada")], ("old.ipynb", OWNER)
    assert any("old.ipynb" in one.parameters["files"] for one in intake.find(tmp_path, roster).ignored)
    found = intake.find(tmp_path, roster, decisions={row: "Nobody"})
    assert [one.student for one in found.submissions] == ["ada"] and found.ignored == []
    assert [one.submission for one in found.doubts if one.about == OWNER] == ["old.ipynb"]  # the decision stays


def test_an_answer_that_is_shorter_than_the_text_that_it_replaces_is_an_answer(tmp_path):
    released = notebook(A, "x = None\n# Your code here.")
    masters = MASTERS | {A: {cell["id"]: cell for cell in json.loads(released)["cells"]}}
    for name, answer, when in (("ada (1).zip", "x = 1  # as it is in the book", EARLY), ("ada (2).zip", "x = 2", LATE)):
        lay(tmp_path, {name: zipped({A: notebook(A, answer)}, when)})
    (submission,) = intake.find(tmp_path).submissions
    assert source_of_first(intake.read(submission, WANTED, masters)) == "x = 2"


@pytest.mark.parametrize("partner", ["bob", ["bob"]])
def test_a_partner_may_stand_in_a_list_or_alone(tmp_path, partner):
    lay(tmp_path / "ada", {A: ANSWERED, "course.json": json.dumps({"student": "ada", "with": partner}).encode()})
    assert [one.student for one in intake.find(tmp_path).submissions] == ["ada", "bob"]


def test_a_program_in_place_of_a_notebook_is_named_and_comes_along(tmp_path):
    lay(tmp_path / "ada", {A: ANSWERED, B.replace(".ipynb", ".py"): b"omega_n = 21\n", C: notebook(C)})
    contents = read(tmp_path)
    (problem,) = intake.unread_problems(contents)
    why = Problem.of(Code.NO_NOTEBOOK_IN_PLACE, B, files=[B.replace(".ipynb", ".py")])
    assert problem == Problem.of(Code.NOTEBOOK_UNREAD, B, why=why)
    assert {item.name for item in contents.items} == {A, C, B.replace(".ipynb", ".py")}


def test_a_notebook_that_was_saved_as_json_is_taken_and_other_data_of_its_name_is_not(tmp_path):
    as_json = {name: name.replace(".ipynb", ".json") for name in (A, B)}
    lay(tmp_path / "ada", {as_json[A]: ANSWERED, as_json[B]: b'{"omega_n": 21}', C: notebook(C)})
    contents = read(tmp_path)
    assert [note for note in contents.notes if note.code is Code.TAKEN_BY_NAME] == [
        Problem.of(Code.TAKEN_BY_NAME, A, file=as_json[A])
    ]
    assert {item.name for item in contents.items} == {A, C, as_json[B]}
    assert [*contents.unread] == [B]


def test_what_is_decided_on_an_owner_or_a_file_holds_for_this_content_and_is_asked_of_another(tmp_path):
    folder, table = tmp_path / "in", tmp_path / "intake.csv"
    lay(folder / "bob", {A: ANSWERED}, EARLY)

    def came(scan, copy, **decide):
        """Return who has the scan, and which notebook of bob's counts, after rows without a decision got these."""
        lay(folder, {"scan.ipynb": scan})
        lay(folder / "bob", {COPY: copy}, EARLY)
        rows = {row: decision or decide.get(row.submission, "") for row, decision in intake_table.read(table).items()}
        decisions = {row.key: decision for row, decision in rows.items() if decision}
        found = intake.find(folder, [StudentRecord("ada"), StudentRecord("bob")], decisions=decisions)
        for one in found.submissions:
            found.doubts.extend(intake.read(one, WANTED, MASTERS, decisions=decisions).doubts)
        asked = [doubt for doubt in found.doubts if doubt.about != TIME_RECEIVED]
        intake_table.write(table, [*asked, *asked], rows, found.read)  # partners have the same rows
        with_scan = [one.student for one in found.submissions for piece in one.pieces if piece.source == "scan.ipynb"]
        return with_scan, source_of_first(found.submissions[-1])

    def decided():
        """Return the decisions in the table."""
        return sorted(intake_table.read(table).values())

    first, second = (notebook(A, "x = 3"), notebook(A, "x = 5")), (notebook(A, "x = 4"), notebook(A, "x = 6"))
    assert came(*first) == ([], "x = 1")
    assert came(*first, **{"scan.ipynb": "ada", "bob": COPY}) == (["ada"], "x = 5")
    assert came(*second) == ([], "x = 1") and decided() == ["", "", COPY, "ada"]
    assert came(*first) == (["ada"], "x = 5")

    text = table.read_text(encoding="utf-8-sig").replace("content", "of no meaning")  # as an earlier version wrote it
    table.write_text("\n".join(line for line in text.splitlines() if not line.endswith(",")), encoding="utf-8")
    assert came(*first) == (["ada"], "x = 5")
    assert came(*second) == ([], "x = 1") and decided() == ["", "", COPY, "ada"]
