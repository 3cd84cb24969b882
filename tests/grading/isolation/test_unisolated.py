"""The run without isolation: the sandbox's call, for those who trust the code. Only harmless commands are run here."""

import os
import secrets
import sys
import tempfile
from pathlib import Path

import psutil
import pytest

from labcourse.errors import IsolationError
from labcourse.grading.isolation import sandbox, unisolated
from labcourse.grading.isolation.process import Ending, Limits


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run a shell script unisolated; were this root, it would be refused."""
    monkeypatch.setattr(unisolated, "check_allowed", lambda: None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def bare_run(script, **more):
        command = ["/bin/sh", "-c", script]
        outcome = sandbox.run(command, visible=[], wanted={"answer": 100}, isolated=False, **more)
        assert list(tmp_path.iterdir()) == []  # its folder is gone, whatever was in it
        return outcome

    return bare_run


def with_word(word):
    found = []
    for process in psutil.process_iter(["cmdline", "status"]):
        found += [process] * (word in (process.info["cmdline"] or []))
    return found


@pytest.mark.skipif(os.geteuid() != 0, reason="not root")
def test_root_runs_nothing_without_isolation(tmp_path):
    with pytest.raises(IsolationError, match="root"):
        sandbox.run(["touch", str(tmp_path / "ran")], visible=[], wanted={}, isolated=False)
    assert list(tmp_path.iterdir()) == []


def test_root_is_known_by_its_rights(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    unisolated.check_allowed()
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    with pytest.raises(IsolationError, match="rights"):
        unisolated.check_allowed()


def test_windows_is_told_what_to_do(monkeypatch):
    monkeypatch.setattr(unisolated.os, "name", "nt")
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(IsolationError, match="WSL2"):
        unisolated.check_allowed()


def test_a_file_comes_back(run):
    outcome = run("cat > answer; pwd; echo $HOME >&2; exit 7", stdin=b"said" * 10)
    assert (outcome.ending, outcome.code, outcome.files) == (Ending.FINISHED, 7, {"answer": b"said" * 10})
    work, home = map(Path, outcome.output.decode().split())
    assert (work.name, home.name, work.parent) == ("work", "home", home.parent)


def test_its_environment_is_its_own(run, monkeypatch):
    monkeypatch.setenv("GRADERS_SECRET", "secret")
    said = run("env", environment={"GIVEN": "this"}).output.decode()
    assert "GIVEN=this" in said.splitlines()
    assert "secret" not in said


def test_another_folder_in_the_working_folders_place_is_not_looked_into(run):
    assert (
        run("echo true > answer; mv ../work ../old; mkdir ../work; echo false > ../work/answer").files.get("answer")
        == b"true\n"
    )


def test_folders_can_be_deep_and_closed(run):
    dig = "import os\nfor _ in range(3000): os.mkdir('d'); os.chdir('d')\nprint('dug')"
    assert run(f'{sys.executable} -I -S -c "{dig}"; mkdir -p ../c/in; chmod 000 ../c').output == b"dug\n"


def test_children_that_have_left_the_group_end_with_it(run):
    word = secrets.token_hex(8)
    start = f"setsid sh -c 'while :; do sleep 1; done' {word} & "
    outcome = run(3 * start + "echo started > answer")
    assert outcome.files.get("answer") == b"started\n"
    assert with_word(word) == []


def test_the_deadline_ends_it(run):
    word = secrets.token_hex(8)
    outcome = run(f"echo before > answer; sh -c 'while :; do sleep 1; done' {word}", limits=Limits(seconds=1))
    assert (outcome.ending, outcome.code, outcome.files.get("answer")) == (Ending.DEADLINE, None, b"before\n")
    assert with_word(word) == []
