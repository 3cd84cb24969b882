"""The commands of an instructor's day: status, publish, and a request with its answer."""

import json
import re
from dataclasses import replace
from datetime import timedelta

import pytest
from command_line import rotflex, said
from day_class import fill, score
from gradebooks import enrol, record, rows
from made_courses import OURS, copied

from labcourse import clock
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.reports import intake_table
from labcourse.grading.reports.grades import Reports
from labcourse.grading.scoring.desk import link
from labcourse.grading.submission import OWNER, Doubt
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    with Gradebook(folder / "gradebook.sqlite") as book:
        fill(book, tmp_path)
        score(book)
    return folder


def test_class_prints_it_and_writes_the_page_beside_the_gradebook(out):
    done = rotflex("status", out, "--solutions", OURS.folder)
    assert done.exit_code == 0, done.output
    assert "TO DO TODAY" in done.output and f"The same as a page: {out / 'class.html'}" in said(done)
    page = (out / "class.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>") and "Requests to look again" in page
    done = rotflex("status", f"sqlite:///{out / 'gradebook.sqlite'}", "--solutions", OURS.folder)
    assert done.exit_code == 0 and "No page was written: say where by --out." in said(done)


def test_publish_writes_pages_records_it_and_tells_what_is_not_ready_and_who_is_to_be_told(out):
    done = rotflex("publish", out, "--yes", "--by", "lea", "--note", "first half", "--solutions", OURS.folder)
    assert done.exit_code == 0, done.output
    assert "Still to be read by a person: 7 answers of 5 students" in said(done)
    assert "1 request not answered yet" in said(done) and "lea gave back all assignments" in said(done)
    assert (out / "ada" / "feedback.html").exists() and (out / "grades.csv").exists()
    with Gradebook(out / "gradebook.sqlite") as book:
        (one,) = book.publications()
        assert (one.actor, one.note) == ("lea", "first half")
        book.set_mark("cleo", "2.12", "K_s", 1.5, reason="rounding", actor="lea")
    again = rotflex("publish", out, "--yes", "--by", "lea", "--solutions", OURS.folder)
    moved = "Other marks than were given back before; tell cleo: 2.12 K_s"
    assert moved in said(again)
    assert "Other marks" not in said(rotflex("publish", out, "--yes", "--by", "lea", "--solutions", OURS.folder))


def test_publish_shows_first_and_what_was_given_back_can_be_taken_back(out):
    ours = ("publish", out, "--by", "lea", "--solutions", OURS.folder)
    with Gradebook(out / "gradebook.sqlite") as book:
        where = ("2.11", "explanation")
        book.scores.give("ada", where, 0.5, "tia", level=2, meaning="Level 2.")
        book.scores.give("dan", where, 0.5, "tia", level=2, remark="Why?")
        late = Problem.of(Code.VERSION_AFTER_GIVEN_BACK, "02_finding_stiffness.ipynb", time="now", counts="then")
        record(book, replace(book.current("bob"), run=replace(book.current("bob").run, notes=(late,))))
    nobodys = Doubt("scan.zip", OWNER, "", ("who knows",))
    intake_table.write(out / "intake.csv", [nobodys], {})
    before = {path: path.read_bytes() for path in out.rglob("*") if path.suffix != ".sqlite"}
    shown = rotflex(*ours, "--assignment", "02").output.splitlines()
    assert {path: path.read_bytes() for path in out.rglob("*") if path.suffix != ".sqlite"} == before
    assert (
        "ada: 02 finding stiffness 4.50 of 5 (marked)" in shown
        and "No page, as nothing of theirs is graded: gus, hal." in shown
    )
    assert [line for line in shown if "answer?" in line] == [f"  ada, 2.11 explanation: {link('ada', *where)}"]
    first = shown.index("Handed in, and does not count:")
    assert shown[first + 1] == f"  bob: {sentence(late)}" and "'scan.zip'" in shown[first + 2]
    other = said(rotflex(*ours, "--assignment", "03"))
    assert "answer?" not in other and sentence(late) not in other

    with Gradebook(out / "gradebook.sqlite") as book:
        book.comment("ada", "Say why.", actor="lea", question=where[0], part=where[1])

    for more in (("--yes",), ("--yes", "--assignment", "02")):
        done = rotflex(*ours, *more)
        assert done.exit_code == 0 and "answer?" not in done.output
    assert rotflex(*ours, "--undo", "--assignment", "02").exit_code == 2
    taken = said(rotflex(*ours, "--undo"))
    assert "Taken back: 02_finding_stiffness, which lea gave back on" in taken and "bob, cleo, dan, eve, fay." in taken
    with Gradebook(out / "gradebook.sqlite") as book:
        assert [one.notebooks for one in book.publications()] == [()]
    assert [rotflex(*ours, "--undo").exit_code for _again in range(2)] == [0, 2]


def test_a_mark_that_is_changed_while_pages_are_written_is_named_the_next_time(out, monkeypatch):
    write, publish = Reports.write_all, ("publish", out, "--yes", "--by", "lea", "--solutions", OURS.folder)

    def write_and_mark(reports):
        count = write(reports)
        with Gradebook(out / "gradebook.sqlite") as book:
            book.set_mark("cleo", "2.12", "K_s", 1.5, reason="rounding", actor="lea")
        return count

    with monkeypatch.context() as changed:
        changed.setattr(Reports, "write_all", write_and_mark)
        assert rotflex(*publish).exit_code == 0
    assert "Other marks than were given back before; tell cleo: 2.12 K_s" in said(rotflex(*publish))


def test_publish_counts_the_students_who_have_pages_and_names_the_others_and_what_it_does_not_write_anew(out):
    with Gradebook(out / "gradebook.sqlite") as book:
        enrol(book, out, ("zoe", "Zoe Zed", "", ""))
    publish = ("publish", out, "--yes", "--by", "lea", "--solutions", OURS.folder)
    message = said(rotflex(*publish))
    pages = [*out.glob("*/feedback.html")]
    assert len(pages) > 1 and f"Pages of {len(pages)} students: " in message and "as it was before" not in message
    assert re.search(r"No page, as nothing of theirs is graded: [a-z, ]*\bzoe\.", message)
    for name, command in (("sheets.html", "sheets"), ("attainment.csv", "report")):
        (out / name).write_text("of before", encoding="utf-8")
        assert f"{name} is as it was before: rotflex outcomes {command}" in said(rotflex(*publish))


def test_while_feedback_is_closed_pages_say_so_and_nothing_counts_as_given_back(out, tmp_path):
    opens = (clock.now() + timedelta(days=3)).isoformat(timespec="seconds")
    folder = copied(tmp_path / "closed")
    (folder / "course.toml").write_text(f"[feedback]\nfrom = {opens}\n", encoding="utf-8")
    done = rotflex("publish", out, "--yes", "--by", "lea", "--solutions", folder)
    assert done.exit_code == 1 and "So nothing is given back" in said(done)
    assert "19.9 rad/s" not in (out / "ada" / "feedback.html").read_text(encoding="utf-8")
    with Gradebook(out / "gradebook.sqlite") as book:
        assert book.publications() == []


def test_a_request_is_noted_listed_seen_beside_the_answer_and_open_until_it_is_answered(out):
    book, on = out / "gradebook.sqlite", ("--question", "2.12", "--part", "K_s", "--by", "tia")
    rotflex("comment", book, "cleo", "Why <i>not</i>?", "--ask", *on)
    assert "Why <i>not</i>?" in said(rotflex("status", book, "--out", out, "--solutions", OURS.folder))
    rotflex("report", book, "--out", out, "--solutions", OURS.folder)
    page = (out / "cleo" / "feedback.html").read_text(encoding="utf-8")
    assert "K_s: Asked on" in page and "not answered yet." in page and "Why &lt;i&gt;not&lt;/i&gt;?" in page
    assert page.index("Stiffness of the joint") < page.rindex("K_s: Asked on")
    assert "2.12, K_s: Asked on" in rows(out)["cleo"]["notes"]

    rotflex("comment", book, "cleo", "It stays.", *on)
    rotflex("report", book, "--out", out, "--solutions", OURS.folder)
    page = (out / "cleo" / "feedback.html").read_text(encoding="utf-8")
    assert page.count("K_s: Asked on") == 1 and page.index("Why &lt;i&gt;not") < page.index("It stays.")
    assert "not answered yet" not in page and "not answered yet" not in rows(out)["cleo"]["notes"]
    asked, answer = json.loads((out / "cleo" / "marks.json").read_text(encoding="utf-8"))["comments"]
    assert (asked["part"], asked["text"], asked["open"]) == ("K_s", "Why <i>not</i>?", False)
    assert (answer["part"], answer["text"], answer["by"]) == ("K_s", "It stays.", "tia") and "open" not in answer
    assert "Why <i>not</i>?" not in said(rotflex("status", book, "--out", out, "--solutions", OURS.folder))


def test_a_request_without_its_answer_is_refused(out):
    for more in (["--ask"], ["--part", "K_s"], ["--ask", "--question", "2.12"]):
        done = rotflex("comment", out, "cleo", "Why?", "--by", "tia", *more)
        assert done.exit_code == 2 and "--question and --part" in said(done)
