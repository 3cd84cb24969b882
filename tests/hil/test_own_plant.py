"""A virtual bench with a plant of one's own."""

import pytest

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.errors import BenchError
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import student_bench
from rotflex.recording import Recording


def decay(bench):
    with bench:
        return experiments.free_decay(bench, duration=0.5, progress=False)


@pytest.mark.parametrize("number", [1, 3])
def test_a_drawn_bench_given_as_ones_own_is_the_same_bench_in_each_run(number):
    own = hil.open("virtual", plant=student_bench(7), run=number)
    assert own.joint == student_bench(7).joint
    ours, drawn = decay(own), decay(hil.open("virtual:?seed=7", run=number))
    for name in drawn.channels:
        assert ours[name].tolist() == drawn[name].tolist()


def test_parameters_alone_have_the_first_arm_and_prompt_outputs(tmp_path):
    parameters = student_bench(7).parameters
    bench = hil.open("virtual:?encoder=EHR", plant=parameters)
    assert (bench.joint.arm_position, bench.servo.encoder) == (1, "EHR")
    recording = decay(bench)
    saved = Recording.load(recording.save(tmp_path / "own.mat")).metadata
    assert saved["source"] == "virtual bench"
    assert saved["bench"]["plant"]["K_s"] == parameters.K_s
    assert saved["bench"]["plant"]["delay"] == 0
    assert "seed" not in saved["bench"]
    prompt, late = recording, decay(hil.open("virtual:?encoder=EHR", plant=student_bench(7)))
    assert prompt["alpha"].tolist() != late["alpha"].tolist()


def test_the_servo_is_as_given():
    assert hil.open("virtual", plant=student_bench(7), servo=srv02(encoder="EHR")).servo.encoder == "EHR"


def test_what_an_address_has_no_use_for_is_refused_and_not_dropped_in_silence():
    plant = {"plant": student_bench(7).parameters}
    refused = [("virtual:?seed=3", plant, "seed="), ("virtual:?preset=workbook", plant, "preset=")]
    refused += [("virtual:?arm_position=2", plant, "arm_position="), ("replay:some.mat", plant, "plant=")]
    refused += [(uri, {"setup": Setup()}, "setup=") for uri in ("virtual:?seed=7", "virtual:twin.toml", "replay:a.mat")]
    boards = ("virtual:twin.toml", "replay:some.mat", "quanser:q2_usb/0")
    refused += [(uri, {"servo": srv02()}, "servo=") for uri in boards]
    for uri, given, named in refused:
        with pytest.raises(BenchError, match=named):
            hil.open(uri, **given)
