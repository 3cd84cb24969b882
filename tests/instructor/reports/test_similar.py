"""Answers that fit a class-mate's bench: told as hints, few by chance, and never of those who share a bench."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gradebooks import graded, record
from made_courses import OURS

from rotflex.courseware.benches import BenchPolicy
from rotflex.instructor.gradebook import Gradebook, MarkRecord
from rotflex.instructor.graded_run import Facts
from rotflex.instructor.marking.checks import ForAPerson, Number
from rotflex.instructor.reports import similar
from rotflex.instructor.reports.grades import Reports
from rotflex.instructor.reports.similar import Hint, Student
from rotflex.instructor.verdicts import OwnBench, Status

X, Y, Z = ("1.1", "x"), ("1.2", "y"), ("1.2", "z")
PARTS = {
    X: OwnBench(lambda bench: bench.x, 0.035, tells=False),
    Y: OwnBench(lambda bench: bench.y, 0.002),
    Z: OwnBench(lambda bench: bench.z, 0.07),
}
STEP = 0.38  # of the scale that x is read off


def right(name, random):
    """Somebody with a bench of their own, and what they measured on it: x off a scale, z with its square."""
    bench = {X: 18.0 * 1.53 ** random.uniform(), Y: 3e-3 * 1.45 ** random.uniform()}
    bench[Z] = bench[Y] * bench[X] ** 2
    x = STEP * round(bench[X] / STEP)
    given = {X: x, Y: bench[Y], Z: bench[Y] * x**2}
    return Student(name, bench, given, frozenset(PARTS), frozenset())


def answering(one, wrong, **given):
    """The same student with other answers, some of them wrong."""
    changed = {**one.given, **{where: given[where[1]] for where in PARTS if where[1] in given}}
    return replace(one, given=changed, right=one.right - set(wrong), wrong=frozenset(wrong))


@pytest.fixture(scope="module")
def everybody():
    random = np.random.default_rng(5)
    return [right(f"s{number:03}", random) for number in range(300)]


def lines(*students):
    return [(hint.student, hint.mate, sorted(hint.given), hint.alone) for hint in similar.hints(students, PARTS)]


def test_a_class_that_is_right_gets_no_hint(everybody):
    assert lines(*everybody) == []


def test_by_chance_there_are_few_hints_in_a_class_of_300(everybody):
    """Every fourth student is wrong somewhere by a slip of their own; of 75, three at most look like a copy."""
    random = np.random.default_rng(6)
    slips = [
        lambda one: answering(one, {X, Z}, x=one.given[X] * random.uniform(0.7, 1.3), z=one.given[Z] * 1.3),
        lambda one: answering(one, {Y, Z}, y=one.given[Y] * random.uniform(0.8, 1.2), z=one.given[Z] * 1.2),
        lambda one: answering(one, {Z}, z=one.given[Z] / 39.478),
        lambda one: answering(one, {Y}, y=float(f"{one.given[Y] * random.uniform(0.9, 1.1):.3g}")),
    ]
    those = [slips[number % 4](one) if number % 4 == number // 4 % 4 else one for number, one in enumerate(everybody)]
    wrong = sum(bool(one.wrong) for one in those)
    told = {hint.student for hint in similar.hints(those, PARTS)}
    assert wrong == 75
    assert len(told) <= 3


def test_one_who_copies_all_three_is_told_with_each_number_that_says_something(everybody):
    friend, one, *others = everybody
    copier = answering(one, PARTS, **{where[1]: friend.given[where] for where in PARTS})
    assert lines(friend, copier, *others) == [
        (one.name, friend.name, [Y], True),
        (one.name, friend.name, [Z], True),
        (one.name, friend.name, [X, Y, Z], False),
    ]


@pytest.mark.parametrize(("digits", "size"), [(6, 300), (5, 300), (4, 30), (3, 10)])
def test_a_rounded_copy_is_told_with_as_many_digits_as_the_class_needs(everybody, digits, size):
    friend, one, *others = everybody[:size]
    copier = answering(one, {Z}, z=float(f"{friend.given[Z]:.{digits}g}"))
    assert lines(friend, copier, *others) == [(one.name, friend.name, [Z], True)]


def test_three_numbers_in_three_digits_are_told_together(everybody):
    friend, one, *others = everybody
    copier = answering(one, PARTS, **{where[1]: float(f"{friend.given[where]:.3g}") for where in PARTS})
    assert (one.name, friend.name, [X, Y, Z], False) in lines(friend, copier, *others)


def test_a_number_in_two_digits_is_nobodys(everybody):
    friend, one, *others = everybody
    copier = answering(one, {Z}, z=float(f"{friend.given[Z]:.2g}"))
    assert lines(friend, copier, *others) == []

    assert lines(friend, copier) == []


@pytest.mark.parametrize(("away", "told"), [(9, 0), (11, 1)])
def test_a_rounded_number_says_nothing_where_several_are_within_ten_times_its_rounding(everybody, away, told):
    first, second, third, one, *_ = everybody
    near = [answering(other, set(), z=1.23 + away * 0.005) for other in (second, third)]
    assert len(lines(answering(first, set(), z=1.23), *near, answering(one, {Z}, z=1.23))) == told


def test_two_wrong_numbers_that_fit_another_bench_are_told_together_and_one_is_not(everybody):
    friend, one, *_ = everybody
    x, z = (float(f"{friend.given[where]:.2g}") for where in (X, Z))
    both = replace(one, given={X: x, Z: z}, right=frozenset(), wrong=frozenset({X, Z}))
    assert lines(friend, both) == [(one.name, friend.name, [X, Z], False)]
    assert lines(friend, replace(both, given={X: x}, wrong=frozenset({X}))) == []


def test_what_many_have_says_nothing_of_any_of_them(everybody):
    first, second, third, one, *_ = everybody
    alike = [answering(other, set(), z=1.2345) for other in (first, second, third)]
    copier = answering(one, {Z}, z=1.2345)
    assert lines(*alike, copier) == []
    assert len(lines(*alike[:2], copier)) == 2


def test_a_number_that_is_wrong_for_the_class_mate_too_is_not_told(everybody):
    friend, one, *_ = everybody
    both = [answering(other, {Z}, z=1.2345) for other in (friend, one)]
    assert lines(*both) == []


def test_what_is_right_on_the_own_bench_is_not_told(everybody):
    friend, one, *_ = everybody
    assert lines(friend, answering(one, set(), z=friend.given[Z])) == []


def test_who_has_the_same_bench_is_left_out(everybody):
    friend, one, *_ = everybody
    partner = answering(replace(one, bench=friend.bench), PARTS, **{where[1]: friend.given[where] for where in PARTS})
    assert lines(friend, partner) == []


def test_numbers_that_fit_the_own_bench_together_are_not_told_for_another_that_is_near(everybody):
    friend, *_ = everybody
    near = replace(friend, name="near", bench={where: 1.0005 * value for where, value in friend.bench.items()})
    assert lines(friend, answering(near, {X, Z}, x=near.bench[X] * 1.03, z=near.bench[Z] * 1.05)) == []


@pytest.mark.parametrize("value", [5e-324, 1.7e308, -3.21])
def test_the_oddest_numbers_are_bounded(everybody, value):
    friend, one, *_ = everybody
    assert lines(friend, answering(one, PARTS, x=value, y=value, z=value)) == []


# --- from the gradebook -----------------------------------------------------------------------------------------------

BENCHES = {"ada": 1.0, "bob": 2.0, "cleo": 3.0, "dan": 4.0}


def course(check=None):
    """A course with one number that is measured, on benches that are told by the student's name."""
    known = check or Number("it", lambda bench: bench.size, 0.01, own_bench=OwnBench(lambda bench: bench.size, 0.01))
    key = {"2.11": {"omega_n": known, "explanation": ForAPerson()}}
    return replace(OURS, key=key, bench=lambda student, policy: SimpleNamespace(size=BENCHES[student]))


def handed_in(student, value, status, bench_of=""):
    content = {"kind": "number", "value": value}
    about = {"format": 1, "student": student, "bench": {}, "software": "rotflex 0", "probe_seed": 7}
    book = {**about, "answers": {"2.11": {"omega_n": content}}}
    facts = Facts(bench_of=bench_of or student, policy=BenchPolicy()).plain()
    marks = MarkRecord("2.11", "omega_n", status, 0.0, 2.0, "Well.", "")
    return graded(student, marks, answers=json.dumps(book).encode(), cells=facts)


@pytest.fixture
def book(tmp_path):
    with Gradebook(tmp_path / "book.sqlite") as opened:
        yield opened


def test_the_file_names_both_question_value_and_that_it_is_no_verdict(book, tmp_path):
    record(book, handed_in("ada", 1.003, Status.RIGHT), handed_in("bob", 1.003, Status.WRONG))
    reports = Reports(tmp_path / "out", course(), book)
    reports.write_all()
    text = (tmp_path / "out" / "hints.md").read_text(encoding="utf-8")
    assert "A hint, never a verdict." in text
    assert "* bob: 2.11 omega_n = 1.003 is wrong on their own bench, and the right answer of ada." in text
    assert reports.hints == (
        "Answers that fit a class-mate's bench, as a hint and never a verdict: 1, listed in "
        f"{tmp_path / 'out' / 'hints.md'}."
    )


def test_a_file_of_before_goes_when_there_is_nothing_to_hint_at(book, tmp_path):
    record(book, handed_in("ada", 1.003, Status.RIGHT), handed_in("bob", 2.0, Status.RIGHT))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "hints.md").write_text("of before", encoding="utf-8")
    reports = Reports(tmp_path / "out", course(), book)
    reports.write_all()
    assert not (tmp_path / "out" / "hints.md").exists() and reports.hints == ""


def test_a_pair_that_hands_in_together_is_left_out(book, tmp_path):
    record(book, handed_in("cleo", 3.01, Status.RIGHT, "cleo"), handed_in("dan", 3.01, Status.WRONG, bench_of="cleo"))
    reports = Reports(tmp_path / "out", course(), book)
    reports.write_all()
    assert reports.hints == ""


def test_answers_that_cannot_be_read_and_a_key_that_fails_cost_no_report(book, tmp_path):
    broken = graded("bob", answers=b"not json")
    record(book, handed_in("ada", 1.003, Status.RIGHT), broken, handed_in("eve", 1.003, Status.WRONG))  # eve: no bench
    reports = Reports(tmp_path / "out", course(), book)
    assert reports.write_all() == 3
    assert reports.hints == ""


def test_in_this_course_what_is_measured_on_the_own_bench_is_looked_at():
    parts = similar.measured_parts(OURS.key)
    assert {where: own.tells for where, own in parts.items()} == {
        ("2.11", "omega_n"): False,
        ("2.12", "J_l"): True,
        ("2.12", "K_s"): True,
    }
    bench = OURS.true_bench("ada")
    expected = [parts[where].expected(bench) for where in parts]
    assert expected == [bench.omega_n, bench.J_l, bench.K_s]


def test_a_hint_says_what_fits():
    together = Hint("bob", "ada", {X: 19.94, Z: 1.25}, alone=False)
    assert str(together) == "bob: 1.1 x = 19.94, 1.2 z = 1.25 fit the bench of ada together, and not their own."
