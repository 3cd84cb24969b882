"""When a voltage arrives at the plant."""

from __future__ import annotations

import math
from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.errors import ConfigurationError
from rotflex.hil.terminals import TICK, Terminals, Timing
from rotflex.plant import State

LATE = Timing(delay=1e-3, jitter=0.25e-3, late=0.01, late_by=2e-3, seed=5)


class Watched:
    """Moves nowhere, and remembers which voltages it was held at, and for how long."""

    state = State(0.0, 0.0, 0.0, 0.0)

    def __init__(self) -> None:
        self.held: list[tuple[float, float]] = []

    def advance(self, voltage: float, duration: float) -> State:
        if self.held and self.held[-1][0] == voltage:
            voltage, before = self.held.pop()
            duration += before
        self.held.append((voltage, duration))
        return self.state


def terminals(timing=LATE, gain=1.0, now=0.0):
    return Terminals(Watched(), motor=0, gain=gain, outputs=2, timing=timing, now=now)


@pytest.mark.parametrize(
    ("delay", "held"), [(0.0, [(3.0, 2e-3), (-3.0, 2e-3)]), (0.75e-3, [(0.0, 0.75e-3), (3.0, 2e-3), (-3.0, 1.25e-3)])]
)
def test_a_voltage_takes_effect_after_the_delay_and_the_one_before_holds_until_then(delay, held):
    ours = terminals(Timing(delay=delay), gain=3.0, now=1.0)
    ours.send({0: 1.0, 1: 5.0})
    ours.move(1.002)
    ours.send({0: -1.0})
    ours.move(1.004)
    assert np.ravel(ours.plant.held) == pytest.approx(np.ravel(held))


def test_a_delay_of_several_samples_shifts_each_voltage_by_as_much():
    ours, time = terminals(Timing(delay=5e-3)), 0.0
    for n in range(1, 21):
        ours.send({0: float(n)})
        time += 0.002
        ours.move(time)
    assert [voltage for voltage, _ in ours.plant.held] == [float(n) for n in range(19)]
    assert [round(duration, 9) for _, duration in ours.plant.held] == [5e-3, *[2e-3] * 17, 1e-3]


def test_what_was_commanded_last_is_known_before_it_arrives():
    ours = terminals(Timing(delay=1e-3))
    ours.send({0: 1.0})
    ours.send({1: 2.0})
    assert ours.commanded == [1.0, 2.0]
    ours.move(0.0005)
    assert ours.plant.held == [(0.0, 0.0005)]
    ours.move(0.1)
    assert ours.commanded == [1.0, 2.0]


def test_none_overtakes_the_one_before():
    timing = Timing(delay=1e-3, late=0.5, late_by=4e-3, seed=1)
    ours, time = terminals(timing), 0.0
    for n in range(200):
        ours.send({0: float(n)})
        time += 0.002
        ours.move(time)
    voltages = [voltage for voltage, _ in ours.plant.held]
    assert voltages == sorted(voltages) and len(set(voltages)) == len(voltages)
    assert sum(duration for _, duration in ours.plant.held) == pytest.approx(0.4)


def test_what_is_set_at_once_puts_aside_what_was_on_its_way():
    """A watchdog that expires sets 0 V, and no voltage from before arrives after it."""
    ours = terminals(Timing(delay=2e-3))
    ours.send({0: 5.0})
    ours.set({0: 0.0})
    ours.move(0.01)
    assert ours.plant.held == [(0.0, 0.01)] and ours.commanded == [0.0, 0.0]


def test_delays_are_drawn_around_the_mean_and_some_come_late():
    delays = np.array(list(islice(LATE.ticks(), 20_000))) * TICK
    in_time = delays[delays < 2e-3]
    assert 0.75e-3 <= in_time.min() < 0.8e-3 and 1.2e-3 < in_time.max() <= 1.25e-3
    assert in_time.mean() == pytest.approx(1e-3, rel=0.01)
    assert np.mean(delays >= 2e-3) == pytest.approx(0.01, abs=0.002)
    assert delays.max() <= LATE.longest == pytest.approx(3.25e-3)


def test_delays_are_the_same_for_the_same_seed_and_begin_anew_with_every_task():
    ours = terminals()
    first = list(islice(LATE.ticks(), 3000))
    assert first == list(islice(LATE.ticks(), 3000))
    assert first != list(islice(Timing(1e-3, 0.25e-3, 0.01, 2e-3, seed=6).ticks(), 3000))

    def sent(time: float) -> list[float]:
        ours.move(time)
        ours.set({0: 0.0})
        ours.begin()
        ours.plant.held.clear()
        for n in range(20):
            ours.send({0: float(n % 2)})
            ours.move(time + 0.002 * (n + 1))
        return [duration for _, duration in ours.plant.held]

    np.testing.assert_allclose(sent(0.0), sent(1.0), atol=1e-9)


def test_a_timing_that_cannot_be_is_refused():
    wrong = [{"delay": value} for value in (-1e-3, math.inf, math.nan)] + [{"jitter": 1e-3}]
    wrong += [{"delay": 1e-3, "jitter": jitter} for jitter in (2e-3, -1e-4)]
    wrong += [{"late": 1.5}, {"late": -0.1}, {"late_by": -1e-3}, {"late_by": math.inf}]
    for values in wrong:
        with pytest.raises(ConfigurationError):
            Timing(**values)


@given(st.floats(0, 0.005), st.floats(0, 1), st.floats(0, 1), st.floats(0, 0.005), st.integers(0, 2**32 - 1))
def test_no_output_comes_before_it_was_written_or_later_than_the_longest(delay, share, late, late_by, seed):
    timing = Timing(delay, share * delay, late, late_by, seed)
    delays = np.array(list(islice(timing.ticks(), 1500))) * TICK
    half_a_step = 4 * TICK * (1 + 1e-9)
    assert delays.min() >= 0 and delays.min() >= delay - share * delay - half_a_step
    assert delays.max() <= timing.longest + half_a_step
