"""Marking in processes of its own: one answer's end is no other's."""

import json
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future

import psutil
import pytest
from made_courses import OURS, loaded

from labcourse.errors import GradingError
from labcourse.grading.marking import decoding, marking, marking_processes
from labcourse.grading.marking.marking_processes import Marker
from labcourse.grading.submission import Submission
from labcourse.problems import Code
from solutions.true_bench import TrueBench

pytestmark = pytest.mark.slow

KEY = f"""
import os
from labcourse.grading.marking.checks import ForAPerson, Number


def expected(bench):
    if bench.K_s == {TrueBench("bomb").K_s!r}:
        os._exit(1)  # as a crash in a library would
    return bench.omega_n

KEY = {{"2.11": {{"omega_n": Number("it", expected, rtol=0.05), "explanation": ForAPerson()}}}}
"""


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("course"), key=KEY)


def answers(student):
    book = {"format": 2, "student": student, "bench": {"uri": "virtual"}, "software": "rotflex", "probe_seed": 1}
    number = {"kind": "number", "value": TrueBench(student).omega_n}
    return json.dumps({**book, "answers": {"2.11": {"omega_n": number}}}).encode()


def answered(student):
    return Submission(student=student, answers=answers(student), probe_seed=1)


def test_an_answer_that_kills_its_marker_costs_no_other_its_marks(course):
    """Three at a time, so that the pool breaks under the neighbours, too."""
    students = ["ada", "bomb", "bob", "cleo", "bomb", "dan"]
    results = {}

    def mark(number, student):
        try:
            marker.mark(submission := answered(student))
            results[number] = sum(one.points for one in submission.marks)
        except GradingError as error:
            results[number] = str(error)

    with Marker(course, 2) as marker:
        threads = [threading.Thread(target=mark, args=item) for item in enumerate(students)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert [results[n] for n in (0, 2, 3, 5)] == [2, 2, 2, 2]
    assert all("could not be marked" in results[n] for n in (1, 4))


def test_answers_that_wait_while_a_neighbour_has_the_processes_ended_are_marked_by_new_ones(course, monkeypatch):
    submit, seen = marking_processes._submit, []

    def ended_meanwhile(pool, work, *given):
        seen.append(pool)
        if len(seen) > 1:
            return submit(pool, work, *given)
        waiting = Future()
        waiting.cancel()  # as a pool does with what waits when it is ended
        return waiting

    monkeypatch.setattr(marking_processes, "_submit", ended_meanwhile)
    with Marker(course, 1) as marker:
        marker.mark(submission := answered("ada"))
    assert submission.marks[0].points == 2
    assert len(set(map(id, seen))) == 2


def test_a_marker_that_has_ended_starts_no_process_any_more(course):
    """As when a batch is stopped while one of its threads has yet to warm it up."""
    with Marker(course, 1) as marker:
        pass
    before = psutil.Process().children()
    marker.warm_up()
    assert psutil.Process().children() == before


def test_no_marking_process_outlives_a_program_that_was_killed(course):
    code = f"""
import sys, time
from pathlib import Path
from labcourse.grading.marking.marking_processes import Marker
from labcourse.grading.submission import Submission
from labcourse.grading import course
if __name__ == "__main__":
    marker = Marker(course.load(Path({str(course.folder)!r})), 1)
    marker.mark(Submission(student="ada", answers={answers("ada")!r}, probe_seed=1))
    print("ready", flush=True)
    time.sleep(600)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"ready\n"
    marking_process = [one for one in psutil.Process(child.pid).children() if "spawn_main" in " ".join(one.cmdline())]
    assert marking_process
    child.kill()
    child.wait()
    _gone, alive = psutil.wait_procs(marking_process, timeout=30)
    assert not alive


def test_an_answer_that_takes_too_long_is_for_a_person(monkeypatch):
    monkeypatch.setattr(marking, "_TIME_LIMIT", 0.05)

    class Slow:
        def verdict(self):
            while True:
                pass

    verdict = marking._judge(OURS, Slow().verdict)
    assert verdict.status.value == "for a person" and verdict.reason.code is Code.NOT_COMPARED
    error = verdict.reason.parameters["error"]
    assert "too long" not in error and "stopped after 0.05 s" in error


def test_a_bound_on_time_cannot_be_caught_by_what_it_bounds():
    def swallow():
        while True:
            try:
                time.sleep(5)
            except ArithmeticError:
                break
        time.sleep(5)

    with pytest.raises(decoding.TooSlow), decoding.time_limited(0.02):
        swallow()


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="there are no masks of signals here")
@pytest.mark.parametrize("fails", [False, True])
def test_ctrl_c_is_kept_from_what_is_started_and_heard_again_afterwards(fails):
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    during = []

    class Pool:
        def submit(self, work, *given):
            during.append(signal.pthread_sigmask(signal.SIG_BLOCK, []))
            if fails:
                raise RuntimeError("broken")
            return work(*given)

    try:
        assert marking_processes._submit(Pool(), max, 1, 2) == 2
    except RuntimeError:
        assert fails
    assert during == [{*before, signal.SIGINT}]
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before and signal.SIGINT not in before
