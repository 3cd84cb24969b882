"""A class without some notebooks: what is asked, what is given, and what a session says of it."""

import json

import pytest

import rotflex.course.lab
from labcourse.answers.notebooks import asked_of
from labcourse.errors import AnswerError
from rotflex.course import reports
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import DRAW, student_bench, student_seed

MODELING = CATALOGUE.notebooks[1:3]
DESIGN = CATALOGUE.notebooks[3:7]
LEFT_OUT = {"stiffness": MODELING, "gain": (*MODELING, *DESIGN)}


@pytest.fixture
def begin(tmp_path):
    """A session of ada's, in a folder whose course.json names the notebooks that are left out."""

    def session(*names, **more):
        about = {"student": "ada", "draw": DRAW, "without": names, **more}
        (tmp_path / "course.json").write_text(json.dumps(about), encoding="utf-8")
        return rotflex.course.lab.start(folder=tmp_path)

    return session


def test_with_all_notebooks_all_is_asked_and_nothing_given(begin, capsys):
    lab = begin()
    assert lab.catalogue is CATALOGUE and not lab.has("2.12", "K_s")
    with pytest.raises(AnswerError, match="K_s"):
        lab.value("2.12", "K_s")
    assert lab.value("2.12", "K_s", default=None) is None
    assert "your class" not in capsys.readouterr().out


def test_the_stiffness_of_the_own_bench_is_given_with_a_word(begin, capsys):
    lab = begin(*MODELING)
    assert lab.value("2.12", "K_s") == student_bench(student_seed("ada")).parameters.K_s
    assert lab.value("2.12", "J_l", default=None) == lab.joint.J_l
    assert capsys.readouterr().out.count("is given to your class") == 2
    assert lab.has("2.12", "K_s") and lab.given("2.12", lab.value("2.12", "K_s"))


def test_what_is_left_out_is_not_asked_and_nothing_is_recorded_of_it(begin, capsys):
    lab = begin(*MODELING)
    (line,) = lab.record("2.12", J_l=1, K_s=9.0)
    assert line.startswith("2.12") and line.endswith("J_l, K_s")
    lines = lab.record("Table 2", omega_n=1.0, K_s=9.0, poles=[0, -1, -2, -3])
    assert lines[-1].endswith(": omega_n, K_s") and "recorded" in lines[0]
    assert lab.value("2.12", "K_s") != 9.0 and lab.book.get("2.12", "K_s") is None
    capsys.readouterr()
    assert lab.value("2.7", "A", default=None) is None
    assert capsys.readouterr().out.startswith("2.7  A ")
    with pytest.raises(AnswerError, match=r"2\.7  A  is not asked"):
        lab.value("2.7", "A")
    lab.progress()
    lab.summary()
    told = capsys.readouterr().out
    assert "2.13" in told and "2.12" not in told and "01_modeling_prelab" not in told
    assert "omega_n" not in str(lab.table("Table 2")) and "2.9" not in reports.outline("Modeling report", lab)
    lab.reflect()
    assert "2.11" not in capsys.readouterr().out


def test_a_cell_asks_for_no_question_that_is_not_asked(begin, capsys):
    lab = begin(*MODELING)
    capsys.readouterr()
    assert not lab.given("2.12, 2.15", None)
    assert " 2.15 " in (told := capsys.readouterr().out) and "2.12" not in told
    assert not lab.given("2.11, 2.12", None)
    assert "2.1" not in capsys.readouterr().out


def test_there_is_no_such_part_also_where_little_is_asked(begin):
    lab = begin(*MODELING)
    for question, part in (("2.99", "K"), ("2.12", "stiffness")):
        with pytest.raises(AnswerError):
            lab.record(question, **{part: 1})
        with pytest.raises(AnswerError):
            lab.value(question, part, default=None)


VALUES = {
    "2.12": {"J_l": 0.003, "K_s": 1.25},
    "2.14": {"A": [[0.0] * 4] * 3 + [[1, 2, 3, 4]], "B": [[0], [0], [1], [2]], "C": [[1, 0, 0, 0]] * 2, "D": [[0]] * 2},
    "3.8": {"K": [[1, 2, 3, 4]]},
}
SAME = {"bench": {"which": "same", "seed": 7}, "given": VALUES}


def test_values_that_course_json_brings_are_those_that_count_where_they_are_not_asked(begin):
    lab = begin(*LEFT_OUT["gain"], **SAME)
    assert lab.value("2.12", "K_s") == 1.25
    assert lab.value("3.8", "K").tolist() == [[1, 2, 3, 4]]
    assert lab.value("2.14", "A").shape == (4, 4)
    assert "3.5" not in lab.questions and lab.questions["Table 3"].names[0] == "t_s_sim"
    lab = begin(*MODELING, **SAME)
    assert lab.value("2.12", "K_s") == 1.25 and not lab.has("3.8", "K")


def test_a_check_at_home_asks_for_as_much(begin, tmp_path):
    begin(*LEFT_OUT["gain"], **SAME)
    cell = {"cell_type": "code", "source": "import rotflex.course.questions", "metadata": {}, "id": "a"}
    master = {"cells": [cell]}
    asked = asked_of({"a.ipynb": master}, tmp_path)
    assert "3.5" not in asked.everything and "3.11" in asked.everything


@pytest.mark.parametrize("names", LEFT_OUT.values(), ids=LEFT_OUT)
def test_a_row_of_a_report_rests_on_something_that_is_asked(names):
    asked = CATALOGUE.without(names)
    for item in asked.report_items:
        whole = next(one for one in CATALOGUE.report_items if (one.report, one.number) == (item.report, item.number))
        assert bool(item.shows) == bool(whole.shows)
        assert all(number in asked.everything for number, _part in item.shows)
    assert not {question.notebook for question in asked.everything.values()} & set(names)
