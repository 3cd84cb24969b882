"""What is given to a class holds in marking, whatever a student says of it."""

from __future__ import annotations

import pytest
from made_courses import OURS

import rotflex.lab
from rotflex.courseware.benches import BenchPolicy
from rotflex.instructor import model
from rotflex.instructor.marking import marking_processes as marker
from rotflex.instructor.marking.marking import About
from rotflex.instructor.verdicts import Status

OWN = BenchPolicy(draw=OURS.draw)
MATRICES = [("2.14", name) for name in "ABCD"]


@pytest.fixture
def answers(tmp_path):
    """What a run leaves that says the stiffness is another, with the model that follows from it."""

    def of(K_s):
        lab = rotflex.lab.start("ada", folder=tmp_path)
        lab.answer("2.12", J_l=lab.joint.J_l, K_s=K_s)
        made = model.state_space(lab.servo, lab.joint, K_s, input="torque", link_damping=0.0)
        lab.answer("2.14", **{name: getattr(made, name) for name in "ABCD"})
        return (tmp_path / "answers.json").read_bytes(), lab.book.probe_seed

    return of


def marks(answers, about):
    data, seed = answers
    marker._courses[:] = [OURS]
    done = marker._mark(marker.Asked("ada", data, seed, about=about, policy=OWN))
    return {(one.question, one.part): one.status for one in done.marks}


def test_what_a_student_claims_in_place_of_what_is_given_counts_for_nothing(answers):
    claimed = answers(2.6)
    assert marks(claimed, About())["2.14", "A"] == Status.FOLLOW_THROUGH  # who was asked for it: it follows
    given = marks(claimed, About(asked=MATRICES, start="stiffness"))
    assert set(given) == set(MATRICES) and given["2.14", "A"] == Status.WRONG


def test_what_follows_from_what_is_given_is_right(answers):
    values = OURS.given("stiffness", "ada", OWN)
    found = marks(answers(values["2.12", "K_s"]), About(asked=MATRICES, start="stiffness"))
    assert set(found.values()) == {Status.RIGHT}
