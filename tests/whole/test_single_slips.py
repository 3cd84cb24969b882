"""What a single slip costs: its own points, and what a person would take off, too; and whether a reason says so."""

import re
from dataclasses import replace

import pytest
import sympy
from single_slip_marks import alone, answers_with, lost_by, secrets
from single_slips import OF_EACH_KIND, SLIPS
from working_through import FULL, theta_ddot

pytestmark = pytest.mark.usefixtures("runs_made_once")

MOST = 4  #: automatic points that a slip may cost
#: Slips that cost more, and why it cannot be otherwise.
BEYOND = {
    "2.13 state_space: A transposed": "of a model that cannot be controlled there is no gain and no closed loop",
}


def test_without_a_slip_nothing_is_lost():
    assert lost_by(answers_with(None)) == {}


@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: slip.name)
def test_a_slip_beside_right_answers_costs_its_own_points_and_is_told_without_the_answer(slip):
    share, reason = alone(slip)
    assert share == pytest.approx(slip.costs, abs=0.01)
    assert re.search(slip.told, reason), reason
    assert not [secret for secret in secrets() if secret in reason]


NAMED = [slip for slip in SLIPS if slip.where[0] in ("2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.8")]


@pytest.mark.parametrize("slip", NAMED, ids=lambda slip: slip.name)
def test_another_mistake_on_paper_is_not_called_by_that_name(slip):
    def other(right, own):
        given = slip.change(right, own)
        return sympy.Eq(given.lhs + 7 * theta_ddot, given.rhs) if isinstance(given, sympy.Eq) else 3 * given

    share, reason = alone(replace(slip, change=other))
    assert share == 1 and not re.search(slip.told, reason)


@pytest.mark.parametrize(
    "slip",
    [pytest.param(slip, id=slip.name, marks=() if slip in OF_EACH_KIND else pytest.mark.scheduled) for slip in SLIPS],
)
def test_a_slip_costs_its_own_points_and_what_a_person_would_take_off(slip):
    lost = lost_by(answers_with(slip))
    expected = {
        slip.where: slip.costs * FULL[slip.where],
        **{at: points for at, (points, _why) in slip.besides.items()},
    }
    assert {at: round(points, 2) for at, (points, _told) in lost.items()} == expected, lost
    assert (sum(expected.values()) <= MOST) == (slip.name not in BEYOND)
    assert re.search(slip.told, lost[slip.where][1]), lost[slip.where][1]
