"""A person is erased completely, and nobody else: in a file and on a real PostgreSQL server."""

import json
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from gradebook_dump import dump
from gradebooks import enrol, graded, mark, prose, record, report_text
from sqlalchemy import insert, select, text, update

from labcourse import clock
from labcourse.answers.cell_reports import Reports
from labcourse.errors import GradebookError
from labcourse.grading import erasure
from labcourse.grading.gradebook import Arrival, Delivery, Gradebook, StudentRecord, persons
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.persons import OfOthers, Person
from labcourse.grading.gradebook.records import Base, Erasure
from labcourse.grading.graded_run import Facts

WHEN = datetime(2026, 3, 2, tzinfo=UTC)
WORDS, COMPARED = ("2.11", "explanation"), ("2.16", "comparison")
ID, NAME, EMAIL, OTHER = "Zoe-77123", "Zoë Quixano", "zoe.q@uni.example", "zq990817"
SECRETS = ["xylocarp", "quokkawise", "brontide"]  # words of theirs, and about them
MARKER = "[erased 2]"
#: Where the name stands in capitals that are not those of A to Z.
IN_OTHER_CAPITALS = {
    "ada: audit trail, 2.16, comparison, lea",
    "ada: audit trail, 2.16, comparison, tia",
    "ada: remark, 2.16, comparison, tia",
}


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
    book.set_mark("ada", *COMPARED, 2, f"Not as {NAME.upper()}: Zoe-77123456 is nobody.", "lea")
    book.scores.give("ada", COMPARED, 1.5, "tia", remark="Better.")
    book.scores.claim([ID], COMPARED, "tia", 3600)
    book.comment("bob", f"Work with {NAME}.", "lea")
    book.comment(ID, SECRETS[2], "lea")
    book.comment(ID, SECRETS[2], "lea", *WORDS, asks=True)
    book.comment("bob", f"{ID} has more points for the same.", "lea", *WORDS, asks=True)
    book.publish("lea", f"without {NAME}")
    book.excuse(ID, ["02_speed"], f"{NAME} was ill", "lea")
    book.excuse("bob", ["02_speed"], f"worked with {NAME}", "lea")
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


def test_nothing_is_left_of_an_erased_person_and_nothing_else_changes(book, url):
    before, marks = without_texts(book), {student: book.current(student).marks for student in ("ada", "bob")}
    assert all(word in everything(url) for word in (ID, NAME, EMAIL, OTHER, SECRETS[0], SECRETS[2]))
    done = book.persons.erase(ID.lower(), "lea")
    assert done.about == StudentRecord(ID, NAME, EMAIL, "A", (OTHER,), enrolled=True)
    assert {name: count for name, count in done.counts.items() if count} == {
        **{"marks": 3, "scores": 1, "audit": 4, "claims": 1, "comments": 2, "excuses": 1},
        **{"decisions": 1, "runs": 1, "deliveries": 1},
    }
    assert done.sources == (f"{ID}.zip",)
    assert set(done.still_named) == IN_OTHER_CAPITALS
    words = (ID, NAME, EMAIL, OTHER, SECRETS[0], SECRETS[2])
    left = everything(url).replace("Zoe-77123456 is nobody", "")
    assert [word for word in words if word in left] == []
    assert without_texts(book) == before
    assert {student.student: book.current(student.student).marks for student in book.students()} == marks
    book.close()
    if "://" not in url:
        stored = Path(url).read_bytes().replace(b"Zoe-77123456 is nobody", b"").decode("latin-1").casefold()
        assert [word for word in words if word.encode().decode("latin-1").casefold() in stored] == []


def test_their_name_is_replaced_in_what_is_written_about_others_and_nowhere_else(book):
    done = book.persons.erase(ID, "lea")
    acts = [one.remark for one in book.scores.acts([COMPARED])]
    assert acts == [f"As {MARKER} has it; see {MARKER}, {MARKER} and {MARKER}.", "Better."]
    trail = [one.reason for one in book.audit("ada", "2.16")]
    assert trail[-2] == f"Not as {NAME.upper()}: Zoe-77123456 is nobody."  # Ë is no capital of A to Z
    assert trail[-3] == acts[0]
    texts = [f"Work with {MARKER}.", f"{MARKER} has more points for the same."]
    assert [one.text for one in book.comments()] == texts
    assert [one.note for one in book.publications()] == [f"without {MARKER}"]
    assert "ada: remark, 2.16, comparison, tia" in done.redacted and "bob: comment for them, lea" in done.redacted


def test_a_decision_comes_back_without_the_name_when_an_act_is_taken_back(book):
    book.scores.give("ada", WORDS, 1, "tia", remark=f"Like {EMAIL}.")
    act = book.scores.give("ada", WORDS, 0, "tia", remark="No.")
    book.persons.erase(ID, "lea")
    book.scores.undo(act.number, "tia")
    assert {one.where: one for one in book.current("ada").marks}[WORDS].reason == f"Like {MARKER}."


def test_a_dry_run_changes_nothing_and_returns_the_same(book):
    before = dump(book)
    expected = book.persons.would_be_erased(ID)
    assert dump(book) == before
    assert book.persons.erase(ID, "lea") == expected


def test_an_unknown_person_cannot_be_erased(book):
    with pytest.raises(GradebookError, match="no student 'nobody'"):
        book.persons.erase("nobody", "lea")


def test_an_erased_person_who_comes_again_gets_another_number(book, url, tmp_path):
    before = clock.now()
    book.persons.erase(ID, "lea")
    (when,) = book.persons.erased([ID.upper(), "ada", "nobody"]).values()
    assert before <= when <= clock.now()
    report = book.import_roster(tmp_path / "roster.csv")
    assert (report.added, report.unchanged) == (0, 2)
    assert report.problems == (f"{ID} was erased on {when:%Y-%m-%d}, and is not taken in. --again {ID} takes them in.",)
    assert book.import_roster(tmp_path / "roster.csv", again=[ID.lower()]).added == 1
    assert book.current(ID) is None and book.audit(ID) == [] and book.delivered(ID) == [] == book.comments(ID)
    record(book, graded(ID))
    assert book.persons.erased([ID]) == {}  # they are here
    with closing(Database(url)) as database, database.reading() as connection:
        assert connection.scalar(select(StudentRecord.id).where(StudentRecord.student == ID)) == 4
    book.persons.erase(ID, "lea")
    assert list(book.persons.erased([ID])) == [ID]


def test_no_number_of_an_erased_person_is_used_again(book, url):
    def numbers():
        with closing(Database(url)) as database, database.reading() as connection:
            return dict(connection.execute(select(StudentRecord.student, StudentRecord.id)).all())

    given = set(numbers().values())
    for gone in (["bob"], ["new 0"], ["ada", ID, "new 1"]):  # the last that came, and everybody
        for student in gone:
            book.persons.erase(student, "lea")
        new = f"new {len(given) - 3}"
        record(book, graded(new))
        assert numbers()[new] not in given
        given.add(numbers()[new])


def test_what_others_wrote_themselves_stays_and_is_reported(book):
    book.deliver("bob", [Delivery("notes.txt", "n", f"With {NAME}!".encode(), WHEN)])
    record(book, graded("bob", mark(), prose(given=f"As {NAME} says."), report_text()))
    book.comment("ada", "Well.", NAME)
    done = book.persons.erase(ID, "lea")
    assert set(done.still_named) - IN_OTHER_CAPITALS == {
        "bob: file that they handed in, notes.txt",
        "bob: answer, 2.11, explanation",
        f"{NAME} is named as who marked, wrote, opened, published or erased",
    }
    assert {one.name: one.content for one in book.delivered("bob")}["notes.txt"] == f"With {NAME}!".encode()


def test_a_student_who_has_an_address_for_scoring_is_reported_and_scores_on(book):
    book.tokens.replace(NAME, "0" * 64)
    named = f"{NAME} is named as who marked, wrote, opened, published or erased"
    assert named in book.persons.erase(ID, "lea").still_named
    assert book.tokens.find("0" * 64).is_valid


def test_a_course_changes_runs_and_files_of_others(book):
    record(book, graded("bob", submission="with them", problems=(f"of {ID}",), answers=b'{"student": "Zo"}'))

    def run(one, person):
        redacted = tuple(map(person.redacted, one.problems))
        return replace(one, problems=redacted, answers=b"{}") if redacted != one.problems else one

    def file(name, content, person):
        return b"[]" if name == "02.ipynb" else content

    done = book.persons.erase(ID, "lea", OfOthers(run, file, lambda run, person: False))
    assert book.current("bob").run.problems == (f"of {MARKER}",) and book.current("bob").run.answers == b"{}"
    assert [one.content for one in book.delivered("bob")] == [b"[]"]
    assert {"bob: messages on their run", "bob: 02.ipynb"} <= set(done.redacted)


def test_common_work_that_only_they_handed_in_is_stored_for_the_partner(book):
    record(book, graded("eve"))
    book.persons.erase(ID, "lea", OfOthers(shares=lambda run, person: run.student in ("eve", "bob")))
    assert [one.name for one in book.delivered("eve")] == ["02.ipynb"] and book.received("eve") == {
        "02.ipynb": Arrival(WHEN)
    }
    assert [file.content for file in book.delivered("bob")] == [json.dumps({"cells": ["It shakes."]}).encode()]


def test_a_copy_of_all_data_of_a_person_leaves_out_no_table(book):
    rows, files = book.persons.everything_of(ID)
    assert {name for name, found in rows.items() if found} | {"deliveries"} == {
        *{name for name, table in Base.metadata.tables.items() if {"student_id", "run_id"} & set(table.c.keys())},
        "students",
    }
    assert [one.name for one in files] == ["02.ipynb"] and SECRETS[0].encode() in files[0].content


def test_each_table_that_names_persons_has_a_name_for_its_rows():
    tables = Base.metadata.tables
    held = {name for name, table in tables.items() if {"student_id", "run_id"} & set(table.c.keys())}
    assert held | {"publications", "erasures", "tokens"} == set(persons._CALLED)
    actors = {name for name, table in tables.items() if {"actor", "answered_by"} & set(table.c.keys())}
    assert actors <= set(persons._CALLED)


def test_a_fingerprint_may_look_like_a_name(book, monkeypatch):
    monkeypatch.setattr(persons, "_fingerprint", lambda secret, student: NAME.encode())
    assert "erasure" in book.persons.erase(ID, "lea").still_named


def refused(url, *statements, why="only grows"):
    with closing(Database(url)) as database, pytest.raises(GradebookError, match=why), database.writing() as connection:
        for statement in statements:
            connection.execute(text(statement) if isinstance(statement, str) else statement)


def begin(number, gone=None):
    values = {"gone": -number if gone is None else gone, "fingerprint": b"", "actor": "x", "lines": 0}
    return insert(Erasure).values(number=number, erased=WHEN, **values)


def replaced(old, new, table="audit", column="reason"):
    return f"UPDATE {table} SET {column} = replace({column}, '{old}', '{new}') WHERE student_id = 1"


OTHER_CHANGES = [
    ["DELETE FROM audit WHERE student_id = 2"],
    ["DELETE FROM scores WHERE student_id = 2"],
    ["DELETE FROM students WHERE id = 2"],  # all of theirs would go with it
    [begin(2), "UPDATE audit SET mark_after = NULL"],
    [begin(2), f'UPDATE audit SET mark_after = \'{{"reason": "{MARKER}"}}\''],
    [begin(2), "DELETE FROM audit WHERE student_id = 1"],
    [begin(2), "DELETE FROM scores"],
    [replaced(NAME, MARKER)],
    [replaced(NAME, MARKER, "scores", "remark")],
    [begin(2), replaced(NAME, "[erased 3]")],
    [begin(2), replaced(NAME, "somebody")],
    [begin(2), replaced("Better", MARKER)],
    [begin(2), replaced("Better", MARKER, "scores", "remark")],
    [begin(2), replaced(NAME, f"{MARKER} and so on")],
    [begin(2), f"UPDATE audit SET reason = '{MARKER}' WHERE student_id = 1"],
    [begin(2), f"UPDATE audit SET reason = replace(reason, '{NAME}', '{MARKER}'), actor = 'x'"],
    [begin(2), f"UPDATE scores SET remark = replace(remark, '{NAME}', '{MARKER}'), points = 2"],
    [begin(2), f"UPDATE audit SET actor = '{MARKER}'"],
    [begin(2), f"UPDATE scores SET given = '{MARKER}'"],
    [begin(2), "UPDATE audit SET student_id = 2 WHERE student_id = 1"],
    [begin(2), "UPDATE scores SET student_id = 1 WHERE student_id = 2"],
    [begin(2), "UPDATE scores SET replaced = NULL WHERE student_id = 1"],
    [begin(2), "UPDATE scores SET replaced = '{}' WHERE student_id = 1"],
    ["UPDATE audit SET changed = changed, reason = ''"],
]
NOT_WHOLE = [
    ([begin(2)], "(?i)foreign key"),  # nobody is erased who is still there
    ([begin(2), "DELETE FROM audit WHERE student_id = 2"], "(?i)foreign key"),
    ([begin(2), replaced(NAME, MARKER)], "(?i)foreign key"),
    ([begin(2, gone=2)], "stays as it is"),
    ([begin(-2, gone=2)], "stays as it is"),
    ([begin(2), "UPDATE erasures SET gone = 2"], "stays as it is"),
    ([begin(2), "UPDATE erasures SET number = 1"], "stays as it is"),
    ([begin(2), "DELETE FROM erasures"], "stays as it is"),
    (["UPDATE students SET id = 9 WHERE id = 2"], "(?i)stays as it is|foreign key"),
]


def test_the_database_refuses_all_changes_but_replaced_names(book, url):
    before = dump(book)
    for statements in OTHER_CHANGES:
        refused(url, *statements)
    assert dump(book) == before


def test_the_database_refuses_an_incomplete_erasure(book, url):
    before = dump(book)
    for statements, why in NOT_WHOLE:
        refused(url, *statements, why=why)
    assert dump(book) == before


def test_the_database_refuses_to_change_an_erasure(book, url):
    book.persons.erase(ID, "lea")
    before = dump(book)
    for statement in ("DELETE FROM erasures", "UPDATE erasures SET actor = 'x'", "UPDATE erasures SET gone = -2"):
        refused(url, statement, why="stays as it is")
    refused(url, replaced(MARKER, "Zoë"))
    refused(url, replaced("Better", MARKER))
    new = {"student": "x", "folded": "x"}
    refused(url, insert(StudentRecord).values(id=2, **new), why="never given again")
    refused(url, update(StudentRecord).where(StudentRecord.id == 1).values(id=2), why="(?i)stays as it is|foreign key")
    assert dump(book) == before


@pytest.mark.parametrize("kind", [pytest.param("postgres", marks=pytest.mark.postgres)])
@pytest.mark.parametrize("table", ["audit", "scores", "erasures"])
def test_a_table_that_only_grows_is_not_emptied_on_a_server(book, url, table):
    refused(url, f"TRUNCATE {table} CASCADE", why="only grows|stays as it is")


def test_short_names_are_not_looked_for():
    person = Person(StudentRecord("17", "Bo", "bo@x.org", aliases=("4711", "12345", "Eva")), 3)
    assert person.names == ("bo@x.org", "12345", "Eva") and person.too_short == ("17", "Bo", "4711")
    assert person.redacted("Bo has 17 of 12345 points (BO@X.ORG)") == "Bo has 17 of [erased 3] points ([erased 3])"
    assert Person(StudentRecord("17"), 3).named_in("17") is False


def test_an_id_that_somebody_typed_in_a_notebook_is_erased():
    facts = Facts(reports=Reports(unused=(("a.ipynb", "student", "ann"), ("a.ipynb", "bench", "x"))))
    erased = erasure._redacted(facts, Person(StudentRecord("ann"), 1))
    assert erased.reports.unused == (("a.ipynb", "student", "[erased 1]"), ("a.ipynb", "bench", "x"))


def test_names_are_found_as_whole_words_in_texts_and_in_files():
    person = Person(StudentRecord("ann", "Jürgen Ohm"), 1)
    assert person.redacted("Ann planned it; ann_b and ANN's.") == "[erased 1] planned it; ann_b and [erased 1]'s."
    assert person.named_in(json.dumps("by Jürgen Ohm").encode()) and person.named_in("by jürgen ohm".encode())
    assert not person.named_in(b"planned \xff\xfe")
