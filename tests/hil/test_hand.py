"""A torque on the arm of a virtual bench: recorded, played again, limited, and gone when nobody pulls."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotflex import experiments, hil
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench, Connection
from rotflex.hil.student_benches import WORKBOOK
from rotflex.hil.virtual import DRIVING, STANDING, Hand, VirtualBoard
from rotflex.plant import Plant
from rotflex.recording import PUSHED, Recording
from rotflex.units import DEG

K = [18.2, -17.2, 1.59, 0.633]
SECONDS = 3.1


def test_a_torque_on_the_link_moves_the_plant_as_its_equations_of_motion_say():
    p, torque, volts = WORKBOOK.parameters, 0.2, 1.5

    def motion(_t, state):
        _theta, alpha, theta_dot, alpha_dot = state
        drive = p.torque_per_volt * (volts - p.back_emf * theta_dot)
        servo = (drive + p.K_s * alpha + p.B_l * alpha_dot - p.B_eq * theta_dot) / p.J_eq
        return theta_dot, alpha_dot, servo, (torque - p.K_s * alpha - p.B_l * alpha_dot) / p.J_l - servo

    plant = Plant(p)
    plant.torque = torque
    for _step in range(250):
        plant.advance(volts, 0.002)
    expected = solve_ivp(motion, (0, 0.5), np.zeros(4), rtol=1e-10, atol=1e-12).y[:, -1]
    assert plant.state == pytest.approx(expected, abs=1e-7)


def pulled(seed, experiment, pull, most):
    """Run an experiment while a hand pulls where ``pull(time, state)`` says, rad in the room."""
    hand = Hand(most)

    def push(measured, plant):
        hand.pull(pull(measured.time, plant.state))
        return hand(measured, plant)

    with hil.open(f"virtual:?seed={seed}", disturbance=push) as bench:
        return experiment(bench, duration=SECONDS, progress=False)


def at_random(seed):
    """A pull that jumps to another place some times a second."""
    places = np.random.default_rng(seed).uniform(-2, 2, 40)
    return lambda time, _state: places[int(9 * time)]


def with_the_swing(_time, state):
    return state.theta + state.alpha + math.copysign(1.5, state.alpha_dot)


def as_far_as_it_goes(_time, state):
    return state.theta + state.alpha + 1.5


def test_a_recorded_push_that_is_played_again_gives_the_same_recording_to_the_last_bit(tmp_path):
    once = pulled(7, experiments.free_decay, at_random(7), DRIVING)
    saved = Recording.load(once.save(tmp_path / "pushed.mat"))
    assert np.ptp(saved[PUSHED]) > 0.1 and saved.channels[PUSHED].unit == "N·m"
    with hil.open("virtual:?seed=7", disturbance=saved[PUSHED]) as bench:
        runs = [experiments.free_decay(bench, duration=SECONDS, progress=False) for _run in range(2)]
    for again in runs:
        for name, channel in once.channels.items():
            assert (again[name] == channel.values).all(), name


EXPERIMENTS = {
    "hold": (experiments.hold, STANDING),
    "watch": (experiments.watch, STANDING),
    "full": (lambda bench, **how: experiments.tracking(bench, K, **how), DRIVING),
    "partial": (lambda bench, **how: experiments.tracking(bench, K, "partial", **how), DRIVING),
    "free decay": (experiments.free_decay, DRIVING),
}


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_no_hand_brings_the_arm_20_degrees_off_on_any_bench(name):
    experiment, most = EXPERIMENTS[name]
    largest = []
    for seed in range(9):
        pull = (with_the_swing, as_far_as_it_goes, at_random(seed))[seed // 3]
        largest.append(np.abs(pulled(seed, experiment, pull, most)["alpha"]).max())
    assert max(largest) < 20 * DEG
    if name == "hold":
        assert min(largest) > 10 * DEG  # and it can be pulled far


def test_a_hand_pulls_until_it_lets_go_however_little_it_says():
    hand = Hand(STANDING)

    def push(measured, plant):
        if measured.time == 0.5:
            hand.pull(1.0)
        if measured.time == 1.6:
            hand.let_go()
        return hand(measured, plant)

    with hil.open("virtual:?seed=7", disturbance=push) as bench:
        held = experiments.hold(bench, duration=2.0, progress=False)
    assert ((held[PUSHED] != 0) == ((held.time >= 0.5) & (held.time < 1.6))).all()


def test_a_run_that_is_broken_off_keeps_the_push():
    with hil.open("virtual:?seed=7", disturbance=np.full(1000, 0.1)) as bench:

        def stop(measured, _voltage):
            if measured.time == 1.0:
                raise BenchError("enough")

        bench.on_sample = stop
        with pytest.raises(BenchError, match="enough"):
            experiments.hold(bench, progress=False)
        assert (bench.recorder.unfinished[PUSHED][:-1] == 0.1).all() and bench.board.plant.torque == 0.0


def test_what_cannot_be_pushed_says_so(tmp_path):
    with hil.open("virtual:?seed=7") as bench:
        path = experiments.hold(bench, duration=0.1, progress=False).save(tmp_path / "held.mat")
    for address in ("virtual:?clock=wall", f"replay:{path}"):
        with pytest.raises(BenchError, match="only on a virtual bench in simulated time"):
            hil.open(address, disturbance=[0.1])
    virtual = hil.open("virtual")
    real = Bench(
        Connection(lambda: VirtualBoard(WORKBOOK.parameters), virtual.servo),
        virtual.servo,
        virtual.joint,
        {"board": "real"},
    )
    with pytest.raises(BenchError, match="push the arm by hand"):
        real.disturb([0.1])
    own = SimpleNamespace(state=(0.0, 0.0, 0.0, 0.0), advance=lambda _voltage, _duration: None)
    with (
        hil.open("virtual", plant=own, disturbance=[0.1]) as bench,
        pytest.raises(BenchError, match="rotflex's own plant"),
    ):
        experiments.hold(bench, duration=0.1, progress=False)
    for torque in ([[0.1]], [math.nan]):
        with pytest.raises(BenchError, match="one-dimensional array of finite numbers"):
            virtual.disturb(torque)
