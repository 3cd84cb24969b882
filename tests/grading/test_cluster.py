"""The same class on a cluster: a real scheduler and two workers on loopback, one of them killed half way."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
import small_class

pytestmark = [pytest.mark.usefixtures("sandbox"), pytest.mark.scheduled]
SIZE = 4


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, and the processes of its two workers (one thread each)."""
    started = []

    def start(*words):
        log = (tmp_path / f"log-{len(started)}").open("wb")
        started.append(subprocess.Popen([sys.executable, "-m", "distributed.cli." + words[0], *words[1:]], stderr=log))
        return started[-1]

    file = tmp_path / "scheduler.json"
    start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
    while not file.exists():
        assert started[0].poll() is None, (tmp_path / "log-0").read_text()
        time.sleep(0.1)
    address = json.loads(file.read_text())["address"]
    one = ("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
    folders = [str(tmp_path / f"worker-{number}") for number in range(2)]
    workers = [start(*one, "--local-directory", folder) for folder in folders]
    yield address, workers
    for process in started:
        process.kill()
        process.wait()


def test_a_cluster_gives_the_same_gradebook_though_a_worker_is_killed(cluster, tmp_path):
    address, workers = cluster
    source = small_class.course(tmp_path / "course")
    small_class.hand_in(source, tmp_path / "submissions", SIZE)
    here = small_class.command(source, tmp_path / "submissions", tmp_path / "here", "--jobs", "2")
    subprocess.run(here, check=True, capture_output=True)
    words = small_class.command(source, tmp_path / "submissions", tmp_path / "there", "--scheduler", address, "--json")
    grading = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    first = json.loads(grading.stdout.readline())
    assert first["event"] == "graded"
    os.kill(workers[0].pid, signal.SIGKILL)
    rest = [json.loads(line) for line in grading.stdout]
    assert grading.wait() == 0
    assert rest[-1] == {"event": "done", "ran": SIZE, "known": 0, "failed": 0, "total": SIZE}
    assert small_class.contents(tmp_path / "there") == small_class.contents(tmp_path / "here")


def test_no_scheduler_at_the_address_is_said_in_words(tmp_path):
    source = small_class.course(tmp_path / "course")
    small_class.hand_in(source, tmp_path / "submissions", 1)
    words = small_class.command(source, tmp_path / "submissions", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert "There is no scheduler at tcp://127.0.0.1:9" in done.stderr
