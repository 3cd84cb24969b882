"""Many recordings of a bench in its place: each experiment is given its own, and what was not recorded is told."""

from __future__ import annotations

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.errors import BenchError, NotRecorded, RecordingError
from rotflex.hil.bench import Bench
from rotflex.hil.replay import RecordedRuns, described
from rotflex.hil.virtual import SimulatedClock, VirtualBoard
from rotflex.recording import Recording

GAIN = [18.24, -17.15, 1.59, 0.63]
MODEL = (np.diag([1.0, 1.0], 2) - np.diag([0.0, 0.0, 20.0, 20.0]), [0.0, 0.0, 60.0, -60.0])
ASKED = {
    "free decay": lambda bench: experiments.free_decay(bench, duration=0.5, progress=False),
    "sweep": lambda bench: experiments.sweep(bench, duration=1.0, progress=False),
    "sweep of the voltage": lambda bench: experiments.sweep(bench, duration=1.0, drive="voltage", progress=False),
    "square": lambda bench: experiments.validation(bench, *MODEL, duration=1.0, progress=False),
    "step": lambda bench: experiments.validation(bench, *MODEL, "step", duration=1.0, progress=False),
    "tracking": lambda bench: experiments.tracking(bench, GAIN, duration=1.0, progress=False),
    "small": lambda bench: experiments.tracking(bench, GAIN, duration=1.0, amplitude=0.05, progress=False),
    "partial": lambda bench: experiments.tracking(bench, GAIN, "partial", duration=1.0, progress=False),
    "watch": lambda bench: experiments.watch(bench, 0.5, progress=False),
}


def bench_of(recordings, run=1) -> Bench:
    """A bench of recordings."""
    runs, servo, identity = RecordedRuns(recordings, 10.0, run), srv02(), {"uri": "recorded", "clock": "simulated"}
    joint = hil.open("virtual:?seed=3").joint
    return Bench(lambda: VirtualBoard(runs, servo, clock=SimulatedClock()), servo, joint, identity, recorded=runs)


@pytest.fixture(scope="module")
def made():
    """What the experiments gave, and what was handed to whoever keeps recordings, by the experiment's name."""
    given, kept = {}, {}
    for name, ask in ASKED.items():
        with hil.open("virtual:?seed=3") as bench:
            handed = []
            bench.on_recorded = handed.append
            given[name] = ask(bench)
            (kept[name],) = handed
    return given, kept


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
        bench.on_recorded = kept.append
        ASKED["tracking"](bench)
    assert kept[0]["theta"][0] == pytest.approx(count) and honest["theta"][0] == 0
    with bench_of(kept) as bench:
        np.testing.assert_array_equal(ASKED["tracking"](bench)["theta"], kept[0]["theta"])


def test_there_is_no_the_recorded_voltage_among_many(made):
    with bench_of(list(made[1].values())) as bench, pytest.raises(ValueError, match="signal is 'recorded'"):
        experiments.validation(bench, *MODEL, "recorded", progress=False)


def test_a_long_list_is_cut(made):
    many = [run_number(made[1]["watch"], number) for number in range(2, 20)]
    with bench_of(many) as bench, pytest.raises(BenchError, match="6 before"):
        ASKED["sweep"](bench)
