"""What counts of several hand-ins: the newest of each name."""

from datetime import UTC, datetime

from hypothesis import given
from hypothesis import strategies as st
from packings import WANTED

from labcourse.grading.gradebook.records import Delivery
from labcourse.grading.intake import choose_newest
from labcourse.grading.submission import Submission
from labcourse.problems import Code

names = st.sampled_from([*WANTED, "answers.json", "course.json", "h.py", "data/x.csv"])
items = st.builds(
    Delivery,
    name=names,
    digest=st.just(""),
    content=st.integers(0, 99).map(lambda number: b'{"cells": [], "n": %d}' % number),
    received=st.integers(1, 5).map(lambda day: datetime(2026, 11, day, tzinfo=UTC)),
    source=st.sampled_from(["a.zip", "b.zip"]),
)


@given(st.lists(items, max_size=12))
def test_the_newest_of_each_name_counts_and_of_one_time_the_last(given_items):
    hand_in = Submission(student="ada")
    notes = choose_newest(hand_in, given_items, WANTED)
    best = {}
    for place, item in enumerate(given_items):
        best[item.name] = max(best.get(item.name, (item.received, place)), (item.received, place))
    assert set(hand_in.notebooks) == set(best) & set(WANTED)
    assert set(hand_in.files) == set(best) & {"h.py", "data/x.csv"}
    for name, content in hand_in.files.items():
        assert content == given_items[best[name][1]].content
    assert (hand_in.answers_at_home is None) == ("answers.json" not in best)
    if hand_in.answers_at_home is not None:
        assert hand_in.answers_at_home == given_items[best["answers.json"][1]].content
    missing = [note for note in notes if note.code is Code.NOT_HANDED_IN]
    assert len(missing) == (len(set(WANTED) - set(best)) if hand_in.notebooks else 0)


def test_nothing_makes_an_empty_hand_in():
    submission = Submission(student="ada")
    assert choose_newest(submission, [], WANTED) == []
    assert submission == Submission(student="ada")
