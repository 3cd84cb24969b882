"""A class of students who mean harm, graded as an instructor grades it: nothing undeserved is earned, no secret is
read, nothing outside is touched, and honest neighbours do not notice.

At a landing the class has attacks of each kind, in `make test-all` it has all.
"""

from __future__ import annotations

import csv
import html.parser
import json
import os
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import hostile
import hostile_outside
import pytest
from hostile import CANARY, HONEST
from hostile_files import NAMES, REFUSED
from hostile_outside import CLASS, OF_EACH_KIND, by_question

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="isolation needs Linux")

OUT_OF = 13
#: What words are shown with, and nothing besides; formulas are MathML.
OF_WORDS = re.compile(
    r"p|strong|em|s|code|pre|[uo]l|li|blockquote|[hb]r|span|img|table|thead|tbody|t[rhd]|figure|details|summary|div|"
    r"math|m(row|i|n|o|text|su[bp]|subsup|frac|sqrt|root|over|under|underover|table|t[rd]|style|space|padded|phantom)"
)


@pytest.fixture(scope="module")
def graded(request):
    """The class, graded by the command as an instructor runs it, after its two honest members were graded alone."""
    here = [item for item in request.session.items if item.path == request.path]
    attacks = CLASS if any(item.get_closest_marker("scheduled") for item in here) else OF_EACH_KIND
    with hostile_outside.graded(attacks) as found:
        yield found


def test_all_are_graded(graded):
    with (graded.out / "grades.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(graded.attacks) + len(HONEST), graded.done.stderr
    assert graded.done.returncode == 1, graded.done.stderr


@pytest.mark.parametrize(
    "student",
    [
        pytest.param(student, marks=() if student in OF_EACH_KIND else pytest.mark.scheduled, id=student)
        for student in CLASS
    ],
)
def test_an_attack_earns_nothing_undeserved_is_contained_and_is_named(graded, student):
    attack, marks = CLASS[student], graded.marks(student)
    assert marks["out_of"] == OUT_OF
    assert graded.undeserved(student) == 0
    if attack.exactly:
        earned = {number: points for number, points in by_question(marks).items() if points}
        assert earned == attack.earns, marks["problems"]
    if attack.runs:  # what it found, as it tells from inside
        report = graded.report(student)
        assert report.get("inside") is True, marks
        for name, expected in attack.finds.items():
            assert expected(report[name]) if callable(expected) else report[name] == expected, (name, report)
    said = "\n".join([*marks["problems"], *marks["notes"], *(mark["reason"] for mark in marks["marks"])])
    assert [trouble for trouble in attack.trouble if trouble not in said] == [], said
    assert not any("Grading failed" in problem for problem in marks["problems"])  # that would be a fault of ours
    _assert_harmless(_Page(graded.out / student / "feedback.html"), _Page(graded.alone / HONEST[0] / "feedback.html"))


@pytest.mark.parametrize("student", HONEST)
def test_honest_neighbours_have_the_same_marks_as_alone(graded, student):
    assert by_question(graded.marks(student)) == {"0.1": 0, "2.1": 2, "2.10": 2, "2.11": 2, "2.12": 3, "2.17": 0}
    assert graded.marks(student) == graded.marks(student, graded.alone)
    rows = [_row(out, student) for out in (graded.out, graded.alone)]
    assert rows[0] == rows[1]


def _row(out: Path, student: str) -> list[str]:
    with (out / "grades.csv").open(encoding="utf-8", newline="") as file:
        return next(row for row in csv.reader(file) if row[0] == student)


def test_the_secrets_are_there_to_be_read(graded):
    read = {
        canary.decode()
        for path in graded.outside["secrets"]
        if os.access(path, os.R_OK)
        for canary in re.findall(CANARY.encode(), Path(path).read_bytes())
    }
    assert read == {canary for name, canary in graded.canaries.items() if name != "environment"}


def test_the_targets_are_there_to_be_written_to(graded):
    assert all(os.access(path, os.W_OK) for path in graded.outside["targets"])


def test_no_code_does_anything_outside_of_a_sandbox(tmp_path, graded):
    code = f"{hostile.PRELUDE.format(outside=json.dumps(graded.outside))}\nopen('done', 'w')"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "not in a sandbox: nothing is done" in done.stderr
    assert not (tmp_path / "done").exists()


def test_no_secret_is_in_anything_that_came_out(graded):
    for path in graded.files():
        found = set(re.findall(CANARY, path.read_text(encoding="utf-8")))
        if path.parent.name in HONEST:  # their own words
            found.discard(graded.canaries["neighbour"])
        assert not found or path.name == "earlier.json", path
    assert not re.search(CANARY, graded.done.stdout + graded.done.stderr)


def test_the_gradebook_holds_no_secret_but_those_that_belong_there(graded):
    found = {
        one.decode()
        for path in graded.out.glob("gradebook.sqlite*")
        for one in re.findall(CANARY.encode(), path.read_bytes())
    }
    assert found == {graded.canaries["gradebook"], graded.canaries["neighbour"]}


def test_nothing_outside_has_changed(graded):
    before, after = graded.before, graded.after
    assert {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)} == set()
    assert graded.strays == []


def test_only_students_have_a_place_among_the_results(graded):
    ours = {"grades.csv", "gradebook.sqlite", "earlier.json"}
    assert {path.name for path in graded.out.iterdir()} - {"hints.md", "hints.json", "intake.csv"} == {
        *graded.attacks,
        *HONEST,
        *ours,
    }


def test_hints_name_attacks_alone(graded):
    file = graded.out / "hints.md"  # not there if no two attacks have an equal file
    hints = file.read_text(encoding="utf-8") if file.exists() else ""
    assert _steering(hints) == set()
    assert not [name for name in HONEST if name in hints]


def _steering(text: str) -> set[str]:
    """Characters that steer a terminal, or turn the direction of writing."""
    return {one for one in text if unicodedata.category(one) in ("Cc", "Cf", "Cs") and one not in "\n\r\t"}


def test_the_terminal_gets_no_escapes(graded):
    assert _steering(graded.done.stdout + graded.done.stderr) == set()


def test_no_cell_of_the_table_begins_a_formula(graded):
    text = (graded.out / "grades.csv").read_text(encoding="utf-8")
    assert _steering(text) == set()
    with (graded.out / "grades.csv").open(encoding="utf-8", newline="") as file:
        cells = [cell for row in csv.reader(file) for cell in row]
    assert not [cell for cell in cells if cell.lstrip().startswith(("=", "+", "-", "@", "\t", "\r"))]
    assert {f"'{name}" for name in NAMES if name in graded.attacks and name[0] in "=+-@"} <= set(cells)


class _Page(html.parser.HTMLParser):
    """The elements of a page, and their attributes."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.found: set[tuple[str, str]] = set()
        self.loads: set[str] = set()
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found |= {(tag, name) for name, _ in attributes} | {(tag, "")}
        self.loads |= {value or "" for name, value in attributes if name in ("src", "href", "srcset", "data", "action")}

    def handle_comment(self, data: str) -> None:
        self.found.add(("comment", data))


def _assert_harmless(page, honest):
    """A feedback has no elements but those of an honest student's, and of words; and a strict policy."""
    ours = {("h2", ""), ("ul", ""), ("li", "")}  # of problems, and notes
    more = {(tag, name) for tag, name in page.found - honest.found - ours if not OF_WORDS.fullmatch(tag)}
    assert more == set()
    assert not {name for _tag, name in page.found if name.startswith("on")}
    assert all(one.startswith(("#", "data:image/png;base64,")) for one in page.loads)
    assert "default-src 'none'" in page.text
    assert _steering(page.text) == set()


@pytest.mark.parametrize(
    "shown", ["&lt;script&gt;alert(1)&lt;/script&gt;", "[red]rich[/red]", "=HYPERLINK(", "{{ 7*7 }}", "&amp;#60;b&gt;"]
)
def test_text_that_is_more_than_text_is_shown_as_text(graded, shown):
    assert shown in (graded.out / "markup" / "feedback.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [name for name in REFUSED if name.isprintable()])
def test_a_name_that_cannot_be_an_id_is_told_and_not_used(graded, name):
    assert repr(name)[:60] in graded.done.stdout.replace("\n", "")
