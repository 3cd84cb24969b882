"""What a run is known by: each thing that it depends on, changed alone, is another run; anything else is none."""

from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta, timezone

import pytest

import labcourse
from labcourse.answers.words import Words
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.running import runner
from labcourse.grading.running.intake import Submission
from labcourse.grading.running.prepared import Prepared
from labcourse.grading.running.supplied import Supplied
from labcourse.run.reasons import Claim

#: Settings that are no part of what a run is known by, each with a value that differs from the usual.
NO_PART = {
    "jobs": 2,
    "scheduler": None,  # where it is run, not what: tests/grading/test_cluster.py
    "times": {"ada": datetime(2026, 5, 1, tzinfo=UTC)},
    "again": ("ada",),
    "decisions": {("ada", "owner"): "ada"},
    "zone": timezone(timedelta(hours=2)),
}
#: The others, each changed alone.
LIMITS = {
    "cell": 61,
    "submission": 601.0,
    "memory": runner.Limits().memory + 1,
    "processes": 101,
    "folder": runner.Limits().folder + 1,
}
OTHERWISE = {
    **{f"limits.{name}": {"limits": runner.Limits(**{name: value})} for name, value in LIMITS.items()},
    "probe_seed": {"probe_seed": 5},
    "isolated": {"isolated": False},
    "every_cell": {"every_cell": True},
    "supplied": {"supplied": (Supplied("ada", "2.11", "omega_n", 19.5, "19.5"),)},
}


def test_every_setting_is_known_to_have_a_part_or_none():
    assert {one.partition(".")[0] for one in OTHERWISE} | set(NO_PART) == {one.name for one in fields(Settings)}
    assert set(LIMITS) == {one.name for one in fields(runner.Limits)}
    assert all(getattr(runner.Limits(), name) != value for name, value in LIMITS.items())


@pytest.mark.parametrize("changed", OTHERWISE.values(), ids=OTHERWISE)
def test_each_setting_that_a_run_depends_on_is_another_run_when_it_alone_changes(fake_class, changed):
    fake_class.hand_in("ada")
    fake_class.grade()
    fake_class.grade()
    assert fake_class.runs == ["ada"]
    fake_class.grade(**changed)
    assert fake_class.runs == ["ada", "ada"]


@pytest.mark.parametrize("name", NO_PART)
def test_a_setting_that_a_run_does_not_depend_on_is_none(fake_class, name):
    fake_class.hand_in("ada")
    fake_class.grade()
    fake_class.grade(**{name: NO_PART[name]})
    assert fake_class.runs == ["ada"]


def test_another_version_of_the_package_is_another_run(fake_class, monkeypatch):
    fake_class.hand_in("ada")
    fake_class.grade()
    monkeypatch.setattr(labcourse, "__version__", f"{labcourse.__version__}.1")
    fake_class.grade()
    assert fake_class.runs == ["ada", "ada"]
    with fake_class.book() as book:
        assert book.current("ada").run.software == f"labcourse {labcourse.__version__}"


@pytest.mark.parametrize("content", [b"1,2\n", b"1,3\n", None])
def test_a_students_own_file_is_part_of_what_is_run(fake_class, content):
    fake_class.hand_in("ada")
    data = fake_class.folder / "in" / "ada" / "data.csv"
    data.write_bytes(b"1,2\n")
    fake_class.grade()
    if content is None:
        data.rename(data.with_name("other.csv"))
    else:
        data.write_bytes(content)
    fake_class.grade()
    assert fake_class.runs == ["ada"] * (1 if content == b"1,2\n" else 2)


@pytest.fixture
def taken(fake_class):
    fake_class.hand_in("ada")
    (fake_class.folder / "in" / "ada" / "data.csv").write_bytes(b"1,2\n")
    with fake_class.book() as book:
        batch = Batch(fake_class.folder / "in", fake_class.course, book)
        (submission,) = batch._submissions
        yield batch, batch._taken_in(submission)


def other_cells(one, changes):
    """The same with other cells among those that are run."""
    notebooks = {
        name: {**notebook, "cells": [cell | changes for cell in notebook["cells"]]}
        for name, notebook in one.prepared.merged.notebooks.items()
    }
    return prepared(one, merged=replace(one.prepared.merged, notebooks=notebooks))


def prepared(one, **changes):
    return replace(one, prepared=replace(one.prepared, **changes))


def submitted(one, **changes):
    return replace(one, submission=replace(one.submission, **changes))


def elsewhere(one):
    (notebook,) = one.prepared.merged.notebooks.values()
    return prepared(one, merged=replace(one.prepared.merged, notebooks={"b.ipynb": notebook}))


#: What is run, changed in one thing.
RUN = {
    "the bench": lambda one: submitted(one, bench_of="bob"),
    "the student": lambda one: submitted(one, student="bob", bench_of="ada"),
    "a cell's source": lambda one: other_cells(one, {"source": "1"}),
    "a cell's id": lambda one: other_cells(one, {"id": "x"}),
    "a notebook's name": elsewhere,
    "a file's name": lambda one: prepared(one, files={"data.txt": b"1,2\n"}),
    "a file's content": lambda one: prepared(one, files={"data.csv": b"1,3\n"}),
    "the bundle": lambda one: replace(one, bundle=replace(one.bundle, digest="1" * 64)),
}


@pytest.mark.parametrize("change", RUN.values(), ids=RUN)
def test_each_thing_that_is_run_is_another_run_when_it_alone_changes(taken, change):
    batch, one = taken
    key = batch._identity(one).key
    assert batch._identity(one).key == key
    assert batch._identity(change(one)).key != key


WORDS = Words("A pole lies on the axis.")
#: What is not run but marked, or told: field of what was prepared → another value.
MARKED_AND_TOLD = {
    "words": {("2.11", "explanation"): WORDS},
    "claim": Claim({"2.11": {"omega_n": "q1"}}, True),
    "handed_in": (),
    "reports": {"modeling_report.pdf": b"%PDF-1.7"},
    "problems": ("a problem",),
    "notes": ("a note",),
}


def test_every_part_of_what_was_prepared_is_looked_at():
    assert {one.name for one in fields(Prepared)} == {"merged", "files", *MARKED_AND_TOLD}


@pytest.mark.parametrize(("name", "value"), MARKED_AND_TOLD.items(), ids=MARKED_AND_TOLD)
def test_what_is_only_marked_or_told_is_the_same_run_and_another_submission(taken, name, value):
    batch, one = taken
    before = batch._identity(one)
    after = batch._identity(prepared(one, **{name: value}))
    assert after.key == before.key and after.probe_seed == before.probe_seed
    assert after.submission != before.submission


@pytest.mark.parametrize("name", ["problems", "notes"])
def test_what_is_told_of_a_submission_is_another_submission(taken, name):
    batch, one = taken
    before, after = batch._identity(one), batch._identity(replace(one, **{name: (*getattr(one, name), "told")}))
    assert after.key == before.key and after.submission != before.submission


def test_words_differ_by_their_text_and_their_pictures(taken):
    batch, one = taken
    pictured = [replace(WORDS, pictures={name: data}) for name, data in (("a", b"1"), ("a", b"2"), ("b", b"1"))]
    written = [WORDS, replace(WORDS, text="A pole lies left of the axis."), *pictured]
    submissions = {
        batch._identity(prepared(one, words={("2.11", "explanation"): words})).submission for words in written
    }
    claims = [
        Claim({"2.11": {"omega_n": "q1"}}, True),
        Claim({"2.11": {"omega_n": "q2"}}, True),
        Claim({"2.11": {"omega_n": "q1"}}, False),
    ]
    claimed = {batch._identity(prepared(one, claim=claim)).submission for claim in claims}
    assert (len(submissions), len(claimed)) == (5, 3)


def test_whose_bench_it_is_run_on_is_ones_own_unless_another_is_named(taken):
    batch, one = taken
    own = submitted(one, bench_of="ada")
    none = submitted(one, bench_of="")
    assert isinstance(one.submission, Submission)
    assert batch._identity(own).key == batch._identity(none).key


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_several_failing_submissions_do_not_end_a_batch(fake_class, jobs):
    students = ["ada", "bob", "cleo", "dan", "eve"]
    fake_class.hand_in(*students)
    for failing in ("ada", "bob", "dan"):
        fake_class.leaves[failing] = OSError(f"the disk of {failing} is full")
    points = {"ada": 0, "bob": 0, "cleo": 2, "dan": 0, "eve": 2}
    assert fake_class.grade(jobs=jobs) == points
    with fake_class.book() as book:
        assert sorted(one.run.student for one in book.all_current()) == students
        for failing in ("ada", "bob", "dan"):
            (problem,) = book.current(failing).run.problems
            assert f"the disk of {failing} is full" in problem and "not the student's fault" in problem
    fake_class.leaves.clear()
    fake_class.runs.clear()
    assert fake_class.grade(jobs=jobs) == dict.fromkeys(students, 2)
    assert sorted(fake_class.runs) == ["ada", "bob", "dan"]  # who failed is tried again, and nobody else


def test_each_step_says_whether_it_was_run_and_whether_its_marks_are_new(fake_class):
    fake_class.hand_in("ada", "bob")
    fake_class.leaves["bob"] = OSError("the disk is full")

    def steps():
        with fake_class.book() as book:
            done = Batch(fake_class.folder / "in", fake_class.course, book).grade()
            return {one.graded.run.student: (one.ran, one.new) for one in done}

    assert steps() == {"ada": (True, True), "bob": (True, True)}
    assert steps() == {"ada": (False, False), "bob": (True, True)}
    fake_class.key(2.0)
    assert steps() == {"ada": (False, True), "bob": (True, True)}
    with fake_class.book() as book:
        assert {one.reason for one in book.audit("bob")} == {"run"}
        assert {one.reason for one in book.audit("ada")} == {"run", "marked again"}


@pytest.mark.parametrize("where", ["read", "prepare"])
def test_several_that_cannot_be_taken_in_do_not_end_a_batch(fake_class, monkeypatch, where):
    from labcourse.grading import batch

    fake_class.hand_in("ada", "bob", "cleo")
    place = batch.intake if where == "read" else batch
    honest = getattr(place, where)

    def failing(*given):
        student = given[0].student if where == "read" else given[3]
        if student in ("ada", "bob"):
            raise MemoryError(f"no room for {student}")
        return honest(*given)

    monkeypatch.setattr(place, where, failing)
    assert fake_class.grade() == {"ada": 0, "bob": 0, "cleo": 2}
    with fake_class.book() as book:
        assert [len(book.current(one).run.problems) for one in ("ada", "bob", "cleo")] == [1, 1, 0]
