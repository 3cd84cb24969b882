"""A decision in ``intake.csv`` holds when a class is graded again, and can be changed back."""

import csv
import json
import os
import shutil
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from labcourse.errors import GradingError
from labcourse.grading.assignments import Handed, State, works
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.gradebook import DECIDED, Arrival, Delivery, StudentRecord, roster
from labcourse.grading.intake import find, found_digest
from labcourse.grading.marks import UNDECIDED, Status
from labcourse.grading.reports import intake_table
from labcourse.grading.settings import CourseSettings, Deadline, LateSettings
from labcourse.grading.submission import Doubt
from labcourse.problems import Code, Problem, has
from labcourse.sentences import sentence

CELL = {"id": "q1", "cell_type": "code", "metadata": {}}


def test_the_file_that_an_instructor_decides_counts_there_and_back(fake_class):
    folder = fake_class.folder / "in" / "ada"
    folder.mkdir(parents=True)
    for name, source in (("a.ipynb", "first"), ("a (1).ipynb", "second")):
        (folder / name).write_text(json.dumps({"cells": [{**CELL, "source": source}]}))
        os.utime(folder / name, (1e9, 1e9))
    ran = []
    for decision in ("", "a (1).ipynb", "a.ipynb", "a (1).ipynb"):
        fake_class.asked.clear()
        fake_class.grade(decisions={("ada", "a.ipynb"): decision})
        if "ada" in fake_class.asked:
            ran.append(json.dumps(fake_class.asked["ada"].notebooks).count("second"))
    assert ran == [0, 1]  # each was run once: back again, its marks are known
    with fake_class.book() as book:
        assert b"second" in book.delivered("ada")[0].content


def test_the_time_that_an_instructor_decides_holds_though_it_is_later(fake_class):
    fake_class.hand_in("ada")
    fake_class.grade()
    (doubt,) = find(fake_class.folder / "in").doubts
    fake_class.grade(decisions={doubt.key: "2027-01-02 10:00"})
    with fake_class.book() as book:
        assert book.received("ada") == {"a.ipynb": Arrival(datetime(2027, 1, 2, 10, tzinfo=UTC), DECIDED)}


def test_a_time_that_an_instructor_decides_is_asked_anew_of_what_is_saved_later(fake_class):
    fake_class.hand_in("ada")
    path, folder = fake_class.folder / "in" / "ada" / "a.ipynb", fake_class.folder / "in"
    os.utime(path, (1e9, 1e9))
    (doubt,) = find(folder).doubts
    decisions = {doubt.key: "2027-01-02 10:00"}
    assert find(folder, decisions=decisions).submissions[0].pieces[0].clock == DECIDED
    os.utime(path, (2e9, 1.1e9))
    found = find(folder, decisions=decisions)
    assert (found.submissions[0].pieces[0].clock, found.doubts[0].assumed) == ("", "")
    intake_path = fake_class.folder / "intake.csv"
    assert intake_table.write(intake_path, found.doubts, {doubt: "2027-01-02 10:00"}) == 1


def test_a_file_that_comes_again_keeps_the_time_that_was_decided_for_it_and_only_others_are_asked_about(fake_class):
    late = CourseSettings(late=LateSettings(per_day=10), deadlines=(Deadline(due=datetime(2027, 1, 3, tzinfo=UTC)),))
    course = replace(fake_class.course, settings=late)

    def came(decisions):
        """When the notebook came, and the rows without a decision."""
        with fake_class.book() as book:
            batch = Batch(fake_class.folder / "in", course, book, Settings(decisions=decisions))
            assert all(step.graded for step in batch.grade())
            return book.received("ada")["a.ipynb"], [row for row in batch.doubts if not row.assumed]

    fake_class.hand_in("ada")
    mail = fake_class.folder / "in" / "ada"
    _arrival, (row,) = came({})
    decisions, decided = {row.key: "2027-01-02 10:00"}, Arrival(datetime(2027, 1, 2, 10, tzinfo=UTC), DECIDED)
    assert came(decisions) == (decided, [])
    fake_class.hand_in("ada", source="omega_n = 2")
    os.utime(mail / "a.ipynb", (1e9, 1e9))
    assert [one.key == row.key for one in came(decisions)[1]] == [False]
    fake_class.hand_in("ada")
    os.utime(mail / "a.ipynb", (1.1e9, 1.1e9))  # the same attachment, saved again
    assert came(decisions) == (decided, [])
    (mail / "data.csv").write_text("1")
    os.utime(mail / "data.csv", (1.2e9, 1.2e9))
    arrival, (other,) = came(decisions)
    assert (arrival, other.alternatives) == (decided, "saved 2008-01-10 21:20:00 UTC")
    assert came(decisions | {other.key: "2027-01-09 10:00"}) == (decided, [])
    assert came({other.key: "2027-01-09 10:00"})[0].received == datetime(2027, 1, 9, 10, tzinfo=UTC)


def test_the_owner_that_an_instructor_decides_has_the_marks_and_the_former_has_none(fake_class):
    fake_class.hand_in("ada")
    assert fake_class.grade() == {"ada": 2}
    assert fake_class.grade(decisions={("ada", "owner"): "bob"}) == {"ada": 0, "bob": 2}
    given = Problem.of(Code.GIVEN_TO_OWNER, "ada", owner="bob")
    with fake_class.book() as book:
        assert book.delivered("ada") == [] and given in book.current("ada").run.problems


DOUBT = Doubt("=1+1.zip", "a.ipynb", "a.ipynb", ("as it is newer",), "a (1).ipynb")


@pytest.mark.parametrize("separator", [",", ";"])
def test_a_decision_is_read_as_a_spreadsheet_saves_it_and_stays_on_its_row(tmp_path, separator):
    path = tmp_path / "intake.csv"
    assert intake_table.write(path, [DOUBT], {}) == 1
    with open(path, encoding="utf-8-sig", newline="") as file:
        heading, row = csv.reader(file)
    assert heading[-1] == "decision" and not any(cell.startswith("=") for cell in row)
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=separator).writerows([heading, [*row[:-1], "a (1).ipynb"]])
    earlier = intake_table.read(path)
    assert earlier == {DOUBT: "a (1).ipynb"}
    assert intake_table.write(path, [], earlier) == 0  # graded without this submission
    assert intake_table.read(path) == earlier
    assert intake_table.write(path, [], {DOUBT: ""}) == 1  # another download has not got it: it still waits
    assert intake_table.write(path, [], {DOUBT: ""}, {DOUBT.submission}) == 0 and not path.exists()


def test_reasons_are_said_in_the_table_and_are_texts_when_it_is_read(tmp_path):
    path = tmp_path / "intake.csv"
    why = (Problem.of(Code.CALLED_LIKE_NOBODY), Problem.of(Code.COURSE_FILE_NAMES, named="ada"))
    row = Doubt("work.zip", "owner", "", why, "ada")
    intake_table.write(path, [row], {})
    ((read, decision),) = intake_table.read(path).items()
    assert (read.key, read.why, decision) == (row.key, (" ".join(map(sentence, why)),), "")
    assert intake_table.write(path, [], {read: "bob"}) == 0
    assert intake_table.read(path) == {read: "bob"}


def test_a_table_is_read_whole_or_refused(tmp_path, monkeypatch):
    path = tmp_path / "intake.csv"
    intake_table.write(path, [DOUBT], {DOUBT: "ada"})
    size = path.stat().st_size
    monkeypatch.setattr(roster, "MAX_TABLE", size)
    assert intake_table.read(path) == {DOUBT: "ada"}
    monkeypatch.setattr(roster, "MAX_TABLE", size - 1)
    with pytest.raises(GradingError):
        intake_table.read(path)
    path.write_text("submission,about\n", encoding="utf-8")
    with pytest.raises(GradingError, match="'assumed'"):
        intake_table.read(path)


MONDAY, TUESDAY = datetime(2026, 11, 23, tzinfo=UTC), datetime(2026, 11, 24, tzinfo=UTC)


@pytest.mark.parametrize(("source", "received"), [("ada.zip", TUESDAY), ("other.zip", MONDAY)])
def test_a_decided_time_replaces_that_of_its_own_submission_only(fake_class, source, received):
    with fake_class.book() as book:
        book.deliver("ada", [Delivery("a.ipynb", "digest", b"{}", MONDAY, "ada.zip", "the list of times")])
        book.deliver("ada", [Delivery("a.ipynb", "digest", b"{}", TUESDAY, source, DECIDED)])
        assert book.received("ada")["a.ipynb"].received == received


def test_a_submission_that_is_given_over_leaves_one_of_the_same_name_of_another_day(fake_class):
    with fake_class.book() as book:
        for student, when in (("ada", MONDAY), ("bob", TUESDAY)):
            book.deliver(student, [Delivery("a.ipynb", student, b"{}", when, "work.zip")])
        assert book.delete_of_others("work.zip", TUESDAY, ["cleo"]) == ["bob"]
        assert book.delivered("ada") and not book.delivered("bob")


def in_class(fake_class, *students):
    """Put students on the roster."""
    names = fake_class.folder / "roster.csv"
    names.write_text("".join(["id,name\n", *(f"{one},{one.title()} Name\n" for one in students)]), encoding="utf-8")
    with fake_class.book() as book:
        book.import_roster(names)


def ask_in_its_notebook(fake_class, monkeypatch):
    """Let the questions of the made-up key be those of the notebook that is handed in."""
    receive = Batch._receive
    names = [f"{fake_class.course.notebook_of(number)}.ipynb" for number in ("2.11", "0.1")]

    def receive_and_ask(batch, submission):
        found = found_digest(submission)
        receive(batch, submission)
        submission.waiting = {name: students for students in submission.waiting.values() for name in names}
        submission.prepared_from = batch._prepared_from(submission, found)

    monkeypatch.setattr(Batch, "_receive", receive_and_ask)


@pytest.mark.parametrize(("decision", "bobs"), [("yes", "right"), ("no", None)])
def test_a_partner_whom_only_a_course_file_names_waits_for_a_person(fake_class, monkeypatch, decision, bobs):
    ask_in_its_notebook(fake_class, monkeypatch)
    in_class(fake_class, "ada", "bob")
    fake_class.hand_in("ada")
    course = {"student": "ada", "with": ["bob"]}
    (fake_class.folder / "in" / "ada" / "course.json").write_text(json.dumps(course), encoding="utf-8")
    assert fake_class.grade() == {"ada": 2, "bob": 0}
    with fake_class.book() as book:
        waits = [mark for mark in book.current("bob").marks if mark.status == Status.UNCONFIRMED]
        assert waits and not any(mark.given for mark in book.current("bob").marks) and not book.delivered("bob")
        assert {mark.status for mark in book.current("bob").marks} <= {*UNDECIDED}
        work = works(fake_class.course, Handed(StudentRecord("bob"), book.current("bob").marks))
        assert State.WAITS in {one.state for one in work.values()}
        assert {mark.reason for mark in waits} == {Problem.of(Code.PARTNER_NOT_CONFIRMED)}
        assert Problem.of(Code.CONFIRMATION_NEEDED, names=["ada"]) in book.current("bob").run.problems
        assert has(Code.PARTNERS_UNCONFIRMED, book.current("ada").run.problems)
    found = find(fake_class.folder / "in", [StudentRecord("ada"), StudentRecord("bob")])
    (row,) = [row for row in found.doubts if row.about == "partner"]
    fake_class.grade(decisions={row.key: decision})
    with fake_class.book() as book:
        statuses = {mark.status for mark in book.current("bob").marks if mark.out_of}
        assert Status.UNCONFIRMED not in statuses and (bobs is None or bobs in statuses)
        assert bobs or statuses == {Status.MISSING}
    assert fake_class.grade(decisions={row.key: decision})["ada"] == 2


def test_nobody_waits_for_a_claim_that_was_taken_back(fake_class, monkeypatch):
    ask_in_its_notebook(fake_class, monkeypatch)
    in_class(fake_class, "ada", "bob")
    fake_class.hand_in("ada")
    path = fake_class.folder / "in" / "ada" / "course.json"
    for partners, expected in ((["bob"], Status.UNCONFIRMED), ([], Status.MISSING)):
        path.write_text(json.dumps({"student": "ada", "with": partners}), encoding="utf-8")
        fake_class.grade()
        with fake_class.book() as book:
            assert {mark.status for mark in book.current("bob").marks} == {expected}


def test_nothing_changes_until_it_is_known_which_platform_named_a_download(fake_class):
    """A file of Canvas, of which the student's part is a class-mate's as Moodle would call it."""
    in_class(fake_class, "ada", "bob")
    fake_class.hand_in("bob")
    before = fake_class.grade()
    folder = fake_class.folder / "download" / "adaname_12_34_x-Bob Name_1234_assignsubmission_file_work"
    folder.mkdir(parents=True)
    (folder / "a.ipynb").write_text(json.dumps({"cells": [{**CELL, "source": "spoilt = 1"}]}))
    with fake_class.book() as book:
        stored = (book.stored("ada"), book.stored("bob"), book.current("bob"))
        batch = Batch(folder.parent, fake_class.course, book)
        assert batch.students == [] and [(row.about, row.assumed) for row in batch.doubts] == [("platform", "")]
        assert list(batch.grade()) == [] and before["bob"] == 2
        assert stored == (book.stored("ada"), book.stored("bob"), book.current("bob"))
        assert Batch(folder.parent, fake_class.course, book, Settings(platform="canvas")).students == ["ada"]
        (row,) = batch.doubts
        assert Batch(folder.parent, fake_class.course, book, Settings(decisions={row.key: "Moodle"})).students == [
            "bob"
        ]


def test_who_was_erased_is_named_and_not_asked_about_though_a_platform_names_only_the_name(fake_class):
    in_class(fake_class, "ada", "fay")
    fake_class.hand_in("ada", "fay")
    assert fake_class.grade() == {"ada": 2, "fay": 2}
    folder = fake_class.folder / "download" / "Fay Name_1234_assignsubmission_file_"
    folder.mkdir(parents=True)
    shutil.copy(fake_class.folder / "in" / "fay" / "a.ipynb", folder)
    (folder / "course.json").write_text(json.dumps({"student": "FAY"}))
    with fake_class.book() as book:
        book.persons.erase("fay", "lea")
        batch = Batch(folder.parent, fake_class.course, book)
        assert (batch.students, batch.doubts) == ([], [])
        (left_out,) = [one for one in batch.ignored if one.code is Code.ERASED_HANDED_IN]
        assert left_out.parameters["sources"] == [folder.name]
