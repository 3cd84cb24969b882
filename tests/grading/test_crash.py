"""A grader that is killed: nothing is lost, nothing is left running, nothing is done twice."""

import json
import subprocess
import time

import psutil
import pytest
import small_class

pytestmark = pytest.mark.usefixtures("sandbox")
SIZE, KILLS = 3, 1


@pytest.fixture(scope="module")
def fake_class(tmp_path_factory):
    """A class, its gradebook without any disturbance, and the folder that they are in."""
    folder = tmp_path_factory.mktemp("crash")
    source = small_class.course(folder / "course")
    small_class.hand_in(source, folder / "submissions", SIZE)
    words = small_class.command(source, folder / "submissions", folder / "undisturbed", "--jobs", "2", "--json")
    begun = time.monotonic()
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    return folder, source, done, time.monotonic() - begun


@pytest.fixture(scope="module")
def killed(fake_class):
    """The folder, after a grader of the class was killed and resumed."""
    folder, source, _, undisturbed = fake_class
    words = small_class.command(source, folder / "submissions", folder / "killed", "--jobs", "2")
    (folder / "scratch").mkdir()
    small_class.killed_at_work(words, folder / "scratch")
    # From before the first submission is begun to after some are done, however quick this machine is.
    small_class.killed_and_resumed(words, KILLS, longest=0.8 * undisturbed, scratch=folder / "scratch")
    return folder


def test_after_kills_at_random_moments_the_gradebook_is_that_of_an_undisturbed_run(killed):
    folder = killed
    assert small_class.contents(folder / "killed") == small_class.contents(folder / "undisturbed")
    assert len(small_class.contents(folder / "undisturbed")["students"]) == SIZE


def test_nothing_is_left_of_a_killed_grader(killed):
    folder = killed
    assert any((folder / "scratch").iterdir())  # files are left behind by a program that was killed so
    lines = {one.pid: " ".join(one.info["cmdline"] or ()) for one in psutil.process_iter(["cmdline"])}
    assert not {pid: line for pid, line in lines.items() if str(folder) in line}


def test_lines_of_json_tell_what_was_done(fake_class):
    *_, done, _ = fake_class
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["event"] for line in lines] == ["graded"] * SIZE + ["done"]
    assert lines[-1] == {"event": "done", "ran": SIZE, "known": 0, "failed": 0, "total": SIZE}
    assert {line["student"] for line in lines[:-1]} == {f"student-{number:03}" for number in range(SIZE)}
    assert done.returncode == 0
