"""What is kept of hand-ins that come in stages, and of those that somebody else makes in a student's name."""

from __future__ import annotations

import json
import os

import pytest
from packings import WANTED, lay, work

from rotflex.instructor import stages
from rotflex.instructor.gradebook import Gradebook
from rotflex.instructor.running import intake

FUTURE = 4e9  # what a file says of itself, somebody may have written there


@pytest.fixture
def stage(tmp_path):
    """Takes in folders: name → (answer, partners, student of the course.json); what counts for each student then."""
    taken = []

    def take(**folders):
        folder = tmp_path / f"stage-{len(taken)}"
        taken.append(folder)
        for name, (answer, partners, student) in folders.items():
            lay(folder / name, work(student, answer, **{"with": partners}))
            for path in (folder / name).iterdir():
                os.utime(path, (FUTURE, FUTURE) if name == "mallory" else None)
        with Gradebook(tmp_path / "book.sqlite") as book:
            found = intake.find(folder, earlier=stages.named_in(book)).submissions
            return {one.student: _answer(stages.kept(book, one, intake.read(one, WANTED))[1]) for one in found}

    return take


def _answer(delivered):
    """Of the first notebook, the newest."""
    newest = max((one for one in delivered if one.name == WANTED[0]), key=lambda one: one.received)
    return json.loads(newest.content)["cells"][0]["source"]


def test_a_pair_hands_in_together_and_again(stage):
    assert stage(bob=("x = 1", ["ada"], "bob")) == {"ada": "x = 1", "bob": "x = 1"}
    assert stage(bob=("x = 2", ["ada"], "bob")) == {"ada": "x = 2", "bob": "x = 2"}
    assert stage(ada=("x = 3", ["bob"], "ada"))["ada"] == "x = 3"


def test_what_somebody_handed_in_before_is_not_replaced_in_their_name(stage):
    assert stage(ada=("x = 1", [], "ada")) == {"ada": "x = 1"}
    assert stage(mallory=("spoilt = 1", ["mallory"], "ada")) == {"mallory": "spoilt = 1"}
    assert stage(mallory=("spoilt = 2", ["ada"], "mallory")) == {"mallory": "spoilt = 2"}


def test_what_somebody_hands_in_later_comes_before_what_was_said_in_their_name(stage):
    assert stage(mallory=("spoilt = 1", ["ada"], "mallory")) == {"ada": "spoilt = 1", "mallory": "spoilt = 1"}
    assert stage(ada=("x = 1", [], "ada")) == {"ada": "x = 1"}
    assert stage(mallory=("spoilt = 2", ["ada"], "mallory")) == {"mallory": "spoilt = 2"}
