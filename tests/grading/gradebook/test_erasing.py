"""A person is erased, whole, and nobody else: on a file and on a real PostgreSQL server."""

import json
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from gradebook_dump import dump
from gradebooks import enrol, graded, mark, prose, record, report_text
from sqlalchemy import insert, select, text, update

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import Arrival, Delivery, Gradebook, StudentRecord, persons
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.persons import OfOthers, Person
from labcourse.grading.gradebook.records import Base, Erasure

WHEN = datetime(2026, 3, 2, tzinfo=UTC)
WORDS, COMPARED = ("2.11", "explanation"), ("2.16", "comparison")
ID, NAME, EMAIL, OTHER = "Zoe-77123", "Zoë Quixano", "zoe.q@uni.example", "zq990817"
SECRETS = ["xylocarp", "quokkawise", "brontide"]  # words of theirs, and about them
STANDS_IN = "[erased 2]"
#: Where the name stands in capitals that are not those of A to Z.
IN_OTHER_CAPITALS = {
    "ada: audit trail, 2.16, comparison, lea",
    "ada: audit trail, 2.16, comparison, tia",
    "ada: remark, 2.16, comparison, tia",
}


@pytest.fixture
def book(book, tmp_path):
    """Three students; the second has left a trace in every table, and is named in what the others are told."""
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
    book.requests.make(ID, WORDS, SECRETS[2])
    asked = book.requests.make("bob", WORDS, f"{ID} has more points for the same.")
    book.requests.answer(asked.number, "lea", f"{NAME} wrote more.")
    book.requests.publish("lea", f"without {NAME}")
    return book


def everything(url: str) -> str:
    with closing(Database(url)) as database, database.reading() as session:
        rows = [tuple(row) for table in Base.metadata.sorted_tables for row in session.execute(select(table))]
    return "\n".join(repr([bytes(x).decode("latin-1") if isinstance(x, bytes) else x for x in row]) for row in rows)


def of_others(book: Gradebook) -> list:
    """What is there of the others, but for what was said of them in words."""
    found = []
    for one in dump(book)["students"]:
        if one["student"] != ID:
            said = {"comments", "requests"}
            kept = {name: value for name, value in one.items() if name not in said}
            found.append(json.loads(json.dumps(kept, default=str)))
    return found


def without_reasons(found: list) -> list:
    for one in found:
        for table, names in (("audit", ("mark_before", "mark_after", "reason")), ("scores", ("remark",))):
            one[table] = [{name: x for name, x in row.items() if name not in names} for row in one[table]]
        one["decisions"] = [{name: x for name, x in row.items() if name != "reason"} for row in one["decisions"]]
    return found


def test_nothing_is_left_of_who_is_erased_and_nothing_else_is_another(book, url):
    before, marks = without_reasons(of_others(book)), {one: book.current(one).marks for one in ("ada", "bob")}
    assert all(word in everything(url) for word in (ID, NAME, EMAIL, OTHER, SECRETS[0], SECRETS[2]))
    done = book.persons.erase(ID.lower(), "lea")
    assert done.about == StudentRecord(ID, NAME, EMAIL, "A", (OTHER,), enrolled=True)
    assert {name: count for name, count in done.counts.items() if count} == {
        **{"marks": 3, "scores": 1, "audit": 4, "claims": 1, "requests": 1, "comments": 1},
        **{"decisions": 1, "runs": 1, "deliveries": 1},
    }
    assert done.sources == (f"{ID}.zip",)
    assert set(done.left) == IN_OTHER_CAPITALS
    words = (ID, NAME, EMAIL, OTHER, SECRETS[0], SECRETS[2])
    left = everything(url).replace("Zoe-77123456 is nobody", "")
    assert [word for word in words if word in left] == []
    assert without_reasons(of_others(book)) == before
    assert book.current("bob").marks == marks["bob"] and book.current("ada").marks == marks["ada"]
    assert [one.student for one in book.students()] == ["ada", "bob"]
    book.close()
    if "://" not in url:
        stored = Path(url).read_bytes().replace(b"Zoe-77123456 is nobody", b"").decode("latin-1").casefold()
        assert [word for word in words if word.encode().decode("latin-1").casefold() in stored] == []


def test_their_name_is_struck_out_of_what_others_are_told_and_of_nothing_more(book):
    done = book.persons.erase(ID, "lea")
    acts = [one.remark for one in book.scores.acts([COMPARED])]
    assert acts == [f"As {STANDS_IN} has it; see {STANDS_IN}, {STANDS_IN} and {STANDS_IN}.", "Better."]
    trail = [one.reason for one in book.audit("ada", "2.16")]
    assert trail[-2] == f"Not as {NAME.upper()}: Zoe-77123456 is nobody."  # Ë is no capital of A to Z
    assert trail[-3] == acts[0]
    assert [one.text for one in book.comments("bob")] == [f"Work with {STANDS_IN}."]
    (asked,) = book.requests.all()
    assert (asked.text, asked.answer) == (f"{STANDS_IN} has more points for the same.", f"{STANDS_IN} wrote more.")
    assert [one.note for one in book.requests.publications()] == [f"without {STANDS_IN}"]
    assert "ada: remark, 2.16, comparison, tia" in done.struck and "bob: comment for them, lea" in done.struck


def test_what_an_act_took_the_place_of_is_taken_back_without_the_name(book):
    book.scores.give("ada", WORDS, 1, "tia", remark=f"Like {EMAIL}.")
    act = book.scores.give("ada", WORDS, 0, "tia", remark="No.")
    book.persons.erase(ID, "lea")
    book.scores.undo(act.number, "tia")
    assert {one.where: one for one in book.current("ada").marks}[WORDS].reason == f"Like {STANDS_IN}."


def test_who_is_tried_only_stays_and_the_same_is_told(book):
    before = dump(book)
    told = book.persons.would_be_erased(ID)
    assert dump(book) == before
    assert book.persons.erase(ID, "lea") == told


def test_nobody_unknown_is_erased(book):
    with pytest.raises(GradebookError, match="no student 'nobody'"):
        book.persons.erase("nobody", "lea")


def test_who_comes_again_is_a_new_person_with_another_number(book, url, tmp_path):
    before = datetime.now(UTC)
    book.persons.erase(ID, "lea")
    (when,) = book.persons.erased([ID.upper(), "ada", "nobody"]).values()
    assert before <= when <= datetime.now(UTC)
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


def test_no_number_is_ever_given_again_whoever_was_erased(book, url):
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


def test_what_others_wrote_themselves_stays_and_is_told(book):
    book.deliver("bob", [Delivery("notes.txt", "n", f"With {NAME}!".encode(), WHEN)])
    record(book, graded("bob", mark(), prose(given=f"As {NAME} says."), report_text()))
    book.comment("ada", "Well.", NAME)
    done = book.persons.erase(ID, "lea")
    assert set(done.left) - IN_OTHER_CAPITALS == {
        "bob: file that they handed in, notes.txt",
        "bob: answer, 2.11, explanation",
        f"{NAME} is named as who marked, wrote, published or erased",
    }
    assert {one.name: one.content for one in book.delivered("bob")}["notes.txt"] == f"With {NAME}!".encode()


def test_a_course_says_what_becomes_of_others_runs_and_files(book):
    record(book, graded("bob", submission="with them", problems=(f"of {ID}",), answers=b'{"student": "Zo"}'))

    def run(one, person):
        struck = tuple(map(person.struck, one.problems))
        return replace(one, problems=struck, answers=b"{}") if struck != one.problems else one

    def file(name, content, person):
        return b"[]" if name == "02.ipynb" else content

    done = book.persons.erase(ID, "lea", OfOthers(run, file, lambda run, person: False))
    assert book.current("bob").run.problems == (f"of {STANDS_IN}",) and book.current("bob").run.answers == b"{}"
    assert [one.content for one in book.delivered("bob")] == [b"[]"]
    assert "bob: what is said of their run" in done.struck and "bob: 02.ipynb" in done.struck


def test_common_work_that_only_they_handed_in_is_kept_for_the_other(book):
    record(book, graded("eve"))
    book.persons.erase(ID, "lea", OfOthers(shares=lambda run, person: run.student in ("eve", "bob")))
    assert [one.name for one in book.delivered("eve")] == ["02.ipynb"] and book.received("eve") == {
        "02.ipynb": Arrival(WHEN)
    }
    assert len(book.delivered("bob")) == 1  # has their own


def test_a_copy_of_all_that_there_is_of_a_person_leaves_out_no_table(book):
    rows, files = book.persons.everything_of(ID)
    assert {name for name, found in rows.items() if found} | {"deliveries"} == {
        *{name for name, table in Base.metadata.tables.items() if {"student_id", "run_id"} & set(table.c.keys())},
        "students",
    }
    assert [one.name for one in files] == ["02.ipynb"] and SECRETS[0].encode() in files[0].content


def test_each_table_with_rows_of_students_is_known_by_name_and_what_is_written_there_too():
    tables = Base.metadata.tables
    held = {name for name, table in tables.items() if {"student_id", "run_id"} & set(table.c.keys())}
    assert held | {"publications", "erasures"} == set(persons._CALLED)
    actors = {name for name, table in tables.items() if {"actor", "answered_by"} & set(table.c.keys())}
    assert actors <= set(persons._CALLED)


def test_a_fingerprint_may_look_like_a_name(book, monkeypatch):
    monkeypatch.setattr(persons, "_fingerprint", lambda secret, student: NAME.encode())
    assert "erasure" in book.persons.erase(ID, "lea").left


def refused(url, *statements, why="only grows"):
    with closing(Database(url)) as database, pytest.raises(GradebookError, match=why), database.writing() as connection:
        for statement in statements:
            connection.execute(text(statement) if isinstance(statement, str) else statement)


def begin(number, gone=None):
    values = {"gone": -number if gone is None else gone, "fingerprint": b"", "actor": "x", "lines": 0}
    return insert(Erasure).values(number=number, erased=WHEN, **values)


def struck(old, new, table="audit", column="reason"):
    return f"UPDATE {table} SET {column} = replace({column}, '{old}', '{new}') WHERE student_id = 1"


NO_STRIKING_OUT = [
    ["DELETE FROM audit WHERE student_id = 2"],
    ["DELETE FROM scores WHERE student_id = 2"],
    ["DELETE FROM students WHERE id = 2"],  # all of theirs would go with it
    [begin(2), "UPDATE audit SET mark_after = NULL"],
    [begin(2), f'UPDATE audit SET mark_after = \'{{"reason": "{STANDS_IN}"}}\''],
    [begin(2), "DELETE FROM audit WHERE student_id = 1"],
    [begin(2), "DELETE FROM scores"],
    [struck(NAME, STANDS_IN)],
    [struck(NAME, STANDS_IN, "scores", "remark")],
    [begin(2), struck(NAME, "[erased 3]")],
    [begin(2), struck(NAME, "somebody")],
    [begin(2), struck("Better", STANDS_IN)],
    [begin(2), struck("Better", STANDS_IN, "scores", "remark")],
    [begin(2), struck(NAME, f"{STANDS_IN} and so on")],
    [begin(2), f"UPDATE audit SET reason = '{STANDS_IN}' WHERE student_id = 1"],
    [begin(2), f"UPDATE audit SET reason = replace(reason, '{NAME}', '{STANDS_IN}'), actor = 'x'"],
    [begin(2), f"UPDATE scores SET remark = replace(remark, '{NAME}', '{STANDS_IN}'), points = 2"],
    [begin(2), f"UPDATE audit SET actor = '{STANDS_IN}'"],
    [begin(2), f"UPDATE scores SET given = '{STANDS_IN}'"],
    [begin(2), "UPDATE audit SET student_id = 2 WHERE student_id = 1"],
    [begin(2), "UPDATE scores SET student_id = 1 WHERE student_id = 2"],
    [begin(2), "UPDATE scores SET replaced = NULL WHERE student_id = 1"],
    [begin(2), "UPDATE scores SET replaced = '{}' WHERE student_id = 1"],
    ["UPDATE audit SET changed = changed, reason = ''"],
]
NOT_WHOLE = [
    ([begin(2)], "(?i)foreign key"),  # nobody is erased who is still there
    ([begin(2), "DELETE FROM audit WHERE student_id = 2"], "(?i)foreign key"),
    ([begin(2), struck(NAME, STANDS_IN)], "(?i)foreign key"),
    ([begin(2, gone=2)], "stays as it is"),
    ([begin(-2, gone=2)], "stays as it is"),
    ([begin(2), "UPDATE erasures SET gone = 2"], "stays as it is"),
    ([begin(2), "UPDATE erasures SET number = 1"], "stays as it is"),
    ([begin(2), "DELETE FROM erasures"], "stays as it is"),
    (["UPDATE students SET id = 9 WHERE id = 2"], "(?i)stays as it is|foreign key"),
]


def test_what_is_no_striking_out_is_refused_by_the_database_itself(book, url):
    before = dump(book)
    for statements in NO_STRIKING_OUT:
        refused(url, *statements)
    assert dump(book) == before


def test_an_erasure_that_is_not_whole_is_refused_by_the_database_itself(book, url):
    before = dump(book)
    for statements, why in NOT_WHOLE:
        refused(url, *statements, why=why)
    assert dump(book) == before


def test_nothing_of_an_erasure_is_changed_afterwards(book, url):
    book.persons.erase(ID, "lea")
    before = dump(book)
    for statement in ("DELETE FROM erasures", "UPDATE erasures SET actor = 'x'", "UPDATE erasures SET gone = -2"):
        refused(url, statement, why="stays as it is")
    refused(url, struck(STANDS_IN, "Zoë"))
    refused(url, struck("Better", STANDS_IN))
    new = {"student": "x", "folded": "x"}
    refused(url, insert(StudentRecord).values(id=2, **new), why="never given again")
    refused(url, update(StudentRecord).where(StudentRecord.id == 1).values(id=2), why="(?i)stays as it is|foreign key")
    assert dump(book) == before


@pytest.mark.parametrize("kind", [pytest.param("postgres", marks=pytest.mark.postgres)])
@pytest.mark.parametrize("table", ["audit", "scores", "erasures"])
def test_a_table_that_only_grows_is_not_emptied_on_a_server(book, url, table):
    refused(url, f"TRUNCATE {table} CASCADE", why="only grows|stays as it is")


def test_short_words_are_not_looked_for_and_told():
    person = Person(StudentRecord("17", "Bo", "bo@x.org", aliases=("4711", "12345", "Eva")), 3)
    assert person.words == ("bo@x.org", "12345", "Eva") and person.unsought == ("17", "Bo", "4711")
    assert person.struck("Bo has 17 of 12345 points (BO@X.ORG)") == "Bo has 17 of [erased 3] points ([erased 3])"
    assert Person(StudentRecord("17"), 3).named_in("17") is False


def test_names_are_found_as_whole_words_in_texts_and_in_files():
    person = Person(StudentRecord("ann", "Jürgen Ohm"), 1)
    assert person.struck("Ann planned it; ann_b and ANN's.") == "[erased 1] planned it; ann_b and [erased 1]'s."
    assert person.named_in(json.dumps("by Jürgen Ohm").encode()) and person.named_in("by jürgen ohm".encode())
    assert not person.named_in(b"planned \xff\xfe")
