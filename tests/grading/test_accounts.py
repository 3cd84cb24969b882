"""What holds of every account: whatever was earned, dropped, weighted, late."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_courses import OURS

from labcourse.grading.accounts import account_of, half_up, in_full, points, to_hundredths
from labcourse.grading.assignments import Handed, State, exact, lateness
from labcourse.grading.gradebook import Arrival, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.settings import Assignment, CourseSettings, Deadline, Extension, LateSettings, MarkSettings

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
        Mark(number, part, "for a person" if name in undecided else "partly right", share * out_of, out_of, "")
        for (number, part, out_of), name, share in zip(PARTS, NAMES, shares, strict=True)
    ]


def account(given_marks, after=None, clock=None, **settings):
    """What they come to, with all notebooks handed in so many hours after they were due."""
    course = replace(OURS, settings=CourseSettings(**settings))
    notebooks = {question.notebook for question in OURS.catalogue.everything.values()}
    received = (
        {} if after is None else {f"{one}.ipynb": Arrival(DUE + timedelta(hours=after), clock) for one in notebooks}
    )
    return account_of(course, Handed(ADA, given_marks, received), DUE + timedelta(days=400))


@given(st.integers(0, 10**7), st.integers(0, 4))
def test_numbers_are_as_they_are_written_and_half_goes_up(number, decimals):
    text = f"{number / 1e5:.5f}"
    assert exact(float(text)) == Fraction(number, 10**5)
    assert in_full(exact(float(text))) == (text.rstrip("0").rstrip(".") or "0")
    rounded = half_up(Fraction(number, 10**5), decimals)
    off = rounded - Fraction(number, 10**5)
    assert (rounded * 10**decimals).denominator == 1
    assert Fraction(-1, 2) < off * 10**decimals <= Fraction(1, 2)


@given(earned, earned, dropped, weights, lates, hours)
def test_what_is_dropped_never_matters(shares, others, drop, weight, late, after):
    """Another mark for it, one that waits, or none at all: the same comes out."""
    decided = MarkSettings(drop, weight)
    more = {"deadlines": (Deadline(DUE),), "late": late, "marks": decided}
    mixed = [b if name in drop else a for name, a, b in zip(NAMES, shares, others, strict=True)]
    without = [one for one, name in zip(marks(shares), NAMES, strict=True) if name not in drop]
    results = [account(one, after, **more) for one in (marks(shares), marks(mixed), marks(shares, drop), without)]
    assert len({(one.earned, one.out_of, one.so_far_text) for one in results}) == 1


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
    ],
)
def test_whose_an_extension_is(extension, has):
    more = replace(extension, until=DUE + timedelta(days=1))
    found = lateness(CourseSettings(deadlines=(Deadline(DUE),), extensions=(more,)), ADA, "x", None)
    assert (found.until > DUE) == has


def test_an_unknown_time_is_in_time_and_nothing_that_counts_is_out_of_nothing():
    late, all_of_it = {"deadlines": (Deadline(DUE),), "late": LateSettings(per_day=50)}, marks([1.0] * len(PARTS))
    found = account(all_of_it, None, **late)
    assert found.earned == found.out_of and found.timings[0].received is None
    assert account(marks([0.0] * len(PARTS)), None, **late).timings == []  # whoever handed in nothing need not be told
    everything = tuple(dict.fromkeys(number for number, *_ in PARTS))
    assert account(all_of_it, marks=MarkSettings(drop=everything)).out_of == 0
    assert account(all_of_it).explanations() == [] and "counts as in time" in found.explanations()[0]
    assert in_full(Fraction(200, 3)) == "66.67"  # as the decimals do not end


@pytest.mark.parametrize(
    ("number", "shown"), [(15.454545454545455, "15.45"), (0.125, "0.13"), (2.0, "2"), (12345.67, "12345.67")]
)
def test_points_are_shown_as_they_are_exported(number, shown):
    assert points(number) == shown
    assert float(to_hundredths(exact(number))) == float(shown)


def test_of_deadlines_the_latest_that_is_for_student_and_notebook_counts():
    days = [DUE + timedelta(days=number) for number in range(4)]
    deadlines = (
        Deadline(days[1], ("x",)),
        Deadline(days[0]),
        Deadline(days[2], ("y",)),
        Deadline(days[3], ("x",), section="B"),
    )
    settings = CourseSettings(deadlines=deadlines)
    assert [lateness(settings, ADA, name, None).due for name in "xyz"] == [days[1], days[2], days[0]]
    assert lateness(settings, StudentRecord("bob", section="B"), "x", None).due == days[3]
    assert lateness(CourseSettings(deadlines=deadlines[2:]), ADA, "x", None) is None


def test_notebooks_in_no_assignment_come_last_in_order():
    found = account(marks([1.0] * len(PARTS)), marks=MarkSettings(drop=tuple(OURS.catalogue.marked))).assignments
    last = [name for one in found if not one.title for name in one.assignment.notebooks]
    assert last == sorted(last) and len(last) > 1 and not found[-1].title


@pytest.mark.parametrize(("per_day", "waits"), [(10, True), (0, False)])
@pytest.mark.parametrize("after", [-1, 1])
def test_a_time_that_only_the_students_computer_wrote_is_no_time_of_receipt(per_day, waits, after):
    given, late = marks([1.0] * len(PARTS)), LateSettings(per_day=per_day)
    found = account(given, after, clock="", deadlines=(Deadline(DUE),), late=late)
    assert waits == bool(found.undecided)
    assert found.timings and all(one.received is None for one in found.timings)


def test_a_notebook_that_is_worth_nothing_makes_no_assignment_missing():
    both = Assignment("Lab 02", ("00_start", "02_finding_stiffness"))
    settings = CourseSettings(assignments=(both,), deadlines=(Deadline(due=DUE),))
    course, received = replace(OURS, settings=settings), {"02_finding_stiffness.ipynb": Arrival(DUE)}
    own = [mark for mark in marks([1.0] * len(PARTS)) if course.notebook_of(mark.question) == "02_finding_stiffness"]
    for marked, state in ((own, State.MARKED), ([], State.MISSING)):
        lab, *_rest = account_of(
            course, Handed(ADA, marked, received if marked else {}), DUE + timedelta(days=9)
        ).assignments
        assert (lab.title, lab.state) == ("Lab 02", state)
