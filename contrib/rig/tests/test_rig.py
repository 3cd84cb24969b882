"""A rig as a whole: students, server and worker, each as far from the other as it will be."""

import hashlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

import control
import numpy as np
import pytest
from rigs import BENCH, Rig, until
from rotflex_rig import address, request
from rotflex_rig.queue import LABORATORY, WORKER
from rotflex_rig.web import TOKEN_VARIABLE, ask, keep_token

from labcourse.grading.scoring import start
from rotflex import experiments, hil
from rotflex.errors import BenchError, DesignError, LimitExceeded, RunStopped
from rotflex.hil.controllers import ObserverFeedback, StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import student_bench
from rotflex.model import of_plant
from rotflex.sampled import sample
from rotflex.units import DEG
from rotflex.widgets.running import Running

K = (18.2356, -17.1547, 1.5893, 0.6327)
MODEL = of_plant(student_bench(7).parameters)
STEPS = 20 * DEG * np.repeat([0.0, 1.0, 0.0], 250)
SAMPLED = sample(MODEL, 0.002)
OBSERVER = ObserverFeedback(
    SAMPLED.A, SAMPLED.B, control.place(SAMPLED.A.T, SAMPLED.C.T, [0.8, 0.82, 0.84, 0.86]).T, K, 0.002
)
EXPERIMENTS = {
    "sweep": lambda bench: experiments.sweep(bench, duration=5.0),
    "sweep by voltage": lambda bench: experiments.sweep(bench, duration=5.0, drive="voltage"),
    "free decay": lambda bench: experiments.free_decay(bench, duration=2.0),
    "validation": lambda bench: experiments.validation(bench, MODEL.A, MODEL.B, duration=3.0, progress=False),
    "validation by a step": lambda bench: experiments.validation(bench, MODEL.A, MODEL.B, "step", duration=1.0),
    "full state": lambda bench: experiments.tracking(bench, K, duration=4.0),
    "partial state": lambda bench: experiments.tracking(bench, K, feedback="partial", duration=4.0),
    "a discrete system": lambda bench: experiments.tracking(bench, StateFeedback(K).system(), duration=4.0),
    "a transfer function": lambda bench: experiments.follow(
        bench, control.tf([4.0, -3.6], [1.0, -0.6], 0.01), 10 * DEG * np.ones(100), 0.01
    ),
    "a static gain": lambda bench: experiments.follow(bench, control.tf([4.0], [1.0], 0.01), np.full(100, 0.1), 0.01),
    "an observer": lambda bench: experiments.follow(bench, OBSERVER, STEPS),
    "two degrees of freedom": lambda bench: experiments.follow(
        bench, TwoDegreesOfFreedom(StateFeedback(K), np.full(100, 0.01), 0.5), STEPS
    ),
}


@pytest.fixture
def entered(rig, monkeypatch):
    """A rig with a worker, and a student in front of it."""
    rig.work()
    rig.enter(monkeypatch)
    return rig


def test_each_experiment_is_the_same_call_on_that_bench_to_the_last_bit(entered):
    for name, call in EXPERIMENTS.items():
        with entered.bench() as far:
            there = call(far)
        with hil.open(BENCH) as near:
            here = call(near)
        assert set(there.channels) == set(here.channels), name
        assert all(np.array_equal(there[one], here[one]) for one in here.channels), name
        assert there.metadata == here.metadata, name


def test_a_recording_says_which_run_it_is_as_at_a_real_bench(entered):
    with entered.bench() as bench:
        bench.identity["run"] = 3
        assert experiments.tracking(bench, K, duration=3.1).metadata["bench"]["run"] == 3


HERE = {
    "a function": (lambda bench: experiments.follow(bench, lambda *_: 0.0, STEPS), DesignError),
    "its own class": (
        lambda bench: experiments.follow(bench, type("StateFeedback", (StateFeedback,), {})(K), STEPS),
        DesignError,
    ),
    "hold": (experiments.hold, BenchError),
    "watch": (experiments.watch, BenchError),
    "read": (lambda bench: bench.start(0.002), BenchError),
    "write": (lambda bench: bench.write(1.0), BenchError),
    "disturb": (lambda bench: bench.disturb(np.ones(5)), BenchError),
    "not finite": (lambda bench: experiments.follow(bench, StateFeedback(K), [0.0, np.nan]), BenchError),
    "too long": (lambda bench: experiments.sweep(bench, duration=61), BenchError),
    "too large": (lambda bench: experiments.follow(bench, StateFeedback(K), np.full(30000, np.pi / 100)), None),
    "too slow": (lambda bench: experiments.follow(bench, control.tf([1.0], [1.0], 0.1), np.zeros(9), 0.1), BenchError),
}
AT_THE_TWIN = {
    "a runaway gain": ((-18, 17, -1.5, -0.6), "unstable"),
    "a gain with a wrong sign in alpha's rate": ((18, -17, 1.6, -6), "unstable"),
    "a huge gain": ((900, -17, 1.6, 0.6), "limit"),
}


@pytest.mark.parametrize("name", [name for name, (_act, error) in HERE.items() if error])
def test_what_a_rig_cannot_run_is_refused_at_once(entered, name):
    act, error = HERE[name]
    with entered.bench() as bench, pytest.raises(error):
        act(bench)
    said = entered.queue.overview()
    assert not said["queue"] and not said["last"]


def test_a_setup_is_refused(entered):
    entered.bench()
    with pytest.raises(BenchError):
        hil.open(f"rig:{entered.url}", setup=Setup())


@pytest.mark.parametrize("name", AT_THE_TWIN)
def test_what_the_twin_does_not_bear_is_refused_with_the_reason(entered, name):
    gain, why = AT_THE_TWIN[name]
    with entered.bench() as bench, pytest.raises(LimitExceeded, match=why):
        experiments.tracking(bench, gain)
    with entered.bench() as bench:  # and the rig goes on
        assert len(experiments.tracking(bench, K, duration=3.1)) == 1551


def test_a_voltage_that_stays_at_its_limit_is_refused(entered):
    gain = control.tf([200.0], [1.0], 0.01)
    with entered.bench() as bench, pytest.raises(LimitExceeded):
        experiments.follow(bench, gain, 60 * DEG * np.ones(300), 0.01)


# --- who sends something else -----------------------------------------------------------------------------------------

GOOD = json.loads(request.packed({"experiment": "follow"}, StateFeedback(K), STEPS, 0.002, 1))
CHANGES = {
    "no JSON": b"{",
    "NaN": json.dumps({**GOOD, "reference": [0.0, float("nan")]}).encode(),
    "infinite": json.dumps({**GOOD, "reference": [0.0, float("inf")]}).encode(),
    "1e999": json.dumps(GOOD).replace("0.002", "1e999").encode(),
    "a number of 5000 digits": json.dumps(GOOD).replace("0.002", "9" * 5000).encode(),
    "deep": b"[" * 100_000,
    "a list": b"[]",
    "a string for a number": json.dumps({**GOOD, "reference": [0.0, "1"]}).encode(),
    "true for a number": json.dumps({**GOOD, "run": True}).encode(),
    "another experiment": json.dumps({**GOOD, "settings": {"experiment": "hold"}}).encode(),
    "a setting of its own": json.dumps({**GOOD, "settings": {"experiment": "follow", "x": 1}}).encode(),
    "more keys": json.dumps({**GOOD, "code": "import os"}).encode(),
    "a class of rotflex": json.dumps({**GOOD, "controller": {"kind": "BandLimitedDerivative"}}).encode(),
    "a kind that is a list": json.dumps({**GOOD, "controller": {"kind": []}}).encode(),
    "other arguments": json.dumps({**GOOD, "controller": {"kind": "OpenLoop", "os": 1}}).encode(),
    "a wide matrix": json.dumps(
        {**GOOD, "controller": {"kind": "SystemController", "A": [[0.0] * 500] * 500}}
    ).encode(),
    "strings for a gain": json.dumps({**GOOD, "controller": {"kind": "StateFeedback", "K": ["1"] * 4}}).encode(),
    "an infinite matrix": json.dumps({**GOOD, "controller": {"kind": "SystemController", "A": [], "B": [], "C": []}})
    .replace('"C": []', '"C": [], "D": [[0, 1e999, 0]]')
    .encode(),
    "a controller of another sample time": json.dumps({**GOOD, "sample_time": 0.004}).encode(),
    "nested controllers": json.dumps(
        {**GOOD, "controller": {"kind": "TwoDegreesOfFreedom", "controller": []}}
    ).encode(),
    "too fast": json.dumps({**GOOD, "sample_time": 1e-9}).encode(),
    "too long": json.dumps({**GOOD, "reference": [0.0] * 200_000}).encode(),
    "giant": b"[" + b"0," * 20_000_000 + b"0]",
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_hostile_body_is_refused_and_nothing_is_queued(rig, name):
    token = rig.admit("eve")
    asked = urllib.request.Request(f"{rig.url}/runs", CHANGES[name], {"Authorization": f"Bearer {token}"})
    try:
        urllib.request.urlopen(asked, timeout=20)
        pytest.fail("it was taken")
    except urllib.error.HTTPError as error:
        assert error.code in (413, 422)
    except (ConnectionError, urllib.error.URLError):  # the server need not read on
        assert name == "giant"
    assert rig.queue.overview()["queue"] == []
    assert json.loads(ask(f"{rig.url}/me", token=token)) == {"id": "eve"}


def test_each_address_asks_for_its_own_token(rig):
    student = rig.admit("ada")
    asked = {
        "/runs": "POST", "/runs/1": "GET", "/runs/1/recording": "GET", "/bench": "GET", "/me": "GET",
        "/queue": "GET", "/control": "POST", "/curves/1": "GET", "/worker/x": "POST", "/worker/x/1": "PUT",
    }  # fmt: skip
    tokens = {"nobody": "no", "ada": student, WORKER: rig.token[WORKER], LABORATORY: rig.token[LABORATORY]}
    allowed = {"/runs": "ada", "/bench": "ada", "/queue": LABORATORY, "/control": LABORATORY, "/worker": WORKER}
    for path, method in asked.items():
        for who, token in tokens.items():
            mine = allowed.get(next((one for one in allowed if path.startswith(one)), ""), LABORATORY)
            if who == mine or (path == "/me" and who != "nobody"):
                continue
            with pytest.raises(BenchError):
                ask(f"{rig.url}{path}", method, b"{}" if method != "GET" else None, token=token)


def test_a_slow_client_holds_up_nobody_and_is_let_go(rig, monkeypatch):
    monkeypatch.setattr(start, "IDLE", 0.5)
    token = rig.admit("eve")
    host, port = rig.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as slow:
        slow.sendall(
            f"POST /runs HTTP/1.1\r\nHost: {host}:{port}\r\nAuthorization: Bearer {token}\r\n"
            "Content-Length: 900000\r\n\r\n[0,".encode()
        )
        begun = time.monotonic()
        assert json.loads(ask(f"{rig.url}/me", token=token)) == {"id": "eve"}
        assert time.monotonic() - begun < 5
        slow.settimeout(10)
        assert slow.recv(100) == b""


# --- who goes away ----------------------------------------------------------------------------------------------------


def waiting(rig):
    return [one for one in rig.queue.overview()["queue"] if one["state"] == "waiting"]


def test_stop_withdraws_a_run_that_waits(entered):
    bench = entered.bench()
    entered.queue.pause("by a test")
    with bench:
        run = Running(bench, lambda one: experiments.tracking(one, K))
        run.start()
        until(lambda: waiting(entered))
        run.stop()
        assert run.wait(20)
    assert isinstance(run.error, RunStopped)
    assert not waiting(entered)


def test_stop_stops_the_bench_too(rig, monkeypatch):
    rig.work(bench=f"{BENCH}&clock=wall")
    rig.enter(monkeypatch)
    with rig.bench() as bench:
        run = Running(bench, lambda one: experiments.sweep(one, duration=50.0))
        run.start()
        [number] = until(lambda: [one["id"] for one in rig.queue.overview()["queue"] if one["state"] == "running"])
        run.stop()
        assert run.wait(30)
    assert rig.queue.status("ada", number)["error"] == "RunStopped"
    assert rig.queue.recorded() == {}


STUDENT = """
import sys
from rotflex import experiments, hil
with hil.open("rig:" + sys.argv[1]) as bench:
    recording = experiments.tracking(bench, (18.2356, -17.1547, 1.5893, 0.6327), duration=4.0, progress=False)
import hashlib
print("RECORDED", hashlib.sha256(recording["alpha"].tobytes()).hexdigest())
"""


def student(rig):
    words = [sys.executable, "-c", STUDENT, rig.url]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_ctrl_c_withdraws_it_too_and_a_program_that_was_killed_finds_its_run_again(entered):
    entered.bench()
    entered.queue.pause("by a test")
    program = student(entered)
    until(lambda: waiting(entered))
    time.sleep(0.5)
    program.send_signal(signal.SIGINT)
    program.wait(20)
    assert not waiting(entered)
    program = student(entered)
    [first] = until(lambda: waiting(entered))
    program.kill()
    program.wait()
    assert waiting(entered) == [first]
    entered.queue.pause("")
    until(lambda: entered.queue.status("ada", first["id"])["state"] == "done")
    said = student(entered).communicate(timeout=60)[0]
    recorded = request.recording_of_bytes(entered.queue.recording("ada", first["id"]))
    assert said.split()[-1] == hashlib.sha256(recorded["alpha"].tobytes()).hexdigest()
    assert len(entered.queue.recorded()) == 1


def test_a_lost_connection_costs_nothing(tmp_path, monkeypatch):
    """The server is away while a run waits and while it is on the bench; student and worker ask again."""
    rig = Rig(tmp_path / "rig", apart=True)
    port = rig.free_port()
    served = rig.serve_apart(port)
    try:
        rig.work()
        rig.enter(monkeypatch)
        rig.bench()
        program = student(rig)
        for _each in range(3):
            time.sleep(0.7)
            served.kill()
            served.wait()
            time.sleep(0.5)
            served = rig.serve_apart(port)
        assert "RECORDED" in program.communicate(timeout=60)[0]
        assert len(rig.queue.recorded()) == 1
    finally:
        served.kill()
        for worker in rig.workers:
            worker.kill()


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed (apt-get install openssl)")
def test_with_a_certificate_all_goes_by_tls(tmp_path, monkeypatch):
    certificate, key = str(tmp_path / "cert.pem"), str(tmp_path / "key.pem")
    kind = ("-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2")
    names = ("-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost")
    made = ["openssl", "req", *kind, *names, "-keyout", key, "-out", certificate]
    subprocess.run(made, check=True, capture_output=True)
    rig = Rig(tmp_path / "rig", apart=True)
    port = rig.free_port()
    url = f"https://localhost:{port}"
    served = rig.serve_apart(port, "--url", url, "--certificate", certificate, "--private-key", key)
    rig.url = url
    monkeypatch.setenv("SSL_CERT_FILE", certificate)
    try:
        rig.work()
        rig.enter(monkeypatch)
        rig.bench()
        assert "RECORDED" in student(rig).communicate(timeout=60)[0]
        monkeypatch.delenv("SSL_CERT_FILE")  # then nobody vouches for this server
        with pytest.raises(BenchError, match="certificate"):
            hil.open(f"rig:{url}")
    finally:
        for program in (served, *rig.workers):
            program.kill()


def test_a_second_worker_on_this_computer_ends_and_says_why(entered):
    entered.bench()
    second = entered.work()
    said = second.communicate(timeout=60)[0]
    assert second.returncode == 2 and "One bench has one worker" in said
    assert entered.workers[0].poll() is None


def test_a_second_worker_on_another_computer_ends_too(entered, tmp_path):
    entered.bench()
    second = entered.work(ROTFLEX_CONFIG_DIR=str(tmp_path / "elsewhere"))
    said = second.communicate(timeout=60)[0]
    assert second.returncode == 2 and "One bench has one worker" in said
    assert entered.workers[0].poll() is None


# --- tokens -----------------------------------------------------------------------------------------------------------


def test_a_token_is_in_a_private_file_and_in_no_recording(rig, monkeypatch, tmp_path, capsys):
    token = rig.admit("ada")
    rig.work()
    monkeypatch.setattr(address.getpass, "getpass", lambda _prompt: token)
    with pytest.raises(BenchError, match="login"):
        hil.open(f"rig:{rig.url}")
    until(rig.knows_its_bench)
    address.login(rig.url)
    kept = keep_token("https://another.school.edu", "another")
    assert os.name == "nt" or kept.stat().st_mode & 0o777 == 0o600
    with hil.open(f"rig:{rig.url}") as bench:
        made = experiments.tracking(bench, K, duration=3.1)
    path = made.save(tmp_path / "run.mat")
    assert token not in capsys.readouterr().out + json.dumps(made.metadata)
    assert token.encode() not in path.read_bytes()


@pytest.mark.parametrize("token", ["rig-a\r\nHost: x", "rig a", "rig-ä", "=1"])
def test_what_is_no_token_is_sent_nowhere_and_shown_nowhere(rig, monkeypatch, token):
    monkeypatch.setenv(TOKEN_VARIABLE, token)
    with pytest.raises(BenchError) as refused:
        hil.open(f"rig:{rig.url}")
    assert token not in str(refused.value)
    monkeypatch.setenv(TOKEN_VARIABLE, f" {rig.admit('ada')}\r\n")  # as it is copied from a file
    assert ask(f"{rig.url}/me") == b'{"id":"ada"}'


@pytest.mark.parametrize("url", ["http://rig.school.edu", "https://", "ftp://rig", "https://a:b@rig", "rig.school.edu"])
def test_no_token_goes_where_others_read_it(monkeypatch, url):
    monkeypatch.setenv(TOKEN_VARIABLE, "secret")
    with pytest.raises(BenchError):
        hil.open(f"rig:{url}")
