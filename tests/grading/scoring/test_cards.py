"""What stands beside an answer: its figures and pictures, the student's own numbers, what the machine found."""

import base64
import io
import json

from gradebooks import graded, mark, prose, record
from made_courses import OURS
from PIL import Image
from scoring_class import COMPARED, RUBRIC, WORDS, desk

from labcourse.grading.marks import Mark
from labcourse.grading.scoring.cards import alike, card, opened

REPORT = "Modeling report"
ANALYSIS = (REPORT, "stiffness_analysis")  # about 2.11 and 2.12
WHOLE = (f"{REPORT}, as a whole", "organisation")


def text(where, given="Well said.", status="for a person"):
    return Mark(*where, status, 0.0, 1.0, "A person will read this.", given)


def number(where, given, status="right", reason="Well."):
    return Mark(*where, status, 1.0, 1.0, reason, given)


def png(colour):
    content = io.BytesIO()
    Image.new("RGB", (4, 4), colour).save(content, "PNG")
    return base64.b64encode(content.getvalue()).decode()


#: As a kernel leaves it.
FIGURE = {
    "title": "",
    "xlabel": "f (Hz)",
    "ylabel": "|A|",
    "lines": [{"label": "measured", "n": 3, "x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 0.0]}],
}


ANSWERS = json.dumps(
    {
        **{"format": 2, "student": "ada", "bench": {}, "software": "rotflex 0", "probe_seed": 7},
        "answers": {"2.10": {"figure": {"kind": "figure", "axes": [FIGURE]}}},
    }
).encode()


def shown(book, where, *marks, **run):
    record(book, graded("ada", *marks, **run))
    made = desk(book)
    return card(made, made.next("Ann", where))


def test_beside_a_text_stand_the_marks_of_its_question_with_what_the_machine_found(book):
    other = number(("2.12", "K_s"), "1.31 N·m/rad", "wrong", "Twice too much.")
    (answer,) = shown(book, WORDS, mark(status="wrong", reason="A factor of 2π is missing."), prose(), other)["answers"]
    assert [list(fact.values()) for fact in answer["facts"]] == [
        ["omega_n", "19.9 rad/s", "wrong", "A factor of 2π is missing."]
    ]


def test_the_levels_are_the_rubrics_where_it_has_the_part_and_what_they_are_worth(book):
    found = shown(book, WORDS, mark(), prose())
    assert found["levels"] == [
        *((level, level / 4, RUBRIC[WORDS].levels[level]) for level in (4, 3, 2, 1)),
        (0, 0.0, ""),
    ]
    found = shown(book, COMPARED, text(COMPARED))
    assert [text for _level, _worth, text in found["levels"]] == [""] * 5 and found["remarks"] == {}


def test_beside_a_reports_text_stands_what_it_is_about(book):
    marks = [mark(), prose(given="Of 2.11."), number(("2.12", "K_s"), "1.31 N·m/rad"), number(("2.14", "A"), "[[0]]")]
    found = shown(book, ANALYSIS, *marks, text(ANALYSIS, "The report says so."))
    assert {one["name"] for one in found["answers"][0]["facts"]} == {"2.11 omega_n", "2.11 explanation", "2.12 K_s"}
    words = next(one for one in found["answers"][0]["facts"] if one["name"] == "2.11 explanation")
    assert (words["given"], words["status"]) == ("Of 2.11.", "")  # another's mark is not to sway


def test_pictures_of_a_text_are_shown_and_of_a_report_as_a_whole_those_of_its_texts(book):
    written = {REPORT: {"stiffness_analysis": {"text": "See ![the peak](attachment:a.png)"}}}
    written[REPORT]["stiffness_analysis"]["pictures"] = {"attachment:a.png": png("red")}
    marks = [text(ANALYSIS, "See ![the peak](attachment:a.png)"), text(WHOLE, "All. ![the peak](attachment:a.png)")]
    for where in (ANALYSIS, WHOLE):
        found = shown(book, where, *marks, words=written)
        assert f'"data:image/png;base64,{png("red")}" alt="the peak"' in found["answers"][0]["text"]


def test_the_students_figure_is_drawn_beside_what_it_belongs_to(book):
    found = shown(book, WHOLE, text(WHOLE), text(ANALYSIS), answers=ANSWERS)
    ((name, drawn),) = found["answers"][0]["figures"]
    assert name == "2.10 figure"
    assert '<path class="curve' in drawn
    assert shown(book, ANALYSIS, text(WHOLE), text(ANALYSIS), answers=ANSWERS)["answers"][0]["figures"] == []


def test_an_answer_that_is_no_text_is_shown_as_it_was_given_and_a_figure_is_drawn(book):
    figure = Mark("2.10", "figure", "wrong", 0.0, 1.0, "No peak.", "a figure")
    record(book, graded("ada", mark("wrong", 0.0, given="2*K*s*<3>"), figure, answers=ANSWERS))
    made = desk(book)
    found = {}
    for answer in (*book.scores.any_answers(("2.11", "omega_n")), *book.scores.any_answers(("2.10", "figure"))):
        found[answer.question] = opened(made, OURS, answer)["shown"]
        (listed,) = alike(made, [answer])
        assert listed["text"] == found[answer.question]["text"]
    assert found["2.11"]["text"] == '<p class="value">2*K*s*&lt;3&gt;</p>'
    assert listed["figure"] == dict(found["2.10"]["figures"])["2.10 figure"]
    assert '<path class="curve' in listed["figure"]
