"""How long the rest takes: by the median of one's own times; several at one key count as one, many at once do not."""

from datetime import UTC, datetime, timedelta

import pytest

from labcourse.grading.gradebook import Act
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring.progress import tally, time_left, time_text

WHERE = ("7", "why")
BEGIN = datetime(2026, 3, 1, 9, tzinfo=UTC)


def acts(*seconds, actor="Ann", where=WHERE, level=3, undoes=None):
    return [
        Act(n, f"s{n}", *where, actor, level, 0.75, 1.0, "", "…", False, undoes, BEGIN + timedelta(seconds=at))
        for n, at in enumerate(seconds)
    ]


@pytest.mark.parametrize(
    ("seconds", "left", "expected"),
    [
        ((), 10, None),
        ((0,), 10, None),
        ((0, 20, 40, 60, 80), 10, None),  # four times are too few
        ((0, 20, 40, 60, 80, 140), 10, 200),  # median 20
        ((0, 20, 40, 4000, 4020, 4040, 4060), 10, 200),  # a pause is no reading
        ((0, 20, 20.1, 20.2, 40, 60, 80, 100), 10, 20 * 10 * 5 / 7),  # three at one key
        (tuple(n / 10 for n in range(100)), 10, None),  # more than one key decides
        ((*(n / 10 for n in range(9)), 20, 40, 60, 80, 100), 10, None),  # nobody knows when the one at 20 was begun
    ],
)
def test_time_left(seconds, left, expected):
    found = time_left(acts(*seconds), WHERE, left)
    assert found == (expected if expected is None else pytest.approx(expected))


def test_unlike_acts_at_once_are_no_reading():
    both = [*acts(20), *acts(20.1, level=1)]
    calm = acts(100, 120, 140, 160, 180)
    assert time_left([*acts(0), *both, *calm], WHERE, 1) is None
    assert time_left([*acts(0, 20, 20.1), *calm], WHERE, 1) == pytest.approx(20 * 6 / 7)


def test_what_was_done_to_other_parts_is_no_reading_of_this_one():
    between = acts(30, 50, where=("8", "why"))
    found = time_left([*acts(0, 10), *between, *acts(60, 70, 80, 90, 100)], WHERE, 1)
    assert found == 10  # and not 50, from 10 to 60


def test_taking_back_is_no_reading_and_what_follows_begins_with_it():
    found = time_left([*acts(0, 20), *acts(25, undoes=1), *acts(35, 45, 55, 65, 75)], WHERE, 1)
    assert found == 10


@pytest.mark.parametrize(("seconds", "text"), [(20, "less than a minute"), (200, "about 3 min"), (9000, "about 2.5 h")])
def test_a_time_in_words(seconds, text):
    assert time_text(seconds) == f"{text} left"
    page = templates("scoring/page").get_template("tally.html")
    assert f"{text} left" in page.render(tally=tally([]), seconds=seconds, left_text=time_text)
    assert "left" not in page.render(tally=tally([]), seconds=None)
