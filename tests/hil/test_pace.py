"""How steadily samples come, on a board with a clock of its own and on one without."""

from __future__ import annotations

import gc
import sys

import numpy as np
import pytest
from fault_board import SAMPLE_TIME, FaultBoard, Stopwatch

from rotflex.config import joint, srv02
from rotflex.hil.bench import Bench, Connection
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.loop import run
from rotflex.hil.pace import TOO_SLOW, Pace, undisturbed


def pace_of(arrivals: list[float], period: float = 1.0) -> tuple[Pace, list[int]]:
    """A pace on which samples arrived at these times, and how many it took to be waiting behind each."""
    time = Stopwatch()
    pace, waiting = Pace(period, "hardware", time.now), []
    for sample, time.time in enumerate(arrivals):
        waiting.append(pace.arrived(sample))
    return pace, waiting


def test_a_sample_that_comes_a_period_late_has_others_behind_it():
    assert pace_of([0.0, 1.0, 2.9, 3.0])[1] == [0, 0, 0, 0]
    assert pace_of([0.0, 1.0, 3.1, 3.2, 4.0])[1] == [0, 0, 1, 0, 0]
    assert pace_of([0.0, 1.0, 9.5])[1] == [0, 0, 7]


def test_the_quickest_arrival_tells_when_samples_are_due():
    """The first came late itself: those that come in time afterwards put that right."""
    assert pace_of([0.9, 1.0, 2.0, 4.1])[1] == [0, 0, 0, 1]


def test_what_is_reported():
    pace, _waiting = pace_of([0.0, 1.0, 2.0, 3.5, 4.0])
    report = pace.report()
    assert report["period"] == {"p50": 1.0, "p99": 1.485, "p99.9": 1.4985, "max": 1.5}
    assert report["clock"] == "hardware"


def test_answers_are_too_slow_when_samples_wait_time_and_again():
    time = Stopwatch()
    pace = Pace(1.0, "hardware", time.now)
    for sample in range(0, 2 * TOO_SLOW, 2):
        assert not pace.too_slow
        pace.arrived(sample)
        time.pass_by(3.0)
        pace.answered()
    assert "each answer takes 3e+03 ms" in pace.too_slow


@pytest.mark.slow
def test_python_does_not_tidy_up_in_a_run_and_does_so_again_afterwards():
    switching = sys.getswitchinterval()
    with undisturbed():
        assert not gc.isenabled() and sys.getswitchinterval() <= 0.0005
    assert gc.isenabled() and sys.getswitchinterval() == switching
    with pytest.raises(ZeroDivisionError), undisturbed():
        raise ZeroDivisionError
    assert gc.isenabled()


def test_what_takes_its_time_is_done_before_the_watchdog_runs(monkeypatch):
    """On a slow computer collecting rubbish takes longer than the watchdog waits."""
    board = FaultBoard()
    monkeypatch.setattr(gc, "collect", lambda: board.time.pass_by(0.5))
    connection = Connection(lambda: board, srv02(), now=board.time.now)
    bench = Bench(connection, srv02(), joint(1), {"uri": "test", "clock": "wall"})
    with bench:
        recording = run(bench, OpenLoop(), np.zeros(50), SAMPLE_TIME, progress=False)
    assert board.time.now() == pytest.approx(0.5 + 49 * SAMPLE_TIME)
    assert recording.metadata["timing"]["late"] == 0
