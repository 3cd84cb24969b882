"""Right answers in many ways (``right_ways.py``): each has its full marks on two benches, and changes no other.

And ``lab.reflect()`` asks nothing of any. What is the same value in another form is recorded as the same, and so marked
as the same. Ways of answering different questions otherwise share a student. At a landing, the largest of these groups
and every twelfth reading that carries on are tried; in `make test-all`, all are.
"""

from functools import cache

import numpy as np
import pytest
from made_courses import OURS
from packs import assert_faultless, named, packed
from reflections import NOTHING, asked_of, said_by
from right_ways import WAYS, rewritten, worked
from working_through import FULL

from labcourse.answers import forms
from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from labcourse.grading.submission import Submission
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench

pytestmark = pytest.mark.usefixtures("runs_made_once")

STUDENTS = ("ada", "bob")
FORMS = [way for way in WAYS if way.group in ("numbers", "matrices", "polynomials", "poles", "choices")]
WRITTEN = [way for way in WAYS if way.written and way not in FORMS]


def by_turns(cases, named=str, **marks):
    """Each case, on one of the students, as parameters."""
    turns = [(case, STUDENTS[number % len(STUDENTS)]) for number, case in enumerate(cases)]
    return [pytest.param(case, student, id=named(case), **marks) for case, student in turns]


def marked(data, student, bench):
    """The marks that a file of answers earns, by question and part."""
    seed = student_seed(student)
    return {
        (one.question, one.part): one
        for one in mark(OURS, decode(data, seed, OURS.catalogue), bench, Submission(student="ada", probe_seed=seed))
    }


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """A student's usual answers, the file of them, its marks, and the bench; worked out when first asked for."""

    @cache
    def of(student):
        own, data = worked(student, tmp_path_factory.mktemp(student))
        bench = TrueBench(student)
        return own, data, marked(data, student, bench), bench

    return of


def lost(marks):
    return {where: marks[where].reason for where, full in FULL.items() if marks[where].points < full}


@pytest.mark.parametrize("student", STUDENTS)
def test_the_usual_way_has_full_marks(usual, student):
    assert lost(usual(student)[2]) == {}
    assert said_by(asked_of(student, usual(student)[1])) == NOTHING


@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.parametrize("way", FORMS, ids=str)
def test_the_same_value_in_another_form_is_recorded_as_the_same(usual, way):
    own = usual(STUDENTS[0])[0]
    for (question, name), change in way.written.items():
        part, right = CATALOGUE.find(question).part(name), own[question, name]
        kept = [forms.encode(part, value, 7) for value in (right, change(right, own))]
        assert kept[0].hints == kept[1].hints == ()
        usual_one, other = (forms.decode(part, one.content) for one in kept)
        if part.kind == "poles":
            usual_one, other = (
                sorted(poles, key=lambda pole: (round(pole.real, 3), pole.imag)) for poles in (usual_one, other)
            )
        if part.kind == "choice":
            assert other == usual_one
        else:
            np.testing.assert_allclose(other, usual_one, rtol=1e-4, atol=1e-6)


PACKS = by_turns(packed(WRITTEN, lambda way: way.written), named)  # those of most ways come first


@pytest.mark.parametrize(
    ("ways", "student"),
    [*PACKS[:4], *(pytest.param(*pack.values, id=pack.id, marks=pytest.mark.scheduled) for pack in PACKS[4:])],
)
def test_other_ways_of_writing_have_full_marks_and_change_nothing_else(usual, tmp_path_factory, ways, student):
    own, data, before, bench = usual(student)

    def faults(tried):
        written = {where: change for way in tried for where, change in way.written.items()}
        changed, said = rewritten(student, tmp_path_factory.mktemp("written"), written, own, data)
        marks = marked(changed, student, bench)
        found = {
            "said": [line for line in said if not line.endswith("  recorded")],
            "lost": lost(marks),
            "changed": {where: marks[where].status for where in FULL if marks[where].status != before[where].status},
            "asked": [one for kind in said_by(asked_of(student, changed)) for one in kind],
        }
        return {what: what_is_wrong for what, what_is_wrong in found.items() if what_is_wrong}

    assert_faultless(ways, faults)


CARRIED = [way for way in WAYS if way.carried]
AT_A_LANDING = 12  #: of so many readings that carry on, one is tried


@pytest.mark.parametrize(
    ("way", "student"),
    [
        *by_turns(CARRIED[::AT_A_LANDING]),
        *by_turns([way for way in CARRIED if way not in CARRIED[::AT_A_LANDING]], marks=pytest.mark.scheduled),
    ],
)
def test_another_reading_has_full_marks_in_all_that_builds_on_it(usual, tmp_path, way, student):
    _own, data = worked(student, tmp_path, way)
    assert lost(marked(data, student, usual(student)[3])) == {}
    assert said_by(asked_of(student, data)) == NOTHING


def test_a_response_that_leaves_its_band_by_a_count_between_two_kept_points_is_asked_nothing(tmp_path):
    (way,) = [way for way in WAYS if str(way) == "rounding: 3.7 T to three digits"]
    assert said_by(asked_of("measure-2859", worked("measure-2859", tmp_path, way)[1])) == NOTHING
