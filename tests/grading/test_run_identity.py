"""The identity of a run: a change in anything that it depends on makes another run; other changes do not."""

import os
from copy import copy
from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta, timezone

import pytest

import labcourse
from labcourse.answers.words import TextAnswer
from labcourse.grading import batch as batches
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.running import runner
from labcourse.grading.running.prepared import submission_digest
from labcourse.grading.running.supplied import Supplied
from labcourse.grading.settings import Assignment
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem

#: Settings that a run does not depend on, each with another value than the default.
NO_PART = {
    "jobs": 2,
    "times": {"ada": datetime(2026, 5, 1, tzinfo=UTC)},
    "again": ("ada",),
    "decisions": {("ada", "owner"): "ada"},
    "zone": timezone(timedelta(hours=2)),
    "platform": "none",  # what it changes are the files that are found
    "only": Assignment("Other", ("another_notebook",)),  # the files that it leaves out are no part
}
PLACE = {"scheduler"}  #: says where it is run, not what: tests/grading/test_cluster.py
#: The others, each changed alone.
LIMITS = {
    "cell": 61,
    "submission": 601.0,
    "memory": runner.RunLimits().memory + 1,
    "processes": 101,
    "folder": runner.RunLimits().folder + 1,
}
OTHERWISE = {
    **{f"limits.{name}": {"limits": runner.RunLimits(**{name: value})} for name, value in LIMITS.items()},
    "probe_seed": {"probe_seed": 5},
    "isolated": {"isolated": False},
    "every_cell": {"every_cell": True},
    "supplied": {"supplied": (Supplied("ada", "2.11", "omega_n", 19.5),)},
}


def test_every_setting_is_tested():
    assert {one.partition(".")[0] for one in OTHERWISE} | PLACE | set(NO_PART) == {one.name for one in fields(Settings)}
    assert set(LIMITS) == {one.name for one in fields(runner.RunLimits)}
    assert all(getattr(runner.RunLimits(), name) != value for name, value in LIMITS.items())


@pytest.mark.parametrize("changed", OTHERWISE.values(), ids=OTHERWISE)
def test_another_value_of_a_setting_that_counts_is_another_run(fake_class, changed):
    fake_class.hand_in("ada")
    fake_class.grade()
    fake_class.grade()
    assert fake_class.runs == ["ada"]
    fake_class.grade(**changed)
    assert fake_class.runs == ["ada", "ada"]


@pytest.mark.parametrize("name", NO_PART)
def test_another_value_of_a_setting_that_does_not_count_is_the_same_run(fake_class, name):
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


@pytest.fixture
def prepared(monkeypatch):
    """What is prepared from now on."""
    hand_ins, once = [], batches.prepare
    monkeypatch.setattr(
        batches,
        "prepare",
        lambda submission, *more, **how: hand_ins.append(submission) or once(submission, *more, **how),
    )
    return hand_ins


def test_what_is_unchanged_by_content_is_not_prepared_again(fake_class, prepared):
    file = fake_class.folder / "in" / "ada" / "data.csv"
    fake_class.hand_in("ada", "bob")
    file.write_bytes(b"1,2\n")
    fake_class.grade()
    about = file.stat()
    fake_class.grade()
    assert [one.files for one in prepared] == [{"data.csv": b"1,2\n"}, {}]
    file.write_bytes(b"1,3\n")  # of the same name, size and time
    os.utime(file, ns=(about.st_atime_ns, about.st_mtime_ns))
    fake_class.grade()
    assert [one.files for one in prepared[2:]] == [{"data.csv": b"1,3\n"}]


def test_what_came_at_another_time_is_prepared_once_more_and_not_run(fake_class, prepared):
    fake_class.hand_in("ada")
    fake_class.grade()
    for path in (fake_class.folder / "in" / "ada").iterdir():
        os.utime(path, (1e9, 1e9))
    for _again in range(2):
        fake_class.grade()
    assert (len(prepared), fake_class.runs) == (2, ["ada"])


@pytest.fixture
def taken(fake_class):
    fake_class.hand_in("ada")
    (fake_class.folder / "in" / "ada" / "data.csv").write_bytes(b"1,2\n")
    with fake_class.book() as book:
        batch = Batch(fake_class.folder / "in", fake_class.course, book)
        (submission,) = batch._waiting
        batch._receive(submission)
        batch._prepare(submission, batch._versions(submission).newest())
        yield batch, submission


def changed(submission, **values):
    other = copy(submission)
    vars(other).update(values)
    return other


def identified(batch, submission):
    batch._identify(submission)
    return submission


def other_cells(one, changes):
    """The same with other cells among those that are run."""
    notebooks = {
        name: {**notebook, "cells": [cell | changes for cell in notebook["cells"]]}
        for name, notebook in one.merged.notebooks.items()
    }
    return changed(one, merged=replace(one.merged, notebooks=notebooks))


def elsewhere(one):
    (notebook,) = one.merged.notebooks.values()
    return changed(one, merged=replace(one.merged, notebooks={"b.ipynb": notebook}))


#: What is run, changed in one thing.
RUN = {
    "the bench": lambda one: changed(one, bench_of="bob"),
    "a cell's source": lambda one: other_cells(one, {"source": "1"}),
    "a cell's id": lambda one: other_cells(one, {"id": "x"}),
    "a notebook's name": elsewhere,
    "a file's name": lambda one: changed(one, files={"data.txt": b"1,2\n"}),
    "a file's content": lambda one: changed(one, files={"data.csv": b"1,3\n"}),
    "the bundle": lambda one: changed(one, bundle=replace(one.bundle, digest="1" * 64)),
}


@pytest.mark.parametrize("change", RUN.values(), ids=RUN)
def test_another_content_is_another_run(taken, change):
    batch, one = taken
    key = identified(batch, one).key
    assert identified(batch, one).key == key
    assert identified(batch, change(one)).key != key
    bobs = identified(batch, changed(one, student="bob"))  # on the same bench
    assert bobs.key != key and bobs.ran == identified(batch, one).ran


WORDS = TextAnswer("A pole lies on the axis.")
#: Of a submission, what is not run but marked or shown → another value.
NOT_RUN = {
    "words": {("2.11", "explanation"): WORDS},
    "claim": {"2.11": {"omega_n": "q1"}},
    "notebooks": {},
    "pdfs": {"modeling_report.pdf": b"%PDF-1.7"},
    "problems": [Problem.of(Code.CELL_TOO_LONG, "a.ipynb", cell=3, why=Problem.of(Code.GONE))],
    "notes": [Problem.of(Code.NOT_HANDED_IN, "a.ipynb")],
    "waiting": {"a.ipynb": ["bob"]},
}
#: What is neither: what the run is prepared from, what counts of it elsewhere, and what later steps fill.
OTHERWISE_THERE = {
    *("pieces", "partners", "unconfirmed", "items", "names", "has_notebooks", "faults", "unread"),
    *("unreadable", "doubts", "answers_at_home", "course", "supplied", "python", "untouched", "prepared_from"),
    *("key", "ran", "digest", "probe_seed", "answers", "cell_reports", "evidence", "ended", "missing", "asked"),
    *("policy", "documents", "waits", "marks", "before", "graded", "is_new", "has_run"),
}


def test_every_field_of_a_submission_is_tested():
    run = {"student", "merged", "files", "bundle", "bench_of"}
    assert {one.name for one in fields(Submission)} == {*run, *NOT_RUN, *OTHERWISE_THERE}


@pytest.mark.parametrize(("name", "value"), NOT_RUN.items(), ids=NOT_RUN)
def test_what_is_only_marked_or_shown_is_the_same_run_and_another_submission(taken, name, value):
    batch, one = taken
    before = identified(batch, one)
    after = identified(batch, changed(one, **{name: value}))
    assert after.ran == before.ran and after.probe_seed == before.probe_seed
    assert after.digest != before.digest


def test_words_differ_by_their_text_and_their_pictures(taken):
    _batch, one = taken
    pictured = [replace(WORDS, pictures={name: data}) for name, data in (("a", b"1"), ("a", b"2"), ("b", b"1"))]
    written = [WORDS, replace(WORDS, text="A pole lies left of the axis."), *pictured]
    submissions = {submission_digest(changed(one, words={("2.11", "explanation"): words}), []) for words in written}
    claims = [{"2.11": {"omega_n": cell}} for cell in ("q1", "q2")]
    claimed = {submission_digest(changed(one, claim=claim), []) for claim in claims}
    assert (len(submissions), len(claimed)) == (5, 2)


@pytest.mark.parametrize("jobs", [1, 2])
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
            failed = Problem.of(Code.GRADING_FAILED, error=f"OSError: the disk of {failing} is full")
            assert book.current(failing).run.problems == (failed,)
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
            return {one.graded.run.student: (one.has_run, one.is_new) for one in done}

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

    def failing(submission, *given, **more):
        if submission.student in ("ada", "bob"):
            raise MemoryError(f"no room for {submission.student}")
        return honest(submission, *given, **more)

    monkeypatch.setattr(place, where, failing)
    assert fake_class.grade() == {"ada": 0, "bob": 0, "cleo": 2}
    with fake_class.book() as book:
        problems = {one: book.current(one).run.problems for one in ("ada", "bob", "cleo")}
    failed = {
        one: (Problem.of(Code.GRADING_FAILED, error=f"MemoryError: no room for {one}"),) for one in ("ada", "bob")
    }
    assert problems == {**failed, "cleo": ()}
