"""Which bench each student has, as ``course.json`` says it."""

import json

import pytest

from labcourse import benches, course_file, courses
from labcourse.benches import BenchPolicy, policy_of
from labcourse.errors import ConfigurationError


def test_a_policy_comes_back_from_plain_data():
    real = BenchPolicy("real", benches=("north",))
    for policy in (BenchPolicy(), BenchPolicy("same", seed=7), BenchPolicy("preset", preset="x", draw=2), real):
        course = json.loads(json.dumps({"student": "", "draw": policy.draw, "bench": policy.as_json()}))
        assert policy_of(course) == policy
    assert policy_of({"student": "ada"}) == BenchPolicy("own")


def test_seeds_are_the_students_own_unless_everybody_has_the_same():
    assert [BenchPolicy(which, seed=7).seed_for("ada", len) for which in benches.WHICH] == [3, 7, 3, 3]


@pytest.mark.parametrize(
    ("course", "named"),
    [
        ({"bench": "own"}, "'own'"),
        ({"bench": {"which": "mine"}}, "'mine'"),
        ({"bench": {"which": ["own"]}}, "'own'"),
        ({"bench": {"which": "same", "seed": -1}}, '"seed".*-1'),
        ({"bench": {"which": "preset", "preset": 3}}, '"preset".*3'),
        ({"bench": {"which": "real", "benches": ["north", 3]}}, '"benches".*3'),
        ({"draw": "1"}, "\"draw\".*'1'"),
        ({"draw": True}, '"draw".*True'),
    ],
)
def test_what_cannot_be_understood_is_refused(course, named):
    with pytest.raises(ConfigurationError, match=named):
        policy_of(course)


def test_the_folders_own_file_counts_and_the_installed_releases_where_there_is_none(tmp_path, monkeypatch):
    package = tmp_path / "made_course"
    (package / "notebooks").mkdir(parents=True)
    (package / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(courses.COURSE_VARIABLE, package.name)
    assert course_file.bench_policy(tmp_path) == BenchPolicy()
    released = {"student": "", "bench": {"which": "same", "seed": 3}}
    (package / "notebooks" / "course.json").write_text(json.dumps(released))
    assert course_file.bench_policy(tmp_path) == BenchPolicy("same", seed=3)
    (tmp_path / "course.json").write_text('{"student": "ada"}')
    assert course_file.bench_policy(tmp_path) == BenchPolicy()
    (tmp_path / "course.json").write_text('{"student": "ada", "bench": 3}')
    with pytest.raises(ConfigurationError, match=r'course\.json.*"bench"'):
        course_file.bench_policy(tmp_path)
