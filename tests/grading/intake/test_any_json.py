"""Any JSON value anywhere in a file of a hand-in costs at most this file."""

import json
import tempfile
from pathlib import Path

from any_json import ANSWERS, COURSE, one_damaged
from hypothesis import given, settings
from packings import WANTED, lay, notebook, work

from labcourse.grading import intake
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.prepared import prepare
from labcourse.problems import Code, has
from labcourse.sentences import sentence
from rotflex.course.questions import CATALOGUE

BROKEN = WANTED[1]
NEW = json.loads(notebook(BROKEN))
GOOD = {**work("ada"), "answers.json": json.dumps(ANSWERS).encode(), "course.json": json.dumps(COURSE).encode()}


def taken_in(root, files):
    lay(root / "ada", files)
    for submission in intake.find(root).submissions:
        if submission.student == "ada":
            intake.read(submission, WANTED)
            intake.choose_newest(submission, submission.items, WANTED)
            return submission, [*intake.unread_problems(submission), *submission.problems, *submission.notes]
    return None


@settings(max_examples=300, deadline=None, derandomize=True)
@given(one_damaged(BROKEN, NEW))
def test_the_other_files_are_read_and_this_one_is_or_is_named(broken):
    name, content = broken
    with tempfile.TemporaryDirectory() as folder:
        hand_in, reported = taken_in(Path(folder), {**GOOD, name: content})
    others = [one for one in WANTED if one != name]
    assert [hand_in.notebooks[one][0].source for one in others] == ["x = 1"] * len(others)
    if name == BROKEN:
        assert (BROKEN in hand_in.notebooks) != any(one.where == BROKEN for one in reported)
    elif name == "answers.json":
        bundle = Bundle(b"", {}, {}, (), "", CATALOGUE)
        prepare(hand_in, bundle, CATALOGUE)
        assert (hand_in.claim is not None) != any("answers.json" in sentence(note) for note in hand_in.notes)
    else:
        assert hand_in.course or content == b"{}" or has(Code.COURSE_FILE_UNREAD, reported, name)
