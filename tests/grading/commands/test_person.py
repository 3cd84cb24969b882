"""The commands about a person: erase, copy. What is left is looked for byte by byte."""

import json
import re
import shutil
import zipfile
from datetime import timedelta

import pytest
from command_line import rotflex, said
from day_class import HANDED_IN, NAMES, deliver, fill, score
from gradebooks import graded, mark, prose, record, report_text, rows
from made_courses import OURS

from labcourse.grading.batch import Batch
from labcourse.grading.counting import regrade
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.database import Database
from labcourse.grading.graded_run import submission_of
from labcourse.grading.reports.result import received
from labcourse.problems import Code

WORD = "quokkawise"  # stands in nobody else's work


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A folder of results with all that commands write into it; of fay there is something in each."""
    folder = tmp_path_factory.mktemp("filled") / "out"
    folder.mkdir()
    with Gradebook(folder / "gradebook.sqlite") as book:
        fill(book, folder.parent)
        score(book)
        deliver(book, "fay", {"data/log.csv": f"{WORD}, 1".encode()}, HANDED_IN + timedelta(days=1))
        record(book, graded("fay", mark(), prose(given=f"It is {WORD}."), report_text(), answers=WORD.encode()))
        book.comment("fay", f"Well, {WORD}.", actor="tia")
        book.set_mark("bob", "2.16", "comparison", 1, reason="Fay Foot has it at fay@uni.", actor="lea")
    at = ("--solutions", OURS.folder)
    for words in (
        ("status", folder),
        ("report", folder, "--out", folder),
        ("outcomes", "report", folder),
        ("outcomes", "sheets", folder, "--student", "fay", "--student", "gus", "--student", "bob"),
    ):
        assert rotflex(*words, *at).exit_code == 0
    return folder


@pytest.fixture
def out(filled, tmp_path):
    shutil.copytree(filled, tmp_path / "out")
    return tmp_path / "out"


def forget(out, *more, student="fay", **how):
    return rotflex("person", "erase", out, student, "--by", "lea", "--solutions", OURS.folder, *more, **how)


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def named(folder, *words):
    return [(name, word) for name, content in files(folder).items() for word in words if word.encode() in content]


@pytest.mark.slow
def test_no_byte_of_who_is_erased_is_left_and_everybody_elses_pages_are_the_same(out):
    before = files(out)
    assert {name for name, word in named(out, WORD)} == {"gradebook.sqlite", "fay/marks.json", "fay/feedback.html"}
    written = {"sheets.html", "fay/sheets.html", "class.html", "levels.csv", "grades.csv"}
    assert written <= {name for name, _word in named(out, "fay")}
    done = forget(out, "--yes", student="FAY")
    assert done.exit_code == 0, done.output
    assert "FAY is erased." in said(done)
    assert named(out, "fay", "Fay", "Foot", WORD) == []
    after = files(out)
    gone = {name for name in before if name.startswith("fay/")}
    of_class = {"class.html", "attainment.csv", "levels.csv", "sheets.html"}
    assert set(after) == set(before) - gone - of_class and len(gone) > 2 and of_class < set(before)
    pages = {
        f"{one}/{name}" for one in ("ada", "bob", "cleo", "dan", "eve") for name in ("marks.json", "feedback.html")
    }
    assert [name for name in sorted(pages) if before[name] != after[name]] == ["bob/feedback.html", "bob/marks.json"]
    for name in ("bob/feedback.html", "bob/marks.json"):  # whose remark named her
        struck = before[name].replace(b"Fay Foot", b"[erased]").replace(b"fay@uni", b"[erased]")
        made_of = re.compile(rb'"page": \[[^]]*\]')
        assert made_of.sub(b"", struck) == made_of.sub(b"", after[name])  # wherever the remark is
    assert b"Student" not in after["grades.csv"] and set(rows(out)) == {*NAMES, "hal"} - {"fay"}


def test_what_would_go_is_shown_and_stays_unless_it_is_confirmed(out):
    before = files(out)
    for done in (forget(out, "--dry-run"), forget(out, input="n\n")):
        assert "2 deliveries" in said(done) and "2 comments" in said(done)
        assert str(out / "fay") in said(done) and "bob, decisions, 2.16, comparison" in said(done)
        assert "Nothing was erased" in said(done)
    assert done.exit_code == 2
    after = files(out)
    assert after.keys() == before.keys()
    assert {name for name in before if before[name] != after[name]} <= {"gradebook.sqlite"}
    with Gradebook(out / "gradebook.sqlite") as book:
        assert book.current("fay") is not None
    assert forget(out, input="y\n").exit_code == 0


def test_an_erasure_that_was_interrupted_is_completed_by_the_same_command(out, monkeypatch):
    def killed(database):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Database, "rebuild", killed)
        assert forget(out, "--yes").exit_code != 0
    assert "bob/feedback.html" in dict(named(out, "Foot"))
    assert forget(out, "--yes").exit_code == 0
    assert named(out, "fay", "Fay", "Foot", WORD) == []
    assert forget(out, "--yes", student="nobody").exit_code == 2


def test_files_that_name_them_still_are_shown(out):
    (out / "sent.csv").write_text("student,mark\nFAY,3\n", encoding="utf-8")
    with zipfile.ZipFile(out / "pages.zip", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("1.html", "<p>Fay Foot</p>")
    with zipfile.ZipFile(out / "names.zip", "w") as packed:
        packed.writestr("fay.html", "")
    (out / "other.txt").write_text("fayence", encoding="utf-8")
    (out / "fay.pdf").write_bytes(b"%PDF")
    with zipfile.ZipFile(out / "damaged.ods", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("a.xml", bytes(1000))
    content = (out / "damaged.ods").read_bytes()
    (out / "damaged.ods").write_bytes(re.sub(rb"(?<=a\.xml)....", b"\xff" * 4, content, count=1, flags=re.DOTALL))
    with Gradebook(out / "gradebook.sqlite") as book:
        deliver(book, "bob", {"notes.txt": b"Fay Foot helped me."})
    done = forget(out, "--yes")
    assert done.exit_code == 1, done.output
    for line in (
        *(str(out / name) for name in ("sent.csv", "pages.zip", "names.zip", "fay.pdf")),
        f"{out / 'damaged.ods'} (it could not be searched)",
        "bob, deliveries, notes.txt",
    ):
        assert line in said(done)
    assert "other.txt" not in done.output


def test_a_copy_is_one_file_with_all_rows_and_each_file_as_it_came(out, tmp_path):
    target = tmp_path / "fay.json"
    words = ("person", "copy", out, "fay", target)
    assert rotflex(*words).exit_code == 0
    stored = json.loads(target.read_text(encoding="utf-8"))
    assert stored["students"][0]["email"] == "fay@uni" and stored["runs"][0]["answers"] == WORD
    assert [file["content"] for file in stored["deliveries"] if file["name"] == "data/log.csv"] == [f"{WORD}, 1"]
    assert "cleo" not in target.read_text(encoding="utf-8")
    assert rotflex(*words).exit_code == 2 and rotflex(*words, "--force").exit_code == 0


def test_a_copy_is_no_zip(out, tmp_path):
    done = rotflex("person", "copy", out, "fay", tmp_path / "fay.zip")
    assert done.exit_code == 2 and str(tmp_path / "fay.json") in said(done)


def test_a_batch_does_not_bring_them_back_in_silence(fake_class):
    fake_class.hand_in("ada", "bob")
    points = fake_class.grade()
    with fake_class.book() as book:
        book.persons.erase("ada", "lea")
    ran = list(fake_class.runs)
    assert fake_class.grade() == {"bob": points["bob"]} and fake_class.runs == ran
    with fake_class.book() as book:
        made = Batch(fake_class.folder / "in", fake_class.course, book)
        (told,) = made.ignored
        assert (told.code, made.students) == (Code.ERASED_HANDED_IN, ["bob"])
        assert (told.parameters["student"], told.parameters["sources"]) == ("ada", ["ada"])
    assert fake_class.grade(again=("ADA",)) == points  # from its folder, as a new person
    assert fake_class.runs == [*ran, "ada"]  # and not from what was known of the run before
    assert fake_class.grade() == points  # who is here again
    with fake_class.book() as book:
        assert len(book.audit("ada")) == len(book.audit("bob"))


def test_who_worked_with_them_keeps_marks_bench_and_times(fake_class, tmp_path):
    """The hand-in of ada was bob's and cleo's, too: they are one group of the roster, and it is run on her bench."""
    fake_class.hand_in("ada")
    course = {"student": "ada", "with": ["bob", "cleo"]}
    (tmp_path / "in" / "ada" / "course.json").write_text(json.dumps(course), encoding="utf-8")
    with fake_class.book() as book:
        for one in ("ada", "bob", "cleo"):
            (tmp_path / "roster.csv").write_text(f"id,name,group\n{one},{one} Name,7\n", encoding="utf-8")
            book.import_roster(tmp_path / "roster.csv")
    points = fake_class.grade()
    assert set(points) == {"ada", "bob", "cleo"} and points["bob"] > 0
    with fake_class.book() as book:
        before, when = {one: book.current(one) for one in points}, received(book, "bob", book.current("bob"))
        assert submission_of(before["bob"].run).bench_of == "ada" and when
    done = rotflex(
        *("person", "erase", tmp_path / "book.sqlite", "ada", "--out", tmp_path / "none", "--by", "lea"),
        *("--solutions", fake_class.course.folder, "--yes"),
    )
    assert done.exit_code == 0, done.output
    assert re.search(rb"(?<!\w)ada(?!\w)", (tmp_path / "book.sqlite").read_bytes()) is None
    with fake_class.book() as book:
        for one in ("bob", "cleo"):
            now = book.current(one)
            assert now.marks == before[one].marks
            assert submission_of(now.run).bench_of == "bob"  # the same for both: they worked together
            assert received(book, one, now) == when
        for one in regrade(book, fake_class.course):
            assert (one.problem, one.after.marks) == ("", before[one.after.run.student].marks)
