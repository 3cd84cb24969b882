"""A recording in the plant's place."""

import re

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.errors import BenchError, NotRecorded, RecordingError
from rotflex.hil.bench import Bench, Connection
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.replay import RecordedPlant, RecordedRuns, described
from rotflex.hil.virtual import SimulatedClock, VirtualBoard
from rotflex.recording import Recording
from rotflex.units import DEG

GAIN = [18.24, -17.15, 1.59, 0.63]
MODEL = (np.diag([1.0, 1.0], 2) - np.diag([0.0, 0.0, 20.0, 20.0]), [0.0, 0.0, 60.0, -60.0])


@pytest.fixture
def recording():
    t = np.arange(0, 1.0, 0.002)
    return Recording.of(t, theta=np.sin(5 * t), alpha=0.1 * np.cos(5 * t), vm=0 * t)


def test_between_samples_it_is_on_the_line_and_at_the_end_it_stands(recording):
    plant = RecordedPlant(recording)
    plant.advance(0.0, 0.003)
    assert plant.state.alpha == pytest.approx(recording["alpha"][1:3].mean(), abs=1e-12)
    state = plant.advance(0.0, 100.0)
    assert state.theta == pytest.approx(recording["theta"][-1])
    assert (state.theta_dot, state.alpha_dot) == (0.0, 0.0)


def test_a_recording_is_replayed_through_the_boards_verbs(recording, tmp_path):
    path = recording.save(tmp_path / "some.mat")
    with hil.open(f"replay:{path}") as bench:
        heard = experiments.watch(bench, 0.9, progress=False)
        count = bench.servo.K_enc
    # The encoders are zeroed where the arm stands.
    assert heard["alpha"] == pytest.approx(recording["alpha"][:451] - recording["alpha"][0], abs=1.01 * count)
    assert heard.metadata["source"] == "replay"
    assert not heard["vm"].any()


def test_the_recording_says_which_bench_it_was(tmp_path):
    with hil.open("virtual:?seed=7&arm_position=3&encoder=EHR") as bench:
        path = experiments.free_decay(bench, duration=0.5, progress=False).save(tmp_path / "decay.mat")
    bench = hil.open(f"replay:{path}")
    assert (bench.joint.arm_position, bench.servo.encoder) == (3, "EHR")


def test_what_cannot_be_replayed_is_said(recording, tmp_path):
    with pytest.raises(RecordingError, match="alpha"):
        RecordedPlant(Recording.of(recording.time, theta=recording["theta"]))
    recording.save(tmp_path / "some.mat")
    Recording(recording.time, recording.channels, {"bench": {"arm_position": 9}}).save(tmp_path / "odd.mat")
    for name, error, word in (
        ("none.mat", RecordingError, "none.mat"),
        ("some.mat?seed=3", BenchError, "clock"),
        ("odd.mat", BenchError, "arm position 9"),
    ):
        with pytest.raises(error, match=word):
            hil.open(f"replay:{tmp_path}/{name}")


#: Every experiment, short, by name.
ASKED = {
    "free decay": lambda bench: experiments.free_decay(bench, duration=0.5, progress=False),
    "sweep": lambda bench: experiments.sweep(bench, duration=1.0, progress=False),
    "sweep of the voltage": lambda bench: experiments.sweep(bench, duration=1.0, drive="voltage", progress=False),
    "square": lambda bench: experiments.validation(bench, *MODEL, duration=1.0, progress=False),
    "step": lambda bench: experiments.validation(bench, *MODEL, "step", duration=1.0, progress=False),
    "tracking": lambda bench: experiments.tracking(bench, GAIN, duration=1.0, progress=False),
    "small": lambda bench: experiments.tracking(bench, GAIN, duration=1.0, amplitude=0.05, progress=False),
    "partial": lambda bench: experiments.tracking(bench, GAIN, "partial", duration=1.0, progress=False),
    "follow at 20 ms": lambda bench: experiments.follow(
        bench, StateFeedback(GAIN, sample_time=0.02, cutoff=50.0), np.full(51, 0.1), 0.02, progress=False
    ),
    "watch": lambda bench: experiments.watch(bench, 0.5, progress=False),
}
STEERED = [name for name in ASKED if name not in ("small", "watch")]


@pytest.fixture(scope="module")
def made():
    """What the experiments gave, and what was handed to whoever keeps recordings, by the experiment's name."""
    given, kept = {}, {}
    for name, ask in ASKED.items():
        with hil.open("virtual:?seed=3") as bench:
            handed = []
            bench.recorder.on_recorded = handed.append
            given[name] = ask(bench)
            (kept[name],) = handed
    return given, kept


@pytest.fixture(scope="module")
def recorded(made, tmp_path_factory):
    """Every experiment of a virtual bench: the recording, and its file."""
    folder = tmp_path_factory.mktemp("recorded")
    return {name: (made[0][name], made[0][name].save(folder / f"{name}.csv")) for name in STEERED}


@pytest.mark.parametrize("asked", STEERED)
def test_an_experiment_on_a_replay_gives_its_own_recording_and_refuses_every_other(recorded, asked):
    for held, (original, path) in recorded.items():
        with hil.open(f"replay:{path}") as bench:
            if held != asked:
                with pytest.raises(BenchError, match=r"It holds .*theta"):
                    ASKED[asked](bench)
                continue
            for _again in range(2):  # from its beginning, however often
                given = ASKED[asked](bench)
                assert set(given.channels) == set(original.channels)
                for name in original.channels:
                    assert given[name] == pytest.approx(original[name], abs=1e-6), name
                assert given.metadata["source"] == "replay"
                assert given.metadata["bench"]["recording"] == path.name


def test_what_the_refusal_advises_gives_the_whole_recording_of_whatever_length_and_no_limit_ends_it(tmp_path):
    t = np.arange(0, 12.5, 0.002)
    long = Recording.of(t, theta=0.5 * t, alpha=0.07 * t, vm=np.sin(t))
    long.save(tmp_path / "long.csv")
    with hil.open(f"replay:{tmp_path / 'long.csv'}") as bench:
        with pytest.raises(BenchError) as refused:
            experiments.free_decay(bench, progress=False)
        (duration,) = re.findall(r"experiments\.watch\(bench, duration=([\d.]+)\) gives it", str(refused.value))
        heard = experiments.watch(bench, float(duration), progress=False)
    assert len(heard) == len(long)
    assert heard["theta"][-1] > 180 * DEG and heard["alpha"][-1] > 30 * DEG


def test_a_model_is_set_beside_whatever_voltage_was_recorded(recorded):
    original, path = recorded["sweep of the voltage"]
    with hil.open(f"replay:{path}") as bench:
        given = experiments.validation(bench, *MODEL, "recorded", progress=False)
    assert given["vm"] == pytest.approx(original["vm"], abs=1e-9)
    assert given["theta"] == pytest.approx(original["theta"], abs=1e-6)
    control = pytest.importorskip("control")
    discrete = control.c2d(control.ss(MODEL[0], np.reshape(MODEL[1], (4, 1)), np.eye(4), 0), 0.002)
    independent = control.forced_response(discrete, np.arange(501) * 0.002, original["vm"]).outputs
    assert given["theta_model"] == pytest.approx(independent[0], abs=1e-9)
    assert given["alpha_model"] == pytest.approx(independent[1], abs=1e-9)


def test_without_a_recorded_voltage_only_the_angles_are_given(recorded, tmp_path):
    original, _path = recorded["tracking"]
    path = tmp_path / "silent.csv"
    Recording.of(original.time, theta=original["theta"], alpha=original["alpha"]).save(path)
    with hil.open(f"replay:{path}") as bench:
        heard = experiments.watch(bench, progress=False)
        assert "vm" not in heard
        assert heard["alpha"] == pytest.approx(original["alpha"], abs=1e-6)
        with pytest.raises(BenchError, match="without vm"):
            experiments.tracking(bench, GAIN, duration=1.0, progress=False)
        with pytest.raises(BenchError, match=r"silent\.csv"):
            experiments.validation(bench, *MODEL, "recorded", progress=False)


def test_a_recording_with_other_samples_is_watched_and_not_run(recorded, tmp_path):
    original, _path = recorded["tracking"]
    channels = {name: original[name][::2] for name in ("theta", "alpha", "vm")}
    path = Recording.of(original.time[::2], **channels).save(tmp_path / "slow.csv")
    with hil.open(f"replay:{path}") as bench:
        with pytest.raises(BenchError, match=r"4 ms.*2 ms"):
            experiments.tracking(bench, GAIN, duration=1.0, progress=False)
        heard = experiments.watch(bench, progress=False)
    assert heard["vm"][::2] == pytest.approx(channels["vm"], abs=1e-9)
    assert heard["vm"][1::2] == pytest.approx(channels["vm"][:-1], abs=1e-9)  # held


def test_the_log_of_a_real_bench_is_the_run_of_its_gain_and_of_no_other(real_log, real_log_path):
    gain = np.array([13.0384, -17.2586, 1.3198, -0.0461])
    with hil.open(f"replay:{real_log_path}") as bench:
        given = run(bench, StateFeedback(gain), real_log["theta_ref"], progress=False)
        assert given["vm"] == pytest.approx(real_log["vm"], abs=1e-12)
        assert given["theta"] == pytest.approx(real_log["theta"], abs=srv02().K_enc / 2)
        with pytest.raises(BenchError, match="not the run"):
            run(bench, StateFeedback(1.02 * gain), real_log["theta_ref"], progress=False)
        with pytest.raises(BenchError, match="theta, theta_ref, alpha, vm, 10 s"):
            experiments.tracking(bench, gain, progress=False)


# --- many recordings ---


def bench_of(recordings, run=1) -> Bench:
    """A bench of recordings."""
    runs, servo, identity = RecordedRuns(recordings, 10.0, run), srv02(), {"uri": "recorded", "clock": "simulated"}
    joint = hil.open("virtual:?seed=3").joint
    return Bench(
        Connection(lambda: VirtualBoard(runs, servo, clock=SimulatedClock()), servo, recorded=runs),
        servo,
        joint,
        identity,
    )


@pytest.mark.parametrize("name", ASKED)
def test_each_experiment_is_given_its_own_recording_to_the_last_bit(made, name):
    given, kept = made
    with bench_of(list(kept.values())) as bench:
        for _again in range(2):
            again = ASKED[name](bench)
            assert set(again.channels) == set(given[name].channels)
            assert again.metadata == given[name].metadata
            for channel in again.channels:
                np.testing.assert_array_equal(again[channel], given[name][channel])


@pytest.mark.parametrize("name", ASKED)
def test_what_was_not_recorded_is_told_with_what_was(made, name):
    others = [one for other, one in made[1].items() if other != name]
    with bench_of(others) as bench, pytest.raises(NotRecorded, match="no recording of") as raised:
        ASKED[name](bench)
    told = str(raised.value)
    assert "Recorded are: " in told and "hand in the folder with the new recording" in told
    assert {described(one.metadata, one.time[-1]) for one in others} <= set(
        told.partition("Recorded are: ")[2].removesuffix(".").split("; ")
    )


def test_another_gain_is_another_run_and_one_of_four_digits_the_same(made):
    with bench_of([made[1]["tracking"]]) as bench:
        with pytest.raises(NotRecorded, match=r"18\.24 -17\.15 2"):
            experiments.tracking(bench, [18.24, -17.15, 2.0, 0.63], duration=1.0, progress=False)
        again = experiments.tracking(bench, np.array(GAIN) * (1 + 2e-5), duration=1.0, progress=False)
    np.testing.assert_array_equal(again["vm"], made[1]["tracking"]["vm"])


def test_where_nothing_was_recorded_it_says_how_to(made):
    time = made[1]["watch"].time
    with pytest.raises(RecordingError, match="theta and alpha"):
        RecordedRuns([Recording.of(time, vm=0 * time)], 10.0, 1)
    with bench_of([]) as bench, pytest.raises(NotRecorded, match="address"):
        ASKED["sweep"](bench)


def run_number(recording: Recording, number: object) -> Recording:
    return Recording(recording.time, recording.channels, {**recording.metadata, "bench": {"run": number}})


def test_of_several_the_last_counts_and_other_runs_are_other_recordings(made):
    first, last = made[1]["watch"], made[1]["watch"]
    last = Recording.of(last.time, last.metadata, theta=last["theta"] + 1.0, alpha=last["alpha"], vm=last["vm"])
    with bench_of([first, last, run_number(first, 2)]) as bench:
        assert ASKED["watch"](bench)["theta"][0] == last["theta"][0]
    with bench_of([first, run_number(last, 2), run_number(first, "x")], run=2) as bench:
        assert ASKED["watch"](bench)["theta"][0] == last["theta"][0]
    with bench_of([first], run=2) as bench, pytest.raises(NotRecorded, match="watch, run 2;"):
        ASKED["watch"](bench)


def test_a_recording_that_begins_a_count_beside_zero_is_honest(made):
    count, honest = srv02().K_enc, made[1]["tracking"]
    kept = []
    with hil.open("virtual:?seed=3") as bench:
        read = bench.read
        bench.read = lambda: (one := read())._replace(theta=one.theta + count)
        bench.recorder.on_recorded = kept.append
        ASKED["tracking"](bench)
    assert kept[0]["theta"][0] == pytest.approx(count) and honest["theta"][0] == 0
    with bench_of(kept) as bench:
        np.testing.assert_array_equal(ASKED["tracking"](bench)["theta"], kept[0]["theta"])
