"""What those who mean harm hand in, read on the trusted side alone: nothing of it is run here.

Each is taken in, put into the course's frame, and explained, as grading does it before and after a run; in bounded
time, and with nothing in it that a run, a page or a terminal would have to fear. What comes of running it, the hostile
class shows (tests/whole/test_hostile_class.py).
"""

import json
import re
import sys
import unicodedata
from pathlib import Path, PurePosixPath

import hostile
import pytest
from hostile_cells import CELLS
from hostile_files import FORMS
from hostile_own_files import MODULES, OWN_FILES
from hostile_words import WORDS
from said_problems import within

from labcourse.answers.cell_reports import CellReports
from labcourse.answers.notebooks import MAX_CELLS
from labcourse.answers.own_files import MAX_FILES, MAX_TOTAL
from labcourse.grading import course as courses
from labcourse.grading import intake
from labcourse.grading.release import student_course
from labcourse.grading.reports.markdown import as_html
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.prepared import prepare
from labcourse.problems import Code
from labcourse.run.reasons import explain
from labcourse.sentences import sentence

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="these files cannot be made there")

SECONDS = 60.0  # after which reading one that hangs ends; it takes an honest hand-in a fraction of one
#: Own files that harm nobody, as they bear no name that anything looks for.
HARMLESS = {
    *("Labcourse/answers/cell_reports.py", "evil.pth", "conftest.py", "main.py", "watch.py", "style/matplotlibrc"),
    *("\uff4e\uff55\uff4d\uff50\uff59.py", "nump\u0443.py", "labcourse_inside/__init__.py", "rotflex/course/lab.py"),
}
#: What the reader says by itself; the rest is said after a run.
_BY_READING = {
    "ten-thousand-cells": (Code.TOO_MANY_CELLS, {"most": MAX_CELLS}),
    "own-modules": (Code.HIDES_MODULE, {"module": "numpy"}),
    "own-files-lead-away": (Code.LEADS_OUTSIDE, {}),
    "says-it-is-anothers-too": (Code.PARTNERS_UNCONFIRMED, {}),
    "pictures-of-all-sorts": (Code.PICTURE_TOO_WIDE, {"most": 20_000}),
}
OTHERS = {name: FORMS[name] for name in ("rearranged", "retagged", "zip-slip", "links")}
ALL = {**CELLS, **OWN_FILES, **WORDS, **OTHERS}


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    source = hostile.course(tmp_path_factory.mktemp("hostile"), "canary")
    course = courses.load(source)
    pristine = {name: json.loads(text) for name, text in student_course.derive_notebooks(course).items()}
    return source, course, Bundle(b"", pristine, {}, (), "0" * 64, course.catalogue)


@pytest.fixture
def taken(request, frame, tmp_path, handed_in):
    source, course, bundle = frame
    student = request.param
    handed_in(tmp_path / "in", source, student, ALL[student])
    for honest in hostile.HONEST:
        handed_in(tmp_path / "in", source, honest, hostile.Attack())
    found = {one.student: one for one in intake.find(tmp_path / "in").submissions}
    ready = intake.read(found[student], sorted(bundle.pristine), {}, packages=course.packages)
    intake.choose_newest(ready, ready.items, sorted(bundle.pristine))
    prepare(ready, bundle, course.catalogue)
    reasons = explain(
        bundle.pristine,
        ready.merged,
        CellReports(),
        set(ready.words),
        course.catalogue,
        handed_in=ready.handed_in,
        claim=ready.claim,
    )
    said = [*intake.unread_problems(ready), *ready.problems, *ready.notes, *reasons.lost]
    return student, ready, said, found


@pytest.fixture
def handed_in(tmp_path):
    """Hands in what an attack is made of, for nothing that is outside."""
    secret = tmp_path / "secret"
    secret.write_text("canary")
    outside = {"secrets": [str(secret)], "targets": [str(tmp_path / "target")], "token": "token", "marker": str(secret)}
    outside |= {"namespaces": {}, "witness": "witness", "neighbour": hostile.HONEST[0]}

    def hand_in(folder: Path, source: Path, student: str, attack: hostile.Attack) -> None:
        from hostile_outside import hand_in

        folder.mkdir(exist_ok=True)
        hand_in(folder, source, student, attack, outside)

    return hand_in


@pytest.mark.timeout(SECONDS, func_only=False)
@pytest.mark.parametrize("taken", ALL, indirect=True)
def test_it_is_read_what_is_wrong_is_said_and_nothing_dangerous_is_left(taken):
    student, ready, said, found = taken
    assert set(found) == {student, *hostile.HONEST}
    for honest in hostile.HONEST:
        assert [piece.source for piece in found[honest].pieces] == [honest]
        assert (found[honest].bench_of, found[honest].partners, found[honest].problems) == (honest, (), [])
    for notebook in ready.merged.notebooks.values():
        names = [cell["id"] for cell in notebook["cells"]]
        assert len(set(names)) == len(names)
        assert all(re.fullmatch(r"[a-zA-Z0-9_-]{1,64}", name) for name in names)
    assert len(ready.files) <= MAX_FILES and sum(map(len, ready.files.values())) <= MAX_TOTAL
    for name in map(PurePosixPath, ready.files):
        assert not name.is_absolute() and ".." not in name.parts and name.as_posix().isprintable()
        assert not {"answers.json", "cell_reports.jsonl", "course.json"} & {part.casefold() for part in name.parts}
    assert b"canary" not in b"".join(ready.files.values())
    if student in _BY_READING:
        code, about = _BY_READING[student]
        assert any(one.code is code and one.parameters.items() >= about.items() for one in within(said))
    assert student != "own-modules" or set(ready.files) <= HARMLESS < set(MODULES)
    shown = "\n".join(map(sentence, said))
    assert not [
        one for one in shown if unicodedata.category(one) in ("Cc", "Cf", "Cs") and one not in "\n\t\u200c\u200d"
    ]
    assert len(shown) < 20_000
    for words in ready.words.values():
        assert all(data.startswith(b"\x89PNG") and len(data) < 10**6 for data in words.pictures.values())
        page = str(as_html(words.text, words.pictures))
        assert not re.search(
            r"<(?:script|iframe|svg|style|base|form|a|link|meta|object|embed|input)\b|<[^>]* on\w+=", page
        )
        assert not re.search(r'(?:src|href)="(?!data:image/png;base64,)', page)
