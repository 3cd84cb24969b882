"""Attacks that the self-test leaves out are contained, too, and would not be if their layer were missing."""

import os

import pytest
from sandbox_attacks import LIMITS, TOGETHER, successful_attacks

from labcourse.grading.isolation import bubblewrap, sandbox, seccomp

pytestmark = pytest.mark.isolation


def test_every_attack_is_contained():
    assert successful_attacks() == TOGETHER


def test_they_succeed_without_limits(monkeypatch):
    monkeypatch.setattr(sandbox._Sandbox, "limit", lambda *_: ())
    assert successful_attacks() == {"file too big", "many processes", "memory together"}


def test_they_succeed_in_a_folder_without_bounds(monkeypatch):
    arguments = bubblewrap.arguments

    def unbounded(*given):
        args = arguments(*given)
        where = args.index(str(LIMITS.folder)) - 1  # --size N
        return args[:where] + args[where + 2 :]

    monkeypatch.setattr(bubblewrap, "arguments", unbounded)
    assert successful_attacks() == {"full folder"} | TOGETHER


def test_they_succeed_without_the_filter(monkeypatch):
    monkeypatch.setattr(seccomp, "program", lambda machine: None)
    found = successful_attacks() - TOGETHER
    assert found <= {"virtual machine's host", "user namespace", "trace the first process"}  # some kernels lack some
    assert "user namespace" in found or os.geteuid() != 0  # an ordinary user's sandbox makes none in any case
