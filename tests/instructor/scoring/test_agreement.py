"""Agreement of two scorers: held against contingency tables written otherwise, and against published examples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.instructor.scoring.agreement import agreement, sampled

levels = st.integers(0, 4)


def from_table(pairs, quadratic):
    """By the table of shares: observed against the outer product of its margins (Cohen 1968)."""
    table = np.zeros((5, 5))
    for one, other in pairs:
        table[one, other] += 1 / len(pairs)
    rows, columns = np.indices((5, 5))
    weights = 1 - (rows - columns) ** 2 / 16 if quadratic else np.eye(5)
    observed = (weights * table).sum()
    expected = (weights * np.outer(table.sum(axis=1), table.sum(axis=0))).sum()
    return (observed - expected) / (1 - expected)


@given(st.lists(st.tuples(levels, levels), min_size=1, max_size=80))
def test_kappa_is_that_of_the_contingency_table(pairs):
    found = agreement(pairs)
    if len({level for pair in pairs for level in pair}) == 1:
        assert (found.kappa, found.weighted) == (None, None)
        assert "not defined" in str(found)
        return
    assert found.kappa == pytest.approx(from_table(pairs, False), abs=1e-9)
    assert found.weighted == pytest.approx(from_table(pairs, True), abs=1e-9)


@given(st.lists(st.tuples(levels, levels), min_size=2, max_size=40))
def test_who_was_first_does_not_matter(pairs):
    turned = agreement([(other, one) for one, other in pairs])
    found = agreement(pairs)
    assert (turned.kappa, turned.weighted) == (pytest.approx(found.kappa), pytest.approx(found.weighted))


def counted(table):
    return [(i, j) for i, row in enumerate(table) for j, count in enumerate(row) for _ in range(count)]


@pytest.mark.parametrize(
    ("table", "kappa"),
    [
        # Fifty proposals read by two readers, yes or no: the example of the encyclopaedias.
        ([[20, 5], [10, 15]], 0.40),
        # Cohen (1960), table 1: two judge 200 cases in three classes; as shares .25 .13 .12, .12 .02 .16, .03 .15 .02
        ([[50, 26, 24], [24, 4, 32], [6, 30, 4]], -0.09),
        # The same share of agreement, other margins.
        ([[45, 15], [25, 15]], 0.1304),
        ([[25, 35], [5, 35]], 0.2593),
    ],
)
def test_published_examples(table, kappa):
    digits = 4 if len(str(abs(kappa))) > 4 else 2
    assert round(agreement(counted(table)).kappa, digits) == kappa


def test_it_is_told_in_words():
    assert str(agreement([])) == "Nothing has been scored a second time yet."
    assert str(agreement([(4, 4), (3, 3), (4, 3), (0, 0)])).startswith("3 of 4 the same; kappa 0.6")
    assert "not defined" in str(agreement([(3, 3)] * 9))
    assert agreement([(3, 2)] * 9).kappa == 0  # each gave one level only, and never the same


def test_a_sample_is_about_the_share_and_depends_on_nothing_but_whose_and_which():
    class_ = [f"student-{n}" for n in range(4000)]
    drawn = [one for one in class_ if sampled(one, ("7", "why"), 10)]
    assert 320 < len(drawn) < 480  # four standard deviations
    assert drawn == [one for one in reversed(class_) if sampled(one, ("7", "why"), 10)][::-1]
    elsewhere = {one for one in class_ if sampled(one, ("8", "why"), 10)}
    assert len(elsewhere & set(drawn)) < 100  # by chance 40; not the same students everywhere
    assert {one for one in class_ if sampled(one, ("7", "why"), 10, "another")} != set(drawn)
    assert drawn == [one for one in class_ if sampled(one.title(), ("7", "why"), 10)]  # a roster may change capitals
    assert not any(sampled(one, ("7", "why"), 0) for one in class_)
    assert all(sampled(one, ("7", "why"), 1) for one in class_)
