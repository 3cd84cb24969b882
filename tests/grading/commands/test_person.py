"""The commands about a person: forget, copy. What is left is looked for byte by byte."""

import json
import re
import shutil
import zipfile
from dataclasses import replace
from datetime import timedelta

import pytest
from command_line import rotflex, said
from day_class import HANDED_IN, NAMES, deliver, fill, notebook, score
from gradebooks import graded, mark, prose, record, report_text, rows
from made_courses import OURS, copied

from labcourse.grading.batch import Batch, regrade
from labcourse.grading.erasure import in_settings
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.graded_run import facts_of
from labcourse.grading.reports.result import received
from labcourse.grading.settings import Extension

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
        book.comment("fay", f"Well, {WORD}.", "tia")
        book.set_mark("bob", "2.16", "comparison", 1, "Fay Foot has it at fay@uni.", "lea")
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


@pytest.fixture
def slim(out):
    """The same without what takes long to be written anew."""
    for name in ("attainment.csv", "levels.csv", "sheets.html"):
        (out / name).unlink()
    return out


def forget(out, *more, **how):
    return rotflex("person", "erase", out, "fay", "--by", "lea", "--solutions", OURS.folder, *more, **how)


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
    done = forget(out, "--yes")
    assert done.exit_code == 0, done.output
    assert "fay is erased." in said(done)
    assert named(out, "fay", "Fay", "Foot", WORD) == []
    after = files(out)
    gone = {name for name in before if name.startswith("fay/")}
    assert set(after) == set(before) - gone and len(gone) > 2
    pages = {
        f"{one}/{name}" for one in ("ada", "bob", "cleo", "dan", "eve") for name in ("marks.json", "feedback.html")
    }
    assert [name for name in sorted(pages) if before[name] != after[name]] == ["bob/feedback.html", "bob/marks.json"]
    for name in ("bob/feedback.html", "bob/marks.json"):  # whose remark named her
        struck = before[name].replace(b"Fay Foot", b"[erased 6]").replace(b"fay@uni", b"[erased 6]")
        assert struck == after[name]  # wherever the remark is
    assert b"Student" not in after["grades.csv"] and set(rows(out)) == {*NAMES, "hal"} - {"fay"}


@pytest.mark.slow
def test_what_would_go_is_told_and_stays_unless_it_is_confirmed(slim):
    out = slim
    before = files(out)
    for done in (forget(out, "--dry-run"), forget(out, input="n\n")):
        assert "2 deliveries" in said(done) and "1 comments" in said(done)
        assert f"to delete {out / 'fay'}" in said(done) and "bob: mark by a person, 2.16, comparison, lea" in said(done)
        assert "Nothing was erased" in said(done)
    assert done.exit_code == 2
    after = files(out)
    assert after.keys() == before.keys()
    assert {name for name in before if before[name] != after[name]} <= {"gradebook.sqlite"}
    with Gradebook(out / "gradebook.sqlite") as book:
        assert book.current("fay") is not None
    assert forget(out, input="y\n").exit_code == 0


@pytest.mark.slow
def test_where_they_are_named_still_is_told(out, tmp_path):
    (out / "attainment.csv").unlink()
    (out / "levels.csv").unlink()
    (out / "sent.csv").write_text("student,mark\nFAY,3\n", encoding="utf-8")
    with zipfile.ZipFile(out / "old.xlsx", "w") as packed:
        packed.writestr("a.xml", "<c>Fay Foot</c>")
    (out / "other.txt").write_text("fayence", encoding="utf-8")
    with zipfile.ZipFile(out / "damaged.ods", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("a.xml", bytes(1000))
    content = (out / "damaged.ods").read_bytes()
    (out / "damaged.ods").write_bytes(re.sub(rb"(?<=a\.xml)....", b"\xff" * 4, content, count=1, flags=re.DOTALL))
    handed_in = tmp_path / "in" / "fay"
    handed_in.mkdir(parents=True)
    (handed_in / "02_finding_stiffness.ipynb").write_bytes(notebook("fay = 1"))
    with Gradebook(out / "gradebook.sqlite") as book:
        deliver(book, "bob", {"notes.txt": b"Fay Foot helped me."})
    course = copied(tmp_path / "course", ["00_start.ipynb"])
    (course / "course.toml").write_text(
        '[[deadline]]\ndue = 2026-01-01\n[[extension]]\nuntil = 2026-02-03\nstudents = ["Fay"]\n', encoding="utf-8"
    )
    words = ("person", "erase", out, "fay", "--by", "lea", "--solutions", course, "--yes")
    done = rotflex(*words, "--submissions", tmp_path / "in")
    assert done.exit_code == 1, done.output
    for line in (
        str(out / "sent.csv"),
        str(out / "old.xlsx"),
        f"{out / 'damaged.ods'} (it could not be searched)",
        str(handed_in),
        "course.toml, in an extension until 2026-02-03",
        "bob: file that they handed in, notes.txt",
        "sheets.html: taken away, and not written anew. This course has no scoring sheets",
    ):
        assert line in said(done)
    assert "other.txt" not in done.output


@pytest.mark.parametrize(("name", "found"), [("FAY", 1), ("4711", 1), ("eve", 0)])
def test_an_extension_names_them_by_any_of_their_names(name, found):
    extensions = (Extension(HANDED_IN, (name,)),)
    course = replace(OURS, settings=replace(OURS.settings, extensions=extensions))
    assert len([*in_settings(course, StudentRecord("fay", aliases=("4711",)))]) == found


def test_a_copy_holds_all_records_and_each_file_as_it_came(out, tmp_path):
    target = tmp_path / "fay.zip"
    words = ("person", "copy", out, "fay", target, "--solutions", OURS.folder)
    done = rotflex(*words)
    assert done.exit_code == 0 and "All records and 2 files" in said(done)
    with zipfile.ZipFile(target) as packed:
        content = {name: packed.read(name) for name in packed.namelist()}
    stored = json.loads(content["record.json"])
    assert stored["students"][0]["email"] == "fay@uni" and stored["runs"][0]["answers"] == WORD
    assert content["handed_in/0002 2026-03-03/data/log.csv"] == f"{WORD}, 1".encode()
    assert content["fay/feedback.html"] == (out / "fay" / "feedback.html").read_bytes()
    assert not any(b"cleo" in one for one in content.values())
    assert rotflex(*words).exit_code == 2 and rotflex(*words, "--force").exit_code == 0


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
        assert told.startswith("ada was erased on ") and "--again ada" in told and made.students == ["bob"]
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
        assert facts_of(before["bob"].run).bench_of == "ada" and when
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
            assert facts_of(now.run).bench_of == "bob"  # the same for both: they worked together
            assert received(book, one, now) == when
        for one in regrade(book, fake_class.course):
            assert (one.problem, one.after.marks) == ("", before[one.after.run.student].marks)
