"""A whole class on the whole course, against marks worked out by hand (see ``whole_class.py``)."""

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import whole_class
import whole_class_notebooks
from checkout import ROOT
from made_courses import OURS
from whole_class import CLASS
from whole_class_notebooks import NOTEBOOKS
from whole_class_slips import SLIPS
from working_through import FULL, JUDGED, PROSE

from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench

PROBE_SEED = 20_240_229
CELL_TIMEOUT = 40  # s; the endless loop runs as long
FOLLOWS = "right, given your own earlier answers"


@pytest.fixture(scope="session")
def key():
    return OURS.key


@pytest.fixture(scope="session")
def bytes_of(tmp_path_factory):
    """Each student's answers, worked out when first asked for."""

    @cache
    def worked(name):
        return whole_class.claims(name, CLASS[name], tmp_path_factory.mktemp(name))

    return worked


def marks_of(data, name, key):
    return mark(
        replace(OURS, key=key), decode(data, student_seed(name), OURS.catalogue), TrueBench(name), student_seed(name)
    )


@pytest.fixture(scope="session")
def marks(bytes_of, key):
    """Each student's marks by question and part, worked out when first asked for."""

    @cache
    def marked(name):
        return {(one.question, one.part): one for one in marks_of(bytes_of(name), name, key)}

    return marked


def test_the_points_are_those_of_the_catalogue():
    assert sum(FULL.values()) == 82.5
    assert sum(PROSE.values()) + sum(JUDGED.values()) == 42 + 4


@pytest.mark.parametrize("name", CLASS)
def test_points_are_those_worked_out_by_hand(marks, name):
    expected = CLASS[name].points()
    given = {where: one.points for where, one in marks(name).items() if where in expected}
    assert given.keys() == expected.keys()
    differing = {where: (given[where], marks(name)[where].reason) for where in given if given[where] != expected[where]}
    assert differing == {}
    assert sum(one.awaiting for one in marks(name).values()) == CLASS[name].awaiting()


@pytest.mark.parametrize("name", [name for name, student in CLASS.items() if student.follows])
def test_what_follows_from_a_mistake_is_said_to_follow(marks, name):
    assert {where: marks(name)[where].status.value for where in CLASS[name].follows} == dict.fromkeys(
        CLASS[name].follows, FOLLOWS
    )


@pytest.mark.parametrize("name", ["ada", "rough"])
def test_what_is_right_within_its_tolerance_is_right_and_not_merely_consistent(marks, name):
    auto = {one.status.value for where, one in marks(name).items() if where in FULL}
    assert auto == {"right"}


def test_nothing_is_recorded_of_what_has_not_the_form_of_an_answer(bytes_of):
    assert bytes_of("nonsense") is None


def test_students_have_different_benches():
    assert len({(TrueBench(name).joint.arm_position, TrueBench(name).K_s) for name in CLASS}) == len(CLASS)


def _verdict(where, change, name, bytes_of, key):
    seed = student_seed(name)
    claims = decode(bytes_of(name), seed, OURS.catalogue)
    given = change(claims.values[where], claims.values)
    claims.values[where] = np.sort_complex(given) if claims.contents[where]["kind"] == "poles" else given
    marks = mark(replace(OURS, key={where[0]: key[where[0]]}), claims, TrueBench(name), seed)
    return next(one for one in marks if one.part == where[1])


@pytest.mark.parametrize(("where", "what"), SLIPS)
def test_a_plausible_slip_does_not_pass(where, what, bytes_of, key):
    found = _verdict(where, SLIPS[where, what], "ada", bytes_of, key)
    assert (found.status.value, found.points) == ("wrong", 0), found.reason


@pytest.mark.parametrize("constant", [b"NaN", b"Infinity", b"-Infinity", b"1e999"])
def test_a_number_that_is_none_is_refused(constant, bytes_of, key):
    content = json.loads(bytes_of("ada"))
    content["answers"]["2.11"]["omega_n"]["value"] = "here"
    claims = decode(json.dumps(content).encode().replace(b'"here"', constant), student_seed("ada"), OURS.catalogue)
    assert claims.problems or ("2.11", "omega_n") in claims.malformed
    marks = mark(replace(OURS, key={"2.11": key["2.11"]}), claims, TrueBench("ada"), student_seed("ada"))
    assert next(one for one in marks if one.part == "omega_n").points == 0


FORGED = {
    ("0.1", "resolution"): "0.0015",
    ("2.14", "A"): [["0"] * 4] * 4,
    ("2.18", "poles"): [[0, 0], [1, 2, 3], "x", None],
    ("3.2", "polynomial"): [[1.0, 2.0]],
    ("3.7", "W"): [[1e308] * 4] * 4,
    ("3.8", "K"): [[1e308, -1e308, 1e308, -1e308]],
    ("3.9", "poles"): [[1e308, 1e308]] * 4,
    ("3.12", "t_s"): True,
    ("2.1", "V"): ["pow", ["int", 9], ["pow", ["int", 9], ["pow", ["int", 9], ["int", 9]]]],
}


def test_forged_answers_cost_their_own_points_and_stop_nothing(bytes_of, key):
    content = json.loads(bytes_of("ada"))
    for (number, part), value in FORGED.items():
        content["answers"][number][part]["value"] = value
    marks = {(one.question, one.part): one for one in marks_of(json.dumps(content).encode(), "ada", key)}
    assert {where: marks[where].points for where in FORGED} == dict.fromkeys(FORGED, 0)
    untouched = [("2.2", "T"), ("2.11", "omega_n"), ("2.12", "J_l"), ("3.4", "desired_poles"), ("3.10", "K")]
    assert {where: marks[where].points for where in untouched} == {where: FULL[where] for where in untouched}


def test_a_perfect_file_of_another_student_does_not_earn_what_depends_on_the_bench(bytes_of, key):
    marks = marks_of(bytes_of("ada"), "silent", key)
    copied = {(one.question, one.part): one.points for one in marks}
    for where in (("2.9", "sweep"), ("2.15", "validation"), ("3.13", "response"), ("3.15", "response")):
        assert copied[where] == 0, where


@pytest.fixture(scope="session")
def marks_folder(tmp_path_factory, sandbox):
    """Grade those who submit notebooks by the command, as an instructor does; return the folder of marks."""
    folder = tmp_path_factory.mktemp("whole-class")
    whole_class_notebooks.hand_in(folder / "submissions")
    command = [sys.executable, "-m", "rotflex.cli", "grade", folder / "marks", folder / "submissions"]
    command += [
        "--solutions",
        ROOT,
        "--jobs",
        "2",
        "--cell-timeout",
        str(CELL_TIMEOUT),
        "--probe-seed",
        str(PROBE_SEED),
    ]
    subprocess.run(command, capture_output=True, text=True, check=False, timeout=1500)
    return folder / "marks"


@pytest.fixture(scope="session")
def graded(marks_folder):
    return {name: json.loads((marks_folder / name / "marks.json").read_text(encoding="utf-8")) for name in NOTEBOOKS}


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_earn_what_was_worked_out_by_hand(graded, name):
    earned, waiting, reasons = {}, 0.0, []
    for one in graded[name]["marks"]:
        where = one["question"], one["part"]
        if where in PROSE or where[0] in CATALOGUE.judged:
            waiting += one["out_of"] if one["status"] == "for a person" else 0.0
        else:
            earned[one["question"]] = earned.get(one["question"], 0.0) + one["points"]
            if one["points"] < one["out_of"]:
                reasons.append((where, one["reason"]))
    expected = {question: points for question, points in NOTEBOOKS[name].points().items() if question in earned}
    assert {question: earned[question] for question in expected} == expected, reasons
    assert waiting == NOTEBOOKS[name].awaiting


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_what_was_wrong_with_notebooks_is_reported(graded, name):
    for reported, pieces in (("problems", NOTEBOOKS[name].trouble), ("notes", NOTEBOOKS[name].notes)):
        said = " ".join(graded[name][reported])
        assert bool(said) == bool(pieces), said
        assert all(piece in said for piece in pieces), said


def test_feedback_does_not_give_away_the_values_of_the_bench(marks_folder):
    bench = TrueBench("consistent")
    page = (marks_folder / "consistent" / "feedback.html").read_text(encoding="utf-8").split("</style>")[1]
    assert "omega_n" in page
    for value in (bench.K_s, bench.omega_n, bench.omega_n / 6.2832):
        assert f"{value:#.4g}" not in page
