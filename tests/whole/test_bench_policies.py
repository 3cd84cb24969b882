"""The whole course on every sort of bench that its settings may give: the solutions are right on each."""

from dataclasses import replace

import pytest
from made_courses import OURS

from labcourse.benches import BenchPolicy
from labcourse.grading import course_check
from labcourse.grading.marking import marking
from labcourse.grading.marks import Status
from labcourse.grading.running import bundle
from labcourse.grading.submission import Submission

SUBMISSION = Submission(student=course_check.SOLUTIONS_STUDENT, probe_seed=20)

pytestmark = pytest.mark.scheduled  # at each landing, test_left_out.py has a class with a bench for all
POLICIES = [BenchPolicy("same", seed=7), *(BenchPolicy("preset", preset=name) for name in OURS.presets)]


@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.preset or policy.which)
def test_the_solutions_get_all_points_on_the_bench_that_everybody_has(sandbox, policy):
    course = replace(OURS, settings=replace(OURS.settings, bench=policy))
    claims, _missing = course_check.answers_of_solutions(course, bundle.build(course))
    assert claims.problems == []
    assert claims.bench.get("seed") == (policy.seed or None)
    assert claims.bench.get("preset", "") == policy.preset
    marks = marking.mark(course, claims, course.true_bench(course_check.SOLUTIONS_STUDENT), SUBMISSION)
    lost = [
        (mark.question, mark.part, mark.reason)
        for mark in marks
        if mark.status not in (Status.RIGHT, Status.FOR_A_PERSON)
    ]
    assert lost == []
    own = marking.mark(course, claims, OURS.true_bench(course_check.SOLUTIONS_STUDENT), SUBMISSION)
    assert sum(mark.points for mark in own) < sum(mark.points for mark in marks)  # it is another bench than their own
