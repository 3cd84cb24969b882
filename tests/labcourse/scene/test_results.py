"""A results table of any course, as an explorer."""

import csv
import io

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError
from labcourse.scene.results import results_table
from labcourse.session import Session

SPEED = Part("speed", "number", 1, "Speed of the cart", unit="m/s")
MASS = Part("mass", "number", 1, "Mass of the cart", unit="kg")


@pytest.fixture
def session(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = Question("Table 1", "1", "01_cart", "The cart", (), (SPEED, MASS))
    return Session("ada", tmp_path, Catalogue([], tables=[table]), {}, seed=1)


def test_a_table_of_another_course_follows_its_answers_and_is_saved(session, tmp_path):
    explorer = results_table(session, "Table 1")
    assert "2 of 2" in explorer.scene["readouts"][0]["title"]
    session.record("Table 1", speed=1.5)
    explorer.receive({"kind": "press", "name": "csv"})
    assert "1 of 2" in explorer.scene["readouts"][0]["title"]
    saved = (tmp_path / "table_1.csv").read_text(encoding="utf-8-sig")
    assert list(csv.reader(io.StringIO(saved)))[1:] == [
        ["Speed of the cart", "speed", "1.5", "m/s"],
        ["Mass of the cart", "mass", "", "kg"],
    ]


def test_a_table_that_there_is_not_is_refused(session):
    with pytest.raises(AnswerError, match=r"'Table 2'.*Table 1"):
        results_table(session, "Table 2")
