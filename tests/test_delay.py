"""How late the board's output may come: every experiment's loop, on the workbook's bench and on drawn ones."""

from dataclasses import replace

import numpy as np
import pytest
from delay_margin import spectral_radius

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import DERIVATIVE_CUTOFF
from rotflex.hil.student_benches import preset, student_bench
from rotflex.hil.terminals import Timing
from rotflex.hil.virtual import VirtualBoard

DESIGNED_FOR = 4e-3  # s
MARGIN = 1.5
BENCHES = [preset("workbook"), preset("real_bench"), *(student_bench(seed) for seed in range(60))]
PRINTED = [18.2356, -17.1547, 1.5893, 0.6327]


def loop(holding):
    """Gain on theta, alpha and their rates, and cut-off, of a position loop."""
    given = holding.keywords
    return [given["K_p"], 0.0, given["K_d"], 0.0], given.get("cutoff", DERIVATIVE_CUTOFF)


LOOPS = {
    "sweep": loop(experiments.FOLLOWING),
    "free decay": loop(experiments.HOLDING),
    "full-state feedback": (PRINTED, DERIVATIVE_CUTOFF),
    "partial-state feedback": ([18.2356, 0.0, 1.5893, 0.0], DERIVATIVE_CUTOFF),
}


@pytest.mark.parametrize("name", LOOPS)
def test_every_loop_is_stable_with_one_and_a_half_times_the_delay_that_it_is_made_for(name):
    gain, cutoff = LOOPS[name]
    for bench in BENCHES:
        assert spectral_radius(bench.parameters, gain, cutoff, MARGIN * DESIGNED_FOR) < 1 + 1e-9


def test_no_virtual_board_is_later_than_that():
    assert max(bench.timing.longest for bench in BENCHES) < DESIGNED_FOR


def late_bench(seed, delay):
    spec = replace(student_bench(seed), timing=Timing(delay=delay))
    servo = srv02()
    return Bench(
        lambda: VirtualBoard(spec.parameters, servo, timing=spec.timing), servo, spec.joint, {"clock": "simulated"}
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_with_outputs_4_ms_late_no_experiment_buzzes(seed):
    with late_bench(seed, DESIGNED_FOR) as bench:
        runs = [experiments.sweep(bench, progress=False), experiments.free_decay(bench, progress=False)]
    for recording in runs:
        at_limit = np.mean(np.abs(recording["vm"]) >= 10)
        assert at_limit < 0.01
        swinging = recording["vm"][recording.time > 0.5]
        fast = np.fft.rfft(swinging)
        fast[np.fft.rfftfreq(swinging.size, 0.002) < 50] = 0
        assert np.std(np.fft.irfft(fast, swinging.size)) < 0.6  # V; a loop that buzzes has 7


@pytest.mark.parametrize("seed", range(4))
def test_the_sweeps_voltage_has_little_power_above_50_hz(seed):
    """Above that the motor should not be driven (facts.md)."""
    with hil.open(seed=seed) as bench:
        volts = experiments.sweep(bench, progress=False)["vm"]
    power = np.abs(np.fft.rfft(volts - volts.mean())) ** 2
    assert power[np.fft.rfftfreq(volts.size, 0.002) > 50].sum() < 0.04 * power.sum()
