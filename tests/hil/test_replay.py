"""A recording in the plant's place."""

from __future__ import annotations

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.errors import BenchError, RecordingError
from rotflex.hil.replay import RecordedPlant
from rotflex.recording import Recording


@pytest.fixture
def recording():
    t = np.arange(0, 1.0, 0.002)
    return Recording.of(t, theta=np.sin(5 * t), alpha=0.1 * np.cos(5 * t), vm=0 * t)


def test_it_moves_as_recorded_whatever_the_voltage(recording):
    plant = RecordedPlant(recording)
    for index in range(len(recording) - 1):
        assert plant.state.theta == pytest.approx(recording["theta"][index], abs=1e-9)
        assert plant.state.theta_dot == pytest.approx(5 * np.cos(5 * recording.time[index]), abs=0.03)
        plant.advance(10.0 * (-1) ** index, 0.002)


def test_between_samples_it_is_on_the_line_and_at_the_end_it_stands(recording):
    plant = RecordedPlant(recording)
    plant.advance(0.0, 0.003)
    assert plant.state.alpha == pytest.approx(recording["alpha"][1:3].mean(), abs=1e-12)
    state = plant.advance(0.0, 100.0)
    assert state.theta == pytest.approx(recording["theta"][-1])
    assert (state.theta_dot, state.alpha_dot) == (0.0, 0.0)


def test_it_needs_both_angles(recording):
    with pytest.raises(RecordingError, match="no alpha"):
        RecordedPlant(Recording.of(recording.time, theta=recording["theta"]))


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


@pytest.mark.parametrize(
    ("address", "error", "word"),
    [
        ("replay:{}/none.mat", RecordingError, "none.mat"),
        ("replay:{}/some.mat?seed=3", BenchError, "clock"),
        ("replay:{}/odd.mat", BenchError, "arm position 9"),
    ],
)
def test_what_cannot_be_replayed_is_said(recording, tmp_path, address, error, word):
    recording.save(tmp_path / "some.mat")
    odd = Recording(recording.time, recording.channels, {"bench": {"arm_position": 9}})
    odd.save(tmp_path / "odd.mat")
    with pytest.raises(error, match=word):
        hil.open(address.format(tmp_path))
