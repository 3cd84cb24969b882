"""A forked process is held to its time, and whatever it does, who forked it goes on."""

import contextlib
import ctypes
import faulthandler
import inspect
import itertools
import os
import signal
import subprocess
import sys
import time

import pytest

from labcourse.run.inside import DIED, FINE, TIMED_OUT, watch

pytestmark = pytest.mark.slow

TIMEOUT = 0.4


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(watch, "GRACE", 0.4)


@pytest.fixture
def note(tmp_path):
    """A function by which a forked process notes something, and all that was noted."""

    def noted(word=None):
        if word is not None:
            with open(tmp_path / "notes", "a") as file:
                file.write(f"{word}\n")
            return None
        path = tmp_path / "notes"
        return path.read_text().split() if path.exists() else []

    return noted


def steps(*deeds):
    """Work that does one thing after the other, as cells are run: an interrupt ends a step, and no more."""

    def work(report_step):
        for deed in deeds:
            report_step()
            try:
                signal.signal(signal.SIGINT, signal.default_int_handler)
                deed()
            except KeyboardInterrupt:
                pass
            finally:
                signal.signal(signal.SIGINT, signal.SIG_IGN)
            report_step()

    return work


def nap(seconds=60.0):
    time.sleep(seconds)


def swallow():
    while True:
        with contextlib.suppress(KeyboardInterrupt):
            time.sleep(60)


def test_work_that_comes_to_its_end_is_fine(note):
    assert watch.run(steps(lambda: note("a"), lambda: note("b")), 2, TIMEOUT) == FINE
    assert note() == ["a", "b"]


def test_a_step_that_takes_too_long_is_interrupted_and_the_next_is_done(note):
    assert watch.run(steps(nap, lambda: note("next")), 2, TIMEOUT) == TIMED_OUT
    assert note() == ["next"]


ENDS = {  # of a step that does not come to its end: what it does, its time, and what is said
    "swallows": (swallow, TIMEOUT, TIMED_OUT),
    "c-code": (
        lambda: sum(itertools.repeat(0)),
        TIMEOUT,
        TIMED_OUT,
    ),  # no Python in which the interrupt could be raised
    "stopped": (lambda: os.kill(os.getpid(), signal.SIGSTOP), TIMEOUT, TIMED_OUT),
    "ignores": (lambda: (signal.signal(signal.SIGINT, signal.SIG_IGN), nap()), TIMEOUT, TIMED_OUT),
    "exit-0": (lambda: os._exit(0), 60, DIED),
    "exit-1": (lambda: os._exit(1), 60, DIED),
    "kill": (lambda: os.kill(os.getpid(), signal.SIGKILL), 60, DIED),
    "term": (lambda: signal.raise_signal(signal.SIGTERM), 60, DIED),
    "segfault": (lambda: (faulthandler.disable(), ctypes.string_at(0)), 60, DIED),
    "sys-exit": (lambda: sys.exit(0), 60, DIED),
}


@pytest.mark.parametrize(("deed", "seconds", "said"), ENDS.values(), ids=ENDS)
def test_a_step_that_no_interrupt_ends_is_killed_and_work_that_ends_itself_has_died(note, deed, seconds, said):
    assert watch.run(steps(deed, lambda: note("next")), 2, seconds) == said
    assert note() == []


def test_an_error_of_the_work_itself_is_told_with_its_place(capfd):
    def broken(report_step):
        raise ValueError("our own fault")

    assert watch.run(broken, 1, TIMEOUT) == DIED
    told = capfd.readouterr().err
    assert "our own fault" in told
    assert "in broken" in told


def test_whoever_is_forked_by_a_step_does_not_go_on_to_the_next(note):
    fork_and_wait = lambda: (child := os.fork()) and os.waitpid(child, 0)  # noqa: E731
    assert watch.run(steps(fork_and_wait, lambda: note("once")), 2, 5) == FINE
    assert note() == ["once"]


def test_what_a_step_has_started_is_ended_with_its_process_group(tmp_path):
    def start():
        child = subprocess.Popen(["sleep", "60"])
        (tmp_path / "child").write_text(str(child.pid))

    assert watch.run(steps(start), 1, TIMEOUT * 10) == FINE
    child = int((tmp_path / "child").read_text())
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline and _runs(child):
        time.sleep(0.01)
    assert not _runs(child)


def _runs(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


def test_a_pipe_that_a_submission_keeps_open_or_closes_holds_nothing_up(note):
    assert watch.run(steps(lambda: os.fork() or nap(600)), 1, 60) == FINE
    assert watch.run(steps(lambda: os.closerange(0, 256), lambda: note("next")), 2, 5) == FINE
    assert note() == ["next"]


def test_reports_beyond_those_that_there_can_be_win_no_time():
    def chatter(report_step):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        while True:
            report_step()
            time.sleep(0.01)

    assert watch.run(chatter, 5, TIMEOUT) == TIMED_OUT


#: In a process of its own: a thread that another test has left may open a file just when files are counted.
ALONE = f"""
import contextlib, os, signal, time
import psutil
from labcourse.run.inside import watch

{inspect.getsource(steps)}
{inspect.getsource(nap)}
watch.GRACE = 0.4
before = set(os.listdir("/proc/self/fd"))
for _ in range(3):
    watch.run(steps(nap), 1, 0.05)
assert set(os.listdir("/proc/self/fd")) == before
assert psutil.Process().children() == []
"""


def test_nothing_of_it_is_left_behind():
    done = subprocess.run([sys.executable, "-c", ALONE], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
