"""Designs beyond the workbook on drawn benches: observers, sampled design, robustness, flat turns.

    python benchmarks/beyond.py [--benches 100]

A design rests on what a student has: the nominal servo, the joint as told, K_s from a sweep that is off by 2 %, no
damping of the link, a delay of 2 ms. It runs on the bench as it is. It prints the median, 5 % and 95 % of all benches.
"""

from __future__ import annotations

import argparse
import contextlib
from collections import defaultdict
from collections.abc import Iterator

import control
import numpy as np

from rotflex import design, experiments, hil, model, observers, response, sampled
from rotflex.config import srv02
from rotflex.controller import Controller
from rotflex.errors import BenchError, DesignError
from rotflex.hil.controllers import ObserverFeedback, OpenLoop, StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.student_benches import student_bench
from rotflex.signals import shaped, smooth_square_wave, time_axis
from rotflex.signals.flat import turn
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, OMEGA_N, P_3, P_4, RATE, ZETA
from rotflex.units import DEG

POLES = design.desired_poles(ZETA, OMEGA_N, P_3, P_4)
TIP, SWING = np.array([1, 1, 0, 0, 0]), np.array([0, 0, 0, 1, 0])
WEIGHTS = 300 * np.outer(TIP, TIP) + 2 * np.outer(SWING, SWING)  # of LQR, with 1 for V_m²
DELAY, FRICTION, TIME = 0.002, 0.07, time_axis(2.5, 0.002)  # s, V, s
BEGIN, END, ANGLE = 0.5, 1.0, 40 * DEG  # of a turn: s, s, rad
PUSH = 0.2 * ((TIME >= BEGIN) & (TIME < BEGIN + 0.1))  # N·m


def own_model(seed: int, factor: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B and the gain K of a student, with a K_s that is off by another factor."""
    K_s = factor * student_bench(seed).parameters.K_s * np.random.default_rng([seed, 11]).normal(1, 0.02)
    system = model.state_space(srv02(), student_bench(seed).joint, K_s, link_damping=0.0)
    return system.A, system.B, design.gain_by_place(system.A, system.B, POLES)


def designs(seed: int, factor: float) -> Iterator[tuple[str, float, StateFeedback | ObserverFeedback]]:
    """Yield each design with its name and sample time (s)."""
    A, B, K = own_model(seed, factor)
    yield from ((f"33 Hz, {feedback}", 0.002, StateFeedback(K, feedback)) for feedback in ("full", "partial"))
    for h in (0.002, 0.01, 0.02, 0.03, 0.05):
        yield "emulated", h, StateFeedback(K, sample_time=h, cutoff=1 / h)
        plant, push = sampled.sample(A, B, h, DELAY), [0, 0, 0, 1 / student_bench(seed).joint.J_l]
        effects = (sampled.sample(A, column, h).B for column in (B, push))
        noise = observers.process_noise(plant, *zip(effects, (0.1, 0.005), strict=True))
        servo, both = (observers.kalman_gain(plant, noise, srv02().K_enc, alone) for alone in (True, False))
        placed, lqr = sampled.gain_by_place(plant, POLES), control.dlqr(plant, WEIGHTS, [[1.0]])[0]
        for name, L, gain in (("servo's encoder", servo, placed), ("both", both, placed), ("LQR", servo, lqr)):
            yield f"sampled, {name}", h, ObserverFeedback(plant.A, plant.B, L, gain, h)


def turns(seed: int) -> Iterator[tuple[str, Controller, np.ndarray]]:
    """Yield each way to turn, with its command."""
    A, B, K = own_model(seed)
    motion, full, partial = turn(A, B, ANGLE, END - BEGIN, TIME, BEGIN), StateFeedback(K), StateFeedback(K, "partial")
    step, ahead = ANGLE * np.clip((TIME - BEGIN) / 0.02, 0, 1), motion.feedforward(K, FRICTION)
    swinging = max(np.linalg.eigvals(A - B @ (K * [1, 0, 1, 0])), key=np.imag)
    yield "flat, open loop", OpenLoop(), motion.volts
    yield "flat", TwoDegreesOfFreedom(full, ahead), motion.states[0]
    yield "flat, integrator", TwoDegreesOfFreedom(full, ahead, rate=2.0), motion.states[0]
    yield "step", full, step
    yield "step, partial", partial, step
    yield "shaped, partial", partial, shaped(step, abs(swinging), -swinging.real / abs(swinging), 0.002)


def measured(seed: int) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield what is measured on a bench. Swing is what is left half a second after a turn or a push begins."""
    A, B, K = own_model(seed)  # with the right K_s
    yield "emulation", {"limit, ms": 1e3 * sampled.longest_sample_time(A, B, K, DELAY)}
    for factor in (1.0, 0.7, 1.3):
        for name, h, controller in designs(seed, factor):
            row = {"settling, s": np.inf, "M_s": np.inf}  # where a limit stops the run, or the model is unstable
            with contextlib.suppress(DesignError):
                row["M_s"] = sampled.margins(sampled.sample(A, B, h, DELAY), controller.system()).sensitivity_peak
            with hil.open("virtual", seed=seed) as bench, contextlib.suppress(BenchError):
                wave = smooth_square_wave(time_axis(DURATION, h), FREQUENCY, AMPLITUDE, RATE)
                log = experiments.follow(bench, controller, wave, h, progress=False)
                worst = response.worst(response.measure(log))
                row |= {"settling, s": worst.settling_time, "alpha, deg": worst.max_alpha / DEG, "V_m, V": worst.max_vm}
                row |= {"noise, V": response.voltage_noise(log), "swing, deg": response.swing(log) / DEG}
            yield f"K_s x {factor:g}, {1e3 * h:g} ms, {name}", row
            if h == 0.002 and factor == 1:
                yield f"push, {name}", short(seed, controller, 0 * TIME, PUSH)
    for name, way, command in turns(seed):
        yield f"turn, {name}", short(seed, way, command)


def short(seed: int, controller: Controller, command: np.ndarray, push: np.ndarray | None = None) -> dict[str, float]:
    """Measure a turn, or a push at the arm at rest."""
    with hil.open("virtual", seed=seed, disturbance=push) as bench:
        log = experiments.follow(bench, controller, command, progress=False)
    alpha = np.abs(log.degrees("alpha"))
    return {"alpha, deg": alpha.max(), "V_m, V": np.abs(log["vm"]).max(), "swing, deg": alpha[TIME >= END].max()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Measure designs beyond the workbook on drawn benches.")
    parser.add_argument("--benches", type=int, default=100)
    parser.add_argument("--smoke", action="store_true", help="one bench")
    options = parser.parse_args()
    found = defaultdict(list)
    for seed in range(1 if options.smoke else options.benches):
        for name, row in measured(seed):
            for quantity, value in row.items():
                found[name, quantity].append(value)
    for (name, quantity), values in found.items():
        print(f"{name:41} {quantity:12}", np.quantile(values, (0.5, 0.05, 0.95), method="nearest").round(4))


if __name__ == "__main__":
    main()
