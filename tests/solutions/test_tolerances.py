"""What marks hang on: each tolerance of the key at both of its edges, and the values themselves, each with a reason.

The first is made from the key: a check that is there is tried. The second is not: its numbers come from the encoder,
the length of a sweep and what people can read, and have to be changed here by whoever changes one there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from labcourse.answers.json_values import thin
from labcourse.grading.marking.checks import Number, RecordingOf
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.course.questions import CATALOGUE
from rotflex.specifications import LIMITS as SPECIFIED
from rotflex.units import DEG
from solutions import tolerances
from solutions.design_checks import ArrayFrom, Design, PolesFrom, StateSpaceFunction
from solutions.key import KEY
from solutions.key_modeling import A, B
from solutions.loop_checks import ClosedLoopPoles, GainPlaces
from solutions.response_checks import LIMITS, Measured, measured_again
from solutions.spectrum_checks import SpectrumFunction
from solutions.true_bench import TrueBench
from solutions.wanted import desired_poles, desired_polynomial

SEED = 20
INSIDE, OUTSIDE = 0.98, 1.02  # of a tolerance
BENCH = TrueBench("ada")
DESIGN = Design(BENCH.servo, BENCH.joint, BENCH.K_s)
Off = Callable[[float], Any]  # share of the tolerance, with its sign → an answer that is so far off


def case(**own: Any) -> Case:
    """A case with own answers, as ``q3_14__PO=``; there are no others."""
    known = {(name[1:].split("__")[0].replace("_", "."), name.split("__")[1]): value for name, value in own.items()}
    return Case(BENCH, lambda question, part: known[question, part], SEED, True)


def number(check: Number) -> Off:
    return lambda share: check.expected(BENCH) * (1 + share * check.rtol)


def array(check: ArrayFrom) -> Off:
    """Only the largest entry is off: for it, what should be zero has the least room."""
    right = np.asarray(check.ideal(DESIGN), dtype=float)

    def off(share: float) -> Any:
        moved = right.copy()
        moved.flat[np.abs(right).argmax()] *= 1 + share * check.rtol
        return moved

    return off


def poles(check: PolesFrom) -> Off:
    right = np.asarray(check.ideal(DESIGN), dtype=complex)

    def off(share: float) -> Any:
        moved = right.copy()
        moved[np.abs(right).argmax()] *= 1 + share * check.rtol
        return moved

    return off


def loop(check: ClosedLoopPoles) -> Off:
    """Where no gain was given, the desired poles are wanted."""
    return lambda share: desired_poles() * np.array([1, 1, 1, 1 + share * check.rtol])


def gain(check: GainPlaces) -> Off:
    """The closed loop's polynomial goes with the gain: open loop plus what the gain adds."""
    wanted, opened = desired_polynomial(), np.poly(DESIGN.voltage_model[0]).real
    worst = np.abs((wanted - opened) / wanted).max()
    return lambda share: DESIGN.K * (1 + share * tolerances.PLACED / worst)


def measured(check: Measured) -> Off:
    """Any run will do: of a simulation there are several, and an answer is off if it is off the last of them."""
    runs = [found[check.quantity] for found in measured_again(case(), check.again, check.recording)]

    def off(share: float) -> Any:
        reached = [target + share * max(check.rtol * abs(target), check.atol) for target in runs if np.isfinite(target)]
        return max(reached) if share > 0 else min(reached)

    return off


def recording(check: RecordingOf) -> Off:
    sweep = BENCH.sweep()
    kept = thin(len(sweep), 400)
    right = sweep[check.channel][kept]
    rms = np.sqrt(np.mean((right - right.mean()) ** 2))
    wave = np.where(np.arange(right.size) % 2, 1.0, -1.0)  # of mean 0 and RMS 1

    def off(share: float) -> Any:
        values = right + share * check.rtol * rms * wave
        return {
            "metadata": dict(sweep.metadata),
            "n": len(sweep),
            "sample_time": sweep.sample_time,
            "channels": {check.channel: {"unit": "rad", "values": values}},
        }

    return off


def spectrum(check: SpectrumFunction) -> Off:
    def off(share: float) -> Any:
        return [
            (np.fft.rfftfreq(x.size, dt), 2 * np.abs(np.fft.rfft(x)) / x.size * (1 + share * check.rtol))
            for x, dt in COMPOUND_SINES.inputs(SEED)
        ]

    return off


def state_space(check: StateSpaceFunction) -> Off:
    def off(share: float) -> Any:
        outputs = []
        for K_s, J_l, J_eq, B_eq in PLANT_PARAMETERS.inputs(SEED):
            p = {"K_s": K_s, "J_l": J_l, "J_eq": J_eq, "B_eq": B_eq}
            a, b = np.array(A(p), dtype=float), np.array(B(p), dtype=float)
            a[3, 1] += share * check.rtol * np.abs(a).max()
            outputs.append((a, b, np.eye(2, 4), np.zeros((2, 1))))
        return outputs

    return off


SORTS: dict[type, Callable[[Any], Off]] = {
    Number: number,
    ArrayFrom: array,
    PolesFrom: poles,
    GainPlaces: gain,
    ClosedLoopPoles: loop,
    Measured: measured,
    RecordingOf: recording,
    SpectrumFunction: spectrum,
    StateSpaceFunction: state_space,
}


def tried() -> Iterator[Any]:
    for question, parts in KEY.items():
        for part, check in parts.items():
            if type(check) in SORTS and part != "D":  # which is zero
                yield pytest.param(question, part, check, id=f"{question} {part}")


@pytest.mark.parametrize(("question", "part", "check"), list(tried()))
def test_each_tolerance_ends_where_it_says(question, part, check):
    asked, off = CATALOGUE.find(question).part(part), SORTS[type(check)](check)
    for side in (-1, 1):
        assert check.verdict(asked, off(side * INSIDE), case()).status is Status.RIGHT
        assert check.verdict(asked, off(side * OUTSIDE), case()).status is not Status.RIGHT


def test_what_is_zero_has_no_room():
    for question in ("2.14", "Table 2"):
        check, asked = KEY[question]["D"], CATALOGUE.find(question).part("D")
        given = [check.verdict(asked, np.array([[0.0], [value]]), case()).status for value in (0.0, 1e-9)]
        assert given == [Status.RIGHT, Status.WRONG]


@pytest.mark.parametrize("side", [-1, 1])
def test_a_gain_follows_from_the_own_companion_form_within_two_per_cent(side):
    (a, b, *_), W = DESIGN.torque_model, DESIGN.transformation[2]
    K_c = 1.3 * (desired_polynomial() - DESIGN.polynomial)[:0:-1]  # which places no pole where it is wanted
    own = case(q2_14__A=a, q2_14__B=b, q3_5__K_c=K_c, q3_7__W=W)
    check, asked = KEY["3.8"]["K"], CATALOGUE.find("3.8").part("K")
    for share, status in ((INSIDE, Status.FOLLOW_THROUGH), (OUTSIDE, Status.WRONG)):
        given = K_c @ np.linalg.inv(W) * (1 + side * share * tolerances.PLACED)
        assert check.verdict(asked, given, own).status is status


def test_the_specifications_are_the_workbooks():
    assert {"t_s": 0.5, "PO": 5.0, "alpha_max_deg": pytest.approx(12.5), "V_max": 10.0} == LIMITS
    assert SPECIFIED["max_alpha"] == pytest.approx(12.5 * DEG)


BIN = 1 / (8192 * 0.002)  # Hz, of a sweep of 15 s filled up to a power of two
SLOWEST, FASTEST = 18.0 / (2 * math.pi), 27.5 / (2 * math.pi)  # Hz, of the benches that are drawn
COUNT = 360 / 4096 / 40 * 100  # per cent of a step of 40 deg
ARM_1, ARM_3 = 3.278e-3, 3.983e-3  # kg·m², of the data sheet's arm at the first anchor and at the last


def pinned() -> dict[str, tuple[Any, float, float]]:
    """Tolerance → its value, and the least and the most that it can be, by independent reasons."""
    t = tolerances
    room = t.MEASURED
    return {
        # A figure of 3 to 5 Hz is read to 0.1 Hz: half a mark is 1.1 to 1.7 %, a whole one twice that.
        "BY_EYE": (t.BY_EYE, 0.1 / FASTEST, 0.1 / SLOWEST),
        # 18.0 to three digits.
        "BY_PROGRAM": (t.BY_PROGRAM, 0.05 / 18.0, 0.06 / 18.0),
        # A fit of the ratio on 500 benches: up to 1.09 % above, and a rare one more.
        "NEAR_TRUE": (t.NEAR_TRUE, 0.0115, 0.013),
        # Half a bin of the slowest bench; and three digits.
        "BIN": (t.BIN, BIN / 2 / SLOWEST, BIN / 2 / SLOWEST + 0.003),
        # J_l, omega_n and K_s in three digits: 0.5/300 + 2·0.5/180 + 0.5/107, and half as much again.
        "K_S_FROM_OWN": (t.K_S_FROM_OWN, 1.5 * (0.5 / 300 + 2 * 0.5 / 180 + 0.5 / 107), 0.021),
        "FEWEST_DIGITS": (t.FEWEST_DIGITS, 2, 2),
        # Arms whose masses are 8 %, and whose lengths 3 %, off the data sheet's; the preset's is 2.77 g·m².
        "ARMS, least": (t.ARMS[0], 2.6e-3, 0.92 * 0.97**2 * ARM_1),
        "ARMS, most": (t.ARMS[1], 1.08 * 1.03**2 * ARM_3, 4.6e-3),
        # 64 g and 30 g in whole grams: 0.8 % of 58 % and 1.7 % of 42 %, hardly ever both at their most.
        "J_L": (t.J_L, 0.008, 0.0117),
        "J_L_SLIP": (t.J_L_SLIP, 1.5 * 0.5 / 300, 0.0031),  # as above
        "CARRIED": (t.CARRIED, 0.019, 0.021),
        # Six digits are kept. A friend's: 1.05 % at least, of 250 000 pairs.
        "RECORDING": (t.RECORDING, 0.008, 0.0105),
        "RESOLUTION": (t.RESOLUTION, 0.009, 0.0105),  # 0.0015 rad for 0.001534 is a digit too few: 2.2 %
        # A recording that ends half a sample later, with zeros, or one bin less: below 1 %; a factor √2 is 41 %.
        "SPECTRUM": (t.SPECTRUM, 0.045, 0.051),
        "DESIRED": (t.DESIRED, 0.005, 0.0051),  # the workbook's own rounding of its coefficients is 0.4 %
        # Three digits of the gain: its entries are up to 0.5 % off, and a coefficient up to three times as much.
        "PLACED": (t.PLACED, 0.016, 0.021),
        "CONTROLLABILITY": (t.CONTROLLABILITY, 0.025, 0.031),
        "K_S": (t.K_S, 1.95 * 0.05, 2.05 * 0.05),  # twice what omega_n may be off
        "ALIKE, omega_n": (t.ALIKE["omega_n"], 0.034, 0.036),
        "ALIKE, J_l": (t.ALIKE["J_l"], 0.5 / 300, 0.0021),
        "ALIKE, K_s": (t.ALIKE["K_s"], 2 * 0.035, 0.0701),
        # Half a degree of 40 off the plot is 0.625 points, a little less than three counts.
        "PO, points": (room["PO"]["atol"], 0.625, 3 * COUNT + 1e-9),
        "PO": (room["PO"]["rtol"], 0.049, 0.051),
        "t_s, s": (room["t_s"]["atol"], 0.0195, 0.0205),  # a mark of the plot either way is 0.02 s
        "t_s": (room["t_s"]["rtol"], 0.049, 0.051),
        "alpha_max_deg, deg": (room["alpha_max_deg"]["atol"], 0.36 / 4.096, 0.101),  # a count, or half of 0.2 deg
        "alpha_max_deg": (room["alpha_max_deg"]["rtol"], 0.029, 0.031),
        "V_max, V": (room["V_max"]["atol"], 0.099, 0.101),  # half of 0.2 V
        "V_max": (room["V_max"]["rtol"], 0.049, 0.051),
    }


def test_a_tolerance_is_what_its_reason_gives():
    assert [name for name, (value, least, most) in pinned().items() if not least <= value <= most] == []
