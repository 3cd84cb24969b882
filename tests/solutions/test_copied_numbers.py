"""How often a copied number is right, on benches drawn at random: what fits one bench seldom fits another."""

import itertools

import numpy as np
import pytest

from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.questions import CATALOGUE
from rotflex.units import HZ
from solutions.key import KEY
from solutions.true_bench import TrueBench

pytestmark = pytest.mark.scheduled  # test_readings.py says where each tolerance ends
OMEGA_N, J_L, K_S = ("2.11", "omega_n"), ("2.12", "J_l"), ("2.12", "K_s")
SIZE = 24  #: benches; each one's numbers are tried on all others: 552 times


@pytest.fixture(scope="module")
def benches():
    return [TrueBench(f"student-{number}") for number in range(SIZE)]


@pytest.fixture(scope="module")
def answers(benches):
    """What each student reads off their own plot, and what follows."""

    def read(bench):
        x = bench.sweep().degrees("alpha")
        amplitude = np.abs(np.fft.rfft(x, 8192))
        omega = HZ * (17 + int(np.argmax(amplitude[17:82]))) / (8192 * 0.002)
        return {OMEGA_N: omega, J_L: bench.J_l, K_S: bench.J_l * omega**2}

    return [read(bench) for bench in benches]


def earned(bench, given):
    case = Case(bench, lambda question, part: given[question, part], 7, True)
    return {
        where
        for where, value in given.items()
        if KEY[where[0]][where[1]].verdict(CATALOGUE.find(where[0]).part(where[1]), value, case).status
        in (Status.RIGHT, Status.FOLLOW_THROUGH)
    }


def copied(benches, answers, parts, own=()):
    """What earns points of a class-mate's answers to some parts, with own answers to others: for each pair."""
    return [
        earned(benches[one], {**{where: answers[one][where] for where in own}, **{w: answers[other][w] for w in parts}})
        for one, other in itertools.permutations(range(SIZE), 2)
    ]


def share(found, *parts):
    return sum(set(parts) <= one for one in found) / len(found)


def test_what_everybody_answers_on_their_own_bench_is_right(benches, answers):
    assert all(earned(bench, given) == {OMEGA_N, J_L, K_S} for bench, given in zip(benches, answers, strict=True))


@pytest.mark.parametrize(("part", "most"), [(OMEGA_N, 0.22), (J_L, 0.10), (K_S, 0.13)])
def test_a_friends_number_alone_is_seldom_right(benches, answers, part, most):
    """On 300 benches 19.1, 6.0 and 8.6 %."""
    assert share(copied(benches, answers, [part]), part) <= most


def test_a_friends_numbers_are_seldom_right_together(benches, answers):
    """On 300 benches 5.8 % for omega_n and K_s, 1.1 % for all three; 5.0 % beside the own inertia."""
    found = copied(benches, answers, [OMEGA_N, J_L, K_S])
    assert share(found, OMEGA_N, K_S) <= 0.09
    assert share(found, OMEGA_N, J_L, K_S) <= 0.03
    assert share(copied(benches, answers, [OMEGA_N, K_S], own=[J_L]), OMEGA_N, K_S) <= 0.08
