"""What another marking changed, in words and as data; how a batch is going."""

import json
import re
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from gradebooks import graded, mark, prose

from labcourse.grading.gradebook import GivenMark
from labcourse.grading.marks import Mark
from labcourse.grading.reports import live_report
from labcourse.grading.reports.changes import HANDED_IN_AGAIN, KEY_CHANGED, RUN_AGAIN, changes, changes_since
from labcourse.grading.reports.live_report import JsonLines, Screen


def test_each_part_that_changed_is_told_from_what_to_what_and_why():
    wrong = mark("wrong", 0.0, "More than 1 % off.")
    found = changes(graded("ada", mark(), prose()), graded("ada", wrong, prose(), key="key 2"))
    first, second = str(found).splitlines()
    assert "ada: 2 → 0" in first and "2.11, omega_n" in second and wrong.reason in second
    data = found.as_data()
    (part,) = data.pop("changes")
    assert data == {"why": KEY_CHANGED}
    assert (part["question"], part["part"]) == ("2.11", "omega_n")
    assert part["before"] == {"status": "right", "points": 2.0, "out_of": 2.0, "reason": "Well."}
    assert part["after"] == {"status": "wrong", "points": 0.0, "out_of": 2.0, "reason": "More than 1 % off."}


def test_a_part_that_comes_or_goes_is_told():
    new = Mark("2.12", "K_s", "right", 1.0, 1.0, "Well.")
    found = changes(graded("ada", mark(), prose()), graded("ada", mark(), new))
    came, went = found.as_data()["changes"]
    assert (came["before"], went["after"]) == (None, None)
    assert "2.12, K_s: no mark → 1 of 1" in str(found) and "2.11, explanation: not decided, of 1" in str(found)


@pytest.mark.parametrize("now", [{"points": 1.0}, {"out_of": 4.0}, {"status": "partly"}])
def test_other_points_for_the_same_answer_are_told(now):
    found = changes(graded("ada", mark()), graded("ada", replace(mark(), **now)))
    assert [where for where, _before, _after in found.parts] == [("2.11", "omega_n")]


def test_another_reason_for_the_same_mark_is_no_change():
    after = graded("ada", mark(reason="Within 1 %.", given="20"), key="key 2")
    assert changes(graded("ada", mark()), after).parts == ()


def test_the_reason_says_who_did_something():
    one = graded("ada", submission="first")
    assert changes(one, graded("ada", submission="second")).why == HANDED_IN_AGAIN
    assert changes(one, graded("ada", key="key 2")).why == KEY_CHANGED
    again = graded("ada", submission="other notebooks")
    again = replace(again, run=replace(again.run, submission="first"), key_digest="key 1")
    assert changes(one, again).why == RUN_AGAIN
    other_words = replace(one, run=replace(one.run, submission="second"))  # which are not run: the run is the same
    assert changes(one, other_words).why == HANDED_IN_AGAIN


def test_who_had_no_marks_or_has_the_same_has_no_changes():
    assert changes_since(None, graded("cleo", mark("wrong", 0.0))) is None
    assert changes_since(graded("ada", answers=b"x"), graded("ADA", answers=b"y")) is None
    changed = changes_since(graded("bob"), graded("Bob", mark("wrong", 0.0), prose()))
    assert changed is not None and (changed.before, changed.after) == (2.0, 0.0)


BEFORE = graded("ada", mark(), prose())
REMARKED = graded("ada", mark("wrong", 0.0, "More than 1 % off."), prose(), key="key 2")
LAPSED = GivenMark(
    Mark("2.11", "explanation", "given by a person", 0.5, 1.0, "Nearly.", "Before."),
    "tutor",
    datetime(2026, 3, 2, tzinfo=UTC),
)


def shown(kind, after, capsys, lapsed=()):
    with kind(1, [], []) as report:
        report.add(False, replace(after, lapsed=lapsed), changes(BEFORE, after))
    return capsys.readouterr().out


def test_the_screen_and_scripts_are_told_what_changed_and_which_mark_lapsed(capsys):
    text = " ".join(shown(Screen, REMARKED, capsys, (LAPSED,)).split())
    assert "ada: 2 → 0" in text and "2.11, omega_n" in text and REMARKED.marks[0].reason in text
    assert "ada, 2.11, explanation: tutor gave 0.5 of 1 points on 2026-03-02" in text
    event = json.loads(shown(JsonLines, REMARKED, capsys, (LAPSED,)).splitlines()[0])
    assert event["why"] == KEY_CHANGED and event["changes"][0]["after"]["status"] == "wrong"
    assert (event["points"], event["not_marked"]) == (0, 0) and event["lapsed"][0].startswith("2.11, ")


@pytest.mark.parametrize("number", [3, 4])
def test_a_class_is_listed_up_to_a_screenful_with_trouble_first_and_the_rest_counted(number, capsys, monkeypatch):
    monkeypatch.setattr(live_report, "_MOST_ROWS", 3)
    monkeypatch.setenv("COLUMNS", "200")
    with Screen(number, [], []) as report:
        for place in reversed(range(number)):
            problems = ("trouble",) if place in (1, 2) else ()
            report.add(False, graded(f"student{place:02}", mark(), prose(), problems=problems))
    text = capsys.readouterr().out
    order = ["00", "01", "02"] if number == 3 else ["01", "02", "00"]
    assert re.findall(r"student(\d\d): (?:trouble|2 of 3 points)", text) == order
    assert re.findall(r"and (\d+) more, in grades.csv", text) == ["1"] * (number - 3)
