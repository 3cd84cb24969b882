"""A course's rubric: what is read of it, and every fault told with its place."""

import re

import pytest
from checkout import ROOT
from made_courses import OURS

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem, number, prose
from labcourse.errors import GradingError
from labcourse.grading.scoring import rubric

CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01", "Stiffness", (), (number("k", "N/m", None, "", "?"), prose("why", "", "Why?"))),
        Question("1.2", "1", "01", "Losses", (), (prose("loss", "", "Which?"),)),
    ],
    report_items=[
        ReportItem("Report", "I", "Aim", "The aim.", ("B",), part="aim"),
        ReportItem("Report", "F", "Order", "All of it.", ("G",), judged="order"),
    ],
    reports={"Report": ("2", "02", "The report")},
)


def entry(place: str, **changes: str) -> str:
    """A table of a rubric; what is changed to "" is left out."""
    lines = {
        "look_for": '"The cause."',
        "4": '"Cause and size."',
        "3": '"Cause."',
        "2": '"Part of it."',
        "1": '"None."',
        "remarks": '["Say why."]',
    } | changes
    return "\n".join([f"[{place}]", *(f"{name} = {text}" for name, text in lines.items() if text), ""])


PLACES = ('"1.1".why', '"1.2".loss', '"Report".aim', '"Report, as a whole".order')
WHOLE = "\n".join(map(entry, PLACES))


@pytest.fixture
def read(tmp_path):
    def items(text):
        (tmp_path / "rubric.toml").write_text(text, encoding="utf-8")
        return rubric.read(tmp_path, CATALOGUE)

    return items


def test_all_parts_that_a_person_marks_are_read_in_the_catalogues_order(read):
    backwards = "\n".join(map(entry, reversed(PLACES)))
    items = read(backwards)
    assert list(items) == [("1.1", "why"), ("1.2", "loss"), ("Report", "aim"), ("Report, as a whole", "order")]
    loss = items["1.2", "loss"]
    assert (loss.look_for, loss.remarks) == ("The cause.", ("Say why.",))
    assert loss.levels == {4: "Cause and size.", 3: "Cause.", 2: "Part of it.", 1: "None."}


def test_a_text_may_be_written_over_several_lines_and_remarks_may_be_left_out(read):
    changed = entry(PLACES[0], look_for='"""\n  Cause\n  and size."""', remarks="")
    one = read(WHOLE.replace(entry(PLACES[0]), changed))["1.1", "why"]
    assert (one.look_for, one.remarks) == ("Cause and size.", ())


#: A rubric with a fault → what its message names.
FAULTS = [
    (WHOLE + entry('"1.3".why'), '"1.3".why'),
    (WHOLE + entry('"1.1".k'), '"1.1".k'),  # which a person does not mark
    (WHOLE.replace(entry(PLACES[3]), ""), '"Report, as a whole".order'),
    (WHOLE.replace('2 = "Part of it."\n', "", 1), '"1.1".why]: 2'),
    (WHOLE.replace("3 =", "5 =", 1), '"1.1".why]: 5'),
    (WHOLE.replace('"None."', '"  "', 1), '"1.1".why]: 1'),
    (WHOLE.replace('"None."', f'"{501 * "a"}"', 1), '"1.1".why]: 1'),
    (WHOLE.replace('"None."', r'"\u202e"', 1), '"1.1".why]: 1'),
    (WHOLE.replace('["Say why."]', '["Say why.", 3]', 1), '"1.1".why]: remarks.1'),
    (WHOLE.replace('"Cause."', '"None."', 1), '"1.1".why]: two of its levels'),
    ('"1.1" = 3\n' + WHOLE.replace(entry(PLACES[0]), ""), '"1.1".why'),
    (WHOLE.replace(entry(PLACES[0]), '["1.1"]\nwhy = "Because."\n'), '"1.1".why'),
]


@pytest.mark.parametrize(("text", "place"), FAULTS)
def test_each_fault_is_told_with_its_place(read, text, place):
    with pytest.raises(GradingError, match=re.escape(f"[{place}")):
        read(text)


def test_all_faults_are_told_at_once(read):
    text = entry('"1.3".why') + entry(PLACES[0], **{"4": "", "1": "7"}) + entry(PLACES[1])
    with pytest.raises(GradingError) as raised:
        read(text)
    told = str(raised.value).splitlines()[1:]
    places = ("1.3", "4", "1", "aim", "order")
    assert [place in line for place, line in zip(places, told, strict=True)] == [True] * 5


@pytest.mark.parametrize("content", [b"\xff\xfe", b"["])
def test_a_file_that_cannot_be_read_is_told(tmp_path, content):
    (tmp_path / "rubric.toml").write_bytes(content)
    with pytest.raises(GradingError, match=r"rubric\.toml"):
        rubric.read(tmp_path, CATALOGUE)


@pytest.fixture(scope="module")
def ours():
    return rubric.read(ROOT / "solutions", OURS.catalogue)


def test_a_course_may_have_no_rubric(tmp_path):
    assert rubric.read(tmp_path, OURS.catalogue) == {}


def test_our_remarks_and_levels_give_no_number_away(ours):
    digits = {
        where: [text for text in (*item.remarks, *item.levels.values()) if re.search(r"\d", text)]
        for where, item in ours.items()
    }
    # The one equation is that of the question.
    assert {where: texts for where, texts in digits.items() if texts} == {
        ("3.2", "strategy"): [ours["3.2", "strategy"].levels[4]]
    }
    assert "det(sI - A) = 0" in ours["3.2", "strategy"].levels[4]
