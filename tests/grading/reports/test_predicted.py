"""What a student predicted, on their page: as their own word, never marked, and whatever it holds."""

import json

import pytest
from gradebooks import result
from made_courses import OURS

import rotflex.course.lab
from labcourse.grading.gradebook import RunRecord
from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from labcourse.grading.reports import feedback
from labcourse.grading.reports.feedback import predictions_of
from labcourse.grading.submission import Submission
from rotflex import experiments
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    lab = rotflex.course.lab.start("ada", folder=tmp_path_factory.mktemp("ada"), quiet=True)
    with lab.bench() as bench:
        lab.answer("2.9", sweep=experiments.sweep(bench, progress=False))
    return lab.book.path.read_bytes()


@pytest.fixture(scope="module")
def foretold(answered, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ada-predicts")
    (folder / "answers.json").write_bytes(answered)
    lab = rotflex.course.lab.start("ada", folder=folder, quiet=True)
    lab.predict("2.9", time_of_largest_swing=3)
    lab.observed("2.9", why="<b>Resonance</b> comes later.")
    return lab.book.path.read_bytes()


def run_of(data):
    return RunRecord(
        key="key",
        student="ada",
        submission="submission",
        master="master",
        software="software",
        probe_seed=1,
        isolation="isolation",
        answers=data,
    )


def marks_of(data):
    seed = student_seed("ada")
    return tuple(
        mark(OURS, decode(data, seed, OURS.catalogue), TrueBench("ada"), Submission(student="ada", probe_seed=seed))
    )


def test_it_stands_beside_what_was_recorded_by_the_students_own_word(foretold):
    page = feedback.page(result(*marks_of(foretold), run=run_of(foretold)), OURS)
    assert "Predicted before the experiment" in page
    assert "By the student’s own word; never marked." in page
    assert "time_of_largest_swing = 3 s; recorded: time_of_largest_swing = " in page
    assert "&lt;b&gt;Resonance&lt;/b&gt; comes later." in page


def test_no_mark_depends_on_it(answered, foretold):
    assert marks_of(foretold) == marks_of(answered)
    assert decode(foretold, student_seed("ada"), OURS.catalogue).notes == []


def test_where_nothing_was_predicted_the_page_says_nothing_of_it(answered):
    page = feedback.page(result(*marks_of(answered), run=run_of(answered)), OURS)
    assert "Predicted" not in page
    assert predictions_of(run_of(b"{"), CATALOGUE) == predictions_of(run_of(None), CATALOGUE) == {}


def test_what_cannot_be_read_of_it_is_left_out_and_text_is_written_as_it_can_be(foretold):
    content = json.loads(foretold)
    content["predictions"] = {
        "2.9": {
            "said": {"time_of_largest_swing": {"kind": "number", "value": "much"}, "x": {}},
            "why": "\ud800 a\u0000",
        },
        "7.7": {"why": "what question?"},
        "2.15": {"said": {"turns_farther": {"kind": "choice", "value": "the moon"}}},
    }
    found = predictions_of(run_of(json.dumps(content).encode()), CATALOGUE)
    assert found.keys() == {"2.9"} and found["2.9"][0] == []
    found["2.9"][1].encode()
