"""The page that a student gets back: what it says, what it folds away, and what cannot get onto it."""

import io
import json
import re
from base64 import b64encode
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from gradebooks import result
from made_courses import OURS
from page_text import page_text
from PIL import Image

from labcourse import clock
from labcourse.answers.catalogue import Catalogue
from labcourse.grading.gradebook import CommentRecord, GivenMark, RunRecord
from labcourse.grading.marking.checks import ForAPerson
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import feedback
from labcourse.grading.settings import MarkSettings

OMEGA = Mark("2.11", "omega_n", Status.RIGHT, 2.0, 2.0, "Within 5 %.", "19.9 rad/s")
WHY = Mark("2.11", "explanation", Status.BY_A_PERSON, 1.0, 1.0, "Well reasoned.", "Because it bends.")
STIFFNESS = Mark("2.12", "K_s", Status.FOLLOW_THROUGH, 2.0, 2.0, "It agrees with your own omega_n.", "1.3 N·m/rad")
FIGURE = {
    "title": "",
    "xlabel": "time (s)",
    "ylabel": "deflection (deg)",
    "lines": [{"label": "alpha", "n": 3, "x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 0.0]}],
}


COURSE = replace(OURS, title="A course", settings=replace(OURS.settings, term="Spring"))


def page(*marks, course=COURSE, **more):
    return feedback.page(result(*marks, **more), course)


def run(answers=None, **more):
    content = {"format": 2, "student": "ada", "bench": {}, "software": "rotflex", "probe_seed": 7}
    data = None if answers is None else json.dumps({**content, "answers": answers}).encode()
    return RunRecord(
        key="k",
        student="ada",
        submission="s",
        master="m",
        software="rotflex",
        probe_seed=7,
        isolation="Run in isolation.",
        answers=data,
        **more,
    )


def opened(text):
    found = re.findall(r'<details class="question"( open)?>\s*<summary><h4>Question ([^:]+):', text)
    return {number: bool(is_open) for is_open, number in found}


def test_a_whole_page():
    """One mark of each sort, a name, comments, a mark that lapsed, problems and notes; read as text."""
    when = datetime(2026, 3, 2, tzinfo=UTC)
    marks = [
        OMEGA,
        replace(WHY, status=Status.FOR_A_PERSON, points=0.0),
        STIFFNESS,
        Mark("2.12", "J_l", Status.WRONG, 0.0, 1.0, "More than 1 % off.", "4"),
        Mark("2.16", "comparison", Status.NOT_MARKED, 0.0, 2.0, "key.py, line 3.", "So."),
        Mark("3.1", "explanation", Status.MISSING, 0.0, 1.0, "3.1 stopped: NameError, line 3", ""),
    ]
    said = [CommentRecord("ada", None, "Good.", "prof", when), CommentRecord("ada", "2.11", "Unit?", "tutor", when)]
    lapsed = GivenMark(Mark("2.12", "K_s", "given by a person", 1.0, 2.0, "", ""), "tutor", when)
    more = {"about": ("Ada L.", "", "B"), "problems": ("A problem.",), "notes": ("A note.",)}
    text = page_text(page(*marks, comments=said, lapsed=[lapsed], **more))
    place = -1
    for piece in (  # in this order
        *("Feedback for ada", "Ada L. · section B · A course · Spring", "So far 4.00 of 9 points."),
        *("1 point waits for a person: 2.11", "2 points could not be marked, through no fault of yours: 2.16"),
        *("A problem.", "Good. prof", "2.12, K_s: tutor gave 1 of 2 points on 2026-03-02", "A note."),
        *("Your answers", "Question 2.11: ", "19.9 rad/s ✓ right , 2 of 2 points. Within 5 %."),
        *("Because it bends. … for a person , 1 point not decided yet.", "Unit? tutor", "Question 2.12: "),
        *("1.3 N·m/rad ✓ right, given your own earlier answers , 2 of 2 points.", "4 ✗ wrong , 0 of 1 point."),
        *("⚑ not marked: key fault , 2 points not decided yet. key.py, line 3.", "○ missing . 3.1 stopped: NameError"),
    ):
        assert text.find(piece, place + 1) > place, piece
        place = text.find(piece, place + 1)


def test_the_three_questions_that_lost_most_come_first_with_their_cell_in_the_students_notebook():
    wrong = replace(OMEGA, status=Status.WRONG, points=0.0)
    half = Mark("3.1", "explanation", Status.BY_A_PERSON, 0.5, 1.0, "Which way?", "Stable.")
    little = Mark("3.3", "A_c", Status.PARTLY, 0.9, 1.0, "Nearly.", "A_c")
    twice = Mark("2.1", "V", Status.PARTLY, 1.25, 2.0, "A sign.", "V")
    waits = Mark("2.16", "comparison", Status.FOR_A_PERSON, 0.0, 2.0, "A person reads it.", "So.")
    course = replace(COURSE, settings=replace(COURSE.settings, marks=MarkSettings(weights={"2.1": 3})))
    text = page(wrong, WHY, half, little, twice, waits, course=course)  # lost: 2, 0.5, 0.1, 0.75 × 3, nothing
    first = text[text.index("<ol>") : text.index("</ol>")]
    assert re.findall('href="#(.*?)"', first) == ["q-2-1", "q-2-11", "q-3-1"]
    assert all(f'id="{one}"' in text for one in re.findall('href="#(.*?)"', text))
    assert "2.11: Natural frequency 1 of 3 points omega_n: wrong. Within 5 %." in page_text(first)
    assert "02_finding_stiffness.ipynb, cell q2-11" in page_text(first)
    assert "05_control_prelab.ipynb, cell q3-1-explanation" in page_text(first)  # words have a cell of their own


def test_a_question_that_the_catalogue_does_not_have_is_shown_all_the_same():
    assert "Question 2.11: " in page(OMEGA, course=replace(COURSE, catalogue=Catalogue([])))


@pytest.mark.parametrize(
    ("marks", "is_open"),
    [
        ((OMEGA, WHY), False),
        ((OMEGA, replace(WHY, points=0.5)), True),
        ((OMEGA, replace(WHY, status=Status.FOR_A_PERSON, points=0.0)), True),
        ((replace(OMEGA, status=Status.FOLLOW_THROUGH),), True),
        ((replace(OMEGA, status=Status.WRONG, points=0.0), WHY), True),
        ((replace(OMEGA, status=Status.NOT_MARKED, points=0.0),), True),
    ],
)
def test_only_what_is_all_well_and_what_nobody_commented_on_is_folded_away(marks, is_open):
    assert opened(page(*marks)) == {"2.11": is_open}
    comment = CommentRecord("ada", "2.11", "Nice.", "prof", clock.now())
    assert opened(page(*marks, comments=[comment])) == {"2.11": True}


DRAWN = Mark("2.9", "figure", Status.RIGHT, 1.0, 1.0, "Well.", "1 diagram, 1 curve")


def test_the_students_own_figure_is_drawn_with_its_description():
    text = page(DRAWN, run=run({"2.9": {"figure": {"kind": "figure", "axes": [FIGURE]}}}))
    assert '<svg class="drawn"' in text and "deflection (deg)" in page_text(text)
    assert 'aria-label="Diagram of deflection (deg) against time (s)' in text
    assert "1 diagram, 1 curve" not in text


def with_axes(axes, number="2.9"):
    return {number: {"figure": {"kind": "figure", "axes": axes}}}


@pytest.mark.parametrize(
    "answers",
    [
        None,
        {},
        with_axes("none"),
        with_axes([{**FIGURE, "lines": [{"label": "", "n": 1, "x": ["<b>"], "y": [1]}]}]),
        {"2.9": {"figure": {"kind": "number", "value": 1.0}}},
        with_axes([FIGURE], "9.9"),
    ],
    ids=["nothing left", "none", "no axes", "no numbers", "of another kind", "of no question"],
)
def test_what_is_no_figure_is_not_drawn_and_stops_nothing(answers):
    text = page(DRAWN, run=run(answers))
    assert "<svg" not in text and "1 diagram, 1 curve" in text


def test_words_from_text_cells_are_rendered_in_place_of_their_source():
    drawn = io.BytesIO()
    Image.new("RGB", (4, 3), "red").save(drawn, format="PNG")
    pictures = {"attachment:a.png": b64encode(drawn.getvalue()).decode(), "attachment:broken.png": "%%"}
    written = "It **bends**, as $\\frac{1}{2}$ <b>says</b>.\n\n* much\n\n"
    written += "![drawn](attachment:a.png) ![no](attachment:broken.png)"
    words = {"2.11": {"explanation": {"text": written, "pictures": pictures}}}
    text = page(OMEGA, WHY, run=run(words=words))
    assert "Because it bends." not in text and "It <strong>bends</strong>" in text and "<li>much</li>" in text
    assert "&lt;b&gt;says" in text and "<mfrac>" in text
    assert re.findall(r'<img[^>]*src="([^"]{22})', text) == ["data:image/png;base64,"]


EVIL = "<script>alert(1)</script><img src=x onerror=y>\"'--><style>*{display:none}</style>"


@pytest.mark.parametrize(("status", "shown"), [(Status.BY_A_PERSON, True), (Status.FOR_A_PERSON, False)])
def test_the_keys_text_to_compare_with_comes_when_a_person_has_marked_the_answer(status, shown):
    key = {**COURSE.key, "2.11": {**COURSE.key["2.11"], "explanation": ForAPerson(compare="The **base** moves.")}}
    text = page(OMEGA, replace(WHY, status=status), course=replace(COURSE, key=key))
    assert ("The <strong>base</strong> moves." in text) is shown


def test_whatever_a_student_can_put_in_is_escaped():
    when = clock.now()
    mark = Mark("2.11", "explanation", Status.FOR_A_PERSON, 0, 1, EVIL, EVIL)
    figure = {**FIGURE, "title": EVIL[:200], "xlabel": EVIL[:200], "ylabel": EVIL[:200]}
    figure["lines"] = [{**FIGURE["lines"][0], "label": EVIL[:200]}]
    given = GivenMark(Mark(EVIL, EVIL, EVIL, 1.0, 2.0, EVIL, EVIL), EVIL, when)
    answers = {"2.9": {"figure": {"kind": "figure", "axes": [figure]}}}
    one = run(answers, problems=(EVIL,), notes=(EVIL,), words={"2.11": {"explanation": {"text": EVIL, "pictures": {}}}})
    comments = [CommentRecord("ada", None, EVIL, EVIL, when)]
    course = replace(COURSE, title=EVIL, settings=replace(OURS.settings, term=EVIL))
    more = {"student": EVIL, "about": (EVIL, EVIL, EVIL), "comments": comments, "lapsed": [given], "course": course}
    text = page(mark, DRAWN, run=replace(one, isolation=EVIL), **more)
    assert "<script" not in text and "<img" not in text and text.count("<style>") == 1
    assert text.count("&lt;script&gt;alert") >= 14


def test_nothing_turns_the_direction_of_the_page():
    turning = "\u202e2 of 2\u2066\x9b31m"
    mark = Mark("2.11", "explanation", Status.FOR_A_PERSON, 0.0, 1.0, turning, turning)
    text = page(mark, student=turning, problems=(turning,), notes=(turning,), isolation=turning)
    assert not set("\u202e\u2066\x9b") & set(text)
    assert text.count(r"\u202e2 of 2\u2066\x9b31m") == 8  # twice as name and problem, and wherever else it is put


def test_the_page_runs_and_loads_nothing():
    text = page(OMEGA, DRAWN, run=run({"2.9": {"figure": {"kind": "figure", "axes": [FIGURE]}}}))
    assert "default-src 'none'; style-src 'unsafe-inline'; img-src data:" in text
    assert "<script" not in text and "http://" not in text and "https://" not in text
    assert not re.search(r"\son\w+=|javascript:|url\(|@import", text)
    assert text.startswith("<!doctype html>") and '<html lang="en">' in text
    assert "prefers-color-scheme: dark" in text and "@media print" in text
