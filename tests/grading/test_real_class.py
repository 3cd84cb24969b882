"""A class that worked at a laboratory's bench, from the notebooks there to marks and feedback.

The bench is a virtual one of nobody's behind an address of its own; the rest is what students and instructors have:
recordings kept as they are made, the zip, the command that grades, the pages.
"""

import json
import subprocess
import sys

import pytest
import real_class
from page_text import page_text

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


def bend_more(folder):
    """Make the arm of a validation bend half as much again."""
    (path,) = (folder / "recordings").glob("*-validation.mat")
    one = Recording.load(path)
    channels = {name: one[name] * (1.5 if name == "alpha" else 1.0) for name in one.channels}
    Recording.of(one.time, one.metadata, **channels).save(path)


@pytest.fixture(scope="module")
def graded(school, sandbox):
    """The class as the command grades it: honest Ada, and two who have something to hear."""
    made, ada, base = school
    homes, hand_ins = base / "homes", base / "hand-ins"
    carl, dora = (made.copy(ada, homes, one) for one in ("carl", "dora"))
    lose_the_partial(carl)
    bend_more(dora)
    for folder in (ada, carl, dora):
        made.hand_in(folder, hand_ins)
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
    why = "002-validation does not count until a person has looked at it: its arm does not move as the arm of"
    assert lost(graded, "dora") == {}  # not a silent mark
    waiting = [
        mark
        for mark in result(graded, "dora")["marks"]
        if (mark["question"], mark["part"])
        in (("2.9", "sweep"), ("2.15", "validation"), ("3.13", "response"), ("3.14", "t_s"), ("3.15", "response"))
    ]
    assert [(mark["status"], mark["points"]) for mark in waiting] == [("for a person", 0.0)] * 5
    assert all("a person will look at it" in mark["reason"] for mark in waiting)
    assert "virtual" not in " ".join(mark["reason"] for mark in waiting)
    assert any(problem.startswith(why) for problem in result(graded, "dora")["problems"])
    assert why in page(graded, "dora")
    assert why[:40] in " ".join(graded[1].stdout.split())
