"""Whoever handed in the same measurements is told to instructors, but for those who handed in together."""

from __future__ import annotations

from dataclasses import replace

from gradebooks import graded

from rotflex.instructor.graded_run import Facts
from rotflex.instructor.reports import shared_files


def who(student, bench_of="", **files):
    evidence = {f"recordings/{name}.mat": content for name, content in files.items()}
    evidence |= {f"recordings/{name}.mat.signed": b"the same" for name in files}
    facts = Facts(missing={}, bench_of=bench_of, evidence=evidence)
    one = graded(student)
    return shared_files.measured(replace(one, run=replace(one.run, cells=facts.plain())))


def test_files_of_ones_own_are_no_hint_and_neither_are_equal_signatures():
    assert shared_files.hints([who("ada", a=b"1"), who("bob", a=b"2"), who("eve")]) == []


def test_the_same_files_are_told_once_for_all_who_have_them_whatever_they_are_called():
    everybody = [who("ada", a=b"1", b=b"2", c=b"4"), who("bob", x=b"1", y=b"2"), who("eve", c=b"3"), who("dan", d=b"4")]
    told = ["ada, bob handed in the same 2 files: recordings/a.mat and others."]
    told += ["ada, dan handed in the same 1 file: recordings/c.mat."]
    assert shared_files.hints(everybody) == told
    text = shared_files.text(told)
    assert "**A hint, never a verdict.**" in text and text.endswith(f"* {told[0]}\n* {told[1]}\n")


def test_who_handed_in_together_is_left_out_and_a_third_is_not():
    pair = [who("ada", "Ada", a=b"1"), who("bob", "ada", a=b"1")]
    assert shared_files.hints(pair) == []
    assert shared_files.hints([*pair, who("eve", a=b"1")]) == [
        "ada, bob, eve handed in the same 1 file: recordings/a.mat."
    ]
