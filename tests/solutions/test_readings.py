"""Natural frequency and stiffness: each honest reading is right, and what fits another bench is not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case, Verdict
from rotflex import identification
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed
from rotflex.units import HZ
from solutions import readings, tolerances
from solutions.key import KEY
from solutions.reading_checks import frequency_of, inertia_slips, is_of_other_arms
from solutions.true_bench import TrueBench

RIGHT, FOLLOWS, WRONG = Status.RIGHT, Status.FOLLOW_THROUGH, Status.WRONG
#: All arms, and many frequencies. One bench is slow; the peak of another one's sweep is 5 % high, or 14 % low with a
#: window.
STUDENTS = ("ada", "alan", "demo", "check-course", "linus", "otto")
BENCHES = {name: TrueBench(name) for name in STUDENTS}


@pytest.fixture(params=STUDENTS)
def bench(request):
    return BENCHES[request.param]


def case(bench: TrueBench, virtual: bool = True, run: Any = None, **own: float) -> Case:
    places = {"omega_n": ("2.11", "omega_n"), "J_l": ("2.12", "J_l"), "K_s": ("2.12", "K_s")}
    known: dict[tuple[str, str], Any] = {places[name]: value for name, value in own.items()}
    if run is not None:
        known["2.9", "sweep"] = {"metadata": {"bench": {"run": run}}}
    return Case(bench, lambda question, part: known[question, part], 7, virtual)


def verdict(question: str, part: str, value: float, case: Case) -> Verdict:
    return KEY[question][part].verdict(CATALOGUE.find(question).part(part), value, case)


def omega(value: float, case: Case) -> Verdict:
    return verdict("2.11", "omega_n", value, case)


def stiffness(value: float, case: Case) -> Verdict:
    return verdict("2.12", "K_s", value, case)


def highest(f: Any, amplitude: Any) -> float:
    inside = (f >= 1) & (f <= 5)
    return float(HZ * f[inside][np.argmax(amplitude[inside])])


def by_fft(length: int, window: str = "boxcar") -> Any:
    def read(bench: TrueBench) -> float:
        from scipy.signal import get_window

        x = bench.sweep().degrees("alpha")
        return highest(np.arange(length) / (length * 0.002), np.abs(np.fft.fft(get_window(window, x.size) * x, length)))

    return read


def by_ratio(bench: TrueBench) -> float:
    response = identification.frequency_response(bench.sweep())
    return highest(response.f_hz, np.abs(response.ratio))


def by_resonance(bench: TrueBench) -> float:
    return identification.resonance(identification.frequency_response(bench.sweep())).value


def by_decrement(bench: TrueBench) -> float:
    return identification.logarithmic_decrement(bench.decay).omega_n.value


def swing(bench: TrueBench) -> Any:
    """The link's swing once the servo stands, about where it comes to rest."""
    theta, alpha = bench.decay["theta"], bench.decay["alpha"]
    moving = np.abs(theta - theta[-1]) > max(0.05 * np.ptp(theta), 0.1 * np.abs(alpha).max())
    return alpha[np.flatnonzero(moving)[-1] + 1 :] - np.median(alpha[-500:])


def by_counting(count: int) -> Any:
    def read(bench: TrueBench) -> float:
        x = swing(bench)
        x = x[x != 0]
        above = np.flatnonzero((x[:-1] < 0) & (x[1:] > 0))
        whole = swing(bench)
        at = np.flatnonzero(whole != 0)[above + 1]
        return float(HZ * count / ((at[count] - at[0]) * 0.002))

    return read


def by_four_with_the_first(bench: TrueBench) -> float:
    """While the servo still settles."""
    x = bench.decay["alpha"] - np.median(bench.decay["alpha"][-500:])
    above = np.flatnonzero((x[50:-1] < 0) & (x[51:] >= 0)) + 1
    return float(HZ * 4 / ((above[4] - above[0]) * 0.002))


def by_spectrum_of_swing(bench: TrueBench) -> float:
    return highest(np.fft.rfftfreq(2**15, 0.002), np.abs(np.fft.rfft(swing(bench) - swing(bench).mean(), 2**15)))


WAYS = {
    "no zeros": by_fft(7501),
    "a power of two": by_fft(8192),
    "twice that": by_fft(16384),
    "very fine": by_fft(2**17),
    "Hann": by_fft(8192, "hann"),
    "the ratio": by_ratio,
    "resonance": by_resonance,
    "logarithmic decrement": by_decrement,
    "five swings": by_counting(5),
    "four swings with the first": by_four_with_the_first,
    "the swing's spectrum": by_spectrum_of_swing,
}


@pytest.mark.parametrize("way", WAYS)
def test_a_reading_is_right_and_what_it_makes_of_the_stiffness(bench, way):
    read = WAYS[way](bench)
    for value in (read, float(f"{read:.3g}"), float(f"{read:.4g}")):
        assert omega(value, case(bench)).status is RIGHT
        K_s = bench.J_l * value**2
        assert stiffness(K_s, case(bench, omega_n=value, J_l=bench.J_l)).status is RIGHT
        rounded = stiffness(float(f"{K_s:.2g}"), case(bench, omega_n=value, J_l=bench.J_l))
        assert rounded.status is RIGHT


def test_a_logarithmic_decrement_is_right_also_where_friction_takes_it_far_from_the_true_frequency():
    bench = TrueBench("s212")
    read = by_decrement(bench)
    assert read > (1 + tolerances.NEAR_TRUE) * bench.omega_n
    assert {omega(value, case(bench)).status for value in (read, float(f"{read:.3g}"))} == {RIGHT}


def test_a_reading_by_eye_or_to_a_mark_of_the_axis_is_right_and_one_in_hertz_is_told(bench):
    read = WAYS["a power of two"](bench)
    values = [read * (1 + off) for off in (-0.0299, -0.02, -0.01, 0.01, 0.02, 0.0299)]
    values += [HZ * step * round(read / HZ / step) for step in (0.05, 0.1)]
    assert {omega(value, case(bench)).status for value in values} == {RIGHT}
    for found in (omega(read / HZ, case(bench)), stiffness(bench.K_s / HZ**2, case(bench))):
        assert found.status is WRONG and "Hz" in found.reason


@pytest.mark.parametrize("way", ["a power of two", "very fine", "the ratio"])
def test_two_digits_will_do_where_the_course_teaches_to_read(bench, way):
    read = float(f"{WAYS[way](bench):.2g}")
    assert omega(read, case(bench)).status is RIGHT
    K_s = float(f"{bench.J_l * read**2:.2g}")
    assert stiffness(K_s, case(bench, omega_n=read, J_l=bench.J_l)).status is RIGHT


@pytest.mark.parametrize(
    ("student", "rounded", "beside"), [("ada", 24.0, "Hann"), ("linus", 18.0, "five swings"), ("s2", 20.0, None)]
)
def test_two_digits_will_not_do_beside_a_window_a_free_swing_or_the_eyes_three_per_cent(student, rounded, beside):
    """Each is within half a digit of its reading, and of none that the course teaches."""
    bench = TrueBench(student)
    if beside is not None:
        assert abs(WAYS[beside](bench) - rounded) < 0.5
    taught = [bench.omega_n] + [WAYS[way](bench) for way in ("no zeros", "a power of two", "very fine", "the ratio")]
    assert all(abs(reading - rounded) > 0.5 for reading in taught)
    assert omega(rounded, case(bench)).status is WRONG


def test_the_ends_of_all_places_together_are_sharp(bench):
    places = list(readings.spans(bench, 1))
    low, high = min(place.low for place in places), max(place.high for place in places)
    for inside, outside in ((low * 1.0005, low * 0.9985), (high * 0.9995, high * 1.0015)):
        assert omega(inside, case(bench)).status is RIGHT
        assert omega(outside, case(bench)).status is WRONG


@pytest.mark.parametrize("student", [name for name in STUDENTS if BENCHES[name].omega_n < 26])
def test_the_peak_of_a_sweep_that_drives_the_motor_is_wrong(student):
    """Beyond, the sweep ends before that peak, and where it ends is nearly right."""
    from rotflex import experiments, hil

    with hil.open("virtual", seed=student_seed(student)) as opened:
        naive = experiments.sweep(opened, drive="voltage", progress=False).degrees("alpha")
    assert (
        omega(highest(np.fft.rfftfreq(8192, 0.002), np.abs(np.fft.rfft(naive, 8192))), case(BENCHES[student])).status
        is WRONG
    )


def test_a_reading_is_of_the_run_that_was_recorded():
    bench = BENCHES["ada"]

    def peaks(run):
        return [place.low for place in readings.of_sweep(bench, run, 0.0)]

    run = next(number for number in range(2, 9) if peaks(number) != peaks(1))
    recorded = [place.low for place in readings.spans(bench, run)]
    assert recorded != [place.low for place in readings.spans(bench, 1)]
    assert all(frequency_of(peak, case(bench, run=run)) is not None for peak in peaks(run))


def test_a_recording_that_names_no_run_that_there_is_changes_nothing():
    bench = BENCHES["ada"]
    for run in ("2", None, 10**9, -1, [1]):
        assert omega(bench.omega_n, case(bench, run=run)).status is RIGHT


def test_the_oddest_numbers_are_wrong_and_break_nothing(bench):
    for value in (0.0, -20.0, 1e300, -1e300, 5e-324):
        own = case(bench, omega_n=value, J_l=value)
        assert omega(value, own).status is stiffness(value, own).status is WRONG


def test_an_inertia_to_two_digits_is_right_and_the_stiffness_follows(bench):
    J_l, read = float(f"{bench.J_l:.2g}"), WAYS["very fine"](bench)
    own = case(bench, omega_n=0.7 * read, J_l=J_l)
    assert verdict("2.12", "J_l", J_l, own).status is RIGHT
    assert stiffness(J_l * (0.7 * read) ** 2, own).status is FOLLOWS


def test_where_both_are_wrong_nothing_follows(bench):
    own = case(bench, omega_n=0.7 * bench.omega_n, J_l=2.6 * bench.J_l)
    assert stiffness(2.6 * bench.J_l * (0.7 * bench.omega_n) ** 2, own).status is WRONG


def test_from_another_arms_inertia_nothing_follows_even_with_a_right_frequency(bench):
    others = (one.J_l for one in BENCHES.values() if abs(one.J_l / bench.J_l - 1) > 0.05)
    other = next(J_l for J_l in others if is_of_other_arms(J_l, bench))
    read = WAYS["very fine"](bench)
    found = stiffness(other * read**2, case(bench, omega_n=read, J_l=other))
    assert found.status is WRONG and "another arm's" in found.reason


def test_from_a_slip_in_ones_own_inertia_the_stiffness_follows_though_an_arm_may_have_it(bench):
    (low, high), read = tolerances.ARMS, WAYS["very fine"](bench)
    slips = [J_l for J_l in inertia_slips(bench).values() if low <= J_l <= high]
    assert slips
    for J_l in slips:
        assert stiffness(J_l * read**2, case(bench, omega_n=read, J_l=J_l)).share == 1


def test_a_stiffness_by_itself_is_right_to_half_a_bin():
    for bench in BENCHES.values():
        peaks = [WAYS[way](bench) for way in ("no zeros", "a power of two", "twice that", "very fine")]
        low, high = min(*peaks, bench.omega_n), max(*peaks, bench.omega_n)
        for share, status in ((0.98, RIGHT), (1.02, WRONG)):
            for edge, side in ((low, -1), (high, 1)):
                K_s = bench.J_l * (edge * (1 + side * share * tolerances.BIN)) ** 2
                assert stiffness(K_s, case(bench)).status is status


def test_half_a_digit_is_that_of_the_second():
    found = [readings.half_a_digit(value) for value in (23.0, 1.5, 0.0034, 20.0, 23.4, 0.0, math.nan)]
    assert found == pytest.approx([0.5, 0.05, 0.00005, 0.5, 0.0, 0.0, 0.0])
