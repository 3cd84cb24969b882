"""A recording in the plant's place."""

import re

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.errors import BenchError, RecordingError
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.replay import RecordedPlant
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
    "free decay": lambda bench: experiments.free_decay(bench, duration=1.0, progress=False),
    "sweep": lambda bench: experiments.sweep(bench, duration=1.0, progress=False),
    "sweep of the voltage": lambda bench: experiments.sweep(bench, duration=1.0, drive="voltage", progress=False),
    "square": lambda bench: experiments.validation(bench, *MODEL, duration=1.0, progress=False),
    "step": lambda bench: experiments.validation(bench, *MODEL, "step", duration=1.0, progress=False),
    "tracking": lambda bench: experiments.tracking(bench, GAIN, duration=1.0, progress=False),
    "partial": lambda bench: experiments.tracking(bench, GAIN, "partial", duration=1.0, progress=False),
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Every experiment of a virtual bench: the recording, and its file."""
    folder = tmp_path_factory.mktemp("recorded")
    made = {}
    for name, ask in ASKED.items():
        with hil.open("virtual:?seed=3") as bench:
            made[name] = ask(bench), folder / f"{name}.csv"
        made[name][0].save(made[name][1])
    return made


@pytest.mark.parametrize("asked", ASKED)
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


def test_another_gain_is_another_run_and_a_gain_with_four_digits_is_the_same(recorded):
    path = recorded["tracking"][1]
    with hil.open(f"replay:{path}") as bench:
        with pytest.raises(BenchError, match="tracking"):
            experiments.tracking(bench, np.multiply(GAIN, 1.02), duration=1.0, progress=False)
        rounded = np.add(GAIN, [0.004, 0.004, 0.0004, 0.0004])
        assert len(experiments.tracking(bench, rounded, duration=1.0, progress=False)) == 501


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
