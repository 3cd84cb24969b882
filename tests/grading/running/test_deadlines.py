"""Each deadline is the one that was asked for, from the command to the clock that ends a run; the clocks are ours."""

import itertools
import json
import subprocess
import sys
import threading
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from made_courses import OURS
from typer.testing import CliRunner

import labcourse
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import batch
from labcourse.grading.isolation import sandbox, unisolated
from labcourse.grading.isolation.process import Ending, Outcome
from labcourse.grading.isolation.process import Limits as SandboxLimits
from labcourse.grading.running import isolation_report, runner
from labcourse.problems import Code, Problem
from labcourse.run import from_notebook
from labcourse.run.inside import BROKEN, EVIDENCE_FILE, FINE, TIMED_OUT
from rotflex.cli import app

USUAL = runner.RunLimits()


@pytest.fixture
def settings_of(tmp_path, monkeypatch):
    (tmp_path / "in" / "ada").mkdir(parents=True)
    seen = []

    class Batch:
        def __init__(self, submissions, course, gradebook, settings):
            seen.append(settings)
            raise GradingError("enough")

    monkeypatch.setattr(batch, "Batch", Batch)
    monkeypatch.setattr(isolation_report, "check", lambda: None)
    monkeypatch.setattr(unisolated, "check_allowed", lambda: None)

    def made(*options):
        command = ["grade", str(tmp_path / "out"), str(tmp_path / "in"), "--solutions", str(OURS.folder)]
        done = CliRunner().invoke(app, [*command, *options])
        assert done.exit_code == 2 and len(seen) == 1, done.output
        return seen.pop()

    return made


def test_without_options_the_limits_are_the_usual_ones(settings_of):
    made = settings_of()
    assert made == batch.Settings() and made.limits == USUAL and made.isolated


@pytest.mark.parametrize(
    ("options", "limits"),
    [
        (("--cell-timeout", "7"), {"cell": 7}),
        (("--deadline", "77"), {"submission": 77}),
        (("--memory", "300"), {"memory": 300 * 2**20}),
        (("--processes", "9"), {"processes": 9}),
    ],
)
def test_each_option_changes_its_limit_and_no_other(settings_of, options, limits):
    made = settings_of(*options).limits
    assert made == runner.RunLimits(**limits) != USUAL


def test_the_other_options_are_each_their_own(settings_of):
    made = settings_of("--jobs", "3", "--probe-seed", "5", "--unsafe-no-isolation")
    assert (made.jobs, made.probe_seed, made.isolated) == (3, 5, False)


@pytest.mark.parametrize(
    ("option", "least"),
    [("--cell-timeout", 1), ("--deadline", 1), ("--memory", 256), ("--processes", 8), ("--jobs", 1)],
)
def test_options_have_a_least_value(settings_of, tmp_path, option, least):
    settings_of(option, str(least))
    command = ["grade", str(tmp_path / "out"), str(tmp_path / "in"), option, str(least - 1)]
    said = " ".join(CliRunner().invoke(app, command).output.replace("│", " ").split())
    assert f"should be greater than or equal to {least} " in said and option in said


LIMITS = runner.RunLimits(cell=7, submission=77.5, memory=300 * 2**20, processes=9, folder=12345)


@pytest.mark.parametrize("isolated", [True, False])
def test_a_run_is_given_its_limits_and_what_it_depends_on(tmp_path, monkeypatch, isolated):
    asked = []

    def run(command, **given):
        asked.append((command, given))
        files = {ANSWERS_FILE: b"{}", runner.REPORTS_FILE: b"reports", EVIDENCE_FILE: b"{}"}
        return Outcome(Ending.FINISHED, 0, files, {}, b"", 1.0)

    monkeypatch.setattr(runner, "unpacked", lambda packed: tmp_path)
    monkeypatch.setattr(sandbox, "run", run)
    cancelled = threading.Event()
    notebooks, parameters = {"a.ipynb": {"cells": []}}, {"bench": "x", "student": "b"}
    job = runner.Job(
        "ada",
        notebooks,
        5,
        parameters=parameters,
        imports=("m",),
        files={"f": b"1"},
        limits=LIMITS,
        isolated=isolated,
        evidence="m:read",
    )
    done = runner.run(b"packed", job, cancelled)
    assert done == ({ANSWERS_FILE: b"{}", runner.REPORTS_FILE: b"reports", EVIDENCE_FILE: b"{}"}, ())
    ((command, given),) = asked
    assert command[-3:] == ["-P", "-m", "labcourse_inside.main"] and given["visible"] == [tmp_path]
    assert given["isolated"] is isolated
    assert given["limits"] == SandboxLimits(seconds=77.5, memory=300 * 2**20, processes=9, folder=12345)
    assert given["wanted"] == {ANSWERS_FILE: 2_000_000, runner.REPORTS_FILE: 1_000_000, EVIDENCE_FILE: 40_000_000}
    assert given["cancelled"] is cancelled and given["environment"]["LABCOURSE_PROBE_SEED"] == "5"
    assert json.loads(given["stdin"]) == {
        "notebooks": notebooks,
        "parameters": {"bench": "x", "student": "ada"},
        "imports": ["import m"],
        "files": {"f": "MQ=="},
        "cell_timeout": 7,
        "evidence": "m:read",
        "shown": [],
    }


def test_a_worker_of_another_version_calls_nothing():
    with pytest.raises(GradingError, match=r"install 0\.0\.1"):
        runner.call_on_worker("0.0.1", pytest.fail, "it is called")
    assert runner.call_on_worker(labcourse.__version__, max, 2, 3) == 3


@pytest.mark.parametrize("is_broken", [True, False])
def test_a_submission_that_claims_that_the_course_is_broken_is_not_believed(monkeypatch, is_broken):
    asked, cancelled = [], threading.Event()

    def run(packed, job, given):
        asked.append(job)
        assert given is cancelled
        return Outcome(Ending.FINISHED, BROKEN if job.notebooks or is_broken else 0, {}, {}, b"no numpy", 1.0)

    monkeypatch.setattr(runner, "_run_in_sandbox", run)
    job = runner.Job("ada", {"a.ipynb": {"cells": []}}, 5, files={"numpy.py": b""}, evidence="m:read")
    if is_broken:
        with pytest.raises(GradingError, match="no numpy"):
            runner.run(b"", job, cancelled)
    else:
        assert runner.run(b"", job, cancelled)[1] == (Problem.of(Code.RUN_ENDED_EARLY),)
    assert asked == [job, runner.Job("ada", {}, 5)]


@pytest.mark.parametrize(
    ("ending", "code", "problem"),
    [
        (Ending.FINISHED, FINE, None),
        (Ending.FINISHED, TIMED_OUT, Problem.of(Code.CELL_TIMED_OUT, seconds=7)),
        (Ending.DEADLINE, None, Problem.of(Code.RUN_TIMED_OUT, seconds=77.5)),
        (Ending.OUTPUT, None, Problem.of(Code.PRINTED_TOO_MUCH)),
    ],
)
def test_what_ended_a_run_and_every_file_that_cannot_be_read_are_told(monkeypatch, ending, code, problem):
    """On runs that end so: tests/grading/running/test_runner.py."""
    troubles = {"answers.json": "a link", EVIDENCE_FILE: "too large"}
    monkeypatch.setattr(runner, "_run_in_sandbox", lambda *_: Outcome(ending, code, {}, troubles, b"", 1.0))
    _files, problems = runner.run(b"", runner.Job("ada", {}, 5, limits=LIMITS))
    unread = [Problem.of(Code.RESULT_UNREAD, name, error=why) for name, why in troubles.items()]
    assert problems == (*([problem] if problem else []), *unread)


@pytest.mark.parametrize("hears", [0, 1, 2])
def test_a_program_in_a_cell_is_waited_for_then_asked_and_then_ended(monkeypatch, tmp_path, hears):
    done, waits = [], itertools.count()

    def wait(timeout=None):
        done.append(timeout)
        if next(waits) < hears:
            raise subprocess.TimeoutExpired("rotflex", timeout)

    ends = {word: lambda word=word: done.append(word) for word in ("terminate", "kill")}
    child = SimpleNamespace(stdout=[], wait=wait, **ends)
    monkeypatch.setattr(subprocess, "Popen", lambda *_words, **_more: child)
    assert list(from_notebook.output_of("check", (), tmp_path)) == []
    assert done == [5, "terminate", 15, "kill", None][: 1 + 2 * hears]


def test_a_scheduler_and_its_workers_are_waited_for_fifteen_seconds_each(monkeypatch):
    """Runs on a cluster: tests/grading/test_cluster.py."""
    client = Mock(**{"wait_for_workers.side_effect": TimeoutError})
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=Mock(return_value=client)))
    with pytest.raises(GradingError, match="has no workers"), runner.cluster("tcp://host:8786"):
        pass
    sys.modules["distributed"].Client.assert_called_once_with("tcp://host:8786", timeout=15, set_as_default=False)
    client.wait_for_workers.assert_called_once_with(1, timeout=15)
    client.close.assert_called_once_with()
