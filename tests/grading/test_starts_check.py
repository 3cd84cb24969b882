"""What check-course finds where a class may begin in the middle."""

from dataclasses import replace

import pytest
from made_courses import OURS

from labcourse.answers.catalogue import Catalogue
from labcourse.grading import course_check

STIFFNESS, GAIN = OURS.catalogue.starts


def found(*those, **course):
    given = OURS.catalogue
    asked = {"warm_up": given.warm_up.values(), "tables": given.tables.values()}
    catalogue = Catalogue(given.questions.values(), **asked, starts=those)
    return [str(one) for one in course_check.check_starts(replace(OURS, catalogue=catalogue, **course))]


def test_this_course_has_nothing_wrong():
    assert list(course_check.check_starts(OURS)) == []


@pytest.mark.parametrize(
    ("start", "what"),
    [
        (replace(STIFFNESS, skips=("01_nonsense",)), "notebook 01_nonsense"),
        (replace(STIFFNESS, gives=(("2.12", "K"),)), "part 'K'"),
        (replace(STIFFNESS, gives=(("2.14", "A"),)), "2.14, A"),
    ],
)
def test_a_start_that_names_what_there_is_not_is_told(start, what):
    assert any(what in one for one in found(start))


def test_values_that_there_are_not_or_that_fit_nothing_are_told():
    (said,) = found(STIFFNESS, given=None)
    assert said.startswith("start stiffness") and "Course.given" in said
    (said,) = found(STIFFNESS, given=lambda name, student, policy: {("2.12", "J_l"): 0.003})
    assert "2.12, K_s" in said
    (said,) = found(STIFFNESS, given=lambda *_: {("2.12", "J_l"): 0.003, ("2.12", "K_s"): "much"})
    assert "2.12, K_s" in said


def test_a_cell_that_needs_what_is_skipped_is_told(tmp_path):
    (folder := tmp_path / "solutions").mkdir()
    notebook = OURS.notebooks[8].read_text(encoding="utf-8")
    assert 'lab.value(\\"3.8\\", \\"K\\", default=None)' in notebook
    (folder / OURS.notebooks[8].name).write_text(notebook.replace('\\"K\\", default=None', '\\"K\\"'), encoding="utf-8")
    for start, needed in ((GAIN, ["3.10"]), (replace(GAIN, gives=GAIN.gives[:-1]), ["3.8", "3.10"])):
        told = found(start, folder=folder)
        assert [f" {one}, K" in line for one, line in zip(needed, told, strict=True)] == [True] * len(needed)
        assert all(line.startswith("08_full_state_feedback.ipynb, cell 'carried") for line in told)
