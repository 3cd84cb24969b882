"""docs/handing_in.md says what holds."""

from __future__ import annotations

import re

import pytest
from checkout import ROOT

from rotflex.courseware import answers, report_files
from rotflex.courseware.run import own_files
from rotflex.instructor.running.intake import labels, limits

TEXT = (ROOT / "docs" / "handing_in.md").read_text(encoding="utf-8")
MB = 1_000_000
LIMITS = {
    "a student's zip": [limits.MAX_ARCHIVE / MB],
    "a zip within a zip": [limits.MAX_INNER_ARCHIVE / MB],
    "zips within one hand-in": [limits.MAX_INNER_ARCHIVES, limits.MAX_NESTING],
    "files and folders of a hand-in": [limits.MAX_ENTRIES, limits.MAX_DEPTH],
    "a zip of the whole class": [limits.MAX_CLASS_ARCHIVE / MB, limits.MAX_CLASS_ENTRIES],
    "a notebook with its outputs, which are dropped": [limits.MAX_NOTEBOOK_FILE / MB],
    "a notebook without its outputs and pictures": [limits.MAX_NOTEBOOK / MB],
    "pictures pasted into one notebook's text cells": [limits.MAX_PICTURES / MB],
    "a report as PDF": [report_files.MAX_BYTES / MB],
    "own files": [own_files.MAX_FILES, own_files.MAX_FILE / MB, own_files.MAX_TOTAL / MB],
    "`answers.json`": [answers.MAX_BYTES / MB],
}
ROWS = dict(re.findall(r"^\| (.+?) \| (.+?) \|$", TEXT.partition("## How much")[2], re.MULTILINE))


def test_each_limit_is_the_one_that_holds_and_no_other_is_stated():
    assert {what: [float(number) for number in re.findall(r"\d+", said)] for what, said in ROWS.items()} == LIMITS


@pytest.mark.parametrize("platform", [labels.MOODLE, labels.CANVAS, labels.BLACKBOARD, labels.BRIGHTSPACE])
def test_the_examples_of_names_are_understood(platform):
    (examples,) = re.findall(rf"^\| {platform}'s .+? \| (.+) \|$", TEXT, re.MULTILINE)
    names = [example.removesuffix("/…") for example in re.findall(r"`(.+?)`", examples)]
    found = [labels.read(name) for name in names]
    assert found and all(label is not None and label.platform == platform for label in found)
