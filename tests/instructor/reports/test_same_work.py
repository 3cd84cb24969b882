"""One list of what class-mates have in common, from a gradebook: an entry for each pair or group, with its evidence."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from hashlib import sha256

import alike_class
import pytest
from checkout import ROOT
from gradebooks import graded, mark, record
from honest_hand_in import solved_notebooks, written
from made_courses import OURS, copied

from rotflex.courseware.benches import BenchPolicy
from rotflex.instructor.gradebook import Delivery, Gradebook
from rotflex.instructor.graded_run import Facts
from rotflex.instructor.overview import glance
from rotflex.instructor.release import student_course
from rotflex.instructor.reports import same_work
from rotflex.instructor.reports.grades import Reports
from rotflex.instructor.reports.same_work import About, Found, Hint

WHEN = datetime(2026, 3, 2, 12, tzinfo=UTC)
WORDS = "The peak lies a little low since the damping of the joint pulls it down, and the sweep passes it so quickly "
WORDS += "that the arm has no time to come to rest before the frequency has moved on by another tenth of a hertz."


@pytest.fixture
def book(tmp_path):
    with Gradebook(tmp_path / "book.sqlite") as opened:
        yield opened


def hand_in(book, student, files, bench_of="", words=""):
    cells = Facts(bench_of=bench_of or student, policy=BenchPolicy()).plain()
    said = {"2.11": {"explanation": {"text": words, "pictures": {}}}} if words else {}
    record(book, graded(student, mark(), cells=cells, words=said))
    deliveries = [
        Delivery(name, sha256(content).hexdigest(), content, WHEN, "a folder") for name, content in files.items()
    ]
    book.deliver(student, deliveries)


def test_numbers_recordings_code_and_words_of_a_pair_are_one_entry(book, tmp_path):
    files = alike_class.honest_class(3)
    own = {"scan.png": b"\x89PNG\x00\xff"}
    ada, bob, eve = files.values()
    hand_in(book, "ada", {**ada, **own}, words=WORDS)
    hand_in(book, "bob", {**alike_class.copied("bob", ada, bob, rename=1.0), **own}, words=WORDS.upper())
    hand_in(book, "eve", eve, words="Because it is damped.")
    found = same_work.of_class(book, OURS)
    assert [hint.about for hint in found.hints] == [About.MEASURED, About.CODE, About.WORDS]
    assert list(same_work.by_students(found.hints)) == [("ada", "bob")]
    text = same_work.text(found)
    assert "**A hint, never a verdict.**" in text and text.count("## ") == 1 and "## ada, bob\n" in text
    assert "* ada, bob handed in the same 1 file: scan.png." in text
    assert 'words in common that hardly anybody else has (2.11 explanation): "The peak lies' in text
    reports = Reports(tmp_path / "out", OURS, book)
    reports.write_all()
    assert (tmp_path / "out" / "hints.md").read_text(encoding="utf-8") == text
    assert [line.split(",")[0] for line in reports.hints.splitlines()] == [
        "Measurements that several handed in",
        "Code that two have in common and hardly anybody else",
        "Words that two have in common and hardly anybody else",
    ]


def test_who_hands_in_together_is_left_out_however_much_is_the_same(book):
    (ada,) = alike_class.honest_class(1).values()
    files = {**ada, "scan.png": b"\x89PNG\x00\xff"}
    hand_in(book, "ada", files, words=WORDS)
    hand_in(book, "bob", files, bench_of="Ada", words=WORDS)
    assert same_work.of_class(book, OURS) == Found(())


def test_the_newest_of_what_was_handed_in_counts(book):
    ada, bob = alike_class.honest_class(2).values()
    hand_in(book, "ada", ada)
    hand_in(book, "bob", ada)
    later = [Delivery(n, sha256(c).hexdigest(), c, WHEN.replace(day=3), "again") for n, c in bob.items()]
    book.deliver("bob", later)
    assert same_work.of_class(book, OURS) == Found(())


def test_two_who_write_as_the_solution_does_have_nothing_in_common(book):
    for student in ("ada", "bob"):
        hand_in(book, student, {name: written(notebook) for name, notebook in solved_notebooks(ROOT).items()})
    assert same_work.of_class(book, OURS) == Found(())


def test_a_class_of_eighty_who_did_it_themselves_gets_no_list(book):
    for student, files in alike_class.honest_class(80, seed=21).items():
        hand_in(book, student, files)
    assert same_work.of_class(book, OURS) == Found(())


def test_a_fault_in_a_notebook_of_the_course_accuses_nobody_and_is_told_where_hints_are(book, tmp_path):
    given = {name: text.encode() for name, text in student_course.derived(OURS).items()}
    for student in ("ada", "bob"):
        hand_in(book, student, {**given, "scan.png": b"\x89PNG\x00\xff"}, words=WORDS)
    faulty = replace(OURS, folder=copied(tmp_path, [path.name for path in OURS.notebooks]))
    path = faulty.folder / "03_model_validation.ipynb"
    path.write_text(path.read_text(encoding="utf-8").replace("### END SOLUTION", "", 1), encoding="utf-8")
    found = same_work.of_class(book, faulty)
    assert [hint.about for hint in found.hints] == [About.MEASURED]
    assert found.left_out.startswith("Code and words were not compared") and "03_model_validation" in found.left_out
    reports = Reports(tmp_path / "out", faulty, book)
    reports.write_all()
    text = (tmp_path / "out" / "hints.md").read_text(encoding="utf-8")
    assert found.left_out in text and "scan.png" in text and found.left_out in reports.hints
    (hints,) = (one for one in glance.at(book, faulty).sections if one.title == "Hints of the same work")
    assert found.left_out in hints.more and hints.urgent
    assert [hint.about for hint in same_work.of_class(book, OURS).hints] == [About.MEASURED, About.WORDS]


def test_what_was_not_compared_is_told_where_there_is_no_hint_at_all(book, tmp_path):
    hand_in(book, "ada", {"own.py": b"x = 1"})
    nowhere = replace(OURS, folder=tmp_path / "nowhere")
    (hints,) = (one for one in glance.at(book, nowhere).sections if one.title == "Hints of the same work")
    assert hints.first == "Nobody has anything in common that hardly anybody else has, as far as it was compared."
    Reports(tmp_path / "out", nowhere, book).write_all()
    assert "There are no notebooks in" in (tmp_path / "out" / "hints.md").read_text(encoding="utf-8")


def test_those_who_have_more_sorts_in_common_come_first():
    hints = [
        Hint(("bob", "ada"), About.NUMBERS, "b"),
        Hint(("eve", "dan"), About.NUMBERS, "e"),
        Hint(("dan", "eve"), About.CODE, "c"),
        Hint(("ada", "bob"), About.NUMBERS, "d"),
    ]
    assert list(same_work.by_students(hints)) == [("dan", "eve"), ("ada", "bob")]


def test_what_steers_a_terminal_or_turns_writing_is_written_out(book, tmp_path):
    evil = "\n".join(f"name_{n} = '\u202e\x1b[2J {n}' + str({n} * {n})" for n in range(12)).encode()
    for student in ("ada", "bob"):
        hand_in(book, student, {"own.py": evil})
    reports = Reports(tmp_path / "out", OURS, book)
    reports.write_all()
    text = (tmp_path / "out" / "hints.md").read_text(encoding="utf-8")
    assert "own.py" in text and "\u202e" not in text and "\x1b" not in text
    assert json.dumps(text)
