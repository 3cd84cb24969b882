"""A class that worked at a laboratory's bench, from the notebooks there to marks and feedback.

The bench is a virtual one of nobody's behind an address of its own; the rest is what students and instructors have:
recordings kept as they are made, the check at home, the zip, the command that grades, the pages.
"""

import json
import re
import shutil
import subprocess
import sys

import pytest
import real_class
from page_text import page_text

from labcourse.grading.release import student_course
from labcourse.run.check import CheckState, check
from labcourse.sentences import sentence
from rotflex.course.spare_design import SPARE_GAIN
from rotflex.recording import Recording

pytestmark = [pytest.mark.scheduled, pytest.mark.isolation]

NOTEBOOKS = [
    "02_finding_stiffness.ipynb",
    "03_model_validation.ipynb",
    "05_control_prelab.ipynb",
    "06_control_design.ipynb",
    "08_full_state_feedback.ipynb",
    "09_partial_state_feedback.ipynb",
]
#: Questions that the bench has a part in: the sweep and what follows from it, the model beside it, both loops.
MEASURED = ("2.9", "2.10", "2.11", "2.12", "2.14", "2.15", "2.18", "3.8", "3.13", "3.14", "3.15", "3.16")
RUNAWAY = "K = -np.array([[18.2356, -17.1547, 1.5893, 0.6327]])"  # pushes the servo away from where it is sent


@pytest.fixture(scope="module")
def school(tmp_path_factory):
    base = tmp_path_factory.mktemp("real")
    made = real_class.made(base, NOTEBOOKS)
    ada = made.folder(base / "homes", "ada")
    made.at_the_bench(ada, "ada")
    return made, ada, base


def lose_the_partial(folder):
    for path in (folder / "recordings").glob("*.mat"):
        if Recording.load(path).metadata.get("feedback") == "partial":
            path.unlink()


def a_pairs(made, ada, homes):
    """The folder of Gil, who handed in with Hal: what they have done so far."""
    gil = made.copy(ada, homes, "gil")
    for path in [*gil.glob("*.ipynb"), *(gil / "recordings").glob("*-tracking.mat*")]:
        if path.name != NOTEBOOKS[0]:
            path.unlink()
    return gil


def edit(folder, which, factors=None, **metadata):
    paths = sorted((folder / "recordings").glob(which))
    assert paths
    for path in paths:
        one = Recording.load(path)
        channels = {name: one[name] * (factors or {}).get(name, 1.0) for name in one.channels}
        Recording.of(one.time, {**one.metadata, **metadata}, **channels).save(path)


@pytest.fixture(scope="module")
def graded(school, sandbox):
    """The class as the command grades it: honest Ada, her bench's partner Bob, and those who have something to hear."""
    made, ada, base = school
    homes, hand_ins = base / "homes", base / "hand-ins"
    bob, carl, dora = (made.copy(ada, homes, one) for one in ("bob", "carl", "dora"))
    lose_the_partial(carl)
    edit(dora, "*-validation.mat", {"alpha": 1.5})
    fay = made.folder(homes, "fay", {"q3-8": RUNAWAY})
    made.at_the_bench(fay, "fay", ["06_control_design.ipynb", "08_full_state_feedback.ipynb"])
    for folder in (ada, bob, carl, dora, fay):
        made.hand_in(folder, hand_ins)
    made.hand_in(a_pairs(made, ada, homes), hand_ins, ["hal"]).rename(hand_ins / "gil+hal.zip")
    for path in hand_ins.glob("*.txt"):
        path.unlink()
    command = [sys.executable, "-m", "rotflex.cli", "grade", base / "marks", hand_ins, "--solutions", made.source]
    done = subprocess.run(
        [*map(str, command), "--probe-seed", "7"], capture_output=True, text=True, check=False, timeout=900
    )
    return base / "marks", done


def result(graded, student):
    return json.loads((graded[0] / student / "marks.json").read_text(encoding="utf-8"))


def lost(graded, student):
    """(question, part) → status and reason of what is neither right nor to be read by a person."""
    return {
        (mark["question"], mark["part"]): (mark["status"], mark["reason"])
        for mark in result(graded, student)["marks"]
        if mark["question"] in MEASURED and mark["status"] not in ("right", "for a person")
    }


def page(graded, student):
    return page_text((graded[0] / student / "feedback.html").read_text(encoding="utf-8"))


def test_everything_that_the_bench_has_a_part_in_gets_full_marks_and_the_page_says_by_what(school, graded):
    assert lost(graded, "ada") == {}
    assert {mark["question"] for mark in result(graded, "ada")["marks"] if mark["status"] == "right"} >= set(MEASURED)
    assert result(graded, "ada")["problems"] == []
    assert graded[1].stderr.count("Traceback") == 0
    names = sorted(path.stem for path in (school[1] / "recordings").glob("*.mat"))
    (note,) = result(graded, "ada")["notes"]
    assert note == f"Marked with the bench north and {len(names)} recordings of it: {', '.join(names)}."
    assert len(names) > 5 and note in page(graded, "ada")


@pytest.mark.parametrize("student", ["gil", "hal"])
def test_one_bench_shared_by_a_pair_that_hands_in_together_costs_nothing(graded, student):
    status = {(mark["question"], mark["part"]): mark["status"] for mark in result(graded, student)["marks"]}
    assert (status["2.9", "sweep"], status["2.11", "omega_n"], status["2.12", "K_s"]) == ("right", "right", "right")
    assert "Marked with the bench north and 2 recordings of it: 001-sweep, 002-validation." in page(graded, student)


def test_the_same_recordings_of_several_are_told_to_the_teacher_and_not_to_the_class(graded):
    hints = (graded[0] / "hints.md").read_text(encoding="utf-8")
    lines = [line for line in hints.splitlines() if re.match(r"\* ada, bob(, \w+)* have the same samples", line)]
    assert [part for part in ("2.9 sweep", "2.15 validation", "3.13 response") if part not in " ".join(lines)] == []
    assert "fay" not in hints
    assert "Measurements that several handed in, as a hint and never a verdict:" in graded[1].stderr
    assert "the same samples" not in page(graded, "bob")


def test_a_recording_that_is_not_there_costs_what_builds_on_it_and_says_so(graded):
    gone = lost(graded, "carl")
    assert {question for question, _part in gone} == {"3.15", "3.16"}
    assert {status for status, _reason in gone.values()} == {"missing"}
    assert all("This experiment has no recording of your bench: tracking, feedback" in why for _s, why in gone.values())
    (problem,) = result(graded, "carl")["problems"]
    assert "Record it at the bench with what your notebook has now, and hand in the folder" in problem
    assert "has no recording of your bench" in page(graded, "carl") and "has no recording of your bench" in " ".join(
        graded[1].stdout.split()
    )


def test_a_recording_that_cannot_be_of_its_bench_is_for_a_person_and_both_are_told_why(graded):
    student = "dora"
    why = "002-validation does not count until a person has looked at it: its arm does not move as the arm of"
    assert lost(graded, student) == {}  # not a silent mark
    waiting = [
        mark
        for mark in result(graded, student)["marks"]
        if (mark["question"], mark["part"])
        in (("2.9", "sweep"), ("2.15", "validation"), ("3.13", "response"), ("3.14", "t_s"), ("3.15", "response"))
    ]
    assert [(mark["status"], mark["points"]) for mark in waiting] == [("for a person", 0.0)] * 5
    assert all("a person will look at it" in mark["reason"] for mark in waiting)
    assert "virtual" not in " ".join(mark["reason"] for mark in waiting)
    assert any(problem.startswith(why) for problem in result(graded, student)["problems"])
    assert why in page(graded, student)
    assert why[:40] in " ".join(graded[1].stdout.split())


def test_a_gain_that_passed_a_limit_at_the_bench_leaves_the_spare_one_with_full_marks(school, graded):
    kept = [Recording.load(path) for path in (school[2] / "homes/fay/recordings").glob("*.mat")]
    assert [one.metadata["K"] for one in kept] == [pytest.approx(SPARE_GAIN)]
    gone = lost(graded, "fay")
    assert gone["3.8", "K"][0] == "wrong"
    assert not {("3.13", "response"), ("3.14", "t_s"), ("3.14", "alpha_max_deg")} & gone.keys()


def test_at_home_recordings_stand_in_for_the_bench_and_what_was_not_recorded_says_so(school, tmp_path):
    made, ada, _base = school
    folder = tmp_path / "ada"
    shutil.copytree(ada, folder)
    lose_the_partial(folder)
    for path in folder.glob("*.ipynb"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace('bench = \\"virtual\\"', f'bench = \\"{real_class.ADDRESS}\\"'), encoding="utf-8")
    masters = {name: json.loads(text) for name, text in student_course.derive_notebooks(made.course).items()}
    found = check(folder, masters, made.course.catalogue)
    parts = {(part.question, part.name): part for part in found.parts if part.question in MEASURED}
    lacking = {where: part for where, part in parts.items() if part.state in (CheckState.MISSING, CheckState.DIFFERENT)}
    assert {question for question, _part in lacking} == {"3.15", "3.16"}
    assert all(part.state is CheckState.MISSING for part in lacking.values())
    assert "This experiment has no recording of your bench: tracking, feedback = partial" in sentence(
        lacking["3.15", "response"].why
    )
