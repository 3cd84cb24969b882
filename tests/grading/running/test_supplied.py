"""Values that an instructor supplies: what is understood, what counts of several, and where each is bound."""

import re

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, choice, matrix, number, poles, prose
from labcourse.errors import GradingError
from labcourse.grading.running import supplied
from labcourse.grading.running.supplied import Supplied

PARTS = (
    number("speed", "rad/s", None, "", ""),
    choice("way", ("up", "down"), "", ""),
    matrix("A", (2, 2), "", ""),
    poles("p", 2, "", ""),
    prose("why", "", ""),
)
CATALOGUE = Catalogue(
    [
        Question("1.2", "1", "a", "", (), PARTS),
        Question("1.3", "1", "b", "", (), (number("mass", "kg", None, "", ""), number("time", "s", None, "", ""))),
    ]
)


@pytest.mark.parametrize(
    ("text", "part", "value", "source"),
    [
        ("ada:1.2.speed=19.5", "speed", 19.5, "19.5"),
        (" Ada : 1.2.speed = -2e3 ", "speed", -2000.0, "-2000.0"),
        ("ada:1.2.way=up", "way", "up", "'up'"),
        ("ada:1.2.way='down'", "way", "down", "'down'"),
        ("ada:1.2.A=[[1, 2], [3, 4]]", "A", [[1, 2], [3, 4]], "__import__('numpy').array([[1, 2], [3, 4]])"),
        ('ada:1.2.p=["-1 + 2j", "-1-2j"]', "p", ["-1 + 2j", "-1-2j"], "__import__('numpy').array([(-1+2j), (-1-2j)])"),
        ("ada:1.2.speed=", "speed", None, "None"),
    ],
)
def test_what_is_supplied_is_understood(text, part, value, source):
    found = supplied.read(text, CATALOGUE)
    assert (found.student.casefold(), found.question, found.part) == ("ada", "1.2", part)
    assert (found.value, found.source, found.name) == (value, source, f"1.2.{part}")
    compile(source, "source", "eval")


@pytest.mark.parametrize(
    "text",
    [
        *("1.2.speed=19.5", "ada:1.2.speed", "ada:speed=1", ":1.2.speed=1", "ada:9.9.speed=1", "ada:1.2.mass=1"),
        *("ada:1.2.why=so", "ada:1.2.speed=fast", "ada:1.2.speed=[1]", "ada:1.2.way=left", "ada:1.2.A=[[1, 2]]"),
    ],
)
def test_what_cannot_be_supplied_is_refused_by_its_own_words(text):
    with pytest.raises(GradingError, match=re.escape(text)):
        supplied.read(text, CATALOGUE)


def values(found):
    return {one.name: one.value for one in found}


def test_what_is_supplied_now_comes_before_what_was_and_takes_back_and_is_ones_own():
    now = [supplied.read(text, CATALOGUE) for text in ("ADA:1.2.speed=2", "ada:1.3.mass=", "bob:1.3.time=9")]
    earlier = {"1.2.speed": 1.0, "1.3.mass": 3.0, "1.2.way": "up"}
    assert values(supplied.values_for("ada", earlier, now, CATALOGUE)) == {"1.2.speed": 2.0, "1.2.way": "up"}
    assert values(supplied.values_for("bob", {}, now, CATALOGUE)) == {"1.3.time": 9.0}
    assert values(supplied.values_for("eve", {}, now, CATALOGUE)) == {}


@pytest.mark.parametrize("gone", ["9.9.speed", "1.2.gone", "1.2.why", "1.2.speed"])
def test_of_several_what_the_course_no_longer_takes_is_left_out_alone(gone):
    value = "fast" if gone == "1.2.speed" else 1.0
    found = supplied.values_for("ada", {gone: value, "1.3.mass": 3.0, "1.3.time": 4.0}, [], CATALOGUE)
    assert values(found) == {"1.3.mass": 3.0, "1.3.time": 4.0}


def locked(name, source):
    return {"id": name, "cell_type": "code", "source": source, "metadata": {}}


PRISTINE = {
    "a.ipynb": {"cells": [locked("a-1", 'lab.answer("1.2", speed=v, way=which(v))'), locked("a-2", "pass")]},
    "b.ipynb": {"cells": [locked("b-1", 'lab.answer("1.3", mass=m)'), locked("b-2", 'lab.answer("1.3", **rest)')]},
}


def of(question, part, value=1):
    return Supplied("ada", question, part, value)


def test_each_is_bound_and_recorded_before_the_cell_that_records_it_several_in_order():
    given = [of("1.2", "way", "up"), of("1.2", "speed"), of("1.3", "time"), of("1.3", "mass", 2.5)]
    assert supplied.code_to_insert(PRISTINE, given) == {
        "a.ipynb": {"a-1": "lab.answer('1.2', way='up')\nv = 1\nlab.answer('1.2', speed=1)"},
        "b.ipynb": {"b-2": "lab.answer('1.3', time=1)", "b-1": "m = 2.5\nlab.answer('1.3', mass=2.5)"},
    }


def test_what_no_cell_records_cannot_be_supplied():
    with pytest.raises(GradingError, match=r"1\.2\.A "):
        supplied.code_to_insert(PRISTINE, [of("1.2", "A")])
