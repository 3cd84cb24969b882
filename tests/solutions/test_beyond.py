"""Notebook 11: right answers in several ways have full marks, slips cost their own points, and others' numbers none."""

import pytest
from beyond_answers import Student

from labcourse.answers import forms
from labcourse.grading.verdicts import Case, Status
from rotflex.course.questions import BEYOND, CATALOGUE
from solutions.key import KEY
from solutions.true_bench import TrueBench

STUDENTS = ("ada", "bob", "s18")  # emulation is lost at 30 ms, and at 50
BENCHES = {name: TrueBench(name) for name in (*STUDENTS, "s7")}
OFF = dict(zip(STUDENTS, (1.02, 0.98, 1.0), strict=True))  # their stiffness is as a sweep shows it
WORKED = {name: Student(name, BENCHES[name], OFF[name] * BENCHES[name].K_s) for name in STUDENTS}
MARKED = [(q.number, p.name) for q in BEYOND for p in q.parts if p.marked == "auto"]
ADA = WORKED["ada"]


def stored(where, value):
    part = CATALOGUE.find(where[0]).part(where[1])
    return forms.decode(part, forms.encode(part, value, 7).content)


def verdict(name, where, value, own, virtual=True):
    known = {at: stored(at, one) for at, one in own.items()}
    case = Case(BENCHES[name], lambda question, part: known[question, part], 7, virtual)
    return KEY[where[0]][where[1]].verdict(CATALOGUE.find(where[0]).part(where[1]), stored(where, value), case)


def everything(student):
    return {**student.before, **student.answers}


@pytest.mark.parametrize("name", STUDENTS)
def test_right_answers_have_full_marks_also_without_any_others(name):
    student = WORKED[name]
    assert set(student.answers) == set(MARKED)
    found = {where: verdict(name, where, value, everything(student)) for where, value in student.answers.items()}
    assert {where: one.reason for where, one in found.items() if one.status is not Status.RIGHT} == {}
