"""What a recording says against itself, and who says it or refuses the recording for it."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest
from scipy.signal import lsim

from rotflex import experiments, greybox, hil, identification, response
from rotflex.config import joint, srv02
from rotflex.errors import DoubtfulRecording, IdentificationError, LimitExceeded
from rotflex.greybox.bands import Band
from rotflex.hil.guard import Limits
from rotflex.recording import Recording
from rotflex.units import DEG

SAMPLES = 1501
T = np.arange(SAMPLES) * 0.002
STEPS = np.where(T % 2 < 1, 0.3, -0.3)


def swung(**metadata) -> Recording:
    """A log of a link of 23 rad/s, by its equation of motion, on a servo that follows a square wave."""
    theta = lsim(([400.0], [1.0, 24.0, 400.0]), STEPS, T)[1]
    alpha = lsim(([-1.0, 0, 0], [1.0, 0.5, 23.0**2]), theta, T)[1]
    return Recording.of(T, {"source": "log.mat", **metadata}, theta_ref=STEPS, theta=theta, alpha=alpha, vm=10 * STEPS)


def late(number: int, missed: int = 0) -> Recording:
    return swung(timing={"late": number, "missed": missed})


def unevenly(number: int) -> Recording:
    """The same, so many of its steps a tenth longer; built as a reader builds a table of such a log."""
    recording = swung()
    longer = np.where(np.arange(SAMPLES - 1) < number, 1.1, 1.0)
    object.__setattr__(recording, "time", np.concatenate([[0.0], np.cumsum(0.002 * longer)]))
    return recording


def codes(recording: Recording) -> list[str]:
    return [doubt.code for doubt in recording.doubts]


BAND = Band(T, np.zeros((2, SAMPLES)), np.zeros((1, 2, SAMPLES)), np.ones(2), is_open=False, spread="")
MEASURING = {
    "steps": response.measure,
    "spectra": identification.frequency_response,
    "free decay": identification.logarithmic_decrement,
    "a fit": lambda recording: greybox.fit(recording, srv02(), joint(1), ["K_s"], progress=False),
    "a band": BAND,
}


@pytest.mark.parametrize("measured", MEASURING.values(), ids=MEASURING)
@pytest.mark.filterwarnings("ignore::rotflex.errors.DoubtfulRecording")
def test_what_measures_refuses_a_recording_beyond_one_per_cent_of_late_lost_or_uneven_samples(measured):
    for recording, code in ((late(589), "late_samples"), (late(9, 7), "late_samples"), (unevenly(16), "uneven_time")):
        (doubt,) = (doubt for doubt in recording.doubts if doubt.refuses)
        assert doubt.code == code
        with pytest.raises(IdentificationError) as refused:
            measured(recording)
        assert str(refused.value) == str(doubt)
    measured(late(8, 7))  # 0.999 %


def test_doubts_are_data_and_every_look_at_a_recording_shows_them():
    recording = late(3, 2)
    (doubt,) = recording.doubts
    assert (doubt.code, doubt.parameters) == ("late_samples", {"late": 3, "missed": 2, "samples": SAMPLES})
    assert json.loads(json.dumps(doubt.parameters)) == doubt.parameters
    assert doubt.code in repr(recording) and str(doubt) in recording._repr_html_().replace("&#x27;", "'")
    summary = response.worst(response.measure(recording))
    assert summary.doubts == recording.doubts
    assert all(doubt.code in finding.words for finding in response.verdict(summary))
    for say in (MEASURING["spectra"], BAND):
        with pytest.warns(DoubtfulRecording, match="3 came late and 2 never"):
            say(recording)


def test_nothing_is_said_of_a_recording_without_doubts():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for measured in (response.measure, identification.frequency_response, BAND):
            measured(swung())
    assert swung().doubts == () and "doubt" not in repr(swung())
    assert "Doubt" not in response.verdict(response.worst(response.measure(swung())))[0].words


def test_another_mechanism_is_seen_in_a_log_by_the_links_equation():
    recording = swung()
    turned = recording.with_channels(alpha=-recording["alpha"])
    assert codes(recording) == [] and codes(turned) == ["other_mechanism"]
    for about in ({"source": "virtual bench"}, {"experiment": "hold"}):  # no other one, and a hand that pulls
        other = Recording(turned.time, turned.channels, {**turned.metadata, **about})
        assert codes(other) == []
    unmoved = turned.with_channels(alpha=0.01 * turned["alpha"], theta=0.01 * turned["theta"])
    assert codes(unmoved) == []


def test_a_clock_that_is_off_and_an_early_end_are_carried_into_the_file_and_a_part(tmp_path):
    with hil.open("virtual:?preset=workbook") as bench:
        bench.safety.limits = Limits(theta=10 * DEG)
        with pytest.raises(LimitExceeded) as ended:
            experiments.tracking(bench, [18.2356, -17.1547, 1.5893, 0.6327], progress=False)
        recording = bench.recorder.unfinished
    (doubt,) = recording.doubts
    assert doubt.code == "early_end" and doubt.parameters["reason"] in f"LimitExceeded: {ended.value}"
    assert codes(Recording.load(recording.save(tmp_path / "run.mat"))) == ["early_end"]
    assert codes(swung(timing={"drift": 0.003}).between(0, 1)) == ["clock_off"]


def test_a_part_has_the_late_samples_that_are_in_it():
    held, lost = [[10, 20], [1000, 3]], [[12, 5]]
    recording = swung(timing={"late": 16, "missed": 5, "held": held, "lost": lost})
    assert [doubt.refuses for doubt in recording.doubts] == [True]
    (doubt,) = recording.between(1.0, 2.5).doubts
    assert (doubt.parameters["late"], doubt.parameters["missed"], doubt.refuses) == (3, 0, False)
    assert codes(recording.between(0.1, 1.9)) == []
