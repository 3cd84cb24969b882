"""How late the board's output may come: every experiment's loop, on the workbook's bench and on drawn ones."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from delay_margin import spectral_radius

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.hil.controllers import DERIVATIVE_CUTOFF
from rotflex.hil.student_benches import preset, student_bench
from rotflex.hil.virtual import TICK, Timing
from solutions.design_checks import Design

DESIGNED_FOR = 4e-3  # s
MARGIN = 1.5
BENCHES = [preset("workbook"), preset("real_bench"), *(student_bench(seed) for seed in range(60))]
PRINTED = [18.2356, -17.1547, 1.5893, 0.6327]


def loop(holding):
    """Gain on theta, alpha and their rates, and cut-off, of a position loop."""
    given = holding.keywords
    return [given["K_p"], 0.0, given["K_d"], 0.0], given.get("cutoff", DERIVATIVE_CUTOFF)


def own(bench):
    """The bench's own gain: the printed poles, with its true stiffness."""
    return Design(srv02(), bench.joint, bench.parameters.K_s).K.ravel().tolist()


def without_alpha(gain):
    return [gain[0], 0.0, gain[2], 0.0]


LOOPS = {
    "sweep": lambda bench: loop(experiments.FOLLOWING),
    "free decay": lambda bench: loop(experiments.HOLDING),
    "full state, printed": lambda bench: (PRINTED, DERIVATIVE_CUTOFF),
    "partial state, printed": lambda bench: (without_alpha(PRINTED), DERIVATIVE_CUTOFF),
    "full state, own": lambda bench: (own(bench), DERIVATIVE_CUTOFF),
    "partial state, own": lambda bench: (without_alpha(own(bench)), DERIVATIVE_CUTOFF),
}


@pytest.mark.parametrize("name", LOOPS)
def test_every_loop_is_stable_with_one_and_a_half_times_the_delay_that_it_is_made_for(name):
    for bench in BENCHES:
        gain, cutoff = LOOPS[name](bench)
        assert spectral_radius(bench.parameters, gain, cutoff, MARGIN * DESIGNED_FOR) < 1 + 1e-9


def test_no_virtual_board_is_later_than_that_but_for_single_samples():
    assert max(bench.timing.delay + bench.timing.jitter for bench in BENCHES) < DESIGNED_FOR
    assert {bench.timing.late for bench in BENCHES} <= {0.0, 1e-3}


@dataclass(frozen=True)
class OneLate(Timing):
    """Outputs that take as long as the latest drawn bench's, and one of them a sample longer."""

    delay: float = 3.75e-3
    at: int = -1

    def ticks(self):
        for index, ticks in enumerate(super().ticks()):
            yield ticks + (round(0.002 / TICK) if index == self.at else 0)


RUNS = {  # an experiment, and the sample whose answer is late: at the resonance, in the jump, in the middle of a turn
    "sweep": (lambda bench: experiments.sweep(bench, duration=8, progress=False), 2500),
    "free decay": (lambda bench: experiments.free_decay(bench, duration=2, progress=False), 20),
    "full": (lambda bench: experiments.tracking(bench, PRINTED, duration=4, progress=False), 775),
    "partial": (lambda bench: experiments.tracking(bench, PRINTED, "partial", duration=4, progress=False), 775),
}


@pytest.mark.parametrize("name", RUNS)
def test_what_a_single_late_sample_starts_has_died_out_after_half_a_second(name):
    experiment, late = RUNS[name]
    runs = []
    for at in (-1, late):
        with hil.open("virtual", plant=replace(student_bench(2), timing=OneLate(at=at))) as bench:
            runs.append(experiment(bench))
    after = slice(late + 250, late + 500)
    volts = np.abs(runs[0]["vm"] - runs[1]["vm"])
    assert volts.max() > 0
    for angle in ("theta", "alpha"):
        counts = np.abs(runs[0][angle] - runs[1][angle])[after].max() / srv02().K_enc
        assert counts < (2.5 if name == "sweep" else 1.5)  # in a sweep the servo sticks at each turn, a count elsewhere


@pytest.mark.parametrize("seed", [0, 3])
def test_the_sweeps_voltage_has_little_power_above_50_hz(seed):
    """Above that the motor should not be driven (facts.md)."""
    with hil.open(seed=seed) as bench:
        volts = experiments.sweep(bench, progress=False)["vm"]
    power = np.abs(np.fft.rfft(volts - volts.mean())) ** 2
    assert power[np.fft.rfftfreq(volts.size, 0.002) > 50].sum() < 0.04 * power.sum()
