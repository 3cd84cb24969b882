"""Messages for people go through one place, and the linter refuses what could not be translated."""

from __future__ import annotations

import subprocess
import sys

import pytest
from checkout import ROOT

from rotflex.courseware.messages import _, listed


def test_a_message_is_its_own_text_until_it_is_translated():
    assert _("{count} marks").format(count=3) == "3 marks"


@pytest.mark.parametrize(("most", "text"), [(3, "a, b, c"), (4, "a, b, c"), (2, "a, b and 1 more")])
def test_of_many_the_first_are_listed_and_the_others_counted(most, text):
    assert listed(["a", "b", "c"], most) == text


@pytest.mark.parametrize(
    ("message", "rule"),
    [
        ('_(f"{n} marks")', "INT001"),
        ('_("{n} marks".format(n=n))', "INT002"),
        ('_("%d marks" % n)', "INT003"),
        ('_("{n} marks").format(n=n)', ""),
    ],
)
def test_a_message_that_has_its_names_in_it_already_is_refused(message, rule):
    code = f"from rotflex.courseware.messages import _\n\nn = 3\nprint({message})\n"
    words = ["ruff", "check", "--no-cache", "--output-format=concise", "--stdin-filename=rotflex/any.py", "-"]
    done = subprocess.run(
        [sys.executable, "-m", *words], input=code, capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == bool(rule), done.stderr
    assert rule in done.stdout
