"""Figures of a recording and of its spectrum, plotted in the ways that students plot, rightly and wrongly."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from labcourse.answers import forms
from labcourse.grading.marking.figure_checks import FigureFollows, FigureOfSpectrum
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.questions import CATALOGUE
from rotflex.recording import Recording
from solutions.key import KEY
from solutions.quantities import ANGLE, FREQUENCY
from solutions.true_bench import TrueBench

PLOT, SPECTRUM = (CATALOGUE.find(number).part("figure") for number in ("2.9", "2.10"))
OWN = ("2.9", "sweep")
BENCH = TrueBench("ada")


def stored(part, figure):
    return forms.decode(part, forms.encode(part, figure, 1).content)


def case(own=None, bench=BENCH):
    answers = {} if own is None else {OWN: own}
    return Case(bench, lambda question, part: answers[question, part], 7, True)


def judged(check, part, figure, own=None, bench=BENCH):
    return check.verdict(part, stored(part, figure), case(own, bench))


def plotted(x, y, xlabel="time (s)", ylabel="alpha (deg)", draw="plot", **limits):
    figure = Figure()
    ax = figure.subplots()
    getattr(ax, draw)(x, y)
    ax.set(xlabel=xlabel, ylabel=ylabel, **limits)
    return figure


SWEEP = BENCH.sweep()
T, DEGREES, RADIANS = SWEEP.time, SWEEP.degrees("alpha"), SWEEP["alpha"]
SHUFFLED = np.random.default_rng(1).permutation(T.size)
PADDING = 1500


def with_others(many):
    figure = plotted(T, DEGREES)
    for place in range(many):
        figure.axes[0].plot(T, SWEEP.degrees("theta") + place)
    return figure


def in_pieces(count, xlabel="time (s)"):
    figure = Figure()
    ax = figure.subplots()
    for piece in np.array_split(np.arange(T.size), count):
        ax.plot(T[piece], DEGREES[piece])
    ax.set(xlabel=xlabel, ylabel="alpha (deg)")
    return figure


def on_a_twin():
    figure = plotted(T, SWEEP.degrees("theta"), ylabel="theta (deg)")
    other = figure.axes[0].twinx()
    other.plot(T, RADIANS)
    other.set_ylabel("alpha (rad)")
    return figure


def below_another():
    figure = Figure()
    upper, lower = figure.subplots(2, 1)
    upper.plot(T, DEGREES)
    lower.plot(T, SWEEP.degrees("theta"))
    upper.set_ylabel("alpha (deg)")
    lower.set(xlabel="time (s)", ylabel="theta (deg)")
    return figure


def some(count):
    return np.sort(np.random.default_rng(2).choice(T.size, count, replace=False))


RIGHTLY = {
    "s and deg": lambda: plotted(T, DEGREES),
    "ms": lambda: plotted(1e3 * T, DEGREES, "t / ms"),
    "rad": lambda: plotted(T, RADIANS, ylabel="alpha in rad"),
    "limits about the resonance": lambda: plotted(T, DEGREES, xlim=(3, 12)),
    "a window with its own time in ms": lambda: plotted(1e3 * (T[1500:6500] - T[1500]), DEGREES[1500:6500], "t (ms)"),
    "time from -0.5 s": lambda: plotted(T - 0.5, DEGREES),
    "constant before 0 and after the end": lambda: plotted(
        np.arange(-PADDING, T.size + PADDING) * 0.002, np.pad(DEGREES, PADDING, mode="edge")
    ),
    "padded with zeros": lambda: plotted(np.arange(16384) * 0.002, np.pad(DEGREES, (0, 16384 - T.size))),
    "every tenth sample": lambda: plotted(T[::10], DEGREES[::10]),
    "25 points with markers": lambda: plotted(T[some(25)], DEGREES[some(25)]),
    "unsorted": lambda: plotted(T[SHUFFLED], DEGREES[SHUFFLED]),
    "scattered": lambda: plotted(T, DEGREES, draw="scatter"),
    "stem": lambda: plotted(T[::50], DEGREES[::50], draw="stem"),
    "offset": lambda: plotted(T, DEGREES + 3),
    "among 15 others": lambda: with_others(15),
    "in 20 pieces": lambda: in_pieces(20),
    "on a twin axis in rad": on_a_twin,
    "above another, one label for both": below_another,
}  # fmt: skip


@pytest.mark.parametrize("how", RIGHTLY)
def test_the_own_recording_plotted_rightly_has_full_marks_too(how):
    """On a bench where it is another's, from the few samples that are kept of it."""
    own = forms.decode(SWEEP_PART, forms.encode(SWEEP_PART, SWEEP, 1).content)
    verdict = judged(KEY["2.9"]["figure"], PLOT, RIGHTLY[how](), own, OTHER)
    assert verdict.status is Status.FOLLOW_THROUGH, verdict.reason


@pytest.mark.parametrize(("room", "status"), [(1.01, Status.FOLLOW_THROUGH), (0.99, Status.WRONG)])
def test_an_own_recording_of_what_no_bench_reaches_is_not_followed(room, status):
    own = forms.decode(SWEEP_PART, forms.encode(SWEEP_PART, SWEEP, 1).content)
    largest = room * np.abs(own["channels"]["alpha"]["values"]).max()
    check = replace(KEY["2.9"]["figure"], largest=largest)
    assert judged(check, PLOT, plotted(T, DEGREES), own, OTHER).status is status


SWEEP_PART = CATALOGUE.find("2.9").part("sweep")
OTHER = next(one for one in map(TrueBench, ("bob", "cy", "di", "eve")) if abs(one.omega_n / BENCH.omega_n - 1) > 0.1)
OTHERS_DEGREES = OTHER.sweep().degrees("alpha")
HALF, NOTHING = 0.5, 0.0

WRONGLY = {
    "no labels": (lambda: plotted(T, DEGREES, "", ""), HALF, "lacks its unit: write a symbol"),
    "no unit of the angle": (lambda: plotted(T, DEGREES, ylabel="alpha"), HALF, "vertical axis lacks its unit"),
    "s said, ms drawn": (lambda: plotted(1e3 * T, DEGREES), HALF, "says s, and the curve is in ms"),
    "deg said, rad drawn": (lambda: plotted(T, RADIANS), HALF, "says deg, and the curve is in rad"),
    "rad, mrad drawn": (lambda: plotted(T, 1e3 * RADIANS, ylabel="α (rad)"), HALF, "the curve is in mrad"),
    "volts said": (lambda: plotted(T, DEGREES, ylabel="alpha (V)"), HALF, "names no unit that is known for it"),
    "samples": (lambda: plotted(np.arange(T.size), DEGREES, "time (samples)"), HALF, "number of the sample"),
    "samples said to be s": (lambda: plotted(np.arange(T.size), DEGREES), HALF, "number of the sample"),
    "another channel": (lambda: plotted(T, SWEEP.degrees("theta")), NOTHING, "No curve in the figure follows alpha"),
    "upside down": (lambda: plotted(T, -DEGREES), NOTHING, "upside down"),
    "too large": (lambda: plotted(T, 1.37 * DEGREES), NOTHING, "No curve"),
    "flat": (lambda: plotted(T, 0 * T), NOTHING, "No curve"),
    "the first 4 s": (lambda: plotted(T, DEGREES, xlim=(0, 4)), NOTHING, "over too short a time"),
    "a strip about 0": (lambda: plotted(T, DEGREES, ylim=(-0.2, 0.2)), NOTHING, "hardly anything happens"),
    "another bench's": (lambda: plotted(T, OTHERS_DEGREES), NOTHING, "Plot the recording of your bench"),
    "10 points": (lambda: plotted(T[::750], DEGREES[::750]), NOTHING, "No curve"),
}  # fmt: skip


def spectrum(y, padded=8192, window=1.0):
    f = np.fft.rfftfreq(padded, 0.002)
    return f, 2 * np.abs(np.fft.rfft(window * (y - y.mean()), padded)) / y.size


def shown(to_x=lambda f: f, to_y=lambda a: a, xlabel="f (Hz)", ylabel="amplitude (deg)", y=DEGREES, most=10, **how):
    f, amplitude = spectrum(y)
    part = (f > 0) & (f <= most)
    return plotted(to_x(f[part]), to_y(amplitude[part]), xlabel, ylabel, **how)


SPECTRUM_RIGHTLY = {
    "Hz": shown,
    "rad/s": lambda: shown(lambda f: 2 * np.pi * f, xlabel="ω (rad/s)"),
    "dB": lambda: shown(to_y=lambda a: 20 * np.log10(a), ylabel="amplitude (dB)"),
    "dB of the power, no unit below": lambda: shown(to_y=lambda a: 10 * np.log10(a**2), ylabel="power [dB re 1 deg²]"),
    "power": lambda: shown(to_y=lambda a: a**2, ylabel="power (deg²)"),
    "rad": lambda: shown(y=RADIANS, ylabel="amplitude (rad)"),
    "not divided": lambda: shown(to_y=lambda a: a * 7501 / 2, ylabel="|FFT|"),
    "logarithmic": lambda: shown(most=250, draw="loglog", xlim=(0.5, 20)),
    "limits about the peak": lambda: shown(most=250, xlim=(BENCH.omega_n / 7, BENCH.omega_n / 5.5)),
    "all of it": lambda: shown(most=250),
    "stems": lambda: shown(draw="stem"),
}  # fmt: skip


SPECTRUM_WRONGLY = {
    "no unit": (lambda: shown(xlabel="frequency"), HALF, "horizontal axis lacks its unit: write a symbol"),
    "an unknown unit": (lambda: shown(xlabel="f (bins)"), HALF, "names no unit that is known"),
    "no vertical label": (lambda: shown(ylabel=""), HALF, "the vertical axis has no label"),
    "dB that are not named": (lambda: shown(to_y=lambda a: 20 * np.log10(a)), HALF, "write dB"),
    "Hz said, rad/s drawn": (lambda: shown(lambda f: 2 * np.pi * f), NOTHING, "says Hz, and the curve is in rad/s"),
    "rad/s said, Hz drawn": (lambda: shown(xlabel="ω (rad/s)"), NOTHING, "says rad/s, and the curve is in Hz"),
    "stretched": (lambda: shown(lambda f: 1.2 * f), NOTHING, "No curve in the figure has its peak where"),
    "another bench's": (lambda: shown(y=OTHERS_DEGREES), NOTHING, "No curve"),
    "the peak out of sight": (lambda: shown(most=250, xlim=(BENCH.omega_n / 5.5, 20)), NOTHING, "its peak in sight"),
    "the recording": (lambda: plotted(T, DEGREES, "f (Hz)"), NOTHING, "No curve"),
    "flat": (lambda: shown(to_y=lambda a: 0 * a), NOTHING, "No curve"),
}  # fmt: skip


PARTS = {"2.9": PLOT, "2.10": SPECTRUM}


@pytest.mark.parametrize(
    ("number", "draw"),
    [*(("2.9", one) for one in RIGHTLY.values()), *(("2.10", one) for one in SPECTRUM_RIGHTLY.values())],
    ids=[*RIGHTLY, *SPECTRUM_RIGHTLY],
)
def test_a_figure_plotted_rightly_has_full_marks(number, draw):
    verdict = judged(KEY[number]["figure"], PARTS[number], draw())
    assert verdict.status is Status.RIGHT, verdict.reason


@pytest.mark.parametrize(
    ("number", "how"),
    [*(("2.9", one) for one in WRONGLY.values()), *(("2.10", one) for one in SPECTRUM_WRONGLY.values())],
    ids=[*WRONGLY, *SPECTRUM_WRONGLY],
)
def test_a_figure_plotted_wrongly_earns_what_it_shows_and_the_reason_is_told(number, how):
    draw, share, reason = how
    verdict = judged(KEY[number]["figure"], PARTS[number], draw())
    assert verdict.share == share, verdict.reason
    assert reason in verdict.reason


EVEN = np.arange(7501) * 0.002  # 15 s
WAVE = np.sin(2 * np.pi * EVEN) + 0.3 * np.sin(2 * np.pi * 0.31 * EVEN)


def made(values=WAVE, time=EVEN):
    return Recording.of(time, alpha=values)


def follows(figure, recording):
    return judged(FigureFollows(lambda bench: recording, OWN, "alpha", ANGLE), PLOT, figure)


@pytest.mark.parametrize(
    ("off", "status"), [(0.098, Status.RIGHT), (-0.098, Status.RIGHT), (0.102, Status.WRONG), (-0.102, Status.WRONG)]
)
def test_a_curve_follows_within_ten_per_cent(off, status):
    assert follows(plotted(EVEN, (1 + off) * WAVE, ylabel="(rad)"), made()).status is status


@pytest.mark.parametrize(("share", "status"), [(0.5, Status.RIGHT), (0.48, Status.WRONG)])
@pytest.mark.parametrize("start", [0, 2000])
def test_half_of_the_recording_is_enough(share, status, start):
    part = slice(start, start + round(7500 * share) + 1)
    assert follows(plotted(EVEN[part], WAVE[part], ylabel="(rad)"), made()).status is status
    assert follows(plotted(EVEN[part] - EVEN[start], WAVE[part], ylabel="(rad)"), made()).status is status


@pytest.mark.parametrize(("share", "status"), [(0.255, Status.RIGHT), (0.245, Status.WRONG)])
def test_a_quarter_of_the_swing_is_to_be_seen(share, status):
    wave = np.where(EVEN < 8, share, 1.0) * np.sin(2 * np.pi * EVEN)
    verdict = follows(plotted(EVEN, wave, ylabel="(rad)", xlim=(0, 7.9)), made(wave))
    assert verdict.status is status
    assert ("hardly anything" in verdict.reason) is (status is Status.WRONG)


@pytest.mark.parametrize(("points", "status"), [(20, Status.RIGHT), (19, Status.WRONG)])
def test_twenty_points_are_a_curve(points, status):
    which = np.linspace(0, 7500, points).astype(int)
    assert follows(plotted(EVEN[which], WAVE[which], ylabel="(rad)"), made()).status is status


def peaked(place, width=0.3, spacing=0.004):
    """A curve with its peak at a place, and of no spectrum's shape."""
    f = place + spacing * np.arange(-90, 91)
    return plotted(f, np.maximum(0, 1 - np.abs(f - place) / width), "f (Hz)", "amplitude (rad)")


def shows_spectrum(figure, recording):
    return judged(FigureOfSpectrum(lambda bench: recording, OWN, "alpha", FREQUENCY, band=(1.0, 5.0)), SPECTRUM, figure)


@pytest.mark.parametrize(
    ("off", "status"), [(0.049, Status.RIGHT), (-0.049, Status.RIGHT), (0.051, Status.WRONG), (-0.051, Status.WRONG)]
)
def test_a_peak_is_in_its_place_within_five_per_cent(off, status):
    sine = made(np.sin(2 * np.pi * 3 * EVEN))
    assert shows_spectrum(peaked(3 * (1 + off)), sine).status is status


@pytest.mark.parametrize("check", [KEY["2.9"]["figure"], KEY["2.10"]["figure"]], ids=["recording", "spectrum"])
@pytest.mark.parametrize(
    "x", [np.zeros(200), np.linspace(0, 1e307, 200), np.linspace(-1e307, 1e307, 200), np.linspace(0, 15, 200)]
)
@pytest.mark.parametrize("y", [np.zeros(200), np.linspace(-1e307, 1e307, 200), np.full(200, 1e-320)])
def test_any_numbers_are_only_wrong(check, x, y):
    line = {"label": "", "n": 200, "x": x, "y": y}
    label = "(s), (ms), (min), (Hz), (rad/s), (deg), (rad), (10^99 rad), (10^-99 s) dB"
    figure = {"axes": [{"title": "", "xlabel": label, "ylabel": label, "lines": [line] * 24}] * 2}
    with np.errstate(all="ignore"):  # as in marking
        assert check.verdict(PLOT, figure, case()).share == 0
