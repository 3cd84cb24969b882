"""The runaway guard: it lets pass what benches do, and nothing that they cannot do."""

from __future__ import annotations

import numpy as np
import pytest

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.hil.guard import Allowance, Guard
from rotflex.hil.student_benches import student_bench
from rotflex.recording import Recording
from rotflex.units import DEG

GAIN = [18.24, -17.15, 1.59, 0.63]


def judged(
    recording: Recording, motor: int = 1, servo: int = 1, link: int = 1, allowance: Allowance | None = None
) -> tuple[str | None, int]:
    """What the guard says of a recording that is read with these signs, and at which sample."""
    guard = Guard(srv02(), allowance=allowance)
    guard.start(recording.sample_time)
    signals = zip(recording["theta"].tolist(), recording["alpha"].tolist(), recording["vm"].tolist(), strict=True)
    for sample, (theta, alpha, volts) in enumerate(signals):
        if why := guard.see(servo * theta, link * alpha):
            return why, sample
        guard.drive(motor * volts)
    return None, len(recording)


#: Experiments that excite all that a bench does, shortened.
EXPERIMENTS = {
    "sweep": lambda bench: experiments.sweep(bench, duration=6.0, progress=False),
    "sweep of the voltage": lambda bench: experiments.sweep(bench, duration=6.0, drive="voltage", progress=False),
    "decay": lambda bench: experiments.free_decay(bench, duration=2.0, progress=False),
    "full": lambda bench: experiments.tracking(bench, GAIN, duration=4.5, progress=False),
    "partial": lambda bench: experiments.tracking(bench, GAIN, "partial", duration=4.5, progress=False),
}


@pytest.mark.parametrize("address", ["virtual:?preset=real_bench", "virtual:?seed=23"])
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_no_honest_run_is_stopped(address, experiment):
    with hil.open(address) as bench:
        recording = EXPERIMENTS[experiment](bench)
    assert judged(recording) == (None, len(recording))


@pytest.mark.parametrize("seed", [1, 18])
def test_a_stiff_joint_passes_where_its_stiffness_is_known_and_not_under_the_workbooks(seed):
    """These are 2.1 times as stiff as the workbook's."""
    stiffness = student_bench(seed).parameters.K_s
    with hil.open(f"virtual:?seed={seed}") as bench:
        recording = experiments.sweep(bench, progress=False)
    for off in (0.85, 1.0, 1.15):
        assert judged(recording, allowance=Allowance(stiffness=off * stiffness))[0] is None
    assert judged(recording)[0] is not None  # in whichever words


def test_the_log_of_a_real_bench_passes_and_not_with_motor_or_encoder_the_other_way(real_log):
    """(That the link alone counts the other way shows in closed loop, see test_faults.py.)"""
    assert judged(real_log)[0] is None
    assert judged(real_log, -1, -1, -1)[0] is None
    first = int(np.flatnonzero(np.abs(real_log["vm"]) > 0.5)[0])
    for signs in ((-1, 1, 1), (1, -1, 1), (-1, 1, -1), (1, -1, -1)):
        why, sample = judged(real_log, *signs)
        assert "sign" in why
        assert np.abs(real_log["theta"][first : sample + 1] - real_log["theta"][first]).max() < 6 * DEG


def test_a_counter_that_stands_still_is_told_apart_from_one_that_turns_the_wrong_way():
    guard = Guard(srv02())
    guard.drive(3.0)
    said = [why for _sample in range(200) if (why := guard.see(0.1, 0.0))]
    assert "stood still for" in said[0] and "3.0 V" in said[0]


def test_a_voltage_that_friction_may_hold_or_a_motion_at_0_V_is_nobodys_fault():
    guard = Guard(srv02())
    assert not any(guard.see(0.5 * np.sin(sample / 50), 0.1 * np.sin(sample / 10)) for sample in range(2000))
    guard = Guard(srv02())
    guard.drive(0.2)
    assert not any(guard.see(0.1, 0.0) for _sample in range(2000))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("theta", "alpha", "name"), [(1.0, 0.0, "servo angle"), (0.0, 1.0, "deflection")])
def test_a_jump_is_told_at_once_and_a_quick_motion_over_samples_that_were_missed_is_none(theta, alpha, name, sign):
    theta, alpha = sign * theta, sign * alpha
    guard = Guard(srv02())
    guard.see(0.0, 0.0)
    assert f"The {name} jumped by {sign * 57.3} deg" in guard.see(theta, alpha)
    guard.start(0.002)
    guard.see(0.0, 0.0)
    assert guard.see(theta, alpha, samples=50) is None


def test_a_run_begins_without_a_memory_of_the_last():
    guard = Guard(srv02())
    guard.drive(3.0)
    while not guard.see(0.1, 0.0):
        pass
    guard.start(0.002)
    assert guard.see(3.0, 0.0) is None and (guard.apart, guard.moved) == (0.0, 0.0)
