"""Samples that were not answered: a recording says which, is known again by the others, and can hide little in them."""

from __future__ import annotations

import numpy as np
import pytest
from fault_board import SAMPLE_TIME, FaultBoard, bench_of
from forged import changed
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rotflex import design, experiments, hil, model, observers, sampled
from rotflex.config import joint, srv02
from rotflex.course import plausible
from rotflex.course.recordings_folder import bench_of as bench_of_recordings
from rotflex.errors import BenchError, NotRecorded
from rotflex.hil import replay
from rotflex.hil.board import WATCHDOG_TIMEOUT
from rotflex.hil.controllers import ObserverFeedback, StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.loop import run
from rotflex.hil.student_benches import REAL_BENCH
from rotflex.recording import Recording
from rotflex.unanswered import HELD, LOST, MOST_NOTED, TIMING, mask, stretches

GAIN = [18.2356, -17.1547, 1.5893, 0.6327]
SECONDS = 4.0
SAMPLES = round(SECONDS / SAMPLE_TIME) + 1
FIRST = 400  # the run before only waits for the arm to be at rest, and is shorter
VERBS = ("task_read_encoder", "write_analog")


class Hiccups(FaultBoard):
    """A board whose program pauses, for s, before a verb at some samples.

    Attributes
    ----------
    buffer : how many samples wait at the most
    before_each : what was at the motor when each sample of the run was taken, V
    """

    def __init__(self, verb: str, pauses: dict[int, float], buffer: int = 500) -> None:
        super().__init__()
        self.buffer, self.before_each = buffer, []
        left = dict(pauses)

        def pause(sample: int) -> None:
            self.time.pass_by(left.pop(sample, 0.0))

        self.before[verb] = pause
        taken = self.inner._values

        def values(task):
            self.before_each.append(float(self.inner.terminals.commanded[0]) * srv02().cable_gain)
            return taken(task)

        self.inner._values = values

    def task_create_encoder_reader(self, _samples, channels, number):
        self.before_each.clear()
        return self.inner.task_create_encoder_reader(self.buffer, channels, number)


def tracked(board: FaultBoard) -> Recording:
    kept: list[Recording] = []
    with bench_of(board) as bench:
        bench.recorder.on_recorded = kept.append
        experiments.tracking(bench, GAIN, duration=SECONDS, progress=False)
    return kept[0]


def look(recording: Recording) -> list[str]:
    return plausible.doubts(recording, srv02(), REAL_BENCH.parameters)


def again(recording: Recording, gain=GAIN) -> Recording:
    with bench_of_recordings([recording], 1, srv02(), joint(1)) as bench:
        return experiments.tracking(bench, gain, duration=SECONDS, progress=False)


def replayed(path, gain=GAIN) -> Recording:
    with hil.open(f"replay:{path}") as bench:
        return experiments.tracking(bench, gain, duration=SECONDS, progress=False)


@pytest.fixture(scope="module", params=VERBS)
def paused(request):
    """A run with a pause of 0.101 s and one of 0.031 s, and its board."""
    board = Hiccups(request.param, {FIRST: 0.101, 1000: 0.031})
    return tracked(board), board


@pytest.fixture(scope="module", params=VERBS)
def lossy(request):
    """The same where no more than four samples wait."""
    board = Hiccups(request.param, {FIRST: 0.101, 1000: 0.031}, buffer=4)
    return tracked(board), board


def test_the_recorded_voltage_is_what_the_motor_had_and_it_says_which_samples_were_held(paused):
    recording, board = paused
    np.testing.assert_allclose(recording["vm"][: SAMPLES - 1], board.before_each[1:SAMPLES], atol=1e-12)
    held = stretches(recording.metadata, HELD)
    assert [count for _first, count in held] == pytest.approx([50, 15], abs=1)
    assert [first for first, _count in held] == pytest.approx([FIRST, 1000], abs=1)
    assert not stretches(recording.metadata, LOST) and not replay.implausible_timing(recording)


def test_samples_that_were_lost_are_told_and_lie_between_their_neighbours(lossy):
    recording, _board = lossy
    (first, count), (_second, less) = stretches(recording.metadata, LOST)
    assert (count, less) == pytest.approx((45, 10), abs=2)
    assert recording.metadata[TIMING]["missed"] == count + less
    line = recording["theta"][first - 1 : first + count + 1]
    assert np.diff(line) == pytest.approx(np.full(count + 1, (line[-1] - line[0]) / (count + 1)), abs=1e-12)
    assert replay.lost_samples(recording).sum() == count + less


def test_a_recording_with_pauses_is_the_same_run_again(paused, lossy, tmp_path):
    """As it was kept, loaded from its file, among recordings, on a replay, and on a replay of that."""
    for (recording, _board), path in ((paused, tmp_path / "a.mat"), (lossy, tmp_path / "a.csv")):
        loaded = Recording.load(recording.save(path))
        assert look(loaded) == []
        one = replayed(path)
        for run_again in (again(loaded), one, replayed(one.save(tmp_path / "b.mat"))):
            np.testing.assert_allclose(run_again["vm"], recording["vm"], atol=1e-9)
            assert run_again.metadata[TIMING] == recording.metadata[TIMING]


def test_another_gain_is_another_run_all_the_same(paused, tmp_path):
    recording, _board = paused
    other = [18.2356, -17.1547, 1.7, 0.6327]
    with pytest.raises(NotRecorded):
        again(recording, other)
    with pytest.raises(BenchError, match="not the run"):
        replayed(recording.save(tmp_path / "a.mat"), other)


def _pauses(most: int):
    """s, up to so many periods; not quite whole ones, where rounding would decide what came first."""
    return st.builds(lambda whole, part: (whole + part) * SAMPLE_TIME, st.integers(0, most), st.floats(0.05, 0.95))


@example({890: 0.119}, {}, "task_read_encoder", 4)  # many lost in motion: the link's swing afterwards is not known
@example({}, {400: 0.003}, "write_analog", 500)  # an answer a period late, after which nothing waits
@given(
    st.dictionaries(st.integers(FIRST, SAMPLES - 50), _pauses(75), max_size=1),
    st.dictionaries(st.integers(FIRST, SAMPLES - 50), _pauses(10), max_size=2),
    st.sampled_from(VERBS),
    st.sampled_from([4, 500]),
)
@settings(max_examples=4, deadline=None)
@pytest.mark.slow
def test_wherever_a_program_pauses_its_recording_is_honest(long, short, verb, buffer):
    board = Hiccups(verb, long | short, buffer)
    recording = tracked(board)
    assert replay.implausible_timing(recording) is None and look(recording) == []
    np.testing.assert_array_equal(again(recording)["vm"], recording["vm"])
    if buffer == 500:
        np.testing.assert_allclose(recording["vm"][: SAMPLES - 1], board.before_each[1:SAMPLES], atol=1e-12)


def designed(kind):
    """Controllers that count samples or predict them."""
    system = model.state_space(srv02(), REAL_BENCH.joint, REAL_BENCH.parameters.K_s, link_damping=0.0)
    if kind == "feedforward":
        return TwoDegreesOfFreedom(StateFeedback(GAIN), 0.1 * np.sin(np.arange(SAMPLES) / 100))
    plant = sampled.sample(system, SAMPLE_TIME, 0.002)
    noise = observers.process_noise(plant, (sampled.sample(system, SAMPLE_TIME).B, 0.1))
    L = observers.kalman_gain(plant, noise, srv02().K_enc, servo_only=True)
    poles = design.desired_poles(0.6, 20, -30, -40)
    return ObserverFeedback(plant.A, plant.B, L, sampled.gain_by_place(plant, poles), SAMPLE_TIME)


@pytest.mark.parametrize("kind", ["observer", "feedforward"])
def test_a_controller_that_counts_or_predicts_samples_runs_along_when_they_come_late_or_never(kind):
    """The pauses come while the arm moves; two seconds later all is as without them."""
    command = 0.2 * np.minimum(np.arange(SAMPLES) / 200, 1)
    runs = []
    for loses, pauses in (({}, {}), ({120: 20}, {150: 0.1})):
        board = Hiccups("write_analog", pauses)
        with bench_of(board) as bench:
            board.loses.update(loses)
            runs.append(run(bench, designed(kind), command, SAMPLE_TIME, progress=False))
    assert stretches(runs[1].metadata, LOST) and stretches(runs[1].metadata, HELD)
    apart = np.abs(runs[1]["theta"] - runs[0]["theta"])
    assert 1e-3 < apart.max() < 0.1 and apart[1150:].max() < 0.006


@pytest.fixture(scope="module")
def honest():
    """A run without a pause."""
    return tracked(FaultBoard())


def claimed(recording: Recording, held, late=None) -> Recording:
    """A recording that says that samples were held."""
    late = sum(count for _first, count in held) if late is None else late
    timing = {**recording.metadata[TIMING], "late": late, HELD: held}
    return Recording(recording.time, recording.channels, {**recording.metadata, TIMING: timing})


PAUSE = round(WATCHDOG_TIMEOUT / SAMPLE_TIME) + 2


@pytest.mark.parametrize(
    ("held", "late", "why"),
    [
        ([[100, PAUSE + 1]], None, "103 samples"),
        ([[100 * n, 60] for n in range(1, 10)], None, "27%"),
        ([[100, 50]], 10, "go together"),
        ([[100, 10**12]], None, "in a row"),
        ([[-1, 10]], 10, "go together"),
        ([["x", 10]], 10, "go together"),
        ("xy", 10, "go together"),
        ([[10 * n, 1] for n in range(1, MOST_NOTED + 1)], 500, "100 times"),
    ],
)
def test_more_than_can_be_is_told_and_excuses_nothing(honest, held, late, why, capsys):
    recording = claimed(honest, held, late)
    forged = changed(recording, vm=recording["vm"] + np.where(np.arange(len(recording)) % 7 == 0, 1.0, 0.0))
    assert any(why in doubt for doubt in look(forged))
    assert not replay.lost_samples(recording).any()
    again(forged)
    assert capsys.readouterr().out.startswith("Note")  # its voltages are for a person


def test_samples_that_are_said_to_be_held_have_to_be(honest):
    assert look(honest) == []
    first = 700
    forged = claimed(changed(honest, vm=honest["vm"] + 0.5 * mask([(first, 40)], len(honest))), [[first, 40]])
    assert any("controller sets" in doubt for doubt in look(forged))


def test_a_short_run_may_have_one_whole_pause_and_where_time_waits_there_is_none():
    time = np.arange(1000) * SAMPLE_TIME
    short = Recording.of(time, {TIMING: {"late": 100, "missed": 0, HELD: [[100, 100]]}}, theta=time, alpha=time)
    assert replay.implausible_timing(short) is None
    with hil.open("virtual:?seed=3") as bench:
        recording = experiments.watch(bench, 0.1, progress=False)
    assert TIMING not in recording.metadata and replay.implausible_timing(recording) is None


def test_samples_that_came_late_are_answered_on_their_own_commands():
    reference, asked = np.linspace(0.0, 0.2, SAMPLES), []

    def controller(target, theta, alpha):
        asked.append(target)
        return 0.0

    with bench_of(Hiccups("write_analog", {FIRST: 0.02})) as bench:
        run(bench, controller, reference, SAMPLE_TIME, progress=False)
    np.testing.assert_allclose(asked, reference, rtol=0, atol=1e-9)
