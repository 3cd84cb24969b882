"""The check of the spectrum function: each of the three peaks counts, in every signal, by its place and its height."""

import numpy as np
import pytest

from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.probes import COMPOUND_SINES
from solutions.spectrum_checks import SpectrumFunction, _three_peaks

SEED = 11
SIGNALS = COMPOUND_SINES.inputs(SEED)
ON_BINS = [number for number, (x, _dt) in enumerate(SIGNALS) if x.size & (x.size - 1) == 0]


def honest():
    return [(np.fft.rfftfreq(x.size, dt), 2 * np.abs(np.fft.rfft(x)) / x.size) for x, dt in SIGNALS]


def verdict(value, **choices):
    return SpectrumFunction(**choices).verdict(None, value, Case(None, {}, SEED))


def around(number, peak):
    """Of a signal's peak: which values are near it, and the distance of two."""
    f, _amplitude = honest()[number]
    place = _three_peaks(*SIGNALS[number])[peak][0]
    return np.abs(f - place) < 0.3, f[1]


@pytest.mark.parametrize("peak", [0, 1, 2])
@pytest.mark.parametrize("number", range(len(SIGNALS)))
def test_one_peak_of_several_in_another_place_or_missing_is_wrong(number, peak):
    value = honest()
    near, bin_width = around(number, peak)
    for bins, status in ((0, Status.RIGHT), (2, Status.WRONG)):
        f, amplitude = honest()[number]
        amplitude[near] = 0.0
        place = _three_peaks(*SIGNALS[number])[peak][0]
        amplitude[np.argmin(np.abs(f - place)) + bins] = honest()[number][1][near].max()
        value[number] = f, amplitude
        assert verdict(value).status is status, bin_width
    f, amplitude = honest()[number]
    value[number] = f[~near], amplitude[~near]
    assert verdict(value).status is Status.WRONG


@pytest.mark.parametrize("peak", [0, 1, 2])
@pytest.mark.parametrize("number", ON_BINS)
@pytest.mark.parametrize(
    ("factor", "status"), [(1.049, "right"), (1.051, "partly right"), (0.951, "right"), (0.949, "partly right")]
)
def test_one_peak_of_several_that_is_too_high_or_too_low_costs_half(number, peak, factor, status):
    value = honest()
    f, amplitude = value[number]
    near, _bin_width = around(number, peak)
    value[number] = f, np.where(near, factor, 1.0) * amplitude
    found = verdict(value, rtol=0.05)
    assert found.status.value == status
    assert found.share == (1.0 if status == "right" else 0.5)


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        (lambda x: 0.5, "the other half is at the negative frequencies"),
        (lambda x: x.size, "too high by the number of samples"),
        (lambda x: x.size / 2, "by half the number of samples"),
        (lambda x: 1.7, "by the same factor"),
        (lambda x: x.size**2, "not their amplitudes"),
    ],
)
def test_heights_that_are_wrong_in_one_way_are_told_which(factors, words):
    value = [(f, amplitude * factors(x)) for (f, amplitude), (x, _dt) in zip(honest(), SIGNALS, strict=True)]
    found = verdict(value)
    assert (found.status, found.share) == (Status.PARTLY, 0.5) and words in found.reason


@pytest.mark.parametrize("window", [np.ones, np.hanning])
@pytest.mark.parametrize("zeros", [0, 692, 8884, 123572])
def test_between_bins_a_height_is_that_of_the_method_and_divided_by_the_samples_without_zeros(zeros, window):
    def answer(by_all):
        for x, dt in SIGNALS:
            length = x.size + zeros
            amplitude = 2 * np.abs(np.fft.rfft(window(x.size) * x, length)) / window(x.size).sum()
            yield np.fft.rfftfreq(length, dt), amplitude * (x.size / length if by_all else 1)

    assert verdict(list(answer(by_all=False))).status is Status.RIGHT
    assert verdict(list(answer(by_all=True))).share == (0.5 if zeros else 1)


def test_who_divides_by_the_padded_length_is_told():
    value = []
    for x, dt in SIGNALS:
        length = 2 ** int(np.ceil(np.log2(x.size)))
        value.append((np.fft.rfftfreq(length, dt), 2 * np.abs(np.fft.rfft(x, length)) / length))
    found = verdict(value)
    assert (found.status, found.share) == (Status.PARTLY, 0.5) and "zeros are appended" in found.reason
