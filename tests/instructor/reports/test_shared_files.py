"""Whoever handed in the same measurements is told to instructors, but for those who handed in together."""

from __future__ import annotations

from dataclasses import replace

from gradebooks import graded

from rotflex.instructor.graded_run import Facts
from rotflex.instructor.reports import shared_files


def who(student, bench_of="", **files):
    delivered = {f"recordings/{name}.mat": b"\xff\x00" + content for name, content in files.items()}
    one = graded(student)
    one = replace(one, run=replace(one.run, cells=Facts(missing={}, bench_of=bench_of).plain()))
    return shared_files.measured(one, delivered)


def test_files_of_ones_own_are_no_hint():
    assert shared_files.hints([who("ada", a=b"1"), who("bob", a=b"2"), who("eve")]) == []


def lines(everybody):
    return [line for _students, line in shared_files.hints(everybody)]


def test_the_same_files_are_told_once_for_all_who_have_them_whatever_they_are_called():
    everybody = [who("ada", a=b"1", b=b"2", c=b"4"), who("bob", x=b"1", y=b"2"), who("eve", c=b"3"), who("dan", d=b"4")]
    assert shared_files.hints(everybody) == [
        (("ada", "bob"), "ada, bob handed in the same 2 files: recordings/a.mat and others."),
        (("ada", "dan"), "ada, dan handed in the same 1 file: recordings/c.mat."),
    ]


def test_who_handed_in_together_is_left_out_and_a_third_is_not():
    pair = [who("ada", "Ada", a=b"1"), who("bob", "ada", a=b"1")]
    assert shared_files.hints(pair) == []
    assert lines([*pair, who("eve", a=b"1")]) == ["ada, bob, eve handed in the same 1 file: recordings/a.mat."]


# --- other files ------------------------------------------------------------------------------------------------------


def having(student, given=(), **files):
    delivered = {f"{name}.mat": content for name, content in files.items()}
    return shared_files.measured(graded(student), delivered, given)


def matlab(when, content):
    return f"MATLAB 5.0 MAT-file, Created on: {when}".encode().ljust(128) + content


def test_a_matlab_file_that_was_saved_again_is_the_same_and_one_of_other_samples_is_not():
    mine, again = matlab("Mon", b"\xff\x00samples"), matlab("Tue", b"\xff\x00samples")
    other = matlab("Mon", b"\xff\x00others")
    assert lines([having("ada", a=mine), having("bob", b=again), having("eve", c=other)]) == [
        "ada, bob handed in the same 1 file: a.mat."
    ]


def test_text_nothing_and_what_was_handed_out_is_no_hint():
    data = b"\xff\x00handed out"
    given = {shared_files.digest(data)}
    everybody = [having(name, given, text=b"import numpy", nothing=b"", data=data) for name in ("ada", "bob")]
    assert lines(everybody) == []


def test_a_file_that_is_in_many_hand_ins_says_nothing():
    assert len(lines([having(f"s{number}", a=b"\xff\x00") for number in range(5)])) == 1
    assert lines([having(f"s{number}", a=b"\xff\x00") for number in range(6)]) == []
