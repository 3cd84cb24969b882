"""Which version of a notebook counts: the term of ``versions_table.py``, graded week by week and all at once."""

import pytest
from command_line import rotflex, said
from versions_class import VersionsClass
from versions_table import FREE, TABLE

from labcourse.grading import batch
from labcourse.problems import Code, Problem


def expected(rows):
    """Student and assignment → the points that must count, by the table."""
    return {where: text and pytest.approx(eval(text)) for row in rows for where, text in row.counts.items()}


@pytest.fixture(scope="module")
def weekly(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        there = VersionsClass(tmp_path_factory.mktemp("weekly"), patch, TABLE)
        there.live()
        yield there


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        there = VersionsClass(tmp_path_factory.mktemp("free"), patch, FREE, per_day=0)
        there.live()
        yield there


@pytest.fixture(scope="module")
def at_once(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        there = VersionsClass(tmp_path_factory.mktemp("at once"), patch, TABLE)
        there.grade_all([row for row in TABLE if not row.acts])
        yield there


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.title)
def test_the_version_counts_that_the_table_names(weekly, row):
    counts, states = weekly.counts(), weekly.states()
    assert {where: counts[where] for where in row.counts} == expected([row])
    assert {where: states[where] for where in row.states} == row.states


def test_what_persons_decided_does_not_depend_on_when_it_was_graded(weekly, at_once):
    # Acts on a version that is not graded yet, and hand-ins for one assignment, need the calendar.
    rows = [row for row in TABLE if not row.acts and not any(one.assignment for one in row.hand_ins)]
    once, each_day = at_once.counts(), weekly.counts()
    where = [place for row in rows for place in row.counts]
    assert {place: once[place] for place in where} == {place: each_day[place] for place in where}


@pytest.mark.parametrize("row", FREE, ids=lambda row: row.title)
def test_where_lateness_costs_nothing_the_newest_counts_unless_marks_were_given_back(free, row):
    counts = free.counts()
    assert {where: counts[where] for where in row.counts} == expected([row])


# --- what is said, decided and run ------------------------------------------------------------------------------------


def about(run, code):
    """The notebooks about which a run has such a note."""
    return [note.where for note in run.notes if isinstance(note, Problem) and note.code is code]


def test_a_student_reads_which_of_their_versions_do_not_count(weekly):
    in_02, in_03 = "02_stiffness.ipynb", "03_motion.ipynb"
    assert about(weekly.run_of("a1"), Code.VERSION_NOT_RUN) == [in_02]
    assert about(weekly.run_of("d1"), Code.VERSION_WORTH_LESS) == [in_02, in_03]
    assert about(weekly.run_of("v1"), Code.EMPTY_BESIDE_ANSWERED) == [in_02]
    assert not about(weekly.run_of("u1"), Code.VERSION_NOT_RUN)


@pytest.mark.parametrize("student", ["a1", "d1", "f2"])
def test_each_notebook_is_said_to_be_from_the_hand_in_that_counts(weekly, student):
    run = weekly.run_of(student)
    arrived = [note.parameters for note in run.notes if isinstance(note, Problem) and note.code is Code.ARRIVED]
    said = [(name, note["time"]) for note in arrived for name in note["names"]]
    counts = {f"{one['notebook']}.ipynb": one["received"] for one in run.versions if one["counts"]}
    assert len(said) == len(counts) and all(counts[name].startswith(time[:10]) for name, time in said)


def test_a_pair_is_run_once(weekly, at_once):
    # f1's folder with 02 alone, and with 03; nothing of it again for f2.
    assert (weekly.runs["f1"], at_once.runs["f1"]) == (2, 1)


def test_what_came_after_marks_were_given_back_counts_when_it_is_taken(tmp_path, monkeypatch):
    there = VersionsClass(tmp_path, monkeypatch, FREE[:1], per_day=0)
    there.live()
    row = (Code.TODO_HANDED_IN_AGAIN, "j1")
    assert about(there.run_of("j1"), Code.VERSION_AFTER_GIVEN_BACK) == ["02_stiffness.ipynb"]
    assert row in there.tasks() and "after marks were given back" in there.take("j1", "02")
    refused = rotflex("take", there.marks, "nobody", "02", "--solutions", there.solutions)
    assert refused.exit_code == 2 and "'nobody' has handed in nothing of 02_stiffness" in said(refused)
    there.take("j1", "02", 2, "--by", "lea", "--reason", "Her laptop broke.")
    assert there.counts()["j1", "Lab 02"] == 20
    assert about(there.run_of("j1"), Code.VERSION_TAKEN) == ["02_stiffness.ipynb"] and row not in there.tasks()
    there.take("j1", "02", "--undo", "--by", "lea", "--reason", "A mistake.")
    assert there.counts()["j1", "Lab 02"] == 8


def test_a_version_that_was_not_run_is_run_when_a_person_gave_the_other_few_points(tmp_path, monkeypatch):
    (texts,) = (row for row in TABLE if row.title.startswith("a text that is replaced"))
    there = VersionsClass(tmp_path, monkeypatch, [texts, TABLE[0]])
    there.grade(texts.hand_ins)
    in_01 = ["01_spring.ipynb"]
    assert about(there.run_of("t1"), Code.VERSION_NOT_RUN) == in_01  # the text in time may have all its points
    there.say("mark", there.marks, "t1", "1.2", "why", "1", "--reason", "Read.", "--by", "tia")
    there.say("report", there.marks)
    assert about(there.run_of("t1"), Code.VERSION_TO_BE_RUN) == in_01
    assert (Code.TODO_GRADE_VERSION, "t1") in there.tasks()
    there.grade(TABLE[0].hand_ins)  # of somebody else
    there.say("mark", there.marks, "t1", "1.2", "why", "4", "--reason", "Read.", "--by", "tia")
    there.end()
    assert there.counts()["t1", "Lab 01"] == 10 * 0.9


def test_a_fault_in_reading_one_of_a_pair_does_not_end_the_batch(tmp_path, monkeypatch):
    (pair,) = (row for row in TABLE if row.title.startswith("F:"))
    there = VersionsClass(tmp_path, monkeypatch, [pair, TABLE[0]])
    read = batch.intake.read

    def broken(submission, *arguments, **options):
        if submission.student == "f1":
            raise RuntimeError("a fault of ours")
        return read(submission, *arguments, **options)

    monkeypatch.setattr(batch.intake, "read", broken)
    there.grade([*pair.hand_ins, *TABLE[0].hand_ins])
    there.end()
    assert (there.counts()["a1", "Lab 02"], there.states()["f1", "Lab 02"]) == (20, "could not be graded")


def test_a_changed_deadline_is_applied_to_who_is_not_in_the_folder(tmp_path, monkeypatch):
    row, other = TABLE[1], TABLE[0]
    there = VersionsClass(tmp_path, monkeypatch, [row, other])
    there.grade(row.hand_ins)
    settings = there.solutions / "course.toml"
    settings.write_text(settings.read_text().replace("due = 2026-11-13", "due = 2026-11-15"))
    there.grade(other.hand_ins)
    assert there.counts()["b1", "Lab 02"] == 20
