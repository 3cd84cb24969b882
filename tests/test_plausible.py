"""Whether a recording can be one of a bench: honest ones all can, and which forged ones are found."""

import pytest
from forged import ANOTHER, FORGED, GAIN, OURS, limited, recorded

from rotflex import experiments, hil, plausible
from rotflex.config import srv02
from rotflex.hil.student_benches import REAL_BENCH
from rotflex.recording import Recording


@pytest.fixture(scope="module")
def made():
    return recorded(OURS), recorded(ANOTHER)


def doubts(recording, spec=OURS):
    return plausible.doubts(recording, srv02(), spec.parameters)


def test_no_honest_recording_is_doubted(made):
    for recordings, spec in zip(made, (OURS, ANOTHER), strict=True):
        for name, one in recordings.items():
            assert doubts(one, spec) == [], name


def test_the_log_of_a_real_bench_is_not_doubted(real_log):
    metadata = {"experiment": "tracking", "feedback": "full", "K": [13.0384, -17.2586, 1.3198, -0.0461]}
    log = Recording(real_log.time, real_log.channels, metadata)
    assert doubts(log, REAL_BENCH) == []
    assert plausible.beside_controller(log, srv02()) < 5e-4
    assert 0 < plausible.left_of_link(log, REAL_BENCH.parameters) < 0.16


@pytest.mark.parametrize("what", FORGED)
def test_what_is_found_of_forged_recordings(made, what):
    forge, is_found = FORGED[what]
    assert bool(found := doubts(forge(*made))) is is_found, found


def test_what_a_bench_cut_to_its_own_limit_is_not_doubted_and_without_the_limit_it_is(made):
    """And a limit that is no number, or none at all, is as if none were told."""
    with hil.open("virtual", plant=OURS) as bench:
        bench._v_max = 6.0
        cut = experiments.tracking(bench, GAIN, progress=False)
    assert abs(cut["vm"]).max() == 6.0
    assert doubts(limited(cut, 6.0)) == []
    for other in (cut, limited(cut, 7.0), limited(cut, 5.0), limited(cut, "6")):
        assert any("beside what its controller sets" in doubt for doubt in doubts(other))
    for nothing in (None, -1.0, 0, True, [6.0], float("nan")):
        assert doubts(limited(made[0]["tracking"], nothing)) == []


def test_a_recording_that_names_no_controller_is_not_compared_with_one(made):
    tracked = made[0]["tracking"]
    for metadata in ({}, {"experiment": "tracking", "K": "x"}, {"experiment": "tracking", "K": [1, 2, 3, 4]}):
        one = Recording(tracked.time, tracked.channels, metadata)
        assert plausible.beside_controller(one, srv02()) == 0.0
