"""How long grading and scoring took, by what the gradebook knows; nothing is made up where it knows too little."""

from datetime import UTC, datetime, timedelta

import pytest

from labcourse.grading.gradebook import Act, Answer, AuditRecord, MarkRecord
from labcourse.grading.overview import times

START = datetime(2026, 3, 2, 9, tzinfo=UTC)
FIRST_PART, SECOND_PART = ("1.1", "why"), ("1.2", "how")


def act(seconds, where=FIRST_PART, actor="tia", undoes=None, number=0):
    when = START + timedelta(seconds=seconds)
    return Act(number, "ada", *where, actor, 3, 1.0, 1.0, "", "So.", False, undoes, when)


def answer(where, waiting=True):
    status = "for a person" if waiting else "given by a person"
    return Answer("ada", *where, MarkRecord(*where, status, 0.0, 1.0, "", "So."))


def entry(seconds, student, actor="labcourse grade"):
    return AuditRecord(0, student, "1.1", "x", None, None, "run", actor, "why", START + timedelta(seconds=seconds))


def test_pauses_are_no_time_of_an_answer_and_neither_is_taking_back():
    acts = [act(0), act(20), act(50), act(55, undoes=2), act(90), act(690), act(1290), act(1310), act(1345)]
    (pace,) = times.paces(acts)
    # 20, 30, (55 is an undoing: nothing), 35; 600 s and more is a pause; 20, 35.
    assert [one.seconds for one in pace.readings] == [20, 30, 35, 20, 35]
    assert pace.usual == 30 and pace.acts == 8


def test_two_scorers_at_a_time_are_told_apart():
    acts = [act(10 * n, actor=("tia", "udo")[n % 2]) for n in range(14)]
    assert [(one.actor, one.acts, one.usual) for one in times.paces(acts)] == [("tia", 7, 20), ("udo", 7, 20)]


def test_what_is_left_is_estimated_by_the_median_of_each_part_or_else_of_all():
    acts = [act(20 * n) for n in range(7)] + [act(120 + 60 * n, SECOND_PART) for n in range(1, 7)]
    found = times.paces(acts)
    other = ("1.3", "what")
    assert times.left(found, [answer(FIRST_PART)] * 3 + [answer(FIRST_PART, waiting=False)]) == 60
    assert times.left(found, [answer(SECOND_PART)] * 2) == 120
    assert times.left(found, [answer(other)]) == 40  # half of the twelve gaps are 20 s, and half 60 s


def test_what_came_from_a_table_is_no_time_of_an_answer():
    table = [act(n / 20, (FIRST_PART, SECOND_PART)[n % 2], "cid") for n in range(120)]
    (pace,) = times.paces(table)
    assert (pace.acts, pace.usual) == (120, None)
    section = times.section(3, [], table, [answer(FIRST_PART)])
    assert "how long that takes is known once" in section.first
    assert ("cid", "120", "not known yet") in section.tables[-1].rows


@pytest.mark.parametrize(("count", "is_known"), [(5, False), (6, True)])
def test_of_a_few_acts_nothing_is_said(count, is_known):
    acts = [act(20 * n) for n in range(count)]
    section = times.section(3, [], acts, [answer(FIRST_PART)])
    assert (times.left(times.paces(acts), []) is not None) is is_known
    assert ("about 20 s for one person" in section.first) is is_known
    assert ("how long that takes is known once" in section.first) is not is_known


def test_commands_are_told_apart_by_name_and_by_pauses_and_persons_are_no_command():
    trail = [entry(0, "ada"), entry(40, "bob"), entry(50, "bob"), entry(60, "tim", "tia")]
    trail += [entry(700, "ada"), entry(710, "ada", "labcourse regrade")]
    assert [(one.actor, one.students, (one.ended - one.began).total_seconds()) for one in times.sessions(trail)] == [
        ("labcourse grade", 2, 50),
        ("labcourse grade", 1, 0),
        ("labcourse regrade", 1, 0),
    ]


@pytest.mark.parametrize(
    ("seconds", "words"), [(0, "0 s"), (99, "99 s"), (100, "2 min"), (5940, "99 min"), (11100, "3 h 05 min")]
)
def test_a_time_is_told_in_two_units_at_most(seconds, words):
    assert times.lasting(seconds) == words
