"""What holds of every account: whatever was earned, dropped, weighted, late."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_courses import OURS

from labcourse.answers import forms
from labcourse.grading.accounts import final_grade, half_up, in_full
from labcourse.grading.assignments import Handed, exact, timing
from labcourse.grading.gradebook import Arrival, Graded, MarkRecord, RunRecord, StudentRecord
from labcourse.grading.settings import CourseSettings, Deadline, Extension, LateSettings, MarkSettings

DUE = datetime(2026, 11, 20, 18, tzinfo=UTC)
ADA = StudentRecord("ada", section="A", aliases=("user7",))
PARTS = [
    (number, part.name, part.points)
    for number in ("2.1", "2.11", "2.13", "2.14", "3.4", "Modeling report")
    for part in OURS.catalogue.find(number).parts
]
NAMES = [f"{number} {part}" for number, part, _out_of in PARTS]

hundredths = st.integers(0, 100).map(lambda share: share / 100)
earned = st.lists(hundredths, min_size=len(PARTS), max_size=len(PARTS))
weights = st.dictionaries(
    st.sampled_from([*NAMES, *(number for number, *_ in PARTS)]), st.integers(1, 400).map(lambda one: one / 100)
)
dropped = st.lists(st.sampled_from(NAMES), unique=True, max_size=8).map(tuple)
lates = st.builds(
    LateSettings, st.integers(0, 1000).map(lambda one: one / 10), st.integers(0, 100), st.sampled_from([0, 0.5, 12, 48])
)
hours = st.integers(-500, 2000)


def marks(shares, undecided=()):
    return [
        MarkRecord(number, part, "for a person" if name in undecided else "partly right", share * out_of, out_of, "")
        for (number, part, out_of), name, share in zip(PARTS, NAMES, shares, strict=True)
    ]


def account(given_marks, after=None, about=ADA, run=None, clock=None, **settings):
    """What they come to, with all notebooks handed in so many hours after they were due."""
    course = replace(OURS, settings=CourseSettings(**settings))
    notebooks = {question.notebook for question in OURS.catalogue.everything.values()}
    received = (
        {} if after is None else {f"{one}.ipynb": Arrival(DUE + timedelta(hours=after), clock) for one in notebooks}
    )
    graded = None if run is None else Graded(run, tuple(given_marks), "")
    return final_grade(course, Handed(about, given_marks, received, graded), DUE + timedelta(days=400))


@given(st.integers(0, 10**7), st.integers(0, 4))
def test_numbers_are_as_they_are_written_and_half_goes_up(number, decimals):
    text = f"{number / 1e5:.5f}"
    assert exact(float(text)) == Fraction(number, 10**5)
    assert in_full(exact(float(text))) == (text.rstrip("0").rstrip(".") or "0")
    rounded = half_up(Fraction(number, 10**5), decimals)
    off = rounded - Fraction(number, 10**5)
    assert (rounded * 10**decimals).denominator == 1
    assert Fraction(-1, 2) < off * 10**decimals <= Fraction(1, 2)


@given(earned, earned, dropped, weights, st.none() | st.integers(1, 1000), lates, hours)
def test_what_is_dropped_never_matters(shares, others, drop, weight, out_of, late, after):
    """Another mark for it, one that waits, or none at all: the same comes out."""
    decided = MarkSettings(drop, weight, out_of)
    more = {"deadlines": (Deadline(DUE),), "late": late, "marks": decided}
    mixed = [b if name in drop else a for name, a, b in zip(NAMES, shares, others, strict=True)]
    without = [one for one, name in zip(marks(shares), NAMES, strict=True) if name not in drop]
    results = [account(one, after, **more) for one in (marks(shares), marks(mixed), marks(shares, drop), without)]
    assert len({(one.earned, one.out_of, one.final) for one in results}) == 1


@pytest.mark.parametrize(
    ("extension", "has"),
    [
        (Extension(DUE, ("ADA ",)), True),
        (Extension(DUE, ("User7",)), True),
        (Extension(DUE, ("bob",)), False),
        (Extension(DUE, (), "a"), True),
        (Extension(DUE, (), "B"), False),
        (Extension(DUE, ("bob",), "A"), True),
        (Extension(DUE, ("ada",), "", ("y",)), False),
        (Extension(DUE, ("ada",), "", ("y", "x")), True),
    ],
)
def test_whose_an_extension_is(extension, has):
    more = replace(extension, until=DUE + timedelta(days=1))
    found = timing(CourseSettings(deadlines=(Deadline(DUE),), extensions=(more,)), ADA, "x", None)
    assert (found.until > DUE) == has


@pytest.mark.parametrize("data", [None, b"", b"{", b'{"predictions": 3}'])
def test_of_what_cannot_be_read_no_prediction_was_made(data):
    run = RunRecord("k", "ada", "s", "m", "rotflex", 1, "", data)
    assert account(marks([0.5] * len(PARTS)), run=run, marks=MarkSettings(predictions=1)).predictions == 0


def test_an_unknown_time_is_in_time_and_nothing_that_counts_gives_no_grade():
    late, all_of_it = {"deadlines": (Deadline(DUE),), "late": LateSettings(per_day=50)}, marks([1.0] * len(PARTS))
    found = account(all_of_it, None, **late)
    assert found.final == found.final_out_of and found.timings[0].received is None
    assert account(marks([0.0] * len(PARTS)), None, **late).timings == []  # whoever handed in nothing need not be told
    everything = tuple(dict.fromkeys(number for number, *_ in PARTS))
    assert account(all_of_it, marks=MarkSettings(drop=everything, out_of=100)).final is None
    assert account(all_of_it).is_plain and not found.is_plain and account(all_of_it).how() == []
    assert in_full(Fraction(200, 3)) == "66.666666…"  # as the decimals do not end


def test_of_deadlines_the_latest_that_is_for_student_and_notebook_counts():
    days = [DUE + timedelta(days=number) for number in range(4)]
    deadlines = (
        Deadline(days[1], ("x",)),
        Deadline(days[0]),
        Deadline(days[2], ("y",)),
        Deadline(days[3], ("x",), section="B"),
    )
    settings = CourseSettings(deadlines=deadlines)
    assert [timing(settings, ADA, name, None).due for name in "xyz"] == [days[1], days[2], days[0]]
    assert timing(settings, StudentRecord("bob", section="B"), "x", None).due == days[3]
    assert timing(CourseSettings(deadlines=deadlines[2:]), ADA, "x", None) is None


@pytest.mark.parametrize(("per_day", "waits"), [(10, True), (0, False)])
@pytest.mark.parametrize("after", [-1, 1])
def test_a_time_that_only_the_students_computer_wrote_is_no_time_of_receipt(per_day, waits, after):
    given, late = marks([1.0] * len(PARTS)), LateSettings(per_day=per_day)
    found = account(given, after, clock="", deadlines=(Deadline(DUE),), late=late)
    assert (found.final is None) == waits == bool(found.undecided)
    assert found.timings and all(one.received is None for one in found.timings)


def run_with(predicted):
    """A run whose answers hold predictions: question → name → value, as a student's own notebook keeps them."""
    kept = {
        number: {
            "said": {
                one.part.name: forms.encode(one.part, said[one.part.name], 0).content
                for one in OURS.catalogue.predictions[number]
            }
        }
        for number, said in predicted.items()
    }
    content = {"format": 2, "student": "ada", "bench": {"uri": "virtual"}, "software": "rotflex", "probe_seed": 1}
    data = json.dumps({**content, "answers": {}, "predictions": kept}).encode()
    return RunRecord("k", "ada", "s", "m", "rotflex", 1, "", data)


(TURNS,) = OURS.catalogue.predictions["2.15"]
BOTH = {"2.9": {"time_of_largest_swing": 3.0}, "2.15": {TURNS.part.name: TURNS.part.choices[0]}}


@pytest.mark.parametrize(
    ("predicted", "drop", "number"),
    [({}, (), 0), ({"2.9": {"time_of_largest_swing": 3.0}}, (), 1), (BOTH, (), 2), (BOTH, ("2.15",), 1)],
)
def test_predictions_that_were_made_earn_what_is_set_for_each(predicted, drop, number):
    given_marks = marks([0.5] * len(PARTS))
    before = account(given_marks, run=run_with(predicted))
    after = account(given_marks, run=run_with(predicted), marks=MarkSettings(drop, predictions=0.3))
    assert after.earned - before.earned == number * Fraction(3, 10) and after.out_of == before.out_of
    more = in_full(number * Fraction(3, 10))
    assert f"{number} predictions made, 0.3 points each: {more} points more." in after.steps()
