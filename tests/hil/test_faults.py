"""What goes wrong on a bench, one thing after the other: 0 V, nothing recorded lost, and the reason beside it.

Each fault comes in the middle of a run in closed loop, on a bench that can come to harm. Time is the test's own.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import re
import signal
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from fault_board import FAULT_AT, FOR_GOOD, SAMPLE_TIME, FaultBoard, bench_of, counts_of, failing

from rotflex.errors import BenchError, DesignError, HILError, LimitExceeded, MotorNotStopped, RunStopped
from rotflex.hil.bench import Bench, Limits, Outcome, Wiring
from rotflex.hil.board import WATCHDOG_TIMEOUT
from rotflex.hil.controllers import OpenLoop, StateFeedback
from rotflex.hil.loop import run
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.units import DEG

GAIN = [18.24, -17.15, 1.59, 0.63]
SAMPLES = 600
#: Turns at 0.25 s, so that the arm is in full motion at the fault.
REFERENCE = smooth_square_wave(time_axis((SAMPLES - 1) * SAMPLE_TIME, SAMPLE_TIME), 2.0, 20 * DEG, 100.0)


class Faulty(StateFeedback):
    """State feedback to which something happens at a sample."""

    def __init__(self, at: int, happens: Callable[[float], Any], until: int | None = None) -> None:
        super().__init__(GAIN)
        self.at, self.until, self.happens, self.sample = at, until or at, happens, -1

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        self.sample += 1
        voltage = super().__call__(reference, theta, alpha)
        return self.happens(voltage) if self.at <= self.sample <= self.until else voltage


def raising(error: BaseException) -> Callable[[Any], Any]:
    def happens(_value: Any) -> Any:
        raise error

    return happens


@dataclass(frozen=True)
class Fault:
    """One thing that goes wrong."""

    #: What is raised, and what the recording says; None where the run goes on.
    error: type[BaseException] | tuple[type[BaseException], ...] | None
    reason: str
    board: Callable[[FaultBoard], None] = lambda board: None
    controller: Callable[[FaultBoard], Any] = lambda board: StateFeedback(GAIN)
    bench: dict[str, Any] = field(default_factory=dict)
    prepare: Callable[[Bench], None] = lambda bench: None
    within: int = 1  # samples of motion that may pass from the fault to its discovery
    watchdog: bool = False  # whether the board's watchdog is what sets 0 V
    left: bool = False  # whether 0 V cannot be written in the end


def spoiled(**verbs: Callable[[int], None]) -> Callable[[FaultBoard], None]:
    return lambda board: board.before.update(verbs)


def unplugged(board: FaultBoard) -> None:
    def pull(sample: int) -> None:
        board.unplugged = board.unplugged or sample >= FAULT_AT

    board.before["task_read_encoder"] = pull


def short(came: int) -> Callable[[FaultBoard], None]:
    def prepare(board: FaultBoard) -> None:
        board.came = lambda sample: came if sample > FAULT_AT else None

    return prepare


def reading(spoil: Callable[[list[int], list[int], int], list[int]]) -> Callable[[FaultBoard], None]:
    """A board whose counts are spoiled from the fault on; ``spoil`` is given the last right ones, too."""

    def prepare(board: FaultBoard) -> None:
        last = [0, 0]

        def read(counts: list[int], sample: int) -> list[int]:
            if sample < FAULT_AT:
                last[:] = counts
                return counts
            return spoil(counts, last, sample)

        board.spoil = read

    return prepare


def paused(pause: float, until: int | None = None) -> Callable[[FaultBoard], Any]:
    """A controller that takes so long once, or until a sample."""

    def make(board: FaultBoard) -> Any:
        def happens(voltage: float) -> float:
            board.time.pass_by(pause)
            return voltage

        return Faulty(FAULT_AT, happens, until)

    return make


def watched_by(error: BaseException | Callable[[], None]) -> Callable[[Bench], None]:
    """Somebody who watches the run, and raises or does something."""

    def on_sample(measured: Any, _voltage: float) -> None:
        if measured.time >= FAULT_AT * SAMPLE_TIME:
            if not isinstance(error, BaseException):
                return error()
            raise error
        return None

    return lambda bench: setattr(bench, "on_sample", on_sample)


def at_fault(happens: Callable[[float], Any]) -> Callable[[FaultBoard], Any]:
    return lambda board: Faulty(FAULT_AT, happens)


def gone(board: FaultBoard) -> None:
    """The board closes under the loop."""
    board.before["task_read_encoder"] = lambda sample: board.inner.close() if sample >= FAULT_AT else None


FIRST = at_fault(raising(ValueError("first")))
FAULTS: dict[str, Fault] = {
    "nothing": Fault(None, ""),
    **{
        f"{error!r} in the controller": Fault(type(error), type(error).__name__, controller=at_fault(raising(error)))
        for error in (ZeroDivisionError("by nought"), KeyboardInterrupt(), SystemExit())
    },
    "a voltage that is no number": Fault(BenchError, "asked for nan V", controller=at_fault(lambda _: math.nan)),
    "a voltage without end": Fault(BenchError, "asked for inf V", controller=at_fault(lambda _: math.inf)),
    "a voltage that is None": Fault(DesignError, "returned None", controller=at_fault(lambda _: None)),
    "an exception in a callback": Fault(LookupError, "LookupError: where", prepare=watched_by(LookupError("where"))),
    "somebody presses STOP": Fault(
        RunStopped, "RunStopped: You", prepare=watched_by(RunStopped("You stopped it. The motor is at 0 V."))
    ),
    **{
        f"Ctrl-C in {verb}": Fault(
            KeyboardInterrupt, "KeyboardInterrupt", spoiled(**{verb: failing(FAULT_AT, KeyboardInterrupt())})
        )
        for verb in ("task_read_encoder", "write_analog")
    },
    "Ctrl-C again while the motor is stopped": Fault(
        KeyboardInterrupt, "ValueError", spoiled(watchdog_clear=failing(FAULT_AT, KeyboardInterrupt())), FIRST
    ),
    **{
        f"{name} ends the program": Fault(
            SystemExit,
            f"{name} ended",
            prepare=watched_by(lambda name=name: signal.raise_signal(getattr(signal, name))),
        )
        for name in ("SIGTERM", "SIGHUP")
        if hasattr(signal, name)
    },
    "reading fails": Fault(HILError, "the board refused", board=spoiled(task_read_encoder=failing(FAULT_AT))),
    "writing fails once": Fault(HILError, "the board refused", board=spoiled(write_analog=failing(FAULT_AT))),
    "writing fails for good": Fault(
        HILError,
        "the board refused",
        board=spoiled(write_analog=failing(FAULT_AT, times=FOR_GOOD)),
        watchdog=True,
        left=True,
    ),
    "reloading fails": Fault(HILError, "the board refused", board=spoiled(watchdog_reload=failing(FAULT_AT))),
    **{
        f"{verb} fails in the end": Fault(
            HILError, "ValueError: first", spoiled(**{verb: failing(FAULT_AT, times=FOR_GOOD)}), FIRST
        )
        for verb in ("watchdog_clear", "watchdog_stop", "task_stop", "task_delete")
    },
    "the cable is pulled": Fault(HILError, "does not answer", board=unplugged, watchdog=True, left=True),
    "the board is gone": Fault(HILError, "closed", board=gone, watchdog=True, left=True),
    **{
        f"{name} for one sample": Fault(HILError, "gave no sample", board=short(came))
        for name, came in {"nothing": 0, "an error's number": -1}.items()
    },
    "the servo's counts freeze": Fault(
        LimitExceeded, "stood still for", board=reading(lambda new, last, _: [last[0], new[1]]), within=50
    ),
    "the link's counts freeze": Fault(
        LimitExceeded, "voltage and spring", board=reading(lambda new, last, _: [new[0], last[1]]), within=150
    ),
    "the servo's counts jump": Fault(
        LimitExceeded,
        r"servo angle jumped by (19|2\d)\.\d deg",
        board=reading(lambda new, last, _: [new[0] + counts_of(20), new[1]]),
    ),
    "the link's counts jump": Fault(
        LimitExceeded,
        r"deflection jumped by -1\d\.\d deg",
        board=reading(lambda new, last, _: [new[0], new[1] + counts_of(15)]),
    ),
    "the servo's encoder turns round": Fault(
        LimitExceeded,
        "voltage and spring",
        board=reading(lambda new, last, _: [2 * last[0] - new[0], new[1]]),
        within=50,
    ),
    "the link's encoder turns round": Fault(
        LimitExceeded,
        "voltage and spring|deflection reached",
        board=reading(lambda new, last, _: [new[0], 2 * last[1] - new[1]]),
        within=150,
    ),
    "the limit of the rate": Fault(
        LimitExceeded, r"turned at .*limit is ±2\.0 rad/s", bench={"limits": Limits(rate=2.0)}, within=SAMPLES
    ),
    "the limit of the duration": Fault(
        LimitExceeded, "bench allows", bench={"limits": Limits(duration=0.5)}, within=SAMPLES
    ),
    "the voltage's limit": Fault(None, "", bench={"limits": Limits(voltage=3.0)}),
    "a short pause": Fault(None, "", controller=paused(0.1)),
    "a burst of 20 samples is lost": Fault(None, "", board=lambda board: board.loses.update({FAULT_AT: 20})),
    "a burst of samples is lost, longer than the watchdog's": Fault(
        HILError, "the board was silent", board=lambda board: board.loses.update({FAULT_AT: 110}), watchdog=True
    ),
    "a pause longer than the watchdog's": Fault(HILError, r"0\.2 s", controller=paused(0.3), watchdog=True),
    **{
        f"the controller takes {takes * 1e3:g} ms": Fault(
            (LimitExceeded, HILError), "too slow", controller=paused(takes, SAMPLES), within=SAMPLES, watchdog=True
        )
        for takes in (0.003, 0.02)
    },
    "the encoders are swapped": Fault(
        LimitExceeded, "jumped by|voltage and spring", board=reading(lambda new, last, _: new[::-1]), within=50
    ),
}


@pytest.fixture
def survives():
    """Signals that end a program do not end this one."""
    known = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = [signal.signal(number, lambda *_event: None) for number in known]
    yield
    for number, handler in zip(known, before, strict=True):
        signal.signal(number, handler)


@pytest.mark.slow
@pytest.mark.usefixtures("survives")
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_after_a_fault_the_motor_is_at_0_V_and_nothing_recorded_is_lost(fault, tmp_path):
    board = FaultBoard()
    bench = bench_of(board, tmp_path, **fault.bench)
    controller = fault.controller(board)
    with pytest.raises(fault.error) if fault.error else contextlib.nullcontext() as caught, bench:
        fault.prepare(bench)
        fault.board(board)
        recording = run(bench, controller, REFERENCE, SAMPLE_TIME, progress=False)
    if fault.error is None:
        assert len(recording) == SAMPLES
        assert bench.recorder.unfinished is None
        assert not list(tmp_path.iterdir())
    else:
        said = " ".join([str(caught.value), *getattr(caught.value, "__notes__", [])])
        assert caught.value.outcome == bench.safety.outcome and bench.safety.outcome.at_zero is not fault.left
        assert said.startswith("The motor may still be at ") if fault.left else "The motor is at 0 V." in said
        recording = bench.recorder.unfinished
        assert_kept(recording, fault)
        (file,) = tmp_path.iterdir()
        saved = Recording.load(file)
        assert file == bench.recorder.unfinished_file and str(file) in said
        assert saved.metadata == recording.metadata
        for name in ("theta", "alpha", "vm"):
            np.testing.assert_allclose(saved[name], recording[name], rtol=1e-12, atol=1e-15)
    if fault.watchdog:
        board.let_time_pass()
    assert board.voltage == 0.0
    assert recording.metadata["timing"]["clock"] == "hardware"


@functools.cache
def undisturbed_run() -> Recording:
    """The run to which nothing happens."""
    with bench_of(FaultBoard()) as bench:
        return run(bench, StateFeedback(GAIN), REFERENCE, SAMPLE_TIME, progress=False)


def assert_kept(recording: Recording | None, fault: Fault) -> None:
    """All that was sampled until the fault is there, with the reason, and what was set last was 0 V or held."""
    assert recording is not None
    assert re.search(fault.reason, recording.metadata["ended"])
    if fault.within < SAMPLES:
        assert FAULT_AT <= len(recording) <= FAULT_AT + 1 + fault.within
    same = min(len(recording), FAULT_AT)
    for name in ("theta", "alpha"):
        assert recording[name][:same].tolist() == undisturbed_run()[name][:same].tolist()


@pytest.mark.parametrize("verb", ["read_encoder", "watchdog_start", "task_start", "watchdog_clear", "watchdog_stop"])
def test_a_run_that_does_not_begin_leaves_0_V_and_no_file(verb, tmp_path):
    board = FaultBoard()
    with pytest.raises(HILError, match="refused"), bench_of(board, tmp_path) as bench:
        board.before[verb] = failing()
        run(bench, OpenLoop(), REFERENCE, SAMPLE_TIME, progress=False)
    assert board.voltage == 0.0
    assert (board.inner.is_valid(), len(board.inner._tasks)) == (False, 0)
    assert board.inner._watchdog.deadline == math.inf
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("verb", ["task_stop", "task_delete", "watchdog_clear", "watchdog_stop"])
def test_a_run_that_is_whole_is_kept_where_the_stop_in_the_end_fails(verb, tmp_path):
    error = KeyboardInterrupt() if verb in ("task_stop", "watchdog_clear") else HILError("the board refused")
    board = FaultBoard()
    with pytest.raises(type(error)) as caught, bench_of(board, tmp_path) as bench:
        board.before[verb] = failing(SAMPLES, error)
        run(bench, StateFeedback(GAIN), REFERENCE, SAMPLE_TIME, progress=False)
    assert board.voltage == 0.0
    assert any(str(bench.recorder.unfinished_file) in note for note in caught.value.__notes__)
    for name in ("theta", "alpha", "vm"):
        assert bench.recorder.unfinished[name].tolist() == undisturbed_run()[name].tolist()
    (saved,) = map(Recording.load, tmp_path.iterdir())
    assert saved.metadata["ended"].startswith(type(error).__name__)
    assert saved["vm"].tolist() == bench.recorder.unfinished["vm"].tolist()


def test_after_a_pause_only_the_newest_sample_is_answered_and_the_others_are_recorded():
    board = FaultBoard()
    written: set[int] = set()
    seen: list[float] = []
    board.before["write_analog"] = lambda sample: written.add(sample - 1)
    with bench_of(board) as bench:
        bench.on_sample = lambda measured, voltage: seen.append(measured.time)
        recording = run(bench, paused(0.15)(board), REFERENCE, SAMPLE_TIME, progress=False)
    late = 75
    timing = recording.metadata["timing"]
    assert timing["late"] == pytest.approx(late, abs=1)
    assert timing["missed"] == 0
    skipped = set(range(SAMPLES)) - written
    assert skipped == set(range(FAULT_AT + 1, FAULT_AT + 1 + timing["late"]))
    assert seen == pytest.approx(recording.time.tolist())  # whoever watches sees each of them, once
    # The angles of the time that nobody answered are those of that time, and the voltage is the one that was held.
    held = recording["vm"][FAULT_AT : FAULT_AT + timing["late"] + 1]
    assert len(set(held.tolist())) == 1
    assert np.count_nonzero(np.diff(recording["theta"][FAULT_AT : FAULT_AT + 20])) > 10


def test_catching_up_after_a_pause_is_a_sign_of_life():
    """The pause and what it takes to look at the samples that were late are longer together than the watchdog waits."""
    board = FaultBoard()
    bench = bench_of(board)

    def look(_measured: Any, _voltage: float) -> None:
        board.time.pass_by(0.001 if bench.late else 0.0)

    with bench:
        bench.on_sample = look
        recording = run(bench, paused(0.15)(board), REFERENCE, SAMPLE_TIME, progress=False)
    assert len(recording) == SAMPLES
    assert 100 < recording.metadata["timing"]["late"] < 200
    # Voltages are those that were written by then, or within a period, also where answers came after other samples;
    # but for a few where it has nearly caught up.
    times, volts = np.array(board.written).T
    by_then, soon = (
        volts[np.searchsorted(times - times[0], recording.time + later) - 1] for later in (1e-6, SAMPLE_TIME + 1e-6)
    )
    assert ((recording["vm"] == by_then) | (recording["vm"] == soon)).mean() > 0.99


def test_stale_samples_at_the_start_are_read_and_no_part_of_the_run():
    board = FaultBoard()
    with bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        board.time.pass_by(0.1)
        first = bench.read()
        assert (first.time, bench.late) == (0.0, [])
        assert board.sample == 52  # 0 to 100 ms, and the one after them
        assert bench.read().time == SAMPLE_TIME
        assert bench.late == []
        assert bench.timing["timing"]["late"] == 0


#: 10 s in which the answer to each sample is another voltage.
LONG = smooth_square_wave(time_axis(10.0, SAMPLE_TIME), 2.0, 20 * DEG, 100.0) + np.linspace(0.0, 0.1, 5001)


@pytest.mark.parametrize(("lost", "at"), [(1, 1000), (20, 1001), (50, 1000)])
def test_after_a_burst_of_lost_samples_each_sample_is_answered_as_before(lost, at):
    board = FaultBoard()
    board.loses[at] = lost
    with bench_of(board) as bench:
        recording = run(bench, StateFeedback(GAIN), LONG, SAMPLE_TIME, progress=False)
    timing = recording.metadata["timing"]
    assert (timing["missed"], timing["lost"], timing["late"]) == (lost, [[at, lost]], 2)
    assert timing["held"] == [[at, lost + 2]]
    assert np.unique(recording["vm"][-1000:]).size >= 998
    assert recording.time[-1] + 1e-9 >= board.time.now()  # what is recorded at the end is of then


@pytest.mark.parametrize(("drift", "jitter"), [(-0.01, 0.3), (0.0045, 0.3)])
def test_a_clock_that_is_not_the_computers_is_measured_and_no_fault(drift, jitter):
    board, rng = FaultBoard(), np.random.default_rng(1)
    bench = bench_of(board)
    bench.connection.now = lambda: (1 + drift) * board.time.now() + jitter * SAMPLE_TIME * rng.random()
    with bench:
        recording = run(bench, StateFeedback(GAIN), LONG, SAMPLE_TIME, progress=False)
    timing = recording.metadata["timing"]
    assert (timing["missed"], timing["late"]) == (0, 0)
    assert timing["drift"] == pytest.approx(drift, abs=2e-5)


def test_pauses_and_lost_samples_are_told_apart_with_a_clock_that_is_not_the_computers():
    board, drift = FaultBoard(), 0.002
    board.loses[3000] = 20
    bench = bench_of(board)
    bench.connection.now = lambda: (1 + drift) * board.time.now()

    def pause(measured: Any, _voltage: float) -> None:
        board.time.pass_by(0.15 if measured.time == 2.0 else 0.0)

    with bench:
        bench.on_sample = pause
        recording = run(bench, StateFeedback(GAIN), LONG, SAMPLE_TIME, progress=False)
    timing = recording.metadata["timing"]
    assert (timing["missed"], timing["late"]) == (20, pytest.approx(74 + 2, abs=1))
    assert timing["drift"] == pytest.approx(drift, abs=2e-5)


def test_a_computer_that_pauses_while_it_fetches_samples_that_wait_has_lost_none():
    board = FaultBoard()
    fetched = itertools.count()
    bench = bench_of(board)

    def preempted(sample: int) -> None:
        if sample > FAULT_AT + 1 and next(fetched) == 10:
            board.time.pass_by(0.7 * SAMPLE_TIME)

    board.before["task_read_encoder"] = preempted
    with bench:
        recording = run(bench, paused(0.15)(board), REFERENCE, SAMPLE_TIME, progress=False)
    assert recording.metadata["timing"]["missed"] == 0
    assert recording.metadata["timing"]["late"] == pytest.approx(75, abs=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signs", "amplitude"),
    [(signs, (5.0, 20.0)[number % 2]) for number, signs in enumerate(itertools.product((1, -1), repeat=3))],
)
def test_a_wrong_sign_is_stopped_within_a_few_degrees(signs, amplitude):
    """Motor, servo's encoder, link's encoder. With all three wrong the bench is its own mirror image, and works."""
    board = FaultBoard()
    motor, servo, link = signs
    wiring = Wiring(motor_sign=motor, servo_sign=servo, link_sign=-link)
    reference = smooth_square_wave(time_axis(2.0, SAMPLE_TIME), 0.25, amplitude * DEG, 100.0)
    if len(set(signs)) == 1:
        with bench_of(board, wiring=wiring) as bench:
            recording = run(bench, StateFeedback(GAIN), reference, SAMPLE_TIME, progress=False)
        assert np.abs(recording["theta"]).max() < 1.1 * amplitude * DEG
        return
    with pytest.raises(LimitExceeded, match="sign"):  # noqa: SIM117
        with bench_of(board, wiring=wiring) as bench:
            run(bench, StateFeedback(GAIN), reference, SAMPLE_TIME, progress=False)
    # Against the command, where servo and motor disagree; with the link alone wrong, hardly beyond the command.
    bound = (6 if motor != servo else amplitude + 2) * DEG
    assert np.abs(bench.recorder.unfinished["theta"]).max() < bound
    assert board.voltage == 0.0


def test_a_voltage_that_the_board_refused_may_be_there_all_the_same():
    board = FaultBoard()
    with pytest.raises(MotorNotStopped) as told, bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        bench.read()
        board.before["write_analog"] = failing(times=FOR_GOOD)
        bench.write(1.5)
    assert told.value.outcome == Outcome(False, 1.5, WATCHDOG_TIMEOUT)


def test_past_its_limit_an_arm_coasts_no_further_than_the_cables_are_to_reach():
    """docs/real_bench.md: three quarters of a turn."""
    for law in (OpenLoop(), StateFeedback([-gain for gain in GAIN])):
        board = FaultBoard()
        with pytest.raises(LimitExceeded, match="limit is ±180"), bench_of(board) as bench:
            run(bench, law, np.full(1000, 10.0), SAMPLE_TIME, progress=False)
        board.let_time_pass()
        assert 180 * DEG < abs(board.inner.plant.state.theta) < 270 * DEG


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows ends a program by other means than signals")
def test_the_handler_of_before_is_there_again_and_hears_of_it_and_nohup_holds():
    heard: list[int] = []
    usual = signal.signal(signal.SIGTERM, handler := lambda number, _frame: heard.append(number))
    ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    board = FaultBoard()
    try:
        with bench_of(board) as bench:
            bench.on_sample = lambda measured, _voltage: signal.raise_signal(signal.SIGHUP)
            assert len(run(bench, OpenLoop(), np.full(50, 1.0), progress=False)) == 50
            signal.raise_signal(signal.SIGTERM)  # between two runs: at once
            assert (heard, board.inner.is_valid()) == ([signal.SIGTERM], False)
            assert signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, usual)
        signal.signal(signal.SIGHUP, ignored)


def test_where_samples_came_late_a_limit_that_is_passed_says_so_first():
    """As on a virtual bench in the computer's time, which no guard watches, on a busy computer."""
    board = FaultBoard()
    bench = bench_of(board)
    bench.safety.guard = None
    calls = itertools.count()

    def now_and_then(voltage: float) -> float:
        board.time.pass_by(0.0 if next(calls) % 100 else 0.15)
        return voltage

    with bench, pytest.raises(LimitExceeded, match=r"^Of \d+ samples \d+ came late .* The computer was busy.*limit"):
        run(bench, Faulty(0, now_and_then, SAMPLES), 4 * REFERENCE, SAMPLE_TIME, progress=False)
