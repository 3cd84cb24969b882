"""What a check at home says of one part, from what was recorded now and before: without running anything."""

import pytest

from labcourse.run.asked import Asked
from labcourse.run.check import State, _Home, _part

WHERE = ("2.10", "spectrum")


def function(output, seed=1):
    return {"kind": "function", "value": [[output, 2.0]]}, seed


def number(value, seed=1):
    return {"kind": "number", "value": value}, seed


def became(now=None, before=None, why="", begun=True, in_words=False, written=()):
    """``now``, ``before``: what was recorded, and the seed of the inputs that functions were tried on."""
    (content, seed), (content_before, seed_before) = now or (None, 1), before or (None, 1)
    found, home = ({} if one is None else {WHERE[0]: {WHERE[1]: one}} for one in (content, content_before))
    asked = Asked("02_finding_stiffness.ipynb", WHERE, in_words, begun)
    return _part(asked, written, (found, seed), _Home(home, seed_before), why)


@pytest.mark.parametrize(
    ("now", "before", "state"),
    [
        (number(20.0), None, State.RECORDED),
        (number(20.0), number(20.0), State.RECORDED),
        (number(20.0), number(21.0), State.DIFFERENT),
        (number(20.0), number(21.0, seed=2), State.DIFFERENT),
        (function(1.0), function(1.0), State.RECORDED),
        (function(1.0), function(1.5), State.DIFFERENT),
        (function(1.0), function(1.5, seed=2), State.RECORDED),  # tried on other inputs: nothing to compare
        (None, number(20.0), State.EMPTY),
    ],
)
def test_a_part_is_other_than_on_the_page_where_it_can_be_compared_and_differs(now, before, state):
    assert became(now, before).state is state


@pytest.mark.parametrize(
    ("begun", "before", "state"),
    [(True, None, State.MISSING), (False, number(20.0), State.MISSING), (False, None, State.EMPTY)],
)
def test_why_a_part_is_missing_is_told_of_what_somebody_began(begun, before, state):
    part = became(None, before, "It stopped.", begun)
    assert (part.state, part.why) == (state, "It stopped." if state is State.MISSING else "")


@pytest.mark.parametrize(("written", "state"), [([WHERE], State.WRITTEN), ([], State.EMPTY)])
def test_words_are_there_or_not_whatever_was_recorded(written, state):
    assert became(number(1.0), number(2.0), "It stopped.", in_words=True, written=written).state is state
