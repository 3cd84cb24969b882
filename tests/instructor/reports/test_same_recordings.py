"""Samples of another student's recording: found in all copies, and in no pair of sixty benches."""

from __future__ import annotations

import json

import numpy as np
import pytest
from gradebooks import graded

from rotflex import experiments, hil
from rotflex.courseware.benches import SAME, THEIR_OWN, BenchPolicy
from rotflex.courseware.kinds.recordings import encode_recording
from rotflex.hil.student_benches import student_seed
from rotflex.instructor.graded_run import Facts
from rotflex.instructor.reports import same_recordings
from rotflex.workbook.questions import CATALOGUE

SIZE, COPIERS = 60, 10
(PART,) = (part for part in CATALOGUE.find("2.9").parts if part.kind == "recording")


def sweep_of(name, run=1):
    with hil.open("virtual", seed=student_seed(name), run=run) as bench:
        return experiments.sweep(bench, f_start=1.0, f_stop=5.0, duration=3.0, progress=False)


def content(recording):
    return {"kind": "recording", **encode_recording(PART, recording)[0]}


def book(student, **answers):
    about = {"format": 1, "student": student, "bench": {}, "software": "rotflex 0", "probe_seed": 7}
    return json.dumps({**about, "answers": {"2.9": answers}}).encode()


def who(student, recording, group="", policy=THEIR_OWN, claim=None):
    cells = Facts(bench_of=group or student, policy=policy).plain()
    run = graded(student, answers=None if recording is None else book(student, sweep=recording), cells=cells)
    return same_recordings.recorded(run, group or student, claim)


def pairs(*everybody):
    return [pair for pair, _line in same_recordings.hints(everybody)]


@pytest.fixture(scope="module")
def sweeps():
    return {f"s{number:02}": content(sweep_of(f"s{number:02}")) for number in range(SIZE)}


def test_sixty_benches_give_no_hint_and_each_copy_is_found(sweeps):
    assert pairs(*(who(name, recording) for name, recording in sweeps.items())) == []
    names = list(sweeps)
    copies = {names[2 * number + 1]: names[2 * number] for number in range(COPIERS)}
    taken = {**sweeps, **{copier: sweeps[mate] for copier, mate in copies.items()}}
    found = pairs(*(who(name, recording) for name, recording in taken.items()))
    assert {frozenset(pair) for pair in found} == {frozenset(pair) for pair in copies.items()}


def test_a_copy_is_known_with_other_metadata_in_other_units_and_with_fewer_digits(sweeps):
    recording = sweeps["s00"]
    channels = {
        name: {**channel, "values": [float(f"{57.3 * value:.4g}") for value in channel["values"]]}
        for name, channel in recording["channels"].items()
    }
    metadata = {**recording["metadata"], "bench": {"uri": "mine"}}
    ((_pair, line),) = same_recordings.hints(
        [who("ada", recording), who("bob", {**recording, "channels": channels, "metadata": metadata})]
    )
    assert line == "ada, bob have the same samples in 2.9 sweep, though each has a bench of their own."


def test_what_was_recorded_at_home_counts(sweeps):
    claim = book("bob", sweep=sweeps["s00"])
    assert pairs(who("ada", sweeps["s00"]), who("bob", sweeps["s01"], claim=claim)) == [("ada", "bob")]


def test_who_works_together_and_who_has_the_same_bench_by_the_settings_is_left_out(sweeps):
    one = sweeps["s00"]
    assert pairs(who("ada", one, "ada"), who("bob", one, "ada")) == []
    everybody = BenchPolicy(which=SAME, seed=7)
    assert pairs(who("ada", one, policy=everybody), who("bob", one, policy=everybody)) == []


def test_another_run_of_one_bench_is_another_recording():
    first, again = (content(sweep_of("s00", run)) for run in (1, 2))
    assert pairs(who("ada", first), who("bob", again)) == []


def test_what_is_simulated_or_stands_still_says_nothing(sweeps):
    recording = sweeps["s00"]
    simulated = {**recording, "metadata": {"source": "a model"}}
    assert pairs(who("ada", simulated), who("bob", simulated)) == []
    still = {name: {**channel, "values": [0.0] * 400} for name, channel in recording["channels"].items()}
    assert pairs(*(who(name, {**recording, "channels": still}) for name in ("ada", "bob"))) == []


@pytest.mark.parametrize(
    "change",
    [
        {"metadata": 7},
        {"channels": 7},
        {"channels": {}},
        {"channels": {"alpha": {"values": ["much"]}}},
        {"channels": {"alpha": {"values": [[1, 2], [3]]}}},
        {"channels": {"alpha": {"values": [1e400, 0]}}},
        {"channels": {"alpha": {"values": [1]}, "theta": {"values": [1, 2]}}},
        {"channels": {"alpha": {"values": []}}},
    ],
)
def test_what_has_not_the_form_of_a_recording_is_passed_over(sweeps, change):
    odd = {**sweeps["s00"], **change}
    assert pairs(who("ada", odd), who("bob", odd), who("eve", None)) == []


def test_the_usual_difference_of_two_benches_is_far_larger_than_what_counts_as_the_same(sweeps):
    """The two of the class that are nearest to each other are off by ten times as much, somewhere."""
    rows = [who(name, recording).samples["2.9", "sweep"][0][1] for name, recording in sweeps.items()]
    nearest = min(np.abs(one - other).max() for place, one in enumerate(rows) for other in rows[:place])
    assert nearest > 10 * same_recordings.SAME
