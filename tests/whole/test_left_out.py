"""Classes that begin in the middle, by the guide alone: from its settings through release and hand-in to marks."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT
from made_courses import OURS, copied

from labcourse.benches import BenchPolicy
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.graded_run import submission_of
from labcourse.grading.marks import Status
from labcourse.grading.release import student_course, student_notebooks
from labcourse.grading.reports.grades import Reports
from labcourse.sentences import sentences

NOTEBOOKS = [path.name for path in OURS.notebooks]
GUIDE = (ROOT / "docs" / "guide" / "middle.md").read_text(encoding="utf-8")
SETTINGS = re.findall(r"^```toml\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL)
#: Points that can be earned → settings of the guide, the notebooks that are left, what is given in numbers, and some of
#: what is not asked.
CLASSES = {
    93.5: (SETTINGS[0], NOTEBOOKS[3:], [], [("2.12", "K_s"), ("2.7", "A"), ("Table 2", "omega_n")]),
    40.25: (
        SETTINGS[1],
        NOTEBOOKS[7:],
        ["2.12", "2.14", "3.8"],
        [("3.8", "K"), ("2.14", "A"), ("Table 3", "W"), ("3.4", "strategy")],
    ),
}


def handed_in(folder: Path, released: Path, student: str) -> None:
    """A release with the solutions in its answer cells; what it recorded at home is not among it."""
    sources = {
        cell.id: cell.source
        for path in OURS.notebooks
        for cell in student_notebooks.read(path).cells
        if student_notebooks.is_answer(cell)
    }
    folder.mkdir(parents=True)
    for path in sorted((released / "notebooks").glob("*.ipynb")):
        notebook = json.loads(path.read_text(encoding="utf-8"))
        for cell in notebook["cells"]:
            cell["source"] = sources.get(cell["id"], cell["source"])
        (folder / path.name).write_text(json.dumps(notebook), encoding="utf-8")
    about = json.loads((released / "notebooks" / "course.json").read_text(encoding="utf-8"))
    (folder / "course.json").write_text(json.dumps({**about, "student": student}), encoding="utf-8")


@pytest.mark.parametrize("points", [pytest.param(93.5, marks=pytest.mark.scheduled), 40.25])
def test_who_begins_in_the_middle_has_all_points_of_what_is_asked(sandbox, tmp_path, points):
    settings, notebooks, in_numbers, not_asked = CLASSES[points]
    source = copied(tmp_path / "course", NOTEBOOKS)
    (source / "course.toml").write_text(settings, encoding="utf-8")
    course = courses.load(source)
    made = student_course.release(course, tmp_path / "out")
    assert list(made.notebooks) == [NOTEBOOKS[0], *notebooks]
    about = json.loads((made.folder / "notebooks" / "course.json").read_text(encoding="utf-8"))
    assert list(about.get("given", {})) == in_numbers
    for path in (made.folder / "rotflex").rglob("*.py"):  # what leaves besides is as always
        assert path.read_bytes() == (ROOT / path.relative_to(made.folder)).read_bytes()
    handed_in(tmp_path / "in" / "ada", made.folder, "ada")
    with Gradebook(tmp_path / "book.sqlite") as book:
        (step,) = Batch(tmp_path / "in", course, book, Settings()).grade()
        Reports(tmp_path / "marks", course, book).write_all()
    marks = {(one.question, one.part): one for one in step.graded.marks}
    assert not set(not_asked) & set(marks)
    wanted = {(number, part.name) for number, one in course.asked_catalogue.marked.items() for part in one.parts}
    assert set(marks) == wanted & {(number, part) for number, parts in OURS.key.items() for part in parts}
    lost = [
        (*where, one.reason) for where, one in marks.items() if one.status not in (Status.RIGHT, Status.FOR_A_PERSON)
    ]
    assert lost == []
    assert not [line for line in sentences(step.graded.run.problems) if "Table" in line or "is missing" in line]
    facts = submission_of(step.graded.run)
    assert set(facts.asked) >= set(marks) - {one for one in marks if "as a whole" in one[0]}
    page = (tmp_path / "marks" / "ada" / "feedback.html").read_text(encoding="utf-8")
    assert "Given to this class" in page and "2.12 K_s" in page
    total = json.loads((tmp_path / "marks" / "ada" / "marks.json").read_text(encoding="utf-8"))["out_of"]
    assert total == pytest.approx(sum(one.out_of for one in marks.values())) == points


def test_the_model_that_is_given_is_that_of_the_bench_and_the_gain_places_its_poles():
    policy = BenchPolicy("same", seed=7, draw=OURS.draw)
    values = OURS.given_values("", policy, ())
    assert values["2.12", "K_s"] == pytest.approx(OURS.true_bench("", policy).K_s, rel=1e-3)
    servo = OURS.true_bench("", policy).servo
    b, a = servo.torque_per_volt, servo.back_emf_damping
    A = values["2.14", "A"] - values["2.14", "B"] @ np.array([[0, 0, a, 0]])
    poles = np.linalg.eigvals(A - b * values["2.14", "B"] @ values["3.8", "K"])
    assert np.sort_complex(poles) == pytest.approx(np.array([-40, -30, -12 - 16j, -12 + 16j]), rel=1e-6)


@pytest.mark.parametrize(
    ("policy", "asked"),
    [
        (BenchPolicy(draw=OURS.draw), {("2.12", "J_l"), ("2.12", "K_s")}),
        (BenchPolicy("real", benches=("north", "south"), draw=OURS.draw), ()),
    ],
)
def test_a_model_and_a_gain_are_given_for_one_bench(policy, asked):
    with pytest.raises(GradingError, match="bench"):
        OURS.given_values("", policy, asked)
