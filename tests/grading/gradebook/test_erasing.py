"""A person is erased completely, and nobody else: in a file and on a real PostgreSQL server."""

import json
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import Mock

import pytest
from gradebook_dump import dump
from gradebooks import enrol, graded, mark, prose, record, report_text
from sqlalchemy import insert, select

from labcourse import clock
from labcourse.answers.cell_reports import CellReports
from labcourse.errors import GradebookError
from labcourse.grading import erasure
from labcourse.grading.gradebook import Delivery, Gradebook, StudentRecord
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.persons import MARKER, Person
from labcourse.grading.gradebook.records import Base, Excuse
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem

WHEN = datetime(2026, 3, 2, tzinfo=UTC)
WORDS, COMPARED = ("2.11", "explanation"), ("2.16", "comparison")
ID, NAME, EMAIL, OTHER = "Zoe-77123", "Zoë Quixano", "zoe.q@uni.example", "zq990817"
SECRETS = ["xylocarp", "quokkawise", "brontide"]  # words of theirs, and about them
THEIRS = (ID, NAME, EMAIL, OTHER, SECRETS[0], SECRETS[2])


@pytest.fixture
def book(book, tmp_path):
    """Three students; the second has rows in every table, and is named in what is written about the others."""
    enrol(book, tmp_path, ("ada", "Ada L.", "ada@uni.example", "A"), (ID, NAME, EMAIL, "A"), ("bob", "Bob B.", "", "B"))
    (tmp_path / "others.csv").write_text(f"id,alias\n{ID},{OTHER}\n", encoding="utf-8")
    book.import_roster(tmp_path / "others.csv")
    for student, words in (("ada", "It bends."), (ID, SECRETS[0]), ("bob", "It shakes.")):
        content = json.dumps({"cells": [words]}, ensure_ascii=False).encode()
        book.deliver(student, [Delivery("02.ipynb", words, content, WHEN, f"{student}.zip")])
        run = graded(student, mark(), prose(given=words), report_text(), answers=content, problems=(f"of {student}",))
        record(book, run)
    for student in ("ada", ID, "bob"):
        book.scores.give(student, WORDS, 0.5, "tia", level=2, remark=f"Shorter than {SECRETS[1]}.")
    book.scores.give("ada", COMPARED, 1, "tia", remark=f"As {NAME} has it; see {ID.upper()}, {EMAIL} and {OTHER}.")
    book.set_mark("ada", *COMPARED, 2, reason=f"Not as {NAME.upper()}: Zoe-77123456 is nobody.", actor="lea")
    book.scores.give("ada", COMPARED, 1.5, "tia", remark="Better.")
    book.scores.claim([ID], COMPARED, "tia", 3600)
    book.comment("bob", f"Work with {NAME}.", actor="lea")
    book.comment(ID, SECRETS[2], actor="lea")
    book.comment(ID, SECRETS[2], "lea", *WORDS, asks=True)
    book.comment("bob", f"{ID} has more points for the same.", "lea", *WORDS, asks=True)
    book.publish("lea", f"without {NAME}")
    book.excuse(ID, ["02_speed"], reason=f"{NAME} was ill", actor="lea")
    book.excuse("bob", ["02_speed"], reason=f"worked with {NAME}", actor="lea")
    book.take(ID, "02_speed", f"{ID}.zip", WHEN, reason=f"{NAME} was ill", actor="lea")
    return book


def everything(url: str) -> str:
    with closing(Database(url)) as database, database.reading() as session:
        rows = [tuple(row) for table in Base.metadata.sorted_tables for row in session.execute(select(table))]
    return "\n".join(repr([bytes(x).decode("latin-1") if isinstance(x, bytes) else x for x in row]) for row in rows)


def without_texts(book: Gradebook) -> list:
    """Return all that is stored about the others without the texts that persons wrote."""
    texts = {"mark_before", "mark_after", "reason", "remark", "text", "answer"}
    tables = Base.metadata.tables.keys() - {"runs"}
    return [
        {
            name: [{column: row[column] for column in row.keys() - texts} for row in value] if name in tables else value
            for name, value in student.items()
        }
        for student in dump(book)["students"]
        if student["student"] != ID
    ]


def in_files(url: str) -> list[str]:
    """Return which words of theirs are in the gradebook's file, or in a file that lies beside it."""
    content = b"".join(path.read_bytes() for path in Path(url).parent.glob(f"{Path(url).name}*"))
    stored = content.replace(b"Zoe-77123456 is nobody", b"").decode("latin-1").casefold()
    forms = {word: (word.encode().decode("latin-1"), json.dumps(word)[1:-1]) for word in THEIRS}
    return [word for word, spelled in forms.items() if any(form.casefold() in stored for form in spelled)]


def free_pages(url: str) -> int:
    with closing(sqlite3.connect(url)) as connection:
        (count,) = connection.execute("PRAGMA freelist_count").fetchone()
    return count


def test_nothing_is_left_of_an_erased_person_and_nothing_else_changes(book, url):
    before, marks = without_texts(book), {student: book.current(student).marks for student in ("ada", "bob")}
    assert all(word in everything(url) for word in THEIRS)
    done = book.persons.erase(ID.lower(), "lea")
    assert done.about == StudentRecord(ID, NAME, EMAIL, "A", (OTHER,), enrolled=True)
    assert done.counts == {
        **{"marks": 3, "scores": 1, "audit": 4, "claims": 1, "comments": 2, "excuses": 1, "takes": 1},
        **{"decisions": 1, "runs": 1, "deliveries": 1},
    }
    assert done.still_named == ()
    left = everything(url).replace("Zoe-77123456 is nobody", "")
    assert [word for word in THEIRS if word in left] == []
    assert without_texts(book) == before
    assert {student.student: book.current(student.student).marks for student in book.students()} == marks
    if "://" not in url:
        assert in_files(url) == []


def test_deleted_bytes_are_overwritten_and_then_the_file_is_written_anew(book, url, monkeypatch):
    if "://" in url:
        return
    book.deliver(ID, [Delivery("log.bin", "b", bytes(100_000), WHEN)])
    assert set(in_files(url)) == set(THEIRS)
    with monkeypatch.context() as patched:
        patched.setattr(Database, "rebuild", Mock())
        book.persons.erase(ID, "lea")
    assert in_files(url) == [] and free_pages(url) > 0
    book.persons.erase(ID, "lea")
    assert free_pages(url) == 0


def test_an_erasure_that_was_interrupted_is_completed_by_erasing_again(book, url, monkeypatch):
    def interrupted(database):
        raise GradebookError("the disk is full")

    with monkeypatch.context() as patched:
        patched.setattr(Database, "rebuild", interrupted)
        with pytest.raises(GradebookError, match="Erase them again: the disk is full"):
            book.persons.erase(ID, "lea")
    rebuild = Mock()
    monkeypatch.setattr(Database, "rebuild", rebuild)
    before = dump(book)
    done = book.persons.erase(ID.upper(), "lea")
    assert (done.about.student, done.counts, rebuild.call_count) == (ID.upper(), {}, 1)
    assert dump(book) == before  # nobody is erased twice


def test_an_erasure_that_fails_changes_nothing(book):
    before = dump(book)

    def change(record, person):
        raise GradebookError("no")

    with pytest.raises(GradebookError, match="no"):
        book.persons.erase(ID, "lea", change=change)
    assert dump(book) == before


def test_every_connection_checks_foreign_keys(book, url):
    lost = insert(Excuse).values(student_id=99, notebook="02", excused=True, actor="x", reason="", when=WHEN)
    with closing(Database(url)) as database:
        for _connection in range(2):
            with pytest.raises(GradebookError, match=r"(?i)foreign key"), database.writing() as session:
                session.execute(lost)


def test_their_name_is_replaced_in_what_is_written_about_others_and_nowhere_else(book):
    done = book.persons.erase(ID, "lea")
    acts = [one.remark for one in book.scores.acts([COMPARED])]
    assert acts == [f"As {MARKER} has it; see {MARKER}, {MARKER} and {MARKER}.", "Better."]
    trail = [one.reason for one in book.audit("ada", "2.16")]
    assert trail[-2] == f"Not as {MARKER}: Zoe-77123456 is nobody."
    assert trail[-3] == acts[0]
    texts = [f"Work with {MARKER}.", f"{MARKER} has more points for the same."]
    assert [one.text for one in book.comments()] == texts
    assert [one.note for one in book.publications()] == [f"without {MARKER}"]
    assert "ada, scores, 2.16, comparison" in done.redacted and "bob, comments" in done.redacted


def test_a_decision_comes_back_without_the_name_when_an_act_is_taken_back(book):
    book.scores.give("ada", WORDS, 1, "tia", remark=f"Like {EMAIL}.")
    act = book.scores.give("ada", WORDS, 0, "tia", remark="No.")
    book.persons.erase(ID, "lea")
    book.scores.undo(act.number, "tia")
    assert {one.where: one for one in book.current("ada").marks}[WORDS].reason == f"Like {MARKER}."


def test_a_dry_run_changes_nothing_and_returns_the_same(book):
    before = dump(book)
    expected = book.persons.erase(ID, "lea", dry_run=True)
    assert dump(book) == before
    assert book.persons.erase(ID, "lea") == expected


def test_an_erased_person_comes_again_only_if_that_is_said(book, tmp_path):
    before = clock.now()
    book.persons.erase(ID, "lea")
    (when,) = book.persons.erased([ID.upper(), "ada", "nobody"]).values()
    assert before <= when <= clock.now()
    report = book.import_roster(tmp_path / "roster.csv")
    assert (report.added, report.unchanged) == (0, 2)
    assert report.notes == (f"{ID} was erased on {when:%Y-%m-%d}, and is not taken in. --again {ID} takes them in.",)
    assert book.import_roster(tmp_path / "roster.csv", again=[ID.lower()]).added == 1
    assert book.current(ID) is None and book.audit(ID) == [] and book.delivered(ID) == [] == book.comments(ID)
    record(book, graded(ID))
    assert book.persons.erased([ID]) == {}  # they are here
    book.persons.erase(ID, "lea")
    assert list(book.persons.erased([ID])) == [ID]


def test_what_others_wrote_themselves_stays_and_is_reported(book):
    book.deliver("bob", [Delivery("notes.txt", "n", f"With {NAME}!".encode(), WHEN)])
    record(book, graded("bob", mark(), prose(given=f"As {NAME} says."), report_text()))
    book.comment("ada", "Well.", actor=NAME)
    done = book.persons.erase(ID, "lea")
    assert set(done.still_named) == {
        "bob, deliveries, notes.txt",
        "bob, marks, 2.11, explanation",
        f"{NAME} as who marked or wrote",
    }
    assert {one.name: one.content for one in book.delivered("bob")}["notes.txt"] == f"With {NAME}!".encode()


def test_a_student_who_has_an_address_for_scoring_is_reported_and_scores_on(book):
    book.tokens.replace(NAME, "0" * 64)
    assert f"{NAME} as who marked or wrote" in book.persons.erase(ID, "lea").still_named
    assert book.tokens.find("0" * 64).is_valid


def test_messages_on_runs_of_others_lose_the_name_and_a_course_changes_the_rest(book):
    slow = Problem.of(Code.TOOK_TOO_LONG, seconds=60, line=3)
    said = (
        f"of {ID}",
        Problem.of(Code.RECORDED_AT_HOME, f"{NAME}.ipynb", parts=["2.11 x", f"of {ID}"], why=slow),
        Problem.of(Code.CELL_STOPPED, why=Problem.of(Code.RAISED, type="ValueError", text=f"{NAME}!", line=0)),
    )
    record(book, graded("bob", submission="with them", problems=said, answers=b'{"student": "Zo"}'))

    def change(row, person):
        assert person.student == ID
        if isinstance(row, Delivery):
            row.content = b"[]"
        elif row.problems == said:
            row.answers = b"{}"

    done = book.persons.erase(ID, "lea", change=change)
    assert book.current("bob").run.problems == (
        f"of {MARKER}",
        Problem.of(Code.RECORDED_AT_HOME, f"{MARKER}.ipynb", parts=["2.11 x", f"of {MARKER}"], why=slow),
        Problem.of(Code.CELL_STOPPED, why=Problem.of(Code.RAISED, type="ValueError", text=f"{MARKER}!", line=0)),
    )
    assert book.current("bob").run.answers == b"{}"
    assert [one.content for one in book.delivered("bob")] == [b"[]"]
    assert {"bob, runs", "bob, deliveries, 02.ipynb"} <= set(done.redacted)


def test_a_copy_has_all_rows_of_a_person_and_each_file_that_they_handed_in(book):
    book.deliver(ID, [Delivery("log.bin", "b", b"\xff\x00", WHEN)])
    copy = json.loads(book.persons.copy(ID.lower()))
    assert {name for name, rows in copy.items() if rows} == {
        *{name for name, table in Base.metadata.tables.items() if {"student_id", "run_id"} & set(table.c.keys())},
        "students",
    }
    assert copy["students"][0]["email"] == EMAIL
    assert [json.loads(copy["deliveries"][0]["content"]), copy["deliveries"][1]["content"]] == [
        {"cells": [SECRETS[0]]},
        {"base64": "/wA="},
    ]
    assert "It bends." not in json.dumps(copy) and "It shakes." not in json.dumps(copy)


def test_short_names_are_not_looked_for():
    person = Person(StudentRecord("17", "Bo", "bo@x.org", aliases=("4711", "12345", "Eva")))
    assert person.names == ("bo@x.org", "12345", "Eva") and person.too_short == ("17", "Bo", "4711")
    assert person.redacted("Bo has 17 of 12345 points (BO@X.ORG)") == "Bo has 17 of [erased] points ([erased])"
    assert Person(StudentRecord("17")).is_named_in("17") is False


def test_an_id_that_somebody_typed_in_a_notebook_is_erased():
    typed = (("a.ipynb", "student", "ann"), ("a.ipynb", "bench", "x"))
    submission = Submission(student="ada", cell_reports=CellReports(unused=typed))
    erasure._redact(submission, Person(StudentRecord("ann")))
    assert submission.cell_reports.unused == (("a.ipynb", "student", "[erased]"), ("a.ipynb", "bench", "x"))


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("course.json", {"student": "Ann", "with": ["bob"]}, {"student": "", "with": ["bob"]}),
        ("course.json", {"student": "bob", "with": ["ANN", "cleo"]}, {"student": "bob", "with": ["cleo"]}),
        ("answers.json", {"student": "ann", "answers": {}}, {"student": "", "answers": {}}),
        ("own.json", {"student": "ann"}, {"student": "ann"}),
    ],
)
def test_a_file_of_a_partners_that_names_its_students_loses_the_person_alone(name, before, after):
    file = Delivery(name, "d", json.dumps(before).encode(), WHEN)
    assert json.loads(erasure._without(file, "ann")) == after


@pytest.mark.parametrize("name", ["Fatima Rahman", "Rahman, Fatima"])
def test_a_name_is_found_with_the_family_name_at_either_end(name):
    person = Person(StudentRecord("s06", name, aliases=("Rahman, Fatima Noor",)))
    said = "As FATIMA RAHMAN (Rahman, Fatima; Fatima Noor Rahman) has it."
    assert person.redacted(said) == "As [erased] ([erased]; [erased]) has it."
    assert not person.is_named_in("Fatima, and Rahman")


def test_names_are_found_as_whole_words_in_texts_and_in_files():
    person = Person(StudentRecord("ann", "Jürgen Ohm"))
    assert person.redacted("Ann planned it; ann_b and ANN's.") == "[erased] planned it; ann_b and [erased]'s."
    for content in (json.dumps("by Jürgen Ohm").encode(), "by JÜRGEN ohm".encode(), "x\tann\t".encode("utf-16")):
        assert person.is_named_in(content)
    assert not person.is_named_in(b"planned \xff\xfe")
