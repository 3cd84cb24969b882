"""The bench console without a page: runs, stops, and always 0 V in the end."""

import asyncio
import subprocess
import sys
import threading
import time
from itertools import count

import numpy as np
import pytest
from explorer_events import control

from rotflex import experiments, hil, widgets
from rotflex.errors import BenchError, HILError, RecordingError
from rotflex.hil.bench import Measurement, Recorder
from rotflex.hil.virtual import VirtualBoard, WallClock
from rotflex.recording import PUSHED, Recording
from rotflex.simulation import with_actuator
from rotflex.widgets import console as console_module
from rotflex.widgets.console import BenchConsole
from rotflex.widgets.running import Running, outcome

K = [18.2, -17.2, 1.59, 0.633]


@pytest.fixture
def console(lab):
    made = BenchConsole(lab, K, addresses=["virtual:?seed=7"])
    yield made
    made.close()


@pytest.fixture
def live(lab):
    """Return a console connected to a virtual bench in real time, ready to start a sweep."""
    made = BenchConsole(lab, K, addresses=["virtual:?clock=wall"])
    made.set("address", "virtual:?clock=wall")
    made.press("connect")
    made.set("experiment", "sweep")
    yield made
    made.close()


def event(console, kind, name="", **more):
    console.receive({"kind": kind, "name": name, "view": "page", "n": 1, **more})


def rows(console, title):
    found = next(one for one in console.scene["readouts"] if one["title"] == title)
    return {row["label"]: row["values"] for row in found["rows"]}


def wait_until(condition, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def output(bench):
    return bench.board.terminals.commanded[0]


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("sweep", experiments.sweep),
        ("tracking, partial state", lambda bench, **quiet: experiments.tracking(bench, K, "partial", **quiet)),
        ("watch", experiments.watch),
    ],
)
def test_the_console_records_what_the_plain_function_records(console, lab, name, plain):
    console.connect()
    event(console, "set", "experiment", value=name)
    event(console, "press", "start")
    with lab.bench() as bench:
        expected = plain(bench, progress=False)
    for channel in ("theta", "alpha", "vm"):
        assert (console.recording[channel] == expected[channel]).all()
    assert rows(console, "State")["state"] == ["finished"]
    assert console.scene["play"]["duration"] == pytest.approx(expected.time[-1])
    assert output(console._bench) == 0.0


@pytest.mark.parametrize("paced", [True, False])
def test_stop_ends_a_run_within_50_samples_and_leaves_0_volts(console, live, paced):
    bench = (console if paced else live)._lab.bench("virtual" if paced else live.address)
    with bench:
        run = Running(bench, lambda bench: experiments.sweep(bench, progress=False), paced=paced)
        run.start()
        wait_until(lambda: run.samples().shape[1] > 300 and np.abs(run.samples()[3, -50:]).max() > 0)
        before = run.samples().shape[1]
        run.stop()
        assert run.wait(30)
        assert run.samples().shape[1] - before <= 50
        assert outcome(run)[0] == "stopped" and "0 V" in outcome(run)[1]
        assert output(bench) == 0.0
        assert run.recording is None and run.at_zero is not None


def test_a_run_whose_page_is_gone_stops_itself_and_says_where_its_samples_are(live, monkeypatch, tmp_path):
    live._bench.recorder = Recorder(tmp_path / "unfinished")
    live.set("experiment", "watch")  # it waits for no rest
    live.hear({"kind": "alive"})  # a page has spoken, and says no more
    monkeypatch.setattr(console_module, "_SILENCE", 60.0)  # however busy the computer is, there are samples before
    heard, samples = live._alive, count()

    def alive():
        if next(samples) == 100:
            live._last_message -= 61.0
        return heard()

    monkeypatch.setattr(live, "_alive", alive)
    live.start()
    assert live._state == "stopped" and "Nothing was heard of the page" in live._message
    (path,) = (tmp_path / "unfinished").glob("*.mat")
    assert str(path) in live._message and "RunStopped" in Recording.load(path).metadata["ended"]
    assert output(live._bench) == 0.0


def test_in_an_event_loop_the_kernel_stays_free_and_frames_come(lab):
    async def scenario():
        live = BenchConsole(lab, K)
        live.press("connect")
        live.set("experiment", "sweep")
        before = live.scene["version"]
        live.press("start")
        assert live.running  # start() has returned, and the loop is free
        while live.scene["version"] < before + 10:
            live.hear({"kind": "alive"})
            await asyncio.sleep(0.02)
        assert live.scene["live"] and live.running
        with pytest.raises(BenchError, match="running"):
            live.start()
        event(live, "press", "stop")
        await asyncio.wait_for(live._task, 30)
        assert live._state == "stopped" and not live.scene["live"]
        live.close()

    asyncio.run(scenario())


def test_messages_from_another_thread_are_heard_on_the_kernels_loop(lab):
    """JupyterLab sends them to a subshell, which is a thread of its own; STOP does not wait for the loop."""

    async def scenario():
        live = BenchConsole(lab, K)
        live.press("connect")
        live.set("experiment", "sweep")
        here = threading.get_ident()
        heard = []
        receive = live.receive
        live.receive = lambda content: (heard.append(threading.get_ident()), receive(content))

        def page(name):
            sender = threading.Thread(target=live.hear, args=({"kind": "press", "name": name},))
            sender.start()
            sender.join()

        page("start")
        while not live.running:
            await asyncio.sleep(0.01)
        version = live.scene["version"]
        while live.scene["version"] <= version + 3:
            await asyncio.sleep(0.01)
        page("stop")
        wait_until(lambda: live._run.done)  # the loop is kept busy: the run ends all the same
        assert live._bench.board.terminals.commanded[0] == 0.0
        await asyncio.wait_for(live._task, 30)
        assert set(heard) == {here}
        live.close()

    asyncio.run(scenario())


def test_a_run_that_is_interrupted_in_a_terminal_is_stopped(console, monkeypatch):
    console.connect()
    console.set("experiment", "sweep")

    def interrupted(self, timeout=None):
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(Running, "wait", interrupted)
    with pytest.raises(KeyboardInterrupt):
        console.start()
    assert not console.running and output(console._bench) == 0.0


def test_a_board_that_fails_at_the_stop_does_not_hang_the_console(console, monkeypatch):
    console.connect()

    def broken():
        raise OSError("cable")

    monkeypatch.setattr(console._bench, "stop", broken)
    event(console, "press", "start")
    assert not console.running
    assert rows(console, "State")["state"] == ["NOT AT 0 V"]
    said = rows(console, "State")[""][0]
    assert "cable" in said and "emergency stop" in said and "is at 0 V" not in said
    assert console._run.at_zero is None
    monkeypatch.undo()


def test_of_a_motor_that_may_still_be_driven_it_says_what_its_outcome_says(console, monkeypatch):
    write = VirtualBoard.write_analog

    def refuses_in_the_run(board, channels, number, buffer):
        if console._bench is not None and console._bench.latest.theta:
            raise HILError("It does not answer.")
        write(board, channels, number, buffer)

    monkeypatch.setattr(VirtualBoard, "write_analog", refuses_in_the_run)
    event(console, "press", "start")
    (known,) = {console._run.outcome, console._bench.safety.outcome}
    assert rows(console, "State")["state"] == ["NOT AT 0 V"] and not known.at_zero and known.volts
    assert rows(console, "State")[""][0].startswith(str(known))
    monkeypatch.undo()


def test_a_stop_that_comes_while_the_page_is_asked_for_is_not_lost(console):
    """From another thread, between the two looks of one sample."""
    console.connect()
    run = None

    def alive():
        run.stop("You stopped it.")
        return ""

    run = Running(console._bench, lambda bench: experiments.sweep(bench, progress=False), alive)
    run.start()
    assert run.wait(60)
    assert outcome(run) == ("stopped", "You stopped it. The motor is at 0 V.")
    assert run.samples().shape[1] <= 2


def test_a_run_is_settled_by_its_own_watcher(lab):
    async def scenario():
        live = BenchConsole(lab, K)
        live.set("experiment", "sweep")
        live.connect()
        live.start()
        first = live._task
        live.disconnect()
        live.connect()
        live.start()
        await asyncio.wait_for(first, 30)
        assert live.running and live.scene["live"] and live._state == "running"
        live.stop()
        await asyncio.wait_for(live._task, 30)
        assert live._state == "stopped"
        live.close()

    asyncio.run(scenario())


def test_a_start_that_waited_for_a_busy_python_is_not_carried_out_at_a_bench_that_can_break(live, monkeypatch):
    console = live
    skew = 1e6  # s; the page's clock may be another's
    now = 1000 * (time.time() - skew)
    event(console, "set", "experiment", value="free decay", at=now)
    event(console, "press", "start", at=now - 30_000)
    assert console._run is None
    assert "Do it again" in rows(console, "State")[""][0]
    live.set("experiment", "watch")
    monkeypatch.setattr(live, "_experiment", lambda: lambda bench: experiments.watch(bench, 0.1, progress=False))
    event(console, "press", "start", at=1000 * (time.time() - skew))
    assert console._run is not None


def test_closing_the_widget_stops_the_run_and_lets_go_of_the_bench(live):
    live._run = Running(live._bench, live._experiment())
    live._run.start()
    wait_until(lambda: live._run.samples().shape[1] > 50)
    bench, board = live._bench, live._bench.board
    live.close()
    assert live._run.done and board.terminals.commanded[0] == 0.0 and not board.is_valid()
    with pytest.raises(BenchError):
        _ = bench.board


ENDING = """
import sys, time
import rotflex.course.lab
from rotflex.hil import virtual
from rotflex.widgets.console import BenchConsole
from rotflex.widgets.running import Running

written = []
write = virtual.VirtualBoard.write_analog
def noted(self, channels, count, buffer):
    write(self, channels, count, buffer)
    written.append(float(buffer[0]))
virtual.VirtualBoard.write_analog = noted
lab = rotflex.course.lab.start("ada", folder=sys.argv[1], quiet=True)
console = BenchConsole(lab, [18.2, -17.2, 1.59, 0.633])
console.connect()
console.set("experiment", "sweep")
console._run = Running(console._bench, console._experiment())
console._run.start()
while not any(written[-20:]):
    time.sleep(0.01)
board, disconnect = console._bench.board, console.disconnect
def told():
    disconnect()
    print("last", written[-1], board.is_valid(), flush=True)
console.disconnect = told  # what the end of the program calls
"""


def test_a_kernel_that_ends_leaves_0_volts(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", ENDING, str(tmp_path)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout.splitlines()[-1:] == ["last 0.0 False"], done.stderr


def test_missed_deadlines_are_counted_and_told(live, monkeypatch):
    def slow(self, instant):
        remaining = instant - self.now()
        time.sleep(max(remaining, 0) + (0.05 if 0.1 < instant % 0.5 < 0.11 else 0))

    monkeypatch.setattr(WallClock, "wait_until", slow)
    live.set("experiment", "watch")
    run = Running(live._bench, lambda bench: experiments.watch(bench, 1.0, progress=False))
    run.start()
    assert run.wait(30)
    assert run.late > 5
    live._run = run
    live._settle()
    live.refresh()
    assert rows(live, "State")["missed deadlines"] == [f"{run.late} of {run.samples().shape[1]} samples"]


def test_what_came_late_before_an_experiment_is_none_of_its_own(live):
    run = Running(live._bench, lambda bench: None)
    run.late = 7
    run._note(Measurement(0.0, 0.0, 0.0), 0.0)
    assert run.late == 0


def test_what_goes_wrong_on_the_bench_is_told_in_words(console):
    console.connect()
    console._bench.safety.limits = type(console._bench.safety.limits)(theta=0.02)
    event(console, "press", "start")
    assert rows(console, "State")["state"] == ["ended"]
    assert "servo angle reached" in " ".join(map(str, rows(console, "State").values()))
    assert output(console._bench) == 0.0


def test_one_press_of_start_makes_a_virtual_bench_move_and_its_time_waits(console):
    before, threads = sys.getswitchinterval(), threading.active_count()
    names = {one["name"] for row in console.scene["controls"] for one in row}
    assert not {"connect", "disconnect"} & names and "missed deadlines" not in rows(console, "State")
    assert not control(console, "start")["disabled"] and control(console, "start")["look"] == "main"
    event(console, "press", "start")
    assert np.ptp(console.recording["alpha"]) > 0.1
    assert rows(console, "State")["state"] == ["finished"] and output(console._bench) == 0.0
    assert console._run.late == 0
    assert sys.getswitchinterval() == before  # and the interpreter is as it was
    wait_until(lambda: threading.active_count() <= threads)


def test_a_real_bench_is_connected_on_purpose_before_it_moves_and_what_is_not_there_is_told(lab, monkeypatch):
    monkeypatch.setitem(sys.modules, "quanser.hardware", None)
    console = BenchConsole(lab, addresses=["quanser:q2_usb/0", "labjack:u3"])
    console.set("address", "quanser:q2_usb/0")
    console.refresh()
    assert control(console, "start")["disabled"]
    assert control(console, "connect")["look"] == "main"
    for address, pressed, named in (
        ("quanser:q2_usb/0", "start", "Connect the bench"),
        ("quanser:q2_usb/0", "connect", "Quanser SDK"),
        ("labjack:u3", "connect", "labjack"),
    ):
        console.set("address", address)
        event(console, "press", pressed)
        assert named in console.scene["notice"]["text"]
    event(console, "set", "address", value="made up")
    assert console.address == "labjack:u3"
    with pytest.raises(RecordingError):
        BenchConsole(lab, addresses=["replay:nothing.mat"]).set("address", "replay:nothing.mat")


def test_a_validation_runs_a_model_beside_the_bench_and_shows_both(lab):
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 600, -35, 0], [0, -1000, 35, 0]])
    B = np.array([[0], [0], [60], [-60]])
    console = BenchConsole(lab, experiment="validation", model=(A, B))
    console.start()
    with lab.bench() as bench:
        expected = experiments.validation(bench, A, B, progress=False)
    assert (console.recording["alpha_model"] == expected["alpha_model"]).all()
    lines = [item for panel in console.view().columns[1].panels for item in panel.items if item["kind"] == "line"]
    assert [line["label"] for line in lines if line["role"] == "model"] == ["your model"] * 2
    console.close()


def test_a_validation_takes_the_answered_model_with_the_actuator_added(lab):
    console = BenchConsole(lab, experiment="validation")
    event(console, "press", "start")
    assert "answer question 2.14 first" in console.scene["notice"]["text"] and console.recording is None
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 600, -1.9, 0], [0, -1000, 1.9, 0]])
    B = np.array([[0], [0], [480], [-480]])
    lab.record("2.14", A=A, B=B)
    event(console, "press", "start")
    with lab.bench() as bench:
        expected = experiments.validation(bench, *with_actuator(A, B, lab.servo), progress=False)
    assert (console.recording["theta_model"] == expected["theta_model"]).all()
    console.close()


def test_tracking_needs_a_gain(lab):
    console = BenchConsole(lab)
    console.set("experiment", "tracking, full state")
    event(console, "press", "start")
    assert "question 3.8" in console.scene["notice"]["text"]
    lab.record("3.8", K=np.array([K]))
    event(console, "press", "start")
    assert console.recording is not None
    console.close()


def test_a_replay_shows_the_voltage_that_was_recorded_then(console, lab, tmp_path):
    console.connect()
    console.start()
    first = console.recording
    event(console, "set", "experiment", value="sweep")  # what is chosen next does not name what was recorded
    event(console, "press", "save")
    assert "console_free_decay.mat" in console.scene["notice"]["text"]
    replay = BenchConsole(lab, addresses=["replay:console_free_decay.mat"])
    replay.set("address", "replay:console_free_decay.mat")
    replay.connect()
    for _ in range(2):  # and from its beginning, however often
        replay.start()
        assert np.abs(replay.recording["alpha"] - first["alpha"]).max() <= 0.51 * replay._bench.servo.K_enc
        assert replay.recording["vm"] == pytest.approx(first["vm"], abs=1e-9)
    replay.close()


def grab(console, **more):
    event(console, "grab", "arm", **more)


def grabs(console):
    return [one["name"] for one in console.view().packed()[0]["columns"][0]["panels"][0]["grabs"]]


def test_an_arm_that_is_grabbed_begins_to_be_held_swings_and_can_be_played_again(lab):
    async def scenario():
        live = BenchConsole(lab, K)
        grab(live, x=-0.6, y=0.6)  # of a pull whose beginning was not heard
        assert not live.running
        begun = time.perf_counter()
        grab(live, x=-0.6, y=0.6, begins=True)
        while np.abs(live._run.samples()[2]).max(initial=0) < 0.1:
            grab(live, x=-0.6, y=0.6)
            await asyncio.sleep(0.02)
            assert live._run.samples()[0, -1:].max(initial=0) <= time.perf_counter() - begun  # never ahead
        grab(live)
        while live._run.samples()[2, -1] > -0.02:  # to the other side
            await asyncio.sleep(0.02)
        live.stop()
        await asyncio.wait_for(live._task, 30)
        stopped, live_bench = live._bench.recorder.unfinished, live._bench
        assert live.choice == "hold" and live_bench.board.plant.torque == 0.0
        live.close()
        return stopped

    stopped = asyncio.run(scenario())
    with hil.open("virtual", seed=lab.seed, disturbance=stopped[PUSHED]) as bench:
        again = experiments.hold(bench, float(stopped.time[-1]), progress=False)
    assert (again["alpha"][: len(stopped)] == stopped["alpha"]).all() and stopped["alpha"].max() > 0.1


def test_a_hand_stays_while_its_page_is_heard_and_lets_go_when_it_is_not(lab, monkeypatch):
    monkeypatch.setattr(console_module, "_SILENCE", 60.0)  # however busy the computer is

    async def scenario():
        live, held = BenchConsole(lab, K), []
        live.hear({"kind": "alive"})
        grab(live, x=-0.6, y=0.6, begins=True)
        begun = live._run.samples()[0].size

        async def until(condition):
            while not condition():
                assert not live._run.done
                await asyncio.sleep(0.02)

        await until(lambda: live._run.samples()[0].size > begun + 250)  # half a second without a word
        held.append(live._hand._pull)
        live._last_message -= 61.0
        await until(lambda: live._hand._pull is None)
        grab(live, x=-0.6, y=0.6)
        held.append(live._hand._pull)
        live.hear({"kind": "grab", "name": "arm"})  # heard before the kernel's loop is free
        held.append(live._hand._pull)
        assert not live._run.done  # nothing can break
        live.stop()
        await asyncio.wait_for(live._task, 30)
        live.close()
        return held

    first, again, released = asyncio.run(scenario())
    assert first == again == pytest.approx(np.pi / 4) and released is None


def test_a_pull_that_waited_for_a_busy_python_begins_nothing_and_is_said(lab):
    console = BenchConsole(lab, K)
    now = 1000 * time.time()
    event(console, "alive", at=now)
    event(console, "grab", "arm", x=-0.6, y=0.6, begins=True, at=now - 5000)
    assert not console.running and "The arm was pulled 5 s ago" in rows(console, "State")[""][0]


def test_only_the_arm_of_a_bench_in_simulated_time_can_be_grabbed(lab, live, tmp_path):
    assert grabs(BenchConsole(lab)) == ["arm"] and grabs(live) == []
    with lab.bench() as bench:
        path = experiments.hold(bench, duration=0.1, progress=False).save(tmp_path / "held.mat")
    replay = BenchConsole(lab, addresses=[f"replay:{path}"])
    replay.set("address", f"replay:{path}")
    assert grabs(replay) == []


def offered(console):
    return [value for value, _text in control(console, "experiment")["options"]]


def test_a_controller_is_felt_on_a_practice_bench_until_the_students_own_may_be_seen(lab):
    lab.answer("3.8", K=[K])
    felt = widgets.feel_controller(lab)
    assert offered(felt) == ["tracking, full state", "hold", "watch"] and "practice" in str(rows(felt, "State"))
    felt.start()
    about = felt.recording.metadata
    assert about["bench"]["seed"] != lab.seed and "K" not in about
    lab.predict("3.13", largest_deflection_deg=10.0)
    own = widgets.feel_controller(lab)
    own.start()
    assert own.recording.metadata["bench"]["seed"] == lab.seed
    assert own.recording.metadata["K"] == pytest.approx(K) and offered(own) == offered(felt)
    lab.predict("3.15", arm_swings="longer")
    assert "tracking, partial state" in offered(widgets.feel_controller(lab))


def test_a_recording_with_a_push_is_no_answer_and_says_when_and_how_much(lab):
    push = np.zeros(2000)
    push[500:600] = -0.2
    with hil.open("virtual", seed=lab.seed, disturbance=push) as bench:
        pushed = experiments.tracking(bench, K, progress=False)
    (line,) = lab.record("3.13", response=pushed)
    assert "not recorded" in line and "a push of your hand in it, -0.2 N·m at 1.00 s: record it again" in line
    assert not lab.has("3.13", "response")
    lab.answer("3.13", response=pushed.between(2.0, 5.0))
    assert lab.has("3.13", "response")
