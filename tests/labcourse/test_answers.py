"""The answer book: what is kept, what is never lost."""

import errno
import inspect
import json
import os
import subprocess
import sys

import numpy as np
import pytest

import labcourse
import rotflex.files
from labcourse import files
from labcourse.answers import answers
from labcourse.answers.answers import AnswerBook, ResultsTable, parse
from labcourse.answers.parts import Part, Probe, Question
from labcourse.errors import AnswerError
from rotflex.course.questions import CATALOGUE

BENCH = {"uri": "virtual", "seed": 5, "arm_position": 2}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "answers.json"


def book_at(path, student="ada", seed=12):
    return AnswerBook(path, student, BENCH, seed)


def test_the_file_is_the_documented_plain_data(path):
    book_at(path).answer(CATALOGUE.find("2.11"), {"omega_n": 19.9}, "q2-11-answer")
    text = path.read_text()
    assert json.loads(text) == {
        "format": 2,
        "student": "ada",
        "bench": BENCH,
        "software": f"labcourse {labcourse.__version__}",
        "probe_seed": 12,
        "answers": {"2.11": {"omega_n": {"kind": "number", "value": 19.9}}},
        "cells": {"2.11": {"omega_n": "q2-11-answer"}},
    }
    assert text == json.dumps(json.loads(text), sort_keys=True) + "\n"


def test_the_latest_cell_to_record_an_answer_is_known(path):
    for cell in ("q2-11-answer", "", "mine"):
        book_at(path).answer(CATALOGUE.find("2.11"), {"omega_n": 19.9}, cell)
        assert json.loads(path.read_text())["cells"] == {"2.11": {"omega_n": cell}}


def test_each_part_is_acknowledged_by_a_line_and_kept_or_refused_by_itself(path):
    book = book_at(path)
    replies = book.answer(CATALOGUE.find("2.11"), {"omega_n": None})
    assert not path.exists()
    for number, given in (
        ("2.11", {"omega_n": 3.17, "explanation": None}),
        ("2.11", {"omega_n": None}),
        ("2.11", {"omega_n": "19"}),
        ("2.12", {"J_l": 0.0035, "K_s": "stiff"}),
    ):
        replies += book.answer(CATALOGUE.find(number), given)
    assert [reply.recorded for reply in replies] == [False, True, False, False, False, True, False]
    kept = {
        "2.11": {"omega_n": {"kind": "number", "value": 3.17}},
        "2.12": {"J_l": {"kind": "number", "value": 0.0035}},
    }
    assert parse(path.read_bytes())["answers"] == kept
    for reply, fragments in zip(
        replies,
        (
            ["2.11  omega_n  not answered yet"],
            ["2.11  omega_n = 3.17 rad/s  recorded", "hertz"],
            ["2.11  explanation  not answered yet"],
            ["2.11  omega_n  not answered yet", "the earlier answer stays"],
            ["2.11  omega_n  not recorded: it is text", "the earlier answer stays"],
            ["2.12  J_l = 0.0035 kg·m²  recorded"],
            ["2.12  K_s  not recorded: it is text"],
        ),
        strict=True,
    ):
        assert all(fragment in str(reply) for fragment in fragments)
        assert ("earlier" in str(reply)) == ("the earlier answer stays" in fragments)


def test_an_unknown_part_is_an_error_and_nothing_is_recorded(path):
    with pytest.raises(AnswerError, match="omega_n, explanation"):
        book_at(path).answer(CATALOGUE.find("2.11"), {"omega_n": 19.9, "omega": 3})
    assert not path.exists()
    with pytest.raises(AnswerError, match="nothing"):
        book_at(path).answer(CATALOGUE.find("2.11"), {})


def test_two_notebooks_may_be_open_at_once(path):
    first, second = book_at(path), book_at(path)
    first.answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    second.answer(CATALOGUE.find("2.12"), {"K_s": 1.3})
    first.refresh()
    assert first.get("2.12", "K_s")["value"] == 1.3
    assert book_at(path).get("2.11", "omega_n")["value"] == 19.9


#: Records 100 answers to a question, as fast as it can.
RECORDING = """
import sys
from pathlib import Path
from labcourse.answers.answers import AnswerBook
from labcourse.answers.parts import Part, Question
parts = tuple(Part(f"p{n}", "number", 1, "") for n in range(100))
book = AnswerBook(Path(sys.argv[1]), "ada", {}, 1)
print("ready", flush=True)
sys.stdin.readline()
for part in parts:
    assert book.answer(Question(sys.argv[2], "1", "a", "", (), parts), {part.name: 1.0})[0].recorded
"""


def test_two_notebooks_that_record_at_the_same_time_lose_nothing(path):
    command = [sys.executable, "-c", RECORDING, str(path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    programs = [subprocess.Popen([*command, number], **pipes) for number in ("1", "2")]
    assert [program.stdout.readline() for program in programs] == ["ready\n"] * 2
    for program in programs:
        program.stdin.write("\n")
        program.stdin.flush()
    assert [program.wait() for program in programs] == [0, 0]
    answers_of = parse(path.read_bytes())["answers"]
    assert {number: len(parts) for number, parts in answers_of.items()} == {"1": 100, "2": 100}


def test_another_notebook_may_record_while_a_function_is_tried(path):
    """That may take long, and another answer that comes in the meantime must not wait, or be lost."""
    other = book_at(path)

    def voltage(x):
        other.answer(CATALOGUE.find("2.12"), {"K_s": 1.3})
        return x

    part = Part("f", "function", 1, "", probe=Probe("p", "f(x)", 1, lambda _: [(1.0,)], lambda y: [y], tuple))
    book = book_at(path)
    (reply,) = book.answer(Question("1", "1", "a", "", (), (part,)), {"f": voltage})
    assert reply.recorded and not (book.notices or other.notices)
    assert parse(path.read_bytes())["answers"].keys() == {"1", "2.12"}


@pytest.mark.parametrize("why", [errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EBADF, errno.EAGAIN])
def test_where_no_lock_can_be_had_that_is_said_once_and_recording_goes_on(path, monkeypatch, why):
    """As on network drives; EAGAIN: a program has it, and does not come to its end."""

    def refuse(*_):
        raise OSError(why, os.strerror(why))

    monkeypatch.setattr("fcntl.flock", refuse)
    monkeypatch.setattr(files, "_LONGEST_LOCK", 0.1)
    book = book_at(path)
    for value in (1.0, 2.0):
        book.answer(CATALOGUE.find("2.11"), {"omega_n": value})
    assert book_at(path).get("2.11", "omega_n")["value"] == 2.0
    (notice,) = book.notices
    assert os.strerror(why) in notice


@pytest.mark.parametrize("lay", [os.mkfifo, os.mkdir, lambda lock: os.symlink("elsewhere", lock)])
def test_what_lies_in_the_locks_place_stops_nobody_and_leads_nowhere(path, lay):
    lay(path.with_name(".answers.json.lock"))
    book_at(path).answer(CATALOGUE.find("2.11"), {"omega_n": 1.0})
    assert book_at(path).get("2.11", "omega_n") and not path.with_name("elsewhere").exists()


def test_the_house_has_one_lock():
    """The laboratory and the engine import nothing of each other, so each has the function."""
    assert inspect.getsource(files.lock) == inspect.getsource(rotflex.files.lock)


BROKEN = {"empty": b"", "cut off": b"{", "list": b"[]", "not UTF-8": b"\xff\xfe", "keys missing": b'{"format": 1}'}
BROKEN |= {"deep": b"[" * 100_000, "NaN": b'{"a": NaN}', "too large": b" " * (answers.MAX_BYTES + 1)}


@pytest.mark.parametrize("broken", BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_put_aside_with_a_word_and_never_lost(path, broken):
    path.write_bytes(broken)
    book = book_at(path)
    (notice,) = book.notices
    assert "put aside as answers.broken.json" in notice
    assert (path.parent / "answers.broken.json").read_bytes() == broken
    book.answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    assert book_at(path).get("2.11", "omega_n")["value"] == 19.9


def test_a_second_broken_file_does_not_take_the_place_of_the_first(path):
    for content in (b"first", b"second"):
        path.write_bytes(content)
        book_at(path)
    assert (path.parent / "answers.broken.json").read_bytes() == b"first"
    assert (path.parent / "answers.broken-2.json").read_bytes() == b"second"


def test_another_students_answers_are_put_aside_and_not_mixed_in(path):
    book_at(path, student="demo").answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    book = book_at(path, student="ada")
    assert book.get("2.11", "omega_n") is None
    (notice,) = book.notices
    assert "answers.demo.json" in notice and "'ada'" in notice
    assert parse((path.parent / "answers.demo.json").read_bytes())["student"] == "demo"


def test_an_aside_name_stays_in_the_folder_whatever_the_students_id(path):
    book_at(path, student="../../x/y").answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    book_at(path, student="ada")
    assert [file.name for file in path.parent.glob("*.json")] == ["answers..._.._x_y.json"]


def test_outputs_of_functions_are_dropped_when_their_inputs_have_changed(path):
    def spectrum(x, dt):
        return np.fft.rfftfreq(len(x), dt), np.abs(np.fft.rfft(x))

    book = book_at(path, seed=1)
    book.answer(CATALOGUE.find("2.10"), {"spectrum": spectrum})
    book.answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    assert book_at(path, seed=1).get("2.10", "spectrum") is not None
    other = book_at(path, seed=2)
    assert other.get("2.10", "spectrum") is None
    assert other.get("2.11", "omega_n") is not None


def test_a_crash_while_writing_leaves_the_old_file(path, monkeypatch):
    book = book_at(path)
    book.answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    before = path.read_bytes()

    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fails)
    with pytest.raises(AnswerError, match=r"cannot be written: No space left"):
        book.answer(CATALOGUE.find("2.12"), {"K_s": 1.3})
    assert path.read_bytes() == before
    assert not list(path.parent.glob("*.tmp"))


CHANGES = [{"format": number} for number in (1, 3, "2", [2])]
CHANGES += [{"student": 3}, {"bench": []}, {"more": 1}, {"cells": []}]
CHANGES += [{"probe_seed": -1}, {"probe_seed": "1"}, {"probe_seed": True}, {"cells": {"2.11": {"omega_n": 1}}}]
CHANGES += [{"answers": []}, {"answers": {"2.11": []}}, {"answers": {"2.11": {"omega_n": 19.9}}}, {"when": []}]
CHANGES += [{"when": {"2.11": {"omega_n": when}}} for when in (-1, 1.5, True)]


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_an_untrusted_file_of_another_form_is_not_read(path, change):
    book_at(path).answer(CATALOGUE.find("2.11"), {"omega_n": 19.9})
    content = json.loads(path.read_bytes())
    assert parse(json.dumps(content).encode()) == content
    with pytest.raises(AnswerError):
        parse(json.dumps({**content, **change}).encode())


def test_a_results_table_shows_what_was_entered_and_what_is_missing(path):
    book = book_at(path)
    book.answer(
        CATALOGUE.tables["Table 2"],
        {"omega_n": 19.876, "B": [0, 0, 479.8, -479.8], "poles": [0, -18.9, -8 + 27j, -8 - 27j]},
    )
    table = ResultsTable(CATALOGUE.tables["Table 2"], book)
    text = str(table)
    assert "omega_n             19.9 rad/s" in text
    assert "K_s                 (not filled in yet)" in text
    assert "-18.9, -8 - 27j, -8 + 27j, 0" in text
    html = table._repr_html_()
    assert html.count("<tr>") == 1 + 7
    assert "not filled in yet" in html and "19.9" in html


def test_a_results_table_survives_a_file_edited_by_hand(path):
    book_at(path).answer(CATALOGUE.tables["Table 2"], {"omega_n": 19.9})
    path.write_text(path.read_text().replace("19.9", '"<b>"'))
    assert "unreadable" in str(ResultsTable(CATALOGUE.tables["Table 2"], book_at(path)))
