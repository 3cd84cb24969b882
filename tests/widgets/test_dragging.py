"""Where poles come to lie when they are dragged: a pair, two real poles, and across the border of stability."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.widgets.dragging import OMEGA, REAL, ZETA, dragged, within
from rotflex.widgets.placement import Dominant
from rotflex.widgets.pole_plots import PLANE

PLACE = st.tuples(st.floats(*PLANE[0]), st.floats(*PLANE[1]))


@pytest.mark.parametrize("place", [(-12, 16), (-1, 20), (0, 20), (3, 20), (8, 25)])
def test_a_pair_goes_where_it_is_dragged_and_over_the_border(place):
    found = dragged(Dominant(), "pair", *place)
    assert found.pair == pytest.approx(complex(*place))
    assert found.partner == pytest.approx(complex(*place).conjugate())


def test_a_pair_that_comes_to_the_axis_splits_into_two_real_poles_and_comes_together_again():
    double = dragged(Dominant(), "pair", -20.0, 0.3)
    assert double.zeta == 1 and double.poles == pytest.approx([-20, -20, -30, -40])
    split = dragged(double, "pair", -10.0, -0.3)
    assert (split.pair, split.partner) == pytest.approx((-10, -20)) and split.zeta > 1
    wider = dragged(split, "partner", -40.0, 0.0)
    assert (wider.pair, wider.partner) == pytest.approx((-10, -40))
    assert wider.zeta == pytest.approx(50 / (2 * 20)) and wider.omega_n == pytest.approx(20)
    passed = dragged(wider, "pair", -60.0, 0.0)  # one does not pass the other
    assert (passed.pair, passed.partner) == pytest.approx((-40, -40))
    again = dragged(wider, "partner", -15.0, 9.0)
    assert again.zeta < 1 and again.pair == pytest.approx(-15 + 9j)


def test_poles_of_a_damping_ratio_beyond_one_are_those_of_its_polynomial():
    found = Dominant(1.7, 12.0)
    expected = np.roots([1, 2 * 1.7 * 12, 144])
    assert sorted([found.pair.real, found.partner.real]) == pytest.approx(sorted(expected))
    assert found.pair.real > found.partner.real


@given(PLACE, PLACE, st.sampled_from(["pair", "partner", "p3", "p4"]), st.sampled_from(["pair", "partner", "p3", "p4"]))
def test_wherever_poles_are_dragged_they_are_on_the_plane_and_in_range(first, second, one, other):
    found = dragged(dragged(Dominant(), one, *first), other, *second)
    assert ZETA[0] <= found.zeta <= ZETA[1] and OMEGA[0] <= found.omega_n <= OMEGA[1]
    assert all(REAL[0] - 1e-6 <= pole.real for pole in found.poles)
    assert np.abs(np.imag(np.poly(found.poles))).max() < 1e-6


def test_the_slower_of_two_real_poles_stays_on_the_left():
    found = dragged(Dominant(1.5, 20.0), "pair", -0.6, 0.0)
    assert found.pair.real < 0


def test_numbers_are_kept_within_their_range():
    assert within(Dominant(9.0, 90.0, 90.0, -900.0)) == Dominant(1.25, 40.0, REAL[1], REAL[0])
    assert within(Dominant(-9.0, 1.0)).zeta == ZETA[0]
