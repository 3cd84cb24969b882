"""A class through a batch: what is run, what is known already, what a fault costs, what is marked again."""

import json
import os
import shutil
import zipfile
from concurrent.futures import wait
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from fake_class import CELLS, InlineMarker, left, perfect

from labcourse.answers import json_values
from labcourse.errors import GradingError, IsolationError
from labcourse.grading import batch, intake
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.counting import _marked_again, regrade
from labcourse.grading.graded_run import submission_of
from labcourse.grading.settings import Assignment, Deadline, LateSettings
from labcourse.grading.submission import TIME_RECEIVED
from labcourse.problems import Code, Problem, has


@pytest.mark.parametrize("jobs", [1, 2])
def test_without_isolation_everything_stops_and_what_was_graded_stays(fake_class, monkeypatch, jobs):
    monkeypatch.setattr(batch, "wait", lambda futures, **_: wait(futures))  # with two jobs, both end together
    fake_class.hand_in("ada", "bob", "cleo")
    fake_class.leaves["bob"] = IsolationError("No sandbox.", "sandbox", "Install one.")
    with pytest.raises(IsolationError, match="Install one"):
        fake_class.grade(jobs=jobs)
    with fake_class.book() as book:
        assert [one.run.student for one in book.all_current()] == ["ada"]
    assert "cleo" not in fake_class.runs


def test_a_bench_that_answers_claim_to_come_from_is_reported_and_changes_no_mark(fake_class):
    fake_class.hand_in("ada", "bob")
    fake_class.leaves["bob"] = left(perfect("bob", 7, omega_n=1.0, bench={"uri": "quanser:q2_usb/0"}))
    assert fake_class.grade(probe_seed=7) == {"ada": 2, "bob": 0}
    with fake_class.book() as book:
        (problem,) = book.current("bob").run.problems
        assert problem.code is Code.ANSWERS_OF_ANOTHER_BENCH and "quanser:q2_usb/0" in problem.parameters["bench"]
        assert book.current("ada").run.problems == ()
        statuses = {mark.part: mark.status for mark in book.current("bob").marks}
        assert statuses["omega_n"] == "wrong"


def test_a_failed_run_replaces_a_mark_and_who_hands_in_the_earlier_version_again_has_its_marks(fake_class):
    fake_class.hand_in("ada", source="first")
    assert fake_class.grade() == {"ada": 2}
    fake_class.hand_in("ada", source="second")
    ended = (Problem.of(Code.RUN_TIMED_OUT, seconds=600),)
    fake_class.leaves["ada"] = left(None, ended)
    assert fake_class.grade() == {"ada": 0}
    with fake_class.book() as book:
        assert book.current("ada").run.problems == ended
    fake_class.hand_in("ada", source="first")
    assert fake_class.grade() == {"ada": 2}
    assert fake_class.runs == ["ada", "ada"]


def test_a_zip_that_cannot_be_read_concerns_the_assignment_that_it_was_handed_in_for(fake_class):
    (fake_class.folder / "in").mkdir(exist_ok=True)
    (fake_class.folder / "in" / "ada.zip").write_bytes(b"PK no zip")
    fake_class.grade(only=Assignment("Lab 02", ("b",)))
    with fake_class.book() as book:
        (problem,) = [one for one in book.current("ada").run.problems if one.code is Code.SUBMISSION_UNREAD]
    assert problem.parameters["notebooks"] == ["b.ipynb"]


@pytest.mark.parametrize(("has_deadline", "per_day", "asked"), [(True, 10, 1), (True, 0, 0), (False, 10, 0)])
def test_a_time_of_receipt_is_in_doubt_where_lateness_costs_something(fake_class, has_deadline, per_day, asked):
    fake_class.hand_in("ada")
    deadlines = (Deadline(datetime(2026, 11, 21, tzinfo=UTC)),) * has_deadline
    settings = replace(fake_class.course.settings, deadlines=deadlines, late=LateSettings(per_day))
    with fake_class.book() as book:
        made = Batch(fake_class.folder / "in", replace(fake_class.course, settings=settings), book, Settings())
        assert len(list(made.grade())) == 1
    assert [doubt.about for doubt in made.doubts] == [TIME_RECEIVED] * asked


def test_probe_seeds_are_every_gradebooks_and_every_submissions_own(fake_class):
    fake_class.hand_in("ada", "bob")
    fake_class.grade("one.sqlite")
    one = dict(fake_class.seeds)
    fake_class.grade("two.sqlite")
    two = dict(fake_class.seeds)
    assert len({*one.values(), *two.values()}) == 4
    assert max(one.values()) <= json_values.MAX_INTEGER
    fake_class.hand_in("bob", source="omega_n = 2")
    fake_class.grade("one.sqlite")
    assert fake_class.seeds["bob"] not in {*one.values(), *two.values()}


def test_regrade_changes_the_marks_of_the_questions_that_are_named(fake_class):
    fake_class.hand_in("ada")
    fake_class.grade()
    fake_class.key(2.0)
    with fake_class.book() as book:
        by = book.current("ada").key_digest
        assert next(regrade(book, fake_class.course, ["0.1"])).after.marks == book.current("ada").marks
        assert book.current("ada").key_digest == by  # so that the next grading marks the others again
        assert sum(mark.points for mark in book.current("ada").marks) == 2
        (one,) = regrade(book, fake_class.course, ["2.11"])
        assert [sum(mark.points for mark in side.marks) for side in (one.before, one.after)] == [2, 0]
    assert fake_class.runs == ["ada"]


def test_regrade_names_what_a_person_gave_and_what_the_key_gives(fake_class):
    fake_class.hand_in("ada", "bob")
    fake_class.grade()
    with fake_class.book() as book:
        seen = next(one for one in book.current("ada").marks if one.part == "omega_n")
        book.set_mark("ada", "2.11", "omega_n", 1.5, reason="By its way.", actor="prof", expected=seen)
        fake_class.key(2.0)
        ada, bob = regrade(book, fake_class.course)
        (left,) = ada.unchanged
        assert left == {"question": "2.11", "part": "omega_n", "points": 1.5, "by_key": 0}
        assert bob.unchanged == () and sum(one.points for one in book.current("bob").marks) == 0
        assert next(one for one in book.current("ada").marks if one.part == "omega_n").points == 1.5
        assert [one.unchanged for one in regrade(book, fake_class.course, ["0.1"])] == [(), ()]


def test_words_that_were_handed_in_are_marked_again_though_the_run_left_no_answers(fake_class):
    fake_class.hand_in("ada")
    fake_class.grade()
    with fake_class.book() as book:
        graded = book.current("ada")
        words = {"2.11": {"explanation": {"text": "The ratio contains the link alone.", "pictures": {}}}}
        for changed, counted in (({}, 0), (words, 1)):
            stopped = replace(graded, run=replace(graded.run, answers=None, words=changed), marks=())
            course = fake_class.course
            again = _marked_again(book, course, stopped, InlineMarker(course, 1), (), "another").after
            assert sum(one.status == "for a person" for one in again.marks) == counted


def test_where_one_cannot_be_marked_again_their_marks_stay_and_the_others_are_marked(fake_class, monkeypatch):
    fake_class.hand_in("ada", "bob")
    fake_class.grade()
    fake_class.key(2.0)
    honest = InlineMarker.mark

    def mark(self, submission):
        if submission.student == "ada":
            raise GradingError("The answers could not be marked (BrokenProcessPool).")
        return honest(self, submission)

    monkeypatch.setattr(InlineMarker, "mark", mark)
    with fake_class.book() as book:
        ada, bob = regrade(book, fake_class.course)
        assert "could not be marked" in ada.problem and ada.after == book.current("ada") == ada.before
        assert bob.problem == "" and sum(mark.points for mark in book.current("bob").marks) == 0


def reports(*lines):
    return "".join(json.dumps({"notebook": "a.ipynb", **line}) + "\n" for line in lines).encode()


def test_what_ended_a_run_is_said_once_where_the_cell_is_known_and_else_of_the_run(fake_class):
    """And a cell took too long only if the runner stopped it: cleo's interrupted itself."""
    fake_class.hand_in("ada", "bob", "cleo")
    problem = Problem.of(Code.CELL_TIMED_OUT, seconds=60)
    error = {"type": "KeyboardInterrupt", "message": "", "line": 1}
    stopped = reports({"event": "started", "cell": "q1"}, {"event": "ended", "cell": "q1", "error": error})
    fake_class.leaves |= {"ada": left(None, (problem,), stopped), "bob": left(None, (problem,))}
    fake_class.leaves["cleo"] = left(None, (), stopped)
    fake_class.grade()
    with fake_class.book() as book:
        (cell,) = book.current("ada").run.problems
        assert (cell.code, cell.parameters["cell"], cell.parameters["question"]) == (Code.CELL_STOPPED, "q1", "2.11")
        assert cell.parameters["why"] == Problem.of(Code.TOOK_TOO_LONG, seconds=60, line=1)
        assert book.current("bob").run.problems == (problem,)
        assert submission_of(book.current("ada").run).ended == (problem,)
        (own,) = book.current("cleo").run.problems
        assert own.parameters["why"] == Problem.of(Code.RAISED, type="KeyboardInterrupt", line=1)


@pytest.mark.parametrize(
    ("there", "code"),
    [("", Code.NOTEBOOK_OF_IT_ABSENT), ("no notebook", Code.NOTEBOOK_OF_IT_UNREAD), ('{"cells": []}', None)],
)
def test_what_is_missing_with_its_notebook_says_so_and_nothing_else_does(fake_class, there, code):
    name = "02_finding_stiffness.ipynb"
    pristine, asked = {**fake_class.made.pristine, name: {"cells": []}}, {("2.11", "omega_n"), ("2.11", "explanation")}
    fake_class.made = replace(fake_class.made, pristine=pristine, asked_parts=frozenset(asked))
    fake_class.hand_in("ada")
    if there:
        (fake_class.folder / "in" / "ada" / name).write_text(there)
    fake_class.leaves["ada"] = left(None)
    fake_class.grade()
    with fake_class.book() as book:
        graded = book.current("ada")
    reasons = {mark.reason for mark in graded.marks if mark.question == "2.11"}
    assert reasons == {Problem.of(code, name)} if code else not any(name in str(one) for one in reasons)
    assert has(Code.NOT_HANDED_IN, graded.run.notes, name) is (there == "")


def test_what_was_read_is_read_again_only_if_a_file_or_a_decision_changed_or_a_row_must_be_written(
    fake_class, monkeypatch
):
    read, seen = intake.read, []

    def counted(submission, *words, **more):
        seen.append(submission.student)
        return read(submission, *words, **more)

    monkeypatch.setattr(intake, "read", counted)

    def again(**more):
        seen.clear()
        fake_class.grade(**more)
        return sorted(seen)

    folder = fake_class.folder / "in"
    fake_class.hand_in("ada", "bob", "cleo")
    packed = shutil.make_archive(str(folder / "dan"), "zip", folder / "bob")
    shutil.copytree(folder / "cleo", folder / "cleo" / "copy")
    (folder / "cleo" / "copy" / "a.ipynb").write_text(json.dumps({"cells": [{**CELLS[0], "source": "omega_n = 3"}]}))
    assert again() == ["ada", "bob", "cleo", "dan"]
    assert again() == ["cleo"]  # with two notebooks, of which an instructor is asked
    assert again(decisions={("bob", "a.ipynb"): "a.ipynb"}) == ["bob", "cleo"]
    about = (folder / "ada" / "a.ipynb").stat()
    fake_class.hand_in("ada", source="omega_n = 2")  # of the same length, saved at the same time
    os.utime(folder / "ada" / "a.ipynb", ns=(about.st_atime_ns, about.st_mtime_ns))
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("a.ipynb", (folder / "ada" / "a.ipynb").read_bytes())
    assert again() == ["ada", "bob", "cleo", "dan"]
    assert again() == ["cleo"]
