"""What the screen and scripts are told of those who did nothing for it."""

from __future__ import annotations

import json
from datetime import UTC, datetime

from gradebooks import graded, mark, prose

from rotflex.instructor.gradebook import GivenMark, MarkRecord
from rotflex.instructor.reports.changes import changes
from rotflex.instructor.reports.live_report import JsonLines, Screen
from rotflex.instructor.reports.result import result_of

BEFORE = graded("ada", mark(), prose())
REMARKED = graded("ada", mark("wrong", 0.0, "More than 1 % off."), prose(), key="key 2")
AGAIN = graded("ada", mark("wrong", 0.0, "More than 1 % off."), prose(), submission="second")
LAPSED = GivenMark(
    MarkRecord("2.11", "explanation", "given by a person", 0.5, 1.0, "Nearly.", "Before."),
    "tutor",
    datetime(2026, 3, 2, tzinfo=UTC),
)


def shown(kind, after, capsys, lapsed=()):
    with kind(1, [], []) as report:
        result = result_of(type(after)(after.run, after.marks, after.key_digest, lapsed))
        report.add(False, result, changes(BEFORE, after))
    return capsys.readouterr().out


def test_the_screen_says_what_a_changed_key_changed(capsys):
    text = shown(Screen, REMARKED, capsys)
    assert "ada: 2 → 0" in text and "key has changed" in text
    assert "2.11, omega_n" in text and REMARKED.marks[0].reason in text


def test_the_screen_leaves_out_what_changed_as_other_work_was_handed_in(capsys):
    assert "→" not in shown(Screen, AGAIN, capsys)


def test_scripts_are_told_what_changed_and_why(capsys):
    event = json.loads(shown(JsonLines, AGAIN, capsys).splitlines()[0])
    assert event["why"] == "handed in again" and event["changes"][0]["after"]["status"] == "wrong"
    assert event["points"] == 0 and event["not_marked"] == 0


def test_a_mark_that_lapsed_is_told(capsys):
    assert "ada, 2.11, explanation: tutor gave 0.5 of 1 points on 2026-03-02" in " ".join(
        shown(Screen, REMARKED, capsys, (LAPSED,)).split()
    )
    assert json.loads(shown(JsonLines, REMARKED, capsys, (LAPSED,)).splitlines()[0])["lapsed"][0].startswith("2.11, ")
